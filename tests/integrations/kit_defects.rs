//! The back-to-back kit fails for a controller with a defect: edits of the generated C, each of one kind.

use codegen::Output;
use policy::Policy;

use super::kit::{STEPS, sources};
use super::{Ran, build, build_silently, example, files, golden_case, legs, run_program, write};

/// Runs the kit with an edited core.
fn edited(policy: &Policy, edits: &[(&str, &str)]) -> Vec<Ran> {
    let folder = tempfile::tempdir().unwrap();
    let files = files(policy, Output::Kit, STEPS);
    write(&files, folder.path());
    let [core, kit] = sources(policy);
    let built = build(&["gcc", "-O1", "-c"], &[&kit], folder.path());
    assert_eq!(built.code, Some(0), "{}", built.stderr);
    std::fs::rename(folder.path().join("program"), folder.path().join("kit.o")).unwrap();
    let run_one = |(from, to): &(&str, &str)| {
        assert!(files[&core].contains(from), "{from}");
        std::fs::write(folder.path().join(&core), files[&core].replacen(from, to, 1)).unwrap();
        build_silently(&["gcc", "-O1"], &[&core, "kit.o"], folder.path());
        run_program(None, folder.path())
    };
    edits.iter().map(run_one).collect()
}

/// Each edit alone makes the kit fail.
fn all_fail(policy: &Policy, edits: &[(&str, &str)]) {
    for (ran, (from, to)) in edited(policy, edits).into_iter().zip(edits) {
        assert!(
            ran.code == Some(1) && ran.stdout.contains("FAIL"),
            "{from} => {to}: {ran:?}"
        );
    }
}

pub fn first_literal(text: &str, table: &str) -> String {
    let start = text.find(table).unwrap();
    let open = start + text[start..].find("{\n").unwrap() + 1;
    text[open..].split(',').next().unwrap().trim().to_owned()
}

/// The literal with its lowest bit changed.
pub fn flipped(literal: &str) -> String {
    let value: f32 = literal.trim_end_matches('f').parse().unwrap();
    format!("{:e}f", f32::from_bits(value.to_bits() ^ 1))
}

/// A number that a core in binary64 rounds to binary32 on its way.
#[test]
fn a_number_of_half_the_width_fails() {
    let policy = golden_case("wide");
    for ran in edited(
        &policy,
        &[
            ("front->observation[0] = ", "front->observation[0] = (double)(float)"),
            ("command->duty_sim = ", "command->duty_sim = (double)(float)"),
            ("state->held[i] = ", "state->held[i] = (double)(float)"),
        ],
    ) {
        assert_eq!(ran.code, Some(1), "{ran:?}");
        assert!(ran.stdout.contains("FAIL"), "{ran:?}");
    }
}

#[test]
fn a_flipped_weight_bit_fails() {
    let policy = example();
    let text = files(&policy, Output::Kit, STEPS)["buck12.c"].clone();
    let literal = first_literal(&text, "buck12_weights0[");
    let ran = edited(&policy, &[(&literal, &flipped(&literal))]).remove(0);
    assert_eq!(ran.code, Some(1), "{ran:?}");
    assert!(ran.stdout.starts_with("buck12: FAIL: "), "{ran:?}");
    let failed = ran.stdout.split(' ').nth(2).unwrap().parse::<u32>().unwrap();
    // not the integrity check alone: the known answers and the moves see it as well
    assert!(failed > 2, "{ran:?}");
}

#[test]
fn an_edited_constant_of_mapping_limits_or_status_fails() {
    let policy = golden_case("adc_mapping");
    let edits = [
        (
            "state->previous_command = 0.1f;",
            "state->previous_command = 0.1000001f;",
        ),
        ("0.083333336f", "0.08333334f"),
        (
            "ADC_MAPPING_STATUS_FALLBACK & (usable",
            "ADC_MAPPING_STATUS_HELD & (usable",
        ),
        ("state->mapping_r = r;", "state->mapping_r = a;"),
        (
            "state->held[i] = front->signal[i];",
            "state->held[0] = front->signal[0];",
        ),
    ];
    all_fail(&policy, &edits);
}

