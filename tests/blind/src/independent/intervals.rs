//! Whether the interval of a named cause holds the value that was hidden.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::independent::truth::Truth;

/// A hidden value whose cause was named.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Id of the cause and name of the value.
    pub what: String,
    /// Whether its 95 % interval holds it.
    pub holds: bool,
}

/// Causes whose numbers here are none of a plant file: the curves of parts have other laws here, and whole periods have no interval.
const NOT_COMPARED: [&str; 3] = ["c_derating", "l_saturation", "duty_delay"];

/// Every hidden value with an interval beside it.
#[must_use]
pub fn told(truth: &Truth, diagnosis: &Value) -> Vec<Told> {
    let causes = diagnosis["causes"].as_array().cloned().unwrap_or_default();
    let mut all = Vec::new();
    let compared = |id: &str| !NOT_COMPARED.contains(&id);
    for hidden in truth.hidden.iter().filter(|one| one.listed && compared(&one.id)) {
        let named = causes.iter().find(|cause| cause["id"] == hidden.id.as_str());
        let Some(parameters) = named.and_then(|cause| cause["parameters"].as_object()) else {
            continue;
        };
        for (name, value) in &hidden.parameters {
            let found = match (hidden.parameters.len(), parameters.len()) {
                // each side has its own name for it
                (1, 1) => parameters.values().next(),
                _ => parameters.get(name.trim_start_matches("ripple_")),
            };
            // the phase of a line counts from the first row of its record, and from the start of the run here
            let Some(found) = found.filter(|_| name != "ripple_phase") else {
                continue;
            };
            // a low-pass comes to what the sensor has
            let before = if name == "added" {
                found["model"].as_f64()
            } else {
                Some(0.0)
            };
            if let (Some(low), Some(high), Some(before)) = (found["low"].as_f64(), found["high"].as_f64(), before) {
                all.push(Told {
                    what: format!("{}.{name}", hidden.id),
                    holds: (low..=high).contains(&(value + before)),
                });
            }
        }
    }
    all
}

/// Values that are outside, each with how often.
#[must_use]
pub fn outside(all: &[&Told]) -> String {
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    for one in all.iter().filter(|one| !one.holds) {
        *count.entry(&one.what).or_default() += 1;
    }
    let each: Vec<String> = count.iter().map(|(what, times)| format!("{what} {times}")).collect();
    each.join(", ")
}

#[cfg(test)]
mod tests {
    use super::{outside, told};

    #[test]
    fn a_hidden_value_is_held_against_the_interval_of_its_cause_whatever_either_calls_it() {
        let hidden = |id: &str, name: &str, value: f64, listed: bool| serde_json::json!({ "id": id, "listed": listed, "what": "", "parameters": { name: value }, "channel": null, "chi2": 1.0 });
        let truth = serde_json::json!({
            "world": "independent", "seed": 1, "case": 0, "family": "cause", "converter": "", "chi2": 1.0, "chi2_listed": 0.0, "ties": [],
            "records": [], "expect": {
                "verdicts": [], "causes": [], "must_name": true, "set_aside": null, "refusal": false, "words": [], "wrong": "",
            },
            "hidden": [
                hidden("core_loss", "core", 1.5, true), hidden("sensor_low_pass", "added", 2.0, true), hidden("esr", "esr", 9.0, true),
                hidden("c_derating", "derating", 0.3, true), hidden("dcr", "dcr", 1.0, true), hidden("cubic", "size", 1.0, false),
            ],
        });
        let truth = serde_json::from_value(truth).unwrap();
        let value = |low: f64, high: f64| serde_json::json!({ "low": low, "high": high, "value": low, "model": 1.0 });
        let diagnosis = serde_json::json!({ "causes": [
            { "id": "core_loss", "parameters": { "core_conductance": value(1.0, 2.0) } },
            { "id": "sensor_low_pass", "parameters": { "time_constant_v": value(2.9, 3.1) } },
            { "id": "esr", "parameters": { "esr": value(8.0, 8.5) } },
            { "id": "c_derating", "parameters": { "derating": value(0.4, 0.5) } },
        ] });
        let all = told(&truth, &diagnosis);
        let holds: Vec<(&str, bool)> = all.iter().map(|one| (one.what.as_str(), one.holds)).collect();
        assert_eq!(
            holds,
            [
                ("core_loss.core", true),
                ("sensor_low_pass.added", true),
                ("esr.esr", false)
            ]
        );
        assert_eq!(outside(&all.iter().collect::<Vec<_>>()), "esr.esr 1");
    }
}
