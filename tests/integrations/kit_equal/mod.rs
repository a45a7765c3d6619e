//! Edits of the generated C that change nothing, each by a rule with its reason.
//!
//! A rule says of an edit that no measurement, no state and no order of calls tells it from the sound code. The tests compare: an
//! edit that a rule excuses and the kit finds is a wrong rule.

mod clips;
mod network;

use policy::{Activation, Policy};

use super::kit_edits::Edit;
use clips::one_side_alone;
use network::{limit_unreached, quotient_unreached};

/// A text with an edit of it.
pub struct Edited<'a> {
    pub policy: &'a Policy,
    /// Lines of the sound text.
    pub lines: Vec<&'a str>,
    pub edit: &'a Edit,
}

type Rule = (fn(&Edited) -> bool, &'static str);

const RULES: &[Rule] = &[
    (longer_array, "an array has a place more than anything writes or reads"),
    (
        disjoint_bits,
        "the two sides have no bit in common, so that or and exclusive or are one",
    ),
    (
        one_side_alone,
        "in a sound state one of the two words is always 0, or a later word of the same or says the same",
    ),
    (
        between_duties,
        "no duty of the table lies between the old and the new limit",
    ),
    (sign_alone, "of this word the sign bit alone is read"),
    (
        behind_the_limits,
        "a number within the duty limits, or the NaN that an operation gives: each bound between tells them apart",
    ),
    (
        first_index,
        "kept where every Q value is a NaN: the state is not sound then, and the mask gives action 0; behind a tanh none is",
    ),
    (
        at_the_start,
        "at equality the difference is the 0 that stands on the other side",
    ),
    (not_both, "no number is below the low end and above the high one"),
    (
        overwritten,
        "the line behind the loop writes the place that the loop writes too much",
    ),
    (same_at_equality, "at equality both sides are the same number"),
    (
        behind_the_tables,
        "the position ends at the count of all tables, before this length",
    ),
    (
        tighter_neighbour,
        "the word behind the line has a tighter limit of its own",
    ),
    (
        limit_unreached,
        "no observation leads a layer to this limit: the first one is bounded, and so are the sums behind it",
    ),
    (
        quotient_unreached,
        "within what the layers reach the quotient stays below 1: every float was tried",
    ),
    (
        implied,
        "the intervals of the coefficients alone say that the sum is above 0",
    ),
];

/// Why an edit that the kit does not find changes nothing, if the fact that it passes says so.
pub fn why_unseen(edited: &Edited) -> Option<&'static str> {
    without_arguments(edited).then_some("the function takes nothing, so that the kit has seen all that it returns")
}

/// Why the edit changes nothing, if a rule says so.
pub fn why(edited: &Edited) -> Option<&'static str> {
    RULES.iter().find(|(holds, _)| holds(edited)).map(|(_, reason)| *reason)
}

impl Edited<'_> {
    fn line(&self) -> &str {
        self.lines[self.edit.line - 1].trim()
    }

    fn is(&self, old: &str, new: &str) -> bool {
        self.edit.old == old && self.edit.new == new
    }

    /// Head of the function around it.
    fn function(&self) -> &str {
        super::kit_edits::head(&self.lines, self.edit.line - 1)
    }

    /// Whether the function around it is that one.
    fn within(&self, name: &str) -> bool {
        self.function().contains(&format!("{}_{name}(", self.policy.name))
    }

    /// The lines of the function around it.
    fn body(&self) -> &[&str] {
        let start = self.lines[..self.edit.line]
            .iter()
            .rposition(|line| *line == "{")
            .unwrap_or(0);
        let end = self.lines[start..].iter().position(|line| *line == "}").unwrap_or(0);
        &self.lines[start..start + end]
    }

    /// What a constant of the function is set to.
    fn value_of(&self, name: &str) -> Option<&str> {
        let of_name = format!(" {name} = ");
        let line = self
            .body()
            .iter()
            .find(|line| line.contains("const ") && line.contains(&of_name))?;
        Some(line.split_once(&of_name)?.1.trim_end_matches(';'))
    }

    /// The numbers of a table.
    fn table(&self, name: &str) -> Vec<f64> {
        let head = format!(" {}_{name}[", self.policy.name);
        let rows = self
            .lines
            .iter()
            .skip_while(|line| !(line.contains(&head) && line.ends_with('{')));
        let rows = rows.skip(1).take_while(|line| !line.starts_with('}'));
        rows.flat_map(|row| row.split(',')).filter_map(number).collect()
    }
}

