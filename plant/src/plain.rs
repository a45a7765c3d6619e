//! The circuit of two states (inductor current, capacitor voltage) between two switching edges, as a power series in time.
//!
//! With x = t/h the coefficients of i, v and w = 1/v follow from one another:
//! `i' = (h/L) (emf - r i - s v)`, `v' = (h/C) (s i - g v - J - P w)`, `v w = 1`, s the share of the current that the output
//! receives. Six orders leave less than 1e-6 V a period
//! (a segment whose last term is too large is halved), cost one division, and give the interval as a polynomial in which the zero
//! crossing of the current and the extremes of the voltage are found without another step.

use std::ops::{Add, Mul, Neg, Sub};

use serde::{Deserialize, Serialize};

use crate::parameters::Converter;
use crate::signals::Load;

pub(crate) const ORDER: usize = 6;
/// Longest step in units of the fastest time constant.
// the first term left out is then 0.2^7 / 7! = 3e-9 of the swing
pub(crate) const LONGEST_STEP: f64 = 0.2;
/// Largest change of v under constant power in one series, relative.
// the series of 1 / v is a geometric one in this ratio
pub(crate) const LARGEST_CHANGE: f64 = 0.2;
/// Largest last term of a series for v, relative to v_in, and how much larger the term before it may be. What is left out
/// is smaller still.
// 1e-6 V at the paper's 200 V. The term before is looked at as well: without losses v's odd terms come from the current
// and its even ones from the voltage at the inductor, so one of them may vanish alone
const LAST_TERM: f64 = 5e-9;
pub(crate) const TERM_BEFORE: f64 = 0.03;
// a part that crosses the fold of a constant power is never fine enough; this depth ends the halving
const DEEPEST_SPLIT: u32 = 12;

/// The constants of the circuit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plain {
    pub inv_l: f64,
    pub inv_c: f64,
    pub v_fold: f64,
    pub inv_fold_squared: f64,
    pub longest: f64,
    /// Largest last term of a series, V.
    pub last_term: f64,
}

/// What drives the inductor: `L di/dt = emf - r i - give v`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drive {
    pub emf: f64,
    pub r: f64,
    /// Share of the current that the output receives.
    pub give: f64,
    /// The current may not change its sign.
    pub stops_at_zero: bool,
    /// The current is 0 and stays there.
    pub open: bool,
    /// While it is open: the output voltage below which it is not.
    pub starts_below: f64,
}

impl Drive {
    pub const OPEN: Drive = Drive {
        emf: 0.0,
        r: 0.0,
        // of no current all or nothing are the same, and all is the faster series
        give: 1.0,
        stops_at_zero: false,
        open: true,
        starts_below: f64::NEG_INFINITY,
    };
}

/// Current and voltage, and their extremes since the last sample.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Track {
    pub v_min: f64,
    pub v_max: f64,
    pub i_min: f64,
    pub i_max: f64,
    pub discontinuous: bool,
    /// Steps of an integrator.
    pub steps: u64,
}

impl Track {
    pub fn at(i: f64, v: f64) -> Self {
        Track {
            v_min: v,
            v_max: v,
            i_min: i,
            i_max: i,
            discontinuous: false,
            steps: 0,
        }
    }

    #[inline(always)]
    pub fn voltage(&mut self, v: f64) {
        self.v_min = if v < self.v_min { v } else { self.v_min };
        self.v_max = if v > self.v_max { v } else { self.v_max };
    }

    #[inline(always)]
    pub fn current(&mut self, i: f64) {
        self.i_min = if i < self.i_min { i } else { self.i_min };
        self.i_max = if i > self.i_max { i } else { self.i_max };
    }
}

impl Plain {
    /// `r` is the largest series resistance, ohm.
    pub fn new(converter: &Converter, r: f64, v_fold: f64) -> Self {
        let (inv_l, inv_c) = (1.0 / converter.inductance, 1.0 / converter.capacitance);
        // conductances at the output change with the load and are asked in `leaf`
        let rate = (inv_l * inv_c).sqrt().max(r * inv_l);
        Plain {
            inv_l,
            inv_c,
            v_fold,
            inv_fold_squared: 1.0 / (v_fold * v_fold),
            longest: LONGEST_STEP / rate,
            last_term: LAST_TERM * converter.v_in,
        }
    }

    /// The current the load draws at `v`.
    #[inline(always)]
    pub fn load_current(&self, load: &Load, v: f64) -> f64 {
        let constant = if v >= self.v_fold {
            load.power / v
        } else {
            load.power * v * self.inv_fold_squared
        };
        load.conductance * v + load.current + constant
    }

