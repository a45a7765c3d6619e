//! Designs against scipy and against the poles that were asked for.
#![allow(clippy::unwrap_used, clippy::panic)]

use closed_loop::design::{Design, Model, Noise, Wanted};
use plant::{Parameters, Topology};

/// What `fixtures/riccati.py` prints: gains and the largest magnitude of a pole.
const SCIPY: [([f64; 4], Noise, [f64; 3], f64); 5] = [
    (
        [1e-4, 2e-3, 1.5e-3, 1.0],
        Noise {
            process: [5e-3, 1e-4, 5e-3],
            // sqrt(0.04^2 + 0.06103515625^2 / 12)
            measured: 0.04370859021068009,
        },
        [
            0.139_301_440_528_549_65,
            0.131_757_314_319_774_53,
            0.106_591_794_117_005_16,
        ],
        0.959_204_859_629_197,
    ),
    (
        [2e-6, 3.3e-6, 94e-6, 1.0],
        Noise {
            process: [3e-3, 2e-6, 4e-4],
            measured: 2e-3,
        },
        [
            1.560_975_156_951_130_5,
            0.241_863_601_889_057_37,
            0.174_142_056_736_544_98,
        ],
        0.931_895_065_872_964_9,
    ),
    (
        [1e-5, 220e-6, 47e-6, 1.0],
        Noise {
            process: [0.1, 0.0, 0.05],
            measured: 0.2,
        },
        [
            0.398_642_850_456_912_8,
            0.372_014_392_827_532_05,
            0.198_113_857_284_840_82,
        ],
        0.977_629_193_648_703_8,
    ),
    // a boost at a duty of a half, and a buck-boost at 5/17
    (
        [1e-5, 68e-6, 100e-6, 0.5],
        Noise {
            process: [2e-3, 1e-5, 6e-4],
            measured: 0.02,
        },
        [
            0.105_075_774_766_308_68,
            0.099_952_874_194_659_09,
            0.028_461_244_056_168_896,
        ],
        0.968_388_990_575_872_2,
    ),
    (
        [2.5e-6, 6.8e-6, 150e-6, 12.0 / 17.0],
        Noise {
            process: [2e-3, 6e-6, 3e-4],
            measured: 2e-3,
        },
        [
            1.283_229_424_787_994_3,
            0.166_379_977_010_846_95,
            0.136_954_191_309_567_65,
        ],
        0.951_324_735_109_939_5,
    ),
];

#[test]
fn gains_are_those_of_scipy() {
    for ([period, inductance, capacitance, give], noise, gains, slowest) in SCIPY {
        let filter = Model::new(period, inductance, capacitance, give)
            .filter(&noise)
            .unwrap();
        for (own, expected) in filter.gains.iter().zip(gains) {
            // both solve the same equation in binary64, by other ways
            assert!((own - expected).abs() < 1e-7 * expected, "{filter:?} {gains:?}");
        }
        // a power of a million has one constant factor more than its pole: a millionth of its logarithm
        assert!((filter.slowest - slowest).abs() < 1e-5, "{} {slowest}", filter.slowest);
    }
}

fn plant() -> Parameters {
    let mut plant = Parameters::ideal(12.0, 3.3e-6, 94e-6, 500e3);
    plant.sensors.v_out.noise = 2e-3;
    plant.pwm.duty_delay = 1;
    plant
}

fn wanted() -> Wanted {
    Wanted {
        v_ref: 5.0,
        load: 10.0,
        noise: None,
        model: None,
        pole: None,
    }
}

/// The law's own model, stepped: the capacitor current x and the error e of a converter around its settled point.
#[test]
fn the_law_leaves_the_share_of_an_error_that_was_asked_for() {
    for pole in [0.0, 0.3, 0.5, 0.8] {
        let design = Design::new(
            &plant(),
            Wanted {
                pole: Some(pole),
                ..wanted()
            },
        )
        .unwrap();
        let (b, a) = (12.0 * 2e-6 / 3.3e-6, 2e-6 / 94e-6);
        let (mut x, mut e) = (1.0, 0.2);
        let mut sizes = Vec::new();
        for _ in 0..60 {
            let u = -design.by_current * x - design.by_voltage * e;
            e += a * (x + 0.5 * b * u);
            x += b * u;
            sizes.push(x.abs() + e.abs());
        }
        // a double pole p decays as n p^n: the ratio of late steps is near p
        let ratio = sizes[59] / sizes[39];
        let late = ratio.powf(1.0 / 20.0);
        assert!(sizes[59] < 1e-12 || (late - pole).abs() < 0.03, "{pole}: {late}");
        assert!(
            pole > 0.0 || sizes[2] < 1e-9,
            "a pole of 0 is done in two periods: {sizes:?}"
        );
    }
}

