//! What is compared: one circuit for each effect, at a size that shows.

use plant::{Carrier, Load, Parameters, Rectifier};
use spice::circuit::hold;

/// A run of both simulators from the same state with the same commands.
pub struct Case {
    /// The effect.
    pub name: String,
    pub parameters: Parameters,
    /// Start, V and A.
    pub v_out: f64,
    pub i_l: f64,
    /// Commanded duty of each control period.
    pub duties: Vec<f64>,
    /// Load before and after the step.
    pub loads: (Load, Load),
    /// When the load steps, periods.
    pub step_at: f64,
    /// Largest deviation of sampled v_out and v_in, i_l and i_out, and of the extremes of v_out between samples.
    pub bounds: [f64; 3],
}

impl Case {
    pub fn step_time(&self) -> f64 {
        self.step_at * self.parameters.t_sw()
    }

    /// The parameters that `ccm` and `dcm` start from: the case without its effect.
    #[allow(dead_code, reason = "the chart uses it, the test does not")]
    pub fn without_effect(&self) -> Parameters {
        let mut base = base();
        (base.converter.topology, base.converter.v_in) =
            (self.parameters.converter.topology, self.parameters.converter.v_in);
        base
    }

    /// Start and duty of every PWM period; the first may start before the first sample.
    pub fn pulses(&self) -> Vec<(f64, f64)> {
        let p = &self.parameters;
        let t = p.t_sw();
        let hold = hold(p, self.v_out);
        let late = p.pwm.duty_delay as usize;
        let mut commands = vec![hold; late];
        commands.extend(&self.duties);
        let mut first = 0.0;
        if p.pwm.sampling_phase > 0.0 {
            first = -p.pwm.sampling_phase * t;
            commands.insert(0, hold);
        }
        let real = |duty: f64| {
            let steps = p.pwm.duty_lsb;
            let duty = match duty {
                0.0 | 1.0 => duty,
                between => (between + p.pwm.duty_offset).clamp(0.0, 1.0),
            };
            let duty = if steps > 0.0 {
                (duty / steps).round() * steps
            } else {
                duty
            };
            if duty * t < p.pwm.min_on_time { 0.0 } else { duty }
        };
        commands
            .iter()
            .enumerate()
            .map(|(n, &duty)| (first + n as f64 * t, real(duty)))
            .collect()
    }
}

const BOUNDS: [f64; 3] = [1.5e-3, 1e-3, 2e-3];

/// The paper's 150 uF converter with ordinary losses; at 1.5 mF most effects would hide.
pub fn base() -> Parameters {
    let mut p = Parameters::paper_table();
    (p.inductor.dcr, p.switch.r_ds_on, p.switch.r_ds_on_low) = (0.1, 0.05, 0.05);
    (p.switch.v_f, p.switch.r_d) = (0.8, 0.02);
    p
}

/// The converter of a case and where it is run.
#[derive(Clone)]
pub struct Bench {
    /// Prefix of the names.
    pub prefix: &'static str,
    pub parameters: Parameters,
    /// Start, V and A.
    pub v_out: f64,
    pub i_l: f64,
    /// Resistors at the output, ohm: for continuous conduction, and so that the current rests.
    pub loads: (f64, f64),
    /// Constant power of the load step, W, in both.
    pub powers: (f64, f64),
    /// Duties of the case with the light load, four periods each.
    pub light: [f64; 4],
}

impl Bench {
    fn buck() -> Self {
        Bench {
            prefix: "",
            parameters: base(),
            v_out: 100.0,
            i_l: 3.8,
            loads: (20.0, 150.0),
            powers: (300.0, 40.0),
            light: [0.3, 0.45, 0.1, 0.5],
        }
    }

