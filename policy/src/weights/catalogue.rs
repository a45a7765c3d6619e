//! The texts of all faults of safetensors files, tensors and layer chains.

use toml_input::Message;

use crate::limits;

pub(crate) fn malformed(found: &str, hint: Option<&str>) -> Message {
    Message::new("this is not a sound safetensors file")
        .found(found)
        .expected("an 8-byte header length, a JSON header, and data that it covers without gaps")
        .maybe_hint(hint.map(str::to_owned))
}

pub(crate) fn cut_off(found: usize, described: u64) -> Message {
    Message::new("the file is cut off")
        .found(format!("{found} bytes of data"))
        .expected(format!("{described} bytes of data, as the header says"))
        .hint("copy or download the file again")
}

pub(crate) fn weights_as_contract() -> Message {
    Message::new("this is a file of weights, not a contract")
        .expected("a policy.toml, or the folder that holds it")
        .hint("`policyc new <this file> --out policy.toml` writes a contract to fill in")
}

pub(crate) fn other_format(found: &str, hint: &str) -> Message {
    Message::new("this is not a safetensors file")
        .found(found)
        .expected("a safetensors file")
        .hint(hint)
}

pub(crate) fn duplicate_key(key: &str) -> Message {
    Message::new("a key stands twice in the header")
        .found(format!("`{}` twice", key.escape_debug()))
        .expected("each key once")
        .hint("readers disagree about which one counts: export the file again")
}

pub(crate) fn too_many_tensors(found: usize) -> Message {
    Message::new("too many tensors")
        .found(found.to_string())
        .expected(format!("at most {}", limits::MAX_TENSORS))
        .hint("export the policy network alone, without optimiser or replay buffer")
}

pub(crate) fn no_tensors() -> Message {
    Message::new("the file holds no tensors")
        .found("0")
        .expected("weights and biases of the network")
}

/// `others`: how many more of the file's names are such.
pub(crate) fn odd_name(name: &str, others: usize) -> Message {
    let short: String = name.chars().take(limits::MAX_TENSOR_NAME_CHARS).collect();
    let more = match others {
        0 => String::new(),
        others => format!(" and {others} more"),
    };
    Message::new("this tensor name is not safe to print or to use in a path")
        .found(format!("\"{}\"{more}", short.escape_debug()))
        .expected("1 to 128 of A-Z, a-z, 0-9, _ . / : - without `..`")
        .hint("name each layer when you save: l0.weight and l0.bias, l1.weight, ...")
}

pub(crate) fn empty_tensor(shape: &[usize]) -> Message {
    Message::new("the tensor has no elements or no shape")
        .found(format!("shape {shape:?}"))
        .expected("at least one element along at least one axis")
}

pub(crate) fn wrong_dtype(found: &str, allowed: &str) -> Message {
    let quantised = found.starts_with(['I', 'U']) || found.starts_with("F8");
    let hint = quantised.then(|| "quantised weights are not read: export the float ones".to_owned());
    Message::new("the tensor has a type that is not read here")
        .found(found)
        .expected(allowed)
        .maybe_hint(hint)
}

pub(crate) fn not_finite(index: usize, value: f64) -> Message {
    Message::new("the tensor holds a number that is not finite")
        .found(format!("{} at index {index}", value.to_string().to_lowercase()))
        .expected("finite numbers")
        .hint("the training has diverged, or the file was damaged")
}

pub(crate) fn beyond_f32(index: usize, value: f64) -> Message {
    Message::new("the tensor holds a number too large for f32")
        .found(format!("{value:e} at index {index}"))
        .expected("magnitudes up to 3.4e38")
}

pub(crate) fn wrong_shape(what: &str, found: &[usize], expected: &[usize], hint: Option<String>) -> Message {
    Message::new(format!("the shape of {what} does not fit"))
        .found(format!("shape {found:?}"))
        .expected(format!("shape {expected:?}"))
        .maybe_hint(hint)
}

pub(crate) fn missing_tensor(name: &str, hint: &str) -> Message {
    Message::new(format!("the tensor `{name}` is missing"))
        .found("no such tensor")
        .expected(format!("`{name}`"))
        .hint(hint)
}

pub(crate) fn extra_bias(name: &str) -> Message {
    Message::new("there is a bias although the contract says `bias = false`")
        .found(format!("`{name}`"))
        .expected("no bias")
        .hint("remove `bias = false` from [network]")
}

pub(crate) fn unknown_layer(name: &str, all: &str) -> Message {
    Message::new(format!("there is no layer `{}` in the weights", name.escape_debug()))
        .found(format!("layers: {all}"))
        .expected("a tensor name without `.weight`")
}

pub(crate) fn unknown_prefix(prefix: &str, all: &str) -> Message {
    Message::new(format!("no layer begins with the prefix `{}`", prefix.escape_debug())).found(format!("layers: {all}"))
}

pub(crate) fn repeated_layer(name: &str) -> Message {
    Message::new(format!("the layer `{}` is listed twice", name.escape_debug())).expected("each layer once")
}

pub(crate) fn several_chains(chains: &str) -> Message {
    Message::new("more than one chain of layers fits the contract")
        .found(chains)
        .expected("exactly one")
        .hint("choose one in [network]: `prefix = \"...\"`, or list the layers: `layers = [\"...\", \"...\"]`")
}

pub(crate) fn no_dense_layer(shape: &[usize]) -> Message {
    Message::new("this tensor belongs to no dense layer: left out, the network would compute something else")
        .found(format!("shape {shape:?}"))
        .expected("weights and biases of dense layers only")
        .hint("fold it into the layers before exporting; if it is not part of the network, name the layers: layers = [...]")
}

