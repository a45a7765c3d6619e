//! A board of devices in ngspice, and an oscilloscope at it.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Faults, Parameters};

/// What to type where ngspice is missing.
const INSTALL: &str = "sudo apt-get install -y --no-install-recommends ngspice";
/// Switching period of the board, s: it and a sampling of 100 ns do not divide each other, as on a bench.
pub const PERIOD: f64 = 10.03e-6;
/// Periods that are kept, behind those in which the board comes to rest.
const KEPT: f64 = 11.0;
const AT_REST: f64 = 260.0;

/// The board as its netlist has it; the devices by the slopes of their models at 1 A.
pub fn truth() -> Parameters {
    let mut p = Parameters::paper_table();
    (p.converter.v_in, p.converter.f_sw) = (24.0, 1.0 / PERIOD);
    (p.converter.inductance, p.converter.capacitance) = (100e-6, 47e-6);
    (p.inductor.dcr, p.capacitor.esr) = (0.15, 0.05);
    // Rd + Rs of the transistor, and N kT ln(i / IS) with RS of the diode
    (p.switch.r_ds_on, p.switch.v_f, p.switch.r_d) = (0.09, 0.45, 0.08);
    (p.switch.turn_on_delay, p.switch.turn_off_delay, p.switch.dead_time) = (0.0, 0.0, 0.0);
    p
}

/// What the board does, every 5 ns.
#[derive(Debug, Clone, Default)]
pub struct Signals {
    pub time: Vec<f64>,
    pub pin: Vec<f64>,
    pub v_sw: Vec<f64>,
    pub v_out: Vec<f64>,
    pub i_l: Vec<f64>,
    pub i_in: Vec<f64>,
}

/// Runs the board at a duty and a load in ohm; steps are at most `longest`.
// ngspice reads its netlist from a file
#[allow(clippy::disallowed_methods)]
pub fn run(name: &str, duty: f64, load: f64, v0: f64, longest: &str) -> Signals {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let start = AT_REST * PERIOD;
    let mut netlist = include_str!("buck.cir").to_owned();
    for (word, value) in [
        ("{v0}", v0),
        ("{i0}", v0 / load),
        ("{load}", load),
        ("{stop}", start + KEPT * PERIOD),
        ("{start}", start),
    ] {
        netlist = netlist.replace(word, &format!("{value:e}"));
    }
    netlist = netlist
        .replace("{longest}", longest)
        .replace("{duty*period}", &format!("{:e}", duty * PERIOD));
    std::fs::write(folder.join("buck.cir"), netlist).unwrap();
    let ran = Command::new("ngspice")
        .args(["-b", "buck.cir"])
        .current_dir(&folder)
        .stdin(Stdio::null())
        .output();
    let said = ran.unwrap_or_else(|error| panic!("cannot run ngspice ({error}); type\n    {INSTALL}"));
    let text = std::fs::read_to_string(folder.join("out.txt"));
    let text = text.unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&said.stderr)));
    let mut signals = Signals::default();
    for line in text.lines() {
        let cells: Vec<f64> = line
            .split_ascii_whitespace()
            .map(|cell| cell.parse().unwrap())
            .collect();
        signals.time.push(cells[0] - start);
        signals.pin.push(cells[1]);
        signals.v_sw.push(cells[3]);
        signals.v_out.push(cells[5]);
        signals.i_l.push(cells[7]);
        signals.i_in.push(-cells[9].abs().copysign(-1.0));
    }
    assert!(signals.time.len() > 2000, "{}", String::from_utf8_lossy(&said.stdout));
    signals
}

/// The board at half duty and 10 ohm, run once for all tests.
pub fn half() -> &'static Signals {
    static RUN: OnceLock<Signals> = OnceLock::new();
    RUN.get_or_init(|| run("half", 0.5, 10.0, 11.57, "10n"))
}

impl Signals {
    fn at(&self, values: &[f64], t: f64) -> f64 {
        let next = self.time.partition_point(|x| *x <= t).clamp(1, self.time.len() - 1);
        let share = (t - self.time[next - 1]) / (self.time[next] - self.time[next - 1]);
        values[next - 1] + share * (values[next] - values[next - 1])
    }

