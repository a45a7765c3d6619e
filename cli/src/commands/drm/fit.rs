//! `policyc drm fit`

use drm::{Conduction, FitOptions, Form, simulation_toml};
use plant::Parameters;
use toml_input::messages;

use crate::arguments::drm::{Fit, Terms};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

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
        report.fit.map.to_toml(&drm::comment(&report)) + &simulation.as_ref().map_or_else(String::new, simulation_toml);
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
            return Err(messages::not_positive(name, value).into());
        }
    }
    let plant = options
        .plant
        .as_deref()
        .map(|path| Parameters::buck_from_file(path, "`drm fit`"))
        .transpose()?;
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
