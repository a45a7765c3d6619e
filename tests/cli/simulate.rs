//! `policyc simulate`: figures, trajectories and pictures of load steps, all or nothing.

use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;
use tests::tools::{copy_folder, listing, run};

use super::{Desk, contents};

const SCENARIO: &str = "plant = \"plants/paper-model.toml\"
load_steps = [[200, 500], [500, 200]]
instants = 3
sampling_instants = 2
lead = 30
after = 50
tail = 10
";

/// The example policy in `policy/`, plants, and a short scenario.
pub fn desk() -> Desk {
    let desk = Desk::new("paper");
    std::fs::remove_dir_all(desk.path("policy")).unwrap();
    let examples = tests::root().join("examples");
    copy_folder(&examples.join("buck12"), &desk.path("policy"));
    copy_folder(&examples.join("plants"), &desk.path("plants"));
    desk.write("s.toml", SCENARIO);
    desk
}

/// The same figures as those of a contract that says the format, and others than in binary32.
#[test]
fn a_format_on_the_command_line_is_that_of_the_contract() {
    let desk = desk();
    let asked = desk.succeed("simulate s.toml --policy policy --format i8 --out asked");
    let plain = desk.succeed("simulate s.toml --policy policy --out plain");
    desk.edit(
        "policy/policy.toml",
        "name = \"buck12\"",
        "name = \"buck12\"\nnumeric_format = \"i8\"",
    );
    let stated = desk.succeed("simulate s.toml --policy policy --out stated");
    assert_eq!(asked.replace("asked", "stated"), stated);
    assert_ne!(asked.replace("asked", "plain"), plain);
    assert_eq!(
        desk.read("asked/200-500W-policy.csv"),
        desk.read("stated/200-500W-policy.csv")
    );
}

#[test]
fn a_simulation_leaves_figures_trajectories_and_pictures() {
    let desk = desk();
    let said = desk.succeed("simulate s.toml --policy policy --out new/out");
    let out = desk.path("new/out");
    let controllers = ["cascade", "deadbeat", "feed-forward", "pid", "policy"];
    let mut expected = ["metrics.csv", "metrics.json", "report.html", "summary.txt"]
        .map(str::to_owned)
        .to_vec();
    for step in ["200-500W", "500-200W"] {
        expected.extend(controllers.map(|name| format!("{step}-{name}.csv")));
        expected.push(format!("{step}.svg"));
    }
    expected.sort();
    assert_eq!(listing(&out), expected);
    for word in [
        "200 -> 500 W",
        "500 -> 200 W",
        "limit 0..1",
        "pid",
        "worst of 4 instants",
    ] {
        assert!(said.contains(word), "{word}\n{said}");
    }
    assert!(said.starts_with(&desk.read("new/out/summary.txt")));
    for name in ["new/out/200-500W.svg", "new/out/report.html"] {
        let text = desk.read(name);
        let words = [
            "output voltage (V)",
            "inductor current (A)",
            "duty",
            "policy",
            "limit 0..1",
        ];
        for word in words {
            assert!(text.contains(word), "{name}: {word}");
        }
    }
}

#[test]
fn figures_are_those_of_the_trajectories() {
    let desk = desk();
    desk.edit("s.toml", "sampling_instants = 2", "sampling_instants = 1");
    desk.succeed("simulate s.toml --policy policy --out out");
    let csv = desk.read("out/200-500W-policy.csv");
    let rows: Vec<Vec<f64>> = csv
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert!(csv.starts_with("t_s,load_W,v_out_V,i_l_A,i_out_A,v_in_V,v_min_V,v_max_V,duty,action,status\n"));
    assert_eq!(rows.len(), 80, "30 control periods before, 50 after");
    // the figures go one sample further than the last command's
    let after = rows.iter().filter(|row| row[0] > 1e-9);
    let deviation = after.map(|row| (row[2] - 100.0).abs()).fold(0.0, f64::max);
    let json: Value = serde_json::from_str(&desk.read("out/metrics.json")).unwrap();
    let step = &json["load_steps"][0];
    assert_eq!((step["from"].as_f64(), step["unit"].as_str()), (Some(200.0), Some("W")));
    let figures = &step["controllers"]["policy"]["sample"];
    assert_eq!(figures["deviation"].as_f64().unwrap(), deviation);
    let metrics = desk.read("out/metrics.csv");
    let row = metrics.lines().nth(1).unwrap();
    assert!(
        row.starts_with(&format!("policy,200,500,W,sample,{deviation},")),
        "{row}"
    );
    assert!(metrics.contains("\nlimit 0..1,200,500,W,worst,"), "{metrics}");
    let limit = step["limits"]["limit 0..1"]["sample"]["deviation"].as_f64().unwrap();
    assert!(limit > 0.05 && limit < deviation, "{limit}");
}

