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
        "drm fit points.csv --plant real.toml --v-in-sim 200 --terms 4 --out buck12/drm.toml --report fit.html --force",
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
    // the mapping's file says which simulation its duties are of
    assert!(desk.read("drm.toml").contains("[simulation]\nv_in = 200.0\n"));
    let said = desk.succeed("drm judge points.csv");
    assert!(said.contains("without a mapping"), "{said}");
    assert_eq!(said, desk.succeed("drm judge points.csv --v-in-sim 200"));
    assert_ne!(said, desk.succeed("drm judge points.csv --v-in-sim 190"));
}

/// A mapping continues beyond the points that it was fitted to, where nobody has measured it.
#[test]
fn a_judgement_marks_what_lies_outside_of_the_mapping_s_range() {
    let desk = desk();
    desk.succeed(&format!("drm acquire --plant real.toml {DUTIES} --out points.csv"));
    desk.succeed("drm fit points.csv --plant real.toml --v-in-sim 200");
    let judge = "drm judge --plant real.toml --nominal plants/paper-model.toml --v-ref 100";
    // fitted from 2 to 10 A
    let said = desk.succeed(&format!("{judge} --currents 5,8,14"));
    let rows: Vec<&str> = said.lines().filter(|line| line.contains("outside [valid]")).collect();
    assert!(rows.len() == 1 && rows[0].trim_start().starts_with("14.0"), "{said}");
    assert!(said.contains("note: 1 of 3 points lie outside"), "{said}");
    let said = desk.succeed(&format!("{judge} --currents 5,8"));
    assert!(!said.contains("outside"), "{said}");
}

/// A leg whose dead time is not in the plant file: its points of light load lie off every mapping, and are named.
#[test]
fn points_in_which_the_current_of_a_leg_turns_round_are_named() {
    let desk = desk();
    let leg = REAL
        .replace("[switch]\n", "rectifier = \"synchronous\"\n\n[switch]\n")
        .replace("v_f = 1.5\nr_d = 0.02\n", "");
    assert!(leg.contains("synchronous") && !leg.contains("v_f"), "{leg}");
    desk.write("leg.toml", &leg);
    desk.write("believed.toml", &leg.replace("dead_time = 4e-6\n", ""));
    // half of the ripple is 1.2 A
    desk.succeed("drm acquire --plant leg.toml --duties 0.46:0.04:0.62 --currents 0.5,3,6,10 --out points.csv");
    let said =
        desk.succeed("drm fit points.csv --plant believed.toml --v-in-sim 200 --keep-outliers --out believed-drm.toml");
    let words = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("write `dead_time` into [switch]"), "{said}");
    let (_, named) = words.split_once("turns round in each period: lines ").unwrap();
    let named: Vec<&str> = named.split_once('.').unwrap().0.split([' ', ',']).collect();
    // the lines of 0.5 A, counted as an editor does
    let table = desk.read("points.csv");
    let light = |row: &str| {
        row.split(',')
            .nth(6)
            .and_then(|i| i.parse::<f64>().ok())
            .is_some_and(|i| i < 1.0)
    };
    let lines: Vec<String> = table
        .lines()
        .enumerate()
        .filter(|(_, row)| light(row))
        .map(|(n, _)| (n + 1).to_string())
        .collect();
    assert_eq!(lines.len(), 5, "{table}");
    for line in &lines {
        assert!(named.contains(&line.as_str()), "{line}: {said}");
    }
    let said = desk.succeed("drm fit points.csv --plant leg.toml --v-in-sim 200 --out leg-drm.toml");
    assert!(said.contains("left out") && !said.contains("below half"), "{said}");
}

/// ngspice shares no code with the plant; both measure the same steady state (docs/results/plant.md: samples agree within 1.5 mV).
#[test]
fn ngspice_is_measured_as_the_plant_is() {
    let desk = desk();
    let points = |simulator: &str| -> Vec<[f64; 3]> {
        let protocol = "--window 100 --most-windows 12";
        desk.succeed(&format!(
            "drm acquire --plant real.toml --simulator {simulator} --duties 0.5 --powers 500,900 {protocol} --out {simulator}.csv"
        ));
        let text = desk.read(&format!("{simulator}.csv"));
        let rows = text
            .lines()
            .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
        rows.map(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            assert_eq!(cells[9], "yes", "{row}");
            [4, 5, 6].map(|column: usize| cells[column].parse().unwrap())
        })
        .collect()
    };
    let (ours, theirs) = (points("plant"), points("ngspice"));
    assert_eq!((ours.len(), theirs.len()), (2, 2));
    for ([d, v, i], [d_spice, v_spice, i_spice]) in ours.into_iter().zip(theirs) {
        let off = (v - v_spice) - (d - d_spice) * 195.0;
        assert!(
            off.abs() < 3e-3 && (i - i_spice).abs() < 1e-3,
            "{v} V at {d}, {v_spice} V at {d_spice}"
        );
    }
}

