//! The circuit with every effect between two switching edges, by Runge-Kutta steps of fourth order that are short
//! against its fastest time constant; a load cable or a fast input filter among parts that do not change takes the matrix of [`affine`].
//!
//! Two voltages are algebraic. At the output `v_out = v_c + esr (i_b - i_out) + esl d(i_b - i_out)/dt`, at the input the
//! source as seen from the switch, `v_th - r_th i`. `i_b` is the winding current, `i_l` that of the inductance itself;
//! the core conductance carries the difference.
//!
//! ```text
//!                      v_in          v_sw                       v_out
//!  v + ripple ── R, L ──┬── switch ──┬── dcr ──[ L || core ]──┬── cable R, L ──┬── load: G, J,
//!                    esr_in        diode or    i_b         esr, esl   i_out    C of    P / v with
//!                     c_in        2nd switch                  C               cable    a lag
//!                       │            │                        │                │       │
//! ```
//!
//! A part of this picture that a converter does not have keeps its state where it was, with slope 0. So do the low-passes of the
//! sensors, which nothing here depends on: [`lag`] moves them on behind each step.

mod affine;
mod algebra;
pub(crate) mod beside;
mod few;
pub(crate) mod lanes;

use serde::{Deserialize, Serialize};

use self::few::{Few, LAGGED};
use crate::catalogue;
use crate::effects::core_loss;
use crate::entry::Way;
use crate::lag;
use crate::parameters::Parameters;
use crate::plain::Track;
use crate::rate::{self, Pace, has_c_in};
use crate::signals::{Load, Signals};

/// Number of states.
// those of the drawing above, and a low-pass for each of four sensors
pub(crate) const STATES: usize = SHOWN + 4;
const I_L: usize = 0;
const V_C: usize = 1;
const I_CABLE: usize = 2;
const V_LOAD: usize = 3;
const I_CPL: usize = 4;
const V_CIN: usize = 5;
const I_SOURCE: usize = 6;
const SHOWN: usize = 7;

/// States of a circuit with inductor and output capacitor alone. Loops over the others, which stand still there, and the branches
/// for parts that are not there took more than half of the time of a converter with an ESR.
const FEW: usize = V_C + 1;
/// With a cable, and nothing beyond it.
const WIRED: usize = V_LOAD + 1;

/// The states: inductance current, capacitor voltage, cable, load, source, four low-passes.
pub(crate) type States = [f64; STATES];

/// Steps of a period from which on a matrix, made anew for each interval, is quicker: it costs as much as some ten of them, and a period has
/// two intervals and more.
const MANY_STEPS: f64 = 24.0;

/// What the inductor is connected to: `v_l = share v_in + emf - r i - give v_out`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Path {
    /// How much of the inductor current the source delivers: 1, 0, or the duty of the averaged model.
    pub share: f64,
    /// How much of the current the output receives, and of its voltage stands against the inductor: 1, 0, or a mean.
    #[serde(default = "all")]
    pub give: f64,
    pub emf: f64,
    pub r: f64,
    /// The sign of current a diode lets through: 1 or -1; 0 for both. With an open leg: of a current that may begin; 0 for
    /// none.
    pub only: f64,
    /// No current.
    pub open: bool,
}

/// A state stored before there was a share: the output received all of the current.
fn all() -> f64 {
    1.0
}

/// A state stored before there was another law.
fn linear() -> bool {
    true
}

/// The circuit's constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Full {
    p: Parameters,
    has_cable: bool,
    has_c_in: bool,
    has_lag: bool,
    /// A state beyond [`FEW`] changes.
    has_many: bool,
    /// None beyond [`WIRED`] does.
    is_wired: bool,
    /// 1 / L, 1 / C of parts that change with neither current nor voltage.
    linear: [Option<f64>; 2],
    /// Whether the core's conductance is the same at every voltage.
    #[serde(default = "linear")]
    is_core_linear: bool,
    low_pass: [f64; 4],
    #[serde(default)]
    pace: Pace,
    /// Fastest rate that does not depend on the load, in steps per second.
    rate: f64,
    /// The sum of those rates, 1/s.
    total: f64,
    /// Whether a matrix takes it over a step.
    is_affine: bool,
}

/// What follows from the states at once; the slopes are those of the first `N` states.
#[derive(Debug, Clone, Copy)]
struct Algebra<const N: usize> {
    signals: Signals,
    v_l: f64,
    v_source: f64,
    slopes: [f64; N],
}

