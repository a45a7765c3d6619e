//! Options that commands share.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use measured::ColumnMap;
use toml_input::Faults;

/// Which files a contract may name.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Outside {
    /// Read files, too, that the contract names outside its own folder
    #[arg(long, display_order = 901)]
    pub allow_outside: bool,
}

/// Whether foreign code may run.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Foreign {
    /// Run the FMU that a plant file names: foreign native code, in this process and with your rights
    #[arg(long, display_order = 900)]
    pub run_fmu: bool,
}

/// How much is said beside the answer.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Loudness {
    /// Only answers and errors: no progress, no notes
    #[arg(short, long, global = true, display_order = 902, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Also tell, on standard error, more of the progress, each file that is written, and the time it took
    #[arg(short, long, global = true, display_order = 903)]
    pub verbose: bool,
    /// Colours: auto (on a terminal, unless NO_COLOR is set), always, never
    #[arg(
        long,
        global = true,
        display_order = 904,
        value_name = "WHEN",
        default_value = "auto",
        hide_default_value = true,
        hide_possible_values = true
    )]
    pub color: Color,
}

/// When colours are used.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal, unless NO_COLOR is set
    #[default]
    Auto,
    /// Into files and pipes, too
    Always,
    /// Nowhere
    Never,
}

/// What runs the policy in a closed loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ControllerKind {
    /// The reference interpreter
    Interpreter,
    /// The generated Rust, built with rustc
    Rust,
    /// The generated C, built with gcc or clang
    C,
}

/// Where the quantities of a table stand that names them otherwise.
#[derive(Debug, Args)]
pub struct Columns {
    /// Where the quantities stand: quantity=column, quantity=column*factor or quantity=number, separated by commas or
    /// given several times; quantities are t, duty, v_out, i_l, i_out, v_in, r_load, i_load, p_load, v_std, settled
    #[arg(long, value_name = "MAP")]
    pub map: Vec<String>,
    /// The same as a file: names, factors, offsets and constants
    #[arg(long, value_name = "MAP.toml")]
    pub columns: Option<PathBuf>,
}

impl Columns {
    /// The file with what the command line adds.
    pub fn read(&self) -> Result<ColumnMap, Faults> {
        let file = self
            .columns
            .as_deref()
            .map_or_else(|| Ok(ColumnMap::default()), ColumnMap::open)?;
        file.and(ColumnMap::parse(&self.map.join(","))?)
    }
}
