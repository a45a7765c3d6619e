//! The candidate causes: which parameters of the plant each moves, and how far.

use plant::Parameters;

use crate::drive::Model;

/// Typical magnitudes of a converter, which make bounds and steps of parameters of any size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bases {
    /// Output voltage, V.
    pub v: f64,
    /// Current, A.
    pub i: f64,
    /// Source voltage, V.
    pub v_in: f64,
    /// Switching period, s.
    pub t_sw: f64,
}

/// How a parameter may move: lowest, highest, and the step that counts as one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Reach {
    /// In shares of the model's own value.
    Own(f64, f64, f64),
    /// In units of v / i: highest and step.
    Resistance(f64, f64),
    /// In units of v / i: lowest, highest and step.
    ResistanceFrom(f64, f64, f64),
    /// In units of t_sw i / v.
    Capacitance(f64, f64, f64),
    /// In units of i / v.
    Conductance(f64, f64),
    /// In units of v_in.
    Source(f64, f64, f64),
    /// In units of v.
    Voltage(f64, f64, f64),
    /// In units of i.
    Current(f64, f64, f64),
    /// In switching periods.
    Time(f64, f64, f64),
    /// As it is.
    Plain(f64, f64, f64),
}

/// One parameter of a cause.
#[derive(Debug, Clone, Copy)]
pub struct Knob {
    /// Name in the results.
    pub name: &'static str,
    /// Keys of the plant that take its value; none for the sampling instant.
    pub keys: &'static [&'static str],
    reach: Reach,
}

impl Knob {
    /// SI unit.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self.keys.first().and_then(|key| plant::parameter(key)) {
            Some(parameter) => parameter.unit,
            None => "s",
        }
    }

    /// Value in a model.
    #[must_use]
    pub fn get(&self, model: &Model) -> f64 {
        match self.keys.first().and_then(|key| plant::parameter(key)) {
            Some(parameter) => parameter.get(&model.plant),
            None => model.late,
        }
    }

    /// Gives a model the value.
    pub fn set(&self, model: &mut Model, value: f64) {
        let value = self.snapped(model, value);
        if self.keys.is_empty() {
            model.late = value;
        }
        for parameter in self.keys.iter().filter_map(|key| plant::parameter(key)) {
            parameter.set(&mut model.plant, value);
        }
    }

    /// A lag far shorter than a period is none: it would only cost steps of the integrator.
    fn snapped(&self, model: &Model, value: f64) -> f64 {
        let is_lag = self.name.starts_with("time_constant");
        let shortest = NO_LAG * model.plant.t_sw();
        if is_lag && value < shortest { 0.0 } else { value }
    }

    /// Lowest value, highest value, and step, for a converter of these magnitudes around `own`.
    #[must_use]
    pub fn range(&self, own: f64, bases: &Bases) -> [f64; 3] {
        let by = |unit: f64, low: f64, high: f64, step: f64| [low * unit, high * unit, step * unit];
        match self.reach {
            Reach::Own(low, high, step) => by(own, low, high, step),
            Reach::Resistance(high, step) => by(bases.v / bases.i, 0.0, high, step),
            Reach::ResistanceFrom(low, high, step) => by(bases.v / bases.i, low, high, step),
            Reach::Capacitance(low, high, step) => by(bases.t_sw * bases.i / bases.v, low, high, step),
            Reach::Conductance(high, step) => by(bases.i / bases.v, 0.0, high, step),
            Reach::Source(low, high, step) => by(bases.v_in, low, high, step),
            Reach::Voltage(low, high, step) => by(bases.v, low, high, step),
            Reach::Current(low, high, step) => by(bases.i, low, high, step),
            Reach::Time(low, high, step) => by(bases.t_sw, low, high, step),
            Reach::Plain(low, high, step) => [low, high, step],
        }
    }
}

/// How a cause is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Search {
    /// From the model's own value.
    Own,
    /// From each of these starts, in steps of the parameters' own steps above the model's value.
    From(&'static [&'static [f64]]),
    /// Its first parameter takes each of these values (times its step), or without any those that the residual suggests, and is
    /// not smooth in between.
    Scan(&'static [f64]),
}

/// A candidate.
#[derive(Debug, Clone, Copy)]
pub struct Cause {
    /// Its name in results.
    pub id: &'static str,
    /// What it is, for a reader.
    pub words: &'static str,
    /// Its parameters; several candidates may share an id with other parameters.
    pub knobs: &'static [Knob],
    /// How to fit it.
    pub search: Search,
}

/// Lags shorter than this share of a period are left out.
const NO_LAG: f64 = 0.01;

const fn knob(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob { name, keys, reach }
}

const fn cause(id: &'static str, words: &'static str, knobs: &'static [Knob]) -> Cause {
    Cause {
        id,
        words,
        knobs,
        search: Search::Own,
    }
}

const fn searched(id: &'static str, words: &'static str, knobs: &'static [Knob], search: Search) -> Cause {
    Cause {
        id,
        words,
        knobs,
        search,
    }
}

