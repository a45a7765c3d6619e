//! Every number tried: the conversion of an observation to an integer, for all 2^32 bit patterns of binary32.
//!
//! The generated C is compiled as it is. A main program hands each pattern to its conversion, with the constants that it holds
//! for the feature, and compares with section 6b of the contract in binary64: `floor(x 2^e + 1/2)`, clamped, a NaN by its sign.

use std::collections::BTreeMap;
use std::process::Command;
use std::time::{Duration, Instant};

use codegen::Output;
use policy::scales::{self, InputScale};

use crate::claim::{Claim, Verdict};
use crate::program::{self, Failed, Stopped};
use crate::{Next, Prover, Task, Watch};

/// Conversions of the integer formats, against the contract's formula in binary64.
#[derive(Debug, Clone, Copy)]
pub struct Exhaustive {
    /// Whether it is to be done: it takes a quarter of a minute a conversion.
    pub asked: bool,
}

const COMPILER: &str = "gcc";
const INSTALL: &str = "apt-get install gcc libc6-dev";
/// Longest time for one conversion: a hundred times what it takes on a free core.
const PATIENCE: Duration = Duration::from_secs(1800);

impl Prover for Exhaustive {
    fn prove(&self, task: Task<'_>, watch: &Watch<'_>) -> Result<Vec<Claim>, Stopped> {
        let Some(scales) = scales::of(task.policy) else {
            return Ok(Vec::new());
        };
        let conversions = conversions(&scales.inputs);
        if !self.asked {
            let why = "every number is tried with --exhaustive only: it takes a quarter of a minute a conversion";
            return Ok(conversions
                .iter()
                .map(|conversion| conversion.claim(task, why))
                .collect());
        }
        let version = program::run(
            Command::new(COMPILER).arg("--version"),
            Duration::from_secs(60),
            watch.stop,
        );
        let version = match version {
            Ok(output) => String::from_utf8_lossy(&output.stdout)
                .lines()
                .next()
                .unwrap_or_default()
                .to_owned(),
            Err(Failed::Stopped) => return Err(Stopped),
            Err(Failed::Io(_)) => {
                let why = format!("{COMPILER} is not on PATH; install it: {INSTALL}");
                return Ok(conversions
                    .iter()
                    .map(|conversion| conversion.claim(task, &why))
                    .collect());
            }
        };
        let mut claims = Vec::new();
        for (done, conversion) in conversions.iter().enumerate() {
            let names = conversion.names(task);
            let what = format!("{}: conversion of {names}, all 2^32 numbers", task.policy.name);
            (watch.say)(Next {
                what: &what,
                done,
                all: conversions.len(),
            });
            let begun = Instant::now();
            let tried = conversion.run(task, watch);
            let (verdict, reason, details) = match tried {
                Ok(None) => (Verdict::Proved, String::new(), Vec::new()),
                Ok(Some(difference)) => (Verdict::Refuted, String::new(), vec![difference]),
                Err(Failed::Stopped) => return Err(Stopped),
                Err(Failed::Io(error)) => (Verdict::Unproven, error.to_string(), Vec::new()),
            };
            claims.push(Claim {
                verdict,
                reason,
                details,
                seconds: begun.elapsed().as_secs_f64(),
                tool: version.clone(),
                ..conversion.claim(task, "")
            });
        }
        Ok(claims)
    }
}

/// Features with one conversion.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Conversion {
    exponent: i32,
    low: i32,
    high: i32,
    features: Vec<usize>,
}

fn conversions(inputs: &[InputScale]) -> Vec<Conversion> {
    let mut all: BTreeMap<(i32, i32, i32), Vec<usize>> = BTreeMap::new();
    for (index, input) in inputs.iter().enumerate() {
        let own = all.entry((input.exponent, input.low, input.high));
        own.or_default().push(index);
    }
    let conversion = |((exponent, low, high), features)| Conversion {
        exponent,
        low,
        high,
        features,
    };
    all.into_iter().map(conversion).collect()
}

impl Conversion {
    fn names(&self, task: Task<'_>) -> String {
        let names = self
            .features
            .iter()
            .filter_map(|index| task.policy.features.get(*index));
        names
            .map(|feature| format!("`{}`", feature.name))
            .collect::<Vec<_>>()
            .join(", ")
    }

