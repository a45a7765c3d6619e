//! Edits of the generated C that change nothing, each by a rule with its reason.
//!
//! A rule says of an edit that no measurement, no state and no order of calls tells it from the sound code. The tests compare: an
//! edit that a rule excuses and the kit finds is a wrong rule.

use policy::{Activation, Expr, Feature, Policy};

use super::kit_edits::Edit;

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
        "kept where every Q value is a NaN: the state is not sound then, and the mask gives action 0",
    ),
    (
        at_the_start,
        "at equality the difference is the 0 that stands on the other side",
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
    is_array && line.contains(&format!("[{}];", edited.edit.old)) && longer
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

/// The words that say that a feature was clipped, and the one after the other the joins of two of them.
struct Clips<'a> {
    /// Name of the word, and the feature.
    leaves: Vec<(&'a str, &'a Feature)>,
    /// Name, left and right side.
    joins: Vec<[&'a str; 3]>,
}

impl<'a> Clips<'a> {
    fn of(edited: &'a Edited) -> Self {
        let mut clips = Clips {
            leaves: Vec::new(),
            joins: Vec::new(),
        };
        for line in edited.body() {
            let Some((name, value)) = line
                .trim()
                .strip_prefix("const uint32_t ")
                .and_then(|line| line.split_once(" = "))
            else {
                continue;
            };
            let value = value.trim_end_matches(';');
            if let [left, right] = value.split(" | ").collect::<Vec<_>>()[..] {
                clips.joins.push([name, left, right]);
            } else if let Some((_, right)) = value.split_once(" ^ ") {
                let clipped = arguments(right, "_bits").first().copied().unwrap_or("");
                let ends = format!("] = {clipped};");
                let stored = edited
                    .body()
                    .iter()
                    .find(|line| line.contains("->observation[") && line.ends_with(&ends));
                let index = stored.and_then(|line| line.split(['[', ']']).nth(1)?.parse::<usize>().ok());
                clips
                    .leaves
                    .extend(index.map(|index| (name, &edited.policy.features[index])));
            }
        }
        clips
    }

    /// The features whose words are joined in that one.
    fn members(&self, name: &str) -> Vec<&Feature> {
        if let Some((_, feature)) = self.leaves.iter().find(|(own, _)| *own == name) {
            return vec![feature];
        }
        let join = self.joins.iter().find(|[own, ..]| *own == name);
        join.map_or(Vec::new(), |[_, left, right]| {
            [self.members(left), self.members(right)].concat()
        })
    }
}

/// Whether no sound state and no measurement leads the feature beyond its clip.
fn never_clips(feature: &Feature) -> bool {
    let clip = feature.clip.unwrap_or(feature.bound);
    clip.low < feature.bound.low && feature.bound.high < clip.high
}

/// Whether one is the other with the other sign, and nothing that is remembered goes in: both are clipped by the same.
fn are_twins(one: &Feature, other: &Feature) -> bool {
    let is_negated = match (&one.source, &other.source) {
        (Expr::Sub(x, y), Expr::Sub(v, w)) => x == w && y == v,
        _ => false,
    };
    let is_plain = |feature: &Feature| {
        feature.filters.is_empty() && feature.offset == 0.0 && feature.clip.is_some_and(|clip| clip.low == -clip.high)
    };
    is_negated && is_plain(one) && is_plain(other) && one.scale == other.scale && one.clip == other.clip
}

fn one_side_alone(edited: &Edited) -> bool {
    if edited.edit.old != "|" || !["^", "&"].contains(&edited.edit.new.as_str()) {
        return false;
    }
    let Some((_, value)) = edited.line().split_once(" = ") else {
        return false;
    };
    let [left, right] = value.trim_end_matches(';').split(" | ").collect::<Vec<_>>()[..] else {
        return false;
    };
    if edited.within("decide") {
        let zero = |name| edited.value_of(name).is_some_and(|value| all_inside(edited, value));
        return edited.edit.new == "^" && (zero(left) || zero(right));
    }
    if !edited.within("sense") {
        return false;
    }
    let clips = Clips::of(edited);
    let (before, own) = (clips.members(left), clips.members(right));
    let joined = before.iter().chain(&own);
    let later: Vec<&Feature> = clips
        .leaves
        .iter()
        .map(|(_, feature)| *feature)
        .filter(|feature| !joined.clone().any(|known| known.name == feature.name))
        .collect();
    let says_later = |feature: &&Feature| later.iter().any(|other| are_twins(feature, other));
    let never = |features: &[&Feature]| features.iter().all(|feature| never_clips(feature));
    match edited.edit.new.as_str() {
        // wrong where both are the same word other than 0
        "^" => never(&before) || never(&own) || own.iter().all(says_later) || before.iter().all(says_later),
        // wrong where one of them is 0 and the other is not
        _ => joined
            .clone()
            .all(|feature| never_clips(feature) || says_later(feature)),
    }
}

/// Whether the value asks if the chosen duty is outside of an interval that holds all duties.
fn all_inside(edited: &Edited, value: &str) -> bool {
    match arguments(value, "_outside")[..] {
        ["chosen", low, high] => {
            let (low, high) = (number(low), number(high));
            let duties = edited.table("duties");
            !duties.is_empty() && duties.iter().all(|duty| low <= Some(*duty) && Some(*duty) <= high)
        }
        _ => false,
    }
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
    edited.line() == "uint32_t index = 0u;" && bits(&edited.edit.new).is_some_and(|new| (new as usize) < actions)
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
    let calls = edited.body().iter().filter(|line| line.contains("_crc(&span, "));
    let is_last = calls.last().is_some_and(|line| line.trim() == edited.line());
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

/// The largest magnitude that a limited activation may see, whatever the observation; nothing where the first layer is unbounded.
fn reach(policy: &Policy, of: impl Fn(Activation) -> Option<f64>) -> Option<f64> {
    let layers = &policy.layers;
    let first = layers
        .first()
        .filter(|layer| layer.activation == Activation::Softsign)?;
    let mut bounds = vec![1.0; first.outputs];
    let mut reach: f64 = 0.0;
    for layer in &layers[1..] {
        let rows = layer.weights.chunks(layer.inputs).zip(&layer.bias);
        let sums = rows.map(|(row, bias)| {
            let products = row.iter().zip(&bounds).map(|(w, bound)| f64::from(w.abs()) * bound);
            f64::from(bias.abs()) + products.sum::<f64>()
        });
        let sums: Vec<f64> = sums.collect();
        let greatest = sums.iter().fold(0.0, |greatest: f64, x| greatest.max(*x));
        // of the sum the share that the function is given
        reach = reach.max(of(layer.activation).map_or(0.0, |share| share * greatest));
        bounds = match layer.activation {
            Activation::Softsign | Activation::Tanh => vec![1.0; layer.outputs],
            // below in magnitude, or -1 where the sum is far below 0
            Activation::Elu => sums.iter().map(|x| x.max(1.0)).collect(),
            Activation::Relu | Activation::LeakyRelu { .. } | Activation::Silu | Activation::Identity => sums,
            _ => return None,
        };
    }
    Some(reach)
}

fn limit_unreached(edited: &Edited) -> bool {
    let ["x", limit] = arguments(edited.line(), "_limit")[..] else {
        return false;
    };
    let of_tanh = |activation| match activation {
        Activation::Tanh => Some(1.0),
        // by the tanh of half of it
        Activation::Elu | Activation::Silu => Some(0.5),
        _ => None,
    };
    let of_silu = |activation| (activation == Activation::Silu).then_some(1.0);
    let reach = match (edited.within("tanh"), edited.within("silu")) {
        (true, _) => reach(edited.policy, of_tanh),
        (_, true) => reach(edited.policy, of_silu),
        _ => None,
    };
    let limits = [limit, &edited.edit.new].map(|limit| bits(limit).map(f32::from_bits));
    limit == edited.edit.old
        && limits
            .into_iter()
            .all(|limit| limit.is_some_and(|limit| reach.is_some_and(|reach| 1.01 * reach < limit.into())))
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