const CASES: &str = "\
plant = \"plants/sb3-buck12.toml\"
load_steps = [[200, 800], [800, 200]]
instants = 1
sampling_instants = 1
lead = 200
after = 250
tail = 50
";

/// What the paper reports: more than 1 V without a mapping, less than 0.3 V with it, and as good as the exact mapping.
#[test]
fn a_transfer_takes_the_steady_state_error_away() {
    let desk = desk();
    desk.write("cases.toml", CASES);
    let wide = desk
        .read("buck12/policy.toml")
        .replace("duty = [0.40, 0.60]", "duty = [0.05, 0.95]");
    desk.write("buck12/policy.toml", &wide);
    let said = desk.succeed("drm transfer cases.toml --policy buck12 --real real.toml --ideal --out out");
    assert!(
        said.contains("generated C") && said.contains("7 files in out"),
        "{said}"
    );
    let metrics = desk.read("out/metrics.csv");
    let tails = |run: &str| -> Vec<f64> {
        let rows = metrics
            .lines()
            .filter(|row| row.starts_with(&format!("{run},")) && row.contains(",worst,"));
        rows.map(|row| row.split(',').nth(7).unwrap().parse().unwrap())
            .collect()
    };
    let [simulation, without, with, exact] =
        ["simulation", "real: no mapping", "real: mapped", "real: exact mapping"].map(tails);
    assert_eq!(
        [&simulation, &without, &with, &exact].map(Vec::len),
        [2; 4],
        "{metrics}"
    );
    assert!(without.iter().all(|v| *v > 1.0), "{without:?}");
    for ((with, exact), simulation) in with.iter().zip(&exact).zip(&simulation) {
        assert!(
            *with < 0.3 && (with - exact).abs() < 0.05 && *simulation < 0.1,
            "{metrics}"
        );
    }
    let page = desk.read("out/report.html");
    assert!(page.contains("200 -&gt; 800 W") || page.contains("200 -> 800 W"));
    // the files fit together: the mapping written is that of the points written
    desk.succeed("drm fit out/real-points.csv --trained-on plants/sb3-buck12.toml --plant plants/sb3-buck12.toml");
    let coefficients = |name: &str| -> Vec<String> {
        let text = desk.read(name);
        text.lines()
            .filter(|line| !line.starts_with('#'))
            .map(str::to_owned)
            .collect()
    };
    assert_eq!(coefficients("drm.toml"), coefficients("out/real-drm.toml"));
}

/// 0.55, the largest duty of the policy, maps beyond its limit of 0.60: 0.55 * 1.02 + 0.04 + 0.02 at 8 A.
#[test]
fn limits_that_cut_mapped_duties_off_are_named() {
    let desk = desk();
    desk.write("cases.toml", &CASES.replace(", [800, 200]", ""));
    let said =
        desk.succeed("drm transfer cases.toml --policy buck12 --real real.toml --controller interpreter --out out");
    assert!(said.contains("its limits are 0.4 .. 0.6"), "{said}");
}

#[test]
fn a_transfer_that_cannot_be_is_answered_before_it_runs() {
    let desk = desk();
    desk.write("cases.toml", CASES);
    let line = "drm transfer cases.toml --real real.toml --out out --policy";
    desk.refuse(&format!("{line} policy"), &["no mapping", "[mapping]"]);
    desk.write("fast.toml", &REAL.replace("f_sw = 10e3", "f_sw = 20e3"));
    desk.refuse(
        "drm transfer cases.toml --policy buck12 --real real.toml,fast.toml --out out",
        &["fast.toml", "different control periods"],
    );
    desk.write("cases.toml", &CASES.replace("plant = ", "# "));
    desk.refuse(&format!("{line} buck12"), &["no plant", "--> cases.toml", "trained on"]);
    assert!(!desk.path("out").exists());
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
    desk.refuse(
        "drm fit percent.csv --map d_real=d_real*0.01 --assume-a nan",
        &["--assume-a", "greater than 0"],
    );
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
