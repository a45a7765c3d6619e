//! The arithmetic that the contract rests on, as operations with expected bits.
//!
//! The expected values are this machine's: Rust computes binary32 and binary64 as IEEE 754 says, without contraction, reassociation or
//! flushed subnormals. A NaN or an infinity does not arise in a checked policy, so no probe gives one.

use std::ops::{Add, Div, Mul, Neg, Sub};

use policy::Scalar;

use crate::program::Literal;

/// One operation on the bits of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Probe {
    operation: u32,
    operands: [u64; 3],
    expected: u64,
}

impl Probe {
    /// A row of the C table; words of a binary64 number with the low one first.
    pub fn row(&self, scalar: Scalar) -> String {
        let bits = |bits: u64| match scalar {
            Scalar::F32 => format!("0x{bits:08X}u"),
            Scalar::F64 => format!("{{ 0x{:08X}u, 0x{:08X}u }}", bits as u32, bits >> 32),
        };
        let [x, y, z] = self.operands.map(bits);
        format!("{{ {}u, {x}, {y}, {z}, {} }},", self.operation, bits(self.expected))
    }
}

/// The numbers that are probed.
pub trait Number:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// Signs, subnormals, the ends of the normal range, numbers that round.
    const VALUES: [Self; 10];
    /// Width of the numbers drawn: of so many digits that a product has some to lose.
    const SPREAD: Self;
    /// One subnormal among them.
    const SMALL: [Self; 3];
    /// Rounded to nearest.
    fn nearest(value: f64) -> Self;
    /// Bits, those of binary32 in the low half.
    fn bits(self) -> u64;
    /// Neither infinite nor NaN.
    fn is_number(self) -> bool;
}

impl Number for f32 {
    const VALUES: [Self; 10] = [
        0.0,
        -0.0,
        1.0,
        -3.0,
        0.1,
        -7.000_001,
        // 2^24 - 1: a sum with it has bits to lose
        16_777_215.0,
        1.0e-40,
        -1.175_494_4e-38,
        2.5e19,
    ];
    const SPREAD: Self = 3.0;
    const SMALL: [Self; 3] = [1.0e-30, 1.0e-10, 1.0e-40];

    fn nearest(value: f64) -> Self {
        value as f32
    }

    fn bits(self) -> u64 {
        self.to_bits().into()
    }

    fn is_number(self) -> bool {
        self.is_finite()
    }
}

impl Number for f64 {
    const VALUES: [Self; 10] = [
        0.0,
        -0.0,
        1.0,
        -3.0,
        0.1,
        -7.000_000_000_000_001,
        // 2^53 - 1: a sum with it has bits to lose
        9_007_199_254_740_991.0,
        1.0e-310,
        -f64::MIN_POSITIVE,
        2.5e150,
    ];
    // not 3: drawn numbers have 24 bits, with 3 as a factor 26, and the product of two such is exact in binary64
    const SPREAD: Self = 3.1;
    const SMALL: [Self; 3] = [1.0e-200, 1.0e-110, 1.0e-310];

    fn nearest(value: f64) -> Self {
        value
    }

    fn bits(self) -> u64 {
        self.to_bits()
    }

    fn is_number(self) -> bool {
        self.is_finite()
    }
}

/// Rounded operations of two numbers; the number of an operation is its place here.
fn binary<T: Number>() -> [fn(T, T) -> T; 4] {
    [|x, y| x + y, |x, y| x - y, |x, y| x * y, |x, y| x / y]
}

/// Operations of three numbers from 4 on: what contraction, reassociation, reciprocals and ignored signs would change.
fn ternary<T: Number>() -> [fn(T, T, T) -> T; 9] {
    [
        |x, y, z| x * y + z,
        |x, y, z| z - x * y,
        |x, y, z| (x + y) + z,
        |x, y, _| (x + y) - x,
        |x, y, z| (x * y) * z,
        |x, y, z| x / y + z / y,
        |x, _, _| x + T::nearest(0.0),
        |x, _, _| -x,
        |x, _, _| x / T::nearest(1.0 / 3.0),
    ]
}

