//! The bounds hold for everything the controller can compute: the formulas of the contract, written out here in
//! binary32 and fed with random and extreme samples, never leave them.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use policy::{Activation, Expr, Feature, Filter, Input, Interval, Policy, Shape};

fn f(x: f64) -> f32 {
    x as f32
}

fn evaluate(expr: &Expr, signals: &[f32], duties: [f32; 2]) -> f32 {
    let of = |e: &Expr| evaluate(e, signals, duties);
    match expr {
        Expr::Input(Input::Signal(index)) => signals[*index],
        Expr::Input(Input::PreviousDuty) => duties[0],
        Expr::Input(Input::PreviousCommand) => duties[1],
        Expr::Input(Input::Estimate(..)) => unreachable!("no policy of this test has an observer"),
        Expr::Input(Input::OutputDuty(_) | Input::OutputCommand(_)) => unreachable!("they have one output"),
        Expr::Constant(value) => f(*value),
        Expr::Neg(e) => -of(e),
        Expr::Add(a, b) => of(a) + of(b),
        Expr::Sub(a, b) => of(a) - of(b),
        Expr::Scale(k, e) => f(*k) * of(e),
    }
}

fn clamp(x: f32, low: f32, high: f32) -> f32 {
    let t = if x < low { low } else { x };
    if t > high { high } else { t }
}

/// One filter with its memory, primed by the first sample.
#[derive(Default)]
struct Line {
    memory: Vec<f32>,
}

impl Line {
    fn step(&mut self, filter: &Filter, x: f32, period: f64) -> f32 {
        let primed = !self.memory.is_empty();
        let memory = &mut self.memory;
        match *filter {
            Filter::Delay { samples } => {
                if !primed {
                    memory.resize(samples, x);
                }
                memory.push(x);
                memory.remove(0)
            }
            Filter::BackwardDifference => {
                let before = memory.pop().unwrap_or(x);
                memory.push(x);
                (x - before) * f(1.0 / period)
            }
            Filter::LowPass { time_constant } => {
                let y1 = memory.pop().unwrap_or(x);
                let y = y1 + f(period / (time_constant + period)) * (x - y1);
                memory.push(y);
                y
            }
            Filter::FilteredDerivative { time_constant } => {
                let (x1, y1) = if primed { (memory[0], memory[1]) } else { (x, 0.0) };
                let sum = time_constant + period;
                let y = f(time_constant / sum) * y1 + f(1.0 / sum) * (x - x1);
                *memory = vec![x, y];
                y
            }
            Filter::MovingAverage { samples } => {
                if !primed {
                    memory.resize(samples - 1, x);
                }
                let mut sum = memory[0];
                for value in &memory[1..] {
                    sum += value;
                }
                sum += x;
                memory.push(x);
                memory.remove(0);
                sum * f(1.0 / samples as f64)
            }
            Filter::Integrator {
                min,
                max,
                initial,
                leak,
            } => {
                let mut y1 = memory.pop().unwrap_or(f(initial));
                if leak != 1.0 {
                    y1 *= f(leak);
                }
                let y = clamp(y1 + f(period) * x, f(min), f(max));
                memory.push(y);
                y
            }
        }
    }
}

fn observe(feature: &Feature, y: f32) -> f32 {
    let mut o = y;
    if feature.scale != 1.0 {
        o *= f(feature.scale);
    }
    if feature.offset != 0.0 {
        o += f(feature.offset);
    }
    feature.clip.map_or(o, |clip| clamp(o, f(clip.low), f(clip.high)))
}

/// The farthest that the contract's values may lie from the facts of the activation, on either side.
fn activate(x: f32, activation: Activation, is_above: bool) -> f32 {
    match activation.shape() {
        Shape::Hinge { .. } if x > 0.0 || activation.is_identity() => x,
        Shape::Hinge { .. } if activation.is_rectifier() => 0.0,
        Shape::Hinge { below } => f(below) * x,
        Shape::Curve(curve) => {
            let value = (curve.value)(x.into());
            // the rounding to binary32 below moves a value by at most half a unit in its last place
            let apart = curve.apart(x.into()) - 0.5 * f64::from(f32::EPSILON) * value.abs().max(1.0);
            let value = value + if is_above { apart } else { -apart };
            f(curve.range.map_or(value, |range| value.clamp(range.low, range.high)))
        }
    }
}

fn assert_inside(value: f32, bound: Interval, what: &str) {
    let value = f64::from(value);
    assert!(
        bound.low <= value && value <= bound.high,
        "{what}: {value:e} outside [{:e}, {:e}]",
        bound.low,
        bound.high
    );
}

