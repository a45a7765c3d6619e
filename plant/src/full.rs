//! The circuit with every effect between two switching edges, by Runge-Kutta steps of fourth order that are short
//! against its fastest time constant.
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

use serde::{Deserialize, Serialize};

use crate::effects::{dcr, derating, input_ripple, saturation};
use crate::lag;
use crate::parameters::Parameters;
use crate::plain::Track;
use crate::rate::{self, has_c_in};
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

/// What changes by the circuit's equations: all but the low-passes.
type Slopes = [f64; SHOWN];

/// The states: inductance current, capacitor voltage, cable, load, source, four low-passes.
pub(crate) type States = [f64; STATES];

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

/// The circuit's constants.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Full {
    p: Parameters,
    has_cable: bool,
    has_c_in: bool,
    has_lag: bool,
    /// 1 / L, 1 / C of parts that change with neither current nor voltage.
    linear: [Option<f64>; 2],
    low_pass: [f64; 4],
    /// Fastest rate that does not depend on the load, in steps per second.
    rate: f64,
}

/// What follows from the states at once.
#[derive(Debug, Clone, Copy, Default)]
struct Algebra {
    signals: Signals,
    v_l: f64,
    v_source: f64,
    slopes: Slopes,
}

impl Full {
    pub fn new(p: &Parameters) -> Self {
        let sensors = &p.sensors;
        let low_pass = [&sensors.v_out, &sensors.i_l, &sensors.i_out, &sensors.v_in].map(|s| s.low_pass);
        let linear = [
            (p.inductor.saturation == 0.0).then(|| 1.0 / p.converter.inductance),
            (p.capacitor.derating == 0.0).then(|| 1.0 / p.converter.capacitance),
        ];
        Full {
            p: p.clone(),
            linear,
            has_cable: p.cable.inductance > 0.0,
            has_c_in: has_c_in(p),
            has_lag: p.load.cpl_time_constant > 0.0,
            low_pass,
            rate: rate::fastest(p).1,
        }
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

    /// Lets the low-passes of the sensors hold these outputs; those that are no number stay.
    pub fn hold_filtered(x: &mut States, outputs: [f64; 4]) {
        for (state, output) in x[SHOWN..].iter_mut().zip(outputs) {
            if output.is_finite() {
                *state = output;
            }
        }
    }

    /// The four low-passes.
    pub fn filtered(x: &States) -> [f64; 4] {
        [x[SHOWN], x[SHOWN + 1], x[SHOWN + 2], x[SHOWN + 3]]
    }

    /// The signals at one instant.
    pub fn signals(&self, x: &States, path: &Path, load: &Load, t: f64) -> Signals {
        self.algebra(x, path, load, t).signals
    }

    /// Advances by `h` seconds from time `t`, or until the current reaches 0 if the path stops there, or an open leg
    /// begins to conduct. Returns the time used.
    pub fn advance(&self, x: &mut States, path: &Path, load: &Load, span: (f64, f64), track: &mut Track) -> f64 {
        let (t, h) = span;
        // a load step changes this rate, so it is not part of `rate`
        let far = rate::of_load(&self.p, load);
        // at least one step: an interval of length 0 would be 0 / 0
        let count = (h * self.rate.max(far)).ceil().max(1.0);
        let step = h / count;
        let whole = lag::of_sensors(step, &self.low_pass);
        let mut before = self.algebra(x, path, load, t);
        extend(track, &before.signals, path);
        let mut used = 0.0;
        for _ in 0..count as u64 {
            let start = *x;
            *x = self.step(&start, &before, path, load, t + used, step);
            let mut after = self.algebra(x, path, load, t + used + step);
            let mut length = step;
            let crossed = path.only != 0.0 && left(&after, path) <= 0.0;
            // the diode has no current to begin with: no time is used, and the caller goes on with an open leg
            if crossed && left(&before, path) <= 0.0 {
                length = 0.0;
                *x = start;
                after = before;
            } else if crossed {
                length = self.crossing(&start, &before, path, load, (t + used, step), left(&after, path));
                *x = self.step(&start, &before, path, load, t + used, length);
                after = self.algebra(x, path, load, t + used + length);
            }
            let middle = between(&start, x, &before.slopes, &after.slopes, length);
            let mid = self.algebra(&middle, path, load, t + used + 0.5 * length).signals;
            if let Some(v) = vertex(before.signals.v_out, mid.v_out, after.signals.v_out) {
                track.voltage(v);
            }
            if self.low_pass != [0.0; 4] {
                // a crossing has shortened the step
                let cut = (length != step).then(|| lag::of_sensors(length, &self.low_pass));
                let shown = [&before.signals, &mid, &after.signals];
                lag::follow(&mut x[SHOWN..], cut.as_ref().unwrap_or(&whole), shown);
            }
            used += length;
            if crossed {
                // exactly 0, because the next path is chosen by the sign of the current
                after.signals.i_l = 0.0;
                x[I_L] = 0.0;
            }
            extend(track, &after.signals, path);
            if crossed {
                return used.min(h);
            }
            before = after;
        }
        h
    }

    /// When nothing is `left` of what keeps the path, by the Illinois method.
    fn crossing(&self, x: &States, a: &Algebra, path: &Path, load: &Load, span: (f64, f64), end: f64) -> f64 {
        let (t, h) = span;
        let (mut low, mut high) = ((0.0, left(a, path)), (h, end));
        // a bound alone: the tests take 8 turns at most, and as many halvings end at 1e-12 of the step
        for _ in 0..40 {
            let guess = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
            let inside = guess > low.0.min(high.0) && guess < low.0.max(high.0);
            if !inside || (high.0 - low.0).abs() < 1e-15 * h {
                break;
            }
            let state = self.step(x, a, path, load, t, guess);
            let i = left(&self.algebra(&state, path, load, t + guess), path);
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

    fn step(&self, x: &States, first: &Algebra, path: &Path, load: &Load, t: f64, h: f64) -> States {
        // the slopes at the start are known from the step before: three evaluations instead of four
        let k1 = &first.slopes;
        let k2 = self.algebra(&moved(x, k1, 0.5 * h), path, load, t + 0.5 * h).slopes;
        let k3 = self.algebra(&moved(x, &k2, 0.5 * h), path, load, t + 0.5 * h).slopes;
        let k4 = self.algebra(&moved(x, &k3, h), path, load, t + h).slopes;
        let mut end = *x;
        let sixth = h / 6.0;
        for n in 0..SHOWN {
            end[n] += sixth * (k1[n] + 2.0 * (k2[n] + k3[n]) + k4[n]);
        }
        end
    }

    fn constant_power(&self, load: &Load, v: f64) -> f64 {
        // continuous at the fold: P / v_fold on both sides
        let fold = self.p.load.v_fold;
        if v >= fold {
            load.power / v
        } else {
            load.power * v / (fold * fold)
        }
    }

    /// The source as the switch sees it: voltage and resistance.
    fn thevenin(&self, x: &States, v_source: f64) -> (f64, f64) {
        let s = &self.p.source;
        if !self.has_c_in {
            // without capacitor the source's resistance is in series with the switch, while that conducts
            return (v_source, s.resistance);
        }
        if s.inductance > 0.0 {
            return (x[V_CIN] + s.esr_in * x[I_SOURCE], s.esr_in);
        }
        let r = s.resistance + s.esr_in;
        (
            (v_source * s.esr_in + x[V_CIN] * s.resistance) / r,
            s.resistance * s.esr_in / r,
        )
    }

    fn algebra(&self, x: &States, path: &Path, load: &Load, t: f64) -> Algebra {
        let p = &self.p;
        // divisions are what a step costs most: none for a part that does not change, nor for one that is not there
        let per_l = self.linear[0]
            .unwrap_or_else(|| 1.0 / (p.converter.inductance * saturation::relative_inductance(&p.inductor, x[I_L])));
        let v_source = p.converter.v_in + input_ripple::voltage(&p.source, t);
        let (v_th, r_th) = self.thevenin(x, v_source);
        let r = path.r + path.share * r_th + dcr::in_series(&p.inductor) + self.apart(path, load);
        let core = p.inductor.core_conductance;
        // v_l = (drive - give v_out) / (1 + r core), i_b = i_l + core v_l; nothing of it while no current flows
        let i_l = if path.open { 0.0 } else { x[I_L] };
        let drive = path.share * v_th + path.emf - r * i_l;
        let shrunk = if core == 0.0 { 1.0 } else { 1.0 / (1.0 + r * core) };
        let reflected = match path.open {
            true => 0.0,
            false => path.give * (p.capacitor.esr * core + p.capacitor.esl * per_l) * shrunk,
        };
        let (v_out, i_out) = self.output(x, load, path.give, i_l, (reflected, drive));
        let v_l = if path.open {
            0.0
        } else {
            (drive - path.give * v_out) * shrunk
        };
        let i_b = i_l + core * v_l;
        let v_in = v_th - path.share * r_th * i_b;
        let signals = Signals {
            v_out,
            i_l: i_b,
            i_out,
            v_in,
        };
        let mut algebra = Algebra {
            signals,
            v_l,
            v_source,
            slopes: [0.0; SHOWN],
        };
        self.slopes(x, path, load, per_l, &mut algebra);
        algebra
    }

    /// What the averaged model adds to the resistance: the output stands against the inductor while it receives the
    /// current, and then lies above its mean by the ESR's share of that current.
    fn apart(&self, path: &Path, load: &Load) -> f64 {
        // 0 in every state of the leg, where `give` is 0 or 1
        if path.give == 0.0 || path.give == 1.0 {
            return 0.0;
        }
        let esr = self.p.capacitor.esr;
        let g = if self.has_cable { 0.0 } else { load.conductance };
        path.give * (1.0 - path.give) * esr / (1.0 + esr * g)
    }

    /// Output voltage and current from
    /// `v (1 + give reflected) + esr i_out(v) = v_c + esr give i_l + reflected drive - esl di_out/dt`.
    fn output(&self, x: &States, load: &Load, give: f64, i_l: f64, (reflected, drive): (f64, f64)) -> (f64, f64) {
        let c = &self.p.capacitor;
        let mut slope = 1.0 + give * reflected;
        let mut right = x[V_C] + c.esr * (give * i_l) + reflected * drive;
        if self.has_cable {
            let cable = &self.p.cable;
            let divided = c.esl / cable.inductance;
            slope += divided;
            right += divided * (x[V_LOAD] + cable.resistance * x[I_CABLE]) - c.esr * x[I_CABLE];
            // the cable's current is a state: constant power acts behind it and needs no equation here
            return (right / slope, x[I_CABLE]);
        }
        let fixed = load.current + if self.has_lag { x[I_CPL] } else { 0.0 };
        slope += c.esr * load.conductance;
        right -= c.esr * fixed;
        let mut v = if slope == 1.0 { right } else { right / slope };
        if self.has_lag || load.power == 0.0 {
            return (v, load.conductance * v + fixed);
        }
        // above the fold it is the larger solution of slope v^2 - right v + esr P = 0
        let square = right * right - 4.0 * slope * c.esr * load.power;
        let above = if square > 0.0 {
            (right + square.sqrt()) / (2.0 * slope)
        } else {
            0.0
        };
        // without ESR the voltage is that of the capacitor, whatever the load draws
        if c.esr > 0.0 && above >= self.p.load.v_fold {
            v = above;
        } else if c.esr > 0.0 {
            // Newton's error squares: behind the fourth turn less than 2e-16 of v is left in the tests
            for _ in 0..4 {
                let cpl = self.constant_power(load, v);
                let turn = if v >= self.p.load.v_fold {
                    -cpl / v
                } else {
                    // P / v_fold^2, and not 0 / 0 at a voltage of 0
                    cpl / v.max(1e-300)
                };
                // constant power is a negative resistance: near the fold it may turn Newton's step round
                v -= (slope * v + c.esr * cpl - right) / (slope + c.esr * turn).max(0.1 * slope);
            }
        }
        (v, load.conductance * v + fixed + self.constant_power(load, v))
    }

    fn slopes(&self, x: &States, path: &Path, load: &Load, per_l: f64, a: &mut Algebra) {
        let (p, s) = (&self.p, a.signals);
        let per_c = self.linear[1]
            .unwrap_or_else(|| 1.0 / (p.converter.capacitance * derating::relative_capacitance(&p.capacitor, x[V_C])));
        a.slopes[I_L] = a.v_l * per_l;
        a.slopes[V_C] = (path.give * s.i_l - s.i_out) * per_c;
        let mut v_load = s.v_out;
        if self.has_cable {
            v_load = x[V_LOAD];
            let cpl = if self.has_lag {
                x[I_CPL]
            } else {
                self.constant_power(load, v_load)
            };
            let drawn = load.conductance * v_load + load.current + cpl;
            a.slopes[I_CABLE] = (s.v_out - p.cable.resistance * x[I_CABLE] - v_load) / p.cable.inductance;
            a.slopes[V_LOAD] = (x[I_CABLE] - drawn) / p.cable.capacitance;
        }
        if self.has_lag {
            a.slopes[I_CPL] = (self.constant_power(load, v_load) - x[I_CPL]) / p.load.cpl_time_constant;
        }
        if self.has_c_in {
            let source = &p.source;
            let i_source = match source.inductance > 0.0 {
                true => x[I_SOURCE],
                false => (a.v_source - s.v_in) / source.resistance,
            };
            a.slopes[V_CIN] = (i_source - path.share * s.i_l) / source.c_in;
            if source.inductance > 0.0 {
                a.slopes[I_SOURCE] = (a.v_source - source.resistance * i_source - s.v_in) / source.inductance;
            }
        }
    }
}

/// What keeps a path that ends by itself, and is 0 when it does: the current of a diode; of an open leg the voltage that the
/// diode blocks.
fn left(a: &Algebra, path: &Path) -> f64 {
    match path.open {
        true => a.signals.v_out - (a.signals.v_in + path.emf),
        false => a.signals.i_l * path.only,
    }
}

#[inline(always)]
fn moved(x: &States, slopes: &Slopes, h: f64) -> States {
    let mut end = *x;
    for n in 0..SHOWN {
        end[n] += h * slopes[n];
    }
    end
}

/// The cubic through both ends and slopes, at half way.
fn between(x0: &States, x1: &States, k0: &Slopes, k1: &Slopes, h: f64) -> States {
    let mut middle = *x0;
    for n in 0..SHOWN {
        middle[n] = 0.5 * (x0[n] + x1[n]) + h / 8.0 * (k0[n] - k1[n]);
    }
    middle
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
