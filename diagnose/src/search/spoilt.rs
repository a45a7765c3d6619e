//! A single cause that explains all channels but one.
//!
//! What an instrument of no list does to its channel bends the causes that are fitted to all, and a search that goes on then fits sets of three to it. So
//! does a second cause that acts on one channel alone: from where the first fits the others, it is what is left.

use super::{Known, LOOKED_AT, Searcher, Set};
use crate::aside::may_miss;
use crate::attribute::SURE;
use crate::fit::{Fit, Fitter, State};
use crate::level::threshold;
use crate::noise;
use crate::parallel;
use crate::problem::{Problem, dot};
use crate::record::{CHANNEL_NAMES, CHANNELS};
use crate::shape::{Structure, structures};

/// Single causes that are fitted without a channel: so many of those that lead with it, and of those that lead in the others. A convention: each costs a
/// fit.
const LEADERS: usize = 3;

/// The records with a channel that is not compared, and the single causes that lead there.
pub(crate) struct WithoutChannel {
    channel: usize,
    /// The records.
    pub problem: Problem,
    /// The model as given.
    pub null: State,
    /// The causes.
    pub fits: Vec<Fit>,
}

impl WithoutChannel {
    /// Fits the leaders among `singles` without channel `n`, and each cause of the set that is `best`; `to_the_end`, or the first steps, which rank.
    pub fn of(fitter: &Fitter<'_>, singles: &[Fit], best: Option<&Fit>, (n, to_the_end): (usize, bool)) -> Self {
        let mut problem = fitter.problem.clone();
        for masked in &mut problem.masked {
            masked[n].fill(true);
        }
        let null = State::settle(&problem, &fitter.null.model, &fitter.null.starts, None);
        let basis = problem.basis(&null.model, &null.starts, &null.residual);
        let own = Fitter {
            problem: &problem,
            basis: &basis,
            null: &null,
            ..*fitter
        };
        let mut begun: Vec<(usize, Vec<f64>)> = (leaders(&problem, singles, n).into_iter())
            .map(|fit| (fit.causes[0], fit.values.clone()))
            .collect();
        // where singles were not fitted again beside free instants, they say nothing of what leads there
        for (cause, values) in best.map_or(Vec::new(), |best| members(&own, best)) {
            if begun.iter().all(|(known, _)| *known != cause) {
                begun.push((cause, values));
            }
        }
        let mut fits = parallel::map(&begun, |(cause, values)| match to_the_end {
            true => own.from(&[*cause], values, &null),
            false => own.first_steps(&[*cause], values, &null),
        });
        fits.extend(counters(&own));
        WithoutChannel {
            channel: n,
            problem,
            null,
            fits,
        }
    }

    /// The causes that leave nothing in the other channels, and explain much there.
    fn explain(&self) -> impl Iterator<Item = &Fit> {
        self.fits.iter().filter(|fit| {
            let inflation = noise::inflation(&self.problem, &fit.state.residual);
            let gain = self.null.chi2 - fit.state.chi2;
            let is_elsewhere = |one: &Structure| one.channel != CHANNEL_NAMES[self.channel];
            gain > SURE * threshold(fit.values.len(), inflation)
                && !structures(&self.problem, &self.null, &fit.state, inflation)
                    .iter()
                    .any(is_elsewhere)
        })
    }
}

/// Counters of the duty, sought anew: no fit goes from one number of counts to another.
fn counters(fitter: &Fitter<'_>) -> Vec<Fit> {
    let search = Searcher {
        fitter: Fitter { ..*fitter },
        say: &|_| (),
        known: Known::default(),
    };
    let all = 0..fitter.candidates.len();
    all.filter(|cause| fitter.candidates[*cause].form.cut().is_some())
        .map(|cause| search.added(&Set::NONE, cause, fitter.null))
        .collect()
}

/// The causes of a set with their values.
fn members(fitter: &Fitter<'_>, set: &Fit) -> Vec<(usize, Vec<f64>)> {
    let places = fitter.places(&set.causes);
    let of = |cause: &usize| {
        let own = places.iter().zip(&set.values).filter(|(place, _)| place.0 == *cause);
        (*cause, own.map(|(_, value)| *value).collect())
    };
    set.causes.iter().map(of).collect()
}

/// The causes that leave least, in all channels and in those but `n`.
fn leaders<'f>(problem: &Problem, singles: &'f [Fit], n: usize) -> Vec<&'f Fit> {
    let elsewhere = |fit: &Fit| -> f64 {
        let cells = (0..problem.records.len()).flat_map(|record| (0..CHANNELS).map(move |channel| (record, channel)));
        let others = cells.filter(|(_, channel)| *channel != n);
        others
            .map(|(record, channel)| noise::channel(problem, &fit.state.residual, record, channel))
            .map(|values| dot(&values, &values))
            .sum()
    };
    let first = |of: &dyn Fn(&Fit) -> f64| {
        let mut order: Vec<(usize, f64)> = singles.iter().map(of).enumerate().collect();
        order.sort_by(|a, b| a.1.total_cmp(&b.1));
        order
            .into_iter()
            .take(LEADERS)
            .map(|(place, _)| place)
            .collect::<Vec<_>>()
    };
    let mut places = first(&|fit| fit.state.chi2);
    for place in first(&elsewhere) {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places.into_iter().map(|place| &singles[place]).collect()
}

impl Searcher<'_> {
    /// Sets of two from single causes that explain all channels but one of those in which `best` leaves something; nothing where no cause does.
    pub(super) fn beside_a_channel(&self, best: &Fit, singles: &[Fit]) -> Option<Vec<Fit>> {
        let all_but = self.but_for_a_channel(best, singles);
        let sets = all_but.iter().flat_map(|fit| {
            let stage = format!("{} and another in one channel", self.names(fit));
            self.forward(fit, LOOKED_AT, &stage)
        });
        (!all_but.is_empty()).then(|| sets.collect())
    }

    fn but_for_a_channel(&self, best: &Fit, singles: &[Fit]) -> Vec<Fit> {
        let problem = self.fitter.problem;
        if !problem.work.goes_on() {
            return Vec::new();
        }
        let left = structures(problem, self.fitter.null, &best.state, 1.0);
        let is_left = |n: &usize| left.iter().any(|one| one.channel == CHANNEL_NAMES[*n]);
        let channels = (0..CHANNELS).filter(|n| is_left(n) && may_miss(problem, *n));
        let found = channels.flat_map(|n| {
            let without = WithoutChannel::of(&self.fitter, singles, None, (n, true));
            let least = without.explain().min_by(|a, b| self.score(a).total_cmp(&self.score(b)));
            least.map(|fit| Fit {
                state: State::at(problem, &fit.state.model, fit.state.starts.clone()),
                ..fit.clone()
            })
        });
        found.collect()
    }
}
