use super::*;

fn interval(low: f32, high: f32) -> Box32 {
    Box32 { low, high }
}

#[test]
fn a_product_lies_between_its_corners() {
    let product = interval(-3.0, 2.0).times(interval(-5.0, 7.0));
    // corners 15, -21, -10, 14
    assert!(matches!(product, Ok(Box32 { low: -21.0, high: 15.0 })));
    let product = interval(2.0, 3.0).times(interval(4.0, 5.0));
    assert!(matches!(product, Ok(Box32 { low: 8.0, high: 15.0 })));
    let product = interval(-3.0, -2.0).times(interval(4.0, 5.0));
    assert!(matches!(product, Ok(Box32 { low: -15.0, high: -8.0 })));
}

#[test]
fn a_difference_of_samples_is_divided_by_the_period() {
    let found = filter(&Filter::BackwardDifference, interval(-1.0, 3.0), 0.25);
    // 4 in a quarter of a second
    assert!(matches!(found, Ok(Box32 { low: -16.0, high: 16.0 })));
}

#[test]
fn a_mean_lies_where_its_samples_lie() {
    let found = filter(&Filter::MovingAverage { samples: 4 }, interval(-1.0, 3.0), 1e-4);
    assert!(matches!(found, Ok(Box32 { low: -1.0, high: 3.0 })));
}

#[test]
fn a_filtered_derivative_is_no_wider_than_its_rounding_errors() {
    // k = 1000 1/s, width 4, decay .1: 4000, and 4.1 units of it for each of the ten steps that the memory keeps
    let error = 4.1 / 16_777_216.0 * 4000.0 / 0.1;
    let found = filtered_derivative(interval(-1.0, 3.0), 9e-4, 1e-4).map(|found| f64::from(found.high));
    // outwards to the next binary32, which is 2^-12 away; k and decay are rounded to binary32
    assert!(found.is_ok_and(|high| high > 4000.0 + 0.9 * error && high < 4000.0 + 1.1 * error + 3.0 / 4096.0));
}

#[test]
fn below_0_a_leaky_rectifier_has_its_slope() {
    let leaky = activated(Interval { low: -8.0, high: 2.0 }, Activation::LeakyRelu { slope: 0.25 });
    assert!(
        leaky.high == 2.0 && leaky.low <= -2.0 && leaky.low > -2.0 - 1e-5,
        "{leaky:?}"
    );
}

const MAX: f32 = MAX_MAGNITUDE as f32;

/// Steps between the numbers of binary32.
fn steps(x: f32, count: u16, size: f64) -> f32 {
    (f64::from(x) + f64::from(count) * size) as f32
}

#[test]
fn a_low_pass_passes_its_input_by_rounding_errors_alone() {
    // 16 units of 3 are 12 steps of 2^-22 beside 3 and 24 of 2^-23 below -1; one more, outwards
    let found = low_pass(interval(-1.0, 3.0)).ok();
    let steps_down = -steps(1.0, 25, f64::from(f32::EPSILON));
    assert_eq!(
        found,
        Some(interval(steps_down, steps(3.0, 13, 2.0 * f64::from(f32::EPSILON))))
    );
    // 71 steps of 2^-149, and one outwards
    let still = low_pass(interval(0.0, 0.0)).ok();
    assert_eq!(still, Some(interval(-f32::from_bits(72), f32::from_bits(72))));
    // the difference to the memory is twice as large as either
    assert!(low_pass(interval(-0.4 * MAX, 0.4 * MAX)).is_ok());
    assert!(low_pass(interval(-0.6 * MAX, 0.6 * MAX)).is_err());
}

#[test]
fn the_rounding_errors_of_a_slow_derivative_add_up() {
    // 1 - p is 2^-10 and k is 1 - p: width 4 gives 2^-8
    let (period, tau) = (1.0, 1023.0);
    let (k, unit) = (1.0 / 1024.0, 1.0 / 16_777_216.0);
    let high = filtered_derivative(interval(-1.0, 3.0), tau, period).map(|found| f64::from(found.high));
    let expected = 4.0 * k + 4.1 * unit * k * 4.0 / (k - 2.1 * unit);
    assert!(high.is_ok_and(|high| high > expected && high < expected * (1.0 + 2.1 * f64::from(f32::EPSILON))));
    // of an input that stands still, the errors of subnormal numbers: of the difference, of the product with k = 1/10 and of the
    // sum, over a decay of 1/10
    let still = filtered_derivative(interval(7.0, 7.0), 9.0, 1.0).map(|found| f64::from(found.high));
    assert!(still.is_ok_and(|still| (still / (4.0 * 1e-43 * 1.1 * 10.0) - 1.0).abs() < 2e-3));
}

#[test]
fn a_derivative_whose_difference_overflows_or_whose_errors_stay_has_no_bound() {
    let of = |x: f32, tau: f64| filtered_derivative(interval(-x, x), tau, 1.0);
    // k is 1/10: the difference is what overflows
    assert!(of(0.4 * MAX, 9.0).is_ok());
    assert!(of(0.6 * MAX, 9.0).is_err());
    // p is rounded to 1
    assert!(of(1.0, 1e9).is_err_and(|Overflow(magnitude)| magnitude == f64::INFINITY));
    // 1 - p of two units is less than 2.1, of four it is more
    assert!(of(1.0, 8_388_607.0).is_err());
    assert!(of(1.0, 4_194_303.0).is_ok());
}

