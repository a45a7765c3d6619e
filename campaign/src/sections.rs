//! The sections of a plan: what each is multiplied over, and the command lines that come of it.

use toml_input::{Document, FileName, Message, Place, Sink, Table, Value, messages};

use crate::inputs::named_in_plan;
use crate::kind::Kind;
use crate::plan::MOST_TASKS;
use crate::seeds;
use crate::task::Axis;

/// A word of a command line.
#[derive(Debug, Clone)]
pub(crate) enum Word {
    Text(String),
    /// Stands for the path that the file will have in the folder of the task.
    File(FileName),
}

impl Word {
    pub(crate) fn file(&self) -> Option<&FileName> {
        match self {
            Self::File(file) => Some(file),
            Self::Text(_) => None,
        }
    }
}

/// A task whose files have not been read.
#[derive(Debug, Clone)]
pub(crate) struct Draft {
    pub kind: Kind,
    pub axes: Vec<(String, Axis)>,
    pub words: Vec<Word>,
    pub place: Place,
}

/// A value of an axis.
struct Choice {
    axis: Option<(String, Axis)>,
    words: Vec<Word>,
}

/// A file as the plan calls it, and itself.
#[derive(Clone)]
struct Named {
    label: String,
    file: FileName,
}

struct Section<'t, 'a, 'f> {
    kind: Kind,
    table: &'t mut Table<'a>,
    plan: &'f FileName,
    faults: &'f mut Sink,
    /// The product of all choices so far.
    drafts: Vec<Draft>,
}

/// The tasks of a section; nothing if a required key is missing.
pub(crate) fn read(kind: Kind, table: &mut Table<'_>, plan: &FileName, faults: &mut Sink) -> Option<Vec<Draft>> {
    let place = table.fault(Message::new("")).place;
    let first = Draft {
        kind,
        axes: Vec::new(),
        words: vec![Word::Text(kind.name().to_owned())],
        place,
    };
    let mut section = Section {
        kind,
        table,
        plan,
        faults,
        drafts: vec![first],
    };
    // all keys are asked for, whatever is missing: what was not asked for counts as unknown
    match kind {
        Kind::Train => section.train(),
        Kind::Simulate => section.simulate(),
        Kind::Verify => section.verify(),
        Kind::Certify => section.certify(),
        Kind::Diagnose => section.diagnose(),
        Kind::Prove => section.prove(),
    }
    Some(section.drafts)
}

