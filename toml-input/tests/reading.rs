//! Places, limits and typed values: what is read, and what is said where.

#![allow(clippy::unwrap_used, clippy::panic, clippy::disallowed_methods)]

use std::path::Path;

use toml_input::{
    Document, Fault, Faults, FileName, MAX_TOML_BYTES, Message, Place, Sink, Table, Value, messages, nearest,
};

fn read<T>(text: &str, read: impl FnOnce(&mut Table<'_>, &mut Sink) -> Option<T>) -> Result<T, Faults> {
    Document::from_text(Path::new("in.toml"), text)?.read(read)
}

/// The faults of a file whose only key is `x`.
fn faults<T>(text: &str, get: impl FnOnce(&Value<'_>, &mut Sink) -> Option<T>) -> String {
    let read = read(text, |root, faults| {
        root.required("x", "give x", faults).and_then(|v| get(&v, faults))
    });
    read.err().map(|faults| faults.to_string()).unwrap_or_default()
}

#[test]
fn typed_values_are_read() {
    let text =
        "x = 2\nn = -3\nw = \"b\"\non = true\nr = [1, 2.5]\nl = [1, 2]\n[t]\na = 1\n[[s]]\na = 2\n[[s]]\na = 3\n";
    let values = read(text, |root, faults| {
        assert_eq!(root.optional("x")?.number(faults), Some(2.0));
        assert_eq!(root.optional("n")?.integer(-3_i8..=3, faults), Some(-3));
        assert_eq!(root.optional("w")?.choice(&[("a", 1), ("b", 2)], faults), Some(2));
        assert_eq!(root.optional("on")?.boolean(faults), Some(true));
        assert_eq!(root.optional("r")?.interval(faults), Some([1.0, 2.5]));
        let list = root.optional("l")?.each("numbers", faults, Value::positive);
        assert_eq!(list, Some(vec![1.0, 2.0]));
        let a = |t: &mut Table<'_>, f: &mut Sink| t.required("a", "", f)?.integer(0..=9_u32, f);
        assert_eq!(root.section("t", faults, a), Some(1));
        Some(root.sections("s", faults, a))
    });
    assert_eq!(values.unwrap(), [2, 3]);
}

#[test]
fn what_is_left_out_takes_its_default() {
    let values = read("", |root, faults| {
        let inner = |t: &mut Table<'_>, f: &mut Sink| Some(t.with_default("a", 5.0, f, Value::number));
        Some((root.section("t", faults, inner)?, root.sections("s", faults, inner)))
    });
    assert_eq!(values.unwrap(), (5.0, vec![]));
}

#[test]
fn wrong_values_say_what_was_found_and_expected() {
    let number = |text: &str| faults(text, |v, f| v.number(f));
    let cases = [
        (number("x = nan"), "`x` is not a finite number"),
        (number("x = \"1,5\""), "hint: write a number with a point"),
        (number("x = \"TODO\""), "`x` still says TODO: fill in a number"),
        (
            number("x = 9223372036854775808"),
            "found: a whole number beyond 64 bits",
        ),
        (faults("x = 0", |v, f| v.positive(f)), "`x` must be greater than 0"),
        (faults("x = 2", |v, f| v.number_within(0.0..=1.0, f)), "0 to 1"),
        (
            faults("x = -2", |v, f| v.number_within(0.0..=f64::MAX, f)),
            "at least 0",
        ),
        (faults("x = 2", |v, f| v.number_within(f64::MIN..=1.0, f)), "at most 1"),
        (faults("x = 300", |v, f| v.integer(0..=255_u8, f)), "found: 300"),
        (faults("x = -1", |v, f| v.integer(0..=u64::MAX, f)), "found: -1"),
        (
            faults("x = 1.0", |v, f| v.integer(1..=9, f)),
            "expected: a whole number, 1 to 9",
        ),
        (
            faults("x = 1", |v, f| v.text(f).map(str::len)),
            "expected: a text in quotes",
        ),
        (faults("x = \"on\"", |v, f| v.boolean(f)), "expected: true or false"),
        (
            faults("x = \"buk\"", |v, f| v.choice(&[("buck", ())], f)),
            "did you mean \"buck\"?",
        ),
        (faults("x = [2, 1]", |v, f| v.interval(f)), "hint: write [1, 2]"),
        (faults("x = [0,4, 0,6]", |v, f| v.interval(f)), "a decimal comma?"),
        (
            faults("x = 1979-05-27", |v, f| v.pairs(f).map(|p| p.len())),
            "found: a date",
        ),
        (faults("y = 1", |v, f| v.number(f)), "`x` is missing at the top level"),
        (faults("x = 1\nx = 2", |v, f| v.number(f)), "this is not valid TOML"),
        (faults("x = 1,5", |v, f| v.number(f)), "write 1.5 instead of 1,5"),
    ];
    for (text, part) in cases {
        assert!(text.contains(part), "{part} in {text:?}");
    }
}

#[test]
fn every_faulty_element_of_a_list_is_named() {
    let text = faults("x = [0, \"a\", 3]", |v, f| v.each("numbers", f, Value::positive));
    assert_eq!(text.matches("error:").count(), 2, "{text}");
}

#[test]
fn unknown_keys_are_faults_and_a_reader_may_know_the_hint() {
    let document = Document::from_text(Path::new("in.toml"), "lenght = 1\nzzz = 2\n").unwrap();
    let (mut root, mut faults) = (document.root(), Sink::new());
    assert_eq!((root.optional("length").is_none(), root.count()), (true, 2));
    root.finish_with(&mut faults, |key| (key == "zzz").then(|| "try length".to_owned()));
    let faults = faults.propagate().unwrap_err();
    let hints: Vec<_> = faults.iter().map(|fault| fault.hint.as_deref()).collect();
    assert_eq!(hints, [Some("did you mean `length`?"), Some("try length")]);
    assert_eq!(nearest("ab", ["zz", "xyz"]), None);
}

#[test]
fn faults_come_in_the_order_of_the_file_and_once() {
    let error = read::<()>("a = 1\nb = 2\n", |root, faults| {
        for key in ["b", "a", "b"] {
            faults.extend(root.optional(key).map(|v| v.fault(Message::new(format!("bad {key}")))));
        }
        None
    });
    let problems: Vec<_> = error.unwrap_err().list.into_iter().map(|f| f.problem).collect();
    assert_eq!(problems, ["bad a", "bad b"]);
}

#[test]
fn nothing_read_for_no_reason_is_refused_all_the_same() {
    assert!(
        read::<()>("", |_, _| None)
            .unwrap_err()
            .to_string()
            .contains("incomplete")
    );
}

#[test]
fn a_fault_inside_a_text_points_into_it_unless_it_has_escapes() {
    let column = |text: &str| {
        let document = Document::from_text(Path::new("in.toml"), text).unwrap();
        let fault = document
            .peek(&["t", "x"])
            .unwrap()
            .fault_within(&(2..3), Message::new(""));
        fault.line_column().unwrap()
    };
    assert_eq!(column("[t]\nx = \"abcd\""), (2, 8));
    assert_eq!(column("[t]\r\nx = \"abc\\u0041\""), (2, 5));
}

#[test]
fn places_count_characters_and_long_lines_are_cut() {
    let fault = Document::from_text(Path::new("in.toml"), "# é\n\"é\" = 1\r\n").unwrap();
    let fault = fault.peek(&["é"]).unwrap().fault(Message::new("bad\u{7}"));
    let Place::Span {
        column, text, length, ..
    } = &fault.place
    else {
        panic!("{fault}")
    };
    assert_eq!((*column, text.as_str(), *length), (7, "\"é\" = 1", 1));
    assert!(!fault.to_string().contains('\u{7}'));
    let long = faults(&format!("x = [{}true]", "1, ".repeat(100)), |v, f| {
        v.each("", f, Value::number)
    });
    assert!(long.contains("in.toml:1:306"), "{long}");
    assert!(long.lines().all(|line| line.chars().count() < 130), "{long}");
}

#[test]
fn a_fault_of_no_file_shows_none() {
    let fault = Fault::from(Message::new("too much").found("3"));
    assert_eq!(fault.to_string(), "error: too much\n  = found: 3\n");
}

#[test]
fn files_are_read_within_their_limits() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("in.toml");
    let open = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        Document::open(&path).map_err(|faults| faults.to_string())
    };
    let bom = open("\u{feff}x = 1".as_bytes()).unwrap();
    assert_eq!(
        bom.peek(&["x"]).unwrap().fault(Message::new("")).line_column(),
        Some((1, 5))
    );
    let latin1 = open(b"x = 1\n# \xe9\n").unwrap_err();
    assert!(
        latin1.contains("in.toml:2:3") && latin1.contains("byte 0xe9"),
        "{latin1}"
    );
    let comment = vec![b'#'; usize::try_from(MAX_TOML_BYTES).unwrap()];
    assert!(open(&comment).is_ok());
    assert!(
        open(&[comment.as_slice(), b"#"].concat())
            .unwrap_err()
            .contains("is too large")
    );
    let said = |path: &Path| Document::open(path).unwrap_err().to_string();
    assert!(said(folder.path()).contains("is a folder"));
    assert!(said(&folder.path().join("none.toml")).contains("cannot find the file"));
    assert!(
        !said(&folder.path().join("none.toml")).contains("relative"),
        "the path is absolute"
    );
    #[cfg(unix)]
    assert!(said(Path::new("/dev/null")).contains("is not a regular file"));
}

