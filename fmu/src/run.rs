//! One control period of an FMU: inputs, communication steps, outputs.

use closed_loop::LoadPath;
use plant::{Load, Sample, Signals};
use toml_input::Message;

use crate::instance::{Instance, Port};
use crate::model::Model;
use crate::state::{Order, State};

/// Resistance that stands for no load where an FMU takes a resistance, ohm.
// a nanoampere at 1 V: less than any load that is set, and no infinity, which models divide by
const NO_LOAD: f64 = 1e9;

/// Places of the inputs in [`Order::Set`].
const DUTY: u8 = 0;
const CURRENT: u8 = 1;
const CONDUCTANCE: u8 = 2;
const RESISTANCE: u8 = 3;
const POWER: u8 = 4;
const SOURCE: u8 = 5;

impl Model {
    /// The variable of an input.
    pub fn input(&self, input: u8) -> Option<&Port> {
        let wiring = &self.wiring;
        match input {
            DUTY => Some(&wiring.duty),
            CURRENT => wiring.loads.current.as_ref(),
            CONDUCTANCE => wiring.loads.conductance.as_ref(),
            RESISTANCE => wiring.loads.resistance.as_ref(),
            POWER => wiring.loads.power.as_ref(),
            _ => wiring.source.as_ref(),
        }
    }

    /// What the user should know, one sentence each.
    pub fn notes(&self) -> Vec<String> {
        let (name, wiring) = (&self.shown, &self.wiring);
        let t_sample = self.nominal.t_sw();
        let step = t_sample / f64::from(wiring.steps);
        let mut notes = vec![format!(
            "{name} computes the converter: foreign code, in steps of {step:e} s"
        )];
        if !self.variable_step {
            notes.push(format!(
                "a load steps at the next of these instants, for {name} cannot change its step"
            ));
        }
        if wiring.loads.power.is_none() {
            notes.push(format!(
                "{name} is not told of constant power: what such a load draws follows the output voltage a step later"
            ));
        }
        if wiring.initial.iter().any(Option::is_none) {
            notes.push(format!(
                "{name} begins at start values of its own, for [fmu.initial] does not name both: it settles before a load step"
            ));
        }
        notes
    }
}

/// An instance with the state that it is in.
pub(crate) struct Run<'a> {
    pub model: &'a Model,
    pub instance: &'a mut Instance,
    pub state: &'a mut State,
}

/// Extremes of a period.
struct Track {
    v: [f64; 2],
    i: [f64; 2],
}

impl Track {
    fn at(signals: &Signals) -> Self {
        Self {
            v: [signals.v_out; 2],
            i: [signals.i_l; 2],
        }
    }

    fn see(&mut self, signals: &Signals) {
        self.v = [self.v[0].min(signals.v_out), self.v[1].max(signals.v_out)];
        self.i = [self.i[0].min(signals.i_l), self.i[1].max(signals.i_l)];
    }
}

