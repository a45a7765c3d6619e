//! Builds the tree of loops of a network from what was decided about each layer.
//!
//! ```text
//!  plan ─► whole           Layer { Repeat full { Sums, Store }, Repeat rest { Sums, Store } }
//!          in_pieces       Begin, Repeat { Layer block, Layer what it adds }     floats, last layer streamed
//!          added_at_once   Layer { Begin, Repeat { Sums, Store, Add } }          integers, last layer streamed
//! ```
//!
//! In: a plan for each layer (`lower::real`, `lower::integer`) and how a language writes loops. Out: the tree and the length
//! of each buffer. The one invariant: the nodes read every table of `lower::tables` once, in its order.

use policy::Activation;

use crate::program::{Add, Buffer, Cut, From, Kept, Layer, Loop, Part, Piece, Shape, Sink, Store, Sums, Turns};

/// What was decided about a layer.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Name and size.
    pub shape: Shape,
    /// Outputs side by side, `1..=outputs`.
    pub rows: usize,
    /// Inputs taken at a time: all, or the block of outputs that the layer before has just made.
    pub chunk: usize,
    /// Where sums are kept.
    pub kept: Kept,
    /// Whether its blocks are there in assembly, too.
    pub has_assembly: bool,
    /// Behind the layer.
    pub activation: Activation,
    /// What is kept of its sums, in integers.
    pub cut: Option<Cut>,
}

impl Plan {
    /// Whether the layer takes the outputs of the one before block by block, so that those are never there all at once.
    pub fn is_streamed(&self) -> bool {
        self.chunk < self.shape.inputs
    }

    /// Count and height of the blocks of outputs.
    pub fn blocks(&self) -> Vec<(Part, usize, usize)> {
        blocks(self.shape.outputs, self.rows)
    }

    /// Count and length of the blocks of inputs.
    pub fn chunks(&self) -> Vec<(Part, usize, usize)> {
        blocks(self.shape.inputs, self.chunk)
    }
}

/// `length` in blocks of `height`: count and height of the full ones, then the shorter last one if there is one.
fn blocks(length: usize, height: usize) -> Vec<(Part, usize, usize)> {
    let rest = length % height;
    std::iter::once((Part::Full, length / height, height))
        .chain((rest > 0).then_some((Part::Rest, 1, rest)))
        .collect()
}

/// How loops are written in a language.
#[derive(Debug, Clone)]
pub struct Style {
    /// Inputs of a group.
    pub lanes: usize,
    /// Groups of inputs written out in a turn.
    pub unrolled: usize,
    /// Sums of a last layer of integers written out in a turn, 0 if one function takes them all.
    pub stretch: fn(usize) -> usize,
    /// Integers: buffers have whole groups, and a streamed layer takes each block in the function that makes it.
    pub is_integer: bool,
}

/// The tree, and the length of every buffer.
pub fn build(plans: &[Plan], style: &Style) -> (Vec<Loop>, Vec<(Buffer, usize)>) {
    let builder = Builder { plans, style };
    let (before, streamed) = match plans {
        // streamed or not, the last two belong together: the one makes blocks, the other takes them
        [before @ .., _, last] if last.is_streamed() => (before.len(), true),
        _ => (plans.len(), false),
    };
    let first = plans.first().map_or(0, |plan| plan.shape.inputs);
    let mut buffers = vec![(Buffer::Input, builder.length(first))];
    let mut loops = Vec::new();
    loops.extend(builder.padding(Buffer::Input, first));
    for (index, plan) in plans.iter().enumerate().take(before) {
        let to = builder.to(index);
        loops.push(builder.whole(index));
        if to != Buffer::Output {
            buffers.push((to, builder.length(plan.shape.outputs)));
            loops.extend(builder.padding(to, plan.shape.outputs));
        }
    }
    if let ([.., last], true) = (plans, streamed) {
        if style.is_integer {
            loops.push(builder.added_at_once(before));
        } else {
            // the sums of a block of floats fill the registers, so it goes through a buffer of its own; the few sums
            // of a block of integers stay where they are
            buffers.push((Buffer::Block, last.chunk));
            loops.extend(builder.in_pieces(before));
        }
    }
    let outputs = plans.last().map_or(0, |plan| plan.shape.outputs);
    buffers.push((Buffer::Output, outputs));
    (loops, buffers)
}

struct Builder<'a> {
    plans: &'a [Plan],
    style: &'a Style,
}

