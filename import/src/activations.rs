//! What libraries call an activation, and the word of the contract for it: one row each.
//!
//! A row whose word the contract does not know yet is still a name that is known: it is refused by that name.

use policy::Activation;
use toml_input::Message;

/// The names of one activation, and the function itself.
struct Row {
    /// In a contract.
    word: &'static str,
    /// Class in `torch.nn`.
    torch: &'static str,
    /// Operation of ONNX; empty where exporters write several nodes, or tell two apart by an attribute.
    onnx: &'static str,
    /// In real arithmetic, by libm: what golden answers are computed with, never what a controller computes.
    exact: fn(f64) -> f64,
}

const fn row(word: &'static str, torch: &'static str, onnx: &'static str, exact: fn(f64) -> f64) -> Row {
    Row {
        word,
        torch,
        onnx,
        exact,
    }
}

/// Word of the GELU by the error function, which is torch's.
pub(crate) const GELU: &str = "gelu";
/// Word of the GELU by tanh.
pub(crate) const GELU_TANH: &str = "gelu_tanh";
/// Word of `x * sigmoid(x)`.
pub(crate) const SILU: &str = "silu";
/// Word of `x * hard_sigmoid(x)`.
pub(crate) const HARD_SWISH: &str = "hard_swish";

/// Word of `log(1 + exp(x))`.
pub(crate) const SOFTPLUS: &str = "softplus";

const ROWS: [Row; 12] = [
    row("relu", "ReLU", "Relu", |x| x.max(0.0)),
    row("tanh", "Tanh", "Tanh", libm::tanh),
    row("softsign", "Softsign", "Softsign", |x| x / (1.0 + x.abs())),
    row("identity", "Identity", "", |x| x),
    row("elu", "ELU", "Elu", |x| if x > 0.0 { x } else { libm::expm1(x) }),
    row(SILU, "SiLU", "", |x| x * sigmoid(x)),
    row(GELU, "GELU", "", |x| {
        0.5 * x * (1.0 + libm::erf(x * std::f64::consts::FRAC_1_SQRT_2))
    }),
    // sqrt(2 / pi) and the factor are those of the paper, and of every library
    row(GELU_TANH, "", "", |x| {
        0.5 * x * (1.0 + libm::tanh((2.0 / std::f64::consts::PI).sqrt() * (x + 0.044_715 * x * x * x)))
    }),
    row("sigmoid", "Sigmoid", "Sigmoid", sigmoid),
    row(SOFTPLUS, "Softplus", "Softplus", |x| {
        x.max(0.0) + libm::log1p(libm::exp(-x.abs()))
    }),
    row("hard_sigmoid", "Hardsigmoid", "HardSigmoid", hard_sigmoid),
    row(HARD_SWISH, "Hardswish", "HardSwish", |x| x * hard_sigmoid(x)),
];

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-x))
}

fn hard_sigmoid(x: f64) -> f64 {
    ((x + 3.0) / 6.0).clamp(0.0, 1.0)
}

/// A class of `torch.nn` with what an instance of it holds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Parameters<'a> {
    /// `negative_slope` or `alpha`.
    pub number: Option<f64>,
    /// `approximate` of a GELU.
    pub approximate: Option<&'a str>,
}

/// The activation that a class of `torch.nn` makes; without parameters, what it makes without arguments.
pub(crate) fn of_torch(class: &str, parameters: Parameters<'_>) -> Option<Activation> {
    match class {
        "LeakyReLU" => Some(Activation::LeakyRelu {
            slope: parameters.number.unwrap_or(0.01),
        }),
        // another alpha is another function, for which there is no word
        "ELU" if parameters.number.is_some_and(|alpha| alpha != 1.0) => None,
        "GELU" if parameters.approximate == Some("tanh") => Activation::find(GELU_TANH),
        _ => {
            let row = ROWS.iter().find(|row| row.torch == class && !row.torch.is_empty())?;
            Activation::find(row.word)
        }
    }
}

