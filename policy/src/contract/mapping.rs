//! `[mapping]` of `policy.toml` and the file it names (`drm.toml`).

use toml_input::{Document, Sink, Table};

use super::{duty_interval, interval_f32, number_f32};
use crate::bounds::Box32;
use crate::catalogue;
use crate::model::{Coefficients, Interval, Mapping, Simulation};
use crate::rounding::{inward_f32, nearest_f32};

/// The section in `policy.toml`: the index of the load current; the coefficients stand in `drm.toml`.
pub(crate) fn load_current(section: &mut Table<'_>, signals: &[String], faults: &mut Sink) -> Option<usize> {
    let hint = "name the signal that is i_out in the mapping: `load_current = \"i_out\"`";
    let value = section.required("load_current", hint, faults)?;
    let text = value.text(faults)?;
    let index = signals.iter().position(|name| name == text);
    if index.is_none() {
        let names: Vec<&str> = signals
            .iter()
            .map(String::as_str)
            .filter(|name| !name.is_empty())
            .collect();
        faults.push(value.fault(catalogue::unknown_name("signal", text, &names)));
    }
    index
}

/// Reads `drm.toml`; `load_current` is entered as given.
pub(crate) fn read(document: &Document, load_current: usize, faults: &mut Sink) -> Option<Mapping> {
    let before = faults.count();
    let mut root = document.root();
    let hint = "a mapping is d_real = a d_sim + b i_out + c (+ r i_out d_sim)";
    let places = ["a", "b", "c"].map(|key| root.required(key, hint, faults));
    let [a, b, c] = places.clone().map(|value| value.and_then(|v| number_f32(&v, faults)));
    let product = root.optional("r");
    let r = product.as_ref().map(|v| number_f32(v, faults));
    // a <= 0 would turn the sign of the loop, or take the policy out of it
    let a = a.filter(|a| *a > 0.0).or_else(|| {
        let value = places[0].as_ref().zip(a);
        faults.extend(value.map(|(value, a)| value.fault(catalogue::not_positive("a", a))));
        None
    });
    let hint = "where the fit holds: [valid] with `i_out = [low, high]` and `d_sim = [low, high]`";
    let mut valid = root
        .required("valid", hint, faults)
        .and_then(|v| v.table("[valid]", faults));
    let i_out = valid
        .as_mut()
        .and_then(|s| s.required("i_out", hint, faults))
        .and_then(|v| interval_f32(&v, faults));
    let d_sim = valid
        .as_mut()
        .and_then(|s| s.required("d_sim", hint, faults))
        .and_then(|v| duty_interval(&v, faults));
    if let Some(section) = valid {
        section.finish(faults);
    }
    let mut adjust = root.optional("adjust").and_then(|v| v.table("[adjust]", faults));
    let near = |value: f64, by: f64| Interval {
        low: value - by,
        high: value + by,
    };
    // conventions: a converter whose gain is off by two, whose b by half of the duty at 10 A, or whose c by a fifth of
    // the duty (as `drm fit` has it) has a fault that no adjustment is for
    let a_default = a.map(|a| Interval {
        low: 0.5 * a,
        high: 2.0 * a,
    });
    let adjust_a = adjustable(&mut adjust, "a", a, a_default, faults);
    let adjust_b = adjustable(&mut adjust, "b", b, b.map(|b| near(b, 0.05)), faults);
    let adjust_c = adjustable(&mut adjust, "c", c, c.map(|c| near(c, 0.2)), faults);
    let adjust_r = match r {
        Some(r) => adjustable(&mut adjust, "r", r, r.map(|r| near(r, 0.05)), faults),
        // three terms: the interval is never looked at, but the field wants one
        None => without_r(&mut adjust, faults).then_some(near(0.0, 0.05)),
    };
    if let Some(section) = adjust {
        section.finish(faults);
    }
    let simulation = simulation(&mut root, faults);
    root.finish(faults);
    let mapping = Mapping {
        coefficients: Coefficients {
            a: a?,
            b: b?,
            c: c?,
            // a faulty `r` looks like none here, but its fault refuses the mapping below
            r: r.flatten(),
        },
        load_current,
        valid_i_out: i_out?,
        valid_d_sim: d_sim?,
        adjust_a: adjust_a?,
        adjust_b: adjust_b?,
        adjust_c: adjust_c?,
        adjust_r: adjust_r?,
        simulation,
    };
    // with a faulty coefficient the slope would be a second fault of one cause
    if faults.count() == before {
        rising(&mapping, product.as_ref().or(places[0].as_ref()), faults);
    }
    (faults.count() == before).then_some(mapping)
}

