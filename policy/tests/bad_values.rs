//! Values of policy.toml that cannot work: actions, limits, ADC, filters, activations.

mod common;
use common::*;

#[test]
fn an_unsupported_numeric_format_lists_what_is() {
    contract_fault(
        "sample_period = 1e-4",
        "sample_period = 1e-4\nnumeric_format = ¦\"i4\"",
        &["not supported yet", "\"i4\"", "supported: f32, f32-fma, f64, i16, i8"],
    );
}

#[test]
fn actions_are_two_to_256_duties_or_pairs() {
    contract_fault("[0.44, 0.50, 0.56]", "¦[]", &["too few actions", "0", "2 to 256"]);
    let faults = Folder::new().replace("[0.44, 0.50, 0.56]", "[0.5]").faults();
    assert_says(&faults.faults.list[0], &["too few actions", "1", "2 to 256"]);
    let many = format!("[{}]", vec!["0.5"; 257].join(", "));
    let faults = Folder::new().replace("[0.44, 0.50, 0.56]", &many).faults();
    assert_says(&faults.faults.list[0], &["too many actions", "257"]);
    contract_fault(
        "[actions]\n",
        "¦[actions]\npairs = []\n",
        &["exactly one of `duties`, `pairs`, `offsets`, `continuous`", "2"],
    );
}

#[test]
fn pairs_give_duties_pair_by_pair() {
    let policy = Folder::new()
        .replace("duties = [0.44, 0.50, 0.56]", "pairs = [{ xi = 0.5, phi = 0.05 }]")
        .policy();
    let duties: Vec<f64> = policy.actions().iter().map(|action| action.duty).collect();
    assert_eq!(duties, [0.5 - 0.05, 0.5, 0.5 + 0.05]);
    assert_eq!(policy.actions()[2].pair.map(|pair| pair.c), Some(1));
    let pairs = |text: &str| format!("pairs = [{text}]");
    let duties = "duties = [0.44, 0.50, 0.56]";
    contract_fault(
        duties,
        &pairs("¦{ xi = 0.98, phi = 0.05 }"),
        &["xi + c phi with c = 1", "1.03"],
    );
    contract_fault(
        duties,
        &pairs("{ xi = 0.5, phi = 0.05, c = [¦2, 0, 1] }"),
        &["`c`", "-1 to 1"],
    );
    contract_fault(duties, &pairs("{ xi = 0.5, phi = 0.05, c = [1, ¦1] }"), &["1 twice"]);
    contract_fault(duties, &pairs("¦{ phi = 0.05 }"), &["`xi` is missing"]);
}

const DUTIES: &str = "duties = [0.44, 0.50, 0.56]";

#[test]
fn a_continuous_head_says_what_is_wrong_with_it() {
    let wrong = |entry: &str, says: &[&str]| contract_fault(DUTIES, &format!("continuous = {entry}"), says);
    wrong(
        "¦{ scale = 0.4 }",
        &["exactly one of `squash`, `clip`", "(hi - lo) / 2"],
    );
    wrong(
        "¦{ squash = \"tanh\", clip = [0.1, 0.9] }",
        &["exactly one of `squash`, `clip`", "2"],
    );
    wrong(
        "{ squash = ¦\"relu\", scale = 0.4, offset = 0.5 }",
        &["`squash`", "tanh, softsign"],
    );
    wrong(
        "{ squash = \"tanh\", scale = ¦0.0, offset = 0.5 }",
        &["`scale`", "one duty"],
    );
    wrong("{ clip = ¦[0.9, 0.1] }", &["0.9", "0.1"]);
    wrong("{ clip = [0.1, 0.9], ¦ofset = 0.1 }", &["ofset"]);
    // a tanh of -1 to 1 is no duty as it is
    wrong(
        "¦{ squash = \"tanh\" }",
        &["not a duty ratio", "-1", "0 to 1", "(hi + lo) / 2"],
    );
    wrong(
        "¦{ squash = \"tanh\", scale = 0.5, offset = 0.6 }",
        &["not a duty ratio", "1.1"],
    );
    wrong(
        "¦{ clip = [-1.0, 1.0], scale = 0.4, offset = 0.3 }",
        &["not a duty ratio"],
    );
    // 0.5 is the number, not the table
    contract_fault(DUTIES, "continuous = ¦0.5", &["continuous"]);
}

