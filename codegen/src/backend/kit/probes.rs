//! The arithmetic that the contract rests on, as operations with expected bits.
//!
//! The expected values are this machine's: Rust computes binary32 as IEEE 754 says, without contraction, reassociation or
//! flushed subnormals. A NaN or an infinity does not arise in a checked policy, so no probe gives one.

/// One operation on binary32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Probe {
    operation: u32,
    operands: [u32; 3],
    expected: u32,
}

impl Probe {
    /// A row of the C table.
    pub fn row(&self) -> String {
        let Probe {
            operation,
            operands: [x, y, z],
            expected,
        } = self;
        format!("{{ {operation}u, 0x{x:08X}u, 0x{y:08X}u, 0x{z:08X}u, 0x{expected:08X}u }},")
    }
}

/// Signs, subnormals, the ends of the normal range, numbers that round.
const VALUES: [f32; 10] = [
    0.0,
    -0.0,
    1.0,
    -3.0,
    0.1,
    -7.000_001,
    16_777_215.0,
    1.0e-40,
    -1.175_494_4e-38,
    2.5e19,
];

/// Rounded operations of two numbers; the number of an operation is its place here.
const BINARY: [fn(f32, f32) -> f32; 4] = [|x, y| x + y, |x, y| x - y, |x, y| x * y, |x, y| x / y];

/// Operations of three numbers from 4 on: what contraction, reassociation, reciprocals and ignored signs would change.
const TERNARY: [fn(f32, f32, f32) -> f32; 9] = [
    |x, y, z| x * y + z,
    |x, y, z| z - x * y,
    |x, y, z| (x + y) + z,
    |x, y, _| (x + y) - x,
    |x, y, z| (x * y) * z,
    |x, y, z| x / y + z / y,
    |x, _, _| x + 0.0,
    |x, _, _| -x,
    |x, _, _| x / (1.0 / 3.0),
];

/// Operations from [`FIRST_COMPARISON`] on; the last asks whether the two can be compared at all.
const COMPARISONS: [fn(f32, f32) -> bool; 5] = [
    |x, y| x > y,
    |x, y| x >= y,
    |x, y| x < y,
    |x, y| x <= y,
    |x, y| x.partial_cmp(&y).is_some(),
];
const FIRST_COMPARISON: u32 = 16;
const FROM_I32: u32 = 24;
const FROM_U32: u32 = 25;
const SHIFT: u32 = 26;
const PRODUCT: u32 = 27;
const SELECT: u32 = 28;

/// All probes in the order of the table.
pub fn probes() -> Vec<Probe> {
    let mut all = Vec::new();
    for x in VALUES {
        for y in VALUES {
            for (number, operation) in (0..).zip(BINARY) {
                push(&mut all, number, [x, y, 0.0], operation(x, y));
            }
        }
    }
    for [x, y, z] in triples() {
        for (number, operation) in (4..).zip(TERNARY) {
            push(&mut all, number, [x, y, z], operation(x, y, z));
        }
    }
    comparisons(&mut all);
    integers(&mut all);
    all
}

fn push(all: &mut Vec<Probe>, operation: u32, operands: [f32; 3], result: f32) {
    if result.is_finite() {
        all.push(Probe {
            operation,
            operands: operands.map(f32::to_bits),
            expected: result.to_bits(),
        });
    }
}

/// Numbers whose products and sums have digits to lose.
fn triples() -> Vec<[f32; 3]> {
    let mut bits: u32 = 0x1234_5678;
    let mut draw = || {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((bits >> 8) as f32 * (1.0 / 16_777_216.0) - 0.5) * 3.0
    };
    let mut triples: Vec<[f32; 3]> = (0..12).map(|_| [draw(), draw(), draw()]).collect();
    triples.extend([[-0.0, 0.0, -0.0], [1.0e8, 1.0, -1.0e8], [1.0e-30, 1.0e-10, 1.0e-40]]);
    triples
}

fn comparisons(all: &mut Vec<Probe>) {
    let special = [0.0, -0.0, 1.0, -1.0e-40, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    for x in special {
        for y in special {
            for (number, holds) in (FIRST_COMPARISON..).zip(COMPARISONS) {
                all.push(Probe {
                    operation: number,
                    operands: [x.to_bits(), y.to_bits(), 0],
                    expected: u32::from(holds(x, y)),
                });
            }
        }
    }
}

fn integers(all: &mut Vec<Probe>) {
    for word in [0, 1, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0x0100_0001, 0x89AB_CDEF] {
        let operands = [word, word >> 3, 0x00FF_00FF];
        let answers = [
            (FROM_I32, (word as i32 as f32).to_bits()),
            (FROM_U32, ((word >> 8) as f32).to_bits()),
            (SHIFT, (word >> 4) ^ (word << 3)),
            (PRODUCT, word.wrapping_mul(word >> 3).wrapping_add(0x00FF_00FF)),
            (SELECT, (word & 0x00FF_00FF) | ((word >> 3) & !0x00FF_00FF)),
        ];
        all.extend(answers.map(|(operation, expected)| Probe {
            operation,
            operands,
            expected,
        }));
    }
}

/// Constants whose decimal text a compiler could read wrongly: subnormal, largest, halfway in binary64.
pub fn literals() -> [f32; 12] {
    [
        1.0e-45,
        -1.0e-40,
        1.175_494_2e-38,
        1.175_494_4e-38,
        3.402_823_5e38,
        0.1,
        -0.3,
        16_777_217.0,
        f32::from_bits(0x15AE_43FD),
        8.589_973e9,
        0.0,
        -0.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of these faults of a build changes the answer of some probe.
    #[test]
    fn contraction_reassociation_reciprocals_and_flushed_subnormals_are_told_apart() {
        let flush = |x: f32| if x.is_subnormal() { 0.0_f32.copysign(x) } else { x };
        type Answer = fn(f32, f32, f32) -> f32;
        let faults: [(u32, Answer); 6] = [
            (4, |x, y, z| x.mul_add(y, z)),
            (6, |x, y, z| x + (y + z)),
            (7, |_, y, _| y),
            (9, |x, y, z| (x + z) / y),
            (10, |x, _, _| x),
            (12, |x, _, _| x * (1.0 / (1.0 / 3.0))),
        ];
        let all = probes();
        let differs = |probe: &&Probe, answer: Answer| {
            let [x, y, z] = probe.operands.map(f32::from_bits);
            answer(x, y, z).to_bits() != probe.expected
        };
        for (operation, answer) in faults {
            let of_kind = all.iter().filter(|probe| probe.operation == operation);
            assert!(of_kind.clone().any(|probe| differs(&probe, answer)), "{operation}");
        }
        let flushed =
            |probe: &&Probe| probe.operation == 2 && flush(f32::from_bits(probe.expected)).to_bits() != probe.expected;
        assert!(all.iter().any(|probe| flushed(&probe)));
    }

    #[test]
    fn a_literal_that_rounds_twice_through_double_is_among_them() {
        let twice = |value: f32| {
            let double = format!("{value:?}").parse::<f64>();
            double.map(|double| (double as f32).to_bits()) != Ok(value.to_bits())
        };
        assert!(literals().into_iter().any(twice));
    }
}
