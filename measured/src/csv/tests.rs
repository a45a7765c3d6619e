use std::path::Path;

use super::*;
use crate::Cell;

fn read_bytes(bytes: &[u8]) -> Result<Sheet, Faults> {
    let options = Options {
        leave_out_cut_line: true,
        ..Options::default()
    };
    Sheet::parse(Path::new("a.csv"), bytes.to_vec(), &options)
}

fn read(text: &str) -> Result<Sheet, Faults> {
    read_bytes(text.as_bytes())
}

fn values(sheet: &Sheet) -> Vec<Vec<f64>> {
    sheet.columns().iter().map(|column| column.values.clone()).collect()
}

/// Problem, line and column of the only fault.
fn fault(text: &str) -> (String, Option<(usize, usize)>) {
    let faults = read(text).unwrap_err();
    assert_eq!(faults.list.len(), 1, "{faults}");
    (faults.list[0].problem.clone(), faults.list[0].line_column())
}

#[test]
fn other_ways_of_writing_it_change_nothing() {
    let plain = "t,v_out\n0.5,1.25\n1.5,2.5\n";
    let wide = |text: &str, bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        format!("\u{feff}{text}").encode_utf16().flat_map(bytes).collect()
    };
    let german = plain.replace(',', ";").replace('.', ",");
    for (name, bytes) in [
        ("mark", format!("\u{feff}{plain}").into_bytes()),
        ("carriage returns", plain.replace('\n', "\r\n").into_bytes()),
        ("doubled ones", plain.replace('\n', "\r\r\n").into_bytes()),
        ("old line ends", plain.replace('\n', "\r").into_bytes()),
        ("tabs", plain.replace(',', "\t").into_bytes()),
        ("blanks", plain.replace(',', "   ").into_bytes()),
        ("decimal commas", german.clone().into_bytes()),
        ("sep=", format!("sep=;\r\n{german}").into_bytes()),
        ("bars", format!("sep=|\n{}", plain.replace(',', "|")).into_bytes()),
        (
            "quotes",
            "\"t\", \"v_out\"\n\"0,5\",\"1,25\"\n\"1,5\",\"2,5\"\n"
                .as_bytes()
                .to_vec(),
        ),
        ("trailing separators", plain.replace('\n', ",,\n").into_bytes()),
        (
            "comments and empty lines",
            format!("# a\n\n{plain}\n  # b\n").into_bytes(),
        ),
        ("no last line end", plain.trim_end().as_bytes().to_vec()),
        ("UTF-16, low byte first", wide(plain, u16::to_le_bytes)),
        ("UTF-16, high byte first", wide(plain, u16::to_be_bytes)),
    ] {
        let sheet = read_bytes(&bytes).unwrap_or_else(|faults| panic!("{name}: {faults}"));
        assert_eq!(sheet.headers().collect::<Vec<_>>(), ["t", "v_out"], "{name}");
        assert_eq!(values(&sheet), [[0.5, 1.5], [1.25, 2.5]], "{name}");
        assert_eq!(sheet.columns()[1].decimals, 2, "{name}");
    }
}

#[test]
fn what_was_repaired_is_said() {
    let repairs = |text: &str| read(text).unwrap().repairs;
    assert_eq!(repairs("t;v\n0,1;1,5\n"), ["decimal commas read as points"]);
    assert_eq!(repairs("t,v\ns,V\n0,1\n"), ["line 2 holds units: they are heeded"]);
    assert_eq!(repairs("t,v\n0,1\n1,2\n2"), ["line 4 is cut off: left out"]);
    assert_eq!(repairs("t,v\n0,1\n"), [""; 0]);
}

#[test]
fn units_below_the_names_scale_as_those_behind_them() {
    for (text, expected) in [
        ("t,duty,v_out,i_l\nms,%,mV,mA\n1,50,1500,20\n", [1e-3, 0.5, 1.5, 0.02]),
        (
            "t,duty,v_out,i_l\n[\u{b5}s],[%],[kV],[uA]\n1,50,1500,20\n",
            [1e-6, 0.5, 1.5e6, 2e-5],
        ),
        ("t;duty;v_out;i_l\nsec;-;Volt;A\n0,5;0,5;1,5;2\n", [0.5, 0.5, 1.5, 2.0]),
        ("t [ms],duty,v_out,i_l\nms,%,V,\n1,50,1,2\n", [1e-3, 0.5, 1.0, 2.0]),
        ("t_us,d%,v_out/mV,i_l (mA)\n1,50,1500,20\n", [1e-6, 0.5, 1.5, 0.02]),
    ] {
        let sheet = read(text).unwrap();
        let located = sheet.locate(&crate::VOCABULARY, &crate::ColumnMap::default()).unwrap();
        let number = |name: &str| located.signal(name).unwrap().number(&sheet, 0).unwrap();
        let found = ["t", "duty", "v_out", "i_l"].map(number);
        let close = found
            .iter()
            .zip(&expected)
            .all(|(a, b)| (a - b).abs() <= 1e-12 * b.abs());
        assert!(close, "{text}: {found:?}");
    }
    let sheet = read("t,CH1,lamp\ns,mV,deg C\n1,1500,20\n").unwrap();
    let map = crate::ColumnMap::parse("v_out=CH1").unwrap();
    let located = sheet.locate(&crate::VOCABULARY, &map).unwrap();
    assert_eq!(located.signal("v_out").unwrap().number(&sheet, 0), Some(1.5));
}