#[test]
fn the_ends_of_a_continuous_head_are_held_within_0_and_1_in_both_arithmetics() {
    let entry = "continuous = { squash = \"tanh\", scale = 0.45, offset = 0.5500000003 }";
    let faults = Folder::new().replace(DUTIES, entry).faults();
    assert_says(&faults.faults.list[0], &["not a duty ratio"]);
    // refused by binary64 alone: in binary32 the sum is 1
    assert_eq!(0.45_f32 + 0.550_000_000_3_f64 as f32, 1.0);
}

#[test]
fn a_network_of_several_outputs_is_no_continuous_head() {
    let faults = Folder::new()
        .replace(DUTIES, "continuous = { squash = \"tanh\", scale = 0.4, offset = 0.5 }")
        .faults();
    let said = faults.to_string();
    assert!(said.contains("3"), "{said}");
}

#[test]
fn limits_slew_and_soft_start_must_work_in_f32() {
    contract_fault("initial_duty = 0.5", "slew = ¦0.0", &["`slew`", "1.2e-7"]);
    // a smaller step is lost in the rounding of a duty near 1
    contract_fault("initial_duty = 0.5", "slew = ¦1e-9", &["`slew`", "would not move"]);
    contract_fault("initial_duty = 0.5", "slew = ¦1e-50", &["`slew`"]);
    contract_fault(
        "initial_duty = 0.5",
        "soft_start = { from = ¦0.7, steps = 10 }",
        &["`from` lies outside", "0.7", " | 0 to 0.6"],
    );
    contract_fault(
        "initial_duty = 0.5",
        "soft_start = ¦{ from = 0.59, steps = 1000000 }",
        &["too slow for f32", "fewer steps"],
    );
    contract_fault(
        "initial_duty = 0.5",
        "soft_start = { from = 0.1, steps = ¦0 }",
        &["`steps`", "1 to 1000000"],
    );
    let policy = Folder::new()
        .replace(
            "initial_duty = 0.5",
            "slew = 0.01\nsoft_start = { from = 0.1, steps = 100 }",
        )
        .policy();
    assert_eq!(policy.limits.initial_duty, 0.0, "the fallback duty by default");
    assert_eq!(policy.limits.soft_start.map(|soft| soft.steps), Some(100));
}

/// `v_out` is plausible from 0 to 250 V.
#[test]
fn a_converter_of_which_little_is_used_is_noted() {
    let unit = "unit = \"V\"\n";
    let notes = |adc: &str| {
        let folder = Folder::new().replace(unit, &format!("{unit}adc = {adc}\n"));
        let notes = folder.policy().notes.into_iter();
        notes
            .filter(|note| note.contains("is the gain right"))
            .collect::<Vec<_>>()
    };
    assert!(notes("{ gain = 0.0625, offset = 0.0, bits = 12 }").is_empty());
    let far = notes("{ gain = 0.625, offset = 0.0, bits = 12 }").concat();
    assert!(
        far.contains("0 to 250 V takes 400 of the 4096 codes") && far.contains("one code is 0.625 V"),
        "{far}"
    );
    // 512 codes of 4096 are an eighth
    assert!(notes("{ gain = 0.488, offset = 0.0, bits = 12 }").is_empty());
    assert!(notes("{ gain = 0.625, offset = 0.0 }").is_empty());
    assert!(
        notes("{ gain = -2.5, offset = 250.0 }")
            .concat()
            .contains("has 100 codes alone")
    );
}

