//! How short the steps of the full circuit are: a share of its fastest time constant.

use serde::{Deserialize, Serialize};

use crate::effects::{dcr, derating, saturation};
use crate::parameters::Parameters;
use crate::signals::{Load, Signals};

/// Steps per time constant: of the LC filter, and of everything else.
// a step leaves about (h / tau)^5 / 120: 3e-9 of the filter's swing, 8e-6 of a fast transient. With these the
// bounds against ngspice hold (docs/results/plant.md); with steps of the filter twice as long the two ways of computing are
// 1e-5 V apart
const FILTER_STEP: f64 = 0.05;
// a step leaves 3e-6 of the filter's swing, less than those of everything else do
const COARSE_FILTER_STEP: f64 = 0.2;
pub(crate) const OTHER_STEP: f64 = 0.25;

/// How long the steps of the filter are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pace {
    /// Those with which the bounds against ngspice hold.
    #[default]
    Fine,
    /// Four times as long: for simulations by the ten thousand, of records with noise.
    Coarse,
}

impl Pace {
    /// Steps per time constant of the filter.
    fn filter_step(self) -> f64 {
        match self {
            Pace::Fine => FILTER_STEP,
            Pace::Coarse => COARSE_FILTER_STEP,
        }
    }
}

/// Whether the source has an input capacitor that matters.
pub(crate) fn has_c_in(p: &Parameters) -> bool {
    // a capacitor at an ideal source changes nothing, and its current would be 0 / 0
    p.source.c_in > 0.0 && (p.source.resistance > 0.0 || p.source.inductance > 0.0)
}

/// What is left of inductance and output capacitance, H and F, and whether the fall of the inductance may be passed.
struct Left {
    l: f64,
    c: f64,
    falls: bool,
}

impl Left {
    /// The least that saturation and derating can leave, whatever current and voltage are.
    fn least(p: &Parameters) -> Self {
        Left {
            l: p.converter.inductance * (1.0 - p.inductor.saturation),
            c: p.converter.capacitance * derating::least(p),
            falls: true,
        }
    }
}

