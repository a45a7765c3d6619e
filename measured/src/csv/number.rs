//! A cell as a number.

/// A finite number as it stands in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Number {
    pub value: f64,
    /// Digits after the point, exponent taken into account.
    pub decimals: u32,
    pub mark: Option<Mark>,
}

/// What stands before the decimals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Point = 0,
    Comma = 1,
}

/// Most digits after the point that are told apart.
// decimals tell on what step a column was written; a number such as 1e-300 would have hundreds of them
const MOST_DECIMALS: i64 = 12;

/// Reads a finite number with a decimal point or a decimal comma.
pub(crate) fn read(cell: &str) -> Option<Number> {
    let mark = match (cell.contains('.'), cell.contains(',')) {
        // 1,000.5 may be a thousand or one: a mark between thousands cannot be told from a decimal one
        (true, true) => return None,
        (true, false) => Some(Mark::Point),
        (false, true) => Some(Mark::Comma),
        (false, false) => None,
    };
    let pointed;
    let text = if mark == Some(Mark::Comma) {
        pointed = cell.replace(',', ".");
        &pointed
    } else {
        cell
    };
    // `inf`, `nan` and 1e999 are words of their cells: readers differ in what these mean to them
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite())?;
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let digits = mantissa
        .split_once('.')
        .map_or(0, |(_, fraction)| fraction.len() as i64);
    let decimals = digits
        .saturating_sub(exponent.parse::<i64>().unwrap_or(0))
        .clamp(0, MOST_DECIMALS);
    Some(Number {
        value,
        decimals: u32::try_from(decimals).unwrap_or(0),
        mark,
    })
}

/// Digits after the point that a number needs which no text was read for.
pub(crate) fn decimals(value: f64) -> u32 {
    read(&value.to_string()).map_or(0, |number| number.decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_a_point_or_a_comma_and_no_mark_between_thousands() {
        let value = |cell| read(cell).map(|number| (number.value, number.decimals));
        assert_eq!(value("1.50"), Some((1.5, 2)));
        assert_eq!(value("-1,5"), Some((-1.5, 1)));
        assert_eq!(value("1.5e-3"), Some((0.0015, 4)));
        assert_eq!(value("15e3"), Some((15e3, 0)));
        for word in [
            "",
            "nan",
            "inf",
            "1e999",
            "1.000,5",
            "1,000,000",
            "1 V",
            "0x10",
            "1_000",
        ] {
            assert_eq!(value(word), None, "{word}");
        }
    }
}
