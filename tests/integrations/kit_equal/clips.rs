//! Joins of words of which one is always 0, or is said by another one.

use policy::{Expr, Feature};

use super::{Edited, arguments, number};

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

pub fn one_side_alone(edited: &Edited) -> bool {
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
    // words of something else than clips
    if before.is_empty() || own.is_empty() {
        return false;
    }
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
