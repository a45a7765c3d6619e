//! Channels of a logger on their way to columns: formats that hold vectors with names in place of lines.

use crate::csv::number::decimals;
use crate::sheet::Column;

/// A vector on its way to a column.
pub struct Vector {
    /// Where it stands: `log.v_out`.
    pub path: String,
    /// What it is called there, with a unit if one is stated.
    pub name: String,
    pub values: Vec<f64>,
}

/// Columns of vectors of one length, in their order.
pub fn columns(vectors: Vec<Vector>) -> Vec<Column> {
    let names = headers(&vectors);
    let column = |(vector, name): (Vector, String)| {
        let finite = |value: f64| if value.is_finite() { value } else { f64::NAN };
        let mut column = Column::new(&name, vector.values.into_iter().map(finite).collect());
        column.decimals = column.values.iter().map(|value| decimals(*value)).max().unwrap_or(0);
        column
    };
    vectors.into_iter().zip(names).map(column).collect()
}

/// A name with its unit, if that is one.
pub fn with_unit(label: &str, unit: &str) -> String {
    match unit {
        "" | "-" => label.to_owned(),
        _ => format!("{label} [{unit}]"),
    }
}

/// What a channel is called at the end of its path: `Model Root/Buck/"v_out"` is `v_out`.
pub fn called(label: &str) -> String {
    let last = label
        .rsplit('/')
        .find(|part| !part.trim().is_empty())
        .unwrap_or_default();
    last.trim().trim_matches(['"', '\'']).to_owned()
}

/// The names alone where nothing else has them, else the whole paths.
pub fn headers(vectors: &[Vector]) -> Vec<String> {
    let is_alone = |vector: &Vector| vectors.iter().filter(|other| other.name == vector.name).count() == 1;
    let header = |vector: &Vector| match is_alone(vector) {
        true => vector.name.clone(),
        false => vector.path.clone(),
    };
    vectors.iter().map(header).collect()
}
