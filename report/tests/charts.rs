//! Charts: well-formed, the same each time, nothing lost, nothing invented.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use quick_xml::Reader;
use quick_xml::events::Event;
use report::{Axis, BarChart, BarPanel, Chart, Colour, HeatMap, Panel, Ramp, ReportError, Series, Svg};

/// Every element closed, every entity known; returns the texts.
fn texts(svg: &str) -> Vec<String> {
    let mut reader = Reader::from_str(svg);
    reader.config_mut().check_end_names = true;
    let (mut found, mut depth, mut text) = (Vec::new(), 0_i32, String::new());
    loop {
        match reader.read_event().expect(svg) {
            Event::Start(tag) => {
                tag.attributes().for_each(|attribute| drop(attribute.unwrap()));
                depth += 1;
                text.clear();
            }
            Event::Empty(tag) => tag.attributes().for_each(|attribute| drop(attribute.unwrap())),
            Event::Text(part) => text.push_str(&part),
            Event::GeneralRef(entity) => {
                let name: &str = &entity;
                let known = quick_xml::escape::unescape(&format!("&{name};")).unwrap().into_owned();
                text.push_str(&known);
            }
            Event::End(_) => {
                depth -= 1;
                if !text.trim().is_empty() {
                    found.push(text.trim().to_owned());
                }
                text.clear();
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert_eq!(depth, 0, "unclosed element");
    found
}

/// Path data drawn in a colour.
fn path_in(svg: &Svg, colour: Colour) -> String {
    let line = svg.as_str().lines().find(|line| {
        line.starts_with("<path d=")
            && line.contains(&format!("stroke=\"{colour}\""))
            && line.contains("stroke-linejoin")
    });
    line.expect("series drawn").split('"').nth(1).unwrap().to_owned()
}

/// Ends of the vertical extent of a path, pixels.
fn extent(path: &str) -> (f64, f64) {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut rest = path;
    while let Some(at) = rest.find(['M', 'L', 'H', 'V']) {
        let command = rest.as_bytes()[at];
        let arguments = &rest[at + 1..];
        let end = arguments
            .find(|c: char| c.is_ascii_alphabetic())
            .unwrap_or(arguments.len());
        let numbers: Vec<f64> = arguments[..end].split(',').map(|n| n.parse().unwrap()).collect();
        if command != b'H' {
            let y = *numbers.last().unwrap();
            (low, high) = (low.min(y), high.max(y));
        }
        rest = &arguments[end..];
    }
    (low, high)
}

fn one(series: Series, y: Axis) -> Result<Svg, ReportError> {
    Chart::new("t", Axis::new("x"))
        .panel(Panel::new(y).series(series).height(100.0))
        .svg()
}

fn each_kind(text: &str) -> Vec<Svg> {
    let t = [0.0, 1.0, 2.0, 3.0];
    let y = [1.0, 3.0, f64::NAN, 2.0];
    let panel = Panel::new(Axis::new(text).unit(text))
        .series(Series::line(text, t, y))
        .series(Series::step("step", t, y).dashed())
        .series(Series::points("points", t, y))
        .series(Series::band("band", t, [0.0; 4], y))
        .y_line(2.0, text)
        .x_zone(0.5, 1.0, text);
    let bars = BarChart::new(text, [text, "b"]).panel(BarPanel::new(Axis::new(text)).bars(text, [1.0, f64::NAN]));
    let map = || {
        HeatMap::new(text, Axis::new(text), Axis::new(text)).values(
            Axis::new(text),
            [0.0, 1.0],
            [0.0, 1.0],
            [0.0, 1.0, f64::NAN, 2.0],
        )
    };
    vec![
        Chart::new(text, Axis::new(text))
            .panel(panel.clone())
            .panel(panel)
            .svg()
            .unwrap(),
        bars.svg().unwrap(),
        bars.clone().vertical().svg().unwrap(),
        bars.dots().svg().unwrap(),
        map().dots(text, [0.5], [0.5]).svg().unwrap(),
        map().ramp(Ramp::Diverging).svg().unwrap(),
        map().levels([0.0, 1.0, 2.0]).svg().unwrap(),
        map().categories([text, "b", "c"]).svg().unwrap(),
    ]
}

#[test]
fn hostile_text_stays_text_in_every_chart() {
    let hostile = "<script>\"a\" & 'b'</script>]]>";
    for svg in each_kind(hostile) {
        assert!(texts(svg.as_str()).iter().any(|text| text.contains(hostile)), "{svg}");
        assert!(!svg.as_str().contains("<script"));
        assert!(!svg.as_str().contains("NaN") && !svg.as_str().contains("inf"));
    }
    for svg in each_kind("null \0 bell \u{7} \u{ffff}") {
        texts(svg.as_str());
        assert!(!svg.as_str().contains(['\0', '\u{7}', '\u{ffff}']));
    }
}

#[test]
fn equal_charts_have_equal_bytes() {
    assert_eq!(each_kind("a"), each_kind("a"));
}

#[test]
fn nothing_in_a_picture_needs_an_id_or_a_load() {
    for svg in each_kind("a") {
        for word in [" id=", "url(", "href", "<style"] {
            assert!(!svg.as_str().contains(word), "{word}");
        }
    }
}

#[test]
fn a_spike_of_one_sample_survives_thinning() {
    let n = 200_000;
    let x: Vec<f64> = (0..n).map(f64::from).collect();
    let mut y = vec![0.0; n as usize];
    (y[77_777], y[123_456]) = (1.0, -1.0);
    for series in [Series::line("s", x.clone(), y.clone()), Series::step("s", x, y)] {
        let svg = one(series, Axis::new("y").range(-1.0, 1.0)).unwrap();
        assert_eq!(extent(&path_in(&svg, Colour::BLUE)), (0.0, 100.0));
        assert!(svg.as_str().len() < 8_000, "{} bytes", svg.as_str().len());
    }
}

#[test]
fn thinned_noise_covers_each_column() {
    // worst case: each column needs all four points
    let x: Vec<f64> = (0..100_000).map(f64::from).collect();
    let y: Vec<f64> = (0..100_000_u32)
        .map(|n| f64::from(n.wrapping_mul(2_654_435_761) >> 8))
        .collect();
    let svg = one(Series::line("s", x, y), Axis::new("y")).unwrap();
    assert!(svg.as_str().len() < 60_000, "{} bytes", svg.as_str().len());
}

#[test]
fn nan_and_infinity_break_the_line() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e200] {
        let svg = one(
            Series::line("s", [0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, bad, 1.0, 0.0]),
            Axis::new("y"),
        )
        .unwrap();
        let path = path_in(&svg, Colour::BLUE);
        assert_eq!(path.matches('M').count(), 2, "{bad}: {path}");
    }
}

#[test]
fn zero_breaks_a_line_on_a_logarithmic_axis() {
    let svg = one(
        Series::line("s", [0.0, 1.0, 2.0], [1.0, 0.0, 10.0]),
        Axis::new("y").log(),
    )
    .unwrap();
    assert_eq!(path_in(&svg, Colour::BLUE).matches('M').count(), 2);
}

#[test]
fn a_step_holds_its_value_until_the_next() {
    let axis = Axis::new("y").range(0.0, 1.0);
    let path = path_in(
        &one(Series::step("s", [0.0, 1.0, 2.0], [0.0, 1.0, 0.0]), axis).unwrap(),
        Colour::BLUE,
    );
    let commands: String = path.chars().filter(char::is_ascii_alphabetic).collect();
    assert_eq!(commands, "MHVHV", "{path}");
}

#[test]
fn ticks_carry_si_prefixes() {
    let axis = |low, high| {
        one(
            Series::line("", [0.0, 1.0], [low, high]),
            Axis::new("v").unit("V").range(low, high),
        )
        .unwrap()
    };
    let found = texts(axis(0.0, 2e-3).as_str());
    for text in ["v (mV)", "0", "1", "2"] {
        assert!(found.contains(&text.to_owned()), "{text}: {found:?}");
    }
    assert!(texts(axis(-3e6, 3e6).as_str()).contains(&"−2".to_owned()));
    assert!(texts(axis(-3e6, 3e6).as_str()).contains(&"v (MV)".to_owned()));
    let log = one(
        Series::line("", [0.0, 1.0], [1e-6, 1.0]),
        Axis::new("v").unit("V").log(),
    )
    .unwrap();
    assert!(texts(log.as_str()).contains(&"1 mV".to_owned()));
    let plain = one(Series::line("", [0.0, 1.0], [1e-9, 1.0]), Axis::new("loss").log()).unwrap();
    assert!(
        texts(plain.as_str()).contains(&"10⁻⁸".to_owned()),
        "{:?}",
        texts(plain.as_str())
    );
}

#[test]
fn a_constant_signal_has_an_axis() {
    for value in [0.0, 5.0, -1e-12, 1e150] {
        let svg = one(Series::line("s", [0.0, 1.0], [value; 2]), Axis::new("y").unit("V")).unwrap();
        let (low, high) = extent(&path_in(&svg, Colour::BLUE));
        assert!(low == high && low > 20.0 && high < 80.0, "{value}: {low} {high}");
    }
}

#[test]
fn series_of_one_name_share_colour_and_legend_entry() {
    let panel = || Panel::new(Axis::new("y")).series(Series::line("plant", [0.0, 1.0], [0.0, 1.0]));
    let other = panel().series(Series::line("bench", [0.0, 1.0], [1.0, 1.0]));
    let svg = Chart::new("t", Axis::new("x"))
        .panel(other)
        .panel(panel())
        .svg()
        .unwrap();
    assert_eq!(texts(svg.as_str()).iter().filter(|text| *text == "plant").count(), 1);
    assert_eq!(svg.as_str().matches(&format!("stroke=\"{}\"", Colour::BLUE)).count(), 3);
}

#[test]
fn bars_start_at_zero() {
    let chart =
        BarChart::new("t", ["a", "b"]).panel(BarPanel::new(Axis::new("y").range(-1.0, 1.0)).bars("s", [0.5, -0.5]));
    let svg = chart.svg().unwrap();
    let bars: Vec<&str> = svg
        .as_str()
        .lines()
        .filter(|line| line.contains("#0072b2"))
        .skip(1)
        .collect();
    let number = |line: &str, key: &str| -> f64 {
        let start = line.find(&format!(" {key}=\"")).unwrap() + key.len() + 3;
        line[start..].split('"').next().unwrap().parse().unwrap()
    };
    let foot = number(bars[0], "x");
    assert!((number(bars[1], "x") + number(bars[1], "width") - foot).abs() < 0.15);
    assert!((number(bars[0], "width") - number(bars[1], "width")).abs() < 0.15);
}

#[test]
fn a_map_puts_the_first_row_at_the_bottom() {
    let map = HeatMap::new("t", Axis::new("x"), Axis::new("y")).categories(["low", "high"]);
    let svg = map
        .values(Axis::new("z"), [0.0, 1.0], [0.0, 1.0], [0.0, 0.0, 1.0, 1.0])
        .svg()
        .unwrap();
    let cell = |colour: &str| {
        svg.as_str()
            .lines()
            .find(|l| l.starts_with("<path") && l.contains(&format!("fill=\"{colour}\"")))
            .unwrap()
    };
    // viridis: the lowest category is dark, the highest yellow
    assert!(
        extent(cell("#440154").split('"').nth(1).unwrap()).0 > extent(cell("#fde725").split('"').nth(1).unwrap()).0
    );
}

#[test]
fn what_cannot_be_drawn_is_an_error_that_names_it() {
    let empty = one(Series::line("plant", [], []), Axis::new("y")).unwrap_err();
    assert_eq!(empty, ReportError::Empty { what: "plant".into() });
    let nan = one(Series::line("plant", [0.0], [f64::NAN]), Axis::new("y")).unwrap_err();
    assert_eq!(nan.to_string(), "`plant` has no value that can be drawn");
    let lengths = one(Series::line("plant", [0.0, 1.0], [1.0]), Axis::new("y")).unwrap_err();
    assert_eq!(lengths.to_string(), "`plant` needs 2 values in each list, found 1");
    let negative = one(Series::line("plant", [0.0], [-1.0]), Axis::new("y").log()).unwrap_err();
    assert_eq!(negative, ReportError::Empty { what: "y".into() });
    for (low, high) in [(1.0, 0.0), (0.0, f64::NAN), (1.0, 1.0)] {
        let range = one(Series::line("s", [0.0], [1.0]), Axis::new("duty").range(low, high)).unwrap_err();
        assert!(matches!(range, ReportError::Range { axis, .. } if axis == "duty"));
    }
    assert!(Chart::new("none", Axis::new("x")).svg().is_err());
    assert!(
        Chart::new("none", Axis::new("x"))
            .panel(Panel::new(Axis::new("y")))
            .svg()
            .is_err()
    );
    assert!(
        BarChart::new("none", [""; 0])
            .panel(BarPanel::new(Axis::new("y")))
            .svg()
            .is_err()
    );
    let bars = BarChart::new("t", ["a"]).panel(BarPanel::new(Axis::new("y")).bars("s", [1.0, 2.0]));
    assert!(matches!(
        bars.svg(),
        Err(ReportError::Lengths {
            expected: 1,
            found: 2,
            ..
        })
    ));
    let map = |x: &[f64], cells: &[f64]| {
        HeatMap::new("t", Axis::new("v_in"), Axis::new("y"))
            .values(Axis::new("z"), x, [0.0, 1.0], cells)
            .svg()
    };
    assert!(matches!(
        map(&[0.0, 1.0], &[0.0; 3]),
        Err(ReportError::Lengths {
            expected: 4,
            found: 3,
            ..
        })
    ));
    assert_eq!(
        map(&[1.0, 0.0], &[0.0; 4]).unwrap_err(),
        ReportError::Order { axis: "v_in".into() }
    );
    assert!(map(&[0.0, 1.0], &[f64::NAN; 4]).is_err());
    assert!(map(&[], &[]).is_err());
}

#[test]
fn hostile_numbers_never_hang_or_panic() {
    let numbers = [
        0.0,
        -0.0,
        5e-324,
        1e-300,
        1e-150,
        1.0,
        1.0 + f64::EPSILON,
        1e15,
        1e150,
        -1e150,
        f64::MAX,
        f64::NAN,
    ];
    for a in numbers {
        for b in numbers {
            for axis in [
                Axis::new("y").unit("V"),
                Axis::new("y"),
                Axis::new("y").log(),
                Axis::new("y").range(a, b),
            ] {
                if let Ok(svg) = one(Series::line("s", [a, b], [a, b]), axis) {
                    assert!(svg.as_str().len() < 20_000);
                    texts(svg.as_str());
                }
            }
        }
    }
}
