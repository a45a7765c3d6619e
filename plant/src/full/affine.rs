//! A circuit with a load cable, or with an input filter and no constant power, of which no part changes with current, voltage or time. Between two
//! edges it is linear but for the constant power, and a matrix takes its states over a step exactly.
//!
//! `x' = A x + b + e r(v)`, v the load's voltage. `A` and `b` hold the tangent of the constant power's current at the voltage `u` of
//! the moment when they were made; `r` is what the tangent leaves. Over a step of `h` seconds, with `X = h A`, `phi_1 = sum X^k / (k+1)!`
//! and `phi_2 = sum X^k / (k+2)!` (Hochbruck and Ostermann, Exponential integrators, 2010, section 2):
//!
//! ```text
//! x(h) = e^X x + h phi_1 b + h (phi_1 - phi_2) e r(start) + h phi_2 e r(end)
//! ```
//!
//! All but `r` is exact; `r` is taken as a line over the step. The tangent is made anew where the voltage has gone far from `u`, or
//! crossed the load's fold, below which constant power is a resistor and leaves nothing.

mod pace;
mod rows;
mod step;
#[cfg(test)]
mod tests;

use self::rows::{End, Ends, Row};
use self::step::Step;
use super::{Full, I_CPL, I_L, Path, SHOWN, States, V_LOAD, between, first, left, moved};
use crate::lag;
use crate::plain::Track;
use crate::rate;
use crate::signals::{Load, Signals};

/// Columns.
type Matrix<const N: usize> = [[f64; N]; N];

/// Steps here over steps of the method of Runge and Kutta.
// only the extremes within a step and `r` ask for steps: a whole time constant leaves an extreme 2e-5 of the ringing
pub(super) const FEWER: f64 = 0.25;
/// Making a matrix takes as long as so many steps of Runge and Kutta.
const MADE: u64 = 10;
/// Steps of an interval at most; just above the fold constant power carries away at any rate.
const MOST: f64 = 1e6;
/// How far the voltage may go from the tangent's, relative.
// r is 4e-4 of the constant power's current there, and the line through it leaves a third of that where it rings
const FARTHEST: f64 = 0.02;

/// What constant power does: its current, and where that acts.
#[derive(Clone, Copy)]
struct Tangent {
    power: f64,
    fold: f64,
    /// The voltage of the tangent, and its inverse; the first below the fold stands for the resistor.
    u: f64,
    per_u: f64,
    folded: bool,
    /// The state whose slope it changes, and by how much per ampere.
    state: usize,
    factor: f64,
}

impl Tangent {
    /// Current at no voltage, and per volt.
    fn line(&self) -> (f64, f64) {
        match self.folded {
            true => (0.0, self.power / (self.fold * self.fold)),
            false => (2.0 * self.power * self.per_u, -self.power * self.per_u * self.per_u),
        }
    }

    /// The rate that the line adds, 1/s.
    fn fastest(&self) -> f64 {
        (self.factor * self.line().1).abs()
    }

    /// The rate at which the line carries away from the voltage: constant power is a negative resistance.
    fn grows(&self) -> f64 {
        if self.folded { 0.0 } else { self.fastest() }
    }

    #[inline(always)]
    fn leaves_nothing(&self) -> bool {
        self.power == 0.0 || self.folded
    }

    /// What the line leaves of the current.
    #[inline(always)]
    fn rest(&self, v: f64) -> f64 {
        if self.leaves_nothing() {
            return 0.0;
        }
        let q = (v - self.u) * self.per_u;
        self.power * self.per_u * (q * q / (1.0 + q))
    }

    #[inline(always)]
    fn crosses(&self, v: f64) -> bool {
        self.power != 0.0 && (v < self.fold) != self.folded
    }

    #[inline(always)]
    fn is_far(&self, v: f64) -> bool {
        !self.leaves_nothing() && (v - self.u).abs() > FARTHEST * self.u
    }
}