    /// Not run, for that reason.
    fn claim(&self, task: Task<'_>, why: &str) -> Claim {
        let Self {
            exponent, low, high, ..
        } = self;
        Claim {
            prover: "exhaustive",
            name: format!("conversion-{}", self.features.first().copied().unwrap_or_default()),
            text: format!(
                "The input of {} is floor(x 2^{exponent} + 1/2), clamped to {low} and {high}, for each of the 2^32 bit patterns of x; a \
                 NaN acts as an end by its sign.",
                self.names(task)
            ),
            subject: "the conversions of observations to integers, every binary32 number".to_owned(),
            format: task.policy.numeric_format,
            settings: Vec::new(),
            verdict: Verdict::NotRun,
            reason: why.to_owned(),
            seconds: 0.0,
            tool: String::new(),
            details: Vec::new(),
        }
    }

    /// The first difference, if there is one.
    fn run(&self, task: Task<'_>, watch: &Watch<'_>) -> Result<Option<String>, Failed> {
        let files = codegen::sources(task.policy, task.target, &[Output::C], None);
        let files = files.map_err(|error| Failed::Io(std::io::Error::other(error.to_string())))?;
        let folder = tempfile::Builder::new()
            .prefix("policyc-prove-")
            .tempdir()
            .map_err(Failed::Io)?;
        for (name, text) in &files.files {
            std::fs::write(folder.path().join(name), text).map_err(Failed::Io)?;
        }
        std::fs::write(folder.path().join("main.c"), self.main(task)).map_err(Failed::Io)?;
        let mut compiler = Command::new(COMPILER);
        compiler.current_dir(folder.path()).env("TMPDIR", folder.path());
        // the portable text: that of a core with special instructions is compared with it by `verify`
        compiler.arg(format!("-D{}_PORTABLE", task.policy.name.to_uppercase()));
        compiler.args([
            "-std=c99",
            "-O2",
            "-ffp-contract=off",
            "-w",
            "-o",
            "main",
            "main.c",
            "-lm",
        ]);
        let built = program::run(&mut compiler, PATIENCE, watch.stop)?;
        if !built.status.success() {
            let text = String::from_utf8_lossy(&built.stderr).into_owned();
            return Err(Failed::Io(std::io::Error::other(text)));
        }
        let output = program::run(&mut Command::new(folder.path().join("main")), PATIENCE, watch.stop)?;
        let said = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        match (output.status.success(), said.as_str()) {
            // the program counts, so that one that ends early is no proof
            (true, "tried 4294967296") => Ok(None),
            (true, _) => Ok(Some(said)),
            (false, _) => Err(Failed::Io(std::io::Error::other("the compiled conversion has crashed"))),
        }
    }

    fn main(&self, task: Task<'_>) -> String {
        let n = &task.policy.name;
        let Self {
            exponent, low, high, ..
        } = self;
        let feature = self.features.first().copied().unwrap_or_default();
        let at = |place: usize| 3 * feature + place;
        format!(
            r#"#include "{n}.c"
#include <math.h>
#include <stdio.h>

int main(void)
{{
    uint32_t bits = 0u;
    unsigned long long tried = 0u;
    do {{
        const float x = {n}_from_bits(bits);
        /* exact: 24 bits, an exponent that binary64 holds, and a half */
        const double rounded = floor(ldexp((double)x, {exponent}) + 0.5);
        const int32_t end = ((bits >> 31) != 0u) ? ({low}) : ({high});
        const int32_t expected = isnan(x) ? end : (rounded < ({low})) ? ({low}) : (rounded > ({high})) ? ({high}) : (int32_t)rounded;
        const int32_t found = {n}_integer(x, {n}_ranges[{}], {n}_ranges[{}], {n}_ranges[{}]);
        if (found != expected) {{
            printf("bits 0x%08lX: expected %ld, found %ld", (unsigned long)bits, (long)expected, (long)found);
            return 0;
        }}
        ++tried;
        ++bits;
    }} while (bits != 0u);
    printf("tried %llu", tried);
    return 0;
}}
"#,
            at(0),
            at(1),
            at(2)
        )
    }
}
