//! Loops over floats: functions of the layers, and the statements of `q_values`.
//!
//! ```text
//!  for (block ...) {                       Repeat
//!      s0 = bias[0]; s1 = bias[1]; ...     Sums: rows side by side, in variables; or in the output array, or in vectors
//!      for (i ...) {
//!          s0 = s0 + w[0] * x[i]; ...
//!          w = &w[rows];
//!      }
//!      out[0] = activation(s0); ...        Store
//!      bias, out move on
//!  }
//! ```
//!
//! In: `x`, and tables in reading order. Out: `y`. The one invariant: `w`, `bias` and `out` only ever move on by what was read or
//! written, so the places in the tables are nowhere computed but where a piece of a layer begins.

use policy::Scalar;

use super::number;
use super::text::Text;
use crate::activation::{C, text_of};
use crate::assembly;
use crate::assembly::real::RealKernel;
use crate::program::{Arithmetic, Buffer, Kept, Layer, Loop, Part, Program, Store, Sums};

/// Functions of the layers.
pub fn functions(program: &Program) -> Vec<String> {
    let printer = Printer::new(program);
    let mut text = Text::default();
    for layer in program.network.pieces() {
        printer.function(layer, &mut text);
    }
    text.lines
}

/// Declarations and statements of `q_values`.
pub fn calls(program: &Program) -> Vec<String> {
    let printer = Printer::new(program);
    let mut text = Text::default();
    for (buffer, length) in &program.network.buffers {
        if matches!(buffer, Buffer::Hidden(_) | Buffer::Block) {
            text.line(format!("{} {}[{length}];", printer.kind, place(*buffer)));
        }
    }
    for node in &program.network.loops {
        match node {
            // the first block takes its sums from there, the others from where the one before left them: nothing is copied
            Loop::Begin(last) => text.line(format!("const {} *sums = {}_bias{last};", printer.kind, program.name)),
            Loop::Repeat { count, .. } if *count > 1 => text.line("uint32_t block;"),
            _ => {}
        }
    }
    let mut full = 0;
    for node in &program.network.loops {
        match node {
            Loop::Layer(layer) => text.line(printer.call(layer)),
            Loop::Repeat { blocks, count, body } => {
                let index = match (blocks, count) {
                    // the shorter block stands behind the full ones
                    (Part::Rest, _) => format!("{full}u"),
                    (Part::Full, 1) => "0u".to_owned(),
                    (Part::Full, _) => "block".to_owned(),
                };
                full = *count;
                let pieces = body.iter().filter_map(|node| printer.piece(node, &index));
                let moved = (*blocks == Part::Full).then(|| "sums = q;".to_owned());
                let lines: Vec<String> = pieces.chain(moved).collect();
                if *count > 1 {
                    text.count("block", 0, *count, |text| text.lines(lines));
                } else {
                    text.lines(lines);
                }
            }
            Loop::Begin(_) | Loop::Sums(_) | Loop::Store(_) | Loop::Add(_) | Loop::Pad { .. } => {}
        }
    }
    text.lines
}

fn place(buffer: Buffer) -> String {
    match buffer {
        Buffer::Input => "observation".to_owned(),
        Buffer::Hidden(index) => format!("hidden{index}"),
        Buffer::Block => "part".to_owned(),
        Buffer::Output => "q".to_owned(),
    }
}

fn function(layer: &Layer) -> String {
    match layer.piece {
        None => format!("layer{}", layer.index),
        Some(piece) => format!("layer{}_{}", layer.index, piece.rows),
    }
}

struct Printer<'a> {
    program: &'a Program,
    /// Prefix of names, and of macros.
    n: &'a str,
    u: String,
    names: C<'a>,
    /// Type of sums and values.
    kind: &'static str,
}

impl<'a> Printer<'a> {
    fn new(program: &'a Program) -> Self {
        Self {
            program,
            n: &program.name,
            u: program.name.to_uppercase(),
            names: number::names(program),
            kind: number::kind(program.scalar()).name,
        }
    }

    /// The call of a whole layer.
    fn call(&self, layer: &Layer) -> String {
        let (from, to) = (place(layer.from), place(layer.to));
        format!("{}_{}({from}, {to});", self.n, function(layer))
    }

