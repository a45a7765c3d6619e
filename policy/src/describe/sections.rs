//! The parts of a policy, a text each: a heading behind an empty line, then a line for each thing that there is.

use crate::describe::formula::formula;
use crate::model::{
    Circuit, Continuous, DutyPath, Estimate, Factor, Head, Input, InputVoltage, Interval, Mapping, Observer, OnTime,
    Output, Policy, Residual, Schedule, Squash, Still,
};

/// Characters of a line of actions, with which it still fits into a terminal beside its indentation.
const LINE: usize = 96;

/// Name, period and numeric format: the first line.
#[must_use]
pub fn head(policy: &Policy) -> String {
    let period = policy.sample_period;
    format!(
        "{}   one step every {} us ({:.6} kHz), {}\n",
        policy.name,
        period * 1e6,
        1e-3 / period,
        policy.numeric_format.name()
    )
}

/// Signals with ranges and units, and parameters.
#[must_use]
pub fn signals(policy: &Policy) -> String {
    let mut out = "\nsignals (plausible range; a sample outside is held)\n".to_owned();
    let width = widest(policy.signals.iter().map(|signal| signal.name.as_str()));
    for signal in &policy.signals {
        let adc = signal
            .adc
            .map(|adc| format!("   = {} * code + {}", adc.gain, adc.offset))
            .unwrap_or_default();
        let (name, range, unit) = (&signal.name, range(signal.range), &signal.unit);
        out += &format!("  {name:width$}  {range} {unit}{adc}\n");
    }
    for (name, value) in &policy.parameters {
        out += &format!("  {name:width$}  {value} (parameter)\n");
    }
    out
}

/// Models of the converter with what they are told and what they correct; nothing where there is none.
#[must_use]
pub fn observers(policy: &Policy) -> String {
    if policy.observers.is_empty() {
        return String::new();
    }
    let mut out = "\nobservers (estimates stand beside the signals)\n".to_owned();
    let name = |index: usize| Input::Signal(index).name(&policy.signals, &policy.observers);
    let paths = policy.paths();
    for (index, own) in policy.observers.iter().enumerate() {
        let source = match own.input_voltage {
            InputVoltage::Constant(volts) => format!("{volts} V"),
            InputVoltage::Signal(index) => name(index),
        };
        let delay = match own.compute_delay {
            0 => "the duty acts in the same period",
            _ => "the duty acts one period later",
        };
        let whose = match paths.get(own.output).and_then(|path| path.name) {
            Some(name) => format!("driven by {name}, "),
            None => String::new(),
        };
        out += &format!(
            "  {}: {whose}{}L {} H, C {} F, V {source}, corrected by {}, loaded by {}; {delay}\n",
            own.name,
            circuit(own),
            own.inductance,
            own.capacitance,
            name(own.output_voltage),
            name(own.load_current)
        );
        let gains = [own.gains.current, own.gains.voltage, own.gains.bias];
        for (estimate, gain) in Estimate::STATE.into_iter().zip(gains) {
            let called = Input::Estimate(index, estimate).name(&policy.signals, &policy.observers);
            let (range, unit) = (range(own.range(estimate)), estimate.unit());
            out += &format!("    {called}  {range} {unit}, {gain} {unit}/V\n");
        }
        if let Some(hold) = own.hold {
            let called = Input::Estimate(index, Estimate::Surplus).name(&policy.signals, &policy.observers);
            out += &format!("    {called}  {} A, at {} V\n", range(hold.range), hold.voltage);
        }
    }
    out
}

/// What differs from a buck converter whose switch turns on first.
fn circuit(own: &Observer) -> String {
    let word = Circuit::EACH.iter().find(|(_, each)| *each == own.topology);
    let word = word.map_or("", |(word, _)| word);
    match (own.topology, own.carrier) {
        (Circuit::Buck, OnTime::Trailing) => String::new(),
        (_, OnTime::Trailing) => format!("{word}, "),
        (_, OnTime::Centre) => format!("{word}, on in the middle of the period, "),
    }
}

