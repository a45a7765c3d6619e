//! How long the steps are: a time constant of the fastest part, or longer where hardly anything rings.
//!
//! A matrix takes the states over a step of any length. What asks for short ones is the polynomial that finds the extremes of the output
//! voltage within a step, and the line for what the constant power's tangent leaves.

use super::rows::Row;
use super::{Circuit, FEWER, step};
use crate::full::{Full, Path, V_LOAD};
use crate::rate;

/// Longer steps, in time constants, the longest first.
// beyond 3 a step holds two extremes of what rings
const LONGER: [f64; 3] = [2.5, 2.0, 1.5];
/// What a longer step may leave of an extreme, relative to the source's voltage.
// ten times what a series of `crate::plain` leaves; a step of one time constant leaves as much of a ringing of half a volt at 200 V
const LEFT_OUT: f64 = 5e-8;
/// A polynomial of fifth order through values, slopes and second derivatives at both ends of `h` leaves this times `h^6` of the sixth
/// derivative.
const SIXTH: f64 = 1.0 / 46080.0;
/// How far the load's voltage may go in a longer step under constant power, relative.
// the line is wrong by the square of it. Without this bound a voltage that falls by half was 6e-4 V beside fine steps, and with it is as
// near as with short steps, 3e-4 V
const SLOW: f64 = 5e-4;

impl<const N: usize> Circuit<N> {
    /// What rings of output voltage, load voltage, and of what keeps the path, at most over `h` seconds; it does not turn faster than once
    /// in `constant` seconds. And how far the load's voltage goes in those.
    #[inline(always)]
    fn rings(&self, x: &[f64; N], keeps: bool, constant: f64, h: f64) -> [f64; 2] {
        let first = self.slopes(x, self.tangent.rest(x[V_LOAD]));
        let second = step::apply(&self.a, &first);
        let third = step::apply(&self.a, &second);
        let of_row = |row: &Row<N>, slopes: &[f64; N]| -> f64 {
            row.of.iter().zip(slopes).map(|(factor, slope)| factor * slope).sum()
        };
        let size = |row: &Row<N>| of_row(row, &second).abs() + constant * of_row(row, &third).abs();
        let mut most = (second[V_LOAD].abs() + constant * third[V_LOAD].abs()).max(size(&self.v_out));
        if keeps {
            most = most.max(size(&self.left));
        }
        // the line carries away half as fast as its rate: it sees half of what swings. 1 / (1 - y/4)^4 is above e^y
        let grown = 1.0 - 0.125 * self.tangent.grows() * h;
        let most = match grown > 0.5 {
            true => constant * constant * most / (grown * grown * grown * grown),
            false => f64::INFINITY,
        };
        [most, constant * first[V_LOAD].abs()]
    }
}

impl Full {
    /// Steps per second over the next `h` seconds; `load` is the rate that the load asks for.
    #[inline(always)]
    pub(super) fn steps<const N: usize>(
        &self,
        circuit: &Circuit<N>,
        x: &[f64; N],
        path: &Path,
        load: f64,
        h: f64,
    ) -> f64 {
        let whole = self.rate.max(load) * FEWER;
        let at_least = circuit.tangent.grows() / rate::OTHER_STEP;
        // the sensors' low-passes follow a cubic through both ends
        if self.low_pass != [0.0; 4] {
            return whole.max(at_least);
        }
        let [rings, goes] = circuit.rings(x, path.only != 0.0, 1.0 / whole, h);
        let left_out = LEFT_OUT * self.p.converter.v_in;
        let slow = match circuit.tangent.leaves_nothing() {
            true => f64::INFINITY,
            false => SLOW * circuit.tangent.u,
        };
        let fits = |longer: &f64| {
            let cube = longer * longer * longer;
            rings * (cube * cube) * SIXTH < left_out && goes * longer < slow
        };
        let longer = LONGER.into_iter().find(fits).unwrap_or(1.0);
        (whole / longer).max(at_least)
    }
}
