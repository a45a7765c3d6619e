//! Tables that are refused, and what the user is told: file, line, what stands there, what should, what to do.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::path::Path;

use drm::{FitOptions, Table, TableOptions};
use measured::ColumnMap;
use plant::Faults;

const GOOD: &str = "\
d_real,v_out,i_out,v_in
0.40,78.1,2.0,200
0.50,97.8,2.0,200
0.40,76.0,8.0,200
0.50,95.6,8.0,200
0.60,115.3,8.0,200
";

fn parse(text: &str, options: &TableOptions) -> Result<Table, Faults> {
    Table::parse(Path::new("table.csv"), text, options)
}

fn refused(text: &str, expected: &[&str]) {
    refused_with(text, &TableOptions::default(), expected);
}

fn refused_with(text: &str, options: &TableOptions, expected: &[&str]) {
    let Err(faults) = parse(text, options) else {
        panic!("accepted:\n{text}")
    };
    let message = faults.to_string();
    for part in expected.iter().chain(&["table.csv"]) {
        assert!(message.contains(part), "`{part}` is not in\n{message}");
    }
}

fn mapped(map: &str) -> TableOptions {
    TableOptions {
        columns: ColumnMap::parse(map).unwrap(),
        ..TableOptions::default()
    }
}

#[test]
fn the_good_table_is_read() {
    let table = common::table(GOOD);
    assert_eq!((table.points.len(), table.points[4].line), (5, 6));
    assert!((table.points[4].d_sim() - 115.3 / 200.0).abs() < 1e-15);
    assert!(drm::fit(&table, &FitOptions::default()).is_ok());
}

#[test]
fn millivolts_in_both_columns_are_refused_unless_they_are_volts() {
    let both =
        "d_real,v_out,i_out,v_in\n0.4,78100,2,200000\n0.5,97800,2,200000\n0.4,76000,8,200000\n0.5,95600,8,200000\n";
    refused(
        both,
        &[
            "`v_in` and `v_out` look like millivolts",
            "--map v_in=v_in*0.001,v_out=v_out*0.001",
        ],
    );
    let options = mapped("v_in=v_in*0.001,v_out=v_out*0.001");
    let v_out = parse(both, &options).unwrap().points[0].v_out;
    assert!((v_out - 78.1).abs() < 1e-12, "{v_out}");
}

#[test]
fn a_missing_cell_is_refused() {
    let empty = GOOD.replace("78.1", "");
    refused(
        &empty,
        &["a cell of `v_out` is empty", "table.csv:2:6", "measure the point again"],
    );
    refused(
        &GOOD.replace(",2.0,200\n0.50", "\n0.50"),
        &["cells are missing", "table.csv:2", "found: 2 cells", "4 cells"],
    );
}

#[test]
fn all_faults_come_at_once() {
    let text = GOOD.replace("78.1", "").replace("95.6", "about 96");
    refused(&text, &["table.csv:2:6", "table.csv:5:6"]);
}

#[test]
fn very_many_faults_are_counted() {
    let rows = "0.5,,1,200\n".repeat(50);
    refused(&format!("d_real,v_out,i_out,v_in\n{rows}"), &["38 more faults"]);
}

#[test]
fn percent_for_fractions_is_seen_and_can_be_mapped() {
    let percent = GOOD
        .replace("0.40,", "40,")
        .replace("0.50,", "50,")
        .replace("0.60,", "60,");
    refused(
        &percent,
        &[
            "`d_real` looks like percent",
            "found: 40 in lines 2, 3, 4, 5, 6",
            "--map d_real=d_real*0.01",
            "`d_real (%)`",
        ],
    );
    let table = parse(&percent, &mapped("d_real=d_real*0.01")).unwrap();
    assert!((table.points[0].d_real - 0.4).abs() < 1e-15);
    refused(
        &GOOD.replace("0.60,", "60 %,"),
        &["not a number", "found: 60 %", "write 0.5 instead of 50 %"],
    );
    refused(
        &GOOD.replace("0.60,", "1.6,"),
        &["`d_real` is no duty ratio", "found: 1.6", "table.csv:6"],
    );
}

#[test]
fn millivolts_and_milliamperes_are_seen() {
    let millivolts = GOOD
        .replace("78.1", "78100")
        .replace("97.8", "97800")
        .replace("76.0", "76000");
    let millivolts = millivolts.replace("95.6", "95600").replace("115.3", "115300");
    refused(
        &millivolts,
        &["`v_out` looks like millivolts", "--map v_out=v_out*0.001"],
    );
    refused(&GOOD.replace(",200\n", ",200000\n"), &["`v_in` looks like millivolts"]);
    let milliamperes = GOOD.replace(",2.0,", ",2000,").replace(",8.0,", ",8000,");
    refused(
        &milliamperes,
        &["`i_out` looks like milliamperes", "--map i_out=i_out*0.001"],
    );
    assert!(parse(&milliamperes, &mapped("i_out=i_out*0.001")).is_ok());
    assert!(
        parse(&milliamperes, &mapped("i_out=i_out*1")).is_ok(),
        "the user insists"
    );
    refused(
        &GOOD.replace("115.3", "115300"),
        &["`v_out` lies above `v_in`", "table.csv:6"],
    );
}

