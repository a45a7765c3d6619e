#![allow(clippy::disallowed_methods)]

use super::*;

fn file(text: &str) -> Result<ColumnMap, Faults> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.toml");
    std::fs::write(&path, text).unwrap();
    ColumnMap::open(&path)
}

#[test]
fn both_forms_say_the_same() {
    let line = ColumnMap::parse("v_out = CH 1, d=D*0.01, r_load=10").unwrap();
    let toml = "[columns]\nv_o = \"CH 1\"\nduty = { name = \"D\", scale = 0.01 }\n[constants]\nr_load = 10.0\n";
    assert_eq!(line, file(toml).unwrap());
    assert_eq!(line.constant("r_load"), Some(10.0));
}

#[test]
fn a_file_says_how_the_table_was_recorded() {
    let map = file("phase = 0.25\nduty = \"applied\"\nsettled = true\n").unwrap();
    assert_eq!(
        (map.phase, map.duty, map.settled),
        (Some(0.25), DutyIs::Applied, Some(true))
    );
    let both = map.and(ColumnMap::parse("v_in=24").unwrap()).unwrap();
    assert_eq!((both.constant("v_in"), both.settled), (Some(24.0), Some(true)));
}

#[test]
fn a_section_says_what_is_different_in_one_record() {
    let text = "phase = 0.5\n[columns]\nv_out = \"CH1\"\n[constants]\nr_load = 10\n\
                [records.second]\nsampled = \"mean\"\ncolumns = { v_out = \"U\", duty = \"D\" }\n";
    let map = file(text).unwrap();
    let first = map.of(Path::new("a/first.csv"));
    assert_eq!(first.mapped().collect::<Vec<_>>(), ["v_out", "r_load"]);
    let second = map.of(Path::new("a/second.csv"));
    let own = ColumnMap::parse("r_load=10,v_out=U,duty=D").unwrap();
    assert_eq!(second.entries, own.entries);
    assert_eq!((second.phase, second.sampled), (Some(0.5), Some(Sampled::Mean)));
    assert_eq!((first.phase, first.sampled), (Some(0.5), None));
    let files = ["a/first.csv", "a/second.csv"].map(Path::new);
    assert_eq!(map.sections_without(&files), [""; 0]);
    assert_eq!(map.sections_without(&files[..1]), ["second"]);
    let twice = map.and(ColumnMap::parse("duty=E").unwrap()).unwrap_err();
    assert!(twice.to_string().contains("`duty` is mapped twice"), "{twice}");
}

#[test]
fn what_cannot_be_read_is_named() {
    for (map, expected) in [
        ("d_rael=duty", "did you mean `d_real`?"),
        ("duty", "quantity=column*factor"),
        ("duty=D*x", "quantity=column*factor"),
        ("v_in=24,v_in=25", "`v_in` is mapped twice"),
        ("v_out=a,v_o=b", "`v_out` is mapped twice"),
    ] {
        let message = ColumnMap::parse(map).unwrap_err().to_string();
        assert!(message.contains(expected), "{map}: {message}");
    }
    for (map, expected, line) in [
        ("[columns]\nv_outt = \"a\"\n", "did you mean `v_out`?", 2),
        ("[columns]\nv_out = \"a\"\nv_o = \"b\"\n", "`v_out` is mapped twice", 3),
        (
            "[columns]\nv_out = \"a\"\n[constants]\nv_out = 3\n",
            "`v_out` is mapped twice",
            4,
        ),
        ("[columns]\nv_out = { nam = \"a\" }\n", "`nam`", 2),
        ("duty = \"asked\"\n", "commanded, applied, direct", 1),
        ("setled = true\n", "did you mean `settled`?", 1),
    ] {
        let faults = file(map).unwrap_err();
        let place = faults.list.iter().find(|fault| fault.to_string().contains(expected));
        let place = place.and_then(toml_input::Fault::line_column).map(|(line, _)| line);
        assert_eq!(place, Some(line), "{map}: {faults}");
    }
}
