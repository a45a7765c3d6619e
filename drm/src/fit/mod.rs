//! From a table of settled points to a mapping, and how far it can be trusted.
//!
//! ```text
//! table ─► points in continuous conduction ─► what they tell apart ─► outliers, by the richer form
//!       ─► both forms: components, coefficients, leave-one-out ─► choice ─► meaning, remarks ─► Report
//! ```

mod boundary;
mod causes;
mod meaning;
mod outliers;
mod regression;
mod separation;
mod show;
mod validation;

use plant::Parameters;
use policy::Coefficients;
use serde::Serialize;
use toml_input::{Fault, Faults, Message};

use crate::dcm::Conduction;
use crate::mapping::DutyRatioMap;
use crate::table::{Point, Table};
pub use causes::{Cause, Explanation};
pub use outliers::Outlier;
pub use regression::Form;
pub(crate) use regression::error_v;
use regression::{Model, hull};
pub use separation::Separation;
pub(crate) use separation::load_line;
pub use show::{comment, text};
pub(crate) use show::{error_head, error_line, wrapped};
pub(crate) use validation::rms;

/// How a table is fitted.
#[derive(Debug, Clone, Default)]
pub struct FitOptions {
    /// The form; without it the four-term form is taken where it foretells clearly better.
    pub form: Option<Form>,
    /// Components of the partial least squares; without it cross-validation decides.
    pub components: Option<usize>,
    /// Points below the boundary of discontinuous conduction are left out.
    pub conduction: Option<Conduction>,
    /// Of a synchronous leg without dead time, whose current turns round and costs no duty by it: points below the boundary
    /// are named, and stay in the fit unless the table shows that they follow another law, as those of a bench with a dead
    /// time do.
    pub turns_round: Option<Conduction>,
    /// The plant is averaged: no current of it rests, and there is no boundary to look for.
    pub is_averaged: bool,
    /// Outliers are named, but stay in the fit.
    pub keep_outliers: bool,
    /// `a` is taken as given: for a table whose voltage does not vary.
    pub assumed_a: Option<f64>,
}

impl FitOptions {
    /// What a plant says of the inductor current of settled points.
    #[must_use]
    pub fn of(plant: &Parameters) -> Self {
        Self {
            conduction: Conduction::of(plant),
            turns_round: Conduction::of_turning(plant),
            is_averaged: plant.converter.model == plant::Model::Averaged,
            ..Self::default()
        }
    }
}

/// A set of errors in V.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// Mean of measured minus expected, V.
    pub mean_v: f64,
    /// Root mean square, V.
    pub rms_v: f64,
    /// Largest magnitude, V.
    pub max_v: f64,
    /// Line of the table it is in.
    pub max_line: usize,
}

/// A point of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Row {
    /// As measured.
    pub point: Point,
    /// Duty ratio of the simulation at the same voltage and load current.
    pub d_sim: f64,
    /// Mapped duty ratio.
    pub d_mapped: f64,
    /// Measured voltage minus that of the simulation at `d_real`: the error without a mapping, V.
    pub without_v: f64,
    /// Measured voltage minus that which the mapping expects, V.
    pub with_v: f64,
    /// The same with the mapping fitted without this point, V.
    pub left_out_v: f64,
}

/// One fitted form.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Fit {
    /// Three- or four-term.
    pub form: Form,
    /// The mapping.
    pub map: DutyRatioMap,
    /// Jackknife standard errors of the coefficients.
    pub standard_errors: Coefficients,
    /// Components of the partial least squares.
    pub components: usize,
    /// Leave-one-out rms error in V for one, two, ... components.
    pub components_v: Vec<f64>,
    /// The points, in the order of the table.
    pub rows: Vec<Row>,
    /// Errors without a mapping.
    pub without: Errors,
    /// Errors of the fit on its own points.
    pub with: Errors,
    /// Leave-one-out errors.
    pub left_out: Errors,
    /// What the table determines.
    pub separation: Separation,
}

/// Everything there is to say about a table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The fit to use.
    pub fit: Fit,
    /// The other form, where the table has points enough.
    pub other: Option<Fit>,
    /// Points left out because the others contradict them; with `keep_outliers` they are in the fit all the same.
    pub outliers: Vec<Outlier>,
    /// Lines left out as discontinuous.
    pub discontinuous: Vec<usize>,
    /// What the coefficients mean, as far as the table separates it.
    pub meaning: Vec<String>,
    /// Causes that explain the table, alone and in pairs.
    pub explanations: Vec<Explanation>,
    /// What a reader must know before using the mapping.
    pub notes: Vec<String>,
}

