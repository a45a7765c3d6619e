//! Pages: one file, escaped, the same each time.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use quick_xml::Reader;
use quick_xml::events::Event;
use report::{Axis, Chart, Page, Panel, ReportError, Section, Series, Table, Verdict, quantity};

fn page(text: &str) -> Page {
    let chart = Chart::new(text, Axis::new("x")).panel(Panel::new(Axis::new("y")).series(Series::line(
        text,
        [0.0, 1.0],
        [0.0, 1.0],
    )));
    let table = Table::new(text)
        .text(text)
        .number("n", 2)
        .row([text.into(), 1.0.into()]);
    let inner = Section::new(text).text(text).code(text).pairs([(text, text)]);
    Page::new(text).verdict(Verdict::Fail, text).section(
        Section::new(text)
            .chart(chart.svg().unwrap(), text)
            .table(table)
            .details(inner),
    )
}

#[test]
fn a_page_is_well_formed_and_hostile_text_stays_text() {
    let html = page("<script>alert('x')</script> & \"y\"").html().unwrap();
    // the data of its chart and the script of the charts, and what is text stays text in both
    assert_eq!(html.matches("<script").count(), 2, "{html}");
    assert!(!html.contains("<script>alert") && html.contains("\\u003cscript\\u003ealert"));
    // the syntax of void elements used here is also XML, so the strict parser reads the page
    let mut reader = Reader::from_str(&html);
    let mut depth = 0;
    loop {
        match reader.read_event().unwrap() {
            Event::Start(_) => depth += 1,
            Event::End(_) => depth -= 1,
            Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!(depth, 0);
}

#[test]
fn a_page_loads_nothing_and_is_the_same_each_time() {
    let html = page("a").html().unwrap();
    assert_eq!(html, page("a").html().unwrap());
    for word in [
        "<link",
        "@import",
        "url(",
        "src=",
        "href=",
        "eval(",
        "import(",
        "fetch(",
        "XMLHttpRequest",
        "WebSocket",
    ] {
        assert!(!html.contains(word), "{word}");
    }
    // the name of a library, and that of the language of the pictures
    let known = [
        "http://www.w3.org/2000/svg",
        "https://github.com/leeoniya/uPlot (v",
        "http-equiv",
    ];
    let outside: Vec<_> = html
        .match_indices("http")
        .filter(|(at, _)| !known.iter().any(|known| html[*at..].starts_with(known)))
        .collect();
    assert!(outside.is_empty(), "{outside:?}");
}

/// Base64 by its definition (RFC 4648, section 4), so that the digest is not told by what wrote it.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |three: &[u8]| -> String {
        let bits = (0..3).fold(0_u32, |bits, n| {
            bits << 8 | u32::from(three.get(n).copied().unwrap_or(0))
        });
        let letter = |n: usize| char::from(LETTERS[(bits >> (18 - 6 * n) & 63) as usize]);
        (0..4).map(|n| if n <= three.len() { letter(n) } else { '=' }).collect()
    };
    bytes.chunks(3).map(group).collect()
}

#[test]
fn a_page_runs_its_own_script_and_no_other() {
    use sha2::Digest;
    let html = page("a").html().unwrap();
    let (_, behind) = html.rsplit_once("<script>").unwrap();
    let (script, _) = behind.split_once("</script>").unwrap();
    let digest = base64(&sha2::Sha256::digest(script));
    let policy = format!("script-src &#39;sha256-{digest}&#39;; base-uri &#39;none&#39;");
    assert!(html.contains(&policy), "{policy}");
    assert!(html.contains("default-src &#39;none&#39;"));
    // one without a chart has none, and may run none
    let html = Page::new("p").section(Section::new("s").text("t")).html().unwrap();
    assert!(!html.contains("<script") && html.contains("script-src &#39;none&#39;"));
}

