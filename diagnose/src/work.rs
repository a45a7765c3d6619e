//! How much a diagnosis may compute. Counted and not timed, so that a slow machine finds what a fast one finds; looked at between pieces of
//! work only, so that threads do not change what is found.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::drive::{Model, PACE, Ran};

/// Rows of a plain converter, and what takes as long, that a diagnosis simulates before it begins nothing more, where the causes found so far
/// come near. A core does a million in a second.
// a ceramic of another law than the plant's is found behind 20 million and before 30 (tests/ceramic.rs)
const ROWS: u64 = 30_000_000;
/// And while they leave most of the error: what forty causes, two at a time, have not come near to by then, no third comes near to.
// with it all 40 single causes of a blind set are found, as with 30 million; with the two looks below most hopeless diagnoses end within the 25 s that a
// user should wait
const ROWS_FAR_OFF: u64 = 12_000_000;
/// ... but so many simulations of all records, up to the rows above: of 1,400 rows the causes alone took 12 million, and no pair was begun, of which
/// a capacitor of another capacitance and resistance is one. Of 600 rows, as in blind sets, it is the number above.
const SIMULATIONS_FAR_OFF: u64 = 20_000;
/// And where a part of the records is set aside.
const ROWS_OF_PART: u64 = 20_000_000;
/// A search in a part may compute as much as this whatever was computed before: where one channel is disturbed, the causes bend to it and come near,
/// and are none.
const LEAST_OF_PART: u64 = 7_000_000;
/// Rows within which a whole search without a part has to begin and to have looked at every cause alone once more.
// of 1,440 rows, three periods each, it took 32 million behind 59, in vain; at 45 million a diode beside a channel set aside is missed, at 55 it is found
const ROWS_OF_ALL: u64 = 55_000_000;
/// Rows that a look at all causes at first order may take which only tells whether a search is worth it: as many as a search in a part takes.
// beside a cable of 17 nH and a load that lags it took 25 million, and the search 10 (buck-boost, 400 rows of a square law)
const ROWS_OF_LOOK: u64 = 10_000_000;
/// Share of them from which on the rest is reckoned: some causes are dearer than others.
const OF_LOOK: f64 = 0.25;
/// Rows in which it is sought what may stand in the place of the causes; where they do not suffice a tie may be left.
// twelve rivals of a node's capacitance beside a cable and a counter took 173 s of a core (boost, 464 rows in another order), and came near nothing. A
// convention: half of what a search may take whose causes come near
const ROWS_OF_RIVALS: u64 = 15_000_000;
/// Rows within which intervals are still sought by fits.
// of input filters that swing above half of the rows' rate the search takes 33 and 37 million (800 rows twice), and covariances made their intervals up to
// four times too narrow
const ROWS_WITH_INTERVALS: u64 = 40_000_000;
/// Rows in which terms of an empirical correction are sought; the one that is begun is brought to its end.
// a term takes 2 million in records of a thousand rows, and there are at most seven
const ROWS_OF_TERMS: u64 = 20_000_000;
/// And in which they are sought with all before them, but for a first few: what took the whole budget in vain took 27 s of a core with five terms behind it.
const ROWS_WITH_TERMS: u64 = 34_000_000;
const LEAST_OF_TERMS: u64 = 4_000_000;
/// Steps of the integrator that take as long as a row of a plain converter.
// a quarter of a microsecond each, on the core that does a million rows
const STEPS: u64 = 4;
/// Rows that one fit may take before it stays where it is, and in simulations of the model as given: the budget is looked at between fits.
// a fit of 3 numbers ends within 60 simulations, each of which takes a thousand rows for a record of 300, and ten times as long where an inductor
// saturates; what takes 2 s of a core is in a corner of what is tried
const ROWS_OF_FIT: u64 = 2_000_000;
const SIMULATIONS_OF_FIT: u64 = 2_000;
/// Most steps in a period of a circuit that is looked at.
// 600 rows of it take .1 s. A bend of the inductor or of the capacitor beside a cable asks for them, since no matrix stands for the steps
// there: a fit went to one of 2 nH and .5 ohm, and stayed for four minutes at 4,000 steps
const MOST_STEPS: f64 = 600.0;
/// And in units of those of the model as given.
// a convention: a time constant fitted to a quarter of the given one
const DEARER: f64 = 4.0;

