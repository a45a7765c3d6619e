//! stable-baselines3's VecNormalize: `clip((o - mean) / sqrt(var + epsilon), -clip_obs, clip_obs)`.

use policy::DraftFeature;
use toml_input::Message;

use crate::numpy;
use crate::pickle::{Item, Pickle};
use crate::zip;

const CLASS: &str = "stable_baselines3.common.vec_env.vec_normalize.VecNormalize";

/// Scale, offset and clip of each feature from what `VecNormalize.save` wrote; none where it left observations alone.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<DraftFeature>, Message> {
    if zip::is_archive(bytes) {
        return Err(other_file(
            "an archive, as numpy.savez writes (.npz) and torch.save, too",
        ));
    }
    if bytes.starts_with(b"\x93NUMPY") {
        return Err(other_file("an array of numpy (.npy)"));
    }
    // a pickle begins with a byte that no text has, or ends with the mark of its first protocol, a full stop
    if std::str::from_utf8(bytes).is_ok() && !bytes.ends_with(b".") {
        return Err(other_file("a text, such as JSON"));
    }
    let pickle = Pickle::read(bytes)?;
    match pickle.item(pickle.root) {
        Item::Object(object) if object.class == CLASS => {}
        _ => return Err(unfit("another object")),
    }
    let attributes = pickle.attributes(pickle.root);
    let attribute = |name: &str| pickle.get(attributes, name);
    if attribute("norm_obs").map(|id| pickle.item(id)) == Some(&Item::Bool(false)) {
        return Ok(Vec::new());
    }
    let number = |name: &str| {
        let values = attribute(name).and_then(|id| numpy::array(&pickle, id));
        let one = values
            .and_then(|values| values.first().copied())
            .filter(|value| *value > 0.0);
        one.ok_or_else(|| unfit(&format!("no positive `{name}`")))
    };
    let (epsilon, clip) = (number("epsilon")?, number("clip_obs")?);
    let statistics = attribute("obs_rms").map_or(&[][..], |id| pickle.attributes(id));
    let vector = |name: &str| {
        let values = pickle.get(statistics, name).and_then(|id| numpy::array(&pickle, id));
        values.ok_or_else(|| unfit(&format!("no `obs_rms.{name}` of a Box")))
    };
    let (mean, var) = (vector("mean")?, vector("var")?);
    let sound = mean.len() == var.len() && mean.iter().chain(&var).all(|value| value.is_finite());
    if !sound || !clip.is_finite() || var.iter().any(|var| *var < 0.0) {
        return Err(unfit("statistics that do not hold together"));
    }
    let feature = |(mean, var): (&f64, &f64)| {
        let deviation = (var + epsilon).sqrt();
        DraftFeature {
            affine: Some((1.0 / deviation, -mean / deviation)),
            clip: Some((-clip, clip, "clip_obs of VecNormalize".to_owned())),
            ..DraftFeature::default()
        }
    };
    Ok(mean.iter().zip(&var).map(feature).collect())
}

/// Arrays alone do not say epsilon and clip, nor which is which: what the user knows goes into the contract by hand.
fn other_file(found: &str) -> Message {
    Message::new("this file is no pickle of VecNormalize")
        .found(found)
        .expected("what env.save(\"vecnormalize.pkl\") of a VecNormalize writes")
        .hint(
            "give that file; or leave --vecnormalize out and write each [[feature]] by hand, from its mean and var: scale = 1 / sqrt(var + \
             epsilon), offset = -mean / sqrt(var + epsilon), clip = [-clip_obs, clip_obs], with epsilon 1e-8 and clip_obs 10 unless the \
             training says otherwise",
        )
}

fn unfit(found: &str) -> Message {
    Message::new("these are no statistics of VecNormalize")
        .found(found)
        .expected("what env.save(\"vecnormalize.pkl\") of a VecNormalize writes")
        .hint("the statistics of the training belong to the model that was saved with them")
}