/// The numbers under the pointer are those of the series, in the unit of the axis, within a part in 65,534 of their range.
#[test]
fn the_data_of_a_chart_are_its_series_in_the_units_that_are_shown() {
    let t: Vec<f64> = (0..101).map(|n| f64::from(n) * 1e-5).collect();
    let v: Vec<f64> = t
        .iter()
        .map(|t| if *t == 5e-4 { f64::NAN } else { 5.0 + 1e3 * t })
        .collect();
    let panel = Panel::new(Axis::new("output voltage").unit("V")).series(Series::line("plant", t.clone(), v.clone()));
    let chart = Chart::new("c", Axis::new("time").unit("s")).panel(panel.y_line(5.5, "limit"));
    let html = |chart: &Chart| {
        let section = Section::new("s").chart(chart.svg().unwrap(), "");
        Page::new("p").section(section).html().unwrap()
    };
    let text = html(&chart);
    let (_, behind) = text.split_once("<script type=\"application/json\">").unwrap();
    let data: serde_json::Value = serde_json::from_str(behind.split_once("</script>").unwrap().0).unwrap();
    assert_eq!(
        (&data["x"]["label"], &data["panels"][0]["label"]),
        (&"time (ms)".into(), &"output voltage (V)".into())
    );
    let series = &data["panels"][0]["series"][0];
    let numbers = |codes: &serde_json::Value| -> Vec<f64> {
        let [from, to] = ["from", "to"].map(|end| codes[end].as_f64().unwrap());
        let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        let text = codes["codes"].as_str().unwrap().trim_end_matches('=').bytes();
        let bits: Vec<u8> = text
            .map(|byte| letters.iter().position(|letter| *letter == byte).unwrap() as u8)
            .collect();
        let mut bytes = Vec::new();
        let (mut held, mut count) = (0_u32, 0);
        for six in bits {
            (held, count) = (held << 6 | u32::from(six), count + 6);
            if count >= 8 {
                count -= 8;
                bytes.push((held >> count) as u8);
            }
        }
        let code = |two: &[u8]| u16::from_le_bytes([two[0], two[1]]);
        let value = |code: u16| {
            if code == u16::MAX {
                f64::NAN
            } else {
                from + f64::from(code) / 65534.0 * (to - from)
            }
        };
        bytes.chunks(2).map(code).map(value).collect()
    };
    let (x, y) = (
        numbers(&data["xs"][series["x"].as_u64().unwrap() as usize]),
        numbers(&series["y"]),
    );
    assert_eq!((x.len(), y.len()), (101, 101));
    for n in 0..101 {
        // milliseconds
        assert!((x[n] - 1e3 * t[n]).abs() < 1e-5, "{n}");
        assert!(y[n].is_nan() && v[n].is_nan() || (y[n] - v[n]).abs() < 1e-5, "{n}");
    }
    // decades, and a curve that goes back along x, stand as pictures
    let log = Chart::new("c", Axis::new("f").log()).panel(Panel::new(Axis::new("y")).series(Series::line(
        "a",
        [1.0, 10.0],
        [1.0, 2.0],
    )));
    let back = Chart::new("c", Axis::new("e")).panel(Panel::new(Axis::new("y")).series(Series::line(
        "a",
        [1.0, 0.0],
        [1.0, 2.0],
    )));
    assert!(
        [log, back]
            .iter()
            .all(|chart| !html(chart).contains("application/json"))
    );
}

#[test]
fn a_long_series_keeps_its_extremes_on_the_page() {
    let x: Vec<f64> = (0..100_000).map(f64::from).collect();
    let y: Vec<f64> = x.iter().map(|x| if *x == 54_321.0 { 9.0 } else { 0.0 }).collect();
    let chart = Chart::new("c", Axis::new("x")).panel(Panel::new(Axis::new("y")).series(Series::line("a", x, y)));
    let html = Page::new("p")
        .section(Section::new("s").chart(chart.svg().unwrap(), ""))
        .html()
        .unwrap();
    let (_, behind) = html.split_once("<script type=\"application/json\">").unwrap();
    let data = behind.split_once("</script>").unwrap().0;
    assert!(data.len() < 20_000 && data.contains("\"to\":9.0"), "{}", data.len());
}

#[test]
fn a_picture_that_cannot_be_drawn_leaves_its_reason_and_the_rest_of_the_page() {
    let empty = Chart::new("t", Axis::new("x")).panel(Panel::new(Axis::new("y")).series(Series::line(
        "plant",
        [0.0],
        [f64::NAN],
    )));
    let section = Section::new("s")
        .chart_or_reason(empty.svg(), "caption")
        .text("behind it");
    let html = Page::new("p").section(section).html().unwrap();
    assert!(html.contains("A picture is missing here: `plant` has no value that can be drawn."));
    assert!(html.contains("behind it") && !html.contains("<figure") && !html.contains(">caption<"));
}