/// Runs the front end on random signals, the network on random observations and on the corners of the box.
fn exercise(policy: &Policy, seed: u64, steps: usize) {
    let mut random = Draws::new(seed);
    let ranges: Vec<_> = policy
        .signals
        .iter()
        .map(|s| policy::rounding::inward_f32(s.range).unwrap())
        .collect();
    let (low, high) = policy::rounding::inward_f32(policy.limits.duty).unwrap();
    let mut lines: Vec<Vec<Line>> = policy
        .features
        .iter()
        .map(|feature| feature.filters.iter().map(|_| Line::default()).collect())
        .collect();
    for _ in 0..steps {
        let signals: Vec<f32> = ranges.iter().map(|(low, high)| random.within(*low, *high)).collect();
        let duty = f(policy.actions()[random.below(policy.outputs())].duty);
        let duties = [duty, random.within(low, high)];
        for (feature, lines) in policy.features.iter().zip(&mut lines) {
            let mut x = evaluate(&feature.source, &signals, duties);
            for (filter, line) in feature.filters.iter().zip(lines) {
                x = line.step(filter, x, policy.sample_period);
            }
            assert_inside(observe(feature, x), feature.bound, &feature.name);
        }
        let mut x: Vec<f32> = policy
            .features
            .iter()
            .map(|o| random.within(o.bound.low as f32, o.bound.high as f32))
            .collect();
        for layer in &policy.layers {
            let row = |o: usize| &layer.weights[o * layer.inputs..(o + 1) * layer.inputs];
            let sum = |o: usize| x.iter().zip(row(o)).fold(layer.bias[o], |acc, (x, w)| acc + w * x);
            x = (0..layer.outputs)
                .map(|o| activate(sum(o), layer.activation, o % 2 == 0))
                .collect();
            for (value, bound) in x.iter().zip(&layer.bounds) {
                assert_inside(*value, *bound, &layer.name);
            }
        }
    }
}

fn with_filters(filters: &str) -> Policy {
    Folder::new().replace("[{ delay = 1 }]", filters).policy()
}

#[test]
fn every_filter_stays_inside_its_bound() {
    for (seed, filters) in [
        "[{ delay = 3 }]",
        "[\"backward_difference\"]",
        "[{ low_pass = { time_constant = 1e-3 } }]",
        "[{ low_pass = { time_constant = 1e-10 } }]",
        "[{ low_pass = { time_constant = 99.0 } }]",
        "[{ filtered_derivative = { time_constant = 1e-3 } }]",
        "[{ filtered_derivative = { time_constant = 1e-9 } }]",
        "[{ filtered_derivative = { time_constant = 50.0 } }]",
        "[{ moving_average = 7 }]",
        "[{ moving_average = 256 }]",
        "[{ integrator = { min = -0.3, max = 0.1 } }]",
        "[{ low_pass = { cutoff = 300.0 } }, { filtered_derivative = { time_constant = 2e-4 } }, { delay = 2 }, \"backward_difference\"]",
        "[{ integrator = { min = -0.3, max = 0.1, leak = 0.9 } }]",
    ]
    .iter()
    .enumerate()
    {
        exercise(&with_filters(filters), seed as u64, 20_000);
    }
}

#[test]
fn a_low_pass_may_pass_its_input_by_rounding_and_the_bound_knows() {
    // from -250 to 1 the difference is rounded far more coarsely than the result
    let filters = "filters = [{ low_pass = { time_constant = 1e-12 } }]";
    let text = CONTRACT.replace(
        "\"v_ref - v_out\"\nfilters = [{ delay = 1 }]",
        &format!("\"v_out\"\n{filters}"),
    );
    let policy = Folder::new()
        .contract(&text.replace("[0.0, 250.0]", "[-250.0, 1.0]"))
        .policy();
    assert!(policy.features[1].bound.high > 1.0);
    exercise(&policy, 11, 20_000);
}

#[test]
fn the_filtered_derivative_is_bounded_by_the_width_and_not_by_its_memory() {
    let policy = with_filters("[{ filtered_derivative = { time_constant = 1e-2 } }]");
    let bound = policy.features[1].bound;
    let expected = 250.0 / (1e-2 + 1e-4);
    assert!(
        bound.high >= expected && bound.high < 1.001 * expected,
        "{bound:?} against {expected}"
    );
}

#[test]
fn the_bound_of_a_clipped_or_exact_feature_is_tight() {
    let policy = Folder::new().policy();
    assert_eq!(policy.features[0].bound, Interval { low: -20.0, high: 20.0 });
    assert_eq!(
        policy.features[1].bound,
        Interval {
            low: -150.0,
            high: 100.0
        }
    );
}

