//! Run-time errors and broken limits planted in generated C: the claim that is about each is not proved.

use policy::NumericFormat;
use prove::{Verdict, eva};

use super::{in_format, sources, task, watched};

struct Defect {
    what: &'static str,
    /// The text, once in the file, and what it becomes.
    edit: (&'static str, &'static str),
    /// The driver that is run.
    driver: &'static str,
    /// The claim that falls.
    claim: &'static str,
}

const fn defect(
    what: &'static str,
    edit: (&'static str, &'static str),
    driver: &'static str,
    claim: &'static str,
) -> Defect {
    Defect {
        what,
        edit,
        driver,
        claim,
    }
}

/// One a driver first: a plain run takes the first of them.
#[rustfmt::skip]
const DEFECTS: [Defect; 28] = [
    defect("a turn too many over the Q values", ("action < CONSTRUCTS_ACTIONS", "action <= CONSTRUCTS_ACTIONS"), "prove_choose", "choose-runs"),
    defect("filter memory overrun", ("for (i = 0u; i < 2u; ++i)", "for (i = 0u; i < 15u; ++i)"), "prove_step", "step-runs"),
    defect("CRC table overrun", ("crc_steps[crc & 15u]", "crc_steps[crc & 31u]"), "prove_others", "others-runs"),
    defect("a number of the state not guarded", ("\n                         | constructs_far(state->memory[11], 0x3CF5C29Fu)", ""), "prove_marked", "marked-marked"),
    defect("a NaN not caught behind the limiter", (" & ~(uint32_t)(stray >> 31)", ""), "prove_damaged", "damaged-duty"),
    defect("a sum without its number", ("for (i = 1u; i < 12u; ++i)", "for (i = 1u; i < 13u; ++i)"), "prove_q_values", "q-values-runs"),
    defect("a gain above 2 in a low-pass", ("v25 * 0.09090909f", "v25 * 2.5f"), "prove_slices", "slices-slices"),
    defect("a vector that there is not", (": (right + 1u)", ": (right + 9u)"), "prove_self_test", "self-test-self_test"),
    defect("duty limits too wide", ("constructs_clamp(v16, 0.3f, 0.67999995f)", "constructs_clamp(v16, 0.3f, 0.7f)"), "prove_damaged", "damaged-duty"),
    defect("another fallback", ("constructs_select(usable, v17, 0.02f)", "constructs_select(usable, v17, 0.2f)"), "prove_damaged", "damaged-duty"),
    defect("a status bit without a meaning", ("(f19 << 7)", "(f19 << 9)"), "prove_damaged", "damaged-status"),
    defect("a duty behind the table", ("constructs_duties[index]", "constructs_duties[index + 1u]"), "prove_step", "step-runs"),
    defect("more held samples than signals", ("i < CONSTRUCTS_SIGNALS", "i <= CONSTRUCTS_SIGNALS"), "prove_step", "step-runs"),
    defect("the bad count goes on", ("(state->bad_count <= 3u) ?", "(state->bad_count <= 4u) ?"), "prove_step", "step-counters"),
    defect("a held sample out of range", ("(measured->v_out <= 80.0f)", "(measured->v_out <= 90.0f)"), "prove_step", "step-held"),
    defect("an integrator without its clamp", ("constructs_clamp(v43, -0.02f, 0.03f)", "v43"), "prove_step", "step-state"),
    defect("a soft start beyond its end", ("(v0 > 0.67999995f) ? 0.67999995f : v0", "v0"), "prove_step", "step-state"),
    defect("a sound state called damaged", ("(front->sound != 0u) ? front->usable : 2u", "front->usable + 2u"), "prove_step", "step-counters"),
    defect("reset beyond the memories", ("i < 15u", "i < 16u"), "prove_others", "others-runs"),
    defect("a start outside of the limits", ("state->previous_command = 0.45f", "state->previous_command = 4.5f"), "prove_others", "others-reset"),
    defect("a CRC that is not set", ("    span.crc = (from == 0u) ? 0xFFFFFFFFu : check->crc;\n", ""), "prove_others", "others-runs"),
    defect("a shift by the width", ("(crc >> 4)", "(crc >> 32)"), "prove_others", "others-runs"),
    defect("a slice behind a table", ("(inside < length) ? inside : length", "inside"), "prove_others", "others-runs"),
    defect("an answer that there is not", ("return accepted;", "return accepted + 1u;"), "prove_others", "others-mapping"),
    defect("a division by zero", ("x / (1.0f + constructs_magnitude(x))", "x / constructs_magnitude(x)"), "prove_q_values", "q-values-finite"),
    defect("an index that starts outside of the actions", ("uint32_t index = 0u;", "uint32_t index = 4294967295u;"), "prove_choose", "choose-index"),
    defect("a range of the self test that is never written", ("    span.to = CONSTRUCTS_ACTIONS;\n", ""), "prove_self_test", "self-test-runs"),
    defect("a damaged state that heals unseen", ("(uint32_t)0 - front->sound);\n#if", "(uint32_t)1 - front->sound);\n#if"), "prove_marked", "marked-kept"),
];

