//! The period of a signal without two levels, by the sinusoid that fits best.

/// Frequencies that are tried, over that of the model: beyond them no ripple of this converter is left.
const AROUND: (f64, f64) = (0.15, 6.0);
/// Share of a signal's power that its best sinusoid explains beyond noise: an F-test with a chance of 1e-8 for each of some hundred
/// frequencies.
const F_VALUE: f64 = 20.0;

/// Samples a period that tell its frequency: each of some thousand frequencies looks at all of them.
const ENOUGH: f64 = 50.0;

/// Power of a signal at a frequency, as a share of all; the mean is taken out together with the sinusoid.
fn share(time: &[f64], values: &[f64], frequency: f64) -> f64 {
    let omega = std::f64::consts::TAU * frequency;
    let columns = [
        vec![1.0; time.len()],
        time.iter().map(|t| libm::sin(omega * t)).collect(),
        time.iter().map(|t| libm::cos(omega * t)).collect(),
    ];
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let total: f64 = centred.iter().map(|v| v * v).sum();
    let explained = crate::search::gained(&columns, &centred);
    if total > 0.0 { explained / total } else { 0.0 }
}

/// A signal less the line through it: a drift is no ripple.
fn straightened(time: &[f64], values: &[f64]) -> Vec<f64> {
    let count = time.len() as f64;
    let (t, v) = (time.iter().sum::<f64>() / count, values.iter().sum::<f64>() / count);
    let (up, down) = time.iter().zip(values).fold((0.0, 0.0), |(up, down), (x, y)| {
        (up + (x - t) * (y - v), down + (x - t).powi(2))
    });
    let slope = if down > 0.0 { up / down } else { 0.0 };
    time.iter().zip(values).map(|(x, y)| y - v - slope * (x - t)).collect()
}

/// The frequency that stands out of a signal, near or far from `expected`, Hz; nothing if none does.
pub fn of(time: &[f64], values: &[f64], expected: f64) -> Option<f64> {
    let all = time.iter().zip(values).filter(|(_, v)| v.is_finite());
    let known: Vec<(f64, f64)> = all.map(|(t, v)| (*t, *v)).collect();
    let count = known.len() as f64;
    let span = known.last()?.0 - known.first()?.0;
    let stride = (count / (span * expected) / ENOUGH).floor().max(1.0) as usize;
    let (time, values): (Vec<f64>, Vec<f64>) = known.into_iter().step_by(stride).unzip();
    let values = straightened(&time, &values);
    let span = time.last()? - time.first()?;
    // at least one turn in the capture: slower is a drift
    let (low, high) = ((AROUND.0 * expected).max(0.9 / span), AROUND.1 * expected);
    // an eighth of what two frequencies must be apart to be told from each other
    let step = 0.125 / span;
    let count = ((high - low) / step).ceil().max(1.0) as usize;
    let tried = (0..=count).map(|n| low + n as f64 * step);
    let looks: Vec<(f64, f64)> = tried.map(|f| (share(&time, &values, f), f)).collect();
    let (power, near) = looks.into_iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let free = (values.len() as f64 - 3.0).max(1.0);
    if power / 2.0 / ((1.0 - power).max(1e-12) / free) < F_VALUE {
        return None;
    }
    let (mut a, mut b) = (near - step, near + step);
    for _ in 0..40 {
        let (left, right) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
        if share(&time, &values, left) < share(&time, &values, right) {
            a = left;
        } else {
            b = right;
        }
    }
    Some(0.5 * (a + b))
}

#[cfg(test)]
mod tests {
    use super::of;

    #[test]
    fn a_ripple_has_its_frequency_and_noise_has_none() {
        let time: Vec<f64> = (0..600).map(|n| f64::from(n) * 1e-7).collect();
        let noise = |n: usize| (n as f64 * 2.399).sin() + (n as f64 * 1.234).cos();
        let ripple = |f: f64| -> Vec<f64> {
            let at = time.iter().enumerate();
            at.map(|(n, t)| 12.0 + (std::f64::consts::TAU * f * t).sin() + 0.3 * noise(n))
                .collect()
        };
        for f in [99.7e3, 50e3, 201e3] {
            let found = of(&time, &ripple(f), 1e5).unwrap();
            assert!((found / f - 1.0).abs() < 0.005, "{found} {f}");
        }
        assert_eq!(of(&time, &vec![12.0; 600], 1e5), None);
    }
}
