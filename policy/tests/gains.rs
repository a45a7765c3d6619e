//! Gain schedules in a contract: what is read, what is refused, and their golden answers.

#![allow(clippy::panic, clippy::unwrap_used)] // helpers of tests fail as tests do

mod common;
use common::*;
use policy::{Factor, Gain, Head, Interval, Schedule, Squash};

const DUTIES: &str = "duties = [0.44, 0.50, 0.56]";
/// Three gains, as many as the network has outputs.
const GAINS: &str = "base = \"0.25 + 0.001 * i_out\"\n\
     gains = [\n  { source = \"v_ref - v_out\", squash = \"tanh\", scale = 0.01, offset = 0.012, limits = [0.004, 0.02] },\n  \
     { feature = \"e_del\", clip = [-1.0, 1.0], scale = -0.002 },\n  { limits = [-0.1, 0.1], scale = 0.5 },\n]";

fn with(gains: &str) -> Folder {
    Folder::new().replace(DUTIES, gains)
}

fn head(folder: &Folder) -> Schedule {
    match folder.policy().head {
        Head::Schedule(head) => head,
        other => panic!("{other:?}"),
    }
}

fn fault(gains: &str, parts: &[&str]) {
    contract_fault(DUTIES, gains, parts);
}

#[test]
fn gains_are_read_with_their_maps_and_factors() {
    let head = head(&with(GAINS));
    assert_eq!(head.limits, Interval { low: 0.4, high: 0.6 });
    assert_eq!(head.base.text, "0.25 + 0.001 * i_out");
    let [first, second, third] = head.gains.as_slice() else {
        panic!()
    };
    assert!(matches!(&first.factor, Factor::Source(source) if source.text == "v_ref - v_out"));
    assert_eq!(first.limits, Some(Interval { low: 0.004, high: 0.02 }));
    assert_eq!(second.factor, Factor::Feature(1));
    assert_eq!(second.squash, Some(Squash::Clip(Interval { low: -1.0, high: 1.0 })));
    assert_eq!((second.scale, second.offset), (-0.002, 0.0));
    assert_eq!((&third.factor, third.squash, third.scale), (&Factor::One, None, 0.5));
    // v_ref = 100 and v_out of 0 to 250; the feature is taken before its scale and clip
    let bounds = |gain: &Gain| (gain.factor_bound.low, gain.factor_bound.high);
    assert_eq!(bounds(first), (-150.0, 100.0));
    assert_eq!(bounds(second), (-150.0, 100.0));
    assert_eq!(bounds(third), (1.0, 1.0));
    // 0.001 * -1 and 0.001 * 40 in binary32
    assert!((head.base_bound.low - 0.249).abs() < 1e-7 && (head.base_bound.high - 0.29).abs() < 1e-7);
}

#[test]
fn a_feature_is_a_factor_before_scale_and_clip() {
    let head = head(&with(&GAINS.replace("\"e_del\"", "\"e\"")));
    // the clip of `e` ends at 20
    assert_eq!(head.gains[1].factor_bound.low, -150.0);
}

#[test]
fn without_a_base_the_sum_begins_with_0() {
    let (_, gains) = GAINS.split_once('\n').unwrap();
    let head = head(&with(gains));
    assert_eq!(
        (head.base.text.as_str(), head.base_bound),
        ("0", Interval { low: 0.0, high: 0.0 })
    );
}

