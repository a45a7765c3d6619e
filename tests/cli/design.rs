//! `policyc design`: its lines make a contract whose law holds the voltage, and what cannot be designed is refused.

use super::Desk;

const PLANT: &str = "[converter]
v_in = 12.0
inductance = 3.3e-6
capacitance = 94e-6
f_sw = 500e3
rectifier = \"synchronous\"
[pwm]
duty_delay = 1
[load]
v_fold = 1.0
[sensors.v_out]
noise = 2e-3
";

/// The part of a text from one line on and up to another one.
fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let start = text.find(from).unwrap_or_else(|| panic!("no {from}:\n{text}"));
    let end = text[start..].find(to).map_or(text.len(), |at| start + at);
    &text[start..end]
}

/// Rows of the law alone in the tables of `simulate`, on load steps at a plant, after the lines of `design` were put into a contract.
fn rows_of_the_law(desk: &Desk, load_steps: &str) -> (String, Vec<String>) {
    let lines = desk.succeed("design plant.toml --v-ref 5 --load 10");
    let contract = desk.read("policy/policy.toml");
    let contract = contract.replace(
        between(&contract, "[[observer]]", "\n[[feature]]"),
        between(&lines, "[[observer]]", "\n#"),
    );
    let contract = contract.replace(between(&contract, "base = ", "\n"), between(&lines, "base = ", "\n"));
    desk.write("policy/policy.toml", &contract);
    desk.write(
        "s.toml",
        &format!(
            "plant = \"plant.toml\"\nload_steps = {load_steps}\ninstants = 3\nlead = 400\nafter = 400\ntail = 50\nbaselines = []\n"
        ),
    );
    let said = desk.succeed("simulate s.toml --policy policy --out out");
    // not those of the table of what is done at rest, which has three columns
    let is_row = |line: &&str| line.starts_with("law alone") && line.matches(" / ").count() > 3;
    let rows: Vec<String> = said.lines().filter(is_row).map(str::to_owned).collect();
    assert_eq!(rows.len(), 2, "{said}");
    (said, rows)
}

/// A law that is mapped rests beside its voltage: the observer sees the mapped duty and has no bias for it.
fn unmap(desk: &Desk) {
    let contract = desk.read("policy/policy.toml");
    let without = contract.replace(between(&contract, "[mapping]", "\n["), "");
    desk.write("policy/policy.toml", &without);
}

