//! What the network adds to: a law, behind an observer where there is one.

use closed_loop::design::{CurrentLaw, Design};

/// A law of control and what it needs.
#[derive(Debug, Clone)]
pub(super) enum Base {
    /// Of a buck converter, whose inductor current is estimated.
    Observed(Design),
    /// Of another one, whose inductor current is measured.
    Measured {
        /// The law.
        law: CurrentLaw,
        /// Standard deviation of the measured output voltage, V.
        noise: f64,
    },
}

/// Picks the same field of either.
macro_rules! either {
    ($base:expr, $field:ident) => {
        match $base {
            Base::Observed(design) => design.$field.clone(),
            Base::Measured { law, .. } => law.$field.clone(),
        }
    };
}

impl Base {
    pub fn has_diode(&self) -> bool {
        either!(self, has_diode)
    }

    pub fn period(&self) -> f64 {
        either!(self, period)
    }

    pub fn v_in(&self) -> f64 {
        either!(self, v_in)
    }

    pub fn inductance(&self) -> f64 {
        either!(self, inductance)
    }

    pub fn capacitance(&self) -> f64 {
        either!(self, capacitance)
    }

    /// Standard deviation of the measured output voltage, V.
    pub fn noise(&self) -> f64 {
        match self {
            Self::Observed(design) => design.noise.measured,
            Self::Measured { noise, .. } => *noise,
        }
    }

    /// The load current at which a diode just lets the current flow throughout the period, A.
    pub fn least_load(&self) -> f64 {
        match self {
            Self::Observed(design) => design.half_ripple,
            Self::Measured { law, .. } => law.half_ripple * law.give,
        }
    }

    /// The duty at rest, without losses.
    pub fn rest(&self) -> f64 {
        match self {
            Self::Observed(design) => design.v_ref / design.v_in,
            Self::Measured { law, .. } => law.rest,
        }
    }

    /// Control periods in which the law brings back a voltage that no effort can hurry, beside what the limit takes.
    pub fn patience(&self) -> f64 {
        match self {
            Self::Observed(_) => 0.0,
            // four time constants: 2 % is left, of a deviation that is a few bands
            Self::Measured { law, .. } => 4.0 * law.loop_periods(),
        }
    }

    /// What the settling time is granted beside the limit's.
    pub fn patience_in_words(&self) -> &'static str {
        match self {
            Self::Observed(_) => "ten periods",
            Self::Measured { .. } => "ten periods, and four time constants of its loop",
        }
    }

    /// Why settling takes longer with other parts.
    pub fn why_longer(&self) -> &'static str {
        match self {
            Self::Observed(_) => "the observer has to find the other parts first",
            Self::Measured { .. } => "the law is not made for these parts",
        }
    }

    /// The name of the converter.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Observed(_) => "buck",
            Self::Measured { law, .. } => law.topology.word(),
        }
    }

    /// The best that is known of the output voltage, as a source.
    pub fn voltage(&self) -> &'static str {
        match self {
            Self::Observed(_) => "model_voltage",
            Self::Measured { .. } => "v_out",
        }
    }

    /// The table `[[observer]]`, where there is one.
    pub fn observer(&self) -> String {
        match self {
            Self::Observed(design) => design.observer(),
            Self::Measured { .. } => String::new(),
        }
    }

    pub fn surplus(&self) -> String {
        match self {
            Self::Observed(design) => design.surplus(),
            Self::Measured { law, .. } => law.surplus(),
        }
    }

    pub fn law(&self) -> String {
        match self {
            Self::Observed(design) => design.law(),
            Self::Measured { law, .. } => law.law(),
        }
    }

    /// The contract's opening comment behind the name of the converter.
    pub fn story(&self) -> &'static str {
        match self {
            Self::Observed(_) => {
                "An observer estimates\n\
                 # inductor current, output voltage and losses; a law of control holds the voltage with them, and the network adds to\n\
                 # the law what makes it faster."
            }
            Self::Measured { .. } => {
                "A law of control\n\
                 # holds the voltage: a deadbeat of the inductor current, inside of a loop of the voltage that stays below the zero in\n\
                 # the right half-plane. The network adds to the law what makes it faster."
            }
        }
    }

    /// What else stands in the tables of the scenario, as its opening comment goes on.
    pub fn beside_it(&self) -> &'static str {
        match self {
            Self::Observed(_) => "a PID controller that\n# measures the voltage, and what no controller can beat.",
            Self::Measured { .. } => {
                "classical controllers\n# that measure voltage and currents, and what no controller can beat."
            }
        }
    }

    /// Classical controllers of the scenario, as a list of the file.
    pub fn baselines(&self) -> &'static str {
        match self {
            Self::Observed(_) => "\"pid\"",
            Self::Measured { .. } => "\"cascade\", \"feed-forward\", \"deadbeat\"",
        }
    }
}
