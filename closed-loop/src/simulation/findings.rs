//! What is simulated, and what was found.

use std::path::{Path, PathBuf};

use plant::Parameters;
use policy::{Interval, Policy};
use toml_input::{Fault, FileName, Message};

use super::spread::{self, Draws, Spread, Spreads};
use crate::agent::REFERENCE;
use crate::converter::Converter;
use crate::course::Course;
use crate::doubtful::doubts;
use crate::faults::Error;
use crate::limit::{Limit, left_out};
use crate::load_step::{LoadKind, LoadStep};
use crate::outside::Open;
use crate::scenario_file::Scenario;
use crate::suits::{draws, driving, held_by, holds_power, reaches, suits, v_ref};

/// Name of the policy among the controllers.
pub const POLICY: &str = "policy";
/// Name of the law that a policy adds to, on its own.
pub(super) const LAW: &str = "law alone";

/// Makes a converter of a plant's file and numbers that take the place of the file's.
type Load<'a> = dyn Fn(FileName, &[(String, f64)]) -> Result<Converter, Error> + 'a;

/// A scenario with everything it needs, all of it sound.
#[derive(Debug, Clone)]
pub struct Setting {
    /// What the file says.
    pub scenario: Scenario,
    /// The policy.
    pub policy: Policy,
    /// Index of the output whose duty is the plant's; 0 of a policy with one.
    pub output: usize,
    /// The plant's file.
    pub plant: PathBuf,
    /// The plant, with the scenario's numbers in it.
    pub converter: Converter,
    /// What the classical controllers are designed on: the plant, unless told otherwise.
    pub designed_on: Parameters,
    /// Numbers of the plant, on whose values all controllers are judged as well: one or two of a grid.
    pub spread: Vec<Spread>,
    /// Whether the values are drawn.
    pub draws: Option<Draws>,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// What the user should know of the scenario, one sentence each.
    pub notes: Vec<String>,
}

/// Everything found on one load step.
#[derive(Debug, Clone)]
pub struct Step {
    /// The load step.
    pub step: LoadStep,
    /// Controllers by name: [`POLICY`], then the classical ones.
    pub courses: Vec<(String, Course)>,
    /// What no controller can beat, by name.
    pub limits: Vec<(String, Limit)>,
}

/// The comparison of controllers that should be one.
#[derive(Debug, Clone)]
pub struct Check {
    /// Each of them; the others are compared with the first.
    pub names: Vec<String>,
    /// Control periods of each, over all load steps and instants.
    pub periods: usize,
    /// The first difference of each that has one, on each load step, in words.
    pub differences: Vec<String>,
}

/// What a simulation found; the files and the summary of it are methods.
#[derive(Debug, Clone)]
pub struct Findings {
    /// What was simulated, with notes that came up on the way.
    pub setting: Setting,
    /// What ran the policy.
    pub controller: String,
    /// In the order of the scenario.
    pub steps: Vec<Step>,
    /// If there was more than one controller of the policy.
    pub check: Option<Check>,
    /// If the setting has a spread.
    pub spread: Option<Spreads>,
}

impl Setting {
    /// Puts a scenario, which was read from `file`, and a policy together; `plant` is a plant's file in the place of the
    /// scenario's.
    ///
    /// # Errors
    /// If no plant or no voltage to hold is named, the plant's file is none, or policy and plant do not suit each other.
    pub fn new(file: &Path, scenario: Scenario, policy: Policy, plant: Option<FileName>) -> Result<Self, Error> {
        Self::load(file, scenario, policy, plant, &Converter::load)
    }

    /// [`Setting::new`], of which a converter from outside is opened by `open`.
    ///
    /// # Errors
    /// As [`Setting::new`], and those of `open`.
    pub fn open(
        file: &Path,
        scenario: Scenario,
        policy: Policy,
        plant: Option<FileName>,
        open: &Open<'_>,
    ) -> Result<Self, Error> {
        Self::load(file, scenario, policy, plant, &|name, set| {
            Converter::open(name, set, open)
        })
    }

