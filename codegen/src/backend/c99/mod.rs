//! C99 that also compiles as C90 with `stdint.h` and as C++: one header, one source.

mod integer;
mod real;
pub(super) mod statements;
pub(super) mod tables;

use std::collections::BTreeMap;

use targets::IntegerLoop;
use templates::Template;
use templates::c::{Argmax, Common, Constant, Header, Helpers, Member, NetworkView, PushView, Source, WideChar};

use crate::backend::assembly::RealKernel;
use crate::backend::{Backend, banner};
use crate::lower::STATUS;
use crate::program::{ActivationCode, Coefficient, NetworkCode, Op, Program};
use crate::{CodegenError, GeneratedFiles};
use statements::{Printer, float, unsigned};

/// The C99 backend.
pub struct C99;

impl Backend for C99 {
    fn emit(&self, program: &Program) -> Result<GeneratedFiles, CodegenError> {
        let mut files = BTreeMap::new();
        files.insert(format!("{}.h", program.name), render(&header(program))?);
        files.insert(format!("{}.c", program.name), render(&source(program))?);
        Ok(GeneratedFiles { files })
    }
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
            tidied.push_str(line);
            tidied.push('\n');
        }
        empty = line.is_empty();
    }
    tidied
}

fn common(program: &Program) -> Common {
    let parameters = program.mapping.iter().flat_map(|mapping| &mapping.coefficients);
    Common {
        name: program.name.clone(),
        upper: program.name.to_uppercase(),
        banner: banner(
            program,
            &format!("Controller {}", program.name),
            program.provenance.c_flags,
        ),
        mapping_parameters: parameters
            .map(|(name, ..)| format!("float {}", name.name()))
            .collect::<Vec<_>>()
            .join(", "),
    }
}

fn wide_char(program: &Program) -> Option<WideChar> {
    let widths = program.provenance.widths;
    (widths.char_bits != 8).then_some(WideChar {
        char_bits: widths.char_bits,
        int_bits: widths.int_bits,
        int_max: (1 << (widths.int_bits - 1)) - 1,
    })
}

fn header(program: &Program) -> Header {
    let constant = |name: &str, value: String| Constant {
        name: name.to_owned(),
        value,
    };
    let count = |name: &str, value: usize| constant(name, format!("{value}u"));
    let period = format!("{:?}", program.sample_period);
    Header {
        common: common(program),
        constants: vec![
            count("SIGNALS", program.signals.len()),
            count("FEATURES", program.feature_count()),
            count("ACTIONS", program.duties.len()),
            count("STATE_WORDS", program.state_words()),
            constant("SAMPLE_PERIOD", period),
        ],
        status: STATUS
            .iter()
            .map(|(name, bit)| constant(name, unsigned(1 << bit)))
            .collect(),
        measurement: program.signals.iter().map(measurement_member).collect(),
        state: state_members(program),
        features: program.features.iter().map(|(_, formula)| formula.clone()).collect(),
    }
}

fn measurement_member(signal: &crate::program::SignalPort) -> Member {
    let (low, high) = signal.range;
    let kind = if signal.is_code { "int32_t" } else { "float" };
    let meaning = if signal.is_code { "ADC code, " } else { "" };
    Member {
        declaration: format!("{kind} {}", signal.name),
        comment: format!(
            "{meaning}plausible {:?} to {:?} {}",
            low.value(),
            high.value(),
            signal.unit
        )
        .trim_end()
        .to_owned(),
    }
}

/// In the order of contract section 1.
fn state_members(program: &Program) -> Vec<Member> {
    let member = |declaration: String, comment: &str| Member {
        declaration,
        comment: comment.to_owned(),
    };
    let mut members = vec![member(
        format!("float held[{}]", program.signals.len()),
        "last good samples",
    )];
    if program.memory_words > 0 {
        members.push(member(
            format!("float memory[{}]", program.memory_words),
            "filters, in feature order, oldest first",
        ));
    }
    members.push(member("float previous_duty".into(), "duty of the last chosen action"));
    members.push(member("float previous_command".into(), "last command"));
    if program.soft_start_from.is_some() {
        members.push(member("float soft_cap".into(), "rising upper limit"));
    }
    for (name, ..) in program.mapping.iter().flat_map(|mapping| &mapping.coefficients) {
        members.push(member(
            format!("float mapping_{}", name.name()),
            "coefficient of the duty ratio mapping",
        ));
    }
    members.push(member(
        "uint32_t bad_count".into(),
        "consecutive steps with an invalid sample",
    ));
    members.push(member("uint32_t primed".into(), "1 once the filters hold good samples"));
    members
}

