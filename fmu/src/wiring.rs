//! The `[fmu]` table of a plant file, and what it names in an FMU.
//!
//! ```text
//! [fmu]                     file, step
//! [fmu.inputs]              duty, one or more loads, v_in      ─► variables that are set while it runs
//! [fmu.outputs]             v_out, i_l, i_out, v_in            ─► variables that are read
//! [fmu.initial]             v_out, i_l                         ─► start values that every run sets
//! [fmu.parameters]          "converter.inductance" = "L"       ─► start values from the plant's file
//! [fmu.start]               "name" = 1.0                       ─► start values that never change
//! ```

use plant::{Parameter, Parameters, Surroundings};
use toml_input::{Document, FileName, Message, Sink, Table, Value};

use crate::description::{Description, Kind, Variable};
use crate::instance::Port;
use crate::units;

/// What a port is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    /// Set while the FMU runs.
    Input,
    /// Read.
    Output,
    /// Set before the initialisation.
    Start,
}

/// The loads that an FMU can be told.
#[derive(Debug, Clone, Default)]
pub(crate) struct Loads {
    /// A
    pub current: Option<Port>,
    /// S
    pub conductance: Option<Port>,
    /// ohm
    pub resistance: Option<Port>,
    /// W
    pub power: Option<Port>,
}

/// The variables of an FMU by what they are for.
#[derive(Debug, Clone)]
pub(crate) struct Wiring {
    /// Communication steps in a control period.
    pub steps: u32,
    pub duty: Port,
    pub loads: Loads,
    pub source: Option<Port>,
    pub v_out: Port,
    pub i_l: Port,
    pub i_out: Option<Port>,
    pub v_in: Option<Port>,
    pub initial: [Option<Port>; 2],
    pub parameters: Vec<(&'static Parameter, Port)>,
    pub start: Vec<(Port, f64)>,
}

/// Most communication steps in a control period.
// a switched model at 200 kHz in steps of 10 ns has 500
const MOST_STEPS: f64 = 100_000.0;

/// The `[fmu]` table of a plant file.
pub(crate) struct Settings<'a> {
    document: &'a Document,
    table: Table<'a>,
    file: Value<'a>,
    /// The archive.
    pub name: FileName,
}

impl<'a> Settings<'a> {
    /// Finds the table and the name of the archive.
    pub fn new(document: &'a Document, faults: &mut Sink) -> Option<Self> {
        let mut table = document.peek(&["fmu"])?.table("[fmu]", faults)?;
        let file = table.required(
            "file",
            "the FMU, from the folder of this file: \"converter.fmu\"",
            faults,
        )?;
        let name = document.source().name.beside(file.text(faults)?);
        Some(Self {
            document,
            table,
            file,
            name,
        })
    }

    /// A fault of the archive, at the line that names it.
    pub fn fault(&self, message: Message) -> toml_input::Fault {
        self.file.fault(message)
    }

    /// Looks every name up.
    pub fn wire(mut self, told: &Description, nominal: &Parameters, faults: &mut Sink) -> Option<Wiring> {
        let steps = self.steps(told, nominal, faults);
        let look = Look { told };
        let mut inputs = section(&mut self.table, "inputs", "[fmu.inputs]", faults);
        let mut outputs = section(&mut self.table, "outputs", "[fmu.outputs]", faults);
        let mut initial = section(&mut self.table, "initial", "[fmu.initial]", faults);
        let missing = |what: &str| format!("the name of the FMU's variable: {what}");
        let input = missing("duty ratio 0 to 1, which the controller commands");
        let duty = look.required(
            &mut inputs,
            "[fmu.inputs]",
            "duty",
            "1",
            Use::Input,
            &input,
            self.document,
            faults,
        );
        let mut load = |key, unit| look.optional(&mut inputs, key, unit, Use::Input, faults);
        let loads = Loads {
            current: load("load_current", "A"),
            conductance: load("load_conductance", "S"),
            resistance: load("load_resistance", "ohm"),
            power: load("load_power", "W"),
        };
        let source = load("v_in", "V");
        let what = [missing("output voltage"), missing("inductor current")];
        let mut output = |key, unit, hint: &str, faults: &mut Sink| {
            look.required(
                &mut outputs,
                "[fmu.outputs]",
                key,
                unit,
                Use::Output,
                hint,
                self.document,
                faults,
            )
        };
        let v_out = output("v_out", "V", &what[0], faults);
        let i_l = output("i_l", "A", &what[1], faults);
        let i_out = look.optional(&mut outputs, "i_out", "A", Use::Output, faults);
        let v_in = look.optional(&mut outputs, "v_in", "V", Use::Output, faults);
        let start = [("v_out", "V"), ("i_l", "A")]
            .map(|(key, unit)| look.optional(&mut initial, key, unit, Use::Start, faults));
        for table in [inputs, outputs, initial].into_iter().flatten() {
            table.finish(faults);
        }
        let parameters = self.parameters(&look, faults);
        let fixed = self.start(&look, faults);
        self.untold(nominal, &parameters, faults);
        self.table.finish(faults);
        Some(Wiring {
            steps: steps?,
            duty: duty?,
            loads,
            source,
            v_out: v_out?,
            i_l: i_l?,
            i_out,
            v_in,
            initial: start,
            parameters,
            start: fixed,
        })
    }

