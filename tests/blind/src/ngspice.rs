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

/// The relative tolerance of the netlists, and what else is tried where a run is lost: steps that fall otherwise, or a
/// picofarad and then ten at every node.
const TOLERANCES: [&str; 4] = [
    "reltol=1e-4",
    "reltol=7e-5",
    "reltol=1e-4 cshunt=1e-12",
    "reltol=1e-4 cshunt=1e-11",
];

/// Runs it in a folder of its own; again with other options if ngspice loses the circuit.
///
/// # Errors
/// If ngspice is missing, fails, or ends before `rows` points of the fine grid.
pub fn run(netlist: &str, rows: usize) -> Result<Signals, String> {
    let mut ran = once(netlist, rows);
    for tolerance in &TOLERANCES[1..] {
        if ran.is_ok() {
            break;
        }
        ran = once(&netlist.replace(TOLERANCES[0], tolerance), rows);
    }
    ran
}

fn once(netlist: &str, rows: usize) -> Result<Signals, String> {
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
    // where a run ends early, `linearize` fills up with zeros
    let lost = signals.v_in.iter().position(|v_in| *v_in <= 0.0);
    let points = lost.unwrap_or(signals.v_o.len());
    match points > rows {
        true => Ok(signals),
        false => Err(format!("ngspice ended at point {points} of {rows}:\n{}", said())),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A source that drops to zero is what a lost run looks like.
    #[test]
    fn zeros_in_the_place_of_a_run_are_an_error() {
        let circuit = |end: &str| {
            let signals = "v(out) i(vil) i(vout) v(nin) v(hold)";
            format!(
                "* none\nVin nin 0 PWL(0 10 1m 10 {end})\nVil nin a 0\nR1 a out 1\nVout out b 0\nR2 b 0 1\nVh hold 0 0\n\
                 .options reltol=1e-4\n.save {signals}\n.tran 0.1m 2m 0 0.1m uic\n.control\nrun\nlinearize {signals}\n\
                 set wr_singlescale\nset numdgt=12\nwrdata out.txt {signals}\nquit\n.endc\n.end\n"
            )
        };
        assert_eq!(run(&circuit("2m 10"), 19).map(|signals| signals.v_in[15]), Ok(10.0));
        let error = run(&circuit("1.001m 0"), 19).unwrap_err();
        assert!(error.contains("of 19"), "{error}");
    }
}
