//! Activations (contract sections 6 and 6b), from the contract's text alone.

use policy::Activation;
use policy::scales::{SLOPE_BITS, power_of_two};

use crate::curves;
use crate::integer::{rounded, shifted};
use crate::real::{Range, Real};

/// Replaces sums of a layer by its outputs (section 6).
pub fn activate<'a, T: Real>(activation: Activation, values: impl Iterator<Item = &'a mut T>) {
    match activation {
        Activation::Identity => {}
        Activation::Relu => values.for_each(|x| *x = relu(*x)),
        Activation::LeakyRelu { slope } => {
            let slope = T::nearest(slope);
            values.for_each(|x| *x = leaky_relu(slope, *x));
        }
        other => {
            let function = curve::<T>(other);
            values.for_each(|x| *x = function(*x));
        }
    }
}

/// The function of a curve in a format.
fn curve<T: Real>(activation: Activation) -> fn(T) -> T {
    match activation {
        Activation::Tanh => tanh,
        Activation::Softsign => softsign,
        Activation::Sigmoid => curves::sigmoid,
        Activation::HardSigmoid => curves::hard_sigmoid,
        Activation::Elu => curves::elu,
        Activation::Softplus => curves::softplus,
        Activation::Silu => curves::silu,
        Activation::Gelu => curves::gelu,
        Activation::GeluTanh => curves::gelu_tanh,
        Activation::HardSwish => curves::hard_swish,
        Activation::Relu | Activation::LeakyRelu { .. } | Activation::Identity => {
            unreachable!("{} is two straight lines", activation.word())
        }
    }
}

/// An output of a layer in integers from its sum (section 6b). Integer / 2^exponent is the number, of the sum with the first of
/// the exponents and of the output with the second.
pub(crate) fn integer(activation: Activation, sum: i64, exponents: (i32, i32), shift: u32) -> i64 {
    match activation {
        Activation::Identity => shifted(sum, shift),
        Activation::Relu => shifted(sum, shift).max(0),
        Activation::LeakyRelu { slope } => {
            let slope = rounded(slope * power_of_two(SLOPE_BITS.cast_signed())).min(32_767);
            let y = shifted(sum, shift);
            if y > 0 { y } else { shifted(y * slope, SLOPE_BITS) }
        }
        other => through_binary32(curve(other), sum, exponents),
    }
}

/// The sum as a binary32 number, the function of section 6, and back.
fn through_binary32(function: fn(f32) -> f32, sum: i64, (accumulator, behind): (i32, i32)) -> i64 {
    let x = sum as f32 * (power_of_two(-accumulator) as f32);
    // the sum is rounded to binary32 once; the power of two changes its exponent alone
    let y = function(x) * (power_of_two(behind) as f32);
    // the sum is positive, so that cutting it off rounds half up; it is made in binary32, as in the contract:
    // in binary64 a value just below a half would not be rounded up to it first
    (y + 32_768.5).trunc() as i64 - 32_768
}

pub(crate) fn relu<T: Real>(x: T) -> T {
    // not `max`, which leaves open which of two zeros it gives: of -0 the contract makes +0
    if x > T::ZERO { x } else { T::ZERO }
}

fn leaky_relu<T: Real>(slope: T, x: T) -> T {
    if x > T::ZERO { x } else { slope * x }
}

// typed from the contract and not taken from `policy`, as the compiler's are: a wrong digit in one of them shows
/// Coefficients n0..n4 of the numerator.
const NUMERATOR: [f64; 5] = [0.9999999, 0.13373208, 0.0034865933, 2.0472007e-5, 1.3184444e-8];
/// Coefficients d0..d4 of the denominator.
const DENOMINATOR: [f64; 5] = [1.0, 0.46706504, 0.025842024, 0.00032714035, 7.702759e-7];

/// The contract's rational approximation of tanh (section 6): in binary32 less than 4e-7 off for every finite x.
pub fn tanh<T: Real>(x: T) -> T {
    let clamp = |limit: f64| Range {
        lo: T::nearest(-limit),
        hi: T::nearest(limit),
    };
    // from 9 on tanh is less than 4e-8 below 1, a tenth of the approximation's error
    let t = clamp(9.0).clamp(x);
    let z = t * t;
    let p = horner(NUMERATOR, z) * t;
    let q = horner(DENOMINATOR, z);
    // the quotient of two rounded sums may pass 1; the scales of section 6b rest on it not doing so
    clamp(1.0).clamp(p / q)
}

