//! Causes that these records would show only if they were larger than usual.

use plant::{Parameters, Rectifier};

use crate::attribute::Attribution;
use crate::causes::Candidate;
use crate::findings::Hidden;
use crate::problem::Problem;
use crate::record::CHANNELS;

/// Whether the circuit has what these keys change: the diodes of a synchronous leg conduct in its dead time alone, and its node waits in that alone.
fn conducts(plant: &Parameters, keys: &[&str]) -> bool {
    let is_of_diode = keys
        .iter()
        .any(|key| ["switch.v_f", "switch.r_d", "switch.node_capacitance"].contains(key));
    let has_diode = plant.converter.rectifier == Rectifier::Diode || plant.switch.dead_time > 0.0;
    has_diode || !is_of_diode
}

/// Each with the smallest change that would be seen.
pub fn hidden(problem: &Problem, attribution: &Attribution) -> Vec<Hidden> {
    let sizes = attribution.smallest_sizes(problem);
    let mut list: Vec<Hidden> = Vec::new();
    for (cause, smallest) in sizes {
        let candidate = &attribution.candidates[cause];
        let knob = &candidate.form.knobs[0];
        // what may stand in the place of a cause is seen, though not beside it
        let is_rival = attribution
            .rivals
            .iter()
            .flatten()
            .flat_map(|fit| &fit.causes)
            .any(|one| attribution.same(*one, cause));
        // one parameter of several forms is one parameter
        let is_listed = list
            .iter()
            .any(|one| (one.id, one.parameter) == (candidate.cause.id, knob.name));
        if is_rival || is_listed || !conducts(&attribution.state().model.plant, knob.keys) {
            continue;
        }
        let reach = candidate.reach();
        // what would be seen at a usual size is not worth a line
        if smallest > candidate.large().min(reach) && is_there(problem, candidate) {
            list.push(Hidden {
                id: candidate.cause.id,
                parameter: knob.name,
                smallest: (smallest <= reach).then_some(smallest),
                reach,
                unit: knob.unit(),
            });
        }
    }
    list
}

/// The sensors of the channels, as the plant names them.
const SENSORS: [&str; CHANNELS] = ["sensors.v_out.", "sensors.i_l.", "sensors.i_out.", "sensors.v_in."];

/// Whether the records have the load or the channel that a cause changes: an error of a load that nobody connected, or of a meter that
/// nobody read, is not hidden in them.
pub(crate) fn is_there(problem: &Problem, candidate: &Candidate) -> bool {
    let loads = || problem.records.iter().flat_map(|record| &record.load);
    let is_of_something = |key: &&str| match *key {
        "load.cpl_time_constant" | "load.v_fold" => loads().any(|load| load.power != 0.0),
        "load.setting_gain" => loads().any(|load| load.current != 0.0 || load.power != 0.0),
        "load.resistor_gain" => loads().any(|load| load.conductance != 0.0),
        key => SENSORS
            .iter()
            .position(|sensor| key.starts_with(sensor))
            .is_none_or(|channel| {
                problem.records.iter().any(|record| match &record.capture {
                    Some(capture) => capture.mean(channel).is_some(),
                    None => record.measured[channel].iter().any(|v| v.is_finite()),
                })
            }),
    };
    // the sampling instant has no key, and every record has one
    let keys = candidate.form.knobs[0].keys;
    keys.is_empty() || keys.iter().any(is_of_something)
}
