//! MAT files of level 5: what MATLAB's `save -v7` and `-v6`, Octave's `save -v7` and scipy write.
//!
//! ```text
//!   128 bytes of text, version and byte order, then elements:
//!   type, size, content, filled up to 8 bytes     type 15 holds an element in zlib
//!   a matrix holds elements: class, axes, name, numbers; a cell holds matrices, a struct names of fields and matrices
//! ```
//!
//! The crate for this inflates without a bound, reads no cells and had no release in two years; cells are what MATLAB's own
//! agents give their parameters in. The zlib is a crate's, whose inflation takes a bound.

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use policy::NamedTensor;
use policy::limits::{MAX_TENSOR_NAME_CHARS, MAX_WEIGHT_BYTES};
use toml_input::Message;

/// How MATLAB saves the parameters of an agent so that they are read here.
const SAVE: &str = "in MATLAB: p = cellfun(@extractdata, getLearnableParameters(actor), 'UniformOutput', false); save('actor.mat', 'p', '-v7')";

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;
// cells within cells within structs: people stop at two
const DEEPEST: usize = 8;
// an array of small cells could hold more items than anybody writes
const MOST_ITEMS: usize = 10_000;
// weights hardly get smaller; of zeros alone zlib makes a thousandth
const MOST_GROWTH: usize = 100;
const SMALL: usize = 1 << 20;

/// Whether `bytes` begin as a MAT file of level 5, or as one of version 7.3.
pub(crate) fn is_mat(bytes: &[u8]) -> bool {
    matches!(
        bytes.get(124..128),
        Some([0, 1 | 2, b'I', b'M'] | [1 | 2, 0, b'M', b'I'])
    )
}

/// Numeric variables, fields and cells, as named tensors; the last axis runs fastest, other than in the file.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<NamedTensor>, Message> {
    match bytes.get(124..128) {
        Some([0, 1, b'I', b'M']) => {}
        Some([0, 2, b'I', b'M']) => return Err(newer()),
        _ => {
            return Err(Message::new("the numbers of this MAT file are stored big-endian")
                .expected("little-endian")
                .hint(SAVE));
        }
    }
    let mut reader = Reader {
        found: Vec::new(),
        left: usize::try_from(MAX_WEIGHT_BYTES).unwrap_or(usize::MAX),
        items: 0,
    };
    let mut rest = bytes.get(128..).unwrap_or_default();
    while !rest.is_empty() {
        let (element, behind) = element(rest)?;
        rest = behind;
        match element.kind {
            COMPRESSED => {
                let inflated = reader.inflate(element.data)?;
                let (inner, _) = self::element(&inflated)?;
                reader.top(inner)?;
            }
            _ => reader.top(element)?,
        }
    }
    if reader.found.iter().all(|tensor| tensor.values.is_none()) {
        return Err(Message::new("the MAT file holds no matrices of floats")
            .expected("weights and biases, as variables, in a struct or in a cell array")
            .hint(SAVE));
    }
    reader.found.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(reader.found)
}

/// Version 7.3 is HDF5.
fn newer() -> Message {
    Message::new("this is a MAT file of version 7.3, which is HDF5")
        .found("save -v7.3")
        .expected("a MAT file of version 7 or 6")
        .hint("save it anew: save('actor.mat', 'p', '-v7')")
}

struct Element<'a> {
    kind: u32,
    data: &'a [u8],
}

/// The first element and what stands behind it.
fn element(bytes: &[u8]) -> Result<(Element<'_>, &[u8]), Message> {
    let first = u32_at(bytes, 0)?;
    // up to four bytes stand in the tag itself, with their number in its upper half
    if first >> 16 != 0 {
        let size = (first >> 16) as usize;
        let data = bytes.get(4..8).and_then(|four| four.get(..size)).ok_or_else(broken)?;
        let kind = first & 0xffff;
        return Ok((Element { kind, data }, bytes.get(8..).unwrap_or_default()));
    }
    let size = usize::try_from(u32_at(bytes, 4)?).map_err(|_| broken())?;
    let data = bytes.get(8..).and_then(|rest| rest.get(..size)).ok_or_else(broken)?;
    let filled = if first == COMPRESSED {
        size
    } else {
        size.next_multiple_of(8)
    };
    let behind = bytes.get(8 + filled..).unwrap_or_default();
    Ok((Element { kind: first, data }, behind))
}

fn u32_at(bytes: &[u8], at: usize) -> Result<u32, Message> {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
    four.map(|four| u32::from_le_bytes(*four)).ok_or_else(broken)
}

struct Reader {
    found: Vec<NamedTensor>,
    /// Bytes that may still be inflated.
    left: usize,
    items: usize,
}

