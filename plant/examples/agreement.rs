//! Draws how well plant and ngspice agree, effect by effect, from the cases of the test:
//! `cargo run --release -p plant --example agreement` writes `docs/pictures/plant-vs-ngspice.svg`.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

#[path = "../tests/ngspice/cases.rs"]
mod cases;
#[path = "../tests/ngspice/compare.rs"]
mod compare;
#[path = "../tests/ngspice/netlist.rs"]
mod netlist;

const PICTURE: &str = "docs/pictures/plant-vs-ngspice.svg";

/// One line of the chart, V and A: deviation from ngspice, and what the effect itself moves.
struct Line {
    name: &'static str,
    deviation: [f64; 3],
    moved: [f64; 2],
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut lines = Vec::new();
    for case in cases::all() {
        let rows = compare::run(&case, folder.path())?;
        let deviation = compare::deviations(&case, &rows);
        let mut moved = [0.0_f64; 2];
        for (row, base) in rows.iter().zip(compare::samples(&case, &case.without_effect())?) {
            let (with, without) = (row.plant.measured, base.measured);
            moved[0] = moved[0].max((with.v_out - without.v_out).abs());
            moved[1] = moved[1].max((with.i_l - without.i_l).abs());
        }
        let [v, i, extremes] = deviation;
        println!(
            "{:24} {v:8.1e} V {i:8.1e} A, extremes {extremes:8.1e} V; moves {moved:?}",
            case.name
        );
        lines.push(Line {
            name: case.name,
            deviation,
            moved,
        });
    }
    let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(PICTURE);
    if let Some(folder) = picture.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(&picture, chart(&lines))?;
    Ok(())
}

const ROW: f64 = 17.0;
const TOP: f64 = 64.0;
const LEFT: f64 = 150.0;
const WIDTH: f64 = 300.0;
const GAP: f64 = 40.0;
/// Decades of the axis.
const FROM: i32 = -5;
const TO: i32 = 2;

/// Place of a value on a panel's axis.
fn place(panel: usize, value: f64) -> f64 {
    let part = (value.log10() - f64::from(FROM)) / f64::from(TO - FROM);
    LEFT + panel as f64 * (WIDTH + GAP) + WIDTH * part.clamp(0.0, 1.0)
}

fn chart(lines: &[Line]) -> String {
    let (width, height) = (LEFT + 2.0 * WIDTH + GAP + 30.0, TOP + ROW * lines.len() as f64 + 40.0);
    let mut s = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n"
    );
    let titles = ["sampled v_out and v_in, V", "sampled i_l and i_out, A"];
    for (panel, title) in titles.into_iter().enumerate() {
        axis(&mut s, panel, title, lines.len());
    }
    let legend = [
        ("#c03030", "largest deviation from ngspice, 30 periods"),
        ("#b8b8b8", "what the effect moves"),
    ];
    for (n, (colour, text)) in legend.into_iter().enumerate() {
        let x = LEFT + n as f64 * 290.0;
        let _ = writeln!(
            s,
            "<circle cx=\"{x}\" cy=\"16\" r=\"4\" fill=\"{colour}\"/><text x=\"{}\" y=\"20\">{text}</text>",
            x + 9.0
        );
    }
    for (n, line) in lines.iter().enumerate() {
        let y = TOP + ROW * (n as f64 + 0.5);
        let _ = writeln!(
            s,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
            LEFT - 8.0,
            y + 4.0,
            line.name
        );
        for panel in 0..2 {
            let (near, far) = (place(panel, line.deviation[panel]), place(panel, line.moved[panel]));
            // less is the difference of the two integrators
            if line.moved[panel] > 1e-4 {
                let _ = writeln!(s, "<path d=\"M{near:.1} {y}H{far:.1}\" stroke=\"#dddddd\"/>");
                let _ = writeln!(s, "<circle cx=\"{far:.1}\" cy=\"{y}\" r=\"3.5\" fill=\"#b8b8b8\"/>");
            }
            let _ = writeln!(s, "<circle cx=\"{near:.1}\" cy=\"{y}\" r=\"3.5\" fill=\"#c03030\"/>");
        }
    }
    s.push_str("</svg>\n");
    s
}

fn axis(s: &mut String, panel: usize, title: &str, rows: usize) {
    let bottom = TOP + ROW * rows as f64;
    let middle = place(panel, 1.0)
        .midpoint(place(panel, 10f64.powi(FROM)))
        .midpoint(place(panel, 10f64.powi((FROM + TO) / 2)));
    let _ = writeln!(
        s,
        "<text x=\"{middle:.1}\" y=\"{}\" text-anchor=\"middle\" font-weight=\"bold\">{title}</text>",
        TOP - 22.0
    );
    for decade in FROM..=TO {
        let x = place(panel, 10f64.powi(decade));
        let _ = writeln!(s, "<path d=\"M{x:.1} {TOP}V{bottom}\" stroke=\"#eeeeee\"/>");
        let _ = writeln!(
            s,
            "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\" fill=\"#555555\">1e{decade}</text>",
            bottom + 15.0
        );
    }
}
