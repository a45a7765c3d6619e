use std::path::Path;

use super::*;
use crate::{Options, VOCABULARY};

fn sheet(text: &str) -> Sheet {
    Sheet::parse(Path::new("a.csv"), text.as_bytes().to_vec(), &Options::default()).unwrap()
}

fn locate(sheet: &Sheet) -> Located {
    sheet.locate(&VOCABULARY, &ColumnMap::default()).unwrap()
}

fn mapped(text: &str, map: &str) -> Result<Located, Faults> {
    sheet(text).locate(&VOCABULARY, &ColumnMap::parse(map).unwrap())
}

#[test]
fn short_forms_and_units_lead_to_one_quantity() {
    let sheet = sheet("timestamps,d (%),v_o_mV,i_o\n0,50,1500,2\n1,60,1600,\n");
    let located = locate(&sheet);
    let at = |name: &str, row| located.signal(name).unwrap().number(&sheet, row);
    assert_eq!(
        (at("t", 1), at("duty", 0), at("v_out", 1)),
        (Some(1.0), Some(0.5), Some(1.6))
    );
    assert_eq!((at("i_out", 0), at("i_out", 1)), (Some(2.0), None));
    let labels = ["t", "duty", "v_out", "i_out"].map(|name| located.signal(name).unwrap().label.clone());
    assert_eq!(
        labels,
        ["timestamps", "d", "v_o", "i_o"],
        "faults speak the file's language"
    );
    assert!(located.signal("i_l").is_none() && located.unused.is_empty());
}

#[test]
fn two_columns_for_one_quantity_are_a_fault_unless_one_is_named() {
    let text = "v_out,v_o\n1,2\n";
    let faults = sheet(text).locate(&VOCABULARY, &ColumnMap::default()).unwrap_err();
    assert_eq!(faults.list[0].line_column(), Some((1, 7)));
    assert!(
        faults
            .to_string()
            .contains("two columns are `v_out`: `v_out` and `v_o`"),
        "{faults}"
    );
    let located = mapped(text, "v_out=v_o").unwrap();
    assert_eq!(located.signal("v_out").unwrap().column(), Some(1));
}

/// As in a plan of `drm acquire` that was filled in.
#[test]
fn a_measured_duty_counts_more_than_the_one_that_was_asked_for() {
    let located = locate(&sheet("duty,d_real\n0.5,0.49\n"));
    assert_eq!(located.signal("duty").unwrap().column(), Some(1));
    assert_eq!(located.unused, [0]);
}

#[test]
fn a_map_heeds_the_unit_behind_the_name_unless_it_has_a_factor() {
    let text = "CH1 [mV],x_ms\n1500,2\n";
    let sheet = sheet(text);
    let at = |located: &Located, name: &str| located.signal(name).unwrap().number(&sheet, 0);
    let plain = mapped(text, "v_out=CH1,t=x_ms").unwrap();
    assert_eq!((at(&plain, "v_out"), at(&plain, "t")), (Some(1.5), Some(0.002)));
    assert!(!plain.signal("v_out").unwrap().is_stated());
    let stated = mapped(text, "v_out=CH1 [mV]*2,t=1.5").unwrap();
    assert_eq!((at(&stated, "v_out"), at(&stated, "t")), (Some(3000.0), Some(1.5)));
    assert!(stated.signal("v_out").unwrap().is_stated());
    let faults = mapped(text, "v_out=CH2").unwrap_err().to_string();
    assert!(
        faults.contains("no column `CH2` for `v_out`") && faults.contains("CH1 [mV], x_ms"),
        "{faults}"
    );
}

#[test]
fn what_is_not_used_is_named() {
    let sheet = sheet("t,lamp,v_out [dBV],,point\n0,on,1,,1\n");
    let map = ColumnMap::parse("i_l=3").unwrap();
    let wanted = VOCABULARY
        .map(|quantity| quantity)
        .into_iter()
        .filter(|quantity| quantity.name == "t");
    let located = sheet.locate(&wanted.collect::<Vec<_>>(), &map).unwrap();
    let expected = [
        "columns not used: `lamp`, `v_out [dBV]`",
        "`i_l` of the column map is not used here",
    ];
    assert_eq!(located.notes(&sheet, &["point"]), expected);
}

fn time_like(header: &str, value: impl Fn(usize) -> String) -> Option<String> {
    let rows: String = (0..30).map(|n| format!("{},0.{}\n", value(n), 3 + n % 5)).collect();
    let sheet = sheet(&format!("{header},duty\n{rows}"));
    let (index, _) = locate(&sheet).time_like(&sheet)?;
    Some(sheet.columns()[index].name.clone())
}

