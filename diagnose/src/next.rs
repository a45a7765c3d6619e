//! Which experiment would separate what the records cannot.

use plant::{Load, Topology};
use serde::Serialize;

use crate::attribute::Attribution;
use crate::causes::{CAUSES, Form};
use crate::drive::Model;
use crate::findings::{Findings, Named};
use crate::fit::State;
use crate::played::{FOLDER, Played};
use crate::problem::Problem;
use crate::progress::{Listener, Progress};
use crate::record::{CHANNELS, QUANTITIES, Record};
use crate::words::si;

/// Rows of a planned experiment: 30 ms at 10 kHz, nine periods of the paper's filter, as long as the records of the blind cases.
const ROWS: usize = 300;

/// Separation from which on an experiment is worth doing: the three standard deviations within which two explanations are a tie. With less
/// it would end in the same tie.
const LEAST: f64 = 3.0;

/// The cause that a column of the input voltage shows.
const SOURCE: &str = "source_impedance";

/// An experiment and what it would tell apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// What to do.
    pub experiment: String,
    /// Where it is written to, below the folder of the diagnosis.
    pub file: String,
    /// The two explanations.
    pub separates: [String; 2],
    /// Predicted separation: standard deviations between the two, initial states free.
    pub separation: f64,
    /// What the file says.
    #[serde(skip)]
    pub played: Played,
}

/// For every tie the experiments by predicted separation, best first; none where none of them would break it.
#[must_use]
pub fn experiments(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<Experiment> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let ties: Vec<_> = attribution.rivals.iter().flatten().take(6).collect();
    if ties.is_empty() {
        return Vec::new();
    }
    say(Progress::Stage("next experiment"));
    let mut plans = plans(problem);
    plans.retain_mut(|planned| {
        let [v, i] = largest(&planned.record, &best.state.model);
        planned.words += &format!(", up to {} and {} by the model", si(v, "V"), si(i, "A"));
        is_borne(problem, [v, i])
    });
    let name = |causes: &[usize]| {
        causes
            .iter()
            .map(|c| attribution.id(*c))
            .collect::<Vec<_>>()
            .join(" + ")
    };
    let mut list = Vec::new();
    for rival in ties {
        let mut scored: Vec<Experiment> = crate::parallel::map(&plans, |planned| Experiment {
            experiment: planned.words.clone(),
            file: format!("{FOLDER}/{}.csv", planned.name),
            separates: [name(&best.causes), name(&rival.causes)],
            separation: separation(problem, &planned.record, &best.state.model, &rival.state.model),
            played: played(problem, &planned.record),
        });
        scored.retain(|experiment| experiment.separation >= LEAST);
        scored.sort_by(|a, b| b.separation.total_cmp(&a.separation));
        list.extend(scored.into_iter().take(2));
    }
    list
}

/// What breaks a tie beside the experiments, for a reader; nothing where there is no tie.
#[must_use]
pub fn advice(findings: &Findings) -> Option<String> {
    let tied: Vec<&Named> = findings
        .causes
        .iter()
        .filter(|cause| !cause.rivals.is_empty())
        .collect();
    if tied.is_empty() {
        return None;
    }
    let rivals = tied.iter().flat_map(|cause| cause.rivals.iter().flatten().copied());
    let mut ids: Vec<&str> = tied.iter().map(|cause| cause.id).chain(rivals).collect();
    ids.sort_unstable();
    ids.dedup();
    let has_v_in = findings.compared.channels.contains(&"v_in");
    let none = match findings.next_experiments.is_empty() {
        true => "None of the experiments that are tried would break the tie.",
        false => "",
    };
    let source = match ids.contains(&SOURCE) && !has_v_in {
        true => " A column of the voltage at the converter's input (`v_in`) would show what the source does.",
        false => "",
    };
    let own = tied
        .iter()
        .flat_map(|cause| cause.parameters.keys().map(|name| (cause.id, *name)));
    let of_rivals = tied.iter().flat_map(|cause| cause.rival_values.iter().flatten());
    let moved: Vec<(&str, &str)> = own.chain(of_rivals.map(|value| (value.id, value.parameter))).collect();
    let key = |id: &&str| {
        let cause = CAUSES.iter().find(|cause| cause.id == *id)?;
        // the form that ties: a load's resistors have another key than its settings
        let is_moved = |form: &&Form| form.knobs.iter().all(|knob| moved.contains(&(*id, knob.name)));
        let form = cause.forms.iter().find(is_moved).unwrap_or(&cause.forms[0]);
        form.knobs[0].known_as().first()
    };
    let keys: Vec<String> = ids
        .iter()
        .filter_map(key)
        .map(|key| format!("--certain {key}"))
        .collect();
    let certain = match keys.is_empty() {
        true => String::new(),
        false => format!(
            " If you know one of these numbers of the model to be right, say so, and no cause changes it: {}.",
            keys.join(", ")
        ),
    };
    Some(format!("{none}{source}{certain}").trim_start().to_owned())
}

