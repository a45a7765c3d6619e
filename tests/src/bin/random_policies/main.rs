//! `cargo xtask random`: policies drawn at random against the interpreter, in shards.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use tests::shards::{self, Family, Plan, Row};
use toml_input::Faults;
use verify::shards::Shard;

/// Draws policies from seeds, builds each in its turn's numeric format with its turn's compiler, and compares bits with the
/// interpreter. A run that is stopped goes on where it stood. See docs/evidence.md.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask random")]
struct Arguments {
    /// Policies of all shards together
    #[arg(long, default_value_t = 150)]
    policies: u64,
    /// First seed; the tests take those below 1000
    #[arg(long, default_value_t = 1000)]
    first: u64,
    /// Control steps of each policy
    #[arg(long, default_value_t = 1000)]
    steps: u64,
    /// Which part: 2/4 takes every fourth policy, from the second on
    #[arg(long, default_value = "1/1", value_name = "I/N")]
    shard: Shard,
    /// Folder of the results
    #[arg(long)]
    out: PathBuf,
    /// Policies with several outputs, from seeds of their own, in the place of those with one
    #[arg(long)]
    several: bool,
    /// Only merge the shards in the folder, and print their table
    #[arg(long)]
    merge: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(rows) if rows.iter().all(Row::is_equal) => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(faults) => {
            eprintln!("{faults}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<Vec<Row>, Faults> {
    if !arguments.merge {
        let family = match arguments.several {
            true => Family::Several,
            false => Family::One,
        };
        let plan = Plan {
            first: arguments.first,
            policies: arguments.policies,
            steps: arguments.steps,
            shard: arguments.shard,
            family,
        };
        let started = Instant::now();
        let mut compared = 0;
        shards::run(
            plan,
            &arguments.out,
            |seed, steps| shards::compare(family, seed, steps),
            |row| {
                compared += 1;
                if !row.is_equal() || compared % 25 == 0 {
                    println!("{:.0} s, {compared} compared: {row}", started.elapsed().as_secs_f64());
                }
            },
        )?;
    }
    let rows = shards::merge(&arguments.out)?;
    print!("{}", shards::table(&rows));
    for row in rows.iter().filter(|row| !row.is_equal()) {
        println!("not equal: {row}");
    }
    Ok(rows)
}
