//! Cases of the bench: a healthy converter of which something goes wrong on the way to the file, and tables of none.

use std::collections::BTreeMap;

use crate::independent::board::Topology;
use crate::independent::draft::{Case, Draft, Name};
use crate::independent::draw::{Design, design};
use crate::independent::families::{Options, consistent, measured, topology, words};
use crate::independent::faults::{Fault, NONSENSE, TABLE_FAULTS, nonsense, spoil};
use crate::independent::records::{Extent, Needs, programs};
use crate::independent::survey::{SEEN, SENSELESS, mean_square};
use crate::independent::truth::{Expect, Hidden};
use crate::rng::Rng;

fn hidden(id: &str, what: String) -> Vec<Hidden> {
    let parameters = BTreeMap::new();
    vec![Hidden {
        id: id.to_owned(),
        listed: false,
        what,
        parameters,
        channel: None,
        chi2: 0.0,
    }]
}

/// What is right of a fault: to refuse the files, to name it, or one of its causes.
fn expected(fault: &Fault) -> Expect {
    let mut verdicts = words(&["unexplained"]);
    if fault.harmless {
        verdicts = words(&["consistent"]);
    }
    Expect {
        verdicts,
        causes: words(&fault.causes),
        must_name: false,
        set_aside: None,
        refusal: !fault.harmless,
        words: fault.words.iter().map(|group| words(group)).collect(),
        wrong: "any other cause".to_owned(),
    }
}