#[test]
fn adc_codes_must_be_able_to_say_the_range() {
    let unit = "unit = \"V\"\n";
    let with = |adc: &str| format!("{unit}adc = {adc}\n");
    contract_fault(
        unit,
        &with("{ gain = ¦0.0, offset = 0.0 }"),
        &["`gain`", "other than 0"],
    );
    contract_fault(
        unit,
        &with("¦{ gain = 1e-6, offset = 0.0 }"),
        &["`v_out`", "250000000", "16777216"],
    );
    contract_fault(unit, &with("¦{ gain = 0.1 }"), &["`offset` is missing in adc"]);
    // 0.05 * 4095 = 204.75 V, and 250 V are plausible
    contract_fault(
        unit,
        &with("{ gain = 0.05, offset = 0.0, bits = ¦12 }"),
        &["end of its codes", "204.75", "stuck at its end"],
    );
    // 20 V: a policy that reads 250 V is not made for this divider, and a shorter range would not mend that
    contract_fault(
        unit,
        &with("{ gain = 0.005, offset = 0.0, bits = ¦12 }"),
        &["end of its codes", "20.475", "far inside of the range", "divider"],
    );
    // 255 V; a range with half as much room is still that of this divider, and one with more is not
    for (end, says) in [
        ("382.5", "let the range end at 254"),
        ("383.0", "far inside of the range"),
    ] {
        let faults = Folder::new()
            .replace("[0.0, 250.0]", &format!("[0.0, {end}]"))
            .replace(unit, &with("{ gain = 1.0, offset = 0.0, bits = 8 }"))
            .faults();
        assert_says(&faults.faults.list[0], &["255 at that code", says]);
    }
    // code 0 is -0.5 A where -1 A is plausible, and the last code, 40.45 A, is not
    contract_fault(
        "unit = \"A\"",
        "unit = \"A\"\nadc = { gain = 0.01, offset = -0.5, bits = ¦12 }",
        &["end of its codes", "-0.5 at that code", "far inside of the range"],
    );
    // -0.0625 * 4095 + 250 = -5.9 V is not plausible, but the first code, 250 V, is
    contract_fault(
        unit,
        &with("{ gain = -0.0625, offset = 250.0, bits = ¦12 }"),
        &["end of its codes", "250 at that code"],
    );
    contract_fault(
        unit,
        &with("{ gain = -0.0625, offset = 0.0, bits = ¦12 }"),
        &["no two codes", "-255.9375 to 0"],
    );
    contract_fault(
        unit,
        &with("{ gain = 0.0625, offset = 0.0, bits = ¦25 }"),
        &["`bits`", "1 to 24"],
    );
    // 0.0625 * 4095 = 255.9 V
    let policy = Folder::new()
        .replace(unit, &with("{ gain = 0.0625, offset = 0.0, bits = 12 }"))
        .policy();
    assert!(policy.signals[0].adc.is_some());
    let policy = Folder::new()
        .replace(unit, &with("{ gain = -0.0625, offset = 0.5 }"))
        .policy();
    assert_eq!(
        policy.signals[0].adc.map(|adc| (adc.gain, adc.offset)),
        Some((-0.0625, 0.5))
    );
}

#[test]
fn filters_are_checked_one_by_one() {
    let with = |filter: &str| format!("[{filter}]");
    let one = "[{ delay = 1 }]";
    contract_fault(
        one,
        &with("{ ¦dely = 1 }"),
        &["unknown key `dely`", "did you mean `delay`?"],
    );
    contract_fault(
        one,
        &with("{ ¦cutoff = 500.0 }"),
        &["unknown key `cutoff`", "{ low_pass = { cutoff = ... } }"],
    );
    contract_fault(one, &with("¦{ delay = 1, moving_average = 2 }"), &["exactly one", "2"]);
    contract_fault(
        one,
        &with("¦\"backward_diference\""),
        &["did you mean \"backward_difference\"?"],
    );
    contract_fault(
        one,
        &with("{ low_pass = { time_constant = ¦-1.0 } }"),
        &["time constant", "-1"],
    );
    contract_fault(
        one,
        &with("{ low_pass = { time_constant = ¦1e3 } }"),
        &["1e6 sample periods"],
    );
    contract_fault(
        one,
        &with("{ low_pass = ¦{} }"),
        &["exactly one of time_constant, cutoff | 0 | 1"],
    );
    contract_fault(one, &with("{ low_pass = { cutoff = ¦0 } }"), &["greater than 0"]);
    contract_fault(one, &with("{ integrator = ¦{ min = 1.0, max = -1.0 } }"), &["crossed"]);
    contract_fault(
        one,
        &with("{ integrator = { min = 1.0, max = 2.0, initial = ¦0.5 } }"),
        &["outside the integrator's clamps"],
    );
    for leak in ["0.0", "-0.5", "1.001"] {
        contract_fault(
            one,
            &with(&format!(
                "{{ integrator = {{ min = -1.0, max = 1.0, leak = ¦{leak} }} }}"
            )),
            &["leak", "above 0 and at most 1"],
        );
    }
    contract_fault(one, &with("{ moving_average = ¦1 }"), &["2 to 256"]);
    let nine = ["{ delay = 1 }"; 9].join(", ");
    contract_fault(one, &format!("¦[{nine}]"), &["too many filters", "9"]);
}

