//! Two causes at once, from where the model stands: of a pair each may show next to nothing alone, and a third that imitates both leads.

use super::Searcher;
use crate::fit::Fit;
use crate::normal::solve;
use crate::parallel;
use crate::problem::dot;
use crate::progress;
use crate::small;

/// Pairs whose fit is begun, and those of them that are brought to an end. Conventions: a first order that is off by a few places is right
/// among as many, and all together cost about as much as one look at the causes that have several starts.
const BEGUN_TOGETHER: usize = 8;
const ENDED_TOGETHER: usize = 3;

/// The tangents of a candidate at the model as given.
struct Direction {
    cause: usize,
    columns: Vec<Vec<f64>>,
}

impl Searcher<'_> {
    /// The pairs of causes that promise most at first order, all of them compared, and fitted from the model's own values.
    pub(crate) fn pairs(&self) -> &[Fit] {
        self.known.pairs.get_or_init(|| self.fitted_pairs())
    }

    /// Whether one of these pairs leaves nothing but noise.
    pub(crate) fn has_a_pair(&self) -> bool {
        self.pairs().iter().any(|fit| self.structure(fit) == 0.0)
    }

    fn fitted_pairs(&self) -> Vec<Fit> {
        let null = self.fitter.null;
        // they were begun and brought to an end behind the budget in hopeless records
        if !self.fitter.problem.work.goes_on() {
            return Vec::new();
        }
        let smooth: Vec<usize> = (0..self.fitter.candidates.len())
            .filter(|cause| {
                let candidate = &self.fitter.candidates[*cause];
                self.begins_at_own(*cause) && candidate.form.is_smooth() && !candidate.is_in_proportion()
            })
            .collect();
        let directions = parallel::map(&smooth, |cause| Direction {
            cause: *cause,
            columns: self.fitter.sensitivity(*cause, null),
        });
        let promising = self.promising(&directions);
        let own = |cause: usize| self.fitter.candidates[cause].own.clone();
        let stage = "two causes at once";
        let mut begun = progress::map(self.say, stage, &promising, |[one, other]| {
            self.fitter
                .first_steps(&[*one, *other], &[own(*one), own(*other)].concat(), null)
        });
        self.sort(&mut begun);
        begun.truncate(ENDED_TOGETHER);
        progress::map(self.say, stage, &begun, |fit| {
            self.fitter.from(&fit.causes, &fit.values, &fit.state)
        })
    }

    /// The pairs that gain most for their parameters, one of each two causes whatever their forms.
    fn promising(&self, directions: &[Direction]) -> Vec<[usize; 2]> {
        let null = self.fitter.null;
        let most = small::most_parameters(self.fitter.problem);
        let price = libm::log(self.fitter.problem.count() as f64);
        let gram = Gram::of(directions, &null.residual);
        let mut looks = Vec::new();
        for (n, one) in directions.iter().enumerate() {
            for (m, other) in directions.iter().enumerate().skip(n + 1) {
                let parameters = one.columns.len() + other.columns.len();
                if self.same(one.cause, other.cause) || parameters > most {
                    continue;
                }
                let gain = gram.gained(n, m) - price * parameters as f64;
                looks.push((gain, [one.cause, other.cause]));
            }
        }
        looks.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut seen = Vec::new();
        looks.retain(|(_, pair)| {
            let numbers = pair.map(|cause| self.number(cause));
            let new = !seen.contains(&numbers);
            seen.push(numbers);
            new
        });
        looks.into_iter().take(BEGUN_TOGETHER).map(|(_, pair)| pair).collect()
    }
}

/// Products of all columns with each other and with the residual.
struct Gram {
    /// Where the columns of each direction begin, and how many there are.
    places: Vec<(usize, usize)>,
    matrix: Vec<Vec<f64>>,
    right: Vec<f64>,
}

impl Gram {
    fn of(directions: &[Direction], residual: &[f64]) -> Self {
        let columns: Vec<&Vec<f64>> = directions.iter().flat_map(|direction| &direction.columns).collect();
        let mut first = 0;
        let places = directions.iter().map(|direction| {
            let place = (first, direction.columns.len());
            first += place.1;
            place
        });
        Gram {
            places: places.collect(),
            matrix: parallel::map(&columns, |a| columns.iter().map(|b| dot(a, b)).collect()),
            right: columns.iter().map(|column| dot(column, residual)).collect(),
        }
    }

    /// What two directions explain together, as `gained` of their columns.
    fn gained(&self, one: usize, other: usize) -> f64 {
        let of = |(first, count): (usize, usize)| first..first + count;
        let all: Vec<usize> = of(self.places[one]).chain(of(self.places[other])).collect();
        let right: Vec<f64> = all.iter().map(|n| self.right[*n]).collect();
        let entry = |n: usize, m: usize| self.matrix[n][m] * if n == m { 1.0 + 1e-9 } else { 1.0 };
        let matrix: Vec<Vec<f64>> = (all.iter())
            .map(|n| all.iter().map(|m| entry(*n, *m)).collect())
            .collect();
        dot(&solve(&matrix, &right), &right)
    }
}

#[cfg(test)]
mod tests {
    use super::{Direction, Gram};
    use crate::search::gained;

    #[test]
    fn two_directions_gain_what_their_columns_gain_together() {
        let direction = |cause, columns: &[[f64; 4]]| Direction {
            cause,
            columns: columns.iter().map(|column| column.to_vec()).collect(),
        };
        let residual = [1.0, -2.0, 0.5, 3.0];
        let (one, other) = ([1.0, 1.0, 0.0, 0.0], [[0.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.2, 1.0]]);
        let gram = Gram::of(&[direction(7, &[one]), direction(8, &other)], &residual);
        let columns = [one.to_vec(), other[0].to_vec(), other[1].to_vec()];
        assert!((gram.gained(0, 1) - gained(&columns, &residual)).abs() < 1e-9);
    }
}
