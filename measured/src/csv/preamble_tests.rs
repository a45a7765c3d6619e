//! Each instrument's file holds the same plain table.

use std::path::Path;

use crate::{Options, Sheet};

fn read(text: &str) -> Sheet {
    Sheet::parse(Path::new("scope.csv"), text.as_bytes().to_vec(), &Options::default()).unwrap()
}

/// Names, and values to what adding up a counted time leaves.
fn same(one: &Sheet, other: &Sheet, what: &str) {
    assert_eq!(
        one.columns().len(),
        other.columns().len(),
        "{what}: {:?}",
        one.columns()
    );
    for (a, b) in one.columns().iter().zip(other.columns()) {
        assert_eq!(a.name, b.name, "{what}");
        assert_eq!(a.values.len(), b.values.len(), "{what}");
        for (x, y) in a.values.iter().zip(&b.values) {
            assert!((x - y).abs() <= 1e-12 * (1e-6 + y.abs()), "{what}: {x} {y}");
        }
    }
}

const TWO: &str = "t [s],CH1 [V],CH2 [V]\n-1e-6,0.5,12.25\n-5e-7,0.75,12.5\n0,1.5,-0.5\n5e-7,-0.25,3\n";

#[test]
fn captures_of_oscilloscopes_are_the_same_plain_table() {
    let units = "t [second],CH1 [Volt],CH2 [Volt]";
    let plain = |head: &str| read(&TWO.replace("t [s],CH1 [V],CH2 [V]", head));
    for (what, text, head) in [
        (
            "Keysight",
            "x-axis,1,2\nsecond,Volt,Volt\n-1.00000E-06,+500.00000E-03,+12.25000E+00\n-500.00E-09,+750.0E-03,+12.5E+00\n\
             +0.0E+00,+1.5E+00,-500.0E-03\n+500.0E-09,-250.0E-03,+3.0E+00\n",
            units,
        ),
        (
            "Rigol DS1000Z",
            "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.000000e-06,5.000000e-07\n0,5.0e-01,1.225e+01,\n1,7.5e-01,1.25e+01,\n\
             2,1.5e+00,-5.0e-01,\n3,-2.5e-01,3.0e+00,\n",
            "t,CH1 [Volt],CH2 [Volt]",
        ),
        (
            "Tektronix MDO",
            "Model,MDO3024\r\nFirmware Version,1.26\r\n\r\nPoint Format,Y,\r\nHorizontal Units,S,\r\nHorizontal Scale,4e-06,\r\n\
             Sample Interval,5e-07,\r\nRecord Length,4,\r\nGating,0.0% to 100.0%,\r\nProbe Attenuation,10,1\r\nVertical Units,V,V\r\n\
             Vertical Offset,0,0\r\nVertical Scale,0.5,5\r\nLabel,,\r\nTIME,CH1,CH2\r\n-1.0e-06,0.5,12.25\r\n-5.0e-07,0.75,12.5\r\n\
             0,1.5,-0.5\r\n5.0e-07,-0.25,3\r\n",
            "t,CH1,CH2",
        ),
        (
            "Siglent with names",
            "Record Length,Analog:4\nSample Interval,5e-07\nVertical Units,CH1:V CH2:V\nVertical Scale,CH1:0.5 CH2:5\n\
             Model Number,SDS1204X-E\nSerial Number,none\nSoftware Version,1\nSource,CH1,CH2\nSecond,Volt,Volt\n-1e-6,0.5,12.25\n\
             -5e-7,0.75,12.5\n0,1.5,-0.5\n5e-7,-0.25,3\n",
            "t [Second],CH1 [Volt],CH2 [Volt]",
        ),
        (
            "Siglent with units alone",
            "Record Length,Analog:4\nSample Rate,2000000.0\nVertical Scale,CH1: 0.5\nVertical Offset,CH1:0.00000\n\
             Horizontal Scale, 0.000010000\nSecond,Volt,Volt\n-0.000001,0.5,12.25\n-0.0000005,0.75,12.5\n0.0,1.5,-0.5\n\
             0.0000005,-0.25,3\n",
            "t [Second],CH1 [Volt],CH2 [Volt]",
        ),
    ] {
        same(&read(text), &plain(head), what);
    }
}

