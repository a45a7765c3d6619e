//! The command line.

use std::path::PathBuf;

use crate::driver::Until;

/// What `--help` prints.
pub const USAGE: &str = "\
usage: cargo run --profile fuzz -p fuzz -- [options]

  --seconds N        time for each target (10 without --executions)
  --executions N     inputs for each target
  --seed S           seed of all inputs (1)
  --target NAME      only this target; may be given several times
  --jobs N           targets at a time (1)
  --out DIR          where findings go (target/fuzz/findings)
  --list             the targets
  --replay FILE      read this input once with --target NAME

The same seed and count give the same inputs. The exit code is 1 if anything was found.
";

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Arguments {
    /// Names of targets; all if empty.
    pub targets: Vec<String>,
    /// Inputs of each target.
    pub executions: Option<u64>,
    /// Seconds for each target.
    pub seconds: Option<f64>,
    /// Seed.
    pub seed: Option<u64>,
    /// Targets at a time.
    pub jobs: Option<usize>,
    /// Folder of findings.
    pub out: Option<PathBuf>,
    /// An input to be read once.
    pub replay: Option<PathBuf>,
    /// Journal: this process is one target's own.
    pub journal: Option<PathBuf>,
    /// Only print the targets.
    pub list: bool,
    /// Only print the usage.
    pub help: bool,
}

impl Arguments {
    /// Reads the words behind the program's name.
    ///
    /// # Errors
    /// Unknown options, missing or wrong values.
    pub fn read(words: impl IntoIterator<Item = String>) -> Result<Self, String> {
        let mut read = Arguments::default();
        let mut words = words.into_iter();
        while let Some(option) = words.next() {
            let mut value = || words.next().ok_or_else(|| format!("`{option}` needs a value"));
            match option.as_str() {
                "--target" => read.targets.push(value()?),
                "--executions" => read.executions = Some(number(&option, &value()?)?),
                "--seconds" => read.seconds = Some(number(&option, &value()?)?),
                "--seed" => read.seed = Some(number(&option, &value()?)?),
                "--jobs" => read.jobs = Some(number(&option, &value()?)?),
                "--out" => read.out = Some(value()?.into()),
                "--replay" => read.replay = Some(value()?.into()),
                "--journal" => read.journal = Some(value()?.into()),
                "--list" => read.list = true,
                "--help" | "-h" => read.help = true,
                _ => return Err(format!("unknown option `{option}`")),
            }
        }
        match read.replay.is_some() && read.targets.len() != 1 {
            true => Err("`--replay` needs one `--target`".to_owned()),
            false => Ok(read),
        }
    }

    /// When a target's run ends.
    #[must_use]
    pub fn until(&self) -> Until {
        let seconds = match (self.seconds, self.executions) {
            (None, None) => Some(10.0),
            (seconds, _) => seconds,
        };
        Until {
            executions: self.executions,
            seconds,
        }
    }
}

fn number<T: std::str::FromStr>(option: &str, text: &str) -> Result<T, String> {
    // 1_000_000 as in the code
    let text = text.replace('_', "");
    text.parse()
        .map_err(|_| format!("`{option}` needs a number, found `{text}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(line: &str) -> Result<Arguments, String> {
        Arguments::read(line.split(' ').map(str::to_owned))
    }

    #[test]
    fn a_count_alone_has_no_limit_of_time() {
        let arguments = read("--executions 1_000 --target mat --seed 7").unwrap();
        assert_eq!(arguments.until().executions, Some(1_000));
        assert_eq!(arguments.until().seconds, None);
        assert_eq!(Arguments::default().until().seconds, Some(10.0));
    }

    #[test]
    fn a_file_to_replay_needs_its_target() {
        assert!(read("--replay f").unwrap_err().contains("--target"));
        assert!(read("--replay f --target mat").is_ok());
        assert!(read("--sed 1").unwrap_err().contains("`--sed`"));
    }
}
