//! Held-out records as judges of what training records say.

use crate::doubts::Doubt;
use crate::drive::Model;
use crate::examine::{Examined, named};
use crate::findings::Verdict;
use crate::fit::{Fit, State};
use crate::gain::Pair;
use crate::held_out::{Of, against, grown, held, points};
use crate::left_open::{self, Chosen};
use crate::level::threshold;
use crate::profile::profiles;
use crate::record::Record;
use crate::rivals;
use crate::search::TIE;
use crate::shape::structures;

/// Evidence over its threshold up to which a cause beside others may be chance, if held-out records say so. Among some two hundred forms and starts of
/// causes one of two parameters gains 24 by chance in one record of a thousand, where the threshold is 20; twice that never. A convention.
const BY_CHANCE: f64 = 2.0;

impl Examined {
    /// Whether the causes, or the model as given, explain the training records, and nothing but the held-out ones speaks against them.
    pub fn fits_training_alone(&self) -> bool {
        let is_held_out = |doubt: &Doubt| matches!(doubt, Doubt::HeldOut(..));
        self.structure.is_empty() && !self.doubts.is_empty() && self.doubts.iter().all(is_held_out)
    }

    /// Lets the held-out records judge; causes that do not hold in them explain nothing any more.
    pub fn judged(&mut self, heldout: &[Record], base: &Model) -> Option<Pair> {
        let found = self.attribution.state();
        let trim = found.starts.trim_or_none(base.plant.converter.f_sw);
        let pair = held(&self.problem, heldout, base, found, trim)?;
        let pair = self.without_chance(heldout, base, &pair).unwrap_or(pair);
        let found = self.attribution.state();
        let fails: Vec<Doubt> = match self.verdict {
            Verdict::Consistent => points(&pair)
                .chain(grown(&pair, "with the edges that the training records ask for"))
                .collect(),
            // what is no more than the step of a converter has no values that could fail to hold
            Verdict::Explained | Verdict::Ambiguous if !self.named.is_empty() => {
                let best = self.attribution.best.as_ref();
                let of = best.map(|best| Of::fit(&self.attribution, best));
                against(&pair, &self.problem, found, &of.unwrap_or_default())
            }
            _ => Vec::new(),
        };
        if fails.is_empty() {
            let is_shifted = self.verdict == Verdict::Ambiguous && !pair.shifts(&self.problem, found).is_empty();
            let other = is_shifted.then(|| self.led_by_what_holds(heldout, base, Some(&pair)));
            return Some(other.flatten().unwrap_or(pair));
        }
        if let Some(pair) = self.led_by_what_holds(heldout, base, None) {
            return Some(pair);
        }
        let explained = (&self.attribution, &self.profiles[..]);
        if let Some(chosen) = left_open::chosen(&self.problem, explained, heldout, base) {
            return Some(self.with_values(chosen));
        }
        let counted = self.counted_otherwise(heldout, base);
        if let Some(pair) = counted.or_else(|| self.led_by_another_counter(heldout, base)) {
            return Some(pair);
        }
        self.verdict = Verdict::Unexplained;
        self.doubts.extend(fails);
        // a record whose rows are late is explained by a delay, which no other record has
        let readings = std::mem::take(&mut self.readings);
        self.odd.retain(|words| !readings.contains(words));
        self.doubts.extend(readings.into_iter().map(Doubt::Bench));
        Some(pair)
    }

    /// Leaves out the weakest of several causes where the held-out records are nearer to the model without it: of all causes in all their forms one
    /// always gains something by chance, and the records in which it was sought cannot tell.
    fn without_chance(&mut self, heldout: &[Record], base: &Model, with: &Pair) -> Option<Pair> {
        let (best, evidence) = (self.attribution.best.as_ref()?, &self.attribution.evidence);
        let explains = matches!(self.verdict, Verdict::Explained | Verdict::Ambiguous);
        if !explains || best.causes.len() < 2 {
            return None;
        }
        let (weakest, gain) = evidence.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        let parameters = self.attribution.candidates[best.causes[weakest]].own.len();
        if *gain > BY_CHANCE * threshold(parameters, self.attribution.inflation) {
            return None;
        }
        let (mut attribution, mut profiles) = (self.attribution.clone(), self.profiles.clone());
        let id = attribution.leave_out(&self.problem, &mut profiles, &[weakest]).pop()?;
        let state = attribution.state();
        if !structures(&self.problem, &attribution.null, state, attribution.inflation).is_empty() {
            return None;
        }
        let trim = state.starts.trim_or_none(base.plant.converter.f_sw);
        let without = held(&self.problem, heldout, base, state, trim)?;
        let chi2 = |pair: &Pair| pair.total().1 * pair.problem.count() as f64;
        if chi2(&without) > chi2(with) - TIE * attribution.inflation {
            return None;
        }
        self.attribution = attribution;
        self.answer();
        self.odd.push(format!(
            "{id} would fit the training records a little better, and the held-out ones worse: not named, since one of all causes gains as much by chance"
        ));
        Some(without)
    }

