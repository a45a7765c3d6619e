//! `policyc replay`: logs that end elsewhere than the contract says, and whether what is told of them fits.

use super::replayed_filters::{EPISODES, SCALE, clamped, desk, errors, low_pass, said, said_with};

/// The voltage error times `scale`, between two ends.
fn cut(scale: f64, low: f64, high: f64) -> impl Fn(&[f64]) -> Vec<f64> {
    move |errors| errors.iter().map(|e| (scale * e).clamp(low, high)).collect()
}

/// A log of the contract `clip = [-1, 1]` is told with `words`, and is equal with `mended` in the contract.
#[track_caller]
fn is_told([scale, low, high]: [f64; 3], words: &[&str], mended: &str) {
    let (code, line) = said_with("scale = 1.0\nclip = [-1.0, 1.0]", cut(scale, low, high));
    assert_eq!(code, 1, "{line}");
    for word in words {
        assert!(line.contains(word), "`{word}` is not in: {line}");
    }
    let (code, line) = said_with(mended, cut(scale, low, high));
    assert_eq!(code, 0, "{mended}: {line}");
}

const OPEN: f64 = f64::INFINITY;

/// The errors go from -1.767 to 3.375.
#[test]
fn an_end_of_the_contract_is_kept_only_where_the_log_stays_within_it() {
    is_told(
        [1.0, -1.0, OPEN],
        &["it ends elsewhere: a clip that begins at -1 and has no upper end (the log goes up to 3.375)"],
        "scale = 1.0\nclip = [-1.0, 1000.0]",
    );
    is_told(
        [1.0, -OPEN, 1.0],
        &["it ends elsewhere: a clip that ends at 1 and has no lower end (the log goes down to -1.767)"],
        "scale = 1.0\nclip = [-1000.0, 1.0]",
    );
    is_told([1.0, -OPEN, OPEN], &["it is not clipped"], "scale = 1.0");
    is_told(
        [1.0, -0.5, 1.0],
        &["clip = [-0.5, 1]"],
        "scale = 1.0\nclip = [-0.5, 1.0]",
    );
}

/// Without a filter nothing remembers how an episode began: what differs there alone differs for another reason.
#[test]
fn a_clip_that_cuts_first_rows_alone_is_no_start_of_a_filter() {
    let (code, line) = said_with("scale = 1.0\nclip = [-3.0, 3.0]", cut(1.0, -OPEN, OPEN));
    assert_eq!(code, 1, "{line}");
    assert!(line.contains("clip") && !line.contains("--skip"), "{line}");
}

#[test]
fn the_clip_of_a_log_with_another_scale_is_told_with_it() {
    is_told(
        [2.0, -2.0, OPEN],
        &[
            "2 times",
            "scale = 2, a clip that begins at -2 and has no upper end (the log goes up to 6.75)",
        ],
        "scale = 2.0\nclip = [-2.0, 1000.0]",
    );
    is_told(
        [2.0, -OPEN, OPEN],
        &["scale = 2, no clip (the log goes from -3.534 to 6.75)"],
        "scale = 2.0",
    );
    // within the contract's clip nothing is to be said of it
    is_told(
        [0.1, -OPEN, OPEN],
        &["scale = 0.1 fits the log"],
        "scale = 0.1\nclip = [-1.0, 1.0]",
    );
    is_told(
        [0.4, -0.4, OPEN],
        &["scale = 0.4, a clip that begins at -0.4 and has no upper end (the log goes up to 1.35)"],
        "scale = 0.4\nclip = [-0.4, 1000.0]",
    );
}

#[test]
fn the_least_value_of_a_log_is_no_clip() {
    let twice = |e: &[f64]| low_pass(e, e[0], 3e-3).iter().map(|y| 2.0 * y).collect::<Vec<_>>();
    let (code, line) = said("{ low_pass = { time_constant = 3e-3 } }", twice);
    assert_eq!(code, 1);
    assert!(
        line.contains("it is 2 times the contract's: scale = 200 fits the log"),
        "{line}"
    );
    assert!(!line.contains("clip"), "{line}");
    // held at an end that the formula passes
    let cut = |e: &[f64]| low_pass(e, e[0], 3e-4).iter().map(|y| y.max(-0.5)).collect::<Vec<_>>();
    let (_, line) = said("{ low_pass = { time_constant = 3e-4 } }", cut);
    assert!(line.contains("a clip that begins at -50"), "{line}");
}

#[test]
fn an_end_that_the_log_never_reaches_is_told() {
    let desk = desk("{ integrator = { min = -0.001, max = 0.9 } }");
    let mut text = "episode,v_out,i_l,i_out,obs_1\n".to_owned();
    for episode in 0..EPISODES {
        let errors = errors(episode);
        for (e, y) in errors.iter().zip(clamped(&errors, -0.001, 0.9)) {
            text += &format!("{episode},{:.7},2,2,{:.7}\n", 100.0 - e, SCALE * y);
        }
    }
    desk.write("log.csv", &text);
    let said = desk.succeed("replay buck12 log.csv");
    assert!(
        said.contains("the log never reaches `max` of e_del, 0.9: not checked"),
        "{said}"
    );
    assert!(!said.contains("`min` of e_del"), "{said}");
}
