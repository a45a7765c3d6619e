//! What is wrong with a table is either an error with its place, or a repair that is reported: one line for each.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Faults, Parameters};

mod cases;
mod table;

use cases::all;
use table::{HEADER, column, good, header, read, text, times, with};

#[test]
fn the_good_table_is_good() {
    let record = read(text(&good()).as_bytes()).unwrap();
    assert_eq!((record.rows(), record.repairs.len()), (40, 0), "{:?}", record.repairs);
}

#[test]
fn what_cannot_be_used_is_an_error_that_says_where_and_what_to_do() {
    for (name, bytes, problem, line) in all() {
        let faults = read(&bytes).expect_err(name);
        let fault = &faults.list[0];
        assert!(fault.problem.contains(problem), "{name}: {}", fault.problem);
        assert_eq!(fault.line_column().map(|(line, _)| line), line, "{name}");
        assert!(faults.to_string().contains("run.csv"), "{name}: {faults}");
        let helps = fault.hint.is_some() || fault.expected.is_some() || fault.found.is_some();
        assert!(helps, "{name}: {faults}");
    }
}

#[test]
fn what_can_be_repaired_is_repaired_and_said() {
    let rows = good();
    let semicolons = text(&rows).replace(',', ";").replace('.', ",");
    let mut repeated = rows.clone();
    repeated.insert(6, rows[5].clone());
    let mut gap = rows.clone();
    gap.drain(15..22);
    let mut units = rows.clone();
    units.insert(1, "second,,Volt,Ampere,V,ohm".to_owned());
    let jitter = column(0, |cell| {
        let t: f64 = cell.parse().unwrap();
        format!("{:.7}", t + if (t * 1e4) as usize % 3 == 1 { 5e-6 } else { 0.0 })
    });
    let cut = text(&rows);
    let cases: Vec<(&str, String, &str)> = vec![
        ("semicolons", semicolons, "decimal commas"),
        ("repeated time", text(&repeated), "1 rows repeat the time"),
        ("gap", text(&gap), "1 gap, in which 7 rows are missing"),
        ("cut", cut[..cut.len() - 12].to_owned(), "is cut off"),
        ("jitter", jitter, "jitter by up to"),
        (
            "empty cells",
            with(5, |l| {
                l.replacen(",100.", ",,", 1).replace(",,548", ",").replace(",,411", ",")
            }),
            "rows without v_o",
        ),
        ("stuck column", column(3, |_| "7.0".to_owned()), "i_l is constant"),
        (
            "missing duty",
            with(6, |l| l.replace(",0.5,", ",,")),
            "1 rows without duty",
        ),
        ("units", text(&units), "holds units"),
    ];
    for (name, text, repair) in cases {
        let record = read(text.as_bytes()).unwrap_or_else(|faults| panic!("{name}: {faults}\n{text}"));
        let found = record.repairs.iter().any(|said| said.contains(repair));
        assert!(found, "{name}: {:?}", record.repairs);
    }
}

#[test]
fn what_is_only_another_way_of_writing_it_changes_nothing() {
    let plain = read(text(&good()).as_bytes()).unwrap();
    let marked = format!("\u{feff}{}", text(&good()));
    let carriage = text(&good()).replace('\n', "\r\n");
    let old = text(&good()).replace('\n', "\r");
    let tabs = text(&good()).replace(',', "\t");
    let blanks = text(&good()).replace(',', "  ");
    let quoted = header("v_o", "\"v_o\"");
    let millivolts = {
        let mut lines: Vec<String> = column(2, times(1e3)).lines().map(str::to_owned).collect();
        lines[0] = lines[0].replace("v_o", "v_o [mV]");
        text(&lines)
    };
    for (name, other) in [
        ("mark", marked),
        ("carriage returns", carriage),
        ("old line ends", old),
        ("tabs", tabs),
        ("blanks", blanks),
        ("quotes", quoted),
        ("unit in the name", millivolts),
    ] {
        let record = read(other.as_bytes()).unwrap_or_else(|faults| panic!("{name}: {faults}"));
        let same = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(same(&record.measured[0], &plain.measured[0]), "{name}");
        assert!(
            same(&record.duty, &plain.duty) && record.repairs.is_empty(),
            "{name}: {:?}",
            record.repairs
        );
    }
}