/// One of the faults of the bench.
pub fn bench(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    let mut design = design(topology(options, random), random);
    if TABLE_FAULTS.contains(&id) {
        if id == "exchanged" {
            design.world.instruments.channels[1].recorded = true;
            design.world.instruments.channels[0].recorded = true;
        }
        let mut draft = measured(&design, &design.world, Needs::default(), options, random)?;
        let fault = spoil(id, &design, &mut draft.tables, random)?;
        // two currents with one mean, or rows without an edge between them, are as right as they were
        if let Extent::Rows(_) = options.extent
            && id != "one_minus_d"
            && mean_square(&draft) < SEEN
        {
            return None;
        }
        let hidden = hidden(fault.id, fault.what.clone());
        return Some(draft.case(name, hidden, expected(&fault), &[], false, random));
    }
    let fault = |id, what: &str, groups: &[&[&'static str]], causes: &[&'static str]| Fault {
        id,
        what: what.to_owned(),
        words: groups.iter().map(|group| group.to_vec()).collect(),
        causes: causes.to_vec(),
        harmless: false,
    };
    match id {
        "sampling_instant" => {
            let mut world = design.world.clone();
            let late = random.uniform(0.2, 0.5) * world.board.t_sw();
            world.instruments.late = if random.chance(0.5) { late } else { -late };
            let needs = Needs {
                rows: true,
                ..Needs::default()
            };
            let draft = measured(&design, &world, needs, options, random)?;
            seen(&draft)?;
            let what = format!("sampled {:.2} us later than stamped", 1e6 * world.instruments.late);
            let fault = fault(id, &what, &[], &["sampling_delay"]);
            Some(draft.case(name, hidden(id, what), naming(&fault), &[], options.rivals, random))
        }
        "wrong_load" => wrong_load(name, &design, options, random),
        "wrong_source" => {
            let mut world = design.world.clone();
            let factor = if random.chance(0.5) {
                random.uniform(1.08, 1.35)
            } else {
                random.uniform(0.7, 0.92)
            };
            world.board.source.v *= factor;
            let draft = measured(&design, &world, Needs::default(), options, random)?;
            seen(&draft)?;
            let what = format!("the supply gives {:.1} % of the plant file's voltage", 100.0 * factor);
            let fault = fault(
                id,
                &what,
                &[&["source voltage"], &["looks like a source"]],
                &["v_in_wrong"],
            );
            Some(draft.case(name, hidden(id, what), naming(&fault), &[], options.rivals, random))
        }
        "heldout_is_training" => {
            let mut draft = measured(&design, &design.world, Needs::default(), options, random)?;
            let (train, held) = (0, draft.programs.iter().position(|program| program.heldout)?);
            draft.tables[held] = draft.tables[train].clone();
            let what = "the held-out record is one of the training records".to_owned();
            let groups: [&[&str]; 5] = [
                &["same", "train"],
                &["identical"],
                &["equal", "train"],
                &["again", "training record"],
                &["same", "held"],
            ];
            let mut expect = expected(&fault(id, &what, &groups, &[]));
            expect.verdicts.clear();
            Some(draft.case(name, hidden(id, what), expect, &[], false, random))
        }
        _ => wrong_topology(name, &mut design, options, random),
    }
}

/// A fault that a cause of the list names.
fn naming(fault: &Fault) -> Expect {
    let mut expect = expected(fault);
    expect.verdicts = words(&["explained", "ambiguous"]);
    expect.must_name = true;
    expect
}

fn seen(draft: &Draft) -> Option<()> {
    (draft.distance(&draft.design.world, &draft.floors()) > super::families::SHOWS).then_some(())
}

/// Another load was connected than is written down.
fn wrong_load(name: Name, design: &Design, options: Options, random: &mut Rng) -> Option<Case> {
    let mut world = design.world.clone();
    let factor = if random.chance(0.5) {
        random.uniform(1.1, 1.5)
    } else {
        random.uniform(0.6, 0.9)
    };
    (world.board.sink.gain, world.board.sink.resistor) = (factor, factor);
    let draft = measured(design, &world, Needs::default(), options, random)?;
    seen(&draft)?;
    let what = format!("the load draws {:.0} % of what is written", 100.0 * factor);
    let words = vec![vec!["load", "meter"], vec!["r_load"], vec!["set load"]];
    let fault = Fault {
        id: "wrong_load",
        what: what.clone(),
        words,
        causes: vec!["load_gain"],
        harmless: false,
    };
    Some(draft.case(
        name,
        hidden("wrong_load", what),
        naming(&fault),
        &[],
        options.rivals,
        random,
    ))
}

/// Records of another topology than the plant file's.
fn wrong_topology(name: Name, design: &mut Design, options: Options, random: &mut Rng) -> Option<Case> {
    let mut world = design.world.clone();
    world.board.topology = match design.world.board.topology {
        Topology::Buck if random.chance(0.5) => Topology::Boost,
        Topology::Buck => Topology::BuckBoost,
        _ => Topology::Buck,
    };
    let plan = programs(design, Needs::default(), options.extent, random);
    let draft = Draft::measure(design, &world, plan, random)?;
    let what = format!("the records are those of a {:?}", world.board.topology);
    let groups = vec![vec!["boost"], vec!["topology"]];
    let fault = Fault {
        id: "wrong_topology",
        what: what.clone(),
        words: groups,
        causes: vec![],
        harmless: false,
    };
    Some(draft.case(
        name,
        hidden("wrong_topology", what),
        expected(&fault),
        &[],
        false,
        random,
    ))
}

/// Tables that no converter gives.
pub fn nonsense_case(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    debug_assert!(NONSENSE.contains(&id));
    let design = design(topology(options, random), random);
    let mut draft = measured(&design, &design.world, Needs::default(), options, random)?;
    let what = nonsense(id, &design, &mut draft.tables, random);
    // rows of one duty in another order are the same rows
    if let Extent::Rows(_) = options.extent
        && mean_square(&draft) < SENSELESS * SENSELESS
    {
        return None;
    }
    let expect = Expect {
        refusal: true,
        ..consistent()
    };
    let expect = Expect {
        verdicts: words(&["unexplained"]),
        ..expect
    };
    Some(draft.case(name, hidden(id, what), expect, &[], false, random))
}
