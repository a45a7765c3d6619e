//! What is compared: one circuit for each effect, at a size that shows.

use plant::{Carrier, Load, Parameters, Rectifier};

/// A run of both simulators from the same state with the same commands.
pub struct Case {
    /// The effect.
    pub name: &'static str,
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
        base()
    }

    /// Start and duty of every PWM period; the first may start before the first sample.
    pub fn pulses(&self) -> Vec<(f64, f64)> {
        let p = &self.parameters;
        let t = p.t_sw();
        let hold = self.v_out / p.converter.v_in;
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
fn base() -> Parameters {
    let mut p = Parameters::paper_table();
    (p.inductor.dcr, p.switch.r_ds_on, p.switch.r_ds_on_low) = (0.1, 0.05, 0.05);
    (p.switch.v_f, p.switch.r_d) = (0.8, 0.02);
    p
}

/// Duties up and down, a constant-power step at 12.3 periods; CCM.
fn ccm(name: &'static str, change: impl FnOnce(&mut Parameters)) -> Case {
    let mut parameters = base();
    change(&mut parameters);
    let duties = (0..30).map(|n| [0.5, 0.58, 0.45, 0.513][n / 5 % 4]).collect();
    let before = Load::resistor(20.0);
    let after = Load {
        power: 300.0,
        current: 1.0,
        ..before
    };
    Case {
        name,
        parameters,
        v_out: 100.0,
        i_l: 3.8,
        duties,
        loads: (before, after),
        step_at: 12.3,
        bounds: BOUNDS,
    }
}

/// A light load, so that the current rests.
fn dcm(name: &'static str, change: impl FnOnce(&mut Parameters)) -> Case {
    let mut case = ccm(name, change);
    case.duties = (0..30).map(|n| [0.3, 0.45, 0.1, 0.5][n / 4 % 4]).collect();
    let before = Load::resistor(150.0);
    case.loads = (before, Load { power: 40.0, ..before });
    case.i_l = 0.0;
    case
}

fn bounded(mut case: Case, bounds: [f64; 3]) -> Case {
    case.bounds = bounds;
    case
}

fn synchronous(p: &mut Parameters) {
    p.converter.rectifier = Rectifier::Synchronous;
}

/// All of them.
pub fn all() -> Vec<Case> {
    let mut cases = vec![
        ccm("CCM", |_| ()),
        dcm("DCM", |_| ()),
        ccm("leading carrier", |p| p.pwm.carrier = Carrier::Leading),
        ccm("centre carrier", |p| p.pwm.carrier = Carrier::Centre),
        ccm("sampled at 0.35", |p| p.pwm.sampling_phase = 0.35),
        ccm("inductor resistance", |p| p.inductor.dcr = 0.5),
        ccm("saturation", |p| (p.inductor.saturation, p.inductor.i_sat) = (0.5, 6.0)),
        ccm("core loss", |p| p.inductor.core_conductance = 2e-4),
        dcm("core loss, DCM", |p| p.inductor.core_conductance = 2e-4),
        ccm("ESR", |p| p.capacitor.esr = 0.2),
        ccm("derating", |p| (p.capacitor.derating, p.capacitor.v_half) = (0.6, 90.0)),
        ccm("switch resistance", |p| p.switch.r_ds_on = 0.5),
        ccm("diode", |p| (p.switch.v_f, p.switch.r_d) = (2.0, 0.2)),
        ccm("dead time, diode leg", |p| p.switch.dead_time = 2e-6),
        ccm("switch delay", |p| {
            (p.switch.turn_on_delay, p.switch.turn_off_delay) = (0.5e-6, 2e-6)
        }),
        ccm("source resistance", |p| p.source.resistance = 0.8),
        ccm("input capacitor", |p| {
            (p.source.resistance, p.source.c_in, p.source.esr_in) = (0.5, 100e-6, 0.02)
        }),
        ccm("source inductance", |p| {
            (p.source.resistance, p.source.inductance, p.source.c_in, p.source.esr_in) = (0.3, 20e-6, 50e-6, 0.05);
        }),
        ccm("input ripple", |p| {
            (p.source.ripple, p.source.ripple_frequency, p.source.ripple_phase) = (5.0, 300.0, 0.1)
        }),
        ccm("bleed", |p| p.load.bleed = 1e-3),
        ccm("CPL lag", |p| p.load.cpl_time_constant = 200e-6),
        ccm("load setting", |p| {
            (p.load.setting_gain, p.load.resistor_gain) = (0.9, 1.05)
        }),
        ccm("load cable", |p| {
            (p.cable.inductance, p.cable.resistance, p.cable.capacitance) = (2e-6, 0.02, 10e-6)
        }),
        ccm("duty delay", |p| p.pwm.duty_delay = 2),
        ccm("duty quantisation", |p| p.pwm.duty_lsb = 0.02),
        dcm("minimum on-time", |p| p.pwm.min_on_time = 12e-6),
        ccm("sensor low-pass", |p| p.sensors.v_out.low_pass = 80e-6),
        ccm("sensor delay", |p| {
            (p.sensors.v_out.delay, p.sensors.i_l.delay) = (23e-6, 123e-6)
        }),
        ccm("sensor gain, offset", |p| {
            (p.sensors.v_out.gain, p.sensors.i_l.offset) = (1.02, -0.3)
        }),
        ccm("sensor quantisation", |p| {
            (p.sensors.v_out.lsb, p.sensors.i_l.lsb) = (0.05, 0.01)
        }),
        ccm("synchronous", synchronous),
        dcm("synchronous, light load", synchronous),
        ccm("dead time", |p| {
            synchronous(p);
            p.switch.dead_time = 2e-6;
        }),
        dcm("dead time, light load", |p| {
            synchronous(p);
            p.switch.dead_time = 2e-6;
        }),
    ];
    // the needles of the ESL are rounded off by the damping ngspice needs beside it
    cases.push(bounded(ccm("ESL", |p| p.capacitor.esl = 200e-9), [1.5e-3, 1e-3, 8e-3]));
    // the cable starts with a short oscillation in ngspice
    cases.push(bounded(ccm("everything", everything), [1.5e-3, 1e-3, 2e-2]));
    cases
}

fn everything(p: &mut Parameters) {
    p.pwm.carrier = Carrier::Centre;
    p.pwm.sampling_phase = 0.5;
    (p.inductor.saturation, p.inductor.core_conductance) = (0.4, 5e-5);
    (p.capacitor.esr, p.capacitor.esl, p.capacitor.derating) = (0.05, 20e-9, 0.3);
    (p.switch.turn_on_delay, p.switch.turn_off_delay) = (0.3e-6, 0.8e-6);
    (p.source.resistance, p.source.c_in, p.source.esr_in) = (0.3, 200e-6, 0.02);
    p.load.cpl_time_constant = 50e-6;
    (p.cable.inductance, p.cable.resistance, p.cable.capacitance) = (1e-6, 0.01, 20e-6);
    p.sensors.v_out.low_pass = 10e-6;
}
