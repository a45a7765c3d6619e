//! A bench of its own for causes that the other one lacks: resistors that are not what is printed on them, late edges, an input filter, a
//! core that saturates at once, a coarse modulator. Kirchhoff's equations by Runge and Kutta's method from edge to edge.

use std::fmt::Write as _;
use std::path::Path;

use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Carrier, Parameters, Topology};

/// Longest step of the integration, periods.
const STEP: f64 = 1.0 / 60.0;
/// Periods before the first row: what is left of the start is far below the noise.
const LEAD: usize = 500;

/// Uniform numbers by Marsaglia's xorshift; twelve make a normal one.
#[derive(Debug, Clone)]
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        (0..8).for_each(|_| {
            dice.uniform();
        });
        dice
    }

    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Evenly in its logarithm.
    pub fn around(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.uniform())
    }

    pub fn sign(&mut self) -> f64 {
        if self.uniform() < 0.5 { -1.0 } else { 1.0 }
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.uniform() * count as f64) as usize).min(count - 1)
    }

    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform() - 0.5).sum()
    }
}

/// An inductance that is whole up to a current and a share of itself from another on.
#[derive(Debug, Clone, Copy)]
pub struct Knee {
    pub at: f64,
    pub width: f64,
    pub left: f64,
}

/// What lies between an ideal source and the switch.
#[derive(Debug, Clone, Copy)]
pub struct InputFilter {
    pub r: f64,
    pub l: f64,
    pub c: f64,
    pub esr: f64,
}

#[derive(Debug, Clone)]
pub struct Lab {
    pub boost: bool,
    pub v_in: f64,
    pub l: f64,
    pub c: f64,
    pub f_sw: f64,
    pub dcr: f64,
    pub esr: f64,
    pub r_on: f64,
    pub v_f: f64,
    pub r_d: f64,
    /// How late the switch turns on and off, s.
    pub late_on: f64,
    pub late_off: f64,
    /// Charge that the current has to move before the node falls, C: turns off later the smaller the current.
    pub node_charge: f64,
    pub knee: Option<Knee>,
    pub filter: Option<InputFilter>,
    /// Counts of the modulator in a period; 0 for one that does not round.
    pub counts: f64,
    /// It cuts off what is no whole count.
    pub floors: bool,
    pub rows: usize,
    /// Duty from rows on.
    pub duty: Vec<(usize, f64)>,
    /// From instants on, periods: what is printed on the resistor, and its conductance.
    pub load: Vec<(f64, f64, f64)>,
}

/// Standard deviations and steps of `v_out`, `i_l`, `i_out`, `v_in`.
#[derive(Debug, Clone, Copy)]
pub struct Meters(pub [(f64, f64); 4]);

type State = [f64; 4];

impl Lab {
    /// The plant file of a bench whose further effects nobody knows of.
    pub fn model(&self) -> Parameters {
        let mut p = Parameters::ideal(self.v_in, self.l, self.c, self.f_sw);
        if self.boost {
            p.converter.topology = Topology::Boost;
        }
        (p.pwm.sampling_phase, p.pwm.carrier) = (0.5, Carrier::Centre);
        (p.inductor.dcr, p.capacitor.esr) = (self.dcr, self.esr);
        (p.switch.r_ds_on, p.switch.v_f, p.switch.r_d) = (self.r_on, self.v_f, self.r_d);
        p
    }

    fn duty_at(&self, row: usize) -> f64 {
        let mut from = self.duty.iter().rev();
        from.find(|(from, _)| *from <= row).map_or(0.5, |one| one.1)
    }

    fn load_at(&self, periods: f64) -> (f64, f64) {
        let mut from = self.load.iter().rev();
        let one = from.find(|(at, ..)| *at <= periods + 1e-9).unwrap_or(&self.load[0]);
        (one.1, one.2)
    }

    /// Output voltage.
    fn output(&self, x: &State, on: bool, g: f64) -> f64 {
        let into = if self.boost && on { 0.0 } else { x[0] };
        (x[1] + self.esr * into) / (1.0 + self.esr * g)
    }

    /// Voltage before the switch.
    fn bus(&self, x: &State, on: bool) -> f64 {
        let taken = if self.boost || on { x[0] } else { 0.0 };
        match self.filter {
            Some(f) if f.c > 0.0 => x[3] + f.esr * (x[2] - taken),
            Some(f) => self.v_in - f.r * taken,
            None => self.v_in,
        }
    }

    fn inductance(&self, i: f64) -> f64 {
        let share = self.knee.map_or(1.0, |k| {
            let along = ((i.abs() - k.at) / (k.width * k.at)).clamp(0.0, 1.0);
            1.0 - (1.0 - k.left) * along
        });
        self.l * share
    }

