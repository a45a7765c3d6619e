//! `policyc drm judge`

use drm::DutyRatioMap;
use drm::formula::Losses;
use drm::judge::{Judgement, Steady};
use plant::Parameters;
use serde::Serialize;
use toml_input::Message;

use crate::arguments::drm::Judge;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

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
        output::say_json(&answer)?;
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
    let (real, nominal) = (
        Parameters::buck_from_file(real, "`drm judge`")?,
        Parameters::buck_from_file(nominal, "`drm judge`")?,
    );
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
