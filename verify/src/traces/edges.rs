//! Values at which code goes wrong: ends of ranges, zeros, subnormals, NaN, infinities, extreme ADC codes.

use interp::Sample;
use policy::{Policy, Signal};

use super::rng::Rng;
use super::sample_of;

/// The edge samples of one signal, split by the signal's plausible range.
#[derive(Debug, Clone)]
pub(super) struct Edges {
    inside: Vec<Sample>,
    outside: Vec<Sample>,
}

/// Bit patterns of NaN: quiet and signalling, both signs, several payloads.
const NANS: [u32; 7] = [
    0x7fc0_0000,
    0xffc0_0000,
    0x7f80_0001,
    0xff80_0001,
    0x7fff_ffff,
    0xffff_ffff,
    0x7fc0_1234,
];

impl Edges {
    /// The edges of signal `index`: its own, and those of the mapping's validity if it is the load current.
    pub fn new(policy: &Policy, index: usize) -> Self {
        let mapping = policy.mapping.as_ref().filter(|mapping| mapping.load_current == index);
        let valid = mapping.map(|mapping| mapping.valid_i_out);
        let ends: Vec<f64> = valid.iter().flat_map(|valid| [valid.low, valid.high]).collect();
        Self::of_signal(&policy.signals[index], &ends)
    }

    fn of_signal(signal: &Signal, more_ends: &[f64]) -> Self {
        let ends = [&[signal.range.low, signal.range.high], more_ends].concat();
        let all = if signal.adc.is_some() {
            codes(signal, &ends)
        } else {
            floats(&ends)
        };
        let plausible = |sample: &Sample| match (*sample, signal.adc) {
            (Sample::Physical(x), _) => {
                let x = f64::from(x);
                x >= signal.range.low && x <= signal.range.high
            }
            (Sample::Code(n), Some(adc)) => {
                // in the format of the contract
                let x = f64::from(adc.gain as f32 * n as f32 + adc.offset as f32);
                x >= signal.range.low && x <= signal.range.high
            }
            (Sample::Code(_), None) => false,
        };
        let (inside, outside) = all.into_iter().partition(plausible);
        Self { inside, outside }
    }

    /// An edge within the plausible range; `default` if there is none.
    pub fn inside(&self, rng: &mut Rng, default: Sample) -> Sample {
        rng.pick(&self.inside, default)
    }

    /// An edge outside the plausible range; `default` if the ADC cannot leave it.
    pub fn outside(&self, rng: &mut Rng, default: Sample) -> Sample {
        rng.pick(&self.outside, default)
    }

    pub fn any(&self, rng: &mut Rng, default: Sample) -> Sample {
        let n = rng.below(self.inside.len() + self.outside.len());
        self.inside
            .iter()
            .chain(&self.outside)
            .nth(n)
            .copied()
            .unwrap_or(default)
    }
}

fn floats(ends: &[f64]) -> Vec<Sample> {
    let mut values = vec![
        0.0,
        -0.0,
        f32::from_bits(1),
        -f32::from_bits(1),
        f32::MIN_POSITIVE,
        -f32::MIN_POSITIVE,
        f32::MIN_POSITIVE.next_down(),
        -f32::MIN_POSITIVE.next_down(),
        1.0,
        -1.0,
        1e30,
        -1e30,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
    ];
    for end in ends.iter().map(|end| *end as f32) {
        let up = end.next_up();
        let down = end.next_down();
        values.extend([end, up, down, up.next_up(), down.next_down(), -end]);
    }
    values.extend(NANS.map(f32::from_bits));
    values.into_iter().map(Sample::Physical).collect()
}

fn codes(signal: &Signal, ends: &[f64]) -> Vec<Sample> {
    let mut codes = vec![0, 1, -1, i32::MIN, i32::MIN + 1, i32::MAX, i32::MAX - 1];
    for n in [8, 10, 12, 14, 16, 24] {
        codes.extend([(1 << n) - 1, 1 << n, (1 << n) + 1, -(1 << n), -(1 << n) - 1]);
    }
    for &end in ends {
        if let Sample::Code(code) = sample_of(signal, end) {
            codes.extend((-2..=2).map(|n| code.saturating_add(n)));
        }
    }
    codes.into_iter().map(Sample::Code).collect()
}

#[cfg(test)]
mod tests {
    use policy::{Adc, Interval};

    use super::*;

    fn signal(adc: Option<Adc>) -> Signal {
        Signal {
            name: "v".into(),
            unit: "V".into(),
            range: Interval { low: 0.1, high: 0.9 },
            adc,
        }
    }

    #[test]
    fn edges_lie_on_both_sides_of_the_range() {
        let edges = Edges::of_signal(&signal(None), &[]);
        // 0.1_f32 is above 0.1, 0.9_f32 below 0.9
        assert!(edges.inside.contains(&Sample::Physical(0.1)) && edges.inside.contains(&Sample::Physical(0.9)));
        assert!(edges.outside.contains(&Sample::Physical(0.1_f32.next_down())));
        assert!(
            edges
                .outside
                .iter()
                .any(|s| matches!(s, Sample::Physical(x) if x.is_nan()))
        );
        assert!(
            edges
                .inside
                .iter()
                .all(|s| matches!(s, Sample::Physical(x) if x.is_finite()))
        );
    }

    #[test]
    fn codes_reach_the_ends_of_the_range_and_of_the_type() {
        let edges = Edges::of_signal(
            &signal(Some(Adc {
                gain: 1e-3,
                offset: 0.0,
            })),
            &[],
        );
        assert!(edges.inside.contains(&Sample::Code(101)) && edges.inside.contains(&Sample::Code(899)));
        assert!(edges.outside.contains(&Sample::Code(i32::MIN)) && edges.outside.contains(&Sample::Code(98)));
    }
}
