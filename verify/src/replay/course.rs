//! The interpreter over a log, with what the trainer applied behind each row.

use interp::{Controller, Real, Trace};
use policy::Policy;
use toml_input::{Faults, Message};

use super::duties::{self, Logged};
use super::explain::Course;
use super::log::{Done, Log};

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
                own.previous_duty = T::nearest(duty);
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

fn no_duty<T: Real>(controller: &Controller<T>) -> Message {
    let state = controller.state();
    let before = (0..state.outputs()).map(|output| state.output(output).previous_duty.to_f64().to_string());
    let before: Vec<String> = before.collect();
    Message::new("the duty before this row is none that the contract's actions command")
        .found(before.join(", "))
        .expected("one between the smallest and the largest of [actions] duties, initial_duty and the fallback's")
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
