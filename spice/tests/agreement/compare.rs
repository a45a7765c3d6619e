//! Runs a case in both simulators and compares what the controller would see.

use std::path::Path;
use std::process::{Command, Stdio};

use plant::{Parameters, Plant, Sample, Signals};

use crate::cases::Case;
use crate::netlist::netlist;

const INSTALL: &str = "ngspice is needed; type\n    sudo apt-get update && sudo apt-get install -y --no-install-recommends ngspice\n\
    or `cargo xtask test`, which does so";

/// A sampling instant as both see it, and the extremes of the voltage since the one before.
pub struct Row {
    pub plant: Sample,
    pub spice: Signals,
    pub spice_extremes: (f64, f64),
}

/// Largest deviations: sampled voltages, sampled currents, extremes of the voltage.
///
/// With an ESL the extremes of the period of the load step do not count: the needle of a few nanoseconds is the load's
/// rise time, which no plant has.
pub fn deviations(case: &Case, rows: &[Row]) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    for (n, row) in rows.iter().enumerate() {
        let (a, b) = (row.plant.measured, row.spice);
        let v = (a.v_out - b.v_out).abs().max((a.v_in - b.v_in).abs());
        let i = (a.i_l - b.i_l).abs().max((a.i_out - b.i_out).abs());
        let (low, high) = row.spice_extremes;
        let needle = case.parameters.capacitor.esl > 0.0 && n as f64 == case.step_at.floor();
        let e = if needle {
            0.0
        } else {
            (row.plant.v_min - low).abs().max((row.plant.v_max - high).abs())
        };
        for (worst, found) in worst.iter_mut().zip([v, i, e]) {
            *worst = worst.max(found);
        }
    }
    worst
}

/// Runs both.
pub fn run(case: &Case, folder: &Path) -> Result<Vec<Row>, String> {
    let wave = spice(case, folder)?;
    let plant = samples(case, &case.parameters).map_err(|faults| faults.to_string())?;
    let t_sw = case.parameters.t_sw();
    let rows = plant.into_iter().enumerate().map(|(n, plant)| {
        let t = (n + 1) as f64 * t_sw;
        Row {
            plant,
            spice: wave.shown(t, &case.parameters),
            spice_extremes: wave.extremes(t - t_sw, t),
        }
    });
    Ok(rows.collect())
}

/// The plant's own samples, of this case's commands with `parameters`.
pub fn samples(case: &Case, parameters: &Parameters) -> Result<Vec<Sample>, plant::Faults> {
    let mut plant = Plant::new(parameters)?;
    let (before, after) = &case.loads;
    plant.reset_at(case.v_out, case.i_l, before);
    let step = |(n, &duty): (usize, &f64)| plant.step_with_change(duty, before, after, case.step_at - n as f64);
    Ok(case.duties.iter().enumerate().map(step).collect())
}

/// What ngspice wrote: time, v_out, i_l, i_out, v_in, filtered v_out.
struct Wave(Vec<[f64; 6]>);

fn spice(case: &Case, folder: &Path) -> Result<Wave, String> {
    let stem = case.name.replace(|c: char| !c.is_ascii_alphanumeric(), "-");
    let (circuit, data) = (format!("{stem}.cir"), format!("{stem}.data"));
    std::fs::write(folder.join(&circuit), netlist(case, &data)).map_err(|e| e.to_string())?;
    let mut command = Command::new("ngspice");
    command.args(["-b", &circuit]).current_dir(folder).stdin(Stdio::null());
    let output = command.output().map_err(|e| format!("{e}: {INSTALL}"))?;
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    let text = std::fs::read_to_string(folder.join(&data)).map_err(|e| format!("{}: {e}\n{said}", case.name))?;
    let mut rows = Vec::new();
    for line in text.lines() {
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        rows.push(<[f64; 6]>::try_from(numbers).map_err(|_| format!("{data}: not six numbers: {line}"))?);
    }
    let end = case.duties.len() as f64 * case.parameters.t_sw();
    match rows.last() {
        Some(last) if last[0] > 0.999_999 * end => Ok(Wave(rows)),
        _ => Err(format!("{}: ngspice ended early\n{said}", case.name)),
    }
}

impl Wave {
    fn at(&self, t: f64) -> [f64; 6] {
        let rows = &self.0;
        let next = rows.partition_point(|row| row[0] < t - 1e-12).clamp(1, rows.len() - 1);
        let (a, b) = (rows[next - 1], rows[next]);
        let part = ((t - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
        std::array::from_fn(|n| a[n] + part * (b[n] - a[n]))
    }

    fn shown(&self, t: f64, p: &Parameters) -> Signals {
        let sensors = [&p.sensors.v_out, &p.sensors.i_l, &p.sensors.i_out, &p.sensors.v_in];
        let mut shown = [0.0; 4];
        for (n, sensor) in sensors.into_iter().enumerate() {
            let row = self.at((t - sensor.delay).max(0.0));
            let value = if n == 0 && sensor.low_pass > 0.0 {
                row[5]
            } else {
                row[n + 1]
            };
            shown[n] = sensor.gain * value + sensor.offset;
        }
        let [v_out, i_l, i_out, v_in] = shown;
        Signals {
            v_out,
            i_l,
            i_out,
            v_in,
        }
    }

    fn extremes(&self, from: f64, to: f64) -> (f64, f64) {
        let inside = self.0.iter().filter(|row| row[0] > from && row[0] < to);
        let (first, last) = (self.at(from)[1], self.at(to)[1]);
        inside.fold((first.min(last), first.max(last)), |(low, high), row| {
            (low.min(row[1]), high.max(row[1]))
        })
    }
}
