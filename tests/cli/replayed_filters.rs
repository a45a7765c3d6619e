//! `policyc replay`: logs of environments whose filters are others than the contract's.
//!
//! The filters here are written from the formulas of textbooks and of the usual libraries, without the interpreter.

use super::Desk;
use tests::tools::copy_folder;

const T: f64 = 1e-4;
pub(super) const EPISODES: usize = 3;
const ROWS: usize = 80;
pub(super) const SCALE: f64 = 100.0;

/// Voltage errors of an episode: a step of another size in each, that dies away with a swing.
pub(super) fn errors(episode: usize) -> Vec<f64> {
    let size = [2.5, -1.7, 3.1][episode];
    let at = |k: usize| {
        let t = k as f64;
        size * (0.35 + (0.17 * t + episode as f64).cos()) * (-0.02 * t).exp()
    };
    (0..ROWS).map(at).collect()
}

/// The example's contract with these filters in its second feature.
pub(super) fn desk(filters: &str) -> Desk {
    desk_with(&format!("filters = [{filters}]\nscale = {SCALE}"))
}

/// The example's contract with a second feature of these keys.
fn desk_with(keys: &str) -> Desk {
    let desk = Desk::new("minimal");
    copy_folder(&tests::root().join("examples/buck12"), &desk.path("buck12"));
    desk.edit(
        "buck12/policy.toml",
        "filters = [{ delay = 1 }]\nscale = 0.2\nclip = [-20.0, 20.0]\n\n[[feature]]\nname = \"de_dt\"",
        &format!("{keys}\n\n[[feature]]\nname = \"de_dt\""),
    );
    // the trainer's observations were made with another feature
    desk.edit("buck12/policy.toml", "golden = \"golden.safetensors\"", "");
    desk
}

/// What is said of a log whose feature is `make` of each episode's errors, times [`SCALE`].
#[track_caller]
pub(super) fn said(filters: &str, make: impl Fn(&[f64]) -> Vec<f64>) -> (i32, String) {
    let scaled = |e: &[f64]| make(e).iter().map(|y| SCALE * y).collect();
    said_with(&format!("filters = [{filters}]\nscale = {SCALE}"), scaled)
}

/// What is said of a log whose feature, of these keys in the contract, is `make` of each episode's errors.
#[track_caller]
pub(super) fn said_with(keys: &str, make: impl Fn(&[f64]) -> Vec<f64>) -> (i32, String) {
    let desk = desk_with(keys);
    let mut text = "episode,v_out,i_l,i_out,obs_1\n".to_owned();
    for episode in 0..EPISODES {
        let errors = errors(episode);
        for (e, y) in errors.iter().zip(make(&errors)) {
            text += &format!("{episode},{:.7},2,2,{y:.7}\n", 100.0 - e);
        }
    }
    desk.write("log.csv", &text);
    let ran = desk.type_in("replay buck12 log.csv");
    let line = ran.stdout.lines().find(|line| line.trim_start().starts_with("e_del: "));
    (ran.code.unwrap(), line.unwrap_or(&ran.stdout).to_owned())
}

#[track_caller]
fn is_named(filters: &str, make: impl Fn(&[f64]) -> Vec<f64>, words: &[&str]) {
    let (code, line) = said(filters, make);
    assert_eq!(code, 1, "{line}");
    for word in words {
        assert!(line.contains(word), "`{word}` is not in: {line}");
    }
}

/// A sum that `next` goes on with: the sum before, the sample before and this one; from `first`.
fn sum(errors: &[f64], first: f64, next: impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
    let mut sums = vec![first];
    for pair in errors.windows(2) {
        sums.push(next(*sums.last().unwrap(), pair[0], pair[1]));
    }
    sums
}

/// Far from its clamps in this log, and within them.
const WIDE: &str = "{ integrator = { min = -1.0, max = 1.0, initial = 0.0 } }";
const NARROW: &str = "{ integrator = { min = -0.001, max = 0.003, initial = 0.0 } }";

fn rectangles(errors: &[f64]) -> Vec<f64> {
    sum(errors, T * errors[0], |y, _, x| y + T * x)
}

