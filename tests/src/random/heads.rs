//! What a policy commands: offsets of a law, a continuous head, a gain schedule, duties.

use std::fmt::Write;

use random::{Random, SplitMix};

use super::{estimate, source};

/// Offsets of a law over signals and estimates, with and without a dead zone.
pub(super) fn residual(rng: &mut SplitMix, actions: usize, observers: &[bool], signals: usize) -> String {
    let seen = |rng: &mut SplitMix| match observers {
        [] => format!("s{}", rng.below(signals)),
        _ => estimate(rng, observers, signals),
    };
    let offsets: Vec<String> = (0..actions).map(|_| format!("{:?}", rng.uniform(-0.3, 0.3))).collect();
    let mut text = format!(
        "[actions]\nbase = \"0.5 - {:?} * ({}) + 0.1 * previous_command\"\noffsets = [{}]\n",
        rng.uniform(-0.02, 0.02),
        seen(rng),
        offsets.join(", ")
    );
    let zone: Vec<String> = (0..rng.below(3))
        .map(|_| {
            format!(
                "{{ source = \"{}\", within = {:?} }}",
                seen(rng),
                rng.uniform(0.1, 30.0)
            )
        })
        .collect();
    if !zone.is_empty() {
        let _ = writeln!(text, "dead_zone = [{}]", zone.join(", "));
    }
    text.push('\n');
    text
}

/// Bits in which the seed of the head's stream differs from that of the rest.
pub(super) const HEAD: u64 = 0x0068_6561_6400_0000;

/// A continuous head of any form whose duties stay within 0..1: with and without scale and offset, of both signs.
pub(crate) fn continuous(rng: &mut SplitMix) -> String {
    let (scale, offset) = (rng.uniform(0.05, 0.45), rng.uniform(0.46, 0.54));
    match rng.below(8) {
        0 => format!("continuous = {{ squash = \"tanh\", scale = {scale:?}, offset = {offset:?} }}"),
        1 => format!("continuous = {{ squash = \"tanh\", scale = -{scale:?}, offset = {offset:?} }}"),
        2 => format!("continuous = {{ squash = \"softsign\", scale = {scale:?}, offset = {offset:?} }}"),
        3 => format!("continuous = {{ clip = [{:?}, {offset:?}] }}", offset - scale),
        5 => format!("continuous = {{ squash = \"sigmoid\", scale = {scale:?}, offset = {offset:?} }}"),
        6 => "continuous = { squash = \"hard_sigmoid\" }".to_owned(),
        4 => format!("continuous = {{ clip = [-1.0, 1.0], scale = {scale:?}, offset = {offset:?} }}"),
        _ => format!("continuous = {{ clip = [0.25, 2.0], scale = {scale:?} }}"),
    }
}

/// Bits in which the seed of the gain schedule's stream differs from that of the rest.
pub(super) const SCHEDULE: u64 = 0x6761_696e_7300_0000;

/// Gains of every map and factor, with and without limits, base and dead zone.
pub(super) fn gains(rng: &mut SplitMix, count: usize, observers: &[bool], [features, signals]: [usize; 2]) -> String {
    let seen = |rng: &mut SplitMix| match !observers.is_empty() && rng.one_in(2) {
        true => estimate(rng, observers, signals),
        false => source(rng, signals),
    };
    let base = match rng.below(4) {
        0 => None,
        1 => Some("previous_duty".to_owned()),
        2 => Some("0.5".to_owned()),
        _ => Some(format!("0.4 - {:?} * ({})", rng.uniform(-0.005, 0.005), seen(rng))),
    };
    let mut list = Vec::new();
    for _ in 0..count {
        let (factor, size) = match rng.below(5) {
            0 => (String::new(), 0.2),
            1 | 2 => (format!("feature = \"x{}\", ", rng.below(features)), 0.01),
            _ => (format!("source = \"{}\", ", seen(rng)), 0.005),
        };
        list.push(format!("  {{ {factor}{} }}", gain(rng, size)));
    }
    let mut text = format!("[actions]\ngains = [\n{},\n]\n", list.join(",\n"));
    if let Some(base) = &base {
        let _ = writeln!(text, "base = \"{base}\"");
        if rng.one_in(3) {
            let (source, within) = (seen(rng), rng.uniform(0.1, 60.0));
            let _ = writeln!(text, "dead_zone = [{{ source = \"{source}\", within = {within:?} }}]");
        }
    }
    text.push('\n');
    text
}

/// The map of a gain of about that size, of either sign.
fn gain(rng: &mut SplitMix, size: f64) -> String {
    let scale = size * rng.uniform(0.1, 1.0) * if rng.one_in(3) { -1.0 } else { 1.0 };
    let offset = match rng.one_in(3) {
        true => 0.0,
        false => size * rng.uniform(-1.0, 1.0),
    };
    let squash = match rng.below(7) {
        0 => Some("squash = \"tanh\""),
        1 => Some("squash = \"softsign\""),
        2 => Some("squash = \"sigmoid\""),
        3 => Some("squash = \"hard_sigmoid\""),
        4 => Some("clip = [-1.0, 0.75]"),
        5 => Some("clip = [0.25, 3.0]"),
        _ => None,
    };
    let mut text = squash.map_or(String::new(), |squash| format!("{squash}, "));
    // about what an output of a half makes, which each of the maps reaches
    let (middle, width) = (offset + 0.5 * scale, 0.4 * scale.abs());
    let limited = squash.is_none() || rng.one_in(3);
    let _ = write!(text, "scale = {scale:?}");
    if offset != 0.0 {
        let _ = write!(text, ", offset = {offset:?}");
    }
    if limited {
        let (low, high) = (middle - width * rng.unit(), middle + width * rng.uniform(0.1, 1.0));
        let _ = write!(text, ", limits = [{low:?}, {high:?}]");
    }
    text
}

/// A choice among duties, listed or in pairs.
pub(crate) fn action_table(text: &mut String, rng: &mut SplitMix, actions: usize) {
    // pairs give three duties each; what is left over becomes a shorter list of factors
    if rng.one_in(2) {
        let duties: Vec<String> = (0..actions).map(|_| format!("{:?}", rng.uniform(0.0, 1.0))).collect();
        let _ = writeln!(text, "[actions]\nduties = [{}]\n", duties.join(", "));
        return;
    }
    let mut pairs = Vec::new();
    let mut left = actions;
    while left > 0 {
        let factors = ["", ", c = [0]", ", c = [-1, 1]", ""][left.min(3)];
        left -= left.min(3);
        pairs.push(format!(
            "{{ xi = {:?}, phi = {:?}{factors} }}",
            rng.uniform(0.3, 0.7),
            rng.uniform(0.0, 0.3)
        ));
    }
    let _ = writeln!(text, "[actions]\npairs = [{}]\n", pairs.join(", "));
}
