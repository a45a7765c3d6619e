//! How well each model fits each channel of each record: the table that comes first, and what `diagnosis.json` has of it.

use report::{Section, Table};
use serde::Serialize;

use super::empirical;
use super::records::{self, PARTLY};
use crate::diagnosis::Diagnosis;
use crate::fit::State;
use crate::left_out;
use crate::noise::channel;
use crate::problem::{LOST, Problem};
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS};
use crate::whiteness::{self, Driven, Largest};
use crate::words::{noise as noise_said, si};
use crate::worth::Worth;

/// An error that white noise passes by this chance is no white one. A convention of tests, and no verdict hangs on it.
const COLOURED: f64 = 0.01;

/// A model at one channel of one record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Fit {
    /// Root mean square error, in the unit of the channel; null where the simulation left every number.
    pub rmse: f64,
    /// 100 (1 - |error| / |measured less its mean|), %: 100 is a perfect fit, 0 that of a constant. Null where the channel is constant.
    pub fit_percent: f64,
    /// Chi-square over the number of values: 1 is noise.
    pub chi2_per_value: f64,
    /// Chance that white noise resembles itself more (Ljung and Box, 20 lags); null where too few values stand in a row.
    pub white_chance: Option<f64>,
}

/// Both models at one channel of one record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Whether the record took no part in the fit.
    pub heldout: bool,
    /// Values that count.
    pub values: usize,
    /// Rows that were measured and are left out: spikes, and the samples at a load step.
    pub left_out: usize,
    /// Standard deviation of the noise.
    pub noise: f64,
    /// Unit of errors and noise.
    pub unit: &'static str,
    /// The model as given.
    pub before: Fit,
    /// What the second model is; none if there is no other.
    pub second: Option<&'static str>,
    /// That model.
    pub after: Option<Fit>,
}

/// Every channel of every record that is no capture, held-out records first.
#[must_use]
pub fn compared(diagnosis: &Diagnosis) -> Vec<Compared> {
    let mut list = Vec::new();
    if let Some(pair) = &diagnosis.held {
        let states = [&pair.before, &pair.after];
        of(&pair.problem, states, second_held(diagnosis), true, &mut list);
    }
    let states = [&diagnosis.given, diagnosis.attribution.state()];
    of(&diagnosis.problem, states, records::second(diagnosis), false, &mut list);
    list.iter_mut().for_each(|one| partly(one, diagnosis));
    list
}

/// Of a held-out record, what explains a part is known by its errors alone: no simulation of it is kept.
fn partly(one: &mut Compared, diagnosis: &Diagnosis) {
    let worths = &diagnosis.findings.partial_gain;
    let own = |worth: &&Worth| (worth.heldout, worth.channel, &worth.record) == (true, one.channel, &one.record);
    if let (true, None, Some(worth)) = (one.heldout, one.second, worths.iter().find(own)) {
        let over = worth.rmse_after / one.noise;
        // the spread of the channel, from the fit that is known
        let spread = one.before.rmse / (1.0 - one.before.fit_percent / 100.0);
        one.second = Some(PARTLY);
        one.after = Some(Fit {
            rmse: worth.rmse_after,
            fit_percent: 100.0 * (1.0 - worth.rmse_after / spread),
            chi2_per_value: over * over,
            white_chance: None,
        });
    }
}

fn of(
    problem: &Problem,
    [before, after]: [&State; 2],
    second: Option<&'static str>,
    heldout: bool,
    list: &mut Vec<Compared>,
) {
    for (index, record) in problem.records.iter().enumerate() {
        if record.capture.is_some() {
            continue;
        }
        for (n, name) in CHANNEL_NAMES.iter().enumerate() {
            let [first, last] = [before, after].map(|state| channel(problem, &state.residual, index, n));
            let values = first.iter().filter(|v| **v != 0.0).count();
            if values == 0 || !problem.sigma[n].is_finite() {
                continue;
            }
            let fit = |errors: &[f64]| fit(&record.measured[n], errors, problem.sigma[n]);
            list.push(Compared {
                record: record.name.clone(),
                channel: name,
                heldout,
                values,
                left_out: left_out::count(problem, index, n).1,
                noise: problem.sigma[n],
                unit: CHANNEL_UNITS[n],
                before: fit(&first),
                second,
                after: second.map(|_| fit(&last)),
            });
        }
    }
}

