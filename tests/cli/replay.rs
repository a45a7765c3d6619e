//! `policyc replay`: logs of environments, right ones and ones that made other features than the contract says.
//!
//! The environment here is written from the formulas of the contract, in binary64 and without the interpreter.

use super::Desk;
use tests::tools::copy_folder;

/// One control period of the log: samples, and what the environment observed.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) episode: usize,
    samples: [f64; 3],
    observation: [f64; 6],
}

/// Two episodes with transients, without noise: v_out, i_l and i_out in V and A.
pub(super) fn environment() -> Vec<Row> {
    let mut rows = Vec::new();
    for episode in 0..2 {
        let mut last: Option<f64> = None;
        for k in 0..60 {
            let t = k as f64;
            let sign = if episode == 0 { 1.0 } else { -1.0 };
            let v_out = 100.0 + sign * 3.0 * (0.21 * t).sin() * (-0.03 * t).exp();
            let i_out = if k < 20 { 2.0 } else { 7.5 };
            let i_l = i_out + 1.5 * (0.21 * t + 0.4).cos();
            let (e, before) = (100.0 - v_out, 100.0 - last.unwrap_or(v_out));
            let slope = (i_out - i_l) / 1.5e-3;
            last = Some(v_out);
            rows.push(Row {
                episode,
                samples: [v_out, i_l, i_out],
                observation: [
                    0.2 * e,
                    0.2 * before,
                    3e-4 * slope,
                    -0.2 * e,
                    -0.2 * before,
                    -3e-4 * slope,
                ],
            });
        }
    }
    rows
}

pub(super) fn table(rows: &[Row]) -> String {
    let mut text = "episode,v_out,i_l,i_out,obs_0,obs_1,obs_2,obs_3,obs_4,obs_5\n".to_owned();
    for row in rows {
        let cells = row.samples.iter().chain(&row.observation);
        let cells: Vec<String> = cells.map(|cell| format!("{cell:.7}")).collect();
        text += &format!("{},{}\n", row.episode, cells.join(","));
    }
    text
}

/// The example's contract, and a log.
pub(super) fn desk(rows: &[Row]) -> Desk {
    let desk = Desk::new("minimal");
    copy_folder(&tests::root().join("examples/buck12"), &desk.path("buck12"));
    desk.write("log.csv", &table(rows));
    desk
}

/// What is said of a log of which one feature is spoiled: exit code 1, and the line of that feature.
#[track_caller]
fn said_of(feature: usize, name: &str, spoil: impl Fn(&[Row], usize) -> f64) -> String {
    let rows = environment();
    let mut spoiled = rows.clone();
    for (k, row) in spoiled.iter_mut().enumerate() {
        row.observation[feature] = spoil(&rows, k);
    }
    let ran = desk(&spoiled).type_in("replay buck12 log.csv");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stdout.contains("DIFFERENT: 1 of 6 logged features"),
        "{}",
        ran.stdout
    );
    let line = ran
        .stdout
        .lines()
        .find(|line| line.trim_start().starts_with(&format!("{name}: ")));
    line.unwrap_or_else(|| panic!("{}", ran.stdout)).to_owned()
}

#[test]
fn replay_of_a_log_that_the_contract_explains_is_equal_to_the_last_feature() {
    let said = desk(&environment()).succeed("replay buck12 log.csv");
    assert!(said.contains("120 samples") && said.contains("2 episodes"), "{said}");
    assert!(said.contains("equal: all 6 features"), "{said}");
    // v_out swings by 3 V: nothing is seen of where the features are cut off
    assert!(
        said.contains("comes to neither end of the clip of e, -20 to 20"),
        "{said}"
    );
}