impl Section<'_, '_, '_> {
    fn train(&mut self) {
        let settings = self.files("settings", Some("training files: `settings = \"train.toml\"`"));
        let seeds = self.table.optional("seeds");
        let seeds = seeds.map(|value| seeds::read(&value, self.faults).unwrap_or_default());
        let mut all = Vec::new();
        for named in &settings {
            // a training of several seeds is a task for each: a lost machine costs one seed
            let own = seeds.clone().unwrap_or_else(|| seeds_of(&named.file));
            let with = |seed: &u64| {
                let mut choice = vec![Word::File(named.file.clone())];
                choice.extend(texts(["--seeds", &seed.to_string()]));
                let axes = [
                    ("settings", Axis::Text(named.label.clone())),
                    ("seed", Axis::Number(*seed)),
                ];
                (axes, choice)
            };
            if !self.fits(all.len().saturating_add(own.len())) {
                return;
            }
            all.extend(own.iter().map(with));
        }
        let drafts = all.into_iter().flat_map(|(axes, words)| {
            self.drafts.iter().map(move |draft| {
                let mut draft = draft.clone();
                draft
                    .axes
                    .extend(axes.clone().map(|(name, axis)| (name.to_owned(), axis)));
                draft.words.extend(words.clone());
                draft
            })
        });
        self.drafts = drafts.collect();
        self.always(["--threads", "1", "--json", "--quiet", "--out", "out"]);
    }

    fn simulate(&mut self) {
        let hint = "scenario files: `scenarios = \"scenario.toml\"`";
        self.over_files("scenarios", "scenario", None, Some(hint));
        self.over_policies();
        self.over_files("plants", "plant", Some("--plant"), None);
        self.over_formats();
        self.word("controller", "--controller");
        self.flag("check", "--check");
        self.outside();
        self.always(["--quiet", "--out", "out"]);
    }

    fn verify(&mut self) {
        self.over_policies();
        self.over_formats();
        self.over_words("targets", "target", "--target");
        let steps = self.number("steps", 1, i64::MAX as u64).unwrap_or(20_000);
        let shards = self.number("shards", 1, 10_000).unwrap_or(1);
        let seed = self.number("seed", 0, i64::MAX as u64 / 2).unwrap_or(1);
        let codes = self
            .table
            .with_default("codes", false, self.faults, |v, faults| v.boolean(faults));
        for trace in self.files("traces", None) {
            self.words(vec![Word::Text("--trace".to_owned()), Word::File(trace.file)]);
        }
        self.word("map", "--map");
        if !codes && shards > steps {
            let message = Message::new("more shards than steps");
            let message = message
                .found(format!("shards {shards}, steps {steps}"))
                .expected("shards <= steps");
            self.faults.push(self.table.fault(message));
        }
        let shard = |number: u64| {
            let words = match codes {
                true => texts(["--codes", "--shard", &format!("{number}/{shards}"), "--out", "out"]),
                false => {
                    // each its own stream; the first ones take what does not divide
                    let own = steps / shards + u64::from(number <= steps % shards);
                    texts(["--steps", &own.to_string(), "--seed", &(seed + number - 1).to_string()])
                }
            };
            Choice {
                axis: (shards > 1).then(|| ("shard".to_owned(), Axis::Number(number))),
                words,
            }
        };
        self.over((1..=shards).map(shard).collect());
        self.outside();
        self.always(["--json", "--quiet"]);
    }

    fn certify(&mut self) {
        self.over_policies();
        self.over_formats();
        let boxes = self.table.optional("boxes");
        let boxes = boxes.and_then(|value| seeds::numbers(&value, "one or several numbers of boxes", self.faults));
        if let Some(boxes) = boxes {
            let choice = |boxes: u64| Choice {
                axis: Some(("boxes".to_owned(), Axis::Number(boxes))),
                words: texts(["--boxes", &boxes.to_string()]),
            };
            self.over(boxes.into_iter().map(choice).collect());
        }
        for (key, most) in [("samples", 1_000_000), ("seed", i64::MAX as u64)] {
            if let Some(number) = self.number(key, 0, most) {
                self.words(texts([&format!("--{key}"), &number.to_string()]));
            }
        }
        self.outside();
        self.always(["--quiet", "--out", "out"]);
    }

    fn diagnose(&mut self) {
        let hint = "plant files: `models = \"plant.toml\"`";
        self.over_files("models", "model", Some("--model"), Some(hint));
        let train = self.files("train", Some("measured records: `train = [\"bench.csv\"]`"));
        let heldout = self.files("heldout", None);
        let case = self.table.optional("name").and_then(|value| value.text(self.faults));
        let case = case
            .map(str::to_owned)
            .or(train.first().map(|named| named.label.clone()));
        self.over(vec![Choice {
            axis: case.map(|case| ("case".to_owned(), Axis::Text(case))),
            words: listed("--train", &train),
        }]);
        self.words(listed("--heldout", &heldout));
        for (key, option) in [
            ("policy", "--policy"),
            ("scenario", "--scenario"),
            ("trained_on", "--trained-on"),
            ("columns", "--columns"),
        ] {
            let one = self.files(key, None);
            self.words(listed(option, &one));
        }
        self.word("map", "--map");
        self.flag("settled", "--settled");
        self.outside();
        self.always(["--quiet", "--out", "out"]);
    }

    fn prove(&mut self) {
        self.over_policies();
        self.over_formats();
        self.over_words("targets", "target", "--target");
        self.flag("exhaustive", "--exhaustive");
        self.outside();
        self.always(["--quiet", "--out", "out"]);
    }

    fn over_policies(&mut self) {
        let hint = "contracts or the folders that hold them: `policies = [\"buck12\"]`";
        self.over_files(
            "policies",
            "policy",
            (self.kind == Kind::Simulate).then_some("--policy"),
            Some(hint),
        );
    }

    fn over_formats(&mut self) {
        self.over_words("formats", "format", "--format");
    }

    /// Multiplies by the files of a key. `hint`: it must be there.
    fn over_files(&mut self, key: &'static str, axis: &str, option: Option<&str>, hint: Option<&str>) {
        let files = self.files(key, hint);
        if files.is_empty() && hint.is_none() {
            return;
        }
        let choice = |named: Named| {
            let mut words: Vec<Word> = option.map(|option| Word::Text(option.to_owned())).into_iter().collect();
            words.push(Word::File(named.file));
            Choice {
                axis: Some((axis.to_owned(), Axis::Text(named.label))),
                words,
            }
        };
        self.over(files.into_iter().map(choice).collect());
    }

    /// Multiplies by the words of a key, if it is there.
    fn over_words(&mut self, key: &'static str, axis: &str, option: &str) {
        let Some(value) = self.table.optional(key) else { return };
        let words = several(&value, "one or several texts", self.faults, |value, faults| {
            value.text(faults).map(str::to_owned)
        });
        let choice = |word: String| Choice {
            words: texts([option, &word]),
            axis: Some((axis.to_owned(), Axis::Text(word))),
        };
        self.over(words.into_iter().map(choice).collect());
    }

    /// Whether so many tasks can be made at all; said before they are.
    fn fits(&mut self, count: usize) -> bool {
        if count > MOST_TASKS {
            let message = messages::count("tasks", count, 1, MOST_TASKS);
            self.faults.push(self.table.fault(message));
        }
        count <= MOST_TASKS
    }

    fn over(&mut self, choices: Vec<Choice>) {
        if !self.fits(self.drafts.len().saturating_mul(choices.len())) {
            // what is read on is only for its own faults
            self.drafts.truncate(1);
            return;
        }
        let mut drafts = Vec::new();
        for draft in &self.drafts {
            for choice in &choices {
                let mut draft = draft.clone();
                draft.axes.extend(choice.axis.clone());
                draft.words.extend(choice.words.clone());
                drafts.push(draft);
            }
        }
        self.drafts = drafts;
    }

    fn files(&mut self, key: &'static str, hint: Option<&str>) -> Vec<Named> {
        let value = match hint {
            Some(hint) => self.table.required(key, hint, self.faults),
            None => self.table.optional(key),
        };
        let Some(value) = value else { return Vec::new() };
        several(&value, "one or several paths", self.faults, |value, faults| {
            let text = value.text(faults)?;
            let found = named_in_plan(self.plan, text).map_err(|message| value.fault(message));
            let label = text.trim_end_matches('/').to_owned();
            faults.keep(found).map(|file| Named { label, file })
        })
    }

    fn number(&mut self, key: &'static str, least: u64, most: u64) -> Option<u64> {
        let value = self.table.optional(key)?;
        value.integer(least..=most, self.faults)
    }

    fn word(&mut self, key: &'static str, option: &str) {
        let word = self.table.optional(key).and_then(|value| value.text(self.faults));
        if let Some(word) = word {
            self.words(texts([option, word]));
        }
    }

    fn flag(&mut self, key: &'static str, option: &str) {
        if self
            .table
            .with_default(key, false, self.faults, |value, faults| value.boolean(faults))
        {
            self.words(texts([option]));
        }
    }

    fn outside(&mut self) {
        self.flag("allow_outside", "--allow-outside");
    }

    fn words(&mut self, words: Vec<Word>) {
        let axis = None;
        self.over(vec![Choice { axis, words }]);
    }

    fn always<const N: usize>(&mut self, words: [&str; N]) {
        self.words(texts(words));
    }
}

