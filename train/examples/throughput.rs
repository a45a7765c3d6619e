//! Control periods of training per second on one core: act, simulate, observe, store, one update.
//!
//!     cargo run --release -p policyc-train --example throughput [TRAIN.toml [RUNS [whole]]]
//!
//! Plain DQN, 12 duties, batch 256, 6-64-64-12, one update per period (`bench/training` sets it beside
//! Stable-Baselines3). Ten thousand periods without a look at the policy; with `whole` a training as the file has it,
//! with its looks and its evaluation, up to where it ends.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use train::{Contract, Converter, Error, Settings, Trainer};

fn main() -> Result<(), Error> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = arguments.first().map_or("examples/train/paper12.toml", String::as_str);
    let runs: u64 = arguments.get(1).and_then(|text| text.parse().ok()).unwrap_or(5);
    let is_whole = arguments.get(2).is_some_and(|word| word == "whole");
    let mut settings = Settings::load(Path::new(path))?;
    if !is_whole {
        // the look at the end of the budget is not part of the figure
        settings.steps = 10_001;
        settings.selection.every = 1_000_000;
    }
    let last = if is_whole { settings.steps } else { 10_000 };
    let contract = Contract::load(&settings.contract, &settings.hidden)?;
    let converter = Converter::load(&settings.plant, &settings.set)?;
    for seed in 0..runs {
        let mut trainer = Trainer::new(&settings, &contract, &converter, seed)?;
        let start = Instant::now();
        let ended = trainer.run_until(last, &AtomicBool::new(false), |_| {})?;
        if is_whole {
            trainer.finish(ended)?;
        }
        let seconds = start.elapsed().as_secs_f64();
        println!("{:.0} steps/s", trainer.step_count() as f64 / seconds);
    }
    Ok(())
}
