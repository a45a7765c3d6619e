//! What is settled of records before they are a problem: their source, magnitudes, and pieces of unstable ones.

use plant::Topology;

use crate::causes::Bases;
use crate::drive::Model;
use crate::ideal::Ideal;
use crate::median::median;
use crate::record::Record;

/// Growth of a state over a segment of an unstable record, in time constants: an error of the initial state grows e^2, sevenfold,
/// and the least-squares problem stays close to linear. At 4 it grows 55-fold. A convention.
const MOST_GROWTH: f64 = 2.0;
/// Output over its usual voltage below which electronic loads may leave their setting: at full current they need some tenths of a volt to a volt,
/// and outputs have a few volts. A convention.
const COLLAPSED: f64 = 0.2;
/// Shortest segment of an unstable or a collapsed record, rows: each costs two unknowns, of 30 rows of two signals.
const SHORTEST: usize = 30;

/// Records at clearly different source voltages were set so; a common deviation is the model's.
pub(super) fn share_source_voltage(records: &mut [Record], v_in: f64) {
    let medians: Vec<f64> = records
        .iter()
        .map(|r| median(r.measured[3].iter().copied()) / v_in)
        .collect();
    let finite = || medians.iter().copied().filter(|m| m.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
    // 3 %, here and below: gains of two sensors differ by as much (`typical` of the plant)
    let apart = high > 1.03 * low;
    for (record, ratio) in records.iter_mut().zip(&medians) {
        if apart && ratio.is_finite() && record.v_in_ratio == 1.0 && !(0.97..1.03).contains(ratio) {
            record.v_in_ratio = *ratio;
            let text = format!("source voltage taken as set to {:.1} V in this record", ratio * v_in);
            record.repairs.push(text);
        }
    }
}

pub(super) fn bases(records: &[Record], base: &Model) -> Bases {
    let v_in = base.plant.converter.v_in;
    let ideal = Ideal::at(&base.plant, 1.0);
    let voltage = |r: &Record| {
        (0..r.rows())
            .map(|n| {
                if r.measured[0][n].is_finite() {
                    r.measured[0][n]
                } else {
                    ideal.volts(r.duty[n])
                }
            })
            .collect::<Vec<_>>()
    };
    // a base of 0 would make every bound in volts 0
    let v = median(records.iter().flat_map(voltage)).max(0.01 * v_in);
    let current = |r: &Record| {
        let drawn = |n: usize| r.load[n].conductance * v + r.load[n].current + r.load[n].power / v;
        (0..r.rows()).map(drawn).collect::<Vec<_>>()
    };
    let i = median(records.iter().flat_map(current));
    // in balance the volts of the on-time weigh as much as those of the off-time: `d on^2 + (1 - d) off^2 = on off`
    let across = match base.plant.converter.topology {
        Topology::Buck => (v_in - v) * v,
        Topology::Boost => v_in * (v - v_in),
        Topology::BuckBoost => v_in * v,
    };
    Bases {
        v,
        i: if i > 0.0 { i } else { 1.0 },
        v_in,
        t_sw: base.plant.t_sw(),
        filter: base.plant.converter.f_sw / ideal.swing(),
        inductance: base.plant.converter.inductance,
        // next to the source's voltage there is hardly any
        across: across.max(0.1 * v * v),
    }
}

/// Takes rows at which the output has collapsed under a load that is set as a current or a power out of the segments, and says so: what such a
/// load draws near 0 V is how it is built, and no number of the plant.
pub(super) fn leave_out_collapse(record: &mut Record, v: f64) {
    let is_set = record.load.iter().any(|load| load.current != 0.0 || load.power != 0.0);
    if record.settled || !is_set {
        return;
    }
    let collapsed: Vec<bool> = record.measured[0].iter().map(|shown| *shown < COLLAPSED * v).collect();
    let count = collapsed.iter().filter(|row| **row).count();
    // in a record that is mostly so the base voltage is none
    if count == 0 || 2 * count > record.rows() {
        return;
    }
    let mut pieces = Vec::new();
    for segment in &record.segments {
        let mut start = segment.start;
        for row in segment.clone().chain([segment.end]) {
            if row == segment.end || collapsed[row] {
                if row >= start + SHORTEST {
                    pieces.push(start..row);
                }
                start = row + 1;
            }
        }
    }
    if pieces.is_empty() {
        return;
    }
    record.segments = pieces;
    record.repairs.push(format!(
        "in {count} of {} rows v_out is below {:.0} % of what it usually is: the record is taken without them, since a load that is set as a current \
         or a power draws what it likes there",
        record.rows(),
        100.0 * COLLAPSED
    ));
}

/// A constant-power load in open loop may be unstable: such a record is simulated in short pieces.
pub(super) fn cut_unstable(record: &mut Record, base: &Model, v: f64) {
    if record.settled {
        return;
    }
    let p = &base.plant;
    let (c, l) = (p.converter.capacitance, p.converter.inductance);
    let r = p.inductor.dcr + 0.5 * (p.switch.r_ds_on + p.switch.r_d);
    let rate = |n: &usize| {
        let load = &record.load[*n];
        0.5 * (load.power / (c * v * v) - load.conductance / c - r / l)
    };
    let fastest = (0..record.rows()).map(|n| rate(&n)).fold(0.0, f64::max);
    if fastest <= 0.0 {
        return;
    }
    let longest = ((MOST_GROWTH / (fastest * p.t_sw())) as usize).max(SHORTEST);
    let mut pieces = Vec::new();
    for segment in &record.segments {
        let count = segment.len().div_ceil(longest);
        let length = segment.len().div_ceil(count.max(1));
        for piece in 0..count {
            let start = segment.start + piece * length;
            // the first row is the last of the piece before, which scores it
            pieces.push(start.saturating_sub(usize::from(piece > 0))..(start + length).min(segment.end));
        }
    }
    record.segments = pieces;
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;
    use std::path::Path;

    use measured::{ColumnMap, Sheet};
    use plant::Parameters;

    use crate::record::Record;

    /// A record of 100 rows around 100 V, of which those in `low` show 4 V.
    fn record(load: &str, low: std::ops::Range<usize>) -> Record {
        let mut text = format!("t,d,v_o,{load}\n");
        for n in 0..100 {
            let v = if low.contains(&n) {
                4.0
            } else {
                100.0 + 0.01 * (n * 7 % 5) as f64
            };
            let _ = writeln!(text, "{:.6},0.5,{v:.3},20", (n as f64 + 0.5) * 1e-4);
        }
        let sheet = Sheet::parse(Path::new("a.csv"), text.into(), &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table()).unwrap()
    }

    #[test]
    fn an_output_that_collapses_under_a_set_current_cuts_the_record() {
        let cut = |load: &str, low: std::ops::Range<usize>| {
            let mut record = record(load, low);
            super::leave_out_collapse(&mut record, 100.0);
            let pieces: Vec<[usize; 2]> = record.segments.iter().map(|one| [one.start, one.end]).collect();
            let is_said = record.repairs.iter().any(|said| said.contains("v_out is below 20 %"));
            (pieces, is_said)
        };
        assert_eq!(cut("i_load", 50..54), (vec![[0, 50], [54, 100]], true));
        // a piece of 20 rows is none
        assert_eq!(cut("i_load", 20..24), (vec![[24, 100]], true));
        assert_eq!(cut("i_load", 0..0), (vec![[0, 100]], false));
        // what a resistor draws is known at any voltage
        assert_eq!(cut("r_load", 50..54), (vec![[0, 100]], false));
    }

    #[test]
    fn a_core_may_take_half_of_the_load_s_power_in_each_topology() {
        // topology, source, duty; on and off: what lies across the inductor
        for (topology, v_in, duty, on, off) in [
            ("buck", 40.0, 0.25, 30.0, -10.0),
            ("boost", 20.0, 0.5, 20.0, -20.0),
            ("buck-boost", 20.0, 2.0 / 3.0, 20.0, -40.0),
        ] {
            let text = format!(
                "[converter]\ntopology = \"{topology}\"\nv_in = {v_in}\ninductance = 22e-6\ncapacitance = 330e-6\nf_sw = 100e3\n"
            );
            let parameters = Parameters::from_toml(Path::new("plant.toml"), &text).unwrap();
            let v_out = if topology == "buck" { 10.0 } else { 40.0 };
            let mut table = "t,d,v_o,i_load\n".to_owned();
            for n in 0..40 {
                let _ = writeln!(
                    table,
                    "{:.6},{duty},{:.3},3",
                    n as f64 * 1e-5,
                    v_out + 0.01 * (n % 3) as f64
                );
            }
            let sheet = Sheet::parse(Path::new("a.csv"), table.into(), &Record::file_options()).unwrap();
            let record = Record::read(&sheet, &ColumnMap::default(), &parameters).unwrap();
            let base = crate::drive::Model::new(&parameters);
            let bases = super::bases(&[record], &base);
            let all = crate::causes::candidates(&base, &bases);
            let core = all.iter().find(|one| one.cause.id == "core_loss").unwrap();
            let lost = core.ranges[0][1] * (duty * on * on + (1.0 - duty) * off * off);
            assert!((lost / (0.5 * v_out * 3.0) - 1.0).abs() < 0.01, "{topology}: {lost} W");
        }
    }
}
