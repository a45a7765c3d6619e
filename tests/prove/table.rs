//! What proofs of random policies cost: a table for `docs/results/proofs.md`, on demand.
//!
//! `POLICYC_PROVE_TABLE=FIRST,COUNT cargo test -p tests --test prove table -- --nocapture` prints a row a policy and format;
//! `POLICYC_PROVE_TABLE=examples/buck12,tests/fixtures/legs` one of those folders.

use std::time::Instant;

use policy::NumericFormat;
use prove::{Claim, Eva, Prover, Smt, Verdict};

use super::{load, task, watched};

const FORMATS: [NumericFormat; 4] = [
    NumericFormat::F32,
    NumericFormat::F64,
    NumericFormat::I16,
    NumericFormat::I8,
];

/// Seconds of processor that ended child processes have taken, with theirs: user and system.
// the clock of a busy machine says nothing; Linux counts ticks of a hundredth of a second for every program that it runs
fn seconds_of_children() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // the name in brackets may hold anything; behind it the state is field 3
    let behind = text.rsplit(')').next().unwrap_or_default();
    let ticks = behind.split_whitespace().skip(13).take(2);
    ticks.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Claims of a prover, and what it took: seconds of processor, and of the clock.
fn proved_by(prover: &dyn Prover, policy: &policy::Policy) -> (Vec<Claim>, [f64; 2]) {
    let (before, start) = (seconds_of_children(), Instant::now());
    let claims = watched(|watch| prover.prove(task(policy), watch)).unwrap();
    let took = [seconds_of_children() - before, start.elapsed().as_secs_f64()];
    (claims, took)
}

fn count(claims: &[Claim], verdict: Verdict) -> usize {
    claims.iter().filter(|claim| claim.verdict == verdict).count()
}

/// What the variable names, and the policy of each.
fn policies(range: &str) -> Vec<(String, policy::Policy)> {
    let numbers: Option<Vec<u64>> = range.split(',').map(|word| word.parse().ok()).collect();
    let Some([first, count]) = numbers.as_deref() else {
        return range.split(',').map(|path| (path.to_owned(), load(path))).collect();
    };
    let random = |seed: u64| {
        let folder = tests::random::policy(seed).unwrap();
        (seed.to_string(), policy::load(&folder.path()).unwrap())
    };
    (*first..first + count).map(random).collect()
}

/// Every claim that a prover tried is proved; with the variable alone, since a policy takes half a minute.
#[test]
fn a_table_of_random_policies_has_no_open_claim() {
    let Ok(range) = std::env::var("POLICYC_PROVE_TABLE") else {
        return;
    };
    let mut open = Vec::new();
    println!(
        "| seed | format | claims proved | not run | open | Eva s | SMT s | Eva clock s | SMT clock s | slowest goal |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|---:|---:|---|");
    for (seed, policy) in policies(&range) {
        for format in FORMATS {
            let policy = policy.clone().with_format(format);
            let (by_eva, eva) = proved_by(&Eva, &policy);
            let (by_solver, smt) = proved_by(&Smt, &policy);
            let slowest = by_solver.iter().max_by(|x, y| x.seconds.total_cmp(&y.seconds)).unwrap();
            let name = &slowest.name;
            let all = [by_eva.clone(), by_solver.clone()].concat();
            let (proved, not_run) = (count(&all, Verdict::Proved), count(&all, Verdict::NotRun));
            println!(
                "| {seed} | {} | {proved} | {not_run} | {} | {:.1} | {:.1} | {:.0} | {:.0} | {name} |",
                format.name(),
                all.len() - proved - not_run,
                eva[0],
                smt[0],
                eva[1],
                smt[1]
            );
            let is_open = |claim: &&Claim| !matches!(claim.verdict, Verdict::Proved | Verdict::NotRun);
            open.extend(all.iter().filter(is_open).map(|claim| {
                format!(
                    "{seed} {}: {}: {} {:?}",
                    format.name(),
                    claim.name,
                    claim.reason,
                    claim.details
                )
            }));
        }
    }
    assert!(open.is_empty(), "{open:#?}");
}
