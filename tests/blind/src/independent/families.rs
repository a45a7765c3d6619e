//! The families of cases: what is hidden in each, and what a right answer is.

use std::collections::BTreeMap;

use crate::independent::board::Topology;
use crate::independent::causes::{Variant, variants};
use crate::independent::draft::{Case, Draft, Name};
use crate::independent::draw::{Design, design};
use crate::independent::instruments::{CHANNELS, I_L, I_OUT, V_IN, V_OUT};
use crate::independent::odd::{DISTURBANCES, Oddity, PHYSICS, disturb, plant_physics};
use crate::independent::program::World;
use crate::independent::records::{Extent, Needs, close_one, programs};
use crate::independent::truth::{Expect, Family, Hidden};
use crate::rng::Rng;

/// From this distance on, in units of the noise's variance, a hidden cause is one that has to be found.
pub const SHOWS: f64 = 150.0;
/// Far less than anybody sees: what a healthy board may have that its plant file does not state.
const NOTHING: f64 = 4.0;

/// How cases are drawn.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Length of the records.
    pub extent: Extent,
    /// Look for what else explains the records.
    pub rivals: bool,
    /// No other topology than the buck.
    pub buck_only: bool,
}

/// A draw of a case; none where what is hidden would not show, or the board does not hold together.
pub fn draw(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    match name.family {
        Family::Healthy => healthy(name, options, random),
        Family::Cause => cause(name, id, options, random),
        Family::Disturbed => disturbed(name, id, options, random),
        Family::Unlisted => unlisted(name, id, options, random),
        Family::Pair => super::pairs::pair(name, id, options, random),
        Family::Bench => super::bench::bench(name, id, options, random),
        Family::Nonsense => super::bench::nonsense_case(name, id, options, random),
    }
}

pub fn topology(options: Options, random: &mut Rng) -> Topology {
    match random.below(10) {
        0 if !options.buck_only => Topology::Boost,
        1 if !options.buck_only => Topology::BuckBoost,
        _ => Topology::Buck,
    }
}

pub fn words(all: &[&str]) -> Vec<String> {
    all.iter().map(|word| (*word).to_owned()).collect()
}

/// Right answers to records that the plant file explains.
pub fn consistent() -> Expect {
    Expect {
        verdicts: words(&["consistent"]),
        wrong: "any cause".to_owned(),
        ..Expect::default()
    }
}

/// A design with its records, one of them perhaps in closed loop.
pub fn measured(design: &Design, world: &World, needs: Needs, options: Options, random: &mut Rng) -> Option<Draft> {
    let mut programs = programs(design, needs, options.extent, random);
    if random.chance(0.4) {
        close_one(design, world, &mut programs, random);
    }
    Draft::measure(design, world, programs, random)
}

fn healthy(name: Name, options: Options, random: &mut Rng) -> Option<Case> {
    let design = design(topology(options, random), random);
    // every board has a little of what no plant file says
    let mut world = design.world.clone();
    world.board.gates.recovery = 1e-5 * world.board.t_sw();
    world.board.odd.core_square = 1e-5 * design.i_l() / world.board.source.v.powi(2);
    let draft = measured(&design, &world, Needs::default(), options, random)?;
    if draft.distance(&design.world, &draft.floors()) > NOTHING {
        return None;
    }
    Some(draft.case(name, vec![], consistent(), &[], false, random))
}

pub fn pick<'a>(all: &'a [Variant], id: &str, random: &mut Rng) -> Option<&'a Variant> {
    let of_id: Vec<&Variant> = all.iter().filter(|variant| variant.id == id).collect();
    of_id.get(random.below(of_id.len())).copied()
}

/// What is hidden, in words and numbers.
pub fn hidden(variant: &Variant, values: &[f64], chi2: f64) -> Hidden {
    let numbers: Vec<String> = variant
        .knobs
        .iter()
        .zip(values)
        .map(|(knob, value)| format!("{} {:.4e} -> {value:.4e} {}", knob.name, knob.nominal, knob.unit))
        .collect();
    Hidden {
        id: variant.id.to_owned(),
        listed: true,
        what: format!("{}: {}", variant.wiring, numbers.join(", ")),
        parameters: variant
            .knobs
            .iter()
            .zip(values)
            .map(|(knob, value)| (knob.name.to_owned(), *value))
            .collect(),
        channel: None,
        chi2,
    }
}

