//! Starts that the records themselves suggest: where an inductor may saturate, and how an input filter may swing.

use std::f64::consts::TAU;

use crate::causes::Bases;
use crate::ideal::{self, Ideal};
use crate::problem::Problem;
use crate::record::Record;
use crate::spectrum;

/// Peaks of the current at the loads and duties of the records have to differ by this share: at one of them the inductor is a smaller one.
/// Less than a fifth is what a steep core needs to fall.
const APART: f64 = 0.1;
/// Share of the rows whose peaks are lower, and higher: a few rows behind a step swing beyond it.
const FEW: f64 = 0.02;
/// Where between the lowest and the highest peak a fall may lie.
const KNEES: [f64; 4] = [0.15, 0.4, 0.65, 0.9];
/// The fall that a fit begins with: of most of the inductance, within a third of the current.
const LOST: f64 = 0.6;
const STEEP: f64 = 6.0;

/// Share lost, current and steepness of falls that lie between the peaks that the records have; none if they are all about the same.
pub(crate) fn knees(problem: &Problem) -> Vec<Vec<f64>> {
    let peak = |record: &Record, row: usize| {
        let (ideal, duty) = (Ideal::of(record, &problem.base.plant), record.duty[row]);
        let drawn = ideal::drawn(&record.load[row], ideal.volts(duty));
        let shown = record.measured[1].get(row).copied().filter(|i| i.is_finite());
        shown.unwrap_or_else(|| ideal.inductor(drawn, duty)) + ideal.half(duty)
    };
    let records = problem.records.iter().filter(|record| record.capture.is_none());
    let mut peaks: Vec<f64> = records
        .flat_map(|record| (0..record.rows()).map(move |row| (record, row)))
        .map(|(record, row)| peak(record, row))
        .filter(|peak| peak.is_finite())
        .collect();
    peaks.sort_by(f64::total_cmp);
    let few = (FEW * peaks.len() as f64) as usize;
    let (Some(low), Some(high)) = (
        peaks.get(few),
        peaks.len().checked_sub(few + 1).and_then(|at| peaks.get(at)),
    ) else {
        return Vec::new();
    };
    if *high < (1.0 + APART) * low {
        return Vec::new();
    }
    let of = |share: f64| vec![LOST, low + share * (high - low), STEEP];
    KNEES.map(of).to_vec()
}

/// Impedances of an input filter where its inductor and capacitor swing, as shares of the resistance that the converter is to its source.
/// Higher ones swing against the converter's negative resistance for ever; lower ones leave no trace.
const IMPEDANCES: [f64; 2] = [0.03, 0.12];
/// Damping that a fit begins with, as a share of that impedance.
const DAMPED: f64 = 0.1;

/// Resistance, inductance, capacitance and its series resistance of input filters that swing as the input voltage does, or where nobody has
/// measured that, current and output voltage; none where nothing swings.
pub(crate) fn swings(problem: &Problem, residual: &[f64], bases: &Bases) -> Vec<Vec<f64>> {
    let is_measured = |channel: usize| {
        let mut records = problem.records.iter().filter(|record| !record.settled);
        records.any(|record| record.measured[channel].iter().any(|value| value.is_finite()))
    };
    // the output filter lets little of it through to the voltage, and the inductor's current shows it best
    let channels = if is_measured(3) { &[3][..] } else { &[1, 0] };
    let found = channels
        .iter()
        .flat_map(|channel| spectrum::swings(problem, residual, *channel));
    found.flat_map(|frequency| filters(frequency, bases)).collect()
}

/// Frequencies, as shares of the switching frequency, at which an input filter may swing whose swing stands out of nothing: twice as high
/// each, since a damped swing is as wide as that.
const SHARES: [f64; 6] = [0.01, 0.02, 0.04, 0.08, 0.16, 0.32];

/// The same of filters that swing at any frequency: a resistance of the source damps one until no line stands out.
pub(crate) fn damped(bases: &Bases) -> Vec<Vec<f64>> {
    let frequencies = SHARES.into_iter().map(|share| share / bases.t_sw);
    frequencies.flat_map(|frequency| filters(frequency, bases)).collect()
}

/// Lowest and highest frequency of filters that are looked at wherever they swing, as shares of the switching frequency: below it the rows show each turn,
/// above it an inductance of leads is nothing beside that of the circuit. Conventions.
const ANY: [f64; 2] = [0.05, 3.0];
/// Impedances of those: half a decade apart, around the two that others begin with.
const ANY_IMPEDANCES: [f64; 4] = [0.01, 0.03, 0.1, 0.3];

/// Input filters behind a resistance at any frequency, each a `ratio` above the one before; several of other impedances at each.
pub(crate) fn filters_at_any(resistance: f64, ratio: f64, bases: &Bases) -> Vec<Vec<Vec<f64>>> {
    let [low, high] = ANY;
    let count = (libm::log(high / low) / libm::log(ratio)) as i32;
    let at = |n: i32| {
        let of = |mut filter: Vec<f64>| {
            filter[0] = resistance;
            filter
        };
        let frequency = low / bases.t_sw * ratio.powi(n);
        of_impedances(frequency, bases, ANY_IMPEDANCES).map(of).to_vec()
    };
    (0..=count).map(at).collect()
}

/// Input filters that swing at a frequency.
fn filters(frequency: f64, bases: &Bases) -> [Vec<f64>; 2] {
    of_impedances(frequency, bases, IMPEDANCES)
}

/// A filter swings fast in less than so many rows. A convention: of six rows each turn shows.
const FAST: f64 = 6.0;

/// Whether an input filter of these numbers swings fast, or not at all.
pub(crate) fn is_fast(values: &[f64], bases: &Bases) -> bool {
    let [_, inductance, capacitance, ..] = values else {
        return false;
    };
    TAU * libm::sqrt(inductance * capacitance) < FAST * bases.t_sw
}

/// ... of these impedances.
fn of_impedances<const N: usize>(frequency: f64, bases: &Bases, impedances: [f64; N]) -> [Vec<f64>; N] {
    let seen = bases.v_in * bases.v_in / (bases.v * bases.i);
    let rate = TAU * frequency;
    impedances.map(|share| {
        let z = share * seen;
        vec![0.5 * DAMPED * z, z / rate, 1.0 / (z * rate), 0.5 * DAMPED * z]
    })
}
