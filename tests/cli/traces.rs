//! `policyc verify --trace`: recorded measurements, sound and spoiled.

use super::Desk;

/// Bad traces are refused before anything is built; good ones run against the C code of one small policy.
fn desk() -> Desk {
    let desk = Desk::new("minimal");
    desk.succeed("compile policy --out out");
    desk
}

const VERIFY: &str = "verify policy --generated out --steps 200 --trace trace.csv";

#[test]
fn a_sound_trace_is_replayed_whatever_its_line_ends_order_and_other_columns() {
    let desk = desk();
    for text in [
        "v_out,i_l\n100.0,5.0\n101.5,4.5\n",
        "\u{feff}t,i_l,v_out\r\n0.0,5.0,100.0\r\n1e-4,4.5,101.5\r\n",
        "# from the bench\n\"v_out\", \"i_l\"\n100,5\n\nnan,5\n-inf,1e3\n101.5,4.5",
    ] {
        desk.write("trace.csv", text);
        let said = desk.succeed(VERIFY);
        assert!(said.contains("200 steps"), "{said}");
    }
}

/// Two recordings that differ lead to different words, so they are really played.
#[test]
fn the_trace_is_part_of_what_is_compared() {
    let desk = desk();
    let checksum = |text: &str| {
        desk.write("trace.csv", text);
        let said = desk.succeed(VERIFY);
        said.lines().find(|line| line.contains("checksum")).unwrap().to_owned()
    };
    let one = checksum("v_out,i_l\n100.0,5.0\n");
    assert_eq!(one, checksum("i_l,v_out\r\n5,100\r\n"));
    assert_ne!(one, checksum("v_out,i_l\n100.5,5.0\n"));
}

#[test]
fn a_spoiled_trace_is_refused_with_its_line_and_column() {
    let desk = desk();
    for (text, words) in [
        ("v_out\n100.0\n", &["`i_l`"][..]),
        ("u_out,i_l\n100.0,5.0\n", &["`v_out`", "u_out"]),
        ("v_out,i_l,v_out\n1,2,3\n", &["two columns", "`v_out`"]),
        (
            "v_out,i_l\n100.0,5.0\n100.0,high\n",
            &["trace.csv:3:7", "`i_l`", "high"],
        ),
        ("v_out,i_l\n100.0,5.0\n100.0\n", &["trace.csv:3", "cells are missing"]),
        (
            "v_out,i_l\n100.0,5.0\n100.0,",
            &["trace.csv:3:7", "`i_l`", "expected: a finite number"],
        ),
        (
            "v_out,i_l\n100.0 V,5.0\n",
            &["trace.csv:2:1", "`v_out`", "found: 100.0 V"],
        ),
        (
            "# note\n\nv_out,i_l\r\n100.0,5.0\r\n,5.0\r\n",
            &["trace.csv:5:1", "`v_out`"],
        ),
        ("v_out,i_l,v_o\n1,2,3\n", &["two columns are `v_out`", "`v_o`"]),
        ("v_out;i_l\n100,0;5.5\n", &["trace.csv:2", "decimal commas"]),
        ("v_out,i_l\n", &["no rows"]),
        ("", &["the table is empty"]),
    ] {
        desk.write("trace.csv", text);
        let said = desk.refuse(VERIFY, words);
        assert!(said.contains("trace.csv"), "{said}");
    }
}

#[test]
fn a_trace_that_cannot_be_read_is_named() {
    let desk = desk();
    desk.refuse(VERIFY, &["trace.csv"]);
    std::fs::write(desk.path("trace.csv"), b"v_out,i_l\n1\xff,2\n").unwrap();
    desk.refuse(VERIFY, &["trace.csv", "UTF-8"]);
}

/// A decimal comma splits a number in two: silently read as 100 V and 0 A it would be a wrong measurement.
#[test]
fn decimal_commas_are_read_where_they_are_clear_and_refused_elsewhere() {
    let desk = desk();
    desk.write("trace.csv", "v_out,i_l\n100,0,5,0\n");
    desk.refuse(VERIFY, &["trace.csv:2", "0,5"]);
    let checksum = |text: &str| {
        desk.write("trace.csv", text);
        let said = desk.succeed(VERIFY);
        said.lines().find(|line| line.contains("checksum")).unwrap().to_owned()
    };
    let plain = checksum("v_out,i_l\n100.5,5.0\n");
    assert_eq!(plain, checksum("v_out,i_l\n\"100,5\",\"5,0\"\n"));
    assert_eq!(plain, checksum("i_l;v_o\n5,0;100,5\n"));
    // the policy says no unit of its signals, so there is nothing to convert millivolts to
    desk.write("trace.csv", "i_l;v_o [mV]\n5,0;100500\n");
    desk.refuse(VERIFY, &["trace.csv:1", "v_o [mV]"]);
}

#[test]
fn a_column_that_no_signal_asked_for_is_named() {
    let desk = desk();
    desk.write("trace.csv", "t,v_out,i_l\n0,100.0,5.0\n");
    let ran = desk.type_in(VERIFY);
    assert!(
        ran.stderr.contains("note: trace.csv: column not used: `t`"),
        "{}",
        ran.stderr
    );
}