#[test]
fn what_makes_no_gain_is_refused_at_its_place() {
    let one = |gain: &str| format!("gains = [{gain}, {{ clip = [-1, 1] }}, {{ clip = [-1, 1] }}]");
    for (gain, parts) in [
        (
            "¦{ source = \"v_out\" }",
            &["nothing bounds this gain", "neither `squash` nor `clip`"][..],
        ),
        (
            "¦{ squash = \"tanh\", clip = [-1, 1] }",
            &["a gain", "exactly one of `squash`, `clip`"],
        ),
        (
            "¦{ source = \"v_out\", feature = \"e\", clip = [-1, 1] }",
            &["exactly one of `source`, `feature`", "2"],
        ),
        (
            "{ feature = ¦\"e_dle\", clip = [-1, 1] }",
            &["there is no feature `e_dle`", "e, e_del", "did you mean `e_del`?"],
        ),
        ("{ squash = ¦\"relu\" }", &["squash", "\"relu\"", "tanh, softsign"]),
        ("{ squash = \"tanh\", scale = ¦0.0 }", &["scale", "another number"]),
        (
            "{ squash = \"tanh\", limits = ¦[2.0, 3.0] }",
            &[
                "leave one gain, whatever the network says",
                "scale and offset reach into",
            ],
        ),
        ("{ squash = \"tanh\", limits = ¦[3.0, 2.0] }", &["crossed"]),
        ("{ squash = \"tanh\", ¦gain = 2.0 }", &["unknown key `gain`"]),
        ("{ source = \"v_out ¦* i_out\", squash = \"tanh\" }", &["not affine"]),
    ] {
        fault(&one(gain), parts);
    }
    fault("gains = ¦[]", &["gains", "0"]);
    let many = vec!["{ clip = [-1, 1] }"; 17].join(", ");
    fault(&format!("gains = ¦[{many}]"), &["gains", "17"]);
    fault(
        &format!(
            "dead_zone = ¦[{{ source = \"v_out\", within = 1.0 }}]\n{}",
            one("{ clip = [-1, 1] }")
        ),
        &["`dead_zone` is given without `base`", "a duty of 0"],
    );
}

#[test]
fn a_law_that_could_overflow_is_named_with_the_gain() {
    let gains = "gains = ¦[{ clip = [-1, 1] }, { source = \"1e30 * v_out\", clip = [-1e8, 1e8] }, { clip = [-1, 1] }]";
    fault(
        gains,
        &["the sum of the law up to gain 1", "could leave the range of f32"],
    );
    // each within the range alone, and not together
    let one = "{ source = \"1e30 * v_out\", clip = [-2.4e5, 2.4e5] }";
    let last = "{ clip = [-1, 1] }";
    fault(
        &format!("gains = ¦[{one}, {one}, {last}]"),
        &["the sum of the law up to gain 1", "could leave the range of f32"],
    );
    // an output within +-10 or so, times 8e37
    let gains = "gains = ¦[{ limits = [-1, 1], scale = 8e37 }, { clip = [-1, 1] }, { clip = [-1, 1] }]";
    let folder = with(&gains.replace('¦', ""));
    assert_says(&folder.fault(), &["gain 0 before its limits", "could leave the range"]);
}

#[test]
fn other_forms_beside_gains_are_refused() {
    let both = format!("¦{DUTIES}\n{GAINS}").replacen('¦', "", 1);
    let told = Folder::new().replace(DUTIES, &both).fault().to_string();
    assert!(
        told.contains("exactly one of `duties`, `pairs`, `offsets`, `continuous`, `gains`"),
        "{told}"
    );
}

#[test]
fn digests_hold_every_number_of_a_gain() {
    let digest = |gains: &str| with(gains).policy().digests.contract;
    let own = digest(GAINS);
    for (from, to) in [
        ("0.012", "0.013"),
        ("0.004", "0.005"),
        ("-0.002", "0.002"),
        ("[-1.0, 1.0]", "[-1.0, 0.5]"),
        ("\"e_del\"", "\"e\""),
        ("v_ref - v_out", "v_out - v_ref"),
        ("0.25 +", "0.26 +"),
    ] {
        assert_ne!(own, digest(&GAINS.replace(from, to)), "{from}");
    }
}

