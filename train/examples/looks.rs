//! What the looks at the policy take of whole trainings: seconds, and share of the time.
//!
//!     cargo run --release -p policyc-train --example looks -- FILE [until=STEPS] [SEED ...]
//!
//! `until` cuts the trainings short; the rate of learning still goes by the file's budget.
//!
//! The control period that ends with a look is timed apart from those before it, whose mean is taken off. Times are of this thread,
//! as often as the system counts them, some milliseconds: short trainings are told coarsely.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use train::{Contract, Converter, Ended, Error, Settings, Trainer};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .unwrap_or_else(|| "examples/train/paper12.toml".to_owned());
    let mut settings = Settings::load(Path::new(&path))?;
    let words: Vec<String> = arguments.collect();
    let until: Option<u64> = words.iter().find_map(|word| word.strip_prefix("until=")?.parse().ok());
    let last = until.unwrap_or(settings.steps).min(settings.steps);
    let seeds: Vec<u64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    if !seeds.is_empty() {
        settings.seeds = seeds;
    }
    let contract = Contract::load(&settings.contract, &settings.hidden)?;
    let converter = Converter::load(&settings.plant, &settings.set)?;
    println!("seed  kept at  of      seconds  of looks  share  steps/s");
    let (mut all, mut of_looks) = (0.0, 0.0);
    for &seed in &settings.seeds {
        let (between, looks, trainer) = timed(&settings, &contract, &converter, (seed, last))?;
        let seconds = between + looks;
        println!(
            "{seed:4}  {:7}  {:6}  {seconds:7.2}  {looks:8.2}  {:4.1}%  {:7.0}",
            trainer.best().map_or(0, |best| best.step),
            trainer.step_count(),
            100.0 * looks / seconds,
            trainer.step_count() as f64 / seconds,
        );
        (all, of_looks) = (all + seconds, of_looks + looks);
    }
    println!(
        " all                   {all:7.2}  {of_looks:8.2}  {:4.1}%",
        100.0 * of_looks / all
    );
    Ok(())
}

/// A whole training: seconds between the looks, seconds of the looks.
fn timed(
    settings: &Settings,
    contract: &Contract,
    converter: &Converter,
    (seed, last): (u64, u64),
) -> Result<(f64, f64, Trainer<Converter>), Error> {
    let never = AtomicBool::new(false);
    let every = settings.selection.every;
    let start = cpu_seconds();
    let mut trainer = Trainer::new(settings, contract, converter, seed)?;
    // the first look at a law belongs to the looks
    let (mut between, mut looks) = (0.0, cpu_seconds() - start);
    loop {
        let step = trainer.step_count();
        let next = (step + every).min(last);
        let start = cpu_seconds();
        trainer.run_until(next - 1, &never, |_| {})?;
        let train = cpu_seconds() - start;
        let ended = trainer.run_until(next, &never, |_| {})?;
        let with_look = cpu_seconds() - start - train;
        let one = train / (next - 1 - step).max(1) as f64;
        between += train + one;
        looks += with_look - one;
        if ended != Ended::Interrupted || trainer.step_count() >= last {
            return Ok((between, looks, trainer));
        }
    }
}

/// Time this thread has run, s; the wall clock where the system does not say.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let run = text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    let wall = std::time::UNIX_EPOCH.elapsed().map_or(0.0, |time| time.as_secs_f64());
    run.map_or(wall, |nanoseconds| 1e-9 * nanoseconds)
}