/// The parts that every matrix begins with.
struct Matrix<'a> {
    class: u8,
    is_complex: bool,
    shape: Vec<usize>,
    name: String,
    rest: &'a [u8],
}

impl Matrix<'_> {
    fn count(&self) -> Result<usize, Message> {
        let product = |product: usize, size: &usize| product.checked_mul(*size);
        self.shape.iter().try_fold(1, product).ok_or_else(broken)
    }
}

impl Reader {
    fn inflate(&mut self, packed: &[u8]) -> Result<Vec<u8>, Message> {
        let limit = self
            .left
            .min(packed.len().saturating_mul(MOST_GROWTH).saturating_add(SMALL));
        let inflated = decompress_to_vec_zlib_with_limit(packed, limit).map_err(|_| {
            Message::new("a compressed variable of the MAT file cannot be read")
                .found(format!(
                    "{} bytes that are damaged, or hold more than {limit}",
                    packed.len()
                ))
                .expected("a network of up to 64 MiB")
                .hint("save it without compression: save('actor.mat', 'p', '-v6')")
        })?;
        self.left -= inflated.len().min(self.left);
        Ok(inflated)
    }

    /// A variable; what is no matrix belongs to MATLAB.
    fn top(&mut self, element: Element<'_>) -> Result<(), Message> {
        if element.kind != MATRIX {
            return Ok(());
        }
        let matrix = matrix(element.data)?;
        // the objects' own store has no name
        if matrix.name.is_empty() {
            return Ok(());
        }
        let name = matrix.name.clone();
        self.visit(&matrix, &name, 0)
    }

    fn visit(&mut self, matrix: &Matrix<'_>, name: &str, depth: usize) -> Result<(), Message> {
        self.items += 1;
        if depth > DEEPEST || self.items > MOST_ITEMS {
            return Err(Message::new("the MAT file is nested deeper than a network is")
                .found(format!("`{name}`"))
                .expected("matrices, in a struct or in a cell array")
                .hint(SAVE));
        }
        match matrix.class {
            1 => self.cell(matrix, name, depth),
            2 => self.fields(matrix, name, depth),
            // text and whole numbers are no weights
            4 | 8..=15 => Ok(()),
            6 | 7 => self.numbers(matrix, name),
            3 | 16 | 17 => Err(
                Message::new(format!("`{name}` is an object of MATLAB, which is not read"))
                    .found("a dlarray, a table, a network or an agent")
                    .expected("matrices, in a struct or in a cell array")
                    .hint(SAVE),
            ),
            5 => Err(Message::new(format!("`{name}` is a sparse matrix"))
                .expected("full matrices")
                .hint("save full(W)")),
            _ => Err(broken()),
        }
    }

    /// Cells of weights and biases by turns are layers; others are numbered.
    fn cell(&mut self, matrix: &Matrix<'_>, name: &str, depth: usize) -> Result<(), Message> {
        let (cells, _) = matrices(matrix.rest, matrix.count()?, name)?;
        let is_column = |cell: &Matrix<'_>, outputs: usize| cell.shape == [outputs, 1] || cell.shape == [1, outputs];
        let is_layer = |pair: &[Matrix<'_>]| match pair {
            [weights, bias] => weights.shape.first().is_some_and(|outputs| is_column(bias, *outputs)),
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
            self.visit(cell, &inner, depth + 1)?;
        }
        Ok(())
    }

    fn fields(&mut self, matrix: &Matrix<'_>, name: &str, depth: usize) -> Result<(), Message> {
        let (length, rest) = element(matrix.rest)?;
        let length = usize::try_from(u32_at(length.data, 0)?).map_err(|_| broken())?;
        let (names, rest) = element(rest)?;
        if length == 0 {
            return Err(broken());
        }
        let names: Vec<String> = names.data.chunks(length).map(text).collect();
        let count = matrix.count()?.checked_mul(names.len()).ok_or_else(broken)?;
        let (fields, _) = matrices(rest, count, name)?;
        for (index, field) in fields.iter().enumerate() {
            let own = names.get(index % names.len()).map_or("", String::as_str);
            // of several structs in one array each has its number
            let inner = match matrix.count()? {
                1 => format!("{name}.{own}"),
                _ => format!("{name}.{}.{own}", index / names.len() + 1),
            };
            self.visit(field, &inner, depth + 1)?;
        }
        Ok(())
    }

