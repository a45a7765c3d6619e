//! Prints a page with every kind of chart: `cargo run -p policyc-report --example gallery > gallery.html`.

use report::{
    Axis, BarChart, BarPanel, Chart, Colour, HeatMap, Page, Panel, Ramp, ReportError, Section, Series, Svg, Table,
    Verdict,
};

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
            Section::new("Categories")
                .chart(losses(false)?, "")
                .chart(losses(true)?, "")
                .chart(effects()?, "Dots suit a logarithmic axis: a bar has no foot there."),
        )
        .section(
            Section::new("Maps and scatter")
                .chart(surface(None)?, "")
                .chart(
                    surface(Some([-0.02, -0.01, -0.005, 0.005, 0.01, 0.02].to_vec()))?,
                    "Six levels of a difference.",
                )
                .chart(policy_map()?, "")
                .chart(convergence()?, ""),
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
                .code("cargo run -p policyc-report --example gallery > gallery.html")
                .details(Section::new("More").text("Hidden until opened.")),
        );
    print!("{}", page.html()?);
    Ok(())
}

fn losses(vertical: bool) -> Result<Svg, ReportError> {
    let chart = BarChart::new("Losses by load", ["no load", "light load, discontinuous", "full load"]).panel(
        BarPanel::new(Axis::new("power").unit("W"))
            .bars("switching", [0.08, 0.2, 0.45])
            .bars("conduction", [0.01, 0.1, 0.92])
            .bars("difference to the data sheet", [-0.02, f64::NAN, 0.1]),
    );
    if vertical { chart.vertical().svg() } else { chart.svg() }
}

fn effects() -> Result<Svg, ReportError> {
    let names = ["dead time", "ESR of the output capacitor", "quantisation"];
    let panel = |axis| {
        BarPanel::new(axis)
            .bars("deviation", [2e-5, 3e-4, 1e-5])
            .bars_in(Colour::GREY, "effect", [0.2, 1.2, 0.004])
    };
    BarChart::new("Effects", names)
        .panel(panel(Axis::new("voltage").unit("V").log()))
        .panel(panel(Axis::new("duty").log()))
        .dots()
        .svg()
}

fn plane(value: impl Fn(f64, f64) -> f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let x: Vec<f64> = (0..80).map(|n| 9.0 + 0.1 * f64::from(n)).collect();
    let y: Vec<f64> = (0..60).map(|n| 0.1 + 0.05 * f64::from(n)).collect();
    let cells = y
        .iter()
        .flat_map(|y| x.iter().map(|x| value(*x, *y)).collect::<Vec<_>>())
        .collect();
    (x, y, cells)
}

fn surface(levels: Option<Vec<f64>>) -> Result<Svg, ReportError> {
    let map = HeatMap::new(
        "Fitted duty",
        Axis::new("input voltage").unit("V"),
        Axis::new("load current").unit("A"),
    );
    match levels {
        None => {
            let (x, y, duty) = plane(|v, i| {
                if v > 15.0 && i > 2.8 {
                    f64::NAN
                } else {
                    (5.0 + 0.12 * i) / v
                }
            });
            map.values(Axis::new("duty"), x, y, duty)
                .dots("measured", [10.0, 12.0, 14.0, 16.0], [0.5, 1.5, 2.5, 1.0])
                .svg()
        }
        Some(levels) => {
            let (x, y, gap) = plane(|v, i| 0.02 * (v * 0.8).sin() * (i * 1.5).cos());
            map.values(Axis::new("fit − measured"), x, y, gap)
                .ramp(Ramp::Diverging)
                .levels(levels)
                .svg()
        }
    }
}

fn policy_map() -> Result<Svg, ReportError> {
    let (x, y, action) = plane(|v, i| ((v - 9.0) * 0.4 + i).floor().clamp(0.0, 4.0));
    HeatMap::new(
        "Greedy action",
        Axis::new("input voltage").unit("V"),
        Axis::new("load current").unit("A"),
    )
    .values(Axis::new("action"), x, y, action)
    .categories(["duty 0.30", "duty 0.35", "duty 0.40", "duty 0.45", "duty 0.50"])
    .svg()
}

fn convergence() -> Result<Svg, ReportError> {
    let h: Vec<f64> = (0..30).map(|n| 1e-8 * 1.4_f64.powi(n)).collect();
    let first: Vec<f64> = h.iter().map(|h| h * 3e4).collect();
    let second: Vec<f64> = h.iter().map(|h| h * h * 1e9 + 1e-9).collect();
    Chart::new("Error over step", Axis::new("step").unit("s").log())
        .panel(
            Panel::new(Axis::new("error").unit("V").log())
                .height(280.0)
                .series(Series::points("Euler", h.clone(), first))
                .series(Series::points("trapezoidal", h.clone(), second.clone()))
                .series(Series::line("", h, second).colour(Colour::GREY).dashed())
                .y_line(1e-3, "required")
                .x_zone(1e-7, 1e-6, "step used"),
        )
        .svg()
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
