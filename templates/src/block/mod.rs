//! Views of the block: the core behind ports of `double`, as block diagrams have them.

use askama::Template;

use crate::c::Common;

/// An input port.
#[derive(Debug, Clone)]
pub struct InputView {
    /// Member of the measurement.
    pub name: String,
    /// Unit and plausible range, for comments.
    pub meaning: String,
    /// The port carries an ADC code.
    pub is_code: bool,
}

/// A coefficient of the mapping as parameter of the block.
#[derive(Debug, Clone)]
pub struct ParameterView {
    /// Name.
    pub name: String,
    /// Value after `init`: a decimal that gives the value also through binary64.
    pub value: String,
    /// Lowest accepted value.
    pub low: String,
    /// Highest accepted value.
    pub high: String,
}

/// A mapping that the block sets.
#[derive(Debug, Clone)]
pub struct AdjustView {
    /// Function of the core, without the prefix.
    pub function: String,
    /// Its arguments behind the state: names of parameters of the block.
    pub arguments: String,
}

/// A duty of the command.
#[derive(Debug, Clone)]
pub struct DutyPort {
    /// Subscript in the command; empty where there is one duty.
    pub place: String,
    /// `_left` of the output `left`; empty where there is one duty.
    pub suffix: String,
    /// The same for a macro.
    pub upper: String,
    /// Duty while the block is disabled.
    pub fallback: String,
}

/// An output port.
#[derive(Debug, Clone)]
pub struct OutputView {
    /// Name: also the member of the block's answer.
    pub name: String,
    /// Declarator of that member, as long as the longest.
    pub declarator: String,
    /// Meaning, for a comment.
    pub meaning: String,
}

/// What all files of the block and of the integrations made of it need.
#[derive(Debug, Clone)]
pub struct BlockView {
    /// Names of the controller and banner of the file.
    pub common: Common,
    /// Signals in order; the port `enable` follows them.
    pub inputs: Vec<InputView>,
    /// Some signal arrives as an ADC code.
    pub has_codes: bool,
    /// Number of input ports.
    pub input_count: usize,
    /// Coefficients of the mappings in order; empty without.
    pub parameters: Vec<ParameterView>,
    /// How they are set.
    pub mappings: Vec<AdjustView>,
    /// The duties, at least one.
    pub duties: Vec<DutyPort>,
    /// Output ports in order: duties, actions, status.
    pub outputs: Vec<OutputView>,
    /// Control period in s.
    pub sample_period: String,
    /// Memory of the block in doubles.
    pub work: usize,
    /// Features.
    pub features: usize,
    /// Actions.
    pub actions: usize,
}

/// `<name>_block.h`
#[derive(Debug, Template)]
#[template(path = "block/block.h.jinja", escape = "none")]
pub struct BlockHeader {
    /// The block.
    pub b: BlockView,
}

/// `<name>_block.c`
#[derive(Debug, Template)]
#[template(path = "block/block.c.jinja", escape = "none")]
pub struct BlockSource {
    /// The block.
    pub b: BlockView,
}