    /// Advances `(i, v)` by `h` seconds, or until the current reaches 0 if the drive stops there, or an open leg begins to
    /// conduct. Returns the time used.
    #[inline(always)]
    pub fn advance(&self, x: &mut (f64, f64), drive: &Drive, load: &Load, h: f64, track: &mut Track) -> f64 {
        if drive.give != 1.0 {
            return self.advance_part(x, drive, load, h, track);
        }
        self.advance_with(All, x, (drive, load), h, track)
    }

    // apart, so that the circuit whose output receives all of the current stays as short as it is
    #[inline(never)]
    fn advance_part(&self, x: &mut (f64, f64), drive: &Drive, load: &Load, h: f64, track: &mut Track) -> f64 {
        self.advance_with(Part(drive.give), x, (drive, load), h, track)
    }

    #[inline(always)]
    fn advance_with<G: Give<f64>>(
        &self,
        give: G,
        x: &mut (f64, f64),
        circuit: (&Drive, &Load),
        h: f64,
        track: &mut Track,
    ) -> f64 {
        if h <= self.longest
            && let Some(used) = self.leaf(give, x, circuit, h, track, 0)
        {
            return used;
        }
        self.split(give, x, circuit, h, track, 0)
    }

    #[cold]
    #[inline(never)]
    fn split<G: Give<f64>>(
        &self,
        give: G,
        x: &mut (f64, f64),
        circuit: (&Drive, &Load),
        h: f64,
        track: &mut Track,
        depth: u32,
    ) -> f64 {
        let half = 0.5 * h;
        let mut used = 0.0;
        for _ in 0..2 {
            let leaf = match half <= self.longest || depth >= DEEPEST_SPLIT {
                true => self.leaf(give, x, circuit, half, track, depth),
                false => None,
            };
            let step = leaf.unwrap_or_else(|| self.split(give, x, circuit, half, track, depth + 1));
            used += step;
            if step < half {
                break;
            }
        }
        used
    }

    /// One series; nothing if it would be too coarse.
    #[inline(always)]
    fn leaf<G: Give<f64>>(
        &self,
        give: G,
        x: &mut (f64, f64),
        (drive, load): (&Drive, &Load),
        h: f64,
        track: &mut Track,
        depth: u32,
    ) -> Option<f64> {
        let (i0, v0) = *x;
        // below the fold the load is a resistor, and the series has no 1 / v
        let folded = v0 < self.v_fold;
        let g = if folded {
            load.conductance + load.power * self.inv_fold_squared
        } else {
            load.conductance
        };
        let (power, w0) = if folded { (0.0, 0.0) } else { (load.power, 1.0 / v0) };
        // 0 keeps a current of 0 where it is: an open leg takes the same series
        let a = if drive.open { 0.0 } else { h * self.inv_l };
        let b = h * self.inv_c;
        let (i, v) = series(
            give,
            [i0, v0, w0],
            [a, b],
            [drive.emf, drive.r],
            [g, load.current, power],
        );
        let v_end = sum(&v);
        let coarse = (power != 0.0 && v[1].abs() > LARGEST_CHANGE * v0)
            || b * g > LONGEST_STEP
            || v[ORDER].abs() + TERM_BEFORE * v[ORDER - 1].abs() > self.last_term
            || (load.power != 0.0 && (v_end < self.v_fold) != folded);
        if coarse && depth < DEEPEST_SPLIT {
            return None;
        }
        let i_end = sum(&i);
        if drive.open && v_end < drive.starts_below {
            let mut above = v;
            above[0] -= drive.starts_below;
            let at = zero(&above, above[0] / (v0 - v_end));
            x.1 = value(&v, at);
            extremes(&v, at, x.1, track);
            return Some(if at < 1.0 { at * h } else { h });
        }
        // a current that begins at 0 and rises has not crossed it
        if drive.stops_at_zero && i_end * i0 <= 0.0 && !(i0 == 0.0 && i_end > 0.0) {
            if i0 == 0.0 {
                return Some(0.0);
            }
            let at = zero(&i, i0 / (i0 - i_end));
            *x = (0.0, value(&v, at));
            extremes(&v, at, x.1, track);
            track.current(0.0);
            // a crossing at the very end counts as reached, so that the caller always sees time go on
            return Some(if at < 1.0 { at * h } else { h });
        }
        *x = (i_end, v_end);
        extremes(&v, 1.0, v_end, track);
        track.current(i_end);
        Some(h)
    }
}

