//! Records that ring: their noise, what a right model leaves over it, and what is said where nothing explains them. From a seeded generator
//! of physics (`bench`), which shares nothing with the plant.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, model};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::Verdict;
use diagnose::page::comparison::compared;

/// Standard deviations of voltage and currents, and steps of their converters.
const NOISE: [(&str, f64, f64); 3] = [("v_out", 0.06, 0.01), ("i_l", 0.03, 5e-3), ("i_out", 0.03, 5e-3)];

/// Steps of the duty and of the load, as often as a bench that is in a hurry makes them.
fn runs(bench: &Bench) -> [Table; 2] {
    let of = |duty: &[(usize, f64)], load: &[(f64, f64, f64)]| {
        let one = Bench {
            rows: 360,
            duty: duty.to_vec(),
            load: load.to_vec(),
            ..bench.clone()
        };
        let at = |row: usize| load.iter().rev().find(|step| step.0 <= row as f64).unwrap().2;
        one.run().without(&["v_in"]).with("i_load", (0..360).map(at).collect())
    };
    let duties = [0.5, 0.58, 0.46, 0.55, 0.43, 0.52];
    let loads = [5.0, 8.0, 4.0, 7.0, 3.5, 6.0];
    let duty: Vec<(usize, f64)> = duties.iter().enumerate().map(|(n, d)| (60 * n, *d)).collect();
    let load: Vec<(f64, f64, f64)> = loads
        .iter()
        .enumerate()
        .map(|(n, i)| (60.0 * n as f64, 0.0, *i))
        .collect();
    [of(&duty, &[(0.0, 0.0, 5.0)]), of(&[(0, 0.5)], &load)]
}

fn read(tables: &[Table], random: &mut Noise) -> Diagnosis {
    let model = model();
    let records = tables.iter().enumerate().map(|(n, table)| {
        let table = table.clone().measured(&NOISE, random);
        table.read(&format!("run{n}"), &model).unwrap()
    });
    diagnose(&model, records.collect(), &[], &|_| ())
}

/// The noise is that of [`NOISE`], which the fit does not know: a right model leaves it and nothing else.
#[test]
fn chi_square_of_a_right_model_is_near_one_where_records_ring() {
    for (seed, inductance, capacitance) in [(1, 0.7, 1.0), (2, 1.0, 0.7), (3, 1.3, 1.0)] {
        let bench = Bench {
            inductance: 2e-3 * inductance,
            capacitance: 150e-6 * capacitance,
            ..Bench::default()
        };
        let found = read(&runs(&bench), &mut Noise(seed));
        println!("{}", found.findings.sentence);
        assert_eq!(
            found.findings.verdict,
            Verdict::Explained,
            "{}",
            found.findings.sentence
        );
        for one in compared(&found) {
            let after = one.after.unwrap().chi2_per_value;
            let of = format!(
                "seed {seed}, {} of {}: {after}, noise {}",
                one.channel, one.record, one.noise
            );
            println!("{of}, before {}", one.before.chi2_per_value);
            assert!((0.8..1.25).contains(&after), "{of}");
        }
    }
}

/// Causes bend to a drift of the voltage as far as they can, and what they leave then is no drift any more.
#[test]
fn what_is_said_to_be_left_is_what_the_model_leaves_and_no_cause_bends() {
    let mut tables = runs(&Bench::default());
    for table in &mut tables {
        for (n, v) in table.column("v_out").iter_mut().enumerate() {
            *v += 3.0 * (1.0 - (-(n as f64) / 120.0).exp());
        }
    }
    let findings = read(&tables, &mut Noise(4)).findings;
    println!("{}", findings.sentence);
    assert_eq!(findings.verdict, Verdict::Unexplained, "{}", findings.sentence);
    let of_voltage: Vec<_> = findings.structure.iter().filter(|one| one.channel == "v_o").collect();
    assert!(!of_voltage.is_empty());
    for one in of_voltage {
        assert!(one.shape.contains("drift"), "{}: {}", one.record, one.shape);
    }
}

/// Edges that jitter make the filter tremble, which every channel of the converter has: that is no instrument that is to be set aside.
#[test]
fn what_kicks_the_filter_is_no_instrument_to_be_set_aside() {
    let mut random = Noise(5);
    let mut tables = runs(&Bench {
        sampled: 0.52,
        ..Bench::default()
    });
    // 10 kHz, 2 mH and 150 uH ring once in 34 rows, and lose half of it in as many
    let turn = std::f64::consts::TAU / 34.4;
    for table in &mut tables {
        let (mut swing, mut speed) = (0.0, 0.0);
        for v in table.column("v_out") {
            speed += -turn * turn * swing - 0.04 * speed + 0.05 * random.normal();
            swing += speed;
            *v += swing;
        }
    }
    let findings = read(&tables, &mut random).findings;
    println!("{}", findings.sentence);
    assert_eq!(findings.verdict, Verdict::Unexplained, "{}", findings.sentence);
}