impl Run<'_> {
    /// Ends the initialisation under `load`; the sample is that of the start.
    pub fn first(&mut self, load: &Load) -> Result<Sample, Message> {
        let converter = &self.state.parameters.converter;
        let duty = converter.topology.duty(self.state.v_in, self.state.initial[0]);
        self.set(DUTY, duty)?;
        self.set(SOURCE, self.state.v_in)?;
        let drawn = self.state.surroundings.drawn(load);
        self.draw(&drawn)?;
        self.instance.start()?;
        self.state.orders.push(Order::Start);
        self.look()?;
        let signals = self.signals(&drawn)?;
        self.state.signals = signals;
        self.state.surroundings.reset_at(&signals);
        Ok(self.sample(&Track::at(&signals)))
    }

    /// A control period.
    pub fn period(&mut self, duty: f64, load: &LoadPath) -> Result<Sample, Message> {
        let duty = self.state.surroundings.modulate(duty);
        self.set(DUTY, duty)?;
        let steps = f64::from(self.model.wiring.steps);
        let mut drawn = self.state.surroundings.drawn(&load.before);
        let mut change = load.change.map(|(at, after)| {
            // of an FMU that cannot change its step the next instant, a rounding error aside
            let at = if self.model.variable_step {
                at
            } else {
                (at * steps - 1e-9).ceil() / steps
            };
            (at, self.state.surroundings.drawn(&after))
        });
        let mut track = Track::at(&self.state.signals);
        self.draw(&drawn)?;
        for step in 0..self.model.wiring.steps {
            let (mut from, to) = (f64::from(step) / steps, f64::from(step + 1) / steps);
            if let Some((at, after)) = change.filter(|(at, _)| *at < to) {
                if at > from {
                    self.step(from, at)?;
                    track.see(&self.state.signals);
                    from = at;
                }
                (drawn, change) = (after, None);
                self.draw(&drawn)?;
            }
            self.step(from, to)?;
            track.see(&self.state.signals);
            self.draw(&drawn)?;
        }
        // at the sampling instant itself: the sample shows it
        if let Some((_, after)) = change {
            drawn = after;
            self.draw(&drawn)?;
            self.look()?;
            track.see(&self.state.signals);
        }
        self.state.periods += 1;
        self.state.signals = self.signals(&drawn)?;
        Ok(self.sample(&track))
    }

    /// The source has another voltage from now on, V.
    pub fn source(&mut self, v_in: f64) -> Result<(), Message> {
        self.state.v_in = v_in;
        self.set(SOURCE, v_in)
    }

    /// s, of a share of the period that is under way
    fn time(&self, share: f64) -> f64 {
        (self.state.periods as f64 + share) * self.model.nominal.t_sw()
    }

    fn step(&mut self, from: f64, to: f64) -> Result<(), Message> {
        let whole = 1.0 / f64::from(self.model.wiring.steps);
        // a whole step is the same number each time, which the difference of two times is not
        let share = if ((to - from) / whole - 1.0).abs() < 1e-9 {
            whole
        } else {
            to - from
        };
        let (time, step) = (self.time(from), share * self.model.nominal.t_sw());
        self.instance.step(time, step)?;
        self.state.orders.push(Order::Step(time, step));
        self.look_at(to)
    }

    /// Reads what every step needs.
    fn look(&mut self) -> Result<(), Message> {
        self.look_at(1.0)
    }

    fn look_at(&mut self, share: f64) -> Result<(), Message> {
        let (time, wiring) = (self.time(share), &self.model.wiring);
        self.state.signals.v_out = self.instance.get(&wiring.v_out, time)?;
        self.state.signals.i_l = self.instance.get(&wiring.i_l, time)?;
        Ok(())
    }

    /// All signals at a sampling instant; what the FMU does not give is that of the load and the source as they are set.
    fn signals(&mut self, drawn: &Load) -> Result<Signals, Message> {
        let (time, wiring) = (self.time(0.0), &self.model.wiring);
        let Signals { v_out, i_l, .. } = self.state.signals;
        let i_out = match &wiring.i_out {
            Some(port) => self.instance.get(port, time)?,
            None => self.state.surroundings.load_current(drawn, v_out),
        };
        let v_in = match &wiring.v_in {
            Some(port) => self.instance.get(port, time)?,
            None => self.state.v_in,
        };
        Ok(Signals {
            v_out,
            i_l,
            i_out,
            v_in,
        })
    }

    fn sample(&mut self, track: &Track) -> Sample {
        let signals = self.state.signals;
        Sample {
            v_out: signals.v_out,
            i_l: signals.i_l,
            i_out: signals.i_out,
            v_in: signals.v_in,
            v_min: track.v[0],
            v_max: track.v[1],
            i_min: track.i[0],
            i_max: track.i[1],
            // a diode's current rests at 0; between two steps nobody looks
            discontinuous: track.i[0] == 0.0,
            measured: self.state.surroundings.show(&signals),
        }
    }

    /// Sets an input of the FMU, if it has it and it is another value.
    fn set(&mut self, input: u8, value: f64) -> Result<(), Message> {
        let Some(port) = self.model.input(input) else {
            return Ok(());
        };
        let held = &mut self.state.held[usize::from(input)];
        if *held == Some(value) {
            return Ok(());
        }
        *held = Some(value);
        let time = self.time(0.0);
        self.instance.set(port, value, time)?;
        self.state.orders.push(Order::Set(input, value));
        Ok(())
    }

    /// Tells the FMU of a load: each kind by its own input, what has none as a current that is held until the next instant.
    fn draw(&mut self, drawn: &Load) -> Result<(), Message> {
        let loads = &self.model.wiring.loads;
        let (has_current, has_power) = (loads.current.is_some(), loads.power.is_some());
        let (as_siemens, as_ohm) = (loads.conductance.is_some(), loads.resistance.is_some());
        let v_out = self.state.signals.v_out;
        let mut held = drawn.current;
        if !has_power {
            let power = Load::power(drawn.power);
            held += self.state.surroundings.load_current(&power, v_out);
        }
        let mut conductance = drawn.conductance;
        if !as_siemens && !as_ohm {
            held += conductance * v_out;
        } else if !has_current {
            // below the fold a constant power is a resistor, which bounds the quotient
            conductance += held / v_out.max(self.state.parameters.load.v_fold);
        }
        if held != 0.0 && !(has_current || as_siemens || as_ohm) {
            return Err(self.untold(drawn));
        }
        self.set(POWER, drawn.power)?;
        self.set(CURRENT, held)?;
        self.set(CONDUCTANCE, conductance)?;
        self.set(
            RESISTANCE,
            if conductance > 1.0 / NO_LOAD {
                1.0 / conductance
            } else {
                NO_LOAD
            },
        )
    }

    fn untold(&self, drawn: &Load) -> Message {
        let what = match drawn {
            load if load.current != 0.0 => "constant current",
            load if load.conductance != 0.0 => "a resistance",
            _ => "constant power",
        };
        let message = Message::new(format!("the FMU is not told of loads of {what}"));
        message.hint("an input for it in [fmu.inputs]: load_current takes every kind, load_resistance and load_conductance as well")
    }
}
