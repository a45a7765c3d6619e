//! Drivers in C: what Eva analyses together with the generated controller.
//!
//! ```text
//!  sound state, or any bits ─┐
//!                            ├─► one call ─► check ... what comes out
//!  any measurement ──────────┘
//! ```
//!
//! They are made from the policy and the numeric contract. Of the generated code they know its interface and, for what needs no
//! network, the three functions of a step around it.

use policy::{NumericFormat, Policy};

use super::frama_c::{Machine, Numbers};
use super::head::{Answer, passes_nan, reads_state};
use super::invariant::{Invariant, Shown, Word};
use super::number::Number;
use super::slices::slices;
use super::stated::{Stated, stated};
use super::text::{Labels, Text};

const LITTLE: Machine = Machine("x86_32");
const BIG: Machine = Machine("ppc_32");
/// A step is also looked through for NaN and infinities. What is finite on one machine is so on the other: both round alike.
const STEP: &[(Machine, Numbers)] = &[(LITTLE, Numbers::Any), (BIG, Numbers::Any), (LITTLE, Numbers::Finite)];
/// Slices of a run, and the most runs: with more, each is mostly the start of Frama-C.
const PART: usize = 40;
const MOST_PARTS: usize = 4;
/// The choice of an action takes most of the time of a step, and what follows takes any.
const ACTION: &str = "choose";
/// Arithmetic alone; without a NaN from a sound state and finite measurements.
pub(super) const BITS_AND_FINITE: &[(Machine, Numbers)] = &[(LITTLE, Numbers::Any), (LITTLE, Numbers::Finite)];
/// Both byte orders, every bit pattern.
pub(super) const BOTH: &[(Machine, Numbers)] = &[(LITTLE, Numbers::Any), (BIG, Numbers::Any)];
/// Intervals alone, which take half of the time and are nearly always enough; then with equalities between values.
pub(super) const COARSE_FIRST: &[u8] = &[0, 2];
/// With equalities between values: a NaN behind the limiter is caught by bits of the number that it was.
pub(super) const FINE: &[u8] = &[2];
/// Sums and hinges of floats: equalities would show nothing more.
pub(super) const COARSE: &[u8] = &[0];
/// What has no bytes in another order: arithmetic alone.
pub(super) const ONE: &[(Machine, Numbers)] = &[(LITTLE, Numbers::Any)];
/// The same from inputs that are integers: where no NaN arises of them, none has to be looked at.
pub(super) const ONE_FINITE: &[(Machine, Numbers)] = &[(LITTLE, Numbers::Finite)];

/// A function of the driver.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entry {
    /// Name of the function.
    pub function: &'static str,
    /// What is called, with which inputs.
    pub about: &'static str,
    /// What holds after it, beside that nothing goes wrong in it.
    pub stated: Vec<Stated>,
    /// Machines and numbers that it is analysed under.
    pub runs: &'static [(Machine, Numbers)],
    /// Into how many runs each of these is cut, which together are the whole.
    pub parts: usize,
    /// Functions of the policy, without its prefix, whose contract stands for their text. Another entry shows the contract.
    pub assumed: Vec<String>,
    /// Frama-C's `-eva-precision`, in the order in which they are tried until one shows everything.
    pub precisions: &'static [u8],
}

impl Entry {
    /// The function in which a run of a part begins.
    pub fn main(&self, part: usize) -> String {
        main_of(self.function, self.parts, part)
    }
}

fn main_of(function: &str, parts: usize, part: usize) -> String {
    match parts {
        1 => function.to_owned(),
        _ => format!("{function}_{part}"),
    }
}

/// A file of C and its entries.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Driver {
    pub text: String,
    pub labels: Labels,
    pub entries: Vec<Entry>,
    /// Claims that are left to the contract's argument: place and why.
    pub not_stated: Vec<(String, &'static str)>,
}