#[test]
fn golden_outputs_have_a_column_for_each_gain() {
    let obs = f32_tensor("obs", &[2, 2], &[1.0, 5.0, -2.0, -10.0]);
    let output = f32_tensor("output", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let golden = with(GAINS).golden(&[obs.clone(), output]).policy().golden.unwrap();
    assert_eq!(
        (golden.q_values.len(), golden.duties.len(), golden.law.len()),
        (6, 0, 0)
    );
    let flat = f32_tensor("output", &[2], &[0.0, 1.0]);
    let told = with(GAINS).golden(&[obs.clone(), flat]).fault().to_string();
    assert!(told.contains("[2, 3]"), "{told}");
    let q = f32_tensor("q", &[2, 3], &[0.0; 6]);
    let told = with(GAINS).golden(&[obs, q]).fault().to_string();
    assert!(
        told.contains("gain schedule") && told.contains("`output` f32 [2, 3]"),
        "{told}"
    );
}

#[test]
fn golden_duties_are_read_where_the_observation_tells_the_law() {
    let obs = f32_tensor("obs", &[3, 2], &[1.0, 5.0, -2.0, -10.0, 20.0, 3.0]);
    let duty = f32_tensor("duty", &[3], &[0.41, 0.42, 0.43]);
    let told = with(GAINS).golden(&[obs.clone(), duty.clone()]).fault().to_string();
    assert!(
        told.contains("0.25 + 0.001 * i_out") && told.contains("give `output`"),
        "{told}"
    );
    let plain = GAINS.replace("0.25 + 0.001 * i_out", "0.25");
    let golden = with(&plain).golden(&[obs, duty]).policy().golden.unwrap();
    // base; the source of `e`, which is scaled by 0.2; `e_del` as it is; nothing
    assert_eq!(golden.law[..4], [0.25, 5.0, 5.0, 1.0]);
    assert_eq!(golden.law[4..8], [0.25, -10.0, -10.0, 1.0]);
    // at the end of the clip of `e`, 20, its value may be any above
    assert!(golden.law[9].is_nan() && golden.law[10] == 3.0);
}

/// What observations say of the law: base and factors before scale and offset, and nothing at an end of a clip, behind which a value may be any.
#[test]
fn observations_tell_base_and_factors_between_the_ends_of_a_clip() {
    let gains = "base = \"0.25\"\ngains = [{ source = \"v_ref - v_out\", clip = [-1, 1] }, { feature = \"e_del\", clip = [-1, 1] }, { clip = [-1, 1] }]";
    let policy = with(gains).policy();
    let Head::Schedule(head) = &policy.head else { panic!() };
    assert!(policy.log_tells_answers());
    // o = 0.2 (v_ref - v_out), clipped at 20 to either side; `e_del` is the other feature as it is
    let told = |e: f32| policy::law_told(head, &policy.features, &[e, -7.5]).unwrap();
    let law = told(2.0);
    assert_eq!((law[0], law[2], law[3]), (0.25, -7.5, 1.0));
    assert!((law[1] - 10.0).abs() < 1e-9 && law.len() == 4, "{law:?}");
    assert!((told(19.9)[1] - 99.5).abs() < 1e-5 && (told(-19.9)[1] + 99.5).abs() < 1e-5);
    for end in [20.0, -20.0, 19.99999, -19.99999] {
        assert!(told(end)[1].is_nan(), "{end}");
    }
    // two rows, in their order
    let rows = policy::law_told(head, &policy.features, &[2.0, 1.0, 4.0, 3.0]).unwrap();
    assert_eq!((rows.len(), rows[2], rows[6]), (8, 1.0, 3.0));
    // what no feature passes on is named as the contract has it; a filter in between passes on something else
    for (law, named) in [
        (
            "base = \"0.25 + 0.001 * i_out\"\ngains = [{ source = \"v_ref - v_out\", clip = [-1, 1] }, { clip = [-1, 1] }, { clip = [-1, 1] }]",
            "0.25 + 0.001 * i_out",
        ),
        (
            "gains = [{ source = \"i_out\", clip = [-1, 1] }, { clip = [-1, 1] }, { clip = [-1, 1] }]",
            "i_out",
        ),
    ] {
        let policy = with(law).policy();
        let Head::Schedule(head) = &policy.head else { panic!() };
        assert!(!policy.log_tells_answers());
        assert_eq!(
            policy::law_told(head, &policy.features, &[0.0, 0.0]).unwrap_err(),
            named
        );
    }
}
