//! The interpreter over a log, with what the trainer applied behind each row.

use interp::{Controller, Real, Trace};
use policy::Policy;
use toml_input::{Faults, Message};

use super::duties::{self, Logged};
use super::explain::Course;
use super::log::{Done, Log};

/// What a logged duty may lie beyond a limit, as a share of it: eight units of the last place of binary32, which a duty worked out from a
/// scaled feature may be off by.
const ROUNDED: f64 = 1e-6;

/// The interpreter over all rows, with the trainer's duties behind each.
pub(super) fn course<T: Real>(policy: &Policy, log: &Log) -> Result<Course, Faults> {
    let mut controller = Controller::<T>::new(policy);
    let mut trace = controller.blank_trace();
    let mut course = Course::new(policy, &log.begins);
    let paths = policy.paths();
    let of = |(path, done)| Logged {
        policy,
        path,
        log,
        done,
    };
    let before: Vec<Vec<Option<f64>>> = paths.iter().zip(&log.done).map(of).map(duties::before).collect();
    for (row, samples) in log.samples.iter().enumerate() {
        if log.begins.get(row).copied().unwrap_or(row == 0) {
            controller.reset();
        }
        let mut state = controller.state().clone();
        for (output, before) in before.iter().enumerate() {
            if let Some(duty) = before.get(row).copied().flatten() {
                let mut own = state.output(output);
                own.previous_duty = commanded(&controller, output, T::nearest(duty));
                state.set_output(output, own);
            }
        }
        controller.restore(&state);
        controller.eval_into(samples, &mut trace)?;
        if !trace.sound {
            return Err(log.fault(row, no_duty(&controller)).into());
        }
        course.push(&trace);
        let q: Vec<f64> = trace.q_values.iter().map(|q| q.to_f64()).collect();
        for (output, (path, done)) in paths.iter().zip(&log.done).enumerate() {
            let logged = done.actions.as_ref().and_then(|actions| actions.get(row));
            if let (Some(logged), Some(own)) = (logged, course.outputs.get_mut(output)) {
                let q = q.get(path.columns()).unwrap_or_default();
                own.gives_up(q, [trace.decision(output).action_index, *logged]);
            }
        }
        for (output, done) in log.done.iter().enumerate() {
            apply(&controller, &mut trace, (output, done), row);
        }
        course.commanded(&trace);
        controller.commit_trace(&trace);
    }
    Ok(course)
}

/// A logged duty as the controller has it: a trainer that clips in binary32 ends half a unit of the last place beyond a limit that the
/// controller rounds inwards.
fn commanded<T: Real>(controller: &Controller<T>, output: usize, duty: T) -> T {
    let Some((low, high)) = controller.duty_before(output) else {
        return duty;
    };
    let is_rounded = |end: T| (duty.to_f64() - end.to_f64()).abs() <= ROUNDED * end.to_f64().abs();
    match (duty < low, duty > high) {
        (true, _) if is_rounded(low) => low,
        (_, true) if is_rounded(high) => high,
        _ => duty,
    }
}

fn no_duty<T: Real>(controller: &Controller<T>) -> Message {
    let state = controller.state();
    let outputs = 0..state.outputs();
    let before = outputs
        .clone()
        .map(|output| state.output(output).previous_duty.to_f64());
    let ends = outputs.filter_map(|output| controller.duty_before(output));
    let ends = ends.map(|(low, high)| format!("{} to {}", low.to_f64(), high.to_f64()));
    Message::new("the duty before this row is none that the controller commands")
        .found(listed(before.map(|duty| duty.to_string())))
        .expected(format!(
            "{}: what the actions give within [limits], initial_duty and the fallback's",
            listed(ends)
        ))
}

fn listed(words: impl Iterator<Item = String>) -> String {
    words.collect::<Vec<_>>().join(", ")
}

/// Puts what the trainer applied to an output in the place of the controller's own command.
fn apply<T: Real>(controller: &Controller<T>, trace: &mut Trace<T>, (output, done): (usize, &Done), row: usize) {
    if let Some(actions) = &done.actions {
        if let Some(action) = actions.get(row) {
            controller.choose_of(trace, output, *action);
        }
    } else if let Some(duty) = done.duty.as_ref().and_then(|duties| duties.get(row)) {
        let mut decision = trace.decision(output);
        decision.command.duty_sim = T::nearest(*duty);
        decision.command.duty = decision.command.duty_sim;
        trace.set_decision(output, decision);
    }
}