    /// Duties up and down, a load step at 12.3 periods.
    pub fn case(&self, effect: &Effect) -> Case {
        let mut parameters = self.parameters.clone();
        (effect.change)(&mut parameters);
        let (name, v_out) = (format!("{}{}", self.prefix, effect.name), self.v_out);
        let (duties, i_l, before, after) = if effect.light {
            let before = Load::resistor(self.loads.1);
            let after = Load {
                power: self.powers.1,
                ..before
            };
            (
                self.light.map(|duty| [duty; 4]).as_flattened().to_vec(),
                0.0,
                before,
                after,
            )
        } else {
            let before = Load::resistor(self.loads.0);
            let after = Load {
                power: self.powers.0,
                current: 1.0,
                ..before
            };
            (
                [0.5, 0.58, 0.45, 0.513].map(|duty| [duty; 5]).as_flattened().to_vec(),
                self.i_l,
                before,
                after,
            )
        };
        Case {
            name,
            parameters,
            v_out,
            i_l,
            duties: (0..30).map(|n| duties[n % duties.len()]).collect(),
            loads: (before, after),
            step_at: 12.3,
            bounds: effect.bounds,
        }
    }
}

/// What a case changes at its bench.
pub struct Effect {
    pub name: &'static str,
    /// With a load so light that the current rests.
    pub light: bool,
    pub change: fn(&mut Parameters),
    pub bounds: [f64; 3],
}

fn steady(name: &'static str, change: fn(&mut Parameters)) -> Effect {
    Effect {
        name,
        light: false,
        change,
        bounds: BOUNDS,
    }
}

fn light(name: &'static str, change: fn(&mut Parameters)) -> Effect {
    Effect {
        light: true,
        ..steady(name, change)
    }
}

fn bounded(effect: Effect, bounds: [f64; 3]) -> Effect {
    Effect { bounds, ..effect }
}

fn synchronous(p: &mut Parameters) {
    p.converter.rectifier = Rectifier::Synchronous;
}

/// Those of the buck.
pub fn all() -> Vec<Case> {
    effects().iter().map(|effect| Bench::buck().case(effect)).collect()
}

/// Each effect by itself, and all of them.
pub fn effects() -> Vec<Effect> {
    let mut effects = vec![
        steady("CCM", |_| ()),
        light("DCM", |_| ()),
        steady("leading carrier", |p| p.pwm.carrier = Carrier::Leading),
        steady("centre carrier", |p| p.pwm.carrier = Carrier::Centre),
        steady("sampled at 0.35", |p| p.pwm.sampling_phase = 0.35),
        steady("inductor resistance", |p| p.inductor.dcr = 0.5),
        steady("saturation", |p| (p.inductor.saturation, p.inductor.i_sat) = (0.5, 6.0)),
        steady("ESR", |p| p.capacitor.esr = 0.2),
        steady("derating", |p| (p.capacitor.derating, p.capacitor.v_half) = (0.6, 90.0)),
        steady("switch resistance", |p| p.switch.r_ds_on = 0.5),
        steady("diode", |p| (p.switch.v_f, p.switch.r_d) = (2.0, 0.2)),
        steady("dead time, diode leg", |p| p.switch.dead_time = 2e-6),
        steady("switch delay", |p| {
            (p.switch.turn_on_delay, p.switch.turn_off_delay) = (0.5e-6, 2e-6)
        }),
        steady("source resistance", |p| p.source.resistance = 0.8),
        steady("input capacitor", |p| {
            (p.source.resistance, p.source.c_in, p.source.esr_in) = (0.5, 100e-6, 0.02)
        }),
        steady("source inductance", |p| {
            (p.source.resistance, p.source.inductance, p.source.c_in, p.source.esr_in) = (0.3, 20e-6, 50e-6, 0.05);
        }),
        steady("input ripple", |p| {
            (p.source.ripple, p.source.ripple_frequency, p.source.ripple_phase) = (5.0, 300.0, 0.1)
        }),
        steady("bleed", |p| p.load.bleed = 1e-3),
        steady("CPL lag", |p| p.load.cpl_time_constant = 200e-6),
        steady("load setting", |p| {
            (p.load.setting_gain, p.load.resistor_gain) = (0.9, 1.05)
        }),
        steady("load cable", |p| {
            (p.cable.inductance, p.cable.resistance, p.cable.capacitance) = (2e-6, 0.02, 10e-6)
        }),
        steady("duty delay", |p| p.pwm.duty_delay = 2),
        steady("duty offset", |p| p.pwm.duty_offset = -0.01),
        steady("duty quantisation", |p| p.pwm.duty_lsb = 0.02),
        light("minimum on-time", |p| p.pwm.min_on_time = 12e-6),
        steady("sensor low-pass", |p| p.sensors.v_out.low_pass = 80e-6),
        steady("sensor delay", |p| {
            (p.sensors.v_out.delay, p.sensors.i_l.delay) = (23e-6, 123e-6)
        }),
        steady("sensor gain, offset", |p| {
            (p.sensors.v_out.gain, p.sensors.i_l.offset) = (1.02, -0.3)
        }),
        steady("sensor quantisation", |p| {
            (p.sensors.v_out.lsb, p.sensors.i_l.lsb) = (0.05, 0.01)
        }),
        steady("synchronous", synchronous),
        light("synchronous, light load", synchronous),
        steady("dead time", |p| {
            synchronous(p);
            p.switch.dead_time = 2e-6;
        }),
        light("dead time, light load", |p| {
            synchronous(p);
            p.switch.dead_time = 2e-6;
        }),
    ];
    // the needles of the ESL are rounded off by the damping ngspice needs beside it
    effects.push(bounded(
        steady("ESL", |p| p.capacitor.esl = 200e-9),
        [1.5e-3, 1e-3, 8e-3],
    ));
    effects.extend(of_the_core());
    effects.extend(of_the_node());
    // the cable starts with a short oscillation in ngspice
    effects.push(bounded(steady("everything", everything), [1.5e-3, 1e-3, 2e-2]));
    effects
}