/// Causes come near that leave this share of the error above the noise, in squares: a tenth of its size.
const NEAR: f64 = 0.01;

/// Most causes that a search may name. Records of one converter hold 5 to 15 independent directions; blind cases hide at most two effects, and the
/// third place is for one that a second imitates in part.
const MOST: usize = 3;
/// And where a part of the records is set aside: a third cause beside a disturbance was never there, and is half of the time of such a search.
const MOST_BESIDE: usize = 2;

/// What all searches of a diagnosis have computed together, and what this one may.
#[derive(Debug, Clone)]
pub struct Work {
    all: Arc<Counts>,
    /// Whether the causes that this search has found come near.
    is_near: Arc<AtomicBool>,
    /// Whether something that may stand in the place of its causes was not tried.
    lacks_rivals: Arc<AtomicBool>,
    /// Rows while they do not, and where they do.
    far_off: u64,
    near: u64,
    most_causes: usize,
}

impl Default for Work {
    fn default() -> Self {
        Work {
            all: Arc::default(),
            is_near: Arc::default(),
            lacks_rivals: Arc::default(),
            far_off: ROWS_FAR_OFF,
            near: ROWS,
            most_causes: MOST,
        }
    }
}

#[derive(Debug, Default)]
struct Counts {
    rows: AtomicU64,
    /// What all causes alone took, the first time.
    singles: AtomicU64,
    /// The limit at which something was not begun; 0 if everything was.
    cut_at: AtomicU64,
}

impl Work {
    /// This for records of so many rows together.
    pub(crate) fn over(&self, rows: usize) -> Self {
        let all = SIMULATIONS_FAR_OFF.saturating_mul(rows as u64);
        Work {
            far_off: self.far_off.max(all.min(self.near)),
            ..self.clone()
        }
    }

    /// The same budget for a search in a part of the records.
    pub(crate) fn of_part(&self) -> Self {
        let least = self.rows().saturating_add(LEAST_OF_PART);
        Work {
            all: Arc::clone(&self.all),
            is_near: Arc::default(),
            lacks_rivals: Arc::default(),
            far_off: ROWS_OF_PART.max(least),
            near: ROWS.max(least),
            most_causes: MOST_BESIDE,
        }
    }

    /// Most causes.
    pub(crate) fn most_causes(&self) -> usize {
        self.most_causes
    }

    /// The causes that this search has found leave this share of the error above the noise, in squares.
    pub(crate) fn leaves(&self, share: f64) {
        self.is_near.store(share < NEAR, Ordering::Relaxed);
    }

    /// A record has been simulated; what that took, in rows.
    pub(crate) fn add(&self, ran: Ran) -> u64 {
        let rows = ran.periods.saturating_add(ran.steps / STEPS);
        self.count(rows);
        rows
    }

    /// Whether a fit may look at a model: a corner of what its parameters may be can take longer than all the rest. A model that was given
    /// as dear as that may become a few times dearer.
    pub(crate) fn may_simulate(model: &Model, base: &Model) -> bool {
        let given = plant::steps_per_period(&base.plant, PACE);
        plant::steps_per_period(&model.plant, PACE) <= MOST_STEPS.max(DEARER * given)
    }

    /// Whether a fit has taken all that it may, of records that take `given` rows as the model was given.
    pub(crate) fn is_fit_over(rows: u64, given: u64) -> bool {
        rows > ROWS_OF_FIT.max(given.saturating_mul(SIMULATIONS_OF_FIT))
    }

    /// Whether another rival may be tried, where the first was begun at so many rows; one that may not is remembered.
    pub(crate) fn may_seek_rivals(&self, begun_at: u64) -> bool {
        let may = self.rows() < begun_at.saturating_add(ROWS_OF_RIVALS);
        if !may {
            self.lacks_rivals.store(true, Ordering::Relaxed);
        }
        may
    }

    /// Whether some rival was not tried.
    pub(crate) fn lacks_rivals(&self) -> bool {
        self.lacks_rivals.load(Ordering::Relaxed)
    }

    /// Whether a look at all causes goes on that has taken so many rows for this share of them.
    pub(crate) fn is_look_worth_it(taken: u64, share: f64) -> bool {
        taken as f64 <= ROWS_OF_LOOK as f64 * share.max(OF_LOOK)
    }