/// Whether a matrix takes the circuit over a step, of `rate` steps a second without it.
fn is_affine(p: &Parameters, rate: f64) -> bool {
    let is_fast = p.cable.inductance > 0.0 || has_c_in(p) && rate * p.t_sw() > MANY_STEPS;
    let is_linear = p.inductor.saturation == 0.0 && p.capacitor.derating == 0.0 && core_loss::is_linear(p);
    is_fast && is_linear && p.source.ripple == 0.0
}

/// Steps in a switching period without a load: what its simulation takes time for. 0 where the circuit is simple enough to need none.
#[must_use]
pub fn steps_per_period(p: &Parameters, pace: Pace) -> f64 {
    let rate = rate::fastest(p, pace).1;
    match (catalogue::way(p) < Way::Full, is_affine(p, rate)) {
        (true, _) => 0.0,
        (false, true) => affine::FEWER * rate * p.t_sw(),
        (false, false) => rate * p.t_sw(),
    }
}

impl Full {
    pub fn new(p: &Parameters) -> Self {
        let sensors = &p.sensors;
        let low_pass = [&sensors.v_out, &sensors.i_l, &sensors.i_out, &sensors.v_in].map(|s| s.low_pass);
        let linear = [
            (p.inductor.saturation == 0.0).then(|| 1.0 / p.converter.inductance),
            (p.capacitor.derating == 0.0).then(|| 1.0 / p.converter.capacitance),
        ];
        let (has_cable, has_lag) = (p.cable.inductance > 0.0, p.load.cpl_time_constant > 0.0);
        let pace = Pace::Fine;
        let rate = rate::fastest(p, pace).1;
        Full {
            p: p.clone(),
            linear,
            is_core_linear: core_loss::is_linear(p),
            has_cable,
            has_c_in: has_c_in(p),
            has_lag,
            has_many: has_cable || has_lag || has_c_in(p),
            is_wired: has_cable && !has_lag && !has_c_in(p),
            low_pass,
            pace,
            rate,
            total: rate::total(p),
            is_affine: is_affine(p, rate),
        }
    }

