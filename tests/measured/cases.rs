//! The files, and what each reader makes of them.

/// What a reader makes of a file.
pub enum Outcome {
    /// The numbers of the good table.
    Same,
    /// Other numbers, without a fault: what looks wrong is no business of this reader, or is a gap to it.
    Read,
    /// A fault with these words, first in this line.
    Refused(&'static [&'static str], Option<usize>),
}

use Outcome::*;

pub struct Case {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Of `drm`, `diagnose`, `verify`.
    pub outcomes: [Outcome; 3],
}

const HEADER: &str = "t,duty,v_out,i_l,i_out,v_in,r_load";

/// Forty rows that are a record, settled points and a trace alike.
pub fn good() -> String {
    let row = |n: usize| {
        let duty = 0.4 + 0.05 * (n % 5) as f64;
        let v_out = 199.0 * duty - 0.137 * (n % 7) as f64;
        let i_out = v_out / 20.0;
        let (i_l, v_in) = (i_out + 0.061 * (n % 4) as f64, 200.0 + 0.11 * (n % 3) as f64);
        let t = (n as f64 + 0.5) * 1e-4;
        format!("{t:.6},{duty:.2},{v_out:.3},{i_l:.3},{i_out:.3},{v_in:.2},20\n")
    };
    (0..40).fold(format!("{HEADER}\n"), |text, n| text + &row(n))
}

fn header(from: &str, to: &str) -> String {
    good().replacen(from, to, 1)
}

/// The good table with one line changed, from 1.
fn line(number: usize, change: impl Fn(&str) -> String) -> String {
    let change = |(n, text): (usize, &str)| if n + 1 == number { change(text) } else { text.to_owned() };
    good().lines().enumerate().map(change).map(|line| line + "\n").collect()
}

/// The good table with a cell of a line changed.
fn cell(number: usize, column: usize, to: &str) -> String {
    line(number, |line| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells[column] = to;
        cells.join(",")
    })
}

/// The good table with columns multiplied, under another header.
fn times(header: &str, columns: &[usize], factor: f64) -> String {
    let row = |line: &str| {
        let cell = |(n, cell): (usize, &str)| match columns.contains(&n) {
            true => (factor * cell.parse::<f64>().unwrap()).to_string(),
            false => cell.to_owned(),
        };
        let cells: Vec<String> = line.split(',').enumerate().map(cell).collect();
        cells.join(",") + "\n"
    };
    format!("{header}\n") + &good().lines().skip(1).map(row).collect::<String>()
}

fn german() -> String {
    good().replace(',', ";").replace('.', ",")
}

fn wide(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
    text.encode_utf16().flat_map(bytes).collect()
}

fn all(name: &'static str, bytes: impl Into<Vec<u8>>, outcome: fn() -> Outcome) -> Case {
    each(name, bytes, [outcome(), outcome(), outcome()])
}

fn each(name: &'static str, bytes: impl Into<Vec<u8>>, outcomes: [Outcome; 3]) -> Case {
    let bytes = bytes.into();
    Case { name, bytes, outcomes }
}