    fn load(
        file: &Path,
        scenario: Scenario,
        policy: Policy,
        plant: Option<FileName>,
        load: &Load<'_>,
    ) -> Result<Self, Error> {
        let Some(name) = plant.or_else(|| scenario.plant.clone()) else {
            let message = Message::new("no plant").hint("plant = \"../plants/paper-model.toml\", or --plant PLANT");
            return Err(Fault::in_file(file, message).into());
        };
        let plant = name.shown.clone();
        let output = driving(scenario.output.as_deref(), &policy, file)?;
        let converter = load(name, &scenario.set)?;
        let references: Vec<f64> = (scenario.load_steps.iter().filter_map(|step| step.reference))
            .flatten()
            .collect();
        let v_ref = v_ref(scenario.v_ref.or(references.first().copied()), &policy, file)?;
        for voltage in references.iter().copied().chain([v_ref]) {
            told(&policy, voltage, !references.is_empty(), file)?;
            reaches(converter.parameters(), voltage, file)?;
        }
        of_this_converter(&scenario, v_ref, file)?;
        suits(&policy, converter.parameters(), v_ref, file)?;
        behind(&policy, &scenario.observers, file)?;
        draws(converter.parameters(), &scenario.load_steps, file)?;
        for v_in in scenario.load_steps.iter().filter_map(|step| step.source).flatten() {
            let mut other = converter.parameters().clone();
            other.converter.v_in = v_in;
            reaches(&other, v_ref, file)?;
        }
        if scenario.load_steps.iter().any(|step| step.kind == LoadKind::Power) {
            let lowest = references.iter().copied().fold(v_ref, f64::min);
            holds_power(converter.parameters(), lowest, &plant)?;
        }
        Ok(Self {
            notes: notes(&scenario, &policy, &converter, v_ref),
            scenario,
            policy,
            output,
            plant,
            designed_on: converter.parameters().clone(),
            spread: Vec::new(),
            draws: None,
            converter,
            v_ref,
        })
    }
}

impl Setting {
    /// The classical controllers are designed on the converter of another plant's file.
    ///
    /// # Errors
    /// If the file is no plant, or one of another topology or control period, for which a design would mean nothing here.
    pub fn designed_on(mut self, file: &Path) -> Result<Self, Error> {
        // a design is made from numbers: those beside a converter from outside are meant for it
        let (nominal, _) = Parameters::nominal_from_file(FileName::new(file))?;
        let (ours, theirs) = (self.converter.parameters(), &nominal);
        if ours.converter.topology != theirs.converter.topology || ours.converter.f_sw != theirs.converter.f_sw {
            let word = |p: &Parameters| format!("a {} at {} Hz", p.converter.topology.word(), p.converter.f_sw);
            let message =
                Message::new("a controller designed on this converter is none for the plant").found(word(theirs));
            return Err(Fault::in_file(file, message.expected(word(ours))).into());
        }
        self.notes
            .push(format!("the classical controllers are designed on {}", file.display()));
        self.designed_on = nominal;
        Ok(self)
    }

    /// All controllers are judged on a spread of the plant, too, on every value or on drawn ones; the classical ones keep their
    /// design.
    ///
    /// # Errors
    /// If a number stands there twice, there are more than two that are not drawn, or spread and draws do not go together.
    pub fn spread(mut self, spread: Vec<Spread>, draws: Option<Draws>) -> Result<Self, Error> {
        spread::check(&spread, draws)?;
        (self.spread, self.draws) = (spread, draws);
        Ok(self)
    }
}

/// # Errors
/// If the classical controllers are to stand behind an observer that the policy does not have.
fn behind(policy: &Policy, observers: &[String], file: &Path) -> Result<(), Error> {
    let names = || policy.observers.iter().map(|own| own.name.as_str());
    let Some(missing) = observers.iter().find(|name| !names().any(|own| own == name.as_str())) else {
        return Ok(());
    };
    let message = Message::new("the policy has no observer of this name").found(missing.clone());
    let known: Vec<&str> = names().collect();
    let message = match known.as_slice() {
        [] => message.expected("a policy with [[observer]]"),
        known => message.expected(format!("one of {}", known.join(", "))),
    };
    Err(Fault::in_file(file, message.did_you_mean(missing, known)).into())
}

