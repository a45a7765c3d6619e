//! Rows that are sampled at a switching edge, where nobody knows on which side of it.
//!
//! In a boost and a buck-boost the current of the inductor reaches the output for a part of the period alone: there the output voltage leaps
//! by ESR times that current. A converter that samples within some nanoseconds of the edge shows either value, and one and the same bench shows
//! one in each row.

use plant::{Carrier, Parameters, Topology};

use super::rows::Lines;

/// How near to an edge is at it, as a share of the period.
// 20 ns at 100 kHz: delays of a driver and of a comparator come to that, and a duty of three decimals to half of it
const NEAR: f64 = 2e-3;

/// Most of the rows that may be left out; beyond, the instant in the plant file decides.
const MOST: f64 = 0.5;

/// Takes the voltages and the load currents out of such rows; what is to be said of it, if there are any.
pub fn unsure(lines: &mut Lines, parameters: &Parameters) -> Option<String> {
    let (pwm, rows) = (&parameters.pwm, lines.duty.len());
    if parameters.converter.topology == Topology::Buck || parameters.capacitor.esr == 0.0 {
        return None;
    }
    let delay = pwm.duty_delay as usize;
    let is_at_edge = |row: &usize| {
        let acting = lines.duty.get(row.saturating_sub(delay)).copied().unwrap_or(0.0);
        let edges = match pwm.carrier {
            Carrier::Trailing => [acting, acting],
            Carrier::Leading => [1.0 - acting, 1.0 - acting],
            Carrier::Centre => [0.5 - 0.5 * acting, 0.5 + 0.5 * acting],
        };
        acting > 0.0 && acting < 1.0 && edges.iter().any(|edge| (edge - lines.phase).abs() < NEAR)
    };
    let at_edge: Vec<usize> = (0..rows).filter(is_at_edge).collect();
    if at_edge.is_empty() {
        return None;
    }
    let what = format!(
        "{} of {rows} rows are sampled at the edge of the switch (duty and sampling_phase {:.3}), where v_out leaps by the ESR's voltage",
        at_edge.len(),
        lines.phase
    );
    if at_edge.len() as f64 > MOST * rows as f64 {
        return Some(format!(
            "{what}, and on which side nobody knows: the model takes the value just before the edge. If a verdict hangs on it, say \
             sampling_phase = {:.3} or {:.3}",
            lines.phase - NEAR,
            lines.phase + NEAR
        ));
    }
    for channel in [0, 2] {
        for row in &at_edge {
            if let Some(value) = lines.measured[channel].get_mut(*row) {
                *value = f64::NAN;
            }
        }
    }
    Some(format!("{what}, and on which side nobody knows: they are left out"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(duty: &[f64], phase: f64) -> Lines {
        Lines {
            duty: duty.to_vec(),
            measured: std::array::from_fn(|_| vec![1.0; duty.len()]),
            ..Lines::empty(phase)
        }
    }

    fn boost(carrier: Carrier) -> Parameters {
        let mut p = Parameters::default();
        (p.converter.topology, p.pwm.carrier, p.capacitor.esr) = (Topology::Boost, carrier, 0.02);
        p
    }

    /// Rows whose voltage was taken out.
    fn taken(duty: &[f64], phase: f64, parameters: &Parameters) -> (Vec<usize>, Option<String>) {
        let mut lines = lines(duty, phase);
        let said = unsure(&mut lines, parameters);
        let rows = (0..duty.len()).filter(|n| lines.measured[0][*n].is_nan()).collect();
        // the current does not leap
        assert!(lines.measured[1].iter().all(|v| v.is_finite()));
        (rows, said)
    }

    #[test]
    fn rows_at_the_edge_are_left_out_where_the_output_leaps() {
        let duty = [0.51, 0.5, 0.49, 0.5005, 0.503];
        let (rows, said) = taken(&duty, 0.5, &boost(Carrier::Trailing));
        assert_eq!(rows, [1, 3]);
        assert!(said.unwrap().starts_with("2 of 5 rows"));
        // the on-interval of the last fifth begins at 0.8
        assert_eq!(taken(&[0.2, 0.3, 0.8], 0.8, &boost(Carrier::Leading)).0, [0]);
        // from 0.3 to 0.7
        assert_eq!(taken(&[0.4, 0.3, 0.7], 0.7, &boost(Carrier::Centre)).0, [0]);
        let mut buck = boost(Carrier::Trailing);
        buck.converter.topology = Topology::Buck;
        assert_eq!(taken(&duty, 0.5, &buck), (Vec::new(), None));
    }

    #[test]
    fn a_duty_that_acts_later_is_judged_where_it_acts() {
        let mut later = boost(Carrier::Trailing);
        later.pwm.duty_delay = 1;
        assert_eq!(taken(&[0.4, 0.5, 0.4, 0.4], 0.5, &later).0, [2]);
    }

    #[test]
    fn where_nearly_all_rows_are_at_the_edge_they_stay_and_it_is_said() {
        let (rows, said) = taken(&[0.5, 0.5, 0.5, 0.4], 0.5, &boost(Carrier::Trailing));
        assert!(rows.is_empty() && said.unwrap().contains("sampling_phase = 0.498 or 0.502"));
    }
}
