//! The candidate causes: which parameters of the plant each moves, and how far.
//!
//! A cause has one or more forms, such as the gain of one current sensor or of both; a form is what is fitted. What the search
//! has to know of a cause stands in its entry: nothing asks for a name.

mod circuit;
mod instruments;
mod knob;
mod list;
mod surroundings;

use plant::{Rectifier, Topology};

use crate::drive::Model;
use knob::Reach;
pub use knob::{Bases, Knob};
pub use list::CAUSES;

/// A change of this share of a number that every converter has is a large one: tolerances of inductors, capacitors and
/// supplies are 5 to 20 %.
const LARGE_SHARE: f64 = 0.3;

/// Parameters that move by less than this share of their steps (0.1 % of an inductance, 5e-4 of a gain) are no effect: of that
/// size is what two simulators of one circuit differ by.
const TINY: f64 = 0.05;
/// A passive part that differs by less is the part that the model has: meters of inductance and capacitance are good for 0.5 %, and a
/// few degrees change both by as much. So little is what an error of a neighbour looks like.
const SAME_PART: f64 = 0.005;

/// Numbers of the plant that move the edges of the gate.
const EDGES: [&str; 5] = [
    "switch.dead_time",
    "switch.turn_on_delay",
    "switch.turn_off_delay",
    "switch.node_capacitance",
    "pwm.duty_offset",
];

/// Causes that are the curve of a part, of which the plant has one law.
pub const CURVES: [&str; 2] = ["l_saturation", "c_derating"];

/// How a form is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// From the model's own value.
    Own,
    /// From the model's own value or, where the response is flat there, from one of these starts, as of `From`; what none of them
    /// promises at first order is not followed.
    OwnOr(&'static [&'static [f64]]),
    /// From each of these starts, in steps of the parameters' own steps above the model's value.
    From(&'static [&'static [f64]]),
    /// Its first parameter takes each of these values (times its step), and is not smooth in between.
    Scan(&'static [f64]),
    /// Amplitude, frequency and phase of a line, from the strongest that stands in the residual.
    Line,
    /// Share lost, current and steepness of a fall of the inductance, between the peaks of the current that the records have.
    Knee,
    /// Resistance, inductance, capacitance and its series resistance of an input filter, from the swing that stands in the residual.
    Swing,
    /// The step of a counter, from the counts that the residual suggests; whole counts are likely, and it is not smooth.
    Counter(Cut),
}

/// What a counter makes of a duty that is no whole count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// The nearest count.
    Nearest,
    /// The count below, as a conversion to an integer does.
    Below,
}

/// How usual a cause is on a bench, the most usual first: where data cannot tell two apart, the reader is told of the more usual one
/// first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A part or a parasitic of the circuit: each converter has them, and no data sheet has them right.
    Part,
    /// How something is set or works: source, load, modulator, sampling.
    Setting,
    /// An error of an instrument, which was calibrated once.
    Instrument,
}

/// A cause.
#[derive(Debug)]
pub struct Cause {
    /// Its name in results.
    pub id: &'static str,
    /// How usual it is.
    pub kind: Kind,
    /// What is fitted, each by itself.
    pub forms: &'static [Form],
}

/// One way in which a cause may act.
#[derive(Debug)]
pub struct Form {
    /// What it is, for a reader.
    pub words: &'static str,
    /// Its parameters.
    pub knobs: &'static [Knob],
    /// How to fit it.
    pub search: Search,
    /// It differs from a simpler form by how it moves in time: settled points have no use for it.
    pub is_of_a_course: bool,
}

impl Form {
    /// The form, where only records with a course tell it from a simpler one.
    pub(crate) const fn of_a_course(self) -> Self {
        Form {
            is_of_a_course: true,
            ..self
        }
    }

    /// Whether the model's own value is a place to fit from, and to look from at first order.
    #[must_use]
    pub fn begins_at_own(&self) -> bool {
        matches!(self.search, Search::Own | Search::OwnOr(_))
    }

