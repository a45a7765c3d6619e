//! Networks that a look has not ruled out, and whose cost nobody has to know yet.
//!
//! ```text
//!  look ─┬─► ruled out
//!        ├─► every trial: the best so far, which may end the training
//!        └─► a limit is exceeded, the cost may be the best ─► waits ─► many wait, or the end: the lowest bound first ─► the best
//! ```
//!
//! While a training learns fast nearly every look finds a better network, and all trials of each cost more than the looks that find
//! none. Most of them are beaten by one that waits beside them, or is found later: only the best of those is run through all trials, and
//! most of the others through one or two.
//!
//! Invariant: the network that is kept is the one of the lowest cost, of equal ones the earliest, as if none had waited; and a
//! training ends at the same control period, since one that may meet the specification does not wait.

use crate::faults::Error;
use crate::network::Network;
use crate::trainer::{Best, Trainer};
use crate::trials::Seen;
use closed_loop::environment::Environment;

/// Networks that may wait.
// whoever waits longer meets a better best one, which one trial tells from it; neighbours take many. With 32, 64, 128, 256 and 512 the
// looks of examples/train/paper12.toml with seed 0 took 827, 722, 539, 396 and 608 thousand control periods; with 128, 256, 512 and
// 1,024 those of wide-delay.toml with seed 1 took 3,602, 2,900, 2,687 and 2,739. Many more, and the best one that is known lags for seconds
const MOST: usize = 256;
/// Parameters of all of them, unless they are [`LEAST`].
// a checkpoint holds them, and one is written every few seconds: 8 MB, as the replay takes
const MOST_PARAMETERS: usize = 2_000_000;
const LEAST: usize = 32;

/// A network that waits.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Waiting {
    /// Control periods after which it was found.
    pub step: u64,
    /// Of the two of its look the second.
    pub second: bool,
    /// What its cost is at least.
    pub bound: f64,
    /// What the cost of the others of its look is at least, if they do not wait.
    pub beside: f64,
    pub network: Network,
}

impl<E: Environment> Trainer<E> {
    /// Judges the networks of this control period; what their costs are at least.
    pub(crate) fn consider(&mut self, networks: &[Network]) -> Result<f64, Error> {
        let mut told = std::mem::take(&mut self.told);
        let (mut least, mut beside) = (f64::INFINITY, f64::INFINITY);
        let first = self.waiting.len();
        for (n, network) in networks.iter().enumerate() {
            // the first of all is the bar of the others
            let bar = self.best.as_ref().map_or(f64::INFINITY, |best| best.score.cost);
            let mut judging = self.judging(network)?;
            // one trial at a time: while it waits a better one may be found, against which fewer trials do
            let count = if bar.is_finite() { 1 } else { usize::MAX };
            let seen = loop {
                let seen = judging.advance(bar, count, &mut told)?;
                // what may end the training does not wait
                let may_end = self.settings.early_stop && judging.bound.met;
                if seen != Seen::Some || !may_end {
                    break seen;
                }
            };
            let score = judging.bound;
            drop(judging);
            least = least.min(score.cost);
            let (step, second, network) = (self.step, n > 0, || network.clone());
            if seen == Seen::Some {
                self.waiting.push(Waiting {
                    step,
                    second,
                    bound: score.cost,
                    beside: f64::INFINITY,
                    network: network(),
                });
                continue;
            }
            beside = beside.min(score.cost);
            if seen == Seen::All {
                self.best = Some(Best {
                    step,
                    second,
                    score,
                    network: network(),
                });
            }
        }
        self.waiting[first..].iter_mut().for_each(|one| one.beside = beside);
        self.told = told;
        Ok(least)
    }

    /// Behind a look: whether it ends the training, and whether too many wait.
    pub(crate) fn conclude(&mut self) -> Result<(), Error> {
        let meets = |own: &Self| {
            let best = own.best.as_ref();
            best.is_some_and(|best| own.settings.early_stop && best.score.met && best.step == own.step)
        };
        // one that waits may cost less although it misses a limit by a little
        let parameters = self.learner.online.parameters.len().max(1);
        let most = (MOST_PARAMETERS / parameters).clamp(LEAST, MOST);
        if meets(self) || self.waiting.len() >= most {
            self.settle()?;
        }
        self.met = meets(self);
        Ok(())
    }

    /// Nobody waits any longer: the best of those who did and of the one that is known is known. The one that promises most goes on,
    /// until it has been through all trials or another one promises more.
    pub(crate) fn settle(&mut self) -> Result<(), Error> {
        let mut waiting = std::mem::take(&mut self.waiting);
        let mut told = std::mem::take(&mut self.told);
        let mut best = self.best.take();
        {
            // of those who have begun: most of the others never do
            let mut looks = Vec::new();
            looks.resize_with(waiting.len(), || None);
            let mut is_open = vec![true; waiting.len()];
            loop {
                let open = waiting.iter().enumerate().filter(|(n, _)| is_open[*n]);
                // of equal ones the earliest
                let Some((n, one)) = open.min_by(|(_, a), (_, b)| a.bound.total_cmp(&b.bound)) else {
                    break;
                };
                let bar = one.bar(best.as_ref());
                if one.bound >= bar {
                    (is_open[n], looks[n]) = (false, None);
                    continue;
                }
                let look = match &mut looks[n] {
                    Some(look) => look,
                    none => none.insert(self.judging(&one.network)?),
                };
                let seen = look.advance(bar, 1, &mut told)?;
                let score = look.bound;
                is_open[n] = seen == Seen::Some;
                if !is_open[n] {
                    looks[n] = None;
                }
                // not less than before: the first trials may be others than those that it was put off after
                waiting[n].bound = score.cost.max(waiting[n].bound);
                if seen == Seen::All {
                    let Waiting { step, second, .. } = waiting[n];
                    best = Some(Best {
                        step,
                        second,
                        score,
                        network: waiting[n].network.clone(),
                    });
                }
            }
        }
        (self.best, self.told) = (best, told);
        for row in &mut self.curve {
            let of_row = waiting.iter().filter(|one| one.step == row.step);
            let least = of_row.map(|one| one.bound.min(one.beside)).reduce(f64::min);
            row.cost = least.unwrap_or(row.cost);
        }
        Ok(())
    }
}

impl Waiting {
    /// What its cost has to stay below.
    fn bar(&self, best: Option<&Best>) -> f64 {
        match best {
            None => f64::INFINITY,
            // of two that cost the same the earlier one is kept
            Some(best) if (self.step, self.second) < (best.step, best.second) => best.score.cost.next_up(),
            Some(best) => best.score.cost,
        }
    }
}