pub fn cases() -> Vec<Case> {
    [
        written_otherwise(),
        named_otherwise(),
        broken(),
        broken_lines(),
        other_files(),
        odd_cells(),
        in_other_units(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// The same table as other programs write it.
fn written_otherwise() -> Vec<Case> {
    let same = |name, bytes: Vec<u8>| all(name, bytes, || Same);
    let quoted = good()
        .lines()
        .map(|line| format!("\"{}\"\n", line.replace(',', "\", \"")))
        .collect::<String>();
    let marked = format!("\u{feff}{}", good());
    vec![
        same("byte order mark", marked.clone().into()),
        same("UTF-16, low byte first", wide(&marked, u16::to_le_bytes)),
        same("UTF-16, high byte first", wide(&marked, u16::to_be_bytes)),
        same("CRLF", good().replace('\n', "\r\n").into()),
        same("CR", good().replace('\n', "\r").into()),
        same("tabs", good().replace(',', "\t").into()),
        same("blanks", good().replace(',', "  ").into()),
        same("semicolons", good().replace(',', ";").into()),
        same("decimal commas", german().into()),
        same("decimal commas and tabs", german().replace(';', "\t").into()),
        same("decimal commas in quotes", quoted.replace('.', ",").into()),
        same("quotes", quoted.into()),
        same("sep=", format!("sep=;\r\n{}", german()).into()),
        same("trailing separators", good().replace('\n', ",\n").into()),
        same(
            "comments and empty lines",
            format!("# bench 3\n\n{}\n", good().replace("\n0.0006", "\n # pause\n0.0006")).into(),
        ),
        same(
            "SI units below the names",
            line(1, |l| format!("{l}\ns,-,V,A,A,V,ohm")).into(),
        ),
        same("no end of the last line", good().trim_end().into()),
    ]
}

/// The same table with other names, units in them, and columns that nobody asked for.
fn named_otherwise() -> Vec<Case> {
    let same = |name, text: String| all(name, text, || Same);
    let only_diagnose = |words: &'static [&'static str], line| [Same, Refused(words, line), Same];
    vec![
        same("timestamps", header("t,", "timestamps,")),
        same("time in s", header("t,", "Time [s],")),
        same("short forms", header("duty,v_out,i_l,i_out", "d,v_o,i_l,i_o")),
        same("percent", times(&HEADER.replace("duty", "duty (%)"), &[1], 100.0)),
        same(
            "percent, short",
            times(&HEADER.replace("duty", "d_percent"), &[1], 100.0),
        ),
        same(
            "milliamperes",
            times(&HEADER.replace("i_l,i_out", "i_l [mA],i_out_mA"), &[3, 4], 1e3),
        ),
        same("millivolts", times(&HEADER.replace("v_out", "v_out/mV"), &[2], 1e3)),
        same(
            "milliseconds, millivolts and milliamperes below the names",
            times(&format!("{HEADER}\nms,-,mV,mA,[mA],V,ohm"), &[0, 2, 3, 4], 1e3),
        ),
        same(
            "percent below the name",
            times(&format!("{HEADER}\n,%,,,,,"), &[1], 100.0),
        ),
        same("microseconds", times(&HEADER.replacen("t,", "t_us,", 1), &[0], 1e6)),
        same(
            "a column of words",
            good().replace("r_load\n", "r_load,lamp\n").replace(",20\n", ",20,on\n"),
        ),
        each(
            "an unknown time",
            header("t,", "sampling_time,"),
            only_diagnose(&["`sampling_time` looks like time", "--map t=sampling_time"], Some(1)),
        ),
        each(
            "a clock without a name",
            header("t,", "x,"),
            only_diagnose(&["`x` looks like time"], Some(1)),
        ),
        each(
            "dates",
            times(HEADER, &[], 1.0)
                .replace("\n0.000", "\n2024-05-01 12:30:0.")
                .replace("\n0.00", "\n2024-05-01 12:30:1."),
            only_diagnose(&["`t` is not a number", "seconds from the first row on"], Some(2)),
        ),
        all("a name twice", header("i_l,i_out", "i_l,i_l"), || {
            Refused(&["two columns are called `i_l`"], Some(1))
        }),
        all("a quantity twice", header("r_load", "v_o"), || {
            Refused(&["two columns are `v_out`"], Some(1))
        }),
        each(
            "an unknown voltage",
            header("v_out", "u_out"),
            [
                Refused(&["no column `v_out`", "--map v_out="], Some(1)),
                Read,
                Refused(&["no column for the signal `v_out`"], Some(1)),
            ],
        ),
    ]
}

/// Tables that are none.
fn broken() -> Vec<Case> {
    let twice = good() + &good();
    let refused = |name, text: String, words: &'static [&'static str], line| {
        each(name, text, [(); 3].map(|()| Refused(words, line)))
    };
    vec![
        refused("empty", String::new(), &["the table is empty", "a header"], None),
        refused(
            "comments only",
            "# bench 3\n\n".to_owned(),
            &["the table is empty"],
            None,
        ),
        refused(
            "header only",
            format!("{HEADER}\n"),
            &["the table has no rows"],
            Some(1),
        ),
        refused(
            "no header",
            good().lines().skip(1).map(|l| format!("{l}\n")).collect(),
            &["the first line holds numbers"],
            Some(1),
        ),
        refused(
            "a header in a comment",
            format!("# {}", good()),
            &["the first line holds numbers", "take away its `#`"],
            Some(2),
        ),
        refused(
            "joined files",
            twice,
            &["the header stands a second time", "cut the file"],
            Some(42),
        ),
    ]
}

/// Tables with a line that is none.
fn broken_lines() -> Vec<Case> {
    let refused = |name, text: String, words: &'static [&'static str], line| {
        each(name, text, [(); 3].map(|()| Refused(words, line)))
    };
    vec![
        refused(
            "a short line",
            line(9, |l| l[..20].to_owned()),
            &["cells are missing", "7 cells"],
            Some(9),
        ),
        refused(
            "a long line",
            line(9, |l| format!("{l},1")),
            &["more cells than the header", "8 cells"],
            Some(9),
        ),
        refused(
            "a decimal comma between commas",
            line(9, |l| l.replacen('.', ",", 1)),
            &["write 0.5 instead of 0,5"],
            Some(9),
        ),
        refused(
            "points and commas",
            german().replacen("0,45;", "0.45;", 1),
            &["decimal points and decimal commas"],
            Some(3),
        ),
        refused(
            "an open quote",
            line(9, |l| format!("\"{l}")),
            &["a quotation mark is not closed"],
            Some(9),
        ),
        refused(
            "a unit of another kind below a name",
            line(1, |l| format!("{l}\nms,-,mA,A,A,V,ohm")),
            &["no unit of `v_out`", "V, with a prefix"],
            Some(2),
        ),
        each(
            "a cut last line",
            good().trim_end().rsplit_once(',').unwrap().0,
            [
                Refused(&["cells are missing"], Some(41)),
                Read,
                Refused(&["cells are missing"], Some(41)),
            ],
        ),
    ]
}

