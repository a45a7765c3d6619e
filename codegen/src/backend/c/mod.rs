//! C99 that also compiles as C90 with `stdint.h` and as C++: one header, one source.

pub(super) mod duties;
mod guard;
mod integer;
pub(super) mod number;
mod real;
pub(super) mod statements;
pub(super) mod tables;
mod text;

use std::collections::BTreeMap;

use templates::Template;
use templates::c::{
    Common, HeadView, Header, Helpers, IntegerView, Member, NetworkView, PushView, RealView, Source, StatusBit,
    WideChar,
};

use crate::activation::{self, text_of};
use crate::backend::banner;
use crate::files::{CodegenError, GeneratedFiles};
use crate::lower::STATUS;
use crate::program::{
    Arithmetic, Buffer, Element, Head, HeadPart, IntegerCode, Kept, Literal, Loop, Op, Program, StateMember, StateValue,
};
use number::number;
use statements::{Printer, float, unsigned};

/// Header and source of the controller.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn emit(program: &Program) -> Result<GeneratedFiles, CodegenError> {
    let mut files = BTreeMap::new();
    files.insert(format!("{}.h", program.name), render(&header(program))?);
    files.insert(format!("{}.c", program.name), render(&source(program))?);
    Ok(GeneratedFiles { files })
}

/// The text of a template.
pub(super) fn render(view: &impl Template) -> Result<String, CodegenError> {
    let text = view
        .render()
        .map_err(|error| CodegenError::Template(error.to_string()))?;
    Ok(tidy(&text))
}

/// Optional parts of a template leave runs of empty lines behind; a file ends with one newline.
fn tidy(text: &str) -> String {
    let mut tidied = String::with_capacity(text.len());
    let mut empty = false;
    for line in text.lines().map(str::trim_end) {
        if !(line.is_empty() && empty) {
            // what a template indents may be a line for the preprocessor
            tidied.push_str(if line.trim_start().starts_with("#") {
                line.trim_start()
            } else {
                line
            });
            tidied.push('\n');
        }
        empty = line.is_empty();
    }
    tidied
}

fn common(program: &Program) -> Common {
    let number = number::kind(program.scalar());
    Common {
        name: program.name.clone(),
        upper: program.name.to_uppercase(),
        banner: banner(
            program,
            &format!("Controller {}", program.name),
            program.provenance.c_flags,
        ),
        mapping_parameters: match program.has_several() {
            true => String::new(),
            false => duties::parameters(program, program.mapping()),
        },
        number,
    }
}

fn wide_char(program: &Program) -> Option<WideChar> {
    let widths = program.provenance.widths;
    // a compiler with other widths than these has to stop, not to compute something else
    (widths.char_bits != 8).then_some(WideChar {
        char_bits: widths.char_bits,
        int_bits: widths.int_bits,
        int_max: (1 << (widths.int_bits - 1)) - 1,
    })
}

fn header(program: &Program) -> Header {
    let count = |name: &str, value: usize| (name.to_owned(), format!("{value}u"));
    let period = ("SAMPLE_PERIOD".to_owned(), format!("{:?}", program.sample_period));
    let constants = vec![
        count("SIGNALS", program.signals.len()),
        count("FEATURES", program.feature_count()),
        count("ACTIONS", program.head.outputs()),
        count("STATE_WORDS", program.state_words()),
        count("TABLE_NUMBERS", program.table_numbers()),
        period,
    ];
    Header {
        common: common(program),
        constants: constants.into_iter().chain(duties::places(program)).collect(),
        places: duties::length(program),
        mappings: duties::settable(program),
        status: STATUS
            .iter()
            .map(|bit| StatusBit {
                name: bit.name,
                value: unsigned(1 << bit.number),
                meaning: bit.meaning,
            })
            .collect(),
        measurement: program
            .signals
            .iter()
            .map(|signal| measurement_member(program, signal))
            .collect(),
        state: state(program).0,
        head: head_view(program),
        features: program.features.iter().map(|(_, formula)| formula.clone()).collect(),
    }
}

fn head_view(program: &Program) -> HeadView {
    match program.head {
        Head::Choice(_) => HeadView::Choice,
        Head::Output { .. } => HeadView::Output,
        Head::Gains { .. } => HeadView::Gains,
        Head::Several { .. } => HeadView::Several,
    }
}

fn measurement_member(program: &Program, signal: &crate::program::SignalPort) -> Member {
    let scalar = program.scalar();
    let kind = if signal.is_code {
        "int32_t"
    } else {
        number::kind(scalar).name
    };
    Member {
        declaration: format!("{kind} {}", signal.name),
        comment: signal.meaning(scalar),
    }
}

/// Members of the state, statements that reset it, and those that set its coefficients.
fn state(program: &Program) -> (Vec<Member>, Vec<String>, Vec<String>) {
    let scalar = program.scalar();
    let kind = number::kind(scalar).name;
    let (mut members, mut reset, mut init) = (Vec::new(), Vec::new(), Vec::new());
    for StateMember { name, meaning, value } in &program.state {
        let set = |place: String, value: &Literal| format!("state->{place} = {};", number(scalar, *value));
        let declaration = match value {
            StateValue::Numbers(values) => {
                let places = values
                    .iter()
                    .enumerate()
                    .map(|(i, value)| set(format!("{name}[{i}]"), value));
                // the memory is long: a loop clears it
                reset.extend(places.filter(|_| name != "memory"));
                format!("{kind} {name}[{}]", values.len())
            }
            StateValue::Number(value) => {
                reset.push(set(name.clone(), value));
                format!("{kind} {name}")
            }
            // not reset: `init` alone sets what the user may have replaced
            StateValue::Coefficient(value) => {
                init.push(set(name.clone(), value));
                format!("{kind} {name}")
            }
            StateValue::Check(bits) => {
                init.push(format!("state->{name} = {};", guard::word(scalar, *bits)));
                format!("{} {name}", number::kind(scalar).word)
            }
            StateValue::Word => {
                reset.push(format!("state->{name} = 0u;"));
                format!("uint32_t {name}")
            }
        };
        members.push(Member {
            declaration,
            comment: (*meaning).to_owned(),
        });
    }
    (members, reset, init)
}

