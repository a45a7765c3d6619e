//! Trains every seed of a training file, one after the other on one core, and prints what came out as a table.
//!
//!     cargo run --release -p policyc-train --example seeds -- FILE [tables] [looks] [SEED ...]
//!
//! `tables` adds the evaluation of every seed, `looks` the learning curve; seeds replace those of the file.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use closed_loop::scenario::Finding;
use train::{Contract, Converter, Error, Settings, Trainer};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .unwrap_or_else(|| "examples/train/paper12.toml".to_owned());
    let words: Vec<String> = arguments.collect();
    let has = |word: &str| words.iter().any(|given| given == word);
    let (tables, looks) = (has("tables"), has("looks"));
    let mut settings = Settings::load(Path::new(&path))?;
    let seeds: Vec<u64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    if !seeds.is_empty() {
        settings.seeds = seeds;
    }
    let contract = Contract::load(&settings.contract, &settings.hidden)?;
    let converter = Converter::load(&settings.plant, &settings.set)?;
    println!(
        "seed  kept at  of     cpu s  selection  evaluation  up V / ms        down V / ms      tail V  before V  ripple V"
    );
    for &seed in &settings.seeds {
        let start = cpu_seconds();
        let mut trainer = Trainer::new(&settings, &contract, &converter, seed)?;
        let ended = trainer.run(&AtomicBool::new(false), |progress| {
            let look = progress.look;
            if looks {
                println!(
                    "{:6} {:8.3} {:7.3} V  cost {:9.3}  best {:9.3}",
                    look.step, look.reward, look.error, look.cost, progress.best
                );
            }
        })?;
        let seconds = cpu_seconds() - start;
        let outcome = trainer.finish(ended)?;
        let met = |met: bool| if met { "met" } else { "missed" };
        println!(
            "{seed:4}  {:7}  {:5}  {seconds:5.1}  {:9}  {:10}  {}",
            outcome.best_step,
            trainer.step_count(),
            met(outcome.selected.met),
            met(outcome.evaluated.met),
            worst(&outcome.findings),
        );
        if tables {
            println!("{}", closed_loop::table(&outcome.findings));
        }
    }
    Ok(())
}

/// Worst upward and downward step over all instants, then the worst of the other figures.
fn worst(findings: &[Finding]) -> String {
    let largest = |figure: &dyn Fn(&Finding) -> f64, keep: &dyn Fn(&Finding) -> bool| {
        findings.iter().filter(|f| keep(f)).map(figure).fold(0.0, f64::max)
    };
    let up = |f: &Finding| f.load_step[1] > f.load_step[0];
    let (deviation, settling) = (|f: &Finding| f.worst.deviation, |f: &Finding| 1e3 * f.worst.settling);
    let sides = [true, false].map(|side| {
        let keep = |f: &Finding| up(f) == side;
        format!("{:.2} / {:.2}", largest(&deviation, &keep), largest(&settling, &keep))
    });
    let all = |_: &Finding| true;
    format!(
        "{:15}  {:15}  {:6.3}  {:8.3}  {:8.3}",
        sides[0],
        sides[1],
        largest(&|f| f.worst.tail_max, &all),
        largest(&|f| f.worst.pre_error, &all),
        largest(&|f| f.worst.ripple, &all),
    )
}

/// Time this thread has run, s; the wall clock where the system does not say.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let run = text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    let wall = std::time::UNIX_EPOCH.elapsed().map_or(0.0, |time| time.as_secs_f64());
    run.map_or(wall, |nanoseconds| 1e-9 * nanoseconds)
}
