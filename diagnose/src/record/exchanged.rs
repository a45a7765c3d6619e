//! Two voltages that are exchanged, where their sizes do not tell: above a duty of 0.6 they are less than 1.6 times apart.

use super::{Record, V_IN};
use crate::ideal::Ideal;
use crate::median::median;

/// Read the other way round, each voltage is this near to what the model has, as a share of the source; as they stand, each is farther. Losses are less
/// than a tenth.
const NEAR: f64 = 0.1;
/// As they stand they are off by this many times as much. A convention: of two readings the clearly nearer one.
const CLEARLY: f64 = 3.0;
/// The duty moves by as much at least: at one duty the source may be another one. A convention.
const MOVES: f64 = 0.05;

/// Whether `v_in` goes with the duty as an output voltage does, and `v_out` stands still as the source.
pub(super) fn voltages(record: &Record, ideal: &Ideal) -> bool {
    let (v_out, v_in) = (&record.measured[0], &record.measured[V_IN]);
    let rows = || {
        let both = record.duty.iter().zip(v_out.iter().zip(v_in));
        both.filter(|(_, (v_out, v_in))| v_out.is_finite() && v_in.is_finite())
    };
    let duties = rows().fold((1.0f64, 0.0f64), |(low, high), (d, _)| (low.min(*d), high.max(*d)));
    if duties.1 - duties.0 < MOVES {
        return false;
    }
    let off = |output: &dyn Fn(f64, f64) -> f64, source: &dyn Fn(f64, f64) -> f64| {
        let of_output = median(rows().map(|(d, (a, b))| (output(*a, *b) - ideal.volts(*d)).abs()));
        let of_source = median(rows().map(|(_, (a, b))| (source(*a, *b) - ideal.v_in).abs()));
        [of_output / ideal.v_in, of_source / ideal.v_in]
    };
    let own = off(&|v_out, _| v_out, &|_, v_in| v_in);
    let other = off(&|_, v_in| v_in, &|v_out, _| v_out);
    own.iter()
        .zip(other)
        .all(|(own, other)| *own > NEAR && other < NEAR && *own > CLEARLY * other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::Parameters;

    fn looks_exchanged(v_out: impl Fn(f64) -> f64, v_in: impl Fn(f64) -> f64) -> bool {
        let parameters = Parameters::paper_table();
        let duties = [0.55, 0.62, 0.7, 0.78, 0.9];
        let rows = duties.map(|d| format!("{d},{},{},20\n", v_out(d), v_in(d)));
        let sheet = measured::Sheet::parse(
            std::path::Path::new("points.csv"),
            format!("duty,v_out,v_in,r_load\n{}", rows.concat()).into(),
            &Record::file_options(),
        );
        // named the right way by force: the check itself is asked
        let map = measured::ColumnMap::parse("v_out=v_out*1,v_in=v_in*1").unwrap();
        let record = Record::read(&sheet.unwrap(), &map, &parameters);
        let ideal = Ideal::at(&parameters, 1.0);
        record.is_ok_and(|record| voltages(&record, &ideal))
    }

    #[test]
    fn an_output_that_stands_still_beside_a_source_that_goes_with_the_duty() {
        let parameters = Parameters::paper_table();
        let ideal = Ideal::at(&parameters, 1.0);
        let (output, source) = (|d: f64| 0.95 * ideal.volts(d), |_: f64| 1.01 * ideal.v_in);
        assert!(looks_exchanged(source, output));
        assert!(!looks_exchanged(output, source));
        // a switch that stays on, and a source that is lower by a fifth
        assert!(!looks_exchanged(source, source));
        assert!(!looks_exchanged(|d| 0.8 * output(d), |_| 0.8 * ideal.v_in));
    }
}
