//! What a mapping makes of a converter, and what no mapping can repair.

use std::fmt::{self, Write};

use plant::{Faults as PlantFaults, Parameters, Plant, Signals};
use policy::Interval;
use serde::Serialize;

use crate::acquire::LoadSetting;
use crate::fit::{Errors, error_head, error_line, error_v, errors, load_line, rms, wrapped};
use crate::mapping::DutyRatioMap;
use crate::table::{Point, Table, lines};

/// A mapping applied to a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judgement {
    /// Measured voltage minus that of the simulation at the same duty, V.
    pub without: Errors,
    /// Measured minus expected voltage, V.
    pub with: Errors,
    /// With the mapping, points inside its valid range only; `None` if there is none.
    pub inside: Option<Errors>,
    /// Lines outside the valid range.
    pub outside: Vec<usize>,
    /// What no mapping can repair, as far as the table shows it, and warnings.
    pub remarks: Vec<String>,
}

/// A point that lies beyond the duty limits.
struct CutOff {
    line: usize,
    wanted: f64,
    missing_v: f64,
}

/// Applies a mapping to a table; `limits` are those of the controller's duty.
#[must_use]
pub fn judge(table: &Table, map: &DutyRatioMap, limits: Option<Interval>) -> Judgement {
    let points = &table.points;
    let line = load_line(points);
    let with = |point: &Point| (point.line, error_v(map, point, line));
    let is_inside = |point: &&Point| map.covers(point.d_sim(), point.i_out);
    let (inside, outside): (Vec<&Point>, Vec<&Point>) = points.iter().partition(is_inside);
    let outside: Vec<usize> = outside.iter().map(|point| point.line).collect();
    let mut remarks = table.notes.clone();
    if !outside.is_empty() {
        remarks.push(format!("outside the mapping's valid range: {}", lines(&outside)));
    }
    remarks.extend(limits.and_then(|limits| cut_off(points, map, limits)));
    remarks.extend(noise(points, map, line));
    Judgement {
        without: errors(points.iter().map(|p| (p.line, p.without_v()))),
        with: errors(points.iter().map(with)),
        inside: (!inside.is_empty()).then(|| errors(inside.iter().map(|p| with(p)))),
        outside,
        remarks,
    }
}

/// Points whose mapped duty the limits do not let through.
fn cut_off(points: &[Point], map: &DutyRatioMap, limits: Interval) -> Option<String> {
    let beyond = |point: &Point| {
        let wanted = map.apply(point.d_sim(), point.i_out);
        let missing = wanted - wanted.clamp(limits.low, limits.high);
        (missing != 0.0).then(|| CutOff {
            line: point.line,
            wanted,
            missing_v: missing / map.slope(point.i_out) * point.v_per_duty(),
        })
    };
    let list: Vec<CutOff> = points.iter().filter_map(beyond).collect();
    let worst = list
        .iter()
        .max_by(|a, b| a.missing_v.abs().total_cmp(&b.missing_v.abs()))?;
    let all: Vec<usize> = list.iter().map(|cut| cut.line).collect();
    Some(format!(
        "the duty range {} to {} ends too early for {}: line {} wants {:.4} and misses {:.2} V; no mapping repairs that",
        limits.low,
        limits.high,
        lines(&all),
        worst.line,
        worst.wanted,
        worst.missing_v.abs()
    ))
}

/// Points at equal duty and load that differ in voltage: what scatters is not a matter of the mapping.
fn noise(points: &[Point], map: &DutyRatioMap, line: f64) -> Option<String> {
    // as near as a bench sets a duty and a load again. A convention
    const EQUAL: f64 = 1e-3;
    let range = |of: &dyn Fn(&Point) -> f64| {
        let values: Vec<f64> = points.iter().map(of).collect();
        values.iter().fold(0.0_f64, |most, v| most.max(v.abs()))
    };
    let (duty, load) = (EQUAL * range(&|p| p.d_real), EQUAL * range(&|p| p.i_out));
    let mut differences = Vec::new();
    for (index, one) in points.iter().enumerate() {
        for other in &points[index + 1..] {
            if (one.d_real - other.d_real).abs() <= duty && (one.i_out - other.i_out).abs() <= load {
                differences.push(error_v(map, one, line) - error_v(map, other, line));
            }
        }
    }
    (!differences.is_empty()).then(|| {
        format!(
            "repeated points differ by {:.4} V rms: no mapping is better than that over root 2",
            rms(&differences)
        )
    })
}

/// An operating point of the real converter with a mapping, in steady state.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Steady {
    /// Wanted voltage, V.
    pub v_ref: f64,
    /// Load current there, A.
    pub i_out: f64,
    /// Duty that the real converter needs.
    pub d_needed: f64,
    /// True voltage minus `v_ref` with `d_sim` unmapped, V.
    pub without_v: f64,
    /// The same with the mapping, V.
    pub with_v: f64,
    /// The same with the mapping and the duty limits, V.
    pub limited_v: f64,
    /// What the sensors show minus what is true: v_out V, i_l A, i_out A, v_in V.
    pub sensors: Signals,
    /// Sampled inductor current minus that of the simulation at the same point, both as their sensors show it, A.
    pub i_l_shift: f64,
    /// Whether the point lies in the range that the mapping says it is valid in.
    pub is_inside: bool,
}