    fn steps(&mut self, told: &Description, nominal: &Parameters, faults: &mut Sink) -> Option<u32> {
        let t_sample = nominal.t_sw();
        let value = self.table.optional("step");
        let step = match &value {
            None => t_sample,
            Some(value) => value.positive(faults)?,
        };
        let place = |message: Message| value.as_ref().unwrap_or(&self.file).fault(message);
        let steps = (t_sample / step).round();
        // a decimal step and 1 / f_sw may differ by rounding
        if !(1.0..=MOST_STEPS).contains(&steps) || (steps * step / t_sample - 1.0).abs() > 1e-9 {
            let message = Message::new("the communication step does not divide the control period");
            let message = message.found(format!("step = {step} s, a control period of {t_sample} s"));
            faults.push(place(
                message.expected(format!("{t_sample} / N s with N of 1 to {MOST_STEPS}")),
            ));
            return None;
        }
        if let Some(own) = told.internal_step.filter(|own| own.is_finite() && *own > 0.0) {
            let inside = step / own;
            if inside < 0.5 || (inside.round() / inside - 1.0).abs() > 1e-6 {
                let message = Message::new("the FMU's own step does not divide the communication step");
                let message = message.found(format!("step = {step} s, fixedInternalStepSize = {own} s in the FMU"));
                faults.push(place(message.expected("a multiple of the FMU's own step")));
                return None;
            }
        }
        Some(steps as u32)
    }

    /// `[fmu.parameters]`: numbers of the plant file that the FMU is told.
    fn parameters(&mut self, look: &Look<'_>, faults: &mut Sink) -> Vec<(&'static Parameter, Port)> {
        let mut all = Vec::new();
        let Some(value) = self.table.optional("parameters") else {
            return all;
        };
        for (key, value) in value.pairs(faults).unwrap_or_default() {
            let Some(parameter) = plant::parameter(&key.value) else {
                faults.push(value.fault(closed_loop::read::no_number(&key.value)));
                continue;
            };
            if Surroundings::has(parameter.key) || parameter.key == "converter.f_sw" {
                let message = Message::new(format!("`{}` is not the FMU's", parameter.key));
                faults.push(
                    value.fault(message.found("a number of modulator, sensors or load box, which are applied here")),
                );
                continue;
            }
            if let Some(port) = look.up(&value, parameter.unit, Use::Start, faults) {
                all.push((parameter, port));
            }
        }
        all
    }

    /// `[fmu.start]`: variables of the FMU with a value of their own.
    fn start(&mut self, look: &Look<'_>, faults: &mut Sink) -> Vec<(Port, f64)> {
        let mut all = Vec::new();
        let Some(value) = self.table.optional("start") else {
            return all;
        };
        for (key, value) in value.pairs(faults).unwrap_or_default() {
            let Some(port) = look.named(&key.value, &value, None, Use::Start, faults) else {
                continue;
            };
            let number = match (port.kind, value.as_boolean()) {
                (Kind::Boolean, _) => value.boolean(faults).map(f64::from),
                (Kind::Integer, _) => value.integer(i32::MIN..=i32::MAX, faults).map(f64::from),
                (Kind::Number, _) => value.number(faults),
            };
            all.extend(number.map(|number| (port, number)));
        }
        all
    }

    /// Effects of the plant file that nobody would compute.
    fn untold(&self, nominal: &Parameters, told: &[(&'static Parameter, Port)], faults: &mut Sink) {
        for parameter in plant::parameters() {
            let is_nominal = parameter.key.starts_with("converter.");
            let is_told = told.iter().any(|(other, _)| other.key == parameter.key);
            if is_nominal || is_told || Surroundings::has(parameter.key) || parameter.get(nominal) == parameter.neutral
            {
                continue;
            }
            faults.push(self.file.fault(untold(parameter.key)));
        }
    }
}

/// A number of the plant that the FMU does not know.
pub(crate) fn untold(key: &str) -> Message {
    let message = Message::new(format!("the FMU is not told of `{key}`"));
    message.hint(format!(
        "\"{key}\" = \"NAME\" in [fmu.parameters], if it is a parameter of the FMU; else take it out"
    ))
}

fn section<'a>(table: &mut Table<'a>, key: &'static str, title: &str, faults: &mut Sink) -> Option<Table<'a>> {
    table.optional(key).and_then(|value| value.table(title, faults))
}

/// Looks names up in a description.
struct Look<'d> {
    told: &'d Description,
}

impl Look<'_> {
    #[allow(clippy::too_many_arguments, reason = "a row of a table")]
    fn required(
        &self,
        table: &mut Option<Table<'_>>,
        title: &str,
        key: &'static str,
        unit: &str,
        purpose: Use,
        hint: &str,
        document: &Document,
        faults: &mut Sink,
    ) -> Option<Port> {
        let Some(table) = table else {
            let message = Message::new(format!("{title} has no `{key}`")).hint(hint);
            faults.push(document.source().name.fault(message));
            return None;
        };
        let value = table.required(key, hint, faults)?;
        self.up(&value, unit, purpose, faults)
    }

