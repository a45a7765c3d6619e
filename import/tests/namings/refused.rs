//! What no chain of dense layers computes, or what does not say which chain.

use super::{Refused, Row, Tensors, dense, named, row, three, with};

pub fn rows() -> Vec<Row> {
    let q = || three(["network.0", "network.2", "network.4"]);
    let recurrent = |cell: &str| -> Tensors {
        let tensors = [
            named(&format!("{cell}.weight_ih_l0"), &[64, 6]),
            named(&format!("{cell}.weight_hh_l0"), &[64, 16]),
        ];
        [tensors.to_vec(), dense("head", 5, 16)].concat()
    };
    let two = [dense("network.0", 16, 6), dense("network.2", 255, 16)].concat();
    let many = [dense("network.0", 16, 6), dense("network.2", 612, 16)].concat();
    let mixed = [
        named("l1.weight", &[6, 16]),
        named("l1.bias", &[16]),
        named("l3.weight", &[5, 16]),
        named("l3.bias", &[5]),
    ];
    let norm: &[(&str, &[usize])] = &[
        ("bn1.weight", &[16]),
        ("bn1.bias", &[16]),
        ("bn1.running_mean", &[16]),
        ("bn1.running_var", &[16]),
    ];
    vec![
        row("CleanRL C51", with(two, &[("atoms", &[51])]), Refused(&["categorical"])),
        row("C51 without its support", many, Refused(&["612 outputs"])),
        row(
            "LayerNorm",
            with(q(), &[("network.1.weight", &[16]), ("network.1.bias", &[16])]),
            Refused(&["LayerNorm"]),
        ),
        row(
            "BatchNorm beside layers without numbers",
            with([dense("fc1", 16, 6), dense("fc2", 5, 16)].concat(), norm),
            Refused(&["which side of the activation"]),
        ),
        row("LSTM", recurrent("lstm"), Refused(&["recurrent"])),
        row("GRU", recurrent("rnn"), Refused(&["recurrent"])),
        row(
            "convolution",
            with(q(), &[("cnn.0.weight", &[8, 6, 3])]),
            Refused(&["convolution"]),
        ),
        row(
            "two heads",
            [dense("body.0", 16, 6), dense("left", 5, 16), dense("right", 5, 16)].concat(),
            Refused(&["more than one chain"]),
        ),
        row(
            "a tensor that nobody knows",
            with(q(), &[("network.gain", &[16])]),
            Refused(&["network.gain"]),
        ),
        row(
            "one transposed weight",
            mixed.to_vec(),
            Refused(&["others as [inputs, outputs]"]),
        ),
    ]
}

/// A scale for each value without statistics, by the names of several libraries.
pub fn layer_norms() -> Vec<Row> {
    let q = || three(["network.0", "network.2", "network.4"]);
    vec![
        row(
            "LayerNorm by its own name",
            with(q(), &[("layer_norm1.weight", &[16]), ("layer_norm1.bias", &[16])]),
            Refused(&["LayerNorm", "layer_norm1.weight", "BatchNorm1d"]),
        ),
        row(
            "LayerNorm without a bias",
            with(q(), &[("ln.weight", &[16])]),
            Refused(&["LayerNorm"]),
        ),
        row(
            "LayerNorm of Keras",
            with(
                q(),
                &[
                    ("layer_normalization/gamma", &[16]),
                    ("layer_normalization/beta", &[16]),
                ],
            ),
            Refused(&["LayerNorm"]),
        ),
        row(
            "LayerNorm of Flax",
            with(q(), &[("LayerNorm_0/scale", &[16]), ("LayerNorm_0/bias", &[16])]),
            Refused(&["LayerNorm"]),
        ),
        row(
            "LayerNorm in an actor of stable-baselines3",
            with(
                [dense("latent_pi.0", 16, 6), dense("mu", 1, 16), dense("log_std", 1, 16)].concat(),
                &[("latent_pi.1.weight", &[16]), ("latent_pi.1.bias", &[16])],
            ),
            Refused(&["LayerNorm", "latent_pi.1"]),
        ),
    ]
}
