//! What the numbers of a data logger are: means, or samples at one instant of a switching period.
//!
//! The current swings in each period, and a sample at its start lies half a ripple below the mean. A table does not show
//! which it holds, so the data decide, unless the map says it.

use measured::Sampled;

use crate::drive::Model;
use crate::fit::State;
use crate::problem::Problem;
use crate::record::Record;

/// Samples at an instant are taken where they lower chi-square by this: five standard deviations, as for another
/// instrument's channel ([`crate::gain`]). Below it the two are alike, and a mean is the usual thing.
const CLEARLY: f64 = 25.0;

/// Decides for each record that does not say it, by what the model fits better; remarks go to the record's repairs.
pub fn decide(problem: &mut Problem, model: &Model) {
    for index in 0..problem.records.len() {
        let record = &problem.records[index];
        if !record.settled || record.sampled.is_some() {
            continue;
        }
        let chi2 = |sampled: Sampled, phase: f64| {
            let mut alone = problem.clone();
            alone.records = vec![Record {
                sampled: Some(sampled),
                phase,
                ..record.clone()
            }];
            (alone.offsets, alone.masked) = (vec![0], vec![problem.masked[index].clone()]);
            State::settle(&alone, model, &alone.first_starts(model), None).chi2
        };
        let instants =
            [record.phase, model.plant.pwm.sampling_phase].map(|phase| (chi2(Sampled::Instant, phase), phase));
        let mean = chi2(Sampled::Mean, record.phase);
        let (least, phase) = if instants[1].0 < instants[0].0 {
            instants[1]
        } else {
            instants[0]
        };
        let record = &mut problem.records[index];
        if least >= mean - CLEARLY {
            record.sampled = Some(Sampled::Mean);
            // said only where the data decided; where both fit alike a mean is what anybody would assume
            if least > mean + CLEARLY {
                record.repairs.push(said("means", "mean"));
            }
            continue;
        }
        (record.sampled, record.phase) = (Some(Sampled::Instant), phase);
        let what = format!("samples at {:.0} % of the switching period", 100.0 * phase);
        record.repairs.push(said(&what, "instant"));
    }
}

fn said(what: &str, word: &str) -> String {
    format!("its numbers fit as {what} and are taken so; a map file can say it: sampled = \"{word}\"")
}
