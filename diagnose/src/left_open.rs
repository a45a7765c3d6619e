//! Values within what the training records leave open.
//!
//! A held-out record may show more of a cause than the training records do: a longer step shows a time constant better, a larger current a core that
//! saturates. And which way held-out duties near half a count are rounded hangs on digits of a counter's step that no training record shows. That
//! the value which fits best does not hold there says nothing against the cause, as long as another one does that the training records allow as
//! well.

use crate::attribute::Attribution;
use crate::causes::Cut;
use crate::drive::Model;
use crate::fit::Fit;
use crate::gain::Pair;
use crate::held_out::{Of, against, held};
use crate::parallel;
use crate::problem::Problem;
use crate::profile::Profile;
use crate::record::Record;
use crate::search::TIE;
use crate::words::si;

/// Values that are tried of a number that is no step: a third of a standard deviation apart where the interval is a normal one's.
const VALUES: usize = 24;
/// Steps that are tried. Between two of them a few held-out duties may be rounded in a way that is not tried. A convention that trades time.
const MOST_TRIED: usize = 48;
/// Beyond both ends of its interval, as a share of its width: 95 % are not all, and what an end costs is asked of each step.
const BEYOND: f64 = 0.5;

/// Digits of a step in words: those that decide are the fifth and the sixth.
const DIGITS: usize = 7;

/// Values that held-out records allow as well.
pub struct Chosen {
    /// The fit with them.
    pub fit: Fit,
    /// The held-out records.
    pub pair: Pair,
    /// What to say of it.
    pub words: String,
}

/// The value of one of the best explanation's parameters, the others fitted beside it, that fits the held-out records best, among those that the
/// training records allow and that leave no doubt there; none if there is no such value. What is allowed is as good as the best in chi-square to
/// three standard deviations.
pub fn chosen(
    problem: &Problem,
    (attribution, profiles): (&Attribution, &[Profile]),
    heldout: &[Record],
    base: &Model,
) -> Option<Chosen> {
    let best = attribution.best.as_ref()?;
    let fitter = attribution.fitter(problem);
    let cut = |number: &usize| {
        let cause = fitter.places(&best.causes)[*number].0;
        attribution.candidates[cause].form.cut()
    };
    let numbers =
        || (0..profiles.len().min(best.values.len())).filter(|number| problem.work.goes_on() || cut(number).is_some());
    let tried: Vec<(usize, f64)> = numbers()
        .flat_map(|number| {
            let [low, high] = profiles[number].interval;
            let beyond = BEYOND * (high - low);
            let values = match cut(&number) {
                // a step near none has counts without end
                Some(cut) => {
                    let duties = heldout.iter().flat_map(|record| record.duty.iter().copied());
                    steps(
                        [(low - beyond).max(0.5 * profiles[number].value), high + beyond],
                        duties,
                        cut,
                    )
                }
                None => {
                    let [least, most, _] = fitter.range(fitter.places(&best.causes)[number]);
                    spread([(low - beyond).max(least), (high + beyond).min(most)])
                }
            };
            values.into_iter().map(move |value| (number, value)).collect::<Vec<_>>()
        })
        .collect();
    let pairs = parallel::map(&tried, |(number, value)| {
        let mut values = best.values.clone();
        values[*number] = *value;
        let fit = fitter.holding(&best.causes, &values, &best.state, Some(*number));
        if fit.state.chi2 > best.state.chi2 + TIE * attribution.inflation {
            return None;
        }
        let trim = fit.state.starts.trim_or_none(base.plant.converter.f_sw);
        let pair = held(problem, heldout, base, &fit.state, trim)?;
        against(&pair, problem, &fit.state, &Of::fit(attribution, best))
            .is_empty()
            .then_some((*number, fit, pair))
    });
    // to hold is more than to do no harm that is told
    let is_better = |(_, _, pair): &(usize, Fit, Pair)| pair.total().1 < pair.total().0.max(NOISE_ALONE);
    let allowed = pairs.into_iter().flatten().filter(is_better);
    let (number, fit, pair) = allowed.min_by(|a, b| a.2.total().1.total_cmp(&b.2.total().1))?;
    let words = words(&profiles[number], fit.values[number], cut(&number).is_some());
    Some(Chosen { fit, pair, words })
}

/// Mean square over that of the noise which held-out records may leave, whatever the model as given leaves of them: noise alone leaves as much in ten
/// values once in ten tables.
pub(crate) const NOISE_ALONE: f64 = 1.6;

/// What to say of a chosen value.
fn words(profile: &Profile, value: f64, is_step: bool) -> String {
    let [low, high] = profile.interval;
    if is_step {
        let [value, low, high] = [value, low, high].map(|step| report::quantity(step, "", DIGITS));
        return format!(
            "the training records leave the step of the duty open between {low} and {high}, and held-out duties lie so near half a count that it decides \
             how they are rounded: {value} is the step in there with which they are explained, too. Another record has to judge it"
        );
    }
    let [value, low, high] = [value, low, high].map(|value| si(value, profile.unit));
    format!(
        "the training records leave {} open between {low} and {high}, and the held-out ones show more of it: {value} is the value about there with which \
         they are explained, too. Another record has to judge it",
        profile.name
    )
}

/// Values from `low` to `high`, both ends among them.
fn spread([low, high]: [f64; 2]) -> Vec<f64> {
    let share = |n: usize| n as f64 / (VALUES - 1) as f64;
    (0..VALUES).map(|n| low + share(n) * (high - low)).collect()
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
    use super::{Cut, MOST_TRIED, Profile, VALUES, spread, steps, words};

    #[test]
    fn values_go_from_end_to_end_and_are_said_with_their_unit() {
        let tried = spread([2e-5, 8e-5]);
        assert_eq!((tried.len(), tried[0], tried[VALUES - 1]), (VALUES, 2e-5, 8e-5));
        assert!(tried.windows(2).all(|pair| pair[1] > pair[0]), "{tried:?}");
        let profile = Profile {
            name: "time_constant",
            unit: "s",
            interval: [2e-5, 8e-5],
            ..Profile::at(0, 5e-5)
        };
        let said = words(&profile, 7e-5, false);
        assert!(
            said.contains("time_constant open between 20.00 µs and 80.00 µs") && said.contains("70.00 µs is"),
            "{said}"
        );
    }

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
