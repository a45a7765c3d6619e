//! `policyc drm fit`

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use drm::{Conduction, FitOptions, Form, Report, simulation_toml};

use super::Reading;
use crate::ownership::Replacing;
use crate::{Failure, Outcome, output};

#[derive(Debug, Args)]
pub struct Fit {
    /// Settled points as CSV with the columns duty (or d_real), v_out, i_out, v_in
    pub table: PathBuf,
    /// Mapping to write; an older one of policyc is replaced
    #[arg(long, value_name = "FILE", default_value = "drm.toml")]
    pub out: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// Form of the mapping
    #[arg(long, value_enum, default_value_t = Terms::Auto)]
    pub terms: Terms,
    /// Components of the partial least squares, instead of cross-validation
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=3))]
    pub components: Option<u8>,
    /// The converter, for its boundary of discontinuous conduction
    #[arg(long, value_name = "FILE", conflicts_with_all = ["inductance", "f_sw", "v_f"])]
    pub plant: Option<PathBuf>,
    /// Inductance in H, for the boundary of discontinuous conduction (diode rectifier)
    #[arg(long, value_name = "H", requires = "f_sw")]
    pub inductance: Option<f64>,
    /// Switching frequency in Hz
    #[arg(long, value_name = "HZ", requires = "inductance")]
    pub f_sw: Option<f64>,
    /// Forward voltage of the diode in V
    #[arg(long, value_name = "V", default_value_t = 0.0)]
    pub v_f: f64,
    /// Name outliers, but leave them in the fit
    #[arg(long)]
    pub keep_outliers: bool,
    /// Take a as given, for a table whose voltage does not vary
    #[arg(long, value_name = "A")]
    pub assume_a: Option<f64>,
    /// Write a page with pictures as well: errors, surface, leave-one-out
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub replacing: Replacing,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// Form on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Terms {
    /// The four-term form where it foretells clearly better
    Auto,
    /// a d_sim + b i_out + c
    #[value(name = "3")]
    Three,
    /// With the product r i_out d_sim
    #[value(name = "4")]
    Four,
}

/// Fits, writes, reports.
pub fn run(options: &Fit) -> Result<Outcome, Failure> {
    let table = options.reading.table(&options.table, None)?;
    let report = drm::fit(&table, &fit_options(options)?)?;
    let text = drm::text(&report)?;
    let title = format!("Duty ratio mapping of {}", options.table.display());
    let page = options
        .report
        .as_ref()
        .map(|path| Ok::<_, Failure>((path, drm::page(&report, &title, &text)?)));
    let page = page.transpose()?;
    let simulation = options.reading.simulation()?;
    let mapping =
        report.fit.map.to_toml(&comment(&report)) + &simulation.as_ref().map_or_else(String::new, simulation_toml);
    output::replace_own_one(&options.out, &mapping, options.replacing)?;
    if let Some((path, page)) = &page {
        output::replace_own_one(path, page, options.replacing)?;
    }
    if options.json {
        output::say(&serde_json::to_string_pretty(&report)?)?;
    } else {
        output::say(text.trim_end())?;
        output::say(&format!("\nwrote {}", options.out.display()))?;
    }
    Ok(Outcome::Done)
}

fn fit_options(options: &Fit) -> Result<FitOptions, Failure> {
    let given = options
        .inductance
        .zip(options.f_sw)
        .map(|(inductance, f_sw)| Conduction {
            inductance,
            f_sw,
            v_f: options.v_f,
        });
    let numbers = [
        ("--inductance", options.inductance),
        ("--f-sw", options.f_sw),
        ("--assume-a", options.assume_a),
    ];
    for (name, value) in numbers {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(super::not_positive(name, value));
        }
    }
    let plant = options.plant.as_deref().map(super::plant_parameters).transpose()?;
    let continuous = plant.as_ref().is_some_and(|plant| Conduction::of(plant).is_none());
    Ok(FitOptions {
        form: match options.terms {
            Terms::Auto => None,
            Terms::Three => Some(Form::ThreeTerm),
            Terms::Four => Some(Form::FourTerm),
        },
        components: options.components.map(usize::from),
        conduction: plant.as_ref().and_then(Conduction::of).or(given),
        always_continuous: continuous,
        keep_outliers: options.keep_outliers,
        assumed_a: options.assume_a,
    })
}

/// What stands above the mapping in its file.
fn comment(report: &Report) -> String {
    let fit = &report.fit;
    let mut text = format!(
        "Duty ratio mapping, fitted by policyc {} to {} settled points ({} components).\n\
         Voltage error rms {:.4} V, leave-one-out {:.4} V rms, {:.4} V at most; without a mapping {:.4} V rms.",
        env!("CARGO_PKG_VERSION"),
        fit.rows.len(),
        fit.components,
        fit.with.rms_v,
        fit.left_out.rms_v,
        fit.left_out.max_v,
        fit.without.rms_v
    );
    for finding in &fit.separation.findings {
        text += &format!("\nNote: {finding}.");
    }
    text
}