#[test]
fn replay_names_sign_scale_offset_and_clip() {
    let line = said_of(0, "e", |rows, k| -rows[k].observation[0]);
    assert!(line.contains("other sign") && line.contains("scale = -0.2"), "{line}");
    let line = said_of(2, "de_dt", |rows, k| 5.0 * rows[k].observation[2]);
    assert!(line.contains("5 times") && line.contains("scale = 0.0015"), "{line}");
    let line = said_of(3, "v", |rows, k| rows[k].observation[3] + 0.25);
    assert!(line.contains("plus 0.25") && line.contains("offset = 0.25"), "{line}");
    let line = said_of(0, "e", |rows, k| rows[k].observation[0].clamp(-0.2, 0.2));
    assert!(line.contains("clip = [-0.2, 0.2]"), "{line}");
}

#[test]
fn replay_names_a_delay_another_order_and_another_source() {
    let line = said_of(0, "e", |rows, k| rows[k].observation[1]);
    assert!(line.contains("what the contract calls `e_del`"), "{line}");
    // two rows before, within the episode
    let line = said_of(1, "e_del", |rows, k| {
        rows[if k % 60 < 2 { k - k % 60 } else { k - 2 }].observation[0]
    });
    assert!(line.contains("1 row earlier") && line.contains("delay = 1"), "{line}");
    let line = said_of(2, "de_dt", |rows, k| 0.1 * rows[k].samples[1] - 1.0);
    assert!(line.contains("0.1 * (i_l) - 1"), "{line}");
    let line = said_of(5, "dv_dt", |rows, k| {
        let before = if k % 60 == 0 { k } else { k - 1 };
        rows[k].samples[0] - rows[before].samples[0]
    });
    assert!(line.contains("the change of v_out from row to row"), "{line}");
}

#[test]
fn replay_says_that_only_the_starts_of_episodes_differ() {
    let line = said_of(
        1,
        "e_del",
        |rows, k| if k % 60 == 0 { 0.7 } else { rows[k].observation[1] },
    );
    assert!(line.contains("only in the first row of an episode"), "{line}");
}

#[test]
fn replay_does_not_invent_a_reason() {
    let noise = |k: usize| ((k * 7919 + 13) % 101) as f64 / 101.0;
    let line = said_of(2, "de_dt", |_, k| noise(k));
    assert!(line.contains("no simple relation"), "{line}");
}

/// A column that a logger wrote one row late: all features of it differ, and none of them is to blame.
#[test]
fn replay_names_the_column_that_is_late_and_not_what_is_made_of_it() {
    let rows = environment();
    let mut late = rows.clone();
    for (k, row) in late.iter_mut().enumerate() {
        row.samples[0] = rows[if k % 60 == 0 { k } else { k - 1 }].samples[0];
    }
    let ran = desk(&late).type_in("replay buck12 log.csv");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("v_out: logged one row late"), "{}", ran.stdout);
    let verdict = "DIFFERENT: `v_out` is logged one row late, and nothing else differs";
    assert!(ran.stdout.contains(verdict), "{}", ran.stdout);
    for name in ["e", "e_del", "v", "v_del"] {
        assert!(!ran.stdout.contains(&format!("{name}: first other")), "{}", ran.stdout);
    }
    // with another fault beside it, it is one reason among others
    for row in &mut late {
        row.observation[2] *= 2.0;
    }
    let ran = desk(&late).type_in("replay buck12 log.csv");
    assert!(!ran.stdout.contains("one row late"), "{}", ran.stdout);
    assert!(ran.stdout.contains("de_dt: first other"), "{}", ran.stdout);
}

#[test]
fn replay_compares_actions_unless_the_trainer_explored() {
    let desk = desk(&environment());
    let with = |actions: &dyn Fn(usize) -> usize| {
        let table = table(&environment());
        let lines = table.lines().enumerate().map(|(line, text)| match line {
            0 => format!("{text},action\n"),
            line => format!("{text},{}\n", actions(line)),
        });
        lines.collect::<String>()
    };
    desk.write("log.csv", &with(&|line| line % 12));
    let ran = desk.type_in("replay buck12 log.csv");
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert!(ran.stdout.contains("--exploring"), "{}", ran.stdout);
    let said = desk.succeed("replay buck12 log.csv --exploring");
    assert!(said.contains("explored"), "{said}");
    desk.write("log.csv", &with(&|_| 12));
    desk.refuse(
        "replay buck12 log.csv",
        &["an action that the contract does not have", "log.csv:2", "from 0 to 11"],
    );
}

