//! Draws how well plant and ngspice agree, effect by effect, from the cases of the test:
//! `cargo run --release -p policyc-spice --example agreement` writes `docs/pictures/plant-vs-ngspice.svg`.

use std::error::Error;
use std::path::Path;

use report::{Axis, BarChart, BarPanel, Colour, ReportError, Svg};

#[path = "../tests/agreement/cases.rs"]
#[allow(dead_code, reason = "the bounds are the test's")]
mod cases;
#[path = "../tests/agreement/compare.rs"]
mod compare;
#[path = "../tests/agreement/netlist.rs"]
mod netlist;

const PICTURE: &str = "docs/pictures/plant-vs-ngspice.svg";

/// One line of the chart, V and A: deviation from ngspice, and what the effect itself moves.
struct Line {
    name: String,
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
    std::fs::write(&picture, chart(&lines)?.as_str())?;
    Ok(())
}

fn chart(lines: &[Line]) -> Result<Svg, ReportError> {
    let panel = |n: usize, label, unit| {
        let deviation: Vec<f64> = lines.iter().map(|line| line.deviation[n]).collect();
        // less is the difference of the two integrators
        let moved = lines.iter().map(|line| line.moved[n]);
        let moved: Vec<f64> = moved.map(|moved| if moved > 1e-4 { moved } else { f64::NAN }).collect();
        BarPanel::new(Axis::new(label).unit(unit).log().range(1e-5, 1e2))
            .bars_in(
                Colour::VERMILION,
                "largest deviation from ngspice, 30 periods",
                deviation,
            )
            .bars_in(Colour::GREY, "what the effect moves", moved)
    };
    BarChart::new(
        "Plant against ngspice, effect by effect",
        lines.iter().map(|line| line.name.as_str()),
    )
    .panel(panel(0, "sampled v_out and v_in", "V"))
    .panel(panel(1, "sampled i_l and i_out", "A"))
    .dots()
    .svg()
}