/// The circuit on one path under one load.
struct Circuit<const N: usize> {
    a: Matrix<N>,
    b: [f64; N],
    tangent: Tangent,
    v_out: Row<N>,
    /// First and second derivative of `v_out` in time; without `r`.
    rises: Row<N>,
    bends: Row<N>,
    i_l: Row<N>,
    i_out: Row<N>,
    v_in: Row<N>,
    /// What keeps the path.
    left: Row<N>,
    ends: Ends<N>,
}

impl<const N: usize> Circuit<N> {
    #[inline(always)]
    fn new(full: &Full, x: &[f64; N], path: &Path, load: &Load, t: f64) -> Self {
        let linear = Load { power: 0.0, ..*load };
        let at = |x: &[f64; N]| full.algebra(x, path, &linear, t);
        let zero = at(&[0.0; N]);
        let none = Row { of: [0.0; N], add: 0.0 };
        let row = |add| Row { add, ..none };
        let mut circuit = Circuit {
            a: [[0.0; N]; N],
            b: zero.slopes,
            tangent: full.tangent(x[V_LOAD], load),
            v_out: row(zero.signals.v_out),
            rises: none,
            bends: none,
            i_l: row(zero.signals.i_l),
            i_out: row(zero.signals.i_out),
            v_in: row(zero.signals.v_in),
            left: row(left(&zero, path)),
            ends: Ends::new([&none; 4]),
        };
        for n in 0..N {
            let mut unit = [0.0; N];
            unit[n] = 1.0;
            let one = at(&unit);
            for m in 0..N {
                circuit.a[n][m] = one.slopes[m] - zero.slopes[m];
            }
            circuit.v_out.of[n] = one.signals.v_out - zero.signals.v_out;
            circuit.i_l.of[n] = one.signals.i_l - zero.signals.i_l;
            circuit.i_out.of[n] = one.signals.i_out - zero.signals.i_out;
            circuit.v_in.of[n] = one.signals.v_in - zero.signals.v_in;
            circuit.left.of[n] = left(&one, path) - circuit.left.add;
        }
        let (at_zero, per_volt) = circuit.tangent.line();
        let Tangent { state, factor, .. } = circuit.tangent;
        circuit.b[state] += factor * at_zero;
        circuit.a[V_LOAD][state] += factor * per_volt;
        circuit.rises = circuit.derivative(&circuit.v_out);
        circuit.bends = circuit.derivative(&circuit.rises);
        circuit.ends = Ends::new([&circuit.v_out, &circuit.rises, &circuit.left, &circuit.i_l]);
        circuit
    }

    #[inline(always)]
    fn derivative(&self, row: &Row<N>) -> Row<N> {
        let mut derivative = Row { of: [0.0; N], add: 0.0 };
        for n in 0..N {
            derivative.add += row.of[n] * self.b[n];
            for k in 0..N {
                derivative.of[k] += row.of[n] * self.a[k][n];
            }
        }
        derivative
    }

    /// Takes in the output voltage over a step: its end, and an extreme within.
    #[inline(always)]
    fn follow(&self, track: &mut Track, x: [&[f64; N]; 2], ends: [End; 2], h: f64) {
        let [before, after] = ends;
        if before.rises * after.rises < 0.0 {
            let bends = [h * h * self.bends.at(x[0]), h * h * self.bends.at(x[1])];
            let value = extreme([before.v_out, after.v_out], [h * before.rises, h * after.rises], bends);
            track.voltage(value.unwrap_or(after.v_out));
        }
        track.voltage(after.v_out);
    }

    fn slopes(&self, x: &[f64; N], r: f64) -> [f64; N] {
        let mut slopes = self.b;
        for (column, x) in self.a.iter().zip(x) {
            slopes = moved(&slopes, column, *x);
        }
        slopes[self.tangent.state] += self.tangent.factor * r;
        slopes
    }

    fn signals(&self, x: &[f64; N]) -> Signals {
        Signals {
            v_out: self.v_out.at(x),
            i_l: self.i_l.at(x),
            i_out: self.i_out.at(x),
            v_in: self.v_in.at(x),
        }
    }

