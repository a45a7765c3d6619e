//! What is done at the bench and written down: duties and loads of a record, and the table that instruments make of it.

use crate::independent::board::{Board, Load};
use crate::independent::circuit::Nodes;
use crate::independent::instruments::{Instruments, digitise, mean, shown};
use crate::independent::simulate::{Period, STEPS, run};
use crate::rng::Rng;

/// A board and what looks at it.
#[derive(Debug, Clone, PartialEq)]
pub struct World {
    pub board: Board,
    pub instruments: Instruments,
}

/// What a record is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// A row each period.
    Rows,
    /// A settled point in each row, every channel a mean.
    Settled,
}

/// A record before it is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    pub name: String,
    pub heldout: bool,
    pub form: Form,
    /// Periods before the first row.
    pub lead: usize,
    /// Periods, or points.
    pub periods: Vec<Period>,
    /// Source voltage over that of the board.
    pub source: f64,
}

/// A measured table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Empty for settled points.
    pub t: Vec<f64>,
    pub duty: Vec<f64>,
    pub load: Vec<Load>,
    /// In the order of the instruments' channels.
    pub values: [Vec<f64>; 6],
}

impl Table {
    pub fn rows(&self) -> usize {
        self.duty.len()
    }
}

/// The table without noise and rounding.
pub fn exact(world: &World, program: &Program, random: &mut Rng) -> Table {
    let mut world = world.clone();
    world.board.source.v *= program.source;
    world.board.source.ripple.2 += begun(&program.name);
    match program.form {
        Form::Rows => rows(&world, program, random),
        Form::Settled => points(&world, program, random),
    }
}

/// Where on the mains a record begins, turns: nobody triggers on them. Another for each name.
fn begun(name: &str) -> f64 {
    let sum: u32 = name.bytes().map(u32::from).sum();
    // of the golden ratio, so that names which differ by one letter are far apart
    (f64::from(sum) * 0.618_034).fract()
}

fn rows(world: &World, program: &Program, random: &mut Rng) -> Table {
    let trace = run(&world.board, &program.periods, STEPS, random);
    let (t_sw, set) = (world.board.t_sw(), &world.instruments);
    let recorded = program.lead..program.periods.len();
    let instants: Vec<f64> = recorded.clone().map(|k| (k as f64 + set.phase) * t_sw).collect();
    let mut table = Table {
        t: (0..recorded.len()).map(|k| (k as f64 + set.phase) * t_sw).collect(),
        duty: program.periods[recorded.clone()]
            .iter()
            .map(|period| period.duty)
            .collect(),
        load: program.periods[recorded].iter().map(|period| period.load).collect(),
        ..Table::default()
    };
    for (index, channel) in set.channels.iter().enumerate() {
        if channel.recorded {
            table.values[index] = shown(channel, index, &trace, &instants, set.late);
        }
    }
    table
}

fn points(world: &World, program: &Program, random: &mut Rng) -> Table {
    let mut table = Table::default();
    let t_sw = world.board.t_sw();
    let periods = 4;
    for point in &program.periods {
        let trace = run(&world.board, &vec![*point; periods], STEPS, random);
        table.duty.push(point.duty);
        table.load.push(point.load);
        for (index, channel) in world.instruments.channels.iter().enumerate() {
            if channel.recorded {
                let (from, to) = (2.0 * t_sw, periods as f64 * t_sw);
                table.values[index].push(mean(channel, index, &trace, from, to));
            }
        }
    }
    table
}

/// What the instruments write.
pub fn measured(world: &World, exact: &Table, random: &mut Rng) -> Table {
    let mut table = exact.clone();
    for (channel, values) in world.instruments.channels.iter().zip(&mut table.values) {
        digitise(channel, values, random);
    }
    table
}

/// A step regulator of the voltage with a proportional and an integral part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regulator {
    pub kp: f64,
    pub ki: f64,
    pub v_ref: f64,
    pub limits: (f64, f64),
}

/// Duties that a regulator makes of what the instruments show, one period late.
pub fn regulated(world: &World, loads: &[Load], first: f64, law: Regulator, random: &mut Rng) -> Vec<f64> {
    let channel = world.instruments.channels[0].clone();
    let mut sum = first;
    let law = |_: usize, nodes: &Nodes| {
        let mut shown = [channel.gain * nodes.v_out + channel.offset];
        digitise(&channel, &mut shown, random);
        let error = law.v_ref - shown[0];
        sum = (sum + law.ki * error).clamp(law.limits.0, law.limits.1);
        // a controller computes with few digits and a modulator has steps
        let duty = (sum + law.kp * error).clamp(law.limits.0, law.limits.1);
        libm::round(duty * 1e5) / 1e5
    };
    crate::independent::simulate::closed(&world.board, loads, first, world.instruments.phase, law)
}
