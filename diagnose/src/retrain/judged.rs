//! The closed loop with the policy that was and the one that is new, on the extended plant and on every plant of a tie.

use closed_loop::baselines::{Baseline, Kind};
use closed_loop::controller::{Classical, Controller, Period};
use closed_loop::scenario::{Finding, Metrics, Task, survey_all};
use closed_loop::{Agent, Converter, Error, LoadStep, follow};
use plant::{Parameters, Sample};
use policy::Policy;
use serde::Serialize;

use super::{Correction, Plan};

/// Names of the controllers in tables.
pub const OLD: &str = "policy before";
/// The one that was trained anew.
pub const NEW: &str = "trained anew";
const PID: &str = "pid";
/// Name of the extended plant among the places.
pub const EXTENDED: &str = "extended model";

/// A cost within this share of another is the same: two trainings of one task with other seeds differ by more.
const SAME: f64 = 0.02;

/// A controller on one load step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figures {
    /// Such as `200 -> 800 W`.
    pub load_step: String,
    /// The worst of the sampling instants.
    pub at_sample: Metrics,
    /// The worst of all instants.
    pub worst: Metrics,
}

/// A controller on one plant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Which.
    pub controller: &'static str,
    /// By the specification of the training; smaller is better.
    pub cost: f64,
    /// Load step by load step.
    pub steps: Vec<Figures>,
}

impl Line {
    /// The largest of a figure over all load steps.
    #[must_use]
    pub fn worst(&self, of: fn(&Metrics) -> f64) -> f64 {
        self.steps.iter().map(|step| of(&step.worst)).fold(0.0, f64::max)
    }
}

/// All controllers on one plant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Place {
    /// [`EXTENDED`], or the causes that would have to be true.
    pub plant: String,
    /// The controllers.
    pub controllers: Vec<Line>,
}

impl Place {
    /// A controller by its name.
    #[must_use]
    pub fn line(&self, name: &str) -> Option<&Line> {
        self.controllers.iter().find(|line| line.controller == name)
    }
}

/// Which of the two policies is the better one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Advice {
    /// The new one, wherever it was tried.
    New,
    /// Neither: they cost the same.
    Same,
    /// The old one, at the extended plant or at one of the tie.
    Old,
    /// There is no old one.
    Alone,
}

/// What a training was worth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Retrained {
    /// The folder of the policy, below that of the diagnosis.
    pub policy: String,
    /// Voltage to hold, V; the figures count true voltages from here.
    pub v_ref: f64,
    /// Which policy to take.
    pub advice: Advice,
    /// The same with its figures.
    pub sentence: String,
    /// Errors of sensors that the new contract takes out.
    pub corrections: Vec<Correction>,
    /// What to know of files and training.
    pub notes: Vec<String>,
    /// The extended plant first.
    pub places: Vec<Place>,
}

/// Figures and a picture's data.
#[derive(Debug, Clone)]
pub struct Judged {
    /// For `diagnosis.json`.
    pub findings: Retrained,
    /// The load step that is shown.
    pub shown_step: String,
    /// Each controller at its first instant.
    pub shown: Vec<(&'static str, Vec<Period>)>,
}

/// What is judged, and by what.
pub struct Asked<'a> {
    /// Where the new policy lies.
    pub folder: String,
    /// The policy before, if there is one.
    pub old: Option<&'a Policy>,
    /// The one that was trained.
    pub new: &'a Policy,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Load steps of the evaluation.
    pub task: &'a Task,
    /// Corrections that the contract of the new one has.
    pub corrections: Vec<Correction>,
    /// Signals that the new contract corrects before they are numbers ([`super::contract::Corrected::before`]).
    pub before: Vec<&'static str>,
    /// What to know besides.
    pub notes: Vec<String>,
    /// What findings over all load steps cost.
    pub cost: &'a dyn Fn(&[Finding]) -> f64,
}

