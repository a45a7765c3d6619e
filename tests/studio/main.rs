//! The page of `policyc studio` in a browser, against the command: the same code, trajectories, diagnosis and faults.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use serde_json::Value;
use tests::browser::Browser;
use tests::root;
use tests::tools::{policyc, run};

/// Ten times what it takes on two cores.
const PATIENCE: Duration = Duration::from_secs(300);

/// The page that `cargo xtask studio` has made; none where WebAssembly cannot be built.
fn built() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("studio");
    let made = folder.join("simulate.wasm").is_file();
    if !made {
        eprintln!("no page of the studio (`cargo xtask studio`): NOT tested");
    }
    made.then_some(folder)
}

/// [`built`], where a browser shows it.
fn page() -> Option<PathBuf> {
    let folder = built()?;
    let is_there = Browser::is_there();
    if !is_there {
        eprintln!("no chromium that starts: the page of the studio is NOT tested");
    }
    is_there.then_some(folder)
}

/// A server of a folder, which ends with the test.
struct Server(Child, String);

impl Server {
    fn of(folder: &Path) -> Self {
        let mut command = Command::new(policyc());
        command.arg("studio").arg("--from").arg(folder).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap())
            .read_line(&mut line)
            .unwrap();
        let address = line.split_whitespace().nth(1).unwrap().to_owned();
        Server(child, address)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        match path.is_dir() {
            true => copy(&path, &target),
            false => drop(std::fs::copy(&path, target).unwrap()),
        }
    }
}

/// What the command writes to know its own files again; a download has none.
const RECORD: &str = "policyc-files.json";

/// Digests of the files in a folder, without the [`RECORD`].
fn digests(folder: &Path) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name != RECORD {
            found.insert(name, policy::sha256(&std::fs::read(&path).unwrap()));
        }
    }
    found
}

fn listed(value: &Value) -> BTreeMap<String, String> {
    serde_json::from_value(value.clone()).unwrap()
}

fn command(arguments: &[&str]) -> tests::tools::Ran {
    run(Command::new(policyc())
        .current_dir(root().join("examples"))
        .args(arguments))
}

/// What the page makes of every example, by the script of the test.
fn made_by_the_page(folder: &Path, temporary: &Path) -> Value {
    let site = temporary.join("site");
    copy(folder, &site);
    for (name, text) in [
        ("test.html", include_str!("test.html")),
        ("test.js", include_str!("test.js")),
    ] {
        std::fs::write(site.join(name), text).unwrap();
    }
    let server = Server::of(&site);
    let mut browser = Browser::start(&temporary.join("profile"));
    let address = format!("{}test.html", server.1);
    browser.ask("Page.navigate", serde_json::json!({ "url": address }));
    let found = browser.value("window.found", PATIENCE);
    let found: Value = serde_json::from_str(found.as_str().unwrap()).unwrap();
    assert!(found["error"].is_null(), "{}", found["error"]);
    found
}

fn the_same_code(contract: &str, page: &Value, folder: &str) {
    assert_eq!(page["faults"], serde_json::json!([null, null, null]), "{contract}");
    let emit = ["--no-costs", "--emit", "c,rust,kit,sfunction", "--out", folder];
    let ran = command(&[&["compile", contract, "--allow-outside"][..], &emit].concat());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert_eq!(listed(&page["code"]), digests(Path::new(folder)), "{contract}");
    let inspected = command(&["inspect", contract, "--allow-outside"]);
    assert_eq!(page["inspect"].as_str().unwrap(), inspected.stdout, "{contract}");
}

fn the_same_loop(contract: &str, page: &Value, scenario: &Value, file: &str, folder: &str) {
    // the plant is named by the same path in both, as pages show it
    let plant = root().join("examples").join(page["plant"].as_str().unwrap());
    let plant = plant.display().to_string();
    let text = format!("plant = {plant:?}\n{}", scenario.as_str().unwrap());
    std::fs::write(file, text).unwrap();
    let policy = ["--policy", contract, "--allow-outside", "--out", folder];
    let ran = command(&[&["simulate", file][..], &policy].concat());
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let shows_path = |name: &str| ["summary.txt", "report.html"].contains(&name);
    let alike = |files: BTreeMap<String, String>| {
        let files = files.into_iter().filter(|(name, _)| !shows_path(name));
        files.collect::<Vec<_>>()
    };
    let written = alike(digests(Path::new(folder)));
    assert!(written.len() >= 8, "{written:?}");
    assert_eq!(alike(listed(&page["loop"])), written, "{contract}");
}

fn the_same_diagnosis(page: &Value, folder: &str) {
    let record = "diagnose/records/nothing-wrong.csv";
    let arguments = ["diagnose", "--model", "blind/plant.toml", "--train", record];
    let ran = command(&[&arguments[..], &["--out", folder]].concat());
    let verdict = format!("verdict: {}\n", page["verdict"].as_str().unwrap());
    assert!(ran.stdout.starts_with(&verdict), "{}", ran.stdout);
    assert_eq!(listed(&page["made"]), digests(Path::new(folder)));
}

/// A planted fault, with the command's text.
fn the_same_faults(page: &Value, temporary: &Path) {
    let broken = temporary.join("buck12");
    copy(&root().join("examples/buck12"), &broken);
    let contract = broken.join("policy.toml");
    let text = std::fs::read_to_string(&contract).unwrap();
    std::fs::write(&contract, text.replace("sample_period", "sample_perod")).unwrap();
    let mut inspect = Command::new(policyc());
    inspect.current_dir(temporary).args(["inspect", "buck12/policy.toml"]);
    let ran = run(&mut inspect);
    let texts = page.as_array().unwrap().iter().filter_map(Value::as_str);
    assert_eq!(texts.collect::<Vec<_>>().join("\n\n") + "\n", ran.stderr);
}

