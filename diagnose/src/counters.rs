//! How far records of few duties tell a counter of the duty.
//!
//! ```text
//! duties      .392      .511           counters of 67, of 27 and of 10 counts may move both by as much
//! ```
//! The interval around a counter holds those whose counts are next to its own. Of two duties hundreds of others make the same, and nobody knows which is
//! true: the interval goes on to the smallest and the largest of them that the held-out records allow as well.

use crate::attribute::Attribution;
use crate::causes::Cut;
use crate::drive::Model;
use crate::duty_steps::{self, Alike};
use crate::examine::{Examined, named};
use crate::findings::Verdict;
use crate::fit::Fit;
use crate::gain::Pair;
use crate::held_out::{Of, against, held};
use crate::left_open::NOISE_ALONE;
use crate::parallel;
use crate::profile::{LEVEL, Profile};
use crate::record::Record;
use crate::search::TIE;

/// Counters that are simulated from either end. A convention for time: the linear look that puts them there is right for most.
const TRIED: usize = 12;
/// Counters that are judged by held-out records where the one that was found does not hold. A convention for time.
const MOST_JUDGED: usize = 96;
/// Digits of a step in words.
const DIGITS: usize = 4;
/// Both ends of an interval this far apart, as a ratio, hold counters of several numbers of counts: the interval of one counter is a hundredth of a count.
const SEVERAL: f64 = 1.1;

impl Examined {
    /// Widens the interval of the step of a counter to all counters that explain the records as well.
    pub fn widen_counter(&mut self, heldout: &[Record], base: &Model) {
        if !matches!(self.verdict, Verdict::Explained | Verdict::Ambiguous) {
            return;
        }
        let Some((number, interval)) = self.counters_alike(heldout, base) else {
            return;
        };
        if let Some(profile) = self.profiles.get_mut(number) {
            profile.interval = interval;
            self.named = named(&self.attribution, &self.profiles);
        }
    }

    /// The place of a counter among the numbers of the best explanation, and the interval from the smallest to the largest counter that does as well.
    fn counters_alike(&self, heldout: &[Record], base: &Model) -> Option<(usize, [f64; 2])> {
        let counter = Counter::of(self)?;
        let inflation = self.attribution.inflation;
        let chi2 = |pair: &Pair| pair.total().1 * pair.problem.count() as f64;
        let of_best = counter.judged(counter.best, heldout, base);
        let is_allowed = |fit: &Fit| match (counter.judged(fit, heldout, base), &of_best) {
            (Some(pair), Some(best)) => chi2(&pair) < chi2(best) + TIE * inflation && counter.does_not_fail(fit, &pair),
            _ => true,
        };
        let does_as_well = |other: &&Alike| counter.with(other).is_some_and(|fit| is_allowed(&fit));
        let [low, high] = self.profiles.get(counter.number)?.interval;
        let steps = counter.alike();
        let mut below = steps.iter().take_while(|other| other.step < low).take(TRIED);
        let mut above = steps.iter().rev().take_while(|other| other.step > high).take(TRIED);
        let ends = [below.find(does_as_well), above.find(does_as_well)];
        // of what lies within the interval, too: a duty of half a count is at the very end of a stretch
        let within = steps.iter().filter(|other| (low..=high).contains(&other.step));
        let reached = ends.into_iter().flatten().chain(within).map(|other| other.reach);
        let hull = reached.fold([low, high], |[low, high], [from, to]| [low.min(from), high.max(to)]);
        Some((counter.number, hull))
    }

    /// Takes the counter that the held-out records are nearest to, of those that the training records do not tell from the one that was found and that
    /// does not hold; the held-out records with it.
    pub fn led_by_another_counter(&mut self, heldout: &[Record], base: &Model) -> Option<Pair> {
        let counter = Counter::of(self)?;
        let steps = counter.alike();
        let every = steps.len().div_ceil(MOST_JUDGED).max(1);
        let some: Vec<Alike> = steps.into_iter().step_by(every).collect();
        let judged = parallel::map(&some, |other| {
            let fit = counter.with(other)?;
            let pair = counter.judged(&fit, heldout, base)?;
            let holds = pair.total().1 < NOISE_ALONE && counter.does_not_fail(&fit, &pair);
            holds.then_some((fit, pair))
        });
        let holding = judged.into_iter().flatten();
        let (fit, pair) = holding.min_by(|a, b| a.1.total().1.total_cmp(&b.1.total().1))?;
        let number = counter.number;
        let [before, step] = [counter.best, &fit].map(|fit| report::quantity(fit.values[number], "", DIGITS));
        let words = format!(
            "of the counters that round the few duties of the training records alike the held-out ones tell this one, a step of {step} in the place of {before}: \
             another record has to judge it"
        );
        self.attribution.best = Some(fit);
        self.answer();
        self.odd.push(words);
        Some(pair)
    }
}