#[test]
fn nan_and_infinity_are_no_numbers() {
    refused(
        &GOOD.replace("95.6", "nan"),
        &["not a number", "table.csv:5:6", "finite"],
    );
    refused(&GOOD.replace("95.6", "inf"), &["not a number", "finite"]);
}

#[test]
fn decimal_commas_are_read_where_they_are_clear() {
    let german = GOOD.replace(',', ";").replace('.', ",");
    let plain = common::table(GOOD);
    let read = common::table(&german);
    assert_eq!(read.points, plain.points);
    assert_eq!(read.notes, ["decimal commas read as points"]);
    assert_eq!(common::table(&GOOD.replace(',', "\t")), plain);
    refused(
        &GOOD.replace('.', ","),
        &["more cells than the header", "write 0.5 instead of 0,5"],
    );
    refused(
        &german.replace("78,1", "78.1"),
        &["decimal points and decimal commas", "table.csv:2:6", "found: 78.1"],
    );
}

#[test]
fn one_row_and_equal_rows_say_nothing() {
    let header = "d_real,v_out,i_out,v_in\n";
    let row = "0.40,78.1,2.0,200\n";
    refused(
        &format!("{header}{row}"),
        &["one point cannot say", "at least 4 points", "drm acquire"],
    );
    refused(
        &format!("{header}{row}{row}{row}{row}"),
        &["all rows are equal", "found: 4 rows"],
    );
    refused(
        &format!("{header}{row}0.40,78.0,3.0,200\n0.40,77.5,4.0,200\n0.40,77.0,5.0,200\n"),
        &["`d_real` is the same in all rows", "vary it"],
    );
    refused(header, &["the table has no rows"]);
    refused("", &["the table is empty"]);
    refused("# only a comment\n", &["the table is empty"]);
}

#[test]
fn unsettled_points_are_refused_or_left_out() {
    let text = "\
d_real,v_out,i_out,v_in,v_std,settled
0.40,78.1,2.0,200,0.01,yes
0.50,97.8,2.0,200,0.01,no
0.40,76.0,8.0,200,1.50,yes
0.50,95.6,8.0,200,,yes
";
    refused(
        text,
        &[
            "the point had not settled",
            "table.csv:3",
            "table.csv:4",
            "--skip-unsettled",
        ],
    );
    let skip = TableOptions {
        skip_unsettled: true,
        ..TableOptions::default()
    };
    let table = parse(text, &skip).unwrap();
    assert_eq!(table.points.len(), 2);
    assert!(table.notes[0].contains("lines 3, 4"), "{:?}", table.notes);
    refused_with(
        &text.replace(",no\n", ",perhaps\n"),
        &skip,
        &["neither yes nor no", "table.csv:3:24"],
    );
}

#[test]
fn columns_that_are_missing_or_double_are_named() {
    refused(
        &GOOD.replace("v_in", "Vin"),
        &["no column `v_in`", "--map v_in=24", "found: d_real, v_out, i_out, Vin"],
    );
    refused(
        &GOOD.replace("i_out", "v_out"),
        &["two columns are called `v_out`", "table.csv:1:14"],
    );
    refused_with(GOOD, &mapped("d_real=duty"), &["no column `duty`"]);
}

#[test]
fn a_column_map_takes_names_factors_and_numbers() {
    let text = "duty %,U,I\n40,78.1,2000\n50,97.8,2000\n40,76,8000\n50,95.6,8000\n";
    let options = mapped("d_real = duty %*0.01, v_out=U, i_out=I*1e-3, v_in=200");
    let table = parse(text, &options).unwrap();
    let last = table.points[3];
    assert_eq!(
        (last.d_real, last.v_out, last.i_out, last.v_in),
        (0.5, 95.6, 8.0, 200.0)
    );
    for (map, expected) in [
        ("d_rael=duty", "did you mean `d_real`?"),
        ("d_real", "quantity=column*factor"),
        ("d_real=duty*x", "quantity=column*factor"),
        ("v_in=24,v_in=25", "mapped twice"),
    ] {
        let message = ColumnMap::parse(map).unwrap_err().to_string();
        assert!(message.contains(expected), "{map}: {message}");
    }
}

