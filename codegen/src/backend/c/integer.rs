//! Loops over integers: functions of the layers, and the calls of `network`.
//!
//! ```text
//!  for (block ...) {                          Repeat
//!      s0 = bias[0]; s1 = bias[1]; ...        Sums: rows side by side
//!      for (turns ...) {                        some groups of inputs written out
//!          x0, x1 = in[0], in[1]
//!          s0 = s0 + w[0] * x0 + w[1] * x1; ...   or one instruction for both (`DSP`), or weights by words (`HALVES`)
//!      }
//!      out[0] = activation(s0 >> shift); ...  Store, or, where the last layer is streamed,
//!      y0 = activation(s0 >> shift); ...      Store in variables, then Add:
//!      sum[0] = sum[0] + next[0] * y0 + ...     into every sum of that layer
//!  }
//! ```
//!
//! In: `x`, whole groups of 16-bit integers. Out: `y`, 16 bits wide, or the sums of the last layer. The one invariant: every form of
//! an inner loop leaves `in`, `w` and `next` behind what it has read, so the forms can be exchanged line by line.

use super::number;
use super::tables::element;
use super::text::Text;
use crate::activation::{C, text_of};
use crate::assembly;
use crate::assembly::integer::Kernel;
use crate::program::{
    Add, Buffer, Element, Inner, IntegerCode, Layer, Loop, Network, Program, Sink, Store, Sums, Turns,
};

/// Functions of the layers.
pub fn functions(program: &Program, code: &IntegerCode) -> Vec<String> {
    let printer = Printer {
        n: &program.name,
        u: program.name.to_uppercase(),
        names: number::names(program),
        network: &program.network,
        code,
        weight: element(Element::Integer {
            bytes: code.weight_bytes,
        }),
    };
    let mut text = Text::default();
    for layer in program.network.pieces() {
        printer.layer(layer, &mut text);
    }
    text.lines
}

/// Declarations and statements of `network`.
pub fn calls(program: &Program) -> Vec<String> {
    let Program { name, network, .. } = program;
    let hidden = network
        .buffers
        .iter()
        .filter(|(buffer, _)| matches!(buffer, Buffer::Hidden(_)));
    let declared = hidden.map(|(buffer, length)| {
        let aligned = format!("{}_ALIGNED", name.to_uppercase());
        format!("{aligned} int16_t {}[{length}];", place(*buffer))
    });
    let statements = network.loops.iter().flat_map(|node| match node {
        Loop::Layer(layer) => {
            let (from, to) = (place(layer.from), place(layer.to));
            vec![format!("{name}_layer{}({from}, {to});", layer.index)]
        }
        Loop::Pad { buffer, .. } if *buffer != Buffer::Input => padding(network, *buffer),
        _ => Vec::new(),
    });
    declared.chain(statements).collect()
}

/// Statements that fill a buffer up to whole groups.
pub fn padding(network: &Network, buffer: Buffer) -> Vec<String> {
    let name = if buffer == Buffer::Input {
        "input".to_owned()
    } else {
        place(buffer)
    };
    let pads = network.loops.iter().filter_map(|node| match node {
        Loop::Pad {
            buffer: other,
            from,
            to,
        } if *other == buffer => Some(*from..*to),
        _ => None,
    });
    pads.flatten().map(|at| format!("{name}[{at}] = 0;")).collect()
}

/// Macro of the inner loops besides the portable ones.
pub fn special(code: &IntegerCode) -> &'static str {
    match code.inner {
        Inner::Dual => "DSP",
        Inner::Halves => "HALVES",
        Inner::Plain => "",
    }
}

fn place(buffer: Buffer) -> String {
    match buffer {
        Buffer::Input => "values->input".to_owned(),
        Buffer::Hidden(index) => format!("hidden{index}"),
        Buffer::Block | Buffer::Output => "values->q".to_owned(),
    }
}

struct Printer<'a> {
    /// Prefix of names, and of macros.
    n: &'a str,
    u: String,
    names: C<'a>,
    network: &'a Network,
    code: &'a IntegerCode,
    /// Type of a weight.
    weight: &'static str,
}