#[test]
fn compiled_code_drives_the_same_loop_and_the_same_files_come_twice() {
    let desk = desk();
    desk.succeed("simulate s.toml --policy policy --out a");
    for (kind, out) in [("c", "b"), ("rust", "c")] {
        let said = desk.succeed(&format!(
            "simulate s.toml --policy policy --out {out} --controller {kind}"
        ));
        assert!(said.contains("(generated "), "{said}");
        for name in ["200-500W-policy.csv", "500-200W-policy.csv", "metrics.csv"] {
            assert_eq!(
                desk.read(&format!("a/{name}")),
                desk.read(&format!("{out}/{name}")),
                "{kind} {name}"
            );
        }
    }
    desk.succeed("simulate s.toml --policy policy --out again");
    assert_eq!(contents(&desk.path("a")), contents(&desk.path("again")));
    // the policy by another name: the page alone says how it was named
    desk.succeed("simulate s.toml --policy policy/policy.toml --out named");
    let but_the_page = |out: &str| {
        let mut files = contents(&desk.path(out));
        files.retain(|(name, _)| name != "report.html");
        files
    };
    assert_eq!(but_the_page("a"), but_the_page("named"));
    assert_eq!(contents(&desk.path("a")).len(), but_the_page("a").len() + 1);
}

#[test]
fn the_check_compares_all_three_and_notices_a_compiler_that_changes_the_code() {
    let desk = desk();
    let said = desk.succeed("simulate s.toml --policy policy --out out --check");
    // two load steps, instants at 0 and 1 periods at the sample, at 1 1/3 and 2 2/3 beside it
    let periods = 2 * (4 * 80 + 1 + 1 + 2);
    assert!(
        said.contains(&format!(
            "equal to the bit over {periods} control periods: interpreter, generated Rust"
        )),
        "{said}"
    );
    let json: Value = serde_json::from_str(&desk.read("out/metrics.json")).unwrap();
    assert_eq!(json["check"]["controllers"].as_array().unwrap().len(), 3);

    // a gcc that changes the slope's scale, which no known answer of the network shows
    std::fs::create_dir(desk.path("bin")).unwrap();
    let gcc = ::verify::toolchain::find("gcc").unwrap();
    let script = format!(
        "#!/bin/sh\nfor f in \"$@\"; do case $f in *.c) sed -i 's/[*] 0.0003f/* 0.00031f/' \"$f\";; esac; done\n\
         exec {} \"$@\"\n",
        gcc.display()
    );
    desk.write("bin/gcc", &script);
    run(std::process::Command::new("chmod").arg("+x").arg(desk.path("bin/gcc")));
    let path = format!("{}:{}", desk.path("bin").display(), std::env::var("PATH").unwrap());
    let arguments = "simulate s.toml --policy policy --out bad --check".split(' ');
    let ran = run(desk.command().env("PATH", path).args(arguments));
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stdout.contains("DIFFERENT") && ran.stdout.contains("generated C (gcc -O2): 200 -> 500 W differs"),
        "{}",
        ran.stdout
    );
    assert!(desk.read("bad/report.html").contains("DIFFERENT"));
}