#[test]
fn an_unknown_column_that_looks_like_time_is_found_by_name_or_by_its_values() {
    let seconds = |n: usize| format!("{:.5}", n as f64 * 1e-4);
    for name in ["sampling_time", "Zeit", "t [ticks]", "x", "Sample", "clock_us"] {
        assert_eq!(time_like(name, seconds).as_deref(), Some(name));
    }
    let of_day = |n: usize| format!("12:30:00.{n:03}");
    assert_eq!(time_like("when", of_day).as_deref(), Some("when"));
    let joined = |n: usize| format!("{}", n % 15);
    assert_eq!(time_like("zeit", joined).as_deref(), Some("zeit"));
    let lost = |n: usize| format!("{}", if n < 15 { n } else { n + 4 } as f64 * 1e-4);
    assert_eq!(time_like("x", lost).as_deref(), Some("x"));
}

#[test]
fn constants_counts_and_other_measurements_do_not_look_like_time() {
    assert_eq!(time_like("dead_time", |_| "2e-6".to_owned()), None);
    assert_eq!(time_like("settling_time", |n| format!("{}", n * 7 % 11)), None);
    assert_eq!(time_like("point", |n| format!("{}", n + 1)), None);
    assert_eq!(time_like("", |n| n.to_string()), None);
    assert_eq!(
        time_like("temperature", |n| format!("{}", 20.0 + (n as f64).sqrt().sin())),
        None
    );
}

#[test]
fn in_a_sweep_everything_rises() {
    let rows: String = (0..30)
        .map(|n| format!("{},{}\n", 0.1 + 0.02 * f64::from(n), 2 * n))
        .collect();
    let sheet = sheet(&format!("duty,v_scope\n{rows}"));
    assert_eq!(locate(&sheet).time_like(&sheet), None);
}

#[test]
fn a_missing_column_is_sought_among_the_names_that_people_give() {
    let sheet = sheet("Tastgrad,Spannung [V],lamp\n0.5,12,1\n");
    let hint = |name: &str| sheet.missing(&Quantity::all(&[name])[0], "").hint.unwrap();
    assert!(hint("duty").contains("--map duty=Tastgrad"), "{}", hint("duty"));
    assert!(
        hint("v_out").contains("--map 'v_out=Spannung [V]'"),
        "{}",
        hint("v_out")
    );
    assert!(hint("i_l").contains("--map i_l=COLUMN"), "{}", hint("i_l"));
}

/// Meters at settled points beside a logger: one map names the logger's columns, and a section takes out what the meters have not.
#[test]
fn a_section_takes_a_quantity_out_of_the_common_map() {
    let map = |own: &str| {
        let text = format!("[columns]\ni_l = \"I_L\"\n[records.a.columns]\nv_out = \"U\"\n{own}");
        ColumnMap::from_text(Path::new("map.toml"), &text).unwrap()
    };
    let meters = sheet("duty,U,i_l_set\n0.5,1.5,2\n");
    let message = meters.locate(&VOCABULARY, &map("")).unwrap_err().to_string();
    assert!(
        message.contains("no column `I_L`") && message.contains("[records.a.columns]"),
        "{message}"
    );
    assert!(message.contains("i_l = false"), "{message}");
    let located = meters.locate(&VOCABULARY, &map("i_l = false\n")).unwrap();
    assert!(located.signal("i_l").is_none() && located.signal("v_out").is_some());
    // nor is it found by its name then
    let both = sheet("duty,U,i_l\n0.5,1.5,2\n");
    assert!(
        both.locate(&VOCABULARY, &map("i_l = false\n"))
            .unwrap()
            .signal("i_l")
            .is_none()
    );
}

/// `i_load` is a load that was set; whoever maps the column as a measured current has said that it is none.
#[test]
fn a_column_that_the_map_names_is_nothing_else_by_its_name() {
    let text = "duty,v_out,i_load (A)\n0.5,1.5,2\n";
    assert!(mapped(text, "").unwrap().signal("i_load").is_some());
    let located = mapped(text, "i_out=i_load").unwrap();
    assert!(located.signal("i_out").is_some() && located.signal("i_load").is_none());
    // both are said to be the same only by the map itself
    let both = mapped(text, "i_out=i_load,i_load=i_load").unwrap();
    assert!(both.signal("i_out").is_some() && both.signal("i_load").is_some());
}

/// Oscilloscopes call any channel Volt, with a current probe at it too.
#[test]
fn a_mapped_column_in_a_unit_of_another_kind_needs_a_factor() {
    let text = "t,CH1 [Volt],CH2 [Volt],x [V]\n0,12,0.1,1\n";
    let faults = mapped(text, "v_out=CH1,i_l=CH2").unwrap_err().to_string();
    for words in ["`CH2 [Volt]`", "`i_l`", "A, with a prefix", "--map i_l=CH2*FACTOR"] {
        assert!(faults.contains(words), "{words}: {faults}");
    }
    let located = mapped(text, "v_out=CH1,i_l=CH2*10").unwrap();
    assert_eq!(located.signal("i_l").unwrap().scale(), 10.0);
    // letters behind a stroke may be part of the name, and an own unit is none of these
    assert!(mapped("i_A,u/phase\n1,2\n", "v_out=i_A,i_l=u/phase").is_ok());
}