/// What a random run of some hundred steps meets seldom or never: limits far from the actions, the last bridged sample, the
/// end of a range, equal values of two actions, a state that is not sound, a coefficient that another check word stands
/// beside, the clip end of what a filter remembers, the number of a self-test vector, the position of a sliced check, a
/// checksum that is compared by order.
#[test]
fn an_edit_where_random_moves_seldom_come_fails() {
    let policy = example();
    let edits = [
        ("(v3, 0.4f, 0.59999996f)", "(v3, 0.38f, 0.59999996f)"),
        ("(v3, 0.4f, 0.59999996f)", "(v3, 0.4f, 0.62f)"),
        (
            "state->primed & buck12_flag(bad_count <= 3u)",
            "state->primed & buck12_flag(bad_count <= 4u)",
        ),
        ("measured->i_out, -1.0f, 40.0f", "measured->i_out, -1.0f, 40.04f"),
        ("buck12_flag(output > best)", "buck12_flag(output >= best)"),
        ("(4u - state->bad_count) |", "(5u - state->bad_count) |"),
        ("^ buck12_bits(state->mapping_c);", ";"),
        (
            "state->mapping_check = 0x4B4B4B4Bu",
            "state->mapping_check = 0x4B4B4B4Au",
        ),
        (
            "buck12_any(buck12_mapping_flips(state))",
            "(buck12_any(buck12_mapping_flips(state)) & 1u)",
        ),
        // clip ends of what a delay remembers: no measurement reaches them within a step or from a fresh start
        ("(v13, -20.0f, 20.0f)", "(v13, -20.0f, 20.02f)"),
        ("(v26, -20.0f, 20.0f)", "(v26, -20.02f, 20.0f)"),
        ("uint32_t next = 1u;", "uint32_t next = 2u;"),
        ("next = vector + 1u;", "next = vector + 2u;"),
        // a self test that loses count, or whose end does
        ("next = vector + 1u;", "next = vector - 1u;"),
        ("(right == 16u) ?", "(right == 15u) ?"),
        ("(17u - next)", "(18u - next)"),
        ("++right;", ""),
        // a number that is never written: whatever the stack holds
        ("    span.to = BUCK12_ACTIONS;\n", ""),
        ("check->position = span.to;", ""),
        ("? check->position : 0u;", "? check->position : 1u;"),
        // the first slice that touches a table takes all of it: the answer is the same in the end
        (
            "to = buck12_place(span, span->to, length);",
            "to = ((span->from > span->first) || (span->to <= span->first)) ? 0u : length;",
        ),
        // the tables of a sound build have the right checksum: another one has to be brought along
        ("(span.crc ^ 0xFFFFFFFFu) == 0x", "(span.crc ^ 0xFFFFFFFFu) >= 0x"),
        ("(span.crc ^ 0xFFFFFFFFu) == 0x", "(span.crc ^ 0xFFFFFFFFu) <= 0x"),
    ];
    all_fail(&policy, &edits);
}

/// What no sound state reaches, or one number alone: a clip end behind a held number that is far outside, two clip words of which one
/// memory sets one, a duty that is no number, a number that no step reads, two counters that hide each other.
#[test]
fn an_edit_where_one_number_of_the_state_alone_leads_fails() {
    let edits = [
        ("f34 = f11 | f15", "f34 = f11 & f15"),
        ("~(uint32_t)(stray >> 31)", "~(uint32_t)(stray << 31)"),
        ("(v18, -20.0f, 20.0f)", "(v18, -19.98f, 20.0f)"),
        ("_line_far(&state->memory[0], 2u", "_line_far(&state->memory[0], 3u"),
        (
            "(4u - state->bad_count) | state->bad_count |",
            "(4u - state->bad_count) ^ state->bad_count |",
        ),
    ];
    all_fail(&example(), &edits);
}

/// An argmax that starts at a number which every Q value lies below in some step, and an activation that leaves out one neuron.
#[test]
fn an_argmax_that_starts_too_high_and_a_neuron_without_its_activation_fail() {
    let start = |number| ("float best = -3.40282347e+38f;", number);
    let edits = [
        start("float best = -3.40282347e-38f;"),
        start("float best = 0.0f;"),
        start("float best = -0.02f;"),
        (
            "o < 5u; ++o) {\n        y[o] = constructs_elu",
            "o < 4u; ++o) {\n        y[o] = constructs_elu",
        ),
        (
            "(o = 0u; o < 4u; ++o) {\n        y[o] = constructs_relu",
            "(o = 1u; o < 4u; ++o) {\n        y[o] = constructs_relu",
        ),
    ];
    all_fail(&golden_case("constructs"), &edits);
}

