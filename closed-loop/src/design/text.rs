//! A design as the lines of a contract.

use super::Design;

/// Digits of a gain: a thousandth of it is less than what L and C are known to.
const DIGITS: usize = 4;

impl Design {
    /// `[[observer]]` and `base` of `[actions]` for a contract with the signals `v_out` and `i_out`.
    #[must_use]
    pub fn contract(&self) -> String {
        let periods = -1.0 / self.filter.slowest.ln();
        let noise = &self.noise;
        let [i, v, b] = noise.process;
        format!(
            "{}# Observer and law for {} V from {} V, {} H, {} F, a period of {} s, by `policyc design`.\n\
             # Steady Kalman filter for {} V of noise and a model that is wrong by {} A, {} V and {} V a period: an error of the\n\
             # estimates decays to 37 % in {:.1} periods.\n\
             {}\n\
             # The law has both poles at {}: it makes up for losses by the bias, and rests {} A below the load current, where the\n\
             # current of a settled converter is when the switch turns on{}.\n\
             [actions]\n\
             base = \"{}\"\n",
            self.at_light_load(),
            self.v_ref,
            self.v_in,
            self.inductance,
            self.capacitance,
            short(self.period),
            short(noise.measured),
            short(i),
            short(v),
            short(b),
            periods,
            self.observer(),
            self.pole,
            short(self.half_ripple),
            match short(self.ripple_by_bias) == 0.0 {
                true => "",
                false => "; losses want another duty, which changes the ripple",
            },
            self.law(),
        )
    }

    /// The table `[[observer]]`.
    #[must_use]
    pub fn observer(&self) -> String {
        let [current, voltage, bias] = self.filter.gains.map(short);
        let reach = self.reach();
        let lowest = if self.has_diode { 0.0 } else { -reach };
        // at the switch node: what a tenth of the source would be lost to
        let most_bias = rounded(0.1 * self.v_in, 2);
        format!(
            "[[observer]]\n\
             name = \"model\"\n\
             inductance = {:?}\n\
             capacitance = {:?}\n\
             input_voltage = {:?}\n\
             output_voltage = \"v_out\"\n\
             load_current = \"i_out\"\n\
             compute_delay = {}\n\
             gains = {{ current = {current}, voltage = {voltage}, bias = {bias} }}\n\
             current = [{lowest:?}, {reach:?}]\n\
             bias = [-{most_bias:?}, {most_bias:?}]\n",
            self.inductance, self.capacitance, self.v_in, self.compute_delay,
        )
    }

    /// What charges the capacitor, A, as an expression of a contract: the mean of the estimated current without the load's.
    #[must_use]
    pub fn surplus(&self) -> String {
        let by_bias = short(self.ripple_by_bias);
        let ripple = match by_bias {
            0.0 => String::new(),
            _ if by_bias > 0.0 => format!(" + {by_bias} * model_bias"),
            _ => format!(" - {} * model_bias", -by_bias),
        };
        format!("model_current - i_out + {}{ripple}", short(self.half_ripple))
    }

    /// The duty of the law, as an expression of a contract.
    #[must_use]
    pub fn law(&self) -> String {
        format!(
            "({} - model_bias) / {} - {} * ({}) - {} * (model_voltage - {})",
            self.v_ref,
            self.v_in,
            short(self.by_current),
            self.surplus(),
            short(self.by_voltage),
            self.v_ref,
        )
    }

    /// What a law of a converter with a diode does not do.
    fn at_light_load(&self) -> String {
        if !self.has_diode {
            return String::new();
        }
        format!(
            "# Below {} A of load the diode stops the current in every period. This law is made for one that flows: the voltage then\n\
             # rests beside {} V.\n",
            short(self.half_ripple),
            self.v_ref,
        )
    }

    /// Where an estimate of the current is clamped: twice the largest load, and four periods of the whole source voltage, beyond
    /// which a transient does not go.
    fn reach(&self) -> f64 {
        rounded(2.0 * self.load + 4.0 * self.v_in * self.period / self.inductance, 2)
    }
}

fn short(x: f64) -> f64 {
    rounded(x, DIGITS)
}

/// To significant digits.
#[must_use]
pub fn rounded(x: f64, digits: usize) -> f64 {
    let text = format!("{x:.*e}", digits.saturating_sub(1));
    // a number that was just written reads back
    text.parse().unwrap_or(x)
}