#[test]
fn the_lines_are_those_of_a_contract_and_carry_the_plant() {
    let text = Design::new(&plant(), wanted()).unwrap().contract();
    let read: toml::Table = text.parse().unwrap_or_else(|error| panic!("{error}\n{text}"));
    let observer = &read["observer"][0];
    let number = |key: &str| observer[key].as_float().unwrap();
    assert_eq!((number("inductance"), number("capacitance")), (3.3e-6, 94e-6));
    assert_eq!(number("input_voltage"), 12.0);
    assert_eq!(observer["compute_delay"].as_integer(), Some(1));
    // twice 10 A, and four periods of 12 V
    let reach = 20.0 + 4.0 * 12.0 * 2e-6 / 3.3e-6;
    let current: Vec<f64> = observer["current"]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_float().unwrap())
        .collect();
    assert_eq!(current[0], 0.0, "a diode");
    assert!((current[1] - reach).abs() < 0.02 * reach, "{current:?}");
    let base = read["actions"]["base"].as_str().unwrap();
    // half of (12 - 5) V * 5/12 * 2 us / 3.3 uH
    let half_ripple = 0.5 * 7.0 * (5.0 / 12.0) * 2.0 / 3.3;
    // at 5 V of 12 V, (5/12 - 1/2) * 2 us / 3.3 us more for each volt of bias
    assert!(
        base.contains(&format!("i_out + {half_ripple:.4} - 0.05051 * model_bias)")),
        "{base}"
    );
    let mut synchronous = plant();
    synchronous.converter.rectifier = plant::Rectifier::Synchronous;
    let text = Design::new(&synchronous, wanted()).unwrap().contract();
    assert!(text.contains("current = [-"), "{text}");
}

/// The current that a switch in the middle of the period samples is its mean: nothing has to be added.
#[test]
fn a_carrier_in_the_middle_stands_in_the_observer_and_leaves_no_ripple_in_the_law() {
    let mut plant = plant();
    plant.pwm.carrier = plant::Carrier::Centre;
    let text = Design::new(&plant, wanted()).unwrap().contract();
    assert!(text.contains("carrier = \"centre\"\n"), "{text}");
    assert!(text.contains("* (model_current - i_out) -"), "{text}");
}

#[test]
fn the_lines_of_a_boost_and_of_a_buck_boost_hold_their_voltage_at_the_duty_of_their_circuit() {
    for (topology, v_ref, word, rest) in [
        (Topology::Boost, 20.0, "boost", "1 - (12 + model_bias) / 20 - "),
        (Topology::BuckBoost, 5.0, "buck-boost", "(5 - model_bias) / (12 + 5) - "),
    ] {
        let mut plant = plant();
        plant.converter.topology = topology;
        let design = Design::new(&plant, Wanted { v_ref, ..wanted() }).unwrap();
        let read: toml::Table = design.contract().parse().unwrap();
        let observer = &read["observer"][0];
        assert_eq!(observer["topology"].as_str(), Some(word));
        assert_eq!(observer["hold"].as_float(), Some(v_ref));
        let base = read["actions"]["base"].as_str().unwrap();
        assert!(base.starts_with(rest), "{base}");
        // a current that is 1 A short, in the output, asks for 0.7 of what brings it back in a period
        let (span, give) = match topology {
            Topology::Boost => (20.0, 0.6),
            _ => (17.0, 12.0 / 17.0),
        };
        let whole = 3.3e-6 / 2e-6 / span / give;
        assert!(
            (design.by_current - 0.7 * whole).abs() < 1e-12,
            "{} {whole}",
            design.by_current
        );
    }
}

#[test]
fn what_cannot_be_designed_is_refused_with_its_reason() {
    let refused = |plant: &Parameters, wanted: Wanted| Design::new(plant, wanted).unwrap_err().to_string();
    let said = refused(
        &plant(),
        Wanted {
            v_ref: 12.0,
            ..wanted()
        },
    );
    assert!(said.contains("cannot hold") && said.contains("12 V of 12 V"), "{said}");
    let said = refused(
        &plant(),
        Wanted {
            pole: Some(1.0),
            ..wanted()
        },
    );
    assert!(said.contains("pole"), "{said}");
    let said = refused(&plant(), Wanted { load: 0.0, ..wanted() });
    assert!(said.contains("load current"), "{said}");
    let mut late = plant();
    late.pwm.duty_delay = 2;
    assert!(refused(&late, wanted()).contains("duty_delay = 2"));
    let mut silent = plant();
    silent.sensors.v_out.noise = 0.0;
    let said = refused(&silent, wanted());
    assert!(said.contains("without noise") && said.contains("--noise"), "{said}");
    assert!(
        Design::new(
            &silent,
            Wanted {
                noise: Some(1e-3),
                ..wanted()
            }
        )
        .is_ok()
    );
    let mut boost = plant();
    boost.converter.topology = Topology::Boost;
    let said = refused(&boost, wanted());
    assert!(
        said.contains("boost") && said.contains("more than the source"),
        "{said}"
    );
    let mut late = plant();
    late.pwm.carrier = plant::Carrier::Leading;
    assert!(refused(&late, wanted()).contains("leading"));
}

/// An observer's equations know no sampling instant: its current is that at the start of a period.
#[test]
fn the_instant_of_the_sample_changes_nothing_of_an_observer_and_its_law() {
    let text = |phase: f64| {
        let mut plant = plant();
        plant.pwm.sampling_phase = phase;
        Design::new(&plant, wanted()).unwrap().contract()
    };
    assert_eq!(text(0.0), text(0.5));
}