/// Whether a policy can be told to hold a voltage; `steps` asks for it.
fn told(policy: &Policy, voltage: f64, steps: bool, file: &Path) -> Result<(), Error> {
    let signal = policy.signals.iter().find(|signal| signal.name == REFERENCE);
    let Some(signal) = signal else {
        if !steps {
            return Ok(());
        }
        let message = Message::new("a step of the reference, and a policy that holds one voltage");
        let message = message.expected("a contract with the signal `v_ref`, which the firmware sets");
        return Err(Fault::in_file(file, message).into());
    };
    let Interval { low, high } = signal.range;
    if (low..=high).contains(&voltage) {
        return Ok(());
    }
    let message = Message::new("the policy takes no such reference").found(format!("{voltage} V"));
    let message = message.expected(format!("{low} to {high} V, the range of its signal `v_ref`"));
    Err(Fault::in_file(file, message).into())
}

/// The load steps that are taken where a scenario names none are those of a converter that holds this, V.
const DEFAULT_STEPS_HOLD: f64 = 100.0;

/// Whether the load steps are meant for a converter that holds `v_ref` V.
fn of_this_converter(scenario: &Scenario, v_ref: f64, file: &Path) -> Result<(), Error> {
    if !scenario.default_steps || v_ref == DEFAULT_STEPS_HOLD {
        return Ok(());
    }
    let message = Message::new("the scenario names no load step")
        .found(format!("a converter that holds {v_ref} V"))
        .expected("load_steps in W, current_steps in A or resistance_steps in ohm")
        .hint("load_steps = [[20, 80], [80, 20]]  # W before and behind; a training has its own in [evaluation] of its file");
    Err(Fault::in_file(file, message).into())
}

fn notes(scenario: &Scenario, policy: &Policy, converter: &Converter, v_ref: f64) -> Vec<String> {
    let loads: Vec<_> = scenario.load_steps.iter().flat_map(LoadStep::loads).collect();
    let mut notes = doubts(converter.parameters(), v_ref, &loads);
    if scenario.default_steps {
        notes.push(
            "the scenario names no load step: those of the paper's 100 V converter are taken; give load_steps (W), current_steps (A) \
             or resistance_steps (ohm) for yours"
                .to_owned(),
        );
    }
    if let Some(theirs) = held_by(policy).filter(|theirs| *theirs != v_ref) {
        notes.push(format!(
            "the policy holds {theirs} V, but errors are counted from {v_ref} V"
        ));
    }
    if let Some(step) = scenario.load_steps.iter().find(|step| step.source.is_some()) {
        notes.push(format!(
            "v_in steps right behind a sampling instant, at a load of {} {}; no limit is computed for it",
            step.values[0],
            step.kind.unit()
        ));
    }
    if let Some(step) = scenario.load_steps.iter().find(|step| step.reference.is_some()) {
        notes.push(format!(
            "v_ref steps at a sampling instant, at a load of {} {}: the deviation is the overshoot, errors are counted from the new \
             reference; no limit is computed for it, and the classical controllers, which hold one voltage, are left out",
            step.values[0],
            step.kind.unit()
        ));
    }
    if !scenario.observers.is_empty() && !scenario.baselines.is_empty() {
        notes.push(format!(
            "the classical controllers stand behind {} of the policy's contract: they see its estimates, and its bias is made up for",
            match scenario.observers.as_slice() {
                [one] => format!("the observer `{one}`"),
                several => format!("the observers {}, each behind each", several.join(", ")),
            }
        ));
    }
    if let Some(outside) = converter.outside() {
        notes.extend(outside.notes());
        let name = outside.name();
        let limit = if scenario.limits.is_empty() {
            ""
        } else {
            ", and so is the limit: that of an unknown model cannot be computed"
        };
        notes.push(format!(
            "classical controllers are designed on the nominal numbers beside {name}{limit}"
        ));
    }
    let left_out = left_out(converter.parameters());
    if !scenario.limits.is_empty() && !left_out.is_empty() {
        notes.push(format!(
            "the limit is that of the plain circuit; it leaves out {}",
            left_out.join(", ")
        ));
    }
    notes
}