/// Fits a mapping to a table.
///
/// # Errors
/// If the points are too few, do not determine the mapping, or yield one that does not rise with d_sim.
pub fn fit(table: &Table, options: &FitOptions) -> Result<Report, Faults> {
    let mut notes = table.notes.clone();
    if !table.open.is_empty() {
        notes.push(format!("not measured yet: {}", crate::table::lines(&table.open)));
    }
    // first of all: points in discontinuous conduction follow another law and would be outliers of both forms
    let (mut points, discontinuous) = boundary::continuous(table, options, &mut notes);
    let forms = forms(&points, options).map_err(|message| Faults::from(Fault::from(message)))?;
    let everything = points.clone();
    let models = Models::new(&points, options);
    // outliers are judged by the better form: what the other lacks must not hide them
    let richest = models.richest();
    let cap = separation::examine(&richest, &points).directions;
    let outliers = outliers::remove(&richest, &mut points, cap);
    if points.len() < richest.form.fewest_points() + 1 {
        notes.push("too few points to tell a bad one from the rest".to_owned());
    }
    if options.keep_outliers {
        points = everything;
    }
    let mut fits = Vec::new();
    for form in &forms {
        match one(&models.of(*form), &points, options) {
            Ok(fit) => fits.push(fit),
            // a product that turns the mapping around is no reason to refuse the form that does not have it
            Err(_) if !fits.is_empty() => {
                notes.push(format!("the {} form does not rise with d_sim: left out", form.name()))
            }
            Err(faults) => return Err(faults),
        }
    }
    let chosen = choose(&fits);
    let fit = fits.remove(chosen);
    let other = fits.pop();
    remarks(&fit, &points, options, &mut notes);
    let (explanations, impossible) = causes::explain(&points);
    Ok(Report {
        meaning: meaning::of(&fit, &points, &explanations, &impossible),
        fit,
        other,
        outliers,
        discontinuous,
        explanations,
        notes,
    })
}

/// The forms to fit, the simplest first.
fn forms(points: &[Point], options: &FitOptions) -> Result<Vec<Form>, Message> {
    let least = options.form.unwrap_or(Form::ThreeTerm).fewest_points();
    if points.len() < least {
        let message = Message::new("too few points in continuous conduction")
            .found(format!("{}", points.len()))
            .expected(format!("at least {least}"));
        return Err(message.hint("measure at more duties and loads; above the ripple the current never rests"));
    }
    let range = hull(points.iter().map(Point::d_sim));
    if range.high - range.low < separation::LEAST_D_SIM && options.assumed_a.is_none() {
        let message = Message::new("the table does not determine a: the voltage hardly varies")
            .found(format!("v_out / v_in from {:.5} to {:.5}", range.low, range.high))
            .expected(format!("a range of at least {}", separation::LEAST_D_SIM));
        let hint = "measure at voltages around the wanted one as well; or give a from a data sheet with --assume-a \
                    (1 if the diode's forward voltage is small against v_in): then b and c are fitted at this voltage";
        return Err(message.hint(hint));
    }
    let product = Models::new(points, options).has_product;
    if options.form == Some(Form::FourTerm) && !product {
        let message = Message::new("the four-term form needs a load and a voltage that vary, each on its own");
        return Err(message.hint("take the three-term form, or measure more points"));
    }
    Ok(match options.form {
        Some(form) => vec![form],
        None if product => vec![Form::ThreeTerm, Form::FourTerm],
        None => vec![Form::ThreeTerm],
    })
}

/// The models that a table allows.
struct Models {
    constant_load: bool,
    load_line: f64,
    assumed_a: Option<f64>,
    /// The product of duty and current can be told from both.
    has_product: bool,
}

impl Models {
    fn new(points: &[Point], options: &FitOptions) -> Self {
        let constant_load = separation::is_constant_load(points);
        let enough = points.len() >= Form::FourTerm.fewest_points();
        Self {
            constant_load,
            // with a given, b is known by itself, and an error is stated at constant current
            load_line: match options.assumed_a {
                Some(_) => 0.0,
                None => separation::load_line(points),
            },
            assumed_a: options.assumed_a,
            has_product: enough && !constant_load && options.assumed_a.is_none(),
        }
    }

    fn of(&self, form: Form) -> Model {
        Model {
            form,
            constant_load: self.constant_load,
            assumed_a: self.assumed_a,
            load_line: self.load_line,
        }
    }

    fn richest(&self) -> Model {
        self.of(match self.has_product {
            true => Form::FourTerm,
            false => Form::ThreeTerm,
        })
    }
}

/// The four-term form if it foretells clearly better and the table tells its terms apart.
fn choose(fits: &[Fit]) -> usize {
    // the ratio of two rms errors of a dozen points scatters by a fifth (1 / root of 2 n). With 1 the term is taken
    // where there is none; 0.2 finds the real ones of the tests as well
    const CLEARLY: f64 = 0.8;
    match fits {
        [three, four] => {
            // a product that the table cannot tell from its factors holds on the measured points only
            let told_apart = four.separation.directions == four.separation.predictors;
            let better = four.left_out.rms_v < CLEARLY * three.left_out.rms_v;
            usize::from(told_apart && better)
        }
        _ => 0,
    }
}

