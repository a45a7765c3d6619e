//! What is done at the bench: records of duties and set loads, drawn at random in the form of real identification
//! experiments. All are stable: constant power alone only under control.

use crate::rng::Rng;

/// A set load: resistor, current sink and constant power side by side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// S
    pub conductance: f64,
    /// A
    pub current: f64,
    /// W
    pub power: f64,
}

/// One record, a duty and a load for each switching period. A change comes at the start of its period.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// File name without ending.
    pub name: &'static str,
    /// Not used for the fit.
    pub heldout: bool,
    /// Commanded duty of each period.
    pub duty: Vec<f64>,
    /// Set load of each period.
    pub load: Vec<Load>,
    /// Under control: the duties come out of the run, and rows are samples at the start of the period.
    pub closed: bool,
    /// Periods run before the first recorded one, so that a record starts neither at rest nor at a round value.
    pub lead: usize,
}

impl Record {
    fn new(name: &'static str, heldout: bool, rng: &mut Rng) -> Self {
        Self {
            name,
            heldout,
            duty: Vec::new(),
            load: Vec::new(),
            closed: false,
            lead: 30 + rng.below(30),
        }
    }

    fn push(&mut self, periods: usize, duty: f64, load: Load) {
        self.duty.extend(std::iter::repeat_n(duty, periods));
        self.load.extend(std::iter::repeat_n(load, periods));
    }
}

/// How much is recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// Four records for training of 25 ms, three held out.
    Full,
    /// Two records for training of 15 ms, one held out: for tests that have to be fast.
    Short,
}

/// The records of a case.
#[must_use]
pub fn draw(extent: Extent, rng: &mut Rng) -> Vec<Record> {
    match extent {
        Extent::Full => vec![
            duty_steps(rng, "dstep_R_10k", false, 50),
            prbs(rng, 250),
            cpl(rng, "cpl_open_10k", false, 50),
            load_steps(rng, "lstep_R_10k", false, 50),
            current_steps(rng, 50),
            cpl(rng, "mixed_10k", true, 40),
            closed(rng, 60),
        ],
        Extent::Short => vec![
            duty_steps(rng, "dstep_R_10k", false, 30),
            cpl(rng, "cpl_open_10k", false, 30),
            current_steps(rng, 30),
        ],
    }
}

fn resistor(rng: &mut Rng, low: f64, high: f64) -> f64 {
    1.0 / rng.uniform(low, high).round()
}

fn level(rng: &mut Rng, low: f64, high: f64) -> f64 {
    (rng.uniform(low, high) * 1000.0).round() / 1000.0
}

fn duty_steps(rng: &mut Rng, name: &'static str, heldout: bool, hold: usize) -> Record {
    let mut record = Record::new(name, heldout, rng);
    let load = Load {
        conductance: resistor(rng, 14.0, 24.0),
        ..Load::default()
    };
    for (low, high) in [(0.49, 0.51), (0.54, 0.58), (0.43, 0.46), (0.50, 0.54), (0.46, 0.49)] {
        record.push(hold, level(rng, low, high), load);
    }
    record
}

fn prbs(rng: &mut Rng, periods: usize) -> Record {
    let mut record = Record::new("prbs_R_10k", false, rng);
    let (centre, swing) = (level(rng, 0.47, 0.53), level(rng, 0.006, 0.014));
    let load = Load {
        conductance: resistor(rng, 18.0, 26.0),
        ..Load::default()
    };
    let mut up = true;
    while record.duty.len() < periods {
        let hold = (3 + rng.below(18)).min(periods - record.duty.len());
        record.push(hold, if up { centre + swing } else { centre - swing }, load);
        up = !up;
    }
    record
}

/// Constant power beside a resistor, at several voltages.
fn cpl(rng: &mut Rng, name: &'static str, heldout: bool, hold: usize) -> Record {
    let mut record = Record::new(name, heldout, rng);
    let conductance = resistor(rng, 17.0, 21.0);
    let mut duty = level(rng, 0.49, 0.51);
    let watts = [0.0, 150.0, 300.0, 200.0, 250.0];
    for (part, centre) in watts.into_iter().enumerate() {
        let power = match part {
            0 => 0.0,
            _ => (centre + rng.uniform(-40.0, 40.0)).round(),
        };
        if part >= 2 {
            duty = level(rng, 0.44, 0.56);
        }
        let load = Load {
            conductance,
            power,
            ..Load::default()
        };
        record.push(hold, duty, load);
    }
    record
}

fn load_steps(rng: &mut Rng, name: &'static str, heldout: bool, hold: usize) -> Record {
    let mut record = Record::new(name, heldout, rng);
    let duty = level(rng, 0.48, 0.52);
    for (low, high) in [(28.0, 36.0), (12.0, 15.0), (18.0, 24.0), (10.0, 12.0), (24.0, 30.0)] {
        let load = Load {
            conductance: resistor(rng, low, high),
            ..Load::default()
        };
        record.push(hold, duty, load);
    }
    record
}

fn current_steps(rng: &mut Rng, hold: usize) -> Record {
    let mut record = Record::new("lstep_I_10k", true, rng);
    let duty = level(rng, 0.48, 0.52);
    let conductance = resistor(rng, 30.0, 42.0);
    for centre in [0.0, 3.0, 6.0, 2.0, 4.0] {
        let current = match centre > 0.0 {
            true => level(rng, centre - 0.8, centre + 0.8),
            false => 0.0,
        };
        let load = Load {
            conductance,
            current,
            ..Load::default()
        };
        record.push(hold, duty, load);
    }
    record
}

/// Steps of constant power alone, held at 100 V by a controller.
fn closed(rng: &mut Rng, hold: usize) -> Record {
    let mut record = Record::new("closed_10k", true, rng);
    record.closed = true;
    for centre in [200.0, 500.0, 800.0, 350.0] {
        let load = Load {
            power: (centre + rng.uniform(-100.0_f64, 150.0)).round(),
            ..Load::default()
        };
        record.push(hold, 0.5, load);
    }
    record
}