#[test]
fn settings_beside_the_samples_are_no_columns() {
    let text = "Record Length,2.5e+03,,-1e-6,0.5,\nSample Interval,5e-07,,-5e-7,0.75,\nTrigger Point,2,,0,1.5,\n\
                Source,CH2,,5e-7,-0.25,\nVertical Units,V,,1e-6,0.5,\nHorizontal Units,s,,1.5e-6,0.75,\n,,,2e-6,1,\n";
    let plain = "t [s],CH2 [V]\n-1e-6,0.5\n-5e-7,0.75\n0,1.5\n5e-7,-0.25\n1e-6,0.5\n1.5e-6,0.75\n2e-6,1\n";
    same(&read(text), &read(plain), "Tektronix TDS");
    // a fault shows the cell, not a setting
    let wrong = text.replace("2e-6,1,", "2e-6,oops,");
    let sheet = read(&wrong);
    let fault = sheet.cell_fault(6, 1, toml_input::Message::new("a word"));
    assert_eq!(fault.line_column(), Some((7, 9)));
}

#[test]
fn a_unit_line_of_a_capture_is_heeded_and_other_tables_stay_as_they_were() {
    let located = |text: &str| {
        let sheet = read(text);
        let map = crate::ColumnMap::parse("v_out=CH1").unwrap();
        let located = sheet.locate(&crate::VOCABULARY, &map).unwrap();
        let number = |name: &str| located.signal(name).unwrap().number(&sheet, 1);
        (number("t"), number("v_out"))
    };
    assert_eq!(
        located("x-axis,1\nsecond,mV\n0,1500\n1e-6,1750\n"),
        (Some(1e-6), Some(1.75))
    );
    // a column that happens to be called x, and a first column `type`
    for text in ["x,v_out\n1,2\n3,4\n", "type,v_out\n1,2\n3,4\n"] {
        let names: Vec<String> = read(text).headers().map(str::to_owned).collect();
        assert_eq!(names[1], "v_out", "{text}");
    }
    assert_eq!(read("x,v_out\n1,2\n3,4\n").columns()[0].name, "x");
}

#[test]
fn a_table_without_settings_above_its_names_is_read_as_any_other() {
    for first in ["label", "type", "date", "title", "model", "segments", "path"] {
        let text = format!("{first},duty,v_out\n-,%,mV\n1,50,1500\n2,51,1530\n");
        let names: Vec<String> = read(&text).headers().map(str::to_owned).collect();
        assert_eq!(names, [first, "duty [%]", "v_out [mV]"]);
        let bare = read(&text.replace("-,%,mV\n", ""));
        assert_eq!(bare.headers().collect::<Vec<_>>(), [first, "duty", "v_out"]);
    }
    // a setting in words with as many cells as the rows
    assert_eq!(read("Title,boot\ntime,CH1\n0,1\n1,2\n").headers().next(), Some("t"));
}

#[test]
fn a_capture_has_each_name_once_and_some_rows() {
    let problem = |text: &str| {
        let sheet = Sheet::parse(Path::new("scope.csv"), text.as_bytes().to_vec(), &Options::default());
        sheet.unwrap_err().list[0].problem.clone()
    };
    let twice = problem("x-axis,1,1\nsecond,Volt,Volt\n0,1,2\n1e-6,1,2\n");
    assert_eq!(twice, "two columns are called `CH1 [Volt]`");
    let none = problem("X,CH1,Start,Increment\nSequence,Volt,0,1e-6\n");
    assert_eq!(none, "the table has no rows");
}