/// `[simulation]`: the converter that `d_sim` is a duty of. A loss that is not named is 0.
fn simulation(root: &mut Table<'_>, faults: &mut Sink) -> Option<Simulation> {
    let mut section = root.optional("simulation")?.table("[simulation]", faults)?;
    let hint = "the input voltage of the simulation that the policy was trained on: `v_in = 200.0`";
    let v_in = section
        .required("v_in", hint, faults)
        .and_then(|value| value.positive(faults));
    let keys = ["v_f", "r_d", "r_on", "dcr", "lost_duty", "v_dead"];
    let [v_f, r_d, r_on, dcr, lost_duty, v_dead] =
        keys.map(|key| section.optional(key).map_or(Some(0.0), |value| value.number(faults)));
    section.finish(faults);
    Some(Simulation {
        v_in: v_in?,
        v_f: v_f?,
        r_d: r_d?,
        r_on: r_on?,
        dcr: dcr?,
        lost_duty: lost_duty?,
        v_dead: v_dead?,
    })
}

/// `[adjust] key`, or the default; the coefficient must lie inside, as it stands and in binary32, and `a` stay above 0.
fn adjustable(
    adjust: &mut Option<Table<'_>>,
    key: &'static str,
    coefficient: Option<f64>,
    default: Option<Interval>,
    faults: &mut Sink,
) -> Option<Interval> {
    let Some(value) = adjust.as_mut().and_then(|section| section.optional(key)) else {
        return default;
    };
    let interval = interval_f32(&value, faults)?;
    let (low, high) = inward_f32(interval)?;
    if key == "a" && interval.low <= 0.0 {
        faults.push(value.fault(catalogue::not_positive("the lower end of adjust a", interval.low)));
        return None;
    }
    if let Some(x) = coefficient
        && !((low..=high).contains(&nearest_f32(x)) && (interval.low..=interval.high).contains(&x))
    {
        let name = "its [adjust] interval";
        faults.push(value.fault(catalogue::outside(key, x, name, interval.low, interval.high)));
        return None;
    }
    Some(interval)
}

/// `adjust r` has no meaning in the three-term form.
fn without_r(adjust: &mut Option<Table<'_>>, faults: &mut Sink) -> bool {
    match adjust.as_mut().and_then(|section| section.optional("r")) {
        None => true,
        Some(value) => {
            faults.push(value.fault(catalogue::needs_other("adjust r", "r")));
            false
        }
    }
}

/// The mapping must rise with d_sim at both ends of i_out, computed as the controller computes it.
fn rising(mapping: &Mapping, at: Option<&toml_input::Value<'_>>, faults: &mut Sink) {
    let Some(r) = mapping.coefficients.r else { return };
    // linear in the current: both ends speak for all between
    for i_out in [mapping.valid_i_out.low, mapping.valid_i_out.high].map(nearest_f32) {
        let slope = nearest_f32(mapping.coefficients.a) + nearest_f32(r) * i_out;
        if slope.is_nan() || slope <= 0.0 {
            let message = catalogue::not_increasing(f64::from(i_out), f64::from(slope));
            faults.extend(at.map(|value| value.fault(message)));
            return;
        }
    }
}

/// Whether the mapped duty stays within the format for every adjustable coefficient and every sanitised current.
pub(crate) fn magnitude_fits(mapping: &Mapping, current: Box32, duties: Interval) -> Result<(), f64> {
    let d = Box32::nearest(duties);
    let all = || {
        // in the order of section 8, and with what the lab may set, not with the coefficients as they are
        let mut t = Box32::nearest(mapping.adjust_a).times(d)?;
        t = t.add(Box32::nearest(mapping.adjust_b).times(current)?)?;
        t = t.add(Box32::nearest(mapping.adjust_c))?;
        if mapping.coefficients.r.is_some() {
            t = t.add(Box32::nearest(mapping.adjust_r).times(current)?.times(d)?)?;
        }
        Ok(t)
    };
    all().map(drop).map_err(|crate::bounds::Overflow(magnitude)| magnitude)
}