/// Features as formulas with their bounds, and the ranges that the golden vectors have of them.
#[must_use]
pub fn observation(policy: &Policy) -> String {
    let mut out = "\nobservation (network input order; bound over all plausible measurements)\n".to_owned();
    for (index, feature) in policy.features.iter().enumerate() {
        let (formula, bound) = (formula(feature, policy), range(feature.bound));
        let golden =
            golden_range(policy, index).map_or_else(String::new, |seen| format!(", golden in {}", range(seen)));
        out += &format!("  {index:2}  {formula}   in {bound}{golden}\n");
    }
    if policy.golden.is_some() {
        out += "  golden vectors begin at the observation: they do not show that these formulas are those of the training\n";
    }
    out
}

/// Smallest and largest value of a feature in the golden vectors: far from its bound, scale or unit may be wrong.
fn golden_range(policy: &Policy, feature: usize) -> Option<Interval> {
    let golden = policy.golden.as_ref()?;
    let column = golden.observations.iter().skip(feature).step_by(policy.features.len());
    let values = column.map(|x| Interval {
        low: f64::from(*x),
        high: f64::from(*x),
    });
    (golden.count > 0).then(|| hull(values))
}

/// Layers with their sizes, activations and bounds over the box of observations.
#[must_use]
pub fn network(policy: &Policy) -> String {
    let mut out = "\nnetwork\n".to_owned();
    let width = widest(policy.layers.iter().map(|layer| layer.name.as_str()));
    for layer in &policy.layers {
        let (name, activation) = (&layer.name, layer.activation.label());
        let (inputs, outputs) = (layer.inputs, layer.outputs);
        let bound = range(hull(layer.bounds.iter().copied()));
        out += &format!("  {name:width$}  {inputs:4} -> {outputs:<4} {activation}, outputs in {bound}\n");
    }
    out
}

/// Duties of the actions, several a line, or the formulas of a head without a choice.
#[must_use]
pub fn actions(policy: &Policy) -> String {
    if let Head::Several(outputs) = &policy.head {
        return outputs.iter().map(several).collect();
    }
    if let Some(head) = policy.head.continuous() {
        return continuous(head);
    }
    if let Some(head) = policy.head.schedule() {
        return schedule(head, policy);
    }
    let mut out = match policy.head.residual() {
        Some(head) => residual(head),
        None => "\nactions (argmax of Q, lowest index wins)\n".to_owned(),
    };
    let texts = policy
        .actions()
        .iter()
        .enumerate()
        .map(|(index, action)| match action.pair {
            None if policy.head.residual().is_some() => format!("{index}: {:+}", action.duty),
            None => format!("{index}: {}", action.duty),
            Some(pair) => format!("{index}: {} {:+} * {} = {:.6}", pair.xi, pair.c, pair.phi, action.duty),
        });
    let mut line = String::new();
    for text in texts {
        if line.len() + text.len() > LINE {
            out += &format!("  {line}\n");
            line.clear();
        }
        if !line.is_empty() {
            line.push_str("   ");
        }
        line.push_str(&text);
    }
    out + &format!("  {line}\n")
}

/// What decides one of several outputs.
fn several(output: &Output) -> String {
    let columns = match output.head.outputs() {
        1 => format!("column {}", output.column),
        count => format!("columns {} to {}", output.column, output.column + count - 1),
    };
    let what = match output.head.continuous() {
        Some(head) => {
            let ends = output.head.duties().into_iter();
            format!(
                "continuous, duty = {}, in {}",
                mapped_output(Some(head.squash), "y", (head.scale, head.offset)),
                range(hull(ends.map(|duty| Interval { low: duty, high: duty })))
            )
        }
        None => {
            let duties: Vec<String> = output.head.actions().iter().map(|own| own.duty.to_string()).collect();
            format!("argmax of {} duties: {}", duties.len(), duties.join(" "))
        }
    };
    format!("\noutput {} ({columns} of the last layer)\n  {what}\n", output.name)
}

