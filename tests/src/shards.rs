//! Random policies in shards: a line of a file each, so that a killed run goes on where it stood, and the files of all shards
//! merge to the same bytes in whatever order they were made.
//!
//! ```text
//!  seeds ─► shard 1 of n ─► shard-1-of-n.csv ─┐
//!        ─► shard 2 of n ─► shard-2-of-n.csv ─┴► merge ─► random.csv, table
//! ```

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use policy::NumericFormat;
use verify::{Options, Outcome, Report};

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

/// What a run compares: seeds from `first` on, every `count`-th of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// First seed.
    pub first: u64,
    /// Seeds of all shards together.
    pub policies: u64,
    /// Control steps of each policy.
    pub steps: u64,
    /// Number of this shard, from 1.
    pub shard: u64,
    /// Number of shards.
    pub count: u64,
}

impl Plan {
    fn seeds(self) -> impl Iterator<Item = u64> {
        let step = usize::try_from(self.count).unwrap_or(usize::MAX).max(1);
        (self.first + self.shard - 1..self.first + self.policies).step_by(step)
    }

    /// The lines above the results. A file with other ones is of another run.
    fn head(self) -> String {
        format!("# {}, {} steps a policy\n{COLUMNS}\n", codegen::TOOL, self.steps)
    }

    fn file(self, folder: &Path) -> PathBuf {
        folder.join(format!("shard-{}-of-{}.csv", self.shard, self.count))
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
pub fn compare(seed: u64, steps: u64) -> Row {
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
    let folder = match crate::random::policy(seed) {
        Ok(folder) => folder,
        Err(error) => return row(0, "", &format!("not written: {error}")),
    };
    let policy = match policy::load(&folder.path()) {
        Ok(policy) => policy.with_format(format),
        Err(faults) => return row(0, "", &format!("refused: {faults}")),
    };
    let options = Options {
        steps,
        seed,
        compilers: vec![compiler.into()],
        ..Options::default()
    };
    match verify::run(&policy, options) {
        Ok(report) => row(report.builds.len(), &report.checksum, &outcome(&report)),
        Err(error) => row(0, "", &format!("not compared: {error}")),
    }
}

/// `equal` only if every build was made and compared.
fn outcome(report: &Report) -> String {
    if report.builds.is_empty() {
        return "no build".into();
    }
    let unequal = report.builds.iter().find(|build| build.outcome != Outcome::Equal);
    match unequal.map(|build| (&build.build, &build.outcome)) {
        None => "equal".into(),
        Some((name, Outcome::Different { difference })) => {
            format!("{name} differs at step {} in {}", difference.step, difference.what)
        }
        Some((name, Outcome::Failed { step, reason, .. })) => format!("{name} failed at step {step}: {reason}"),
        Some((name, Outcome::CompileError { message })) => format!("{name} refused: {message}"),
        Some((name, Outcome::Skipped { .. } | Outcome::Equal)) => format!("{name} is missing"),
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
    mut tell: impl FnMut(&Row),
) -> Result<Vec<Row>, String> {
    let path = plan.file(folder);
    let told = |error: std::io::Error| format!("{}: {error}", path.display());
    std::fs::create_dir_all(folder).map_err(told)?;
    let mut rows = kept(plan, &path)?;
    let mut file = std::fs::OpenOptions::new().append(true).open(&path).map_err(told)?;
    for seed in plan.seeds() {
        if rows.iter().any(|row| row.seed == seed) {
            continue;
        }
        let row = compare(seed, plan.steps);
        // one call of the system: a kill leaves a whole line or a torn last one, which the next run cuts off
        file.write_all(format!("{row}\n").as_bytes()).map_err(told)?;
        tell(&row);
        rows.push(row);
    }
    Ok(rows)
}

/// The rows of a file of this shard, which is made or cut back to its last whole line.
fn kept(plan: Plan, path: &Path) -> Result<Vec<Row>, String> {
    let told = |error: std::io::Error| format!("{}: {error}", path.display());
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => return Err(told(error)),
    };
    let whole = &text[..text.rfind('\n').map_or(0, |at| at + 1)];
    if whole.lines().count() < plan.head().lines().count() {
        std::fs::write(path, plan.head()).map_err(told)?;
        return Ok(Vec::new());
    }
    if whole.len() < text.len() {
        std::fs::write(path, whole).map_err(told)?;
    }
    let (head, rows) = parsed(path, whole)?;
    match head == plan.head() {
        true => Ok(rows),
        false => Err(format!(
            "{}: of another run\n  found: {}\n  expected: {}\nname another folder",
            path.display(),
            head.lines().next().unwrap_or_default(),
            plan.head().lines().next().unwrap_or_default()
        )),
    }
}

fn parsed(path: &Path, text: &str) -> Result<(String, Vec<Row>), String> {
    let lines: Vec<&str> = text.lines().collect();
    let at = lines.len().min(2);
    let read = |(index, line): (usize, &&str)| {
        Row::read(line).ok_or_else(|| format!("{}:{}: no line of a shard: {line}", path.display(), index + 3))
    };
    let rows: Result<Vec<Row>, String> = lines[at..].iter().enumerate().map(read).collect();
    Ok((lines[..at].iter().map(|line| format!("{line}\n")).collect(), rows?))
}

/// Merges all shards of a folder into [`MERGED`]; returns the rows, by seed.
///
/// # Errors
/// If a file cannot be read or written, if the files are of different runs, or if two of them disagree about a seed.
pub fn merge(folder: &Path) -> Result<Vec<Row>, String> {
    let told = |path: &Path| {
        let path = path.display().to_string();
        move |error: std::io::Error| format!("{path}: {error}")
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(told(folder))? {
        let path = entry.map_err(told(folder))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with("shard-") && name.ends_with(".csv") {
            files.push(path);
        }
    }
    files.sort();
    let mut head: Option<String> = None;
    let mut rows: BTreeMap<u64, Row> = BTreeMap::new();
    for path in &files {
        let text = std::fs::read_to_string(path).map_err(told(path))?;
        // a shard may be at work: its last line counts when it is whole
        let (found, more) = parsed(path, &text[..text.rfind('\n').map_or(0, |at| at + 1)])?;
        if head.get_or_insert_with(|| found.clone()) != &found {
            return Err(format!("{}: of another run than the other shards", path.display()));
        }
        for row in more {
            let seed = row.seed;
            let known = rows.entry(seed).or_insert_with(|| row.clone());
            if *known != row {
                return Err(format!("two results of seed {seed}:\n  {known}\n  {row}"));
            }
        }
    }
    let rows: Vec<Row> = rows.into_values().collect();
    let head = head.ok_or_else(|| format!("{}: no shard in it", folder.display()))?;
    let mut text = head;
    rows.iter().for_each(|row| {
        let _ = writeln!(text, "{row}");
    });
    let path = folder.join(MERGED);
    std::fs::write(&path, text).map_err(told(&path))?;
    Ok(rows)
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
