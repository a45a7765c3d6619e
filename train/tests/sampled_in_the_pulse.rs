//! What `new --plant` writes for converters that are sampled while the switch is on.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use closed_loop::design::Design;
use closed_loop::scenario::{Metrics, Task, survey_all};
use closed_loop::{Agent, Converter};
use plant::{Carrier, Parameters, Rectifier, Sample};
use train::Contract;
use train::start::{Start, Wanted};

const V_REF: f64 = 15.0;

/// 24 V to 15 V: a duty of 0.625 at rest.
fn converter(phase: f64, carrier: Carrier, duty_delay: u32) -> Parameters {
    let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/plants/buck-24-15.toml");
    let mut plant = Parameters::from_file(example.as_path()).unwrap();
    plant.converter.rectifier = Rectifier::Synchronous;
    (plant.pwm.sampling_phase, plant.pwm.carrier) = (phase, carrier);
    plant.pwm.duty_delay = duty_delay;
    plant.sensors.v_out.noise = 1e-3;
    plant.sensors.i_out.noise = 1e-3;
    plant
}

fn start(plant: &Parameters) -> Result<Start, train::Error> {
    let wanted = Wanted {
        v_ref: V_REF,
        loads: [40.0, 150.0],
    };
    Start::new(plant, "plant.toml".as_ref(), wanted)
}

/// The law for a plant with its poles there.
fn law(plant: &Parameters, pole: Option<f64>) -> String {
    let wanted = closed_loop::design::Wanted {
        v_ref: V_REF,
        load: 1.2 * 150.0 / V_REF,
        noise: None,
        model: None,
        pole,
    };
    Design::new(plant, wanted).unwrap().law()
}

/// The largest deviation and error in the tail of load steps, V, and the longest settling, s, of the law alone, with its poles at 0.1;
/// designed for one plant, on another.
fn found(design: &Parameters, plant: &Parameters, name: &str) -> [f64; 3] {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("policy.toml");
    // fast, so that it shows what the observer does not know
    let contract = start(design)
        .unwrap()
        .contract()
        .replace(&law(design, None), &law(design, Some(0.1)));
    assert!(contract.contains(&law(design, Some(0.1))));
    std::fs::write(&path, contract).unwrap();
    let contract = Contract::load(&path, &[4]).unwrap_or_else(|faults| panic!("{faults}"));
    let mut agent = Agent::<f32>::new(&contract.policy.law_alone().unwrap()).unwrap();
    let controller = move |sample: &Sample| agent.step(&sample.measured).unwrap();
    let task = Task {
        load_steps: vec![[40.0, 150.0], [150.0, 40.0]],
        ..Task::default()
    };
    let converter = Converter::new(plant).unwrap();
    let findings = survey_all(&converter, &controller, V_REF, &task, &task.all_instants()).unwrap();
    let largest = |of: fn(&Metrics) -> f64| findings.iter().map(|finding| of(&finding.worst)).fold(0.0, f64::max);
    [
        largest(|worst| worst.deviation),
        largest(|worst| worst.tail_max),
        largest(|worst| worst.settling),
    ]
}

/// Inside the pulse the duty that was given at a sample lies between the two samples behind it: a period of delay more.
#[test]
fn the_law_rests_at_its_voltage_wherever_in_the_period_it_is_sampled() {
    let trailing = [0.0, 0.1, 0.3, 0.45, 0.55, 0.8].map(|phase| (phase, Carrier::Trailing));
    let centre = [0.05, 0.1, 0.9].map(|phase| (phase, Carrier::Centre));
    for (phase, carrier) in trailing.into_iter().chain(centre) {
        let plant = converter(phase, carrier, 0);
        let [deviation, tail, settling] = found(&plant, &plant, &format!("{carrier:?}-{phase}"));
        println!("{carrier:?} {phase}: {deviation} {tail} {settling}");
        assert!(
            deviation < 1.0 && tail < 1e-3 * V_REF,
            "{carrier:?}, sampled at {phase}: {deviation} V, {tail} V, {settling} s"
        );
    }
}

#[test]
fn a_law_that_knows_nothing_of_the_sampling_instant_takes_longer() {
    for (phase, carrier) in [
        (0.1, Carrier::Trailing),
        (0.3, Carrier::Trailing),
        (0.1, Carrier::Centre),
    ] {
        let (design, plant) = (converter(0.0, carrier, 0), converter(phase, carrier, 0));
        let [.., settling] = found(&design, &plant, &format!("unaware-{carrier:?}-{phase}"));
        let [.., aware] = found(&plant, &plant, &format!("aware-{carrier:?}-{phase}"));
        println!("unaware {carrier:?} {phase}: {settling}, aware {aware}");
        // a duty that acts a period later than it believes has to be waited for, seen and made up for: one period each
        assert!(
            settling > aware + 3.0 / plant.converter.f_sw,
            "{carrier:?}, sampled at {phase}: {settling} s, and {aware} s with it"
        );
    }
}

#[test]
fn a_sampling_instant_for_which_there_is_no_observer_is_refused_with_its_reason() {
    for (plant, words) in [
        (
            converter(0.3, Carrier::Trailing, 1),
            ["the pulse of a duty lies 2 periods", "behind the pulse"],
        ),
        (
            converter(0.5, Carrier::Centre, 0),
            ["grows at both ends", "sampling_phase"],
        ),
    ] {
        let said = start(&plant).map(|_| ()).unwrap_err().to_string();
        for word in words {
            assert!(said.contains(word), "{word}\n{said}");
        }
    }
    assert!(start(&converter(0.8, Carrier::Trailing, 1)).is_ok());
}
