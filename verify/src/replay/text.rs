//! A replay in words.

use interp::decisions::Decisions;
use policy::{DutyPath, Feature, Filter, Policy};
use report::grouped;

use super::explain::number;
use super::{Commanded, Compared, FeatureResult, Replay};

/// The table of features, what differs, and the verdict.
#[must_use]
pub fn text(policy: &Policy, replay: &Replay) -> String {
    let rows = replay.rows;
    let mut out = format!(
        "{}: {} of the log through the contract\n\n",
        policy.name,
        counted(rows, "sample")
    );
    if replay.episodes > 1 {
        out = format!(
            "{}: {} of the log through the contract, {}\n\n",
            policy.name,
            counted(rows, "sample"),
            counted(replay.episodes, "episode")
        );
    }
    if replay.skipped > 0 {
        out.truncate(out.trim_end().len());
        out += &format!("; {} of them left out\n\n", counted(replay.skipped, "row"));
    }
    let width = replay.features.iter().map(|feature| feature.name.chars().count());
    let width = width.max().unwrap_or(0).max("feature".len());
    out += &format!(
        "  {:width$}  {:>23}  {:>23}  equal\n",
        "feature", "contract makes", "log has"
    );
    for feature in &replay.features {
        out += &row(feature, rows, width);
    }
    let words = words(policy, replay);
    if !words.is_empty() {
        out.push('\n');
    }
    for line in words {
        out += &format!("  {line}\n");
    }
    out.push('\n');
    out += &verdict(policy, replay);
    out.push('\n');
    out
}

fn row(feature: &FeatureResult, rows: usize, width: usize) -> String {
    let (log, equal) = match &feature.logged {
        None => ("-".to_owned(), "not in the log".to_owned()),
        Some(compared) => (
            range(compared.range),
            format!("{} of {}", grouped(compared.equal as u64), grouped(rows as u64)),
        ),
    };
    let own = range(feature.own);
    format!("  {:width$}  {own:>23}  {log:>23}  {equal}\n", feature.name)
}

fn range([low, high]: [f64; 2]) -> String {
    format!("{} .. {}", number(low), number(high))
}

/// What is to be said below the table.
fn words(policy: &Policy, replay: &Replay) -> Vec<String> {
    if let Some(late) = &replay.late {
        return vec![format!(
            "{late}: logged one row late; with each of its values a row earlier, all that the log has is equal"
        )];
    }
    let mut words = Vec::new();
    for (feature, compared) in replay.compared() {
        let name = &feature.name;
        if let Some(first) = compared.first_line {
            let reason = compared.explanation.as_deref();
            let reason = reason.unwrap_or("no simple relation to the samples was found");
            words.push(format!(
                "{name}: first other in line {first}, by up to {} in line {}; {reason}",
                number(compared.worst),
                compared.worst_line
            ));
        } else if is_still(compared) && replay.rows > 1 {
            words.push(format!("{name} does not move in this log, which shows little of it"));
        }
    }
    words.extend(unreached_words(policy, replay));
    for (output, path) in replay.commands().into_iter().zip(policy.paths()) {
        words.extend(command_words(policy, replay, output, &path));
    }
    if let Some(decisions) = &replay.format {
        // rows of the log stand in the place of golden vectors
        let lines = crate::text::decisions(policy, decisions).into_iter();
        words.extend(lines.map(|line| line.replace("most at golden vector", "most in row (from 0)")));
    }
    if replay.uncounted > 0 {
        words.push(format!(
            "{} of {} do not count in what {} changes: a signal is outside its range there, or an observation is none that a plausible \
             measurement gives, and the controller never computes that decision{}",
            grouped(replay.uncounted as u64),
            counted(replay.rows, "row"),
            policy.numeric_format.name(),
            if replay.format.is_none() { "; this log says nothing of it" } else { "" }
        ));
    }
    for (signal, rows, [low, high]) in &replay.outside {
        words.push(format!(
            "{signal}: {} to {} in the log, outside its range in {}: there the controller will hold the last good sample, and then \
             command the fallback",
            number(*low),
            number(*high),
            counted(*rows, "row")
        ));
    }
    words
}

