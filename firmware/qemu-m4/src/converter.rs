//! A buck converter with its load: what the controller regulates, in place of a power stage.
//!
//! Switched, with the diode's blocking; binary64 and `core` only. rustc neither contracts nor reorders, so the same
//! source gives the same bits on the processor and on the machine that checks it.

/// Control and PWM period, s.
pub const PERIOD: f64 = 1e-4;

const V_IN: f64 = 200.0;
const INDUCTANCE: f64 = 2e-3;
const CAPACITANCE: f64 = 1.5e-3;
/// Transistor, on.
const R_ON: f64 = 0.1;
/// Diode: threshold and slope.
const V_F: f64 = 0.8;
const R_D: f64 = 1e-3;
/// Bleeder of the load, S.
const BLEED: f64 = 1e-4;
/// Below this voltage the load of constant power is a resistor, V.
const V_FOLD: f64 = 20.0;
/// Parts of each of the two intervals of a period.
const PARTS: u32 = 8;

/// Inductor current and output voltage at the start of a PWM period, where the current is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Converter {
    /// A.
    pub i_l: f64,
    /// V.
    pub v_out: f64,
}

impl Converter {
    /// One PWM period: the transistor first, then the diode. `duty` lies in 0..1, `power` is the load's, W.
    pub fn period(&mut self, duty: f64, power: f64) {
        let on = duty * PERIOD;
        self.interval(V_IN, R_ON, on, power);
        self.interval(-V_F, R_D, PERIOD - on, power);
    }

    /// `L di/dt = emf - r i - v`, `C dv/dt = i - i_out`, by the midpoint rule.
    fn interval(&mut self, emf: f64, r: f64, duration: f64, power: f64) {
        let h = duration / f64::from(PARTS);
        for _ in 0..PARTS {
            let slope = |x: &Self| {
                let di = (emf - r * x.i_l - x.v_out) * (1.0 / INDUCTANCE);
                let dv = (x.i_l - x.i_out(power)) * (1.0 / CAPACITANCE);
                (di, dv)
            };
            let (di, dv) = slope(self);
            let (di, dv) = slope(&self.advanced(di, dv, 0.5 * h));
            *self = self.advanced(di, dv, h);
        }
    }

    /// The diode lets no current flow back.
    fn advanced(&self, di: f64, dv: f64, h: f64) -> Self {
        let i_l = self.i_l + h * di;
        Self {
            i_l: if i_l > 0.0 { i_l } else { 0.0 },
            v_out: self.v_out + h * dv,
        }
    }

    /// Current of the load, A.
    pub fn i_out(&self, power: f64) -> f64 {
        let constant = if self.v_out >= V_FOLD {
            power / self.v_out
        } else {
            power * self.v_out / (V_FOLD * V_FOLD)
        };
        BLEED * self.v_out + constant
    }
}