/// Operations from [`FIRST_COMPARISON`] on; the last asks whether the two can be compared at all.
fn comparisons<T: Number>() -> [fn(T, T) -> bool; 5] {
    [
        |x, y| x > y,
        |x, y| x >= y,
        |x, y| x < y,
        |x, y| x <= y,
        |x, y| x.partial_cmp(&y).is_some(),
    ]
}
// the C program has the same numbers in its `switch`; gaps leave room for operations of a kind
const FIRST_COMPARISON: u32 = 16;
const FROM_I32: u32 = 24;
const FROM_U32: u32 = 25;
const SHIFT: u32 = 26;
const PRODUCT: u32 = 27;
const SELECT: u32 = 28;

/// All probes of the format in the order of the table.
pub fn of(scalar: Scalar) -> Vec<Probe> {
    match scalar {
        Scalar::F32 => probes::<f32>(),
        Scalar::F64 => probes::<f64>(),
    }
}

fn probes<T: Number>() -> Vec<Probe> {
    let mut all = Vec::new();
    for x in T::VALUES {
        for y in T::VALUES {
            for (number, operation) in (0..).zip(binary::<T>()) {
                push(&mut all, number, [x, y, T::nearest(0.0)], operation(x, y));
            }
        }
    }
    for [x, y, z] in triples::<T>() {
        for (number, operation) in (4..).zip(ternary::<T>()) {
            push(&mut all, number, [x, y, z], operation(x, y, z));
        }
    }
    compared::<T>(&mut all);
    integers::<T>(&mut all);
    all
}

fn push<T: Number>(all: &mut Vec<Probe>, operation: u32, operands: [T; 3], result: T) {
    // the bits of a NaN differ from machine to machine
    if result.is_number() {
        all.push(Probe {
            operation,
            operands: operands.map(T::bits),
            expected: result.bits(),
        });
    }
}

/// Numbers whose products and sums have digits to lose.
fn triples<T: Number>() -> Vec<[T; 3]> {
    // a convention; drawn, because round numbers have exact products and sums
    let mut bits: u32 = 0x1234_5678;
    let mut draw = || {
        bits = bits.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let share = T::nearest(f64::from(bits >> 8)) * T::nearest(1.0 / 16_777_216.0);
        (share - T::nearest(0.5)) * T::SPREAD
    };
    let mut triples: Vec<[T; 3]> = (0..12).map(|_| [draw(), draw(), draw()]).collect();
    // signs of zero, and a sum that is 0 or 1 in binary32 by its order
    let more = [[-0.0, 0.0, -0.0], [1.0e8, 1.0, -1.0e8]].map(|triple| triple.map(T::nearest));
    triples.extend(more);
    triples.push(T::SMALL);
    triples
}