#[test]
fn another_plant_takes_the_place_of_the_scenario_s() {
    let desk = desk();
    desk.succeed("simulate s.toml --policy policy --out a");
    desk.succeed("simulate s.toml --policy policy --out b --plant plants/sb3-buck12.toml");
    assert_ne!(desk.read("a/metrics.csv"), desk.read("b/metrics.csv"));
    desk.write("s.toml", &format!("{SCENARIO}[set]\n\"sensors.v_out.noise\" = 0.05\n"));
    let said = desk.succeed("simulate s.toml --policy policy --out c");
    assert!(
        said.contains("sensors.v_out.noise = 0.05") && said.contains("note: the limit is that of the plain circuit"),
        "{said}"
    );
}

#[test]
fn a_policy_that_loses_the_voltage_is_said_to() {
    let desk = desk();
    let settled = desk.succeed("simulate s.toml --policy policy --out a");
    assert!(!settled.contains("does not settle"), "{settled}");
    let said = desk.succeed("simulate s.toml --policy policy --out b --plant plants/paper-table.toml");
    let words = "the policy does not settle within 0.5 V of 100 V before and after 200 -> 500 W, 500 -> 200 W";
    assert!(said.contains(words), "{said}");
    let page = desk.read("b/report.html");
    assert!(page.contains("verdict warn") && page.contains("does not settle"));
}

#[test]
fn results_are_not_overwritten() {
    let desk = desk();
    desk.succeed("simulate s.toml --policy policy --out out");
    let before = contents(&desk.path("out"));
    let words = ["out is not empty", "nothing written", "another --out"];
    desk.refuse("simulate s.toml --policy policy --out out", &words);
    desk.refuse("simulate s.toml --policy policy --out policy", &["policy is not empty"]);
    desk.refuse("simulate s.toml --policy policy --out s.toml", &["s.toml"]);
    assert_eq!(contents(&desk.path("out")), before);
    std::fs::create_dir(desk.path("empty")).unwrap();
    desk.succeed("simulate s.toml --policy policy --out empty");
}

#[test]
fn what_cannot_be_simulated_is_refused_and_nothing_is_written() {
    let desk = desk();
    let before = desk.listing();
    let simulate = |words: &[&str]| desk.refuse("simulate s.toml --policy policy --out out", words);
    let with = |text: &str, words: &[&str]| {
        desk.write("s.toml", text);
        simulate(words);
    };
    desk.refuse("simulate nothing.toml --policy policy --out out", &["nothing.toml"]);
    desk.refuse("simulate s.toml --policy nowhere --out out", &["nowhere"]);
    desk.refuse(
        "simulate s.toml --policy policy --out out --plant nowhere.toml",
        &["nowhere.toml"],
    );
    // the paper's loads are none of this converter's
    with(
        "plant = \"plants/buck-48-12.toml\"\nv_ref = 12.0\n",
        &["names no load step", "holds 12 V", "load_steps = [["],
    );
    with("v_ref = 100.0\n", &["--> s.toml", "no plant", "--plant"]);
    with("plant = \"plants/none.toml\"\n", &["plants/none.toml"]);
    with(
        &SCENARIO.replace("lead", "leap"),
        &["s.toml:5:1", "leap", "did you mean `lead`?"],
    );
    with(
        &format!("v_ref = 200.0\n{SCENARIO}"),
        &["cannot hold", "v_in = 200 V", "s.toml"],
    );
    let slow = format!("{SCENARIO}[set]\n\"converter.f_sw\" = 20000.0\n");
    with(
        &slow,
        &[
            "different control periods",
            "0.0001 s",
            "0.00005 s",
            "1 / sample_period",
        ],
    );
    desk.write("s.toml", SCENARIO);
    desk.edit("policy/policy.toml", "name = \"i_l\"", "name = \"i_coil\"");
    let text = desk.read("policy/policy.toml").replace("i_l)", "i_coil)");
    desk.write("policy/policy.toml", &text.replace("(i_l -", "(i_coil -"));
    simulate(&["no signal `i_coil`", "v_out, i_l, i_out, v_in"]);
    assert_eq!(desk.listing(), before);
}

