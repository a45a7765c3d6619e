//! Whether a cause acts in another of its forms.

use super::{SWAP, Searcher, Set, top, without};
use crate::causes::Knob;
use crate::fit::Fit;
use crate::progress;

/// A form of so many numbers is held against the simpler ones of its cause: two of its numbers may be one. Those of two numbers are fitted
/// beside the simpler ones from the start, and are as cheap.
const MANY: usize = 3;
/// Other forms of a cause that are fitted in its place. A convention for time.
const FORMS: usize = 2;
/// Steepness that a curve begins with, over that of the model. A convention: from twice of it a fit of the tests comes along the valley.
const OF_A_BEND: [f64; 2] = [0.5, 2.0];

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
            let from_here = forms.iter().flat_map(|form| self.bent_further(&best, member, *form));
            for other in fits.into_iter().chain(from_here.collect::<Vec<_>>()) {
                if self.score(&other) < self.score(&best) - SWAP {
                    best = self.polished(&other);
                }
            }
        }
        best
    }

    /// The set with the curve of a part in a form that has all its numbers and more, from the curve that it is now, but steeper and flatter: where three numbers make one curve a fit creeps along a bent valley, and ends before it is there.
    fn bent_further(&self, best: &Fit, member: usize, form: usize) -> Vec<Fit> {
        let own = best.causes[member];
        let (now, further) = (&self.fitter.candidates[own], &self.fitter.candidates[form]);
        let is_the_same = |(one, other): (&Knob, &Knob)| one.keys == other.keys;
        let mut knobs = now.form.knobs.iter().zip(further.form.knobs);
        if !now.is_curve() || further.own.len() <= now.own.len() || !knobs.all(is_the_same) {
            return Vec::new();
        }
        let kept = without(&best.causes, member);
        let from = |share: f64| {
            let more = further.own[now.own.len()..].iter().map(|value| share * value);
            let bent = [self.values_of(best, &[own]), more.collect()].concat();
            let values = [self.values_of(best, &kept), bent].concat();
            self.fitter
                .from(&[kept.clone(), vec![form]].concat(), &values, &best.state)
        };
        OF_A_BEND.map(from).into()
    }
}
