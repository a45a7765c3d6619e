//! The policy in closed loop: a load step quickly, or all that `policyc simulate` does.

use std::path::Path;

use closed_loop::baselines::Kind;
use closed_loop::scenario::{Metrics, Record, Task};
use closed_loop::simulation::{Setting, simulate as run};
use closed_loop::{Course, LoadKind, LoadStep, Named, Scenario, interpreter_driving};
use plant::Parameters;
use policy::Policy;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::{Faults, Message, messages};

use crate::answer::Contract;
use crate::contract::load;
use crate::session::{Reply, Session, Tell, read, texts};

/// A load step at a plant.
#[derive(Deserialize)]
struct Step {
    /// The plant's file.
    plant: String,
    /// Numbers of the plant that take the place of its file's.
    #[serde(default)]
    set: Vec<(String, f64)>,
    /// Voltage to hold, V; the policy's own if nothing is said.
    v_ref: Option<f64>,
    /// Unit of the load: `W`, `A` or `ohm`.
    unit: String,
    /// Loads before and after, for each step.
    steps: Vec<[f64; 2]>,
    /// Names of classical controllers.
    beside: Vec<String>,
    /// Whether the limit is computed.
    limit: bool,
    /// Control periods after the step.
    after: usize,
}

/// Control periods before the step: those of the default scenario, in which a controller comes to rest.
const LEAD: usize = 300;
/// Longest run after the step in control periods; a page that lives answers in a moment.
const LONGEST: usize = 5000;

