//! The mapping that is refitted to an extended model, and the loop closed with it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::Path;

use closed_loop::scenario::Task;
use closed_loop::{LoadKind, LoadStep};
use diagnose::control::{Control, Request, control};
use drm::formula::Losses;
use plant::Parameters;

/// The policy of the blind cases on a converter that differs from the one of its training.
fn controlled(change: impl Fn(&mut Parameters)) -> Control {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/blind");
    let trained_on = Parameters::from_file(&folder.join("plant.toml")).unwrap();
    let mut extended = trained_on.clone();
    change(&mut extended);
    let request = Request {
        output: 0,
        policy: policy::load(&folder.join("policy/policy.toml")).unwrap(),
        losses: Losses::of(&trained_on).unwrap(),
        trained_on,
        v_ref: 100.0,
        load_steps: vec![LoadStep {
            kind: LoadKind::Power,
            values: [200.0, 600.0],
            source: None,
            reference: None,
        }],
        task: Task {
            instants: 1,
            sampling_instants: 1,
            ..Task::default()
        },
    };
    control(&request, &extended).unwrap()
}

#[test]
fn a_weaker_source_gets_another_mapping_and_a_ripple_none() {
    // 195 V for 200 V: the same voltage needs 200/195 of the duty
    let weaker = controlled(|p| p.converter.v_in = 195.0).findings;
    assert!(weaker.refitted);
    assert!((weaker.mapping_after.a - 200.0 / 195.0).abs() < 2e-3, "{weaker:?}");
    // under a ripple of the source nothing settles, and its mean asks for no other duty
    let ripple = controlled(|p| (p.source.ripple, p.source.ripple_frequency) = (3.0, 160.0)).findings;
    assert!(!ripple.refitted && ripple.largest_change < 1e-3, "{ripple:?}");
}

#[test]
fn a_wrong_voltmeter_gets_no_other_mapping_and_is_said() {
    let off =
        |gain: f64, offset: f64| controlled(move |p| (p.sensors.v_out.gain, p.sensors.v_out.offset) = (gain, offset));
    for (what, found) in [("gain", off(0.98, 0.0).findings), ("offset", off(1.0, -1.3).findings)] {
        assert!(!found.refitted && found.largest_change < 1e-3, "{what}: {found:?}");
        for course in &found.steps {
            assert_eq!(course.before, course.after, "{what}");
        }
        assert!(!found.beyond_repair.is_empty(), "{what}");
    }
    // the source that is weaker beside it is what the mapping follows
    let both = controlled(|p| (p.converter.v_in, p.sensors.v_out.gain) = (195.0, 0.98)).findings;
    assert!((both.mapping_after.a - 200.0 / 195.0).abs() < 2e-3, "{both:?}");
}
