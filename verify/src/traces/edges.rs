//! Values at which code goes wrong: ends of ranges, zeros, subnormals, NaN, infinities, extreme ADC codes.

use interp::Sample;
use policy::{Policy, Scalar, Signal};
use random::{Random, SplitMix};

use super::{physical, sample_of};

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

/// The same of binary64.
const WIDE_NANS: [u64; 7] = [
    0x7ff8_0000_0000_0000,
    0xfff8_0000_0000_0000,
    0x7ff0_0000_0000_0001,
    0xfff0_0000_0000_0001,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_ffff,
    0x7ff8_0000_1234_0000,
];

impl Edges {
    /// The edges of signal `index`: its own, and those of the mapping's validity if it is the load current.
    pub fn new(policy: &Policy, index: usize) -> Self {
        let mappings = policy.paths().into_iter().filter_map(|path| path.mapping);
        let valid = mappings
            .filter(|mapping| mapping.load_current == index)
            .map(|mapping| mapping.valid_i_out);
        let ends: Vec<f64> = valid.flat_map(|valid| [valid.low, valid.high]).collect();
        Self::of_signal(policy.numeric_format.scalar(), &policy.signals[index], &ends)
    }

    fn of_signal(scalar: Scalar, signal: &Signal, more_ends: &[f64]) -> Self {
        // where the mapping's range ends a status bit changes, too
        let ends = [&[signal.range.low, signal.range.high], more_ends].concat();
        let all = if signal.adc.is_some() {
            codes(scalar, signal, &ends)
        } else {
            floats(scalar, &ends)
        };
        let within = |x: f64| x >= signal.range.low && x <= signal.range.high;
        let plausible = |sample: &Sample| match (*sample, signal.adc) {
            (Sample::Physical(x), _) => within(f64::from(x)),
            (Sample::Wide(x), _) => within(x),
            (Sample::Code(n), Some(adc)) => {
                // in the format of the contract
                let [gain, n, offset] = [adc.gain, f64::from(n), adc.offset].map(|x| scalar.nearest(x));
                within(scalar.nearest(scalar.nearest(gain * n) + offset))
            }
            (Sample::Code(_), None) => false,
        };
        let (inside, outside) = all.into_iter().partition(plausible);
        Self { inside, outside }
    }

    /// An edge within the plausible range; `default` if there is none.
    pub fn inside(&self, rng: &mut SplitMix, default: Sample) -> Sample {
        rng.pick(&self.inside, default)
    }

    /// An edge outside the plausible range; `default` if the ADC cannot leave it.
    pub fn outside(&self, rng: &mut SplitMix, default: Sample) -> Sample {
        rng.pick(&self.outside, default)
    }

    pub fn any(&self, rng: &mut SplitMix, default: Sample) -> Sample {
        let n = rng.below(self.inside.len() + self.outside.len());
        self.inside
            .iter()
            .chain(&self.outside)
            .nth(n)
            .copied()
            .unwrap_or(default)
    }
}

fn floats(scalar: Scalar, ends: &[f64]) -> Vec<Sample> {
    let (normal, nans) = match scalar {
        Scalar::F32 => (
            f64::from(f32::MIN_POSITIVE),
            NANS.map(|bits| Sample::Physical(f32::from_bits(bits))),
        ),
        Scalar::F64 => (
            f64::MIN_POSITIVE,
            WIDE_NANS.map(|bits| Sample::Wide(f64::from_bits(bits))),
        ),
    };
    let infinity = f64::INFINITY;
    let (up, down) = (|x: f64| scalar.next_up(x), |x: f64| scalar.next_down(x));
    let mut values = vec![
        0.0,
        -0.0,
        up(0.0),
        down(0.0),
        normal,
        -normal,
        down(normal),
        -down(normal),
        1.0,
        -1.0,
        1e30,
        -1e30,
        down(infinity),
        up(-infinity),
        infinity,
        -infinity,
    ];
    // one and two units on either side: the range is rounded inwards, and the contract compares with >= and <=
    for end in ends.iter().map(|end| scalar.nearest(*end)) {
        values.extend([end, up(end), down(end), up(up(end)), down(down(end)), -end]);
    }
    let numbers = values.into_iter().map(|x| physical(scalar, x));
    numbers.chain(nans).collect()
}

fn codes(scalar: Scalar, signal: &Signal, ends: &[f64]) -> Vec<Sample> {
    let mut codes = vec![0, 1, -1, i32::MIN, i32::MIN + 1, i32::MAX, i32::MAX - 1];
    // widths of converters, and 24 bits up to which an integer is a binary32 number
    for n in [8, 10, 12, 14, 16, 24] {
        codes.extend([(1 << n) - 1, 1 << n, (1 << n) + 1, -(1 << n), -(1 << n) - 1]);
    }
    for &end in ends {
        if let Sample::Code(code) = sample_of(scalar, signal, end) {
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
        let edges = Edges::of_signal(Scalar::F32, &signal(None), &[]);
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
            Scalar::F32,
            &signal(Some(Adc {
                gain: 1e-3,
                offset: 0.0,
                bits: None,
            })),
            &[],
        );
        assert!(edges.inside.contains(&Sample::Code(101)) && edges.inside.contains(&Sample::Code(899)));
        assert!(edges.outside.contains(&Sample::Code(i32::MIN)) && edges.outside.contains(&Sample::Code(98)));
    }
}
