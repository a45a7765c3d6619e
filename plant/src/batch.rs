//! Many plain converters side by side: structure of arrays, so that the compiler works on several at once.

use std::ops::{Add, Mul, Neg, Sub};

use toml_input::{Fault, Faults, Message};

use crate::effects::{duty_offset, duty_quantisation, load_setting, minimum_on_time};
use crate::entry::Way;
use crate::parameters::{Parameters, Pwm};
use crate::plain::{All, Give, LARGEST_CHANGE, LONGEST_STEP, Number, ORDER, Part, TERM_BEFORE, series, sum};
use crate::plant::Plant;
use crate::signals::{Load, Signals};

/// Converters computed together in the lanes of the vector unit.
// a convention from before it was measured: on x86-64 with SSE2, 1024 converters make 17.9 M periods a second with 2
// lanes, 22.2 with 4, 16.6 with 8, 15.3 with 16, and 7.7 one by one
const LANES: usize = 8;

/// Converters without any effect that needs more than two states: what [`Plant::step`] computes, to the bit, without
/// extremes and sensors. They may differ in every number, not in the rectifier.
#[derive(Debug, Clone)]
pub struct Batch {
    plants: Vec<Plant>,
    groups: Vec<Group>,
    i_l: Vec<f64>,
    v_out: Vec<f64>,
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
        // what does not fill a group is stepped one by one, so the constants of a partial group are never needed
        let groups = plants.chunks_exact(LANES).map(Group::new).collect();
        Ok(Batch {
            plants,
            groups,
            i_l: vec![0.0; count],
            v_out: vec![0.0; count],
        })
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
        &self.v_out
    }

    /// Inductor currents at the sampling instant, A.
    #[must_use]
    pub fn i_l(&self) -> &[f64] {
        &self.i_l
    }

    /// Puts one converter to `v_out` V and `i_l` A.
    pub fn reset_at(&mut self, index: usize, v_out: f64, i_l: f64) {
        (self.v_out[index], self.i_l[index]) = (v_out, i_l);
    }

    /// One control period of every converter; `duties` and `loads` have one element each.
    pub fn step(&mut self, duties: &[f64], loads: &[Load]) {
        wide::widest(Period {
            batch: self,
            duties,
            loads,
        });
        for index in self.len() - self.len() % LANES..self.len() {
            self.step_one(index, duties[index], &loads[index]);
        }
    }

    /// Signals of one converter at the sampling instant under `load`; its sensors show them as they are.
    #[must_use]
    #[inline]
    pub fn signals(&self, index: usize, load: &Load) -> Signals {
        let plant = &self.plants[index];
        let drawn = load_setting::drawn(&plant.parameters.load, load);
        Signals {
            v_out: self.v_out[index],
            i_l: self.i_l[index],
            i_out: plant.plain.load_current(&drawn, self.v_out[index]),
            v_in: plant.parameters.converter.v_in,
        }
    }

    /// Puts another converter into the place of one; it keeps its voltage and current.
    ///
    /// # Errors
    /// As [`Batch::new`].
    pub fn replace(&mut self, index: usize, parameters: &Parameters) -> Result<(), Faults> {
        let plant = Plant::new(parameters)?;
        fits(index, &plant)?;
        self.plants[index] = plant;
        let first = index - index % LANES;
        if let (Some(group), Some(plants)) = (
            self.groups.get_mut(index / LANES),
            self.plants.get(first..first + LANES),
        ) {
            *group = Group::new(plants);
        }
        Ok(())
    }

    /// One control period of one converter alone, in which the load changes: [`Plant::step_with_change`].
    pub fn step_with_change(&mut self, index: usize, duty: f64, [before, after]: [&Load; 2], at: f64) {
        let plant = &mut self.plants[index];
        // at rest in this state: what a plant remembers beyond it belongs to an earlier period of the same converter
        plant.reset_at(self.v_out[index], self.i_l[index], before);
        let sample = plant.step_with_change(duty, before, after, at);
        (self.i_l[index], self.v_out[index]) = (sample.i_l, sample.v_out);
    }

    // apart: of the way alone no lane gains anything
    #[inline(never)]
    fn step_one(&mut self, index: usize, duty: f64, load: &Load) {
        let plant = &mut self.plants[index];
        (plant.state.x[0], plant.state.x[1]) = (self.i_l[index], self.v_out[index]);
        let sample = plant.step(duty, load);
        (self.i_l[index], self.v_out[index]) = (sample.i_l, sample.v_out);
    }

    #[inline(always)]
    fn step_lanes(&mut self, first: usize, duties: &[f64], loads: &[Load]) {
        let (duties, loads) = (&duties[first..first + LANES], &loads[first..first + LANES]);
        let group = &self.groups[first / LANES];
        let mut lanes = Lanes::new(group, duties, loads);
        lanes.i.0.copy_from_slice(&self.i_l[first..first + LANES]);
        lanes.v.0.copy_from_slice(&self.v_out[first..first + LANES]);
        let off = group.t_sw - lanes.on;
        // no branch for duties of 0 and 1: an interval of length 0 leaves current and voltage as they are, to the bit
        let no_diode = Lane([0.0; LANES]);
        if group.all {
            lanes.segment(All, group, lanes.on, [group.emf_on, group.r_on], no_diode);
            lanes.segment(All, group, off, [group.emf_off, group.r_off], group.diode);
        } else {
            lanes.segment(
                Part(group.give_on),
                group,
                lanes.on,
                [group.emf_on, group.r_on],
                no_diode,
            );
            lanes.segment(
                Part(group.give_off),
                group,
                off,
                [group.emf_off, group.r_off],
                group.diode,
            );
        }
        // a lane that is not regular may hold nonsense; `i_l` and `v_out` still have the start of the period
        let regular = lanes.regular;
        if regular.iter().fold(1, |all, lane| all & lane) == 1 {
            self.i_l[first..first + LANES].copy_from_slice(&lanes.i.0);
            self.v_out[first..first + LANES].copy_from_slice(&lanes.v.0);
            return;
        }
        for n in 0..LANES {
            if regular[n] == 1 {
                (self.i_l[first + n], self.v_out[first + n]) = (lanes.i.0[n], lanes.v.0[n]);
            } else {
                self.step_one(first + n, duties[n], &loads[n]);
            }
        }
    }
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
    if plant.way <= Way::Batch {
        return Ok(());
    }
    let message = Message::new(format!("converter {index} does not fit into a batch"))
        .expected("resistances, diode voltage, load and duty quantisation only; trailing carrier, sampled at 0")
        .hint("step it as a `Plant`");
    Err(Fault::from(message).into())
}