fn compared<T: Number>(all: &mut Vec<Probe>) {
    // here with NaN and infinities: the sanitiser compares with them, and `-ffinite-math-only` leaves that out
    let mut special = [0.0, -0.0, 1.0, -1.0e-40, f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(T::nearest);
    special[3] = -T::SMALL[2];
    for x in special {
        for y in special {
            for (number, holds) in (FIRST_COMPARISON..).zip(comparisons::<T>()) {
                all.push(Probe {
                    operation: number,
                    operands: [x.bits(), y.bits(), 0],
                    expected: u64::from(holds(x, y)),
                });
            }
        }
    }
}

fn integers<T: Number>(all: &mut Vec<Probe>) {
    for word in [
        0_u32,
        1,
        0x7FFF_FFFF,
        0x8000_0000,
        0xFFFF_FFFF,
        0x0100_0001,
        0x89AB_CDEF,
    ] {
        let operands = [word, word >> 3, 0x00FF_00FF].map(u64::from);
        let answers = [
            (FROM_I32, T::nearest(f64::from(word as i32)).bits()),
            (FROM_U32, T::nearest(f64::from(word >> 8)).bits()),
            (SHIFT, ((word >> 4) ^ (word << 3)).into()),
            (PRODUCT, word.wrapping_mul(word >> 3).wrapping_add(0x00FF_00FF).into()),
            (SELECT, ((word & 0x00FF_00FF) | ((word >> 3) & !0x00FF_00FF)).into()),
        ];
        all.extend(answers.map(|(operation, expected)| Probe {
            operation,
            operands,
            expected,
        }));
    }
}

/// Constants whose decimal text a compiler could read wrongly: subnormal, largest, halfway in the next wider format.
pub fn literals(scalar: Scalar) -> [Literal; 12] {
    let values: [f64; 12] = match scalar {
        Scalar::F32 => [
            1.0e-45,
            -1.0e-40,
            1.175_494_2e-38,
            1.175_494_4e-38,
            3.402_823_5e38,
            0.1,
            -0.3,
            // 2^24 + 1: halfway between two numbers
            16_777_217.0,
            // its shortest digits, read through binary64, give the neighbour
            f64::from(f32::from_bits(0x15AE_43FD)),
            8.589_973e9,
            0.0,
            -0.0,
        ],
        Scalar::F64 => [
            5.0e-324,
            -1.0e-310,
            2.225_073_858_507_201e-308,
            f64::MIN_POSITIVE,
            f64::MAX,
            0.1,
            -0.3,
            // 2^53 + 1: halfway between two numbers
            9_007_199_254_740_993.0,
            6.631_236_846_766e-316,
            1.797_693_134_862_315_5e308,
            0.0,
            -0.0,
        ],
    };
    values.map(|value| Literal::nearest(scalar, value))
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
        let all = probes::<f32>();
        let differs = |probe: &&Probe, answer: Answer| {
            let [x, y, z] = probe.operands.map(|bits| f32::from_bits(bits as u32));
            answer(x, y, z).bits() != probe.expected
        };
        for (operation, answer) in faults {
            let of_kind = all.iter().filter(|probe| probe.operation == operation);
            assert!(of_kind.clone().any(|probe| differs(&probe, answer)), "{operation}");
        }
        let flushed = |probe: &&Probe| {
            probe.operation == 2 && flush(f32::from_bits(probe.expected as u32)).bits() != probe.expected
        };
        assert!(all.iter().any(|probe| flushed(&probe)));
    }

    #[test]
    fn a_literal_that_rounds_twice_through_double_is_among_them() {
        let twice = |value: f32| {
            let double = format!("{value:?}").parse::<f64>();
            double.map(|double| (double as f32).to_bits()) != Ok(value.to_bits())
        };
        assert!(literals(Scalar::F32).into_iter().any(|literal| twice(literal.single())));
    }

    /// The smallest, one in between and the largest subnormal number, the ends of the normal ones, and numbers that no format has.
    #[test]
    fn literals_of_binary64_are_those_that_are_read_wrongly() {
        let values = literals(Scalar::F64).map(|literal| literal.value());
        let subnormal: Vec<f64> = values.iter().copied().filter(|x| x.is_subnormal()).collect();
        assert_eq!(subnormal[0].to_bits(), 1);
        assert!(subnormal[1].is_sign_negative() && subnormal.len() == 4);
        assert_eq!(subnormal[2], f64::MIN_POSITIVE.next_down());
        for x in [f64::MIN_POSITIVE, f64::MAX, 0.1, -0.3, f64::powi(2.0, 53)] {
            assert!(values.contains(&x), "{x:e}");
        }
        assert!(values.iter().any(|x| x.to_bits() == (-0.0_f64).to_bits()));
    }

    #[test]
    fn contraction_and_numbers_rounded_to_binary32_are_told_apart_in_binary64() {
        type Answer = fn(f64, f64, f64) -> f64;
        let faults: [(u32, Answer); 5] = [
            (4, |x, y, z| x.mul_add(y, z)),
            (2, |x, y, _| f64::from((x * y) as f32)),
            (6, |x, y, z| x + (y + z)),
            (9, |x, y, z| (x + z) / y),
            (12, |x, _, _| x * (1.0 / (1.0 / 3.0))),
        ];
        let all = probes::<f64>();
        for (operation, answer) in faults {
            let differs = |probe: &&Probe| {
                let [x, y, z] = probe.operands.map(f64::from_bits);
                probe.operation == operation && answer(x, y, z).bits() != probe.expected
            };
            assert!(all.iter().any(|probe| differs(&probe)), "{operation}");
        }
    }
}
