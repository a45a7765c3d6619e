//! Many plain converters side by side: structure of arrays, so that the compiler works on several at once.
//!
//! ```text
//! duties, loads ─► group of eight ─┬─► lanes that are regular ─┬─► states, signals ─► sensors
//!                                  └─► others: plants alone  ──┘
//! ```
//!
//! Invariant: what [`Plant::step`] computes, to the bit, without extremes.

pub(crate) mod commands;
mod plain;
mod sensors;

use toml_input::{Fault, Faults, Message};

use crate::effects::load_setting;
use crate::entry::Way;
use crate::full::lanes;
use crate::gates::Gates;
use crate::lane::{LANES, Lane, Mask};
use crate::parameters::Parameters;
use crate::plant::Plant;
use crate::sensing::array;
use crate::signals::{Load, Sample, Signals};

/// Converters of two states whose edges are those of a pulse at the period's start: without any effect that needs more than [`Way::Batch`],
/// or with an ESR or ESL, losses of the core, a resistance of the source, and a dead time beside one of these. They may differ in every
/// number; eight in a row are computed together if they are all of the first or all of the second kind.
#[derive(Debug, Clone)]
pub struct Batch {
    plants: Vec<Plant>,
    groups: Vec<Group>,
    /// What changes of the circuits, one array for each number.
    now: Now,
    /// What sensors show that do not show what is true: output voltage, inductor current, load current, input voltage.
    measured: [Vec<f64>; 4],
    /// Those of the groups.
    sensors: Vec<Option<sensors::Sensors>>,
}

/// States and signals at the sampling instant.
#[derive(Debug, Clone)]
struct Now {
    i_l: Vec<f64>,
    v_out: Vec<f64>,
    /// Of the second kind only; those of the first follow from the two above.
    i_out: Vec<f64>,
    v_in: Vec<f64>,
    /// States of the second kind: current of the inductance, voltage of the capacitance.
    x: [Vec<f64>; 2],
    /// 1 where the gates owe nothing to the next period.
    clear: Vec<u64>,
    /// 1 where the load changes within the period.
    changes: Vec<u64>,
}

/// Eight converters in a row.
#[derive(Debug, Clone)]
enum Group {
    Plain(Box<plain::Group>),
    Few(Box<lanes::Group>),
    /// Of both kinds.
    Alone,
}

impl Group {
    fn new(plants: &[Plant]) -> Self {
        match plants.iter().filter(|plant| is_plain(plant)).count() {
            LANES => Group::Plain(Box::new(plain::Group::new(plants))),
            0 => Group::Few(Box::new(lanes::Group::new(plants))),
            _ => Group::Alone,
        }
    }
}

fn is_plain(plant: &Plant) -> bool {
    plant.way <= Way::Batch
}

impl Batch {
    /// One converter for each element of `parameters`, at rest.
    ///
    /// # Errors
    /// Faults of the parameters; a converter that a batch cannot hold.
    pub fn new(parameters: &[Parameters]) -> Result<Self, Faults> {
        let plants = parameters.iter().map(Plant::new).collect::<Result<Vec<_>, _>>()?;
        for (index, plant) in plants.iter().enumerate() {
            fits(index, plant)?;
        }
        let count = plants.len();
        let zeros = || vec![0.0; count];
        let mut batch = Batch {
            // what does not fill a group is stepped one by one, so the constants of a partial group are never needed
            groups: plants.chunks_exact(LANES).map(Group::new).collect(),
            now: Now {
                i_l: zeros(),
                v_out: zeros(),
                i_out: zeros(),
                v_in: zeros(),
                x: [zeros(), zeros()],
                clear: vec![1; count],
                changes: vec![0; count],
            },
            measured: std::array::from_fn(|_| zeros()),
            sensors: plants.chunks_exact(LANES).map(sensors::Sensors::new).collect(),
            plants,
        };
        for index in 0..count {
            let sample = batch.plants[index].sample();
            batch.take(index, &sample);
        }
        Ok(batch)
    }

    /// Number of converters.
    #[must_use]
    pub fn len(&self) -> usize {
        self.plants.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.plants.is_empty()
    }

    /// Output voltages at the sampling instant, V.
    #[must_use]
    pub fn v_out(&self) -> &[f64] {
        &self.now.v_out
    }

    /// Inductor currents at the sampling instant, A.
    #[must_use]
    pub fn i_l(&self) -> &[f64] {
        &self.now.i_l
    }

