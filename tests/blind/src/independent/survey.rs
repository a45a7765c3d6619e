//! A survey: many small cases of one group, of any length from three rows to five thousand, for figures with narrow intervals.
//!
//! The families of a set say how the diagnosis does on records as a bench takes them. The groups here ask one question each: is a fault of
//! the bench named, is a rhythm seen, is nonsense believed, and does a good record keep its answer, however short or long it is?

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use crate::independent::draft::{Case, Draft, Name};
use crate::independent::draw::design;
use crate::independent::families::{Options, draw, ids, measured, topology, words};
use crate::independent::instruments::{V_IN, V_OUT};
use crate::independent::program::{Table, World};
use crate::independent::records::{Extent, FEWEST_IN_TIME, Needs};
use crate::independent::truth::{Expect, Family, Hidden};
use crate::rng::Rng;

/// What is asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// Nothing is wrong.
    Good,
    /// A fault between bench and file.
    Bench,
    /// Something trembles or swings, ten times as high in the spectrum as the noise.
    Rhythm,
    /// No converter gave the table.
    Nonsense,
    /// Physics that no plant file states.
    Unlisted,
}

impl Group {
    /// All of them.
    pub const ALL: [Group; 5] = [
        Group::Good,
        Group::Bench,
        Group::Rhythm,
        Group::Nonsense,
        Group::Unlisted,
    ];

    /// In a word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Group::Good => "good",
            Group::Bench => "bench",
            Group::Rhythm => "rhythm",
            Group::Nonsense => "nonsense",
            Group::Unlisted => "unlisted",
        }
    }

    fn ids(self) -> Vec<&'static str> {
        match self {
            Group::Good => ids(Family::Healthy),
            Group::Bench => ids(Family::Bench),
            Group::Rhythm => RHYTHMS.to_vec(),
            Group::Nonsense => ids(Family::Nonsense),
            Group::Unlisted => ids(Family::Unlisted),
        }
    }
}

/// What a survey asks for a rhythm.
const RHYTHMS: [&str; 4] = ["half_rate", "quarter_rate", "limit_cycle", "jitter"];
/// Height of a rhythm in the spectrum, over that of the noise: ten times its amplitude, a hundred times its power.
const HEIGHT: f64 = 100.0;
/// Longest and shortest records, rows.
const ROWS: (f64, f64) = (3.0, 5000.0);
/// Fewest rows in which a rhythm is asked for.
const FEWEST_OF_RHYTHM: f64 = 60.0;
/// Draws of a converter until what is hidden shows.
const DRAWS: u64 = 200;

/// A case, and what would be said of it by a reader who sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct Surveyed {
    /// What is hidden.
    pub id: &'static str,
    /// Rows of a training record that were asked for.
    pub rows: usize,
    /// Files and truth.
    pub case: Case,
    /// Words of which one is right for the shape or place of what is left; empty where none is asked for.
    pub shapes: &'static [&'static str],
}

/// A case of a survey; `with_ties` its truth has the listed causes that would show the same (twenty times as slow).
///
/// # Errors
/// If what is hidden does not show on any converter that is drawn.
pub fn surveyed(seed: u64, group: Group, number: usize, with_ties: bool) -> Result<Surveyed, String> {
    let mut all = group.ids();
    let turn = number / all.len();
    Rng::new(seed, &[81, group as u64, turn as u64]).shuffle(&mut all);
    let id = all[number % all.len()];
    for draws in 0..DRAWS {
        let random = &mut Rng::new(seed, &[82, group as u64, number as u64, draws]);
        let rows = rows(group, id, random);
        let options = Options {
            extent: Extent::Rows(rows),
            rivals: with_ties,
            buck_only: false,
        };
        let family = match group {
            Group::Good => Family::Healthy,
            Group::Bench => Family::Bench,
            Group::Rhythm | Group::Unlisted => Family::Unlisted,
            Group::Nonsense => Family::Nonsense,
        };
        let name = Name {
            seed,
            case: number,
            family,
        };
        let case = match group {
            Group::Rhythm => rhythm(name, id, options, random),
            _ => draw(name, id, options, random),
        };
        if let Some(case) = case {
            let shapes = if group == Group::Unlisted || group == Group::Rhythm {
                shapes(id)
            } else {
                &[]
            };
            return Ok(Surveyed { id, rows, case, shapes });
        }
    }
    Err(format!("{} {number}: {id} never shows in {DRAWS} draws", group.word()))
}

fn rows(group: Group, id: &str, random: &mut Rng) -> usize {
    let in_time = FEWEST_IN_TIME as f64;
    let (low, high) = match (group, id) {
        (Group::Rhythm, _) => (FEWEST_OF_RHYTHM, 1000.0),
        // what needs rows in time needs some to be seen in
        (Group::Bench, "shifted" | "clipped" | "spikes" | "lost_rows") => (1.5 * in_time, ROWS.1),
        // a search follows, and one record of thousands of rows takes minutes
        (Group::Unlisted, _) => (2.0 * in_time, 400.0),
        (Group::Bench, "sampling_instant" | "wrong_load" | "wrong_source") => (in_time, 300.0),
        (Group::Nonsense, _) => (4.0, ROWS.1),
        _ => ROWS,
    };
    random.log_uniform(low, high) as usize
}