/// What is to be said of the choices or duties of an output.
fn command_words(policy: &Policy, replay: &Replay, output: Commanded<'_>, path: &DutyPath<'_>) -> Vec<String> {
    let of = output.name.map_or(String::new(), |name| format!("{name}: "));
    let mut words = Vec::new();
    if let Some(actions) = output.actions {
        let (equal, rows) = (grouped(actions.equal as u64), grouped(replay.rows as u64));
        let told = match (actions.first_line, actions.exploring) {
            (None, _) => String::new(),
            (Some(line), true) => format!(", first other in line {line}: explored"),
            (Some(line), false) => format!(", first other in line {line}"),
        };
        let command = if path.head.is_choice() { "action" } else { "duty" };
        let ties = match actions.ties {
            0 => String::new(),
            1 => ", 1 tie apart".to_owned(),
            ties => format!(", {} ties apart", grouped(ties as u64)),
        };
        // that of a gain is another one, and what a format does is told as a share of that
        let range = match path.head.schedule().and(path.head.duty_span()) {
            Some(span) => format!("the range of the limits, {}", number(span)),
            None => "its range".to_owned(),
        };
        let worst = actions.worst.map_or(String::new(), |(share, line)| match share > 0.0 {
            true => format!(", largest difference {} of {range}, in line {line}", number(share)),
            false => ", to the last digit".to_owned(),
        });
        let in_floats = if replay.in_floats { " in f32" } else { "" };
        words.push(format!(
            "{of}{command} equal in {equal} of {rows}{in_floats}{ties}{told}{worst}"
        ));
        if actions.ties > 0 {
            words.push(format!(
                "a tie: both actions have the same Q value within golden_tolerance, {} of the largest; a rounding chose between them",
                number(policy.golden_tolerance())
            ));
        }
    }
    let others = output.duties.and_then(super::DutyResult::text);
    words.extend(others.map(|text| format!("{of}{text}")));
    words
}

/// Where features are cut off: the ends by their words, as what the network sees and as the contract says them, lower one first.
struct Ends {
    word: &'static str,
    names: [&'static str; 2],
    seen: [f64; 2],
    written: [f64; 2],
}

impl Ends {
    /// The clip of a feature, and the clamp of an integrator that is behind all but delays.
    fn of(feature: &Feature) -> Vec<Self> {
        let clip = feature.clip.map(|clip| Self {
            word: "clip",
            names: ["lower", "upper"],
            seen: [clip.low, clip.high],
            written: [clip.low, clip.high],
        });
        let mut filters = feature.filters.iter().rev();
        let last = filters.find(|filter| !matches!(filter, Filter::Delay { .. }));
        let clamp = last.and_then(|filter| match *filter {
            Filter::Integrator { min, max, .. } => {
                let seen = [min, max].map(|end| feature.scale * end + feature.offset);
                let clamp = Self {
                    word: "clamp",
                    names: ["min", "max"],
                    seen,
                    written: [min, max],
                };
                Some(if feature.scale < 0.0 { clamp.turned() } else { clamp })
            }
            _ => None,
        });
        clip.into_iter().chain(clamp).collect()
    }

    fn turned(mut self) -> Self {
        self.names.reverse();
        self.seen.reverse();
        self.written.reverse();
        self
    }

