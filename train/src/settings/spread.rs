//! `[[spread]]`: other converters on which a policy has to hold.

use closed_loop::read;
use toml_input::{Message, Sink, Table, Value};

use super::read::{limits, requirement};
use super::{Instants, Limits, Requirement};

/// A converter beside that of the plant's file. Nothing is trained on it: a policy that is kept has to hold on it, too.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Factors on numbers of the plant, by key.
    pub factor: Vec<(String, f64)>,
    /// Numbers of the plant, by key.
    pub set: Vec<(String, f64)>,
    /// What a good policy does there; none, where the `[[spec]]` of the file hold.
    pub limits: Vec<Requirement>,
}

impl Spread {
    /// In words: `inductance x 0.85, dcr = 0.1`.
    #[must_use]
    pub fn name(&self) -> String {
        let short = |key: &str| key.rsplit('.').next().unwrap_or(key).to_owned();
        let factors = self
            .factor
            .iter()
            .map(|(key, factor)| format!("{} x {factor}", short(key)));
        let numbers = self.set.iter().map(|(key, value)| format!("{} = {value}", short(key)));
        factors.chain(numbers).collect::<Vec<_>>().join(", ")
    }

    /// Keys that are others here.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.factor.iter().chain(&self.set).map(|(key, _)| key.as_str())
    }

    /// The numbers that are others here; `nominal` says what the plant's file has.
    #[must_use]
    pub fn numbers(&self, nominal: impl Fn(&str) -> Option<f64>) -> Vec<(String, f64)> {
        let scaled = |(key, factor): &(String, f64)| Some((key.clone(), factor * nominal(key)?));
        self.factor
            .iter()
            .filter_map(scaled)
            .chain(self.set.iter().cloned())
            .collect()
    }
}

pub(super) fn read(table: &mut Table<'_>, faults: &mut Sink) -> Option<Spread> {
    // what is there and wrong has its own fault
    let factor = table
        .optional("factor")
        .map_or(Some(Vec::new()), |v| factors(&v, faults));
    let set = table
        .optional("set")
        .map_or(Some(Vec::new()), |v| read::plant_numbers(&v, faults));
    let (factor, set) = (factor?, set?);
    if factor.is_empty() && set.is_empty() {
        let message = Message::new("a [[spread]] that is the plant itself").expected("`factor`, `set` or both");
        let hint = "factor = { \"converter.inductance\" = 0.85, \"converter.capacitance\" = 0.85 }";
        faults.push(table.fault(message.hint(hint)));
    }
    let of_all_steps = Requirement {
        load_step: None,
        instants: Instants::Worst,
        limits: limits(table, faults),
    };
    let is_given = of_all_steps.limits != Limits::default();
    let mut limits = table.sections("spec", faults, requirement);
    limits.extend(is_given.then_some(of_all_steps));
    Some(Spread { factor, set, limits })
}

/// Factors on numbers of a plant.
fn factors(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<(String, f64)>> {
    let mut list = Vec::new();
    for (key, value) in value.pairs(faults)? {
        read::known_parameter(&key.value, &value, faults);
        list.push((key.value.clone(), value.positive(faults)?));
    }
    Some(list)
}
