//! Edits of the generated C that are drawn from a seed: does the kit find them?
//!
//! ```text
//! core.c ─► lines of code ─► a token, drawn ─► another one ─► gcc ─► other machine code? ─► with the kit ─► FAIL, or printed
//! ```
//!
//! An edit that the kit does not find may be one that changes nothing, such as an array that is longer. `kit_equal` has rules for
//! those, each with its reason; the others are missed, and printed. Those of the self test and of the integrity check are counted
//! apart: none of them changes a command, what they weaken is the check.

use random::{Random, SplitMix};

use super::kit_equal::{self, Edited};
use super::{Ran, build, example, files, golden_case, legs, write};
use codegen::Output;
use policy::Policy;

/// Control steps of the kit: those of `policyc compile` without a flag.
const STEPS: u32 = verify::kit::DEFAULT_STEPS;

/// An edit of a text.
pub struct Edit {
    /// From 1.
    pub line: usize,
    part: Part,
    /// The token; empty for a statement that is left out.
    pub old: String,
    /// What stands in its place.
    pub new: String,
    before: String,
    /// The line with the edit.
    pub after: String,
}

/// What of the code an edit is in.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    /// What makes commands and keeps the state.
    Controller,
    /// The self test and the integrity check.
    Checks,
}

/// Head of the function around a line.
pub fn head<'a>(lines: &[&'a str], line: usize) -> &'a str {
    let head = |line: &&&str| line.contains('(') && !line.starts_with([' ', '#', '/', '}', '*']);
    lines[..line].iter().rev().find(head).unwrap_or(&"")
}

/// Of a line the part it is in, by the function around it.
fn part(lines: &[&str], line: usize) -> Part {
    const CHECKS: [&str; 5] = ["_crc", "_place(", "_integrity(", "_integrity_slice(", "_self_test("];
    let head = head(lines, line);
    match CHECKS.iter().any(|name| head.contains(name)) {
        true => Part::Checks,
        false => Part::Controller,
    }
}

/// What a token may become.
fn others(token: &str) -> Vec<String> {
    const OPERATORS: &[(&str, &[&str])] = &[
        ("+", &["-"]),
        ("-", &["+"]),
        ("*", &["+"]),
        ("&", &["|"]),
        ("|", &["&", "^"]),
        ("^", &["|"]),
        ("<<", &[">>"]),
        (">>", &["<<"]),
        ("<", &["<=", ">"]),
        ("<=", &["<"]),
        (">", &[">=", "<"]),
        (">=", &[">"]),
        ("==", &["!=", ">="]),
        ("!=", &["=="]),
        ("&&", &["||"]),
        ("+=", &["-="]),
        ("|=", &["&="]),
    ];
    if let Some((_, others)) = OPERATORS.iter().find(|(operator, _)| *operator == token) {
        return others.iter().map(|other| (*other).to_owned()).collect();
    }
    if let Some(value) = token.strip_suffix('f').and_then(|digits| digits.parse::<f32>().ok()) {
        let near = if value == 0.0 { 0.001 } else { value * 1.001 };
        let far = if value == 0.0 { -0.001 } else { value * 0.999 };
        return [near, far].map(|value| format!("{value:?}f")).to_vec();
    }
    let (digits, suffix) = match token.strip_suffix('u') {
        Some(digits) => (digits, "u"),
        None => (token, ""),
    };
    let value = match digits.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16),
        None => digits.parse(),
    };
    value.map_or(Vec::new(), |value| {
        [value.wrapping_add(1), value.wrapping_sub(1)]
            .map(|value| format!("{value}{suffix}"))
            .to_vec()
    })
}

/// The lines of functions: no tables, no directives, no comments, and nothing that only a prover or an assembler reads.
fn code(text: &str) -> Vec<usize> {
    let mut lines = Vec::new();
    // how deep in conditions, and from which depth on nothing is compiled here
    let (mut depth, mut skipped) = (0_usize, None);
    for (number, line) in text.lines().enumerate() {
        let bare = line.trim_start();
        if bare.starts_with("#if") {
            depth += 1;
            let is_other = ["__FRAMAC__", "_ASSEMBLY", "__cplusplus"]
                .iter()
                .any(|word| bare.contains(word));
            if is_other && skipped.is_none() {
                skipped = Some(depth);
            }
        } else if bare.starts_with("#else") && skipped == Some(depth) {
            skipped = None;
        } else if bare.starts_with("#endif") {
            skipped = skipped.filter(|from| *from != depth);
            depth = depth.saturating_sub(1);
        } else if skipped.is_none()
            && line.starts_with("    ")
            && !bare.starts_with(['/', '*'])
            && !bare.starts_with(|c: char| c.is_ascii_digit() || c == '-')
        {
            lines.push(number);
        }
    }
    lines
}

