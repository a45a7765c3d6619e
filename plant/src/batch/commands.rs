//! What modulators and load boxes side by side make of duties and loads.

use crate::effects::{duty_offset, duty_quantisation, minimum_on_time};
use crate::lane::{LANES, Lane};
use crate::parameters::Pwm;
use crate::plain::Number;
use crate::plant::Plant;
use crate::signals::Load;

/// The modulators of [`LANES`] converters.
#[derive(Debug, Clone)]
pub(crate) struct Modulator {
    pwm: [Pwm; LANES],
    t_sw: Lane,
    /// Each gives the duty that is commanded.
    exact: bool,
}

impl Modulator {
    pub fn new(plants: &[Plant]) -> Self {
        Modulator {
            exact: plants.iter().all(|plant| {
                let pwm = &plant.parameters().pwm;
                pwm.duty_offset == 0.0 && pwm.duty_lsb == 0.0 && pwm.min_on_time == 0.0
            }),
            pwm: std::array::from_fn(|n| plants[n].parameters().pwm.clone()),
            t_sw: Lane::each(|n| plants[n].t_sw),
        }
    }

    /// `Plant::modulate` lane by lane.
    #[inline(always)]
    pub fn duties(&self, commanded: &[f64]) -> Lane {
        let mut duty = Lane::of(0.0);
        for (duty, commanded) in duty.0.iter_mut().zip(commanded) {
            *duty = if *commanded > 0.0 { commanded.min(1.0) } else { 0.0 };
        }
        if !self.exact {
            for n in 0..LANES {
                let (pwm, t_sw) = (&self.pwm[n], self.t_sw.0[n]);
                let shifted = duty_offset::shift(duty.0[n], pwm);
                duty.0[n] = minimum_on_time::limit(duty_quantisation::round(shifted, pwm.duty_lsb), pwm, t_sw);
            }
        }
        duty
    }
}

/// What the load boxes of [`LANES`] converters draw.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    resistor_gain: Lane,
    bleed: Lane,
    setting_gain: Lane,
}

impl Drawn {
    pub fn new(plants: &[Plant]) -> Self {
        Drawn {
            resistor_gain: Lane::each(|n| plants[n].parameters().load.resistor_gain),
            bleed: Lane::each(|n| plants[n].parameters().load.bleed),
            setting_gain: Lane::each(|n| plants[n].parameters().load.setting_gain),
        }
    }

    /// `load_setting::drawn` lane by lane: conductance, current, power.
    #[inline(always)]
    pub fn of(&self, loads: &[Load]) -> [Lane; 3] {
        let (mut conductance, mut current, mut power) = (Lane::of(0.0), Lane::of(0.0), Lane::of(0.0));
        for (n, load) in loads.iter().take(LANES).enumerate() {
            conductance.0[n] = load.conductance;
            current.0[n] = load.current;
            power.0[n] = load.power;
        }
        [
            conductance * self.resistor_gain + self.bleed,
            current * self.setting_gain,
            power * self.setting_gain,
        ]
    }
}