pub(crate) fn no_layers(names: &str) -> Message {
    Message::new("the file holds no dense layer")
        .found(format!("tensors {names}"))
        .expected("tensors named <layer>.weight [out, in] and <layer>.bias [out] (or kernel [in, out])")
        .hint("rename them when exporting, as `l1.weight` for `l1.w`; a PyTorch module's state_dict() has such names")
}

pub(crate) fn too_deep(found: usize) -> Message {
    Message::new("the network has too many layers")
        .found(found.to_string())
        .expected(format!("at most {}", limits::MAX_LAYERS))
}

pub(crate) fn too_wide(found: usize) -> Message {
    Message::new("the layer is too wide")
        .found(format!("{found} outputs"))
        .expected(format!("at most {}", limits::MAX_WIDTH))
}

pub(crate) fn no_order(layers: &str) -> Message {
    Message::new("the layers do not join up into a chain")
        .found(layers)
        .expected("each layer's inputs equal to the outputs of the one before")
        .hint("list the layers in order: `layers = [\"...\", \"...\"]` in [network]")
}

// --- golden vectors ---

pub(crate) fn golden_missing(name: &str, expected: &str) -> Message {
    Message::new(format!("golden vectors need the tensor `{name}`"))
        .expected(expected)
        .hint("the tensors are called obs, q and action: rename those that are there")
}

pub(crate) fn golden_continuous(rows: usize, outputs: usize) -> Message {
    let (head, of_each) = match outputs {
        1 => ("continuous head", format!("[{rows}]")),
        _ => ("gain schedule", format!("[{rows}, {outputs}]")),
    };
    Message::new(format!("golden vectors of a {head} need the tensor `duty` or `output`"))
        .expected(format!("`duty` f32 [{rows}] or `output` f32 {of_each}, or both"))
        .hint(
            "duty is what the trainer's actor asks for, as a duty: its action taken through scale and offset; output is the \
             network's last layer, before squash or clip",
        )
}

pub(crate) fn golden_several([rows, columns]: [usize; 2], each: &str, silent: &[&str]) -> Message {
    Message::new(format!("golden vectors say nothing of the outputs {}", silent.join(", ")))
        .expected(format!("`output` f32 [{rows}, {columns}], the network's last layer, or {each}, [{rows}] each"))
        .hint(
            "action_NAME holds the chosen action of an output, duty_NAME what the trainer's actor asks for, as a duty; output is the last \
             layer as it is, before argmax, squash or clip",
        )
}

pub(crate) fn golden_layer_twice() -> Message {
    Message::new("golden vectors hold the last layer twice")
        .found("`output` and `q`")
        .expected("one of them")
}

pub(crate) fn golden_stranger(name: &str, known: &[String]) -> Message {
    Message::new(format!(
        "the tensor `{}` is the answer of no output",
        name.escape_debug()
    ))
    .expected(format!("one of {}", known.join(", ")))
    .did_you_mean(name, known.iter().map(String::as_str))
}

pub(crate) fn golden_law(text: &str) -> Message {
    Message::new("the golden duties cannot be held against the law: an observation does not tell all that it reads")
        .found(format!(
            "`{text}`, which is no number and no source of a feature without filters"
        ))
        .expected("a base that is a number or the source of a feature, and factors that are features or such sources")
        .hint("give `output`, the network's last layer before squash or clip, in the place of `duty`")
}

pub(crate) fn golden_shape(found: &[usize], features: usize) -> Message {
    let hint = match found {
        [first, _] if *first == features => "the vectors stand in columns: save the transposed array, `obs.T.copy()`",
        [_] => "one vector is still a table of one row: `obs[None, :]`",
        _ => "one row for each vector, one column for each [[feature]], in their order",
    };
    Message::new("the observations do not fit the contract")
        .found(format!("shape {found:?}"))
        .expected(format!(
            "shape [rows, {features}]: the contract has {features} features"
        ))
        .hint(hint)
}

pub(crate) fn golden_outside(row: usize, feature: &str, value: f64, low: f64, high: f64) -> Message {
    Message::new(format!(
        "row {row} holds an observation that the controller can never see"
    ))
    .found(format!("`{feature}` = {value}"))
    .expected(format!(
        "{low} to {high}, from the signals' ranges, the filters and the clip"
    ))
}

/// [`golden_outside`] of the first row, with how many more and what to do.
pub(crate) fn golden_outside_rows(first: Message, outside: usize, rows: usize) -> Message {
    const DIFFER: &str = "Either order, scale or clip of the features, or a number of [parameters] such as a reference, differ from the training, which `policyc replay` tells of a log; or the";
    if outside == rows {
        return first.hint(format!(
            "all {rows} rows lie outside, and none is left to check with. {DIFFER} `range` of a signal is not that of the training"
        ));
    }
    let share = (1000.0 * outside as f64 / rows as f64).ceil() / 1000.0;
    let lie = if outside == 1 { "lies" } else { "lie" };
    first.hint(format!(
        "{outside} of {rows} rows {lie} outside. {DIFFER} training left the `range` of a signal: then golden_outside = {share} in [network] leaves \
         these rows out"
    ))
}

pub(crate) fn golden_action(row: usize, found: &str, actions: usize) -> Message {
    Message::new(format!("row {row} holds an action that does not exist"))
        .found(found)
        .expected(format!("0 to {}", actions.saturating_sub(1)))
}

pub(crate) fn golden_not_greedy(row: usize, action: u32, best: usize) -> Message {
    Message::new(format!("row {row}: the action is not the one with the largest q value"))
        .found(format!("action {action}"))
        .expected(format!("action {best}"))
        .hint("record the greedy action, without exploration")
}
