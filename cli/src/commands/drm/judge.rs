//! `policyc drm judge`

use std::path::PathBuf;

use clap::Args;
use drm::DutyRatioMap;
use drm::formula::Losses;
use drm::judge::{Judgement, Steady};
use policy::Interval;
use serde::Serialize;
use toml_input::Message;

use super::{Loads, Reading};
use crate::{Failure, Outcome, output};

#[derive(Debug, Args)]
pub struct Judge {
    /// Settled points as CSV with the columns duty (or d_real), v_out, i_out, v_in
    #[arg(required_unless_present = "plant")]
    pub table: Option<PathBuf>,
    /// The mapping
    #[arg(long, value_name = "FILE", default_value = "drm.toml")]
    pub mapping: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// Duty limits of the controller
    #[arg(long, value_name = "LOW,HIGH", value_parser = super::duty_limits)]
    pub duty_limits: Option<Interval>,
    /// The real converter, simulated
    #[arg(long, value_name = "FILE", requires_all = ["nominal", "v_ref"])]
    pub plant: Option<PathBuf>,
    /// The converter that the policy was trained on
    #[arg(long, value_name = "FILE", requires = "plant")]
    pub nominal: Option<PathBuf>,
    /// Wanted voltage in V
    #[arg(long, value_name = "V", requires = "plant")]
    pub v_ref: Option<f64>,
    #[command(flatten)]
    pub loads: Loads,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    #[serde(skip_serializing_if = "Option::is_none")]
    table: Option<Judgement>,
    #[serde(skip_serializing_if = "Option::is_none")]
    steady: Option<Vec<Steady>>,
    beyond_repair: Vec<String>,
}

/// Judges and reports.
pub fn run(options: &Judge) -> Result<Outcome, Failure> {
    let mapping = policy::load_mapping(&options.mapping)?;
    let map = DutyRatioMap::from(&mapping);
    let simulation = mapping.simulation.as_ref().map(Losses::from);
    let table = options
        .table
        .as_ref()
        .map(|path| options.reading.table(path, simulation))
        .transpose()?;
    let judgement = table.map(|table| drm::judge::judge(&table, &map, options.duty_limits));
    let steady = steady(options, &map)?;
    let v_ref = options.v_ref.unwrap_or_default();
    if options.json {
        let beyond_repair = steady.as_deref().map(|list| drm::judge::beyond_repair(list, v_ref));
        let answer = Answer {
            table: judgement,
            steady,
            beyond_repair: beyond_repair.unwrap_or_default(),
        };
        output::say(&serde_json::to_string_pretty(&answer)?)?;
        return Ok(Outcome::Done);
    }
    let mut parts = Vec::new();
    if let Some(judgement) = &judgement {
        parts.push(drm::judge::table_text(judgement)?);
    }
    if let Some(steady) = &steady {
        parts.push(drm::judge::steady_text(steady, v_ref)?);
    }
    output::say(parts.join("\n").trim_end())?;
    Ok(Outcome::Done)
}

fn steady(options: &Judge, map: &DutyRatioMap) -> Result<Option<Vec<Steady>>, Failure> {
    let (Some(real), Some(nominal), Some(v_ref)) = (&options.plant, &options.nominal, options.v_ref) else {
        return Ok(None);
    };
    let (real, nominal) = (super::plant_parameters(real)?, super::plant_parameters(nominal)?);
    if !(v_ref > 0.0 && v_ref < real.converter.v_in.min(nominal.converter.v_in)) {
        let message = Message::new("--v-ref is out of reach").found(format!("{v_ref} V"));
        return Err(message.expected("above 0 and below the input voltages").into());
    }
    let loads = options.loads.settings();
    if loads.is_empty() {
        let message = Message::new("no load");
        return Err(message.hint("give --powers, --currents or --resistors").into());
    }
    let limits = options.duty_limits;
    Ok(Some(drm::judge::against_plant(
        map, &real, &nominal, v_ref, &loads, limits,
    )?))
}
