//! Plant files with a correction `[empirical]`, in `simulate`, `train` and `drm acquire`: against a modulator that is off by the same
//! duty, and against the converter's own equation.

use super::{Desk, contents, simulate, training};

/// Duty that is added, by the correction and by the modulator.
const CONSTANT: &str = "\n[empirical]\nconstant = 0.04\n";
const OFFSET: &str = "\n[pwm]\nduty_offset = 0.04\n";

/// Plants beside the paper's model: with the correction, and with the modulator that is off by as much.
fn beside(desk: &Desk) {
    let paper = desk.read("plants/paper-model.toml");
    desk.write("plants/corrected.toml", &format!("{paper}{CONSTANT}"));
    desk.write("plants/off.toml", &format!("{paper}{OFFSET}"));
}

#[test]
fn a_simulation_has_the_correction_of_the_plant_file() {
    let desk = simulate::desk();
    beside(&desk);
    let course = |plant: &str| {
        let line = format!("simulate s.toml --policy policy --plant plants/{plant}.toml --out {plant}");
        desk.succeed(&line);
        ["policy", "pid"].map(|name| desk.read(&format!("{plant}/200-500W-{name}.csv")))
    };
    let [plain, corrected, off] = ["paper-model", "corrected", "off"].map(course);
    assert_eq!(corrected, off);
    assert!(plain[0] != corrected[0] && plain[1] != corrected[1]);
}

#[test]
fn a_training_has_the_correction_of_the_plant_file() {
    let desk = training::desk();
    beside(&desk);
    desk.edit("train/train.toml", "steps = 1200", "steps = 400");
    desk.edit("train/train.toml", "seeds = [3, 5]", "seeds = [5]");
    let mut before = "paper-model";
    let mut trained = |plant: &'static str| {
        desk.edit("train/train.toml", before, plant);
        before = plant;
        desk.succeed(&format!("train train/train.toml --out {plant}"));
        let files = contents(&desk.path(plant));
        let learned = |name: &str| name.ends_with("weights.safetensors") || name.ends_with("learning-curve.csv");
        files.into_iter().filter(|file| learned(&file.0)).collect::<Vec<_>>()
    };
    let [plain, corrected, off] = ["paper-model", "corrected", "off"].map(&mut trained);
    assert!(plain.len() >= 2 && plain != corrected);
    assert_eq!(corrected, off);
}

/// Settled points as (commanded duty, output voltage).
fn points(desk: &Desk, plant: &str) -> Vec<(f64, f64)> {
    let line = format!("drm acquire --plant {plant} --duties 0.46:0.04:0.62 --currents 2,6 --out {plant}.csv");
    desk.succeed(&line);
    let table = desk.read(&format!("{plant}.csv"));
    let mut lines = table.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name: &str| names.iter().position(|one| *one == name).unwrap();
    let places = [place("d_real"), place("v_out")];
    let number = |line: &str, place: usize| line.split(',').nth(place).unwrap().parse::<f64>().unwrap();
    lines
        .map(|line| (number(line, places[0]), number(line, places[1])))
        .collect()
}

/// Without losses the output is the source's 200 V times the duty that acts.
#[test]
fn settled_points_have_the_correction_of_the_plant_file() {
    let desk = simulate::desk();
    let paper = desk.read("plants/paper-model.toml");
    let by_voltage = "\n[empirical]\nv = 0.03\nv_centre = 100.0\nv_span = 30.0\n";
    type Added = fn(f64) -> f64;
    let cases: [(&str, Added); 3] = [
        ("", |_| 0.0),
        (CONSTANT, |_| 0.04),
        (by_voltage, |v| 0.03 * ((v - 100.0) / 30.0).clamp(-1.0, 1.0)),
    ];
    for (table, added) in cases {
        desk.write("plant.toml", &format!("{paper}{table}"));
        let found = points(&desk, "plant.toml");
        assert_eq!(found.len(), 10);
        for (duty, v) in found {
            let expected = 200.0 * (duty + added(v));
            // means over a filter that rings for long without losses
            assert!((v - expected).abs() < 0.3, "{table}: {duty}, {v} V, {expected} V");
        }
        std::fs::remove_file(desk.path("plant.toml.csv")).unwrap();
    }
}
