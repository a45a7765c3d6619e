//! Predictive control with an exact model.

use plant::{Load, Parameters, Rectifier, Signals};

use super::Design;
use crate::faults::Error;
use crate::part::Part;
use crate::time_optimal::{Target, TimeOptimal};

/// Predictive control on voltage, current and the load's power, with the ideal converter as model: to where
/// its duty acts by prediction, then [`TimeOptimal`]. What the plant loses beyond the model is learnt from the error of the predicted current.
///
/// No gain is tuned but `LEARNING`. It takes any load for constant power, and the current for continuous.
#[derive(Debug, Clone)]
pub struct Deadbeat {
    design: Design,
    planner: TimeOptimal,
    /// From a sample inside of the PWM period to its end, and from the start to the next sample.
    parts: Option<[Part; 2]>,
    /// Acts until the next start of a PWM period.
    in_force: f64,
    /// Commanded, not yet in force; the oldest first.
    pending: Vec<f64>,
    /// Duty that makes up for losses.
    correction: f64,
    /// Current expected at the next sample, A.
    expected: Option<f64>,
    /// The current stops at 0 A.
    has_diode: bool,
}

/// Share of the error of the predicted current that is learnt each period.
// twenty periods to learn: slower than a load step is answered, faster than losses drift. A convention
const LEARNING: f64 = 0.05;

impl Deadbeat {
    /// For the plant with these parameters; its losses, delays and sensors stay unknown to the model.
    ///
    /// # Errors
    /// If the parameters are not those of a converter.
    pub fn new(parameters: &Parameters, design: &Design) -> Result<Self, Error> {
        let design = *design;
        let mut model = Parameters::ideal(design.v_in, design.l, design.c, 1.0 / design.t);
        model.converter.topology = design.topology;
        model.converter.rectifier = parameters.converter.rectifier;
        model.converter.model = parameters.converter.model;
        // as given, because 1 / t may round: model and plant must have the same period to the bit
        model.converter.f_sw = parameters.converter.f_sw;
        model.pwm.carrier = parameters.pwm.carrier;
        model.load.v_fold = parameters.load.v_fold;
        let parts = match design.phase {
            0.0 => None,
            phase => Some([Part::new(&model, phase, 1.0)?, Part::new(&model, 0.0, phase)?]),
        };
        Ok(Self {
            parts,
            in_force: design.rest(),
            planner: TimeOptimal::new(&model, design.v_ref, [0.0, design.most()])?,
            pending: vec![design.rest(); design.delay],
            has_diode: parameters.converter.rectifier == Rectifier::Diode,
            correction: 0.0,
            expected: None,
            design,
        })
    }

    /// The duty for a measurement.
    pub fn step(&mut self, measured: &Signals) -> f64 {
        let (mut v, mut i) = (measured.v_out, measured.i_l);
        let load = Load::power(v * measured.i_out);
        let gain = self.design.span() * self.design.t / self.design.l;
        // a current that rests at 0 A does so at many duties, and says nothing of losses
        if let Some(expected) = self.expected
            && (i > 0.0 || !self.has_diode)
        {
            self.correction += LEARNING * (expected - i) / gain;
        }
        if let Some([rest, _]) = &mut self.parts {
            (v, i) = rest.pass(v, i, self.in_force, &load);
        }
        let at_start = (v, i);
        for duty in &self.pending {
            (v, i) = self.planner.predict(v, i, *duty, &load);
        }
        let valley = load.power / self.design.v_ref / self.design.give() - self.design.below_at_start();
        let target = Target {
            v_out: self.design.v_ref,
            // a diode blocks: only a synchronous leg has a valley below 0
            i_l: if self.has_diode { valley.max(0.0) } else { valley },
        };
        let planned = self.planner.duty(v, i, &load, target);
        let duty = (planned + self.correction).clamp(0.0, self.design.most());
        // what the model is to believe: the duty less its correction
        let believed = (duty - self.correction).clamp(0.0, self.design.most());
        self.pending.push(believed);
        self.in_force = self.pending.remove(0);
        // with a delay the next sample is decided by the oldest duty under way
        let (v, i) = at_start;
        let next = match &mut self.parts {
            Some([_, first]) => first.pass(v, i, self.in_force, &load),
            None => self.planner.predict(v, i, self.in_force, &load),
        };
        self.expected = Some(next.1);
        duty
    }
}