    /// Puts one converter to `v_out` V and `i_l` A under `load`.
    pub fn reset_at(&mut self, index: usize, v_out: f64, i_l: f64, load: &Load) {
        let plant = &mut self.plants[index];
        if is_plain(plant) && plant.sensing.ideal {
            (self.now.v_out[index], self.now.i_l[index]) = (v_out, i_l);
            return;
        }
        let sample = plant.reset_at(v_out, i_l, load);
        self.take(index, &sample);
    }

    /// One control period of every converter; `duties` and `loads` have one element each.
    pub fn step(&mut self, duties: &[f64], loads: &[Load]) {
        self.step_with_changes(duties, loads, &[]);
    }

    /// One control period of every converter; of each of `changes` the load gives way to another at a fraction of the period:
    /// [`Plant::step_with_change`].
    pub fn step_with_changes(&mut self, duties: &[f64], loads: &[Load], changes: &[(usize, f64, Load)]) {
        for (index, ..) in changes {
            self.now.changes[*index] = 1;
        }
        wide::widest(Period {
            batch: self,
            duties,
            loads,
        });
        for index in self.len() - self.len() % LANES..self.len() {
            self.step_one(index, duties[index], &loads[index]);
        }
        for (index, at, after) in changes {
            self.now.changes[*index] = 0;
            let plant = self.put_back(*index);
            let sample = plant.step_with_change(duties[*index], &loads[*index], after, *at);
            self.take(*index, &sample);
        }
    }

    /// Signals of one converter at the sampling instant under `load`, which is that of the end of its latest period.
    #[must_use]
    #[inline]
    pub fn signals(&self, index: usize, load: &Load) -> Signals {
        let (plant, now) = (&self.plants[index], &self.now);
        let (v_out, i_l) = (now.v_out[index], now.i_l[index]);
        if !is_plain(plant) {
            return Signals {
                v_out,
                i_l,
                i_out: now.i_out[index],
                v_in: now.v_in[index],
            };
        }
        let drawn = load_setting::drawn(&plant.parameters.load, load);
        Signals {
            v_out,
            i_l,
            i_out: plant.plain.load_current(&drawn, v_out),
            v_in: plant.parameters.converter.v_in,
        }
    }

    /// What the sensors of one converter showed at the sampling instant; `load` as for [`Batch::signals`].
    #[must_use]
    #[inline]
    pub fn measured(&self, index: usize, load: &Load) -> Signals {
        if self.plants[index].sensing.ideal {
            return self.signals(index, load);
        }
        let [v_out, i_l, i_out, v_in] = [0, 1, 2, 3].map(|at: usize| self.measured[at][index]);
        Signals {
            v_out,
            i_l,
            i_out,
            v_in,
        }
    }

    /// Puts another converter into the place of one, at rest.
    ///
    /// # Errors
    /// As [`Batch::new`].
    pub fn replace(&mut self, index: usize, parameters: &Parameters) -> Result<(), Faults> {
        let plant = Plant::new(parameters)?;
        fits(index, &plant)?;
        let sample = plant.sample();
        self.plants[index] = plant;
        self.take(index, &sample);
        let first = index - index % LANES;
        if let (Some(group), Some(plants)) = (
            self.groups.get_mut(index / LANES),
            self.plants.get(first..first + LANES),
        ) {
            *group = Group::new(plants);
            self.sensors[index / LANES] = sensors::Sensors::new(plants);
        }
        Ok(())
    }

    // apart: of the way alone no lane gains anything
    #[inline(never)]
    fn step_one(&mut self, index: usize, duty: f64, load: &Load) {
        if self.now.changes[index] == 1 {
            return;
        }
        let sample = self.put_back(index).step(duty, load);
        self.take(index, &sample);
    }

    /// The plant alone, where the lanes have left it.
    fn put_back(&mut self, index: usize) -> &mut Plant {
        let (plant, now) = (&mut self.plants[index], &self.now);
        if is_plain(plant) {
            // what it remembers of its gates belongs to an earlier period
            plant.state.gates = Gates::default();
            (plant.state.x[0], plant.state.x[1]) = (now.i_l[index], now.v_out[index]);
        } else {
            (plant.state.x[0], plant.state.x[1]) = (now.x[0][index], now.x[1][index]);
        }
        plant
    }