/// What the controller remembers of its own duty is the trainer's duty.
#[test]
fn replay_takes_previous_duty_from_the_log() {
    let desk = desk(&environment());
    desk.edit(
        "buck12/policy.toml",
        "source = \"(i_l - i_out) / c_out\"\nscale = 3e-4",
        "source = \"previous_duty - 0.5\"\nscale = 10",
    );
    // the trainer's observations were made with another feature
    desk.edit("buck12/policy.toml", "golden = \"golden.safetensors\"", "");
    let log = |column: &str, values: &dyn Fn(usize) -> f64, observed: &dyn Fn(usize) -> f64| {
        let mut text = format!("v_out,i_l,i_out,obs_dv_dt,{column}\n");
        for k in 0..12 {
            text += &format!("100,2,2,{:.5},{}\n", observed(k), values(k));
        }
        text
    };
    let duties = |k: usize| 0.44 + 0.01 * ((5 * k) % 12) as f64;
    let before = |k: usize| if k == 0 { 0.5 } else { duties(k - 1) };
    desk.write(
        "log.csv",
        &log("action", &|k| ((5 * k) % 12) as f64, &|k| 10.0 * (before(k) - 0.5)),
    );
    desk.succeed("replay buck12 log.csv --exploring");
    desk.write("log.csv", &log("duty", &duties, &|k| 10.0 * (before(k) - 0.5)));
    desk.succeed("replay buck12 log.csv --exploring");
    // the log begins in mid-run: its first duty is not that of the contract
    desk.write("log.csv", &log("previous_duty", &duties, &|k| 10.0 * (duties(k) - 0.5)));
    let said = desk.type_in("replay buck12 log.csv");
    assert!(
        said.code == Some(1) && said.stdout.contains("look at initial_duty"),
        "{}",
        said.stdout
    );
    desk.succeed("replay buck12 log.csv --skip 1");
    desk.write("log.csv", &log("previous_duty", &|_| 0.9, &|_| 4.0));
    desk.refuse("replay buck12 log.csv", &["none that the controller commands", "0.9"]);
}

#[test]
fn replay_refuses_a_log_that_it_cannot_compare() {
    let desk = desk(&environment());
    desk.write("log.csv", "v_out,i_l,i_out\n100,2,2\n");
    desk.refuse(
        "replay buck12 log.csv",
        &[
            "nothing to compare with",
            "v_out, i_l, i_out",
            "obs_0",
            "--map obs_0=NAME",
        ],
    );
    desk.write("log.csv", "v_out,i_l,obs_0\n100,2,0\n");
    desk.refuse("replay buck12 log.csv", &["no column for the signal `i_out`"]);
    desk.write("log.csv", "t,v_out,i_l,i_out,obs_0\n0,100,2,2,0\n2e-4,100,2,2,0\n");
    desk.refuse("replay buck12 log.csv", &["not a control period apart", "1e-4 s"]);
    desk.write("log.csv", "v_out,i_l,i_out,obs_0\n100,2,2,zero\n");
    desk.refuse("replay buck12 log.csv", &["zero"]);
}