    fn optional(
        &self,
        table: &mut Option<Table<'_>>,
        key: &'static str,
        unit: &str,
        purpose: Use,
        faults: &mut Sink,
    ) -> Option<Port> {
        let value = table.as_mut()?.optional(key)?;
        self.up(&value, unit, purpose, faults)
    }

    /// The variable whose name is the value.
    fn up(&self, value: &Value<'_>, unit: &str, purpose: Use, faults: &mut Sink) -> Option<Port> {
        let name = value.text(faults)?;
        self.named(name, value, Some(unit), purpose, faults)
    }

    fn named(
        &self,
        name: &str,
        value: &Value<'_>,
        unit: Option<&str>,
        purpose: Use,
        faults: &mut Sink,
    ) -> Option<Port> {
        let Some(variable) = self.told.variables.get(name) else {
            let message = Message::new(format!("the FMU has no variable `{}`", name.escape_debug()));
            let usable = self
                .told
                .variables
                .iter()
                .filter(|(_, variable)| usable(variable, purpose));
            let names: Vec<&str> = usable.map(|(name, _)| name.as_str()).collect();
            let message = message
                .expected(listed(&names))
                .did_you_mean(name, names.iter().copied());
            faults.push(value.fault(message));
            return None;
        };
        let before = faults.count();
        let shown = name.escape_debug();
        if !usable(variable, purpose) {
            let (what, expected) = match purpose {
                Use::Input => ("is no input", "causality = \"input\""),
                Use::Output => ("is no output", "causality = \"output\" or \"local\""),
                Use::Start => (
                    "cannot be set before a run",
                    "a parameter, an input, or initial = \"exact\" or \"approx\"",
                ),
            };
            let message = Message::new(format!("`{shown}` of the FMU {what}"));
            let found = format!(
                "causality = \"{}\", variability = \"{}\"",
                variable.causality, variable.variability
            );
            faults.push(value.fault(message.found(found).expected(expected)));
        }
        let kind = variable.kind();
        // what carries a unit is a number; a start value may be a whole number or a truth value
        let fits = kind.is_some_and(|kind| kind == Kind::Number || unit.is_none()) && !variable.is_array;
        if !fits {
            let message = Message::new(format!("`{shown}` of the FMU is of another type"));
            let array = if variable.is_array { "an array of " } else { "" };
            let expected = if unit.is_some() {
                "Real or Float64, a scalar"
            } else {
                "Real, Float64, Integer, Int32 or Boolean, a scalar"
            };
            faults.push(value.fault(message.found(format!("{array}{}", variable.element)).expected(expected)));
        }
        if let (Some(wanted), Some(declared)) = (unit, &variable.unit) {
            let base = self.told.units.get(declared);
            if !units::is_in(wanted, declared, base) {
                let message = Message::new(format!("`{shown}` of the FMU has another unit"));
                let factor = base.map_or(String::new(), |base| {
                    format!(" (factor {}, offset {})", base.factor, base.offset)
                });
                let message = message
                    .found(format!("\"{}\"{factor}", declared.escape_debug()))
                    .expected(wanted);
                faults.push(value.fault(message.hint("export it in SI units: nothing is converted here")));
            }
        }
        (faults.count() == before).then_some(Port {
            name: name.to_owned(),
            reference: variable.reference,
            kind: kind?,
        })
    }
}

fn usable(variable: &Variable, purpose: Use) -> bool {
    match purpose {
        Use::Input => variable.causality == "input",
        Use::Output => ["output", "local"].contains(&variable.causality.as_str()),
        Use::Start => variable.can_start(),
    }
}

/// Names for a message, not all of a thousand.
fn listed(names: &[&str]) -> String {
    const SHOWN: usize = 12;
    let shown: Vec<String> = names
        .iter()
        .take(SHOWN)
        .map(|name| name.escape_debug().to_string())
        .collect();
    match names.len() {
        0 => "the FMU has none that would do".to_owned(),
        n if n > SHOWN => format!("one of {}, and {} more", shown.join(", "), n - SHOWN),
        _ => format!("one of {}", shown.join(", ")),
    }
}
