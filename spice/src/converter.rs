//! A converter in ngspice as an environment of a closed loop.

use closed_loop::environment::{Environment, LoadPath, Start};
use closed_loop::{Error, environment};
use plant::{Load, Model, Parameters, Rectifier, Sample, Sensor, ShortPulse, Signals};
use toml_input::Message;

use crate::circuit::{Circuit, SOURCES, drawn, netlist};
use crate::gates::{Modulator, pulse};
use crate::host::{Edge, Host, Row, Source};

/// Duration of a load step, before its instant, s; faster ones ngspice does not follow into an inductance.
const LOAD_RISE: f64 = 100e-9;
/// Longest step of the transient, as a share of the control period.
// ripple moves by 1e-7 V from half of it to twice, by 5e-5 V at twenty times
const LONGEST_STEP: f64 = 0.005;
/// Longest run, control periods.
// 100 s at 10 kHz, ten times the longest of a scenario file
const LONGEST_RUN: f64 = 1e6;

/// The plant's effects that the netlist and the modulator here reproduce. One that is new there is refused until somebody
/// writes its netlist: ngspice would otherwise answer for another converter.
const KNOWN: [&str; 26] = [
    "converter",
    "dcr",
    "saturation",
    "core_loss",
    "esr",
    "esl",
    "derating",
    "switch_resistance",
    "diode",
    "dead_time",
    "switch_delay",
    "node_capacitance",
    "source_impedance",
    "input_ripple",
    "bleed",
    "cpl_bandwidth",
    "cpl_fold",
    "load_setting",
    "cable",
    "duty_delay",
    "duty_offset",
    "duty_quantisation",
    "minimum_on_time",
    "sensor_gain",
    "sensor_offset",
    "sensor_quantisation",
];

/// The effects of a converter that ngspice would leave out.
fn unknown(parameters: &Parameters) -> Vec<&'static str> {
    let on = plant::effects().filter(|effect| effect.is_on(parameters));
    on.map(|effect| effect.name)
        .filter(|name| !KNOWN.contains(name))
        .collect()
}

/// A converter of the given parameters, simulated by ngspice.
///
/// A copy goes on from the same state: it repeats the run so far when it is first used. Sensors may have gain, offset and
/// quantisation.
#[derive(Debug)]
pub struct SpiceConverter {
    nominal: Parameters,
    /// What the run started from.
    start: Option<Begin>,
    /// Edges of each control period so far.
    history: Vec<Vec<Edge>>,
    host: Option<Host>,
    modulator: Modulator,
    /// Edges of the PWM period that was running at the start, for the first control period.
    leftover: Vec<Edge>,
}

#[derive(Debug, Clone)]
struct Begin {
    parameters: Parameters,
    netlist: String,
    before: Vec<Edge>,
}

impl Clone for SpiceConverter {
    fn clone(&self) -> Self {
        Self {
            nominal: self.nominal.clone(),
            start: self.start.clone(),
            history: self.history.clone(),
            // a process cannot be copied: the copy repeats the history
            host: None,
            modulator: self.modulator.clone(),
            leftover: self.leftover.clone(),
        }
    }
}

impl SpiceConverter {
    /// A converter that has not been started.
    ///
    /// # Errors
    /// If an effect is on that the circuit for ngspice does not have, or the converter is an averaged one.
    pub fn new(parameters: &Parameters) -> Result<Self, Error> {
        if let Some(effect) = unknown(parameters).first() {
            let message = Message::new(format!("the circuit for ngspice has no `{effect}`"));
            return Err(message.expected(format!("one of {}", KNOWN[1..].join(", "))).into());
        }
        if parameters.converter.model == Model::Averaged {
            let message = Message::new("ngspice computes switching intervals");
            return Err(message.found("`converter.model` is \"averaged\"").into());
        }
        parameters.require_buck("the closed loop in ngspice")?;
        let pwm = &parameters.pwm;
        // refused, not ignored: ngspice would answer for another converter
        if pwm.min_on_time > 0.0 && pwm.short_pulse == ShortPulse::Extend {
            let message = Message::new("the modulator for ngspice drops short pulses");
            return Err(message.found("`pwm.short_pulse` is \"extend\"").into());
        }
        Ok(Self {
            nominal: parameters.clone(),
            start: None,
            history: Vec::new(),
            host: None,
            modulator: Modulator::new(parameters, 0.0),
            leftover: Vec::new(),
        })
    }