#[test]
fn a_cell_knows_what_it_holds_and_where() {
    let sheet = read("t;v_out\n# c\n0;1,5\n1;\n2;\"over flow\"\n3;nan\n4;1e999\n").unwrap();
    let v_out = &sheet.columns()[1];
    let cells: Vec<Cell<'_>> = (0..5).map(|row| v_out.cell(row)).collect();
    let word = Cell::Word;
    assert_eq!(
        cells,
        [
            Cell::Number(1.5),
            Cell::Empty,
            word("over flow"),
            word("nan"),
            word("1e999")
        ]
    );
    assert!(cells[1].is_missing() && cells[3].is_missing() && !cells[2].is_missing());
    let place = |row, column| sheet.cell_fault(row, column, Message::new("x")).line_column();
    assert_eq!(
        (place(0, 1), place(1, 1), place(2, 1)),
        (Some((3, 3)), Some((4, 3)), Some((5, 4)))
    );
    assert_eq!(sheet.line(2), 5);
    assert_eq!(sheet.row_fault(2, Message::new("x")).line_column(), Some((5, 1)));
    assert_eq!(sheet.name_fault(1, Message::new("x")).line_column(), Some((1, 3)));
}

#[test]
fn what_is_no_table_is_refused_with_its_place() {
    for (text, problem, place) in [
        ("", "the table is empty", None),
        ("# only\n\n", "the table is empty", None),
        ("t,v\n", "the table has no rows", Some((1, 1))),
        ("0.1,2\n0.2,3\n", "the first line holds numbers", Some((1, 1))),
        ("t,v,t\n0,1,2\n", "two columns are called `t`", Some((1, 5))),
        ("t,v\n0,1\n\n0\n1,2\n", "cells are missing", Some((4, 1))),
        ("t,v\n0,1\n0,1,2\n", "more cells", Some((3, 1))),
        ("t,v\n0,5,1,5\n", "more cells", Some((2, 1))),
        ("t,v\n0,\"1\n1,2\n", "a quotation mark is not closed", Some((2, 3))),
        ("t,\"v\n0,1\n", "a quotation mark is not closed", Some((1, 3))),
        ("t,v\n0,1\nt,v\n1,2\n", "the header stands a second time", Some((3, 1))),
        ("t,v\nt,v\n1,2\n", "the header stands a second time", Some((2, 1))),
        ("t;v\n0,5;1\n1;1.5\n", "decimal points and decimal commas", Some((3, 3))),
        ("t;v\n0.5;1\n1;1,5\n", "decimal points and decimal commas", Some((3, 3))),
        ("t,v_out\ns,mA\n1,2\n", "no unit of `v_out`", Some((2, 3))),
        ("t,v_out\nms,MV\n1,2\n", "no unit of `v_out`", Some((2, 4))),
        (
            "t [ms],v_out [mV]\nms,V\n1,2\n",
            "another unit behind its name",
            Some((2, 4)),
        ),
    ] {
        let (found, at) = fault(text);
        assert!(found.contains(problem) && at == place, "{text:?}: {found} {at:?}");
    }
    let hint = read("# t,v\n0,1\n1,2\n").unwrap_err().to_string();
    assert!(hint.contains("take away its `#`"), "{hint}");
}

#[test]
fn files_of_other_kinds_are_called_by_their_names() {
    let cases: [(&[u8], &str); 7] = [
        (b"MATLAB 5.0 MAT-file, Platform: GLNXA64", "not a sound MAT file"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
        (b"MDF     4.10", "not a sound MDF file"),
        (b"PK\x03\x04\x14", "an Excel workbook is one"),
        (b"t\0,\0v\0", "UTF-16 without a byte order mark"),
        (b"\xff\xfet", "UTF-16 text with bytes that are none"),
        (b"t,v\n0,\xb5\n", "not UTF-8"),
    ];
    for (bytes, problem) in cases {
        let fault = read_bytes(bytes).unwrap_err().list.remove(0);
        assert!(fault.problem.contains(problem), "{fault}");
        assert!(fault.hint.is_some(), "{fault}");
    }
}

#[test]
fn very_many_faults_are_counted() {
    let faults = read(&format!("t,v\n{}", "0\n".repeat(50))).unwrap_err();
    assert_eq!(faults.list.len(), 13);
    assert!(faults.to_string().contains("38 more faults"), "{faults}");
}

/// Half a million cells: the time is that of reading, not of counting lines for every row.
#[test]
fn a_large_table_is_read_in_one_go() {
    let rows: String = (0..100_000).map(|n| format!("{n},0.5,{}.25,1,2\n", n % 100)).collect();
    let sheet = read(&format!("t,duty,v_out,i_l,i_out\n{rows}")).unwrap();
    assert_eq!((sheet.rows(), sheet.line(99_999)), (100_000, 100_001));
    assert_eq!(sheet.columns()[2].values[99_999], 99.25);
}

/// SCPI instruments write 9.9E+37 for a value out of range and 9.91E+37 for none.
#[test]
fn the_marks_of_instruments_for_no_measurement_are_missing_values() {
    let sheet = read("t,v_out,i_l\n0,1.5,2\n1,+9.9E+37,3\n2,-9.91E+37,9.9E+37\n3,1.5,oops\n4,8e37,1\n").unwrap();
    let v_out = &sheet.columns()[1];
    assert!(v_out.values[1].is_nan() && v_out.values[2].is_nan());
    assert_eq!(v_out.values[4], 8e37);
    assert!(v_out.cell(1).is_missing() && v_out.cell(2).is_missing() && !v_out.cell(0).is_missing());
    // words keep their order beside them
    assert!(sheet.columns()[2].cell(2).is_missing());
    assert_eq!(sheet.columns()[2].cell(3), Cell::Word("oops"));
    assert_eq!(
        sheet.repairs,
        [
            "2 values of `v_out` are marks of an instrument for none or out of range (9.9e37): not measured",
            "1 value of `i_l` is a mark of an instrument for none or out of range (9.9e37): not measured"
        ]
    );
}
