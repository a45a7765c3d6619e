//! Causes that a fit took and that are none: they are taken out, and the others are fitted again.

use crate::attribute::{Attribution, SURE};
use crate::coloured;
use crate::fit::{Fit, State};
use crate::level::threshold;
use crate::noise;
use crate::problem::{Problem, dot};
use crate::profile::Profile;
use crate::search::{ALIKE, TIE, TIE_SHARE};

/// Share of the error above the noise that makes a counter the whole of it: what a limit cycle leaves beside a counter that imitates it is far more than
/// a fiftieth. A convention.
const ALL_OF_IT: f64 = 0.98;

impl Attribution {
    /// Takes out causes that are no effect: by their size, or because the interval of each parameter that makes it holds
    /// the model's own value. Their ids.
    pub fn leave_out_nothing(&mut self, problem: &Problem, profiles: &mut Vec<Profile>) -> Vec<&'static str> {
        let Some(best) = self.best.clone() else {
            return Vec::new();
        };
        let own = |member: usize| profiles.iter().filter(move |profile| profile.member == member);
        let is_nothing = |member: &usize| {
            let candidate = &self.candidates[best.causes[*member]];
            let values: Vec<f64> = own(*member).map(|profile| profile.value).collect();
            let sizes = candidate.sizes();
            candidate.is_nothing(&values) || sizes > 0 && own(*member).take(sizes).all(Profile::holds_own)
        };
        let out: Vec<usize> = (0..best.causes.len()).filter(is_nothing).collect();
        self.leave_out(problem, profiles, &out)
    }

    /// Takes out causes whose evidence is too weak for the colour of what is left, or that are a rhythm of the rows; `beside_line` if a line
    /// is there, with the model as given or in the end. Their ids. For the time before there are profiles.
    pub fn leave_out_coloured(&mut self, problem: &Problem, beside_line: bool) -> Vec<&'static str> {
        let Some(best) = self.best.clone() else {
            return Vec::new();
        };
        let scatter = coloured::scatter(problem, self);
        let sure = if beside_line { SURE } else { 1.0 };
        let is_weak = |member: &usize| {
            let parameters = self.candidates[best.causes[*member]].own.len();
            let form = self.candidates[best.causes[*member]].form;
            // to which counts a duty is rounded nobody knows where the duty itself goes to and fro; but of a counter that makes all of it the line may
            // be, where a bench steps its duty in a rhythm
            let makes_all = self.evidence[*member] > ALL_OF_IT * (self.null.chi2 - problem.count() as f64);
            let is_of_counts = beside_line && !makes_all && form.cut().is_some();
            let inflation = scatter[*member].max(sure * self.inflation);
            let chance = self.chance(problem, *member) * inflation;
            let evidence = match chance > 0.0 {
                true => self.evidence[*member].max(self.of_voltage(problem) * inflation),
                false => self.evidence[*member],
            };
            evidence < threshold(parameters, inflation) + chance
                || is_of_counts
                || coloured::is_of_rows(problem, self, *member)
        };
        let weak: Vec<usize> = (0..best.causes.len()).filter(is_weak).collect();
        let places = self.fitter(problem).places(&best.causes);
        let member = |place: &(usize, usize)| best.causes.iter().position(|cause| *cause == place.0).unwrap_or(0);
        let mut at_best: Vec<Profile> = (places.iter().zip(&best.values))
            .map(|(place, value)| Profile::at(member(place), *value))
            .collect();
        self.leave_out_weak(problem, &mut at_best, weak)
    }

    /// Twice the logarithm of the likelihood that one cause wins in the voltage, whose noise few rows tell poorly and a rounding makes look larger: that
    /// of any noise, n log(S0 / S1). 0 of several causes.
    fn of_voltage(&self, problem: &Problem) -> f64 {
        let alone = self.best.as_ref().is_some_and(|best| best.causes.len() == 1);
        let values = |state: &State| -> Vec<f64> {
            let each = (0..problem.records.len()).flat_map(|n| noise::channel(problem, &state.residual, n, 0));
            each.filter(|value| *value != 0.0).collect()
        };
        let [before, after] = [values(&self.null), values(self.state())];
        match alone && !after.is_empty() {
            true => after.len() as f64 * libm::log(dot(&before, &before) / dot(&after, &after)),
            false => 0.0,
        }
    }

    /// Chi-square that the best of all counters wins by chance, of a member that is one; 0 of others: twice the logarithm of the ways in which the duties
    /// of the records are rounded by counters up to this, as [`instants::PRICE`] is of the instants that are told apart.
    fn chance(&self, problem: &Problem, member: usize) -> f64 {
        let Some(best) = &self.best else { return 0.0 };
        let places = self.fitter(problem).places(&best.causes);
        let number = places.iter().position(|place| place.0 == best.causes[member]);
        let step = number.and_then(|number| best.values.get(number));
        match (self.candidates[best.causes[member]].form.cut(), step) {
            (Some(_), Some(step)) if *step > 0.0 => {
                let mut duties: Vec<f64> = problem.records.iter().flat_map(|r| r.duty.iter().copied()).collect();
                duties.sort_by(f64::total_cmp);
                duties.dedup();
                2.0 * libm::log((duties.iter().sum::<f64>() / step).max(1.0))
            }
            _ => 0.0,
        }
    }

    /// [`Attribution::leave_out`] of causes whose evidence is too weak, but for one that moves edges where the trim would do more than edges
    /// can in its place: the trim takes over what such a cause does, so that its evidence is small, and is none all the same.
    pub fn leave_out_weak(
        &mut self,
        problem: &Problem,
        profiles: &mut Vec<Profile>,
        mut weak: Vec<usize>,
    ) -> Vec<&'static str> {
        let mut without = self.clone();
        let mut left = profiles.clone();
        let out = without.leave_out(problem, &mut left, &weak);
        if without.asks_for_edges() && !self.asks_for_edges() {
            let causes = self.best.as_ref().map_or(&[][..], |best| &best.causes);
            weak.retain(|member| !self.candidates[causes[*member]].is_of_edges());
            return self.leave_out(problem, profiles, &weak);
        }
        *self = without;
        *profiles = left;
        out
    }

    /// Whether the edges of the gate do more than edges can where the best explanation ends.
    fn asks_for_edges(&self) -> bool {
        let state = self.state();
        let f_sw = state.model.plant.converter.f_sw;
        state.starts.trim_of_nobody(f_sw).is_some()
    }

    /// Takes causes out, by their places, and fits the others again. Their ids.
    pub fn leave_out(&mut self, problem: &Problem, profiles: &mut Vec<Profile>, out: &[usize]) -> Vec<&'static str> {
        let Some(best) = self.best.clone().filter(|_| !out.is_empty()) else {
            return Vec::new();
        };
        let own = |member: usize| profiles.iter().filter(move |profile| profile.member == member);
        let kept: Vec<usize> = (0..best.causes.len()).filter(|member| !out.contains(member)).collect();
        let causes: Vec<usize> = kept.iter().map(|member| best.causes[*member]).collect();
        let values: Vec<f64> = kept.iter().flat_map(|m| own(*m).map(|profile| profile.value)).collect();
        let fit = (!causes.is_empty()).then(|| self.fitter(problem).from(&causes, &values, &self.null));
        let fit = fit.map(|fit| self.as_alone(fit));
        self.evidence = kept.iter().map(|member| self.evidence[*member]).collect();
        let gone: Vec<usize> = out.iter().map(|member| best.causes[*member]).collect();
        let rivals = |member: &usize| self.rivals_without(problem, &self.rivals[*member], fit.as_ref(), &gone);
        self.rivals = kept.iter().map(rivals).collect();
        profiles.retain(|profile| kept.contains(&profile.member));
        for profile in profiles {
            // always found: `retain` has left only members that are kept
            profile.member = kept.iter().position(|m| *m == profile.member).unwrap_or(0);
        }
        self.best = fit;
        out.iter().map(|member| self.id(best.causes[*member])).collect()
    }

    /// A fit of one cause as that ended alone, where it ended better: beside others it may have gone to where it does not come back from. Of causes that do
    /// the same the first in the list.
    fn as_alone(&self, fit: Fit) -> Fit {
        let [cause] = fit.causes[..] else { return fit };
        let alone = |single: &&Fit| single.causes == [cause] && single.state.chi2 < fit.state.chi2;
        let Some(single) = self.singles.iter().find(alone) else {
            return fit;
        };
        let is_same = |other: &&Fit| (other.state.chi2 - single.state.chi2).abs() < ALIKE;
        self.singles.iter().find(is_same).unwrap_or(single).clone()
    }

    /// What may stand in the place of a cause that is kept, without causes that are `gone`: beside them it did as well as `best` did, and does it no more
    /// than that without.
    fn rivals_without(&self, problem: &Problem, rivals: &[Fit], best: Option<&Fit>, gone: &[usize]) -> Vec<Fit> {
        let Some(best) = best else { return Vec::new() };
        let fitter = self.fitter(problem);
        let explained = self.null.chi2 - best.state.chi2;
        let tie = (TIE * self.inflation).max(TIE_SHARE * explained);
        let mut list: Vec<Fit> = Vec::new();
        for rival in rivals {
            let is_kept = |cause: &usize| !gone.contains(cause);
            if rival.causes.iter().all(is_kept) {
                list.push(rival.clone());
                continue;
            }
            let causes: Vec<usize> = rival.causes.iter().copied().filter(is_kept).collect();
            let places = fitter.places(&rival.causes);
            let own = places.iter().zip(&rival.values).filter(|(place, _)| is_kept(&place.0));
            let values: Vec<f64> = own.map(|(_, value)| *value).collect();
            let is_known = |known: &Fit| known.causes == causes || best.causes == causes;
            if causes.is_empty() || list.iter().any(is_known) {
                continue;
            }
            let fit = fitter.from(&causes, &values, &self.null);
            if fit.state.chi2 <= best.state.chi2 + tie {
                list.push(fit);
            }
        }
        if let [own] = best.causes[..] {
            self.add_singles(&mut list, (own, best), tie);
        }
        list
    }

    /// Adds to what may stand in the place of `own`, which alone is left, the other causes that do as well alone.
    fn add_singles(&self, list: &mut Vec<Fit>, (own, best): (usize, &Fit), tie: f64) {
        let number = |cause: usize| self.candidates[cause].number;
        let f_sw = best.state.model.plant.converter.f_sw;
        let asks = |fit: &Fit| fit.state.starts.trim_of_nobody(f_sw).is_some();
        let mut singles: Vec<&Fit> = (self.singles.iter())
            .filter(|single| single.state.chi2 <= best.state.chi2 + tie && (asks(best) || !asks(single)))
            .collect();
        singles.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
        for single in singles {
            let [cause] = single.causes[..] else { continue };
            let is_known = |known: &Fit| known.causes.len() == 1 && number(known.causes[0]) == number(cause);
            if number(cause) != number(own) && !list.iter().any(is_known) {
                list.push(single.clone());
            }
        }
    }
}