#[test]
fn what_a_missing_file_is_relative_to_follows_from_who_named_it() {
    let said = |name: FileName| Document::open(name).unwrap_err().to_string();
    let typed = FileName::new(Path::new("nope/in.toml"));
    assert!(said(typed.clone()).contains("relative to the working folder"));
    let named = typed.beside("other.toml");
    assert_eq!(named.shown, Path::new("nope/other.toml"));
    assert!(said(named).contains("relative to the folder of the file that names them"));
}

#[test]
fn a_file_beside_another_is_shown_without_the_way_in_and_out() {
    let shown = |file: &str, text: &str| FileName::new(Path::new(file)).beside(text).shown;
    for (file, text, expected) in [
        ("simulate/a.toml", "../plants/b.toml", "plants/b.toml"),
        ("a/b/c.toml", "../../d.toml", "d.toml"),
        ("a/b/c.toml", "../d.toml", "a/d.toml"),
        // out of the working folder there is no shorter way
        ("a.toml", "../d.toml", "../d.toml"),
        ("../a/b.toml", "../../d.toml", "../../d.toml"),
        ("a/b.toml", "c/../d.toml", "a/c/../d.toml"),
        ("a/b.toml", "/d.toml", "/d.toml"),
    ] {
        assert_eq!(shown(file, text), Path::new(expected), "{text} beside {file}");
    }
}

#[cfg(unix)]
#[test]
fn a_way_out_of_a_linked_folder_is_shown_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(at("far/away")).unwrap();
    std::fs::write(at("far/d.toml"), "x = 1").unwrap();
    std::os::unix::fs::symlink(at("far/away"), at("near")).unwrap();
    let named = FileName::new(&at("near/a.toml")).beside("../d.toml");
    assert_eq!(named.shown, at("near/../d.toml"));
    assert!(named.is_file(), "it is `far/d.toml`");
}

#[test]
fn an_unknown_name_is_answered_with_all_and_the_nearest() {
    let fault = Fault::from(messages::unknown(
        "target",
        "cortexm4",
        &["host", "cortex-m3", "cortex-m4f"],
    ));
    assert_eq!(fault.problem, "unknown target `cortexm4`");
    assert_eq!(fault.expected.as_deref(), Some("one of host, cortex-m3, cortex-m4f"));
    assert_eq!(fault.hint.as_deref(), Some("did you mean `cortex-m4f`?"));
}
