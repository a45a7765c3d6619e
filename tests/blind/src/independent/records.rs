//! Which records somebody takes of a converter, drawn anew for each case.

use crate::independent::board::{Load, Topology};
use crate::independent::draw::{Design, Kind, load, round};
use crate::independent::program::{Form, Program, Regulator, World, regulated};
use crate::independent::simulate::Period;
use crate::rng::Rng;

/// What the records must hold, so that a cause can show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// Constant power.
    pub power: bool,
    /// Set current or power.
    pub sink: bool,
    /// A row each period.
    pub rows: bool,
}

/// How large a set is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    Full,
    /// As somebody takes them who has two things to find.
    Long,
    /// For tests.
    Short,
    /// So many rows in each training record: settled points where they are few.
    Rows(usize),
}

/// Fewer rows than these are a table of settled points: a record over time of fewer shows next to nothing.
pub const FEWEST_IN_TIME: usize = 40;
/// Most rows of a record that only judges, and of one that does not learn alone, in a set of drawn lengths.
const MOST_JUDGED: usize = 150;

/// Draws the records of a case: two or three to learn from, one or two that judge.
pub fn programs(design: &Design, needs: Needs, extent: Extent, random: &mut Rng) -> Vec<Program> {
    match extent {
        Extent::Rows(rows) if !needs.rows && rows < FEWEST_IN_TIME => {
            return tables(design, needs, rows, random);
        }
        Extent::Full | Extent::Short if !needs.rows && random.chance(0.2) => {
            let points = 14 + random.below(20);
            return tables(design, needs, points, random);
        }
        _ => {}
    }
    let kinds = kinds(needs, random);
    let heldout = 1;
    let train = match extent {
        Extent::Short => 1,
        Extent::Rows(rows) if rows > MOST_JUDGED => 1,
        _ => 2,
    };
    let mut all = Vec::new();
    for number in 0..train + heldout {
        let judged = number >= train;
        let kind = kinds[number % kinds.len()];
        let rows = match extent {
            Extent::Full => 110 + 10 * random.below(8),
            Extent::Long if judged => 200 + 10 * random.below(11),
            Extent::Long => 500 + 50 * random.below(9),
            Extent::Short => 80,
            Extent::Rows(rows) if judged => rows.clamp(FEWEST_IN_TIME, MOST_JUDGED),
            Extent::Rows(rows) => rows.max(FEWEST_IN_TIME),
        };
        let name = format!("{}{number:02}", ["run_", "rec", "m", "log-"][random.below(4)]);
        all.push(record(design, kind, (name, judged, rows), random));
    }
    all
}

fn kinds(needs: Needs, random: &mut Rng) -> Vec<Kind> {
    let mut kinds = vec![Kind::Resistor, Kind::Current, Kind::Power];
    random.shuffle(&mut kinds);
    kinds.truncate(1 + random.below(3));
    if needs.power && !kinds.contains(&Kind::Power) {
        kinds.insert(0, Kind::Power);
    }
    if needs.sink && kinds == [Kind::Resistor] {
        kinds.insert(0, Kind::Current);
    }
    kinds
}

/// Duty held and load stepping, duty stepping, both, or small pseudo-random duties.
fn record(design: &Design, kind: Kind, (name, heldout, rows): (String, bool, usize), random: &mut Rng) -> Program {
    let lead = 4;
    let hold = ((design.swing * random.uniform(0.8, 1.5)) as usize).clamp(15, 45);
    // nobody steps a long record a hundred times
    let hold = hold * (rows / 200).max(1);
    let what = random.below(4);
    let span = match design.world.board.topology {
        Topology::Buck => 0.25,
        _ => 0.12,
    };
    let mut duty = level(design, span, random);
    let mut share = random.uniform(0.6, 1.0);
    let (mut periods, mut left) = (Vec::new(), hold.min(15));
    let mut small = 0.0;
    for k in 0..lead + rows {
        if left == 0 {
            left = hold / 2 + random.below(hold);
            if what == 0 || what == 2 || (what == 1 && random.chance(0.3)) {
                duty = level(design, span, random);
            }
            if what >= 1 {
                share = random.uniform(0.3, 1.1);
            }
        }
        if what == 3 && k > lead && k % 5 == 0 {
            small = if random.chance(0.5) { 0.03 } else { -0.03 } * design.duty;
        }
        left -= 1;
        let duty = round_duty(duty + small);
        periods.push(Period {
            duty,
            load: load(design, kind, share),
            after: 0.0,
        });
    }
    Program {
        name,
        heldout,
        form: Form::Rows,
        lead,
        periods,
        source: 1.0,
    }
}

fn level(design: &Design, span: f64, random: &mut Rng) -> f64 {
    round_duty((design.duty * random.uniform(1.0 - span, 1.0 + span)).clamp(0.05, 0.92))
}

fn round_duty(duty: f64) -> f64 {
    libm::round(duty * 1e4) / 1e4
}

/// Settled points over duty and load.
fn tables(design: &Design, needs: Needs, most: usize, random: &mut Rng) -> Vec<Program> {
    let kinds = kinds(needs, random);
    (0..2)
        .map(|number| {
            let points = if number == 0 { most } else { 8 + random.below(8) };
            let periods = (0..points)
                .map(|_| {
                    let duty = level(
                        design,
                        if design.world.board.topology == Topology::Buck {
                            0.5
                        } else {
                            0.2
                        },
                        random,
                    );
                    let kind = kinds[random.below(kinds.len())];
                    Period {
                        duty,
                        load: load(design, kind, random.uniform(0.2, 1.1)),
                        after: 0.0,
                    }
                })
                .collect();
            let name = format!("points{number}");
            Program {
                name,
                heldout: number == 1,
                form: Form::Settled,
                lead: 0,
                periods,
                source: 1.0,
            }
        })
        .collect()
}

/// Closes a loop over one of the held-out records of a buck: its duties become those of a regulator at the real board.
pub fn close_one(design: &Design, world: &World, programs: &mut [Program], random: &mut Rng) {
    let usable = world.board.topology == Topology::Buck && world.instruments.channels[0].recorded;
    let judged = programs
        .iter_mut()
        .rev()
        .find(|program| program.heldout && program.form == Form::Rows);
    let Some(program) = judged.filter(|_| usable) else {
        return;
    };
    let gain = world.board.source.v;
    // integral action far below the filter's resonance, so that its peak stays below one
    let slow = (1.0 / 6.0_f64).min(0.3 / design.quality.max(0.5)) / design.swing;
    let law = Regulator {
        kp: 0.1 / (gain * design.quality.max(1.0)),
        ki: 2.0 * std::f64::consts::PI * slow / gain,
        v_ref: design.v_out * random.uniform(0.9, 1.1),
        limits: (0.05, 0.95),
    };
    let mut share = 0.8;
    let hold = (design.swing * 2.5) as usize;
    let loads: Vec<Load> = (0..program.periods.len())
        .map(|k| {
            if k > program.lead && k % hold.max(20) == 0 {
                share = random.uniform(0.4, 1.1);
            }
            load(design, Kind::Resistor, share)
        })
        .collect();
    let first = round(design.duty, 4);
    let duties = regulated(world, &loads, first, law, random);
    program.periods = duties
        .iter()
        .zip(&loads)
        .map(|(duty, load)| Period {
            duty: *duty,
            load: *load,
            after: 0.0,
        })
        .collect();
}
