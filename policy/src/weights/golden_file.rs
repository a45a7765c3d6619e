//! Golden answers as the file that a contract names.

use safetensors::tensor::{Dtype, TensorView, serialize};
use toml_input::Message;

use crate::model::{Golden, Policy};

/// The safetensors file that says these answers of this policy's network: `obs`, and `action` or `duty`, of several outputs
/// `action_NAME` or `duty_NAME`. Q values and gains are not written.
///
/// # Errors
/// If the library cannot make the file.
pub fn golden_file(policy: &Policy, golden: &Golden) -> Result<Vec<u8>, Message> {
    let features = policy.features.len();
    let floats = |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let integers = |values: &[u32]| -> Vec<u8> { values.iter().flat_map(|x| (*x as i32).to_le_bytes()).collect() };
    let count = golden.count;
    let mut tensors = vec![(
        "obs".to_owned(),
        Dtype::F32,
        vec![count, features],
        floats(&golden.observations),
    )];
    let one = [(None, &golden.action_indices, &golden.duties)];
    let paths = policy.paths();
    let several = paths.iter().zip(&golden.outputs);
    let several = several.map(|(path, own)| (path.name, &own.action_indices, &own.duties));
    for (name, actions, duties) in one.into_iter().chain(several) {
        let named = |what: &str| name.map_or_else(|| what.to_owned(), |name| format!("{what}_{name}"));
        if !actions.is_empty() {
            tensors.push((named("action"), Dtype::I32, vec![count], integers(actions)));
        }
        if !duties.is_empty() {
            tensors.push((named("duty"), Dtype::F32, vec![count], floats(duties)));
        }
    }
    let fault =
        |error: safetensors::SafeTensorError| Message::new("cannot make golden answers").found(error.to_string());
    let views = tensors.iter().map(|(name, dtype, shape, bytes)| {
        Ok((
            name.as_str(),
            TensorView::new(*dtype, shape.clone(), bytes).map_err(fault)?,
        ))
    });
    let views: Vec<_> = views.collect::<Result<_, _>>()?;
    serialize(views, None).map_err(fault)
}