const OHMS: Reach = Reach::Resistance(0.5, 0.005);
const EDGE: Reach = Reach::Time(0.0, 0.2, 0.002);
const GAIN: Reach = Reach::Plain(0.5, 1.5, 0.01);
const FILTER: Reach = Reach::Time(0.0, 5.0, 0.1);

/// All candidates.
pub const CAUSES: &[Cause] = &[
    cause(
        "dcr",
        "resistance of the winding",
        &[knob("dcr", &["inductor.dcr"], OHMS)],
    ),
    cause(
        "r_ds_on",
        "on-resistance of the switch",
        &[knob("r_ds_on", &["switch.r_ds_on"], OHMS)],
    ),
    cause(
        "diode",
        "forward voltage of the diode",
        &[knob("v_f", &["switch.v_f"], Reach::Source(0.0, 0.1, 0.002))],
    ),
    cause(
        "diode",
        "differential resistance of the diode",
        &[knob("r_d", &["switch.r_d"], OHMS)],
    ),
    cause(
        "diode",
        "forward voltage and differential resistance of the diode",
        &[
            knob("v_f", &["switch.v_f"], Reach::Source(0.0, 0.1, 0.002)),
            knob("r_d", &["switch.r_d"], OHMS),
        ],
    ),
    cause(
        "dead_time",
        "dead time",
        &[knob("dead_time", &["switch.dead_time"], EDGE)],
    ),
    cause(
        "turn_on_delay",
        "turn-on delay of the switch",
        &[knob("turn_on_delay", &["switch.turn_on_delay"], EDGE)],
    ),
    cause(
        "turn_off_delay",
        "turn-off delay of the switch",
        &[knob("turn_off_delay", &["switch.turn_off_delay"], EDGE)],
    ),
    cause(
        "esr",
        "series resistance of the output capacitor",
        &[knob("esr", &["capacitor.esr"], OHMS)],
    ),
    cause(
        "esl",
        "series inductance of the output capacitor",
        &[knob("esl", &["capacitor.esl"], Reach::Plain(0.0, 1e-5, 2e-7))],
    ),
    cause(
        "l_wrong",
        "inductance",
        &[knob(
            "inductance",
            &["converter.inductance"],
            Reach::Own(0.3, 3.0, 0.02),
        )],
    ),
    cause(
        "c_wrong",
        "capacitance",
        &[knob(
            "capacitance",
            &["converter.capacitance"],
            Reach::Own(0.3, 3.0, 0.02),
        )],
    ),
    searched(
        "l_saturation",
        "inductance that falls with current",
        &[
            knob("saturation", &["inductor.saturation"], Reach::Plain(0.0, 0.95, 0.1)),
            knob("i_sat", &["inductor.i_sat"], Reach::Current(0.5, 5.0, 0.1)),
        ],
        Search::From(&[&[0.3, 6.0], &[0.3, 12.0], &[0.3, 25.0], &[4.0, 12.0]]),
    ),
    searched(
        "c_derating",
        "capacitance that falls with voltage",
        &[
            knob("derating", &["capacitor.derating"], Reach::Plain(0.0, 0.95, 0.1)),
            knob("v_half", &["capacitor.v_half"], Reach::Voltage(0.5, 5.0, 0.1)),
        ],
        Search::From(&[&[0.3, 6.0], &[0.3, 12.0], &[0.3, 25.0], &[4.0, 12.0]]),
    ),
    cause(
        "source_impedance",
        "resistance of the source",
        &[knob("resistance", &["source.resistance"], OHMS)],
    ),
    searched(
        "source_impedance",
        "resistance of the source before an input capacitor",
        &[
            // bounds keep their time constant above NO_LAG periods
            knob(
                "resistance",
                &["source.resistance"],
                Reach::ResistanceFrom(0.002, 0.5, 0.005),
            ),
            knob("c_in", &["source.c_in"], Reach::Capacitance(10.0, 1e6, 20.0)),
        ],
        Search::From(&[&[4.0, 1.0], &[4.0, 20.0]]),
    ),
    cause(
        "v_in_wrong",
        "source voltage",
        &[knob("v_in", &["converter.v_in"], Reach::Own(0.7, 1.3, 0.005))],
    ),
    cause(
        "sensor_low_pass",
        "low-pass of the sensors",
        &[knob(
            "time_constant",
            &[
                "sensors.v_out.low_pass",
                "sensors.i_l.low_pass",
                "sensors.i_out.low_pass",
            ],
            FILTER,
        )],
    ),
    cause(
        "sensor_low_pass",
        "low-pass of the voltage sensor",
        &[knob("time_constant_v", &["sensors.v_out.low_pass"], FILTER)],
    ),
    cause(
        "sensor_low_pass",
        "low-pass of the inductor current sensor",
        &[knob("time_constant_i", &["sensors.i_l.low_pass"], FILTER)],
    ),
    searched(
        "sampling_delay",
        "sampling instant",
        &[knob("delay", &[], Reach::Time(-1.9, 1.9, 0.02))],
        Search::From(&[&[0.0], &[-12.0], &[12.0], &[35.0]]),
    ),
    cause(
        "v_gain",
        "gain of the output voltage sensor",
        &[knob("gain", &["sensors.v_out.gain"], GAIN)],
    ),
    cause(
        "v_offset",
        "offset of the output voltage sensor",
        &[knob(
            "offset",
            &["sensors.v_out.offset"],
            Reach::Voltage(-0.3, 0.3, 0.002),
        )],
    ),
    cause(
        "i_gain",
        "gain of the inductor current sensor",
        &[knob("gain", &["sensors.i_l.gain"], GAIN)],
    ),
    cause(
        "i_gain",
        "gain of the load current sensor",
        &[knob("gain_o", &["sensors.i_out.gain"], GAIN)],
    ),
    cause(
        "i_gain",
        "gain of both current sensors",
        &[knob("gain", &["sensors.i_l.gain", "sensors.i_out.gain"], GAIN)],
    ),
    cause(
        "i_offset",
        "offset of the inductor current sensor",
        &[knob(
            "offset",
            &["sensors.i_l.offset"],
            Reach::Current(-1.0, 1.0, 0.005),
        )],
    ),
    cause(
        "i_offset",
        "offset of the load current sensor",
        &[knob(
            "offset_o",
            &["sensors.i_out.offset"],
            Reach::Current(-1.0, 1.0, 0.005),
        )],
    ),
    cause(
        "i_offset",
        "offset of both current sensors",
        &[knob(
            "offset",
            &["sensors.i_l.offset", "sensors.i_out.offset"],
            Reach::Current(-1.0, 1.0, 0.005),
        )],
    ),
    searched(
        "duty_delay",
        "whole periods the duty waits",
        &[knob("periods", &["pwm.duty_delay"], Reach::Plain(0.0, 8.0, 1.0))],
        Search::Scan(&[0.0, 1.0, 2.0, 3.0, 4.0]),
    ),
    searched(
        "duty_quantisation",
        "step of the duty",
        &[knob("duty_lsb", &["pwm.duty_lsb"], Reach::Plain(0.0, 0.1, 1.0))],
        Search::Scan(&[]),
    ),
    cause(
        "cpl_bandwidth",
        "time constant of the constant-power regulation",
        &[knob(
            "time_constant",
            &["load.cpl_time_constant"],
            Reach::Time(0.0, 50.0, 0.5),
        )],
    ),
    searched(
        "cpl_fold",
        "voltage below which constant power becomes a resistor",
        &[knob("v_fold", &["load.v_fold"], Reach::Voltage(0.01, 1.5, 0.01))],
        Search::From(&[&[55.0], &[70.0], &[80.0], &[86.0], &[91.0], &[96.0], &[101.0]]),
    ),
    cause(
        "load_gain",
        "drawn over set current and power",
        &[knob("gain", &["load.setting_gain"], GAIN)],
    ),
    cause(
        "load_gain",
        "real over set conductance",
        &[knob("resistor_gain", &["load.resistor_gain"], GAIN)],
    ),
    cause(
        "load_gain",
        "drawn over set load",
        &[knob("gain", &["load.setting_gain", "load.resistor_gain"], GAIN)],
    ),
    cause(
        "bleed",
        "conductance that is always there",
        &[knob("bleed", &["load.bleed"], Reach::Conductance(0.3, 0.003))],
    ),
    cause(
        "core_loss",
        "conductance across the inductance",
        &[knob(
            "core_conductance",
            &["inductor.core_conductance"],
            Reach::Conductance(0.1, 0.001),
        )],
    ),
    searched(
        "input_ripple",
        "line harmonic on the source",
        &[
            knob("ripple", &["source.ripple"], Reach::Source(0.0, 0.2, 0.002)),
            knob(
                "frequency",
                &["source.ripple_frequency"],
                Reach::Plain(10.0, 2000.0, 2.0),
            ),
            knob("phase", &["source.ripple_phase"], Reach::Plain(-1.0, 1.0, 0.02)),
        ],
        Search::From(&[]),
    ),
    cause(
        "v_in_gain",
        "gain of the input voltage sensor",
        &[knob("gain", &["sensors.v_in.gain"], GAIN)],
    ),
];

/// A candidate with the numbers it has for one converter.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Which cause.
    pub cause: &'static Cause,
    /// The model's own values.
    pub own: Vec<f64>,
    /// Lowest and highest value and step of each.
    pub ranges: Vec<[f64; 3]>,
}

/// The candidates for a converter.
#[must_use]
pub fn candidates(parameters: &Parameters, bases: &Bases) -> Vec<Candidate> {
    let model = Model::new(parameters);
    let candidate = |cause: &'static Cause| {
        let own: Vec<f64> = cause.knobs.iter().map(|knob| knob.get(&model)).collect();
        let ranges = cause
            .knobs
            .iter()
            .zip(&own)
            .map(|(knob, own)| knob.range(*own, bases))
            .collect();
        Candidate { cause, own, ranges }
    };
    CAUSES.iter().map(candidate).collect()
}