pub(super) fn clamped(errors: &[f64], low: f64, high: f64) -> Vec<f64> {
    sum(errors, (T * errors[0]).clamp(low, high), |y, _, x| {
        (y + T * x).clamp(low, high)
    })
}

#[test]
fn an_integral_as_in_the_contract_is_equal() {
    assert_eq!(said(WIDE, rectangles).0, 0);
    assert_eq!(said(NARROW, |e| clamped(e, -0.001, 0.003)).0, 0);
}

#[test]
fn an_integral_by_another_rule_is_named() {
    let first = "leaves out the first sample of an episode";
    is_named(WIDE, |e| sum(e, 0.0, |y, _, x| y + T * x), &[first]);
    let trapezoids = "trapezoids, T (x + x1) / 2";
    let trapezoid = |first: f64, e: &[f64]| sum(e, first, |y, x1, x| y + 0.5 * T * (x + x1));
    // scipy's cumulative_trapezoid with initial=0
    is_named(WIDE, |e| trapezoid(0.0, e), &[trapezoids, "nothing in the first row"]);
    is_named(WIDE, |e| trapezoid(T * e[0], e), &[trapezoids]);
    // what MATLAB's discrete-time integrator gives from an input of 0 on
    is_named(
        WIDE,
        |e| trapezoid(0.5 * T * e[0], e),
        &[trapezoids, "0 before the first sample"],
    );
    is_named(
        WIDE,
        |e| sum(e, 0.0, |y, x1, _| y + T * x1),
        &["sample of the row before", "{ delay = 1 } behind the integrator"],
    );
    is_named(
        WIDE,
        |e| sum(e, T * e[0], |y, x1, _| y + T * x1),
        &["sample of the row before", "{ delay = 1 } in front of the integrator"],
    );
}

#[test]
fn an_integral_with_another_clamp_is_named_with_its_ends() {
    is_named(
        NARROW,
        |e| clamped(e, -0.0008, 0.0025),
        &["min = -0.0008", "max = 0.0025"],
    );
    is_named(NARROW, |e| clamped(e, -0.001, 0.002), &["elsewhere: max = 0.002 fits"]);
    // an end is proposed only as far as the log shows: no clamp of the log is seen
    is_named(
        NARROW,
        rectangles,
        &[
            "goes beyond min = -0.001, down to",
            "goes beyond max = 0.003, up to",
            "or more fits the log",
        ],
    );
    is_named(
        NARROW,
        |e| rectangles(e).iter().map(|y| y.clamp(-0.001, 0.003)).collect(),
        &["winds up"],
    );
    is_named(
        NARROW,
        |e| sum(e, 0.0, |y, x1, x| (y + 0.5 * T * (x + x1)).clamp(-0.001, 0.002)),
        &["trapezoids", "max = 0.002"],
    );
}

#[test]
fn what_is_no_matter_of_the_integral_is_not_blamed_on_it() {
    let times = |factor: f64| move |e: &[f64]| rectangles(e).iter().map(|y| factor * y).collect::<Vec<_>>();
    is_named(WIDE, times(-1.0), &["other sign"]);
    is_named(WIDE, times(1e4), &["10000 times"]);
    let shifted = |e: &[f64]| rectangles(e).iter().map(|y| y + 0.0025).collect::<Vec<_>>();
    is_named(WIDE, shifted, &["plus 0.25"]);
    // two mistakes at once
    is_named(
        WIDE,
        |e| sum(e, 0.0, |y, x1, x| 0.9 * (y + 0.5 * T * (x + x1))),
        &["no simple relation"],
    );
}

/// The clamps of the contract are in the way of nearly all of the log, and the sum does not wind up behind them: the log passes them.
#[test]
fn a_clamp_that_the_log_passes_is_no_wind_up() {
    let tight = "{ integrator = { min = -0.00005, max = 0.00005 } }";
    let (code, line) = said(tight, rectangles);
    assert_eq!(code, 1, "{line}");
    assert!(line.contains("the log goes beyond max = 5e-5, up to"), "{line}");
    assert!(line.contains("the log goes beyond min = -5e-5, down to"), "{line}");
    assert!(!line.contains("winds up"), "{line}");
    // what it proposes fits
    let end = |word: &str| {
        let rest = line
            .split("fits the log")
            .find(|part| part.contains(&format!("beyond {word}")));
        let rest = rest.unwrap().split(&format!(": {word} = ")).nth(1).unwrap();
        rest.split(' ').next().unwrap().to_owned()
    };
    let mended = format!("{{ integrator = {{ min = {}, max = {} }} }}", end("min"), end("max"));
    assert_eq!(said(&mended, rectangles).0, 0, "{mended}");
}

