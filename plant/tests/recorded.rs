//! The closed loop Stable-Baselines3 recorded (200 W to 1000 W), replayed with its duties.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use plant::{Load, Parameters, Plant};

#[test]
fn recorded_trajectory_is_reproduced_open_loop() {
    let text = include_str!("../../examples/plants/sb3-buck12.toml");
    let mut plant = Plant::new(&Parameters::from_toml("sb3-buck12.toml".as_ref(), text).unwrap()).unwrap();
    let rows: Vec<Vec<f64>> = include_str!("fixtures/sb3_dqn_200_1000_excerpt.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
        .collect();
    plant.reset_at(rows[0][3], rows[0][2], &Load::power(rows[0][1]));
    for row in &rows[1..] {
        let &[t, power, i_l, v_out, v_max, v_min, duty] = row.as_slice() else {
            panic!("{row:?}")
        };
        let sample = plant.step(duty, &Load::power(power));
        // the record has six digits; its extremes are those of a simulation's grid
        assert!(
            (sample.i_l - i_l).abs() < 2e-4 && (sample.v_out - v_out).abs() < 1e-3,
            "{t}: {sample:?}"
        );
        assert!(
            (sample.v_max - v_max).abs() < 2e-3 && (sample.v_min - v_min).abs() < 2e-3,
            "{t}: {sample:?}"
        );
    }
}