/// Where the tokens of a line stand.
fn tokens(line: &str) -> Vec<std::ops::Range<usize>> {
    let line = line.split("/*").next().unwrap_or(line);
    let kind = |c: char| match c {
        _ if c.is_ascii_alphanumeric() || "._".contains(c) => 1,
        _ if "+-*&|^<>=!".contains(c) => 2,
        _ => 0,
    };
    let mut all: Vec<std::ops::Range<usize>> = Vec::new();
    let mut last = 0;
    for (at, c) in line.char_indices() {
        let now = kind(c);
        match all.last_mut() {
            Some(range) if now == last && now != 0 => range.end = at + 1,
            _ if now != 0 => all.push(at..at + 1),
            _ => {}
        }
        last = now;
    }
    all
}

/// Whether a line may be left out: an assignment, and no declaration that others read.
fn is_assignment(line: &str) -> bool {
    line.ends_with(';') && line.contains(" = ") && !line.trim_start().starts_with("const")
}

/// An edit, drawn: a token of any line of code, or a statement that is left out.
fn draw(text: &str, random: &mut SplitMix) -> Option<(Edit, String)> {
    let code = code(text);
    let line = code[random.below(code.len())];
    let old = text.lines().nth(line)?;
    if is_assignment(old) && random.below(8) == 0 {
        return Some(edited(text, line, None));
    }
    let places = tokens(old);
    let place = places.get(random.below(places.len().max(1)))?.clone();
    let others = others(&old[place.clone()]);
    let other = others.get(random.below(others.len().max(1)))?;
    Some(edited(text, line, Some((place, other))))
}

/// Every edit that can be drawn.
fn every(text: &str) -> Vec<(Edit, String)> {
    let lines: Vec<&str> = text.lines().collect();
    let of_line = |line: usize| {
        let old = lines[line];
        let each = tokens(old).into_iter().flat_map(move |place| {
            let others = others(&old[place.clone()]).into_iter();
            others.map(move |other| edited(text, line, Some((place.clone(), &other))))
        });
        let left_out = is_assignment(old).then(|| edited(text, line, None));
        each.chain(left_out)
    };
    code(text).into_iter().flat_map(of_line).collect()
}

/// The text with another token at a place of a line, or without the line.
fn edited(text: &str, line: usize, change: Option<(std::ops::Range<usize>, &str)>) -> (Edit, String) {
    let lines: Vec<&str> = text.lines().collect();
    let old = lines[line];
    let (token, other, new) = match change {
        Some((place, other)) => {
            let new = format!("{}{other}{}", &old[..place.start], &old[place.end..]);
            (old[place].to_owned(), other.to_owned(), new)
        }
        None => (String::new(), String::new(), String::new()),
    };
    let part = part(&lines, line);
    let mut edited = lines;
    edited[line] = &new;
    let edited = edited.join("\n") + "\n";
    let edit = Edit {
        line: line + 1,
        part,
        old: token,
        new: other,
        before: old.trim().to_owned(),
        after: new.trim().to_owned(),
    };
    (edit, edited)
}

/// An edit and what came of it.
struct Tried {
    edit: Edit,
    is_found: bool,
    /// Why it changes nothing, if a rule says so.
    same: Option<&'static str>,
}

/// Compilers and flags of the edits: an access outside of an array is a finding, too, whatever it changes.
const SANITISED: [&str; 4] = ["gcc", "-O1", "-fsanitize=address,bounds", "-fno-sanitize-recover=all"];

/// Draws edits that give other machine code until so many of them change something by all that the rules know; all of them if no
/// count is given.
fn tried(policy: &Policy, seed: u64, count: Option<usize>) -> Vec<Tried> {
    let folder = tempfile::tempdir().unwrap();
    let files = files(policy, Output::Kit, STEPS);
    write(&files, folder.path());
    let (core, kit) = (format!("{}.c", policy.name), format!("{}_kit.c", policy.name));
    let compiled = |source: &str, object: &str| {
        let compiler = [&SANITISED[..], &["-w", "-c"]].concat();
        let built = build(&compiler, &[source], folder.path());
        (built.code == Some(0)).then(|| {
            std::fs::rename(folder.path().join("program"), folder.path().join(object)).unwrap();
            std::fs::read(folder.path().join(object)).unwrap()
        })
    };
    compiled(&kit, "kit.o").unwrap();
    let sound = compiled(&core, "core.o").unwrap();
    let mut random = SplitMix::new(seed);
    let mut tried: Vec<Tried> = Vec::new();
    let drawn = std::iter::from_fn(|| Some(draw(&files[&core], &mut random)));
    let edits: Box<dyn Iterator<Item = (Edit, String)>> = match count {
        Some(_) => Box::new(drawn.flatten()),
        None => Box::new(every(&files[&core]).into_iter()),
    };
    for (edit, text) in edits {
        std::fs::write(folder.path().join(&core), text).unwrap();
        // the same machine code is no edit: a branch of another machine's, or another way to say the same
        if compiled(&core, "core.o").is_none_or(|object| object == sound) {
            continue;
        }
        let linked = build(&SANITISED, &["core.o", "kit.o"], folder.path());
        assert_eq!(linked.code, Some(0), "{}", linked.stderr);
        let is_found = timed(folder.path()).code != Some(0);
        let edited = Edited {
            policy,
            lines: files[&core].lines().collect(),
            edit: &edit,
        };
        let same = kit_equal::why(&edited);
        assert!(
            !is_found || same.is_none(),
            "the kit finds what a rule excuses ({same:?}): {}: {} => {}",
            edit.line,
            edit.before,
            edit.after
        );
        let same = same.or_else(|| kit_equal::why_unseen(&edited).filter(|_| !is_found));
        tried.push(Tried { edit, is_found, same });
        let changing = || tried.iter().filter(|tried| tried.same.is_none()).count();
        if count.is_some_and(|count| changing() >= count) {
            break;
        }
    }
    tried
}