fn named(id: &str) -> Expect {
    Expect {
        verdicts: words(&["explained", "ambiguous"]),
        causes: words(&[id]),
        must_name: true,
        wrong: "any cause that is neither hidden nor tied".to_owned(),
        ..Expect::default()
    }
}

fn cause(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    let design = design(topology(options, random), random);
    if id == "adc_quantisation" {
        return quantised(name, &design, options, random);
    }
    let all = variants(&design);
    let variant = pick(&all, id, random)?;
    let values = variant.draw(random);
    let world = variant.applied(&design.world, &values);
    let draft = measured(&design, &world, variant.needs, options, random)?;
    let chi2 = draft.distance(&design.world, &draft.floors());
    if chi2 < SHOWS {
        return None;
    }
    Some(draft.case(
        name,
        vec![hidden(variant, &values, chi2)],
        named(id),
        &[],
        options.rivals,
        random,
    ))
}

/// A coarse converter that the plant file does not state: seen in the numbers, not in the mean.
fn quantised(name: Name, design: &Design, options: Options, random: &mut Rng) -> Option<Case> {
    let mut world = design.world.clone();
    let channel = if world.instruments.channels[V_OUT].recorded {
        V_OUT
    } else {
        I_L
    };
    let mut design = design.clone();
    design.world.instruments.channels[channel].lsb = 0.0;
    let coarse = &mut world.instruments.channels[channel];
    coarse.lsb = coarse.noise * random.uniform(4.0, 9.0);
    let (lsb, noise) = (coarse.lsb, coarse.noise);
    let needs = Needs {
        rows: true,
        ..Needs::default()
    };
    let draft = measured(&design, &world, needs, options, random)?;
    let hidden = Hidden {
        id: "adc_quantisation".to_owned(),
        listed: true,
        what: format!("{}: step {lsb:.4e} over noise {noise:.4e}", CHANNELS[channel]),
        parameters: BTreeMap::from([("lsb".to_owned(), lsb)]),
        channel: Some(CHANNELS[channel].to_owned()),
        chi2: 0.0,
    };
    Some(draft.case(name, vec![hidden], named("adc_quantisation"), &[], false, random))
}

pub fn odd(oddity: &Oddity, chi2: f64) -> Hidden {
    Hidden {
        id: oddity.id.to_owned(),
        listed: false,
        what: oddity.what.clone(),
        parameters: BTreeMap::new(),
        channel: oddity.channel.map(|index| CHANNELS[index].to_owned()),
        chi2,
    }
}

/// Usual value of a channel.
pub fn span(design: &Design, channel: usize) -> f64 {
    match channel {
        V_OUT => design.v_out,
        I_L => design.i_l(),
        I_OUT => design.i_out,
        _ => design.world.board.source.v,
    }
}