#[test]
fn remembered_duties_cover_actions_start_and_fallback() {
    let with = |name: &str| {
        let folder = Folder::new().replace("filters = [{ delay = 1 }]", "");
        let text = CONTRACT
            .replacen("v_ref - v_out", "v_ref - v_out ", 1)
            .replace("\"v_ref - v_out\"", &format!("\"{name}\""));
        folder
            .contract(&text.replace("filters = [{ delay = 1 }]", ""))
            .policy()
            .features[1]
            .bound
    };
    let nearest = |x: f64| f64::from(x as f32);
    assert_eq!(
        with("previous_duty"),
        Interval {
            low: 0.0,
            high: nearest(0.56)
        }
    );
    assert_eq!(with("previous_command").low, 0.0);
    assert!(with("previous_command").high <= 0.6);
}

#[test]
fn random_networks_and_sources_stay_inside_their_bounds() {
    let mut random = Draws::new(7);
    let activations: Vec<String> = Activation::EACH.iter().map(|each| each.written()).collect();
    for round in 0..40u64 {
        let mut values = |count: usize| {
            let size = [1e-3f32, 1.0, 30.0][random.below(3)];
            (0..count).map(|_| random.within(-size, size)).collect::<Vec<_>>()
        };
        let tensors = [
            f32_tensor("a.0.weight", &[5, 2], &values(10)),
            f32_tensor("a.0.bias", &[5], &values(5)),
            f32_tensor("a.1.weight", &[6, 5], &values(30)),
            f32_tensor("a.1.bias", &[6], &values(6)),
            f32_tensor("a.2.weight", &[3, 6], &values(18)),
            f32_tensor("a.2.bias", &[3], &values(3)),
        ];
        let source = [
            "v_out * 0.37 - i_out / 3 + 0.1",
            "-(i_out - 0.3 * v_out) * 1.7",
            "previous_duty - 0.1 * previous_command",
        ][random.below(3)];
        let text = CONTRACT.replace("\"v_ref - v_out\"\nfilters", &format!("\"{source}\"\nfilters"));
        let text = text.replace("\"relu\"", &activations[round as usize % activations.len()]);
        let folder = Folder::new().contract(&text).tensors(&tensors);
        exercise(&folder.policy(), round, 1_000);
    }
}

#[test]
fn rounding_inwards_brackets_and_nearest_is_between() {
    use policy::rounding::{down_f32, inward_f32, nearest_f32, up_f32};
    let mut random = Draws::new(3);
    for _ in 0..100_000 {
        let x = f64::from_bits(random.next());
        if !x.is_finite() || x.abs() > 3e38 {
            continue;
        }
        let (down, near, up) = (down_f32(x), nearest_f32(x), up_f32(x));
        assert!(f64::from(down) <= x && x <= f64::from(up), "{x:e}");
        assert!(near == down || near == up);
        assert!(up == down || up == down.next_up());
    }
    assert_eq!((down_f32(0.9), up_f32(0.9)), (0.9f32, 0.9f32.next_up()));
    assert_eq!((down_f32(0.5), up_f32(0.5)), (0.5, 0.5));
    assert_eq!((down_f32(1e-60), up_f32(1e-60)), (0.0, f32::from_bits(1)));
    assert_eq!((down_f32(-1e-60), up_f32(-1e-60)), (-f32::from_bits(1), 0.0));
    assert_eq!(up_f32(1e39), f32::INFINITY);
    assert_eq!(down_f32(1e39), f32::MAX);
    assert_eq!(inward_f32(Interval { low: 0.4, high: 0.4 }), None);
    // one number is enough
    assert_eq!(inward_f32(Interval { low: 0.5, high: 0.5 }), Some((0.5, 0.5)));
}

/// e from -150 to 100, and an offset that is added whatever number it is.
#[test]
fn an_offset_moves_the_bound_of_an_observation() {
    for offset in [1.0, -1.0, 0.5, 2.0] {
        let folder = Folder::new().replace("scale = 0.2\nclip = [-20.0, 20.0]", &format!("offset = {offset:?}"));
        let bound = folder.policy().features[0].bound;
        assert_eq!((bound.low, bound.high), (offset - 150.0, offset + 100.0));
    }
}

#[test]
fn each_format_rounds_to_its_own_numbers() {
    use policy::Scalar::{F32, F64};
    // 0.9 lies between two of binary32, and is one of binary64
    let (below, above) = (f64::from(0.9_f32), f64::from(0.9_f32.next_up()));
    assert_eq!((F32.down(0.9), F32.nearest(0.9), F32.up(0.9)), (below, below, above));
    assert_eq!((F64.down(0.9), F64.nearest(0.9), F64.up(0.9)), (0.9, 0.9, 0.9));
    for x in [0.0, 0.5, -0.5, 1.0, -3e8] {
        let wide = |x: f32| f64::from(x);
        let of_32 = x as f32;
        assert_eq!(
            (F32.next_down(x), F32.next_up(x)),
            (wide(of_32.next_down()), wide(of_32.next_up()))
        );
        assert_eq!((F64.next_down(x), F64.next_up(x)), (x.next_down(), x.next_up()));
    }
}
