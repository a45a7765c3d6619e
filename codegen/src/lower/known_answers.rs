//! Known answers for `self_test`: what the contract's arithmetic gives on pseudo-random observations of the box.
//!
//! They are computed on the program's own loops and tables, node by node. So they catch a compiler, flag or byte order that
//! changes the arithmetic on the target; that the lowering itself is right is shown elsewhere, against the interpreter.
//!
//! ```text
//!  seed ─► observation in the box ─► loops over tables ─► Q values ─► CRC of their bits     16 times, here and in `self_test`
//! ```
//!
//! The one invariant: draw and arithmetic are those of the generated code, operation by operation, in the format of the policy.

use std::collections::BTreeMap;

use policy::scales::{power_of_two, round_half_up};
use policy::{Policy, Scalar};

use crate::activation::{Number, text_of};
use crate::crc::crc32_words;
use crate::program::{
    Arithmetic, Buffer, Element, From, IntegerCode, Kept, Literal, Loop, Network, Sink, Store, Sums, Table, words,
};

/// Number of vectors.
// a convention: they are for compiler, flags and byte order, which show at once; flipped tables are for the CRC
pub const VECTORS: usize = 16;
/// Seed of the generator in `self_test`.
// a convention: the upper half of a published multiplier
pub const SEED: u32 = 0x2545_F491;
/// Multiplier and increment of the generator (Numerical Recipes' LCG).
pub const LCG: (u32, u32) = (1_664_525, 1_013_904_223);
/// Scale from the generator's upper 24 bits to 0..1, exact.
// 24 bits, because a binary32 number holds no more of them
pub const UNIT: f64 = 1.0 / 16_777_216.0;

/// Draws the observations as `self_test` will and computes the answers: the tables of answers, lower ends and widths of the
/// box.
pub fn lower(policy: &Policy, network: &Network, tables: &[Table]) -> [Table; 3] {
    let scalar = policy.numeric_format.scalar();
    let bounds = policy.features.iter().map(|feature| feature.bound);
    let observation_box: Vec<(Literal, Literal)> = bounds
        .map(|bound| {
            // a bound is a binary32 number
            let width = Literal::nearest(scalar, bound.high - bound.low);
            (Literal::nearest(scalar, bound.low), width)
        })
        .collect();
    let answers = match &network.arithmetic {
        Arithmetic::Real {
            scalar: Scalar::F64, ..
        } => answers(&observation_box, |x: &[f64]| {
            evaluate(network, tables, &Real(false), x.to_vec())
        }),
        Arithmetic::Real { fused, .. } => answers(&observation_box, |x: &[f32]| {
            evaluate(network, tables, &Real(*fused), x.to_vec())
        }),
        Arithmetic::Integer(code) => answers(&observation_box, |x: &[f32]| {
            let outputs = evaluate(network, tables, &Integers, quantised(code, x));
            // a streamed last layer leaves its sums: they are cut here, not where they are stored
            let q = |output: &i32| (output >> code.output_shift) as f32 * code.q_unit.single();
            outputs.iter().map(q).collect()
        }),
    };
    let column = |name: &str, pick: fn(&(Literal, Literal)) -> Literal| {
        Table::plain(name, Element::Float(scalar), observation_box.iter().map(pick))
    };
    [
        Table::words("answers", &answers),
        column("box_low", |(low, _)| *low),
        column("box_width", |(_, width)| *width),
    ]
}

/// What the nodes mean in an arithmetic of values of this type.
trait Machine<T> {
    fn constant(&self, literal: Literal) -> T;
    /// `sum + weight * x`
    fn accumulated(&self, sum: T, weight: T, x: T) -> T;
    /// What becomes of a sum.
    fn stored(&self, store: &Store, sum: T) -> T;
}

/// Floats, and whether products are added with one rounding.
struct Real(bool);

impl<T: Number> Machine<T> for Real {
    fn constant(&self, literal: Literal) -> T {
        T::nearest(literal.value())
    }

    fn accumulated(&self, sum: T, weight: T, x: T) -> T {
        if self.0 { weight.fused(x, sum) } else { sum + weight * x }
    }

    fn stored(&self, store: &Store, sum: T) -> T {
        sum.activated(&*text_of(store.activation))
    }
}

/// Integers; sums wrap nowhere, as the scales prove.
struct Integers;

impl Machine<i32> for Integers {
    fn constant(&self, literal: Literal) -> i32 {
        literal.value() as i32
    }

    fn accumulated(&self, sum: i32, weight: i32, x: i32) -> i32 {
        sum.wrapping_add(weight.wrapping_mul(x))
    }

    fn stored(&self, store: &Store, sum: i32) -> i32 {
        let Some(cut) = store.cut else { return sum };
        text_of(store.activation).integer(sum, &cut)
    }
}

fn quantised(code: &IntegerCode, observation: &[f32]) -> Vec<i32> {
    let inputs = code.inputs.iter().zip(observation);
    let integer = inputs.map(|(input, o)| {
        // 150: the exponent field of a number whose mantissa is an integer
        let integer = round_half_up(f64::from(*o) * power_of_two(150 - input.unshifted)) as i32;
        integer.clamp(input.low, input.high)
    });
    integer.collect()
}

