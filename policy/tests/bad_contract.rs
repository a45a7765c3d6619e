//! Faults of policy.toml: each with line, column, what was found and what to do.

mod common;
use common::*;
use policy::Place;

#[test]
fn the_small_policy_is_accepted() {
    let policy = Folder::new().policy();
    assert_eq!(
        (policy.features.len(), policy.layers.len(), policy.outputs()),
        (2, 2, 3)
    );
    assert_eq!(policy.files.len(), 3);
}

#[test]
fn an_unknown_key_names_the_nearest_known_one() {
    contract_fault(
        "initial_duty = 0.5",
        "¦intial_duty = 0.5",
        &["unknown key `intial_duty` in [limits]", "initial_duty"],
    );
    contract_fault(
        "unit = \"V\"\n",
        "¦units = \"V\"\n",
        &["[[signal]]", "did you mean `unit`?"],
    );
    contract_fault(
        "name = \"buck\"",
        "name = \"buck\"\n¦sample_time = 1.0",
        &["at the top level"],
    );
}

#[test]
fn a_list_below_the_parameters_is_told_where_it_belongs() {
    contract_fault(
        "v_ref = 100.0",
        "v_ref = 100.0\n¦signal = [{ name = \"w\", unit = \"V\", range = [0.0, 1.0] }]",
        &["`signal` stands in [parameters]", "in one line", "[[signal]]"],
    );
    // a list of another name is a parameter of the wrong type, and a number is no list
    contract_fault("v_ref = 100.0", "v_ref = 100.0\nlevels = ¦[1.0, 2.0]", &["a number"]);
    Folder::new()
        .replace("v_ref = 100.0", "v_ref = 100.0\nobserver = 3.0")
        .policy();
}

#[test]
fn a_duplicate_key_is_refused_at_its_second_place() {
    contract_fault("hold = 3", "hold = 3\n¦hold = 4", &["not valid TOML", "duplicate key"]);
}

#[test]
fn a_decimal_comma_is_explained() {
    contract_fault(
        "scale = 0.2",
        "scale = 1¦,5",
        &["not valid TOML", "write 1.5 instead of 1,5"],
    );
    contract_fault("[0.40, 0.60]", "¦[0,40, 0,60]", &["4", "two numbers", "decimal comma"]);
    let duties = "[0.44, 0.50, 0.56]";
    contract_fault(duties, "¦[0,10, 0,15]", &["decimal commas", "write 0.10, 0.15"]);
    // one duty too large among others is no list of commas
    for too_large in ["[0.1, 3, 0.2, 0.4]", "[0, 10, 5, 15]"] {
        let said = Folder::new().replace(duties, too_large).faults().to_string();
        assert!(
            said.contains("not a duty ratio") && !said.contains("decimal comma"),
            "{said}"
        );
    }
    contract_fault(
        "scale = 0.2",
        "scale = ¦\"1,5\"",
        &["a number", "the text", "with a point"],
    );
}

#[test]
fn a_percentage_is_recognised() {
    contract_fault(
        "0.44, 0.50",
        "¦44, 0.50",
        &["not a duty ratio", "44", "0 to 1", "percentage: write 0.44"],
    );
    contract_fault("[0.40, 0.60]", "¦[40.0, 60.0]", &["percentage: write 0.4"]);
    contract_fault("duty = 0.0", "duty = ¦-0.1", &["-0.1", "0 to 1"]);
}

#[test]
fn duties_below_0_may_be_steps_of_a_duty() {
    let hint = "write base = \"previous_duty\" and these numbers as `offsets`";
    contract_fault("0.44, 0.50", "¦-0.01, 0.50", &["not a duty ratio", "-0.01", hint]);
    let too_large = Folder::new().replace("0.44, 0.50", "1.5, 0.50").fault().to_string();
    assert!(!too_large.contains("offsets"), "{too_large}");
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    contract_fault("scale = 0.2", "scale = ¦nan", &["not a finite number", "nan"]);
    contract_fault("250.0", "¦inf", &["`range` is not a finite number", "inf"]);
    contract_fault(
        "sample_period = 1e-4",
        "sample_period = ¦1e999",
        &["not a finite number"],
    );
    contract_fault("v_ref = 100.0", "v_ref = ¦-inf", &["`v_ref`"])
        .found
        .unwrap();
}

