//! Flipped bits counted: each bit of each state word and of the tables, in every kind of number.
//!
//! ```text
//!  a run under way ─► state ─┬─────────────► HORIZON steps ─┐
//!                            └─► bit flipped ─► HORIZON steps ─┴► commands changed, seen, healed
//! ```

use std::fmt::Write as _;

use codegen::{Language, Output};
use interp::{Controller, Real, Sample, State, status};
use policy::{NumericFormat, Policy};
use random::SplitMix;

use super::{example, sample};

/// Formats whose numbers or networks differ; `f32-fma` has the state of `f32`.
const FORMATS: [NumericFormat; 4] = [
    NumericFormat::F32,
    NumericFormat::F64,
    NumericFormat::I16,
    NumericFormat::I8,
];

/// Steps behind a flip. The delays of the example hold one sample, and five bad samples in a row are rare.
const HORIZON: usize = 8;

/// Runs of each bit, of which a release asks for 1000.
fn runs() -> usize {
    if tests::full() { 1000 } else { 10 }
}

/// What became of the flips in one word, by its name.
#[derive(Debug, Default)]
struct Count {
    runs: u64,
    /// Some command was another one.
    changed: u64,
    /// No number, or neither within the limits nor the fallback.
    wrong: u64,
    /// The bit `STATE` in the first step.
    seen: u64,
    /// Another command, and never the bit `STATE`.
    silent: u64,
    /// Not seen, and some state was another one to the end.
    lasting: u64,
    /// Steps until the state was that of the twin again, at most; 0 where the first step wrote it anew.
    slowest: usize,
}

impl Count {
    fn add(&mut self, other: &Self) {
        self.runs += other.runs;
        self.changed += other.changed;
        self.wrong += other.wrong;
        self.seen += other.seen;
        self.silent += other.silent;
        self.lasting += other.lasting;
        self.slowest = self.slowest.max(other.slowest);
    }
}

/// Turns a bit of a word: numbers first, the check word of the mapping, then counters.
trait Flip: Real {
    const BITS: usize;
    fn flipped(self, bit: usize) -> Self;
}

impl Flip for f32 {
    const BITS: usize = 32;
    fn flipped(self, bit: usize) -> Self {
        f32::from_bits(self.to_bits() ^ (1 << bit))
    }
}

impl Flip for f64 {
    const BITS: usize = 64;
    fn flipped(self, bit: usize) -> Self {
        f64::from_bits(self.to_bits() ^ (1 << bit))
    }
}

fn flipped<T: Flip>(state: &State<T>, name: &str, word: usize, bit: usize) -> State<T> {
    let mut state = state.clone();
    match name {
        "mapping.check" => state.mapping_check = state.mapping_check.map(|check| check ^ (1 << bit)),
        "bad_count" => state.bad_count ^= 1 << bit,
        "primed" => state.primed ^= 1 << bit,
        _ => {
            let number = state.numbers_mut().nth(word).unwrap();
            *number = number.flipped(bit);
        }
    }
    state
}

fn bits<T: Real>(number: T) -> Vec<u32> {
    let mut words = Vec::new();
    number.append_words(&mut words);
    words
}

/// One flip: both go on with the same measurements.
fn one<T: Flip>(policy: &Policy, twin: &mut Controller<T>, damaged: &State<T>, stream: &[Vec<Sample>]) -> Count {
    let mut hit = twin.clone();
    assert!(hit.restore(damaged));
    let fallback = bits(T::nearest(policy.fallback.duty));
    let limits = policy.limits.duty;
    let mut count = Count {
        runs: 1,
        ..Count::default()
    };
    let mut traces = (twin.blank_trace(), hit.blank_trace());
    for (at, samples) in stream.iter().enumerate() {
        twin.step_into(samples, &mut traces.0).unwrap();
        hit.step_into(samples, &mut traces.1).unwrap();
        let (good, bad) = (traces.0.command, traces.1.command);
        let duty = bad.duty.to_f64();
        let is_fallback = bits(bad.duty) == fallback;
        // a NaN is in no range
        let is_within = (limits.low..=limits.high).contains(&duty);
        count.wrong |= u64::from(!is_fallback && !is_within);
        count.changed |= u64::from(bits(good.duty) != bits(bad.duty));
        let is_seen = bad.status & status::STATE != 0;
        if at == 0 {
            count.seen = u64::from(is_seen);
        } else {
            assert_eq!(count.seen, u64::from(is_seen), "seen in the first step or not at all");
        }
        if hit.state_words() == twin.state_words() {
            // from here on both do the same
            break;
        }
        count.slowest = at + 1;
    }
    count.silent = u64::from(count.changed > count.seen);
    if count.seen > 0 {
        count.slowest = 0;
    } else if count.slowest == stream.len() {
        (count.lasting, count.slowest) = (1, 0);
    }
    count
}

