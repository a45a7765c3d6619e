//! Tables that cannot be used.

use super::table::{column, good, header, text, times, with};

/// What is wrong, the file, what the fault says, and the line that it names.
pub type Case = (&'static str, Vec<u8>, &'static str, Option<usize>);

/// Lines and cells that cannot be read.
fn broken() -> Vec<Case> {
    let rows = good();
    let mut unsorted = rows.clone();
    unsorted.swap(10, 11);
    vec![
        ("empty", Vec::new(), "the table is empty", None),
        (
            "header only",
            text(&rows[..1]).into_bytes(),
            "the table has no rows",
            Some(1),
        ),
        ("one row", text(&rows[..2]).into_bytes(), "too few rows", None),
        (
            "no header",
            text(&rows[1..]).into_bytes(),
            "the first line holds numbers",
            Some(1),
        ),
        (
            "a word",
            with(7, |l| l.replace("0.5", "half")).into_bytes(),
            "`d` is not a number",
            Some(8),
        ),
        (
            "infinity",
            with(7, |l| l.replace("0.5", "inf")).into_bytes(),
            "`d` is not a number",
            Some(8),
        ),
        (
            "short line",
            with(9, |l| l[..12].to_owned()).into_bytes(),
            "cells are missing",
            Some(10),
        ),
        (
            "long line",
            with(9, |l| format!("{l},1")).into_bytes(),
            "more cells than the header",
            Some(10),
        ),
        (
            "thousands",
            with(9, |l| l.replace(",20", ",1,000")).into_bytes(),
            "more cells than the header",
            Some(10),
        ),
        ("unsorted", text(&unsorted).into_bytes(), "time goes backward", Some(12)),
        (
            "no time in a row",
            with(4, |l| l.replacen("0.000350", "NaN", 1)).into_bytes(),
            "without time",
            Some(5),
        ),
    ]
}

/// Numbers that this quantity of this converter cannot have.
fn impossible() -> Vec<Case> {
    vec![
        ("time in us", column(0, times(1e6)).into_bytes(), "sample rate", None),
        ("time in ms", column(0, times(1e3)).into_bytes(), "sample rate", None),
        (
            "duty in percent",
            column(1, times(100.0)).into_bytes(),
            "a duty outside 0 to 1",
            Some(2),
        ),
        (
            "negative duty",
            with(3, |l| l.replace(",0.5,", ",-0.5,")).into_bytes(),
            "a duty outside 0 to 1",
            Some(4),
        ),
        (
            "millivolts",
            column(2, times(1e3)).into_bytes(),
            "v_o is not in V",
            None,
        ),
        (
            "kilovolts",
            column(2, times(1e-3)).into_bytes(),
            "v_o is not in V",
            None,
        ),
        (
            "milliamperes",
            column(3, times(1e3)).into_bytes(),
            "i_l is not in A",
            None,
        ),
        (
            "load in kiloohms",
            column(5, times(1e-3)).into_bytes(),
            "r_load is not in ohm",
            None,
        ),
        (
            "load in milliamperes",
            column(5, |_| "5000".to_owned())
                .replace("r_load", "i_load")
                .into_bytes(),
            "i_load is not in A",
            None,
        ),
        (
            "input in millivolts",
            column(4, times(1e3)).into_bytes(),
            "v_in is not in V",
            None,
        ),
        (
            "exchanged",
            header("v_o,i_l", "i_l,v_o").into_bytes(),
            "v_o and i_l look exchanged",
            None,
        ),
        (
            "exchanged voltages",
            header("v_o,i_l,v_in", "v_in,i_l,v_o").into_bytes(),
            "v_o and v_in look exchanged",
            None,
        ),
    ]
}

/// Columns that are not there, or twice.
fn misnamed() -> Vec<Case> {
    let rows = good();
    vec![
        (
            "twice",
            header("i_l", "v_o").into_bytes(),
            "two columns are called `v_o`",
            Some(1),
        ),
        (
            "no duty",
            header(",d,", ",x,").into_bytes(),
            "no column `duty`",
            Some(1),
        ),
        (
            "no load",
            header("r_load", "r").into_bytes(),
            "what the load is",
            Some(1),
        ),
        (
            "negative load",
            column(5, times(-1.0)).into_bytes(),
            "a negative load",
            Some(2),
        ),
        (
            "nothing measured",
            header("v_o,i_l,v_in", "a,b,c").into_bytes(),
            "nothing is measured",
            Some(1),
        ),
        (
            "all stuck",
            "t,d,v_o,r_load\n"
                .chars()
                .chain((0..40).flat_map(|n| {
                    format!("{:.6},0.5,99.5,20\n", (n as f64 + 0.5) * 1e-4)
                        .chars()
                        .collect::<Vec<_>>()
                }))
                .collect::<String>()
                .into_bytes(),
            "nothing is measured",
            None,
        ),
        ("UTF-16 cut off", vec![0xff, 0xfe, b't', 0, b','], "UTF-16", None),
        ("UTF-16 without mark", vec![b't', 0, b',', 0, b'd', 0], "UTF-16", None),
        (
            "unknown time",
            header("t,", "sampling_time,").into_bytes(),
            "`sampling_time` looks like time",
            Some(1),
        ),
        (
            "a clock without name",
            header("t,", "x,").into_bytes(),
            "`x` looks like time",
            Some(1),
        ),
        (
            "two duties",
            header("i_l", "duty").into_bytes(),
            "two columns are `duty`",
            Some(1),
        ),
        (
            "units of another kind",
            {
                let mut lines = rows.clone();
                lines.insert(1, "ms,,mA,A,V,ohm".to_owned());
                text(&lines).into_bytes()
            },
            "no unit of `v_out`",
            Some(2),
        ),
    ]
}

/// All of them.
pub fn all() -> Vec<Case> {
    [broken(), impossible(), misnamed()].concat()
}
