//! What a training leaves behind: a policy folder, a learning curve, a report. All of it as data.

use std::collections::BTreeMap;
use std::fmt::Write;

use plant::Sample;
use policy::Policy;
use toml_input::Message;

use crate::contract::{Files, GoldenVectors};
use crate::faults::Error;
use crate::judge::{Judged, evaluate, overall};
use crate::network::Network;
use crate::score::Score;
use crate::trainer::{Best, Ended, Look, Trainer};
use crate::verdict::Verdict;
use closed_loop::Agent;
use closed_loop::environment::Environment;
use closed_loop::scenario::{Finding, load_step};
use closed_loop::{at_rest, comparison, evaluation_csv, table};

/// Observations among the golden vectors at most.
// a convention: `compile` and `verify` compute each of them once, and the paper's network fits them into 40 kB
const GOLDEN: usize = 512;
/// Rows whose two best Q values are closer than this share of the largest are left out: another order of summation may
/// turn them round.
// a hundred times what another order of 64 sums was seen to do (8.5e-6, interp's golden check)
const GAP: f32 = 1e-3;

/// A finished training.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Its seed.
    pub seed: u64,
    /// Why it ended.
    pub ended: Ended,
    /// Control periods after which the kept policy was found.
    pub best_step: u64,
    /// How the kept policy did on the selection scenarios; seeds are compared by this.
    pub selected: Score,
    /// How it did on the evaluation scenarios.
    pub evaluated: Score,
    /// The evaluation, load step by load step.
    pub findings: Vec<Finding>,
    /// The evaluation on the plant, and behind it on the converters of `[[spread]]`.
    pub judged: Vec<Judged>,
    /// The same of the law alone that a residual policy adds to; empty without one.
    pub law: Vec<Judged>,
    /// The looks at the selection scenarios on the way.
    pub curve: Vec<Look>,
    /// The policy, as its folder has it.
    pub policy: Policy,
    /// The policy folder: contract, weights, golden vectors, `report.txt`, `evaluation.csv`, `learning-curve.csv`.
    pub files: Files,
}

impl<E: Environment> Trainer<E> {
    /// Evaluates the policy that did best and makes its folder.
    ///
    /// # Errors
    /// If there has been no look yet, the plant cannot be started or the policy does not pass its own check.
    pub fn finish(&self, ended: Ended) -> Result<Outcome, Error> {
        if !self.waiting.is_empty() {
            // an interrupted training: this one goes on as if nobody had asked
            let mut settled = self.clone();
            settled.settle()?;
            return settled.finish(ended);
        }
        let Some(best) = self.best() else {
            let message = Message::new("no policy has been judged yet");
            return Err(message
                .hint("train at least `every` control periods of [selection]")
                .into());
        };
        let mut judged = self.evaluate(&best.network)?;
        let law = match (self.contract.adds_nothing(), self.contract.policy.law_alone()) {
            (Some(nothing), _) => self.evaluate(&nothing)?,
            (None, Some(law)) => evaluate(&self.settings, &self.nominal, &law)?,
            (None, None) => Vec::new(),
        };
        let mut best = best.clone();
        let (own, laws) = (overall(&judged), overall(&law));
        let passed_over = !law.is_empty() && !own.met && (laws.met || laws.cost < own.cost);
        if passed_over && let Some(nothing) = self.law(&mut self.told.clone())? {
            // on its own load steps the selection preferred a network; nobody wants one that misses what the law keeps, or by more than it
            (best, judged) = (nothing, law.clone());
        }
        let evaluated = overall(&judged);
        let golden = self.golden(&best.network)?;
        let (policy, mut files) = self.contract.folder(&best.network, &golden)?;
        let report = self.report(ended, &best, passed_over, &judged, &law);
        let findings = judged
            .first()
            .map(|nominal| nominal.findings.clone())
            .unwrap_or_default();
        files.insert("report.txt".to_owned(), report.into_bytes());
        files.insert("evaluation.csv".to_owned(), evaluation_csv(&findings).into_bytes());
        if judged.len() > 1 {
            files.insert("spread.csv".to_owned(), spread_csv(&judged[1..]).into_bytes());
        }
        files.insert("learning-curve.csv".to_owned(), curve_csv(self.curve()).into_bytes());
        Ok(Outcome {
            seed: self.seed,
            ended,
            best_step: best.step,
            selected: best.score,
            evaluated,
            findings,
            judged,
            law,
            curve: self.curve().to_vec(),
            policy,
            files,
        })
    }