    fn numbers(&mut self, matrix: &Matrix<'_>, name: &str) -> Result<(), Message> {
        if matrix.is_complex {
            return Err(Message::new(format!("`{name}` is complex"))
                .expected("real matrices")
                .hint("save real(W)"));
        }
        let (content, _) = element(matrix.rest)?;
        let stored = floats(&content).ok_or_else(broken)?;
        if stored.len() != matrix.count()? {
            return Err(broken());
        }
        if stored.iter().any(|value| !value.is_finite()) {
            return Err(Message::new(format!("`{name}` holds a number that is not finite"))
                .expected("finite numbers")
                .hint("the training has diverged, or the file was damaged"));
        }
        // an empty matrix is no tensor
        if stored.is_empty() {
            return Ok(());
        }
        if name.len() > MAX_TENSOR_NAME_CHARS {
            return Err(broken());
        }
        self.found.push(NamedTensor {
            name: name.to_owned(),
            shape: matrix.shape.clone(),
            values: Some(by_rows(&stored, &matrix.shape)),
        });
        Ok(())
    }
}

/// So many matrices, one behind the other.
fn matrices<'a>(mut rest: &'a [u8], count: usize, name: &str) -> Result<(Vec<Matrix<'a>>, &'a [u8]), Message> {
    if count > MOST_ITEMS {
        return Err(Message::new(format!("`{name}` has more parts than a network"))
            .found(count.to_string())
            .expected(format!("at most {MOST_ITEMS}"))
            .hint(SAVE));
    }
    let mut list = Vec::new();
    for _ in 0..count {
        let (inner, behind) = element(rest)?;
        if inner.kind != MATRIX {
            return Err(broken());
        }
        list.push(matrix(inner.data)?);
        rest = behind;
    }
    Ok((list, rest))
}

fn matrix(data: &[u8]) -> Result<Matrix<'_>, Message> {
    // an empty cell that was never set has nothing inside
    if data.is_empty() {
        return Ok(Matrix {
            class: 4,
            is_complex: false,
            shape: vec![0, 0],
            name: String::new(),
            rest: data,
        });
    }
    let (flags, rest) = element(data)?;
    let flags = u32_at(flags.data, 0)?;
    let (class, is_complex) = ((flags & 0xff) as u8, flags & 0x800 != 0);
    // an opaque object has its name where others have their axes
    if class == 17 {
        let (name, _) = element(rest)?;
        return Ok(Matrix {
            class,
            is_complex,
            shape: Vec::new(),
            name: text(name.data),
            rest: &[],
        });
    }
    let (axes, rest) = element(rest)?;
    let (name, rest) = element(rest)?;
    let size = |four: &[u8; 4]| usize::try_from(i32::from_le_bytes(*four)).map_err(|_| broken());
    Ok(Matrix {
        class,
        is_complex,
        shape: axes
            .data
            .as_chunks::<4>()
            .0
            .iter()
            .map(size)
            .collect::<Result<_, _>>()?,
        name: text(name.data),
        rest,
    })
}

/// A name up to its first zero; MATLAB's have letters, digits and underscores.
fn text(bytes: &[u8]) -> String {
    let bytes = bytes.iter().take_while(|byte| **byte != 0).take(MAX_TENSOR_NAME_CHARS);
    bytes
        .map(|byte| char::from(*byte))
        .map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' })
        .collect()
}

/// Numbers of any type: MATLAB stores those of a matrix in the smallest that holds them all.
fn floats(element: &Element<'_>) -> Option<Vec<f64>> {
    fn each<const N: usize>(data: &[u8], number: impl Fn([u8; N]) -> f64) -> Option<Vec<f64>> {
        let (numbers, rest) = data.as_chunks::<N>();
        rest.is_empty()
            .then(|| numbers.iter().map(|bytes| number(*bytes)).collect())
    }
    let data = element.data;
    match element.kind {
        1 => each(data, |b| f64::from(i8::from_le_bytes(b))),
        2 => each(data, |b: [u8; 1]| f64::from(b[0])),
        3 => each(data, |b| f64::from(i16::from_le_bytes(b))),
        4 => each(data, |b| f64::from(u16::from_le_bytes(b))),
        5 => each(data, |b| f64::from(i32::from_le_bytes(b))),
        6 => each(data, |b| f64::from(u32::from_le_bytes(b))),
        7 => each(data, |b| f64::from(f32::from_le_bytes(b))),
        9 => each(data, f64::from_le_bytes),
        12 => each(data, |b| i64::from_le_bytes(b) as f64),
        13 => each(data, |b| u64::from_le_bytes(b) as f64),
        _ => None,
    }
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

fn broken() -> Message {
    Message::new("this is not a sound MAT file")
        .found("elements that do not hold together")
        .expected("a MAT file of version 7 or 6")
        .hint("copy or save the file again")
}
