//! One answer against the truth of its case.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::independent::families::SHOWS;
use crate::independent::intervals::{self, Told};
use crate::independent::truth::{Family, Hidden, Reducible, Truth};

/// A held-out column counts for the gain from this share of reducible error to noise on.
const WORTH: f64 = 0.3;

/// What the command answered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Exit code; none where it was killed.
    pub exit: Option<i32>,
    /// Processor's time, s.
    pub seconds: f64,
    /// Standard output and standard error.
    pub said: String,
    /// `diagnosis.json`, or null.
    pub diagnosis: Value,
}

/// How an answer is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// What the truth asks for.
    Right,
    /// One of two causes, and not the other.
    OneOfTwo,
    /// The right cause first, and a wrong one beside it.
    RightAndWrong,
    /// A cause that the data cannot tell from the hidden one, without saying so.
    TieUnsaid,
    /// `unexplained` where a cause should be named.
    Withheld,
    /// `consistent` where something shows.
    Missed,
    /// A wrong cause, one of several.
    WrongAmongSeveral,
    /// A wrong cause, and no doubt.
    ConfidentAndWrong,
    /// A fault of the bench neither named nor mistaken for a cause.
    NotNamed,
    /// The files were refused where they should not be.
    Refused,
    /// The topology was refused by its name.
    NoSuchTopology,
    /// Neither an answer nor a refusal.
    Broken,
}

impl Outcome {
    /// In words.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Outcome::Right => "right",
            Outcome::OneOfTwo => "one of two",
            Outcome::RightAndWrong => "right, and a wrong one beside",
            Outcome::TieUnsaid => "tie not said",
            Outcome::Withheld => "wrongly unexplained",
            Outcome::Missed => "missed",
            Outcome::WrongAmongSeveral => "wrong, among several",
            Outcome::ConfidentAndWrong => "confident and wrong",
            Outcome::NotNamed => "fault not named",
            Outcome::Refused => "wrongly refused",
            Outcome::NoSuchTopology => "topology refused",
            Outcome::Broken => "no answer",
        }
    }
}

/// A judged case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judgement {
    /// Family.
    pub family: Family,
    /// What was hidden.
    pub hidden: Vec<String>,
    /// The converter in words.
    pub converter: String,
    /// `explained` ..., or `refused`.
    pub verdict: String,
    /// What was named, each with its rivals.
    pub named: Vec<String>,
    /// How it is judged.
    pub outcome: Outcome,
    /// Something is claimed of a converter that is as its plant file says.
    pub false_alarm: bool,
    /// Processor's time, s.
    pub seconds: f64,
    /// Shares of the reducible held-out error that the extended model removes.
    pub removed: Vec<f64>,
    /// Hidden values whose cause was named.
    #[serde(default)]
    pub told: Vec<Told>,
}

/// Ids of a cause and of the sets of ids that it calls its rivals.
struct Named {
    id: String,
    rivals: Vec<Vec<String>>,
}

fn named(diagnosis: &Value) -> Vec<Named> {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let set = |value: &Value| match value {
        Value::Array(ids) => ids.iter().map(text).collect(),
        one => vec![text(one)],
    };
    let causes = diagnosis["causes"].as_array().cloned().unwrap_or_default();
    let of = |cause: &Value| Named {
        id: text(&cause["id"]),
        rivals: cause["rivals"]
            .as_array()
            .map_or(vec![], |rivals| rivals.iter().map(set).collect()),
    };
    causes.iter().map(of).collect()
}

fn says(truth: &Truth, answer: &Answer) -> bool {
    let diagnosis = &answer.diagnosis;
    let mut text = answer.said.clone();
    // words of values alone: the names of the keys hold some of them, too
    let values = ["/sentence", "/doubts", "/noise/repairs", "/notes"].map(|key| diagnosis.pointer(key).cloned());
    for value in values.into_iter().flatten() {
        text.push_str(&value.to_string());
    }
    if diagnosis["noise"]["outliers"]
        .as_array()
        .is_some_and(|outliers| !outliers.is_empty())
    {
        text.push_str(" outlier");
    }
    let text = text.to_lowercase();
    let has = |word: &String| text.contains(&word.to_lowercase());
    truth.expect.words.iter().any(|group| group.iter().all(has))
}

/// Compares.
#[must_use]
pub fn judge(truth: &Truth, answer: &Answer) -> Judgement {
    let diagnosis = &answer.diagnosis;
    let refused = answer.exit == Some(2);
    let verdict = match (refused, diagnosis["verdict"].as_str()) {
        (true, _) => "refused",
        (_, Some(verdict)) => verdict,
        _ => "none",
    };
    let causes = named(diagnosis);
    let outcome = match verdict {
        "none" => Outcome::Broken,
        "refused" => refusal(truth, answer),
        _ => answered(truth, answer, verdict, &causes),
    };
    let shown = |cause: &Named| {
        let rivals: Vec<String> = cause.rivals.iter().map(|ids| ids.join("+")).collect();
        if rivals.is_empty() {
            cause.id.clone()
        } else {
            format!("{} ~ {}", cause.id, rivals.join(" ~ "))
        }
    };
    Judgement {
        family: truth.family,
        hidden: truth.hidden.iter().map(|hidden| hidden.id.clone()).collect(),
        converter: truth.converter.clone(),
        verdict: verdict.to_owned(),
        named: causes.iter().map(shown).collect(),
        outcome,
        false_alarm: truth.family == Family::Healthy && (verdict != "consistent" || !causes.is_empty()) && !refused,
        seconds: answer.seconds,
        removed: removed(truth, diagnosis),
        told: intervals::told(truth, diagnosis),
    }
}