impl Builder<'_> {
    fn length(&self, values: usize) -> usize {
        values.next_multiple_of(self.style.lanes)
    }

    fn padding(&self, buffer: Buffer, from: usize) -> Option<Loop> {
        let to = self.length(from);
        (from < to).then_some(Loop::Pad { buffer, from, to })
    }

    fn from(&self, index: usize) -> Buffer {
        match index {
            0 => Buffer::Input,
            _ => Buffer::Hidden(index - 1),
        }
    }

    fn to(&self, index: usize) -> Buffer {
        if index + 1 == self.plans.len() {
            Buffer::Output
        } else {
            Buffer::Hidden(index)
        }
    }

    /// A layer from all of its inputs to all of its outputs.
    fn whole(&self, index: usize) -> Loop {
        let plan = &self.plans[index];
        Loop::Layer(Layer {
            index,
            piece: None,
            inputs: plan.shape.inputs,
            outputs: plan.shape.outputs,
            from: self.from(index),
            to: self.to(index),
            next: None,
            has_assembly: plan.has_assembly,
            body: self.blocks(index, plan.shape.inputs, From::Bias, &plan.blocks()),
        })
    }

    /// The last two layers in floats: a block of outputs of the one, then what it adds to the sums of the other. Half of the
    /// stack of a whole layer of outputs.
    fn in_pieces(&self, index: usize) -> Vec<Loop> {
        let (block, last) = (&self.plans[index], &self.plans[index + 1]);
        let piece = |size: usize, is_last: bool| {
            let (index, plan) = if is_last { (index + 1, last) } else { (index, block) };
            let (inputs, outputs) = if is_last {
                (size, last.shape.outputs)
            } else {
                (block.shape.inputs, size)
            };
            let (from, blocks) = if is_last {
                (From::Sums, last.blocks())
            } else {
                (From::Bias, vec![(Part::Full, 1, size)])
            };
            Loop::Layer(Layer {
                index,
                piece: Some(Piece {
                    rows: size,
                    // of a full block, for the shorter last one, too: its tables begin behind whole blocks
                    weights: last.chunk * if is_last { outputs } else { inputs },
                    biases: if is_last { 0 } else { last.chunk },
                }),
                inputs,
                outputs,
                from: if is_last { Buffer::Block } else { self.from(index) },
                to: if is_last { Buffer::Output } else { Buffer::Block },
                next: None,
                has_assembly: plan.has_assembly,
                body: self.blocks(index, inputs, from, &blocks),
            })
        };
        let repeats = last.chunks().into_iter().map(|(blocks, count, size)| Loop::Repeat {
            blocks,
            count,
            body: vec![piece(size, false), piece(size, true)],
        });
        std::iter::once(Loop::Begin(index + 1)).chain(repeats).collect()
    }

    /// The last two layers in integers: each block of outputs goes from registers into all sums of the last layer.
    fn added_at_once(&self, index: usize) -> Loop {
        let (block, last) = (&self.plans[index], &self.plans[index + 1]);
        let repeats = block.blocks().into_iter().map(|(blocks, count, rows)| Loop::Repeat {
            blocks,
            count,
            body: vec![
                self.sums(index, rows, block.shape.inputs, From::Bias),
                self.store(index, rows, Sink::Registers),
                Loop::Add(Add {
                    layer: index + 1,
                    inputs: rows,
                    // two outputs without a sign go into a word with a shift and an or
                    is_positive: block.activation.is_rectifier(),
                    turns: turns(last.shape.outputs, (self.style.stretch)(last.shape.outputs)),
                }),
            ],
        });
        Loop::Layer(Layer {
            index,
            piece: None,
            inputs: block.shape.inputs,
            outputs: last.shape.outputs,
            from: self.from(index),
            to: Buffer::Output,
            next: Some(index + 1),
            has_assembly: block.has_assembly,
            body: std::iter::once(Loop::Begin(index + 1)).chain(repeats).collect(),
        })
    }

    fn blocks(&self, index: usize, inputs: usize, from: From, blocks: &[(Part, usize, usize)]) -> Vec<Loop> {
        let plan = &self.plans[index];
        let is_kept = plan.kept == Kept::Registers;
        let sink = match self.to(index) {
            // what goes on to a layer fits 16 bits, as the scales prove; Q values need all of theirs
            Buffer::Hidden(_) if self.style.is_integer => Sink::Halves,
            _ => Sink::Sums,
        };
        let mut body: Vec<Loop> = Vec::new();
        for (part, count, rows) in blocks {
            let sums = self.sums(index, *rows, inputs, from);
            let store = is_kept.then(|| self.store(index, *rows, sink));
            body.push(Loop::Repeat {
                blocks: *part,
                count: *count,
                body: std::iter::once(sums).chain(store).collect(),
            });
        }
        // sums in memory are outputs already; a pass over all of them can be vectorised
        if !is_kept && !plan.activation.is_identity() {
            body.push(self.store(index, plan.shape.outputs, Sink::InPlace));
        }
        body
    }

    fn sums(&self, layer: usize, rows: usize, inputs: usize, from: From) -> Loop {
        Loop::Sums(Sums {
            layer,
            rows,
            inputs,
            from,
            kept: self.plans[layer].kept,
            turns: turns(inputs.div_ceil(self.style.lanes), self.style.unrolled),
        })
    }

    fn store(&self, layer: usize, rows: usize, to: Sink) -> Loop {
        let Plan { activation, cut, .. } = self.plans[layer];
        Loop::Store(Store {
            rows,
            activation,
            cut,
            to,
        })
    }
}

/// Turns of `width` that make up `total`, then a shorter one.
fn turns(total: usize, width: usize) -> Vec<Turns> {
    // a width is 1 or more, as heights and stretches are: no division by zero
    let turns = [(total / width, width), (1, total % width)];
    let some = turns.into_iter().filter(|(count, width)| count * width > 0);
    some.map(|(count, width)| Turns { count, width }).collect()
}