/// Runs the mapping against a known converter: `real` is the bench, `nominal` what the policy was trained on.
///
/// # Errors
/// If either is no converter, or another one than a buck.
pub fn against_plant(
    map: &DutyRatioMap,
    real: &Parameters,
    nominal: &Parameters,
    v_ref: f64,
    loads: &[LoadSetting],
    limits: Option<Interval>,
) -> Result<Vec<Steady>, PlantFaults> {
    real.require_buck("the judgement of a mapping")?;
    nominal.require_buck("the judgement of a mapping")?;
    let (mut bench, mut simulation) = (Plant::new(real)?, Plant::new(nominal)?);
    let steady = loads.iter().map(|setting| {
        let load = setting.load();
        let d_needed = bench.settle(v_ref, &load).duty;
        let d_sim = simulation.settle(v_ref, &load).duty;
        let (seen, wanted) = (bench.sample(), simulation.sample());
        let mapped = map.apply(d_sim, seen.measured.i_out);
        let limited = limits.map_or(mapped, |limits| mapped.clamp(limits.low, limits.high));
        // to first order, by the mapping's own slope: no run at the wrong duty, which may have no steady state
        let volts = |duty: f64| (duty - d_needed) / map.slope(seen.i_out) * nominal.converter.v_in;
        Steady {
            v_ref,
            i_out: seen.i_out,
            d_needed,
            without_v: volts(d_sim),
            with_v: volts(mapped),
            limited_v: volts(limited),
            sensors: Signals {
                v_out: seen.measured.v_out - seen.v_out,
                i_l: seen.measured.i_l - seen.i_l,
                i_out: seen.measured.i_out - seen.i_out,
                v_in: seen.measured.v_in - seen.v_in,
            },
            // both as shown: a sensor that the simulation has too is no shift
            i_l_shift: seen.measured.i_l - wanted.measured.i_l,
            is_inside: map.covers(d_sim, seen.measured.i_out),
        }
    });
    Ok(steady.collect())
}

/// What is left beside the mapping, in words with figures.
#[must_use]
pub fn beyond_repair(steady: &[Steady], v_ref: f64) -> Vec<String> {
    let mut remarks = Vec::new();
    let most = |of: &dyn Fn(&Steady) -> f64| {
        let values = steady.iter().map(of);
        values.fold(0.0_f64, |most, v| if v.abs() > most.abs() { v } else { most })
    };
    let seen = most(&|s| s.sensors.v_out);
    // 0.02 V at 100 V, what a mapped converter is off by anyway (docs/results/mapping.md)
    if seen.abs() > 2e-4 * v_ref {
        remarks.push(format!(
            "the voltage sensor is off by up to {seen:+.3} V at {v_ref} V: a controller that follows it misses by as much, \
             whatever the mapping; calibrate the sensor"
        ));
    }
    let shift = most(&|s| s.i_l_shift);
    let current = most(&|s| s.i_out);
    // current sensors are no better; a late sample shifts 1.7 A. 0.2 % blames a repaired bench, 20 % none at all
    if shift.abs() > 0.02 * current {
        remarks.push(format!(
            "the sampled inductor current is off by up to {shift:+.3} A from the simulation's at the same point (sampling \
             instant, dead time, ripple, sensor): a policy that observes it sees a shifted state; sample as in the simulation"
        ));
    }
    let short = most(&|s| s.limited_v - s.with_v);
    // 0.01 V at 100 V, which a reader would not see in the voltage
    if short.abs() > 1e-4 * v_ref {
        let needed = most(&|s| s.d_needed);
        remarks.push(format!(
            "the duty range ends too early: up to {needed:.4} is needed, the limits cost {:.2} V; widen them",
            short.abs()
        ));
    }
    remarks
}

/// A judgement as text.
///
/// # Errors
/// Never, in fact: writing to a text does not fail.
pub fn table_text(judgement: &Judgement) -> Result<String, fmt::Error> {
    let mut out = String::new();
    error_head(&mut out)?;
    error_line(&mut out, "without a mapping", &judgement.without)?;
    error_line(&mut out, "with it", &judgement.with)?;
    if let Some(inside) = judgement.inside.as_ref().filter(|_| !judgement.outside.is_empty()) {
        error_line(&mut out, "with it, inside its valid range", inside)?;
    }
    for remark in &judgement.remarks {
        writeln!(out)?;
        wrapped(&mut out, "", &format!("note: {remark}"))?;
    }
    Ok(out)
}

/// Steady states as text.
///
/// # Errors
/// Never, in fact: writing to a text does not fail.
pub fn steady_text(steady: &[Steady], v_ref: f64) -> Result<String, fmt::Error> {
    let mut out = String::new();
    writeln!(out, "steady state at {v_ref} V, true voltage - wanted")?;
    writeln!(
        out,
        "     i_out   duty needed      without         with   within limits"
    )?;
    for s in steady {
        writeln!(
            out,
            "{:>8.3} A {:>13.5} {:>+10.3} V {:>+10.3} V {:>+13.3} V{}",
            s.i_out,
            s.d_needed,
            s.without_v,
            s.with_v,
            s.limited_v,
            if s.is_inside { "" } else { "  outside [valid]" }
        )?;
    }
    let outside = steady.iter().filter(|s| !s.is_inside).count();
    if outside > 0 {
        let text = format!(
            "note: {outside} of {} points lie outside of the range that the mapping was fitted in ([valid] in its file): there it \
             is continued, not measured; acquire points there, or keep the controller away",
            steady.len()
        );
        writeln!(out)?;
        wrapped(&mut out, "", &text)?;
    }
    for remark in beyond_repair(steady, v_ref) {
        writeln!(out)?;
        wrapped(&mut out, "", &format!("no mapping repairs: {remark}"))?;
    }
    Ok(out)
}
