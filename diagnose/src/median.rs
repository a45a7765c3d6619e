//! The middle of some numbers, which a wrong one among them does not move.

/// The median of what is finite; NaN if nothing is.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The same, and between the two in the middle where their number is even: of two estimates neither is the better one.
#[must_use]
pub fn middle(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    match sorted.len() % 2 {
        0 if half > 0 => 0.5 * (sorted[half - 1] + sorted[half]),
        _ => sorted.get(half).copied().unwrap_or(f64::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::{median, middle};

    #[test]
    fn the_middle_of_an_even_number_lies_between_two() {
        assert_eq!((middle([3.0, 1.0]), middle([5.0, 1.0, 2.0, 4.0])), (2.0, 3.0));
        assert_eq!((middle([9.0, f64::NAN, 1.0, 2.0]), middle([7.0])), (2.0, 7.0));
        assert!(middle([f64::NAN]).is_nan());
        assert_eq!(median([3.0, 1.0]), 3.0);
    }
}
