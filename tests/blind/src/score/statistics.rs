//! Intervals of a share, and medians.

/// Exact 95 % interval of a share (Clopper and Pearson 1934); 0 to 1 where nothing was counted.
#[must_use]
pub fn interval(hits: usize, of: usize) -> (f64, f64) {
    let (hits, of) = (hits.min(of), of);
    let low = match hits {
        0 => 0.0,
        // P(X >= hits) = 2.5 %
        _ => root(|p| 1.0 - at_most(hits - 1, of, p) - 0.025),
    };
    let high = match hits == of {
        true => 1.0,
        false => root(|p| 0.025 - at_most(hits, of, p)),
    };
    (low, high)
}

/// P(X <= hits) of a binomial.
fn at_most(hits: usize, of: usize, p: f64) -> f64 {
    if p <= 0.0 || p >= 1.0 {
        return if p <= 0.0 || hits >= of { 1.0 } else { 0.0 };
    }
    let mut log_term = of as f64 * libm::log1p(-p);
    let odds = libm::log(p) - libm::log1p(-p);
    let mut sum = libm::exp(log_term);
    for k in 0..hits {
        log_term += odds + libm::log((of - k) as f64 / (k + 1) as f64);
        sum += libm::exp(log_term);
    }
    sum.min(1.0)
}

/// Where a rising function of a share crosses 0.
fn root(rising: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match rising(middle) < 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// The middle value, of two the mean; NaN of none.
#[must_use]
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of R's binom.test.
    #[test]
    fn intervals_are_those_of_clopper_and_pearson() {
        for (hits, of, low, high) in [
            (0, 12, 0.0, 0.264_648),
            (5, 10, 0.187_086, 0.812_914),
            (12, 12, 0.735_352, 1.0),
        ] {
            let found = interval(hits, of);
            assert!(
                (found.0 - low).abs() < 1e-5 && (found.1 - high).abs() < 1e-5,
                "{found:?}"
            );
        }
        assert_eq!(interval(0, 0), (0.0, 1.0));
    }

    #[test]
    fn median_of_even_and_odd_counts() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0]), 2.5);
        assert!(median(&[]).is_nan());
    }
}