#[test]
fn crossed_limits_are_refused() {
    contract_fault(
        "[0.40, 0.60]",
        "¦[0.60, 0.40]",
        &["limits of `duty` are crossed", "low 0.6, high 0.4", "[0.4, 0.6]"],
    );
    contract_fault("[-20.0, 20.0]", "¦[20.0, -20.0]", &["`clip`", "crossed"]);
    contract_fault("[0.0, 250.0]", "¦[5.0, 5.0]", &["single point", "low < high"]);
}

#[test]
fn an_interval_without_an_f32_number_is_refused() {
    contract_fault(
        "[0.40, 0.60]",
        "¦[0.4, 0.4]",
        &["no f32 number lies inside `duty`", "[0.4, 0.4]", "wider"],
    );
    assert_eq!(
        Folder::new()
            .replace("[0.40, 0.60]", "[0.5, 0.5]")
            .policy()
            .limits
            .duty
            .low,
        0.5
    );
}

#[test]
fn a_wrong_kind_of_value_is_named() {
    contract_fault(
        "hold = 3",
        "hold = ¦3.0",
        &[
            "`hold` is of the wrong kind",
            "the number 3",
            "a whole number, 0 to 1000000",
        ],
    );
    contract_fault(
        "name = \"buck\"",
        "name = ¦7",
        &["the whole number 7", "a text in quotes"],
    );
    contract_fault("[0.40, 0.60]", "¦0.6", &["the number 0.6", "two numbers: [low, high]"]);
    contract_fault("[{ delay = 1 }]", "¦{ delay = 1 }", &["a table", "an array of filters"]);
    contract_fault("[{ delay = 1 }]", "[{ delay = ¦true }]", &["true", "1 to 256"]);
}

#[test]
fn numbers_out_of_range_are_named() {
    contract_fault(
        "hold = 3",
        "hold = ¦-1",
        &["`hold` is out of range", "-1", "0 to 1000000"],
    );
    contract_fault(
        "sample_period = 1e-4",
        "sample_period = ¦10000",
        &["period in seconds", "1e-9 s to 10 s"],
    );
    contract_fault("sample_period = 1e-4", "sample_period = ¦0", &["1e-9 s"]);
    contract_fault("scale = 0.2", "scale = ¦1e-60", &["rounds to 0 in f32"]);
    contract_fault("scale = 0.2", "scale = ¦0.0", &["`scale`", "0", "constant"]);
    contract_fault("delay = 1 ", "delay = ¦257 ", &["257", "1 to 256"]);
}

#[test]
fn a_missing_key_says_what_to_write() {
    let fault = Folder::new().replace("name = \"buck\"\n", "").fault();
    assert_whole_file(
        &fault,
        "policy.toml",
        &["`name` is missing at the top level", "name = \"buck\""],
    );
    contract_fault(
        "[limits]\nduty = [0.40, 0.60]\n",
        "¦[limits]\n",
        &["`duty` is missing in [limits]", "duty = [0.05, 0.95]"],
    );
    contract_fault(
        "[[feature]]\nname = \"e\"\n",
        "¦[[feature]]\n",
        &["`name` is missing in [[feature]]"],
    );
    let fault = Folder::new().replace("[fallback]\nduty = 0.0\nhold = 3\n", "").fault();
    assert_whole_file(&fault, "policy.toml", &["`fallback` is missing"]);
    contract_fault(
        "[network]\nweights = \"weights.safetensors\"\nhidden_activation = \"relu\"\n",
        "¦[network]\nweights = \"weights.safetensors\"\n",
        &["`hidden_activation` is missing", "weights do not say it"],
    );
}

