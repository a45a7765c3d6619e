//! What follows from the states at once: both algebraic voltages, the currents, the slopes.

use super::{Algebra, FEW, Full, I_CABLE, I_CPL, I_L, I_SOURCE, Path, States, V_C, V_CIN, V_LOAD};
use crate::effects::core_loss::Near;
use crate::effects::{dcr, derating, input_ripple, saturation};
use crate::signals::{Load, Signals};

impl Full {
    pub(super) fn constant_power(&self, load: &Load, v: f64) -> f64 {
        // continuous at the fold: P / v_fold on both sides
        let fold = self.p.load.v_fold;
        if v >= fold {
            load.power / v
        } else {
            load.power * v / (fold * fold)
        }
    }

    /// The source as the switch sees it: voltage and resistance.
    fn thevenin<const N: usize>(&self, x: &[f64; N], v_source: f64) -> (f64, f64) {
        let s = &self.p.source;
        if N == FEW || !self.has_c_in {
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

    pub(super) fn algebra<const N: usize>(&self, x: &[f64; N], path: &Path, load: &Load, t: f64) -> Algebra<N> {
        self.algebra_near(x, path, load, t, &Near::NOWHERE)
    }

    /// What a core that is no conductor does at the start of an interval.
    pub(super) fn core_near(&self, x: &States, path: &Path) -> Near {
        if self.is_core_linear || path.open {
            return Near::NOWHERE;
        }
        let v_in = if self.has_c_in { x[V_CIN] } else { self.p.converter.v_in };
        let drive = path.share * v_in + path.emf - path.r * x[I_L];
        Near::new(&self.p, drive - path.give * x[V_C])
    }

    /// [`Full::algebra`] beside a known conductance of the core.
    pub(super) fn algebra_near<const N: usize>(
        &self,
        x: &[f64; N],
        path: &Path,
        load: &Load,
        t: f64,
        near: &Near,
    ) -> Algebra<N> {
        let p = &self.p;
        // divisions are what a step costs most: none for a part that does not change, nor for one that is not there
        let per_l = self.linear[0]
            .unwrap_or_else(|| 1.0 / (p.converter.inductance * saturation::relative_inductance(&p.inductor, x[I_L])));
        let v_source = p.converter.v_in + input_ripple::voltage(&p.source, t);
        let (v_th, r_th) = self.thevenin(x, v_source);
        let r = path.r + path.share * r_th + dcr::in_series(&p.inductor) + self.apart(path, load);
        // v_l = (drive - give v_out) / (1 + r core), i_b = i_l + core v_l; nothing of it while no current flows
        let i_l = if path.open { 0.0 } else { x[I_L] };
        let drive = path.share * v_th + path.emf - r * i_l;
        let core = match self.is_core_linear {
            true => p.inductor.core_conductance,
            // but for what its own current and the ESR drop, hundredths of that voltage
            false => near.conductance(p, drive - path.give * x[V_C]),
        };
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
            slopes: [0.0; N],
        };
        self.slopes(x, path, load, per_l, &mut algebra);
        algebra
    }

    /// What the averaged model adds to the resistance: the output stands against the inductor while it receives the
    /// current, and then lies above its mean by the ESR's share of that current.
    pub(super) fn apart(&self, path: &Path, load: &Load) -> f64 {
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
    fn output<const N: usize>(
        &self,
        x: &[f64; N],
        load: &Load,
        give: f64,
        i_l: f64,
        (reflected, drive): (f64, f64),
    ) -> (f64, f64) {
        let c = &self.p.capacitor;
        let mut slope = 1.0 + give * reflected;
        let mut right = x[V_C] + c.esr * (give * i_l) + reflected * drive;
        if N != FEW && self.has_cable {
            let cable = &self.p.cable;
            let divided = c.esl / cable.inductance;
            slope += divided;
            right += divided * (x[V_LOAD] + cable.resistance * x[I_CABLE]) - c.esr * x[I_CABLE];
            // the cable's current is a state: constant power acts behind it and needs no equation here
            let v = if slope == 1.0 { right } else { right / slope };
            return (v, x[I_CABLE]);
        }
        let has_lag = N != FEW && self.has_lag;
        let fixed = load.current + if has_lag { x[I_CPL] } else { 0.0 };
        slope += c.esr * load.conductance;
        right -= c.esr * fixed;
        if has_lag || load.power == 0.0 {
            let v = if slope == 1.0 { right } else { right / slope };
            return (v, load.conductance * v + fixed);
        }
        // above the fold it is the larger solution of slope v^2 - right v + esr P = 0
        let square = right * right - 4.0 * slope * c.esr * load.power;
        let above = if square > 0.0 {
            (right + square.sqrt()) / (2.0 * slope)
        } else {
            0.0
        };
        if c.esr > 0.0 && above >= self.p.load.v_fold {
            let cpl = self.constant_power(load, above);
            return (above, load.conductance * above + fixed + cpl);
        }
        self.output_near_fold(load, slope, right, fixed)
    }

    /// Output voltage and current from `slope v + esr P / v = right` below the fold, or at any voltage without an ESR.
    #[inline(never)]
    pub(super) fn output_near_fold(&self, load: &Load, slope: f64, right: f64, fixed: f64) -> (f64, f64) {
        let esr = self.p.capacitor.esr;
        // without ESR the voltage is that of the capacitor, whatever the load draws; a division that it does not need
        let mut v = if slope == 1.0 { right } else { right / slope };
        if esr > 0.0 {
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
                v -= (slope * v + esr * cpl - right) / (slope + esr * turn).max(0.1 * slope);
            }
        }
        (v, load.conductance * v + fixed + self.constant_power(load, v))
    }

    fn slopes<const N: usize>(&self, x: &[f64; N], path: &Path, load: &Load, per_l: f64, a: &mut Algebra<N>) {
        let (p, s) = (&self.p, a.signals);
        let per_c = self.linear[1]
            .unwrap_or_else(|| 1.0 / (p.converter.capacitance * derating::relative_capacitance(&p.capacitor, x[V_C])));
        a.slopes[I_L] = a.v_l * per_l;
        a.slopes[V_C] = (path.give * s.i_l - s.i_out) * per_c;
        if N == FEW {
            return;
        }
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