fn of_the_core() -> Vec<Effect> {
    vec![
        steady("core loss", |p| p.inductor.core_conductance = 2e-4),
        steady("core loss of another power", |p| {
            (p.inductor.core_conductance, p.inductor.core_exponent) = (1e-3, 3.0);
        }),
        steady("core loss of a low power", |p| {
            (p.inductor.core_conductance, p.inductor.core_exponent) = (2e-4, 1.7);
        }),
        steady("core loss, ESR", |p| {
            (p.inductor.core_conductance, p.capacitor.esr) = (2e-4, 0.2)
        }),
        steady("core loss of another power, ESR", |p| {
            (p.inductor.core_conductance, p.inductor.core_exponent) = (2e-4, 3.0);
            p.capacitor.esr = 0.2;
        }),
        light("core loss, DCM", |p| p.inductor.core_conductance = 2e-4),
    ]
}

/// The node's ramps are worth 0.2 V in the buck and 1 V in the others, and each edge of ngspice may be off by a nanosecond then: 2 mV.
const OF_RAMPS: [f64; 3] = [8e-3, 2e-3, 1.2e-2];
/// Where a small current turns round before the node has arrived, what it swings by afterwards is left out.
const OF_SWINGS: [f64; 3] = [5e-2, 1e-2, 5e-2];

// with an ESR the charge that a closing switch gives the node is a needle in ngspice, which the plant spreads over the ramp
fn of_the_node() -> [Effect; 3] {
    let leg = |p: &mut Parameters| {
        synchronous(p);
        (p.switch.dead_time, p.switch.node_capacitance) = (2e-6, 5e-9);
    };
    [
        bounded(
            steady("node capacitance, diode leg", |p| p.switch.node_capacitance = 5e-9),
            OF_RAMPS,
        ),
        bounded(steady("node capacitance", leg), OF_RAMPS),
        bounded(light("node capacitance, light load", leg), OF_SWINGS),
    ]
}

fn everything(p: &mut Parameters) {
    everything_but_esl(p);
    p.capacitor.esl = 20e-9;
}

/// Where the leg interrupts the capacitor's current there is no such inductance.
#[allow(dead_code, reason = "the test uses it, the chart does not")]
pub fn everything_but_esl(p: &mut Parameters) {
    p.pwm.carrier = Carrier::Centre;
    p.pwm.sampling_phase = 0.5;
    (p.inductor.saturation, p.inductor.core_conductance) = (0.4, 5e-5);
    (p.capacitor.esr, p.capacitor.derating) = (0.05, 0.3);
    (p.switch.turn_on_delay, p.switch.turn_off_delay) = (0.3e-6, 0.8e-6);
    (p.source.resistance, p.source.c_in, p.source.esr_in) = (0.3, 200e-6, 0.02);
    p.load.cpl_time_constant = 50e-6;
    (p.cable.inductance, p.cable.resistance, p.cable.capacitance) = (1e-6, 0.01, 20e-6);
    p.sensors.v_out.low_pass = 10e-6;
}
