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

/// Changes of one digit that make a flicker, and not a setting that was turned by a digit.
const FLICKERS: usize = 10;
/// Share of all changes that a flicker makes; the others are steps of the load.
const MOSTLY: f64 = 0.8;
/// Share of a flicker's changes that the next row takes back. Of noise at the edge of a digit it is half, of rarer ones more; a setting
/// stays for more than a row.
const TAKEN_BACK: f64 = 0.35;

/// Whether numbers stand still but for their last digit, which goes to the one beside and back: noise of less than a digit.
fn flickers(steps: &[f64], level: f64) -> bool {
    let digit = steps.iter().map(|step| step.abs()).filter(|step| *step > 0.0);
    let digit = digit.fold(f64::INFINITY, f64::min);
    // one digit, or two where it leaps from one side to the other
    let is_small = |step: f64| step != 0.0 && step.abs() < 2.5 * digit;
    let small = steps.iter().filter(|step| is_small(**step)).count();
    let all = steps.iter().filter(|step| **step != 0.0).count();
    let back = steps
        .windows(2)
        .filter(|pair| is_small(pair[0]) && is_small(pair[1]) && pair[0] * pair[1] < 0.0)
        .count();
    digit <= LARGEST_NOISE * level
        && small >= FLICKERS
        && small as f64 >= MOSTLY * all as f64
        && back as f64 >= TAKEN_BACK * small as f64
}

/// Whether numbers read like those of a meter: they change in nearly every row, by little, and back and forth, or stand still
/// but for a last digit that flickers. What was set stays at a level, or moves in one direction.
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
    if flickers(&steps, level) {
        return true;
    }
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