fn source(program: &Program) -> Source {
    let mut sense = Printer::new(&program.name, program);
    sense.block(&program.front.block);
    let mut decide = Printer::new(&program.name, program);
    decide.block(&program.decide.block);
    let mut advance = Printer::new(&program.name, program);
    advance.block(&program.advance.block);
    let status_terms = program
        .decide
        .status
        .iter()
        .map(|(bit, flag)| format!("({} << {bit})", decide.operand(*flag)))
        .collect();
    let (sense_lines, sense_results) = sense_statements(program, &sense);
    Source {
        common: common(program),
        wide_char: wide_char(program),
        tables: tables::tables(program),
        network: network(program),
        senses_again: senses_again(program),
        argmax: argmax(program),
        crc_kinds: tables::crc_kinds(program),
        helpers: helpers(program),
        tanh: tables::tanh_steps(),
        front_members: front_members(program),
        sense: sense_lines,
        sense_results,
        duty: decide.operand(program.decide.duty),
        status_terms,
        decide: decide.lines,
        soft_cap: program
            .advance
            .soft_cap
            .map(|value| advance.operand(value))
            .unwrap_or_default(),
        advance: advance.lines,
        signal_count: program.signals.len(),
        pushes: pushes(program),
        init: init(program),
        reset: reset(program),
        memory_words: program.memory_words,
        mapping_conditions: mapping_conditions(program),
        mapping_assignments: mapping_assignments(program),
        hold: unsigned(program.hold),
        fallback: float(program.fallback_duty.value()),
        integrity: tables::integrity(program),
        crc: unsigned(program.crc),
        self_test: tables::self_test(),
    }
}

fn network(program: &Program) -> NetworkView {
    match &program.network {
        NetworkCode::Real { fused, layers } => NetworkView::Real(real::view(&program.name, layers, *fused)),
        NetworkCode::Integer(network) => NetworkView::Integer(integer::view(&program.name, network, program.has_fpu)),
    }
}

/// To sense is a few per cent of the network where floats are hardware, and a tenth of it where they are a library.
fn senses_again(program: &Program) -> bool {
    program.has_fpu
}

fn argmax(program: &Program) -> Argmax {
    let n = &program.name;
    let again = senses_again(program);
    match program.network {
        NetworkCode::Real { .. } => Argmax {
            element: "float",
            lowest: "-3.40282347e+38f",
            declarations: again
                .then(|| format!("float observation[{}];", program.feature_count()))
                .into_iter()
                .chain([format!("float q[{}];", program.duties.len())])
                .collect(),
            calls: again
                .then(|| format!("{n}_observe(state, measured, observation);"))
                .into_iter()
                .chain([format!("{n}_q_values(observation, q);")])
                .collect(),
            output: "q[action]".to_owned(),
            dual: false,
            select: format!("{n}_select(above, output, best)"),
        },
        NetworkCode::Integer(ref network) => Argmax {
            element: "int32_t",
            lowest: "(-2147483647 - 1)",
            declarations: vec![
                format!("{n}_values values;"),
                "const int32_t *const q = values.q;".to_owned(),
            ],
            calls: vec![
                if again {
                    format!("{n}_inputs(state, measured, values.input);")
                } else {
                    format!("{n}_quantise(observation, values.input);")
                },
                format!("{n}_network(&values);"),
            ],
            output: integer::output(network, "action"),
            dual: network.block.inner == IntegerLoop::Dual,
            select: format!("{n}_select_integer(above, output, best)"),
        },
    }
}

fn front_members(program: &Program) -> Vec<Member> {
    let member = |declaration: String, comment: &str| Member {
        declaration,
        comment: comment.to_owned(),
    };
    let mut members = vec![member(format!("float signal[{}]", program.signals.len()), "sanitised")];
    members.push(member(
        format!("float observation[{}]", program.feature_count()),
        "network input",
    ));
    if !program.front.pushes.is_empty() {
        members.push(member(
            format!("float push[{}]", program.front.pushes.len()),
            "what the filters will remember",
        ));
    }
    members.push(member("uint32_t bad_count".into(), "including this step"));
    members.push(member("uint32_t usable".into(), "1 if the network decides"));
    members.push(member(
        "uint32_t held".into(),
        "1 if a held sample bridges an invalid one",
    ));
    members.push(member(
        "uint32_t primed_now".into(),
        "1 if this step primes the filters",
    ));
    if program.front.clipped.is_some() {
        members.push(member("uint32_t clipped".into(), "1 if an observation was clipped"));
    }
    members
}

