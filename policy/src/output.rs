//! Duties of a controller: one, or several that are decided from one network (contract section 9b).

use serde::Serialize;
use toml_input::Message;

use crate::head::Head;
use crate::model::{Input, Limits, Mapping, Policy};

/// One of several outputs: which columns of the last layer decide it, and what stands between them and the hardware.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Output {
    /// Identifier in generated code: `[a-z][a-z0-9_]*`.
    pub name: String,
    /// First column of the last layer; the head has as many as it needs from there on.
    pub column: usize,
    /// What these columns mean: a choice of duties or a continuous head.
    #[serde(serialize_with = "shown")]
    pub head: Head,
    /// Duty ratio mapping, if any.
    #[serde(skip)]
    pub mapping: Option<Mapping>,
    /// Limits of the commanded duty.
    pub limits: Limits,
    /// Duty without a usable measurement, 0..1.
    pub fallback: f64,
}

impl Output {
    /// Its columns of the last layer.
    #[must_use]
    pub fn columns(&self) -> std::ops::Range<usize> {
        self.column..self.column + self.head.outputs()
    }
}

/// A head as the digest of a contract takes it; outputs have no other than these two.
fn shown<S: serde::Serializer>(head: &Head, serializer: S) -> Result<S::Ok, S::Error> {
    (head.actions(), head.continuous()).serialize(serializer)
}

/// The way of one duty from the network to the hardware, of a contract with one output as of one with several.
#[derive(Debug, Clone, Copy)]
pub struct DutyPath<'a> {
    /// Name of the output; `None` where there is one.
    pub name: Option<&'a str>,
    /// First column of the last layer.
    pub column: usize,
    /// What the columns mean.
    pub head: &'a Head,
    /// Duty ratio mapping, if any.
    pub mapping: Option<&'a Mapping>,
    /// Limits of the commanded duty.
    pub limits: &'a Limits,
    /// Duty without a usable measurement.
    pub fallback: f64,
    /// How expressions call the duty before its mapping of the step before.
    pub previous_duty: Input,
    /// How they call the duty that left the controller.
    pub previous_command: Input,
}

impl DutyPath<'_> {
    /// Columns of the last layer.
    #[must_use]
    pub fn columns(&self) -> std::ops::Range<usize> {
        self.column..self.column + self.head.outputs()
    }

    /// `stem` where there is one output, `stem_left` of the output `left`.
    #[must_use]
    pub fn named(&self, stem: &str) -> String {
        self.name.map_or(stem.to_owned(), |name| format!("{stem}_{name}"))
    }
}

impl Policy {
    /// The outputs, of which one contract has one or several.
    #[must_use]
    pub fn paths(&self) -> Vec<DutyPath<'_>> {
        let Head::Several(outputs) = &self.head else {
            return vec![DutyPath {
                name: None,
                column: 0,
                head: &self.head,
                mapping: self.mapping.as_ref(),
                limits: &self.limits,
                fallback: self.fallback.duty,
                previous_duty: Input::PreviousDuty,
                previous_command: Input::PreviousCommand,
            }];
        };
        let path = |(index, output): (usize, &'_ Output)| DutyPath {
            name: Some(&outputs[index].name),
            column: output.column,
            head: &outputs[index].head,
            mapping: outputs[index].mapping.as_ref(),
            limits: &outputs[index].limits,
            fallback: output.fallback,
            previous_duty: Input::OutputDuty(index),
            previous_command: Input::OutputCommand(index),
        };
        outputs.iter().enumerate().map(path).collect()
    }

    /// Names of several outputs; none where there is one.
    #[must_use]
    pub fn output_names(&self) -> Vec<&str> {
        self.paths().into_iter().filter_map(|path| path.name).collect()
    }

    /// The same with another mapping of the output of that index.
    #[must_use]
    pub fn with_mapping(mut self, output: usize, mapping: Mapping) -> Self {
        match &mut self.head {
            Head::Several(outputs) => {
                if let Some(own) = outputs.get_mut(output) {
                    own.mapping = Some(mapping);
                }
            }
            _ => self.mapping = Some(mapping),
        }
        self
    }

    /// The way of the output of that index; the first where there is no such one.
    #[must_use]
    pub fn path(&self, output: usize) -> DutyPath<'_> {
        let mut paths = self.paths();
        let index = if output < paths.len() { output } else { 0 };
        paths.swap_remove(index)
    }

    /// Index of the output of that name, for whoever works with one duty; 0 of a contract with one output, which has no name.
    ///
    /// # Errors
    /// A contract with several and no name, one with another name, or one output and a name.
    pub fn chosen_output(&self, wanted: Option<&str>) -> Result<usize, Message> {
        let names = self.output_names();
        let list = names.join(", ");
        match (wanted, names.as_slice()) {
            (None, []) => Ok(0),
            (Some(wanted), []) => {
                let message = Message::new("an output by name, and a contract with one, which has none");
                Err(message.found(wanted).expected("no name"))
            }
            (None, _) => {
                let message = Message::new("this contract has several outputs, and one duty is taken here");
                Err(message
                    .found(format!("outputs {list}"))
                    .expected("the name of one of them"))
            }
            (Some(wanted), names) => names.iter().position(|name| *name == wanted).ok_or_else(|| {
                let message = Message::new("the contract has no output of this name").found(wanted);
                let message = message.expected(format!("one of {list}"));
                message.did_you_mean(wanted, names.iter().copied())
            }),
        }
    }
}
