//! What tells one topology from another: one row of numbers for each, and the loss-free steady state.
//!
//! ```text
//! buck         v_in ── main ──┬── L ── v_out        main on: source and output; off: output alone
//!                           second
//! boost        v_in ── L ──┬── second ── v_out      main on: source alone; off: source and output
//!                         main
//! buck-boost   v_in ── main ──┬── second ── -v_out  main on: source alone; off: output alone
//!                             L
//! ```
//!
//! `second` is the diode, or the second switch with its body diode; what is not drawn goes to the return. Equations:
//! Erickson and Maksimovic, Fundamentals of Power Electronics, chapters 2 (ratios), 5 (DCM) and 8 (right half-plane zero).

use toml_input::{Fault, Faults, Message};

use crate::parameters::{Parameters, Topology};

/// The shares of the inductor's current that the source delivers and the output receives.
pub(crate) type Shares = (f64, f64);

impl Topology {
    /// Its word in a plant file.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Topology::Buck => "buck",
            Topology::Boost => "boost",
            Topology::BuckBoost => "buck-boost",
        }
    }

    /// Shares while the main switch conducts.
    pub(crate) fn on(self) -> Shares {
        match self {
            Topology::Buck => (1.0, 1.0),
            Topology::Boost | Topology::BuckBoost => (1.0, 0.0),
        }
    }

    /// Shares while the diode or the second switch conducts.
    pub(crate) fn off(self) -> Shares {
        match self {
            Topology::Buck | Topology::BuckBoost => (0.0, 1.0),
            Topology::Boost => (1.0, 1.0),
        }
    }

    /// Whether source, inductor, diode and output are in series, so that current begins without the switch as soon as the
    /// output lies below the source.
    pub(crate) fn starts_by_itself(self) -> bool {
        self.off() == (1.0, 1.0)
    }

    /// The duty that holds `v_out` without losses, in continuous conduction; 0 or 1 where none does.
    #[must_use]
    pub fn duty(self, v_in: f64, v_out: f64) -> f64 {
        let duty = match self {
            Topology::Buck => v_out / v_in,
            Topology::Boost => 1.0 - v_in / v_out,
            Topology::BuckBoost => v_out / (v_in + v_out),
        };
        duty.clamp(0.0, 1.0)
    }

    /// The output voltage that a duty makes without losses, in continuous conduction, V; without bound at a duty of 1 but for the buck.
    #[must_use]
    pub fn voltage(self, v_in: f64, duty: f64) -> f64 {
        match self {
            Topology::Buck => duty * v_in,
            Topology::Boost => v_in / (1.0 - duty),
            Topology::BuckBoost => v_in * duty / (1.0 - duty),
        }
    }

    /// What a duty of 1 adds to the voltage at the inductor, V.
    #[must_use]
    pub fn span(self, v_in: f64, v_out: f64) -> f64 {
        match self {
            Topology::Buck => v_in,
            Topology::Boost => v_out,
            Topology::BuckBoost => v_in + v_out,
        }
    }

    /// What stands against the current at a duty of 0, V: the inductor's voltage is `span duty - level`.
    #[must_use]
    pub fn level(self, v_in: f64, v_out: f64) -> f64 {
        match self {
            Topology::Buck | Topology::BuckBoost => v_out,
            Topology::Boost => v_out - v_in,
        }
    }

    /// Share of the inductor's current that the output receives over a period.
    #[must_use]
    pub fn give(self, duty: f64) -> f64 {
        match self {
            Topology::Buck => 1.0,
            Topology::Boost | Topology::BuckBoost => 1.0 - duty,
        }
    }

    /// Angular frequency of the zero in the right half-plane at `v_out` V and a load of `i_out` A, rad/s: more duty first takes
    /// current from the output. The buck has none.
    ///
    /// Erickson and Maksimovic, table 8.2: `D'^2 R/L` of the boost, `D'^2 R/(D L)` of the buck-boost.
    #[must_use]
    pub fn right_half_plane_zero(self, v_in: f64, v_out: f64, i_out: f64, inductance: f64) -> f64 {
        match self {
            Topology::Buck => f64::INFINITY,
            Topology::Boost | Topology::BuckBoost => {
                let give = self.give(self.duty(v_in, v_out));
                give * give * self.span(v_in, v_out) / (inductance * i_out.abs())
            }
        }
    }

    /// What the source delivers of an inductor current `i_l` at that duty, A.
    pub(crate) fn i_in(self, i_l: f64, v_in: f64, v_out: f64) -> f64 {
        match self {
            // by the balance of power, whose bits existing runs have
            Topology::Buck => i_l * v_out / v_in,
            Topology::Boost => i_l,
            Topology::BuckBoost => i_l * self.duty(v_in, v_out),
        }
    }

    /// Ripple of the inductor's current at that duty, times the inductance over the period, V.
    #[must_use]
    pub fn ripple(self, v_in: f64, v_out: f64) -> f64 {
        match self {
            Topology::Buck => v_out * (1.0 - v_out / v_in),
            Topology::Boost | Topology::BuckBoost => v_in * self.duty(v_in, v_out),
        }
    }
}

impl Parameters {
    /// Ripple of the inductor's current without losses at `v_out` V in continuous conduction, A peak to peak.
    #[must_use]
    pub fn ideal_ripple(&self, v_out: f64) -> f64 {
        let converter = &self.converter;
        converter.topology.ripple(converter.v_in, v_out) * self.t_sw() / converter.inductance
    }

    /// The mean inductor current that holds `v_out` V at a load of `i_out` A, without losses, A.
    #[must_use]
    pub fn holding_current(&self, v_out: f64, i_out: f64) -> f64 {
        let converter = &self.converter;
        i_out / converter.topology.give(converter.topology.duty(converter.v_in, v_out))
    }

    /// Refuses every topology but the buck, for what is built for that one alone; `what` is its name, such as `drm fit`.
    ///
    /// # Errors
    /// Another topology.
    pub fn require_buck(&self, what: &str) -> Result<(), Faults> {
        match other_than_buck(self, what) {
            None => Ok(()),
            Some(message) => Err(Fault::from(message).into()),
        }
    }
}

/// What is said where `what` is built for the buck alone and the converter is another.
pub(crate) fn other_than_buck(p: &Parameters, what: &str) -> Option<Message> {
    let other = match p.converter.topology {
        Topology::Buck => return None,
        other => other.word(),
    };
    let message = Message::new(format!("{what} is built for the buck converter alone"));
    let message = message.found(format!("`converter.topology` is \"{other}\""));
    Some(
        message
            .expected("\"buck\"")
            .hint("its formulas hold for no other topology; `simulate` takes any"),
    )
}
