//! Contract, training and scenario for a converter that has none yet.
//!
//! ```text
//!  plant ─┬─► limit of its load steps ─┬─► scales, reward, specification ─┐
//!         └─► law, and an observer ────┴─► features, base, dead zone ─────┴─► policy.toml, train.toml, scenario.toml
//! ```

mod base;
mod text;
mod trial;

use std::path::Path;

use closed_loop::design::{CurrentLaw, Design, Noise, STEPS, Wanted as Asked, measured, rounded};
use closed_loop::limit::{Limit, Question};
use closed_loop::{LoadKind, LoadStep, doubts, holds_power};
use plant::{Parameters, Sensor, Topology};
use toml_input::Message;

use crate::faults::Error;

use base::Base;
pub use text::{SCENARIO, TRAINING};

/// What is asked beside the plant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Smallest and largest load, constant powers in W.
    pub loads: [f64; 2],
}

impl Wanted {
    /// Half way between the loads, W.
    fn middle(&self) -> f64 {
        self.within(0.5)
    }

    /// A load at a share of the way from the smallest to the largest, W; with few digits where these are not those of an end.
    fn within(&self, share: f64) -> f64 {
        let [low, high] = self.loads;
        let load = low + share * (high - low);
        let short = rounded(load, 3);
        if short > low && short < high { short } else { load }
    }
}

/// Load steps between the ends, before those from and to the middle.
const WHOLE: usize = 2;

/// A start: what the files are written from.
#[derive(Debug, Clone)]
pub struct Start {
    wanted: Wanted,
    plant: Parameters,
    base: Base,
    /// How many times the usual the observer's bias may be wrong by in a period.
    bias: f64,
    /// Duties that may be commanded.
    duties: [f64; 2],
    limits: Limits,
    v_out: Channel,
    i_out: Channel,
    /// Measured by the classical controllers of a boost or a buck-boost, and by the law itself where there is no observer.
    i_l: Option<Channel>,
}

/// What nothing can beat, whatever the controller.
#[derive(Debug, Clone)]
struct Limits {
    /// Of the load steps up and down, and behind them of those from and to the middle.
    nominal: Vec<(LoadStep, Limit)>,
    /// The same on converters with other parts, behind the factor on L and C.
    spread: Vec<(f64, Vec<(LoadStep, Limit)>)>,
}

impl Limits {
    fn of(plant: &Parameters, wanted: Wanted, duties: [f64; 2]) -> Result<Self, Error> {
        let ([low, high], middle) = (wanted.loads, wanted.middle());
        let steps = [
            [low, high],
            [high, low],
            [low, middle],
            [middle, low],
            [middle, high],
            [high, middle],
        ];
        let all = |plant: &Parameters| -> Result<Vec<(LoadStep, Limit)>, Error> {
            let limit = |values| -> Result<(LoadStep, Limit), Error> {
                let step = LoadStep::from(values);
                let limit = Question::new(plant, wanted.v_ref, step, duties)?.of_all_instants();
                Ok((step, limit))
            };
            steps.into_iter().map(limit).collect()
        };
        let other = |factor: f64| {
            let mut other = plant.clone();
            other.converter.inductance *= factor;
            other.converter.capacitance *= factor;
            Ok((factor, all(&other)?))
        };
        Ok(Self {
            nominal: all(plant)?,
            spread: SPREAD.into_iter().map(other).collect::<Result<Vec<_>, Error>>()?,
        })
    }
}

/// How a quantity is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Channel {
    /// Lowest and highest value, V or A.
    range: [f64; 2],
    /// Step and noise, V or A, where the plant has neither and they were assumed.
    assumed: Option<[f64; 2]>,
}

/// Largest duty, where the converter leaves it.
// a driver with a bootstrap capacitor wants some time off
const LARGEST_DUTY: f64 = 0.95;
/// Clock of a usual microcontroller with an FPU and a fast PWM timer, an STM32G4, Hz.
const CLOCK: f64 = 170e6;
/// Cycles of a Cortex-M4F for each multiplication of a network: with assembly at no wait states, and the most of the model in C.
// `compile --target cortex-m4f` of a network of this size: 13,154 and 26,628 cycles for 5,248
const CYCLES: [f64; 2] = [2.5, 5.1];
/// Cycles of the observer, the features and a network of four neurons, the smallest that is of use.
// `compile --target cortex-m4f` of `examples/plants/buck-48-12.toml` says 162 % of 850 for its soonest build, in i16
const LEAST_CYCLES: f64 = 1400.0;
/// Factors on inductance and capacitance at which the policy has to hold as well.
// what a print allows: inductors are 20 % and film or polymer capacitors 10 to 20 % parts; both off to one side is rarer
const SPREAD: [f64; 2] = [0.85, 1.15];

