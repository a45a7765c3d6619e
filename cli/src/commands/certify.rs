//! `policyc certify`

use std::collections::BTreeMap;
use std::path::Path;

use ::certify::{Certificate, Domain, Effort, Slice, page};
use interp::Controller;
use ndarray::aview1;
use policy::{Interval, NumericFormat, Policy};
use random::{Random, SplitMix};
use serde::Serialize;
use toml_input::Message;

use super::progress_line::Working;
use crate::arguments::Certify;
use crate::failure::Failure;
use crate::made;
use crate::outcome::Outcome;
use crate::output;

/// What is asked of a certificate, beside the policy.
#[derive(Debug, Clone)]
pub struct Request {
    /// Axes of the map, `NAME` or `NAME=LOW:HIGH`: two or none.
    pub axis: Vec<String>,
    /// Other coordinates of the map, `NAME=VALUE`.
    pub at: Vec<String>,
    /// States drawn for the shares.
    pub samples: u32,
    /// Boxes into which the states are split.
    pub boxes: u32,
    /// Seed of the draws.
    pub seed: u64,
}

/// A certificate as files, by name, and in words.
pub struct Made {
    /// As `certificate.json` has it.
    pub certificate: Certificate,
    /// `certificate.json`, `certificate.html` and, where there is a map, `map.svg`: of the output `left` `map-left.svg`.
    pub files: BTreeMap<String, String>,
    /// What the command says.
    pub summary: String,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a> {
    out: &'a Path,
    files: Vec<&'a String>,
    /// The keys of `certificate.json`.
    #[serde(flatten)]
    certificate: &'a Certificate,
}

/// Proves, measures, draws, writes.
pub fn run(options: &Certify) -> Result<Outcome, Failure> {
    let policy = super::load_several_as(&options.policy, options.outside, options.format)?;
    let working = Working::new("bounding and drawing states");
    let mut made = make(
        &policy,
        &Request {
            axis: options.axis.clone(),
            at: options.at.clone(),
            samples: options.samples,
            boxes: options.boxes,
            seed: options.seed,
        },
    )?;
    drop(working);
    let read = [("policy", options.policy.display().to_string())];
    made::signed(&mut made.files, &[("--out", "certificate")], &read)?;
    output::replace_own_texts(&options.out, &made.files, options.replacing)?;
    if options.json {
        output::say_json(&Answer {
            out: &options.out,
            files: made.files.keys().collect(),
            certificate: &made.certificate,
        })?;
        return Ok(Outcome::Done);
    }
    output::say(&made.summary)?;
    output::say(&format!(
        "to look at: {}",
        options.out.join("certificate.html").display()
    ))?;
    Ok(Outcome::Done)
}

/// The certificate of a policy; nothing is written.
///
/// # Errors
/// If the policy computes in `f64`, or an axis is none of its states.
pub fn make(policy: &Policy, options: &Request) -> Result<Made, Failure> {
    if policy.numeric_format == NumericFormat::F64 {
        let message = Message::new(
            "the certificate is about binary32 and integers: its box holds the observations as binary32 rounds them",
        );
        let message = message.found("f64").expected("one of f32, f32-fma, i16, i8");
        return Err(message.hint("--format f32").into());
    }
    let decides = policy.paths().iter().any(|path| path.head.is_choice());
    let asks_for_a_map = !(options.axis.is_empty() && options.at.is_empty());
    if asks_for_a_map && !decides {
        let message = Message::new("a map shows where actions are proven, and this policy commands a number");
        return Err(message.found("--axis or --at").hint("leave them out").into());
    }
    let slice = if decides { slice(policy, options)? } else { None };
    let controller = Controller::<f32>::new(policy);
    let q_values = |observation: &[f32]| {
        let numbers = answers(policy, &controller, observation).unwrap_or_default();
        numbers.into_iter().map(f64::from).collect()
    };
    let mut rng = SplitMix::new(options.seed);
    let effort = Effort {
        boxes: options.boxes as usize,
        samples: options.samples as usize,
        ..Effort::default()
    };
    let certificate = Certificate::new(policy, effort, slice.as_ref(), &q_values, &mut || rng.unit());
    let mut json = serde_json::to_string_pretty(&certificate)?;
    json.push('\n');
    let maps = page::maps(policy, &certificate)?;
    let mut files = BTreeMap::from([
        ("certificate.json".to_owned(), json),
        (
            "certificate.html".to_owned(),
            page::page(policy, &certificate, maps.clone())?,
        ),
    ]);
    for (statement, map) in certificate.statements.iter().zip(maps) {
        let Some(map) = map else { continue };
        let output = statement.output.as_ref();
        let name = output.map_or("map.svg".to_owned(), |output| format!("map-{output}.svg"));
        files.insert(name, map.to_string());
    }
    Ok(Made {
        files,
        summary: page::summary(&certificate),
        certificate,
    })
}

/// What the format says at an observation, output by output: Q values, the duty of an actor, or the gains of a law.
fn answers(policy: &Policy, controller: &Controller<f32>, observation: &[f32]) -> Option<Vec<f32>> {
    let outputs = controller.q_values(&aview1(observation)).ok()?;
    let paths = policy.paths();
    let view = outputs.view();
    let Some(decisions) = controller.decide_each(&view) else {
        if policy.head.is_choice() {
            return Some(outputs.to_vec());
        }
        let duty = || controller.decide(&view).map(|(_, duty)| vec![duty]);
        return controller.gains(&view).or_else(duty);
    };
    let each = paths
        .iter()
        .zip(decisions)
        .flat_map(|(path, (_, duty))| match path.head.is_choice() {
            true => outputs
                .iter()
                .copied()
                .skip(path.column)
                .take(path.head.outputs())
                .collect(),
            false => vec![duty],
        });
    Some(each.collect())
}

/// The slice that is asked for, of settled states unless those have fewer than two coordinates; `None` if all have.
fn slice(policy: &Policy, options: &Request) -> Result<Option<Slice>, Failure> {
    let (memory, domain) = Domain::mapped(policy);
    let coordinates = domain.coordinates();
    let find = |name: &str| {
        coordinates.iter().position(|c| c.name == name).ok_or_else(|| {
            let names: Vec<&str> = coordinates.iter().map(|c| c.name.as_str()).collect();
            let message = Message::new("no such coordinate of the states").found(name);
            let message = message.expected(format!("one of {}", names.join(", ")));
            Failure::from(message.did_you_mean(name, names))
        })
    };
    let mut asked = Vec::new();
    for axis in &options.axis {
        let (name, range) = axis
            .split_once('=')
            .map_or((axis.as_str(), None), |(name, range)| (name, Some(range)));
        let index = find(name)?;
        let whole = coordinates[index].range;
        asked.push((index, range.map(|range| within(range, name, whole)).transpose()?));
    }
    let order = domain.signals_first(policy);
    let axes = match (asked.as_slice(), order.as_slice()) {
        ([], [x, y, ..]) => [(*x, None), (*y, None)],
        ([], _) => return Ok(None),
        ([x, y], _) if x.0 != y.0 => [*x, *y],
        _ => {
            let message = Message::new(format!("--axis: {} axes found", asked.len()));
            return Err(message.expected("two different axes, or none").into());
        }
    };
    let mut at = domain.middle();
    for text in &options.at {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let index = find(name)?;
        at[index] = number(value, text)?;
        let range = coordinates[index].range;
        if !(at[index] >= range.low && at[index] <= range.high) {
            return Err(outside(text, range));
        }
    }
    let [x, y] = axes;
    Ok(Slice::through(policy, memory, x, y, at))
}

/// `LOW:HIGH` inside of a range.
fn within(text: &str, name: &str, whole: Interval) -> Result<Interval, Failure> {
    let (low, high) = text.split_once(':').unwrap_or((text, ""));
    let place = format!("{name}={text}");
    let range = Interval {
        low: number(low, &place)?,
        high: number(high, &place)?,
    };
    if range.low >= whole.low && range.low < range.high && range.high <= whole.high {
        Ok(range)
    } else {
        Err(outside(&place, whole))
    }
}

fn number(text: &str, place: &str) -> Result<f64, Failure> {
    let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| {
        let message = Message::new("a number is missing").found(place);
        Failure::from(message.expected("NAME=LOW:HIGH for --axis, NAME=VALUE for --at"))
    })
}

fn outside(place: &str, range: Interval) -> Failure {
    let expected = format!("ascending, within {}:{}", range.low, range.high);
    Message::new("outside of the plausible range")
        .found(place)
        .expected(expected)
        .into()
}