/// Each neuron of each layer gives another number on one side of 0 of its sum, and each action never wins.
#[test]
fn a_neuron_that_is_wrong_on_one_side_and_an_action_that_never_wins_fail() {
    let policy = golden_case("constructs");
    let mut edits = Vec::new();
    for layer in policy.layers.iter().filter(|layer| !layer.activation.is_identity()) {
        let call = match layer.activation.parameter() {
            Some((_, parameter)) => format!("constructs_{}(y[o], {parameter}f)", layer.activation.word()),
            None => format!("constructs_{}(y[o])", layer.activation.word()),
        };
        for (neuron, sign) in (0..layer.outputs).flat_map(|neuron| [(neuron, '<'), (neuron, '>')]) {
            let wrong = format!("y[o] = ((o == {neuron}u) && (y[o] {sign} 0.0f)) ? 0.75f : {call};");
            edits.push((format!("y[o] = {call};"), wrong));
        }
    }
    let sums: usize = policy.layers.iter().rev().skip(1).map(|layer| layer.outputs).sum();
    assert_eq!(edits.len(), 2 * sums);
    edits.extend((0..policy.outputs()).map(|action| {
        let never = format!("const float output = (action == {action}u) ? -9.0f : q[action];");
        ("const float output = q[action];".to_owned(), never)
    }));
    // each costs a run of the compiler
    let stride = if tests::full() { 1 } else { 7 };
    let edits: Vec<(&str, &str)> = edits
        .iter()
        .step_by(stride)
        .map(|(from, to)| (from.as_str(), to.as_str()))
        .collect();
    all_fail(&policy, &edits);
}

/// Two clips of the same bits in one step: what has to be looked for.
#[test]
fn clips_that_are_wrongly_joined_fail() {
    all_fail(&golden_case("constructs"), &[("f62 = f13 | f23", "f62 = f13 ^ f23")]);
}

/// A duty that lies within its limits but for the sign, and a cap that is the duty itself.
#[test]
fn an_edit_at_a_mirrored_duty_or_an_equal_cap_fails() {
    let edits = [
        ("return above | (width - above);", "return above ^ (width - above);"),
        ("_flag(v12 > state->soft_cap)", "_flag(v12 >= state->soft_cap)"),
    ];
    all_fail(&golden_case("constructs"), &edits);
}

/// A term of the guard joined by an exclusive or shows where its neighbour is outside as well.
#[test]
fn a_guard_that_joins_its_terms_wrongly_fails() {
    let edits = [
        ("| buck12_aside(state->held[2]", "^ buck12_aside(state->held[2]"),
        ("stray |= ", "stray ^= "),
    ];
    all_fail(&example(), &edits);
}

/// A cap that ends 0.1 % too early shows where one more step comes just below the upper limit of the duty.
#[test]
fn a_soft_start_that_ends_early_or_late_fails() {
    let edits = [
        ("_flag(v0 > 0.67999995f)", "_flag(v0 > 0.67932f)"),
        ("_flag(v0 > 0.67999995f)", "_flag(v0 > 0.68068f)"),
    ];
    all_fail(&golden_case("constructs"), &edits);
}

/// Each of these leaves the first output as it is, apart from the last, which would show in the status word alone.
#[test]
fn a_defect_in_an_output_that_is_not_the_first_fails() {
    let policy = legs("constructs");
    let edits = [
        (
            "constructs_greedy(&outputs[2], 2u)",
            "constructs_greedy(&outputs[0], 2u)",
        ),
        (
            "constructs_greedy(&outputs[2], 2u)",
            "constructs_greedy(&outputs[1], 2u)",
        ),
        ("command->duty[1];", "command->duty[0];"),
        ("= command->duty_sim[1];", "= command->duty_sim[0];"),
        ("= command->duty[2];", "= command->duty_sim[2];"),
        ("state->mapping_b_right = b;", "state->mapping_b_right = a;"),
        ("^ constructs_bits(state->mapping_c_right)", ""),
        (
            "state->mapping_check_right = 0x4B4B4B4Bu",
            "state->mapping_check_right = 0x4B4B4B4Au",
        ),
        ("state->soft_cap_right = ", "state->soft_cap_left = "),
        (
            "state->previous_command_mid = 0.5f",
            "state->previous_command_mid = 0.50000006f",
        ),
    ];
    all_fail(&policy, &edits);
}
