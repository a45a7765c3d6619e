//! Two causes at once, in records as long as somebody takes them who has two things to find.

use crate::independent::causes::{Variant, variants};
use crate::independent::draft::{Case, Name};
use crate::independent::draw::design;
use crate::independent::families::{Options, SHOWS, hidden, ids, measured, pick, topology, words};
use crate::independent::program::World;
use crate::independent::records::{Extent, Needs};
use crate::independent::ties::{TIED, search, vector};
use crate::independent::truth::{Expect, Family, Hidden, Tie};
use crate::rng::Rng;

/// The causes of which two are hidden: those with numbers of their own, as the step of a converter has none in the mean. Each is the first of two before
/// one comes twice.
pub fn first() -> Vec<&'static str> {
    let mut all = ids(Family::Cause);
    all.retain(|id| *id != "adc_quantisation");
    all
}

/// What both need.
fn needs(one: Needs, other: Needs) -> Needs {
    Needs {
        power: one.power || other.power,
        sink: one.sink || other.sink,
        rows: true,
    }
}

/// A draw: the second is drawn, each shows beside the other, and no single cause of the list does what both do.
pub fn pair(name: Name, id: &'static str, options: Options, random: &mut Rng) -> Option<Case> {
    let long = Options {
        extent: match options.extent {
            Extent::Full => Extent::Long,
            other => other,
        },
        ..options
    };
    let design = design(topology(options, random), random);
    let all = variants(&design);
    let one = pick(&all, id, random)?;
    let mut others = first();
    others.retain(|other| *other != id);
    let two = pick(&all, others[random.below(others.len())], random)?;
    let (of_one, of_two) = (one.draw(random), two.draw(random));
    let with_one = one.applied(&design.world, &of_one);
    let with_two = two.applied(&design.world, &of_two);
    let world = two.applied(&with_one, &of_two);
    let draft = measured(&design, &world, needs(one.needs, two.needs), long, random)?;
    let floors = draft.floors();
    let [by_one, by_two] = [&with_two, &with_one].map(|without| draft.distance(without, &floors));
    if by_one < SHOWS || by_two < SHOWS {
        return None;
    }
    let mut expect = Expect {
        verdicts: words(&["explained", "ambiguous"]),
        causes: words(&[one.id, two.id]),
        must_name: true,
        wrong: "any cause that is neither hidden nor tied".to_owned(),
        ..Expect::default()
    };
    let mut ties = Vec::new();
    if options.rivals {
        if draft.rivals(&floors).first().is_some_and(|rival| rival.left < SHOWS) {
            return None;
        }
        let truth = vector(&world, &floors, &draft.programs);
        let view = |world: &World| vector(world, &floors, &draft.programs);
        for with in [&with_one, &with_two] {
            let own = |variant: &&Variant| variant.id != one.id && variant.id != two.id;
            let beside: Vec<Variant> = variants(&design).into_iter().filter(|variant| own(&variant)).collect();
            let near = search(with, &beside, &truth, &view);
            ties.extend(near.into_iter().filter(|rival| rival.left < TIED));
        }
    }
    for tie in &ties {
        expect.causes.push(tie.id.to_owned());
    }
    let both: Vec<Hidden> = vec![hidden(one, &of_one, by_one), hidden(two, &of_two, by_two)];
    let mut case = draft.case(name, both, expect, &[], false, random);
    case.truth.ties = ties
        .iter()
        .map(|rival| Tie {
            id: rival.id.to_owned(),
            wiring: rival.wiring.to_owned(),
            left: rival.left,
        })
        .collect();
    Some(case)
}