#[test]
fn an_integrator_lies_within_its_clamps_and_what_one_step_can_reach() {
    let of = |leak: f64, x: Box32| {
        let integrator = Filter::Integrator {
            min: -2.0,
            max: 8.0,
            initial: 0.0,
            leak,
        };
        filter(&integrator, x, 0.5).ok()
    };
    // 8 + 0.5 and -2 + 0.5, behind the clamp
    assert_eq!(of(1.0, interval(1.0, 1.0)), Some(interval(-1.5, 8.0)));
    // a quarter is kept: -0.5 - 1 and 2 + 1.5
    assert_eq!(of(0.25, interval(-2.0, 3.0)), Some(interval(-1.5, 3.5)));
    assert_eq!(of(1.0, interval(-4.0 * MAX, 0.0)), None);
}

#[test]
fn an_observation_is_scaled_then_moved_then_clipped() {
    let of = |scale, offset, clip| observation(interval(-3.0, 5.0), scale, offset, clip).ok();
    assert_eq!(of(1.0, 0.0, None), Some(interval(-3.0, 5.0)));
    assert_eq!(of(2.0, 0.0, None), Some(interval(-6.0, 10.0)));
    assert_eq!(of(-0.5, 1.0, None), Some(interval(-1.5, 2.5)));
    let clip = Some(Interval { low: -4.0, high: 6.0 });
    assert_eq!(of(2.0, 1.0, clip), Some(interval(-4.0, 6.0)));
    assert_eq!(of(0.0, 9.0, clip), Some(interval(6.0, 6.0)));
}

#[test]
fn a_sum_of_a_layer_has_a_slack_of_all_its_magnitudes() {
    let unit = 1.0 / 16_777_216.0;
    let of = |weights: &[f32], bias: f32| {
        let inputs = [Interval { low: -1.0, high: 2.0 }, Interval { low: 0.5, high: 4.0 }];
        layer(&inputs, weights, &[bias], Activation::Identity).map(|bounds| (bounds[0].low, bounds[0].high))
    };
    // -3 to 6 and -2 to -0.25; the largest magnitudes are 0.5, 6 and 2, and (n + 2) 2^-23 is 8 units
    let slack = 8.0 * unit * 8.5;
    let found = of(&[3.0, -0.5], 0.5);
    assert!(
        matches!(found, Ok((low, high)) if low == -4.5 - slack && high == 6.25 + slack),
        "{found:?}"
    );
    // a negative bias counts by its magnitude, a negative weight turns the ends around
    let slack = 8.0 * unit * 17.0;
    let found = of(&[-3.0, 0.5], -9.0);
    assert!(
        matches!(found, Ok((low, high)) if low == -14.75 - slack && high == -4.0 + slack),
        "{found:?}"
    );
    // of one input, 6 units
    let one = layer(
        &[Interval { low: -1.0, high: 2.0 }],
        &[3.0],
        &[0.5],
        Activation::Identity,
    );
    let slack = 6.0 * unit * 6.5;
    assert!(matches!(one.as_deref(), Ok([one]) if one.low == -2.5 - slack && one.high == 6.5 + slack));
    // of nothing the rounding of subnormal products is left: one for each input
    assert!(matches!(of(&[0.0, 0.0], 0.0), Ok((low, high)) if low == -2e-43 && high == 2e-43));
    // an output that may overflow is named, with the magnitude and not with the sum, which is smaller
    let weights = [0.0, 0.0, 0.3 * MAX, 0.2 * MAX];
    let inputs = [Interval { low: -1.0, high: 2.0 }, Interval { low: 0.5, high: 4.0 }];
    let found = layer(&inputs, &weights, &[0.0, -0.2 * MAX], Activation::Relu);
    let expected = 1.6 * f64::from(MAX);
    assert!(matches!(found, Err((1, Overflow(magnitude))) if (magnitude / expected - 1.0).abs() < 1e-6));
    // exactly the largest and a little less
    let alone = |bias: f32| layer(&inputs[..1], &[0.0], &[bias], Activation::Identity).is_ok();
    assert!(alone(MAX * 0.999_999));
    assert!(!alone(MAX));
}

#[test]
fn ends_pass_an_activation_one_by_one() {
    let of = |low, high, activation| {
        let found = activated(Interval { low, high }, activation);
        (found.low, found.high)
    };
    let leaky = Activation::LeakyRelu { slope: 0.25 };
    let unit = 1.0 / 16_777_216.0;
    assert_eq!(of(-8.0, -4.0, leaky), (-2.0 - 8.0 * unit, -1.0 + 4.0 * unit));
    assert_eq!(of(1.0, 3.0, leaky), (1.0, 3.0));
    // a product with 0 may be rounded from a subnormal one
    assert_eq!(of(0.0, 0.0, leaky), (-1e-43, 1e-43));
    assert_eq!(of(-8.0, -4.0, Activation::Relu), (0.0, 0.0));
    assert_eq!(of(-8.0, 4.0, Activation::Relu), (0.0, 4.0));
    assert_eq!(of(-8.0, -4.0, Activation::Identity), (-8.0, -4.0));
}
