//! `cargo run --release -p policyc-verify --example verify -- <policy.toml> [steps] [seed] [compiler...]`: the report as JSON.

use std::error::Error;
use std::path::Path;

use verify::Options;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("expected the path of a policy.toml")?;
    let number = |text: Option<String>, default: u64| text.map_or(Ok(default), |text| text.parse());
    let steps = number(arguments.next(), 100_000)?;
    let seed = number(arguments.next(), 1)?;
    let policy = policy::load(Path::new(&path)).map_err(|faults| format!("{faults:#?}"))?;
    let start = std::time::Instant::now();
    let mut progress = |news| eprintln!("{:6.1} s  {news:?}", start.elapsed().as_secs_f64());
    let compilers = arguments.collect();
    let options = Options {
        steps,
        seed,
        compilers,
        progress: Some(&mut progress),
        ..Options::default()
    };
    let report = verify::run(&policy, options)?;
    println!("{}", serde_json::to_string_pretty(&report)?);
    Ok(())
}
