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
        ("V_out,i_l\n100.0,5.0\n", &["`v_out`"]),
        ("v_out,i_l,v_out\n1,2,3\n", &["two columns", "`v_out`"]),
        ("v_out,i_l\n100.0,5.0\n100.0,high\n", &["line 3", "`i_l`", "`high`"]),
        (
            "v_out,i_l\n100.0,5.0\n100.0\n",
            &["line 3", "`i_l`", "expected a number"],
        ),
        (
            "v_out,i_l\n100.0,5.0\n100.0,",
            &["line 3", "`i_l`", "expected a number"],
        ),
        ("v_out,i_l\n100.0 V,5.0\n", &["line 2", "`v_out`", "`100.0 V`"]),
        ("# note\n\nv_out,i_l\r\n100.0,5.0\r\n,5.0\r\n", &["line 5", "`v_out`"]),
        ("v_out;i_l\n100,0;5,0\n", &["`v_out`"]),
        ("", &["`v_out`"]),
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
fn decimal_commas_are_refused_and_not_read_as_other_columns() {
    let desk = desk();
    for text in ["v_out,i_l\n100,0,5,0\n", "v_out,i_l\n\"100,0\",\"5,0\"\n"] {
        desk.write("trace.csv", text);
        desk.refuse(VERIFY, &["trace.csv", "line 2"]);
    }
}