#[test]
fn all_filters_of_the_contract_are_read() {
    use policy::Filter::*;
    let text = "[{ delay = 2 }, \"backward_difference\", { backward_difference = true }, { low_pass = { cutoff = 100.0 } }, \
        { filtered_derivative = { time_constant = 1e-3 } }, { moving_average = 4 }, { integrator = { min = -1, max = 1 } }, \
        { integrator = { min = -1, max = 1, leak = 0.998 } }]";
    let policy = Folder::new().replace("[{ delay = 1 }]", text).policy();
    let tau = 1.0 / (2.0 * std::f64::consts::PI * 100.0);
    assert_eq!(
        policy.features[1].filters,
        [
            Delay { samples: 2 },
            BackwardDifference,
            BackwardDifference,
            LowPass { time_constant: tau },
            FilteredDerivative { time_constant: 1e-3 },
            MovingAverage { samples: 4 },
            Integrator {
                min: -1.0,
                max: 1.0,
                initial: 0.0,
                leak: 1.0
            },
            Integrator {
                min: -1.0,
                max: 1.0,
                initial: 0.0,
                leak: 0.998
            }
        ]
    );
}

#[test]
fn activations_are_never_guessed() {
    use policy::Activation::*;
    contract_fault(
        "\"relu\"",
        "¦\"ReLU\"",
        &["hidden_activation", "\"ReLU\"", "did you mean \"relu\"?"],
    );
    let words: Vec<&str> = policy::Activation::plain().map(policy::Activation::word).collect();
    contract_fault("\"relu\"", "¦\"swoosh\"", &["\"swoosh\"", &words.join(", ")]);
    contract_fault("\"relu\"", "¦[\"relu\", \"relu\"]", &["2", "1, one per hidden layer"]);
    contract_fault("\"relu\"", "{ leaky_relu = ¦1.0 }", &["less than 1"]);
    contract_fault("\"relu\"", "¦\"leaky_relu\"", &["{ leaky_relu = 0.01 }"]);
    let with = |text: &str| Folder::new().replace("\"relu\"", text).policy().layers[0].activation;
    assert_eq!(with("{ leaky_relu = 0.01 }"), LeakyRelu { slope: 0.01 });
    assert_eq!(with("[\"tanh\"]"), Tanh);
    let single = Folder::new()
        .replace("hidden_activation = \"relu\"\n", "")
        .tensors(&dense("out", 3, 2))
        .policy();
    assert_eq!(single.layers[0].activation, Identity);
}

#[test]
fn a_feature_that_could_overflow_is_named() {
    let folder = Folder::new().replace("scale = 0.2\nclip = [-20.0, 20.0]", "scale = 1e37");
    assert_says(&folder.fault(), &["feature `e` could leave the range of f32", "narrow"]);
}

/// Codes are whole numbers of binary32 up to 2^24, which is one itself.
#[test]
fn the_largest_code_is_taken_and_the_next_one_is_not() {
    let unit = "unit = \"V\"\nrange = [0.0, 250.0]";
    let with = |high: &str| {
        let adc = format!("unit = \"V\"\nadc = {{ gain = 1.0, offset = 0.0 }}\nrange = [0.0, {high}]");
        // the clip keeps the network's inputs where they were
        Folder::new().replace(unit, &adc)
    };
    let policy = with("16777216.0").policy();
    assert_eq!(policy.signals[0].range.high, 16_777_216.0);
    let fault = with("16777218.0").fault();
    assert_says(&fault, &["16777218"]);
}

/// A time constant may be a million periods, and no more.
#[test]
fn the_longest_time_constant_is_taken() {
    let folder = |seconds: f64| {
        let filters = format!("filters = [{{ low_pass = {{ time_constant = {seconds:?} }} }}]");
        Folder::new().replace("filters = [{ delay = 1 }]", &filters)
    };
    let longest = 1e-4 * 1e6;
    assert!(folder(longest).load().is_ok());
    assert_says(&folder(longest + 1e-9).fault(), &["the time constant is out of range"]);
}
