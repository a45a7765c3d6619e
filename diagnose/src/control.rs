//! What the extension is worth under control: a policy on the extended model, with the mapping it has and with one that is
//! fitted to that model.

use closed_loop::controller::Period;
use closed_loop::refit::{AtEnvironment, Refit};
use closed_loop::scenario::{Finding, Metrics, Task};
use closed_loop::{Agent, Converter, Error, LoadKind, LoadStep, follow};
use drm::DutyRatioMap;
use drm::acquire::{Hold, LoadSetting};
use drm::formula::Losses;
use plant::Parameters;
use policy::{Coefficients, Policy};
use serde::Serialize;
use toml_input::Message;

use crate::record::Record;

/// Duties that differ by less are one: twice the accuracy of a model of ideal edges, and 0.2 V at 200 V.
const SAME_DUTY: f64 = 1e-3;
/// Share of the largest load from which load steps start where no scenario is given: that of the paper, 200 W of 1 kW.
const LIGHT: f64 = 0.2;

/// The policy on one load step, each figure the worst of all instants.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Course {
    /// Such as `200 -> 800 W`.
    pub load_step: String,
    /// In the simulation that it was trained in.
    pub simulation: Metrics,
    /// On the extended model with its own mapping.
    pub before: Metrics,
    /// On the extended model with the refitted mapping.
    pub after: Metrics,
}

/// What is written to `gain.closed_loop`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClosedLoop {
    /// Name of the policy.
    pub policy: String,
    /// Voltage to hold, V; the figures count true voltages from here.
    pub v_ref: f64,
    /// What the loop is closed on.
    pub judge: &'static str,
    /// The policy's own mapping.
    pub mapping_before: Coefficients,
    /// The one from the extended model; the same where that would move no duty by 1e-3.
    pub mapping_after: Coefficients,
    /// Whether they differ.
    pub refitted: bool,
    /// Largest difference of their duties within the valid range, 1.
    pub largest_change: f64,
    /// Rms error of the refitted mapping, leaving each settled point out, V.
    pub fit_error: f64,
    /// Each load step.
    pub steps: Vec<Course>,
    /// What the mapping does not repair.
    pub beyond_repair: Vec<String>,
}

/// Figures, files and a picture's data.
#[derive(Debug, Clone)]
pub struct Control {
    /// For `diagnosis.json`.
    pub findings: ClosedLoop,
    /// Text of the `drm.toml` of the refitted mapping.
    pub mapping: String,
    /// The load step that is shown.
    pub shown_step: String,
    /// Simulation, before, after: the shown load step at its first instant.
    pub shown: [Vec<Period>; 3],
}

/// A policy and what is asked of it.
#[derive(Debug, Clone)]
pub struct Request {
    /// The policy, with a mapping.
    pub policy: Policy,
    /// Index of the output that drives the converter, and whose mapping is refitted; 0 of a policy with one.
    pub output: usize,
    /// The converter it was trained on.
    pub trained_on: Parameters,
    /// Steady state of that.
    pub losses: Losses,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Load steps; if empty, those of [`load_steps`].
    pub load_steps: Vec<LoadStep>,
    /// Instants and periods.
    pub task: Task,
}

/// Load steps over the loads that the records have: from a fifth of the largest to half of it and to all of it, and back.
/// Constant power if any record has it, else current.
#[must_use]
pub fn load_steps<'a>(records: impl Iterator<Item = &'a Record>, v_ref: f64) -> Vec<LoadStep> {
    let (mut most, mut any_power) = (0.0_f64, false);
    for record in records {
        for load in &record.load {
            most = most.max(load.current + load.conductance * v_ref + load.power / v_ref);
            any_power |= load.power > 0.0;
        }
    }
    let (kind, most) = if any_power {
        (LoadKind::Power, most * v_ref)
    } else {
        (LoadKind::Current, most)
    };
    let two_digits = |x: f64| format!("{x:.1e}").parse().unwrap_or(x);
    let [low, middle, high] = [LIGHT, 0.5, 1.0].map(|share| two_digits(share * most));
    let steps = [[low, middle], [low, high], [middle, low], [high, low]];
    steps.map(|values| LoadStep { kind, ..values.into() }).to_vec()
}

