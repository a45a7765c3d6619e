//! `modelDescription.xml`: what an FMU says of itself.
//!
//! Only what an importer for co-simulation needs is read, from FMI 2.0 (section 2.2) and FMI 3.0 (section 2.4). The reader keeps
//! no tree and expands no entity of the file's own.

use std::collections::BTreeMap;

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use toml_input::Message;

use crate::units::BaseUnit;

/// Largest description, bytes.
// a line a variable: hundreds of thousands of variables
pub(crate) const LARGEST: u64 = 128 << 20;

/// Which standard an FMU follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0
    Two,
    /// FMI 3.0 and what is compatible with it, 3.x
    Three,
}

/// What a variable holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// `Real`, `Float64`
    Number,
    /// `Integer`, `Int32`
    Integer,
    /// `Boolean`
    Boolean,
}

/// A scalar variable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Variable {
    pub reference: u32,
    pub causality: String,
    pub variability: String,
    pub initial: Option<String>,
    /// Its element, such as `Real` or `Float64`.
    pub element: String,
    /// Name of the unit, its own or that of its type.
    pub unit: Option<String>,
    /// An array of FMI 3.
    pub is_array: bool,
    /// It has a start value in the file.
    pub has_start: bool,
}

impl Variable {
    /// What it holds, if that can be read and written here.
    pub fn kind(&self) -> Option<Kind> {
        match self.element.as_str() {
            "Real" | "Float64" => Some(Kind::Number),
            "Integer" | "Int32" => Some(Kind::Integer),
            "Boolean" => Some(Kind::Boolean),
            _ => None,
        }
    }

    /// Whether it can be set before the initialisation: an input, a parameter, or a start value that the FMU does not compute.
    pub fn can_start(&self) -> bool {
        let given = match self.initial.as_deref() {
            Some(initial) => initial == "exact" || initial == "approx",
            // the standards' default of outputs and locals is `calculated`
            None => self.has_start && self.causality != "output",
        };
        self.variability != "constant" && (["input", "parameter"].contains(&self.causality.as_str()) || given)
    }
}

/// What an FMU says of itself.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Description {
    pub version: Version,
    pub model: String,
    /// `guid` of FMI 2, `instantiationToken` of FMI 3.
    pub token: String,
    /// `modelIdentifier` of the co-simulation: the name of the binary.
    pub identifier: String,
    pub variable_step: bool,
    pub once_per_process: bool,
    pub needs_tool: bool,
    /// s
    pub internal_step: Option<f64>,
    pub variables: BTreeMap<String, Variable>,
    pub units: BTreeMap<String, BaseUnit>,
}

type Attributes = BTreeMap<String, String>;

/// What is being read.
#[derive(Default)]
struct Draft {
    root: Attributes,
    co_simulation: Option<Attributes>,
    others: Vec<&'static str>,
    variables: BTreeMap<String, Variable>,
    units: BTreeMap<String, BaseUnit>,
    /// Unit by name of a type.
    types: BTreeMap<String, String>,
    /// Type by name of a variable that has no unit of its own.
    of_type: Vec<(String, String)>,
}

impl Description {
    /// Reads the file.
    ///
    /// # Errors
    /// If it is no sound XML, of another version, or not for co-simulation.
    pub fn read(bytes: &[u8]) -> Result<Self, Message> {
        let text = std::str::from_utf8(bytes).map_err(|_| broken("text that is not UTF-8"))?;
        draft(text.trim_start_matches('\u{feff}'))?.finish()
    }
}

