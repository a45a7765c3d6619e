//! Rows that are sampled at a switching edge, where nobody knows on which side of it.
//!
//! In a boost and a buck-boost the current of the inductor reaches the output for a part of the period alone: there the output voltage leaps
//! by ESR times that current. A converter that samples within some nanoseconds of the edge shows either value, and one and the same bench shows
//! one in each row.

use plant::{Carrier, Parameters, Topology};

use super::Record;

/// How near to an edge is at it, as a share of the period.
// 20 ns at 100 kHz: delays of a driver and of a comparator come to that, and a duty of three decimals to half of it
pub(crate) const NEAR: f64 = 2e-3;

/// Takes the voltages and the load currents of such rows out of a record over time, and says so. Where they are most of the rows and no current of
/// the inductor stands beside them nothing would be left to compare: they stay, and the instant in the plant file decides.
pub fn leave_out(record: &mut Record, parameters: &Parameters) {
    let pwm = &parameters.pwm;
    if record.settled || parameters.converter.topology == Topology::Buck || parameters.capacitor.esr == 0.0 {
        return;
    }
    let delay = pwm.duty_delay as usize;
    let is_at_edge = |row: &usize| {
        let acting = record.duty.get(row.saturating_sub(delay)).copied().unwrap_or(0.0);
        let edges = match pwm.carrier {
            Carrier::Trailing => [acting, acting],
            Carrier::Leading => [1.0 - acting, 1.0 - acting],
            Carrier::Centre => [0.5 - 0.5 * acting, 0.5 + 0.5 * acting],
        };
        acting > 0.0 && acting < 1.0 && edges.iter().any(|edge| (edge - record.phase).abs() < NEAR)
    };
    let rows = record.rows();
    let at_edge: Vec<usize> = (0..rows).filter(is_at_edge).collect();
    if at_edge.is_empty() {
        return;
    }
    let (phase, (before, behind)) = (record.phase, (record.phase - NEAR, record.phase + NEAR));
    let what = format!(
        "{} of {rows} rows are sampled at the edge of the switch (duty and sampling_phase {phase:.3}), where v_out leaps by the ESR's voltage, \
         and on which side nobody knows",
        at_edge.len(),
    );
    let are_most = 2 * at_edge.len() > rows;
    let has_current = record.measured[1].iter().any(|value| value.is_finite());
    if are_most && !has_current {
        record.repairs.push(format!(
            "{what}: the model takes the value just before the edge. If a verdict hangs on it, say sampling_phase = {before:.3} or {behind:.3}"
        ));
        return;
    }
    for channel in [0, 2] {
        for row in &at_edge {
            if let Some(value) = record.measured[channel].get_mut(*row) {
                *value = f64::NAN;
            }
        }
    }
    record.repairs.push(match are_most {
        true => format!(
            "{what}: their v_out and i_out are left out, and i_l remains. If you know the side, sampling_phase = {before:.3} or {behind:.3} in the plant file keeps them"
        ),
        false => format!("{what}: their v_out and i_out are left out"),
    });
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use measured::{ColumnMap, Sheet};

    use super::*;

    fn boost(carrier: Carrier) -> Parameters {
        let mut p = Parameters::paper_table();
        (p.converter.topology, p.pwm.carrier, p.capacitor.esr) = (Topology::Boost, carrier, 0.02);
        p.converter.v_in = 50.0;
        p
    }

    /// A record whose duties repeat, sampled at a phase; `columns` of it are measured.
    fn record(duty: &[f64], phase: f64, columns: &[&str], parameters: &Parameters) -> Record {
        let mut text = format!("t,duty,r_load,{}\n", columns.join(","));
        for n in 0..60 {
            let (time, value) = ((n as f64 + phase) * 1e-4, 100.0 + 0.137 * (n % 7) as f64);
            let scale = |name: &&str| if **name == *"i_l" { 0.05 } else { 1.0 };
            let cells: Vec<String> = (columns.iter())
                .map(|name| format!("{:.4}", scale(name) * value))
                .collect();
            text += &format!("{time:.7},{:.4},20,{}\n", duty[n % duty.len()], cells.join(","));
        }
        let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), parameters).unwrap()
    }

    /// Which of the first rows have lost their voltage, and what is said.
    fn taken(duty: &[f64], phase: f64, columns: &[&str], parameters: &Parameters) -> (Vec<usize>, Vec<String>) {
        let record = record(duty, phase, columns, parameters);
        let rows = (0..duty.len()).filter(|n| record.measured[0][*n].is_nan()).collect();
        // the current does not leap
        let has_current = columns.contains(&"i_l");
        assert!(record.measured[1].iter().all(|v| v.is_finite() == has_current));
        (rows, record.repairs)
    }

    const BOTH: [&str; 2] = ["v_out", "i_l"];

    #[test]
    fn rows_at_the_edge_are_left_out_where_the_output_leaps() {
        let duty = [0.51, 0.5, 0.49, 0.5005, 0.503];
        let (rows, said) = taken(&duty, 0.5, &BOTH, &boost(Carrier::Trailing));
        assert_eq!(rows, [1, 3]);
        // said once, and not a second time as holes
        assert!(said.len() == 1 && said[0].starts_with("24 of 60 rows"), "{said:?}");
        // the on-interval of the last fifth begins at 0.8
        assert_eq!(taken(&[0.2, 0.3, 0.8], 0.8, &BOTH, &boost(Carrier::Leading)).0, [0]);
        // from 0.3 to 0.7
        assert_eq!(taken(&[0.4, 0.3, 0.7], 0.7, &BOTH, &boost(Carrier::Centre)).0, [0]);
        let mut buck = boost(Carrier::Trailing);
        (buck.converter.topology, buck.converter.v_in) = (Topology::Buck, 200.0);
        assert_eq!(taken(&duty, 0.5, &BOTH, &buck), (Vec::new(), Vec::new()));
    }

    #[test]
    fn a_duty_that_acts_later_is_judged_where_it_acts() {
        let mut later = boost(Carrier::Trailing);
        later.pwm.duty_delay = 1;
        assert_eq!(taken(&[0.4, 0.5, 0.4, 0.4], 0.5, &BOTH, &later).0, [2]);
    }

    #[test]
    fn where_most_rows_are_at_the_edge_the_current_remains_and_without_it_they_stay() {
        let duty = [0.5, 0.5, 0.5, 0.4];
        let (rows, said) = taken(&duty, 0.5, &BOTH, &boost(Carrier::Trailing));
        assert_eq!(rows, [0, 1, 2]);
        assert!(
            said[0].contains("i_l remains") && said[0].contains("sampling_phase = 0.498 or 0.502"),
            "{said:?}"
        );
        let (rows, said) = taken(&duty, 0.5, &["v_out"], &boost(Carrier::Trailing));
        assert!(rows.is_empty(), "{rows:?}");
        assert!(
            said[0].contains("just before the edge") && said[0].contains("0.498 or 0.502"),
            "{said:?}"
        );
    }
}