    /// Takes in what a plant alone has come to.
    fn take(&mut self, index: usize, sample: &Sample) {
        let (plant, now) = (&self.plants[index], &mut self.now);
        (now.i_l[index], now.v_out[index]) = (sample.i_l, sample.v_out);
        (now.i_out[index], now.v_in[index]) = (sample.i_out, sample.v_in);
        (now.x[0][index], now.x[1][index]) = (plant.state.x[0], plant.state.x[1]);
        now.clear[index] = u64::from(plant.state.gates.owe_nothing());
        for (array, shown) in self.measured.iter_mut().zip(array(&sample.measured)) {
            array[index] = shown;
        }
    }

    #[inline(always)]
    fn step_lanes(&mut self, first: usize, duties: &[f64], loads: &[Load]) {
        let (of_duties, of_loads) = (&duties[first..first + LANES], &loads[first..first + LANES]);
        let now = &mut self.now;
        // a lane that is not regular may hold nonsense; the arrays still have the start of the period
        let (regular, signals) = match &self.groups[first / LANES] {
            Group::Plain(group) => {
                let lanes = plain::Lanes::run(group, [at(&now.i_l, first), at(&now.v_out, first)], of_duties, of_loads);
                let regular = without(lanes.regular, &now.changes, first);
                put(&mut now.i_l, first, &lanes.i, &regular);
                put(&mut now.v_out, first, &lanes.v, &regular);
                // what nobody asks for is not computed
                let signals = match self.sensors[first / LANES] {
                    Some(_) => group.signals(&lanes),
                    None => [lanes.v; 4],
                };
                (regular, signals)
            }
            Group::Few(group) => {
                let x = [at(&now.x[0], first), at(&now.x[1], first)];
                let clear = std::array::from_fn(|n| now.clear[first + n]);
                let (lanes, signals) = lanes::Lanes::run(group, x, clear, of_duties, of_loads);
                let regular = without(lanes.regular, &now.changes, first);
                put(&mut now.x[0], first, &lanes.x[0], &regular);
                put(&mut now.x[1], first, &lanes.x[1], &regular);
                let seen = [&mut now.v_out, &mut now.i_l, &mut now.i_out, &mut now.v_in];
                for (array, signal) in seen.into_iter().zip(&signals) {
                    put(array, first, signal, &regular);
                }
                (regular, signals)
            }
            Group::Alone => ([0; LANES], [Lane([0.0; LANES]); 4]),
        };
        if let Some(sensors) = &self.sensors[first / LANES] {
            let shown = sensors.show(&mut self.plants[first..first + LANES], signals, &regular);
            for (array, shown) in self.measured.iter_mut().zip(&shown) {
                put(array, first, shown, &regular);
            }
        }
        if regular.iter().fold(1, |all, lane| all & lane) == 1 {
            return;
        }
        for n in 0..LANES {
            if regular[n] == 0 {
                self.step_one(first + n, of_duties[n], &of_loads[n]);
            }
        }
    }
}

#[inline(always)]
fn at(array: &[f64], first: usize) -> Lane {
    Lane::each(|n| array[first + n])
}

/// Writes the regular lanes.
#[inline(always)]
fn put(array: &mut [f64], first: usize, lane: &Lane, regular: &Mask) {
    let array = &mut array[first..first + LANES];
    for n in 0..LANES {
        array[n] = if regular[n] == 1 { lane.0[n] } else { array[n] };
    }
}

#[inline(always)]
fn without(regular: Mask, changes: &[u64], first: usize) -> Mask {
    let changes = &changes[first..first + LANES];
    std::array::from_fn(|n| regular[n] & (1 - changes[n]))
}

/// A control period of the converters that fill groups.
struct Period<'a> {
    batch: &'a mut Batch,
    duties: &'a [f64],
    loads: &'a [Load],
}

impl wide::Work for Period<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for first in (0..self.batch.groups.len()).map(|group| group * LANES) {
            self.batch.step_lanes(first, self.duties, self.loads);
        }
    }
}

fn fits(index: usize, plant: &Plant) -> Result<(), Faults> {
    if is_plain(plant) || lanes::hold(plant) {
        return Ok(());
    }
    let message = Message::new(format!("converter {index} does not fit into a batch"))
        .expected(
            "resistances, diode voltage, ESR, ESL and a dead time beside them, load, duty quantisation, sensors without lag; trailing \
             carrier, sampled at 0",
        )
        .hint("step it as a `Plant`");
    Err(Fault::from(message).into())
}
