//! MAT files of level 5: what MATLAB's `save -v7` and `-v6`, Octave's `save -v7` and scipy write, as a tree of values.
//!
//! ```text
//!   128 bytes of text, version and byte order, then elements:
//!   type, size, content, filled up to 8 bytes     type 15 holds an element in zlib
//!   a matrix holds elements: class, axes, name, numbers; a cell holds matrices, a struct names of fields and matrices
//! ```
//!
//! Weights of a network and records of a bench come in such files; what is in them is looked for by their readers. The crate that
//! exists for this inflates without a bound, reads no cells and had no release in two years. The zlib is a crate's, whose
//! inflation takes a bound. Format: MathWorks, *MAT-File Format*, level 5.

mod element;
mod matrix;

use element::{COMPRESSED, Element, MATRIX, element};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

/// What a file may take.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Bytes of all variables together, unpacked.
    pub most_bytes: usize,
    /// Unpacked bytes for each packed one, beyond the first mebibyte of a variable.
    pub most_growth: usize,
    /// Characters of a name.
    pub most_name: usize,
}

/// A variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name, letters, digits and underscores.
    pub name: String,
    /// What it holds.
    pub value: Value,
}

/// What a variable, a cell or a field holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A full matrix of numbers.
    Numbers(Numbers),
    /// Text, its rows one behind the other.
    Text(String),
    /// A cell array.
    Cells(Vec<Value>),
    /// Structs, one or an array of them: names of the fields, then the fields of each struct.
    Structs {
        /// In the order of the file.
        names: Vec<String>,
        /// A list for each struct, in the order of the names.
        rows: Vec<Vec<Value>>,
    },
    /// A sparse matrix, which is not read.
    Sparse,
    /// An object of a class: a table, a timeseries, a network. Not read.
    Object,
}

/// A full matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Numbers {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// The first axis runs fastest; real parts.
    pub values: Vec<f64>,
    /// Whether there are imaginary parts, too.
    pub is_complex: bool,
    /// Whether its class is one of integers or truth values.
    pub is_integer: bool,
}

/// Why a file is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Error {
    /// Version 7.3 is HDF5.
    Newer,
    /// Its numbers are stored big-endian.
    BigEndian,
    /// A compressed variable is damaged, or unpacks to more than this.
    Unpacked {
        /// Bytes in the file.
        packed: usize,
        /// The limit, in bytes.
        most: usize,
    },
    /// Cells in cells in structs, deeper or more of them than any file has.
    Nested {
        /// The variable.
        name: String,
    },
    /// A cell array or struct says that it has so many parts.
    Parts {
        /// The variable.
        name: String,
        /// How many.
        count: usize,
    },
    /// Elements that do not hold together.
    Broken,
}

// cells within cells within structs: people stop at two, loggers at four
const DEEPEST: usize = 8;
/// Most cells and structs of a file.
// an array of small cells could hold more items than anybody writes
pub const MOST_ITEMS: usize = 10_000;
const SMALL: usize = 1 << 20;

/// Whether `bytes` begin as a MAT file of level 5, or as one of version 7.3.
#[must_use]
pub fn is_mat(bytes: &[u8]) -> bool {
    matches!(
        bytes.get(124..128),
        Some([0, 1 | 2, b'I', b'M'] | [1 | 2, 0, b'M', b'I'])
    )
}

/// All named variables, in the order of the file.
///
/// # Errors
/// A file that is not sound, not of level 5, or larger inside than the limits.
pub fn read(bytes: &[u8], limits: Limits) -> Result<Vec<Variable>, Error> {
    match bytes.get(124..128) {
        Some([0, 1, b'I', b'M']) => {}
        Some([0, 2, b'I', b'M']) => return Err(Error::Newer),
        Some([1 | 2, 0, b'M', b'I']) => return Err(Error::BigEndian),
        _ => return Err(Error::Broken),
    }
    let mut reader = Reader {
        limits,
        left: limits.most_bytes,
        items: 0,
    };
    let mut found = Vec::new();
    let mut rest = bytes.get(128..).unwrap_or_default();
    while !rest.is_empty() {
        let (element, behind) = element(rest)?;
        rest = behind;
        if element.kind == COMPRESSED {
            let inflated = reader.inflate(element.data)?;
            let (inner, _) = self::element::element(&inflated)?;
            found.extend(reader.variable(&inner)?);
        } else {
            found.extend(reader.variable(&element)?);
        }
    }
    Ok(found)
}

struct Reader {
    limits: Limits,
    /// Bytes that may still be unpacked.
    left: usize,
    items: usize,
}

impl Reader {
    fn inflate(&mut self, packed: &[u8]) -> Result<Vec<u8>, Error> {
        let grown = packed
            .len()
            .saturating_mul(self.limits.most_growth)
            .saturating_add(SMALL);
        let most = self.left.min(grown);
        let inflated = decompress_to_vec_zlib_with_limit(packed, most).map_err(|_| Error::Unpacked {
            packed: packed.len(),
            most,
        })?;
        self.left -= inflated.len().min(self.left);
        Ok(inflated)
    }

    /// A variable; what is no matrix, and the store of the objects, which has no name, belong to MATLAB.
    fn variable(&mut self, element: &Element<'_>) -> Result<Option<Variable>, Error> {
        if element.kind != MATRIX {
            return Ok(None);
        }
        let matrix = matrix::of(element.data, self.limits.most_name)?;
        if matrix.name.is_empty() {
            return Ok(None);
        }
        let value = self.value(&matrix, &matrix.name, 0)?;
        Ok(Some(Variable {
            name: matrix.name,
            value,
        }))
    }
}
