//! Whether numbers were set or read off a meter.

/// Rows below which chance decides.
// the correlation below has a standard error of 1/sqrt(rows): at 40 rows its bound is 1.6 of them from either side
const FEWEST_ROWS: usize = 40;
/// Share of rows that differ from the one before. A setting stays; steps of a meter's last digit may repeat one row in five.
const CHANGED: f64 = 0.8;
/// Differences of neighbouring rows of white noise have a correlation of -1/2 from one to the next, those of ramps and slow
/// courses 0 or more: half way.
const BACK_AND_FORTH: f64 = -0.25;
/// Median difference over median value. Levels that somebody drew at random differ by as much as they are large; no meter of a
/// bench has such noise.
const LARGEST_NOISE: f64 = 0.1;

/// Whether numbers read like those of a meter: they change in nearly every row, by little, and back and forth. What was set stays at
/// a level, or moves in one direction.
///
/// ```
/// let jitter = |n: u32| f64::from(n.wrapping_mul(2_654_435_761) >> 16) / 65_536.0;
/// assert!(measured::is_metered(&(0..200).map(|n| 5.0 + 0.02 * jitter(n)).collect::<Vec<_>>()));
/// assert!(!measured::is_metered(&(0..200).map(|n| 5.0 + 0.02 * f64::from(n)).collect::<Vec<_>>()));
/// ```
#[must_use]
pub fn is_metered(values: &[f64]) -> bool {
    let values: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if values.len() < FEWEST_ROWS {
        return false;
    }
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let changed = steps.iter().filter(|step| **step != 0.0).count() as f64 / steps.len() as f64;
    let noise = median(steps.iter().map(|step| step.abs()).collect());
    let level = median(values.iter().map(|value| value.abs()).collect());
    if changed < CHANGED || noise > LARGEST_NOISE * level {
        return false;
    }
    // steps between levels are rare and large: they are cut, so that they do not hide what happens between them
    let cut: Vec<f64> = steps.iter().map(|step| step.clamp(-4.0 * noise, 4.0 * noise)).collect();
    let power: f64 = cut.iter().map(|step| step * step).sum();
    let next: f64 = cut.windows(2).map(|pair| pair[0] * pair[1]).sum();
    next < BACK_AND_FORTH * power
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