    fn begin(&mut self, parameters: Parameters, start: &Start<'_>) -> Begin {
        let hold = start.v_out / parameters.converter.v_in;
        self.modulator = Modulator::new(&parameters, hold);
        let phase = parameters.pwm.sampling_phase;
        self.leftover = match phase > 0.0 {
            true => pulse(&parameters, hold, -phase * parameters.t_sw()),
            false => Vec::new(),
        };
        let circuit = Circuit {
            parameters: &parameters,
            v_out: start.v_out,
            i_l: start.i_l,
            load: &start.load,
        };
        let mut text = netlist(&circuit);
        for name in SOURCES {
            text.push_str(&format!("V{name} {name} 0 external\n"));
        }
        let t = parameters.t_sw();
        text.push_str(&format!(
            ".save v(out) i(vil) i(vout) v(nin)\n.tran {:e} {:e} 0 {:e} uic\n.end\n",
            1e-3 * t,
            // `.tran` wants an end; the run ends sooner, with its input
            LONGEST_RUN * t,
            LONGEST_STEP * t
        ));
        // in force before time 0, so that the transient starts under its load
        // before the start, however short: a microsecond behind which all rises are over
        let mut before = load_edges(&parameters, &start.load, -1e-6);
        if parameters.converter.rectifier == Rectifier::Synchronous {
            before.push(Edge {
                source: Source::LowerGate,
                time: -1e-6,
                rise: 1e-9,
                level: 1.0,
            });
        }
        Begin {
            parameters,
            netlist: text,
            before,
        }
    }

    /// The running host, after whatever a copy has to repeat.
    fn host(&mut self) -> Result<(&mut Host, Option<Row>), Error> {
        let Some(begin) = &self.start else {
            return Err(Message::new("the converter has not been started").into());
        };
        let mut row = None;
        if self.host.is_none() {
            let (mut host, first) = Host::start(&begin.netlist, begin.parameters.t_sw(), &begin.before, &[])?;
            row = Some(first);
            for edges in &self.history {
                row = Some(host.period(edges)?);
            }
            self.host = Some(host);
        }
        match &mut self.host {
            Some(host) => Ok((host, row)),
            None => Err(Message::new("ngspice has not been started").into()),
        }
    }

    fn period(&mut self, duty: f64, load: &LoadPath) -> Result<Sample, Error> {
        let Some(begin) = &self.start else {
            return Err(Message::new("the converter has not been started").into());
        };
        let p = &begin.parameters;
        let mut edges = std::mem::take(&mut self.leftover);
        edges.extend(self.modulator.edges(p, duty));
        if let Some((at, after)) = &load.change {
            // done by its instant: a sample taken there shows the load behind it, as the plant's does
            edges.extend(load_edges(p, after, at * p.t_sw() - LOAD_RISE));
        }
        let (host, _) = self.host()?;
        let row = host.period(&edges)?;
        self.history.push(edges);
        Ok(self.sample(&row))
    }

    fn sample(&self, row: &Row) -> Sample {
        let sensors = self.start.as_ref().map(|begin| &begin.parameters.sensors);
        let show = |value: f64, sensor: Option<&Sensor>| match sensor {
            None => value,
            Some(sensor) => {
                let shown = sensor.gain * value + sensor.offset;
                match sensor.lsb > 0.0 {
                    true => (shown / sensor.lsb).round() * sensor.lsb,
                    false => shown,
                }
            }
        };
        let [v_min, v_max, i_min, i_max] = row.extremes;
        Sample {
            v_out: row.v_out,
            i_l: row.i_l,
            i_out: row.i_out,
            v_in: row.v_in,
            v_min,
            v_max,
            i_min,
            i_max,
            // ngspice's diode leaks: at rest the current is a few microamperes
            discontinuous: i_min.abs() < 1e-4,
            measured: Signals {
                v_out: show(row.v_out, sensors.map(|s| &s.v_out)),
                i_l: show(row.i_l, sensors.map(|s| &s.i_l)),
                i_out: show(row.i_out, sensors.map(|s| &s.i_out)),
                v_in: show(row.v_in, sensors.map(|s| &s.v_in)),
            },
        }
    }
}

/// The load goes to `load` from `time` on.
fn load_edges(p: &Parameters, load: &Load, time: f64) -> Vec<Edge> {
    let sources = [Source::Power, Source::Current, Source::Conductance];
    let edge = |(source, level)| Edge {
        source,
        time,
        rise: LOAD_RISE,
        level,
    };
    sources.into_iter().zip(drawn(p, load)).map(edge).collect()
}

impl Environment for SpiceConverter {
    fn t_sample(&self) -> f64 {
        self.nominal.t_sw()
    }

    fn parameter(&self, key: &str) -> Option<f64> {
        plant::parameter(key).map(|parameter| parameter.get(&self.nominal))
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        let parameters = self.start.as_ref().map_or(&self.nominal, |start| &start.parameters);
        parameters.ideal_ripple(v_out)
    }

    fn identity(&self) -> Vec<u8> {
        format!("ngspice {:?}", self.nominal).into_bytes()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error> {
        let parameters = environment::varied(&self.nominal, start.varied);
        self.host = None;
        self.history.clear();
        self.start = Some(self.begin(parameters, start));
        let (_, row) = self.host()?;
        row.map(|row| self.sample(&row))
            .ok_or_else(|| Message::new("ngspice did not start").into())
    }

    /// Where ngspice fails the sample is not a number: a diverged run.
    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        self.period(duty, load).unwrap_or(Sample {
            v_out: f64::NAN,
            ..Sample::default()
        })
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        Err(Message::new("a run in ngspice cannot be saved").into())
    }

    fn load(&mut self, _: &[u8]) -> Result<(), Error> {
        Err(Message::new("a run in ngspice cannot be saved").into())
    }
}
