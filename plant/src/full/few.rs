//! The circuit of inductor and output capacitor with an ESR, and a load whose constant power may lag, without other states and a source that does
//! not ripple: what does not depend on the states is computed once for a path and a load.
//!
//! Invariant: the bits of [`Full::algebra`]. Every sum and product below is one of it, in its order; what is left out is a product
//! with 1 or a sum with 0.

use super::{Algebra, Full, I_L, Path, V_C};
use crate::effects::{dcr, derating, saturation};
use crate::signals::{Load, Signals};

/// Where the current of a constant power that lags stands among the states here.
const LAGS: usize = V_C + 1;
/// States with it.
pub(super) const LAGGED: usize = LAGS + 1;

/// What a path and a load make of the circuit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Few<'a> {
    full: &'a Full,
    load: &'a Load,
    open: bool,
    pub give: f64,
    v_source: f64,
    /// `share v_source + emf`
    pub drive: f64,
    pub r: f64,
    pub share_r: f64,
    esr: f64,
    core: f64,
    pub shrunk: f64,
    pub reflected: f64,
    /// Of the equation of the output voltage.
    pub slope: f64,
    esr_fixed: f64,
    /// `4 slope esr P`
    four: f64,
    /// Of parts that do not change.
    per_l: f64,
    per_c: f64,
}

impl<'a> Few<'a> {
    /// Nothing if there are other states, the source ripples, the core is of another law than a conductor, or a current that changes the
    /// inductance acts on the output at once.
    #[inline]
    pub fn new(full: &'a Full, path: &Path, load: &'a Load) -> Option<Self> {
        let p = &full.p;
        let [per_l, per_c] = full.linear;
        let acts_at_once = per_l.is_none() && p.capacitor.esl != 0.0;
        let is_other = full.has_cable || full.has_c_in || !full.is_core_linear;
        if is_other || p.source.ripple != 0.0 || acts_at_once {
            return None;
        }
        let (v_source, r_th) = (p.converter.v_in, p.source.resistance);
        let r = path.r + path.share * r_th + dcr::in_series(&p.inductor) + full.apart(path, load);
        let (core, esr) = (p.inductor.core_conductance, p.capacitor.esr);
        let shrunk = if core == 0.0 { 1.0 } else { 1.0 / (1.0 + r * core) };
        // of an inductance that changes nothing acts at once: `esl` is 0
        let reflected = match path.open {
            true => 0.0,
            false => path.give * (esr * core + p.capacitor.esl * per_l.unwrap_or(0.0)) * shrunk,
        };
        let mut slope = 1.0 + path.give * reflected;
        slope += esr * load.conductance;
        Some(Few {
            full,
            load,
            open: path.open,
            give: path.give,
            v_source,
            drive: path.share * v_source + path.emf,
            r,
            share_r: path.share * r_th,
            esr,
            core,
            shrunk,
            reflected,
            slope,
            esr_fixed: esr * load.current,
            four: 4.0 * slope * esr * load.power,
            per_l: per_l.unwrap_or(f64::NAN),
            per_c: per_c.unwrap_or(f64::NAN),
        })
    }

    /// Whether the output receives all of the current, which flows, and nothing of the inductor's voltage acts on it.
    #[inline]
    pub fn is_whole(&self) -> bool {
        !self.open && self.give == 1.0 && self.core == 0.0 && self.reflected == 0.0 && self.share_r == 0.0
    }

    /// [`Full::algebra`] of `N` states, of which the third is the lagging current if it is there; `WHOLE` as [`Few::is_whole`] says, `BENT` if a part
    /// changes.
    #[inline(always)]
    pub fn algebra<const N: usize, const WHOLE: bool, const BENT: bool>(&self, x: &[f64; N]) -> Algebra<N> {
        let i_l = if !WHOLE && self.open { 0.0 } else { x[I_L] };
        let drive = self.drive - self.r * i_l;
        let given = if WHOLE { i_l } else { self.give * i_l };
        let mut right = x[V_C] + self.esr * given;
        if !WHOLE {
            right += self.reflected * drive;
        }
        let (v_out, i_out) = match N == LAGGED {
            true => self.output_beside(right, x[LAGS]),
            false => self.output(right - self.esr_fixed),
        };
        let v_l = match WHOLE {
            true => drive - v_out,
            false if self.open => 0.0,
            false => (drive - self.give * v_out) * self.shrunk,
        };
        let i_b = if WHOLE { i_l } else { i_l + self.core * v_l };
        let received = if WHOLE { i_b } else { self.give * i_b };
        let [per_l, per_c] = match BENT {
            true => self.bent(x[I_L], x[V_C]),
            false => [self.per_l, self.per_c],
        };
        let mut slopes = [0.0; N];
        slopes[I_L] = v_l * per_l;
        slopes[V_C] = (received - i_out) * per_c;
        if N == LAGGED {
            let lag = self.full.p.load.cpl_time_constant;
            slopes[LAGS] = (self.full.constant_power(self.load, v_out) - x[LAGS]) / lag;
        }
        Algebra {
            signals: Signals {
                v_out,
                i_l: i_b,
                i_out,
                v_in: if WHOLE {
                    self.v_source
                } else {
                    self.v_source - self.share_r * i_b
                },
            },
            v_l,
            v_source: self.v_source,
            slopes,
        }
    }

    /// 1 / L and 1 / C, at least one of which changes.
    #[inline(always)]
    fn bent(&self, i: f64, v: f64) -> [f64; 2] {
        let p = &self.full.p;
        let [per_l, per_c] = self.full.linear;
        [
            per_l.unwrap_or_else(|| 1.0 / (p.converter.inductance * saturation::relative_inductance(&p.inductor, i))),
            per_c.unwrap_or_else(|| 1.0 / (p.converter.capacitance * derating::relative_capacitance(&p.capacitor, v))),
        ]
    }

    /// Output voltage and current beside a constant power that lags.
    #[inline(always)]
    fn output_beside(&self, right: f64, lagging: f64) -> (f64, f64) {
        let load = self.load;
        let fixed = load.current + lagging;
        let right = right - self.esr * fixed;
        let v = if self.slope == 1.0 { right } else { right / self.slope };
        (v, load.conductance * v + fixed)
    }

    /// Output voltage and current.
    #[inline(always)]
    fn output(&self, right: f64) -> (f64, f64) {
        let load = self.load;
        if load.power == 0.0 {
            let v = if self.slope == 1.0 { right } else { right / self.slope };
            return (v, load.conductance * v + load.current);
        }
        let fold = self.full.p.load.v_fold;
        if self.esr == 0.0 {
            let v = if self.slope == 1.0 { right } else { right / self.slope };
            return (
                v,
                load.conductance * v + load.current + self.full.constant_power(load, v),
            );
        }
        let square = right * right - self.four;
        if square > 0.0 {
            let sum = right + square.sqrt();
            // half of it is the quotient by 2, to the bit
            let above = if self.slope == 1.0 {
                0.5 * sum
            } else {
                sum / (2.0 * self.slope)
            };
            if above >= fold {
                return (above, load.conductance * above + load.current + load.power / above);
            }
        }
        self.full.output_near_fold(load, self.slope, right, load.current)
    }
}