#[test]
fn all_faults_of_all_files_come_together() {
    let folder = Folder::new()
        .replace("hold = 3", "hold = -3\ncolour = 1")
        .replace("scale = 0.2", "scale = nan")
        .replace("load_current = \"i_out\"", "load_current = \"i_oud\"")
        .file(
            "drm.toml",
            MAPPING
                .replace("a = 1.0", "a = -1.0")
                .replace("i_out =", "i_o =")
                .as_bytes(),
        )
        .tensors(&[dense("net.0", 4, 3), dense("net.2", 3, 4)].concat());
    let faults = folder.faults();
    let text = faults.to_string();
    for word in [
        "out of range",
        "unknown key `colour`",
        "not a finite",
        "did you mean `i_out`?",
        "`a` must be greater",
        "unknown key `i_o`",
        "`i_out` is missing in [valid]",
        "shape [4, 3]",
    ] {
        assert!(text.contains(word), "{word}:\n{text}");
    }
    assert_eq!(faults.faults.list.len(), 8, "{text}");
    assert_eq!(faults.skeleton.name.as_deref(), Some("buck"));
    assert_eq!(
        faults.skeleton.signals,
        [("v_out".to_owned(), false), ("i_out".to_owned(), false)]
    );
    assert_eq!(faults.files.len(), 3);
}

#[test]
fn syntax_faults_are_collected_and_keep_name_and_signals() {
    let folder = Folder::new()
        .replace("scale = 0.2", "scale = = 1")
        .replace("hold = 3", "hold = [1");
    let faults = folder.faults();
    let lines: Vec<_> = faults
        .faults
        .iter()
        .filter_map(|f| f.line_column())
        .map(|(line, _)| line)
        .collect();
    assert!(lines.contains(&21), "{faults}");
    assert!(lines.len() >= 2, "{faults}");
    assert_eq!(faults.skeleton.name.as_deref(), Some("buck"));
    assert_eq!(faults.skeleton.signals.len(), 2);
}

/// The name of a file may be what is broken: none is read, and none is missed.
#[test]
fn of_a_text_with_faults_of_syntax_no_other_file_is_read() {
    let text = CONTRACT.replace("weights.safetensors", "missing.safetensors");
    let faults = Folder::new().contract(&text.replace("hold = 3", "hold = = 3")).faults();
    assert_eq!(faults.faults.list.len(), 1, "{faults}");
    assert_eq!(faults.files.len(), 1, "{:?}", faults.files);
}

#[test]
fn a_fault_is_shown_with_its_line_and_carets() {
    let fault = contract_fault("0.44, 0.50", "¦44, 0.50", &[]);
    let text = fault.to_string();
    assert!(
        text.starts_with("error: `duties` is not a duty ratio\n  --> "),
        "{text}"
    );
    assert!(text.contains("policy.toml:34:11\n   |\n34 | duties = [44, 0.50, 0.56]\n   |           ^^\n   = found: 44\n   = expected: 0 to 1\n   = hint: "), "{text}");
}

#[test]
fn control_characters_of_a_file_do_not_reach_the_terminal() {
    let faults = Folder::new()
        .replace("name = \"buck\"", "name = \"b\u{1b}[31muck\"")
        .faults();
    assert!(!faults.to_string().contains('\u{1b}'), "{faults}");
    let faults = Folder::new()
        .replace("weights.safetensors", "w\\u001b.safetensors")
        .faults();
    assert!(!faults.to_string().contains('\u{1b}'), "{faults}");
}

#[test]
fn crlf_and_a_byte_order_mark_are_accepted() {
    let folder = Folder::new();
    let plain = folder.policy().digests;
    let text = format!("\u{feff}{}", CONTRACT.replace('\n', "\r\n"));
    assert_eq!(folder.contract(&text).policy().digests, plain);
    let (text, place) = unmark(&CONTRACT.replace("hold = 3", "hold = ¦-3"));
    let fault = Folder::new()
        .contract(&format!("\u{feff}{}", text.replace('\n', "\r\n")))
        .fault();
    assert_eq!(fault.line_column(), Some(place));
    assert!(matches!(fault.place, Place::Span { text, .. } if text == "hold = -3"));
}

