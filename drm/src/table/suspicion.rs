//! Values that no buck converter has, and those that look like another unit.

use measured::{Signal, table_faults};
use toml_input::{Fault, Faults, Message};

use super::point::{Point, Table};
use super::reading::Reading;

/// Measured voltage over `d v_in` beyond which the units differ.
// a slip of a prefix is a factor of 1000; at light load v_out may be several times d v_in
const OTHER_UNIT: f64 = 20.0;
/// A buck converter cannot lift the voltage; this much is left to sensors.
// two sensors, 2.5 % each
const SENSOR: f64 = 1.05;
/// A load current beyond this is more likely in milliamperes, A.
// one ampere in milliamperes; few benches have a thousand, and those say the unit
const CURRENT: f64 = 1000.0;
/// An input voltage beyond this is more likely in millivolts, V.
// three volts in millivolts, the least that converters are fed with
const VOLTAGE: f64 = 3000.0;
/// A power beyond this is more likely one of milliamperes, W.
// 20 W with the current in milliamperes; the parts that the plant knows end at 10 kW
const POWER: f64 = 20e3;

/// Faults of range and unit, and notes on what only looks odd.
pub(super) fn check(table: &mut Table, reading: &Reading<'_>) -> Result<(), Faults> {
    let points = &table.points;
    if points.is_empty() {
        let message = Message::new("no point is measured yet").expected("numbers in duty, v_out, i_out and v_in");
        return Err(reading.sheet.fault(message.hint("fill in the rows of the plan")).into());
    }
    let mut faults = table_faults();
    faults.extend((0..points.len()).filter_map(|n| not_positive("v_in", points[n].v_in, n, reading)));
    faults.extend(duties(points, reading));
    // what follows divides by duty and input voltage
    faults.propagate()?;
    let mut faults = table_faults();
    faults.extend(voltages(points, reading));
    faults.extend(both_in_millivolts(points, reading));
    faults.propagate()?;
    let most = points.iter().map(|p| p.i_out.abs()).fold(0.0, f64::max);
    let power = points.iter().map(|p| (p.i_out * p.v_out).abs()).fold(0.0, f64::max);
    if (most > CURRENT || power > POWER) && !reading.i_out.is_stated() {
        let convert = converted(reading.i_out, reading, 0.001);
        let insist = converted(reading.i_out, reading, 1.0);
        let message = Message::new("`i_out` looks like milliamperes")
            .found(format!("up to {most} and {power:.0} W"))
            .expected("amperes")
            .hint(format!(
                "--map {convert} converts; if these are amperes, say so with --map {insist}"
            ));
        return Err(reading.sheet.fault(message).into());
    }
    let negative: Vec<usize> = points.iter().filter(|p| p.i_out < 0.0).map(|p| p.line).collect();
    if !negative.is_empty() {
        let lines = super::point::lines(&negative);
        table.notes.push(format!("the load delivers current in {lines}"));
    }
    Ok(())
}

/// The entry of a map that multiplies a column by `factor`.
fn converted(signal: &Signal, reading: &Reading<'_>, factor: f64) -> String {
    let column = signal.column().and_then(|index| reading.sheet.columns().get(index));
    let column = column.map_or(&signal.label, |column| &column.name);
    format!("{}={column}*{}", signal.label, factor * signal.scale())
}

/// Ratios of voltages do not show a unit that both share.
fn both_in_millivolts(points: &[Point], reading: &Reading<'_>) -> Option<Fault> {
    let most = points.iter().map(|p| p.v_in).fold(0.0, f64::max);
    (most > VOLTAGE && !reading.v_in.is_stated()).then(|| {
        let (v_in, v_out) = (reading.v_in, reading.v_out);
        let convert = [v_in, v_out].map(|signal| converted(signal, reading, 0.001));
        let insist = converted(v_in, reading, 1.0);
        let message = Message::new("`v_in` and `v_out` look like millivolts")
            .found(format!("v_in up to {most}"))
            .expected("volts");
        let convert = convert.join(",");
        let hint = format!("--map {convert} converts; if these are volts, say so with --map {insist}");
        reading.sheet.fault(message.hint(hint))
    })
}

fn not_positive(name: &str, value: f64, point: usize, reading: &Reading<'_>) -> Option<Fault> {
    (value <= 0.0).then(|| {
        let message = Message::new(format!("`{name}` is not positive")).found(value.to_string());
        reading.fault(point, message.expected("greater than 0"))
    })
}

