//! The same questions to Marabou (PyPI `maraboupy`), which shares no code and no method with our bounds: it decides by
//! simplex and case splits.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Stdio};

use certify::Certifier;
use policy::{Interval, NumericFormat, Policy};
use random::{Random, SplitMix};
use serde_json::{Value, json};

const BOXES: usize = 200;

struct Marabou {
    process: Child,
    answers: BufReader<std::process::ChildStdout>,
}

impl Marabou {
    fn start(policy: &Policy) -> Self {
        let script = tests::root().join("tests/certificate/marabou.py");
        let mut process = tests::tools::python(env!("CARGO_TARGET_TMPDIR"))
            .arg(script)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("python3 starts");
        let layers: Vec<Value> = policy
            .layers
            .iter()
            .map(|layer| {
                let rows: Vec<&[f32]> = layer.weights.chunks_exact(layer.inputs).collect();
                json!({"weights": rows, "bias": layer.bias, "relu": layer.activation.is_rectifier()})
            })
            .collect();
        let answers = BufReader::new(process.stdout.take().unwrap());
        let mut marabou = Self { process, answers };
        marabou.say(&json!(layers));
        marabou
    }

    fn say(&mut self, value: &Value) {
        writeln!(self.process.stdin.as_mut().unwrap(), "{value}")
            .expect("Marabou listens (`cargo xtask setup` installs it)");
    }

    /// An input of the box with a sum of outputs of at least this, if there is one.
    fn find(&mut self, cell: &[Interval], terms: &[(usize, f64)], at_least: f64) -> Option<Vec<f64>> {
        let cell: Vec<[f64; 2]> = cell.iter().map(|range| [range.low, range.high]).collect();
        self.say(&json!({"box": cell, "terms": terms, "at_least": at_least}));
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        let answer: Value = serde_json::from_str(&line)
            .unwrap_or_else(|error| panic!("Marabou does not answer: {error} (`cargo xtask setup` installs it)"));
        assert!(answer.get("unknown").is_none(), "Marabou gives up: {line}");
        let found = answer["found"].as_array()?;
        Some(found.iter().map(|x| x.as_f64().unwrap()).collect())
    }
}

impl Drop for Marabou {
    fn drop(&mut self) {
        drop(self.process.stdin.take());
        let _ = self.process.wait();
    }
}

/// What 200 boxes have shown.
#[derive(Default)]
struct Score {
    decided: usize,
    tight: usize,
}

#[test]
fn marabou_contradicts_no_bound_and_no_decision_on_200_boxes() {
    if tests::tools::is_without("Marabou") {
        return;
    }
    let policy = super::example(NumericFormat::I16);
    let score = score(&policy, &Certifier::new(&policy), BOXES);
    println!(
        "{} of {BOXES} boxes decided, {} of 50 bounds within 10 %",
        score.decided, score.tight
    );
    assert!(score.decided > 40, "claims were put to the test: {}", score.decided);
    assert!(
        score.tight > 25,
        "bounds that are nowhere near the truth would pass, too: {}",
        score.tight
    );
}

fn score(policy: &Policy, certifier: &Certifier, boxes: usize) -> Score {
    let mut marabou = Marabou::start(policy);
    let mut rng = SplitMix::new(4);
    let domain = certifier.observations().clone();
    let mut score = Score::default();
    for turn in 0..boxes {
        let cell = small_cell(&mut rng, &domain.whole());
        let ranges = certifier.q_values_over(&domain, &cell);
        let n = rng.below(ranges.len());
        let Interval { low, high } = ranges[n];
        let slack = 1e-6 * low.abs().max(high.abs());
        let (factor, end) = if turn % 2 == 0 { (1.0, high) } else { (-1.0, -low) };
        let found = marabou.find(&cell, &[(n, factor)], end + slack);
        assert!(
            found.is_none(),
            "Q of action {n} leaves [{low}, {high}] in {cell:?} at {found:?}"
        );
        if turn % 4 == 0 {
            // a value in the last tenth: the bound is no empty claim
            let near = end - 0.1 * (high - low);
            score.tight += usize::from(marabou.find(&cell, &[(n, factor)], near).is_some());
        }
        let [Some(action)] = certifier.decided(&domain, &cell)[..] else {
            continue;
        };
        score.decided += 1;
        for other in (0..ranges.len()).filter(|other| *other != action) {
            if ranges[other].high < ranges[action].low {
                continue;
            }
            let found = marabou.find(&cell, &[(other, 1.0), (action, -1.0)], slack);
            assert!(
                found.is_none(),
                "action {other} beats {action} in {cell:?} at {found:?}"
            );
        }
    }
    score
}

/// A box that Marabou decides in milliseconds.
fn small_cell(rng: &mut SplitMix, whole: &[Interval]) -> Vec<Interval> {
    let size = 10_f64.powf(rng.uniform(-4.0, -1.3));
    let one = |range: &Interval| {
        let width = size * (range.high - range.low);
        let low = rng.uniform(range.low, range.high - width);
        Interval { low, high: low + width }
    };
    whole.iter().map(one).collect()
}
