//! Explanations that share no cause with the leading one and fit as well.

use crate::attribute::Attribution;
use crate::doubts;
use crate::fit::{Fit, Fitter};
use crate::parallel;
use crate::problem::{Problem, axpy, dot};
use crate::progress::{self, Listener};
use crate::search::{self, gained};
use crate::shape::structures;

/// As for rivals of one cause: chi-square within three standard deviations of one parameter, times the scatter, or this share of
/// what is explained. The share is fifty times that for rivals of one cause, since nothing of the leading pair is kept. A convention in
/// its size.
const TIE: f64 = 9.0;
const TIE_SHARE: f64 = 0.005;
/// And never more than this share of what the lesser of the two causes explains. A convention: half of its size.
const OF_LEAST: f64 = 0.25;
/// A pair is fitted if at first order it explains this share of what the best pair explains. A
/// convention that trades time for ties that first order does not show.
const LOOKS_AS_GOOD: f64 = 0.97;
/// Pairs that are fitted at most, of settled points and of records. Settled points are quick to simulate, and ties are the rule among
/// them. Conventions for time.
const MOST_SETTLED: usize = 80;
const MOST: usize = 8;

/// A parameter is one that the explanation needs if to put it back to the model's own value costs this many ties: with less, a part of a
/// tie is all that another cause would have to gain, which each of them does.
const NEEDED: f64 = 4.0;
/// Causes that are fitted in the place of one parameter, and how far from a tie they may look at first order, in ties. Both as for rivals of one
/// cause: conventions for time, and for what first order does not show.
const MOST_IN_PART: usize = 4;
const NEAR: f64 = 5.0;

/// Causes that lead a pair in the place of one, and causes that are fitted beside each. Conventions for time.
const LEADERS: usize = 3;
const SECONDS: usize = 3;

/// What may stand in the place of one parameter of a cause that has several, with other values of the rest: for each the member of the
/// leading explanation and the fit, with that parameter at the model's own value.
///
/// Resistance of the switch and of the diode together are a resistance of the winding and of one of them. Neither cause as a whole has
/// a rival then, and the winding would never be named.
#[must_use]
pub fn in_part(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<(usize, Fit)> {
    let Some(best) = attribution.best.as_ref() else {
        return Vec::new();
    };
    // what initial states explain is taken where the fits end: from the model as given they would creep, since its drops are not there
    let basis = problem.basis(&best.state.model, &best.state.starts, &best.state.residual);
    let fitter = Fitter {
        basis: &basis,
        ..attribution.fitter(problem)
    };
    let places = fitter.places(&best.causes);
    let columns_of = |cause: &usize| fitter.sensitivity(*cause, &best.state);
    let columns: Vec<Vec<f64>> = best.causes.iter().flat_map(columns_of).collect();
    // counts and whole periods have no columns
    if columns.len() != places.len() {
        return Vec::new();
    }
    let is_other = |cause: &usize| {
        let candidate = &attribution.candidates[*cause];
        // nor what is in proportion: a number that can be put back has no ratio to others
        let own = candidate.form.begins_at_own() && !candidate.is_in_proportion();
        own && best.causes.iter().all(|known| !attribution.same(*known, *cause))
    };
    let others: Vec<usize> = (0..attribution.candidates.len()).filter(is_other).collect();
    let other_columns = parallel::map(&others, columns_of);
    // the share is of what that parameter alone explains, not of all that its cause does: a diode's drop may be worth a hundred times
    // its resistance
    let tie = |cost: f64| (TIE * attribution.inflation).max(search::TIE_SHARE * cost);
    let mut looks = Vec::new();
    for (number, place) in places.iter().enumerate() {
        let candidate = &attribution.candidates[place.0];
        let off = candidate.own[place.1] - best.values[number];
        let member = best.causes.iter().position(|cause| *cause == place.0).unwrap_or(0);
        // chi-square of putting it back, all else following, at first order
        let variance = best.covariance[number][number].max(0.0);
        let is_needed = off * off > NEEDED * TIE * attribution.inflation * variance;
        let tie = tie(off * off / variance);
        // whatever else the load draws is a part of every resistor's error
        let is_resistor = candidate.form.knobs[place.1].is_resistor();
        if candidate.own.len() < 2 || !candidate.form.begins_at_own() || !is_needed || variance == 0.0 || is_resistor {
            continue;
        }
        let mut left = best.state.residual.clone();
        axpy(&mut left, -off / fitter.range(*place)[2], &columns[number]);
        let kept: Vec<Vec<f64>> = (0..columns.len())
            .filter(|n| *n != number)
            .map(|n| columns[n].clone())
            .collect();
        for (other, own) in others.iter().zip(&other_columns) {
            let lost = dot(&left, &left) - gained(&[&kept[..], &own[..]].concat(), &left) - best.state.chi2;
            if lost < NEAR * tie {
                looks.push((lost, number, member, *other, tie));
            }
        }
    }
    looks.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.3).cmp(&(b.1, b.3))));
    looks.truncate(MOST_IN_PART);
    let fits = progress::map(say, "parts of causes", &looks, |(_, number, member, other, tie)| {
        let causes = [&best.causes[..], &[*other]].concat();
        let mut values = best.values.clone();
        let place = places[*number];
        values[*number] = attribution.candidates[place.0].own[place.1];
        values.extend(&attribution.candidates[*other].own);
        let fit = fitter.holding(&causes, &values, &best.state, Some(*number));
        (fit.state.chi2 <= best.state.chi2 + tie).then_some((*member, fit))
    });
    fits.into_iter().flatten().collect()
}

