//! The step of a counter within what the training records leave open.
//!
//! A record with a few duties holds the step to some 1e-4 of it, and so do held-out duties, of which others lie near half a count: which way
//! those are rounded hangs on digits that no training record shows. That a step does not hold there says nothing against the counter, as long
//! as another one does that the training records allow as well.

use crate::attribute::Attribution;
use crate::causes::{Cut, Search};
use crate::drive::Model;
use crate::examine::held;
use crate::fit::Fit;
use crate::gain::Pair;
use crate::parallel;
use crate::problem::Problem;
use crate::profile::Profile;
use crate::record::Record;
use crate::search::TIE;

/// Steps that are tried. Between two of them a few held-out duties may be rounded in a way that is not tried. A convention that trades time.
const MOST_TRIED: usize = 48;
/// Beyond both ends of its interval, as a share of its width: 95 % are not all, and what an end costs is asked of each step.
const BEYOND: f64 = 0.5;

/// Digits of a step in words: those that decide are the fifth and the sixth.
const DIGITS: usize = 7;

/// A step that held-out records allow as well.
pub struct Chosen {
    /// The fit with it.
    pub fit: Fit,
    /// Its place among the parameters.
    pub number: usize,
    /// The held-out records.
    pub pair: Pair,
    /// What to say of it.
    pub words: String,
}

/// The step of the best explanation's counter that fits the held-out records best, among those that the training records allow and that leave no
/// doubt there; none if no counter is part of it. What is allowed is as good as the best in chi-square to three standard deviations.
pub fn chosen(
    problem: &Problem,
    (attribution, profiles): (&Attribution, &[Profile]),
    heldout: &[Record],
    base: &Model,
) -> Option<Chosen> {
    let best = attribution.best.as_ref()?;
    let fitter = attribution.fitter(problem);
    let cut = |cause: usize| match attribution.candidates[cause].form.search {
        Search::Counter(cut) => Some(cut),
        _ => None,
    };
    let places = fitter.places(&best.causes);
    let number = places.iter().position(|place| cut(place.0).is_some())?;
    let (cut, profile) = (cut(places[number].0)?, profiles.get(number)?);
    let [low, high] = profile.interval;
    let beyond = BEYOND * (high - low);
    let duties = heldout.iter().flat_map(|record| record.duty.iter().copied());
    // a step near none has counts without end
    let tried = steps([(low - beyond).max(0.5 * profile.value), high + beyond], duties, cut);
    let pairs = parallel::map(&tried, |step| {
        let mut values = best.values.clone();
        values[number] = *step;
        let fit = fitter.holding(&best.causes, &values, &best.state, Some(number));
        if fit.state.chi2 > best.state.chi2 + TIE * attribution.inflation {
            return None;
        }
        let trim = fit.state.starts.trim_or_none(base.plant.converter.f_sw);
        let pair = held(problem, heldout, base, &fit.state, trim)?;
        pair.doubts(problem, &fit.state, false)
            .is_empty()
            .then_some((fit, pair))
    });
    let allowed = pairs.into_iter().flatten();
    let (fit, pair) = allowed.min_by(|a, b| a.1.total().1.total_cmp(&b.1.total().1))?;
    let [value, low, high] = [fit.values[number], low, high].map(|step| report::quantity(step, "", DIGITS));
    let words = format!(
        "the training records leave the step of the duty open between {low} and {high}, and held-out duties lie so near half a count that it decides \
         how they are rounded: {value} is the step in there with which they are explained, too. Another record has to judge it"
    );
    Some(Chosen {
        fit,
        number,
        pair,
        words,
    })
}

/// Steps from `low` to `high` with which `duties` are rounded in different ways, one in the middle of each way.
fn steps([low, high]: [f64; 2], duties: impl Iterator<Item = f64>, cut: Cut) -> Vec<f64> {
    let of_count = match cut {
        Cut::Nearest => 0.5,
        Cut::Below => 0.0,
    };
    let turns = |duty: f64| {
        let from = (duty / high - of_count).floor().max(0.0) as u32;
        let to = (duty / low - of_count).ceil().max(0.0) as u32;
        (from..=to).map(move |count| duty / (f64::from(count) + of_count))
    };
    let mut edges: Vec<f64> = duties
        .flat_map(turns)
        .filter(|step| *step > low && *step < high)
        .collect();
    edges.extend([low, high]);
    edges.sort_by(f64::total_cmp);
    let mut list: Vec<f64> = edges.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    list.dedup();
    let every = list.len().div_ceil(MOST_TRIED).max(1);
    list.into_iter().step_by(every).collect()
}

#[cfg(test)]
mod tests {
    use super::{Cut, MOST_TRIED, steps};

    #[test]
    fn steps_round_the_duties_in_different_ways() {
        // .505 is 33.5 counts of .0150746 and 50.5 of .01
        let tried = steps([0.0099, 0.0101], [0.505, 0.3].into_iter(), Cut::Nearest);
        let rounded = |step: f64| [0.505, 0.3].map(|duty: f64| (duty / step).round());
        assert!(
            tried.windows(2).all(|pair| rounded(pair[0]) != rounded(pair[1])),
            "{tried:?}"
        );
        assert_eq!([rounded(tried[0])[0], rounded(tried[tried.len() - 1])[0]], [51.0, 50.0]);
        let below = steps([0.0099, 0.0101], [0.3].into_iter(), Cut::Below);
        assert_eq!(below.len(), 2, "{below:?}");
        let many = steps([0.0099, 0.0101], (0..5000).map(|n| f64::from(n) / 5000.0), Cut::Nearest);
        assert!(
            many.len() <= MOST_TRIED && many.len() > MOST_TRIED / 2,
            "{}",
            many.len()
        );
    }
}