/// Words for the shape or place of what physics leaves: of its spectrum, in time, or what it goes along with.
fn shapes(id: &str) -> &'static [&'static str] {
    match id {
        "half_rate" | "half_rate_dither" => &["every second row", "line", "dither"],
        "quarter_rate" | "slow_dither" | "limit_cycle" => &["line", "dither", "limit cycle"],
        "pickup" | "hunting_supply" => &["line", "limit cycle"],
        "jitter" => &["jitter", "tremble", "fast", "from row to row"],
        "lost_pulses" => &["pulse", "burst", "single"],
        "drift" => &["drift"],
        "heating" => &["drift", "current", "load", "behind"],
        "cubic" => &["duty", "load", "voltage", "level", "current"],
        "backlash" => &["stick", "step", "play", "duty", "load"],
        "creep" | "uncompensated_probe" => &["behind", "creep", "step", "duty", "load"],
        "absorption" | "eddy_currents" | "inductive_load" | "input_filter" => {
            &["behind", "step", "duty", "load", "burst"]
        }
        "hysteresis" | "square_core_loss" | "node_capacitance" | "recovery" => &["duty", "load", "current", "DCM"],
        _ => &[],
    }
}

/// Square of the Fourier transform at a share of the rate, over the number of values: the mean square of white noise.
fn power(values: &[f64], share: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    for (n, value) in values.iter().enumerate() {
        let angle = TAU * share * n as f64;
        re += (value - mean) * libm::cos(angle);
        im += (value - mean) * libm::sin(angle);
    }
    (re * re + im * im) / values.len().max(1) as f64
}

/// Highest power of what two tables differ by over that of the noise, in the channel that shows most.
fn height(a: &Table, b: &Table, floors: &[f64; 6], share: Option<f64>) -> f64 {
    let of = |channel: usize| {
        let pairs = a.values[channel].iter().zip(&b.values[channel]);
        let left: Vec<f64> = pairs.map(|(a, b)| (a - b) / floors[channel]).collect();
        match share {
            Some(share) => power(&left, share),
            // what trembles has no frequency: the mean over a twentieth of the rate where that is highest
            None => (1..10)
                .map(|band| {
                    let at = |n: usize| power(&left, 0.05 * band as f64 + 0.0025 * n as f64);
                    (0..20).map(at).sum::<f64>() / 20.0
                })
                .fold(0.0, f64::max),
        }
    };
    (V_OUT..V_IN).map(of).fold(0.0, f64::max)
}

fn trembling(world: &World, id: &str, size: f64, rows: f64) -> World {
    let mut world = world.clone();
    let gates = &mut world.board.gates;
    match id {
        "half_rate" => gates.dither = (size, 2.0),
        "quarter_rate" => gates.dither = (size, 4.0),
        "jitter" => gates.jitter = size / gates.f_sw,
        _ => gates.dither = (size, rows),
    }
    world
}

fn rhythm(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    let design = design(topology(options, random), random);
    let period = match id {
        "half_rate" => 2.0,
        "quarter_rate" => 4.0,
        _ => libm::round(random.uniform(5.0, 12.0)),
    };
    let needs = Needs {
        rows: true,
        ..Needs::default()
    };
    let still = measured(&design, &design.world, needs, options, random)?;
    let share = (id != "jitter").then_some(1.0 / period);
    let floors = still.floors();
    // two edges of half a percent, and from there as a line
    let mut size = 0.005;
    for _ in 0..3 {
        let world = trembling(&design.world, id, size, period);
        let draft = Draft::measure(&design, &world, still.programs.clone(), random)?;
        let height = height(&draft.exact[0], &still.exact[0], &floors, share);
        if (0.7 * HEIGHT..1.6 * HEIGHT).contains(&height) {
            let expect = Expect {
                verdicts: words(&["unexplained"]),
                wrong: "any cause".to_owned(),
                ..Expect::default()
            };
            let hidden = Hidden {
                id: id.to_owned(),
                listed: false,
                what: format!(
                    "{id}: {:.3} % of the period, {period} rows, {height:.1} times the noise",
                    100.0 * size
                ),
                parameters: BTreeMap::new(),
                channel: None,
                chi2: draft.distance(&design.world, &floors),
            };
            return Some(draft.case(name, vec![hidden], expect, &[], false, random));
        }
        size *= (HEIGHT / height.max(1e-9)).sqrt();
        if size > 0.05 {
            return None;
        }
    }
    None
}

/// A fault of the bench is seen from this mean square over the noise on: noise alone makes 1.
pub const SEEN: f64 = 2.0;
/// A table without sense differs from what the plant file gives by so many times the noise in the mean.
pub const SENSELESS: f64 = 30.0;

/// Mean square of what a table differs by from what the plant file gives, over the noise.
pub fn mean_square(draft: &Draft) -> f64 {
    let floors = draft.floors();
    let (mut sum, mut count) = (0.0, 0.0);
    for (table, exact) in draft.tables.iter().zip(&draft.exact) {
        for (channel, floor) in floors[..4].iter().enumerate() {
            for (a, b) in table.values[channel].iter().zip(&exact.values[channel]) {
                sum += ((a - b) / floor).powi(2);
                count += 1.0;
            }
        }
    }
    sum / f64::max(count, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_survey_has_every_id_and_the_same_bytes_again() {
        for group in Group::ALL {
            let (a, b) = (surveyed(3, group, 1, false), surveyed(3, group, 1, false));
            assert_eq!(a, b, "{group:?}");
            assert!(a.is_ok(), "{group:?}: {a:?}");
        }
    }

    #[test]
    fn a_line_has_its_power_at_its_frequency() {
        let values: Vec<f64> = (0..400).map(|n| 2.0 * libm::sin(TAU * 0.1 * n as f64)).collect();
        // |X|^2 / n of a sine of amplitude A is n A^2 / 4
        assert!((power(&values, 0.1) - 400.0).abs() < 1.0);
        assert!(power(&values, 0.2) < 1.0);
    }
}