/// Deviation, settling, largest error at the end; each at sampling instants and at all.
fn numbers(row: &str) -> Vec<f64> {
    row.split([' ', '/']).filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn its_lines_stand_in_a_contract_and_their_law_holds_the_voltage() {
    let desk = Desk::new("residual");
    desk.write("plant.toml", PLANT);
    let (said, rows) = rows_of_the_law(&desk, "[[10, 40], [40, 10]]");
    let shown = desk.succeed("inspect policy");
    assert!(
        shown.contains("model_bias") && shown.contains("the duty acts one period later"),
        "{shown}"
    );
    // in the picture the law has a colour of its own
    let picture = desk.read("out/10-40W.svg");
    let colours: std::collections::BTreeSet<&str> = (picture.split("stroke=\"#").skip(1))
        .filter_map(|text| text.get(..6))
        .collect();
    assert!(colours.contains("0072b2") && colours.contains("56b4e9"), "{colours:?}");
    for row in rows {
        // 3 % of 5 V, after a load step that is the whole range
        let numbers = numbers(&row);
        assert!(numbers[1] < 0.6 && numbers[5] < 0.15, "{row}\n{said}");
    }
}

#[test]
fn the_law_of_a_buck_boost_holds_the_voltage_with_losses_that_it_does_not_know() {
    let desk = Desk::new("residual");
    unmap(&desk);
    let lossy = "rectifier = \"synchronous\"\n[inductor]\ndcr = 0.02\n[capacitor]\nesr = 0.001";
    let plant = PLANT.replace("v_in", "topology = \"buck-boost\"\nv_in");
    desk.write("plant.toml", &plant.replace("rectifier = \"synchronous\"", lossy));
    let (said, rows) = rows_of_the_law(&desk, "[[10, 20], [20, 10]]");
    assert!(desk.succeed("inspect policy").contains("model_surplus"));
    for row in rows {
        // 10 W more are 2 A: 94 uF lose 0.04 V a period, and the duty takes three; 0.2 % of 5 V at rest
        let numbers = numbers(&row);
        assert!(numbers[1] < 0.3 && numbers[5] < 0.01, "{row}\n{said}");
    }
}

/// The voltage to hold is a signal, which the firmware sets; generated C and Rust get it as the interpreter does.
#[test]
fn a_policy_that_is_told_its_reference_follows_a_step_of_it() {
    let desk = Desk::new("residual");
    desk.write("plant.toml", PLANT);
    unmap(&desk);
    rows_of_the_law(&desk, "[[10, 20], [20, 10]]");
    let steps = |steps: &str| {
        let lines = "plant = \"plant.toml\"\nreference_load = { power = 20 }\ninstants = 2\nlead = 400\nafter = 400\ntail = 50\n";
        desk.write("r.toml", &format!("{lines}reference_steps = {steps}\n"));
    };
    steps("[[4, 5], [5, 4]]");
    desk.refuse(
        "simulate r.toml --policy policy --out told",
        &["holds one voltage", "the signal `v_ref`"],
    );
    let signal = "[[signal]]\nname = \"v_ref\"\nunit = \"V\"\nrange = [3.0, 6.0]\n";
    let contract = desk.read("policy/policy.toml");
    let contract = contract
        .replace("[parameters]\nv_ref = 5.0\n", signal)
        .replace("base = \"(5 - ", "base = \"(v_ref - ")
        .replace("(model_voltage - 5)", "(model_voltage - v_ref)");
    desk.write("policy/policy.toml", &contract);
    let said = desk.succeed("simulate r.toml --policy policy --check --out told");
    assert!(
        said.contains("equal to the bit") && said.contains("the deviation is the overshoot"),
        "{said}"
    );
    for step in ["v_ref 4 -> 5 V", "v_ref 5 -> 4 V"] {
        let table = between(&said, step, "at rest after it");
        let row = table.lines().find(|line| line.starts_with("law alone")).unwrap();
        let numbers = numbers(row);
        // settled within 50 periods, and at rest 0.2 % of the reference: half the ripple in the law is that at 5 V
        assert!(numbers[3] < 0.1 && numbers[5] < 0.01, "{row}\n{said}");
        assert!(!table.contains("pid") && !table.contains("limit"), "{table}");
    }
    steps("[[4, 7]]");
    desk.refuse(
        "simulate r.toml --policy policy --out more",
        &["no such reference", "3 to 6 V"],
    );
    desk.succeed("new --plant plant.toml --v-ref 5 --loads 10,20 --out mine");
    desk.edit("mine/policy.toml", "[parameters]\nv_ref = 5.0\n", signal);
    desk.refuse(
        "train mine/train.toml --out trained",
        &["nothing sets the signal `v_ref`"],
    );
}

#[test]
fn a_law_behind_a_diode_says_from_which_load_on_it_holds() {
    let desk = Desk::new("linear");
    desk.write("plant.toml", &PLANT.replace("synchronous", "diode"));
    let said = desk.succeed("design plant.toml --v-ref 5 --load 10");
    // half of (12 - 5) V * 5/12 * 2 us / 3.3 uH
    assert!(said.contains("Below 0.8838 A of load"), "{said}");
    desk.write("plant.toml", PLANT);
    assert!(
        !desk
            .succeed("design plant.toml --v-ref 5 --load 10")
            .contains("of load")
    );
}

#[test]
fn what_cannot_be_designed_is_exit_code_2_with_its_reason() {
    let desk = Desk::new("linear");
    desk.write("plant.toml", PLANT);
    desk.write("boost.toml", &PLANT.replace("v_in", "topology = \"boost\"\nv_in"));
    for (line, reason) in [
        ("design plant.toml --v-ref 12 --load 10", "cannot hold"),
        ("design plant.toml --v-ref nan --load 10", "a voltage above 0"),
        ("design plant.toml --v-ref 5 --load 10 --pole 1", "pole"),
        ("design plant.toml --v-ref 5 --load 10 --noise 0", "without noise"),
        (
            "design plant.toml --v-ref 5 --load 10 --model-noise 0.1,0.2",
            "three numbers",
        ),
        ("design boost.toml --v-ref 5 --load 10", "more than the source"),
        ("design nothing.toml --v-ref 5 --load 10", "nothing.toml"),
    ] {
        desk.refuse(line, &[reason]);
    }
}
