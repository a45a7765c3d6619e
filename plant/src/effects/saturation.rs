//! The inductance falls with current: `L(i) = L0 (1 - k y / (1 + y))`, y = x^(2 s), x = i / i_sat.
//!
//! Differential inductance, v = L(i) di/dt. Half of the share k is lost at `i_sat`; k = 0 is the linear inductor. The steepness s is 1
//! for a powder core, that falls over a decade of current; with 12 it is a ferrite, that falls within a fifth of `i_sat`. With k at its
//! upper end this is the law of the data sheets of powder cores, `1 / (1 + (i / i_sat)^c)`, c = 2 s from 1.2 to 2.5.
//! Between whole numbers `y = x^(2 n) (1 + f (x^2 - 1))`, n whole and f the rest of s; below 1 the powers of x at the quarters of c, and a line
//! between them: powers without logarithms.
//! More ripple at high current, a faster response there; nothing in steady state in CCM.

use crate::entry::{Effect, Way, detail, number};
use crate::parameters::Inductor;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "saturation",
    meaning: "inductance that falls with current",
    needs: Way::Full,
    parameters: &[
        number!(
            inductor.saturation,
            "1",
            "share of the inductance that is lost far above i_sat",
            // something must be left: the steps of the full circuit are as short as the least inductance asks for. Without its core a
            // winding keeps a hundredth and more, a permeability of 100 at most with an air gap
            (0.0, 0.99),
            // data sheets rate the current at a drop of 10 to 30 %; powder cores go on falling
            (0.1, 0.7),
            0.0
        ),
        detail!(
            inductor.i_sat,
            "A",
            "current at which half of that share is lost: L = L0 (1 - saturation y / (1 + y)), y = (i / i_sat)^(2 steepness)",
            (1e-3, 1e6),
            (2.0, 50.0),
            10.0
        ),
        detail!(
            inductor.steepness,
            "1",
            "how suddenly it is lost: 1 over a decade of current, 12 within a fifth of i_sat",
            // from a fall that begins at once; to one within 7 % of i_sat, steeper is none of a core with an air gap
            (0.5, 32.0),
            (1.0, 12.0),
            1.0
        ),
    ],
};

/// L(i) over L0.
#[inline]
pub(crate) fn relative_inductance(inductor: &Inductor, i: f64) -> f64 {
    // a rational law: one with an exponential would need libm, whose bits differ between machines
    let x = i / inductor.i_sat;
    let square = x * x;
    let y = match inductor.steepness {
        1.0 => square,
        other => power(square, other),
    };
    1.0 - inductor.saturation * y / (1.0 + y)
}

/// `square^steepness`; between whole numbers along a line, below 1 between quarters of the exponent of its root.
// in one place: the law stands in every form of the circuit, and the page of the studio loads them all
#[inline(never)]
fn power(square: f64, steepness: f64) -> f64 {
    if steepness < 1.0 {
        return soft(square.sqrt(), 2.0 * steepness).min(1e300);
    }
    let whole = steepness.floor();
    let (mut y, mut factor, mut left) = (1.0, square, whole as u32);
    while left > 0 {
        if left & 1 == 1 {
            y *= factor;
        }
        factor *= factor;
        left >>= 1;
    }
    // far above i_sat all of the share is lost: infinity over itself would be no number
    (y * (1.0 + (steepness - whole) * (square - 1.0))).min(1e300)
}

/// `x^c`, c from 1 to 2, by square roots, which every machine rounds alike.
fn soft(x: f64, c: f64) -> f64 {
    let half = x.sqrt();
    let quarter = half.sqrt();
    // the power at the quarter below, and how far to the next one
    let quarters = 4.0 * (c - 1.0);
    let (below, rest) = match quarters {
        q if q < 1.0 => (x, q),
        q if q < 2.0 => (x * quarter, q - 1.0),
        q if q < 3.0 => (x * half, q - 2.0),
        q => (x * half * quarter, q - 3.0),
    };
    below * (1.0 + rest * (quarter - 1.0))
}

#[cfg(test)]
mod tests {
    use super::{Inductor, relative_inductance};

    #[test]
    fn a_powder_core_falls_as_its_data_sheet_says() {
        // 1 / (1 + (i / i_sat)^c), the form of the makers' curves, within a hundredth of it and what is left for ever
        for c in [1.0, 1.2, 1.37, 1.5, 1.66, 1.9, 2.0] {
            let inductor = Inductor {
                saturation: 0.99,
                i_sat: 10.0,
                steepness: 0.5 * c,
                ..Inductor::default()
            };
            for x in [0.05_f64, 0.1, 0.3, 0.7, 1.0, 1.5, 3.0] {
                let sheet = 1.0 / (1.0 + x.powf(c));
                let left = relative_inductance(&inductor, -10.0 * x);
                assert!((left - sheet).abs() < 0.011, "c {c}, x {x}: {left} for {sheet}");
            }
        }
    }

    #[test]
    fn a_steep_core_keeps_its_inductance_below_and_loses_it_within_a_fifth() {
        let of = |steepness: f64, x: f64| {
            let inductor = Inductor {
                saturation: 0.8,
                i_sat: 10.0,
                steepness,
                ..Inductor::default()
            };
            relative_inductance(&inductor, 10.0 * x)
        };
        for steepness in [0.5, 0.8, 1.0, 1.5, 4.0, 11.3, 32.0] {
            assert!((of(steepness, 1.0) - 0.6).abs() < 1e-12);
            let falls = (0..400).map(|n| of(steepness, f64::from(n) * 0.01)).collect::<Vec<_>>();
            assert!(falls.windows(2).all(|pair| pair[1] <= pair[0] + 1e-15), "{steepness}");
            assert!((of(steepness, 1e9) - 0.2).abs() < 1e-3, "{steepness}");
        }
        assert!(of(12.0, 0.9) > 0.93 && of(12.0, 1.1) < 0.28);
        // the line between two powers is near the power itself
        assert!((of(2.5, 0.9) - (1.0 - 0.8 * 0.9f64.powi(5) / (1.0 + 0.9f64.powi(5)))).abs() < 2e-3);
    }
}