#[test]
fn a_leak_is_named_with_its_share() {
    let leaky = |leak: f64, first: f64| move |e: &[f64]| sum(e, first * T * e[0], |y, _, x| leak * y + T * x);
    is_named(WIDE, leaky(0.998, 1.0), &["it leaks, leak = 0.998 a period"]);
    // forgets a hundredth of itself in each period, and begins at 0
    is_named(
        WIDE,
        leaky(0.99, 0.0),
        &["leaves out the first sample", "leak = 0.99 a period"],
    );
    // one ten-thousandth: over the 80 rows of an episode it is seen
    is_named(WIDE, leaky(0.9999, 1.0), &["it leaks, leak = 0.9999"]);
    let contract = "{ integrator = { min = -1.0, max = 1.0, leak = 0.98 } }";
    assert_eq!(said(contract, leaky(0.98, 1.0)).0, 0);
    is_named(contract, leaky(0.9, 1.0), &["it leaks otherwise: leak = 0.9 a period"]);
    is_named(contract, rectangles, &["it does not leak"]);
    let clamped = |e: &[f64]| {
        sum(e, (T * e[0]).clamp(-0.0005, 0.001), |y, _, x| {
            (0.98 * y + T * x).clamp(-0.0005, 0.001)
        })
    };
    let contract = "{ integrator = { min = -0.0005, max = 0.001 } }";
    is_named(contract, clamped, &["it leaks, leak = 0.98 a period"]);
}

/// An integral that adds the sample of the row before, from an initial value that leaks: what is proposed has to fit.
#[test]
fn a_delay_behind_a_leak_is_proposed_only_where_it_fits() {
    let before = |leak: f64, initial: f64| move |e: &[f64]| sum(e, leak * initial, |y, x1, _| leak * y + T * x1);
    let contract = |initial: f64, more: &str| {
        format!("{{ integrator = {{ min = -1.0, max = 1.0, initial = {initial}, leak = 0.9 }} }}{more}")
    };
    let behind = "{ delay = 1 } behind the integrator";
    // from 0 nothing leaks
    is_named(&contract(0.0, ""), before(0.9, 0.0), &[behind]);
    let (code, line) = said(&contract(0.02, ""), before(0.9, 0.02));
    assert_eq!(code, 1, "{line}");
    assert!(
        line.contains("sample of the row before") && !line.contains(behind),
        "{line}"
    );
    let (code, line) = said(&contract(0.02, ", { delay = 1 }"), before(0.9, 0.02));
    assert_eq!(code, 1, "{line}");
}

/// A factor in front of an integral is no factor behind its clamp.
#[test]
fn another_source_in_front_of_a_filter_is_named() {
    let twice = |e: &[f64]| {
        let doubled: Vec<f64> = e.iter().map(|e| 2.0 * e).collect();
        clamped(&doubled, -0.001, 0.003)
    };
    is_named(NARROW, twice, &["it is the integral of 2 * (v_ref - v_out)"]);
    // the mean of v_out in the place of that of the error
    let desk = desk("{ low_pass = { time_constant = 3e-4 } }");
    let errors = errors(0);
    let current = |k: usize| 4.0 + (0.3 * k as f64).sin() * (-0.01 * k as f64).exp();
    let currents: Vec<f64> = (0..ROWS).map(current).collect();
    let mut text = "v_out,i_l,i_out,obs_1\n".to_owned();
    for ((e, i), y) in errors.iter().zip(&currents).zip(low_pass(&currents, currents[0], 3e-4)) {
        text += &format!("{:.7},{i:.7},2,{:.7}\n", 100.0 - e, 0.1 * y);
    }
    desk.write("log.csv", &text);
    let ran = desk.type_in("replay buck12 log.csv");
    let words = "behind another source: source = \"i_l\", scale = 0.1 fits the log";
    assert!(ran.stdout.contains(words), "{}", ran.stdout);
}