/// A literal of the text as a number.
fn number(text: &str) -> Option<f64> {
    text.trim().trim_end_matches(['f', 'u']).parse().ok()
}

/// Bits of a literal in hexadecimal or decimal.
fn bits(text: &str) -> Option<u32> {
    let text = text.trim().trim_end_matches('u');
    match text.strip_prefix("0x") {
        Some(hex) => u32::from_str_radix(hex, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Arguments of the first call of that function in a line.
fn arguments<'a>(line: &'a str, function: &str) -> Vec<&'a str> {
    let Some((_, rest)) = line.split_once(&format!("{function}(")) else {
        return Vec::new();
    };
    rest.split(')').next().unwrap_or(rest).split(", ").collect()
}

fn longer_array(edited: &Edited) -> bool {
    let line = edited.line();
    let is_array = ["float ", "double ", "uint32_t ", "int32_t "]
        .iter()
        .any(|kind| line.starts_with(kind));
    let longer = bits(&edited.edit.new) > bits(&edited.edit.old);
    // a number that is read from an array is no array
    is_array && !line.contains(" = ") && line.contains(&format!("[{}];", edited.edit.old)) && longer
}

fn disjoint_bits(edited: &Edited) -> bool {
    if !edited.is("|", "^") {
        return false;
    }
    let line = edited.line();
    // flags of 0 or 1 at different places, and masks of which one is 0
    let status = edited.within("decide") && (line.starts_with("| (") || line.contains("command->status = "));
    // what a mask leaves beside what its complement leaves
    status || line.contains("& ~") || line.contains("& below) |")
}

fn between_duties(edited: &Edited) -> bool {
    if !edited.line().contains("_outside(chosen, ") {
        return false;
    }
    let (Some(old), Some(new)) = (number(&edited.edit.old), number(&edited.edit.new)) else {
        return false;
    };
    let duties = edited.table("duties");
    // at an end a duty is inside still
    !duties.is_empty() && !duties.iter().any(|duty| old.min(new) <= *duty && *duty <= old.max(new))
}

fn sign_alone(edited: &Edited) -> bool {
    edited.line() == "uint32_t stray = 0u;" && bits(&edited.edit.new).is_some_and(|new| new < 1 << 31)
}

fn behind_the_limits(edited: &Edited) -> bool {
    // the greatest duty is below 1; an operation gives a quiet NaN
    let (one, quiet) = (1.0_f32.to_bits(), 0x7FC0_0000);
    let asks = edited.within("decide") && edited.line().starts_with("const uint32_t stray = ");
    asks && bits(&edited.edit.new).is_some_and(|new| one < new && new < quiet)
}

fn first_index(edited: &Edited) -> bool {
    let actions = edited.table("duties").len();
    let is_action = bits(&edited.edit.new).is_some_and(|new| (new as usize) < actions);
    // limited by its bits, so that a NaN leaves it as a number; what stands behind it is a number then
    let has_tanh = edited
        .policy
        .layers
        .iter()
        .any(|layer| layer.activation == Activation::Tanh);
    edited.line() == "uint32_t index = 0u;" && (is_action || has_tanh)
}

fn without_arguments(edited: &Edited) -> bool {
    edited.within("self_test") && edited.function().contains("_self_test(void)")
        || edited.within("integrity") && edited.function().contains("_integrity(void)")
}

fn at_the_start(edited: &Edited) -> bool {
    edited
        .line()
        .contains("(position > span->first) ? (position - span->first) : 0u")
        && edited.is(">", ">=")
}

fn behind_the_tables(edited: &Edited) -> bool {
    // the last call of its kind in the slice
    let mut calls = edited.body().iter().filter(|line| line.contains("_crc(&span, "));
    let is_last = calls.next_back().is_some_and(|line| line.trim() == edited.line());
    is_last && edited.within("integrity_slice") && bits(&edited.edit.new) > bits(&edited.edit.old)
}

fn tighter_neighbour(edited: &Edited) -> bool {
    let words = |line: &str, function: &str| -> Option<(u32, Vec<String>)> {
        let arguments = arguments(line, function);
        let word = arguments
            .first()?
            .split_once("memory[")?
            .1
            .trim_end_matches(']')
            .parse()
            .ok()?;
        Some((word, arguments.iter().map(|text| (*text).to_owned()).collect()))
    };
    let Some((first, own)) = words(edited.line(), "_line_far") else {
        return false;
    };
    let (Some(length), Some(bound)) = (bits(&own[1]), bits(&own[2])) else {
        return false;
    };
    if edited.edit.old != own[1] || bits(&edited.edit.new) != Some(length + 1) {
        return false;
    }
    edited.body().iter().any(|line| {
        let alone = words(line, "_far")
            .filter(|(_, arguments)| arguments.len() == 2)
            .map(|(at, own)| (at, own[1].clone()));
        let of_line = words(line, "_line_far").map(|(at, own)| (at, own[2].clone()));
        of_line
            .or(alone)
            .is_some_and(|(at, own)| at == first + length && bits(&own) <= Some(bound))
    })
}

fn implied(edited: &Edited) -> bool {
    if !edited.within("set_mapping") {
        return false;
    }
    // the line as it is after the edit: `& flag((a + (r * X)) > Y)`
    let Some((_, sum)) = edited.edit.after.split_once("_flag((a ") else {
        return false;
    };
    let words: Vec<&str> = sum.split([' ', '(', ')']).filter(|word| !word.is_empty()).collect();
    let [join, "r", product, x, comparison, y, ..] = words[..] else {
        return false;
    };
    let (Some(x), Some(y)) = (number(x), number(y)) else {
        return false;
    };
    let range = |name: &str| -> Option<[f64; 2]> {
        let of_name = format!("_within({name}, ");
        let line = edited.body().iter().find(|line| line.contains(&of_name))?;
        let arguments = arguments(line, "_within");
        Some([number(arguments[1])?, number(arguments[2])?])
    };
    let (Some(a), Some(r)) = (range("a"), range("r")) else {
        return false;
    };
    // linear in each of them: the ends are the farthest
    let corners = a.iter().flat_map(|a| r.iter().map(move |r| (a, r)));
    let all_above = corners.clone().all(|(a, r)| {
        let term = if product == "*" { r * x } else { r + x };
        let sum = if join == "+" { a + term } else { a - term };
        sum > y + 1e-3
    });
    all_above && [">", ">="].contains(&comparison)
}

/// A choice of the smaller or greater of two, and limits that put the limit itself in the place of an equal number.
fn same_at_equality(edited: &Edited) -> bool {
    if !edited.is("<", "<=") && !edited.is(">", ">=") {
        return false;
    }
    let line = edited.line();
    let of_two = ["(count < rest) ? count : rest", "(inside < length) ? inside : length"];
    // zeros are equal and have two signs: no clamp may end at one
    let clamps = || edited.lines.iter().filter(|line| line.contains("_clamp(v"));
    let ends_at_zero = |line: &&&str| arguments(line, "_clamp").iter().any(|end| number(end) == Some(0.0));
    let clamp = edited.within("clamp") && !clamps().any(|line| ends_at_zero(&line));
    // the cap that is reached, which no status tells of
    let cap = edited.within("advance") && line.starts_with("const uint32_t f") && line.contains("_flag(v");
    of_two.iter().any(|text| line.contains(text)) || clamp || cap
}

fn not_both(edited: &Edited) -> bool {
    edited.within("outside") && edited.line().contains("_flag(x < low) | ") && edited.is("|", "^")
}

/// A line of memories that moves on by one more: its last place gets the newest sample behind the loop.
fn overwritten(edited: &Edited) -> bool {
    let head = edited
        .line()
        .strip_prefix("for (i = ")
        .and_then(|rest| rest.split_once("; i < "));
    let Some(end) = head.and_then(|(_, rest)| bits(rest.split(';').next()?)) else {
        return false;
    };
    let is_longer =
        edited.is("<", "<=") || edited.edit.old == format!("{end}u") && bits(&edited.edit.new) == Some(end + 1);
    let behind = &edited.lines[edited.edit.line..];
    let body = behind.iter().position(|line| line.trim() == "}");
    let next = body
        .and_then(|at| behind.get(at + 1))
        .is_some_and(|line| line.trim().starts_with(&format!("state->memory[{end}] = push")));
    edited.within("advance") && is_longer && next
}