#[test]
fn text_that_is_not_utf8_is_refused_with_its_place() {
    let bytes = [b"name = \"b\"\nx = \"".as_slice(), &[0xe9], b"\"\n"].concat();
    let fault = Folder::new().file("policy.toml", &bytes).fault();
    assert_eq!(fault.line_column(), Some((2, 6)));
    assert_says(&fault, &["not UTF-8", "0xe9"]);
}

#[test]
fn a_contract_beyond_the_size_limit_is_refused() {
    let fault = Folder::new().contract(&"#".repeat((1 << 20) + 1)).fault();
    assert_whole_file(
        &fault,
        "policy.toml",
        &["too large", "1048577 bytes", "at most 1048576"],
    );
}

#[test]
fn a_missing_file_a_folder_and_a_missing_companion_are_told_apart() {
    let folder = Folder::new();
    let missing = policy::load(&folder.path().join("nothing.toml")).unwrap_err();
    assert_whole_file(&missing.faults.list[0], "nothing.toml", &["cannot find the file"]);
    let is_folder = policy::load(&folder.path()).unwrap_err();
    assert_says(&is_folder.faults.list[0], &["is a folder"]);
    contract_fault(
        "\"weights.safetensors\"",
        "¦\"other.safetensors\"",
        &["cannot find the file", "other.safetensors"],
    );
    contract_fault("file = \"drm.toml\"", "file = ¦\".\"", &["is a folder"]);
}

#[test]
fn files_outside_the_root_are_refused() {
    let root = Folder::new();
    let options = policy::ReadOptions::within(root.path());
    let load = |path: &str| policy::read(std::path::Path::new(path), &options).and_then(policy::check);
    assert_eq!(load("policy.toml").unwrap().name, "buck");
    let outside = load("../policy.toml").unwrap_err();
    assert_says(&outside.faults.list[0], &["outside the crate"]);
    let root = root.replace("\"weights.safetensors\"", "\"../weights.safetensors\"");
    let faults = load("policy.toml").unwrap_err();
    assert_eq!(
        faults.faults.list[0].file.to_str(),
        Some("policy.toml"),
        "shown relative to the root"
    );
    assert_says(
        &faults.faults.list[0],
        &["`../weights.safetensors` lies outside the crate"],
    );
    assert_eq!(faults.faults.list[0].line_column(), Some((30, 11)));
    drop(root);
}

/// Nothing of the file is read: a message about it would show a line of it.
#[test]
#[allow(clippy::disallowed_methods, reason = "a folder beside the one that `Folder` makes")]
fn files_outside_the_contracts_folder_are_refused_unread() {
    let folder = Folder::new();
    let options = policy::ReadOptions {
        own_folder: true,
        ..policy::ReadOptions::default()
    };
    assert!(policy::load_with(&folder.path().join("policy.toml"), &options).is_ok());
    let secret = folder.path().join("secret");
    std::fs::write(&secret, "password = hunter2\n").unwrap();
    for name in [
        "../secret".to_owned(),
        "a/../../secret".to_owned(),
        "/etc/hostname".to_owned(),
    ] {
        let inner = folder.path().join("inner");
        std::fs::create_dir_all(&inner).unwrap();
        for file in ["policy.toml", "weights.safetensors", "drm.toml"] {
            std::fs::copy(folder.path().join(file), inner.join(file)).unwrap();
        }
        let contract = std::fs::read_to_string(inner.join("policy.toml")).unwrap();
        std::fs::write(
            inner.join("policy.toml"),
            contract.replace("\"drm.toml\"", &format!("{name:?}")),
        )
        .unwrap();
        let faults = policy::load_with(&inner.join("policy.toml"), &options).unwrap_err();
        assert_says(
            &faults.faults.list[0],
            &["lies outside the contract's folder", "--allow-outside"],
        );
        assert!(!faults.to_string().contains("hunter2"), "{faults}");
        assert!(
            policy::load(&inner.join("policy.toml")).is_err(),
            "the mapping is none, wherever it lies"
        );
    }
}