    /// Steps of another length.
    pub fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
        self.rate = rate::fastest(&self.p, pace).1;
        self.is_affine = is_affine(&self.p, self.rate);
    }

    /// States at rest around `v_out` and `i_l`.
    /// `give` is the output's share of the current then.
    pub fn initial(&self, v_out: f64, i_l: f64, load: &Load, give: f64) -> States {
        let mut x = [0.0; STATES];
        let cpl = self.constant_power(load, v_out);
        let i_out = load.conductance * v_out + load.current + cpl;
        let v_in = self.p.converter.v_in;
        let i_in = self.p.converter.topology.i_in(i_l, v_in, v_out);
        let v_c = v_out - self.p.capacitor.esr * (give * i_l - i_out);
        (x[I_L], x[V_C], x[V_LOAD], x[I_CPL]) = (i_l, v_c, v_out, cpl);
        x[I_CABLE] = i_out;
        x[V_CIN] = v_in - self.p.source.resistance * i_in;
        x[I_SOURCE] = i_in;
        let shown = [v_out, i_l, i_out, v_in];
        x[SHOWN..].copy_from_slice(&shown);
        x
    }

    /// Whether a state ever changes: it is that of a part which is there.
    pub fn moves(&self, state: usize) -> bool {
        match state {
            I_L | V_C => true,
            I_CABLE | V_LOAD => self.has_cable,
            I_CPL => self.has_lag,
            V_CIN => self.has_c_in,
            I_SOURCE => self.has_c_in && self.p.source.inductance > 0.0,
            low_pass => self.low_pass[low_pass - SHOWN] != 0.0,
        }
    }

    /// Lets the low-passes of the sensors hold these outputs; those that are no number stay.
    pub fn hold_filtered(x: &mut States, outputs: [f64; 4]) {
        for (state, output) in x[SHOWN..].iter_mut().zip(outputs) {
            if output.is_finite() {
                *state = output;
            }
        }
    }

    /// Lets a load whose constant power lags draw more than at rest, A.
    pub fn draw_more(&self, x: &mut States, current: f64) {
        if self.has_lag {
            x[I_CPL] += current;
        }
    }

    /// The four low-passes.
    pub fn filtered(x: &States) -> [f64; 4] {
        [x[SHOWN], x[SHOWN + 1], x[SHOWN + 2], x[SHOWN + 3]]
    }

    /// The signals at one instant.
    pub fn signals(&self, x: &States, path: &Path, load: &Load, t: f64) -> Signals {
        match self.has_many {
            true => self.algebra(&first::<SHOWN>(x), path, load, t).signals,
            false => self.algebra(&first::<FEW>(x), path, load, t).signals,
        }
    }

    /// Advances by `h` seconds from time `t`, or until the current reaches 0 if the path stops there, or an open leg
    /// begins to conduct. Returns the time used.
    pub fn advance(&self, x: &mut States, path: &Path, load: &Load, span: (f64, f64), track: &mut Track) -> f64 {
        // without a cable constant power acts at once, and its equation is not linear
        if self.is_affine && (self.has_cable || load.power == 0.0) {
            return match self.is_wired {
                true => self.advance_affine::<WIRED>(x, path, load, span, track),
                false => self.advance_affine::<SHOWN>(x, path, load, span, track),
            };
        }
        if let Some(few) = Few::new(self, path, load) {
            return self.advance_few(&few, x, path, load, span, track);
        }
        let near = self.core_near(x, path);
        macro_rules! advance {
            ($n:expr) => {
                self.advance_first(x, path, load, span, track, |x: &[f64; $n], t| {
                    self.algebra_near(x, path, load, t, &near)
                })
            };
        }
        match (self.is_wired, self.has_many) {
            (true, _) => advance!(WIRED),
            (false, true) => advance!(SHOWN),
            (false, false) => advance!(FEW),
        }
    }

    /// [`Full::advance`] of a circuit without other states than those of [`Few`].
    fn advance_few(
        &self,
        few: &Few<'_>,
        x: &mut States,
        path: &Path,
        load: &Load,
        span: (f64, f64),
        track: &mut Track,
    ) -> f64 {
        let is_bent = self.linear.contains(&None);
        macro_rules! advance {
            ($n:expr, $whole:expr, $bent:expr) => {
                self.advance_first(x, path, load, span, track, |x: &[f64; $n], _| {
                    few.algebra::<{ $n }, $whole, $bent>(x)
                })
            };
        }
        match (self.has_lag, few.is_whole(), is_bent) {
            (false, true, false) => advance!(FEW, true, false),
            (false, true, true) => advance!(FEW, true, true),
            (false, false, false) => advance!(FEW, false, false),
            (false, false, true) => advance!(FEW, false, true),
            (true, true, false) => advance!(LAGGED, true, false),
            (true, true, true) => advance!(LAGGED, true, true),
            (true, false, false) => advance!(LAGGED, false, false),
            (true, false, true) => advance!(LAGGED, false, true),
        }
    }

    /// [`Full::advance`] where the states behind the first `N` stand still (for `N` of [`LAGGED`] see [`place`]), and `algebra` gives what follows from states and time.
    #[inline(always)]
    fn advance_first<const N: usize>(
        &self,
        states: &mut States,
        path: &Path,
        load: &Load,
        span: (f64, f64),
        track: &mut Track,
        algebra: impl Fn(&[f64; N], f64) -> Algebra<N> + Copy,
    ) -> f64 {
        let (t, h) = span;
        let mut x = first::<N>(states);
        // a load step changes this rate, so it is not part of `rate`
        let far = rate::of_load(&self.p, load);
        let mut before = algebra(&x, t);
        let rate = match self.linear {
            [Some(_), Some(_)] => self.rate,
            // that of the worst current and voltage is known to be enough
            _ => rate::fastest_near(&self.p, self.pace, &before.signals, h).min(self.rate),
        };
        // at least one step: an interval of length 0 would be 0 / 0
        let count = (h * rate.max(far)).ceil().max(1.0);
        track.steps += count as u64;
        let step = h / count;
        let has_lags = self.low_pass != [0.0; 4];
        let whole = has_lags.then(|| lag::of_sensors(step, &self.low_pass));
        extend(track, &before.signals, path);
        let mut used = 0.0;
        for _ in 0..count as u64 {
            let start = x;
            x = runge_kutta(algebra, &start, &before, t + used, step);
            let mut after = algebra(&x, t + used + step);
            let mut length = step;
            let crossed = path.only != 0.0 && left(&after, path) <= 0.0;
            // the diode has no current to begin with: no time is used, and the caller goes on with an open leg
            if crossed && left(&before, path) <= 0.0 {
                length = 0.0;
                x = start;
                after = before;
            } else if crossed {
                length = crossing(algebra, &start, &before, path, (t + used, step), left(&after, path));
                x = runge_kutta(algebra, &start, &before, t + used, length);
                after = algebra(&x, t + used + length);
            }
            let middle = between(&start, &x, &before.slopes, &after.slopes, length);
            let mid = algebra(&middle, t + used + 0.5 * length).signals;
            if let Some(v) = vertex(before.signals.v_out, mid.v_out, after.signals.v_out) {
                track.voltage(v);
            }
            if let Some(whole) = &whole {
                // a crossing has shortened the step
                let cut = (length != step).then(|| lag::of_sensors(length, &self.low_pass));
                let shown = [&before.signals, &mid, &after.signals];
                lag::follow(&mut states[SHOWN..], cut.as_ref().unwrap_or(whole), shown);
            }
            used += length;
            if crossed {
                // exactly 0, because the next path is chosen by the sign of the current
                after.signals.i_l = 0.0;
                x[I_L] = 0.0;
            }
            extend(track, &after.signals, path);
            for (n, value) in x.iter().enumerate() {
                states[place::<N>(n)] = *value;
            }
            if crossed {
                return used.min(h);
            }
            before = after;
        }
        h
    }
}