fn duties(points: &[Point], reading: &Reading<'_>) -> Vec<Fault> {
    let most = points.iter().map(|p| p.d_real).fold(0.0, f64::max);
    let outside = |n: &usize| !(0.0..=1.0).contains(&points[*n].d_real);
    let above: Vec<usize> = (0..points.len()).filter(outside).collect();
    let Some(first) = above.first() else { return Vec::new() };
    let label = &reading.duty.label;
    // a few duties above 1 are slips; a column in percent has them in most rows
    let percent = most <= 100.0 && points.iter().all(|p| p.d_real >= 0.0) && above.len() * 2 > points.len();
    if percent {
        let lines: Vec<usize> = above.iter().map(|n| points[*n].line).collect();
        let message = Message::new(format!("`{label}` looks like percent"))
            .found(format!("{} in {}", points[*first].d_real, super::point::lines(&lines)))
            .expected("a fraction of 1")
            .hint(format!(
                "--map {} converts; or call the column `{label} (%)`",
                converted(reading.duty, reading, 0.01)
            ));
        return vec![reading.fault(*first, message)];
    }
    let fault = |n: usize| {
        let message = Message::new(format!("`{label}` is no duty ratio")).found(points[n].d_real.to_string());
        reading.fault(n, message.expected("0 to 1"))
    };
    above.into_iter().map(fault).collect()
}

fn voltages(points: &[Point], reading: &Reading<'_>) -> Vec<Fault> {
    let mut ratios: Vec<f64> = points
        .iter()
        .filter(|p| p.d_real > 0.0)
        .map(|p| (p.v_out / (p.d_real * p.v_in)).abs())
        .collect();
    ratios.sort_by(f64::total_cmp);
    // the median: one bad row must not make the whole column look like another unit
    let Some(middle) = ratios.get(ratios.len() / 2).copied() else {
        let message = Message::new("every duty ratio is 0").expected("points at different duty ratios");
        return vec![reading.sheet.fault(message)];
    };
    let unit = |name: &str, signal: &Signal, other: &str| {
        let message = Message::new(format!("`{name}` looks like millivolts"))
            .found(format!("v_out / (duty v_in) is about {middle:.3e}"))
            .expected(format!("volts, as `{other}`; a buck converter has about 1"))
            .hint(format!("--map {} converts", converted(signal, reading, 0.001)));
        vec![reading.sheet.fault(message)]
    };
    if middle > OTHER_UNIT {
        return unit("v_out", reading.v_out, "v_in");
    }
    if middle < 1.0 / OTHER_UNIT {
        return unit("v_in", reading.v_in, "v_out");
    }
    let mut faults = Vec::new();
    for (n, point) in points.iter().enumerate() {
        faults.extend(not_positive("v_out", point.v_out, n, reading));
        if point.v_out > SENSOR * point.v_in {
            let message = Message::new("`v_out` lies above `v_in`")
                .found(format!("{} V with v_in {} V", point.v_out, point.v_in))
                .expected("what a buck converter can yield")
                .hint("check units and columns");
            faults.push(reading.fault(n, message));
        }
    }
    faults
}

/// A regression needs points that differ.
pub(super) fn variety(points: &[Point], reading: &Reading<'_>) -> Result<(), Faults> {
    let Some(first) = points.first() else { return Ok(()) };
    let same = |p: &Point| (p.d_real, p.v_out, p.i_out, p.v_in) == (first.d_real, first.v_out, first.i_out, first.v_in);
    let message = if points.len() == 1 {
        Message::new("one point cannot say how the duty depends on anything")
            .found("1 row")
            .expected("at least 4 points")
            .hint("measure at several duties and loads: `policyc drm acquire` writes a plan")
    } else if points.iter().all(same) {
        Message::new("all rows are equal")
            .found(format!("{} rows", points.len()))
            .expected("points at different duties and loads")
    } else if points.iter().all(|p| p.d_real == first.d_real) {
        Message::new(format!("`{}` is the same in all rows", reading.duty.label))
            .found(first.d_real.to_string())
            .expected("several duty ratios")
            .hint("the mapping says how the duty must change: vary it")
    } else {
        return Ok(());
    };
    Err(reading.fault(0, message).into())
}
