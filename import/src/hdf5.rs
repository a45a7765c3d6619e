//! HDF5 is not read: its format is a file system, and each library that writes one has a plain way out.

use toml_input::Message;

/// The way out of Keras.
pub(crate) const KERAS: &str =
    "in Python: model.export(\"policy.onnx\", format=\"onnx\"), and `policyc new policy.onnx`";

const MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";

/// Whether a file is HDF5; a MAT file of version 7.3 is one behind a header of 512 bytes.
pub(crate) fn is_file(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// The refusal, with the way out of the library that wrote the file.
pub(crate) fn refused(bytes: &[u8]) -> Message {
    // names of groups stand at the beginning
    let begin = bytes.get(..bytes.len().min(1 << 16)).unwrap_or_default();
    let has = |word: &str| begin.windows(word.len()).any(|window| window == word.as_bytes());
    let (found, hint) = match () {
        // groups of every Keras 3 model hold a group of variables by number
        () if has("vars") && has("layers") => ("a .weights.h5 of Keras 3", KERAS),
        () if has("keras_version") || has("model_weights") => ("an .h5 of Keras", KERAS),
        () => (
            "HDF5",
            "save the tensors by safetensors.numpy.save_file({name: array, ...}, \"weights.safetensors\")",
        ),
    };
    Message::new("an HDF5 file is not read")
        .found(found)
        .expected("ONNX, safetensors, a torch file, or a model of stable-baselines3")
        .hint(hint)
}
