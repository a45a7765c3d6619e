//! Long steps against short ones.

use plant::{Load, Pace, Parameters, Plant, Rectifier};

/// A ringing filter, a diode that ends its current, constant power that lags: what a record of some hundred rows can hold.
fn circuits() -> Vec<(&'static str, Parameters, Load)> {
    let with = |name, change: &dyn Fn(&mut Parameters), load| {
        let mut p = Parameters::ideal(48.0, 20e-6, 100e-6, 200e3);
        (p.inductor.dcr, p.capacitor.esr) = (0.02, 0.01);
        change(&mut p);
        (name, p, load)
    };
    vec![
        with("linear", &|_| (), Load::resistor(4.0)),
        with("slow filter", &|p| p.converter.capacitance = 2e-6, Load::resistor(8.0)),
        with(
            "diode",
            &|p| p.converter.rectifier = Rectifier::Diode,
            Load::resistor(60.0),
        ),
        with(
            "core",
            &|p| (p.inductor.core_conductance, p.inductor.core_exponent) = (2e-3, 2.6),
            Load::resistor(4.0),
        ),
        with(
            "saturation",
            &|p| (p.inductor.saturation, p.inductor.i_sat) = (0.6, 5.0),
            Load::resistor(3.0),
        ),
        with(
            "constant power",
            &|p| p.load.cpl_time_constant = 3e-6,
            Load::power(20.0),
        ),
        with(
            "input filter",
            &|p| (p.source.resistance, p.source.inductance, p.source.c_in, p.source.esr_in) = (0.1, 1e-6, 10e-6, 0.02),
            Load::resistor(4.0),
        ),
    ]
}

#[test]
fn coarse_steps_are_fewer_and_change_less_than_any_sensor_shows() {
    for (name, p, load) in circuits() {
        let run = |pace| {
            let mut plant = Plant::new(&p).unwrap().at_pace(pace);
            plant.reset_at(12.0, 1.0, &load);
            let rows: Vec<[f64; 2]> = (0..300)
                .map(|n| {
                    let sample = plant.step([0.25, 0.32, 0.2][n / 25 % 3], &load);
                    [sample.v_out, sample.i_l]
                })
                .collect();
            (rows, plant.steps_taken())
        };
        let ((fine, many), (coarse, few)) = (run(Pace::Fine), run(Pace::Coarse));
        // a lag of 3 us and an input filter of 3 us are faster than the filter of 45 us, and ask for their steps whatever its own are
        let is_of_others = p.load.cpl_time_constant > 0.0 || p.source.c_in > 0.0;
        assert!(
            if is_of_others { few == many } else { few < many },
            "{name}: {few} of {many}"
        );
        for channel in 0..2 {
            let of = |rows: &[[f64; 2]]| rows.iter().map(|row| row[channel]).collect::<Vec<_>>();
            let (fine, coarse) = (of(&fine), of(&coarse));
            let swing = fine.iter().fold(f64::MIN, |a, b| a.max(*b)) - fine.iter().fold(f64::MAX, |a, b| a.min(*b));
            let apart = fine
                .iter()
                .zip(&coarse)
                .fold(0.0_f64, |most, (a, b)| most.max((a - b).abs()));
            // the inductance that falls is the one with more than 3e-5, and a sensor's noise is 1e-3 and more
            assert!(apart < 5e-4 * swing, "{name}: {apart} of {swing}");
        }
    }
}