/// The rates of the parts of the circuit without a load: the key of the part, 1/s, and steps per time constant.
fn rates(p: &Parameters, left: &Left, pace: Pace, mut ask: impl FnMut(&'static str, f64, f64)) {
    let Left { l, c, falls } = *left;
    let r = dcr::in_series(&p.inductor)
        + p.switch.r_ds_on.max(p.switch.r_ds_on_low).max(p.switch.r_d)
        + p.source.resistance;
    ask("converter.inductance", 1.0 / (l * c).sqrt(), pace.filter_step());
    if falls && p.inductor.saturation > 0.0 && p.inductor.steepness > 1.0 {
        // a step each time the current passes the width of the fall, at the slope that it has in the middle: longer ones jump over it
        let middle = p.converter.inductance * (1.0 - 0.5 * p.inductor.saturation);
        let rate = p.converter.v_in / middle * p.inductor.steepness / p.inductor.i_sat;
        ask("inductor.i_sat", rate, 1.0);
    }
    let mut ask = |key: &'static str, rate: f64| ask(key, rate, OTHER_STEP);
    ask("converter.inductance", (r + p.capacitor.esr) / l);
    // those of the sensors ask for nothing: `crate::lag`
    if p.load.cpl_time_constant > 0.0 {
        ask("load.cpl_time_constant", 1.0 / p.load.cpl_time_constant);
    }
    if p.cable.inductance > 0.0 {
        let cable = &p.cable;
        let series_c = 1.0 / (1.0 / cable.capacitance + 1.0 / c);
        ask("cable.inductance", 1.0 / (cable.inductance * series_c).sqrt());
        ask(
            "cable.inductance",
            (cable.resistance + p.capacitor.esr) / cable.inductance,
        );
    }
    if has_c_in(p) {
        let s = &p.source;
        let r = s.resistance + s.esr_in;
        if s.inductance > 0.0 {
            ask("source.inductance", 1.0 / (s.inductance * s.c_in).sqrt());
            ask("source.inductance", r / s.inductance);
        } else {
            ask("source.c_in", 1.0 / (r * s.c_in));
        }
    }
    if p.source.ripple > 0.0 {
        ask(
            "source.ripple_frequency",
            p.source.ripple_frequency * std::f64::consts::TAU,
        );
    }
}

/// Steps per second that the parts of the circuit ask for without a load, and the key of the part that asks for most.
pub(crate) fn fastest(p: &Parameters, pace: Pace) -> (&'static str, f64) {
    fastest_of(p, &Left::least(p), pace)
}

fn fastest_of(p: &Parameters, left: &Left, pace: Pace) -> (&'static str, f64) {
    let mut fastest = ("", f64::NEG_INFINITY);
    rates(p, left, pace, |key, rate, step| {
        if fastest.0.is_empty() || rate / step > fastest.1 {
            fastest = (key, rate / step);
        }
    });
    fastest
}

/// Share of what an inductor can lose, below which it is as good as linear: its fall need not be resolved. A convention.
const HARDLY: f64 = 0.01;

/// [`fastest`] over the next `h` seconds, where current and voltage are known to begin with: a curve that could leave a tenth, and leaves nine
/// tenths there, asks for a third of the steps.
pub(crate) fn fastest_near(p: &Parameters, pace: Pace, at: &Signals, h: f64) -> f64 {
    let least = Left::least(p);
    let (inductance, capacitance) = (p.converter.inductance, p.converter.capacitance);
    // no path puts more on the inductor than source and output together; what is left of it where that leads says how far it leads
    let across = p.converter.v_in.abs().max(at.v_in.abs()) + at.v_out.abs();
    let left_at = |i: f64| inductance * saturation::relative_inductance(&p.inductor, i);
    let far = |l: f64| at.i_l.abs() + h * across / l;
    let i = far(left_at(far(left_at(at.i_l.abs()))));
    let c_at = |v: f64| capacitance * derating::relative_capacitance(&p.capacitor, v);
    let v = at.v_out.abs() + h * (i + at.i_out.abs()) / c_at(at.v_out.abs());
    let left = Left {
        l: left_at(i).max(least.l),
        c: c_at(v).max(least.c),
        falls: saturation::relative_inductance(&p.inductor, i) < 1.0 - HARDLY * p.inductor.saturation,
    };
    fastest_of(p, &left, pace).1
}

/// The sum of the rates of the parts without a load, 1/s.
pub(crate) fn total(p: &Parameters) -> f64 {
    let mut total = 0.0;
    rates(p, &Left::least(p), Pace::Fine, |_, rate, _| total += rate);
    total
}

/// Steps per second that a load asks for: its resistance empties the capacitor beside it.
pub(crate) fn of_load(p: &Parameters, load: &Load) -> f64 {
    let beside = match p.cable.inductance > 0.0 {
        true => p.cable.capacitance,
        false => p.converter.capacitance,
    };
    load.conductance / beside / OTHER_STEP
}

#[cfg(test)]
mod tests {
    use super::{Pace, fastest, fastest_near};
    use crate::parameters::Parameters;
    use crate::signals::Signals;

    #[test]
    fn a_part_that_bends_asks_for_the_steps_of_what_is_left_of_it_where_the_current_can_go() {
        let linear = Parameters::ideal(48.0, 20e-6, 100e-6, 200e3);
        let mut bent = linear.clone();
        // a hundredth is left far above i_sat, which would be ten times the steps everywhere
        (bent.inductor.saturation, bent.inductor.i_sat) = (0.99, 100.0);
        let at = |i_l: f64| Signals {
            v_out: 12.0,
            i_l,
            i_out: i_l,
            v_in: 48.0,
        };
        let near = |i_l: f64| fastest_near(&bent, Pace::Fine, &at(i_l), 2.5e-6) / fastest(&linear, Pace::Fine).1;
        // 5 A and at most 7.5 A of ripple: L is 1 - .99 (.125)^2 of its own, and the steps grow by the root
        assert!((1.0..1.02).contains(&near(5.0)), "{}", near(5.0));
        // at i_sat half of it is left, and less where the current goes on
        assert!(near(100.0) > 2.0_f64.sqrt(), "{}", near(100.0));
        assert!((near(1e5) / 10.0 - 1.0).abs() < 1e-3, "{}", near(1e5));
    }
}
