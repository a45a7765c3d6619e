//! Whether a cause acts in another of its forms.

use super::{SWAP, Searcher, Set, top, without};
use crate::fit::Fit;
use crate::progress;

/// A form of so many numbers is held against the simpler ones of its cause: two of its numbers may be one. Those of two numbers are fitted
/// beside the simpler ones from the start, and are as cheap.
const MANY: usize = 3;
/// Other forms of a cause that are fitted in its place. A convention for time.
const FORMS: usize = 2;

impl Searcher<'_> {
    /// The set with causes in other forms of theirs, where these are clearly better: in simpler ones, for those of many numbers; in any, where
    /// structure is left.
    pub(super) fn reformed(&self, fit: Fit) -> Fit {
        let mut best = fit;
        for member in 0..best.causes.len() {
            let own = best.causes[member];
            let size = |cause: usize| self.fitter.candidates[cause].own.len();
            let leaves = self.structure(&best) > 0.0;
            let is_other = |cause: &usize| {
                *cause != own && self.same(*cause, own) && (leaves || size(own) >= MANY && size(*cause) < size(own))
            };
            let forms: Vec<usize> = (0..self.fitter.candidates.len()).filter(is_other).collect();
            if forms.is_empty() || !self.fitter.problem.work.goes_on() {
                continue;
            }
            let kept = without(&best.causes, member);
            let kept = self.fitter.from(&kept, &self.values_of(&best, &kept), self.fitter.null);
            let columns = self.sensitivities(&kept.causes, &kept.state);
            let set = Set::of(&kept, &columns);
            let looks = self.looks(&set, &forms, &kept.state);
            let stage = format!("other forms of {}", self.id(own));
            let fits = progress::map(self.say, &stage, &top(looks, FORMS), |cause| {
                self.added(&set, *cause, &kept.state)
            });
            for other in fits {
                if self.score(&other) < self.score(&best) - SWAP {
                    best = self.polished(&other);
                }
            }
        }
        best
    }
}
