//! From a plant file alone: what is possible (`limit`), and what a training starts from (`new --plant`).

use super::Desk;

/// A synchronous converter from 48 V to 12 V at 200 kHz.
const PLANT: &str = "[converter]
v_in = 48.0
inductance = 10e-6
capacitance = 220e-6
f_sw = 200e3
rectifier = \"synchronous\"
[pwm]
duty_delay = 1
";

/// The numbers of a line behind its first column.
fn numbers(line: &str) -> Vec<f64> {
    line[17..]
        .split([' ', '/', '>'])
        .filter_map(|word| word.parse().ok())
        .collect()
}

#[test]
fn a_limit_is_that_of_the_circuit_and_of_the_duties() {
    let desk = Desk::new("linear");
    desk.write("plant.toml", PLANT);
    let said = desk.succeed("limit plant.toml --v-ref 12 --load-step 20,120 --load-step 120,20 --current-step 1,2");
    let row = |start: &str| {
        numbers(
            said.lines()
                .find(|line| line.starts_with(start))
                .unwrap_or_else(|| panic!("{said}")),
        )
    };
    // 8.3 A less: 12 V / 10 uH take 6.94 us to bring them down, with what came before the sample and the delay of a period,
    // 5 us each: charge / C = 8.33 A (5 us + 5 us + 6.94 us / 2) / 220 uF
    let down = row("120 -> 20 W");
    let charge = 8.33 * (5e-6 + 5e-6 + 6.94e-6 / 2.0) / 220e-6;
    assert!((down[1] - charge).abs() < 0.2 * charge, "{down:?}, about {charge}");
    assert!(
        down[0] < down[1],
        "a step at a sampling instant is seen at once: {down:?}"
    );
    assert!(row("1 -> 2 A")[1] < 0.2 * down[1], "a small step");
    // a period is 5 us: two decimals of a millisecond would hide it
    assert!(down[3] < 0.05 && said.contains("0.025"), "{said}");
    let narrow = desk.succeed("limit plant.toml --v-ref 12 --load-step 20,120 --duty 0.1,0.3");
    let wide = row("20 -> 120 W");
    let tight = numbers(narrow.lines().find(|line| line.starts_with("20 -> 120 W")).unwrap());
    assert!(tight[1] > 1.2 * wide[1], "{tight:?} {wide:?}");
}

#[test]
fn a_plant_becomes_a_trained_policy_that_holds_on_its_spread() {
    let desk = Desk::new("linear");
    std::fs::create_dir(desk.path("parts")).unwrap();
    desk.write("parts/plant.toml", PLANT);
    let said = desk.succeed("new --plant parts/plant.toml --v-ref 12 --loads 20,120 --out mine/policy.toml");
    assert!(said.contains("policyc train mine/train.toml"), "{said}");
    let ran = desk.type_in("train mine/train.toml --out mine/trained --seeds 0");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    for part in [
        "law alone",
        "On inductance x 0.85, capacitance x 0.85:",
        "The law alone costs",
    ] {
        assert!(ran.stdout.contains(part), "{part}\n{}", ran.stdout);
    }
    assert!(
        desk.read("mine/trained/spread.csv")
            .contains("\"inductance x 1.15, capacitance x 1.15\",20,120,worst")
    );
    let said = desk.succeed("simulate mine/scenario.toml --policy mine/trained --out mine/loop");
    let (rows, limits) = (rows(&said, "policy   "), rows(&said, "limit 0..0.95"));
    assert_eq!((rows.len(), limits.len()), (2, 2), "{said}");
    for (row, limit) in rows.iter().zip(limits) {
        assert!(
            row[1] < 1.1 * limit[1],
            "a tenth more than what nothing can beat\n{said}"
        );
        // 0.1 % of 12 V
        assert!(row[5] < 0.012, "the tail\n{said}");
    }
    // nothing that is there is overwritten
    let again = desk.type_in("new --plant parts/plant.toml --v-ref 12 --loads 20,120 --out mine/policy.toml");
    assert_eq!(again.code, Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("exists already"), "{}", again.stderr);
    // no file but a folder, as a voltage in its name makes it look
    desk.succeed("new --plant parts/plant.toml --v-ref 12 --loads 20,120 --out buck-3.3");
    // which asks for load steps from and to half way as well
    assert!(desk.read("buck-3.3/train.toml").contains("[70.0, 20.0]"));
}