/// The driver of a policy in its numeric format.
pub(super) fn driver(policy: &Policy) -> Driver {
    let invariant = Invariant::of(policy);
    let mut writer = Writer {
        policy,
        number: Number::of(policy.numeric_format),
        invariant,
        text: Text::default(),
        not_stated: Vec::new(),
    };
    writer.inputs();
    // the longest runs first, so that no core waits for one of them at the end
    let mut entries = Vec::from_iter(writer.network());
    entries.extend([writer.q_values(), writer.marked()]);
    entries.extend(writer.slices());
    entries.extend([
        writer.others(),
        writer.choose(),
        writer.step(),
        writer.damaged(),
        writer.self_test(),
    ]);
    let (text, labels) = writer.text.end();
    Driver {
        text,
        labels,
        entries,
        not_stated: writer.not_stated,
    }
}

pub(super) struct Writer<'a> {
    pub policy: &'a Policy,
    pub number: Number,
    pub invariant: Invariant,
    pub text: Text,
    pub not_stated: Vec<(String, &'static str)>,
}

impl Writer<'_> {
    pub fn literal(&self, x: f64) -> String {
        self.number.literal(x)
    }

    /// A prefix of the policy's functions.
    pub fn n(&self) -> &str {
        &self.policy.name
    }

    /// Opens a function with a state, a measurement and a command.
    pub fn open(&mut self, function: &str) {
        let n = self.n().to_owned();
        self.text.line(format!("void {function}(void)"));
        self.text.lines([
            "{".to_owned(),
            format!("{n}_state state;"),
            format!("{n}_measurement measured;"),
            format!("{n}_command command;"),
        ]);
    }

    /// Closes it: the last check must not hold, or nothing was analysed.
    pub fn close(&mut self) {
        self.text.reached();
        self.text.lines(["}", ""]);
    }

    /// The network and its argmax, from every bit pattern; from a sound state with finite measurements without a NaN.
    fn choose(&mut self) -> Entry {
        let n = self.n().to_owned();
        self.text.lines([
            "void prove_choose(void)".to_owned(),
            "{".to_owned(),
            format!("{n}_state state;"),
            format!("{n}_measurement measured;"),
            match self.answer() {
                Answer::Index => "uint32_t index;".to_owned(),
                Answer::Output => format!("{} output;", self.number.kind()),
                Answer::Gains(count) => format!("{} outputs[{count}];", self.number.kind()),
            },
            "#if defined(FINITE)".to_owned(),
            "sound(&state);".to_owned(),
            "#else".to_owned(),
            "arbitrary(&state);".to_owned(),
            "#endif".to_owned(),
            "measure(&measured);".to_owned(),
            match self.answer() {
                Answer::Index => format!("index = {n}_choose(&state, &measured);"),
                Answer::Output => format!("output = {n}_choose(&state, &measured);"),
                Answer::Gains(_) => format!("{n}_choose(&state, &measured, outputs);"),
            },
        ]);
        let stated = match self.answer() {
            // that it is finite is what the runs with finite numbers show of everything
            Answer::Output | Answer::Gains(_) => Vec::new(),
            Answer::Index => {
                self.text.check("index", &format!("index < {}u", self.policy.outputs()));
                let text = "The network and its argmax give an index below the number of actions.";
                vec![stated("index", text)]
            }
        };
        self.close();
        Entry {
            function: "prove_choose",
            about: match self.answer() {
                Answer::Output | Answer::Gains(_) => {
                    "the network's output from every bit pattern of the state, every measurement; finite numbers from every sound state"
                }
                Answer::Index => {
                    "the choice of an action from every bit pattern of the state, every measurement; finite numbers from every sound state"
                }
            },
            stated,
            runs: BITS_AND_FINITE,
            parts: 1,
            assumed: vec![if self.is_integer() { "network" } else { "q_values" }.to_owned()],
            precisions: COARSE_FIRST,
        }
    }

    /// One step from every sound state.
    fn step(&mut self) -> Entry {
        let n = self.n().to_owned();
        self.open("prove_step");
        self.text.lines([
            "sound(&state);".to_owned(),
            "measure(&measured);".to_owned(),
            format!("{n}_step(&state, &measured, &command);"),
        ]);
        let finite_only = passes_nan(&self.policy.head);
        let mut claims = self.command(passes_nan);
        self.where_it_holds(finite_only, |text| {
            text.check("undamaged", &format!("(command.status & {}u) == 0u", 1 << 8))
        });
        let undamaged = stated("undamaged", "A sound state is never called damaged: STATE is clear.");
        claims.push(undamaged.finite_only(finite_only));
        self.counters();
        let held = self.policy.signals.len();
        let paths = self.policy.paths();
        let passing = paths.iter().filter(|path| passes_nan(path.head));
        let unshown: Vec<String> = passing.map(|path| path.named("previous_duty")).collect();
        for (index, word) in self.invariant.words.clone().iter().enumerate() {
            if let Shown::ByContract(why) = word.shown {
                self.not_stated.push((word.name.clone(), why));
            }
            if word.shown == Shown::Directly && !unshown.contains(&word.place) {
                let label = if index < held { "held" } else { "state" };
                self.keeps(label, index, word);
            }
        }
        self.close();
        if self.takes_output_as_it_is() {
            let why = "an output that nothing squashes is bounded by the check of the policy, over the network's whole box: intervals do not \
                       know that box, so that no sum behind it is infinite is left to the check";
            self.not_stated.push(("a gain without squash and clip".to_owned(), why));
            claims.retain(|claim| !claim.is_finite_only);
        }
        claims.push(stated("held", "Every held sample stays within its plausible range."));
        let others = self.invariant.words.iter().skip(held);
        if others
            .into_iter()
            .any(|word| word.shown == Shown::Directly && word.ends.is_some())
        {
            claims.push(stated(
                "state",
                "Filter memories, previous duty and command, soft start and coefficients stay within their ends.",
            ));
        }
        claims.push(stated(
            "counters",
            "The count of bad steps stays at most K + 1, and `primed` is 0 or 1.",
        ));
        Entry {
            function: "prove_step",
            about: "one step from every sound state, every measurement",
            stated: claims,
            runs: if self.takes_output_as_it_is() { BOTH } else { STEP },
            parts: 1,
            assumed: std::iter::once(ACTION.to_owned()).chain(self.flips()).collect(),
            precisions: match self.answer() {
                // the law multiplies what the state holds
                Answer::Gains(_) if self.policy.head.schedule().is_some() => FINE,
                _ => COARSE_FIRST,
            },
        }
    }

    /// A number of the state is still within its ends.
    pub fn keeps(&mut self, label: &str, index: usize, word: &Word) {
        let Some((low, high)) = word.ends else { return };
        let (low, high) = (self.literal(low), self.literal(high));
        let place = format!("state.{}", word.place);
        self.text.check(
            &format!("{label}_{index}"),
            &format!("{place} >= {low} && {place} <= {high}"),
        );
    }

    fn counters(&mut self) {
        let most = self.invariant.hold + 1;
        self.text.check("counters_bad", &format!("state.bad_count <= {most}u"));
        self.text.check("counters_primed", "state.primed <= 1u");
    }

    /// One step from every bit pattern.
    fn damaged(&mut self) -> Entry {
        let n = self.n().to_owned();
        self.open("prove_damaged");
        self.text.lines([
            "arbitrary(&state);".to_owned(),
            "measure(&measured);".to_owned(),
            format!("{n}_step(&state, &measured, &command);"),
        ]);
        // a law of control reads the state, and its clamps pass a NaN on
        let mut claims = self.command(|head| passes_nan(head) || reads_state(head));
        self.close();
        if claims.iter().any(|claim| claim.is_finite_only) {
            let why = "a NaN of a damaged state passes the clip of the head or of the law: that it leads to the fallback is a relation, which \
                       intervals do not hold; the goals of `equivalence` say so";
            self.not_stated.push(("duty_sim of a damaged state".to_owned(), why));
            claims.retain(|claim| !claim.is_finite_only);
        }
        Entry {
            function: "prove_damaged",
            about: "one step from every bit pattern of the state, every measurement",
            stated: claims,
            runs: BOTH,
            parts: 1,
            assumed: vec![ACTION.to_owned()],
            precisions: FINE,
        }
    }

    /// Numbers that stay within their ends in slices.
    fn slices(&mut self) -> Option<Entry> {
        const FIRST: &str =
            "the memory is the input itself then: `y + k(x - y)` with `y = x`, which intervals take for two numbers";
        const WHY: &str = "a low-pass so fast that it would need too many slices";
        let n = self.n().to_owned();
        let words = self.invariant.words.clone();
        let mut calls = Vec::new();
        for index in 0..self.invariant.memory {
            let Some(word) = self.invariant.memory_word(index).cloned() else {
                continue;
            };
            let (Shown::InSlices { gain, input }, Some((_, bound))) = (word.shown, word.ends) else {
                continue;
            };
            let behind = words.iter().enumerate();
            let kept = behind.filter(|(_, other)| **other == word || other.shown == Shown::WithSlicesOf(index));
            let kept: Vec<(usize, Word)> = kept.map(|(at, other)| (at, other.clone())).collect();
            let first = (format!("{} at the first sample", word.name), FIRST);
            let Some(ends) = slices(bound, input, gain) else {
                self.not_stated
                    .extend(kept.into_iter().map(|(_, word)| (word.name, WHY)));
                continue;
            };
            self.not_stated.push(first);
            if calls.is_empty() {
                self.text.lines([
                    format!("static {n}_state any_sound;"),
                    format!("static {n}_measurement any_measured;"),
                    format!("static {n}_command any_command;"),
                    String::new(),
                ]);
            }
            self.slice_function(index, &word, &kept);
            let pairs = ends.windows(2).map(|pair| {
                let (low, high) = (self.number.down(pair[0]), self.number.up(pair[1]));
                format!("slice{index}({}, {});", self.literal(low), self.literal(high))
            });
            calls.extend(pairs);
        }
        if calls.is_empty() {
            return None;
        }
        // side by side: the time of a run is that of its slices
        let parts = calls.len().div_ceil(PART).min(MOST_PARTS);
        for (part, calls) in calls.chunks(calls.len().div_ceil(parts)).enumerate() {
            self.text
                .line(format!("void {}(void)", main_of("prove_slices", parts, part)));
            self.text.lines(["{", "sound(&any_sound);", "measure(&any_measured);"]);
            self.any_command("any_command");
            self.text.lines(calls.iter());
            self.close();
        }
        Some(Entry {
            function: "prove_slices",
            about: "commit from every sound state, in slices of the memories of low-pass filters, every measurement and command",
            stated: vec![stated(
                "slices",
                "Behind the first sample, the memories of low-pass filters and what stands behind them stay within their ends.",
            )],
            runs: ONE,
            parts,
            assumed: vec![ACTION.to_owned()],
            precisions: COARSE_FIRST,
        })
    }

    fn slice_function(&mut self, index: usize, word: &Word, kept: &[(usize, Word)]) {
        let (n, kind) = (self.n().to_owned(), self.number.kind());
        self.text
            .line(format!("static void slice{index}({kind} low, {kind} high)"));
        self.text.lines([
            "{".to_owned(),
            format!("{n}_state state;"),
            format!("{n}_front front;"),
            // made once: a copy costs a tenth of it
            "state = any_sound;".to_owned(),
            format!("state.{} = Frama_C_{kind}_interval(low, high);", word.place),
            "state.primed = 1u;".to_owned(),
        ]);
        // what decides has no part in it: whatever it says of the state
        self.text.lines([
            format!("{n}_sense(&state, &any_measured, &front);"),
            "front.sound = Frama_C_unsigned_int_interval(0u, 1u);".to_owned(),
            "front.usable = Frama_C_unsigned_int_interval(0u, 1u);".to_owned(),
            format!("{n}_advance(&state, &front, &any_command);"),
        ]);
        for (at, other) in kept {
            self.keeps("slices", *at, other);
        }
        self.text.lines(["}", ""]);
    }

    /// Whether the network computes in integers.
    pub fn is_integer(&self) -> bool {
        matches!(self.policy.numeric_format, NumericFormat::I16 | NumericFormat::I8)
    }
}
