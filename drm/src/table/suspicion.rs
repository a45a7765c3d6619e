//! Values that no buck converter has, and those that look like another unit.

use toml_input::{Fault, Message};

use crate::table::cells::Sheet;
use crate::table::columns::Located;
use crate::table::{Point, Table};

/// Measured voltage over `d v_in` beyond which the units differ.
const OTHER_UNIT: f64 = 20.0;
/// A buck converter cannot lift the voltage; this much is left to sensors.
const SENSOR: f64 = 1.05;
/// A load current beyond this is more likely in milliamperes, A.
const CURRENT: f64 = 1000.0;
/// An input voltage beyond this is more likely in millivolts, V.
const VOLTAGE: f64 = 3000.0;
/// A power beyond this is more likely one of milliamperes, W.
const POWER: f64 = 20e3;

/// Faults of range and unit, and notes on what only looks odd.
pub(crate) fn check(table: &mut Table, located: &Located, sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    let points = &table.points;
    if points.is_empty() {
        let message = Message::new("no point is measured yet").expected("numbers in d_real, v_out, i_out and v_in");
        faults.push(sheet.fault(message.hint("fill in the rows of the plan")));
        return;
    }
    for point in points {
        not_positive("v_in", point.v_in, point, sheet, faults);
    }
    duties(points, sheet, faults);
    if !faults.is_empty() {
        return;
    }
    voltages(points, sheet, faults);
    both_in_millivolts(points, located, sheet, faults);
    if !faults.is_empty() {
        return;
    }
    let most = points.iter().map(|p| p.i_out.abs()).fold(0.0, f64::max);
    let power = points.iter().map(|p| (p.i_out * p.v_out).abs()).fold(0.0, f64::max);
    if (most > CURRENT || power > POWER) && !located.i_out.is_stated() {
        let message = Message::new("`i_out` looks like milliamperes")
            .found(format!("up to {most} and {power:.0} W"))
            .expected("amperes")
            .hint("--map i_out=i_out*0.001 converts; if these are amperes, say so with --map i_out=i_out*1");
        faults.push(sheet.fault(message));
    }
    let negative: Vec<usize> = points.iter().filter(|p| p.i_out < 0.0).map(|p| p.line).collect();
    if !negative.is_empty() {
        let lines = super::lines(&negative);
        table.notes.push(format!("the load delivers current in {lines}"));
    }
}

/// Ratios of voltages do not show a unit that both share.
fn both_in_millivolts(points: &[Point], located: &Located, sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    let most = points.iter().map(|p| p.v_in).fold(0.0, f64::max);
    if most > VOLTAGE && !located.v_in.is_stated() {
        let message = Message::new("`v_in` and `v_out` look like millivolts")
            .found(format!("v_in up to {most}"))
            .expected("volts")
            .hint(
                "--map v_in=v_in*0.001,v_out=v_out*0.001 converts; if these are volts, say so with --map v_in=v_in*1",
            );
        faults.push(sheet.fault(message));
    }
}

fn not_positive(name: &str, value: f64, point: &Point, sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    if value <= 0.0 {
        let message = Message::new(format!("`{name}` is not positive")).found(value.to_string());
        faults.push(sheet.line_fault(point.line, message.expected("greater than 0")));
    }
}

fn duties(points: &[Point], sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    let most = points.iter().map(|p| p.d_real).fold(0.0, f64::max);
    let above: Vec<&Point> = points.iter().filter(|p| !(0.0..=1.0).contains(&p.d_real)).collect();
    let Some(first) = above.first() else { return };
    let percent = most <= 100.0 && points.iter().all(|p| p.d_real >= 0.0) && above.len() * 2 > points.len();
    if percent {
        let lines: Vec<usize> = above.iter().map(|p| p.line).collect();
        let found = format!("{} in {}", first.d_real, super::lines(&lines));
        let message = Message::new("`d_real` looks like percent")
            .found(found)
            .expected("a fraction of 1");
        faults.push(sheet.line_fault(first.line, message.hint("--map d_real=d_real*0.01 converts")));
        return;
    }
    for point in above {
        let message = Message::new("`d_real` is no duty ratio").found(point.d_real.to_string());
        faults.push(sheet.line_fault(point.line, message.expected("0 to 1")));
    }
}

fn voltages(points: &[Point], sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    let mut ratios: Vec<f64> = points
        .iter()
        .filter(|p| p.d_real > 0.0)
        .map(|p| (p.v_out / (p.d_real * p.v_in)).abs())
        .collect();
    ratios.sort_by(f64::total_cmp);
    let Some(middle) = ratios.get(ratios.len() / 2).copied() else {
        let message = Message::new("every duty ratio is 0").expected("points at different duty ratios");
        faults.push(sheet.fault(message));
        return;
    };
    let unit = |name: &str, other: &str| {
        Message::new(format!("`{name}` looks like millivolts"))
            .found(format!("v_out / (d_real v_in) is about {middle:.3e}"))
            .expected(format!("volts, as `{other}`; a buck converter has about 1"))
            .hint(format!("--map {name}={name}*0.001 converts"))
    };
    if middle > OTHER_UNIT {
        faults.push(sheet.fault(unit("v_out", "v_in")));
        return;
    }
    if middle < 1.0 / OTHER_UNIT {
        faults.push(sheet.fault(unit("v_in", "v_out")));
        return;
    }
    for point in points {
        not_positive("v_out", point.v_out, point, sheet, faults);
        if point.v_out > SENSOR * point.v_in {
            let found = format!("{} V with v_in {} V", point.v_out, point.v_in);
            let message = Message::new("`v_out` lies above `v_in`").found(found);
            let message = message
                .expected("what a buck converter can yield")
                .hint("check units and columns");
            faults.push(sheet.line_fault(point.line, message));
        }
    }
}

/// A regression needs points that differ.
pub(crate) fn variety(points: &[Point], sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    let Some(first) = points.first() else { return };
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
        Message::new("`d_real` is the same in all rows")
            .found(first.d_real.to_string())
            .expected("several duty ratios")
            .hint("the mapping says how the duty must change: vary it")
    } else {
        return;
    };
    faults.push(sheet.line_fault(first.line, message));
}