/// All elements of the file; their depth is counted, not stacked.
fn draft(text: &str) -> Result<Draft, Message> {
    let mut reader = Reader::from_str(text);
    reader.config_mut().check_end_names = true;
    let mut draft = Draft::default();
    let mut path: Vec<String> = Vec::new();
    // the scalar variable or the unit or type that encloses what comes
    let mut outer = Attributes::new();
    loop {
        let at = reader.buffer_position();
        let wrong = |error: &dyn std::fmt::Display| broken(&format!("byte {at}: {error}"));
        let event = reader.read_event().map_err(|error| wrong(&error))?;
        let (tag, closed) = match &event {
            Event::Start(tag) => (tag, false),
            Event::Empty(tag) => (tag, true),
            Event::End(_) => {
                path.pop();
                continue;
            }
            Event::Eof if path.is_empty() && !draft.root.is_empty() => return Ok(draft),
            Event::Eof => return Err(broken("the file ends early")),
            _ => continue,
        };
        // deeper than any element of the standards; annotations of tools may nest
        if path.len() > 100 {
            return Err(wrong(&"elements nested more than 100 deep"));
        }
        let name = tag.local_name().as_ref().to_owned();
        let own = attributes(tag).map_err(|error| wrong(&error))?;
        draft.element(&path, &name, own, &mut outer)?;
        if !closed {
            path.push(name);
        }
    }
}

fn attributes(tag: &BytesStart<'_>) -> Result<Attributes, String> {
    let mut all = Attributes::new();
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|error| error.to_string())?;
        let key = attribute.key.local_name().into_inner().to_owned();
        let value = attribute
            .normalized_value(XmlVersion::Implicit1_0)
            .map_err(|error| error.to_string())?;
        all.insert(key, value.into_owned());
    }
    Ok(all)
}

impl Draft {
    fn element(&mut self, path: &[String], name: &str, own: Attributes, outer: &mut Attributes) -> Result<(), Message> {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        match (path.as_slice(), name) {
            ([], "fmiModelDescription") => self.root = own,
            ([], other) => return Err(broken(&format!("the outermost element is <{}>", other.escape_debug()))),
            ([_], "CoSimulation") => self.co_simulation = Some(own),
            ([_], "ModelExchange") => self.others.push("model exchange"),
            ([_], "ScheduledExecution") => self.others.push("scheduled execution"),
            // FMI 2: the element around has the name, that within the type
            ([_, "ModelVariables"], "ScalarVariable")
            | ([_, "UnitDefinitions"], "Unit")
            | ([_, "TypeDefinitions"], "SimpleType") => {
                *outer = own;
            }
            ([_, "ModelVariables", "ScalarVariable"], _) if name != "Annotations" => {
                let mut all = std::mem::take(outer);
                all.extend(own);
                self.variable(name, all)?;
            }
            // FMI 3: one element
            ([_, "ModelVariables"], _) => {
                *outer = own.clone();
                self.variable(name, own)?;
            }
            ([_, "ModelVariables", _], "Dimension") => {
                let known = outer.get("name").and_then(|name| self.variables.get_mut(name));
                known.into_iter().for_each(|variable| variable.is_array = true);
            }
            ([_, "UnitDefinitions", "Unit"], "BaseUnit") => self.unit(outer.get("name"), &own)?,
            ([_, "TypeDefinitions", "SimpleType"], _) => self.unit_of_type(outer.get("name"), &own),
            ([_, "TypeDefinitions"], _) => self.unit_of_type(own.get("name"), &own),
            _ => {}
        }
        Ok(())
    }

    fn unit_of_type(&mut self, name: Option<&String>, own: &Attributes) {
        if let (Some(name), Some(unit)) = (name, own.get("unit")) {
            self.types.insert(name.clone(), unit.clone());
        }
    }

    fn unit(&mut self, name: Option<&String>, own: &Attributes) -> Result<(), Message> {
        let Some(name) = name else { return Ok(()) };
        let number = |key: &str, usual: f64| match own.get(key) {
            None => Ok(usual),
            Some(text) => text
                .trim()
                .parse::<f64>()
                .map_err(|_| broken(&format!("{key} = \"{}\" of a unit", text.escape_debug()))),
        };
        let exponent = |key: &str| number(key, 0.0).map(|value| value as i32);
        let others = ["K", "mol", "cd", "rad"]
            .into_iter()
            .map(exponent)
            .collect::<Result<Vec<_>, _>>()?;
        let others = others.into_iter().map(i32::unsigned_abs).fold(0, u32::saturating_add);
        let base = BaseUnit {
            exponents: [
                exponent("kg")?,
                exponent("m")?,
                exponent("s")?,
                exponent("A")?,
                i32::try_from(others).unwrap_or(i32::MAX),
            ],
            factor: number("factor", 1.0)?,
            offset: number("offset", 0.0)?,
        };
        self.units.insert(name.clone(), base);
        Ok(())
    }

