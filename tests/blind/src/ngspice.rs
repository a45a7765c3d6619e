//! Runs a netlist and reads what it wrote.

use std::process::{Command, Stdio};

/// What to type where ngspice is missing.
pub const INSTALL: &str = "sudo apt-get install -y --no-install-recommends ngspice";

/// True signals on the fine grid of [`crate::netlist::T_FINE`], from the start of the lead on.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Signals {
    /// Output voltage, V.
    pub v_o: Vec<f64>,
    /// Inductor current, A.
    pub i_l: Vec<f64>,
    /// Load current, A.
    pub i_o: Vec<f64>,
    /// Input voltage, V.
    pub v_in: Vec<f64>,
    /// Duty that a controller holds; 0 without one.
    pub duty: Vec<f64>,
}

/// Runs it in a folder of its own.
///
/// # Errors
/// If ngspice is missing, fails, or ends before `rows` points of the fine grid.
pub fn run(netlist: &str, rows: usize) -> Result<Signals, String> {
    let folder = tempfile::tempdir().map_err(|error| format!("cannot make a folder: {error}"))?;
    let file = folder.path().join("circuit.cir");
    std::fs::write(&file, netlist).map_err(|error| format!("cannot write a netlist: {error}"))?;
    let mut command = Command::new("ngspice");
    command
        .args(["-b", "circuit.cir"])
        .current_dir(folder.path())
        .stdin(Stdio::null());
    let output = command
        .output()
        .map_err(|error| format!("cannot run ngspice ({error}); type\n    {INSTALL}"))?;
    let said = || {
        let all = [&output.stdout[..], &output.stderr[..]].concat();
        String::from_utf8_lossy(&all).into_owned()
    };
    let text = std::fs::read_to_string(folder.path().join("out.txt"))
        .map_err(|_| format!("ngspice wrote no signals:\n{}", said()))?;
    let signals = read(&text)?;
    match signals.v_o.len() > rows {
        true => Ok(signals),
        false => Err(format!(
            "ngspice ended at point {} of {rows}:\n{}",
            signals.v_o.len(),
            said()
        )),
    }
}

fn read(text: &str) -> Result<Signals, String> {
    let mut signals = Signals::default();
    for line in text.lines() {
        let mut numbers = line.split_ascii_whitespace().map(str::parse::<f64>);
        let mut next = || match numbers.next() {
            Some(Ok(number)) if number.is_finite() => Ok(number),
            _ => Err(format!("ngspice wrote a line without six numbers: {line}")),
        };
        next()?;
        signals.v_o.push(next()?);
        signals.i_l.push(next()?);
        signals.i_o.push(next()?);
        signals.v_in.push(next()?);
        signals.duty.push(next()?);
    }
    Ok(signals)
}
