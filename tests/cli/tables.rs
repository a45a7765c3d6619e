//! Tables of measurements with other names: `drm` and `diagnose` take the same ones, and both forms of a column map.

use super::Desk;

fn desk() -> Desk {
    let desk = Desk::new("minimal");
    let plant = std::fs::read_to_string(tests::root().join("examples/plants/sb3-buck12.toml")).unwrap();
    desk.write("plant.toml", &plant);
    desk
}

const POINTS: &str = "40,78.1,2.0\n50,97.8,2.0\n40,76.0,8.0\n50,95.6,8.0\n60,115.3,8.0\n";

/// A record over time, ten rows longer than the shortest one that is taken.
fn record(header: &str) -> String {
    (0..30).fold(format!("{header}\n"), |text, n| {
        let duty = 0.4 + 0.02 * f64::from(n % 5);
        text + &format!("{:.6},{duty:.2},{:.3},20\n", (f64::from(n) + 0.5) * 1e-4, 199.0 * duty)
    })
}

#[test]
fn a_mapping_is_fitted_to_short_forms_and_decimal_commas_and_both_forms_of_maps() {
    let desk = desk();
    desk.write("short.csv", &format!("d (%),v_o,i_o\n{POINTS}"));
    let said = desk.succeed("drm fit short.csv --map v_in=200 --out one.toml");
    assert!(!said.contains("not used"), "{said}");
    let german = format!(
        "lamp;duty [%];v_out;i_out\n{}",
        POINTS.replace(',', ";").replace('.', ",")
    );
    desk.write(
        "german.csv",
        &german
            .replace("\n4", "\n1;4")
            .replace("\n5", "\n1;5")
            .replace("\n6", "\n1;6"),
    );
    desk.write("map.toml", "[constants]\nv_in = 200\n");
    let said = desk.succeed("drm fit german.csv --columns map.toml --out two.toml");
    assert!(
        said.contains("decimal commas") && said.contains("not used: `lamp`"),
        "{said}"
    );
    assert_eq!(desk.read("one.toml"), desk.read("two.toml"));
    desk.write("strange.csv", &format!("D,U,I\n{POINTS}"));
    desk.write(
        "map.toml",
        "[columns]\nd = { name = \"D\", scale = 0.01 }\nv_o = \"U\"\ni_out = \"I\"\n",
    );
    desk.succeed("drm fit strange.csv --columns map.toml --map v_in=200 --out three.toml");
    assert_eq!(desk.read("one.toml"), desk.read("three.toml"));
    desk.refuse(
        "drm fit strange.csv --columns map.toml --map v_o=U",
        &["`v_out` is mapped twice"],
    );
}

/// The held-out record is missing: what is said of it alone shows that the other was read.
#[test]
fn a_record_is_read_by_its_long_names_or_by_either_map() {
    let desk = desk();
    let diagnose = "diagnose --model plant.toml --heldout nothing.csv --out out --train";
    let accepted = |line: &str| {
        let said = desk.refuse(&format!("{diagnose} {line}"), &["cannot find the file `nothing.csv`"]);
        assert!(!said.contains("run.csv"), "{line}: {said}");
    };
    for header in [
        "t,d,v_o,r_load",
        "timestamps,duty,v_out,r_load",
        "time_s,duty,v_out,r_load",
    ] {
        desk.write("run.csv", &record(header));
        accepted("run.csv");
    }
    desk.write("run.csv", &record("Zeit,D,U,R"));
    desk.write(
        "map.toml",
        "[columns]\nt = \"Zeit\"\nduty = \"D\"\nv_out = \"U\"\nr_load = \"R\"\n",
    );
    accepted("run.csv --columns map.toml");
    accepted("run.csv --map t=Zeit,d=D,v_o=U,r_load=R");
    accepted("run.csv --map d=D,v_o=U,r_load=R --settled");
    let said = desk.refuse(
        &format!("{diagnose} run.csv --map d=D,v_o=U,r_load=R"),
        &["run.csv:1:1", "`Zeit` looks like time", "--map t=Zeit", "--settled"],
    );
    assert!(!desk.path("out").exists(), "{said}");
}