/// Pairs that may stand in the place of one cause of several numbers, and need no more of them; the best first.
///
/// An input capacitor shapes what the resistance of its source does, and does as well what a winding and a little error of the inductance do
/// together. Each pair begins with a cause that explains much alone.
#[must_use]
pub fn pairs_for_one(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<Fit> {
    let is_shaped = |best: &&Fit| best.causes.len() == 1 && best.values.len() > 1;
    let Some(best) = attribution.best.as_ref().filter(is_shaped) else {
        return Vec::new();
    };
    let explained = attribution.null.chi2 - best.state.chi2;
    let tie = (TIE * attribution.inflation).max(search::TIE_SHARE * explained);
    let is_tied = |fit: &Fit| fit.state.chi2 <= best.state.chi2 + tie;
    let is_open = |fit: &&Fit| {
        let is_other = fit.causes.iter().all(|cause| !attribution.same(*cause, best.causes[0]));
        // what does as well alone is a rival already; by its share of what is explained it may be near and still leave structure
        let is_rival = attribution
            .rivals
            .iter()
            .flatten()
            .any(|rival| rival.causes == fit.causes);
        is_other && fit.values.len() < best.values.len() && !is_rival
    };
    let mut leaders: Vec<&Fit> = attribution.singles.iter().filter(is_open).collect();
    leaders.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    leaders.truncate(LEADERS);
    let mut looks = Vec::new();
    for leader in leaders {
        let basis = problem.basis(&leader.state.model, &leader.state.starts, &leader.state.residual);
        let fitter = Fitter {
            basis: &basis,
            ..attribution.fitter(problem)
        };
        let is_second = |cause: &usize| {
            let numbers = attribution.candidates[*cause].own.len() + leader.values.len();
            let is_own = |known: &usize| attribution.same(*known, *cause);
            let (form, others) = (attribution.candidates[*cause].form, [leader.causes[0], best.causes[0]]);
            numbers <= best.values.len() && form.begins_at_own() && !others.iter().any(is_own)
        };
        let seconds: Vec<usize> = (0..attribution.candidates.len()).filter(is_second).collect();
        let own = fitter.sensitivity(leader.causes[0], &leader.state);
        let gains = parallel::map(&seconds, |cause| {
            let columns = [own.clone(), fitter.sensitivity(*cause, &leader.state)].concat();
            gained(&columns, &leader.state.residual)
        });
        let mut own: Vec<(f64, &Fit, usize)> = gains
            .into_iter()
            .zip(&seconds)
            .map(|(gain, cause)| (leader.state.chi2 - gain, leader, *cause))
            .filter(|(chi2, ..)| *chi2 <= best.state.chi2 + NEAR * tie)
            .collect();
        own.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        looks.extend(own.into_iter().take(SECONDS));
    }
    let fitter = attribution.fitter(problem);
    let mut fits = progress::map(say, "pairs of causes for one", &looks, |(_, leader, second)| {
        let values = [&leader.values[..], &attribution.candidates[*second].own].concat();
        fitter.from(&[leader.causes[0], *second], &values, &leader.state)
    });
    let is_at_bound = |fit: &Fit| {
        let split = attribution.candidates[fit.causes[0]].own.len().min(fit.values.len());
        let (first, second) = fit.values.split_at(split);
        let ends = [(fit.causes[0], first), (fit.causes[1], second)];
        ends.iter()
            .any(|(cause, values)| doubts::is_at_bound(&attribution.candidates[*cause], values))
    };
    let leaves = |fit: &Fit| structures(problem, &attribution.null, &fit.state, attribution.inflation);
    fits.retain(|fit| is_tied(fit) && !is_at_bound(fit) && leaves(fit).is_empty());
    fits.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    fits
}

/// Pairs of causes beside a leading pair with which they have nothing in common; the best first.
#[must_use]
pub fn other_pairs(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<Fit> {
    // rivals of each cause by itself are found in the search; pairs that share nothing with the leader are not
    let Some(best) = attribution.best.as_ref().filter(|best| best.causes.len() == 2) else {
        return Vec::new();
    };
    let fitter = attribution.fitter(problem);
    let is_own = |cause: usize| best.causes.iter().any(|own| attribution.same(*own, cause));
    let all: Vec<usize> = (0..attribution.candidates.len()).collect();
    let columns = parallel::map(&all, |cause| fitter.sensitivity(*cause, &attribution.null));
    // at first order, because some 800 pairs cannot all be fitted
    let gain_of = |a: usize, b: usize| gained(&[&columns[a][..], &columns[b][..]].concat(), &attribution.null.residual);
    let reached = gain_of(best.causes[0], best.causes[1]);
    let others: Vec<usize> = all
        .into_iter()
        .filter(|cause| !is_own(*cause) && !columns[*cause].is_empty())
        .collect();
    let mut looks = Vec::new();
    for (n, a) in others.iter().enumerate() {
        for b in &others[n + 1..] {
            let gain = gain_of(*a, *b);
            if !attribution.same(*a, *b) && gain >= LOOKS_AS_GOOD * reached {
                looks.push((gain, [*a, *b]));
            }
        }
    }
    // equal gains in the order of the list, so that the same records give the same ties
    looks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let settled = problem.records.iter().all(|record| record.settled);
    looks.truncate(if settled { MOST_SETTLED } else { MOST });
    let explained = attribution.null.chi2 - best.state.chi2;
    // the share is of what is explained: what two simulators differ by grows with the effect. What leaves a good part of one of the two is no
    // tie all the same
    let least = attribution.evidence.iter().copied().fold(f64::INFINITY, f64::min);
    let share = (TIE_SHARE * explained).min(OF_LEAST * least);
    let worst = best.state.chi2 + (TIE * attribution.inflation).max(share);
    let mut fits = progress::map(say, "other pairs of causes", &looks, |(_, pair)| {
        let values: Vec<f64> = pair
            .iter()
            .flat_map(|cause| attribution.candidates[*cause].own.clone())
            .collect();
        fitter.from(pair, &values, &attribution.null)
    });
    fits.retain(|fit| fit.state.chi2 <= worst);
    fits.sort_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    fits
}