/// A counter among the causes that were found.
struct Counter<'a> {
    found: &'a Examined,
    best: &'a Fit,
    /// Its step among the numbers of the fit.
    number: usize,
    cause: usize,
    cut: Cut,
}

impl<'a> Counter<'a> {
    fn of(found: &'a Examined) -> Option<Self> {
        let attribution = &found.attribution;
        let best = attribution.best.as_ref()?;
        let places = attribution.fitter(&found.problem).places(&best.causes);
        let is_counter = |(n, place): (usize, &(usize, usize))| Some((n, place.0, cut(attribution, place.0)?));
        let (number, cause, cut) = places.iter().enumerate().find_map(is_counter)?;
        Some(Counter {
            found,
            best,
            number,
            cause,
            cut,
        })
    }

    /// The most that another may leave more than it.
    fn cost(&self) -> f64 {
        LEVEL * self.found.attribution.inflation
    }

    /// The counters that do as well at first order.
    fn alike(&self) -> Vec<Alike> {
        let (problem, attribution) = (&self.found.problem, &self.found.attribution);
        let fitter = attribution.fitter(problem);
        let others = self.best.causes.iter().filter(|cause| **cause != self.cause);
        let beside: Vec<Vec<f64>> = others
            .flat_map(|cause| fitter.sensitivity(*cause, &self.best.state))
            .collect();
        let known = (self.best.values[self.number].recip(), self.cut);
        let from = (&self.best.state, &beside[..]);
        duty_steps::alike(problem, &attribution.basis, from, known, self.cost())
    }

    /// The fit with another counter, if it leaves no more.
    fn with(&self, other: &Alike) -> Option<Fit> {
        let (problem, attribution) = (&self.found.problem, &self.found.attribution);
        let is_it = |form: &usize| attribution.same(*form, self.cause) && cut(attribution, *form) == Some(other.cut);
        let form = (0..attribution.candidates.len()).find(is_it)?;
        let put = |cause: &usize| if *cause == self.cause { form } else { *cause };
        let causes: Vec<usize> = self.best.causes.iter().map(put).collect();
        let mut values = self.best.values.clone();
        values[self.number] = other.step;
        let fitter = attribution.fitter(problem);
        let fit = fitter.holding(&causes, &values, &self.best.state, Some(self.number));
        (fit.state.chi2 < self.best.state.chi2 + self.cost()).then_some(fit)
    }

    fn judged(&self, fit: &Fit, heldout: &[Record], base: &Model) -> Option<Pair> {
        let trim = fit.state.starts.trim_or_none(base.plant.converter.f_sw);
        held(&self.found.problem, heldout, base, &fit.state, trim)
    }

    fn does_not_fail(&self, fit: &Fit, pair: &Pair) -> bool {
        let of = Of::fit(&self.found.attribution, fit);
        against(pair, &self.found.problem, &fit.state, &of).is_empty()
    }
}

/// How a counter rounds; nothing for other causes.
fn cut(attribution: &Attribution, cause: usize) -> Option<Cut> {
    attribution.candidates[cause].form.cut()
}

/// What to say of a counter that the records tell from no other.
pub fn note(attribution: &Attribution, profiles: &[Profile]) -> Option<String> {
    let best = attribution.best.as_ref()?;
    profiles.iter().find_map(|profile| {
        cut(attribution, *best.causes.get(profile.member)?)?;
        let [low, high] = profile.interval;
        (low > 0.0 && high > SEVERAL * low).then(|| {
            format!(
                "counters of {:.0} to {:.0} counts round the few duties of these records alike: which it is, records with other duties tell",
                high.recip(),
                low.recip()
            )
        })
    })
}