fn source(program: &Program) -> Source {
    let mut sense = Printer::new(&program.name, program);
    sense.block(&program.front.block);
    let mut decide = Printer::new(&program.name, program);
    decide.block(&program.decide.block);
    let mut advance = Printer::new(&program.name, program);
    advance.block(&program.advance.block);
    let bits = program.decide.status.iter();
    let (_, reset, init) = state(program);
    let front = &program.front;
    let operands = |ids: &[usize]| ids.iter().map(|id| sense.operand(*id)).collect();
    let pushed: Vec<usize> = front.pushes.iter().map(|push| push.value).collect();
    let (answer, answered) = match program.head {
        Head::Choice(_) => ("uint32_t", "index"),
        Head::Output { .. } => (number::kind(program.scalar()).name, "output"),
        // the template makes an array of them
        Head::Gains { .. } | Head::Several { .. } => (number::kind(program.scalar()).name, "outputs"),
    };
    Source {
        common: common(program),
        wide_char: wide_char(program),
        tables: program.tables.iter().map(tables::view).collect(),
        network: network(program),
        senses_again: program.senses_again,
        crc_kinds: tables::crc_kinds(program),
        helpers: helpers(program),
        activations: activation::c_functions(program, &number::names(program)),
        actions: program.head.outputs(),
        head: head_view(program),
        answer,
        answered,
        lowest: number::lowest(program.scalar()),
        signals: operands(&front.signals),
        observation: operands(&front.observation),
        pushed: operands(&pushed),
        valid: sense.operand(front.all_valid),
        clipped: front.clipped.map(|flag| sense.operand(flag)),
        base: front.base.map(|value| sense.operand(value)),
        factors: operands(&front.factors),
        still: front.still.map(|flag| sense.operand(flag)),
        takes_outputs: program.head.hands_on_all(),
        chosen: duties::chosen(program),
        greedy: program.head.parts().iter().any(HeadPart::is_choice),
        duties: duties::commanded(program, &decide),
        duty_stray: duties::stray(program, &decide),
        reads_state: duties::reads_state(program),
        guard: guard::terms(program),
        mappings: duties::mappings(program),
        most_bad: unsigned(program.guard.bad_count),
        status_terms: bits
            .map(|(bit, flag)| format!("({} << {bit})", decide.operand(*flag)))
            .collect(),
        sense: sense.lines,
        decide: decide.lines,
        soft_caps: duties::soft_caps(program, &advance),
        advance: advance.lines,
        pushes: pushes(program),
        init,
        reset,
        memory_words: program.memory_words,
        hold: unsigned(program.hold),
        integrity: tables::integrity(program),
        crc: unsigned(program.crc),
        self_test: tables::self_test(program.scalar()),
    }
}

fn network(program: &Program) -> NetworkView {
    match &program.network.arithmetic {
        Arithmetic::Real { .. } => NetworkView::Real(RealView {
            functions: real::functions(program),
            calls: real::calls(program),
        }),
        Arithmetic::Integer(code) => NetworkView::Integer(integer_view(program, code)),
    }
}

fn integer_view(program: &Program, code: &IntegerCode) -> IntegerView {
    let network = &program.network;
    IntegerView {
        bound: code.accumulator_bound,
        weight: tables::element(Element::Integer {
            bytes: code.weight_bytes,
        }),
        is_quad: network.lanes.len() == 4,
        input_length: network.length(Buffer::Input),
        padding: integer::padding(network, Buffer::Input),
        shift: code.output_shift,
        q_unit: float(code.q_unit.single()),
        q_field: code.q_field,
        has_fpu: program.has_fpu,
        special: integer::special(code),
        has_assembly: network.has_assembly,
        shares: code.shares,
        functions: integer::functions(program, code),
        calls: integer::calls(program),
        activations: activation::used(network)
            .flat_map(|kind| text_of(kind).c_integer_helper(&number::names(program)))
            .collect(),
    }
}

fn pushes(program: &Program) -> Vec<PushView> {
    let view = |(index, push): (usize, &crate::program::Push)| PushView {
        word: push.word,
        last: push.word + push.length - 1,
        index,
    };
    program.front.pushes.iter().enumerate().map(view).collect()
}

fn helpers(program: &Program) -> Helpers {
    let ops = || {
        let blocks = [&program.front.block, &program.decide.block, &program.advance.block];
        blocks.into_iter().flat_map(|block| &block.ops)
    };
    let network = &program.network;
    Helpers {
        // what is not called is not printed: unused functions are warnings, and the code builds with -Werror
        within: ops().any(|op| matches!(op, Op::Within { .. })),
        outside: ops().any(|op| matches!(op, Op::Outside { .. })),
        clamp: ops().any(|op| matches!(op, Op::Clamp { .. })),
        line_sum: ops().any(|op| matches!(op, Op::LineSum { .. })),
        assembly: network.has_assembly,
        vectors: (network.nodes().iter()).any(|node| matches!(node, Loop::Sums(sums) if sums.kept == Kept::Vectors)),
        alignment: program.alignment(),
        fused: matches!(network.arithmetic, Arithmetic::Real { fused: true, .. }),
    }
}