/// What a series is made of: a number, or numbers side by side.
pub(crate) trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    fn of(value: f64) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
}

/// How a series takes the share of the inductor's current that the output receives.
pub(crate) trait Give<T: Number>: Copy {
    /// That share of `x`.
    fn of(self, x: T) -> T;
}

/// All of it, without a product.
#[derive(Clone, Copy)]
pub(crate) struct All;

impl<T: Number> Give<T> for All {
    #[inline(always)]
    fn of(self, x: T) -> T {
        x
    }
}

/// A part of it.
#[derive(Clone, Copy)]
pub(crate) struct Part<T>(pub T);

impl<T: Number> Give<T> for Part<T> {
    #[inline(always)]
    fn of(self, x: T) -> T {
        self.0 * x
    }
}

type Coefficients<T> = [T; ORDER + 1];
type Series = Coefficients<f64>;

/// Coefficients of i and v from `[i, v, 1/v]`, `[h/L, h/C]`, `[emf, r]` and `[g, J, P]`.
#[inline(always)]
pub(crate) fn series<T: Number, G: Give<T>>(
    give: G,
    start: [T; 3],
    step: [T; 2],
    drive: [T; 2],
    load: [T; 3],
) -> (Coefficients<T>, Coefficients<T>) {
    const OVER: Series = [0.0, 1.0, 1.0 / 2.0, 1.0 / 3.0, 1.0 / 4.0, 1.0 / 5.0, 1.0 / 6.0];
    let ([a, b], [emf, r], [g, current, power]) = (step, drive, load);
    let zero = T::of(0.0);
    let (mut i, mut v) = ([zero; ORDER + 1], [zero; ORDER + 1]);
    // the load's constant-power current P w, and v / v0
    let (mut cpl, mut relative) = ([zero; ORDER + 1], [zero; ORDER + 1]);
    let w0;
    [i[0], v[0], w0] = start;
    cpl[0] = power * w0;
    i[1] = a * (emf - r * i[0] - give.of(v[0]));
    let rest = give.of(i[0]) - g * v[0] - current - cpl[0];
    v[1] = b * rest;
    relative[1] = b * w0 * rest;
    for k in 1..ORDER {
        let mut product = relative[1] * cpl[k - 1];
        for j in 2..=k {
            product = product + relative[j] * cpl[k - j];
        }
        cpl[k] = -product;
        let over = T::of(OVER[k + 1]);
        i[k + 1] = a * over * (-r * i[k] - give.of(v[k]));
        let rest = give.of(i[k]) - g * v[k] - cpl[k];
        v[k + 1] = b * over * rest;
        relative[k + 1] = b * over * w0 * rest;
    }
    (i, v)
}

/// The value at the end.
#[inline(always)]
pub(crate) fn sum<T: Number>(c: &Coefficients<T>) -> T {
    // from the smallest term up, nested as in `value`: the same bits at 1
    c[0] + (c[1] + (c[2] + (c[3] + (c[4] + (c[5] + c[6])))))
}

#[inline(always)]
fn value(c: &Series, x: f64) -> f64 {
    c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * (c[5] + x * c[6])))))
}

#[inline(always)]
fn slope(c: &Series, x: f64) -> f64 {
    c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * (4.0 * c[4] + x * (5.0 * c[5] + x * (6.0 * c[6])))))
}

/// Newton's iteration from a chord; the current is close to a straight line here.
fn zero(c: &Series, guess: f64) -> f64 {
    let mut x = if guess.is_finite() { guess } else { 0.0 };
    // twice the turns that the tests take at most
    for _ in 0..6 {
        let step = value(c, x) / slope(c, x);
        if !step.is_finite() {
            break;
        }
        x -= step;
        // the next step would be of the order of the square
        if step.abs() < 1e-9 {
            break;
        }
    }
    // NaN becomes 0, too
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// Extremes of v between 0 and `end`; inside, where the slope changes its sign.
#[inline(always)]
fn extremes(v: &Series, end: f64, v_end: f64, track: &mut Track) {
    let (first, last) = (v[1], slope(v, end));
    if first * last < 0.0 {
        // the slope is close to a straight line: its chord, then once more with the chord's inclination
        let reach = end / (first - last);
        let chord = first * reach;
        let x = chord + slope(v, chord) * reach;
        track.voltage(value(v, x));
    }
    track.voltage(v_end);
}