/// Prints what was missed and what changes nothing; how many were missed.
fn told(policy: &Policy, seed: u64, tried: &[Tried]) -> usize {
    let is_missed = |tried: &&&Tried| !tried.is_found && tried.same.is_none();
    for part in [Part::Controller, Part::Checks] {
        let own: Vec<&Tried> = tried.iter().filter(|tried| tried.edit.part == part).collect();
        println!(
            "{}, seed {seed}, {part:?}: {} edits, {} found, {} change nothing, {} missed",
            policy.name,
            own.len(),
            own.iter().filter(|tried| tried.is_found).count(),
            own.iter().filter(|tried| tried.same.is_some()).count(),
            own.iter().filter(is_missed).count()
        );
        for Tried { edit, same, .. } in own.iter().filter(|tried| !tried.is_found) {
            let verdict = same.unwrap_or("MISSED");
            println!(
                "  {}: {}\n      => {}\n      {verdict}",
                edit.line, edit.before, edit.after
            );
        }
    }
    tried.iter().filter(|tried| is_missed(&tried)).count()
}

/// Runs the program; a kit that does not end within a time is one that a user sees, too.
fn timed(folder: &std::path::Path) -> Ran {
    let program = folder.join("program");
    tests::tools::run(std::process::Command::new("timeout").arg("20").arg(program))
}

/// `POLICYC_KIT_SEED` picks other edits, `POLICYC_KIT_EDITS` more of them; `all` takes an hour.
#[test]
fn edits_from_a_seed_are_found() {
    let asked = |name: &str, usual: &str| std::env::var(name).unwrap_or(usual.to_owned());
    let seed: u64 = asked("POLICYC_KIT_SEED", "77123").parse().unwrap();
    let count = match asked("POLICYC_KIT_EDITS", if tests::full() { "60" } else { "6" }).as_str() {
        "all" => None,
        number => Some(number.parse::<usize>().unwrap()),
    };
    let policies = [example(), golden_case("constructs")];
    let half = count.map(|count| count.div_ceil(2));
    let missed = |(policy, seed): (&Policy, u64)| told(policy, seed, &tried(policy, seed, half));
    let missed: usize = policies.iter().zip(seed..).map(missed).sum();
    assert_eq!(missed, 0, "of {count:?}");
}

/// Most of them hit what the outputs share; the others hit any of the three.
#[test]
fn edits_from_a_seed_are_found_with_several_outputs() {
    let (policy, seed) = (legs("constructs"), 9);
    let count = if tests::full() { 30 } else { 4 };
    assert_eq!(told(&policy, seed, &tried(&policy, seed, Some(count))), 0, "of {count}");
}

/// What is drawn compiles to another program: edits of nothing would always be missed, and edits of tables always found.
#[test]
fn edits_are_drawn_from_the_code_alone() {
    let policy = example();
    let text = files(&policy, Output::C, STEPS).remove("buck12.c").unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let code = code(&text);
    assert!(
        code.iter()
            .any(|line| lines[*line].contains("buck12_within(measured->v_out"))
    );
    assert!(
        !code
            .iter()
            .any(|line| lines[*line].contains("admit") || lines[*line].contains("split"))
    );
    let at = |words: &str| part(&lines, lines.iter().position(|line| line.contains(words)).unwrap());
    assert_eq!(at("next = vector + 1u;"), Part::Checks);
    assert_eq!(at("check->position = span.to;"), Part::Checks);
    assert_eq!(at("span->crc = buck12_crc_word"), Part::Checks);
    assert_eq!(at("buck12_within(measured->v_out"), Part::Controller);
    assert_eq!(at("state->mapping_check = "), Part::Controller);
    let every = every(&text);
    assert!(every.iter().all(|(_, edited)| *edited != text));
    let mut random = SplitMix::new(1);
    for _ in 0..200 {
        let Some((edit, edited)) = draw(&text, &mut random) else {
            continue;
        };
        assert_ne!(edited, text, "{}", edit.before);
        assert_eq!(edited.lines().count(), lines.len());
    }
}