/// All flips of a policy, by the name of the word.
fn campaign<T: Flip>(policy: &Policy, runs: usize) -> Vec<(String, Count)> {
    let mut rng = SplitMix::new(23);
    let mut twin = Controller::<T>::new(policy);
    let names = twin.state_names().to_vec();
    let mut counts: Vec<(String, Count)> = names.into_iter().map(|name| (name, Count::default())).collect();
    for run in 0..runs {
        // a fresh start now and then, and a bad sample now and then: unprimed, held and fallback states are hit, too
        if run % 5 == 0 {
            twin.reset();
        }
        for (word, (name, count)) in counts.iter_mut().enumerate() {
            let is_counter = ["bad_count", "primed"].contains(&name.as_str());
            for bit in 0..if is_counter { 32 } else { T::BITS } {
                let stream: Vec<_> = (0..HORIZON).map(|_| sample(policy, &mut rng, 0.05)).collect();
                let damaged = flipped(twin.state(), name, word, bit);
                count.add(&one(policy, &mut twin, &damaged, &stream));
            }
        }
    }
    counts
}

#[test]
fn a_flipped_state_bit_gives_no_wrong_duty_in_any_format() {
    let mut table = String::from(
        "| format | word | flips | commands changed | wrong duty | seen at once | changed unseen | lasting unseen | steps to heal |\n|---|---|---:|---:|---:|---:|---:|---:|---:|\n",
    );
    for format in FORMATS {
        let policy = example().with_format(format);
        let counts = match format.scalar() {
            policy::Scalar::F32 => campaign::<f32>(&policy, runs()),
            policy::Scalar::F64 => campaign::<f64>(&policy, runs()),
        };
        let mut all = Count::default();
        for (name, count) in &counts {
            write_row(&mut table, format.name(), name, count);
            all.add(count);
            assert_eq!(count.wrong, 0, "{} {name}: {count:?}", format.name());
            // also where it leaves a coefficient within the interval that the lab may set
            if name.starts_with("mapping.") {
                assert_eq!(count.seen, count.runs, "{} {name}: {count:?}", format.name());
            }
        }
        write_row(&mut table, format.name(), "all", &all);
        assert!(all.changed > 0 && all.seen > 0, "the flips do something: {all:?}");
    }
    println!("{table}");
}

fn write_row(table: &mut String, format: &str, name: &str, count: &Count) {
    let _ = writeln!(
        table,
        "| {format} | {name} | {} | {} | {} | {} | {} | {} | {} |",
        count.runs, count.changed, count.wrong, count.seen, count.silent, count.lasting, count.slowest
    );
}