/// A sensor that ends below what the training reached is no feature that is wrong, and the golden vectors do not stand in the way.
#[test]
fn replay_tells_a_signal_that_leaves_its_range_from_a_wrong_feature() {
    let desk = desk(&environment());
    desk.edit("buck12/policy.toml", "range = [0.0, 250.0]", "range = [0.0, 101.0]");
    let stderr = desk.refuse(
        "inspect buck12",
        &[
            "can never see",
            "golden_outside",
            "policyc replay",
            "the `range` of a signal",
        ],
    );
    let said = desk.succeed("replay buck12 log.csv");
    assert!(
        said.contains("v_out: ") && said.contains("outside its range in"),
        "{said}"
    );
    assert!(said.contains("; but in at least "), "{said}");
    let share = stderr
        .split("golden_outside = ")
        .nth(1)
        .unwrap()
        .split(' ')
        .next()
        .unwrap();
    desk.edit(
        "buck12/policy.toml",
        "[network]",
        &format!("[network]\ngolden_outside = {share}"),
    );
    let said = desk.succeed("inspect buck12");
    assert!(said.contains("golden observations are left out"), "{said}");
    desk.edit(
        "buck12/policy.toml",
        &format!("golden_outside = {share}"),
        "golden_outside = 0.01",
    );
    desk.refuse("inspect buck12", &["can never see"]);
}

#[test]
fn replay_names_initial_duty_time_constant_and_a_shift_of_the_duties() {
    let rows = environment();
    let low_pass = |k: usize| {
        let start = k - k % 60;
        (start + 1..=k).fold(rows[start].observation[0], |y, row| {
            y + 0.25 * (rows[row].observation[0] - y)
        })
    };
    let line = said_of(0, "e", |_, k| low_pass(k));
    // 0.25 = T / (tau + T) at T = 0.1 ms
    assert!(
        line.contains("time_constant = 3e-4") || line.contains("time_constant = 0.0003"),
        "{line}"
    );
    let desk = desk(&rows);
    desk.edit("buck12/policy.toml", "golden = \"golden.safetensors\"", "");
    desk.edit(
        "buck12/policy.toml",
        "source = \"(i_l - i_out) / c_out\"\nscale = 3e-4",
        "source = \"previous_duty\"\nscale = 2",
    );
    let log = |first: f64, shift: f64| {
        let mut text = "episode,v_out,i_l,i_out,obs_dv_dt,action\n".to_owned();
        for k in 0..100 {
            let before = if k % 50 == 0 {
                first
            } else {
                0.44 + 0.01 * ((5 * (k - 1)) % 12) as f64 + shift
            };
            text += &format!("{},100,2,2,{:.5},{}\n", k / 50, 2.0 * before, (5 * k) % 12);
        }
        text
    };
    let said = |text: &str| {
        desk.write("log.csv", text);
        let ran = desk.type_in("replay buck12 log.csv --exploring");
        assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
        ran.stdout
    };
    let stdout = said(&log(0.46, 0.0));
    assert!(stdout.contains("initial_duty"), "{stdout}");
    let stdout = said(&log(0.5, 0.04));
    assert!(stdout.contains("plus 0.08"), "{stdout}");
}

/// What is left of 100 V - v_out at rest is the rounding of binary32, and no feature that is wrong.
#[test]
fn replay_of_a_settled_converter_is_equal_up_to_the_rounding_of_binary32() {
    let desk = desk(&environment());
    let mut text = "v_out,i_l,i_out,obs_0\n".to_owned();
    for k in 0..50 {
        let e = 1e-5 * f64::from(k % 7);
        text += &format!("{:.9},2,2,{:.12}\n", 100.0 - e, 0.2 * e);
    }
    desk.write("log.csv", &text);
    desk.succeed("replay buck12 log.csv");
    // a tenth of a volt is not
    desk.write("log.csv", &text.replace("2,2,0.00000", "2,2,0.02000"));
    assert_eq!(desk.type_in("replay buck12 log.csv").code, Some(1));
}

