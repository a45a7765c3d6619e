//! What is settled of records before they are a problem: their source, magnitudes, and pieces of unstable ones.

use crate::causes::Bases;
use crate::drive::Model;
use crate::ideal::Ideal;
use crate::median::median;
use crate::record::Record;

/// Growth of a state over a segment of an unstable record, in time constants: an error of the initial state grows e^2, sevenfold,
/// and the least-squares problem stays close to linear. At 4 it grows 55-fold. A convention.
const MOST_GROWTH: f64 = 2.0;
/// Shortest segment of an unstable record, rows: each costs two unknowns, of 30 rows of two signals.
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
    Bases {
        v,
        i: if i > 0.0 { i } else { 1.0 },
        v_in,
        t_sw: base.plant.t_sw(),
    }
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