/// A column called `timestamps` once made a record over time a table of settled points, with causes to match.
#[test]
fn other_names_of_the_columns_make_the_same_record() {
    let plain = read(text(&good()).as_bytes()).unwrap();
    for names in [
        "timestamps,duty,v_out,i_l,v_in,r_load",
        "time,d_real,v_out,i_l,v_in,r_load",
        "Time [s],Duty,V_out,I_L,V_in,R_load",
    ] {
        let record = read(header(HEADER, names).as_bytes()).unwrap_or_else(|faults| panic!("{names}: {faults}"));
        assert!(
            !record.settled && record.repairs.is_empty(),
            "{names}: {:?}",
            record.repairs
        );
        assert_eq!((&record.duty, &record.time), (&plain.duty, &plain.time), "{names}");
        assert_eq!(record.segments, plain.segments);
    }
}

#[test]
fn what_is_not_used_is_named_and_rows_are_settled_if_the_user_says_so() {
    let more = header("i_l", "lamp");
    assert_eq!(read(more.as_bytes()).unwrap().repairs, ["column not used: `lamp`"]);
    let strange = header("t,", "Zeit,");
    let with = |map: &str, settled: Option<bool>| {
        let sheet = Sheet::parse(Path::new("run.csv"), strange.clone().into(), &Record::file_options())?;
        let mut map = ColumnMap::parse(map)?;
        map.settled = settled;
        Record::read(&sheet, &map, &Parameters::paper_table())
    };
    assert!(!with("t=Zeit", None).unwrap().settled);
    let said = with("", Some(true)).unwrap();
    assert!(
        said.settled && said.repairs == ["column not used: `Zeit`"],
        "{:?}",
        said.repairs
    );
    assert!(with("t=Zeit", Some(true)).unwrap().settled);
    let faults = with("", Some(false)).unwrap_err().to_string();
    assert!(
        faults.contains("no column `t`") && faults.contains("settled = false"),
        "{faults}"
    );
    let faults = with("", None).unwrap_err().to_string();
    assert!(
        faults.contains("--map t=Zeit") && faults.contains("--settled"),
        "{faults}"
    );
}

#[test]
fn a_set_load_current_is_said_to_be_set_unless_the_load_current_was_measured() {
    let note = "i_load is read as the load that was set; a measured load current is i_out";
    let said = |table: String| read(table.as_bytes()).unwrap().repairs.iter().any(|text| text == note);
    assert!(!said(text(&good())));
    assert!(said(header("r_load", "i_load")));
    assert!(!said(header("i_l,v_in,r_load", "i_out,v_in,i_load")));
}

#[test]
fn a_load_current_with_the_jitter_of_a_meter_is_measured_whatever_its_column_is_called() {
    let loads = |load: fn(usize) -> f64| {
        let row = |n: usize| {
            format!(
                "{},0.5,{},{}\n",
                n as f64 * 5e-5,
                100.0 + (n % 7) as f64 * 1e-3,
                load(n)
            )
        };
        let rows: String = (0..80).map(row).collect();
        read(format!("t,duty,v_out,i_load\n{rows}").as_bytes()).unwrap()
    };
    let note = |record: &Record| record.repairs.iter().any(|text| text.contains("it is taken for i_out"));
    let set = loads(|n| if n < 40 { 2.0 } else { 4.0 });
    let ramp = loads(|n| 2.0 + 0.01 * n as f64);
    let metered = loads(|n| 2.0 + 0.008 * f64::from((n as u32).wrapping_mul(2_654_435_761) >> 16) / 65_536.0);
    assert_eq!([&set, &ramp, &metered].map(note), [false, false, true]);
}

#[test]
fn the_current_of_the_resistor_is_no_second_load() {
    let taken = |current: fn(f64) -> f64| {
        let row = |n: usize| {
            // a slow swing, whose current no jitter of a meter shows
            let v = 12.0 + (n as f64 / 9.0).sin();
            format!("{},0.25,{v:.4},2.4,{:.4}\n", n as f64 * 1e-4, current(v))
        };
        let rows: String = (0..120).map(row).collect();
        let record = read(format!("t,duty,v_out,r_load,i_load\n{rows}").as_bytes()).unwrap();
        record.repairs.iter().any(|text| text.contains("no second load"))
    };
    assert!(taken(|v| v / 2.4 * 1.02));
    assert!(!taken(|_| 5.0), "a load that was set beside the resistor");
    assert!(
        !taken(|v| 2.0 - 0.1 * (v - 12.0)),
        "another load, which draws less as the voltage rises"
    );
}