/// The outputs of the network's loops.
fn evaluate<T: Copy + Default>(
    network: &Network,
    tables: &[Table],
    machine: &impl Machine<T>,
    input: Vec<T>,
) -> Vec<T> {
    let read = |name: &str, index: usize| {
        let name = format!("{name}{index}");
        let table = tables.iter().find(|table| table.name == name);
        table.map_or_else(Default::default, |table| table.values.iter())
    };
    let layers = 0..network.layers.len();
    let mut run = Run {
        network,
        machine,
        weights: layers.clone().map(|index| read("weights", index)).collect(),
        biases: layers.map(|index| read("bias", index)).collect(),
        buffers: BTreeMap::from([(Buffer::Input, input)]),
        sums: Vec::new(),
        from: Buffer::Input,
        to: Buffer::Output,
        at: 0,
    };
    run.all(&network.loops);
    run.buffers.remove(&Buffer::Output).unwrap_or_default()
}

/// The network under way: tables are read on, as a pointer would.
struct Run<'a, T, M> {
    network: &'a Network,
    machine: &'a M,
    weights: Vec<std::slice::Iter<'a, Literal>>,
    biases: Vec<std::slice::Iter<'a, Literal>>,
    buffers: BTreeMap<Buffer, Vec<T>>,
    /// Sums made last, or the outputs made of them.
    sums: Vec<T>,
    from: Buffer,
    to: Buffer,
    /// Next place in `to`.
    at: usize,
}

impl<T: Copy + Default, M: Machine<T>> Run<'_, T, M> {
    fn all(&mut self, loops: &[Loop]) {
        for node in loops {
            match node {
                Loop::Layer(layer) => {
                    (self.from, self.to, self.at) = (layer.from, layer.to, 0);
                    self.all(&layer.body);
                }
                Loop::Repeat { count, body, .. } => (0..*count).for_each(|_| self.all(body)),
                Loop::Begin(layer) => {
                    let biases = self.biases[*layer].by_ref().map(|bias| self.machine.constant(*bias));
                    self.buffers.insert(Buffer::Output, biases.collect());
                }
                Loop::Sums(sums) => self.sum(sums),
                Loop::Store(store) => self.store(store),
                Loop::Add(add) => {
                    let x = std::mem::take(&mut self.sums);
                    let mut sums = self.buffers.remove(&Buffer::Output).unwrap_or_default();
                    for sum in &mut sums {
                        self.products(add.layer, &x, std::slice::from_mut(sum));
                    }
                    self.buffers.insert(Buffer::Output, sums);
                }
                Loop::Pad { buffer, to, .. } => self.buffers.entry(*buffer).or_default().resize(*to, T::default()),
            }
        }
    }

    fn sum(&mut self, node: &Sums) {
        let mut sums: Vec<T> = match node.from {
            From::Bias => {
                let biases = self.biases[node.layer].by_ref().take(node.rows);
                biases.map(|bias| self.machine.constant(*bias)).collect()
            }
            From::Sums => {
                let all = self.buffers.get(&self.to).map_or(&[][..], Vec::as_slice);
                all.iter().skip(self.at).take(node.rows).copied().collect()
            }
        };
        let x = self.buffers.get(&self.from).map_or(&[][..], Vec::as_slice);
        let x: Vec<T> = x.iter().take(node.inputs).copied().collect();
        self.products(node.layer, &x, &mut sums);
        self.sums = sums;
        if node.kept != Kept::Registers {
            self.write();
        }
    }

    /// Adds to each sum the products of all inputs, whose last group is filled with zeros.
    fn products(&mut self, layer: usize, x: &[T], sums: &mut [T]) {
        let lanes = &self.network.lanes;
        for group in x.chunks(lanes.len()) {
            for sum in sums.iter_mut() {
                for lane in lanes {
                    let weight = self.weights[layer].next().map(|weight| self.machine.constant(*weight));
                    // the last group may lack inputs: these are the zeros of `Pad`
                    let x = group.get(*lane).copied().unwrap_or_default();
                    *sum = self.machine.accumulated(*sum, weight.unwrap_or_default(), x);
                }
            }
        }
    }

    fn store(&mut self, store: &Store) {
        let machine = self.machine;
        let stored = |value: &mut T| *value = machine.stored(store, *value);
        if store.to == Sink::InPlace {
            self.buffers.entry(self.to).or_default().iter_mut().for_each(stored);
            return;
        }
        self.sums.iter_mut().for_each(stored);
        if store.to != Sink::Registers {
            self.write();
        }
    }

    fn write(&mut self) {
        let buffer = self.buffers.entry(self.to).or_default();
        let end = self.at + self.sums.len();
        buffer.resize(buffer.len().max(end), T::default());
        buffer[self.at..end].copy_from_slice(&self.sums);
        self.at = end;
    }
}

fn answers<T: Number>(observation_box: &[(Literal, Literal)], q_values: impl Fn(&[T]) -> Vec<T>) -> Vec<u32> {
    let mut random = SEED;
    let mut answers = Vec::with_capacity(VECTORS);
    for _ in 0..VECTORS {
        let mut values: Vec<T> = Vec::with_capacity(observation_box.len());
        for (low, width) in observation_box {
            random = random.wrapping_mul(LCG.0).wrapping_add(LCG.1);
            // 24 bits are exact
            let share = T::nearest(f64::from(random >> 8) * UNIT);
            values.push(T::nearest(low.value()) + T::nearest(width.value()) * share);
        }
        let q = q_values(&values).into_iter();
        // a word for a whole row: of the bits and not of the action, which stays the same through most faults
        answers.push(crc32_words(q.flat_map(|q| words(T::SCALAR, q.wide()))));
    }
    answers
}