    fn count(&self, rows: u64) {
        self.all.rows.fetch_add(rows, Ordering::Relaxed);
    }

    /// Whether another piece of work may begin; one that may not is remembered.
    pub(crate) fn goes_on(&self) -> bool {
        match self.is_near.load(Ordering::Relaxed) {
            true => self.is_below(self.near),
            false => self.is_below(self.far_off),
        }
    }

    /// Every cause has been looked at alone, which began at so many rows.
    pub(crate) fn singles_are_done(&self, begun_at: u64) {
        let took = self.rows().saturating_sub(begun_at);
        // a later search is in a part
        let _ = (self.all.singles).compare_exchange(0, took, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Rows so far.
    pub(crate) fn rows(&self) -> u64 {
        self.all.rows.load(Ordering::Relaxed)
    }

    /// Whether all causes may be looked at once more; what may not is remembered.
    pub(crate) fn may_begin_again(&self) -> bool {
        self.is_below(ROWS_OF_ALL.saturating_sub(self.all.singles.load(Ordering::Relaxed)))
    }

    /// Whether another term may be sought, where the first began at so many rows.
    pub(crate) fn may_add_a_term(&self, begun_at: u64) -> bool {
        let most = ROWS_WITH_TERMS.max(begun_at.saturating_add(LEAST_OF_TERMS));
        self.rows() < most.min(begun_at.saturating_add(ROWS_OF_TERMS))
    }

    /// Whether half of it is left, for what is tried where two searches have failed; what may not begin is remembered.
    pub(crate) fn half_is_left(&self) -> bool {
        self.is_below(ROWS / 2)
    }

    /// Whether intervals may be sought by fits: they are read off the covariance where not.
    pub(crate) fn may_seek_intervals(&self) -> bool {
        self.is_below(ROWS_WITH_INTERVALS)
    }

    fn is_below(&self, limit: u64) -> bool {
        let is_below = self.rows() < limit;
        if !is_below {
            self.all.cut_at.fetch_max(limit, Ordering::Relaxed);
        }
        is_below
    }

    /// What is said where something was not begun.
    #[must_use]
    pub(crate) fn said(&self) -> Option<String> {
        let limit = self.all.cut_at.load(Ordering::Relaxed);
        (limit > 0).then(|| {
            format!(
                "the search kept to its budget of {} million simulated rows, and what it had found by then is shown: larger sets of causes, \
                 records without one channel, and intervals that are no parabolas, were not all tried",
                limit / 1_000_000
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{ROWS, ROWS_FAR_OFF, ROWS_OF_RIVALS, Work};

    #[test]
    fn work_ends_at_its_budget_for_all_who_share_it_and_only_what_was_not_begun_is_said() {
        let work = Work::default();
        let shared = work.clone();
        work.leaves(0.001);
        shared.count(ROWS - 1);
        assert!(work.goes_on());
        shared.count(1);
        // nobody has asked for more
        assert_eq!(work.said(), None);
        assert!(!work.half_is_left());
        assert!(!work.goes_on());
        assert!(shared.said().is_some_and(|said| said.contains("30 million")));
    }

    #[test]
    fn a_search_that_is_far_off_ends_early_and_leaves_something_for_the_records_without_a_channel() {
        let work = Work::default();
        work.leaves(0.3);
        work.count(ROWS_FAR_OFF);
        assert!(!work.goes_on());
        assert!(work.said().is_some_and(|said| said.contains("12 million")));
        let part = work.of_part();
        assert!(part.goes_on() && part.half_is_left());
        part.count(ROWS - ROWS_FAR_OFF);
        assert!(!part.goes_on());
        let another = work.of_part();
        another.leaves(0.0);
        assert!(another.goes_on() && !another.half_is_left());
    }

    #[test]
    fn rivals_that_were_not_tried_are_remembered_by_the_search_that_wanted_them() {
        let work = Work::default();
        work.count(ROWS);
        let begun_at = work.rows();
        assert!(work.may_seek_rivals(begun_at) && !work.lacks_rivals());
        work.count(ROWS_OF_RIVALS);
        let part = work.of_part();
        assert!(!work.may_seek_rivals(begun_at) && work.lacks_rivals());
        // another search has rivals of its own
        assert!(part.may_seek_rivals(part.rows()) && !part.lacks_rivals());
    }
}