/// `id` is the disturbance; the cause is drawn.
fn disturbed(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    let mut design = design(topology(options, random), random);
    // somebody who suspects a channel records two at least
    for channel in [V_OUT, I_L] {
        design.world.instruments.channels[channel].recorded = true;
    }
    let all = variants(&design);
    let sensor = [
        "v_gain",
        "v_offset",
        "i_gain",
        "i_offset",
        "v_in_gain",
        "sensor_low_pass",
        "sensor_delay",
    ];
    let usable: Vec<&Variant> = all.iter().filter(|variant| !sensor.contains(&variant.id)).collect();
    let variant = usable[random.below(usable.len())];
    let values = variant.draw(random);
    let alone = variant.applied(&design.world, &values);
    let channels: Vec<usize> = [V_OUT, I_L, I_OUT, V_IN]
        .into_iter()
        .filter(|channel| design.world.instruments.channels[*channel].recorded)
        .collect();
    let channel = channels[random.below(channels.len())];
    let mut world = alone.clone();
    let oddity = disturb(
        id,
        random.uniform(0.7, 1.5),
        channel,
        span(&design, channel),
        &mut world,
        random,
    );
    let needs = Needs {
        rows: true,
        ..variant.needs
    };
    let draft = measured(&design, &world, needs, options, random)?;
    let by_channel = draft.distance(&alone, &draft.floors());
    let mut others = draft.floors();
    others[channel] = f64::INFINITY;
    let by_cause = draft.distance(&design.world, &others);
    // without the disturbed channel the cause still shows, and the disturbance is no small thing, nor a gain or an offset by another name: of a
    // channel that hardly moves even a cube is one
    let is_small = by_channel < 2.0 * SHOWS || draft.beside_calibration(&alone, channel) < SHOWS;
    if by_cause < SHOWS || is_small {
        return None;
    }
    let mut expect = named(variant.id);
    expect.verdicts = words(&["mostly_explained"]);
    expect.set_aside = Some(CHANNELS[channel].to_owned());
    "a cause for what disturbs the channel".clone_into(&mut expect.wrong);
    let hidden = vec![hidden(variant, &values, by_cause), odd(&oddity, by_channel)];
    Some(draft.case(name, hidden, expect, &[channel], options.rivals, random))
}

fn unlisted(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    let topology = if id == "node_capacitance" {
        Topology::Buck
    } else {
        topology(options, random)
    };
    let design = design(topology, random);
    let mut world = design.world.clone();
    let size = random.uniform(0.8, 2.0);
    let oddity = if PHYSICS.contains(&id) {
        plant_physics(id, size, &design, &mut world, random)
    } else {
        let channel = if world.instruments.channels[V_OUT].recorded {
            V_OUT
        } else {
            I_L
        };
        disturb(id, size, channel, span(&design, channel), &mut world, random)
    };
    let needs = Needs {
        rows: true,
        ..Needs::default()
    };
    let draft = measured(&design, &world, needs, options, random)?;
    let chi2 = draft.distance(&design.world, &draft.floors());
    if chi2 < SHOWS {
        return None;
    }
    let mut expect = Expect {
        verdicts: words(&["unexplained"]),
        causes: words(oddity.same),
        wrong: "any cause but the same thing by another name".to_owned(),
        ..Expect::default()
    };
    if let Some(channel) = oddity.channel {
        expect.verdicts.push("mostly_explained".to_owned());
        expect.set_aside = Some(CHANNELS[channel].to_owned());
    }
    Some(draft.case(name, vec![odd(&oddity, chi2)], expect, &[], options.rivals, random))
}

/// Ids of a family: every one comes before one comes twice.
pub fn ids(family: Family) -> Vec<&'static str> {
    match family {
        Family::Healthy => vec!["none"],
        Family::Cause => vec![
            "dcr",
            "r_ds_on",
            "diode",
            "dead_time",
            "turn_on_delay",
            "turn_off_delay",
            "esr",
            "esl",
            "c_wrong",
            "c_derating",
            "l_wrong",
            "l_saturation",
            "core_loss",
            "v_in_wrong",
            "source_impedance",
            "input_ripple",
            "v_gain",
            "v_offset",
            "i_gain",
            "i_offset",
            "v_in_gain",
            "sensor_low_pass",
            "sensor_delay",
            "sampling_delay",
            "adc_quantisation",
            "duty_delay",
            "duty_offset",
            "duty_quantisation",
            "cpl_bandwidth",
            "cpl_fold",
            "load_gain",
            "bleed",
            "cable",
        ],
        Family::Disturbed => DISTURBANCES.to_vec(),
        Family::Bench => [super::faults::TABLE_FAULTS.as_slice(), &super::faults::OTHER_FAULTS].concat(),
        Family::Nonsense => super::faults::NONSENSE.to_vec(),
        Family::Unlisted => [PHYSICS.as_slice(), &DISTURBANCES].concat(),
        Family::Pair => super::pairs::first(),
    }
}