/// Errors are over the noise `sigma`, and 0 where nothing counts.
fn fit(measured: &[f64], errors: &[f64], sigma: f64) -> Fit {
    let pairs = || measured.iter().zip(errors).filter(|(v, e)| v.is_finite() && **e != 0.0);
    let n = pairs().count().max(1) as f64;
    let square = pairs().map(|(_, e)| e * e).sum::<f64>() / n;
    let mean = pairs().map(|(v, _)| v).sum::<f64>() / n;
    let spread = (pairs().map(|(v, _)| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt();
    // a simulation that left the numbers is off by no number of volts
    let lost = errors.iter().any(|e| e.abs() >= LOST);
    let rmse = if lost { f64::NAN } else { sigma * square.sqrt() };
    Fit {
        rmse,
        // a channel that moves less than its noise is a constant to whoever measures it
        fit_percent: match spread > sigma {
            true => 100.0 * (1.0 - rmse / spread),
            false => f64::NAN,
        },
        chi2_per_value: if lost { f64::NAN } else { square },
        white_chance: whiteness::white_chance(errors),
    }
}

/// The error before and after in a sentence, of the record and channel that the model as given misses most: a held-out voltage if
/// there is one.
pub(super) fn volts(list: &[Compared]) -> Option<String> {
    let best = |one: &&Compared| (one.heldout, one.channel == CHANNEL_NAMES[0]);
    let first = list.iter().map(|one| best(&one)).max()?;
    let all = list
        .iter()
        .filter(|one| best(one) == first && one.before.rmse.is_finite());
    let worst = all.max_by(|a, b| a.before.chi2_per_value.total_cmp(&b.before.chi2_per_value))?;
    let kind = if worst.heldout { "held-out" } else { "training" };
    let before = si(worst.before.rmse, worst.unit);
    let last = worst.after.as_ref().unwrap_or(&worst.before).rmse;
    let noise = noise_said(last, worst.noise, worst.unit);
    let what = format!("In {} of the {kind} record {}", worst.channel, worst.record);
    Some(match (worst.second, worst.after) {
        (Some(second), Some(after)) if after.rmse.is_finite() => format!(
            "{what} the error is {before} rms with the model as given and {} {}; the noise is {noise}.",
            si(after.rmse, worst.unit),
            phrase(second)
        ),
        _ => format!("{what} the error of the model as given is {before} rms; the noise is {noise}."),
    })
}

/// A second model in a sentence.
fn phrase(second: &str) -> String {
    match second {
        second if second.starts_with("with ") => second.to_owned(),
        PARTLY => format!("with the {PARTLY}"),
        second => format!("with the {second} model"),
    }
}

/// What is left of each channel and what drives the converter: the largest correlations at lags up to two milliseconds at 10 kHz.
fn driven(list: &[Driven]) -> Table {
    let mut table = Table::new("")
        .text("record")
        .text("channel")
        .text("with the duty")
        .text("with the load")
        .text("99 % band");
    let told = |largest: &Option<Largest>, band: f64| match largest {
        None => "stands still".to_owned(),
        Some(Largest { correlation, lag }) => {
            let word = if correlation.abs() > band { "" } else { ", as noise" };
            format!("{correlation:.2} after {lag} rows{word}")
        }
    };
    for one in list {
        let kind = if one.heldout { "held-out" } else { "training" };
        table = table.row([
            format!("{} ({kind})", one.record).into(),
            one.channel.into(),
            told(&one.with_duty, one.band).into(),
            told(&one.with_load, one.band).into(),
            format!("±{:.2}", one.band).into(),
        ]);
    }
    table
}

/// The table of all of it.
pub(super) fn section(list: &[Compared], residuals: &[Driven]) -> Section {
    let is_second = list.iter().any(|one| one.after.is_some());
    let mut table = Table::new("").text("record").text("channel");
    let columns = [("rms error", 4), ("fit %", 1), ("chi²/N", 2)];
    for (what, decimals) in columns {
        let named = |when: &str| match is_second {
            true => format!("{what} {when}"),
            false => what.to_owned(),
        };
        table = table.number(named("before"), decimals);
        if is_second {
            table = table.number(named("after"), decimals);
        }
    }
    table = table.number("noise", 4).text("unit").text("white").text("rows");
    for one in list {
        let kind = if one.heldout { "held-out" } else { "training" };
        let mut row: Vec<report::Cell> = vec![format!("{} ({kind})", one.record).into(), one.channel.into()];
        for figure in [
            (|fit: &Fit| fit.rmse) as fn(&Fit) -> f64,
            |fit: &Fit| fit.fit_percent,
            |fit: &Fit| fit.chi2_per_value,
        ] {
            row.push(figure(&one.before).into());
            row.extend(is_second.then(|| one.after.as_ref().map_or(f64::NAN, figure).into()));
        }
        let word = |fit: &Fit| match fit.white_chance {
            None => "–",
            Some(chance) if chance < COLOURED => "no",
            Some(_) => "yes",
        };
        let white = match &one.after {
            Some(after) if after.white_chance.is_some() => format!("{} → {}", word(&one.before), word(after)),
            _ => word(&one.before).to_owned(),
        };
        let rows = match one.left_out {
            0 => one.values.to_string(),
            left => format!("{}, without {left}", one.values),
        };
        row.extend([one.noise.into(), one.unit.into(), white.into(), rows.into()]);
        table = table.row(row);
    }
    let is_part = list.iter().any(|one| one.second == Some(PARTLY));
    let words = match (is_second, is_part) {
        (_, true) => {
            "Before is the model as given, after the model with the best of the known causes, which is no explanation."
        }
        (true, false) => "Before is the model as given, after the model with what was found.",
        (false, false) => "The model as given; there is no second one.",
    };
    let section = Section::new("How well the model fits").text(words).table(table).text(format!(
        "Fit is 100 % less the error over what the channel moves. Chi²/N is 1 where only noise is left; below 1 the noise, which is \
         read off neighbouring rows, is estimated high, as it is where a record rings. White is an error that resembles \
         itself no more than noise does in {:.0} of 100 records; a “no” beside a chi²/N near 1 is less than what a verdict asks for, and no part \
         of the answer.",
        100.0 * (1.0 - COLOURED)
    ));
    if residuals.is_empty() {
        return section;
    }
    let inner = Section::new("Whether what is left follows duty or load")
        .text(
            "The largest correlation of what the last model leaves with the duty and with the set load some rows before. Of noise, 99 of 100 at \
             one lag lie within the band; the largest of 21 lags leaves it in up to one record of five.",
        )
        .table(driven(residuals));
    section.details(inner)
}

/// What the second model of held-out records is.
pub(super) fn second_held(diagnosis: &Diagnosis) -> Option<&'static str> {
    let is_described = diagnosis.findings.empirical.as_ref().is_some_and(|term| term.written);
    empirical::second(!diagnosis.findings.causes.is_empty(), is_described)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: errors of one and measured values of plus and minus two.
    #[test]
    fn a_fit_is_what_its_formulas_say() {
        let measured = [12.0, 8.0, 12.0, 8.0, f64::NAN];
        let fit = fit(&measured, &[2.0, 2.0, -2.0, -2.0, 0.0], 0.5);
        assert_eq!((fit.rmse, fit.fit_percent, fit.chi2_per_value), (1.0, 50.0, 4.0));
        assert_eq!(fit.white_chance, None);
        // what leaves the numbers is off by no number
        assert!(super::fit(&measured, &[2.0, LOST, 1.0, 1.0, 0.0], 0.5).rmse.is_nan());
    }
}