impl Start {
    /// For a plant, whose nominal values the observer and the law are made for, and its file. Where the law alone misses its
    /// specification, its observer is the one of a few that misses it least: how fast the bias follows is what losses ask for.
    ///
    /// # Errors
    /// If the loads are no range, or the plant is one for which there is no law or no limit ([`Design::new`],
    /// [`CurrentLaw::new`], [`Question::new`]).
    pub fn new(plant: &Parameters, file: &Path, wanted: Wanted) -> Result<Self, Error> {
        Self::with(plant, file, wanted, (1.0, None), None)?.tried(plant, file)
    }

    /// With an observer whose bias may be wrong by so many times the usual in a period, and a law with this pole or the usual one; `limits` if they are
    /// known.
    fn with(
        plant: &Parameters,
        file: &Path,
        wanted: Wanted,
        (bias, pole): (f64, Option<f64>),
        limits: Option<Limits>,
    ) -> Result<Self, Error> {
        let Wanted { v_ref, loads } = wanted;
        let [low, high] = loads;
        let range = LoadKind::Power.range();
        if !(range.contains(&low) && range.contains(&high) && low < high) {
            let message = Message::new("these loads are no range").found(format!("{low} W to {high} W"));
            return Err(message
                .expected(format!("a smallest and a largest power from 0 to {} W", range.end()))
                .into());
        }
        // what is wrong with the voltage is said better by the design than by the limit
        let largest = high / v_ref;
        let [current, voltage, usual] = Noise::usual(plant);
        let model = [current, voltage, bias * usual];
        let asked = |noise| Asked {
            v_ref,
            // a load of constant power draws more in a dip
            load: 1.2 * largest,
            noise,
            model: Some(model),
            pole,
        };
        let topology = plant.converter.topology;
        match measures_inductor(plant) {
            false => Design::new(plant, asked(Some(v_ref / STEPS))).map(|_| ())?,
            true => CurrentLaw::new(plant, v_ref, largest).map(|_| ())?,
        }
        holds_power(plant, v_ref, file)?;
        let needed = topology.duty(plant.converter.v_in, v_ref);
        // 10 % is left for a load step up: more than any loss of a converter that works
        let highest = if needed < LARGEST_DUTY / 1.1 { LARGEST_DUTY } else { 1.0 };
        let duties = [0.0, highest];
        let limits = limits.map_or_else(|| Limits::of(plant, wanted, duties), Ok)?;
        let deviation = largest_of(&limits.nominal, |limit| limit.worst.extreme);
        // room for twice the dip and the overshoot that no controller avoids
        let v_full = rounded(f64::max(1.5 * v_ref, v_ref + 2.0 * deviation), 2);
        let i_full = rounded(
            f64::max(1.6 * largest, high / (v_ref - 2.0 * deviation).max(0.5 * v_ref)),
            2,
        );
        let v_out = Channel::new(&plant.sensors.v_out, [0.0, v_full]);
        let i_out = Channel::new(&plant.sensors.i_out, [-rounded(0.05 * i_full, 1), i_full]);
        Ok(Self {
            wanted,
            plant: plant.clone(),
            base: match measures_inductor(plant) {
                false => Base::Observed(Design::new(plant, asked(v_out.assumed.map(noise)))?),
                true => Base::Measured {
                    law: CurrentLaw::new(plant, v_ref, largest)?,
                    noise: noise(
                        v_out
                            .assumed
                            .unwrap_or([plant.sensors.v_out.lsb, plant.sensors.v_out.noise]),
                    ),
                },
            },
            bias,
            i_l: (topology != Topology::Buck).then(|| Channel::of_inductor(plant, v_ref, 1.2 * largest)),
            duties,
            limits,
            v_out,
            i_out,
        })
    }

