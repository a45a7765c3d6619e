//! MAT files: numeric variables, fields and cells as named tensors.

use mat::{Error, Limits, MOST_ITEMS, Numbers, Value};
use policy::NamedTensor;
use policy::limits::{MAX_TENSOR_NAME_CHARS, MAX_WEIGHT_BYTES};
use toml_input::Message;

pub(crate) use mat::is_mat;

/// How MATLAB saves the parameters of an agent so that they are read here.
const SAVE: &str = "in MATLAB: p = cellfun(@extractdata, getLearnableParameters(actor), 'UniformOutput', false); save('actor.mat', 'p', '-v7')";

const LIMITS: Limits = Limits {
    most_bytes: MAX_WEIGHT_BYTES as usize,
    // weights hardly get smaller; of zeros alone zlib makes a thousandth
    most_growth: 100,
    most_name: MAX_TENSOR_NAME_CHARS,
};

/// Numeric variables, fields and cells, as named tensors; the last axis runs fastest, other than in the file.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<NamedTensor>, Message> {
    let mut found = Vec::new();
    for variable in mat::read(bytes, LIMITS).map_err(told)? {
        visit(&variable.value, &variable.name, &mut found)?;
    }
    if found.is_empty() {
        return Err(Message::new("the MAT file holds no matrices of floats")
            .expected("weights and biases, as variables, in a struct or in a cell array")
            .hint(SAVE));
    }
    found.sort_by(|a: &NamedTensor, b| a.name.cmp(&b.name));
    Ok(found)
}

fn told(error: Error) -> Message {
    match error {
        Error::Newer => Message::new("this is a MAT file of version 7.3, which is HDF5")
            .found("save -v7.3")
            .expected("a MAT file of version 7 or 6")
            .hint("save it anew: save('actor.mat', 'p', '-v7')"),
        Error::BigEndian => Message::new("the numbers of this MAT file are stored big-endian")
            .expected("little-endian")
            .hint(SAVE),
        Error::Unpacked { packed, most } => Message::new("a compressed variable of the MAT file cannot be read")
            .found(format!("{packed} bytes that are damaged, or hold more than {most}"))
            .expected("a network of up to 64 MiB")
            .hint("save it without compression: save('actor.mat', 'p', '-v6')"),
        Error::Nested { name } => Message::new("the MAT file is nested deeper than a network is")
            .found(format!("`{name}`"))
            .expected("matrices, in a struct or in a cell array")
            .hint(SAVE),
        Error::Parts { name, count } => Message::new(format!("`{name}` has more parts than a network"))
            .found(count.to_string())
            .expected(format!("at most {MOST_ITEMS}"))
            .hint(SAVE),
        Error::Broken => Message::new("this is not a sound MAT file")
            .found("elements that do not hold together")
            .expected("a MAT file of version 7 or 6")
            .hint("copy or save the file again"),
    }
}

fn visit(value: &Value, name: &str, found: &mut Vec<NamedTensor>) -> Result<(), Message> {
    match value {
        Value::Cells(cells) => visit_cells(cells, name, found),
        Value::Structs { names, rows } => {
            for (index, row) in rows.iter().enumerate() {
                for (own, field) in names.iter().zip(row) {
                    // of several structs in one array each has its number
                    let inner = match rows.len() {
                        1 => format!("{name}.{own}"),
                        _ => format!("{name}.{}.{own}", index + 1),
                    };
                    visit(field, &inner, found)?;
                }
            }
            Ok(())
        }
        // text and whole numbers are no weights
        Value::Text(_) => Ok(()),
        Value::Numbers(numbers) if numbers.is_integer => Ok(()),
        Value::Numbers(numbers) => {
            found.extend(tensor(numbers, name)?);
            Ok(())
        }
        Value::Object => Err(
            Message::new(format!("`{name}` is an object of MATLAB, which is not read"))
                .found("a dlarray, a table, a network or an agent")
                .expected("matrices, in a struct or in a cell array")
                .hint(SAVE),
        ),
        Value::Sparse => Err(Message::new(format!("`{name}` is a sparse matrix"))
            .expected("full matrices")
            .hint("save full(W)")),
    }
}

/// Cells of weights and biases by turns are layers; others are numbered.
fn visit_cells(cells: &[Value], name: &str, found: &mut Vec<NamedTensor>) -> Result<(), Message> {
    let shape = |cell: &Value| match cell {
        Value::Numbers(numbers) => numbers.shape.clone(),
        _ => Vec::new(),
    };
    let is_layer = |pair: &[Value]| match pair {
        [weights, bias] => {
            let bias = shape(bias);
            let outputs = shape(weights).first().copied();
            outputs.is_some_and(|outputs| bias == [outputs, 1] || bias == [1, outputs])
        }
        _ => false,
    };
    let by_turns = cells.chunks(2).all(is_layer);
    for (index, cell) in cells.iter().enumerate() {
        let inner = if by_turns {
            let part = if index % 2 == 0 { "Weights" } else { "Bias" };
            format!("{name}.{}.{part}", index / 2 + 1)
        } else {
            format!("{name}.{}", index + 1)
        };
        visit(cell, &inner, found)?;
    }
    Ok(())
}

fn tensor(numbers: &Numbers, name: &str) -> Result<Option<NamedTensor>, Message> {
    if numbers.is_complex {
        return Err(Message::new(format!("`{name}` is complex"))
            .expected("real matrices")
            .hint("save real(W)"));
    }
    if numbers.values.iter().any(|value| !value.is_finite()) {
        return Err(Message::new(format!("`{name}` holds a number that is not finite"))
            .expected("finite numbers")
            .hint("the training has diverged, or the file was damaged"));
    }
    // an empty matrix is no tensor
    if numbers.values.is_empty() {
        return Ok(None);
    }
    if name.len() > MAX_TENSOR_NAME_CHARS {
        return Err(told(Error::Broken));
    }
    Ok(Some(NamedTensor {
        name: name.to_owned(),
        shape: numbers.shape.clone(),
        values: Some(by_rows(&numbers.values, &numbers.shape)),
    }))
}

/// From columns, which run fastest in MATLAB, to rows.
fn by_rows(stored: &[f64], shape: &[usize]) -> Vec<f64> {
    let place = |index: usize| {
        let (mut rest, mut place) = (index, 0);
        let mut stride: usize = stored.len();
        for size in shape.iter().rev() {
            stride /= size.max(&1);
            place += (rest % size.max(&1)) * stride;
            rest /= size.max(&1);
        }
        stored.get(place).copied().unwrap_or_default()
    };
    (0..stored.len()).map(place).collect()
}