    /// The call of a piece of a layer, for the block of that index.
    fn piece(&self, node: &Loop, block: &str) -> Option<String> {
        let Loop::Layer(layer) = node else { return None };
        let (n, index, piece) = (self.n, layer.index, layer.piece?);
        let sums = match layer.from {
            Buffer::Block => "sums".to_owned(),
            _ => format!("&{n}_bias{index}[{block} * {}u]", piece.biases),
        };
        let (from, to, weights) = (place(layer.from), place(layer.to), piece.weights);
        Some(format!(
            "{n}_{}({from}, {to}, &{n}_weights{index}[{block} * {weights}u], {sums});",
            function(layer)
        ))
    }

    fn function(&self, layer: &Layer, text: &mut Text) {
        let Self {
            n, u, kind, program, ..
        } = self;
        let shape = &program.network.layers[layer.index];
        let extent = match layer.piece {
            Some(_) => format!(", {} -> {} of them", layer.inputs, layer.outputs),
            None => String::new(),
        };
        let parameters = match layer.piece {
            // no `restrict`: from the second block on biases and outputs are the same sums
            Some(_) => format!("const {kind} *x, {kind} *y, const float *w, const {kind} *bias"),
            None => format!("const {kind} *{u}_RESTRICT x, {kind} *{u}_RESTRICT y"),
        };
        text.line("");
        text.line(format!(
            "/* {}: {} -> {}{extent} */",
            shape.name, shape.inputs, shape.outputs
        ));
        text.function(
            &format!("{u}_CODE static void {n}_{}({parameters})", function(layer)),
            |text| {
                if layer.piece.is_none() {
                    text.line(format!("const float *w = {n}_weights{};", layer.index));
                    text.line(format!("const {kind} *bias = {n}_bias{};", layer.index));
                }
                text.line(format!("{kind} *out = y;"));
                self.counters(layer, text);
                for node in &layer.body {
                    match node {
                        Loop::Repeat { count, body, .. } => {
                            text.repeat("block", *count, |text| self.block(layer, body, text))
                        }
                        Loop::Store(store) => self.in_place(store, text),
                        _ => {}
                    }
                }
            },
        );
    }

    /// Declarations of the counters that some build of the layer needs.
    fn counters(&self, layer: &Layer, text: &mut Text) {
        let unless = |text: &mut Text, is_spare: bool, condition: &str, line: &str| {
            // declared only in builds that use it: the code has to pass -Wall -Wextra -Werror
            if is_spare {
                text.directive(format!("#if !defined({}_{condition})", self.u));
                text.line(line);
                text.directive("#endif");
            } else {
                text.line(line);
            }
        };
        unless(text, layer.has_assembly, "ASSEMBLY", "uint32_t i;");
        match kept(layer) {
            Kept::Registers => {}
            kept => {
                let is_stored = layer.body.iter().any(|node| matches!(node, Loop::Store(_)));
                unless(text, kept == Kept::Vectors && !is_stored, "LANES", "uint32_t o;");
            }
        }
        if layer.loops_over_blocks() {
            text.line("uint32_t block;");
        }
    }

    /// One block of outputs.
    fn block(&self, layer: &Layer, body: &[Loop], text: &mut Text) {
        let portable = |text: &mut Text| {
            for node in body {
                match node {
                    Loop::Sums(sums) => self.sums(sums, text),
                    Loop::Store(store) => self.store(store, text),
                    _ => {}
                }
            }
        };
        let kernel = layer.has_assembly.then(|| RealKernel::of(body)).flatten();
        let assembly = kernel.map(|kernel| {
            move |text: &mut Text| {
                let activated = |row: usize| match body.last() {
                    Some(Loop::Store(store)) => self.activated(store, &format!("done[{row}]")),
                    _ => String::new(),
                };
                // the kernel has the ReLU in it; other activations come behind
                let is_left = !kernel.relu && activated(0) != "done[0]";
                let activated: Option<&dyn Fn(usize) -> String> = if is_left { Some(&activated) } else { None };
                text.block("", |text| text.lines(assembly::c::real(&kernel, activated)));
            }
        });
        text.either(&format!("defined({}_ASSEMBLY)", self.u), assembly, portable);
    }

    fn sums(&self, sums: &Sums, text: &mut Text) {
        let Sums { rows, inputs, .. } = *sums;
        if sums.kept != Kept::Registers {
            self.sums_in_memory(sums, text);
            text.lines([format!("bias = &bias[{rows}];"), format!("out = &out[{rows}];")]);
            return;
        }
        text.lines((0..rows).map(|row| format!("{} s{row} = bias[{row}];", self.kind)));
        text.count("i", 0, inputs, |text| {
            text.line(format!("const {} input = x[i];", self.kind));
            text.lines((0..rows).map(|row| {
                let next = self.accumulated([&format!("s{row}"), &format!("w[{row}]"), "input"]);
                format!("s{row} = {next};")
            }));
            text.line(format!("w = &w[{rows}];"));
        });
    }