/// Every `stride`-th bit of the checked tables turned in the running program, one at a time.
fn tables_in_c(policy: &Policy, stride: usize) -> String {
    let program = codegen::lower(policy, targets::host(), Language::C);
    let name = &policy.name;
    let tables: Vec<String> = program
        .checked_tables()
        .map(|table| format!("{{ (unsigned char *){name}_{t}, sizeof({name}_{t}) }}", t = table.name))
        .collect();
    let limits = policy.limits.duty;
    format!(
        r#"#include <stdio.h>
#include <stdint.h>
#include <string.h>
#define const
#include "{name}.c"
#undef const
static struct {{ unsigned char *start; unsigned long bytes; }} tables[] = {{ {tables} }};
int main(void)
{{
    unsigned long t, bit, flips = 0ul, missed = 0ul, wrong = 0ul, changed = 0ul, step;
    if ({name}_integrity() != 1) {{ return 1; }}
    for (t = 0ul; t < sizeof(tables) / sizeof(tables[0]); ++t) {{
        for (bit = 0ul; bit < 8ul * tables[t].bytes; bit += {stride}ul) {{
            unsigned char *place = tables[t].start + bit / 8ul;
            {name}_state state;
            int differs = 0;
            static double plain[4];
            {name}_init(&state);
            *place = (unsigned char)(*place ^ (1u << (bit % 8ul)));
            missed += {name}_integrity() == 1;
            for (step = 0ul; step < 4ul; ++step) {{
                {name}_measurement measured = {{ 98.0f, 6.0f, 5.5f }};
                {name}_command command;
                double duty;
                measured.v_out = measured.v_out + (float)step;
                {name}_step(&state, &measured, &command);
                duty = (double)command.duty;
                wrong += !(duty == {fallback:?} || (duty >= {low:?} && duty <= {high:?}));
                /* the first flip that changes nothing is not known beforehand: the plain duties come from an unflipped run */
                differs |= flips != 0ul && duty != plain[step];
            }}
            *place = (unsigned char)(*place ^ (1u << (bit % 8ul)));
            if (flips == 0ul) {{
                {name}_init(&state);
                for (step = 0ul; step < 4ul; ++step) {{
                    {name}_measurement measured = {{ 98.0f, 6.0f, 5.5f }};
                    {name}_command command;
                    measured.v_out = measured.v_out + (float)step;
                    {name}_step(&state, &measured, &command);
                    plain[step] = (double)command.duty;
                }}
            }}
            changed += (unsigned long)differs;
            ++flips;
        }}
    }}
    printf("%lu %lu %lu %lu %d\n", flips, missed, wrong, changed, {name}_integrity());
    return 0;
}}
"#,
        tables = tables.join(", "),
        fallback = policy.fallback.duty,
        low = limits.low,
        high = limits.high,
    )
}

#[test]
fn a_flipped_table_bit_is_found_by_integrity_and_gives_no_wrong_duty() {
    // without a common factor with the bits of an element: every bit of the elements takes its turn
    let stride = if tests::full() { 1 } else { 211 };
    let mut table =
        String::from("| format | flips | missed | wrong duty | commands changed |\n|---|---:|---:|---:|---:|\n");
    for format in FORMATS {
        let policy = example().with_format(format);
        let folder = tempfile::tempdir().unwrap();
        let files = codegen::generate(&policy, targets::host(), &[Output::C], None)
            .unwrap()
            .files;
        for (name, text) in &files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        std::fs::write(folder.path().join("main.c"), tables_in_c(&policy, stride)).unwrap();
        let mut compiler = std::process::Command::new("gcc");
        compiler.args([
            "-std=c99",
            "-O2",
            "-fwrapv",
            "-ffp-contract=off",
            "main.c",
            "-o",
            "flips",
        ]);
        let built = tests::tools::run(compiler.current_dir(folder.path()));
        assert_eq!(built.code, Some(0), "{}: {}", format.name(), built.stderr);
        let ran = tests::tools::run(&mut std::process::Command::new(folder.path().join("flips")));
        let counts: Vec<u64> = ran
            .stdout
            .split_whitespace()
            .map(|word| word.parse().unwrap())
            .collect();
        let [flips, missed, wrong, changed, intact] = counts[..] else {
            panic!("{}: {ran:?}", format.name())
        };
        let _ = writeln!(
            table,
            "| {} | {flips} | {missed} | {wrong} | {changed} |",
            format.name()
        );
        assert!(
            flips > 100 && changed > 0 && intact == 1,
            "{}: {counts:?}",
            format.name()
        );
        assert_eq!((missed, wrong), (0, 0), "{}", format.name());
    }
    println!("{table}");
}