    fn slope(&self, x: &State, on: bool, g: f64) -> State {
        let (v, bus, i) = (self.output(x, on, g), self.bus(x, on), x[0]);
        let across = match (self.boost, on) {
            (false, true) => bus - self.r_on * i - v,
            (false, false) => -self.v_f - self.r_d * i - v,
            (true, true) => bus - self.r_on * i,
            (true, false) => bus - self.v_f - self.r_d * i - v,
        };
        let rise = (across - self.dcr * i) / self.inductance(i);
        let rise = if i <= 0.0 { rise.max(0.0) } else { rise };
        let into = if self.boost && on { 0.0 } else { i };
        let taken = if self.boost || on { i } else { 0.0 };
        let (source, held) = match self.filter {
            Some(f) if f.c > 0.0 => ((self.v_in - f.r * x[2] - bus) / f.l, (x[2] - taken) / f.c),
            _ => (0.0, 0.0),
        };
        [rise, (into - v * g) / self.c, source, held]
    }

    fn step(&self, x: &State, on: bool, g: f64, h: f64) -> State {
        let moved = |k: &State, h: f64| std::array::from_fn(|n| x[n] + h * k[n]);
        let a = self.slope(x, on, g);
        let b = self.slope(&moved(&a, 0.5 * h), on, g);
        let c = self.slope(&moved(&b, 0.5 * h), on, g);
        let d = self.slope(&moved(&c, h), on, g);
        std::array::from_fn(|n| x[n] + h / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]))
    }

    fn advance(&self, x: &mut State, on: bool, g: f64, periods: f64) {
        let count = (periods / STEP).ceil().max(1.0);
        let h = periods / count / self.f_sw;
        for _ in 0..count as usize {
            let next = self.step(x, on, g, h);
            *x = match next[0] < 0.0 {
                // the diode ends the current inside of the step, and not at its end
                true => {
                    let share = x[0] / (x[0] - next[0]);
                    let mut end = self.step(x, on, g, share * h);
                    end[0] = 0.0;
                    let mut rest = self.step(&end, on, g, (1.0 - share) * h);
                    rest[0] = rest[0].max(0.0);
                    rest
                }
                false => next,
            };
        }
    }

    /// About the current at which the switch turns off, A.
    fn peak(&self, x: &State, duty: f64) -> f64 {
        let across = if self.boost { self.v_in } else { self.v_in - x[1] };
        (x[0] + 0.5 * duty * across / (self.l * self.f_sw)).max(1e-3)
    }

    /// A table as a logger writes it, of the columns that are asked for beside `t` and `duty`.
    pub fn table(&self, columns: &[&str], meters: &Meters, dice: &mut Dice) -> String {
        let d = self.duty_at(0);
        let v = if self.boost {
            self.v_in / (1.0 - d)
        } else {
            self.v_in * d
        };
        let out = v * self.load_at(0.0).1;
        let i = if self.boost { out / (1.0 - d) } else { out };
        let taken = if self.boost { i } else { d * i };
        let mut x: State = [i, v, taken, self.v_in];
        let mut text = "t,duty".to_owned();
        columns.iter().for_each(|name| {
            let _ = write!(text, ",{name}");
        });
        text.push('\n');
        for n in 0..LEAD + self.rows {
            let row = n as f64 - LEAD as f64;
            let said = self.duty_at(n.saturating_sub(LEAD));
            let duty = match self.counts > 0.0 {
                true => (said * self.counts + if self.floors { 1e-9 } else { 0.5 }).floor() / self.counts,
                false => said,
            };
            let later = self.late_off + self.node_charge / self.peak(&x, duty);
            let rise = 0.5 * (1.0 - duty) + self.late_on * self.f_sw;
            let fall = 0.5 * (1.0 + duty) + (later * self.f_sw).min(0.2);
            let mut marks = vec![0.0, rise, fall, 0.5, 1.0];
            let steps = self.load.iter().map(|(at, ..)| at - row);
            marks.extend(steps.filter(|at| (0.0..1.0).contains(at)));
            marks.sort_by(f64::total_cmp);
            for pair in marks.windows(2) {
                let middle = 0.5 * (pair[0] + pair[1]);
                let on = (rise..fall).contains(&middle);
                let (printed, g) = self.load_at(row + middle);
                if n >= LEAD && pair[0] == 0.5 {
                    let v = self.output(&x, on, g);
                    let shown = [v, x[0], v * g, self.bus(&x, on)];
                    let _ = write!(text, "{:.9},{:.5}", (row + 0.5) / self.f_sw, said);
                    for name in columns {
                        let place = ["v_out", "i_l", "i_out", "v_in"].iter().position(|known| known == name);
                        let value = place.map_or(printed, |place| {
                            let (sd, lsb) = meters.0[place];
                            ((shown[place] + sd * dice.normal()) / lsb).round() * lsb
                        });
                        let _ = write!(text, ",{value:.5}");
                    }
                    text.push('\n');
                }
                if pair[1] > pair[0] {
                    self.advance(&mut x, on, g, pair[1] - pair[0]);
                }
            }
        }
        text
    }

    pub fn record(&self, name: &str, columns: &[&str], model: &Parameters, meters: &Meters, dice: &mut Dice) -> Record {
        let text = self.table(columns, meters, dice);
        let file = format!("{name}.csv");
        let sheet = Sheet::parse(Path::new(&file), text.into(), &Record::file_options()).unwrap();
        Record::read(&sheet, &ColumnMap::default(), model).unwrap()
    }
}

