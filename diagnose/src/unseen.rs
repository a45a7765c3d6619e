//! Causes that these records would show only if they were larger than usual.

use crate::attribute::Attribution;
use crate::findings::Hidden;
use crate::problem::Problem;

/// Each with the smallest change that would be seen.
pub fn hidden(problem: &Problem, attribution: &Attribution) -> Vec<Hidden> {
    let sizes = attribution.smallest_sizes(problem);
    let mut list: Vec<Hidden> = Vec::new();
    for (cause, smallest) in sizes {
        let candidate = &attribution.candidates[cause];
        let knob = &candidate.form.knobs[0];
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
