//! MAT files of version 7.3 as a tree of values: HDF5 behind 512 bytes of text.
//!
//! ```text
//!   dataset, MATLAB_class "double", [cols, rows]     a matrix of rows x cols, whose first axis runs fastest
//!   group                                            a struct of its members
//!   group whose members are references               an array of structs, one for each reference
//!   dataset of references, "cell"                    a cell array; what it refers to lies in `#refs#`
//! ```
//!
//! The HDF5 is a crate's. hdf5-pure is checked against libhdf5, follows references, bounds what a filter unpacks to, and brings seven crates
//! along. hdf5-reader brings thirty-four; hdf5-rust reads no packed chunks; hdf5file had one release, and hdf5-metno wants the library in C. What a file may claim is bounded here, before anything is read: a dataset without a stored byte may
//! have any size.

use std::collections::HashMap;

use ::mat::{Limits, MOST_ITEMS, Numbers, Value, Variable};
use hdf5_pure::{AttrValue, DType, Dataset, File, Group, Object};

/// Why a file is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Error {
    /// What the HDF5 says of it.
    Broken(String),
    /// It claims to hold more than so many bytes.
    Larger {
        /// The variable.
        name: String,
        /// The limit.
        most: u64,
    },
    /// Structs and cells deeper, or more of them, than any record has.
    Nested {
        /// The variable.
        name: String,
    },
}

// as of older files: people stop at two, loggers at four
const DEEPEST: usize = 8;
/// Bytes that a file may hold however small it is.
const SMALL: u64 = 1 << 20;
/// Axes at most that a value has here; a record has two.
const MOST_AXES: usize = 32;
/// Characters of a text at most: units and names of channels.
const MOST_TEXT: u64 = 4096;

/// Whether `bytes` begin as a MAT file of version 7.3.
pub(crate) fn is_newer(bytes: &[u8]) -> bool {
    bytes.get(124..128) == Some(&[0, 2, b'I', b'M']) || bytes.starts_with(b"MATLAB 7.3 MAT-file")
}

/// All variables.
///
/// # Errors
/// A file that is not sound, or larger inside than the limits.
pub(crate) fn read(bytes: &[u8], limits: Limits) -> Result<Vec<Variable>, Error> {
    let grown = (bytes.len() as u64)
        .saturating_mul(limits.most_growth as u64)
        .saturating_add(SMALL);
    let mut reader = Reader {
        most: grown.min(limits.most_bytes as u64),
        left: grown.min(limits.most_bytes as u64),
        items: 0,
        most_name: limits.most_name,
    };
    let file = File::from_bytes(bytes.to_vec()).map_err(broken)?;
    let fields = reader.members(&file.root(), "", 0)?;
    Ok(fields
        .into_iter()
        .map(|(name, value)| Variable { name, value })
        .collect())
}

fn broken(error: impl std::fmt::Display) -> Error {
    // a line, however much a file makes it say
    let said: String = error
        .to_string()
        .chars()
        .filter(|c| !c.is_control())
        .take(200)
        .collect();
    Error::Broken(said)
}

struct Reader {
    most: u64,
    /// Bytes that may still be read.
    left: u64,
    items: usize,
    most_name: usize,
}

impl Reader {
    /// Counts a value of so many bytes.
    fn take(&mut self, name: &str, depth: usize, bytes: Option<u64>) -> Result<(), Error> {
        self.items += 1;
        if depth > DEEPEST || self.items > MOST_ITEMS {
            return Err(Error::Nested { name: name.to_owned() });
        }
        match bytes.and_then(|bytes| self.left.checked_sub(bytes)) {
            Some(left) => self.left = left,
            None => {
                return Err(Error::Larger {
                    name: name.to_owned(),
                    most: self.most,
                });
            }
        }
        Ok(())
    }

    /// The members of a group by their names, in alphabetical order. What begins with `#` belongs to MATLAB.
    fn members(&mut self, group: &Group, path: &str, depth: usize) -> Result<Vec<(String, Value)>, Error> {
        let mut found: Vec<(String, Value)> = Vec::new();
        for name in group.datasets().map_err(broken)? {
            let Some(below) = self.below(path, &name)? else {
                continue;
            };
            let dataset = group.dataset(&name).map_err(broken)?;
            let value = self.dataset(&dataset, &below, depth)?;
            found.push((name, value));
        }
        for name in group.groups().map_err(broken)? {
            let Some(below) = self.below(path, &name)? else {
                continue;
            };
            let inner = group.group(&name).map_err(broken)?;
            let value = self.group(&inner, &below, depth + 1)?;
            found.push((name, value));
        }
        found.sort_by(|a, b| a.0.cmp(&b.0));
        Ok(found)
    }

    /// The path of a member; none of one that belongs to MATLAB.
    fn below(&self, path: &str, name: &str) -> Result<Option<String>, Error> {
        if name.starts_with('#') {
            return Ok(None);
        }
        if name.len() > self.most_name || name.contains(char::is_control) {
            return Err(Error::Broken("a name that is none".to_owned()));
        }
        Ok(Some(if path.is_empty() {
            name.to_owned()
        } else {
            format!("{path}.{name}")
        }))
    }