/// Rows that are held somewhere without reason leave the contract's own source where it is.
#[test]
fn the_contract_s_own_source_is_no_other_source() {
    let held = |e: &[f64]| {
        let mut y: Vec<f64> = low_pass(e, e[0], 3e-4).iter().map(|y| 2.0 * y).collect();
        y[40..60].fill(9.0);
        y
    };
    is_named("{ low_pass = { time_constant = 3e-4 } }", held, &["no simple relation"]);
}

pub(super) fn low_pass(errors: &[f64], first: f64, tau: f64) -> Vec<f64> {
    sum(errors, first, |y, _, x| y + T / (tau + T) * (x - y))
}

fn average(errors: &[f64], samples: usize) -> Vec<f64> {
    let mean = |k: usize| {
        let window = (0..samples).map(|back| errors[k.saturating_sub(back)]);
        window.sum::<f64>() / samples as f64
    };
    (0..errors.len()).map(mean).collect()
}

#[test]
fn a_filter_with_another_time_constant_is_named_with_it() {
    let contract = "{ low_pass = { time_constant = 2e-4 } }";
    is_named(
        contract,
        |e| low_pass(e, e[0], 7e-4),
        &["low-pass has another time constant", "time_constant = 0.0007"],
    );
    is_named(
        contract,
        |e| low_pass(e, T / 3e-4 * e[0], 2e-4),
        &["starts from 0", "--skip"],
    );
    is_named(contract, <[f64]>::to_vec, &["without the low-pass"]);
    // a low-pass by the exact exponential is one with another factor: T / (1 - exp(-1/2)) - T
    is_named(
        contract,
        |e| {
            sum(e, e[0], |y, _, x| {
                let a = (-T / 2e-4_f64).exp();
                a * y + (1.0 - a) * x
            })
        },
        &["time_constant = 0.0001541"],
    );
    // behind another filter
    is_named(
        "{ delay = 1 }, { low_pass = { time_constant = 2e-4 } }",
        |e| {
            let mut before = vec![e[0]];
            before.extend(&e[..e.len() - 1]);
            low_pass(&before, e[0], 7e-4)
        },
        &["time_constant = 0.0007"],
    );
    is_named(
        "{ filtered_derivative = { time_constant = 3e-4 } }",
        |e| sum(e, 0.0, |y, x1, x| (9e-4 * y + (x - x1)) / (9e-4 + T)),
        &[
            "filtered derivative has another time constant",
            "time_constant = 0.0009",
        ],
    );
}

#[test]
fn a_filter_of_the_log_alone_is_named() {
    let contract = "{ moving_average = 4 }";
    is_named(contract, |e| average(e, 7), &["{ moving_average = 7 }"]);
    is_named(
        contract,
        |e| average(e, 4).iter().map(|y| 1.3 * y).collect(),
        &["1.3 times"],
    );
    let contract = "{ delay = 1 }";
    let delayed = |e: &[f64]| (0..e.len()).map(|k| e[k.saturating_sub(1)]).collect::<Vec<_>>();
    is_named(contract, |e| average(&delayed(e), 5), &["{ moving_average = 5 } more"]);
    is_named(
        contract,
        |e| low_pass(&delayed(e), e[0], 4e-4),
        &["it is low-pass filtered", "time_constant = 0.0004"],
    );
}

/// A low-pass in front of which the log has another scale, too, is two mistakes, and no time constant repairs them.
#[test]
fn no_filter_is_named_that_does_not_explain_the_column() {
    let contract = "{ low_pass = { time_constant = 2e-4 } }";
    is_named(
        contract,
        |e| low_pass(e, e[0], 7e-4).iter().map(|y| 1.2 * y + 0.3).collect(),
        &["no simple relation"],
    );
    is_named(contract, |e| average(e, 9), &["no simple relation"]);
    let noise = |k: usize| ((k * 7919 + 13) % 101) as f64 / 101.0;
    is_named(WIDE, |e| (0..e.len()).map(noise).collect(), &["no simple relation"]);
}

