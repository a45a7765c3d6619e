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
    assert!(!html.contains("<script"));
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
    for word in ["<script", "<link", "@import", "url(", "src=", "href="] {
        assert!(!html.contains(word), "{word}");
    }
    let outside: Vec<_> = html
        .match_indices("http")
        .filter(|(at, _)| !html[*at..].starts_with("http://www.w3.org/2000/svg"))
        .collect();
    assert!(outside.is_empty(), "{outside:?}");
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