    /// Lets a member of the tie lead that holds in the held-out records, the one that fits them best, if there is one; they with it. The data that
    /// the causes were sought in do not put the members in order, so that the one that does not hold stays in the tie. Where the leader leaves no more
    /// than what a sensor would that has `shifted`, the other one has to do clearly better, without such a sensor.
    fn led_by_what_holds(&mut self, heldout: &[Record], base: &Model, shifted: Option<&Pair>) -> Option<Pair> {
        let attribution = &self.attribution;
        let chi2 = |pair: &Pair| pair.total().1 * pair.problem.count() as f64;
        let is_clear = |pair: &Pair, state: &State, rival: &Fit| {
            shifted.is_none_or(|own| {
                let least = BY_CHANCE * threshold(rival.values.len(), attribution.inflation);
                chi2(pair) < chi2(own) - least && pair.shifts(&self.problem, state).is_empty()
            })
        };
        let holding = |(member, other, rival): (usize, usize, &Fit)| {
            let state = &rival.state;
            let leaves = structures(&self.problem, &attribution.null, state, attribution.inflation);
            let trim = state.starts.trim_or_none(base.plant.converter.f_sw);
            let pair = held(&self.problem, heldout, base, state, trim)?;
            let holds =
                leaves.is_empty() && against(&pair, &self.problem, state, &Of::fit(attribution, rival)).is_empty();
            (holds && is_clear(&pair, state, rival)).then(|| (member, other, rival.clone(), pair))
        };
        let held = rivals::in_one_place(attribution).filter_map(holding);
        let (member, other, leader, pair) = held.min_by(|a, b| a.3.total().1.total_cmp(&b.3.total().1))?;
        let [before, after] = [attribution.best.as_ref()?.causes[member], other].map(|cause| attribution.id(cause));
        let words = format!(
            "{before} and {after} explain the training records as well as each other, and in the held-out ones {after} holds and {before} does \
             not: another record has to judge it"
        );
        self.attribution.lead(leader, false);
        self.answer();
        self.odd.push(words);
        Some(pair)
    }

    /// Lets a counter of the duty explain the records alone, cut off where it was rounded or the other way round, where what was found has one, does not
    /// hold and is hardly better: over a few levels of the duty one counter in one form does nearly what another does in the other, and what is
    /// left of the difference brings a cause with it.
    fn counted_otherwise(&mut self, heldout: &[Record], base: &Model) -> Option<Pair> {
        let (problem, attribution) = (&self.problem, &self.attribution);
        let best = attribution.best.as_ref()?;
        let is_counter = |cause: usize| attribution.candidates[cause].form.cut().is_some();
        let own = best.causes.iter().copied().find(|cause| is_counter(*cause))?;
        let most = best.state.chi2 + BY_CHANCE * threshold(best.values.len(), attribution.inflation);
        let others = attribution.singles.iter().filter(|fit| {
            let of_a_counter = is_counter(fit.causes[0]) && attribution.same(fit.causes[0], own);
            of_a_counter && fit.causes != best.causes && fit.state.chi2 < most
        });
        let fitter = attribution.fitter(problem);
        let holding = |single: &Fit| {
            let fit = fitter.from(&single.causes, &single.values, &single.state);
            let mut trial = attribution.clone();
            trial.evidence = vec![trial.null.chi2 - fit.state.chi2];
            (trial.rivals, trial.best) = (vec![Vec::new()], Some(fit));
            if !structures(problem, &trial.null, trial.state(), trial.inflation).is_empty() {
                return None;
            }
            let profiles = profiles(problem, &mut trial, &|_| ());
            let chosen = left_open::chosen(problem, (&trial, &profiles), heldout, base)?;
            Some((trial, chosen))
        };
        let found = others.filter_map(holding);
        let (attribution, chosen) = found.min_by(|a, b| a.1.pair.total().1.total_cmp(&b.1.pair.total().1))?;
        self.attribution = attribution;
        self.answer();
        Some(self.with_values(chosen))
    }

    /// Takes other values, which hold in the held-out records; those.
    fn with_values(&mut self, chosen: Chosen) -> Pair {
        for (profile, value) in self.profiles.iter_mut().zip(&chosen.fit.values) {
            profile.value = *value;
            let [low, high] = profile.interval;
            profile.interval = [low.min(*value), high.max(*value)];
        }
        self.attribution.best = Some(chosen.fit);
        self.named = named(&self.attribution, &self.profiles);
        self.odd.push(chosen.words);
        chosen.pair
    }
}
