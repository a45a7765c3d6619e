//! Rows and their text.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::peers::{self, PEER};
use crate::row::{Failure, Row};

/// Equal policies in equal formats have given equal bits, on every core, in every language, portable or not.
///
/// # Errors
/// The rows that differ.
pub fn one_checksum_per_format(rows: &[Row]) -> Result<(), Failure> {
    let ours = rows
        .iter()
        .filter(|row| !row.variant.starts_with("naive") && !row.variant.starts_with(PEER));
    let mut known: BTreeMap<(&str, &str), &Row> = BTreeMap::new();
    for row in ours {
        let format = row.variant.split(',').next().unwrap_or_default();
        let first = known.entry((row.policy.as_str(), format)).or_insert(row);
        if first.checksum != row.checksum {
            return Err(Failure(format!("the bits differ:\n{first:?}\n{row:?}")));
        }
    }
    Ok(())
}

/// `q_values` takes as many instructions for every observation. Not asked of `f32-fma` in Rust, which goes through
/// functions of the library, of peers, nor of the naive loop, which branches where the core does not select.
///
/// # Errors
/// The row that varies.
pub fn one_count_per_kernel(rows: &[Row]) -> Result<(), Failure> {
    let is_asked = |row: &&Row| {
        let is_fma_in_rust = row.variant == "f32-fma" && row.compiler.starts_with("rustc");
        !is_fma_in_rust && !row.variant.starts_with(PEER) && !row.variant.starts_with("naive")
    };
    let asked = rows.iter().filter(is_asked);
    let mut varying = asked.filter(|row| row.q_values.is_some_and(|(low, high)| low != high));
    match varying.next() {
        Some(row) => Err(Failure(format!("the count depends on the data:\n{row:?}"))),
        None => Ok(()),
    }
}

/// JSON, or a Markdown table.
///
/// # Errors
/// If the rows cannot be written as JSON.
pub fn text(rows: &[Row], json: bool) -> Result<String, Failure> {
    if json {
        let text = serde_json::to_string_pretty(rows).map_err(|error| Failure(error.to_string()))?;
        return Ok(text + "\n");
    }
    let mut text = String::from(
        "| policy | core | compiler | variant | q_values | step | slice of 32 | flash B | network linked B | step linked B | stack B | checksum | time / naive |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows.iter().filter(|row| !row.variant.starts_with(PEER)) {
        let number = |value: Option<u64>| value.map(|value| value.to_string()).unwrap_or_default();
        // writing to a String cannot fail
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            row.policy,
            row.core,
            row.compiler,
            row.variant,
            range(row.q_values),
            range(row.step),
            range(row.slice),
            number(row.flash),
            number(row.network_flash),
            number(row.step_flash),
            number(row.stack),
            row.checksum.as_deref().unwrap_or_default(),
            row.time_ratio.map(|ratio| format!("{ratio:.3}")).unwrap_or_default()
        );
    }
    text += &peers::table(rows);
    Ok(text)
}

fn range(counts: Option<(u64, u64)>) -> String {
    match counts {
        None => String::new(),
        Some((low, high)) if low == high => low.to_string(),
        Some((low, high)) => format!("{low}..{high}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(variant: &str, checksum: &str) -> Row {
        Row {
            policy: "bench".into(),
            core: "m".into(),
            compiler: "c".into(),
            variant: variant.into(),
            q_values: Some((7, 9)),
            step: Some((8, 8)),
            slice: None,
            flash: None,
            network_flash: None,
            step_flash: None,
            stack: None,
            checksum: Some(checksum.into()),
            time_ratio: None,
        }
    }

    #[test]
    fn other_bits_in_the_same_format_are_an_error() {
        let equal = [
            row("i16", "a"),
            row("i16, assembly", "a"),
            row("i8", "b"),
            row("naive C", "c"),
        ];
        assert!(one_checksum_per_format(&equal).is_ok());
        assert!(one_checksum_per_format(&[row("i16", "a"), row("i16, assembly", "b")]).is_err());
    }

    #[test]
    fn a_kernel_whose_count_varies_is_an_error() {
        let mut steady = row("i16", "a");
        assert!(one_count_per_kernel(std::slice::from_ref(&steady)).is_err());
        steady.q_values = Some((7, 7));
        assert!(one_count_per_kernel(&[steady]).is_ok());
    }

    #[test]
    fn a_count_that_varies_is_shown_as_a_range() {
        let text = text(&[row("i16", "a")], false).unwrap_or_default();
        assert!(text.contains("| 7..9 | 8 |"), "{text}");
    }
}
