//! Converters side by side against converters alone.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use closed_loop::LoadKind;
use random::{Random, Xoshiro};
use train::episodes::{Actions, Begin, Episodes, Given};
use train::{Contract, Converter, Settings};

const COUNT: usize = 11;

/// The paper's training with changes: shorter episodes, loads that change anywhere in a period, a drawn converter.
fn settings(more: &str) -> Settings {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/train/paper12.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let episode = "[episode]\nsteps = 60\nload_every = 7\nany_phase = true\n";
    let text = text.replace("[episode]\nsteps = 400\nload_every = 100\n", episode);
    assert!(text.contains("any_phase"), "the example has changed");
    Settings::parse(&format!("{text}\n{more}"), &path).unwrap()
}

fn episodes(settings: &Settings, count: usize, profile: &[(u64, f64)]) -> Episodes {
    let contract = Contract::load_any(&settings.contract, &[]).unwrap();
    let nominal = Converter::load(settings.plant.as_path(), &settings.set).unwrap();
    Episodes::new(
        settings,
        &contract,
        &nominal,
        count,
        (LoadKind::Power, profile.to_vec()),
    )
    .unwrap()
}

/// What a control period gave, as bits.
#[derive(Debug, PartialEq)]
struct Row(Vec<u32>, u64, bool, [u64; 4]);

/// One control period of all; an episode that has ended is begun in the next.
fn step(episodes: &mut Episodes, actions: &[i64], over: &mut [bool]) -> Vec<Row> {
    let (count, features) = (episodes.count(), episodes.features());
    let (mut observations, mut rewards, mut truncated) =
        (vec![0.0; count * features], vec![0.0; count], vec![false; count]);
    let given = Given {
        observations: &mut observations,
        rewards: &mut rewards,
        truncated: &mut truncated,
    };
    episodes.step(Actions::Index(actions), over, given).unwrap();
    over.copy_from_slice(&truncated);
    let row = |index: usize| {
        let seen = &observations[index * features..][..features];
        let sample = episodes.sample(index);
        Row(
            seen.iter().map(|x| x.to_bits()).collect(),
            rewards[index].to_bits(),
            truncated[index],
            [sample.v_out, sample.i_l, sample.i_out, sample.v_in].map(f64::to_bits),
        )
    };
    (0..count).map(row).collect()
}

/// Drives all together, and each alone, with the same actions.
fn hold_against_each_other(settings: &Settings, profile: &[(u64, f64)], is_batch: bool) {
    let mut many = episodes(settings, COUNT, profile);
    assert_eq!(many.is_batch(), is_batch);
    let mut alone: Vec<Episodes> = (0..COUNT).map(|_| episodes(settings, 1, profile)).collect();
    for (index, one) in alone.iter_mut().enumerate() {
        many.seed(index, 40 + index as u64);
        many.begin(index, None).unwrap();
        one.seed(0, 40 + index as u64);
        one.begin(0, None).unwrap();
    }
    let mut rng = Xoshiro::new(5);
    let (mut over, mut each) = ([false; COUNT], [[false]; COUNT]);
    let mut ended = 0;
    for period in 0..400 {
        let actions: Vec<i64> = (0..COUNT).map(|_| rng.below(12) as i64).collect();
        let rows = step(&mut many, &actions, &mut over);
        for (index, row) in rows.into_iter().enumerate() {
            let own = step(&mut alone[index], &actions[index..=index], &mut each[index]);
            assert_eq!([row].as_slice(), own, "converter {index} in period {period}");
        }
        ended += over.iter().filter(|over| **over).count();
    }
    assert!(ended > 20, "{ended} episodes have ended");
}

#[test]
fn converters_side_by_side_live_the_lives_of_single_ones() {
    hold_against_each_other(&settings(""), &[], true);
}

