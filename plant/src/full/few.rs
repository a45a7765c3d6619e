//! The circuit of inductor and output capacitor with an ESR, where no part changes with current, voltage or time: what does not
//! depend on the states is computed once for a path and a load.
//!
//! Invariant: the bits of [`Full::algebra`]. Every sum and product below is one of it, in its order; what is left out is a product
//! with 1 or a sum with 0.

use super::{Algebra, FEW, Full, I_L, Path, V_C};
use crate::effects::dcr;
use crate::signals::{Load, Signals};

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
    per_l: f64,
    per_c: f64,
}

impl<'a> Few<'a> {
    /// Nothing if a part changes, or there are other states.
    #[inline]
    pub fn new(full: &'a Full, path: &Path, load: &'a Load) -> Option<Self> {
        let p = &full.p;
        let [Some(per_l), Some(per_c)] = full.linear else {
            return None;
        };
        if full.has_many || p.source.ripple != 0.0 {
            return None;
        }
        let (v_source, r_th) = (p.converter.v_in, p.source.resistance);
        let r = path.r + path.share * r_th + dcr::in_series(&p.inductor) + full.apart(path, load);
        let (core, esr) = (p.inductor.core_conductance, p.capacitor.esr);
        let shrunk = if core == 0.0 { 1.0 } else { 1.0 / (1.0 + r * core) };
        let reflected = match path.open {
            true => 0.0,
            false => path.give * (esr * core + p.capacitor.esl * per_l) * shrunk,
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
            per_l,
            per_c,
        })
    }

    /// Whether the output receives all of the current, which flows, and nothing of the inductor's voltage acts on it.
    #[inline]
    pub fn is_whole(&self) -> bool {
        !self.open && self.give == 1.0 && self.core == 0.0 && self.reflected == 0.0 && self.share_r == 0.0
    }

    /// [`Full::algebra`]; `WHOLE` as [`Few::is_whole`] says.
    #[inline(always)]
    pub fn algebra<const WHOLE: bool>(&self, x: &[f64; FEW]) -> Algebra<FEW> {
        let i_l = if !WHOLE && self.open { 0.0 } else { x[I_L] };
        let drive = self.drive - self.r * i_l;
        let given = if WHOLE { i_l } else { self.give * i_l };
        let mut right = x[V_C] + self.esr * given;
        if !WHOLE {
            right += self.reflected * drive;
        }
        right -= self.esr_fixed;
        let (v_out, i_out) = self.output(right);
        let v_l = match WHOLE {
            true => drive - v_out,
            false if self.open => 0.0,
            false => (drive - self.give * v_out) * self.shrunk,
        };
        let i_b = if WHOLE { i_l } else { i_l + self.core * v_l };
        let received = if WHOLE { i_b } else { self.give * i_b };
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
            slopes: [v_l * self.per_l, (received - i_out) * self.per_c],
        }
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