#[test]
fn a_missing_compiler_is_named() {
    let desk = desk();
    let arguments = "simulate s.toml --policy policy --out out --controller c".split(' ');
    let ran = run(desk.command().env("PATH", desk.path("policy")).args(arguments));
    super::assert_refused(&ran, &["no compiler for", "gcc or clang"]);
    assert!(!desk.path("out").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupted_simulation_ends_with_130_and_writes_nothing() {
    let desk = desk();
    let long = "plant = \"plants/paper-model.toml\"\nlead = 90000\n";
    desk.write("s.toml", long);
    for more in [&[][..], &["--controller", "c"]] {
        let mut command = desk.command();
        command.args(["simulate", "s.toml", "--policy", "policy", "--out", "out"]);
        let started = command.args(more).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
        let mut child = started.unwrap();
        let begun = Instant::now();
        let status = format!("/proc/{}/status", child.id());
        // SIGINT is number 2: bit 1 of the signals that are caught
        let catches = || {
            let text = std::fs::read_to_string(&status).unwrap_or_default();
            let mask = text.lines().find_map(|line| line.strip_prefix("SigCgt:"));
            mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
                .is_some_and(|mask| mask & 2 != 0)
        };
        while !catches() {
            assert!(begun.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
            std::thread::sleep(Duration::from_millis(5));
        }
        let ended = super::interrupt(child);
        assert_eq!(ended.status.code(), Some(130));
        assert!(String::from_utf8_lossy(&ended.stderr).contains("interrupted; nothing written"));
        assert!(!desk.path("out").exists());
    }
}

/// The loop, its limit and classical controllers take any topology; what has formulas for the buck refuses.
#[test]
fn a_boost_is_simulated_beside_limit_and_classical_controllers_and_what_is_built_for_the_buck_says_so() {
    let desk = Desk::new("minimal");
    desk.write(
        "boost.toml",
        "[converter]\ntopology = \"boost\"\nv_in = 50.0\ninductance = 2e-3\ncapacitance = 1.5e-3\nf_sw = 10e3\n",
    );
    desk.write(
        "s.toml",
        "plant = \"boost.toml\"\nv_ref = 100.0\nload_steps = [[200, 900]]\ninstants = 1\n",
    );
    let said = desk.succeed("simulate s.toml --policy policy --out out");
    for words in [
        "a PID controller on the voltage cannot hold this boost converter",
        "\ncascade ",
        "\nfeed-forward ",
        "\ndeadbeat ",
        "\nlimit 0..1 ",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let listed = listing(&desk.path("out"));
    assert!(listed.iter().any(|name| name.ends_with("-policy.csv")), "{listed:?}");
    assert!(!listed.iter().any(|name| name.ends_with("-pid.csv")), "{listed:?}");
    // a boost does not go below its source
    desk.edit("boost.toml", "v_in = 50.0", "v_in = 150.0");
    desk.refuse(
        "simulate s.toml --policy policy --out below",
        &["boost", "cannot hold this voltage"],
    );
    desk.refuse(
        "drm acquire --plant boost.toml --duties 0.4,0.5 --powers 100,200 --out points.csv",
        &["built for the buck converter alone"],
    );
}

#[test]
fn a_plant_beside_the_scenario_s_folder_is_shown_without_the_way_in_and_out() {
    let desk = desk();
    std::fs::create_dir(desk.path("scenarios")).unwrap();
    desk.write("scenarios/s.toml", &SCENARIO.replace("plants/", "../plants/"));
    desk.succeed("simulate scenarios/s.toml --policy policy --out out");
    for file in ["summary.txt", "report.html"] {
        let text = desk.read(&format!("out/{file}"));
        assert!(text.contains("plants/paper-model.toml"), "{file}");
        assert!(!text.contains("/../"), "{file}");
    }
}
