//! Line harmonic on the source: `v = v_in + ripple sin(2 pi (f t + phase))`, t from the plant's start.
//!
//! The sine is a polynomial of our own: the same bits on every machine.

use crate::entry::{Effect, Way, detail, number};
use crate::parameters::Source;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "input_ripple",
    meaning: "line harmonic on the source voltage",
    needs: Way::Full,
    parameters: &[
        number!(
            source.ripple,
            "V",
            // a few percent of the source
            "amplitude of the line harmonic",
            (0.0, 1e5),
            (0.5, 10.0),
            0.0
        ),
        detail!(
            source.ripple_frequency,
            "Hz",
            // rectified mains: 2 x 50 Hz of one phase to 6 x 60 Hz of three
            "frequency of the line harmonic",
            (0.0, 1e6),
            (100.0, 360.0),
            100.0
        ),
        detail!(
            source.ripple_phase,
            "1",
            "phase at time 0, turns",
            (-1.0, 1.0),
            (0.0, 1.0),
            0.0
        ),
    ],
};

/// Added to the source voltage at time `t`, V.
#[inline]
pub(crate) fn voltage(source: &Source, t: f64) -> f64 {
    if source.ripple == 0.0 {
        return 0.0;
    }
    source.ripple * sine(source.ripple_frequency * t + source.ripple_phase)
}

/// sin(2 pi turns) to 1e-11, from the Taylor series on a quarter turn.
fn sine(turns: f64) -> f64 {
    // folded to a quarter turn first: there eight terms leave (pi/2)^19 / 19! = 4e-14
    let whole = turns - turns.floor();
    let folded = match whole {
        x if x < 0.25 => x,
        x if x < 0.75 => 0.5 - x,
        x => x - 1.0,
    };
    let x = folded * std::f64::consts::TAU;
    let square = x * x;
    let mut sum = 1.0;
    for k in (1..=8u32).rev() {
        sum = 1.0 - square / f64::from(2 * k * (2 * k + 1)) * sum;
    }
    x * sum
}

#[cfg(test)]
mod tests {
    use super::sine;

    #[test]
    fn sine_is_the_sine() {
        for step in -4000..4000 {
            let turns = f64::from(step) / 1000.0;
            let exact = (turns * std::f64::consts::TAU).sin();
            assert!((sine(turns) - exact).abs() < 1e-11, "{turns}");
        }
    }
}