/// Closes the loop with both policies, and with a PID controller where the plant has one.
///
/// # Errors
/// If a policy does not fit a plant, or a plant is none.
pub fn judged(plan: &Plan, asked: Asked<'_>) -> Result<Judged, Error> {
    let policies: Vec<(&'static str, &Policy)> = (asked.old.map(|old| (OLD, old)).into_iter())
        .chain([(NEW, asked.new)])
        .collect();
    let pid = pid(&plan.plant, &asked);
    let mut places = vec![place(
        EXTENDED.to_owned(),
        &plan.plant,
        &policies,
        pid.as_ref(),
        &asked,
    )?];
    for rival in &plan.rivals {
        places.push(place(rival.causes.clone(), &rival.plant, &policies, None, &asked)?);
    }
    let advice = advice(&places);
    let worst = shown_step(&places[0]);
    let shown_step = asked.task.load_steps.get(worst).map(|step| LoadStep::from(*step));
    let mut shown = Vec::new();
    if let Some(step) = shown_step {
        let mut controllers: Vec<(&'static str, Box<dyn Controller>)> = Vec::new();
        for (name, policy) in &policies {
            controllers.push((*name, Box::new(Agent::<f32>::new(policy)?)));
        }
        controllers.extend(pid.map(|pid| (PID, Box::new(Classical::from(pid)) as Box<dyn Controller>)));
        let converters = [
            Converter::new(&plan.plant)?,
            Converter::new(&as_seen_by_new(&plan.plant, &asked))?,
        ];
        let instant = asked.task.all_instants()[0];
        for (name, mut controller) in controllers {
            let run = follow(
                &converters[usize::from(name == NEW)],
                controller.as_mut(),
                asked.v_ref,
                asked.task,
                step,
                instant,
            )?;
            shown.push((name, run.periods));
        }
    }
    Ok(Judged {
        findings: Retrained {
            sentence: sentence(advice, &places),
            policy: asked.folder,
            v_ref: asked.v_ref,
            advice,
            corrections: asked.corrections,
            notes: asked.notes,
            places,
        },
        shown_step: shown_step.map_or_else(String::new, |step| step.to_string()),
        shown,
    })
}

/// A plant whose sensors are right where the new contract corrects them before a simulation sees them.
fn as_seen_by_new(plant: &Parameters, asked: &Asked<'_>) -> Parameters {
    let numbers = super::true_sensors(&asked.before);
    let numbers: Vec<(&str, f64)> = numbers.iter().map(|(key, value)| (key.as_str(), *value)).collect();
    closed_loop::environment::varied(plant, &numbers)
}

/// It knows L, C and the source of the extended plant, and no losses; none where its topology has none.
fn pid(plant: &Parameters, asked: &Asked<'_>) -> Option<Baseline> {
    let most = asked
        .task
        .load_steps
        .iter()
        .flatten()
        .fold(0.0_f64, |most, power| most.max(*power));
    Baseline::new(Kind::Pid, plant, asked.v_ref, most / asked.v_ref).ok()
}

fn place(
    name: String,
    plant: &Parameters,
    policies: &[(&'static str, &Policy)],
    pid: Option<&Baseline>,
    asked: &Asked<'_>,
) -> Result<Place, Error> {
    let converter = Converter::new(plant)?;
    let seen_by_new = Converter::new(&as_seen_by_new(plant, asked))?;
    let (task, v_ref) = (asked.task, asked.v_ref);
    let instants = task.all_instants();
    let mut controllers = Vec::new();
    for (name, policy) in policies {
        // figures, not bits: binary32 will do for every format
        let mut agent = Agent::<f32>::new(policy)?;
        // the signals fit since `Agent::new`; a NaN would end the run as a divergence
        let control = move |sample: &Sample| agent.step(&sample.measured).unwrap_or(f64::NAN);
        let converter = if *name == NEW { &seen_by_new } else { &converter };
        let findings = survey_all(converter, &control, v_ref, task, &instants)?;
        controllers.push(line(name, &findings, asked));
    }
    if let Some(pid) = pid {
        let mut pid = pid.clone();
        let control = move |sample: &Sample| pid.step(sample);
        let findings = survey_all(&converter, &control, v_ref, task, &instants)?;
        controllers.push(line(PID, &findings, asked));
    }
    Ok(Place {
        plant: name,
        controllers,
    })
}

fn line(controller: &'static str, findings: &[Finding], asked: &Asked<'_>) -> Line {
    let figures = |finding: &Finding| Figures {
        load_step: finding.step().to_string(),
        at_sample: finding.at_sample,
        worst: finding.worst,
    };
    Line {
        controller,
        cost: (asked.cost)(findings),
        steps: findings.iter().map(figures).collect(),
    }
}

/// The new policy has to be the better one where the tie is about something else, too.
fn advice(places: &[Place]) -> Advice {
    let cost = |place: &Place, name: &str| place.line(name).map(|line| line.cost);
    let pairs: Option<Vec<(f64, f64)>> = (places.iter())
        .map(|place| Some((cost(place, OLD)?, cost(place, NEW)?)))
        .collect();
    let Some(pairs) = pairs else {
        return Advice::Alone;
    };
    let is_worse = |(old, new): &(f64, f64)| *new > old * (1.0 + SAME);
    let is_better = |(old, new): &(f64, f64)| *new < old * (1.0 - SAME);
    match (pairs.iter().any(is_worse), pairs.first().is_some_and(is_better)) {
        (true, _) => Advice::Old,
        (false, true) => Advice::New,
        (false, false) => Advice::Same,
    }
}

/// The load step that the policy before holds worst, or else the new one.
fn shown_step(place: &Place) -> usize {
    let Some(line) = place.line(OLD).or(place.line(NEW)) else {
        return 0;
    };
    let size = |n: &usize| line.steps[*n].worst.deviation;
    (0..line.steps.len())
        .max_by(|a, b| size(a).total_cmp(&size(b)))
        .unwrap_or(0)
}

fn sentence(advice: Advice, places: &[Place]) -> String {
    let figures = |name: &str| {
        let line = places.first()?.line(name)?;
        let (deviation, tail) = (line.worst(|m| m.deviation), line.worst(|m| m.tail_mean));
        Some(format!(
            "{deviation:.3} V after a step and {tail:.3} V on the mean at rest"
        ))
    };
    let new = figures(NEW).unwrap_or_default();
    let said = match figures(OLD) {
        Some(old) => format!(
            "On the extended model the worst load step is off by {old} with the policy before, by {new} with the new one."
        ),
        None => format!("On the extended model the worst load step is off by {new}."),
    };
    let word = match advice {
        Advice::New => " By the specification of the training the new policy is the better one.",
        Advice::Same => {
            " By the specification of the training they are the same: there is no need to change the policy."
        }
        Advice::Old => {
            let is_only_elsewhere = places.first().is_some_and(|place| advice_at(place) != Advice::Old);
            match is_only_elsewhere {
                true => {
                    " The tie decides: if another of its explanations is the true one, the new policy is the worse one. Keep the policy until an \
                         experiment has broken the tie."
                }
                false => {
                    " By the specification of the training the new policy is the worse one: keep the policy, or train longer."
                }
            }
        }
        Advice::Alone => "",
    };
    said + word
}

fn advice_at(place: &Place) -> Advice {
    advice(std::slice::from_ref(place))
}
