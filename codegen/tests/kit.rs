//! The words of a kit's moves: what the C program reads at which place, counted by hand from the order that a move has. Bits of the
//! measurement, of each duty, of each duty before the mapping, the actions, the status, a checksum of the rest; a number of
//! binary64 takes two words.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;
use codegen::Output;
use codegen::backend::kit::{Material, Trace};
use common::*;
use policy::Policy;

/// Lines of the kit of a policy without moves.
fn kit(policy: &Policy) -> Vec<String> {
    let material = Material {
        policy: Trace::default(),
        suite: Vec::new(),
        asked: 0,
    };
    let files = codegen::generate(policy, target("host"), &[Output::Kit], Some(&material)).unwrap();
    let text = &files.files[&format!("{}_kit.c", policy.name)];
    text.lines().map(|line| line.trim().to_owned()).collect()
}

/// These lines stand in the kit, in this order.
#[track_caller]
fn assert_lines(kit: &[String], expected: &[&str]) {
    let mut from = 0;
    for line in expected {
        let at = kit[from..].iter().position(|found| found == line);
        from += at.unwrap_or_else(|| panic!("`{line}` is not behind line {from}")) + 1;
    }
}

/// Two signals, five features and three outputs, of which the first has a mapping.
#[test]
fn words_of_binary32_are_counted_one_by_one() {
    let policy = case("legs");
    let kit = kit(&policy);
    // two counters of 4 bytes stand behind the numbers
    let numbers = (codegen::manifest::sizes(&policy, target("host")).state_bytes - 8) / 4;
    assert_lines(
        &kit,
        &[
            "memcpy(&measured.v_out, &word[0], sizeof(measured.v_out));",
            "memcpy(&measured.i_out, &word[1], sizeof(measured.i_out));",
            "word += 2;",
            "legs_kit_check(\"legs\", \"duty left\", event, word[0], legs_kit_bits(command.duty[0]));",
            "legs_kit_check(\"legs\", \"duty right\", event, word[1], legs_kit_bits(command.duty[1]));",
            "legs_kit_check(\"legs\", \"duty spare\", event, word[2], legs_kit_bits(command.duty[2]));",
            "legs_kit_check(\"legs\", \"duty left before the mapping\", event, word[3], legs_kit_bits(command.duty_sim[0]));",
            "legs_kit_check(\"legs\", \"duty right before the mapping\", event, word[4], legs_kit_bits(command.duty_sim[1]));",
            "legs_kit_check(\"legs\", \"duty spare before the mapping\", event, word[5], legs_kit_bits(command.duty_sim[2]));",
            "legs_kit_check(\"legs\", \"action left\", event, word[6], command.action_index[0]);",
            "legs_kit_check(\"legs\", \"action right\", event, word[7], command.action_index[1]);",
            "legs_kit_check(\"legs\", \"action spare\", event, word[8], command.action_index[2]);",
            "legs_kit_check(\"legs\", \"status\", event, word[9], command.status);",
            "legs_kit_check(\"legs\", \"duty left of eval\", event, word[0], legs_kit_bits(first.duty[0]));",
            "legs_kit_check(\"legs\", \"duty right of eval\", event, word[1], legs_kit_bits(first.duty[1]));",
            "legs_kit_check(\"legs\", \"duty spare of eval\", event, word[2], legs_kit_bits(first.duty[2]));",
            "crc = legs_kit_crc(0xFFFFFFFFu, observation, are_numbers * LEGS_FEATURES);",
            "crc = legs_kit_crc(crc, q, are_numbers * LEGS_ACTIONS);",
            "crc = legs_kit_crc(crc, state, LEGS_STATE_WORDS);",
            "legs_kit_check(\"legs\", \"CRC of observation, Q values, state\", event, word[10], crc ^ 0xFFFFFFFFu);",
            "return word + 11;",
            "for (i = 0u; i < LEGS_FEATURES; ++i) {",
            "observation[i] = legs_kit_float(word[i]);",
            "legs_q_values(observation, q);",
            "legs_kit_check(\"legs\", \"CRC of Q values of an observation\", event, word[5], legs_kit_crc(0xFFFFFFFFu, q, \
             LEGS_ACTIONS) ^ 0xFFFFFFFFu);",
            "return word + 6;",
            "const float a = legs_kit_float(word[0]);",
            "const float b = legs_kit_float(word[1]);",
            "const float c = legs_kit_float(word[2]);",
            "const float r = legs_kit_float(word[3]);",
            "const uint32_t accepted = legs_set_mapping_left(state, a, b, c, r);",
            "legs_kit_check(\"legs\", \"mapping of left accepted\", event, word[4], accepted);",
            "return word + 5;",
            "if (kind == 1u) {",
            &format!("legs_kit_damage(&state, {numbers}u, word[0], word[1]);"),
        ],
    );
}

