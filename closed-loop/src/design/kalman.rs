//! The steady Kalman filter of the observer's model.

use plant::Parameters;
use toml_input::Message;

use crate::faults::Error;

type Matrix = [[f64; 3]; 3];

/// A period of the model, linear in current, voltage and bias around a duty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// T/L, A/V.
    pub by_inductance: f64,
    /// T/C, V/A.
    pub by_capacitance: f64,
    /// Share of the inductor's current that the output receives, and of its voltage that stands against the current.
    pub give: f64,
}

/// Standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// What the model may be wrong by in a period: current in A, voltage in V, bias in V.
    pub process: [f64; 3],
    /// Of the measured output voltage, V.
    pub measured: f64,
}

impl Noise {
    /// What was found good for the converters of Cui et al. (2 mH, 200 V, 10 kHz; 1.5 mF and 150 uF): 5 mA, 3 and 30 mV, and 5 mV a
    /// period. In units of what a period of the whole source voltage does to the current, of what that current does to the output
    /// voltage in a period, and of the source voltage.
    #[must_use]
    pub fn usual(plant: &Parameters) -> [f64; 3] {
        let volts = plant.converter.v_in;
        let amperes = volts * plant.t_sw() / plant.converter.inductance;
        let charged = amperes * plant.t_sw() / plant.converter.capacitance;
        [5e-4 * amperes, CAPACITANCE * charged, 2.5e-5 * volts]
    }
}

/// Share of what a current does to the output voltage that the model is wrong by.
// what a capacitance that is not that of its print does while a load step is made up for. With the 150 uF, a delay of one period, a
// sensor of 12 bits, twice the usual noise of the bias and L and C 20 % low, the law deviated by 21.5 V where 20.6 is the limit and rested
// within 0.155 V at 1.5e-5 of it; at 4.5e-3 it deviates by 20.6 and rests within 0.098 V
const CAPACITANCE: f64 = 4.5e-3;

/// Gains of a steady filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// Corrections of current, voltage and bias per volt between measured and predicted output voltage.
    pub gains: [f64; 3],
    /// How much of an error of the estimates is left after a period, where it decays slowest.
    pub slowest: f64,
}

/// Steps in which the covariance has to stand still.
// one that decays by a thousandth a period has lost all but 1e-43 of its start
const STEPS: usize = 100_000;
/// Relative change of the gains of a step that counts as none.
// rounding leaves 1e-13; what is left at a pole of 0.999 is then 1e-8 of a gain, which is written with four digits
const STILL: f64 = 1e-11;

impl Model {
    /// From the period in s, L in H, C in F and the output's share of the current, which is 1 for a buck.
    #[must_use]
    pub fn new(period: f64, inductance: f64, capacitance: f64, give: f64) -> Self {
        Self {
            give,
            by_inductance: period / inductance,
            by_capacitance: period / capacitance,
        }
    }

    /// The state after a period without duty and load.
    fn transition(&self) -> Matrix {
        let (h, g, r) = (self.by_inductance, self.by_capacitance, self.give);
        // the derivatives of the contract's prediction: mean current, voltage, current (section 2b)
        let voltage = [g * r, 1.0 - 0.5 * g * r * h * r, 0.5 * g * r * h];
        let current = [
            1.0 - 0.5 * h * r * voltage[0],
            -0.5 * h * r * (1.0 + voltage[1]),
            h * (1.0 - 0.5 * r * voltage[2]),
        ];
        [current, voltage, [0.0, 0.0, 1.0]]
    }

    /// The steady filter for this noise: the covariance is predicted and corrected until the gains stand still.
    ///
    /// # Errors
    /// If they do not: a converter whose resonance lies near the control frequency.
    pub fn filter(&self, noise: &Noise) -> Result<Filter, Error> {
        let transition = self.transition();
        let mut covariance = diagonal(noise.process.map(|x| x * x));
        let mut gains = [0.0_f64; 3];
        for _ in 0..STEPS {
            let next = self.step(&transition, &mut covariance, noise);
            let change = gains.iter().zip(&next).map(|(old, new)| (old - new).abs());
            let largest = next.iter().fold(0.0_f64, |most, gain| most.max(gain.abs()));
            // at first the voltage may be known exactly: nothing is corrected yet
            let is_still = largest > 0.0 && change.fold(0.0, f64::max) <= STILL * largest;
            gains = next;
            if is_still {
                let slowest = slowest(&closed(&transition, gains));
                if slowest < 1.0 {
                    return Ok(Filter { gains, slowest });
                }
                break;
            }
        }
        let message = Message::new("the observer's filter does not settle");
        Err(message
            .found(format!(
                "T/L = {} A/V, T/C = {} V/A",
                self.by_inductance, self.by_capacitance
            ))
            .hint("is the resonance of L and C far below the switching frequency?")
            .into())
    }

    /// One correction and prediction; the gains of the correction.
    fn step(&self, transition: &Matrix, covariance: &mut Matrix, noise: &Noise) -> [f64; 3] {
        let innovation = covariance[1][1] + noise.measured * noise.measured;
        let gains = [0, 1, 2].map(|row: usize| covariance[row][1] / innovation);
        let corrected: Matrix = [0, 1, 2].map(|row: usize| {
            [0, 1, 2].map(|column: usize| covariance[row][column] - gains[row] * covariance[1][column])
        });
        let mut next = product(&product(transition, &corrected), &transposed(transition));
        for (row, x) in noise.process.iter().enumerate() {
            next[row][row] += x * x;
        }
        // rounding must not make it lopsided
        let mirrored = transposed(&next);
        *covariance = [0, 1, 2]
            .map(|row: usize| [0, 1, 2].map(|column: usize| 0.5 * (next[row][column] + mirrored[row][column])));
        gains
    }
}

/// What a correction and a prediction make of an error of the estimates.
fn closed(transition: &Matrix, gains: [f64; 3]) -> Matrix {
    let mut corrected = diagonal([1.0; 3]);
    for (row, gain) in gains.iter().enumerate() {
        corrected[row][1] -= gain;
    }
    product(transition, &corrected)
}

/// The largest magnitude of an eigenvalue, from the growth of a high power.
fn slowest(matrix: &Matrix) -> f64 {
    // squared twenty times: the power of a million, with the scale taken out each time
    const SQUARES: i32 = 20;
    let (mut power, mut scale) = (*matrix, 0.0);
    for _ in 0..SQUARES {
        let size = power.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        if size == 0.0 {
            return 0.0;
        }
        let scaled = power.map(|row| row.map(|x| x / size));
        power = product(&scaled, &scaled);
        scale = 2.0 * (scale + libm::log(size));
    }
    let size = power.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    libm::exp((scale + libm::log(size)) / 2.0_f64.powi(SQUARES))
}

fn diagonal(values: [f64; 3]) -> Matrix {
    let [a, b, c] = values;
    [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]
}

fn product(left: &Matrix, right: &Matrix) -> Matrix {
    [0, 1, 2].map(|row: usize| [0, 1, 2].map(|column: usize| (0..3).map(|k| left[row][k] * right[k][column]).sum()))
}

fn transposed(matrix: &Matrix) -> Matrix {
    [0, 1, 2].map(|row: usize| [0, 1, 2].map(|column: usize| matrix[column][row]))
}
