//! Settled points are what they are in whatever order somebody wrote them down.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Noise, Table};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use plant::Parameters;

const V_IN: f64 = 12.0;
/// Of the winding, of the lower and of the upper switch, ohm; the model has 11 mohm for the last.
const RESISTANCES: [f64; 3] = [7e-3, 6e-3, 31e-3];

/// Duty and current of each point, and what puts them into an order.
type Points = Vec<(f64, f64)>;
type Order = dyn Fn(&mut Points);

/// Means of a synchronous buck that never rests: Kirchhoff's law over a period. In `order`, with a noise of 1 mV.
fn table(duties: &[f64], currents: &[f64], order: &Order) -> Table {
    let mut points: Points = duties
        .iter()
        .flat_map(|d| currents.iter().map(move |i| (*d, *i)))
        .collect();
    order(&mut points);
    let noise = &mut Noise(5);
    let [winding, lower, upper] = RESISTANCES;
    let mut table = Table::of(&["duty", "v_out", "i_out", "v_in"]);
    for (d, i) in points {
        // the current's ripple squares out over a period to first order
        let v = d * V_IN - i * (winding + d * upper + (1.0 - d) * lower);
        table.push(&[d, v + 1e-3 * noise.normal(), i, V_IN + 2e-3 * noise.normal()]);
    }
    table
}

fn model() -> Parameters {
    let text = "[converter]\nv_in = 12.0\ninductance = 3.3e-6\ncapacitance = 440e-6\nf_sw = 400e3\nrectifier = \"synchronous\"\n\
                [inductor]\ndcr = 7e-3\n[switch]\nr_ds_on = 11e-3\nr_ds_on_low = 6e-3\n";
    Parameters::from_toml("plant.toml".as_ref(), text).unwrap()
}

fn found(duties: &[f64], currents: &[f64], order: &Order) -> Findings {
    let record = table(duties, currents, order).read("sweep", &model()).unwrap();
    diagnose(&model(), vec![record], &[], &|_| ()).findings
}

#[test]
fn a_sweep_says_the_same_duty_by_duty_and_load_by_load() {
    let (duties, currents) = ([0.22, 0.26, 0.30, 0.34, 0.38], [1.0, 4.0, 8.0, 12.0]);
    let by_duty: &Order = &|_| ();
    let by_load: &Order = &|points| points.sort_by(|a, b| a.1.total_cmp(&b.1));
    for order in [by_duty, by_load] {
        let findings = found(&duties, &currents, order);
        assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
        let cause = &findings.causes[0];
        let value = cause.parameters["r_ds_on"].value;
        assert!((value / RESISTANCES[2] - 1.0).abs() < 0.06, "{}", findings.sentence);
        let noise = findings.noise.sigma["v_o"];
        // of 20 values a noise counts a third more than it shows
        assert!((0.7e-3..2.5e-3).contains(&noise), "{noise}");
    }
}

#[test]
fn a_sag_of_nine_points_is_not_their_noise() {
    let findings = found(&[0.24, 0.28, 0.36], &[2.0, 6.0, 10.0], &|_| ());
    assert_ne!(findings.verdict, Verdict::Consistent, "{}", findings.sentence);
    assert!(findings.noise.sigma["v_o"] < 4e-3, "{:?}", findings.noise.sigma);
}

#[test]
fn a_counter_of_few_counts_is_found_in_settled_points() {
    // the points lie 20 to 50 mV beside the commanded duties, as those of no converter do; the resistances are the model's
    for (counts, up) in [(96.0, 0.5), (128.0, 0.0), (60.0, 0.5)] {
        let noise = &mut Noise(23);
        let mut table = Table::of(&["duty", "v_out", "i_out", "v_in"]);
        for n in 0..26 {
            let command = 0.2 + 0.0091 * f64::from(n);
            let i = 2.0 + f64::from(n * 7 % 11) + 5e-3 * noise.normal();
            let d = (command * counts + up).floor() / counts;
            let v = d * V_IN - i * (7e-3 + d * 11e-3 + (1.0 - d) * 6e-3);
            let values = [command, v + 2e-3 * noise.normal(), i, V_IN + 2e-3 * noise.normal()];
            table.push(&values);
        }
        let record = table.read("sweep", &model()).unwrap();
        let findings = diagnose(&model(), vec![record], &[], &|_| ()).findings;
        let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
        assert_eq!(ids, ["duty_quantisation"], "{counts}: {}", findings.sentence);
        let step = findings.causes[0].parameters["duty_lsb"].value;
        assert!((step * counts - 1.0).abs() < 2e-3, "{counts}: {step}");
    }
}