/// Section 6: a sum and a quotient, each rounded once.
fn softsign<T: Real>(x: T) -> T {
    let magnitude = if x < T::ZERO { -x } else { x };
    x / (T::nearest(1.0) + magnitude)
}

fn horner<T: Real>([c0, c1, c2, c3, c4]: [f64; 5], z: T) -> T {
    [c3, c2, c1, c0]
        .into_iter()
        .fold(T::nearest(c4), |sum, c| sum * z + T::nearest(c))
}

#[cfg(test)]
mod tests {
    use policy::Shape;

    use super::*;

    fn one<T: Real>(activation: Activation, x: T) -> T {
        let mut values = [x];
        activate(activation, values.iter_mut());
        values[0]
    }

    /// Every 1009th number of the format from 0 to the largest that the check of a policy lets arise: 2 million, in order.
    fn numbers() -> impl Iterator<Item = f32> {
        let last = policy::limits::MAX_MAGNITUDE as f32;
        (0..=last.to_bits()).step_by(1009).map(f32::from_bits).chain([last])
    }

    /// A slope has 15 bits behind the point (section 6b): one that would round to 1 is the largest of them.
    #[test]
    fn the_steepest_slope_in_integers_is_one_unit_below_one() {
        let behind = |slope: f64| integer(Activation::LeakyRelu { slope }, -32_768, (0, 0), 0);
        assert_eq!(behind(0.999_999), -32_767);
        assert_eq!(behind(0.5), -16_384);
    }

    /// What bounds and certificates take for granted, against the arithmetic of the contract.
    #[test]
    fn the_facts_of_each_activation_hold_for_the_contracts_arithmetic() {
        for each in Activation::EACH {
            for x in numbers().chain([1.0, 9.0]) {
                check(*each, x);
                check(*each, -x);
            }
        }
    }

    /// Of every 4099th binary32 number that the check of a policy lets arise, or with POLICYC_FULL of every one: how near its
    /// bound the largest error comes.
    #[test]
    fn every_number_of_a_curve_is_within_its_stated_errors() {
        let step = if std::env::var_os("POLICYC_FULL").is_some() {
            1
        } else {
            4099
        };
        let last = (policy::limits::MAX_MAGNITUDE as f32).to_bits();
        for (each, curve) in curves() {
            let mut worst = (0.0, 0.0);
            for x in (0..=last).step_by(step).map(f32::from_bits).flat_map(|x| [x, -x]) {
                let wide = f64::from(x);
                let error = (f64::from(one(each, x)) - (curve.real)(wide)).abs();
                let share = error / curve.error_32.at(wide);
                if share > worst.0 {
                    worst = (share, x);
                }
            }
            println!("{}: {:.3} of the bound at {:e}", each.word(), worst.0, worst.1);
            assert!(worst.0 < 1.0, "{} {worst:?}", each.word());
            assert!(
                worst.0 > 0.3,
                "{}: a bound that nothing comes near, {worst:?}",
                each.word()
            );
        }
    }

    fn check(each: Activation, x: f32) {
        let (y, word, wide) = (one(each, x), each.word(), f64::from(x));
        match each.shape() {
            Shape::Hinge { below } => {
                let expected = if x > 0.0 { x } else { below as f32 * x };
                assert!(y == expected, "{word} {x}");
            }
            Shape::Curve(curve) => {
                let apart = |value: f64| (f64::from(y) - value).abs();
                assert!(apart((curve.real)(wide)) < curve.error_32.at(wide), "{word} {x}");
                assert!(apart((curve.value)(wide)) < curve.apart(wide), "{word} {x}");
                let wider = (one(each, wide) - (curve.value)(wide)).abs();
                assert!(wider <= 1e-15 * (1.0 + wide.abs()), "{word} {x}: {wider}");
                if let Some(range) = curve.range {
                    assert!(range.low <= f64::from(y) && f64::from(y) <= range.high, "{word} {x}");
                }
            }
        }
    }

    fn curves() -> impl Iterator<Item = (Activation, &'static policy::activation::Curve)> {
        let all = Activation::EACH.iter();
        all.filter_map(|each| Some((*each, each.curve()?)))
    }

