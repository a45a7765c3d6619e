//! Whether parameters describe a plant.

use toml_input::{Fault, Faults, Message, Sink};

use crate::catalogue;
use crate::effects::duty_delay;
use crate::parameters::{Parameters, Topology};
use crate::rate::{self, Pace};
use crate::sensing;
use crate::signals::Load;

/// Whether a load can be simulated at a plant of these parameters.
///
/// # Errors
/// If its resistance is so small that a period would take the simulation too long.
pub fn check_load(p: &Parameters, load: &Load) -> Result<(), Message> {
    let steps = rate::of_load(p, load) * p.t_sw();
    if steps <= MOST_STEPS {
        return Ok(());
    }
    Err(Message::new("the load resistance is too small to be simulated")
        .found(format!(
            "{:e} ohm: {steps:.1e} steps in a period of {:e} s",
            1.0 / load.conductance,
            p.t_sw()
        ))
        .expected(format!("at most {MOST_STEPS:e}"))
        .hint("a short circuit is no load step; resistances are in ohm"))
}

/// All faults of the parameters, if any.
///
/// # Errors
/// Parameters outside their allowed range, and effects that lack a partner.
pub fn check(p: &Parameters) -> Result<(), Faults> {
    let mut faults: Sink = keyed(p).into_iter().map(|(_, message)| Fault::from(message)).collect();
    faults.propagate()
}

/// The faults, each with the key of the parameter it is about.
pub(crate) fn keyed(p: &Parameters) -> Vec<(&'static str, Message)> {
    let mut faults = Vec::new();
    for parameter in catalogue::parameters() {
        let value = parameter.get(p);
        let (low, high) = parameter.allowed;
        // in this form NaN is out of range as well
        if !(low <= value && value <= high) {
            let unit = if parameter.unit == "1" { "" } else { parameter.unit };
            let message = Message::new(format!("`{}` is out of range", parameter.key))
                .found(format!("{value} {unit}").trim_end())
                .expected(format!("{low} to {high} {unit}").trim_end())
                .hint(format!("{}; SI units", parameter.meaning));
            faults.push((parameter.key, message));
        }
    }
    // partners are asked only of numbers in range: a wrong unit would otherwise be answered twice
    if faults.is_empty() {
        partners(p, &mut faults);
    }
    // a cable without capacitor has no rate
    if faults.is_empty() {
        faults.extend(too_fast(p));
    }
    faults
}

/// Steps of the simulation in a period at most.
// a step takes about a quarter of a microsecond, so a period a quarter of a second. The fastest time constant of a bench,
// 1 ns of a short cable at 10 kHz, asks for 400,000
const MOST_STEPS: f64 = 1e6;

/// A time constant that would have the simulation of a period go on for ever.
fn too_fast(p: &Parameters) -> Option<(&'static str, Message)> {
    let (key, rate) = rate::fastest(p, Pace::Fine);
    let steps = rate * p.t_sw();
    let message = || {
        Message::new(format!("`{key}` makes a time constant too short to be simulated"))
            .found(format!("{steps:.1e} steps in a period of {:e} s", p.t_sw()))
            .expected(format!("at most {MOST_STEPS:e}"))
            .hint("SI units: 1 us is 1e-6; what is not there is left out, or 0")
    };
    // in this form NaN is too fast as well
    let ends = steps <= MOST_STEPS;
    (!ends).then(|| (key, message()))
}

fn partners(p: &Parameters, faults: &mut Vec<(&'static str, Message)>) {
    let mut require = |holds: bool, key: &'static str, problem: String, hint: &str| {
        if !holds {
            faults.push((key, Message::new(problem).hint(hint)));
        }
    };
    let cable = &p.cable;
    require(
        (cable.inductance > 0.0) == (cable.capacitance > 0.0),
        if cable.inductance > 0.0 {
            "cable.inductance"
        } else {
            "cable.capacitance"
        },
        "a cable needs `cable.inductance` and `cable.capacitance`".to_owned(),
        "an inductance into a load without capacitor has no finite bandwidth; a capacitor without cable belongs to \
         `converter.capacitance`",
    );
    require(
        cable.resistance == 0.0 || cable.inductance > 0.0,
        "cable.resistance",
        "`cable.resistance` needs `cable.inductance` and `cable.capacitance`".to_owned(),
        "give the cable about 1 uH a metre",
    );
    let topology = p.converter.topology;
    require(
        topology == Topology::Buck || p.capacitor.esl == 0.0,
        "capacitor.esl",
        format!("a {} converter has no `capacitor.esl`", topology.word()),
        "its leg interrupts the current into the capacitor at every edge, and an inductance there would answer with a \
         voltage without bound; the wires to the load are a cable",
    );
    let source = &p.source;
    require(
        source.inductance == 0.0 || source.c_in > 0.0,
        "source.inductance",
        "`source.inductance` needs an input capacitor, `source.c_in`".to_owned(),
        "without one the switch would interrupt the current of an inductance",
    );
    require(
        source.esr_in == 0.0 || source.c_in > 0.0,
        "source.esr_in",
        "`source.esr_in` needs an input capacitor, `source.c_in`".to_owned(),
        "set `source.c_in`, or leave `source.esr_in` at 0",
    );
    let t_sw = p.t_sw();
    let s = &p.switch;
    require(
        // `gates::Train` remembers one pulse for the next period only
        s.dead_time + s.turn_on_delay < t_sw && s.turn_off_delay < t_sw,
        if s.turn_off_delay < t_sw {
            "switch.dead_time"
        } else {
            "switch.turn_off_delay"
        },
        "dead time and delays of the switch reach beyond a period".to_owned(),
        "times are in seconds: 2 us is 2e-6",
    );
    let sensors = &p.sensors;
    let delays = [
        ("sensors.v_out.delay", sensors.v_out.delay),
        ("sensors.i_l.delay", sensors.i_l.delay),
        ("sensors.i_out.delay", sensors.i_out.delay),
        ("sensors.v_in.delay", sensors.v_in.delay),
    ];
    for (key, delay) in delays {
        let periods = sensing::LONGEST;
        let problem = format!("`{key}` is {periods} periods or more");
        require(
            delay < periods as f64 * t_sw,
            key,
            problem,
            "times are in seconds: 35 us is 35e-6",
        );
    }
    debug_assert_eq!(duty_delay::LONGEST, sensing::LONGEST);
}
