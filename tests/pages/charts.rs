//! The charts answer a mouse, fingers and keys.

use serde_json::json;
use tests::browser::Browser;

use crate::{ALONE, PATIENCE, is_there, open, page_of, text};

/// What stands in the legend of the first chart.
const LEGEND: &str = "document.querySelector('.live table').innerText";
/// Its place on the screen: left, top, width, height.
const PLACE: &str = "{ const plot = document.querySelector('.u-over'); plot.scrollIntoView({ block: 'center' }); \
    const { x, y, width, height } = plot.getBoundingClientRect(); [x, y, width, height] }";

fn place(browser: &mut Browser) -> [f64; 4] {
    serde_json::from_value(browser.value(PLACE, PATIENCE)).unwrap()
}

fn mouse(browser: &mut Browser, kind: &str, x: f64, y: f64) {
    let pressed = u8::from(kind != "mouseMoved");
    let event = json!({"type": kind, "x": x, "y": y, "button": if pressed == 1 { "left" } else { "none" }, "clickCount": pressed});
    browser.ask("Input.dispatchMouseEvent", event);
}

fn fingers(browser: &mut Browser, kind: &str, at: &[(f64, f64)]) {
    let points: Vec<_> = at
        .iter()
        .enumerate()
        .map(|(id, (x, y))| json!({"x": x, "y": y, "id": id}))
        .collect();
    browser.ask("Input.dispatchTouchEvent", json!({"type": kind, "touchPoints": points}));
}

/// Waits until the legend is another one, and returns it.
fn other_than(browser: &mut Browser, before: &str) -> String {
    let quoted = serde_json::to_string(before).unwrap();
    text(browser, &format!("{LEGEND} !== {quoted} && {LEGEND}"))
}

fn shown(kind: &str, width: u32, act: impl FnOnce(&mut Browser)) {
    if !is_there("whether charts answer") {
        return;
    }
    let _alone = ALONE.lock();
    let temporary = tempfile::tempdir().unwrap();
    let page = page_of(kind, temporary.path());
    let mut browser = Browser::start(&temporary.path().join("profile"));
    open(&mut browser, &page, width, false);
    act(&mut browser);
}

#[test]
fn a_mouse_reads_values_in_all_panels_and_draws_a_stretch() {
    shown("diagnose: consistent", 1280, |browser| {
        let rest = text(browser, LEGEND);
        // at rest the legend has what the curves reach, and no empty table
        assert!(
            rest.contains("lowest … highest") && rest.matches('…').count() > 4,
            "{rest}"
        );
        let [x, y, wide, high] = place(browser);
        mouse(browser, "mouseMoved", x + wide / 2.0, y + high / 2.0);
        let read = other_than(browser, &rest);
        assert!(read.starts_with("time (ms) ") && !read.contains('…'), "{read}");
        mouse(browser, "mousePressed", x + 0.3 * wide, y + high / 2.0);
        mouse(browser, "mouseMoved", x + 0.4 * wide, y + high / 2.0);
        mouse(browser, "mouseReleased", x + 0.4 * wide, y + high / 2.0);
        mouse(browser, "mouseMoved", 2.0, 2.0);
        // what is reached in a tenth of the record is less than what is reached in all of it
        let stretch = text(browser, &format!("{LEGEND}.includes('lowest') && {LEGEND}"));
        assert_ne!(stretch, rest);
        browser.value(
            "{ document.querySelector('.tools button[aria-label=\"show the whole\"]').click(); true }",
            PATIENCE,
        );
        assert_eq!(other_than(browser, &stretch), rest);
    });
}

#[test]
fn fingers_read_values_and_zoom_on_a_phone() {
    shown("diagnose: consistent", 390, |browser| {
        browser.ask(
            "Emulation.setTouchEmulationEnabled",
            json!({"enabled": true, "maxTouchPoints": 2}),
        );
        let rest = text(browser, LEGEND);
        let [x, y, wide, high] = place(browser);
        let middle = y + high / 2.0;
        fingers(browser, "touchStart", &[(x + 0.5 * wide, middle)]);
        fingers(browser, "touchMove", &[(x + 0.52 * wide, middle)]);
        let read = other_than(browser, &rest);
        assert!(read.starts_with("time (ms) "), "{read}");
        fingers(browser, "touchEnd", &[]);
        fingers(
            browser,
            "touchStart",
            &[(x + 0.4 * wide, middle), (x + 0.6 * wide, middle)],
        );
        for part in [0.35, 0.3, 0.2] {
            fingers(
                browser,
                "touchMove",
                &[(x + part * wide, middle), (x + (1.0 - part) * wide, middle)],
            );
        }
        fingers(browser, "touchEnd", &[]);
        mouse(browser, "mouseMoved", 2.0, 2.0);
        let whole = "document.querySelector('.tools button[aria-label=\"show the whole\"]')";
        let zoomed = text(browser, LEGEND);
        browser.value(&format!("{{ {whole}.click(); true }}"), PATIENCE);
        assert_ne!(other_than(browser, &zoomed), zoomed);
    });
}

#[test]
fn keys_pick_a_load_step_and_its_chart_fits() {
    shown("simulate", 390, |browser| {
        let seen = "[...document.querySelectorAll('.pick > section')].filter(section => section.checkVisibility()).map(section => \
                    section.querySelector('h2').textContent).join()";
        assert_eq!(text(browser, seen), "200 -> 500 W");
        browser.value("{ document.querySelector('.pick input').focus(); true }", PATIENCE);
        for kind in ["keyDown", "keyUp"] {
            let key = json!({"type": kind, "key": "ArrowRight", "code": "ArrowRight", "windowsVirtualKeyCode": 39});
            browser.ask("Input.dispatchKeyEvent", key);
        }
        assert_eq!(
            text(
                browser,
                &format!("{{ const now = {seen}; now !== '200 -> 500 W' && now }}")
            ),
            "200 -> 800 W"
        );
        let fits = "document.documentElement.scrollWidth <= document.documentElement.clientWidth && [...document.querySelectorAll('.pick > section')]\
                    .find(section => section.checkVisibility()).querySelector('canvas').getBoundingClientRect().width > 250";
        browser.value(fits, PATIENCE);
    });
}