/// The law, where it is left alone, and the heading of the offsets.
fn residual(head: &Residual) -> String {
    format!(
        "\nlaw\n  duty = {}, in {}\n{}\noffsets (argmax of Q, lowest index wins)\n",
        head.base.text,
        range(head.limits),
        still(&head.dead_zone)
    )
}

/// Where nothing is added to a law; empty where that is nowhere.
fn still(zone: &[Still]) -> String {
    let zone: Vec<String> = (zone.iter())
        .map(|still| format!("|{}| <= {}", still.source.text, still.within))
        .collect();
    match zone.is_empty() {
        true => String::new(),
        false => format!("  nothing is added where {}\n", zone.join(" and ")),
    }
}

fn continuous(head: &Continuous) -> String {
    let ends = Head::Continuous(*head).duties().into_iter();
    format!(
        "\naction (continuous, y is the network's output)\n  duty = {}, in {}\n",
        mapped_output(Some(head.squash), "y", (head.scale, head.offset)),
        range(hull(ends.map(|duty| Interval { low: duty, high: duty })))
    )
}

/// The law with its gains, then each gain as a formula of its output.
fn schedule(head: &Schedule, policy: &Policy) -> String {
    let product = |(index, gain): (usize, &crate::model::Gain)| match &gain.factor {
        Factor::Source(source) => format!(" + g{index} * ({})", source.text),
        Factor::Feature(own) => {
            let feature = policy.features.get(*own).map_or("?", |feature| &feature.name);
            format!(" + g{index} * {feature} before scale, offset and clip")
        }
        Factor::One => format!(" + g{index}"),
    };
    let products: String = head.gains.iter().enumerate().map(product).collect();
    let mut out = format!(
        "\nlaw (summed in this order)\n  duty = {}{products}, in {}\n{}\ngains (y0, y1, ... are the network's outputs)\n",
        head.base.text,
        range(head.limits),
        still(&head.dead_zone)
    );
    for (index, gain) in head.gains.iter().enumerate() {
        let formula = mapped_output(gain.squash, &format!("y{index}"), (gain.scale, gain.offset));
        let factor = match gain.factor {
            Factor::One => String::new(),
            Factor::Source(_) | Factor::Feature(_) => format!(", times {}", range(gain.factor_bound)),
        };
        out += &format!("  g{index} = {formula}, in {}{factor}\n", range(gain.ends()));
    }
    out
}

/// `0.4 * tanh(y) + 0.5`
fn mapped_output(squash: Option<Squash>, output: &str, (scale, offset): (f64, f64)) -> String {
    let squashed = match squash {
        Some(Squash::Curve(curve)) => format!("{}({output})", curve.word()),
        Some(Squash::Clip(clip)) => format!("{output} clipped to {}", range(clip)),
        None => output.to_owned(),
    };
    let scale = match scale {
        1.0 => String::new(),
        scale => format!("{scale} * "),
    };
    let offset = match offset {
        0.0 => String::new(),
        offset if offset < 0.0 => format!(" - {}", -offset),
        offset => format!(" + {offset}"),
    };
    format!("{scale}{squashed}{offset}")
}

/// The mapping as a formula, with its valid range and what may be adjusted at run time.
#[must_use]
pub fn mapping(policy: &Policy) -> String {
    let of = |mapping: &Mapping| mapped(mapping, policy);
    let none = || "  none: duty = duty of the action\n".to_owned();
    let one = |path: &DutyPath<'_>| format!("\n{}\n{}", heading("mapping", path), path.mapping.map_or_else(none, of));
    policy.paths().iter().map(one).collect()
}

