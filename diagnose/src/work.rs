//! How much a diagnosis may compute. Counted and not timed, so that a slow machine finds what a fast one finds; looked at between pieces of
//! work only, so that threads do not change what is found.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::drive::Model;
use crate::record::Record;

/// Rows of a plain converter that a diagnosis simulates before it begins nothing more.
// a ceramic of another law than the plant's is found behind 24 million and before 30 (tests/ceramic.rs). A core does .6 to 1.5 million in a second
// (hopeless records of 400 and 600 rows), so that the longest search is more than the 25 s that a user should wait
const ROWS: u64 = 30_000_000;
/// What a row costs with a load cable, in rows without.
// 3.3 M rows a second with an ESR, .7 M behind it a cable of 50 kHz, .3 M one of 160 kHz (docs/results/plant.md)
const CABLE: u64 = 10;
/// And behind an input filter.
// a convention between a row without and one behind a cable: the same matrix, and often fewer steps of it
const FILTER: u64 = 5;
/// And with a constant power that lags, which takes the general integrator.
const LAG: u64 = 2;
/// Steps of the integrator that take as long as a row of a plain converter.
// a quarter of a microsecond each, on the core that does a million rows
const STEPS: f64 = 4.0;
/// Most steps in a period of a circuit that is looked at.
// 600 rows of it take .1 s. A bend of the inductor or of the capacitor beside a cable asks for them, since no matrix stands for the steps
// there: a fit went to one of 2 nH and .5 ohm, and stayed for four minutes at 4,000 steps
const MOST_STEPS: f64 = 600.0;
/// And in units of those of the model as given.
// a convention: a time constant fitted to a quarter of the given one
const DEARER: f64 = 4.0;

/// Most causes that a search may name. Records of one converter hold 5 to 15 independent directions; blind cases hide at most two effects, and the
/// third place is for one that a second imitates in part.
const MOST: usize = 3;
/// And where a part of the records is set aside: a third cause beside a disturbance was never there, and is half of the time of such a search.
const MOST_BESIDE: usize = 2;

/// What all searches of a diagnosis have computed together, and how many causes this one may name.
#[derive(Debug, Clone)]
pub struct Work(Arc<Counts>, usize);

impl Default for Work {
    fn default() -> Self {
        Work(Arc::default(), MOST)
    }
}

#[derive(Debug, Default)]
struct Counts {
    rows: AtomicU64,
    was_cut: AtomicBool,
}

impl Work {
    /// The same budget for a search in a part of the records.
    pub(crate) fn of_part(&self) -> Self {
        Work(Arc::clone(&self.0), MOST_BESIDE)
    }

    /// Most causes.
    pub(crate) fn most_causes(&self) -> usize {
        self.1
    }

    /// A record has been simulated, over so many periods.
    pub(crate) fn add(&self, model: &Model, record: &Record, periods: u64) {
        let p = &model.plant;
        let is_lagged = p.load.cpl_time_constant > 0.0 && record.load.iter().any(|load| load.power != 0.0);
        let of_plant = match (p.cable.inductance > 0.0, p.source.c_in > 0.0) {
            (true, _) => CABLE,
            (false, true) => FILTER,
            (false, false) if is_lagged => LAG,
            (false, false) => 1,
        };
        let of_steps = (plant::steps_per_period(p) / STEPS) as u64;
        self.count(periods.saturating_mul(of_plant.max(of_steps)));
    }

    /// Whether a fit may look at a model: a corner of what its parameters may be can take longer than all the rest. A model that was given
    /// as dear as that may become a few times dearer.
    pub(crate) fn may_simulate(model: &Model, base: &Model) -> bool {
        let given = plant::steps_per_period(&base.plant);
        plant::steps_per_period(&model.plant) <= MOST_STEPS.max(DEARER * given)
    }

    fn count(&self, rows: u64) {
        self.0.rows.fetch_add(rows, Ordering::Relaxed);
    }

    /// Whether another piece of work may begin; one that may not is remembered.
    pub(crate) fn goes_on(&self) -> bool {
        let goes_on = self.0.rows.load(Ordering::Relaxed) < ROWS;
        if !goes_on {
            self.0.was_cut.store(true, Ordering::Relaxed);
        }
        goes_on
    }

    /// Whether half of it is left, for what is tried where two searches have failed; what may not begin is remembered.
    pub(crate) fn half_is_left(&self) -> bool {
        let is_left = 2 * self.0.rows.load(Ordering::Relaxed) < ROWS;
        if !is_left {
            self.0.was_cut.store(true, Ordering::Relaxed);
        }
        is_left
    }

    /// What is said where something was not begun.
    #[must_use]
    pub(crate) fn said(&self) -> Option<String> {
        self.0.was_cut.load(Ordering::Relaxed).then(|| {
            format!(
                "the search kept to its budget of {} million simulated rows, and what it had found by then is shown: larger sets of causes, and \
                 records without one channel, were not all tried",
                ROWS / 1_000_000
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{ROWS, Work};

    #[test]
    fn work_ends_at_its_budget_for_all_who_share_it_and_only_what_was_not_begun_is_said() {
        let work = Work::default();
        let shared = work.clone();
        shared.count(ROWS - 1);
        assert!(work.goes_on());
        shared.count(1);
        // nobody has asked for more
        assert_eq!(work.said(), None);
        assert!(!work.half_is_left());
        assert!(!work.goes_on());
        assert!(shared.said().is_some_and(|said| said.contains("30 million")));
    }
}
