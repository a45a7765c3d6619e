//! Matrices: numbers, text, cells, structs.

use crate::element::{Element, MATRIX, element, u32_at};
use crate::{DEEPEST, Error, MOST_ITEMS, Numbers, Reader, Value};

/// The parts that every matrix begins with.
pub struct Matrix<'a> {
    class: u8,
    is_complex: bool,
    shape: Vec<usize>,
    pub name: String,
    rest: &'a [u8],
}

/// Reads the beginning of a matrix.
pub fn of(data: &[u8], most_name: usize) -> Result<Matrix<'_>, Error> {
    // an empty cell that was never set has nothing inside
    if data.is_empty() {
        return Ok(Matrix {
            class: 6,
            is_complex: false,
            shape: vec![0, 0],
            name: String::new(),
            // no numbers: the smallest element that says so
            rest: &[9, 0, 0, 0, 0, 0, 0, 0],
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
            name: identifier(name.data, most_name),
            rest: &[],
        });
    }
    let (axes, rest) = element(rest)?;
    let (name, rest) = element(rest)?;
    let size = |four: &[u8; 4]| usize::try_from(i32::from_le_bytes(*four)).map_err(|_| Error::Broken);
    let axes = axes.data.as_chunks::<4>().0;
    Ok(Matrix {
        class,
        is_complex,
        shape: axes.iter().map(size).collect::<Result<_, _>>()?,
        name: identifier(name.data, most_name),
        rest,
    })
}

impl Matrix<'_> {
    fn count(&self) -> Result<usize, Error> {
        let product = |product: usize, size: &usize| product.checked_mul(*size);
        self.shape.iter().try_fold(1, product).ok_or(Error::Broken)
    }
}

impl Reader {
    /// What a matrix of the variable `name` holds.
    pub fn value(&mut self, matrix: &Matrix<'_>, name: &str, depth: usize) -> Result<Value, Error> {
        self.items += 1;
        if depth > DEEPEST || self.items > MOST_ITEMS {
            return Err(Error::Nested { name: name.to_owned() });
        }
        match matrix.class {
            1 => {
                let (cells, _) = self.matrices(matrix.rest, matrix.count()?, name)?;
                let cells = cells.iter().map(|cell| self.value(cell, name, depth + 1));
                Ok(Value::Cells(cells.collect::<Result<_, _>>()?))
            }
            2 => self.structs(matrix, name, depth),
            4 => {
                let content = element(matrix.rest).ok();
                let text = content.and_then(|(content, _)| content.text());
                Ok(Value::Text(text.unwrap_or_default()))
            }
            5 => Ok(Value::Sparse),
            6..=15 => numbers(matrix).map(Value::Numbers),
            3 | 16 | 17 => Ok(Value::Object),
            _ => Err(Error::Broken),
        }
    }

    fn structs(&mut self, matrix: &Matrix<'_>, name: &str, depth: usize) -> Result<Value, Error> {
        let (length, rest) = element(matrix.rest)?;
        let length = usize::try_from(u32_at(length.data, 0)?).map_err(|_| Error::Broken)?;
        let (names, rest) = element(rest)?;
        if length == 0 {
            return Err(Error::Broken);
        }
        let names = names.data.chunks(length);
        let names: Vec<String> = names.map(|name| identifier(name, self.limits.most_name)).collect();
        let count = matrix.count()?.checked_mul(names.len()).ok_or(Error::Broken)?;
        let (fields, _) = self.matrices(rest, count, name)?;
        let mut rows = Vec::new();
        for row in fields.chunks(names.len().max(1)) {
            let row = row.iter().map(|field| self.value(field, name, depth + 1));
            rows.push(row.collect::<Result<_, _>>()?);
        }
        Ok(Value::Structs { names, rows })
    }

    /// So many matrices, one behind the other.
    fn matrices<'a>(&self, mut rest: &'a [u8], count: usize, name: &str) -> Result<(Vec<Matrix<'a>>, &'a [u8]), Error> {
        if count > MOST_ITEMS {
            let name = name.to_owned();
            return Err(Error::Parts { name, count });
        }
        let mut list = Vec::new();
        for _ in 0..count {
            let (inner, behind) = element(rest)?;
            if inner.kind != MATRIX {
                return Err(Error::Broken);
            }
            list.push(of(inner.data, self.limits.most_name)?);
            rest = behind;
        }
        Ok((list, rest))
    }
}

fn numbers(matrix: &Matrix<'_>) -> Result<Numbers, Error> {
    let (content, _): (Element<'_>, _) = element(matrix.rest)?;
    let values = content.numbers().ok_or(Error::Broken)?;
    if values.len() != matrix.count()? {
        return Err(Error::Broken);
    }
    Ok(Numbers {
        shape: matrix.shape.clone(),
        values,
        is_complex: matrix.is_complex,
        is_integer: matrix.class >= 8,
    })
}

/// A name up to its first zero; MATLAB's have letters, digits and underscores.
fn identifier(bytes: &[u8], most: usize) -> String {
    let bytes = bytes.iter().take_while(|byte| **byte != 0).take(most);
    bytes
        .map(|byte| char::from(*byte))
        .map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' })
        .collect()
}