    /// Observations of the closed loop with the trainer's own Q values (matrices, another order of summation than the
    /// compiled code's): a check of weights, order and activation that does not lean on the interpreter.
    fn golden(&self, network: &Network) -> Result<GoldenVectors, Error> {
        let task = &self.settings.evaluation;
        let mut agent = Agent::<f32>::new(&self.contract.with(network))?;
        let mut observations = Vec::new();
        let instants = task.all_instants();
        for (n, &step) in task.load_steps.iter().enumerate() {
            let mut controller = |sample: &Sample| {
                let duty = agent.step(&sample.measured).unwrap_or(f64::NAN);
                observations.push(agent.observation().to_vec());
                duty
            };
            let v_ref = self.settings.reward.v_ref;
            load_step(
                self.nominal.clone(),
                &mut controller,
                v_ref,
                task,
                step,
                // another instant for each load step, for observations that differ
                instants[n % instants.len()],
            )?;
            agent.reset();
        }
        Ok(golden_vectors(network, &observations))
    }

    fn report(&self, ended: Ended, best: &Best, passed_over: bool, judged: &[Judged], law: &[Judged]) -> String {
        let mut out = String::new();
        let ended = match ended {
            Ended::Met => "the selection scenarios met the specification",
            Ended::Budget => "the budget was used up",
            Ended::Interrupted => "interrupted",
        };
        let steps = self.step_count();
        let actions = network_shape(&best.network);
        let lines = [
            format!("policy      {}", self.contract.policy.name),
            format!("seed        {}", self.seed),
            format!("network     {actions}"),
            format!("training    {steps} control periods: {ended}"),
            match best.step {
                0 if passed_over => format!(
                    "kept        the law alone, cost {:.4}: the network of the selection misses the specification in the evaluation",
                    best.score.cost
                ),
                0 => format!(
                    "kept        the law alone, cost {:.4}: no network did better",
                    best.score.cost
                ),
                step => format!(
                    "kept        the policy after {step} control periods, cost {:.4}",
                    best.score.cost
                ),
            },
            format!("train.toml  SHA-256 {}", self.settings.digest),
        ];
        out.push_str(&lines.join("\n"));
        out.push_str("\n\nEvaluation: true voltages at the sampling instants; worst sampling instant / worst of all instants\n\n");
        out.push_str(&tables(judged, law));
        if !self.settings.specification.is_empty() {
            let verdict = if overall(judged).met { "met" } else { "NOT met" };
            // writing to a String cannot fail
            let _ = writeln!(out, "\nSpecification: {verdict}");
            for verdict in judged.iter().flat_map(|judged| &judged.verdicts) {
                let word = if verdict.holds() { "holds" } else { "FAILS" };
                let _ = writeln!(out, "  {word}  {verdict}");
            }
        }
        out
    }
}

impl Outcome {
    /// All limits of the specification on all converters of the evaluation.
    pub fn verdicts(&self) -> impl Iterator<Item = &Verdict> {
        self.judged.iter().flat_map(|judged| &judged.verdicts)
    }
}