/// The refusal of a class of `torch.nn`.
pub(crate) fn not_compiled(class: &str, parameters: Parameters<'_>) -> Message {
    let row = ROWS.iter().find(|row| row.torch == class && !row.torch.is_empty());
    let word = match parameters.approximate {
        Some("tanh") => GELU_TANH,
        _ => row.map_or(class, |row| row.word),
    };
    let found = match parameters.number {
        Some(number) => format!("{class} of {number}"),
        None => class.to_owned(),
    };
    refusal(word, &found)
}

/// The refusal of an activation that is known by name.
pub(crate) fn refusal(word: &str, found: &str) -> Message {
    let known: Vec<String> = Activation::EACH.iter().map(|each| each.written()).collect();
    Message::new(format!("this activation is not compiled: {word}"))
        .found(found)
        .expected(known.join(", "))
        .hint("train with one of these")
}

/// The word for an ONNX operation by its name alone; the contract may not know it.
pub(crate) fn word_of_onnx(operation: &str) -> Option<&'static str> {
    let row = ROWS.iter().find(|row| row.onnx == operation && !row.onnx.is_empty())?;
    Some(row.word)
}

/// The function itself, not the contract's bits of it; `None` of one that is not in the table.
pub(crate) fn exact(activation: Activation) -> Option<Box<dyn Fn(f64) -> f64>> {
    if let Activation::LeakyRelu { slope } = activation {
        return Some(Box::new(move |x| x.max(slope * x)));
    }
    let row = ROWS.iter().find(|row| row.word == activation.word())?;
    Some(Box::new(row.exact))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_activation_of_the_contract_has_a_function_for_golden_answers() {
        for each in Activation::EACH {
            let exact = exact(*each).unwrap_or_else(|| panic!("{}", each.word()));
            assert!(exact(0.7).is_finite() && exact(-0.7).is_finite(), "{}", each.word());
        }
        assert_eq!(exact(Activation::LeakyRelu { slope: 0.25 }).unwrap()(-2.0), -0.5);
    }

    /// Published values: torch.nn's pages and Abramowitz and Stegun 7.1 for erf(1 / sqrt 2) = 0.682689492.
    #[test]
    fn the_functions_are_those_of_the_libraries() {
        for (word, x, expected) in [
            ("elu", -1.0, -0.632_120_558_8),
            ("silu", 1.0, 0.731_058_578_6),
            ("gelu", 1.0, 0.841_344_746_1),
            ("gelu_tanh", 1.0, 0.841_191_990_6),
            ("sigmoid", -1.0, 0.268_941_421_4),
            ("softplus", 0.0, std::f64::consts::LN_2),
            ("softplus", 800.0, 800.0),
            ("hard_sigmoid", 1.0, 4.0 / 6.0),
            ("hard_swish", -1.0, -2.0 / 6.0),
        ] {
            let row = ROWS.iter().find(|row| row.word == word).unwrap();
            assert!(
                ((row.exact)(x) - expected).abs() < 1e-9,
                "{word} {x}: {}",
                (row.exact)(x)
            );
        }
    }

    #[test]
    fn a_name_is_taken_where_the_contract_has_its_word_and_in_no_other_case() {
        for row in ROWS.iter().filter(|row| !row.torch.is_empty()) {
            assert_eq!(of_torch(row.torch, Parameters::default()), Activation::find(row.word));
        }
        for row in ROWS.iter().filter(|row| !row.onnx.is_empty()) {
            assert_eq!(word_of_onnx(row.onnx), Some(row.word));
        }
        let number = |number| Parameters {
            number: Some(number),
            ..Parameters::default()
        };
        assert_eq!(of_torch("ELU", number(0.5)), None);
        assert_eq!(
            of_torch("LeakyReLU", number(0.2)),
            Some(Activation::LeakyRelu { slope: 0.2 })
        );
        assert_eq!(of_torch("PReLU", number(0.2)), None);
        assert_eq!(word_of_onnx(""), None);
    }
}
