//! Control periods per second of the environment on one core: `cargo run --release -p policyc-train --example episodes`.

use std::path::Path;
use std::time::Instant;

use closed_loop::LoadKind;
use train::episodes::{Actions, Episodes, Given};
use train::{Contract, Converter, Error, Settings};

fn main() -> Result<(), Error> {
    let settings = Settings::load(Path::new("examples/train/paper12.toml"))?;
    let contract = Contract::load_any(&settings.contract, &[])?;
    let nominal = Converter::load(settings.plant.as_path(), &settings.set)?;
    for count in [1, 16, 256, 1024] {
        let mut episodes = Episodes::new(&settings, &contract, &nominal, count, (LoadKind::Power, Vec::new()))?;
        let mut observations = vec![0.0; count * episodes.features()];
        let (mut rewards, mut truncated) = (vec![0.0; count], vec![false; count]);
        let actions: Vec<i64> = (0..count as i64).map(|n| 4 + n % 4).collect();
        let mut fastest = 0.0_f64;
        // short runs and many: one of them is not interrupted by other programs of the machine
        for _ in 0..1000 {
            let (begun, rounds) = (Instant::now(), 4096 / count);
            for _ in 0..rounds {
                let over = truncated.clone();
                let given = Given {
                    observations: &mut observations,
                    rewards: &mut rewards,
                    truncated: &mut truncated,
                };
                episodes.step(Actions::Index(&actions), &over, given)?;
            }
            fastest = fastest.max((rounds * count) as f64 / begun.elapsed().as_secs_f64());
        }
        println!("{count:5} converters: {:8.3} M control periods/s", fastest * 1e-6);
    }
    Ok(())
}