    /// A struct, an array of structs, or what is no record.
    fn group(&mut self, group: &Group, path: &str, depth: usize) -> Result<Value, Error> {
        self.take(path, depth, Some(0))?;
        match class(&group.attrs().map_err(broken)?) {
            Class::Struct => {}
            Class::Sparse => return Ok(Value::Sparse),
            _ => return Ok(Value::Object),
        }
        let members = self.members(group, path, depth)?;
        let (names, values): (Vec<String>, Vec<Value>) = members.into_iter().unzip();
        // each field of an array of structs is a list of what it is in each of them
        let lengths: Option<Vec<usize>> = (values.iter())
            .map(|value| match value {
                Value::Cells(cells) if !cells.is_empty() => Some(cells.len()),
                _ => None,
            })
            .collect();
        match lengths.as_deref() {
            Some([first, rest @ ..]) if rest.iter().all(|length| length == first) => {
                let columns: Vec<Vec<Value>> = (values.into_iter())
                    .map(|value| match value {
                        Value::Cells(cells) => cells,
                        other => vec![other],
                    })
                    .collect();
                let row = |index: usize| columns.iter().map(|column| column[index].clone()).collect();
                let rows = (0..*first).map(row).collect();
                Ok(Value::Structs { names, rows })
            }
            _ => Ok(Value::Structs {
                names,
                rows: vec![values],
            }),
        }
    }

    fn dataset(&mut self, dataset: &Dataset, path: &str, depth: usize) -> Result<Value, Error> {
        let kind = class(&dataset.attrs().map_err(broken)?);
        let dtype = dataset.dtype().map_err(broken)?;
        let dims = dataset.shape().map_err(broken)?;
        if dims.len() > MOST_AXES {
            return Err(Error::Broken(format!("`{path}` has {} axes", dims.len())));
        }
        let count = dims.iter().try_fold(1_u64, |all, length| all.checked_mul(*length));
        // as numbers of 64 bits, which is what they become
        let bytes = count.and_then(|count| count.checked_mul(8));
        if dtype == DType::ObjectReference {
            // each is an item of its own
            if count.is_none_or(|count| count > MOST_ITEMS as u64) {
                return Err(Error::Nested { name: path.to_owned() });
            }
            self.take(path, depth, bytes)?;
            return self.cells(dataset, path, depth);
        }
        self.take(path, depth, bytes)?;
        let is_float = matches!(dtype, DType::F32 | DType::F64);
        let is_integer = matches!(
            dtype,
            DType::I8 | DType::I16 | DType::I32 | DType::I64 | DType::U8 | DType::U16 | DType::U32 | DType::U64
        );
        let shape = |dims: &[u64]| -> Vec<usize> {
            let axes = dims
                .iter()
                .rev()
                .map(|length| usize::try_from(*length).unwrap_or(usize::MAX));
            axes.collect()
        };
        match kind {
            // its value is its shape
            Class::Empty => Ok(numbers(vec![0, 0], Vec::new(), is_integer)),
            Class::Object => Ok(Value::Object),
            Class::Text if is_integer => match count {
                Some(count) if count <= MOST_TEXT => self.text(dataset),
                _ => Ok(Value::Object),
            },
            _ if is_float || is_integer => {
                let values = dataset.read_f64().map_err(broken)?;
                Ok(numbers(shape(&dims), values, is_integer))
            }
            // real and imaginary parts
            _ if matches!(dtype, DType::Compound(_)) => Ok(Value::Numbers(Numbers {
                shape: shape(&dims),
                values: Vec::new(),
                is_complex: true,
                is_integer: false,
            })),
            _ => Ok(Value::Object),
        }
    }

    fn cells(&mut self, dataset: &Dataset, path: &str, depth: usize) -> Result<Value, Error> {
        let mut cells = Vec::new();
        for (index, object) in dataset.dereference().map_err(broken)?.into_iter().enumerate() {
            let below = format!("{path}_{}", index + 1);
            cells.push(match object {
                Object::Dataset(inner) => self.dataset(&inner, &below, depth + 1)?,
                Object::Group(inner) => self.group(&inner, &below, depth + 1)?,
                // a named type is no value
                _ => Value::Object,
            });
        }
        Ok(Value::Cells(cells))
    }

    /// Rows one behind the other, as units and names have one.
    #[allow(clippy::unused_self, reason = "reads as its neighbours do")]
    fn text(&self, dataset: &Dataset) -> Result<Value, Error> {
        let units: Vec<u16> = dataset
            .read_f64()
            .map_err(broken)?
            .into_iter()
            .map(|unit| unit as u16)
            .collect();
        Ok(Value::Text(String::from_utf16_lossy(&units)))
    }
}

fn numbers(shape: Vec<usize>, values: Vec<f64>, is_integer: bool) -> Value {
    Value::Numbers(Numbers {
        shape,
        values,
        is_complex: false,
        is_integer,
    })
}

/// What MATLAB says that a member is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    Numbers,
    Text,
    Struct,
    Sparse,
    Empty,
    Object,
}

fn class(attributes: &HashMap<String, AttrValue>) -> Class {
    let word = attributes.get("MATLAB_class").and_then(AttrValue::as_str);
    // a class that is decoded by code: a table, a timeseries, a string
    if attributes.contains_key("MATLAB_object_decode") {
        return Class::Object;
    }
    if attributes.contains_key("MATLAB_empty") {
        return Class::Empty;
    }
    if attributes.contains_key("MATLAB_sparse") {
        return Class::Sparse;
    }
    match word {
        Some("char") => Class::Text,
        Some("struct") => Class::Struct,
        Some("double" | "single" | "logical" | "cell") => Class::Numbers,
        Some(word) if word.starts_with("int") || word.starts_with("uint") => Class::Numbers,
        Some(_) => Class::Object,
        // a group without a class was made by another program, which has no other meaning for it
        None => Class::Struct,
    }
}
