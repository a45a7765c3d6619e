//! What both laws know of a converter: its nominal values, without losses.

use plant::{Carrier, Parameters, Rectifier, Topology};
use toml_input::Message;

use crate::baselines;
use crate::faults::Error;

/// Share of what a loop of the voltage may ask for, of `baselines::Design::by_voltage`.
// whatever is asked for during a dip deepens it. With L and C 15 % low the law of a measured current exceeds the limit of all
// duties of examples/plants/boost-24-48.toml by 19, 15, 13 and 10 % at shares of 1, .7, .5 and .35, and that of
// buck-boost-12-24.toml by 29, 24, 18 and 15 %, where it settles in .18, .26, .35 and .48 ms
const SHARE: f64 = 0.4;

/// A converter at rest at its voltage.
#[derive(Debug, Clone, PartialEq)]
pub struct Nominal {
    /// The converter.
    pub topology: Topology,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Largest load current, A.
    pub load: f64,
    /// Source voltage, V.
    pub v_in: f64,
    /// Inductance, H.
    pub inductance: f64,
    /// Capacitance, F.
    pub capacitance: f64,
    /// Control period, s.
    pub period: f64,
    /// Periods from a measurement to its duty, 0 or 1.
    pub compute_delay: u32,
    /// The current stops at 0 A.
    pub has_diode: bool,
    /// Half of the current's ripple, A.
    pub half_ripple: f64,
    /// How far the current that an observer estimates lies below its mean, A: at the start of a period, wherever the plant is sampled,
    /// as its equations have it.
    pub below_mean: f64,
    /// How far the measured current lies below its mean where it is sampled, A.
    pub sampled_below_mean: f64,
    /// The duty at rest, without losses.
    pub rest: f64,
    /// Share of the inductor's current that the output receives at rest.
    pub give: f64,
    /// What the duty switches to the inductor at rest, V.
    pub span: f64,
    /// What the largest load costs at the inductor by resistances and diodes of the plant, V: an upper estimate.
    pub losses: f64,
    /// Current per volt of error that a loop of the voltage asks for where there is a zero in the right half-plane, A/V.
    pub asked: f64,
}

impl Nominal {
    /// Of a plant that holds `v_ref` V at loads up to `load` A.
    ///
    /// # Errors
    /// If the topology cannot make the voltage, the load is none, or the plant delays its duty by more than a period.
    pub fn new(plant: &Parameters, v_ref: f64, load: f64) -> Result<Self, Error> {
        let converter = &plant.converter;
        let (v_in, topology) = (converter.v_in, converter.topology);
        let (holds, expected) = match topology {
            Topology::Buck => (v_ref < v_in, "more than 0 and less than v_in"),
            Topology::Boost => (v_ref > v_in, "more than the source gives, v_in"),
            Topology::BuckBoost => (true, "more than 0"),
        };
        if !(v_ref > 0.0 && v_ref.is_finite() && holds) {
            let message = Message::new(format!("a {} converter cannot hold this voltage", topology.word()));
            let message = message.found(format!("{v_ref} V of {v_in} V"));
            return Err(message.expected(expected).into());
        }
        if !(load > 0.0 && load.is_finite()) {
            let message = Message::new("the largest load current is no current").found(format!("{load} A"));
            return Err(message.expected("more than 0 A").into());
        }
        let compute_delay = match plant.pwm.duty_delay {
            delay @ 0..=1 => delay,
            delay => {
                let message = Message::new("the duty waits longer than a law can look ahead");
                let message = message.found(format!("pwm.duty_delay = {delay}"));
                return Err(message.expected("0 or 1 period").into());
            }
        };
        let design = baselines::Design::new(plant, v_ref, load);
        Ok(Self {
            topology,
            v_ref,
            load,
            v_in,
            inductance: design.l,
            capacitance: design.c,
            period: design.t,
            compute_delay,
            has_diode: converter.rectifier == Rectifier::Diode,
            half_ripple: design.half_ripple(),
            below_mean: match plant.pwm.carrier {
                Carrier::Centre => 0.0,
                Carrier::Trailing | Carrier::Leading => design.half_ripple(),
            },
            sampled_below_mean: design.below_mean(),
            rest: design.rest(),
            give: design.give(),
            span: design.span(),
            losses: {
                let (inductor, switch) = (&plant.inductor, &plant.switch);
                let resistance = inductor.dcr + f64::max(switch.r_ds_on, switch.r_ds_on_low);
                switch.v_f + resistance * load / design.give()
            },
            asked: match topology {
                Topology::Buck => 0.0,
                Topology::Boost | Topology::BuckBoost => SHARE * design.by_voltage(load),
            },
        })
    }

    /// Control periods in which the loop of the voltage leaves 37 % of an error, where a zero in the right half-plane paces it.
    #[must_use]
    pub fn loop_periods(&self) -> Option<f64> {
        let paced = self.topology != Topology::Buck;
        paced.then(|| self.capacitance / self.period / (self.give * self.asked))
    }

    /// Control periods in which the source alone raises the current from nothing to what holds the largest load.
    pub(super) fn effort(&self) -> f64 {
        self.load / self.give * self.inductance / (self.v_in * self.period)
    }

    /// The load below which a diode stops the current in every period, A.
    #[must_use]
    pub fn least_load(&self) -> f64 {
        self.half_ripple * self.give
    }

    /// Duty per ampere of the inductor's current that a period brings back.
    pub(super) fn by_current(&self) -> f64 {
        self.inductance / self.period / self.span
    }

    /// Duty per volt, where a share of the current that is missing, `by_current` in duty per ampere, is brought back in a period.
    pub(super) fn by_voltage(&self, by_current: f64) -> f64 {
        // the duty at rest changes with the voltage by `D'/V`, V being the span
        by_current * self.asked - self.give / self.span
    }
}
