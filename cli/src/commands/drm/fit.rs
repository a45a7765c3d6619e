//! `policyc drm fit`

use drm::{Conduction, FitOptions, Form, simulation_toml};
use plant::Parameters;
use toml_input::messages;

use crate::arguments::drm::{Fit, Terms};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// A fitted mapping as files.
pub struct Made {
    /// `drm.toml`.
    pub mapping: String,
    /// The report as a page.
    pub page: Option<String>,
    /// The report in words.
    pub text: String,
    /// The report as JSON.
    pub json: String,
}

/// Fits, writes, reports.
pub fn run(options: &Fit) -> Result<Outcome, Failure> {
    let made = make(options, options.report.is_some())?;
    output::replace_own_one(&options.out, &made.mapping, options.replacing)?;
    if let (Some(path), Some(page)) = (&options.report, signed(options, &made)?) {
        output::replace_own_one(path, &page, options.replacing)?;
    }
    if options.json {
        output::say(&made.json)?;
    } else {
        output::say(made.text.trim_end())?;
        output::say(&format!("\nwrote {}", options.out.display()))?;
    }
    Ok(Outcome::Done)
}

/// The page with what made it.
///
/// # Errors
/// None in practice.
pub fn signed(options: &Fit, made: &Made) -> Result<Option<String>, Failure> {
    let read = [("table", options.table.display().to_string())];
    let signed =
        |page: &String| crate::made::signed_page(page, &[("--out", "drm.toml"), ("--report", "report.html")], &read);
    made.page.as_ref().map(signed).transpose()
}

/// The mapping of a table; nothing is written.
///
/// # Errors
/// Faults of the table or the options, or that no mapping can be fitted.
pub fn make(options: &Fit, with_page: bool) -> Result<Made, Failure> {
    let table = options.reading.table(&options.table, None)?;
    let report = drm::fit(&table, &fit_options(options)?)?;
    let text = drm::text(&report)?;
    let title = format!("Duty ratio mapping of {}", options.table.display());
    let page = with_page.then(|| drm::page(&report, &title, &text)).transpose()?;
    let simulation = options.reading.simulation()?;
    Ok(Made {
        mapping: report.fit.map.to_toml(&drm::comment(&report))
            + &simulation.as_ref().map_or_else(String::new, simulation_toml),
        page,
        text,
        json: serde_json::to_string_pretty(&report)?,
    })
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
            return Err(messages::not_positive(name, value).into());
        }
    }
    let plant = options
        .plant
        .as_deref()
        .map(|path| Parameters::buck_from_file(path, "`drm fit`"))
        .transpose()?;
    let of_plant = plant.as_ref().map(FitOptions::of).unwrap_or_default();
    Ok(FitOptions {
        form: match options.terms {
            Terms::Auto => None,
            Terms::Three => Some(Form::ThreeTerm),
            Terms::Four => Some(Form::FourTerm),
        },
        components: options.components.map(usize::from),
        conduction: of_plant.conduction.or(given),
        keep_outliers: options.keep_outliers,
        assumed_a: options.assume_a,
        ..of_plant
    })
}
