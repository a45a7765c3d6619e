//! Tables: records for a diagnosis, settled points for a mapping, logs of a trainer, recorded measurements, and what maps columns.

use std::path::Path;

use diagnose::record::Record;
use drm::acquire::{LoadSetting, Plan};
use drm::{FitOptions, Table, TableOptions};
use measured::{ColumnMap, Options, Sheet};
use plant::Parameters;
use verify::replay::{Log, Wanted, replay};
use verify::traces::Recorded;

use super::Target;
use super::seeds::{answer, at, files, folder, head, read};
use crate::forms::Form;
use crate::guard::{Answer, Limits, Reader};

/// Rows of a seed: enough for every check of a record, and few enough that a changed cell matters.
const ROWS: usize = 40;

pub(super) static TARGETS: &[Target] = &[
    Target {
        name: "record",
        about: "a table of measurements for the diagnosis",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: record_seeds,
        reader: record,
    },
    Target {
        name: "mdf",
        about: "an MDF 4 file as a record",
        // its blocks are found by their places, so a part that grows takes the rest apart
        form: Form::Bytes,
        words: &[
            "MDF     4.10",
            "##DG",
            "##CG",
            "##CN",
            "##CC",
            "##DT",
            "##DZ",
            "##DL",
            "##HL",
            "##TX",
            "<TX>",
        ],
        limits: Limits::READER,
        seeds: || folder("tests/fixtures/records", &[".mf4", ".mdf"]),
        reader: record,
    },
    Target {
        name: "mat-7.3",
        about: "a MAT file of version 7.3, which is HDF5, as a record",
        // its headers are found by their places, as in an MDF file
        form: Form::Bytes,
        words: &[
            "MATLAB 7.3 MAT-file",
            "HDF\r\n",
            "OHDR",
            "SNOD",
            "TREE",
            "HEAP",
            "GCOL",
            "MATLAB_class",
            "MATLAB_empty",
            "double",
            "struct",
            "cell",
            "#refs#",
        ],
        limits: Limits::READER,
        seeds: || folder("tests/fixtures/records", &["_73.mat"]),
        reader: record,
    },
    Target {
        name: "column-map",
        about: "the file and the line that map columns to quantities",
        form: Form::Bytes,
        words: MAP_WORDS,
        limits: Limits::READER,
        seeds: map_seeds,
        reader: || Ok(Box::new(column_map)),
    },
    Target {
        name: "settled-points",
        about: "a table of settled points, read and fitted",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: points_seeds,
        reader: || Ok(Box::new(settled_points)),
    },
    Target {
        name: "plan",
        about: "a half-measured plan of an acquisition, taken up again",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: || Ok(vec![plan_text()?, half_measured()?]),
        reader: || Ok(Box::new(resumed)),
    },
    Target {
        name: "trainer-log",
        about: "a log of the trainer, replayed against the contract",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: log_seeds,
        reader: trainer_log,
    },
    Target {
        name: "recorded-trace",
        about: "recorded measurements as part of a verification",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: log_seeds,
        reader: recorded_trace,
    },
];

const WORDS: &[&str] = &[
    "t",
    "time",
    "v_out",
    "v_o",
    "i_l",
    "i_out",
    "v_in",
    "duty",
    "d_real",
    "r_load",
    "p_load",
    "i_load",
    "v_ref",
    "v_std",
    "point",
    "load",
    "hold",
    "settled",
    "action",
    "episode",
    "obs_0",
    "obs_1",
    "previous_duty",
    "[V]",
    "[mA]",
    "(us)",
    "ms",
    "%",
    "kV",
    ";",
    "\t",
    "\"a,b\"",
    "\"",
    "\r\n",
    "\r",
    "\u{feff}",
    "#",
    "1,5",
    "1.234,5",
    "1e400",
    "nan",
    "inf",
    "-",
    "",
    "n/a",
    "NaN",
    "--",
    "yes",
    "no",
    "open loop",
    "0.5 A",
    "200 W",
    "10 ohm",
    "2026-11-23 12:00:00",
    "12:00:00.5",
    "\u{b5}s",
    "\u{3a9}",
];
const MAP_WORDS: &[&str] = &[
    "phase",
    "duty",
    "\"commanded\"",
    "\"applied\"",
    "\"direct\"",
    "settled",
    "sampled",
    "\"mean\"",
    "\"instant\"",
    "[columns]",
    "[constants]",
    "[records.run2]",
    "columns",
    "name",
    "scale",
    "offset",
    "v_out",
    "i_l",
    "v_in",
    "r_load",
    "i_out",
    "t",
    "=",
    "*",
    "duty=duty_percent*0.01",
    "v_in=24",
    ",",
    "CH1 [V]",
];