/// Rows of the tables of `simulate`, one a load step; not those of the table of what is done at rest, which has three columns.
fn rows(said: &str, name: &str) -> Vec<Vec<f64>> {
    let is_row = |line: &&str| line.starts_with(name) && (name.starts_with("limit") || line.matches(" / ").count() > 3);
    said.lines().filter(is_row).map(numbers).collect()
}

/// 12 bits, noise and a period of delay; L and C of 85 %.
fn is_near_the_limit_with_smaller_parts(example: &str, v_ref: f64, loads: [f64; 2]) {
    let desk = Desk::new("linear");
    let example = tests::root().join(format!("examples/plants/{example}.toml"));
    desk.write("plant.toml", &std::fs::read_to_string(example).unwrap());
    let [low, high] = loads;
    desk.succeed(&format!(
        "new --plant plant.toml --v-ref {v_ref} --loads {low},{high} --out mine"
    ));
    // of three seeds, as the file has it: one alone may miss the settling by an unlucky instant
    desk.succeed("train mine/train.toml --out mine/trained");
    for key in ["inductance", "capacitance"] {
        let key = format!("\"converter.{key}\"");
        desk.edit("mine/scenario.toml", &format!("# {key}"), &key);
    }
    let said = desk.succeed("simulate mine/scenario.toml --policy mine/trained --out mine/loop");
    // of the duties that the contract allows; with all of them it is smaller or equal
    let (limits, of_all) = (rows(&said, "limit 0..0.95"), rows(&said, "limit 0..1 "));
    let (law, policy) = (rows(&said, "law alone"), rows(&said, "policy   "));
    assert_eq!([limits.len(), of_all.len(), law.len(), policy.len()], [2; 4], "{said}");
    for (n, limit) in limits.iter().enumerate() {
        assert!(of_all[n][1] <= limit[1], "{said}");
        for row in [&law[n], &policy[n]] {
            // what one load step leaves of its tenth must not be spent on the other
            assert!(
                row[1] < 1.1 * limit[1],
                "a tenth more than what nothing can beat\n{said}"
            );
            assert!(row[5] < 1e-3 * v_ref, "the tail\n{said}");
        }
    }
    for (file, power) in [
        (format!("{low}-{high}W-policy.csv"), high),
        (format!("{high}-{low}W-policy.csv"), low),
    ] {
        let record = desk.read(&format!("mine/loop/{file}"));
        let last: Vec<f64> = (record.lines().last().unwrap().split(','))
            .map(|cell| cell.parse().unwrap_or(f64::NAN))
            .collect();
        let (v_out, i_out) = (last[2], last[4]);
        assert!((i_out - power / v_out).abs() < 0.01 * power / v_out, "{last:?}");
    }
}

#[test]
fn twelve_volts_become_minus_five_near_the_limit_with_smaller_parts() {
    is_near_the_limit_with_smaller_parts("buck-boost-12-5", 5.0, [2.0, 15.0]);
}

/// Its step down is the harder one.
#[test]
fn five_volts_become_one_near_the_limit_with_smaller_parts() {
    is_near_the_limit_with_smaller_parts("buck-5-1", 1.0, [1.0, 10.0]);
}

#[test]
fn what_has_no_start_and_no_limit_is_exit_code_2_with_its_reason() {
    let desk = Desk::new("linear");
    desk.write("plant.toml", PLANT);
    desk.write("boost.toml", &PLANT.replace("v_in", "topology = \"boost\"\nv_in"));
    for (line, reason) in [
        ("new", "--plant"),
        ("new --plant plant.toml", "--v-ref"),
        ("new --plant plant.toml --v-ref 12", "--loads"),
        ("new --plant plant.toml --v-ref 12 --loads 20", "two numbers"),
        ("new --plant plant.toml --v-ref 12 --loads 120,20", "no range"),
        ("new --plant plant.toml --v-ref 12 --loads 20,nan", "two numbers"),
        ("new --plant plant.toml --v-ref 60 --loads 20,120", "cannot hold"),
        ("new --plant plant.toml --v-ref 3 --loads 2,12", "v_fold"),
        (
            "new --plant boost.toml --v-ref 12 --loads 20,120",
            "more than the source",
        ),
        ("new --plant nothing.toml --v-ref 12 --loads 20,120", "nothing.toml"),
        ("new weights.safetensors --v-ref 12", "--plant"),
        ("limit plant.toml --v-ref 12", "--load-step"),
        ("limit plant.toml --v-ref 60 --load-step 20,120", "less than the source"),
        ("limit plant.toml --v-ref nan --load-step 20,120", "a voltage above 0"),
        ("limit plant.toml --v-ref -5 --load-step 2,15", "counts as positive"),
        ("design plant.toml --v-ref -5 --load 3", "counts as positive"),
        ("new --plant plant.toml --v-ref -5 --loads 2,15", "counts as positive"),
        ("new --plant plant.toml --v-ref 12 --loads -20,120", "no range"),
        ("limit plant.toml --v-ref 3 --load-step 2,12", "v_fold"),
        ("limit plant.toml --v-ref 12 --load-step -20,120", "no load step"),
        ("limit plant.toml --v-ref 12 --resistance-step 0,5", "no load step"),
        (
            "limit plant.toml --v-ref 12 --load-step 20,120 --duty 0.5,0.5",
            "no range",
        ),
        ("limit boost.toml --v-ref 12 --load-step 20,120", "more than the source"),
    ] {
        desk.refuse(line, &[reason]);
    }
    assert!(!desk.path("policy.toml").exists());
}

