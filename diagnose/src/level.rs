//! From where on a gain counts.

/// Gain in chi-square that one parameter must bring. Chi-square of one degree of freedom exceeds 16 with probability 6.3e-5:
/// for 40 independent forms and normal noise a false alarm in 0.25 % of diagnoses. At 8 it would be one in six, at 32 an effect
/// has to be 1.4 times as large to be named. No false alarm in 12 blind cases without effect (docs/results/blind-cases.md).
pub const THRESHOLD: f64 = 16.0;
/// For each further parameter. Chi-square of two exceeds 20 with 4.5e-5, of three 24 with 2.5e-5: a form with more parameters
/// gives no more false alarms than one with a single one. With 2 it would be 1.2e-4 and 1.7e-4.
const PER_PARAMETER: f64 = 4.0;
/// Two simulators of one circuit differ by about this share of the response to a cause: the plant against ngspice (0.4 % of
/// a change of capacitance, less than that elsewhere).
pub const ACCURACY: f64 = 0.005;

/// The gain that `parameters` more parameters must bring.
#[must_use]
pub fn threshold(parameters: usize, inflation: f64) -> f64 {
    (THRESHOLD + PER_PARAMETER * (parameters.max(1) - 1) as f64) * inflation
}
