//! A first-order lag over a step in which its input is known at the start, the middle and the end, exactly for a parabola through
//! the three.
//!
//! `y' = (u - y) / tau` gives `y(h) = e^-a y(0) + integral_0^1 a e^(-a (1 - s)) u(s) ds`, `a = h / tau`. With
//! `m_k = integral_0^1 a e^(-a (1 - s)) s^k ds` and the parabola through `u(0)`, `u(1/2)`, `u(1)` the integral is a sum of the three
//! with weights that depend on `a` alone.
//!
//! A sensor does not act back on the circuit. So its time constant need not shorten the steps of the circuit, as it would in a
//! Runge-Kutta method: ten microseconds beside a filter of half a millisecond cost four fifths of all steps.

use crate::signals::Signals;

/// What a step makes of the lag's state and of its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lag {
    keep: f64,
    weights: [f64; 3],
}

/// Below it the recursion of the moments cancels (an error of 1e-16 over the square of `a`), and a series takes its place.
const SHORT: f64 = 0.02;

impl Lag {
    /// Over a step of `h` seconds with the time constant `tau` in seconds, above 0.
    pub fn over(h: f64, tau: f64) -> Self {
        let a = h / tau;
        // of the libm crate, which is Rust: the same bits on every machine
        let keep = libm::exp(-a);
        let [m0, m1, m2] = match a < SHORT {
            true => [series(a, 0), series(a, 1), series(a, 2)],
            false => {
                let m0 = 1.0 - keep;
                let m1 = 1.0 - m0 / a;
                [m0, m1, 1.0 - 2.0 * m1 / a]
            }
        };
        Lag {
            keep,
            weights: [m0 - 3.0 * m1 + 2.0 * m2, 4.0 * (m1 - m2), 2.0 * m2 - m1],
        }
    }

    /// The state behind the step.
    #[inline]
    pub fn step(&self, y: f64, input: [f64; 3]) -> f64 {
        let [first, middle, last] = self.weights;
        self.keep * y + (first * input[0] + middle * input[1] + last * input[2])
    }
}

/// The low-passes of four sensors over a step of `h` seconds; none where the time constant is 0.
pub(crate) fn of_sensors(h: f64, tau: &[f64; 4]) -> [Option<Lag>; 4] {
    tau.map(|tau| (tau > 0.0).then(|| Lag::over(h, tau)))
}

/// Lets what four sensors show follow what is true at the start, in the middle and at the end of a step.
pub(crate) fn follow(shown: &mut [f64], lags: &[Option<Lag>; 4], signals: [&Signals; 3]) {
    let [first, middle, last] = signals.map(|s| [s.v_out, s.i_l, s.i_out, s.v_in]);
    for (n, (shown, lag)) in shown.iter_mut().zip(lags).enumerate() {
        if let Some(lag) = lag {
            *shown = lag.step(*shown, [first[n], middle[n], last[n]]);
        }
    }
}

/// `m_k = a/(k+1) - a^2/((k+1)(k+2)) + ...`; six terms leave 1e-13 of the first at [`SHORT`].
fn series(a: f64, k: u32) -> f64 {
    let mut term = 1.0;
    let mut sum = 0.0;
    for n in 1..=6 {
        term *= a / f64::from(k + n);
        sum += if n % 2 == 1 { term } else { -term };
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lag's equation has a closed solution for a line and a parabola.
    #[test]
    fn a_parabola_is_followed_exactly() {
        let (u0, b, c, y0) = (3.0, -2.0, 5.0, 0.7);
        for a in [1e-9, 1e-4, 0.019, 0.021, 0.3, 2.0, 50.0, 1e6] {
            let u = |s: f64| u0 + b * s + c * s * s;
            // y = A + B s + C s^2 + (y0 - A) e^(-a s), compared coefficient by coefficient with y' = a (u - y)
            let found = Lag::over(a * 1e-5, 1e-5).step(y0, [u(0.0), u(0.5), u(1.0)]);
            let exact = match a < 1e-3 {
                // the closed form cancels there; the first two terms of the change
                true => y0 + a * ((u0 + b / 2.0 + c / 3.0) - y0) - a * a * ((u0 / 2.0 + b / 6.0 + c / 12.0) - y0 / 2.0),
                false => {
                    let second = b - 2.0 * c / a;
                    let first = u0 - second / a;
                    first + second + c + (y0 - first) * f64::exp(-a)
                }
            };
            assert!((found - exact).abs() < 1e-11, "{a}: {found} {exact}");
        }
    }

    #[test]
    fn the_series_and_the_recursion_meet() {
        let (below, above) = (Lag::over(SHORT * (1.0 - 1e-12), 1.0), Lag::over(SHORT, 1.0));
        for (x, y) in below.weights.iter().zip(above.weights) {
            assert!((x - y).abs() < 1e-12, "{x} {y}");
        }
    }
}
