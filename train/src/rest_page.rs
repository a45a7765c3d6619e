//! What the best policy decides around its rest, for the page of a training.

use closed_loop::{Converter, rest_map};
use plant::Load;
use report::{Axis, HeatMap, Ramp, Section};

use crate::faults::Error;
use crate::outcome::Outcome;
use crate::settings::Settings;
use crate::summary::Worst;

/// Cells along each side: smooth to the eye, and a moment's work.
const CELLS: usize = 60;

/// `section` with a map at the smallest and one at the largest load of the evaluation.
///
/// # Errors
/// If the policy does not run at the converter, which it was trained at.
pub(crate) fn around_rest(
    section: Section,
    settings: &Settings,
    best: &Outcome,
    converter: &Converter,
) -> Result<Section, Error> {
    let v_ref = settings.reward.v_ref;
    let powers = || settings.evaluation.load_steps.iter().flatten().copied();
    let (low, high) = (powers().fold(f64::INFINITY, f64::min), powers().fold(0.0, f64::max));
    if high <= low {
        return Ok(section);
    }
    // as far as a load step takes it: the deviation that was found, the current that is missing at once
    let band = closed_loop::scenario::settled_band(v_ref);
    let found = Worst::of(&best.findings).deviation;
    // a policy that was lost shows the voltages at which an episode ends
    let reach = if found.is_finite() {
        found
    } else {
        settings.episode.max_error
    };
    let errors = centres(reach.clamp(band, settings.episode.max_error.max(band)));
    let currents = centres((high - low) / v_ref);
    let mut section = section;
    for power in [low, high] {
        let axes = [errors.clone(), currents.clone()];
        let map = rest_map(&best.policy, converter, v_ref, Load::power(power), axes)?;
        let (x, y): (Vec<f64>, Vec<f64>) = map.cycle.iter().map(|[error, current]| (*error, *current)).unzip();
        let picture = HeatMap::new(
            format!("Duty around rest at {power} W"),
            Axis::new("error of v_out").unit("V"),
            Axis::new("charging current").unit("A"),
        )
        .values(Axis::new("duty"), map.errors, map.currents, map.duties)
        .ramp(Ramp::Sequential)
        .dots("samples at rest", x, y);
        section = section.chart_or_reason(picture.svg(), CAPTION);
    }
    Ok(section)
}

const CAPTION: &str = "The duty before mapping and limits at this error and this current into the output capacitor; what else the controller \
    remembers is that of its rest. The dots are the sampling instants of two hundred control periods at rest, without the sensors' noise: one dot is \
    a point of rest, a ring or a few dots far apart are a limit cycle.";

fn centres(reach: f64) -> Vec<f64> {
    (0..CELLS)
        .map(|n| reach * (2.0 * (n as f64 + 0.5) / CELLS as f64 - 1.0))
        .collect()
}
