//! What the network adds to: a law, behind an observer where there is one.

use closed_loop::design::{CurrentLaw, Design, Nominal};

/// A law of control and what it needs.
#[derive(Debug, Clone)]
pub(super) enum Base {
    /// The inductor current is estimated.
    Observed(Design),
    /// It is measured, in a boost or a buck-boost.
    Measured {
        /// The law.
        law: CurrentLaw,
        /// Standard deviation of the measured output voltage, V.
        noise: f64,
    },
}

impl Base {
    /// The converter that it is made for.
    pub fn nominal(&self) -> &Nominal {
        match self {
            Self::Observed(design) => &design.nominal,
            Self::Measured { law, .. } => &law.nominal,
        }
    }

    /// Standard deviation of the measured output voltage, V.
    pub fn noise(&self) -> f64 {
        match self {
            Self::Observed(design) => design.noise.measured,
            Self::Measured { noise, .. } => *noise,
        }
    }

    /// Control periods in which the law brings back a voltage that no effort can hurry, beside what the limit takes.
    pub fn patience(&self) -> f64 {
        // four time constants: 2 % is left, of a deviation that is a few bands
        self.nominal().loop_periods().map_or(0.0, |periods| 4.0 * periods)
    }

    /// The same, behind a number of periods that is granted as well.
    pub fn patience_in_words(&self) -> &'static str {
        match self.nominal().loop_periods() {
            None => "",
            Some(_) => " and four time constants of its loop",
        }
    }

    /// Why settling takes longer with other parts, behind a sentence.
    pub fn why_longer(&self) -> &'static str {
        match self {
            Self::Observed(_) => "; the observer has to find the other parts first",
            Self::Measured { .. } => "; the law is not made for these parts",
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
        match self.nominal().loop_periods() {
            None => "a PID controller that\n# measures the voltage, and what no controller can beat.",
            Some(_) => "classical controllers\n# that measure voltage and currents, and what no controller can beat.",
        }
    }

    /// Classical controllers of the scenario, as a list of the file.
    pub fn baselines(&self) -> &'static str {
        match self.nominal().loop_periods() {
            None => "\"pid\"",
            Some(_) => "\"cascade\", \"feed-forward\", \"deadbeat\"",
        }
    }
}