fn refusal(truth: &Truth, answer: &Answer) -> Outcome {
    let other = !truth.converter.contains("Buck ") && !truth.converter.starts_with("Buck ");
    let text = answer.said.to_lowercase();
    if other && (text.contains("topology") || text.contains("buck")) {
        return Outcome::NoSuchTopology;
    }
    match truth.expect.refusal && (truth.family == Family::Nonsense || says(truth, answer)) {
        true => Outcome::Right,
        false if truth.family == Family::Bench => Outcome::NotNamed,
        false => Outcome::Refused,
    }
}

/// A delay of all channels and a late sampling instant are one thing.
fn same_instant(truth: &Truth, id: &str) -> bool {
    let late = |id: &str, what: &str| id == "sampling_delay" || id == "sensor_delay" && what.contains("all channels");
    let hidden = truth.hidden.iter().any(|hidden| late(&hidden.id, &hidden.what));
    hidden && ["sampling_delay", "sensor_delay"].contains(&id)
}

/// Whether a cause is one that may be named, or has one among its rivals that adds nothing to it.
fn right(truth: &Truth, cause: &Named) -> bool {
    // of what no list has, a cause that leaves next to nothing cannot be told by anybody
    let tied = |id: &String| truth.family == Family::Unlisted && truth.ties.iter().any(|tie| tie.id == *id);
    let may = |id: &String| truth.expect.causes.contains(id) || tied(id) || same_instant(truth, id);
    let hidden = |id: &String| truth.hidden.iter().any(|hidden| hidden.id == *id);
    may(&cause.id)
        || cause
            .rivals
            .iter()
            .any(|ids| ids.iter().all(may) || ids.iter().all(hidden))
}

fn answered(truth: &Truth, answer: &Answer, verdict: &str, causes: &[Named]) -> Outcome {
    let expect = &truth.expect;
    let good = causes.iter().filter(|cause| right(truth, cause)).count();
    let fault_named = truth.family == Family::Bench && says(truth, answer);
    let wrong = |verdict: &str| match verdict {
        "explained" | "mostly_explained" => Outcome::ConfidentAndWrong,
        _ => Outcome::WrongAmongSeveral,
    };
    if causes.is_empty() {
        return match verdict {
            _ if fault_named && (expect.refusal || verdict == "consistent") => Outcome::Right,
            "consistent" if expect.verdicts.iter().any(|right| right == "consistent") => Outcome::Right,
            "consistent" if unseen(truth) => Outcome::Right,
            "consistent" if truth.family == Family::Bench => Outcome::NotNamed,
            "consistent" => Outcome::Missed,
            _ if truth.family == Family::Bench && !expect.must_name && expect.refusal => Outcome::NotNamed,
            "unexplained" if expect.verdicts.iter().any(|right| right == "unexplained") => Outcome::Right,
            // nothing named, and one channel or record set aside
            "mostly_explained" if expect.set_aside.is_some() && !expect.must_name => Outcome::Right,
            _ => Outcome::Withheld,
        };
    }
    if good == causes.len() {
        if truth.family == Family::Pair && good < truth.hidden.len() {
            return Outcome::OneOfTwo;
        }
        return if verdict == "explained" && untold(truth, causes) {
            Outcome::TieUnsaid
        } else {
            Outcome::Right
        };
    }
    match fault_named || good > 0 && right(truth, &causes[0]) {
        true => Outcome::RightAndWrong,
        false => wrong(verdict),
    }
}

/// What is hidden leaves no trace beyond the noise, or none that one cause of the list would not.
fn unseen(truth: &Truth) -> bool {
    truth.family == Family::Unlisted && truth.chi2 < SHOWS
}

/// A tied cause is named alone and without the hidden one among its rivals.
fn untold(truth: &Truth, causes: &[Named]) -> bool {
    let hidden = |id: &String| truth.hidden.iter().any(|hidden| hidden.id == *id) || same_instant(truth, id);
    let told = |cause: &Named| hidden(&cause.id) || cause.rivals.iter().flatten().any(hidden);
    truth.family == Family::Cause && !causes.iter().any(told)
}

/// Shares of the reducible error removed in held-out columns that have some; not in one that something on no list disturbs, which no model takes away.
fn removed(truth: &Truth, diagnosis: &Value) -> Vec<f64> {
    let lines = diagnosis["gain"]["heldout"].as_array().cloned().unwrap_or_default();
    let mut shares = Vec::new();
    for line in &lines {
        if line["regime"].as_str().is_some_and(|regime| regime != "all") {
            continue;
        }
        let record = line["record"].as_str().unwrap_or_default();
        let stem = record.rsplit('/').next().unwrap_or_default().trim_end_matches(".csv");
        // the answer writes the short names
        let channel = match line["channel"].as_str().unwrap_or_default() {
            "v_o" => "v_out",
            "i_o" => "i_out",
            name => name,
        };
        let of = truth
            .records
            .iter()
            .find(|of| of.record == stem && of.channel == channel);
        let is_disturbed = |of: &&Reducible| {
            let of_it = |hidden: &Hidden| !hidden.listed && hidden.channel.as_ref() == Some(&of.channel);
            truth.hidden.iter().any(of_it)
        };
        let Some(of) = of.filter(|of| of.reducible > WORTH * of.floor && !is_disturbed(of)) else {
            continue;
        };
        if let (Some(before), Some(after)) = (line["rmse_before"].as_f64(), line["rmse_after"].as_f64()) {
            let most = before - of.floor;
            if most > 0.0 {
                shares.push((before - after) / most);
            }
        }
    }
    shares
}
