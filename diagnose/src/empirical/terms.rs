//! The terms that an empirical correction may have, and the ranges in which it follows the signals.
//!
//! They take the shape of candidates, so that the fit of causes fits them, and stand in no list of causes.

use plant::Parameters;

use crate::causes::{Candidate, Cause, Form, Kind, Knob, Search};
use crate::problem::Problem;

/// Largest coefficient that is tried, duty: with more the term would be another converter.
const MOST: f64 = 0.3;
/// Change of a coefficient that counts as one: half a percent of the duty, ten times what gates are taken for.
const STEP: f64 = 0.005;

/// A signal of which a term is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    Duty,
    Voltage,
    Current,
    Rate,
}

/// A term: the name of its coefficient under `[empirical]`, and what it is a product of.
struct Term {
    form: Form,
    of: &'static [Of],
}

macro_rules! terms {
    ($($name:literal [$($of:ident),*] $words:literal),+ $(,)?) => {
        static TERMS: &[Term] = &[$(Term {
            form: Form {
                words: $words,
                knobs: &[Knob::plain($name, &[concat!("empirical.", $name)], [-MOST, MOST, STEP])],
                search: Search::Own,
                is_of_a_course: false,
            },
            of: &[$(Of::$of),*],
        }),+];
    };
}

terms! {
    "constant" [] "throughout",
    "d" [Duty] "duty",
    "v" [Voltage] "output voltage",
    "i" [Current] "inductor current",
    "rate" [Rate] "rate of the duty",
    "d_d" [Duty, Duty] "square of the duty",
    "v_v" [Voltage, Voltage] "square of the output voltage",
    "i_i" [Current, Current] "square of the inductor current",
    "rate_rate" [Rate, Rate] "square of the rate",
    "d_v" [Duty, Voltage] "duty times output voltage",
    "d_i" [Duty, Current] "duty times inductor current",
    "v_i" [Voltage, Current] "output voltage times inductor current",
    "d_rate" [Duty, Rate] "duty times rate",
    "v_rate" [Voltage, Rate] "output voltage times rate",
    "i_rate" [Current, Rate] "inductor current times rate",
}

static NOBODYS: Cause = Cause {
    id: "empirical",
    kind: Kind::Setting,
    forms: &[],
};

/// A range is this share of the magnitude at least: a signal that moves less says nothing of how anything depends on it.
// a hundred times what two simulators of one circuit differ by, 1e-4
const NARROW: f64 = 0.01;
/// Share of the rows beyond either end of a range: spikes and the very corners, where one row would have to tell the whole course.
const CORNER: f64 = 0.005;

/// Sets centres and spans of `plant` to the ranges of the records, in which `shown` is simulated (rows of output voltage and inductor
/// current); the terms whose signals move.
pub fn candidates(problem: &Problem, shown: &[[f64; 2]], plant: &mut Parameters) -> Vec<Candidate> {
    // ranges are those of the terms that are fitted here, of which none stands yet
    plant.empirical = Parameters::default().empirical;
    let p = &mut plant.empirical;
    let time = (plant.converter.inductance * plant.converter.capacitance).sqrt();
    // the filter takes its time whatever the duty does: what is left behind a change of the duty is left that long
    p.rate_time = time.max(2.0 * problem.bases.t_sw);
    let share = 1.0 - libm::exp(-problem.bases.t_sw / p.rate_time);
    let duties = problem.records.iter().flat_map(|record| record.duty.iter().copied());
    let duty = range(duties);
    let rates = problem.records.iter().flat_map(|record| {
        let mut slow = record.duty.first().copied().unwrap_or(0.0);
        record.duty.iter().map(move |duty| {
            let rate = duty - slow;
            slow += share * rate;
            rate.abs()
        })
    });
    let rate = range(rates).map_or(0.0, |[_, high]| high);
    let signal = |n: usize| {
        let measured = problem.records.iter().flat_map(|r| r.measured[n].iter().copied());
        range(measured.chain(shown.iter().map(|row| row[n])))
    };
    let mut moves = Vec::new();
    let mut take = |of: Of, range: Option<[f64; 2]>, least: f64, [centre, span]: [&mut f64; 2]| {
        let Some([low, high]) = range else { return };
        *centre = 0.5 * (low + high);
        *span = (0.5 * (high - low)).max(least);
        if 0.5 * (high - low) > least {
            moves.push(of);
        }
    };
    let mut nowhere = 0.0;
    take(Of::Duty, duty, NARROW, [&mut p.d_centre, &mut p.d_span]);
    take(
        Of::Voltage,
        signal(0),
        NARROW * problem.bases.v,
        [&mut p.v_centre, &mut p.v_span],
    );
    take(
        Of::Current,
        signal(1),
        NARROW * problem.bases.i,
        [&mut p.i_centre, &mut p.i_span],
    );
    take(Of::Rate, Some([-rate, rate]), NARROW, [&mut nowhere, &mut p.rate_span]);
    let usable = TERMS.iter().filter(|term| term.of.iter().all(|of| moves.contains(of)));
    let candidate = |term: &'static Term| Candidate {
        number: usize::MAX,
        cause: &NOBODYS,
        form: &term.form,
        own: vec![0.0],
        ranges: vec![[-MOST, MOST, STEP]],
    };
    usable.map(candidate).collect()
}

/// The range of all values but the corners.
fn range(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut sorted: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let corner = (CORNER * sorted.len() as f64) as usize;
    Some([*sorted.get(corner)?, *sorted.get(sorted.len() - 1 - corner)?])
}