/// A converter drawn at random, healthy, at rest with one resistor.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub lab: Lab,
    pub model: Parameters,
    pub meters: Meters,
    pub dice: Dice,
    pub duty: f64,
    /// Of the load at rest.
    pub g: f64,
    pub i_l: f64,
    pub v_out: f64,
}

/// Rows of each record.
pub const ROWS: usize = 280;

pub fn drawn(seed: u64) -> Drawn {
    let mut dice = Dice::new(seed);
    let boost = dice.uniform() < 0.3;
    let (v_in, f_sw) = (dice.around(12.0, 400.0), dice.around(20e3, 200e3));
    let (duty, i_out) = (dice.between(0.35, 0.6), dice.around(1.0, 20.0));
    let v_out = if boost { v_in / (1.0 - duty) } else { v_in * duty };
    let i_l = if boost { i_out / (1.0 - duty) } else { i_out };
    let on = if boost { v_in } else { v_in - v_out };
    let l = on * duty / f_sw / (dice.between(0.2, 0.4) * i_l);
    let swing = f_sw / dice.between(15.0, 28.0) * std::f64::consts::TAU;
    let seen = if boost { l / (1.0 - duty).powi(2) } else { l };
    let c = 1.0 / (swing * swing * seen);
    let r = v_in / i_l * if boost { 1.0 } else { duty };
    let lab = Lab {
        boost,
        v_in,
        l,
        c,
        f_sw,
        dcr: r * dice.between(0.003, 0.012),
        esr: dice.between(0.1, 0.6) / (8.0 * c * f_sw),
        r_on: r * dice.between(0.002, 0.01),
        v_f: (0.012 * v_out).clamp(0.3, 0.9),
        r_d: r * dice.between(0.001, 0.006),
        late_on: 0.0,
        late_off: 0.0,
        node_charge: 0.0,
        knee: None,
        filter: None,
        counts: 0.0,
        floors: false,
        rows: ROWS,
        duty: vec![(0, duty)],
        load: vec![(0.0, v_out / i_out, i_out / v_out)],
    };
    let of = |full: f64| {
        let lsb = full / 4096.0;
        (1.2 * lsb, lsb)
    };
    let meters = Meters([of(1.5 * v_out), of(2.2 * i_l), of(2.2 * i_out), of(1.3 * v_in)]);
    let model = lab.model();
    Drawn {
        lab,
        model,
        meters,
        dice,
        duty,
        g: i_out / v_out,
        i_l,
        v_out,
    }
}

/// Resistors of a load box as they are printed, in conductance, and by how much each is off.
#[derive(Debug, Clone, Copy)]
pub struct Resistors {
    pub g: [f64; 3],
    pub off: [f64; 3],
}

impl Drawn {
    /// Three resistors, chosen one at a time.
    pub fn resistors(&mut self) -> Resistors {
        let g = [1.0, self.dice.between(1.4, 1.8), self.dice.between(0.6, 0.75)].map(|share| share * self.g);
        Resistors { g, off: [0.0; 3] }
    }

    /// Steps of the duty, steps of the load, and both to be held out.
    pub fn labs(&mut self, resistors: &Resistors) -> [Lab; 3] {
        let d = self.duty;
        let level = |at: f64, n: usize| (at, 1.0 / resistors.g[n], resistors.g[n] * (1.0 + resistors.off[n]));
        let mut moved = |by: f64| {
            // a modulator with five digits, so that the table says what was commanded
            ((d + by * self.dice.between(0.6, 1.0)) * 1e5).round() * 1e-5
        };
        let duties = vec![
            (0, moved(0.0)),
            (40, moved(0.05)),
            (95, moved(-0.05)),
            (140, moved(0.03)),
            (175, moved(-0.02)),
            (225, moved(0.06)),
        ];
        let held = vec![(0, moved(-0.02)), (130, moved(0.045))];
        let lab = |duty: Vec<(usize, f64)>, load: Vec<(f64, f64, f64)>| Lab {
            duty,
            load,
            ..self.lab.clone()
        };
        [
            lab(duties, vec![level(0.0, 0)]),
            lab(
                vec![(0, moved_back(d))],
                vec![
                    level(0.0, 0),
                    level(60.0, 1),
                    level(125.0, 2),
                    level(190.0, 1),
                    level(235.0, 0),
                ],
            ),
            lab(held, vec![level(0.0, 2), level(70.0, 1), level(200.0, 0)]),
        ]
    }

    pub fn records(&mut self, labs: &[Lab; 3], columns: &[&str]) -> [Record; 3] {
        ["duty", "load", "held"].map(|name| {
            let place = ["duty", "load", "held"]
                .iter()
                .position(|known| *known == name)
                .unwrap();
            labs[place].record(name, columns, &self.model, &self.meters, &mut self.dice)
        })
    }
}

fn moved_back(d: f64) -> f64 {
    (d * 1e5).round() * 1e-5
}