    /// Seconds after `start` until nothing is left of what keeps the path; within `h` nothing is. The states then.
    // apart: most steps cross nothing
    #[cold]
    #[inline(never)]
    fn crossing(&self, start: &[f64; N], ends: [f64; 2], h: f64, total: f64) -> (f64, [f64; N]) {
        // the diode has no current to begin with: no time is used, and the caller goes on with an open leg
        if ends[0] <= 0.0 {
            return (0.0, *start);
        }
        let (mut low, mut high) = (0.0, h);
        let mut length = h * ends[0] / (ends[0] - ends[1]);
        let mut x = *start;
        // Newton's error squares, and a chord is a good start; the tests take 4 turns at most
        for _ in 0..40 {
            x = *start;
            Step::new(self, length, total).take(&self.tangent, &mut x, self.tangent.rest(start[V_LOAD]));
            let left = self.left.at(&x);
            match left > 0.0 {
                true => low = length,
                false => high = length,
            }
            if left.abs() < 1e-12 || high - low < 1e-15 * h {
                break;
            }
            let slopes = self.slopes(&x, 0.0);
            let falls: f64 = self.left.of.iter().zip(&slopes).map(|(left, slope)| left * slope).sum();
            let next = length - left / falls;
            length = if low < next && next < high {
                next
            } else {
                0.5 * (low + high)
            };
        }
        (length, x)
    }

    /// Lets the sensors' low-passes follow a step.
    fn show(&self, shown: &mut [f64], lags: &[Option<lag::Lag>; 4], x: [&[f64; N]; 2], r: [f64; 2], h: f64) {
        let [k0, k1] = [self.slopes(x[0], r[0]), self.slopes(x[1], r[1])];
        let middle = between(x[0], x[1], &k0, &k1, h);
        let signals = [x[0], &middle, x[1]].map(|x| self.signals(x));
        lag::follow(shown, lags, [&signals[0], &signals[1], &signals[2]]);
    }
}

impl Full {
    fn tangent(&self, v: f64, load: &Load) -> Tangent {
        let fold = self.p.load.v_fold;
        let (state, factor) = match self.has_lag {
            true => (I_CPL, 1.0 / self.p.load.cpl_time_constant),
            false if self.has_cable => (V_LOAD, -1.0 / self.p.cable.capacitance),
            // there is no power then
            false => (V_LOAD, 0.0),
        };
        Tangent {
            power: load.power,
            fold,
            u: v,
            per_u: if v < fold || !self.has_cable { 0.0 } else { 1.0 / v },
            folded: v < fold,
            state,
            factor,
        }
    }

    /// [`Full::advance`] of a circuit that is affine.
    #[inline(never)]
    pub(super) fn advance_affine<const N: usize>(
        &self,
        states: &mut States,
        path: &Path,
        load: &Load,
        span: (f64, f64),
        track: &mut Track,
    ) -> f64 {
        wide::widest(Interval::<N> {
            full: self,
            states,
            path,
            load,
            span,
            track,
        })
    }