#[derive(Debug, Clone, Copy)]
struct Lane([f64; LANES]);

impl Number for Lane {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Lane([value; LANES])
    }
}

macro_rules! lane_by_lane {
    ($operation:ident, $function:ident, $symbol:tt) => {
        impl $operation for Lane {
            type Output = Lane;
            #[inline(always)]
            fn $function(mut self, other: Lane) -> Lane {
                for n in 0..LANES {
                    self.0[n] $symbol other.0[n];
                }
                self
            }
        }
    };
}
lane_by_lane!(Add, add, +=);
lane_by_lane!(Sub, sub, -=);
lane_by_lane!(Mul, mul, *=);

impl Neg for Lane {
    type Output = Lane;
    #[inline(always)]
    fn neg(self) -> Lane {
        Lane(self.0.map(|x| -x))
    }
}

/// The constants of `LANES` converters.
#[derive(Debug, Clone)]
struct Group {
    t_sw: Lane,
    inv_l: Lane,
    inv_c: Lane,
    longest: Lane,
    last_term: Lane,
    v_fold: Lane,
    emf_on: Lane,
    r_on: Lane,
    emf_off: Lane,
    r_off: Lane,
    give_on: Lane,
    give_off: Lane,
    /// The output of every lane receives all of the current all the time.
    all: bool,
    /// 1 where a diode ends the current.
    diode: Lane,
    resistor_gain: Lane,
    bleed: Lane,
    setting_gain: Lane,
    pwm: [Pwm; LANES],
    /// The modulator of every lane gives the duty that is commanded.
    exact: bool,
}