#[derive(Serialize)]
struct Shown {
    v_ref: f64,
    steps: Vec<OneStep>,
    notes: Vec<String>,
    /// Numbers of the plant as they were simulated.
    plant: Vec<(&'static str, f64)>,
}

#[derive(Serialize)]
struct OneStep {
    from: f64,
    to: f64,
    band: f64,
    curves: Vec<Curve>,
    /// Deviation in V and settling in s that no controller can beat, at a sampling instant.
    limit: Option<(f64, f64)>,
}

/// A controller over the load step.
#[derive(Serialize)]
struct Curve {
    name: String,
    metrics: Metrics,
    /// s from the step.
    time: Vec<f64>,
    v_out: Vec<f64>,
    i_l: Vec<f64>,
    duty: Vec<f64>,
}

impl Curve {
    fn of(name: String, course: &Course, since: f64) -> Self {
        let records: Vec<&Record> = course.shown.periods.iter().map(|period| &period.record).collect();
        let late: Vec<&Record> = records.into_iter().filter(|record| record.time >= since).collect();
        let all = |figure: fn(&Record) -> f64| late.iter().map(|record| figure(record)).collect();
        Curve {
            name,
            metrics: course.shown.metrics,
            time: all(|record| record.time),
            v_out: all(|record| record.sample.v_out),
            i_l: all(|record| record.sample.i_l),
            duty: all(|record| record.duty),
        }
    }
}

/// Load steps at one instant each.
pub(crate) fn step(session: &Session, request: &Value, _: Tell) -> Result<Reply, Faults> {
    let of = read::<Contract>(request)?;
    let policy = load(session, &of)?;
    let setting = setting(session, &read(request)?, policy, of.output)?;
    let before = 20.0 * setting.policy.sample_period;
    let named = vec![interpreted(&setting)?];
    let found = run(setting, named, &mut |_| Ok(()))?;
    let steps = found.steps.iter().map(|step| OneStep {
        from: step.step.values[0],
        to: step.step.values[1],
        band: step
            .courses
            .first()
            .map_or(0.0, |(_, course)| course.shown.metrics.band),
        curves: (step.courses.iter())
            .map(|(name, course)| Curve::of(name.clone(), course, -before))
            .collect(),
        limit: (step.limits.first()).map(|(_, limit)| (limit.at_sample.deviation, limit.at_sample.settling)),
    });
    let parameters = found.setting.converter.parameters();
    Reply::of(&Shown {
        v_ref: found.setting.v_ref,
        steps: steps.collect(),
        notes: found.notes(),
        plant: plant::parameters().map(|p| (p.key, p.get(parameters))).collect(),
    })
}

fn setting(session: &Session, step: &Step, policy: Policy, output: Option<String>) -> Result<Setting, Faults> {
    let kinds = [LoadKind::Power, LoadKind::Current, LoadKind::Resistance];
    let units = kinds.map(LoadKind::unit);
    let kind = kinds.into_iter().find(|kind| kind.unit() == step.unit);
    let kind = kind.ok_or_else(|| messages::unknown("unit of a load", &step.unit, &units))?;
    let names = Kind::ALL.map(Kind::name);
    let baseline = |name: &String| {
        let found = Kind::ALL.into_iter().find(|kind| kind.name() == name);
        found.ok_or_else(|| messages::unknown("classical controller", name, &names))
    };
    if !(1..=LONGEST).contains(&step.after) {
        let message = Message::new("so many control periods are not shown").found(step.after.to_string());
        return Err(message.expected(format!("1 to {LONGEST}")).into());
    }
    let range = kind.range();
    if let Some(value) = step.steps.iter().flatten().find(|value| !range.contains(value)) {
        let message = Message::new("there is no such load").found(format!("{value} {}", step.unit));
        return Err(message.expected(format!("{} to {}", range.start(), range.end())).into());
    }
    let file = Path::new(&step.plant);
    let scenario = Scenario {
        set: within(&step.set)?,
        v_ref: step.v_ref,
        output,
        load_steps: (step.steps.iter())
            .map(|values| LoadStep {
                kind,
                ..LoadStep::from(*values)
            })
            .collect(),
        default_steps: false,
        task: Task {
            instants: 1,
            sampling_instants: 1,
            lead: LEAD,
            after: step.after,
            tail: (step.after / 3).max(1),
            ..Task::default()
        },
        baselines: step.beside.iter().map(baseline).collect::<Result<_, _>>()?,
        limits: if step.limit { vec![[0.0, 1.0]] } else { Vec::new() },
        ..Scenario::from_toml(file, "")?
    };
    Setting::new(file, scenario, policy, Some(session.named(&step.plant)))
}

/// Numbers of a plant within what it allows.
fn within(set: &[(String, f64)]) -> Result<Vec<(String, f64)>, Faults> {
    for (key, value) in set {
        let Some(parameter) = plant::parameter(key) else {
            continue;
        };
        let (low, high) = parameter.allowed;
        if !(low..=high).contains(value) {
            let message = messages::out_of_range(key, &value.to_string(), &format!("{low} to {high}"));
            return Err(message.into());
        }
    }
    Ok(set.to_vec())
}

fn interpreted(setting: &Setting) -> Result<Named, Faults> {
    Ok(Named {
        name: "interpreter".to_owned(),
        controller: interpreter_driving(&setting.policy, setting.output)?,
    })
}

/// What is simulated.
#[derive(Deserialize)]
struct Wanted {
    /// The scenario.
    scenario: String,
}

#[derive(Serialize)]
struct Simulated {
    summary: String,
}

/// All that `policyc simulate` writes.
pub(crate) fn simulate(session: &Session, request: &Value, tell: Tell) -> Result<Reply, Faults> {
    let Wanted { scenario: file } = read(request)?;
    let of = read::<Contract>(request)?;
    let mut scenario = Scenario::load(session.named(&file))?;
    // what the file says counts, as the page shows the file
    scenario.output = scenario.output.or(of.output.clone());
    let policy = load(session, &of)?;
    let setting = Setting::new(Path::new(&file), scenario, policy, None)?;
    let named = vec![interpreted(&setting)?];
    let found = run(setting, named, &mut |next| {
        tell(&next.what.to_string());
        Ok(())
    })?;
    let answer = Simulated {
        summary: found.summary(),
    };
    Reply::with(&answer, texts(found.files()?))
}

/// The numbers of a plant's file.
pub(crate) fn plant_of(session: &Session, file: &str, what: &str) -> Result<Parameters, Faults> {
    Parameters::buck_from_file(session.named(file), what)
}
