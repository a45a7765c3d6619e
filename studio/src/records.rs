//! The diagnosis of records.

use std::path::Path;

use diagnose::diagnosis::diagnose as examined;
use diagnose::progress::Progress;
use diagnose::record::open_all;
use diagnose::results::{self, Asked};
use measured::ColumnMap;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::{Faults, FileName};

use crate::loops::plant_of;
use crate::session::{Reply, Session, Tell, read, texts};

/// What `policyc diagnose` is told.
#[derive(Deserialize)]
struct Wanted {
    /// The plant's file.
    model: String,
    /// Records that are fitted.
    train: Vec<String>,
    /// Records that judge.
    #[serde(default)]
    heldout: Vec<String>,
    /// A column map.
    columns: Option<String>,
    /// A map as on the command line: `duty=D,v_out=U*0.1`.
    #[serde(default)]
    map: String,
}

#[derive(Serialize)]
struct Diagnosed {
    verdict: &'static str,
    sentence: String,
    /// What the command says, line by line.
    lines: Vec<String>,
}

/// What `policyc diagnose` writes and says.
pub(crate) fn diagnose(session: &Session, request: &Value, tell: Tell) -> Result<Reply, Faults> {
    let wanted = read::<Wanted>(request)?;
    let columns = wanted
        .columns
        .as_deref()
        .map(|file| ColumnMap::open(session.named(file)));
    let columns = columns.unwrap_or_else(|| Ok(ColumnMap::default()))?;
    let columns = columns.and(ColumnMap::parse(&wanted.map)?)?;
    let model = plant_of(session, &wanted.model, "`diagnose`")?;
    let named = |files: &[String]| files.iter().map(|file| session.named(file)).collect::<Vec<FileName>>();
    let (train, heldout) = open_all(&named(&wanted.train), &named(&wanted.heldout), &columns, &model)?;
    let say = |what: Progress<'_>| match what {
        Progress::Stage(stage) => tell(stage),
        Progress::Done { done, total } => tell(&format!("{done} of {total}")),
        Progress::Noticed(words) => tell(words),
    };
    let mut diagnosis = examined(&model, train, &heldout, &say);
    diagnosis.keep_text(&session.named(&wanted.model));
    let paths: Vec<&Path> = wanted.train.iter().chain(&wanted.heldout).map(Path::new).collect();
    let answer = Diagnosed {
        verdict: diagnosis.findings.verdict.word(),
        sentence: diagnosis.findings.sentence.clone(),
        lines: results::answer(&columns, &paths, &diagnosis.findings),
    };
    let asked = Asked {
        model: wanted.model.clone(),
        train: wanted.train.clone(),
        heldout: wanted.heldout.clone(),
        map: Some(wanted.map.clone())
            .filter(|map| !map.is_empty())
            .into_iter()
            .collect(),
        others: wanted.columns.iter().map(|file| ("--columns", file.clone())).collect(),
    };
    Reply::with(&answer, texts(results::files_of(&diagnosis, &asked)?))
}
