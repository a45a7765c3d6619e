//! The regression against scikit-learn's on tables it was given (`fixtures/make_pls.py`).
#![allow(clippy::unwrap_used)]

use drm::pls::Pls;
use serde_json::Value;

const TOLERANCE: f64 = 1e-9;

struct Case {
    name: String,
    columns: Vec<Vec<f64>>,
    d_real: Vec<f64>,
    fits: Vec<Value>,
    least_squares: Option<Vec<f64>>,
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn cases() -> Vec<Case> {
    let fixture: Value = serde_json::from_str(include_str!("fixtures/pls.json")).unwrap();
    let cases = fixture["cases"].as_array().unwrap().iter().map(|case| {
        let (d_sim, i_out) = (numbers(&case["d_sim"]), numbers(&case["i_out"]));
        let product = d_sim.iter().zip(&i_out).map(|(d, i)| d * i).collect();
        let mut columns = vec![d_sim, i_out];
        if case["product"].as_bool().unwrap() {
            columns.push(product);
        }
        Case {
            name: case["name"].as_str().unwrap().to_owned(),
            columns,
            d_real: numbers(&case["d_real"]),
            fits: case["fits"].as_array().unwrap().clone(),
            least_squares: case["least_squares"]
                .is_array()
                .then(|| numbers(&case["least_squares"])),
        }
    });
    cases.collect()
}

fn row(columns: &[Vec<f64>], index: usize) -> Vec<f64> {
    columns.iter().map(|column| column[index]).collect()
}

fn near(found: f64, expected: f64, scale: f64, what: &str) {
    let difference = (found - expected).abs();
    assert!(difference <= TOLERANCE * scale, "{what}: {found} instead of {expected}");
}

#[test]
fn coefficients_and_predictions_equal_those_of_scikit_learn() {
    let cases = cases();
    assert_eq!(cases.len(), 10);
    for case in &cases {
        for fit in &case.fits {
            let components = fit["components"].as_u64().unwrap() as usize;
            let name = format!("{} with {components}", case.name);
            let pls = Pls::fit(&case.columns, &case.d_real, components);
            for (found, expected) in pls.coefficients.iter().zip(numbers(&fit["coefficients"])) {
                near(*found, expected, expected.abs().max(1e-15), &name);
            }
            near(pls.intercept, fit["intercept"].as_f64().unwrap(), 1.0, &name);
            for (index, expected) in numbers(&fit["predictions"]).into_iter().enumerate() {
                near(pls.predict(&row(&case.columns, index)), expected, 1.0, &name);
            }
        }
    }
}

#[test]
fn leave_one_out_predictions_equal_those_of_scikit_learn() {
    for case in cases() {
        for fit in &case.fits {
            let components = fit["components"].as_u64().unwrap() as usize;
            for (index, expected) in numbers(&fit["left_out"]).into_iter().enumerate() {
                let but_one = |list: &Vec<f64>| [&list[..index], &list[index + 1..]].concat();
                let columns: Vec<Vec<f64>> = case.columns.iter().map(but_one).collect();
                let pls = Pls::fit(&columns, &but_one(&case.d_real), components);
                near(pls.predict(&row(&case.columns, index)), expected, 1.0, &case.name);
            }
        }
    }
}

#[test]
fn all_components_together_are_least_squares() {
    let mut checked = 0;
    for case in cases() {
        let Some(expected) = &case.least_squares else { continue };
        let pls = Pls::fit(&case.columns, &case.d_real, case.columns.len());
        for (found, expected) in pls.coefficients.iter().zip(expected) {
            near(*found, *expected, 1.0, &case.name);
        }
        checked += 1;
    }
    assert_eq!(checked, 8, "all but the collinear one and the constant load");
}

#[test]
fn what_does_not_vary_takes_no_part() {
    // 0.1 summed up is not exactly 0.1 times their number
    let columns = [vec![0.3, 0.4, 0.5, 0.6, 0.7], vec![0.1; 5]];
    let pls = Pls::fit(&columns, &[0.31, 0.41, 0.51, 0.61, 0.71], 2);
    assert!(pls.coefficients[1] == 0.0 && pls.components == 1, "{pls:?}");
    near(pls.coefficients[0], 1.0, 1.0, "slope");
}

#[test]
fn the_leverages_of_all_points_sum_to_the_number_of_coefficients() {
    for case in cases() {
        let components = case.fits.len();
        let pls = Pls::fit(&case.columns, &case.d_real, components);
        let sum: f64 = (0..case.d_real.len())
            .map(|k| pls.leverage(&row(&case.columns, k)))
            .sum();
        near(sum, pls.components as f64 + 1.0, 1.0, &case.name);
    }
}