/// Fits a mapping to `extended` and closes the loop with and without it.
///
/// # Errors
/// If the policy does not fit the converter, or the settled points determine no mapping.
pub fn control(request: &Request, extended: &Parameters) -> Result<Control, Error> {
    // only to fit: the runs below have ripple and noise
    let (nominal, real) = (quiet(&request.trained_on), quiet(extended));
    let refit = Refit {
        policy: &request.policy,
        output: request.output,
        nominal: &nominal,
        trained_on: request.losses,
        v_ref: request.v_ref,
        load_steps: &request.load_steps,
    };
    let report = refit.fit(&acquire(&refit, &read_as_trained(&real, &request.trained_on))?)?;
    let own = request
        .policy
        .path(request.output)
        .mapping
        .map_or(DutyRatioMap::IDENTITY, DutyRatioMap::from);
    let fitted = report.fit.map.rounded();
    let largest_change = furthest(&own, &fitted);
    let refitted = largest_change > SAME_DUTY;
    let map = if refitted { fitted } else { own };
    let (unmapped, after) = (refit.with(&DutyRatioMap::IDENTITY)?, refit.with(&map)?);
    let runs = [
        // in the simulation of its training a policy needs no mapping
        run(request, &unmapped, &request.trained_on)?,
        run(request, &request.policy, extended)?,
        run(request, &after, extended)?,
    ];
    let course = |(n, step): (usize, &LoadStep)| Course {
        load_step: step.to_string(),
        simulation: runs[0][n].0,
        before: runs[1][n].0,
        after: runs[2][n].0,
    };
    let steps: Vec<Course> = request.load_steps.iter().enumerate().map(course).collect();
    let size = |n: &usize| runs[1][*n].0.deviation;
    let most = (0..steps.len()).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let comment = format!(
        "From the extended model by `policyc diagnose --policy`, for policy {}; no bench time.\n{} points, leave-one-out \
         {:.4} V rms.",
        request.policy.name,
        report.fit.rows.len(),
        report.fit.left_out.rms_v
    );
    Ok(Control {
        mapping: map.to_toml(&comment),
        shown_step: steps
            .get(most)
            .map_or_else(String::new, |course| course.load_step.clone()),
        findings: ClosedLoop {
            policy: request.policy.name.clone(),
            v_ref: request.v_ref,
            judge: "extended model",
            mapping_before: own.coefficients,
            mapping_after: map.coefficients,
            refitted,
            largest_change,
            fit_error: report.fit.left_out.rms_v,
            steps,
            beyond_repair: refit.beyond_repair(&real, &map)?,
        },
        shown: runs.map(|mut run| {
            if most < run.len() {
                run.swap_remove(most).1
            } else {
                Vec::new()
            }
        }),
    })
}

/// A mapping is one of settled points: noise would only have to be averaged away, and under a ripple nothing settles.
fn quiet(converter: &Parameters) -> Parameters {
    let mut quiet = converter.clone();
    quiet.source.ripple = 0.0;
    for sensor in crate::drive::sensors(&mut quiet) {
        sensor.noise = 0.0;
    }
    quiet
}

/// The converter with the voltmeter of the training: no duty repairs a wrong one. A mapping that was fitted to its readings would hold these
/// where the policy wants the voltage, and would be wrong as soon as the contract takes the error out. A load current that is shown wrong stays:
/// the mapping is that of the contract as it is, whose loop reads it so.
fn read_as_trained(converter: &Parameters, trained_on: &Parameters) -> Parameters {
    let mut read = converter.clone();
    let known = &trained_on.sensors.v_out;
    (read.sensors.v_out.gain, read.sensors.v_out.offset) = (known.gain, known.offset);
    read
}

/// Settled points of the extended model as CSV.
fn acquire(refit: &Refit<'_>, extended: &Parameters) -> Result<String, Error> {
    let mut plan = refit.plan(extended.converter.v_in)?;
    let mut bench = AtEnvironment(Converter::new(extended)?);
    for entry in &mut plan.points {
        // what draws a current does not matter, and a current is stable where constant power is not
        if let (LoadSetting::Power(_), Hold::ClosedLoop(v_out)) = (entry.0.load, entry.0.hold) {
            entry.0.load = LoadSetting::Current(entry.0.load.current(v_out));
        }
        refit.measure(&mut bench, entry)?;
    }
    plan.to_csv().map_err(|error| Message::new(error.to_string()).into())
}

/// Largest difference of the duties of two mappings over the valid range of the second: at a corner, for both are linear
/// in each variable.
fn furthest(own: &DutyRatioMap, fitted: &DutyRatioMap) -> f64 {
    let (i, d) = (fitted.valid_i_out, fitted.valid_d_sim);
    let corners = [(d.low, i.low), (d.low, i.high), (d.high, i.low), (d.high, i.high)];
    let change = |(d, i): (f64, f64)| (own.apply(d, i) - fitted.apply(d, i)).abs();
    corners.into_iter().map(change).fold(0.0, f64::max)
}

/// The policy over all load steps at a converter: figures, and the periods of each step's first instant.
fn run(request: &Request, policy: &Policy, converter: &Parameters) -> Result<Vec<(Metrics, Vec<Period>)>, Error> {
    let environment = Converter::new(converter)?;
    // figures, not bits: binary32 will do for every format
    let mut agent = Agent::<f32>::driving(policy, request.output)?;
    let mut one = |step: &LoadStep| {
        let mut finding = Finding::new(*step);
        let mut shown = None;
        for instant in request.task.all_instants() {
            let trajectory = follow(&environment, &mut agent, request.v_ref, &request.task, *step, instant)?;
            finding.add(instant, trajectory.metrics);
            shown.get_or_insert(trajectory.periods);
        }
        Ok((finding.worst, shown.unwrap_or_default()))
    };
    request.load_steps.iter().map(&mut one).collect()
}