fn one(model: &Model, points: &[Point], options: &FitOptions) -> Result<Fit, Faults> {
    let separation = separation::examine(model, points);
    let cap = separation.directions;
    let (best, components_v) = validation::choose_components(model, points, cap);
    // further components would fit directions that are rounding or noise
    let components = options.components.unwrap_or(best).min(cap);
    let pls = model.fit(points, components);
    // rounded before it is judged: the errors are those of the mapping that a policy reads
    let map = model.map(points, &pls).rounded();
    // refused, not noted: with a mapping that falls the control loop has the wrong sign
    if !map.rises() {
        let currents = [0.0, map.valid_i_out.low, map.valid_i_out.high];
        let slope = currents
            .map(|i_out| map.slope(i_out))
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        let message = Message::new(format!("the {} mapping does not rise with d_sim", model.form.name()))
            .found(format!("slope {slope:.4} with {components} components"))
            .expected("a + r i_out > 0 without load and over the measured load currents");
        let hint = "a larger duty must raise the voltage: look for swapped columns, a wrong unit or bad points";
        return Err(Fault::from(message.hint(hint)).into());
    }
    let left_out = validation::leave_one_out(model, points, components);
    let rows: Vec<Row> = points
        .iter()
        .zip(&left_out.errors_v)
        .map(|(point, left_out_v)| Row {
            point: *point,
            d_sim: point.d_sim(),
            d_mapped: map.apply(point.d_sim(), point.i_out),
            without_v: point.without_v(),
            with_v: error_v(&map, point, model.load_line),
            left_out_v: *left_out_v,
        })
        .collect();
    Ok(Fit {
        form: model.form,
        map,
        standard_errors: validation::standard_errors(&left_out),
        components,
        components_v,
        without: errors(rows.iter().map(|row| (row.point.line, row.without_v))),
        with: errors(rows.iter().map(|row| (row.point.line, row.with_v))),
        left_out: errors(rows.iter().map(|row| (row.point.line, row.left_out_v))),
        rows,
        separation,
    })
}

/// Sums up errors, each with its line.
pub(crate) fn errors(list: impl Iterator<Item = (usize, f64)>) -> Errors {
    let (lines, values): (Vec<usize>, Vec<f64>) = list.unzip();
    let worst = (0..values.len()).max_by(|&k, &l| values[k].abs().total_cmp(&values[l].abs()));
    Errors {
        mean_v: values.iter().sum::<f64>() / values.len().max(1) as f64,
        rms_v: rms(&values),
        max_v: worst.map_or(0.0, |k| values[k].abs()),
        max_line: worst.map_or(0, |k| lines[k]),
    }
}

/// What a reader must know before using the mapping.
fn remarks(fit: &Fit, points: &[Point], options: &FitOptions, notes: &mut Vec<String>) {
    notes.extend(fit.separation.findings.iter().cloned());
    if let Some(a) = options.assumed_a {
        notes.push(format!("a = {a} is assumed, not measured"));
    }
    notes.push(simulated_by(points));
    let map = &fit.map;
    let corners = match separation::is_constant_load(points) {
        // what holds at one current has no corners
        true => Vec::new(),
        false => separation::unmeasured_corners(points, map.valid_i_out, map.valid_d_sim),
    };
    for corner in corners {
        notes.push(format!(
            "no point near the corner of the valid range with {corner}: the mapping is extended there"
        ));
    }
    let range = map.duty_range();
    if range.low < 0.0 || range.high > 1.0 {
        notes.push(format!(
            "within the valid range the mapped duty goes from {:.4} to {:.4}: it is cut off at the controller's limits",
            range.low, range.high
        ));
    }
}

/// What d_sim is here.
fn simulated_by(points: &[Point]) -> String {
    let v_in = hull(points.iter().map(|p| p.v_in));
    let v_sim = hull(points.iter().map(|p| p.simulation.v_in));
    if points.iter().any(|p| !p.simulation.is_none()) {
        return format!(
            "d_sim is the duty that the nominal converter needs, {} V and its losses: the mapping holds what the real one \
             loses beyond them",
            v_sim.low
        );
    }
    if v_sim.low == v_sim.high && v_sim.low != v_in.low {
        return format!("d_sim = v_out / {} V, the input voltage of the simulation", v_sim.low);
    }
    // a controller that does not divide misses by 0.2 V at 100 V, less than the 0.3 V that the paper's policy may leave
    if v_in.high - v_in.low > 2e-3 * v_in.high {
        return format!(
            "v_in goes from {:.2} to {:.2} V and is divided out (d_sim = v_out / v_in): a controller does not do so; with \
             --v-in-sim, the input voltage the policy was trained on, the mapping carries it",
            v_in.low, v_in.high
        );
    }
    format!(
        "d_sim = v_out / v_in with v_in about {:.2} V: right for a policy trained on that input voltage; else give it with \
         --v-in-sim",
        v_in.high
    )
}
