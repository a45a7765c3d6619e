use std::fmt::Write as _;
use std::path::Path;

use plant::Parameters;

use super::digits::lattice;
use super::*;

fn read(text: &str) -> Result<Record, Faults> {
    let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options())?;
    Record::read(&sheet, &ColumnMap::default(), &Parameters::paper_table())
}

/// 30 rows at the middle of the period; `edit` may change the line of a row.
fn rows(edit: impl Fn(usize, String) -> String) -> String {
    let mut text = String::from("t,d,v_o,r_load\n");
    for n in 0..30 {
        let line = format!(
            "{:.6},0.5,{:.3},20",
            (n as f64 + 0.5) * 1e-4,
            100.0 + 0.137 * (n % 7) as f64
        );
        let _ = writeln!(text, "{}", edit(n, line));
    }
    text
}

#[test]
fn the_phase_comes_from_the_time_column() {
    let record = read(&rows(|_, line| line)).unwrap();
    assert!((record.phase - 0.5).abs() < 1e-9);
    assert_eq!((record.rows(), record.segments.len()), (30, 1));
    assert!((record.load[3].conductance - 0.05).abs() < 1e-15);
    assert!(record.measured[1].iter().all(|i| i.is_nan()), "no current was recorded");
    assert_eq!(record.repairs, [""; 0]);
}

#[test]
fn a_gap_makes_a_new_segment() {
    let text = rows(|n, line| {
        if (10..14).contains(&n) {
            "# lost".to_owned()
        } else {
            line
        }
    });
    let record = read(&text).unwrap();
    assert_eq!(record.segments, [0..10, 14..30]);
}

/// Rows two periods apart, of which a controller gives each a duty of its own; the load steps behind the twentieth.
#[test]
fn a_load_step_between_rows_begins_a_new_stretch_beside_a_controller_too() {
    let mut text = String::from("t,d,v_o,r_load\n");
    for n in 0..40 {
        let (duty, load) = (0.5 + 1e-3 * (n % 9) as f64, if n < 20 { 20 } else { 15 });
        let _ = writeln!(text, "{:.6},{duty},{:.3},{load}", (2 * n) as f64 * 1e-4, 200.0 * duty);
    }
    let record = read(&text).unwrap();
    // rows between hold what was not recorded
    assert_eq!(record.segments, [0..39, 40..79]);
    // and without a step there is nothing to cut
    let record = read(&text.replace(",15\n", ",20\n")).unwrap();
    assert_eq!(record.segments.len(), 1);
}

#[test]
fn backward_time_a_percent_duty_and_another_rate_are_faults_with_a_place() {
    let swapped = rows(|n, line| if n == 8 { "0.0001,0.5,100,20".to_owned() } else { line });
    let fault = &read(&swapped).unwrap_err().list[0];
    assert_eq!(
        (fault.line_column().unwrap().0, fault.problem.as_str()),
        (10, "time goes backward")
    );
    let fault = &read(&rows(|_, line| line.replace(",0.5,", ",50,"))).unwrap_err().list[0];
    assert!(fault.hint.as_ref().unwrap().starts_with("percent?"));
    let slow = rows(|_, line| line).replace("t,", "t_ms,");
    assert!(read(&slow).unwrap_err().list[0].problem.contains("sample rate"));
}

#[test]
fn repairs_are_reported() {
    let repeated = rows(|n, line| if n == 5 { format!("{line}\n{line}") } else { line });
    let record = read(&repeated).unwrap();
    assert!(
        record.repairs[0].contains("1 rows repeat the time"),
        "{:?}",
        record.repairs
    );
    let stuck = rows(|_, line| {
        line.split(',')
            .take(2)
            .chain(["7.0", "20"])
            .collect::<Vec<_>>()
            .join(",")
    });
    assert!(
        read(&stuck).unwrap_err().list[0]
            .problem
            .contains("nothing is measured")
    );
}

#[test]
fn ten_times_faster_records_are_thinned_to_the_period() {
    let mut text = String::from("t,d,v_o,r_load\n");
    for n in 0..400 {
        let _ = writeln!(text, "{:.7},0.5,{}.25,20", n as f64 * 1e-5, n);
    }
    let record = read(&text).unwrap();
    assert_eq!((record.rows(), record.phase), (40, 0.0));
    assert_eq!(record.measured[0][3], 30.25);
    assert_eq!(record.repairs.len(), 1);
}

#[test]
fn a_table_without_time_holds_settled_points() {
    let record = read("d,v_o,r_load\n0.3,60.1,10\n0.5,99.2,10\n0.6,119.5,10\n").unwrap();
    assert!(record.settled);
    assert_eq!(record.segments.len(), 3);
}

#[test]
fn a_converter_step_is_found_and_plain_digits_are_not() {
    let on: Vec<f64> = (0..200)
        .map(|n| ((n * 37 % 101) as f64 * 0.0488).mul_add(1000.0, 0.0).round() / 1000.0)
        .collect();
    assert!((lattice(&on, 3) - 0.0488).abs() < 1e-4);
    let off: Vec<f64> = (0..200)
        .map(|n| ((n * n * 37 % 7919) as f64 * 0.001_3).mul_add(1000.0, 0.0).round() / 1000.0)
        .collect();
    assert_eq!(lattice(&off, 3), 0.0);
}