/// A plant file that says how the inductor current is measured has a contract that measures it.
#[test]
fn a_sensor_of_the_inductor_current_takes_the_place_of_the_observer() {
    let desk = Desk::new("linear");
    let boost = PLANT.replace("v_in", "topology = \"boost\"\nv_in") + "[sensors.i_l]\nlsb = 0.01\n";
    desk.write("boost.toml", &boost);
    let said = desk.type_in("new --plant boost.toml --v-ref 60 --loads 20,120 --out start");
    assert_eq!(said.code, Some(0), "{}", said.stderr);
    assert!(
        said.stderr.contains("has a sensor of the inductor current"),
        "{}",
        said.stderr
    );
    let contract = desk.read("start/policy.toml");
    assert!(
        contract.contains("name = \"i_l\"") && !contract.contains("[[observer]]"),
        "{contract}"
    );
    // an estimate needs to know where in the ripple it is
    let last = "[pwm]\ncarrier = \"leading\"\n";
    desk.write("last.toml", &boost.replace("[pwm]\n", last));
    desk.succeed("new --plant last.toml --v-ref 60 --loads 20,120 --out last");
    desk.write("last.toml", &PLANT.replace("[pwm]\n", last));
    desk.refuse(
        "new --plant last.toml --v-ref 12 --loads 20,120 --out none",
        &["leading", "trailing or centre"],
    );
    // a buck's law has nothing that needs it
    desk.write("buck.toml", &format!("{PLANT}[sensors.i_l]\nlsb = 0.01\n"));
    desk.succeed("new --plant buck.toml --v-ref 12 --loads 20,120 --out buck");
    assert!(desk.read("buck/policy.toml").contains("[[observer]]"));
}

#[test]
fn a_boost_has_a_limit_and_a_start_whose_scenario_judges_on_a_spread() {
    let desk = Desk::new("linear");
    desk.write("boost.toml", &PLANT.replace("v_in", "topology = \"boost\"\nv_in"));
    let said = desk.succeed("limit boost.toml --v-ref 60 --load-step 20,120");
    assert!(said.contains("20 -> 120 W"), "{said}");
    desk.succeed("new --plant boost.toml --v-ref 60 --loads 20,120 --out start");
    let contract = desk.read("start/policy.toml");
    assert!(
        contract.contains("model_surplus") && !contract.contains("name = \"i_l\""),
        "{contract}"
    );
    let trained = "train start/train.toml --out trained --seeds 0";
    desk.edit("start/train.toml", "steps = 10000", "steps = 300");
    // so few steps meet no specification, which is exit code 1
    let _ = desk.type_in(trained);
    desk.edit(
        "start/scenario.toml",
        "limit = [[0.0, 0.95], [0.0, 1.0]]",
        "limit = false\ninstants = 1\nsampling_instants = 1",
    );
    let spread =
        "simulate start/scenario.toml --policy trained --out loop --spread converter.inductance=8.5e-6,11.5e-6,2";
    let said = desk.succeed(spread);
    assert!(
        said.contains("2 converters, converter.inductance from 0.0000085 to 0.0000115"),
        "{said}"
    );
    assert!(desk.read("loop/spread.csv").lines().count() > 2 * 4);
    desk.refuse(
        &spread.replace("--out loop", "--out more").replace(",2", ",1"),
        &["no range", "2 to 21 values"],
    );
}