    /// Whether values in `range` come to neither or only one end; an end beyond `cut` shows in no log.
    fn unreached(&self, range: [f64; 2], cut: [f64; 2]) -> [bool; 2] {
        let [low, high] = self.seen;
        // what lies at an end is off it by roundings of binary32 at most
        let slack = 1e-6 * (high - low);
        let is_shown = [low >= cut[0], high <= cut[1]];
        [
            is_shown[0] && range[0] > low + slack,
            is_shown[1] && range[1] < high - slack,
        ]
    }
}

/// Ends that an equal feature never came to: the log is equal whatever they are.
fn unreached_words(policy: &Policy, replay: &Replay) -> Vec<String> {
    let (mut both, mut one) = (Vec::new(), Vec::new());
    for (feature, result) in policy.features.iter().zip(&replay.features) {
        let is_told = |compared: &Compared| compared.first_line.is_none() && !is_still(compared);
        if !result.logged.as_ref().is_some_and(is_told) {
            continue;
        }
        let name = &feature.name;
        let clip = (feature.clip).map_or([f64::NEG_INFINITY, f64::INFINITY], |clip| [clip.low, clip.high]);
        for ends in Ends::of(feature) {
            let word = ends.word;
            match ends.unreached(result.own, clip) {
                [true, true] => {
                    let [low, high] = ends.seen.map(number);
                    both.push(format!("the {word} of {name}, {low} to {high}"));
                }
                [false, false] => {}
                [low, _] => {
                    let at = usize::from(!low);
                    let (end, value) = (ends.names[at], number(ends.written[at]));
                    one.push(match word {
                        "clamp" => format!("the log never reaches `{end}` of {name}, {value}: not checked"),
                        _ => format!("the log never reaches the {end} end of the clip of {name}, {value}: not checked"),
                    });
                }
            }
        }
    }
    let both = (!both.is_empty()).then(|| {
        format!(
            "this log comes to neither end of {}: it shows nothing of them",
            both.join(", ")
        )
    });
    both.into_iter().chain(one).collect()
}

fn is_still(compared: &Compared) -> bool {
    let [low, high] = compared.range;
    low == high
}

fn verdict(policy: &Policy, replay: &Replay) -> String {
    let compared = replay.compared().count();
    if let Some(late) = &replay.late {
        return format!("DIFFERENT: `{late}` is logged one row late, and nothing else differs");
    }
    if let Some(decisions) = &replay.format {
        return by_format(policy, decisions) + &beyond_ranges(replay);
    }
    let kind = Kind::of(policy, replay);
    let format = policy.numeric_format.name();
    if !replay.equal() {
        let in_floats = match replay.in_floats {
            true => format!(". All of this in f32: what {format} changes is judged where that is equal"),
            false => String::new(),
        };
        return different(replay, &kind) + &in_floats;
    }
    let has_commands = replay.commands().iter().any(|output| output.actions.is_some());
    let unjudged = match replay.in_floats {
        true => format!("; in f32, and of {format} nothing is said: the log has no row that the controller answers"),
        false => String::new(),
    };
    equal(replay, &kind, compared, has_commands) + &unjudged + &beyond_ranges(replay)
}

/// Where everything is equal in floats.
fn by_format(policy: &Policy, decisions: &Decisions) -> String {
    let format = policy.numeric_format.name();
    match decisions.kept() {
        true => format!("equal in f32, and {format} changes no more than is allowed"),
        false => format!(
            "DIFFERENT: equal in f32, but {format} changes more than is allowed; to accept it, {} in [network]",
            decisions.remedy()
        ),
    }
}

/// What the verdict does not hold for: the log was replayed as it is, and the controller believes no such sample.
fn beyond_ranges(replay: &Replay) -> String {
    match replay.outside.iter().map(|(_, rows, _)| *rows).max() {
        Some(rows) if rows > 0 => format!(
            "; but in at least {} a signal is outside its range, where the controller holds and falls back",
            counted(rows, "row")
        ),
        _ => String::new(),
    }
}

fn equal(replay: &Replay, kind: &Kind, compared: usize, has_commands: bool) -> String {
    let of = replay.features.len();
    match (compared, has_commands) {
        (0, false) => "NOTHING COMPARED: the log has no observations and no actions".to_owned(),
        (0, true) => format!("equal: the {} (the log has no observations)", kind.noun),
        (compared, _) if compared < of => format!("equal: the {compared} of {of} features that the log has"),
        _ => {
            let largest = |compared: &Compared| compared.range.iter().fold(0.0, |most: f64, end| most.max(end.abs()));
            let is_rounded = |compared: &Compared| compared.worst > replay.tolerance * largest(compared);
            let or_rounding = match replay.compared().any(|(_, compared)| is_rounded(compared)) {
                true => ", or within the rounding of binary32 of what is subtracted there",
                false => "",
            };
            format!(
                "equal: all {} within {} of their largest value{or_rounding}",
                counted(of, "feature"),
                number(replay.tolerance)
            )
        }
    }
}

/// What stands behind the network: of several outputs, of those that differ.
struct Kind {
    /// `actions`, `duties`, or both with the names of outputs.
    noun: String,
    /// Whether a number is commanded, and no choice made.
    is_continuous: bool,
}

impl Kind {
    fn of(policy: &Policy, replay: &Replay) -> Self {
        let paths = policy.paths();
        let both: Vec<_> = replay.commands().into_iter().zip(&paths).collect();
        let differ: Vec<_> = both.iter().filter(|(output, _)| output.differs()).collect();
        // where none differs, all of them are meant
        let meant = if differ.is_empty() {
            both.iter().collect()
        } else {
            differ
        };
        let noun = |path: &DutyPath<'_>| if path.head.is_choice() { "actions" } else { "duties" };
        let named = meant.iter().map(|(output, path)| match output.name {
            Some(name) => format!("{} of {name}", noun(path)),
            None => noun(path).to_owned(),
        });
        let list: Vec<String> = named.collect();
        Self {
            noun: list.join(" and the "),
            is_continuous: meant.first().is_some_and(|(_, path)| !path.head.is_choice()),
        }
    }
}

fn different(replay: &Replay, kind: &Kind) -> String {
    let (noun, is_continuous) = (&kind.noun, kind.is_continuous);
    let compared = replay.compared().count();
    let others = replay.compared().filter(|(_, compared)| compared.first_line.is_some());
    let others = others.count();
    let outputs = replay.commands();
    let other_duties: Vec<_> = outputs.iter().filter(|output| output.has_other_duties()).collect();
    if let ([first, ..], 0) = (other_duties.as_slice(), others) {
        let of = first.name.map_or(String::new(), |name| format!(" of {name}"));
        return format!("DIFFERENT: the actions{of} of the log have other duties");
    }
    match others {
        0 if compared == 0 => format!(
            "DIFFERENT: the {noun}. The log has no observations, which would say why: {} all show here. Columns `obs_0`, `obs_1`, ... \
             tell them apart. A trainer who explores: --exploring",
            if is_continuous {
                "a filter that begins otherwise, the scale of a feature, squash or clip, scale and offset in [actions], base and factors of a law"
            } else {
                "a filter that begins otherwise, the scale of a feature, the order of the features or of [actions]"
            }
        ),
        0 if compared < replay.features.len() => unlogged(replay, noun),
        0 => format!(
            "DIFFERENT: the observations are equal, the {noun} are not. A trainer who explores: --exploring. Otherwise look at {}, \
             and at the golden vectors",
            match is_continuous {
                true => "squash or clip, scale and offset in [actions]",
                false => "the order of [actions]",
            }
        ),
        1 => format!("DIFFERENT: 1 of {compared} logged features"),
        others => format!("DIFFERENT: {others} of {compared} logged features"),
    }
}

/// Other commands of equal observations, of which some are not in the log.
fn unlogged(replay: &Replay, noun: &str) -> String {
    let missing = replay.features.iter().filter(|feature| feature.logged.is_none());
    let missing: Vec<String> = missing.map(|feature| format!("`{}`", feature.name)).collect();
    let (list, verb) = match missing.as_slice() {
        [one] => (one.clone(), "is"),
        [first @ .., last] => (format!("{} and {last}", first.join(", ")), "are"),
        [] => (String::new(), "are"),
    };
    let seen = match replay.compared().count() {
        1 => "the 1 logged observation is equal".to_owned(),
        count => format!("the {count} logged observations are equal"),
    };
    format!(
        "DIFFERENT: {seen}, the {noun} are not; {list} {verb} not in the log: look there first. A trainer who explores: --exploring"
    )
}

fn counted(count: usize, noun: &str) -> String {
    let s = if count == 1 { "" } else { "s" };
    format!("{} {noun}{s}", grouped(count as u64))
}