#[test]
fn columns_with_names_of_their_own_get_a_whole_map_proposed_and_never_applied() {
    let other = header(HEADER, "time_s,D,Vout,IL,Spannung,Iout");
    let faults = read(other.as_bytes()).unwrap_err().to_string();
    assert!(faults.contains("--map v_out=Vout,i_l=IL,i_out=Iout"), "{faults}");
    let none = header(HEADER, "Zeit,Tastgrad,Vout [V],IL,Vin,r_load");
    let faults = read(none.as_bytes()).unwrap_err().to_string();
    assert!(
        faults.contains("--map 't=Zeit,duty=Tastgrad,v_out=Vout [V],i_l=IL,v_in=Vin'"),
        "{faults}"
    );
    // what the record can do without is read only if the map says so
    let some = header("i_l", "IL");
    let repairs = read(some.as_bytes()).unwrap().repairs;
    let note = "`IL` looks like i_l and is not read as such: --map i_l=IL";
    assert!(repairs.iter().any(|text| text == note), "{repairs:?}");
}

fn mapped(table: &str, map: &str) -> Result<Record, Faults> {
    let sheet = Sheet::parse(Path::new("run.csv"), table.into(), &Record::file_options())?;
    Record::read(&sheet, &ColumnMap::parse(map)?, &Parameters::paper_table())
}

#[test]
fn a_sensor_the_other_way_round_is_said_with_the_map_that_turns_it() {
    for (table, message, map) in [
        (column(3, times(-1.0)), "i_l has the turned sign", "i_l=i_l*-1"),
        (column(2, times(-1.0)), "v_o has the turned sign", "v_out=v_o*-1"),
        (column(4, times(-1.0)), "v_in has the turned sign", "v_in=v_in*-1"),
    ] {
        let faults = read(table.as_bytes()).unwrap_err().to_string();
        assert!(
            faults.contains(message) && faults.contains(&format!("--map {map}\n")),
            "{faults}"
        );
        assert!(mapped(&table, map).is_ok());
    }
    // a unit of its own stays in the factor
    let milliamperes = column(3, times(-1000.0)).replace("i_l", "i_l [mA]");
    let faults = read(milliamperes.as_bytes()).unwrap_err().to_string();
    assert!(faults.contains("--map 'i_l=i_l [mA]*-0.001'"), "{faults}");
    assert!(mapped(&milliamperes, "i_l=i_l [mA]*-0.001").is_ok());
    assert!(
        mapped(&column(3, times(-1.0)), "i_l=i_l*1").is_ok(),
        "who gives a factor knows"
    );
}

#[test]
fn one_probe_of_another_ratio_is_said_where_the_other_signals_agree() {
    let tenfold = column(2, times(10.0));
    let faults = read(tenfold.as_bytes()).unwrap_err().to_string();
    assert!(faults.contains("v_o is 10 times what the model has"), "{faults}");
    assert!(
        faults.contains("--map v_out=v_o*0.1;") && mapped(&tenfold, "v_out=v_o*0.1").is_ok(),
        "{faults}"
    );
    // a current alone may be twice as large because the load is another
    let doubled = column(3, times(2.0));
    assert!(read(doubled.as_bytes()).is_ok());
    let beside_i_out = |table: &str| {
        let with_i_out = table.replace("v_in", "i_out");
        let lines = with_i_out.lines().enumerate().map(|(n, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if n > 0 {
                cells[4] = format!("{:.3}", cells[4].parse::<f64>().unwrap() / 40.0);
            }
            cells.join(",")
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    assert!(read(beside_i_out(&text(&good())).as_bytes()).is_ok());
    let faults = read(beside_i_out(&doubled).as_bytes()).unwrap_err().to_string();
    assert!(faults.contains("i_l is 2 times what the model has"), "{faults}");
}

#[test]
fn a_duty_of_the_lower_switch_is_said() {
    let of = |duty: f64| {
        let lines = good().into_iter().enumerate().map(|(n, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if n > 0 {
                cells[1] = duty.to_string();
                cells[2] = format!("{:.3}", 1.6 * cells[2].parse::<f64>().unwrap());
                cells[3] = format!("{:.3}", 1.6 * cells[3].parse::<f64>().unwrap());
            }
            cells.join(",")
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    assert!(read(of(0.8).as_bytes()).is_ok());
    let faults = read(of(0.2).as_bytes()).unwrap_err().to_string();
    assert!(
        faults.contains("1 - d") && faults.contains("{ name = \"d\", scale = -1.0, offset = 1.0 }"),
        "{faults}"
    );
    assert!(mapped(&of(0.2), "duty=d*1").is_ok(), "who gives a factor knows");
}