/// Declarations, then assignments, of `sense`.
fn sense_statements(program: &Program, printer: &Printer<'_>) -> (Vec<String>, Vec<String>) {
    let front = &program.front;
    let valid = printer.operand(front.all_valid);
    let (n, hold) = (&program.name, unsigned(program.hold));
    let mut lines = printer.lines.clone();
    lines.push(format!(
        "const uint32_t counted = state->bad_count + {n}_flag(state->bad_count <= {hold});"
    ));
    lines.push(format!("const uint32_t bad_count = counted & ({valid} - (uint32_t)1);"));
    lines.push(format!(
        "const uint32_t bridged = state->primed & {n}_flag(bad_count <= {hold});"
    ));
    lines.push(format!("const uint32_t usable = {valid} | bridged;"));
    let mut results = Vec::new();
    let values = [("signal", &front.signals), ("observation", &front.observation)];
    for (array, ids) in values {
        results.extend(
            ids.iter()
                .enumerate()
                .map(|(i, id)| format!("front->{array}[{i}] = {};", printer.operand(*id))),
        );
    }
    let pushes = front.pushes.iter().enumerate();
    results.extend(pushes.map(|(i, push)| format!("front->push[{i}] = {};", printer.operand(push.value))));
    results.push("front->bad_count = bad_count;".into());
    results.push("front->usable = usable;".into());
    results.push(format!("front->held = usable & ({valid} ^ (uint32_t)1);"));
    results.push("front->primed_now = usable & (state->primed ^ (uint32_t)1);".into());
    if let Some(clipped) = front.clipped {
        results.push(format!("front->clipped = {};", printer.operand(clipped)));
    }
    (lines, results)
}

fn pushes(program: &Program) -> Vec<PushView> {
    let view = |(index, push): (usize, &crate::program::Push)| PushView {
        word: push.word,
        last: push.word + push.length - 1,
        index,
    };
    program.front.pushes.iter().enumerate().map(view).collect()
}

fn reset(program: &Program) -> Vec<String> {
    let signals = program.signals.iter().enumerate();
    let mut lines: Vec<String> = signals
        .map(|(i, signal)| format!("state->held[{i}] = {};", float(signal.initial.value())))
        .collect();
    let initial = float(program.initial_duty.value());
    lines.push(format!("state->previous_duty = {initial};"));
    lines.push(format!("state->previous_command = {initial};"));
    lines.extend(
        program
            .soft_start_from
            .map(|from| format!("state->soft_cap = {};", float(from.value()))),
    );
    lines.push("state->bad_count = 0u;".into());
    lines.push("state->primed = 0u;".into());
    lines
}

fn init(program: &Program) -> Vec<String> {
    let coefficients = program.mapping.iter().flat_map(|mapping| &mapping.coefficients);
    coefficients
        .map(|(name, value, ..)| format!("state->mapping_{} = {};", name.name(), float(value.value())))
        .collect()
}

fn mapping_conditions(program: &Program) -> Vec<String> {
    let Some(mapping) = &program.mapping else {
        return Vec::new();
    };
    let p = &program.name;
    let within = |(name, _, low, high): &(Coefficient, _, crate::program::Literal, crate::program::Literal)| {
        let (name, low, high) = (name.name(), float(low.value()), float(high.value()));
        format!("{p}_within({name}, {low}, {high})")
    };
    let mut conditions: Vec<String> = mapping.coefficients.iter().map(within).collect();
    if mapping.coefficients.iter().any(|(name, ..)| *name == Coefficient::R) {
        let (low, high) = mapping.valid_i_out;
        for end in [low, high] {
            conditions.push(format!("{p}_flag((a + (r * {})) > 0.0f)", float(end.value())));
        }
    }
    conditions
}

fn mapping_assignments(program: &Program) -> Vec<String> {
    let coefficients = program.mapping.iter().flat_map(|mapping| &mapping.coefficients);
    coefficients
        .map(|(name, ..)| name.name())
        .map(|name| format!("state->mapping_{name} = {name};"))
        .collect()
}

fn helpers(program: &Program) -> Helpers {
    let ops = || {
        let blocks = [&program.front.block, &program.decide.block, &program.advance.block];
        blocks.into_iter().flat_map(|block| &block.ops)
    };
    let real = matches!(program.network, NetworkCode::Real { .. });
    let network = &program.network;
    Helpers {
        within: ops().any(|op| matches!(op, Op::Within { .. })),
        outside: ops().any(|op| matches!(op, Op::Outside { .. })),
        clamp: ops().any(|op| matches!(op, Op::Clamp { .. })),
        line_sum: ops().any(|op| matches!(op, Op::LineSum { .. })),
        relu: real && network.activates(|activation| activation == ActivationCode::Relu),
        relu_by_sum: program.has_fpu,
        leaky_relu: real && network.activates(|activation| matches!(activation, ActivationCode::LeakyRelu(_))),
        tanh: network.activates(|activation| activation == ActivationCode::Tanh),
        assembly: match network {
            NetworkCode::Real { layers, .. } => layers.iter().any(RealKernel::is_for),
            NetworkCode::Integer(network) => integer::is_in_assembly(network),
        },
        vectors: match network {
            NetworkCode::Real { layers, .. } => layers.iter().any(|layer| layer.has_vectors),
            NetworkCode::Integer(_) => false,
        },
        alignment: match network {
            NetworkCode::Real { layers, .. } => layers.iter().find_map(|layer| layer.alignment),
            // words, although the elements are smaller
            NetworkCode::Integer(_) => Some(4),
        },
        fused: matches!(network, NetworkCode::Real { fused: true, .. }),
    }
}