fn text_of(lines: impl IntoIterator<Item = String>) -> Vec<u8> {
    lines.into_iter().collect::<Vec<_>>().join("\n").into_bytes()
}

fn record_seeds() -> Result<Vec<Vec<u8>>, String> {
    let mut seeds = Vec::new();
    for name in ["duty-steps", "load-steps", "nothing-wrong", "power-steps"] {
        seeds.push(head(&read(&format!("examples/diagnose/records/{name}.csv"))?, ROWS));
    }
    let layouts = ["vectors", "struct", "controldesk", "structure_with_time"];
    let mat = layouts.map(|name| format!("tests/fixtures/records/{name}.mat"));
    seeds.extend(files(&mat.each_ref().map(String::as_str))?);
    // settled points without time, and decimal commas
    seeds.push(text_of((0..12).map(|row| match row {
        0 => "duty;v_out;i_out;v_in".to_owned(),
        _ => format!("0,{};{},5;{};24,0", 30 + row, 7 + row / 3, row % 4),
    })));
    Ok(seeds)
}

fn record() -> Result<Box<Reader>, String> {
    let plant = at("examples/diagnose/buck24.toml");
    let parameters = Parameters::from_file(&plant).map_err(|faults| faults.to_string())?;
    let map = ColumnMap::default();
    Ok(Box::new(move |bytes| {
        let record = Sheet::parse(Path::new("run.csv"), bytes.to_vec(), &Record::file_options())
            .and_then(|sheet| Record::read(&sheet, &map, &parameters));
        answer(record, |record| {
            format!("record, settled {:?}, dense {}", record.settled, record.dense)
        })
    }))
}

fn map_seeds() -> Result<Vec<Vec<u8>>, String> {
    let mut seeds = files(&[
        "examples/diagnose/buck24-sweep-columns.toml",
        "examples/diagnose/buck24-u-columns.toml",
    ])?;
    seeds.push(b"duty=duty_percent*0.01,v_in=24,v_out=CH1 [V],i_l=CH2*0.001".to_vec());
    seeds.push(
        b"phase = 0.5\nduty = \"commanded\"\nsettled = true\nsampled = \"mean\"\n[columns]\nv_out = \"CH1 [V]\"\nduty = { name = \"D\", scale = 0.01, offset = 0.0 }\n[constants]\nr_load = 10.0\n[records.run2]\ncolumns = { v_out = \"CH3 [V]\" }\n"
            .to_vec(),
    );
    Ok(seeds)
}

fn column_map(bytes: &[u8]) -> Answer {
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Answer::refused("no text");
    };
    // one text for both readers: what one takes the other refuses
    let line = ColumnMap::parse(text);
    let file = ColumnMap::from_text(Path::new("columns.toml"), text);
    if let (Ok(line), Ok(file)) = (line.clone(), file.clone()) {
        let _ = line.and(file);
    }
    let map = if text.contains('\n') { file } else { line };
    answer(map, |map| {
        let _ = map.of(Path::new("run2.csv"));
        "map".to_owned()
    })
}

fn points_seeds() -> Result<Vec<Vec<u8>>, String> {
    // points of a buck with drops, so that a mapping can be fitted
    let rows = |mark: char, comma: bool| {
        let header = ["duty", "v_out", "i_out", "v_in"].join(&mark.to_string());
        let row = move |index: usize| {
            let (d, i) = (0.3 + 0.05 * (index % 6) as f64, 1.0 + (index / 6) as f64);
            let cells = [d, 24.0 * (0.97 * d - 0.004 * i + 0.01), i, 24.0].map(|x| format!("{x:.4}"));
            let text = cells.join(&mark.to_string());
            if comma { text.replace('.', ",") } else { text }
        };
        text_of(std::iter::once(header).chain((0..24).map(row)))
    };
    Ok(vec![rows(',', false), rows(';', true), half_measured()?])
}

