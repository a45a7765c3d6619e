//! Prints a page with every kind of chart: `cargo run -p report --example gallery > gallery.html`.

use report::{Axis, Chart, Colour, Page, Panel, ReportError, Section, Series, Svg, Table, Verdict};

fn main() -> Result<(), ReportError> {
    let page = Page::new("Gallery of charts")
        .verdict(Verdict::Pass, "every kind of chart, with made-up data.")
        .section(
            Section::new("Panels with a shared x axis")
                .text("Series with their own x, steps, bands, zones, reference lines and a gap.")
                .chart(
                    transient()?,
                    "A spike one sample wide stays visible among 20 000 samples.",
                ),
        )
        .section(
            Section::new("Tables and lists")
                .table(
                    Table::new("Figures that line up")
                        .text("quantity")
                        .number("largest deviation (mV)", 2)
                        .number("samples", 0)
                        .row(["v_out".into(), 12.5.into(), 20_000.0.into()])
                        .row(["v_in & <more>".into(), (-0.25).into(), 300.0.into()])
                        .row(["missing".into(), f64::NAN.into(), 0.0.into()]),
                )
                .pairs([("f_sw", "100 kHz"), ("inductor", "47 µH")])
                .code("cargo run -p report --example gallery > gallery.html")
                .details(Section::new("More").text("Hidden until opened.")),
        );
    print!("{}", page.html()?);
    Ok(())
}

fn transient() -> Result<Svg, ReportError> {
    let t: Vec<f64> = (0..20_000).map(|n| f64::from(n) * 1e-7).collect();
    let ring = |t: f64| 5.0 - 0.35 * (-t * 3e3).exp() * (t * 3e4).sin();
    let mut v: Vec<f64> = t.iter().map(|t| ring(*t)).collect();
    v[7777] += 0.3;
    let coarse: Vec<f64> = (0..200).map(|n| f64::from(n) * 1e-5).collect();
    let bench: Vec<f64> = coarse.iter().map(|t| ring(*t) + 0.02 * (t * 2e5).sin()).collect();
    let low: Vec<f64> = bench.iter().map(|v| v - 0.05).collect();
    let high: Vec<f64> = bench.iter().map(|v| v + 0.05).collect();
    let i: Vec<f64> = coarse
        .iter()
        .map(|t| {
            if (1.0e-3..1.1e-3).contains(t) {
                f64::NAN
            } else {
                2.0 + 0.8 * (-t * 2e3).exp() * (t * 3e4).cos()
            }
        })
        .collect();
    let duty: Vec<f64> = (0..200_i32).map(|n| 0.4 + 0.05 * f64::from(n * n % 5)).collect();
    Chart::new("Load step from 1 A to 2 A", Axis::new("time").unit("s"))
        .panel(
            Panel::new(Axis::new("output voltage").unit("V"))
                .series(Series::band("expanded uncertainty", coarse.clone(), low, high).colour(Colour::VERMILION))
                .series(Series::line("plant", t, v))
                .series(Series::line("bench", coarse.clone(), bench).dashed())
                .y_zone(4.9, 5.1, "settled")
                .y_line(5.0, "v_ref")
                .x_line(2.5e-4, "load step"),
        )
        .panel(
            Panel::new(Axis::new("inductor current").unit("A"))
                .height(140.0)
                .series(Series::line("bench", coarse.clone(), i))
                .y_line(2.75, "limit"),
        )
        .panel(
            Panel::new(Axis::new("duty").range(0.3, 0.7))
                .height(100.0)
                .series(Series::step("plant", coarse, duty)),
        )
        .svg()
}
