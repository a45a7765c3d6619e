//! A plant file whose carrier or sampling instant is not the bench's: the answer says so, and what to type. The records come from a circuit
//! that shares nothing with the plant (`bench`).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, model};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::drive::Model;
use diagnose::extend::extended_toml;
use diagnose::findings::Verdict;
use diagnose::fit::State;
use diagnose::noise;
use diagnose::problem::Problem;
use diagnose::timing::{self, Timing};
use plant::{Carrier, Parameters};

const ROWS: usize = 180;

/// Steps of duty and load.
fn stepped(bench: &Bench, random: &mut Noise) -> Table {
    let d = random.between(0.4, 0.55);
    let low = random.between(4.0, 6.0);
    let load = vec![(0.0, 0.0, low), (50.0, 0.0, 1.5 * low), (110.0, 0.0, 0.8 * low)];
    let bench = Bench {
        rows: ROWS,
        duty: vec![(0, d), (75, d + 0.1), (140, d - 0.08)],
        load: load.clone(),
        ..bench.clone()
    };
    let set = (0..ROWS).map(|n| {
        let last = load.iter().rev().find(|step| step.0 <= n as f64);
        last.map_or(low, |step| step.2)
    });
    let table = bench.run().without(&["i_out", "v_in"]).with("i_load", set.collect());
    table.measured(&[("v_out", 0.1, 0.02), ("i_l", 0.05, 5e-3)], random)
}

fn diagnosed(bench: &Bench, plant: &Parameters, seed: u64) -> Diagnosis {
    let random = &mut Noise(seed);
    let [train, held] = ["train", "held"].map(|name| stepped(bench, random).read(name, plant).unwrap());
    let found = diagnose(plant, vec![train], &[held], &|_| ());
    println!(
        "{:?}: {}\n{}\n",
        found.findings.verdict,
        found.findings.sentence,
        found.findings.noise.repairs.join("\n")
    );
    found
}

fn carrier(carrier: Carrier, phase: f64) -> Parameters {
    let mut plant = model();
    (plant.pwm.carrier, plant.pwm.sampling_phase) = (carrier, phase);
    plant
}

#[test]
fn another_carrier_is_a_cause_and_stands_in_the_extended_plant() {
    let bench = Bench {
        carrier: 1.0,
        sampled: 0.0,
        ..Bench::default()
    };
    let found = diagnosed(&bench, &carrier(Carrier::Centre, 0.5), 5);
    let findings = &found.findings;
    assert_eq!(findings.verdict, Verdict::Explained);
    assert_eq!(
        findings.causes.iter().map(|cause| cause.id).collect::<Vec<_>>(),
        ["carrier"]
    );
    assert!(
        findings.sentence.contains("[carrier]: leading (model centre)"),
        "{}",
        findings.sentence
    );
    let plant = extended_toml(&found);
    assert!(plant.contains("carrier = \"leading\"  # "), "{plant}");
    // held-out errors are those of the plant file as it is, and of the extended one
    let current = findings.gain.heldout.iter().find(|held| held.channel == "i_l").unwrap();
    assert!(current.rmse_before > 1.0 && current.rmse_after < 0.06, "{current:?}");
}

#[test]
fn what_else_is_wrong_is_found_beside_another_carrier() {
    let bench = Bench {
        carrier: 0.0,
        sampled: 0.0,
        capacitance: 120e-6,
        ..Bench::default()
    };
    let found = diagnosed(&bench, &carrier(Carrier::Centre, 0.5), 6);
    let ids: Vec<&str> = found.findings.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(ids, ["c_wrong", "carrier"], "{}", found.findings.sentence);
}

/// What is said before any search.
#[test]
fn samples_a_period_and_more_too_old_are_the_sampling_instant() {
    // the table's rows are those of the period before, and the trigger comes early beside that
    for (rows, sampled) in [(1, 0.36), (1, 0.75), (0, 0.9)] {
        let bench = Bench {
            sampled,
            ..Bench::default()
        };
        let mut random = Noise(61);
        let tables = [0, 1].map(|_| {
            let mut table = stepped(&bench, &mut random);
            let whole = table.rows();
            // the logger believes in the middle of the period
            let off = (0.5 - sampled) / bench.f_sw;
            table.column("t").iter_mut().for_each(|t| *t += off);
            for (name, values) in &mut table.0 {
                // duty and load belong to the row; what was measured is older
                let is_measured = ["v_out", "i_l", "i_out", "v_in"].contains(&name.as_str());
                *values = if is_measured {
                    values[..whole - rows].to_vec()
                } else {
                    values[rows..].to_vec()
                };
            }
            table
        });
        let plant = carrier(Carrier::Centre, 0.5);
        let records = tables.iter().map(|table| table.read("run", &plant).unwrap());
        let findings = diagnose(&plant, records.collect(), &[], &|_| ()).findings;
        let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
        assert_eq!(ids, ["sampling_delay"], "{}", findings.sentence);
        let delay = &findings.causes[0].parameters["delay"];
        let truth = (sampled - 0.5 - rows as f64) / bench.f_sw;
        assert!(delay.low <= truth && truth <= delay.high, "{truth} {delay:?}");
    }
}