fn mapped(mapping: &Mapping, policy: &Policy) -> String {
    let c = mapping.coefficients;
    let signal = policy.signals.get(mapping.load_current);
    let current = signal.map_or("?", |signal| &signal.name);
    let product = c.r.map(|r| format!(" {r:+} {current} d_sim")).unwrap_or_default();
    let adjust = [
        ("a", mapping.adjust_a),
        ("b", mapping.adjust_b),
        ("c", mapping.adjust_c),
        ("r", mapping.adjust_r),
    ];
    let shown = adjust.iter().filter(|(name, _)| *name != "r" || c.r.is_some());
    let adjust: Vec<String> = shown
        .map(|(name, interval)| format!("{name} in {}", range(*interval)))
        .collect();
    format!(
        "  duty = {} d_sim {:+} {current} {:+}{product}\n  valid for {current} in {}, d_sim in {}\n  at run time {}\n",
        c.a,
        c.b,
        c.c,
        range(mapping.valid_i_out),
        range(mapping.valid_d_sim),
        adjust.join(", ")
    )
}

/// Limits of the duty, and what is commanded without a measurement.
#[must_use]
pub fn limits(policy: &Policy) -> String {
    let path = |path: &DutyPath<'_>| limits_of(path, policy.fallback.hold);
    policy.paths().iter().map(path).collect()
}

/// `limits`, or `limits of left` where there are several outputs.
fn heading(what: &str, path: &DutyPath<'_>) -> String {
    path.name.map_or(what.to_owned(), |name| format!("{what} of {name}"))
}

fn limits_of(path: &DutyPath<'_>, hold: u32) -> String {
    let (limits, duty) = (path.limits, path.fallback);
    let mut out = format!(
        "\n{}\n  duty in {}, {} before the first step\n",
        heading("limits", path),
        range(limits.duty),
        limits.initial_duty
    );
    if let Some(slew) = limits.slew {
        out += &format!("  at most {slew} per step\n");
    }
    if let Some(soft) = limits.soft_start {
        out += &format!("  soft start: upper limit from {} in {} steps\n", soft.from, soft.steps);
    }
    out + &format!("  invalid measurement: hold {hold} steps, then duty {duty}\n")
}

/// Digests of what decides the controller.
#[must_use]
pub fn digests(policy: &Policy) -> String {
    let digests = &policy.digests;
    let mut out = format!(
        "\ndigests (sha256 of what decides the controller, not of the files)\n  weights  {}\n  contract {}\n",
        digests.weights, digests.contract
    );
    if let Some(mapping) = &digests.mapping {
        out += &format!("  mapping  {mapping}\n");
    }
    out
}

/// The smallest interval that holds all of them; upside down if there are none.
#[must_use]
pub fn hull(intervals: impl IntoIterator<Item = Interval>) -> Interval {
    let empty = Interval {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };
    intervals.into_iter().fold(empty, |all, one| Interval {
        low: all.low.min(one.low),
        high: all.high.max(one.high),
    })
}

/// An interval to five digits behind the point, `[0.05, 0.95]`; very small and very large ends with an exponent.
#[must_use]
pub fn range(interval: Interval) -> String {
    let number = |x: f64| {
        let text = format!("{x:.5}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e7) {
            format!("{x:.4e}")
        } else {
            text.to_owned()
        }
    };
    format!("[{}, {}]", number(interval.low), number(interval.high))
}

fn widest<'a>(names: impl Iterator<Item = &'a str>) -> usize {
    names.map(str::len).max().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_short_where_it_can_be() {
        let of = |low, high| range(Interval { low, high });
        assert_eq!(of(0.0, 250.0), "[0, 250]");
        assert_eq!(of(-0.05, 0.123_456_7), "[-0.05, 0.12346]");
        assert_eq!(of(1e-4, 2.5e7), "[1.0000e-4, 2.5000e7]");
        // from one thousandth to less than ten millions
        assert_eq!(of(1e-3, 9_999_999.0), "[0.001, 9999999]");
        assert_eq!(of(-1e7, 9.9e-4), "[-1.0000e7, 9.9000e-4]");
    }

    #[test]
    fn the_hull_holds_all() {
        let list = [(0.0, 1.0), (-2.0, -1.0)].map(|(low, high)| Interval { low, high });
        assert_eq!(hull(list), Interval { low: -2.0, high: 1.0 });
    }
}