#[test]
fn so_do_those_that_are_drawn_anew_for_each_episode() {
    let drawn = "[[randomise]]\nkey = \"converter.inductance\"\nfactor = [0.7, 1.3]\n\
                 [[randomise]]\nkey = \"switch.v_f\"\nvalue = [0.0, 1.2]\n";
    hold_against_each_other(&settings(drawn), &[], true);
}

#[test]
fn so_do_those_with_an_esr_and_with_noisy_sensors() {
    let esr = "[[randomise]]\nkey = \"capacitor.esr\"\nvalue = [0.0, 0.05]\n";
    hold_against_each_other(&settings(esr), &[], true);
    let noise = "[[randomise]]\nkey = \"sensors.v_out.noise\"\nvalue = [0.01, 0.05]\n";
    hold_against_each_other(&settings(noise), &[], true);
}

#[test]
fn a_converter_that_is_not_plain_is_computed_alone() {
    let drawn = "[[randomise]]\nkey = \"inductor.saturation\"\nvalue = [0.0, 0.2]\n";
    hold_against_each_other(&settings(drawn), &[], false);
}

#[test]
fn a_load_profile_takes_the_place_of_draws() {
    let profile = [(0, 200.0), (9, 800.0), (30, 350.0)];
    hold_against_each_other(&settings(""), &profile, true);
    let mut one = episodes(&settings(""), 1, &profile);
    let mut loads = vec![one.load(0)];
    let mut over = [false];
    for _ in 0..31 {
        step(&mut one, &[6], &mut over);
        loads.push(one.load(0));
    }
    assert_eq!([loads[8], loads[9], loads[29], loads[30]], [200.0, 800.0, 800.0, 350.0]);
}

#[test]
fn a_start_that_is_given_is_taken_as_it_is() {
    let mut one = episodes(&settings(""), 1, &[]);
    let begin = Begin {
        v_out: 97.5,
        i_l: None,
        load: Some(390.0),
        noise: 0,
    };
    one.begin(0, Some(&begin)).unwrap();
    let sample = one.sample(0);
    assert_eq!((sample.v_out, sample.i_l, one.load(0)), (97.5, 4.0, 390.0));
}

#[test]
fn what_is_no_profile_and_arrays_of_another_length_are_refused() {
    let settings = settings("");
    let contract = Contract::load_any(&settings.contract, &[]).unwrap();
    let nominal = Converter::load(settings.plant.as_path(), &settings.set).unwrap();
    for profile in [vec![(1, 200.0)], vec![(0, 1.0), (5, 2.0), (5, 3.0)]] {
        assert!(Episodes::new(&settings, &contract, &nominal, 1, (LoadKind::Power, profile)).is_err());
    }
    let mut two = episodes(&settings, 2, &[]);
    let (mut observations, mut rewards, mut truncated) = (vec![0.0; 12], vec![0.0; 2], vec![false; 2]);
    let given = Given {
        observations: &mut observations,
        rewards: &mut rewards,
        truncated: &mut truncated,
    };
    let error = two.step(Actions::Index(&[1]), &[false; 2], given).unwrap_err();
    assert!(error.to_string().contains("as long as there are converters"), "{error}");
}

#[test]
fn a_seed_twice_is_refused_and_load_steps_beyond_the_loads_are_told() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/train/paper12.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let twice = Settings::parse(&text.replace("seeds = [0, 1, 2, 3, 4]", "seeds = [3, 1, 3]"), &path).unwrap_err();
    let said = twice.to_string();
    assert!(
        said.contains("names a seed twice") && said.contains("found: 3"),
        "{said}"
    );
    let remarks = |text: &str| {
        Settings::parse(text, &path)
            .unwrap()
            .remarks(&plant::Parameters::paper_model())
    };
    assert_eq!(remarks(&text), Vec::<String>::new());
    let beyond = remarks(&text.replace("[[200, 500], [200, 800]", "[[200, 500], [200, 8000]"));
    assert!(
        beyond.len() == 1 && beyond[0].contains("[evaluation] judges at 8000 W"),
        "{beyond:?}"
    );
}