/// The evaluation as tables for people, a converter after the other, the law alone beside the policy where there is one; and
/// what of both did better.
#[must_use]
pub fn tables(judged: &[Judged], law: &[Judged]) -> String {
    let mut out = String::new();
    for (n, Judged { place, findings, .. }) in judged.iter().enumerate() {
        if !place.is_empty() {
            let _ = write!(out, "\nOn {place}:\n\n");
        }
        let steps: Vec<String> = findings.iter().map(|finding| finding.step().to_string()).collect();
        let Some(law) = law.get(n) else {
            out.push_str(&table(findings));
            out.push_str(&at_rest(
                findings
                    .iter()
                    .zip(&steps)
                    .map(|(finding, step)| (step.as_str(), finding)),
            ));
            continue;
        };
        for (policy, law) in findings.iter().zip(&law.findings) {
            let both = [("policy", policy), ("law alone", law)];
            out.push_str(&comparison(policy.step(), both, []));
            out.push_str(&at_rest(both));
        }
    }
    if !law.is_empty() {
        let [policy, law] = [overall(judged), overall(law)];
        let verdict = match (policy.met, law.met) {
            (true, false) => "The law alone does not meet the specification.".to_owned(),
            (false, true) => "The law alone meets the specification: the network makes it worse.".to_owned(),
            _ if law.cost == policy.cost => format!(
                "The policy does here what the law alone does (cost {:.3}): the network adds nothing.",
                law.cost
            ),
            _ if law.cost < policy.cost => format!(
                "The law alone is the better one (cost {:.3}, the policy {:.3}): the network adds nothing.",
                law.cost, policy.cost
            ),
            _ => format!("The law alone costs {:.3}, the policy {:.3}.", law.cost, policy.cost),
        };
        let _ = write!(out, "\n{verdict}\n");
    }
    out
}

/// The evaluations on a spread as CSV: the converter in front of the columns of `evaluation.csv`.
fn spread_csv(judged: &[Judged]) -> String {
    let mut out = String::new();
    for Judged { place, findings, .. } in judged {
        let text = evaluation_csv(findings);
        let mut lines = text.lines();
        let head = lines.next().unwrap_or_default();
        if out.is_empty() {
            let _ = writeln!(out, "converter,{head}");
        }
        for line in lines {
            let _ = writeln!(out, "\"{place}\",{line}");
        }
    }
    out
}

fn network_shape(network: &Network) -> String {
    let widths = network
        .layers()
        .iter()
        .map(|layer| layer.inputs)
        .chain([network.outputs()]);
    widths.map(|width| width.to_string()).collect::<Vec<_>>().join("-")
}

/// Every n-th observation, without doubles and near ties, and what the network says to it.
fn golden_vectors(network: &Network, observations: &[Vec<f32>]) -> GoldenVectors {
    // at rest a loop sees the same again and again; ordered by bits, so that equal trainings give equal files
    let mut distinct = BTreeMap::new();
    for observation in observations {
        let key: Vec<u32> = observation.iter().map(|x| x.to_bits()).collect();
        distinct.entry(key).or_insert(observation);
    }
    let rows: Vec<&Vec<f32>> = distinct.into_values().collect();
    let stride = rows.len().div_ceil(GOLDEN).max(1);
    let chosen: Vec<f32> = rows
        .iter()
        .step_by(stride)
        .flat_map(|row| row.iter().copied())
        .collect();
    let count = chosen.len() / network.inputs().max(1);
    let mut activations = network.activations(count);
    network.forward(&chosen, &mut activations);
    let mut golden = GoldenVectors::default();
    let outputs = activations.outputs().chunks_exact(network.outputs());
    for (row, q) in chosen.chunks_exact(network.inputs()).zip(outputs) {
        let best = crate::learner::greedy(q);
        let largest = q.iter().fold(0.0_f32, |largest, x| largest.max(x.abs()));
        let close = |(n, &x): (usize, &f32)| n != best && q[best] - x < GAP * largest;
        if q.iter().enumerate().any(close) {
            continue;
        }
        golden.observations.extend_from_slice(row);
        golden.q_values.extend_from_slice(q);
        golden.actions.push(best as u32);
    }
    golden
}

/// The learning curve as CSV.
#[must_use]
pub fn curve_csv(curve: &[Look]) -> String {
    let mut out = String::from("step,reward,error_V,loss,epsilon,cost\n");
    for Look {
        step,
        reward,
        error,
        loss,
        epsilon,
        cost,
    } in curve
    {
        let _ = writeln!(out, "{step},{reward},{error},{loss},{epsilon},{cost}");
    }
    out
}