/// What a plain run tries: half of the drivers, a few seconds each.
const PLAIN: usize = 4;

/// Those of several outputs; a plain run takes the first two.
#[rustfmt::skip]
const OF_SEVERAL: [Defect; 9] = [
    defect("columns beyond those of the network", ("legs_greedy(&outputs[1], 2u)", "legs_greedy(&outputs[2], 2u)"), "prove_step", "step-runs"),
    defect("one output without its fallback", ("legs_select(usable, v37, 0.0f)", "v37"), "prove_marked", "marked-marked"),
    defect("soft caps exchanged", ("state->soft_cap_left = v3;", "state->soft_cap_left = v7;"), "prove_step", "step-state"),
    defect("fallback of the other output", ("legs_select(usable, v20, 0.25f)", "legs_select(usable, v20, 0.0f)"), "prove_damaged", "damaged-duty.left"),
    defect("limits of the other output", ("legs_clamp(v19, 0.2f, 0.79999995f)", "legs_clamp(v19, 0.1f, 0.9f)"), "prove_damaged", "damaged-duty.left"),
    defect("a place behind the command", ("command->duty[1] =", "command->duty[2] ="), "prove_step", "step-runs"),
    defect("an index of the wrong table", ("command->action_index[0] = 0u", "command->action_index[0] = index1"), "prove_damaged", "damaged-action.left"),
    defect("start of the other output", ("state->soft_cap_left = 0.2f", "state->soft_cap_left = 0.1f"), "prove_others", "others-reset"),
    defect("an answer of one mapping that there is not", ("        state->mapping_check_right = 0x4B4B4B4Bu ^ legs_bits(a) ^ legs_bits(b) ^ legs_bits(c);\n    }\n    return accepted;", "    }\n    return accepted + 1u;"), "prove_others", "others-mapping.right"),
];

#[test]
fn no_planted_defect_is_proved() {
    let count = if tests::full() { DEFECTS.len() } else { PLAIN };
    plant("tests/golden/cases/constructs", &DEFECTS[..count]);
}

#[test]
fn no_planted_defect_of_several_outputs_is_proved() {
    let count = if tests::full() { OF_SEVERAL.len() } else { 2 };
    plant("tests/fixtures/legs", &OF_SEVERAL[..count]);
}

fn plant(path: &str, defects: &[Defect]) {
    let policy = in_format(path, NumericFormat::F32);
    let good = sources(&policy);
    for Defect {
        what,
        edit,
        driver,
        claim,
    } in defects
    {
        let mut files = good.clone();
        let text = files.get_mut(&format!("{}.c", policy.name)).unwrap();
        assert_eq!(text.matches(edit.0).count(), 1, "{what}: `{}`", edit.0);
        *text = text.replace(edit.0, edit.1);
        let claims = watched(|watch| eva::prove_sources(task(&policy), &files, Some(driver), watch)).unwrap();
        let own: Vec<_> = claims.iter().filter(|own| own.name == *claim).collect();
        let names: Vec<_> = claims.iter().map(|claim| &claim.name).collect();
        assert_eq!(own.len(), 1, "{what}: {claim} in {names:?}");
        let verdict = own[0].verdict;
        assert!(
            matches!(verdict, Verdict::Unproven | Verdict::Refuted),
            "{what}: {claim} is {}",
            verdict.words()
        );
    }
}

/// The overflow of a sum of integers is a claim of the integer formats alone.
#[test]
fn a_sum_that_overflows_is_not_proved() {
    // those of `activations` are behind both forms of GELU and a softplus: there Eva is told where values of the curve lie
    for (path, layer) in [
        ("tests/golden/cases/minimal", 0),
        ("tests/golden/cases/activations", 2),
        ("tests/golden/cases/activations", 3),
        ("tests/golden/cases/activations", 6),
    ] {
        let policy = in_format(path, NumericFormat::I16);
        let mut files = sources(&policy);
        let text = files.get_mut(&format!("{}.c", policy.name)).unwrap();
        let first = text.find(&format!("_bias{layer}[")).unwrap();
        let value = first + text[first..].find("{\n").unwrap() + 2;
        let end = value + text[value..].find(',').unwrap();
        text.replace_range(value..end, "2147483647");
        let claims = watched(|watch| eva::prove_sources(task(&policy), &files, Some("prove_network"), watch)).unwrap();
        let claim = claims.iter().find(|claim| claim.name == "network-runs").unwrap();
        assert_eq!(claim.verdict, Verdict::Unproven, "layer {layer}");
        assert!(
            claim.details.iter().any(|detail| detail.contains("overflow")),
            "{:?}",
            claim.details
        );
    }
}