    #[inline(always)]
    fn advance_wide<const N: usize>(&self, interval: Interval<'_, N>) -> f64 {
        let Interval {
            states,
            path,
            load,
            track: caller,
            span: (t, h),
            ..
        } = interval;
        // in registers, not in the caller's memory
        let mut track = *caller;
        let far = rate::of_load(&self.p, load);
        let has_lags = self.low_pass != [0.0; 4];
        let mut x = first::<N>(states);
        let mut used = 0.0;
        track.discontinuous |= path.open;
        loop {
            let circuit = Circuit::new(self, &x, path, load, t);
            let asked = self.steps(&circuit, &x, path, far, h - used);
            let mut count = ((h - used) * asked).ceil().clamp(1.0, MOST) as u64;
            track.steps += MADE + count;
            let length = (h - used) / count as f64;
            let total = self.total + far * rate::OTHER_STEP + circuit.tangent.fastest();
            let step = Step::new(&circuit, length, total);
            let lags = has_lags.then(|| lag::of_sensors(length, &self.low_pass));
            let mut before = circuit.ends.at(&x);
            let mut r = circuit.tangent.rest(x[V_LOAD]);
            track.voltage(before.v_out);
            track.current(before.i_l);
            while count > 0 {
                let (start, r0) = (x, r);
                r = step.take(&circuit.tangent, &mut x, r0);
                if circuit.tangent.crosses(x[V_LOAD]) {
                    // a line knows nothing of the resistor on the other side
                    states[..N].copy_from_slice(&start);
                    let algebra = |x: &[f64; N], t: f64| self.algebra(x, path, load, t);
                    *caller = track;
                    let cut = self.advance_first(states, path, load, (t + used, length), caller, algebra);
                    track = *caller;
                    used += cut;
                    count -= 1;
                    if cut < length {
                        return used;
                    }
                    x = first::<N>(states);
                    break;
                }
                let after = circuit.ends.at(&x);
                if path.only != 0.0 && after.left <= 0.0 {
                    let (cut, mut there) = circuit.crossing(&start, [before.left, after.left], length, total);
                    circuit.follow(&mut track, [&start, &there], [before, circuit.ends.at(&there)], cut);
                    if has_lags {
                        let lags = lag::of_sensors(cut, &self.low_pass);
                        circuit.show(&mut states[SHOWN..], &lags, [&start, &there], [r0; 2], cut);
                    }
                    // exactly 0, because the next path is chosen by the sign of the current
                    there[I_L] = 0.0;
                    track.current(0.0);
                    states[..N].copy_from_slice(&there);
                    *caller = track;
                    return (used + cut).min(h);
                }
                if let Some(lags) = &lags {
                    circuit.show(&mut states[SHOWN..], lags, [&start, &x], [r0, r], length);
                }
                circuit.follow(&mut track, [&start, &x], [before, after], length);
                track.current(after.i_l);
                before = after;
                used += length;
                count -= 1;
                if circuit.tangent.is_far(x[V_LOAD]) {
                    break;
                }
            }
            if count == 0 {
                states[..N].copy_from_slice(&x);
                *caller = track;
                return h;
            }
        }
    }
}

/// What [`Full::advance`] is given.
struct Interval<'a, const N: usize> {
    full: &'a Full,
    states: &'a mut States,
    path: &'a Path,
    load: &'a Load,
    span: (f64, f64),
    track: &'a mut Track,
}

impl<const N: usize> wide::Work for Interval<'_, N> {
    type Output = f64;

    #[inline(always)]
    fn run(self) -> f64 {
        self.full.advance_wide(self)
    }
}

/// The extreme between 0 and 1 of the polynomial with these values, slopes and second derivatives at both ends.
#[inline(always)]
fn extreme(v: [f64; 2], d: [f64; 2], s: [f64; 2]) -> Option<f64> {
    let [left, fall, turn] = [v[1] - v[0] - d[0] - 0.5 * s[0], d[1] - d[0] - s[0], s[1] - s[0]];
    let c3 = 10.0 * left - 4.0 * fall + 0.5 * turn;
    let c4 = -15.0 * left + 7.0 * fall - turn;
    let c5 = 6.0 * left - 3.0 * fall + 0.5 * turn;
    let mut at = d[0] / (d[0] - d[1]);
    // the slope is close to a straight line: its chord is near, and what Newton's second step leaves in it squares in the value
    for _ in 0..2 {
        let slope = d[0] + at * (s[0] + at * (3.0 * c3 + at * (4.0 * c4 + at * 5.0 * c5)));
        let bend = s[0] + at * (6.0 * c3 + at * (12.0 * c4 + at * 20.0 * c5));
        at -= slope / bend;
    }
    (at > 0.0 && at < 1.0).then(|| v[0] + at * (d[0] + at * (0.5 * s[0] + at * (c3 + at * (c4 + at * c5)))))
}