    /// A rectifier gives +0 for zeros of both signs: neurons are left out because of it.
    #[test]
    fn zeros_keep_their_sign_but_behind_a_rectifier() {
        for each in Activation::EACH {
            let of_zeros = [0.0_f32, -0.0].map(|x| one(*each, x));
            match each.shape() {
                Shape::Hinge { .. } => {
                    let expected = if each.is_rectifier() { [0, 0] } else { [0, 1] };
                    assert_eq!(of_zeros.map(|y| y.to_bits() >> 31), expected, "{}", each.word());
                }
                // the sign of zero is left to the formula; its value is not
                Shape::Curve(curve) => {
                    assert_eq!(of_zeros[0], of_zeros[1], "{}", each.word());
                    let real = (curve.real)(0.0);
                    assert!(
                        (f64::from(of_zeros[0]) - real).abs() < curve.error_32.absolute,
                        "{}",
                        each.word()
                    );
                }
            }
        }
    }

    #[test]
    fn integers_behind_a_curve_are_the_nearest_to_its_value() {
        for (each, curve) in curves() {
            for exponent in [14, 11] {
                let unit = power_of_two(exponent);
                // sums of 13 fractional bits up to +-4.9; of a curve with two ends the largest, too
                let far = [i64::from(i32::MAX), i64::from(-i32::MAX)]
                    .into_iter()
                    .filter(|_| curve.range.is_some());
                let near = (-40_000_i64..=40_000).step_by(7);
                let fits = near.filter(|sum| curve.range.is_some() || *sum as f64 / 8192.0 * unit < 32_000.0);
                for sum in fits.chain(far) {
                    let x = sum as f64 / 8192.0;
                    let y = integer(each, sum, (13, exponent), 0) as f64;
                    let expected = unit * (curve.real)(x);
                    // half a unit, and what the binary32 value is off
                    let bound = 0.502 + unit * curve.error_32.at(x);
                    assert!((y - expected).abs() < bound, "{} {sum}: {y} {expected}", each.word());
                }
            }
        }
    }

    #[test]
    fn relu_gives_plus_zero_for_everything_not_positive() {
        for x in [-0.0_f32, 0.0, -1.0, -f32::MIN_POSITIVE, f32::NAN, f32::NEG_INFINITY] {
            assert_eq!(relu(x).to_bits(), 0, "{x}");
        }
        assert_eq!(relu(f32::from_bits(1)).to_bits(), 1);
    }

    #[test]
    fn leaky_relu_keeps_the_sign_of_zero_and_scales_the_negative_side() {
        let slope = 0.01_f32;
        assert_eq!(leaky_relu(slope, 0.0).to_bits(), 0);
        assert_eq!(leaky_relu(slope, -0.0).to_bits(), 1 << 31);
        assert_eq!(leaky_relu(slope, -3.0), 0.01_f32 * -3.0);
        assert_eq!(leaky_relu(slope, 3.0), 3.0);
    }

    #[test]
    fn tanh_is_within_4e_7_over_a_dense_sweep_of_bit_patterns() {
        let mut worst = (0.0_f64, 0.0_f32);
        let mut check = |x: f32| {
            let error = (f64::from(tanh(x)) - f64::from(x).tanh()).abs();
            if error > worst.0 {
                worst = (error, x);
            }
        };
        // every 97th pattern of [0, 10], both signs: about 23 million values less the tail
        for bits in (0..=10.0_f32.to_bits()).step_by(97) {
            check(f32::from_bits(bits));
            check(-f32::from_bits(bits));
        }
        for x in [1e3, 1e10, f32::MAX, -1e3, f32::MIN, 9.0, 9.0_f32.next_up(), 8.999_999] {
            check(x);
        }
        assert!(worst.0 < 4e-7, "error {} at {}", worst.0, worst.1);
        assert!(worst.0 > 1e-8, "a bound that is never approached: {}", worst.0);
    }

    #[test]
    fn tanh_is_odd_bounded_and_keeps_the_sign_of_zero() {
        for x in [1e-45_f32, 1e-3, 0.3, 1.0, 4.0, 8.9, 9.0, 100.0, f32::MAX] {
            assert_eq!(tanh(-x).to_bits(), (-tanh(x)).to_bits(), "{x}");
            assert!(tanh(x) <= 1.0);
        }
        assert_eq!(tanh(0.0_f32).to_bits(), 0);
        assert_eq!(tanh(-0.0_f32).to_bits(), 1 << 31);
    }
}