/// When nothing is `left` of what keeps the path, by the Illinois method.
// apart: most steps cross nothing
#[cold]
#[inline(never)]
fn crossing<const N: usize>(
    algebra: impl Fn(&[f64; N], f64) -> Algebra<N> + Copy,
    x: &[f64; N],
    a: &Algebra<N>,
    path: &Path,
    (t, h): (f64, f64),
    end: f64,
) -> f64 {
    let (mut low, mut high) = ((0.0, left(a, path)), (h, end));
    // a bound alone: the tests take 8 turns at most, and as many halvings end at 1e-12 of the step
    for _ in 0..40 {
        let guess = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
        let inside = guess > low.0.min(high.0) && guess < low.0.max(high.0);
        if !inside || (high.0 - low.0).abs() < 1e-15 * h {
            break;
        }
        let state = runge_kutta(algebra, x, a, t, guess);
        let i = left(&algebra(&state, t + guess), path);
        if i * high.1 < 0.0 {
            low = high;
        } else {
            // the Illinois rule: plain regula falsi would keep this end for ever on a curve that bends one way
            low.1 *= 0.5;
        }
        high = (guess, i);
        // rounding of a current of amperes, 1e-16 of it, a thousand times
        if i.abs() < 1e-13 {
            break;
        }
    }
    high.0
}

#[inline(always)]
fn runge_kutta<const N: usize>(
    algebra: impl Fn(&[f64; N], f64) -> Algebra<N> + Copy,
    x: &[f64; N],
    first: &Algebra<N>,
    t: f64,
    h: f64,
) -> [f64; N] {
    // the slopes at the start are known from the step before: three evaluations instead of four
    let k1 = &first.slopes;
    let k2 = algebra(&moved(x, k1, 0.5 * h), t + 0.5 * h).slopes;
    let k3 = algebra(&moved(x, &k2, 0.5 * h), t + 0.5 * h).slopes;
    let k4 = algebra(&moved(x, &k3, h), t + h).slopes;
    let mut end = *x;
    let sixth = h / 6.0;
    for n in 0..N {
        end[n] += sixth * (k1[n] + 2.0 * (k2[n] + k3[n]) + k4[n]);
    }
    end
}

/// What keeps a path that ends by itself, and is 0 when it does: the current of a diode; of an open leg the voltage that the
/// diode blocks.
fn left<const N: usize>(a: &Algebra<N>, path: &Path) -> f64 {
    match path.open {
        true => a.signals.v_out - (a.signals.v_in + path.emf),
        false => a.signals.i_l * path.only,
    }
}

/// The states that change.
#[inline(always)]
fn first<const N: usize>(x: &States) -> [f64; N] {
    std::array::from_fn(|n| x[place::<N>(n)])
}

/// Where the state number `n` of `N` stands among all. A load that lags without a cable between has its current behind the first two.
#[inline(always)]
fn place<const N: usize>(n: usize) -> usize {
    if N == LAGGED && n == V_C + 1 { I_CPL } else { n }
}

#[inline(always)]
fn moved<const N: usize>(x: &[f64; N], slopes: &[f64; N], h: f64) -> [f64; N] {
    std::array::from_fn(|n| x[n] + h * slopes[n])
}

/// The cubic through both ends and slopes, at half way.
fn between<const N: usize>(x0: &[f64; N], x1: &[f64; N], k0: &[f64; N], k1: &[f64; N], h: f64) -> [f64; N] {
    std::array::from_fn(|n| 0.5 * (x0[n] + x1[n]) + h / 8.0 * (k0[n] - k1[n]))
}

fn extend(track: &mut Track, signals: &Signals, path: &Path) {
    track.voltage(signals.v_out);
    track.current(signals.i_l);
    track.discontinuous |= path.open;
}

/// Extreme of the parabola through three equidistant values, if it lies between the first and the last.
fn vertex(first: f64, middle: f64, last: f64) -> Option<f64> {
    let (slope, bend) = (0.5 * (last - first), first - 2.0 * middle + last);
    let at = -slope / bend;
    // without bend the quotient is infinite or NaN, and the comparison refuses both
    (at.abs() < 1.0).then_some(middle + 0.5 * slope * at)
}
