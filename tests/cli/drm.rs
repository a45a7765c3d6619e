//! `policyc drm`: from a converter to a mapping that a controller applies.

use serde_json::Value;

use super::Desk;

/// 195 V, diode, switch, winding, dead time; the paper's converter otherwise.
const REAL: &str = "\
[converter]
v_in = 195.0
inductance = 2e-3
capacitance = 1.5e-3
f_sw = 10e3

[switch]
r_ds_on = 0.5
v_f = 1.5
r_d = 0.02
dead_time = 4e-6

[inductor]
dcr = 0.1
";

const DUTIES: &str = "--duties 0.46:0.04:0.62 --currents 2,6,10";

fn desk() -> Desk {
    let desk = Desk::new("minimal");
    let examples = tests::root().join("examples");
    tests::tools::copy_folder(&examples.join("buck12"), &desk.path("buck12"));
    tests::tools::copy_folder(&examples.join("plants"), &desk.path("plants"));
    desk.write("real.toml", REAL);
    desk
}

/// The generated C and Rust apply a four-term mapping as the interpreter does, and take another one at run time within
/// its limits only: `verify` sends both and compares bits.
#[test]
fn a_measured_mapping_reaches_the_generated_code() {
    let desk = desk();
    let said = desk.succeed(&format!("drm acquire --plant real.toml {DUTIES} --out points.csv"));
    assert!(said.contains("15 points, 0 taken over, 15 measured"), "{said}");
    let said = desk.succeed(
        "drm fit points.csv --plant real.toml --v-in-sim 200 --terms 4 --out buck12/drm.toml --report fit.html",
    );
    assert!(
        said.contains("V_f = 1.5") && said.contains("lost duty = 0.039"),
        "{said}"
    );
    let page = desk.read("fit.html");
    assert!(page.contains("Leave-one-out error") && page.contains("<svg"));
    let said = desk.succeed("inspect buck12");
    assert!(said.contains("i_out d_sim"), "{said}");
    desk.succeed("verify buck12 --steps 200");
}

#[test]
fn a_judgement_says_what_is_repaired_and_what_not() {
    let desk = desk();
    desk.succeed(&format!("drm acquire --plant real.toml {DUTIES} --out points.csv"));
    desk.succeed("drm fit points.csv --plant real.toml --v-in-sim 200");
    desk.write("sensor.toml", &format!("{REAL}\n[sensors.v_out]\ngain = 1.005\n"));
    let judge = "drm judge --nominal plants/paper-model.toml --v-ref 100 --powers 200,800";
    let said = desk.succeed(&format!("{judge} --plant sensor.toml --duty-limits 0.4,0.55"));
    for expected in ["voltage sensor is off by up to +0.500 V", "duty range ends too early"] {
        assert!(
            said.split_whitespace().collect::<Vec<_>>().join(" ").contains(expected),
            "{said}"
        );
    }
    let said = desk.succeed(&format!("{judge} --plant real.toml --json"));
    let answer: Value = serde_json::from_str(&said).unwrap();
    for steady in answer["steady"].as_array().unwrap() {
        assert!(steady["without_v"].as_f64().unwrap() < -9.0, "{said}");
        assert!(steady["with_v"].as_f64().unwrap().abs() < 0.05, "{said}");
    }
    let said = desk.succeed("drm judge points.csv --v-in-sim 200");
    assert!(said.contains("without a mapping"), "{said}");
}

#[test]
fn a_plan_for_the_bench_is_filled_in_and_resumed() {
    let desk = desk();
    let plan = "drm acquire --v-in 200 --duties 0.45,0.55 --powers 400 --resistors 20 --cool-down 30";
    let said = desk.succeed(&format!("{plan} --out plan.csv"));
    assert!(said.contains("4 points to measure"), "{said}");
    let text = desk.read("plan.csv");
    assert!(text.contains("closed loop at 90 V or current load 4.4444 A"), "{text}");
    assert!(text.contains("cool down for 30 s"), "{text}");
    let row = "1,0.45,resistor 20 ohm,open loop,";
    desk.write(
        "plan.csv",
        &text.replace(&format!("{row},,,,,"), &format!("{row}0.45,88.1,4.4,199.9,,yes")),
    );
    let said = desk.succeed(&format!("{plan} --resume plan.csv --out plan.csv"));
    assert!(
        said.contains("1 taken over, 0 measured") && said.contains("3 points to measure"),
        "{said}"
    );
    // one point is a start, not a mapping
    desk.refuse("drm fit plan.csv", &["one point cannot say", "plan.csv"]);
    assert!(!desk.path("drm.toml").exists());
}

#[test]
fn a_bad_table_or_wish_is_answered_and_nothing_written() {
    let desk = desk();
    desk.write(
        "percent.csv",
        "d_real,v_out,i_out,v_in\n45,90,4,200\n50,100,4,200\n45,89,8,200\n50,99,8,200\n",
    );
    desk.refuse("drm fit percent.csv", &["percent", "--map d_real=d_real*0.01"]);
    desk.refuse("drm fit missing.csv", &["missing.csv"]);
    desk.refuse(
        "drm acquire --plant real.toml --duties 45 --currents 2 --out p.csv",
        &["not percent"],
    );
    desk.refuse("drm acquire --v-in 200 --duties 0.4,0.5 --out p.csv", &["no loads"]);
    desk.refuse(
        "drm acquire --v-in 200 --simulator ngspice --duties 0.4 --powers 9 --out p.csv",
        &["--plant"],
    );
    desk.refuse("drm judge --plant real.toml", &["--nominal"]);
    assert!(!desk.path("drm.toml").exists() && !desk.path("p.csv").exists());
}