impl Group {
    fn new(plants: &[Plant]) -> Self {
        let lane = |of: &dyn Fn(&Plant) -> f64| Lane(std::array::from_fn(|n| of(&plants[n])));
        // the upper diode has no lane: a current that is not positive makes its lane irregular (`flows` below)
        let off = |p: &Plant| {
            if p.legs.synchronous {
                p.legs.second
            } else {
                p.legs.diode
            }
        };
        let (give_on, give_off) = (lane(&|p| p.legs.main.give), lane(&|p| off(p).give));
        Group {
            all: give_on.0.iter().chain(&give_off.0).all(|give| *give == 1.0),
            give_on,
            give_off,
            t_sw: lane(&|p| p.t_sw),
            inv_l: lane(&|p| p.plain.inv_l),
            inv_c: lane(&|p| p.plain.inv_c),
            longest: lane(&|p| p.plain.longest),
            last_term: lane(&|p| p.plain.last_term),
            v_fold: lane(&|p| p.plain.v_fold),
            emf_on: lane(&|p| p.legs.main.emf),
            r_on: lane(&|p| p.legs.main.r),
            emf_off: lane(&|p| off(p).emf),
            r_off: lane(&|p| off(p).r),
            diode: lane(&|p| if p.legs.synchronous { 0.0 } else { 1.0 }),
            resistor_gain: lane(&|p| p.parameters().load.resistor_gain),
            bleed: lane(&|p| p.parameters().load.bleed),
            setting_gain: lane(&|p| p.parameters().load.setting_gain),
            exact: plants.iter().all(|plant| {
                let pwm = &plant.parameters().pwm;
                pwm.duty_offset == 0.0 && pwm.duty_lsb == 0.0 && pwm.min_on_time == 0.0
            }),
            pwm: std::array::from_fn(|n| plants[n].parameters().pwm.clone()),
        }
    }
}

/// One period of `LANES` converters. A lane that needs more than one series a segment is not regular.
struct Lanes {
    i: Lane,
    v: Lane,
    on: Lane,
    conductance: Lane,
    current: Lane,
    power: Lane,
    /// 1 or 0: as wide as a lane, so that what asks for it is computed side by side as well.
    regular: [u64; LANES],
}

impl Lanes {
    #[inline(always)]
    fn new(group: &Group, duties: &[f64], loads: &[Load]) -> Self {
        let (mut conductance, mut current, mut power) = (Lane::of(0.0), Lane::of(0.0), Lane::of(0.0));
        let mut duty = Lane::of(0.0);
        for n in 0..LANES {
            conductance.0[n] = loads[n].conductance;
            current.0[n] = loads[n].current;
            power.0[n] = loads[n].power;
            duty.0[n] = if duties[n] > 0.0 { duties[n].min(1.0) } else { 0.0 };
        }
        if !group.exact {
            for n in 0..LANES {
                let (pwm, t_sw) = (&group.pwm[n], group.t_sw.0[n]);
                let shifted = duty_offset::shift(duty.0[n], pwm);
                duty.0[n] = minimum_on_time::limit(duty_quantisation::round(shifted, pwm.duty_lsb), pwm, t_sw);
            }
        }
        Lanes {
            i: Lane::of(0.0),
            v: Lane::of(0.0),
            on: duty * group.t_sw,
            // `load_setting::drawn` lane by lane
            conductance: conductance * group.resistor_gain + group.bleed,
            current: current * group.setting_gain,
            power: power * group.setting_gain,
            regular: [1; LANES],
        }
    }

    #[inline(always)]
    fn segment<G: Give<Lane>>(&mut self, give: G, group: &Group, h: Lane, drive: [Lane; 2], diode: Lane) {
        let (i0, v0, power) = (self.i, self.v, self.power);
        let mut w0 = Lane([0.0; LANES]);
        for n in 0..LANES {
            // 1 / v0 at a voltage of 0 would bring 0 * inf, a NaN, into a lane without constant power
            let inverse = 1.0 / v0.0[n];
            w0.0[n] = if v0.0[n] < group.v_fold.0[n] { 0.0 } else { inverse };
        }
        let (a, b) = (h * group.inv_l, h * group.inv_c);
        let load = [self.conductance, self.current, power];
        let (i, v) = series(give, [i0, v0, w0], [a, b], drive, load);
        (self.i, self.v) = (sum(&i), sum(&v));
        let rate = b * self.conductance;
        for n in 0..LANES {
            let fold = group.v_fold.0[n];
            // the conditions of `Plain::leaf`, so that a lane that passes has the bits of a plant alone
            let steady = (v[1].0[n].abs() <= LARGEST_CHANGE * v0.0[n]) & (v0.0[n] >= fold) & (self.v.0[n] >= fold);
            let smooth = (power.0[n] == 0.0) | steady;
            let short = (h.0[n] <= group.longest.0[n]) & (rate.0[n] <= LONGEST_STEP);
            let flows = (diode.0[n] == 0.0) | ((i0.0[n] > 0.0) & (self.i.0[n] > 0.0));
            let last = v[ORDER].0[n].abs() + TERM_BEFORE * v[ORDER - 1].0[n].abs();
            self.regular[n] &= u64::from(smooth & short & flows & (last <= group.last_term.0[n]));
        }
    }
}
