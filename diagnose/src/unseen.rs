//! Causes that these records would show only if they were larger than usual.

use plant::{Parameters, Rectifier};

use crate::attribute::Attribution;
use crate::findings::Hidden;
use crate::problem::Problem;

/// Whether the circuit has what these keys change: the diodes of a synchronous leg conduct in its dead time alone.
fn conducts(plant: &Parameters, keys: &[&str]) -> bool {
    let is_of_diode = keys.iter().any(|key| ["switch.v_f", "switch.r_d"].contains(key));
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
        // one parameter of several forms is one parameter
        let is_listed = list
            .iter()
            .any(|one| (one.id, one.parameter) == (candidate.cause.id, knob.name));
        if is_listed || !conducts(&attribution.state().model.plant, knob.keys) {
            continue;
        }
        let reach = candidate.reach();
        // what would be seen at a usual size is not worth a line
        if smallest > candidate.large().min(reach) {
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