/// Few values far apart, of which the nearest two are a step that the digits show to a hundredth only.
#[test]
fn a_converter_step_is_found_in_values_far_apart() {
    let step = 0.212_829_17;
    let counts = [
        600, 599, 597, 704, 707, 680, 641, 607, 584, 570, 569, 579, 595, 612, 624, 630, 629, 621, 611, 605,
    ];
    let written = |counts: &[i32]| -> Vec<f64> {
        let of = |count: &i32| (f64::from(*count) * step * 1000.0).round() / 1000.0;
        counts.iter().map(of).collect()
    };
    let found = lattice(&written(&counts), 3);
    assert!((found - step).abs() < 1e-5, "{found}");
    // none of which are one step apart
    let coarse = [
        600, 602, 605, 707, 710, 680, 641, 607, 584, 570, 567, 579, 595, 612, 624, 632, 629, 621, 615, 635,
    ];
    let found = lattice(&written(&coarse), 3);
    assert!((found - step).abs() < 1e-5, "{found}");
    // one value between the steps
    let mut broken = written(&counts);
    broken[7] += 0.1;
    assert_eq!(lattice(&broken, 3), 0.0);
}

/// Rows at 0.5 of periods of 300 kHz, as a logger writes them with `digits` behind the point.
fn at_300_khz(write: impl Fn(f64) -> String, edit: impl Fn(usize, String) -> String) -> Record {
    let mut parameters = Parameters::paper_table();
    parameters.converter.f_sw = 3e5;
    parameters.pwm.sampling_phase = 0.5;
    let mut text = String::from("t,d,v_o,r_load,seq\n");
    for n in 0..60 {
        let line = format!(
            "{},0.5,{:.3},20,{n}",
            write((n as f64 + 0.5) / 3e5),
            100.0 + 0.137 * (n % 7) as f64
        );
        let _ = writeln!(text, "{}", edit(n, line));
    }
    let sheet = Sheet::parse(Path::new("run.csv"), text.into(), &Record::file_options()).unwrap();
    Record::read(&sheet, &ColumnMap::default(), &parameters).unwrap()
}

#[test]
fn rounded_and_cut_times_leave_the_model_s_sampling_phase() {
    for digits in [6, 7, 8] {
        let record = at_300_khz(|t| format!("{t:.digits$}"), |_, line| line);
        assert_eq!(
            (record.phase, record.rows()),
            (0.5, 60),
            "{digits}: {:?}",
            record.repairs
        );
        let cut = |t: f64| {
            let scale = 10f64.powi(digits as i32);
            format!("{:.digits$}", (t * scale + 1e-6).floor() / scale)
        };
        let record = at_300_khz(cut, |_, line| line);
        assert_eq!(
            (record.phase, record.rows()),
            (0.5, 60),
            "{digits}: {:?}",
            record.repairs
        );
    }
    // whole microseconds: the first row alone says 0.6
    let record = at_300_khz(|t| format!("{t:.6}"), |_, line| line);
    assert!(
        record
            .repairs
            .iter()
            .any(|note| note.contains("steps of 1.00 µs") && note.contains("0.600")),
        "{:?}",
        record.repairs
    );
}

#[test]
fn another_sampling_phase_is_seen_through_the_rounding() {
    let record = at_300_khz(|t| format!("{:.7}", t + 0.2 / 3e5), |_, line| line);
    assert!((record.phase - 0.7).abs() < 0.01, "{}", record.phase);
    assert!(
        record.repairs.iter().any(|note| note.contains("the model has 0.5")),
        "{:?}",
        record.repairs
    );
    // written exactly it is read exactly, without a word
    let record = at_300_khz(|t| format!("{:.12}", t + 0.2 / 3e5), |_, line| line);
    assert!((record.phase - 0.7).abs() < 1e-4);
    let about_time = |note: &String| note.contains("times");
    assert!(!record.repairs.iter().any(about_time), "{:?}", record.repairs);
}

#[test]
fn lost_rows_are_counted_by_time_and_by_their_numbers() {
    let lost = |n: usize, line: String| {
        if (20..23).contains(&n) || n == 40 {
            "# lost".to_owned()
        } else {
            line
        }
    };
    let record = at_300_khz(|t| format!("{t:.9}"), lost);
    let said = record.repairs.join("\n");
    assert!(said.contains("2 gaps, in which 4 rows are missing"), "{said}");
    assert!(
        said.contains("`seq` counts rows and leaps in 2 places, first in line 25: 4 rows were lost"),
        "{said}"
    );
    let whole = at_300_khz(|t| format!("{t:.9}"), |_, line| line);
    assert!(
        !whole
            .repairs
            .iter()
            .any(|note| note.contains("lost") || note.contains("missing")),
        "{:?}",
        whole.repairs
    );
}