fn settled_points(bytes: &[u8]) -> Answer {
    let table = Table::parse(Path::new("points.csv"), bytes, &TableOptions::default());
    answer(table, |table| match drm::fit(&table, &FitOptions::default()) {
        Ok(report) => {
            let text = report.fit.map.to_toml("");
            let again = policy::read_mapping(Path::new("drm.toml"), &text);
            assert!(again.is_ok(), "the fitted mapping is not read again: {text}");
            "fitted".to_owned()
        }
        Err(faults) => faults
            .list
            .first()
            .map(|fault| fault.problem.clone())
            .unwrap_or_default(),
    })
}

fn plan() -> Result<Plan, String> {
    let loads = [
        LoadSetting::Resistor(10.0),
        LoadSetting::Current(2.0),
        LoadSetting::Power(20.0),
    ];
    Plan::new(24.0, &[0.3, 0.4, 0.5], &loads, 1.0).map_err(|faults| faults.to_string())
}

fn plan_text() -> Result<Vec<u8>, String> {
    Ok(plan()?.to_csv().map_err(|error| error.to_string())?.into_bytes())
}

/// The plan with its first rows measured: the empty cells of a row filled in.
fn half_measured() -> Result<Vec<u8>, String> {
    let text = String::from_utf8(plan_text()?).map_err(|error| error.to_string())?;
    let mut open = 4;
    let fill = |line: &str| {
        let is_open = open > 0 && line.contains(",,") && !line.starts_with('#');
        if !is_open {
            return line.to_owned();
        }
        open -= 1;
        let mut numbers = ["0.31", "7.1", "0.7", "24", "0.01", "yes"].into_iter();
        let cells = line.split(',').map(|cell| match cell {
            "" => numbers.next().unwrap_or(""),
            other => other,
        });
        cells.collect::<Vec<_>>().join(",")
    };
    Ok(text_of(text.lines().map(fill)))
}

fn resumed(bytes: &[u8]) -> Answer {
    let Ok(mut plan) = plan() else {
        return Answer::refused("no plan");
    };
    let sheet = Sheet::parse(Path::new("plan.csv"), bytes.to_vec(), &Table::file_options());
    answer(sheet.and_then(|sheet| plan.resume(&sheet)), |taken| {
        let text = plan.to_csv();
        assert!(text.is_ok(), "a plan that was taken up is not written");
        format!("taken up {}", if taken > 0 { "some" } else { "none" })
    })
}

fn log_seeds() -> Result<Vec<Vec<u8>>, String> {
    let trace = head(&read("tests/fixtures/buck12_200_1000.csv")?, ROWS);
    let text = String::from_utf8_lossy(&trace).into_owned();
    let more = |(index, line): (usize, &str)| match index {
        0 => line.to_owned(),
        1 => format!("t,{line},action,episode,previous_duty"),
        _ => format!("{}e-4,{line},{},{},0.5", index - 2, index % 12, index / 20),
    };
    let log = text_of(text.lines().enumerate().map(more));
    Ok(vec![trace, log])
}

fn example() -> Result<policy::Policy, String> {
    policy::load(&at("examples/buck12/policy.toml")).map_err(|faults| faults.faults.to_string())
}

fn trainer_log() -> Result<Box<Reader>, String> {
    let policy = example()?;
    Ok(Box::new(move |bytes| {
        let log = Sheet::parse(Path::new("log.csv"), bytes.to_vec(), &Options::default())
            .and_then(|sheet| Log::read(&policy, sheet, ""))
            .and_then(|log| {
                let wanted = Wanted {
                    tolerance: 1e-4,
                    exploring: bytes.len() % 2 == 0,
                    skip: bytes.len() % 3,
                };
                replay(&policy, &log, wanted)
            });
        answer(log, |replay| format!("replayed, equal {}", replay.equal()))
    }))
}

fn recorded_trace() -> Result<Box<Reader>, String> {
    let policy = example()?;
    Ok(Box::new(move |bytes| {
        let trace = Sheet::parse(Path::new("trace.csv"), bytes.to_vec(), &Options::default())
            .and_then(|sheet| Recorded::read(&policy, &sheet, ""));
        answer(trace, |trace| {
            format!("{} steps", if trace.steps().is_empty() { "no" } else { "some" })
        })
    }))
}