impl Printer<'_> {
    fn layer(&self, layer: &Layer, text: &mut Text) {
        let shape = |index: usize| {
            let shape = &self.network.layers[index];
            format!(
                "{}: {} -> {}, cut by {} bits",
                shape.name, shape.inputs, shape.outputs, shape.shift
            )
        };
        let next = layer
            .next
            .map(|last| format!("; each block goes at once into the sums of {}", shape(last)));
        text.line("");
        text.line(format!("/* {}{} */", shape(layer.index), next.unwrap_or_default()));
        let assembly = layer
            .has_assembly
            .then_some(|text: &mut Text| self.assembly(layer, text));
        text.either(&format!("defined({}_ASSEMBLY)", self.u), assembly, |text| {
            self.portable(layer, text)
        });
    }

    /// Head of the function of a layer.
    fn head(&self, layer: &Layer, restrict: &str) -> String {
        let (n, u, sink) = (self.n, &self.u, sink(layer));
        let index = layer.index;
        format!("{u}_CODE {u}_NO_LIBC static void {n}_layer{index}(const int16_t *{restrict}x, {sink} *{restrict}y)")
    }

    /// The blocks of each height as a function in assembly, then the function that calls them.
    fn assembly(&self, layer: &Layer, text: &mut Text) {
        let (n, u, weight, index) = (self.n, &self.u, self.weight, layer.index);
        let mut calls = Vec::new();
        let mut first = 0;
        for (_, count, body) in layer.blocks() {
            let Some(kernel) = Kernel::of(self.network, count, body) else {
                continue;
            };
            let name = format!("{n}_kernel{index}_{}", kernel.height);
            let (parameter, argument, to) = match layer.next {
                Some(last) => (
                    format!(", const {weight} *next"),
                    format!(", &{n}_weights{last}[{}]", first * layer.outputs),
                    "y".to_owned(),
                ),
                None => (String::new(), String::new(), format!("&y[{first}]")),
            };
            let (sink, weights) = (sink(layer), first * self.network.padded(layer.inputs));
            let head =
                format!("{name}(const int16_t *x, {sink} *y, const {weight} *w, const int32_t *bias{parameter})");
            text.function(&format!("{u}_CODE {u}_NAKED static void {head}"), |text| {
                text.lines(assembly::c::integer(&kernel));
            });
            text.line("");
            calls.push(format!(
                "{name}(x, {to}, &{n}_weights{index}[{weights}], &{n}_bias{index}[{first}]{argument});"
            ));
            first += count * kernel.height;
        }
        text.function(&self.head(layer, ""), |text| {
            if layer.next.is_some() {
                text.line("uint32_t i;");
            }
            self.begin(layer, text);
            text.lines(calls);
        });
    }

    fn portable(&self, layer: &Layer, text: &mut Text) {
        let (n, index) = (self.n, layer.index);
        let restrict = format!("{}_RESTRICT ", self.u);
        // sound, because the word type may alias the elements and tables are aligned to words
        let weights = |index: usize| format!("(const {n}_weight *)(const void *){n}_weights{index};");
        text.function(&self.head(layer, &restrict), |text| {
            text.line(format!("const {n}_weight *w = {}", weights(index)));
            text.line(format!("const int32_t *bias = {n}_bias{index};"));
            match layer.next {
                Some(last) => text.line(format!("const {n}_weight *next = {}", weights(last))),
                None => text.line(format!("{} *out = y;", sink(layer))),
            }
            if layer.next.is_some() || has_turns(layer) {
                text.line("uint32_t i;");
            }
            if layer.loops_over_blocks() {
                text.line("uint32_t block;");
            }
            self.begin(layer, text);
            for (_, count, body) in layer.blocks() {
                text.repeat("block", count, |text| self.block(body, text));
            }
        });
    }

    /// The sums of a streamed layer start from its biases.
    fn begin(&self, layer: &Layer, text: &mut Text) {
        if let Some(last) = layer.next {
            text.count("i", 0, layer.outputs, |text| {
                text.line(format!("y[i] = {}_bias{last}[i];", self.n))
            });
        }
    }

    fn block(&self, body: &[Loop], text: &mut Text) {
        let [Loop::Sums(sums), Loop::Store(store), added @ ..] = body else {
            return;
        };
        self.sums(sums, text);
        match added {
            [Loop::Add(add)] => text.block("", |text| {
                text.line("int32_t *sum = y;");
                text.lines((0..store.rows).map(|row| format!("const int32_t y{row} = {};", self.stored(store, row))));
                self.add(add, text);
            }),
            _ => {
                text.lines((0..store.rows).map(|row| match (self.stored(store, row), store.to) {
                    (output, Sink::Halves) => format!("out[{row}] = (int16_t)({output});"),
                    (output, _) => format!("out[{row}] = {output};"),
                }));
                text.line(format!("out = &out[{}];", store.rows));
            }
        }
    }

    fn sums(&self, sums: &Sums, text: &mut Text) {
        let (n, rows) = (self.n, sums.rows);
        text.line(format!(
            "const {n}_activation *in = (const {n}_activation *)(const void *)x;"
        ));
        text.lines((0..rows).map(|row| format!("int32_t s{row} = bias[{row}];")));
        self.forms(&sums.turns, text, |special, groups| match (special, self.code.inner) {
            (false, _) | (_, Inner::Plain) => self.portable_groups(groups, rows),
            (true, Inner::Dual) => self.dual_groups(groups, rows),
            (true, Inner::Halves) => self.halved_groups(groups, rows),
        });
        text.line(format!("bias = &bias[{rows}];"));
    }

    /// The same loops in the target's form, if it has one of its own, and in portable C.
    fn forms(&self, turns: &[Turns], text: &mut Text, lines: impl Fn(bool, usize) -> Vec<String>) {
        let all = |text: &mut Text, is_special: bool| {
            for Turns { count, width } in turns {
                text.repeat("i", *count, |text| text.lines(lines(is_special, *width)));
            }
        };
        let own = (self.code.inner != Inner::Plain).then_some(|text: &mut Text| all(text, true));
        text.either(&format!("defined({}_{})", self.u, special(self.code)), own, |text| {
            all(text, false)
        });
    }

    fn portable_groups(&self, groups: usize, rows: usize) -> Vec<String> {
        let lanes = &self.network.lanes;
        let lines = (0..groups).flat_map(|group| {
            let loads = (0..lanes.len()).map(move |lane| {
                let at = group * lanes.len() + lane;
                format!("const int32_t x{lane} = in[{at}];")
            });
            let sums = (0..rows).map(move |row| {
                let first = (group * rows + row) * lanes.len();
                let products = lanes.iter().enumerate();
                let products = products.map(|(at, lane)| format!("((int32_t)w[{}] * x{lane})", first + at));
                format!("s{row} = s{row} + {};", products.collect::<Vec<_>>().join(" + "))
            });
            braced(loads.chain(sums))
        });
        lines.chain(self.moved_on(groups, rows)).collect()
    }

    fn dual_groups(&self, groups: usize, rows: usize) -> Vec<String> {
        let (n, is_quad) = (self.n, self.network.lanes.len() == 4);
        // inputs by two words, too: a group of four, or two groups of two
        let step = if is_quad { 1 } else { 2 };
        let lines = (0..groups).step_by(step).flat_map(|group| {
            let taken = step.min(groups - group);
            let load = if is_quad || taken == 2 {
                vec![
                    "int32_t x0;".to_owned(),
                    "int32_t x1;".to_owned(),
                    format!("{n}_two(&in, &x0, &x1);"),
                ]
            } else {
                vec![format!("const int32_t x0 = {n}_one(&in);")]
            };
            let sums = (0..taken).flat_map(|x| (0..rows).map(move |row| (x, row)));
            let sums = sums.map(|(x, row)| match is_quad {
                true => format!("s{row} = {n}_quad({WORD}, x0, x1, s{row});"),
                false => format!("s{row} = __smlad({WORD}, x{x}, s{row});"),
            });
            let sums = self.by_twos("w", "w", &sums.collect::<Vec<_>>());
            braced(load.into_iter().chain(sums))
        });
        lines.collect()
    }

    fn halved_groups(&self, groups: usize, rows: usize) -> Vec<String> {
        let n = self.n;
        let lines = (0..groups).flat_map(|group| {
            let loads = [
                format!("const int32_t x01 = {n}_word_at(&in[{}]);", 2 * group),
                "const int32_t x0 = (int16_t)x01;".to_owned(),
                "const int32_t x1 = x01 >> 16;".to_owned(),
            ];
            let sums = (0..rows).map(|row| {
                let at = 2 * (group * rows + row);
                format!("s{row} = {n}_halves({n}_word_at(&w[{at}]), x0, x1, s{row});")
            });
            braced(loads.into_iter().chain(sums))
        });
        lines.chain(self.moved_on(groups, rows)).collect()
    }

    /// Behind the statements of some groups whose inputs and weights are taken by index.
    fn moved_on(&self, groups: usize, rows: usize) -> [String; 2] {
        let inputs = groups * self.network.lanes.len();
        [format!("in = &in[{inputs}];"), format!("w = &w[{}];", inputs * rows)]
    }

    /// What is left of sum `row`, 32 bits wide; a hidden one fits 16.
    fn stored(&self, store: &Store, row: usize) -> String {
        let sum = format!("s{row}");
        let Some(cut) = &store.cut else { return sum };
        text_of(store.activation).c_integer(&self.names, &sum, cut)
    }

    /// What a block of outputs adds to all sums of the last layer.
    fn add(&self, add: &Add, text: &mut Text) {
        let output = |at: usize| match at < add.inputs {
            true => format!("y{at}"),
            false => "0".to_owned(),
        };
        let pairs = (0..self.network.padded(add.inputs)).step_by(2).map(|at| {
            let (low, high) = (output(at), output(at + 1));
            let pair = match add.is_positive {
                // no sign that would reach into the upper half
                true => format!("{low} | (int32_t)((uint32_t){high} << 16)"),
                false => format!("{}_pair({low}, {high})", self.n),
            };
            format!("const int32_t y{at}{} = {pair};", at + 1)
        });
        let all = |text: &mut Text, lines: &dyn Fn(usize) -> Vec<String>| {
            for Turns { count, width } in &add.turns {
                let moved = format!("sum = &sum[{width}];");
                text.repeat("i", *count, |text| text.lines(lines(*width).into_iter().chain([moved])));
            }
        };
        // words are split nowhere here: `HALVES` takes the portable form
        let own = (self.code.inner == Inner::Dual).then_some(|text: &mut Text| {
            text.lines(pairs);
            all(text, &|sums| self.dual_sums(add, sums));
        });
        let condition = format!("defined({}_{})", self.u, special(self.code));
        text.either(&condition, own, |text| all(text, &|sums| self.portable_sums(add, sums)));
    }

    fn dual_sums(&self, add: &Add, sums: usize) -> Vec<String> {
        let words = self.network.groups(add.inputs);
        let uses = (0..sums).flat_map(|row| (0..words).map(move |word| (row, word)));
        let lines = uses.map(|(row, word)| match self.network.lanes.len() {
            4 => format!("sum[{row}] = {}_quad({WORD}, y01, y23, sum[{row}]);", self.n),
            _ => format!(
                "sum[{row}] = __smlad({WORD}, y{}{}, sum[{row}]);",
                2 * word,
                2 * word + 1
            ),
        });
        self.by_twos("next", "v", &lines.collect::<Vec<_>>())
    }

    fn portable_sums(&self, add: &Add, sums: usize) -> Vec<String> {
        let lanes = &self.network.lanes;
        let padded = self.network.padded(add.inputs);
        let rows = (0..sums).map(|row| {
            let products = (0..padded).filter_map(|at| {
                let lane = at / lanes.len() * lanes.len() + lanes[at % lanes.len()];
                (lane < add.inputs).then(|| format!(" + ((int32_t)next[{}] * y{lane})", row * padded + at))
            });
            format!("sum[{row}] = sum[{row}]{};", products.collect::<String>())
        });
        rows.chain([format!("next = &next[{}];", sums * padded)]).collect()
    }

    /// Statements that take one word each from `pointer`, which is advanced: two words with one load.
    fn by_twos(&self, pointer: &str, name: &str, uses: &[String]) -> Vec<String> {
        let n = self.n;
        let taken = |(at, line): (usize, &String)| line.replace(WORD, &format!("{name}{at}"));
        let lines = uses.chunks(2).flat_map(|chunk| {
            let load = match chunk {
                [_, _] => vec![
                    format!("int32_t {name}0;"),
                    format!("int32_t {name}1;"),
                    format!("{n}_two(&{pointer}, &{name}0, &{name}1);"),
                ],
                _ => vec![format!("const int32_t {name}0 = {n}_one(&{pointer});")],
            };
            braced(load.into_iter().chain(chunk.iter().enumerate().map(taken)))
        });
        lines.collect()
    }
}

/// Where a statement for [`Printer::by_twos`] has its word.
// a character that C has not
const WORD: &str = "@";

/// Statements in a block of their own.
fn braced(lines: impl IntoIterator<Item = String>) -> Vec<String> {
    let mut text = Text::default();
    text.block("", |text| text.lines(lines));
    text.lines
}

/// Type of what a layer writes.
fn sink(layer: &Layer) -> &'static str {
    match layer.to {
        Buffer::Hidden(_) => "int16_t",
        _ => "int32_t",
    }
}

/// Whether the loops over groups of inputs are loops.
fn has_turns(layer: &Layer) -> bool {
    let turns = |node: &Loop| matches!(node, Loop::Sums(sums) if sums.turns.iter().any(|turns| turns.count > 1));
    layer.blocks().any(|(_, _, body)| body.iter().any(turns))
}
