//! Random policies in shards, and the table of all of them.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::path::Path;

use policy::{NumericFormat, Policy, ReadOptions};
use toml_input::Faults;
use verify::Options;
use verify::shards::{self, Entry, Head, Shard};

/// Compilers in the order in which policies take turns.
pub const COMPILERS: [&str; 3] = ["gcc", "clang", "rustc"];

/// Formats in the order in which policies take turns. There are five of them and three compilers, so fifteen seeds in
/// a row meet every pair once.
pub const FORMATS: [NumericFormat; 5] = [
    NumericFormat::F32,
    NumericFormat::F64,
    NumericFormat::F32Fma,
    NumericFormat::I16,
    NumericFormat::I8,
];

/// The file that all shards are merged into.
pub const MERGED: &str = "random.csv";

const COLUMNS: &str = "seed,format,compiler,builds,checksum,outcome";

/// Which policies a seed stands for. Each family has seeds of its own: those of one stay what they are whatever another draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// One output, every head.
    One,
    /// Two to four outputs.
    Several,
}

impl Family {
    /// The policy of that seed, read as it is on disk.
    fn policy(self, seed: u64) -> Result<Policy, String> {
        let folder = match self {
            Family::One => crate::random::policy(seed),
            Family::Several => crate::random::several::policy(seed),
        };
        let folder = folder.map_err(|error| format!("not written: {error}"))?;
        let options = match self {
            Family::One => ReadOptions::default(),
            Family::Several => crate::random::several::options(),
        };
        policy::load_with(&folder.path(), &options).map_err(|faults| format!("refused: {faults}"))
    }
}

/// What a run compares: seeds from `first` on, every `count`-th of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// First seed.
    pub first: u64,
    /// Seeds of all shards together.
    pub policies: u64,
    /// Control steps of each policy.
    pub steps: u64,
    /// Which part of them.
    pub shard: Shard,
    /// What the seeds stand for.
    pub family: Family,
}

impl Plan {
    fn seeds(self) -> impl Iterator<Item = u64> {
        let own = (0..self.policies).filter(move |index| self.shard.takes(*index));
        own.map(move |index| self.first + index)
    }

    /// A file with another one is of another run.
    fn head(self) -> Head {
        let of = match self.family {
            Family::One => "",
            Family::Several => ", several outputs",
        };
        Head::new(&format!("{} steps a policy{of}", self.steps), COLUMNS)
    }
}

/// The result of a policy, as its line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Seed of the policy and of the stream of measurements.
    pub seed: u64,
    /// Numeric format.
    pub format: String,
    /// Compiler.
    pub compiler: String,
    /// Builds, one an optimisation level.
    pub builds: u64,
    /// Checksum of the words that the interpreter expects.
    pub checksum: String,
    /// `equal`, or what is not.
    pub outcome: String,
}

impl Row {
    /// Whether every build gave the interpreter's bits.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.outcome == "equal"
    }
}

impl Entry for Row {
    fn key(&self) -> u64 {
        self.seed
    }

    fn read(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split(',').collect();
        let [seed, format, compiler, builds, checksum, outcome] = fields[..] else {
            return None;
        };
        Some(Self {
            seed: seed.parse().ok()?,
            format: format.into(),
            compiler: compiler.into(),
            builds: builds.parse().ok()?,
            checksum: checksum.into(),
            outcome: outcome.into(),
        })
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            seed,
            format,
            compiler,
            builds,
            checksum,
            outcome,
        } = self;
        write!(f, "{seed},{format},{compiler},{builds},{checksum},{outcome}")
    }
}

/// Compares the policy of a seed in its turn's format with its turn's compiler, at all its levels.
#[must_use]
pub fn compare(family: Family, seed: u64, steps: u64) -> Row {
    let format = FORMATS[(seed % 5) as usize];
    let compiler = COMPILERS[(seed % 3) as usize];
    let row = |builds: usize, checksum: &str, outcome: &str| Row {
        seed,
        format: format.name().into(),
        compiler: compiler.into(),
        builds: builds as u64,
        checksum: checksum.into(),
        // a message of a compiler would break the line
        outcome: outcome.replace([',', '\n', '\r'], ";"),
    };
    let policy = match family.policy(seed) {
        Ok(policy) => policy.with_format(format),
        Err(why) => return row(0, "", &why),
    };
    let options = Options {
        steps,
        seed,
        compilers: vec![compiler.into()],
        ..Options::default()
    };
    match verify::run(&policy, options) {
        Ok(report) => row(report.builds.len(), &report.checksum, &report.in_a_line()),
        Err(error) => row(0, "", &format!("not compared: {error}")),
    }
}

/// Compares what the file of the shard does not hold yet, and appends it line by line; `tell` hears each new row.
/// Returns all rows of the shard.
///
/// # Errors
/// If the file cannot be read or written, or is of another run.
pub fn run(
    plan: Plan,
    folder: &Path,
    compare: impl Fn(u64, u64) -> Row,
    tell: impl FnMut(&Row),
) -> Result<Vec<Row>, Faults> {
    let make = |seed| Ok(compare(seed, plan.steps));
    shards::run(folder, plan.shard, &plan.head(), plan.seeds(), make, tell)
}

/// Merges all shards of a folder into [`MERGED`]; returns the rows, by seed.
///
/// # Errors
/// If a file cannot be read or written, if the files are of different runs, or if two of them disagree about a seed.
pub fn merge(folder: &Path) -> Result<Vec<Row>, Faults> {
    shards::merge(folder, MERGED)
}

/// A row for each format and compiler: policies, builds, policies that are not equal.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut counts: BTreeMap<(&str, &str), [u64; 3]> = BTreeMap::new();
    for row in rows {
        let count = counts.entry((&row.format, &row.compiler)).or_default();
        count[0] += 1;
        count[1] += row.builds;
        count[2] += u64::from(!row.is_equal());
    }
    let mut text = String::from("| format | compiler | policies | builds | not equal |\n|---|---|---:|---:|---:|\n");
    let mut sum = [0; 3];
    for ((format, compiler), count) in &counts {
        let [policies, builds, unequal] = count;
        let _ = writeln!(text, "| {format} | {compiler} | {policies} | {builds} | {unequal} |");
        for (sum, count) in sum.iter_mut().zip(count) {
            *sum += count;
        }
    }
    let _ = writeln!(text, "| all | | {} | {} | {} |", sum[0], sum[1], sum[2]);
    text
}

#[cfg(test)]
mod tests;