    /// The axpy form: the first input with the bias, so that no pass is spent on copying it.
    fn sums_in_memory(&self, sums: &Sums, text: &mut Text) {
        let Sums { rows, inputs, .. } = *sums;
        let widths: &[usize] = if sums.kept == Kept::Vectors { &LANES } else { &[] };
        for (at, lanes) in widths.iter().enumerate() {
            let directive = if at == 0 { "if" } else { "elif" };
            text.directive(format!(
                "#{directive} defined({u}_LANES) && ({u}_LANES == {lanes})",
                u = self.u
            ));
            self.sums_in_vectors(sums, *lanes, text);
        }
        if !widths.is_empty() {
            text.directive("#else");
        }
        let all = |text: &mut Text, next: String| {
            text.count("o", 0, rows, |text| text.line(format!("out[o] = {next};")));
        };
        all(text, self.accumulated(["bias[o]", "w[o]", "x[0]"]));
        text.line(format!("w = &w[{rows}];"));
        text.count("i", 1, inputs, |text| {
            text.line(format!("const {} input = x[i];", self.kind));
            all(text, self.accumulated(["out[o]", "w[o]", "input"]));
            text.line(format!("w = &w[{rows}];"));
        });
        if !widths.is_empty() {
            text.directive("#endif");
        }
    }

    /// The sums of a block as vectors of `lanes`, then of four, then as scalars.
    fn sums_in_vectors(&self, sums: &Sums, lanes: usize, text: &mut Text) {
        let Sums { rows, inputs, .. } = *sums;
        let (mut start, mut turn, mut end) = (Vec::new(), Vec::new(), Vec::new());
        let mut first = 0;
        while first < rows {
            // down to four and then to one: a block need not be whole vectors
            let widths = [lanes, 4, 1].into_iter();
            let width = widths.clone().find(|width| first + width <= rows).unwrap_or(1);
            let kind = match width {
                1 => "float".to_owned(),
                _ => format!("{}_lanes{width}", self.n),
            };
            let at = |array: &str, kind: &str| match width {
                1 => format!("{array}[{first}]"),
                _ => format!("*({kind} *)&{array}[{first}]"),
            };
            let constant = format!("const {kind}");
            start.push(format!("{kind} s{first} = {};", at("bias", &constant)));
            turn.push(format!("s{first} = s{first} + ({} * input);", at("w", &constant)));
            end.push(format!("{} = s{first};", at("out", &kind)));
            first += width;
        }
        text.lines(start);
        text.count("i", 0, inputs, |text| {
            text.line(format!("const {} input = x[i];", self.kind));
            text.lines(turn);
            text.line(format!("w = &w[{rows}];"));
        });
        text.lines(end);
    }

    fn store(&self, store: &Store, text: &mut Text) {
        let rows = store.rows;
        text.lines((0..rows).map(|row| format!("out[{row}] = {};", self.activated(store, &format!("s{row}")))));
        text.lines([format!("bias = &bias[{rows}];"), format!("out = &out[{rows}];")]);
    }

    fn in_place(&self, store: &Store, text: &mut Text) {
        let activated = self.activated(store, "y[o]");
        text.count("o", 0, store.rows, |text| text.line(format!("y[o] = {activated};")));
    }

    fn accumulated(&self, [sum, weight, input]: [&str; 3]) -> String {
        match self.program.network.arithmetic {
            Arithmetic::Real { fused: true, .. } => format!("{}_fma({weight}, {input}, {sum})", self.n),
            // weights are binary32
            _ if self.program.scalar() == Scalar::F64 => format!("{sum} + ((double){weight} * {input})"),
            _ => format!("{sum} + ({weight} * {input})"),
        }
    }

    /// The output that a sum becomes.
    fn activated(&self, store: &Store, sum: &str) -> String {
        text_of(store.activation).c(&self.names, sum)
    }
}

/// Floats in a vector: SSE2 and NEON, AVX, AVX-512.
const LANES: [usize; 3] = [4, 8, 16];

/// Where the sums of a layer are kept.
fn kept(layer: &Layer) -> Kept {
    match layer.blocks().find_map(|(_, _, body)| body.first()) {
        Some(Loop::Sums(sums)) => sums.kept,
        _ => Kept::Registers,
    }
}