fn texts<const N: usize>(words: [&str; N]) -> Vec<Word> {
    words.map(|word| Word::Text(word.to_owned())).into()
}

/// An option and its files; nothing without files.
fn listed(option: &str, files: &[Named]) -> Vec<Word> {
    let option = (!files.is_empty()).then(|| Word::Text(option.to_owned()));
    let files = files.iter().map(|named| Word::File(named.file.clone()));
    option.into_iter().chain(files).collect()
}

/// What `read` makes of a value, or of each element of an array; an array of nothing is a fault.
fn several<T>(
    value: &Value<'_>,
    expected: &str,
    faults: &mut Sink,
    read: impl Fn(&Value<'_>, &mut Sink) -> Option<T>,
) -> Vec<T> {
    let Some(items) = value.as_list() else {
        return read(value, faults).into_iter().collect();
    };
    if items.is_empty() {
        faults.push(value.fault(Message::new(format!("`{}` is empty", value.label())).expected(expected)));
    }
    items.iter().filter_map(|item| read(item, faults)).collect()
}

/// The seeds of a training file; what is wrong with it is said when it is read as one.
fn seeds_of(file: &FileName) -> Vec<u64> {
    let document = Document::open(file.clone()).ok();
    let seeds = document.as_ref().and_then(|document| document.peek(&["seeds"]));
    let seeds = seeds.and_then(|value| seeds::numbers(&value, "", &mut Sink::new()));
    seeds.unwrap_or_else(|| vec![0])
}