/// What a bench does for such a record.
fn played(problem: &Problem, record: &Record) -> Played {
    Played {
        period: problem.bases.t_sw,
        duty: record.duty.clone(),
        load: record.load.clone(),
        v_in: record.v_in_ratio * problem.base.plant.converter.v_in,
    }
}

/// How much more than the records show an experiment may ask of a bench, in voltage and in current: what its sizes are chosen for, 1.4 and 2
/// times the typical ones, with an overshoot of a third and of a filter that nothing damps.
const MORE: [f64; 2] = [1.8, 4.0];

/// Largest output voltage and inductor current at the sampling instants of an experiment.
fn largest(record: &Record, model: &Model) -> [f64; 2] {
    let made = Problem::new(vec![record.clone()], model.clone());
    let starts = made.first_starts(&made.base);
    let shown = crate::drive::simulate(model, &made.records[0], &starts.of(0));
    // what runs away is no number in the end, and no bench bears it
    let size = |value: f64| if value.is_nan() { f64::INFINITY } else { value.abs() };
    [0, 1].map(|n| shown.iter().map(|row| size(row[n])).fold(0.0, f64::max))
}

/// Whether it asks no more than that of a bench, as far as the records say what it has borne.
fn is_borne(problem: &Problem, largest: [f64; 2]) -> bool {
    let seen = |n: usize| {
        let values = problem.records.iter().flat_map(|record| &record.measured[n]);
        values
            .copied()
            .filter(|v| v.is_finite())
            .map(f64::abs)
            .fold(0.0, f64::max)
    };
    // without a column the typical size stands for it
    let seen = [seen(0).max(problem.bases.v), seen(1).max(problem.bases.i)];
    (0..2).all(|n| largest[n] <= MORE[n] * seen[n])
}

/// Measured with one model, fitted with the other.
fn separation(problem: &Problem, record: &Record, one: &Model, other: &Model) -> f64 {
    let mut made = Problem::new(vec![record.clone()], one.clone());
    made.sigma = problem.sigma.map(|s| if s.is_finite() { s } else { f64::INFINITY });
    let starts = made.first_starts(&made.base);
    let shown = crate::drive::simulate(one, &made.records[0], &starts.of(0));
    for n in 0..CHANNELS {
        if problem.sigma[n].is_finite() {
            made.records[0].measured[n] = shown.iter().map(|row| row[n]).collect();
        }
    }
    State::settle(&made, other, &starts, None).chi2.sqrt()
}

/// How something that is set runs over an experiment.
#[derive(Clone, Copy)]
enum Course {
    Still(f64),
    /// The first half and the second.
    Halves(f64, f64),
    /// Four levels.
    Stair(f64, f64),
    /// 0.03 up and down, pseudo-random.
    Trembling(f64),
}

impl Course {
    fn at(self, n: usize) -> f64 {
        match self {
            Course::Still(level) => level,
            Course::Halves(first, second) => [first, second][usize::from(n >= ROWS / 2)],
            Course::Stair(low, high) => low + (high - low) * (n / (ROWS / 4)) as f64 / 3.0,
            Course::Trembling(centre) => centre + if prbs(n) { 0.03 } else { -0.03 },
        }
    }
}

/// A maximum-length sequence of 7 bits, two periods a bit.
fn prbs(n: usize) -> bool {
    let mut state = 0x5bu32;
    for _ in 0..n / 2 {
        state = (state >> 1) ^ if state & 1 == 1 { 0x60 } else { 0 };
    }
    state & 1 == 1
}

/// An experiment that the bench can run.
struct Plan {
    /// Of its file.
    name: &'static str,
    words: String,
    duty: Course,
    /// Conductance over the typical one, current, power.
    load: (f64, Course, Course),
    /// Source voltage over that of the model.
    v_in_ratio: f64,
}

/// A plan as the record that it would give, without measured values.
struct Planned {
    name: &'static str,
    words: String,
    record: Record,
}

