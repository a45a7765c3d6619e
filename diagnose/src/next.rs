//! Which experiment would separate what the records cannot.

use plant::Load;
use serde::Serialize;

use crate::attribute::Attribution;
use crate::drive::Model;
use crate::fit::State;
use crate::problem::Problem;
use crate::record::{CHANNELS, Record};

/// Rows of a planned experiment.
const ROWS: usize = 300;

/// An experiment and what it would tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// What to do.
    pub experiment: String,
    /// The two explanations.
    pub separates: [String; 2],
    /// Predicted separation: standard deviations between the two, initial states free.
    pub separation: f64,
}

/// For every tie the experiments by predicted separation, best first.
#[must_use]
pub fn experiments(problem: &Problem, attribution: &Attribution, say: &(dyn Fn(&str) + Sync)) -> Vec<Experiment> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let ties: Vec<_> = attribution.rivals.iter().flatten().take(6).collect();
    if ties.is_empty() {
        return Vec::new();
    }
    say("next experiment");
    let plans = plans(problem);
    let name = |causes: &[usize]| {
        causes
            .iter()
            .map(|c| attribution.id(*c))
            .collect::<Vec<_>>()
            .join(" + ")
    };
    let mut list = Vec::new();
    for rival in ties {
        let mut scored: Vec<Experiment> = crate::parallel::map(&plans, |(words, record)| Experiment {
            experiment: words.clone(),
            separates: [name(&best.causes), name(&rival.causes)],
            separation: separation(problem, record, &best.state.model, &rival.state.model),
        });
        scored.sort_by(|a, b| b.separation.total_cmp(&a.separation));
        list.extend(scored.into_iter().take(2));
    }
    list
}

/// Measured with one model, fitted with the other.
fn separation(problem: &Problem, record: &Record, one: &Model, other: &Model) -> f64 {
    let mut made = Problem::new(vec![record.clone()], one.clone());
    made.sigma = problem.sigma.map(|s| if s.is_finite() { s } else { f64::INFINITY });
    let starts = made.first_starts();
    let shown = crate::drive::simulate(one, &made.records[0], &starts.states[0], 0.0);
    for n in 0..CHANNELS {
        if problem.sigma[n].is_finite() {
            made.records[0].measured[n] = shown.iter().map(|row| row[n]).collect();
        }
    }
    State::settle(&made, other, &starts, None).chi2.sqrt()
}

fn plans(problem: &Problem) -> Vec<(String, Record)> {
    let (v, i, v_in) = (problem.bases.v, problem.bases.i, problem.bases.v_in);
    let d = (v / v_in).clamp(0.1, 0.9);
    let resistor = Load {
        conductance: i / v,
        ..Load::default()
    };
    let current = |amperes: f64| Load {
        current: amperes,
        conductance: 0.2 * i / v,
        ..Load::default()
    };
    let prbs = |n: usize| {
        // a maximum-length sequence of 7 bits, two periods a bit
        let mut state = 0x5bu32;
        for _ in 0..n / 2 {
            state = (state >> 1) ^ if state & 1 == 1 { 0x60 } else { 0 };
        }
        if state & 1 == 1 { d + 0.03 } else { d - 0.03 }
    };
    let stair = |n: usize, low: f64, high: f64| low + (high - low) * (n / (ROWS / 4)) as f64 / 3.0;
    let mut list: Vec<(String, Record)> = Vec::new();
    let mut add = |words: String, duty: &dyn Fn(usize) -> f64, load: &dyn Fn(usize) -> Load, ratio: f64| {
        let phase = problem.base.plant.pwm.sampling_phase;
        list.push((
            words,
            Record {
                name: "planned".to_owned(),
                time: (0..ROWS).map(|n| (n as f64 + phase) * problem.bases.t_sw).collect(),
                phase,
                duty: (0..ROWS).map(|n| duty(n).clamp(0.0, 1.0)).collect(),
                load: (0..ROWS).map(load).collect(),
                measured: std::array::from_fn(|_| vec![f64::NAN; ROWS]),
                lattice: [0.0; CHANNELS],
                resolution: [0.0; CHANNELS],
                v_in_ratio: ratio,
                duty_is: crate::columns::DutyIs::Commanded,
                settled: false,
                dense: true,
                segments: std::iter::once(0..ROWS).collect(),
                repairs: Vec::new(),
            },
        ));
    };
    add(
        format!("duty steps {:.2} to {:.2} at {:.1} ohm", 0.6 * d, 1.4 * d, v / i),
        &|n| stair(n, 0.6 * d, 1.4 * d),
        &|_| resistor,
        1.0,
    );
    add(
        format!("duty PRBS of 0.03 around {d:.2} at {:.1} ohm", v / i),
        &prbs,
        &|_| resistor,
        1.0,
    );
    add(
        format!("load current steps {:.1} to {:.1} A at duty {d:.2}", 0.3 * i, 2.0 * i),
        &|_| d,
        &|n| current(stair(n, 0.3 * i, 2.0 * i)),
        1.0,
    );
    add(
        format!("duty {:.2} and {:.2} at the same current of {i:.1} A", 0.6 * d, 1.4 * d),
        &|n| if n < ROWS / 2 { 0.6 * d } else { 1.4 * d },
        &|_| current(i),
        1.0,
    );
    add(
        format!("duty PRBS at half the source voltage, {:.0} V", 0.5 * v_in),
        &prbs,
        &|_| resistor,
        0.5,
    );
    add(
        format!("light load: {:.0} ohm at duty {d:.2}, with duty steps", 10.0 * v / i),
        &|n| stair(n, 0.8 * d, 1.2 * d),
        &|_| Load {
            conductance: 0.1 * i / v,
            ..Load::default()
        },
        1.0,
    );
    add(
        "zero reading: duty 0 without load current".to_owned(),
        &|_| 0.0,
        &|_| resistor,
        1.0,
    );
    add(
        format!(
            "constant power steps {:.0} to {:.0} W beside {:.0} ohm",
            0.3 * v * i,
            1.2 * v * i,
            2.0 * v / i
        ),
        &|_| d,
        &|n| Load {
            conductance: 0.5 * i / v,
            power: stair(n, 0.3 * v * i, 1.2 * v * i),
            current: 0.0,
        },
        1.0,
    );
    list
}