    pub fn mean(&self, values: &[f64]) -> f64 {
        let inside = self.time.iter().zip(values).filter(|(t, _)| **t < 10.0 * PERIOD);
        let (sum, count) = inside.fold((0.0, 0.0), |(sum, count), (_, v)| (sum + v, count + 1.0));
        sum / count
    }

    /// First instant at which a signal passes a level.
    fn passes(&self, values: &[f64], level: f64, up: bool, after: f64) -> f64 {
        let is_pass = |n: &usize| self.time[*n] > after && (values[*n] > level) == up && (values[*n - 1] > level) != up;
        let n = (1..values.len()).find(is_pass).unwrap();
        let share = (level - values[n - 1]) / (values[n] - values[n - 1]);
        self.time[n - 1] + share * (self.time[n] - self.time[n - 1])
    }

    /// From the command to the switch node, on and off, s, by the fine grid.
    pub fn delays(&self) -> [f64; 2] {
        [true, false].map(|up| {
            let command = self.passes(&self.pin, 2.5, up, 0.1 * PERIOD);
            self.passes(&self.v_sw, 12.0, up, command) - command
        })
    }
}

/// An oscilloscope.
pub struct Scope {
    /// Time between samples, s.
    pub step: f64,
    pub periods: f64,
    /// Columns, each with the range of its channel; the second number is taken off before (an offset, or coupling by a capacitor).
    pub channels: &'static [(&'static str, f64, f64)],
    /// Steps of eight bits, and noise of one step.
    pub is_coarse: bool,
}

pub const CLEAN: Scope = Scope {
    step: 1e-7,
    periods: 8.0,
    channels: &[
        ("v_out", 16.0, 0.0),
        ("i_l", 2.5, 0.0),
        ("v_sw", 40.0, 0.0),
        ("v_pwm", 8.0, 0.0),
    ],
    is_coarse: false,
};

/// As on a bench: the ripple of the output fills the screen, which its mean then has left.
pub const COARSE: Scope = Scope {
    channels: &[
        ("v_out", 0.05, 11.57),
        ("i_l", 2.0, 0.0),
        ("v_sw", 40.0, 0.0),
        ("v_pwm", 8.0, 0.0),
    ],
    is_coarse: true,
    ..CLEAN
};

impl Scope {
    /// A table.
    pub fn table(&self, board: &Signals) -> String {
        let names: Vec<&str> = self.channels.iter().map(|(name, ..)| *name).collect();
        let mut text = format!("t,{}\n", names.join(","));
        let mut state = 1u64;
        let mut normal = || {
            // twelve uniform numbers of a linear congruential generator make a normal one
            let uniform = |_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            (0..12).map(uniform).sum::<f64>()
        };
        // the trigger is anywhere
        let first = 0.37 * PERIOD;
        for n in 0..(self.periods * PERIOD / self.step) as usize {
            let t = n as f64 * self.step;
            let _ = write!(text, "{t:.10}");
            for (name, range, offset) in self.channels {
                let values = match *name {
                    "v_out" => &board.v_out,
                    "i_l" => &board.i_l,
                    "v_sw" => &board.v_sw,
                    "i_in" => &board.i_in,
                    _ => &board.pin,
                };
                let value = board.at(values, first + t) - offset;
                let lsb = range / 256.0;
                let value = if self.is_coarse {
                    ((value / lsb + normal()).round()) * lsb
                } else {
                    value
                };
                let _ = write!(text, ",{value:.6}");
            }
            text.push('\n');
        }
        text
    }
}

/// Reads a table with a map as on the command line.
pub fn read(text: &str, map: &str, model: &Parameters) -> Result<Record, Faults> {
    let sheet = Sheet::parse(Path::new("scope.csv"), text.into(), &Record::file_options())?;
    Record::read(&sheet, &ColumnMap::parse(map).unwrap(), model)
}