    /// What nothing can beat, of the whole load steps up and down.
    #[must_use]
    pub fn limits(&self) -> &[(LoadStep, Limit)] {
        self.limits.nominal.get(..WHOLE).unwrap_or(&self.limits.nominal)
    }

    /// What the user should know of the files.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let loads = self.wanted.loads.map(plant::Load::power);
        let mut notes = doubts(&self.plant, self.wanted.v_ref, &loads);
        let inductor = self.i_l.and_then(|channel| channel.assumed);
        if self.v_out.assumed.or(self.i_out.assumed).or(inductor).is_some() {
            notes.push(
                "the plant file has neither noise nor steps in [sensors]: converters of 12 bits with one step of noise were assumed, in \
                 [set] of train.toml and scenario.toml"
                    .to_owned(),
            );
        }
        if matches!(self.base, Base::Measured { .. }) {
            notes.push(
                "the plant file has a sensor of the inductor current: this contract measures it, and its law has neither observer nor \
                 integral, so losses leave the voltage a little beside its reference"
                    .to_owned(),
            );
        }
        let smallest = self.wanted.loads[0] / self.wanted.v_ref;
        let nominal = self.base.nominal();
        if nominal.has_diode && smallest < nominal.least_load() {
            notes.push(format!(
                "at {} W the diode stops the current in every period, below {:.3} A of load: the law is made for one that flows, and the \
                 voltage will rest beside {} V there",
                self.wanted.loads[0], nominal.least_load(), self.wanted.v_ref
            ));
        }
        notes.extend(self.hurry());
        notes
    }

    /// Said where a step of the network surely takes longer than a control period of a usual microcontroller.
    fn hurry(&self) -> Option<String> {
        let cycles = CYCLES.map(|each| each * text::MULTIPLICATIONS as f64);
        let own = CLOCK * self.base.nominal().period;
        (cycles[0] > own).then(|| {
            let way = match own < LEAST_CYCLES {
                true => "no network fits there, for observer and features with four neurons take some 1,400: a faster processor or a \
                         lower f_sw; ",
                false => "make `hidden` in train.toml smaller, or ",
            };
            format!(
                "a step of a network of this size takes some {:.0},000 to {:.0},000 cycles on a Cortex-M4F, and a control period at 170 MHz \
                 is {own:.0}: {way}ask `policyc compile --target NAME --clock FREQUENCY` about your processor",
                1e-3 * cycles[0],
                1e-3 * cycles[1]
            )
        })
    }

    /// The largest error of the limits, V.
    fn deviation(&self) -> f64 {
        largest_of(&self.limits.nominal, |limit| limit.worst.deviation)
    }

    /// The load step in A.
    fn step(&self) -> f64 {
        let [low, high] = self.wanted.loads;
        (high - low) / self.wanted.v_ref
    }
}

impl Channel {
    /// Of the inductor current, at loads up to `i_out` A.
    fn of_inductor(plant: &Parameters, v_ref: f64, i_out: f64) -> Self {
        let ripple = plant.ideal_ripple(v_ref);
        // what a period of the whole source voltage adds: full effort ends one late
        let effort = plant.converter.v_in * plant.t_sw() / plant.converter.inductance;
        let most = rounded(1.6 * plant.holding_current(v_ref, i_out) + ripple + effort, 2);
        Self::new(&plant.sensors.i_l, [-rounded(0.25 * most, 2), most])
    }

    fn new(sensor: &Sensor, range: [f64; 2]) -> Self {
        let is_ideal = sensor.noise == 0.0 && sensor.lsb == 0.0;
        let step = range[1] / STEPS;
        Self {
            range,
            assumed: is_ideal.then_some([step, step]),
        }
    }
}

/// Whether the plant file says how the inductor current is measured, where a law can do without the observer: that of a boost or a
/// buck-boost.
fn measures_inductor(plant: &Parameters) -> bool {
    let sensor = &plant.sensors.i_l;
    plant.converter.topology != Topology::Buck && (sensor.noise > 0.0 || sensor.lsb > 0.0)
}

/// Standard deviation of a step and a noise: a rounding is spread evenly over its step.
fn noise([step, noise]: [f64; 2]) -> f64 {
    measured(step, noise)
}

fn largest_of(limits: &[(LoadStep, Limit)], figure: fn(&Limit) -> f64) -> f64 {
    limits.iter().map(|(_, limit)| figure(limit)).fold(0.0, f64::max)
}