/// The example's network with one output for all actions, but for two biases: action 3 is worth 1 less, and action 0 four
/// millionths more than all others, which a trainer's own order of additions may turn.
fn tied(desk: &Desk) {
    use safetensors::{Dtype, SafeTensors, tensor::TensorView};
    let path = desk.path("buck12/weights.safetensors");
    let bytes = std::fs::read(&path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let last = |shape: &[usize]| shape.first() == Some(&12);
    let tensors = file.tensors().into_iter().map(|(name, view)| {
        let mut data = view.data().to_vec();
        if last(view.shape()) {
            let row = data.len() / 12;
            let first = data[..row].to_vec();
            data.chunks_exact_mut(row)
                .for_each(|other| other.copy_from_slice(&first));
        }
        if view.shape() == [12] {
            let bias = f32::from_le_bytes(*data.first_chunk().unwrap());
            data[..4].copy_from_slice(&(bias + 4e-6).to_le_bytes());
            data[12..16].copy_from_slice(&(bias - 1.0).to_le_bytes());
        }
        (name, view.shape().to_vec(), data)
    });
    let tensors: Vec<_> = tensors.collect();
    let views =
        (tensors.iter()).map(|(name, shape, data)| (name, TensorView::new(Dtype::F32, shape.clone(), data).unwrap()));
    std::fs::write(&path, safetensors::serialize(views, None).unwrap()).unwrap();
    desk.edit("buck12/policy.toml", "golden = \"golden.safetensors\"", "");
}

#[test]
fn replay_counts_an_action_of_the_same_q_value_as_a_tie_and_another_one_as_different() {
    let desk = desk(&environment());
    tied(&desk);
    let log = |action: &dyn Fn(usize) -> usize| {
        let rows = table(&environment());
        let mut lines = rows.lines();
        let head = lines.next().unwrap();
        let lines = lines.enumerate().map(|(row, line)| format!("{line},{}\n", action(row)));
        format!("{head},action\n{}", lines.collect::<String>())
    };
    desk.write("log.csv", &log(&|_| 0));
    let said = desk.succeed("replay buck12 log.csv");
    assert!(
        said.contains("action equal in 120 of 120") && !said.contains("tie"),
        "{said}"
    );
    desk.write("log.csv", &log(&|row| if row == 4 || row == 70 { 7 } else { 0 }));
    let said = desk.succeed("replay buck12 log.csv");
    assert!(said.contains("action equal in 118 of 120, 2 ties apart"), "{said}");
    assert!(
        said.contains("golden_tolerance") && said.contains("equal: all 6 features"),
        "{said}"
    );
    let json: serde_json::Value = serde_json::from_str(&desk.succeed("replay buck12 log.csv --json")).unwrap();
    assert_eq!(
        (json["actions"]["ties"].as_u64(), json["equal"].as_bool()),
        (Some(2), Some(true))
    );
    desk.write(
        "log.csv",
        &log(&|row| [0, 7, 3][usize::from(row == 4) + 2 * usize::from(row == 70)]),
    );
    let ran = desk.type_in("replay buck12 log.csv");
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    // the header is line 1
    assert!(
        ran.stdout
            .contains("action equal in 118 of 120, 1 tie apart, first other in line 72"),
        "{}",
        ran.stdout
    );
}

#[test]
fn a_feature_with_one_row_off_is_not_taken_for_itself() {
    // 1e-4 of its largest value is allowed, and this is twice that
    let line = said_of(0, "e", |rows, k| {
        rows[k].observation[0] + if k == 30 { 2.5e-4 } else { 0.0 }
    });
    assert!(!line.contains("another order of the features"), "{line}");
}

#[test]
fn a_tolerance_below_the_rounding_of_binary32_is_said_not_to_be_kept() {
    let desk = desk(&environment());
    let kept = desk.succeed("replay buck12 log.csv");
    assert!(
        kept.contains("within 0.0001 of their largest value") && !kept.contains("rounding of binary32"),
        "{kept}"
    );
    let below = desk.succeed("replay buck12 log.csv --tolerance 1e-12");
    assert!(below.contains("within the rounding of binary32"), "{below}");
}