fn looked(table: &Table, plant: &Parameters) -> Option<Timing> {
    let base = Model::new(plant);
    let mut problem = Problem::new(vec![table.read("run", plant).unwrap()], base.clone());
    let null = State::settle(&problem, &base, &problem.first_starts(&base), None);
    problem.sigma = noise::sigma(&problem, &null.residual);
    let null = State::settle(&problem, &base, &null.starts, None);
    timing::of(&problem, &null)
}

const WHERE: [(Carrier, f64); 3] = [
    (Carrier::Trailing, 0.0),
    (Carrier::Centre, 0.5),
    (Carrier::Leading, 1.0),
];

#[test]
fn another_carrier_is_seen_before_any_search_at_any_instant() {
    let random = &mut Noise(7);
    for (word, on) in WHERE {
        for (wrong, _) in WHERE.into_iter().filter(|(other, _)| *other != word) {
            for sampled in [0.0, 0.25, 0.5, 0.7] {
                let table = stepped(
                    &Bench {
                        carrier: on,
                        sampled,
                        ..Bench::default()
                    },
                    random,
                );
                let found = looked(&table, &carrier(wrong, sampled));
                let is_found = matches!(&found, Some(Timing::Other(_, found, _)) if *found == word);
                assert!(is_found, "bench {word:?} plant {wrong:?} at {sampled}: {found:?}");
            }
        }
    }
}

/// What is wrong is another thing.
#[test]
#[allow(clippy::too_many_lines, reason = "a table of faults, one after the other")]
fn no_other_fault_is_taken_for_a_carrier() {
    let random = &mut Noise(8);
    let good = Bench::default();
    let mut cases: Vec<(String, Bench)> = Vec::new();
    let mut add = |name: &str, bench: Bench| cases.push((name.to_owned(), bench));
    for part in [0.75, 0.85, 1.2, 1.4] {
        add(
            "inductance",
            Bench {
                inductance: part * good.inductance,
                ..good.clone()
            },
        );
        add(
            "capacitance",
            Bench {
                capacitance: part * good.capacitance,
                ..good.clone()
            },
        );
        add(
            "source",
            Bench {
                v_in: (1.0 + 0.2 * (part - 1.0)) * good.v_in,
                ..good.clone()
            },
        );
        add(
            "winding",
            Bench {
                dcr: 4.0 * part * good.dcr,
                ..good.clone()
            },
        );
        for n in [0, 1] {
            let mut gain = [1.0; 4];
            gain[n] = 1.0 + 0.3 * (part - 1.0);
            add("gain", Bench { gain, ..good.clone() });
            let mut offset = [0.0; 4];
            offset[n] = [4.0, 1.5][n] * (part - 1.0);
            add("offset", Bench { offset, ..good.clone() });
            let mut slow = [0.0; 4];
            slow[n] = 2.0 * part;
            add("low-pass", Bench { slow, ..good.clone() });
        }
        add(
            "lost",
            Bench {
                lost: 0.02 * part,
                ..good.clone()
            },
        );
    }
    // a tie is said in a note, and rarely
    let mut perhaps = 0;
    for (word, on) in WHERE {
        for (name, bench) in &cases {
            for sampled in [0.0, 0.3, 0.5] {
                let bench = Bench {
                    carrier: on,
                    sampled,
                    ..bench.clone()
                };
                let found = looked(&stepped(&bench, random), &carrier(word, sampled));
                assert!(
                    !matches!(found, Some(Timing::Other(..))),
                    "{name} {word:?} {sampled}: {found:?}"
                );
                perhaps += usize::from(found.is_some());
            }
        }
        for late in [-0.3, -0.2, -0.1, -0.05, 0.05, 0.1, 0.2, 0.3, 0.45] {
            let bench = Bench {
                carrier: on,
                sampled: 0.5,
                ..good.clone()
            };
            let mut table = stepped(&bench, random);
            table.column("t").iter_mut().for_each(|t| *t += late / bench.f_sw);
            let found = looked(&table, &carrier(word, 0.5));
            assert!(
                !matches!(found, Some(Timing::Other(..))),
                "late {late} {word:?}: {found:?}"
            );
            perhaps += usize::from(found.is_some());
        }
    }
    assert!(perhaps <= 3, "{perhaps}");
}