fn plans(problem: &Problem) -> Vec<Planned> {
    use Course::{Halves, Stair, Still, Trembling};
    let (v, i, v_in) = (problem.bases.v, problem.bases.i, problem.bases.v_in);
    // sizes of the plans are conventions: steps as large as a bench takes without leaving continuous conduction (but
    // for the light load), and a PRBS small enough that the response stays linear
    let topology = problem.base.plant.converter.topology;
    let duty_for = |share: f64| duty_for(topology, share * v, v_in).clamp(0.02, 0.9);
    let d = duty_for(1.0).max(0.1);
    let (low, high, ohms) = (duty_for(0.6), duty_for(1.4), v / i);
    let (few, many) = (0.3 * v * i, 1.2 * v * i);
    let none = Still(0.0);
    let rows = [
        (
            "duty-steps",
            format!("duty steps {low:.2} to {high:.2} at {ohms:.1} ohm"),
            Stair(low, high),
            (1.0, none, none),
        ),
        (
            "duty-prbs",
            format!("duty PRBS of 0.03 around {d:.2} at {ohms:.1} ohm"),
            Trembling(d),
            (1.0, none, none),
        ),
        (
            "load-steps",
            format!("load current steps {:.1} to {:.1} A at duty {d:.2}", 0.3 * i, 2.0 * i),
            Still(d),
            (0.2, Stair(0.3 * i, 2.0 * i), none),
        ),
        (
            "two-duties",
            format!("duty {low:.2} and {high:.2} at the same current of {i:.1} A"),
            Halves(low, high),
            (0.2, Still(i), none),
        ),
        (
            "light-load",
            format!("light load: {:.0} ohm at duty {d:.2}, with duty steps", 10.0 * ohms),
            Stair(duty_for(0.8), duty_for(1.2)),
            (0.1, none, none),
        ),
        (
            "zero-reading",
            "zero reading: duty 0 without load current (a converter that ends at 0 V shows offsets above 0 alone)"
                .to_owned(),
            none,
            (1.0, none, none),
        ),
        (
            "power-steps",
            format!(
                "constant power steps {few:.0} to {many:.0} W beside {:.0} ohm",
                2.0 * ohms
            ),
            Still(d),
            (0.5, none, Stair(few, many)),
        ),
    ];
    let mut list: Vec<Plan> = Vec::new();
    list.extend(rows.map(|(name, words, duty, load)| Plan {
        name,
        words,
        duty,
        load,
        v_in_ratio: 1.0,
    }));
    list.push(Plan {
        name: "half-source",
        words: format!("duty PRBS at half the source voltage, {:.0} V", 0.5 * v_in),
        duty: Trembling(d),
        load: (1.0, none, none),
        v_in_ratio: 0.5,
    });
    list.into_iter().map(|plan| planned(problem, plan)).collect()
}

/// The duty at which a loss-free converter has `v` at its output.
fn duty_for(topology: Topology, v: f64, v_in: f64) -> f64 {
    match topology {
        Topology::Buck => v / v_in,
        Topology::Boost => 1.0 - v_in / v,
        Topology::BuckBoost => v / (v + v_in),
    }
}

fn planned(problem: &Problem, plan: Plan) -> Planned {
    let phase = problem.base.plant.pwm.sampling_phase;
    let (conductance, current, power) = plan.load;
    let load = |n: usize| Load {
        conductance: conductance * problem.bases.i / problem.bases.v,
        current: current.at(n),
        power: power.at(n),
    };
    let record = Record {
        name: "planned".to_owned(),
        time: (0..ROWS).map(|n| (n as f64 + phase) * problem.bases.t_sw).collect(),
        phase,
        duty: (0..ROWS).map(|n| plan.duty.at(n).clamp(0.0, 1.0)).collect(),
        load: (0..ROWS).map(load).collect(),
        headers: QUANTITIES.map(str::to_owned),
        measured: std::array::from_fn(|_| vec![f64::NAN; ROWS]),
        lattice: [0.0; CHANNELS],
        resolution: [0.0; CHANNELS],
        v_in_ratio: plan.v_in_ratio,
        duty_is: measured::DutyIs::Commanded,
        is_true: [false; CHANNELS],
        settled: false,
        repeated: false,
        scatter: [f64::NAN; CHANNELS],
        clock: 0.0,
        metered: None,
        levels: Vec::new(),
        free_levels: Vec::new(),
        sampled: None,
        dense: true,
        segments: std::iter::once(0..ROWS).collect(),
        free_steps: Vec::new(),
        capture: None,
        unread: Vec::new(),
        ends: [None; CHANNELS],
        repairs: Vec::new(),
    };
    Planned {
        name: plan.name,
        words: plan.words,
        record,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the balance of the inductor's voltage over a period, `d v_on = (1 - d) v_off`.
    #[test]
    fn the_duty_of_an_experiment_is_that_of_its_converter() {
        let (v_in, v) = (12.0, 30.0);
        let boost = duty_for(Topology::Boost, v, v_in);
        assert!((boost * v_in - (1.0 - boost) * (v - v_in)).abs() < 1e-9, "{boost}");
        let inverting = duty_for(Topology::BuckBoost, v, v_in);
        assert!((inverting * v_in - (1.0 - inverting) * v).abs() < 1e-9, "{inverting}");
        assert_eq!(duty_for(Topology::Buck, 3.0, v_in), 0.25);
    }
}
