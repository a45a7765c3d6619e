//! The variables of an FMU: the block's ports and parameters with types, units and start values.

use policy::Scalar;
use templates::block::{BlockView, ParameterView};
use templates::fmu::{Kind, UnitView, VariableView};

use crate::backend::literal::number;
use crate::program::{OutputCode, Program, SignalPort};

/// Inputs, `enable`, outputs, parameters; and a name for the time that none of them has.
pub fn of(program: &Program, block: &BlockView) -> (Vec<VariableView>, String) {
    let scalar = program.scalar();
    let inputs = program.signals.iter().zip(&block.inputs).enumerate();
    let mut all: Vec<VariableView> = inputs
        .map(|(index, (signal, port))| input(scalar, index, signal, &port.meaning))
        .collect();
    all.push(VariableView {
        name: "enable".to_owned(),
        kind: Kind::Boolean,
        attributes: " start=\"true\"".to_owned(),
        start_c: Some("1.0".to_owned()),
        ..plain("input", "discrete", format!("inputs[{}]", program.signals.len()))
            .meaning("true: works; false: fallback duty, state as after start")
    });
    for (index, (name, kind, meaning)) in outputs(program).into_iter().enumerate() {
        all.push(VariableView {
            name,
            kind,
            initial: Some("calculated"),
            ..plain("output", "discrete", format!("outputs[{index}]")).meaning(meaning)
        });
    }
    for (index, parameter) in block.parameters.iter().enumerate() {
        let ParameterView { name, value, low, high } = parameter;
        all.push(VariableView {
            name: name.clone(),
            initial: Some("exact"),
            attributes: format!(" min=\"{low}\" max=\"{high}\" start=\"{value}\""),
            start_c: Some(value.clone()),
            ..plain("parameter", "tunable", format!("coefficients[{index}]"))
                .meaning("coefficient of the duty ratio mapping; set before a step, it counts from the one after it")
        });
    }
    let time = name_all(&mut all, program);
    (all, time)
}

/// Name, type and meaning of each output, in the order of the block's: `duty_left` of the output `left`.
fn outputs(program: &Program) -> Vec<(String, Kind, &'static str)> {
    let each = |stem, kind, meaning| {
        let named = move |output: &OutputCode| (output.named(stem), kind, meaning);
        program.outputs.iter().map(named)
    };
    let duty = "commanded duty, 0 to 1, for the control period that begins with the step";
    let status = "status bits; 65536 is added while the coefficients are refused";
    each("duty", Kind::Real, duty)
        .chain(each("action", Kind::Integer, "index of the greedy action, from 0"))
        .chain([("status".to_owned(), Kind::Integer, status)])
        .collect()
}

/// Signals keep their names; our own names give way with underscores.
fn name_all(all: &mut [VariableView], program: &Program) -> String {
    // a signal's name is the user's, who connects it by that name
    let mut taken: Vec<String> = program.signals.iter().map(|signal| signal.name.clone()).collect();
    let mut free = |name: &str| {
        let mut name = name.to_owned();
        while taken.contains(&name) {
            name.push('_');
        }
        taken.push(name.clone());
        name
    };
    for (index, variable) in all.iter_mut().enumerate() {
        // 0 is the time in FMI 3
        variable.reference = index + 1;
        if index >= program.signals.len() {
            variable.name = free(&variable.name);
        }
    }
    free("time")
}

fn plain(causality: &'static str, variability: &'static str, place: String) -> VariableView {
    VariableView {
        name: String::new(),
        reference: 0,
        kind: Kind::Real,
        causality,
        variability,
        initial: None,
        comment: String::new(),
        description: String::new(),
        attributes: String::new(),
        place,
        start_c: None,
    }
}

trait Meaning {
    fn meaning(self, text: &str) -> Self;
}

impl Meaning for VariableView {
    fn meaning(mut self, text: &str) -> Self {
        self.comment = text.to_owned();
        self.description = xml(text);
        self
    }
}

fn input(scalar: Scalar, index: usize, signal: &SignalPort, meaning: &str) -> VariableView {
    let place = format!("inputs[{index}]");
    if signal.is_code {
        // a code has no unit, and which one stands for the initial value only the converter knows
        return VariableView {
            name: signal.name.clone(),
            kind: Kind::Integer,
            attributes: " start=\"0\"".to_owned(),
            start_c: Some("0.0".to_owned()),
            ..plain("input", "discrete", place).meaning(meaning)
        };
    }
    let start = number(scalar, signal.initial);
    let unit = match signal.unit.as_str() {
        "" => String::new(),
        unit => format!(" unit=\"{}\"", xml(unit)),
    };
    VariableView {
        name: signal.name.clone(),
        attributes: format!("{unit} start=\"{start}\""),
        start_c: Some(start),
        ..plain("input", "continuous", place).meaning(meaning)
    }
}

/// Units of the inputs, each once, with base units as far as they are known here.
pub fn units(program: &Program) -> Vec<UnitView> {
    let mut all: Vec<UnitView> = Vec::new();
    for signal in program
        .signals
        .iter()
        .filter(|signal| !signal.is_code && !signal.unit.is_empty())
    {
        let unit = UnitView {
            name: xml(&signal.unit),
            base: base(&signal.unit),
        };
        if !all.contains(&unit) {
            all.push(unit);
        }
    }
    all
}

fn base(unit: &str) -> Option<&'static str> {
    Some(match unit {
        "V" => "kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\"",
        "mV" => "kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\" factor=\"0.001\"",
        "kV" => "kg=\"1\" m=\"2\" s=\"-3\" A=\"-1\" factor=\"1000\"",
        "A" => "A=\"1\"",
        "mA" => "A=\"1\" factor=\"0.001\"",
        "W" => "kg=\"1\" m=\"2\" s=\"-3\"",
        "kW" => "kg=\"1\" m=\"2\" s=\"-3\" factor=\"1000\"",
        "ohm" | "Ohm" | "Ω" => "kg=\"1\" m=\"2\" s=\"-3\" A=\"-2\"",
        "s" => "s=\"1\"",
        "Hz" => "s=\"-1\"",
        "K" => "K=\"1\"",
        "degC" | "°C" => "K=\"1\" offset=\"273.15\"",
        // a unit without base units is allowed; guessed ones would be converted
        _ => return None,
    })
}

/// Text inside an attribute: on one line, without the characters that XML takes for its own.
pub fn xml(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // XML 1.0 cannot say most of them, not even as a reference
            c if c.is_control() => escaped.push(' '),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_a_user_cannot_end_an_attribute() {
        assert_eq!(xml("a\"/><b c='&'\n"), "a&quot;/&gt;&lt;b c='&amp;' ");
        assert_eq!(xml("µV·Ω"), "µV·Ω");
    }
}