    /// How a counter of the duty rounds; nothing for other causes.
    pub(crate) fn cut(&self) -> Option<Cut> {
        match self.search {
            Search::Counter(cut) => Some(cut),
            _ => None,
        }
    }

    /// Whether its first parameter is varied continuously.
    #[must_use]
    pub fn is_smooth(&self) -> bool {
        !matches!(self.search, Search::Scan(_) | Search::Counter(_))
    }
}

/// A form of a cause with the numbers it has for one converter.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Which cause, as a place in [`CAUSES`]: candidates with the same are forms of one cause.
    pub number: usize,
    /// The cause.
    pub cause: &'static Cause,
    /// Which of its forms.
    pub form: &'static Form,
    /// The model's own values.
    pub own: Vec<f64>,
    /// Lowest and highest value and step of each.
    pub ranges: Vec<[f64; 3]>,
}

/// The frequency of a line on the source.
const LINE: [&str; 1] = ["source.ripple_frequency"];
/// Turns of a line in a record, at least: of less it is another source. They are sought from .6 turns on; a convention, half of that.
const LEAST_TURNS: f64 = 0.3;

impl Candidate {
    /// The largest change of the first parameter that is tried.
    #[must_use]
    pub fn reach(&self) -> f64 {
        let (own, [low, high, _]) = (self.own[0], self.ranges[0]);
        (high - own).max(own - low)
    }

    /// Whether the cause at `values` is no effect, whatever it gains.
    #[must_use]
    pub fn is_nothing(&self, values: &[f64]) -> bool {
        let knobs = self.form.knobs.iter();
        let least = knobs.zip(&self.own).zip(&self.ranges).map(|((knob, own), range)| {
            let is_a_part = self.cause.kind == Kind::Part && matches!(knob.reach, Reach::Own(..));
            (TINY * range[2]).max(if is_a_part { SAME_PART * own.abs() } else { 0.0 })
        });
        let mut sizes = values.iter().zip(&self.own).zip(least).take(self.sizes());
        self.sizes() > 0 && sizes.all(|((value, own), least)| (value - own).abs() < least)
    }

    /// Bounds the frequency of a line to those that turn in a record of `longest` seconds.
    pub(crate) fn turns_in(&mut self, longest: f64) {
        let knobs = self.form.knobs.iter().zip(&mut self.ranges);
        for (_, [low, high, _]) in knobs.filter(|(knob, _)| knob.keys == LINE) {
            *low = low.max(LEAST_TURNS / longest).min(*high);
        }
    }

    /// Whether it moves the edges of the gate, as the trim that stands beside every fit does.
    #[must_use]
    pub fn is_of_edges(&self) -> bool {
        let mut keys = self.form.knobs.iter().flat_map(|knob| knob.keys);
        keys.all(|key| EDGES.contains(key)) && !self.form.knobs[0].keys.is_empty()
    }

    /// Whether it is the curve of a part, of which the plant has one law.
    #[must_use]
    pub fn is_curve(&self) -> bool {
        CURVES.contains(&self.cause.id)
    }

    /// Whether it moves several numbers in proportion.
    #[must_use]
    pub fn is_in_proportion(&self) -> bool {
        self.form.knobs.iter().any(|knob| knob.in_proportion)
    }

    /// Whether it changes one of these numbers of the plant file.
    #[must_use]
    pub fn changes(&self, keys: &[String]) -> bool {
        let has = |key: &&str| keys.iter().any(|one| one == key);
        let knobs = self.form.knobs.iter();
        knobs.flat_map(|knob| knob.known_as()).any(has)
    }

    /// Starts that are given in steps of its parameters: above the model's value, or of several parameters as they are.
    pub(crate) fn in_steps(&self, list: &[&[f64]]) -> Vec<Vec<f64>> {
        let absolute = self.own.len() > 1;
        let start = |steps: &&[f64]| {
            let values = steps.iter().zip(&self.ranges).zip(&self.own);
            values
                .map(|((n, range), own)| n * range[2] + if absolute { 0.0 } else { *own })
                .collect()
        };
        list.iter().map(start).collect()
    }

