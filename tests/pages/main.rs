//! Every page that the command makes, in Chromium: readable on a phone, in the dark, by a screen reader and on paper, and its charts answer.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod charts;
mod kinds;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use serde_json::{Value, json};
use tests::browser::Browser;

const PATIENCE: Duration = Duration::from_secs(60);
/// Bytes of a page at most: it is sent by mail and opened on a phone.
const HEAVIEST: usize = 400_000;
/// Printed sheets at most, A4.
const MOST_SHEETS: usize = 4;
/// A small telephone and a small notebook.
const WIDTHS: [u32; 2] = [390, 1280];
const LOOK: &str = include_str!("look.js");

/// One browser at a time: two cores are enough for one.
static ALONE: Mutex<()> = Mutex::new(());

/// Chromium, if it starts here.
fn is_there(what: &str) -> bool {
    let is_there = Browser::is_there();
    if !is_there {
        eprintln!("no chromium that starts: {what} NOT tested");
    }
    is_there
}

/// The rules of axe-core, which `cargo xtask setup` gets; without them the accessibility of the pages is not tested.
fn rules() -> Option<String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("npm");
    let text = std::fs::read_to_string(folder.join("node_modules/axe-core/axe.min.js")).ok();
    if text.is_none() {
        eprintln!("no axe-core (`cargo xtask setup`): the accessibility of the pages is NOT tested");
    }
    text
}

fn open(browser: &mut Browser, page: &Path, width: u32, is_dark: bool) {
    let size = json!({"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 600});
    browser.ask("Emulation.setDeviceMetricsOverride", size);
    let scheme = if is_dark { "dark" } else { "light" };
    let scheme = json!({"features": [{"name": "prefers-color-scheme", "value": scheme}]});
    browser.ask("Emulation.setEmulatedMedia", scheme);
    let address = format!("file://{}", page.display());
    browser.ask("Page.navigate", json!({ "url": address }));
    let drawn = "document.readyState === 'complete' && location.protocol === 'file:' \
                 && document.querySelectorAll('figure.data:not(.answers)').length === 0 && 'drawn'";
    browser.value(drawn, PATIENCE);
}

/// What is wrong with a page as it is shown.
fn faults(browser: &mut Browser, rules: Option<&str>) -> Vec<String> {
    let found = browser.value(LOOK, PATIENCE);
    let mut found: Vec<String> = serde_json::from_str(found.as_str().unwrap()).unwrap();
    if let Some(rules) = rules {
        browser.ask("Runtime.evaluate", json!({ "expression": rules }));
        let run = "axe.run(document, { resultTypes: ['violations'] }).then(({ violations }) => JSON.stringify(violations\
                   .filter(({ impact }) => ['serious', 'critical'].includes(impact))\
                   .map(({ id, nodes }) => `${id}: ${nodes[0].html.slice(0, 150)}`)))";
        let against = browser.value(run, PATIENCE);
        found.extend(serde_json::from_str::<Vec<String>>(against.as_str().unwrap()).unwrap());
    }
    found
}

/// Sheets of A4 that a page fills in print.
fn sheets(browser: &mut Browser) -> usize {
    browser.ask("Emulation.clearDeviceMetricsOverride", json!({}));
    let paper = json!({"paperWidth": 8.27, "paperHeight": 11.69, "preferCSSPageSize": true});
    let printed = browser.ask("Page.printToPDF", paper);
    let pdf = decoded(printed["data"].as_str().unwrap());
    // pages are objects of their own, in plain text; `/Pages` is the list of them
    let text = String::from_utf8_lossy(&pdf);
    text.match_indices("/Type /Page")
        .filter(|(at, _)| !text[at + 11..].starts_with('s'))
        .count()
}

/// Base64 (RFC 4648, section 4).
fn decoded(text: &str) -> Vec<u8> {
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bytes, mut held, mut count) = (Vec::new(), 0_u32, 0);
    for byte in text.trim_end_matches('=').bytes() {
        let six = letters.iter().position(|letter| *letter == byte).unwrap() as u32;
        (held, count) = (held << 6 | six, count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((held >> count & 255) as u8);
        }
    }
    bytes
}

#[test]
fn every_page_can_be_read_on_a_phone_in_the_dark_by_a_screen_reader_and_on_paper() {
    if !is_there("every page") {
        return;
    }
    let _alone = ALONE.lock();
    let rules = rules();
    let temporary = tempfile::tempdir().unwrap();
    let pages = kinds::all(temporary.path());
    let mut browser = Browser::start(&temporary.path().join("profile"));
    let mut wrong = Vec::new();
    for (name, page) in &pages {
        let weight = std::fs::metadata(page).unwrap().len() as usize;
        if weight > HEAVIEST {
            wrong.push(format!("{name}: {weight} bytes"));
        }
        for width in WIDTHS {
            for is_dark in [false, true] {
                open(&mut browser, page, width, is_dark);
                let found = faults(&mut browser, rules.as_deref());
                wrong.extend(
                    found
                        .iter()
                        .map(|fault| format!("{name} at {width}, dark {is_dark}: {fault}")),
                );
            }
        }
        let sheets = sheets(&mut browser);
        if !(1..=MOST_SHEETS).contains(&sheets) {
            wrong.push(format!("{name}: {sheets} printed sheets"));
        }
        let text = std::fs::read_to_string(page).unwrap();
        if let Some(at) = text.find(&temporary.path().display().to_string()) {
            wrong.push(format!(
                "{name} names this machine: {}",
                &text[at..(at + 80).min(text.len())]
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Each check sees the fault that it is for.
#[test]
fn planted_faults_of_a_page_are_found() {
    if !is_there("what is looked for in pages") {
        return;
    }
    let _alone = ALONE.lock();
    let temporary = tempfile::tempdir().unwrap();
    let page = temporary.path().join("planted.html");
    let text = "<!DOCTYPE html><html lang=\"en\"><head><title>p</title></head><body><main><h1>p</h1>\
                <div style=\"width: 2000px\">wide</div><p style=\"color: #ccc; background: #fff\">pale</p>\
                <svg role=\"img\" aria-label=\"words alone\" viewBox=\"0 0 900 100\" width=\"300\" height=\"33\">\
                <text x=\"10\" y=\"50\" font-size=\"12\">small</text><text x=\"880\" y=\"50\" font-size=\"60\">cut off</text></svg>\
                <div style=\"height: 20000px\"></div><div>far</div></main></body></html>";
    std::fs::write(&page, text).unwrap();
    let mut browser = Browser::start(&temporary.path().join("profile"));
    open(&mut browser, &page, 390, false);
    let rules = rules();
    let found = faults(&mut browser, rules.as_deref()).join("\n");
    let mut expected = vec![
        "sticks out",
        "letters of 4.0 pixels: small",
        "cut: cut off",
        "without a number in words",
    ];
    expected.extend(rules.map(|_| "color-contrast"));
    for words in expected {
        assert!(found.contains(words), "{words} in {found}");
    }
    assert!(sheets(&mut browser) > MOST_SHEETS);
}

/// A page of a kind, for the tests of its charts.
fn page_of(kind: &str, folder: &Path) -> PathBuf {
    let pages = kinds::of(folder, &[kind]);
    pages.into_iter().next().unwrap().1
}

/// The value of an expression that is a text.
fn text(browser: &mut Browser, expression: &str) -> String {
    match browser.value(expression, PATIENCE) {
        Value::String(text) => text,
        other => panic!("{expression} is {other}"),
    }
}