#[test]
fn a_page_says_its_command_and_every_picture_leads_there() {
    let command = report::CommandLine::new("policyc simulate")
        .argument("a <b>.toml")
        .options("--with", ["it's"]);
    let html = report::made(&page("a").html().unwrap(), &command, [("plant", "p.toml")]).unwrap();
    let typed = "policyc simulate &#39;a &lt;b&gt;.toml&#39; --with &#39;it&#39;\\&#39;&#39;s&#39;</pre>";
    assert!(html.contains(typed), "{html}");
    assert_eq!(html.matches("<section id=\"made\">").count(), 1);
    assert_eq!(
        html.matches("<a href=\"#made\">").count(),
        html.matches("<figure").count()
    );
    // and only what was told
    assert!(!page("a").html().unwrap().contains("#made"));
}

#[test]
fn one_of_several_sections_is_picked_without_a_script() {
    let sections = |count: usize| {
        (0..count)
            .map(|n| Section::new(format!("step {n}")).text("t"))
            .collect()
    };
    let html = |count| {
        let section = Section::new("Load steps").pick("load step", sections(count));
        Page::new("p").section(section).html().unwrap()
    };
    let three = html(3);
    assert_eq!(three.matches("type=\"radio\"").count(), 3);
    assert_eq!(three.matches("checked=").count(), 1);
    assert!(three.contains("<label for=\"pick-0-2\">step 2</label>") && !three.contains("<script"));
    assert!(!html(1).contains("radio"));
}

#[test]
fn a_picture_says_its_numbers_in_words_and_stands_in_two_widths() {
    let series = Series::line("plant", [0.0, 1e-3, 2e-3], [5.0, 4.75, 5.25]);
    let chart = Chart::new("Load step", Axis::new("time").unit("s"))
        .panel(Panel::new(Axis::new("output voltage").unit("V")).series(series));
    let section = Section::new("s").chart(chart.svg().unwrap(), "");
    let html = Page::new("p").section(section).html().unwrap();
    let words = "Load step. time (ms) from 0.000 to 2.000. output voltage (V): plant from 4.750 to 5.250.";
    assert!(html.contains(words), "{html}");
    // of a chart that answers the wide one is drawn by the script
    assert!(!html.contains("viewBox=\"0 0 900 ") && html.contains("viewBox=\"0 0 356 "));
    let bars = report::BarChart::new("Losses", ["light"])
        .panel(report::BarPanel::new(Axis::new("power").unit("W")).bars("switching", [0.1]));
    let section = Section::new("s").chart(bars.svg().unwrap(), "");
    let html = Page::new("p").section(section).html().unwrap();
    assert_eq!(
        html.matches("Losses. power (mW): light: switching 100.0.").count(),
        2,
        "{html}"
    );
    assert!(html.contains("viewBox=\"0 0 900 ") && html.contains("viewBox=\"0 0 356 "));
}

#[test]
fn numbers_of_a_column_have_equal_decimals() {
    let table = Table::new("").number("x", 2);
    let table = table
        .row([1.0.into()])
        .row([(-0.001).into()])
        .row([(-12.345).into()])
        .row([f64::NAN.into()]);
    let html = Page::new("t")
        .section(Section::new("s").table(table.row([f64::NEG_INFINITY.into()])))
        .html()
        .unwrap();
    for cell in ["1.00", "0.00", "−12.35", "–", "−∞"] {
        assert!(html.contains(&format!("<td class=\"n\">{cell}</td>")), "{cell}");
    }
}

#[test]
fn a_row_of_wrong_length_is_an_error() {
    let table = Table::new("losses").text("a").text("b").row(["1".into()]);
    let error = Page::new("t")
        .section(Section::new("s").details(Section::new("d").table(table)))
        .html()
        .unwrap_err();
    assert_eq!(
        error,
        ReportError::Lengths {
            what: "losses".into(),
            expected: 2,
            found: 1
        }
    );
}

#[test]
fn quantities_round_before_they_choose_a_prefix() {
    for (value, unit, digits, text) in [
        (999.96, "V", 3, "1.00 kV"),
        (0.000_999_4, "s", 3, "999 µs"),
        (0.0, "A", 3, "0.00 A"),
        (-2.5e-9, "s", 2, "−2.5 ns"),
        (1e-20, "V", 3, "0.0000100 fV"),
        (12.5, "%", 3, "12.5 %"),
        (123_456.0, "", 3, "123000"),
        (1.5e9, "", 2, "1.5·10⁹"),
        (f64::INFINITY, "V", 3, "∞"),
    ] {
        assert_eq!(quantity(value, unit, digits), text);
    }
}