#[test]
fn the_page_makes_of_every_example_what_the_command_makes() {
    let Some(folder) = page() else { return };
    let temporary = tempfile::tempdir().unwrap();
    let found = made_by_the_page(&folder, temporary.path());
    let policies = found["policies"].as_object().unwrap();
    assert_eq!(policies.len(), 4);
    let out = |name: &str| temporary.path().join(name).display().to_string();
    for (index, (contract, page)) in policies.iter().enumerate() {
        the_same_code(contract, page, &out(&format!("code-{index}")));
        let [file, folder] = [format!("scenario-{index}.toml"), format!("loop-{index}")].map(|name| out(&name));
        the_same_loop(contract, page, &found["scenario"], &file, &folder);
    }
    the_same_diagnosis(&found["diagnosis"], &out("diagnosis"));
    the_same_faults(&found["faults"], temporary.path());
}

/// Most that a visitor may load before anything is shown, in bytes, compressed as most servers do: a second over 7 Mbit/s.
const FIRST_LOAD: usize = 900_000;

#[test]
fn what_a_visitor_loads_first_is_within_its_aim() {
    let Some(folder) = built() else { return };
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let later = ["code.wasm", "records.wasm", "simulate.wasm"];
    let first = files.filter(|path| path.is_file() && !later.iter().any(|name| path.ends_with(name)));
    let compressed = |path: PathBuf| {
        let packed = Command::new("gzip").arg("-9c").arg(&path).output().unwrap();
        assert!(packed.status.success(), "{}", path.display());
        packed.stdout.len()
    };
    let bytes: usize = first.map(compressed).sum();
    assert!((100_000..FIRST_LOAD).contains(&bytes), "{bytes} bytes");
}

#[test]
fn the_page_opens_an_example_and_shows_its_loop() {
    let Some(folder) = page() else { return };
    let temporary = tempfile::tempdir().unwrap();
    let server = Server::of(&folder);
    let mut browser = Browser::start(temporary.path());
    let address = format!("{}#loop", server.1);
    browser.ask("Page.navigate", serde_json::json!({ "url": address }));
    browser.value(
        "document.getElementById('status')?.textContent.startsWith('Ready')",
        PATIENCE,
    );
    let pick =
        "{ const e = document.getElementById('examples'); e.value = '0'; e.dispatchEvent(new Event('change')); true }";
    browser.value(pick, PATIENCE);
    let curves = browser.value("document.querySelectorAll('#loop .curve').length || null", PATIENCE);
    assert_eq!(curves.as_u64(), Some(6), "policy and PID in three panels");
    let width = browser.value(
        "document.documentElement.scrollWidth - document.documentElement.clientWidth + 1",
        PATIENCE,
    );
    assert_eq!(width.as_i64(), Some(1), "nothing sticks out");
}

/// What stable-baselines3 saved, dropped into the page: a contract to fill in, with its weights.
#[test]
fn a_model_of_a_trainer_is_dropped_and_becomes_a_contract() {
    let Some(folder) = page() else { return };
    let temporary = tempfile::tempdir().unwrap();
    let site = temporary.path().join("site");
    copy(&folder, &site);
    for name in ["sb3_dqn.zip", "gemm.onnx"] {
        let model = root().join("tests/fixtures/trainers").join(name);
        std::fs::copy(model, site.join("examples").join(name)).unwrap();
    }
    let server = Server::of(&site);
    let mut browser = Browser::start(&temporary.path().join("profile"));
    for name in ["sb3_dqn.zip", "gemm.onnx"] {
        browser.ask(
            "Page.navigate",
            serde_json::json!({ "url": format!("{}?{name}#contract", server.1) }),
        );
        let ready = format!(
            "location.search === '?{name}' && document.getElementById('status')?.textContent.startsWith('Ready')"
        );
        browser.value(&ready, PATIENCE);
        let drop = format!(
            "fetch('examples/{name}').then((answer) => answer.blob()).then((blob) => {{ const data = new DataTransfer(); \
             data.items.add(new File([blob], '{name}')); \
             document.documentElement.dispatchEvent(new DragEvent('drop', {{ dataTransfer: data, bubbles: true, cancelable: true }})); return true; }})"
        );
        browser.value(&drop, PATIENCE);
        let contract = browser.value("document.getElementById('edit').value || null", PATIENCE);
        assert!(contract.as_str().unwrap().contains("[network]"), "{name}: {contract}");
    }
}

#[test]
fn the_views_are_reached_by_keys() {
    let Some(folder) = page() else { return };
    let temporary = tempfile::tempdir().unwrap();
    let server = Server::of(&folder);
    let mut browser = Browser::start(temporary.path());
    browser.ask(
        "Page.navigate",
        serde_json::json!({ "url": format!("{}#contract", server.1) }),
    );
    browser.value(
        "document.getElementById('status')?.textContent.startsWith('Ready')",
        PATIENCE,
    );
    browser.value("{ document.getElementById('tab-contract').focus(); true }", PATIENCE);
    for (key, view) in [
        ("ArrowRight", "code"),
        ("End", "records"),
        ("ArrowRight", "contract"),
        ("ArrowLeft", "records"),
        ("Home", "contract"),
    ] {
        for kind in ["keyDown", "keyUp"] {
            browser.ask(
                "Input.dispatchKeyEvent",
                serde_json::json!({ "type": kind, "key": key, "code": key }),
            );
        }
        let shown = format!(
            "document.activeElement.id === 'tab-{view}' && !document.getElementById('panel-{view}').hidden && location.hash === '#{view}'"
        );
        browser.value(&shown, PATIENCE);
    }
}