/// Files of other kinds.
fn other_files() -> Vec<Case> {
    let refused =
        |name, bytes: &[u8], words: &'static [&'static str]| each(name, bytes, [(); 3].map(|()| Refused(words, None)));
    let unmarked = wide(&good(), u16::to_le_bytes);
    vec![
        refused(
            "MAT",
            b"MATLAB 5.0 MAT-file, Platform: PCWIN64",
            &["not a sound MAT file", "save the file again"],
        ),
        refused("MAT 7.3", b"\x89HDF\r\n\x1a\n\0", &["HDF5", "as CSV"]),
        refused(
            "MDF4",
            b"MDF     4.10    asammdf",
            &["not a sound MDF file", "save the file again"],
        ),
        refused("workbook", b"PK\x03\x04\x14\0", &["Excel", "CSV"]),
        refused("gzip", b"\x1f\x8b\x08\0", &["gzip"]),
        refused("UTF-16 without mark", &unmarked, &["UTF-16 without a byte order mark"]),
        all("Latin-1", [HEADER.as_bytes(), b"\n0,\xb5\n"].concat(), || {
            Refused(&["not UTF-8", "0xb5"], Some(2))
        }),
    ]
}

/// Cells that hold no number: a fault to some, a gap or a value to others.
fn odd_cells() -> Vec<Case> {
    let not_a_number = || Refused(&["is not a number", "run.csv:7:"], Some(7));
    vec![
        all("a word", cell(7, 3, "overflow"), || {
            Refused(&["`i_l` is not a number", "overflow"], Some(7))
        })
        .but(0, Same),
        all("a unit in a cell", cell(7, 2, "98 V"), || {
            Refused(&["`v_out` is not a number", "`v_out [mV]`"], Some(7))
        }),
        all("thousands", german().replacen("79,6", "1.079,6", 1), || {
            Refused(&["write 1000.5 instead of 1,000.5"], Some(2))
        }),
        each(
            "an empty cell",
            cell(7, 2, ""),
            [
                Refused(&["a cell of `v_out` is empty"], Some(7)),
                Read,
                Refused(&["a cell of `v_out` is empty"], Some(7)),
            ],
        ),
        each("NaN", cell(7, 2, "NaN"), [not_a_number(), Read, Read]),
        each("infinity", cell(7, 2, "inf"), [not_a_number(), not_a_number(), Read]),
        each("too large", cell(7, 2, "1e999"), [not_a_number(), not_a_number(), Read]),
    ]
}

/// Values in another unit than the name says: each reader suspects what it can know.
fn in_other_units() -> Vec<Case> {
    vec![
        each(
            "percent without a word",
            times(HEADER, &[1], 100.0),
            [
                Refused(
                    &["`duty` looks like percent", "--map duty=duty*0.01", "`duty (%)`"],
                    Some(2),
                ),
                Refused(&["a duty outside 0 to 1", "`duty (%)`"], Some(2)),
                Same,
            ],
        ),
        each(
            "milliamperes without a word",
            times(HEADER, &[3, 4], 1e3),
            [
                Refused(&["`i_out` looks like milliamperes", "--map i_out=i_out*0.001"], None),
                Refused(&["i_l is not in A", "`i_l [mA]`"], None),
                Read,
            ],
        ),
        each(
            "millivolts without a word",
            times(HEADER, &[2], 1e3),
            [
                Refused(&["`v_out` looks like millivolts", "--map v_out=v_out*0.001"], None),
                Refused(&["v_out is not in V", "`v_out [mV]`"], None),
                Read,
            ],
        ),
    ]
}

impl Case {
    /// The case with another outcome for one reader.
    fn but(mut self, reader: usize, outcome: Outcome) -> Self {
        self.outcomes[reader] = outcome;
        self
    }
}