#[test]
fn short_forms_and_units_are_columns_and_what_is_left_over_is_named() {
    let short = GOOD.replace("d_real,v_out,i_out,v_in", "d,v_o [mV],i_o,v_in");
    let short = [
        ("78.1", "78100"),
        ("97.8", "97800"),
        ("76.0", "76000"),
        ("95.6", "95600"),
        ("115.3", "115300"),
    ]
    .into_iter()
    .fold(short, |text, (volts, millivolts)| text.replace(volts, millivolts));
    let (read, plain) = (common::table(&short), common::table(GOOD));
    for (read, plain) in read.points.iter().zip(&plain.points) {
        assert!((read.v_out - plain.v_out).abs() < 1e-12 && read.d_real == plain.d_real);
    }
    let more = GOOD.replace('\n', ",7\n").replace("v_in,7", "v_in,lamp");
    assert_eq!(common::table(&more).notes, ["column not used: `lamp`"]);
    refused(
        &more.replace("lamp", "duty").replace("d_real", "d"),
        &[
            "two columns are `duty`: `d` and `duty`",
            "--map duty=d",
            "table.csv:1:20",
        ],
    );
}

#[test]
fn rows_not_measured_yet_are_open_and_half_measured_ones_faults() {
    let table = common::table(&format!("{GOOD},,,\n"));
    assert_eq!((table.points.len(), &table.open[..]), (5, &[7][..]));
    refused(
        "d_real,v_out,i_out,v_in\n,,,\n,,,\n",
        &["no point is measured yet", "fill in"],
    );
    refused(
        &format!("{GOOD}0.6,,,\n"),
        &["a cell of `v_out` is empty", "table.csv:7", "may stay"],
    );
}

#[test]
fn a_record_over_time_is_not_a_table() {
    let rows: String = (0..2500).map(|k| format!("0.4{k},78.1,2.0,200\n")).collect();
    refused(
        &format!("d_real,v_out,i_out,v_in\n{rows}"),
        &["too many rows", "found: 2500 rows", "average"],
    );
}

fn no_fit(text: &str, options: &FitOptions, expected: &[&str]) {
    let message = drm::fit(&common::table(text), options).unwrap_err().to_string();
    for part in expected {
        assert!(message.contains(part), "`{part}` is not in\n{message}");
    }
}

/// The paper's own table: the voltage is held, only the load changes.
#[test]
fn a_table_at_one_voltage_does_not_determine_a() {
    let text = "\
d_real,v_out,i_out,v_in
0.531,100.0,2.0,200
0.545,100.0,5.0,200
0.559,100.0,8.0,200
0.568,100.0,10.0,200
";
    no_fit(
        text,
        &FitOptions::default(),
        &["does not determine a", "--assume-a", "0.50000 to 0.50000"],
    );
    let options = FitOptions {
        assumed_a: Some(1.0),
        ..FitOptions::default()
    };
    let report = drm::fit(&common::table(text), &options).unwrap();
    let k = report.fit.map.coefficients;
    assert!(k.a == 1.0 && (k.b - 0.0046).abs() < 1e-4, "{k:?}");
    assert!(
        report.notes.iter().any(|note| note.contains("a = 1 is assumed")),
        "{:?}",
        report.notes
    );
}

#[test]
fn a_constant_load_leaves_b_untold() {
    let text = "\
d_real,v_out,i_out,v_in
0.40,78.1,5.0,200
0.45,87.9,5.0,200
0.50,97.8,5.0,200
0.55,107.6,5.0,200
0.60,117.5,5.0,200
";
    let report = drm::fit(&common::table(text), &FitOptions::default()).unwrap();
    assert_eq!(report.fit.map.coefficients.b, 0.0);
    let finding = report.fit.separation.findings.join(" ");
    assert!(finding.contains("b cannot be told from c"), "{finding}");
    assert!(
        report.fit.map.valid_i_out.low > 4.9 && report.fit.map.valid_i_out.high < 5.1,
        "at this load only"
    );
}

#[test]
fn a_mapping_that_falls_is_refused() {
    let text = "\
d_real,v_out,i_out,v_in
0.60,78.1,2.0,200
0.50,97.8,2.0,200
0.60,76.0,8.0,200
0.50,95.6,8.0,200
0.40,115.3,8.0,200
";
    no_fit(
        text,
        &FitOptions::default(),
        &["does not rise with d_sim", "swapped columns"],
    );
}

#[test]
fn too_few_points_are_refused() {
    let text = GOOD.lines().take(4).collect::<Vec<_>>().join("\n");
    no_fit(
        &text,
        &FitOptions::default(),
        &["too few points", "found: 3", "at least 4"],
    );
}