/// `v_out` and `i_out` are numbers of two words, `i_l` is the code of a converter: one.
#[test]
fn words_of_binary64_are_counted_in_pairs() {
    let policy = case("wide");
    let kit = kit(&policy);
    // two counters of 4 bytes stand behind the numbers
    let numbers = (codegen::manifest::sizes(&policy, target("host")).state_bytes - 8) / 8;
    let state = |member: &str, start: &str, state: &str| {
        format!(
            "wide_kit_crc(wide_kit_crc(wide_kit_crc_numbers({start}, {state}, {numbers}u), &{member}bad_count, 1u), \
             &{member}primed, 1u)"
        )
    };
    assert_lines(
        &kit,
        &[
            "measured.v_out = wide_kit_number(&word[0]);",
            "memcpy(&measured.i_l, &word[2], sizeof(measured.i_l));",
            "measured.i_out = wide_kit_number(&word[3]);",
            "word += 5;",
            "wide_kit_check_bits(\"wide\", \"duty\", event, &word[0], wide_kit_bits(command.duty));",
            "wide_kit_check_bits(\"wide\", \"duty before the mapping\", event, &word[2], wide_kit_bits(command.duty_sim));",
            "wide_kit_check(\"wide\", \"action\", event, word[4], command.action_index);",
            "wide_kit_check(\"wide\", \"status\", event, word[5], command.status);",
            "wide_kit_check_bits(\"wide\", \"duty of eval\", event, &word[0], wide_kit_bits(first.duty));",
            "crc = wide_kit_crc_numbers(0xFFFFFFFFu, observation, are_numbers * WIDE_FEATURES);",
            "crc = wide_kit_crc_numbers(crc, q, are_numbers * WIDE_ACTIONS);",
            &format!("crc = {};", state("state->", "crc", "state")),
            "wide_kit_check(\"wide\", \"CRC of observation, Q values, state\", event, word[6], crc ^ 0xFFFFFFFFu);",
            "return word + 7;",
            "observation[i] = wide_kit_number(&word[2u * i]);",
            "wide_q_values(observation, q);",
            // twelve features
            "wide_kit_check(\"wide\", \"CRC of Q values of an observation\", event, word[24], wide_kit_crc_numbers(0xFFFFFFFFu, \
             q, WIDE_ACTIONS) ^ 0xFFFFFFFFu);",
            "return word + 25;",
            "const double a = wide_kit_number(&word[0]);",
            "const double b = wide_kit_number(&word[2]);",
            "const double c = wide_kit_number(&word[4]);",
            "const double r = wide_kit_number(&word[6]);",
            "const uint32_t accepted = wide_set_mapping(state, a, b, c, r);",
            "wide_kit_check(\"wide\", \"mapping accepted\", event, word[8], accepted);",
            "return word + 9;",
            "if (kind == 1u) {",
            &format!("wide_kit_damage(&state, {numbers}u, word[0], word[1]);"),
        ],
    );
    let whole = kit.join("\n");
    assert!(whole.contains(&state("state.", "0xFFFFFFFFu", "&state")));
}