    /// How many of its parameters make its size: all, or the first alone where the others only shape it.
    #[must_use]
    pub fn sizes(&self) -> usize {
        match self.form.search {
            Search::Own | Search::OwnOr(_) => self.own.len(),
            Search::From(_) | Search::Scan(_) | Search::Line | Search::Knee => 1,
            // a filter without resistance swings all the same
            Search::Swing => 2,
            // its step is one of counts
            Search::Counter(_) => 0,
        }
    }

    /// A change of the first parameter that nobody would call small: of a number that every converter has a share, else what
    /// converters typically have.
    #[must_use]
    pub fn large(&self) -> f64 {
        let knob = &self.form.knobs[0];
        let typical = knob.keys.first().and_then(|key| plant::parameter(key));
        match (knob.reach, typical) {
            (Reach::Own(..), _) => LARGE_SHARE * self.own[0],
            (_, Some(parameter)) if parameter.is_pure() => 0.5 * (parameter.typical.1 - parameter.typical.0),
            (_, Some(parameter)) => parameter.typical.1,
            // the sampling instant is no number of the plant and has no usual size: its reach alone decides
            (_, None) => f64::INFINITY,
        }
    }
}

/// The candidates for a converter and the resistors of its load.
#[must_use]
pub fn candidates(model: &Model, bases: &Bases) -> Vec<Candidate> {
    let candidate = |number: usize, cause: &'static Cause, form: &'static Form| {
        let own: Vec<f64> = form.knobs.iter().map(|knob| knob.get(model)).collect();
        let ranges = form.knobs.iter().zip(&own);
        let ranges = ranges.map(|(knob, own)| knob.range(*own, bases)).collect();
        Candidate {
            number,
            cause,
            form,
            own,
            ranges,
        }
    };
    let causes = CAUSES.iter().enumerate();
    // the plant has no such inductance where the leg interrupts the capacitor's current at every edge
    let is_buck = model.plant.converter.topology == Topology::Buck;
    let value = |key: &&str| plant::parameter(key).map(|parameter| parameter.get(&model.plant));
    let is_one = |knob: &Knob| {
        knob.keys
            .iter()
            .all(|key| value(key) == knob.keys.first().and_then(value))
    };
    // where both switches are there
    let is_in_proportion = |knob: &Knob| {
        let leg = model.plant.converter.rectifier == Rectifier::Synchronous;
        knob.in_proportion && leg && knob.keys.iter().all(|key| value(key) > Some(0.0))
    };
    let is_known = |form: &Form| {
        let resistors = form.knobs.iter().filter(|knob| knob.resistor.is_some()).count();
        (resistors == 0 || resistors == model.resistors.len())
            // what cuts off is an offset of half a count beside a counter, and takes the place of another
            && (form.search != Search::Counter(Cut::Below) || model.plant.pwm.duty_offset == 0.0)
            && (is_buck || !form.knobs.iter().any(|knob| knob.keys.contains(&"capacitor.esl")))
            // one value for numbers that differ in the model is no place to begin
            && (form.search != Search::Own || form.knobs.iter().all(|knob| match knob.in_proportion {
                true => is_in_proportion(knob),
                false => is_one(knob),
            }))
    };
    causes
        .flat_map(|(number, cause)| cause.forms.iter().map(move |form| (number, cause, form)))
        .filter(|(_, _, form)| is_known(form))
        .map(|(number, cause, form)| candidate(number, cause, form))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_stands_once_and_moves_numbers_that_the_plant_has() {
        for (n, cause) in CAUSES.iter().enumerate() {
            assert!(CAUSES[n + 1..].iter().all(|other| other.id != cause.id), "{}", cause.id);
            assert!(!cause.forms.is_empty(), "{}", cause.id);
            for knob in cause.forms.iter().flat_map(|form| form.knobs) {
                for key in knob.keys {
                    assert!(plant::parameter(key).is_some(), "{}: {key}", cause.id);
                }
            }
        }
    }

    #[test]
    fn a_ripple_of_the_source_is_sought_below_the_filter_and_up_to_mains_at_least() {
        let text = "[converter]\nv_in = 48.0\ninductance = 22e-6\ncapacitance = 330e-6\nf_sw = 200e3\n";
        let model = Model::new(&plant::Parameters::from_toml("plant.toml".as_ref(), text).unwrap());
        let highest = |filter: f64| {
            let bases = Bases {
                v: 12.0,
                i: 5.0,
                v_in: 48.0,
                t_sw: 5e-6,
                filter,
                inductance: 22e-6,
                across: 432.0,
            };
            let all = candidates(&model, &bases);
            let ripple = all.iter().find(|one| one.cause.id == "input_ripple").unwrap();
            ripple.ranges[1][1]
        };
        assert_eq!([highest(1.9e3), highest(3e4)], [2e3, 1.5e4]);
    }

    #[test]
    fn nanohenries_beside_a_small_inductor_are_an_effect_and_beside_a_large_one_none() {
        let is_nothing = |inductance: f64, esl: f64| {
            let text =
                format!("[converter]\nv_in = 5.0\ninductance = {inductance}\ncapacitance = 200e-6\nf_sw = 1e6\n");
            let model = Model::new(&plant::Parameters::from_toml("plant.toml".as_ref(), &text).unwrap());
            let bases = Bases {
                v: 1.0,
                i: 10.0,
                v_in: 5.0,
                t_sw: 1e-6,
                filter: 2e4,
                inductance,
                across: 4.0,
            };
            let all = candidates(&model, &bases);
            let found = all.iter().find(|one| one.cause.id == "esl").unwrap();
            found.is_nothing(&[esl])
        };
        // 1 nH and .33 uH: 15 mV of 5 V at each edge; 2 mH: 2.5 uV
        assert_eq!([is_nothing(0.33e-6, 1e-9), is_nothing(2e-3, 1e-9)], [false, true]);
    }

    #[test]
    fn a_number_that_is_certain_takes_its_causes_away() {
        let text = "[converter]\nv_in = 48.0\ninductance = 22e-6\ncapacitance = 330e-6\nf_sw = 200e3\n";
        let model = Model::new(&plant::Parameters::from_toml("plant.toml".as_ref(), text).unwrap());
        let bases = Bases {
            v: 12.0,
            i: 5.0,
            v_in: 48.0,
            t_sw: 5e-6,
            filter: 1.9e3,
            inductance: 22e-6,
            across: 432.0,
        };
        let candidates = candidates(&model, &bases);
        let left = |key: &str| {
            let mut left = candidates.iter().filter(|one| !one.changes(&[key.to_owned()]));
            left.any(|one| one.cause.id == "sampling_delay")
        };
        assert!(!left("pwm.sampling_phase") && left("pwm.carrier"));
        for candidate in &candidates {
            for key in candidate.form.knobs.iter().map(|knob| knob.known_as()) {
                assert!(!key.is_empty(), "{}", candidate.cause.id);
                assert!(key.iter().all(|key| plant::parameter(key).is_some()), "{key:?}");
                assert!(key.iter().all(|key| candidate.changes(&[(*key).to_owned()])), "{key:?}");
            }
        }
    }

    #[test]
    fn every_cause_is_documented() {
        let pages = [
            (
                "reference/diagnosis.md",
                include_str!("../../../docs/reference/diagnosis.md"),
            ),
            // what else looks like it, and how to check it at the bench
            (
                "how-to/plan-an-experiment.md",
                include_str!("../../../docs/how-to/plan-an-experiment.md"),
            ),
        ];
        for (name, page) in pages {
            for cause in CAUSES {
                assert!(
                    page.contains(&format!("`{}`", cause.id)),
                    "{} is missing in docs/{name}",
                    cause.id
                );
            }
        }
    }
}
