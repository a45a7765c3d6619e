//! A design as the lines of a contract.

use plant::{Carrier, Topology};

use super::Design;

/// Digits of a gain: a thousandth of it is less than what L and C are known to.
const DIGITS: usize = 4;

impl Design {
    /// `[[observer]]` and `base` of `[actions]` for a contract with the signals `v_out` and `i_out`.
    #[must_use]
    pub fn contract(&self) -> String {
        let own = &self.nominal;
        let periods = -1.0 / libm::log(self.filter.slowest);
        let noise = &self.noise;
        let [i, v, b] = noise.process;
        format!(
            "{}# Observer and law for {} V from {} V by a {}, {} H, {} F, a period of {} s, by `policyc design`.\n\
             # Steady Kalman filter for {} V of noise and a model that is wrong by {} A, {} V and {} V a period: an error of the\n\
             # estimates decays to 37 % in {:.1} periods.\n\
             {}\n\
             {}\
             [actions]\n\
             base = \"{}\"\n",
            self.at_light_load(),
            own.v_ref,
            own.v_in,
            own.topology.word(),
            own.inductance,
            own.capacitance,
            short(own.period),
            short(noise.measured),
            short(i),
            short(v),
            short(b),
            periods,
            self.observer(),
            self.story(),
            self.law(),
        )
    }

    /// What the law does, as a comment.
    fn story(&self) -> String {
        let own = &self.nominal;
        if let Some(periods) = own.loop_periods() {
            return format!(
                "# The law leaves {} of an error of the current after a period. It asks for current by the voltage in {periods:.1} periods,\n\
                 # which stays below the zero in the right half-plane at {} A. It makes up for losses by the bias.\n",
                self.pole, own.load,
            );
        }
        let rests = match short(own.below_mean) {
            0.0 => "at the load current".to_owned(),
            below => format!(
                "{below} A below the load current, where the\n\
                 # current of a settled converter is when the switch turns on"
            ),
        };
        format!(
            "# The law has both poles at {}: it makes up for losses by the bias, and rests {rests}{}.\n",
            self.pole,
            match short(self.ripple_by_bias) == 0.0 {
                true => "",
                false => "; losses want another duty, which changes the ripple",
            },
        )
    }

    /// The table `[[observer]]`.
    #[must_use]
    pub fn observer(&self) -> String {
        let own = &self.nominal;
        let [current, voltage, bias] = self.filter.gains.map(short);
        let reach = self.reach();
        let lowest = if own.has_diode { 0.0 } else { -reach };
        // at the inductor: what a tenth of the source would be lost to, or twice what the plant file says is lost. At low voltages a
        // diode alone takes more than a tenth
        let most_bias = rounded(f64::max(0.1 * own.v_in, 2.0 * own.losses), 2);
        format!(
            "[[observer]]\n\
             name = \"model\"\n\
             {}\
             inductance = {:?}\n\
             capacitance = {:?}\n\
             input_voltage = {:?}\n\
             output_voltage = \"v_out\"\n\
             load_current = \"i_out\"\n\
             compute_delay = {}\n\
             gains = {{ current = {current}, voltage = {voltage}, bias = {bias} }}\n\
             current = [{lowest:?}, {reach:?}]\n\
             bias = [-{most_bias:?}, {most_bias:?}]\n",
            self.circuit(),
            own.inductance,
            own.capacitance,
            own.v_in,
            own.compute_delay,
        )
    }

    /// The keys that a buck whose switch is on first does without.
    fn circuit(&self) -> String {
        let own = &self.nominal;
        let topology = match own.topology {
            Topology::Buck => String::new(),
            other => format!("topology = \"{}\"\nhold = {:?}\n", other.word(), own.v_ref),
        };
        match self.carrier {
            Carrier::Centre => topology + "carrier = \"centre\"\n",
            Carrier::Trailing | Carrier::Leading => topology,
        }
    }

    /// What charges the capacitor, A, as an expression of a contract.
    #[must_use]
    pub fn surplus(&self) -> String {
        let own = &self.nominal;
        if own.topology != Topology::Buck {
            return "model_surplus".to_owned();
        }
        let by_bias = short(self.ripple_by_bias);
        let ripple = match by_bias {
            0.0 => String::new(),
            _ if by_bias > 0.0 => format!(" + {by_bias} * model_bias"),
            _ => format!(" - {} * model_bias", -by_bias),
        };
        let below = match short(own.below_mean) {
            0.0 => String::new(),
            below => format!(" + {below}"),
        };
        format!("model_current - i_out{below}{ripple}")
    }

    /// The duty of the law, as an expression of a contract.
    #[must_use]
    pub fn law(&self) -> String {
        let own = &self.nominal;
        let (v_ref, v_in) = (own.v_ref, own.v_in);
        // without an error: losses, which are the bias, want another duty
        let rest = match own.topology {
            Topology::Buck => format!("({v_ref} - model_bias) / {v_in}"),
            Topology::Boost => format!("1 - ({v_in} + model_bias) / {v_ref}"),
            Topology::BuckBoost => format!("({v_ref} - model_bias) / ({v_in} + {v_ref})"),
        };
        let by_voltage = short(self.by_voltage);
        // a slow loop asks for less than what the voltage itself does to the current
        let sign = if by_voltage < 0.0 { '+' } else { '-' };
        format!(
            "{rest} - {} * {} {sign} {} * (model_voltage - {v_ref})",
            short(self.by_current),
            match own.topology {
                Topology::Buck => format!("({})", self.surplus()),
                Topology::Boost | Topology::BuckBoost => self.surplus(),
            },
            by_voltage.abs(),
        )
    }

    /// What a law of a converter with a diode does not do.
    fn at_light_load(&self) -> String {
        let own = &self.nominal;
        if !own.has_diode {
            return String::new();
        }
        format!(
            "# Below {} A of load the diode stops the current in every period. This law is made for one that flows: the voltage then\n\
             # rests beside {} V.\n",
            short(own.least_load()),
            own.v_ref,
        )
    }

    /// Where an estimate of the current is clamped: twice the largest load, and four periods of the whole source voltage, beyond
    /// which a transient does not go.
    fn reach(&self) -> f64 {
        let own = &self.nominal;
        rounded(
            2.0 * own.load / own.give + 4.0 * own.v_in * own.period / own.inductance,
            2,
        )
    }
}

/// To the digits of a gain.
pub(super) fn short(x: f64) -> f64 {
    rounded(x, DIGITS)
}

/// To significant digits.
#[must_use]
pub fn rounded(x: f64, digits: usize) -> f64 {
    let text = format!("{x:.*e}", digits.saturating_sub(1));
    // a number that was just written reads back
    text.parse().unwrap_or(x)
}