#[test]
fn a_few_odd_rows_are_no_relation() {
    let odd = |e: &[f64]| {
        let mut y = rectangles(e);
        y[50] += 0.01;
        y
    };
    is_named(WIDE, odd, &["3 of 240 rows differ"]);
}

#[test]
fn columns_of_a_log_may_have_other_names() {
    let desk = desk("{ delay = 1 }");
    desk.write(
        "log.csv",
        "Va,IL,Iq,x1\n99.9,2000,2,10\n99.8,2100,2,10\n99.7,2100,2,20\n",
    );
    desk.refuse("replay buck12 log.csv", &["no column for the signal `v_out`", "--map"]);
    let ran = desk.type_in("replay buck12 log.csv --map obs_1=x1 --map i_l=IL*0.001,i_out=IO");
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    desk.write(
        "log.csv",
        "Vo,IL,IO,x1\n99.9,2000,2,10\n99.8,2100,2,10\n99.7,2100,2,20\n",
    );
    let said = desk.succeed("replay buck12 log.csv --map v_out=Vo,obs_1=x1 --map i_l=IL*0.001,i_out=IO");
    assert!(said.contains("equal: the 1 of 6 features"), "{said}");
    desk.refuse(
        "replay buck12 log.csv --map v_aut=Vo",
        &["no quantity `v_aut`", "did you mean `v_out`?"],
    );
    desk.refuse(
        "replay buck12 log.csv --map v_out=Va",
        &["no column `Va`", "did you mean `Vo`?"],
    );
}

/// The same map, for the recordings of `verify`.
#[test]
fn columns_of_a_recording_may_have_other_names() {
    let desk = desk("{ delay = 1 }");
    desk.write("run.csv", "Vo,IL,IO\n99.9,2,2\n99.8,2.1,2\n");
    desk.refuse(
        "verify buck12 --trace run.csv --steps 50",
        &["no column for the signal", "--map v_out=Vo,i_l=IL,i_out=IO"],
    );
    desk.refuse("verify buck12 --map v_out=Vo", &["--trace"]);
    desk.succeed("verify buck12 --trace run.csv --map v_out=Vo,i_l=IL,i_out=IO --steps 50");
}

/// `--skip` of as many rows as are named leaves the start of a low-pass out, and hardly more than that.
#[test]
fn the_rows_in_which_another_start_is_seen_are_told() {
    let desk = desk("{ low_pass = { time_constant = 4e-4 } }");
    let errors = errors(0);
    let mut text = "v_out,i_l,i_out,obs_1\n".to_owned();
    for (e, y) in errors.iter().zip(low_pass(&errors, 0.2 * errors[0], 4e-4)) {
        text += &format!("{:.7},2,2,{:.7}\n", 100.0 - e, SCALE * y);
    }
    desk.write("log.csv", &text);
    let ran = desk.type_in("replay buck12 log.csv");
    assert_eq!(ran.code, Some(1));
    let rows = ran.stdout.split("--skip ").nth(1).expect("a number of rows");
    let rows: usize = rows.split(' ').next().unwrap().parse().unwrap();
    // 0.8^n of 0.8 of the first value is below 1e-4 of the largest
    assert!((38..45).contains(&rows), "{rows}");
    desk.succeed(&format!("replay buck12 log.csv --skip {rows}"));
    assert_eq!(
        desk.type_in(&format!("replay buck12 log.csv --skip {}", rows - 3)).code,
        Some(1)
    );
}

/// The log has a turning point, and no clip there.
#[test]
fn other_actions_send_the_reader_to_the_features_that_are_not_in_the_log() {
    let desk = desk("{ delay = 1 }");
    let mut text = "v_out,i_l,i_out,obs_0,action\n".to_owned();
    for (k, e) in errors(0).iter().enumerate() {
        text += &format!("{:.7},2,2,{:.7},{}\n", 100.0 - e, 0.2 * e, k % 12);
    }
    desk.write("log.csv", &text);
    let ran = desk.type_in("replay buck12 log.csv");
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    let words = "the 1 logged observation is equal, the actions are not; `e_del`, `de_dt`, `v`, `v_del` and `dv_dt` are not in the log: look \
                 there first";
    assert!(ran.stdout.contains(words), "{}", ran.stdout);
}
