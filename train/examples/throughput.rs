//! Whole control periods of training per second on one core: act, simulate, observe, store, one update.
//!
//!     cargo run --release -p policyc-train --example throughput [TRAIN.toml [RUNS]]
//!
//! Plain DQN, 12 duties, batch 256, 6-64-64-12, one update per period (`bench/training` sets it beside
//! Stable-Baselines3); looks at the policy are left out.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use train::{Contract, Converter, Error, Settings, Trainer};

fn main() -> Result<(), Error> {
    let path = std::env::args()
        .nth(1)
        .unwrap_or_else(|| "examples/train/paper12.toml".to_owned());
    let runs: u64 = std::env::args().nth(2).and_then(|text| text.parse().ok()).unwrap_or(5);
    let mut settings = Settings::load(Path::new(&path))?;
    // the look at the end of the budget is not part of the figure
    settings.steps = 10_001;
    settings.selection.every = 1_000_000;
    let contract = Contract::load(&settings.contract, &settings.hidden)?;
    let converter = Converter::load(&settings.plant, &settings.set)?;
    for seed in 0..runs {
        let mut trainer = Trainer::new(&settings, &contract, &converter, seed)?;
        let stop = AtomicBool::new(false);
        let start = Instant::now();
        trainer.run_until(10_000, &stop, |_| {})?;
        println!("{:.0} steps/s", 10_000.0 / start.elapsed().as_secs_f64());
    }
    Ok(())
}