    fn variable(&mut self, element: &str, all: Attributes) -> Result<(), Message> {
        let text = |key: &str| all.get(key).cloned();
        let Some(name) = text("name") else {
            return Err(broken(&format!("a <{}> without a name", element.escape_debug())));
        };
        let reference = text("valueReference").unwrap_or_default();
        let Ok(reference) = reference.trim().parse() else {
            let found = format!(
                "`{}` with valueReference = \"{}\"",
                name.escape_debug(),
                reference.escape_debug()
            );
            return Err(broken(&found));
        };
        let unit = text("unit");
        if let (None, Some(kind)) = (&unit, text("declaredType")) {
            self.of_type.push((name.clone(), kind));
        }
        let variable = Variable {
            reference,
            causality: text("causality").unwrap_or_else(|| "local".to_owned()),
            variability: text("variability").unwrap_or_else(|| "continuous".to_owned()),
            initial: text("initial"),
            element: element.to_owned(),
            unit,
            is_array: false,
            has_start: all.contains_key("start"),
        };
        match self.variables.insert(name.clone(), variable) {
            None => Ok(()),
            Some(_) => Err(broken(&format!("the variable `{}` twice", name.escape_debug()))),
        }
    }

    fn finish(mut self) -> Result<Description, Message> {
        let version = version(self.root.get("fmiVersion"))?;
        let Some(own) = self.co_simulation else {
            let found = if self.others.is_empty() {
                "nothing that can be run".to_owned()
            } else {
                self.others.join(", ")
            };
            let message = Message::new("the FMU is not for co-simulation").found(found);
            return Err(message.hint("export it once more as an FMU for co-simulation, which brings its own solver"));
        };
        for (name, kind) in self.of_type {
            if let (Some(variable), Some(unit)) = (self.variables.get_mut(&name), self.types.get(&kind)) {
                variable.unit = Some(unit.clone());
            }
        }
        let is_true = |key: &str| matches!(own.get(key).map(String::as_str), Some("true" | "1"));
        let required = |all: &Attributes, key: &str| {
            let text = all.get(key).filter(|text| !text.contains('\0')).cloned();
            text.ok_or_else(|| broken(&format!("no `{key}`")))
        };
        let identifier = required(&own, "modelIdentifier")?;
        // it becomes the name of a file
        if identifier.is_empty()
            || !identifier
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "_-.+".contains(c))
            || identifier.starts_with('.')
        {
            return Err(broken(&format!("modelIdentifier = \"{}\"", identifier.escape_debug())));
        }
        Ok(Description {
            version,
            model: self
                .root
                .get("modelName")
                .cloned()
                .unwrap_or_else(|| identifier.clone()),
            token: match version {
                Version::Two => required(&self.root, "guid")?,
                Version::Three => required(&self.root, "instantiationToken")?,
            },
            identifier,
            variable_step: is_true("canHandleVariableCommunicationStepSize"),
            once_per_process: is_true("canBeInstantiatedOnlyOncePerProcess"),
            needs_tool: is_true("needsExecutionTool"),
            internal_step: own
                .get("fixedInternalStepSize")
                .and_then(|text| text.trim().parse().ok()),
            variables: self.variables,
            units: self.units,
        })
    }
}

fn version(text: Option<&String>) -> Result<Version, Message> {
    match text.map(String::as_str) {
        Some("2.0") => Ok(Version::Two),
        Some(text) if text == "3.0" || text.starts_with("3.0.") || text.starts_with("3.0-") || text == "3.1" => {
            Ok(Version::Three)
        }
        other => {
            let found = format!("fmiVersion = \"{}\"", other.unwrap_or_default().escape_debug());
            Err(Message::new("the FMU is of another version of FMI")
                .found(found)
                .expected("2.0 or 3.0"))
        }
    }
}

fn broken(found: &str) -> Message {
    Message::new("modelDescription.xml is not sound").found(found)
}
