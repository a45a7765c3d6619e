//! Defects planted in emitted code: each is refuted by the goal that is about it.

use equivalence::Verdict;

use super::{Code, load, run, solver};

/// Where a defect is planted.
#[derive(Clone, Copy)]
enum In {
    C,
    Rust,
}

struct Defect {
    policy: &'static str,
    language: In,
    what: &'static str,
    /// The text, once in the file, and what it becomes.
    edit: (&'static str, &'static str),
    /// The goal that has to be refuted.
    goal: &'static str,
}

const ADC: &str = "tests/golden/cases/adc_mapping";
const FILTERS: &str = "tests/golden/cases/filters";
/// An integrator with a leak.
const LINEAR: &str = "tests/golden/cases/linear";
/// Two outputs: a duty in the first column, a choice in the others.
const LEGS: &str = "tests/fixtures/legs";
/// A law whose gains the network gives.
const GAINS: &str = "tests/golden/cases/scheduled";

const fn c(policy: &'static str, what: &'static str, edit: (&'static str, &'static str), goal: &'static str) -> Defect {
    Defect {
        policy,
        language: In::C,
        what,
        edit,
        goal,
    }
}

const fn rust(
    policy: &'static str,
    what: &'static str,
    edit: (&'static str, &'static str),
    goal: &'static str,
) -> Defect {
    Defect {
        policy,
        language: In::Rust,
        what,
        edit,
        goal,
    }
}

/// Defects that a plain run proves, too: the first of the list.
const PLAIN: usize = 13;

/// One a language and kind first: a plain run takes the first of them.
#[rustfmt::skip]
const DEFECTS: [Defect; 70] = [
    c(ADC, "argmax inverted", ("output > best", "output < best"), "c.action_index"),
    rust(ADC, "tie to the highest index", ("*q > best", "*q >= best"), "rust.action_index"),
    c(ADC, "off by one in the bad count", ("flag(state->bad_count <= 4u)", "flag(state->bad_count <= 5u)"), "c.commit.counters"),
    rust(ADC, "stale held samples", ("self.held = front.signal;", ""), "rust.commit.held"),
    c(FILTERS, "filter coefficient", ("v15 * 0.04761905f", "v15 * 0.0476191f"), "c.observation"),
    rust(FILTERS, "line one word too short", (".take(20).rev()", ".take(19).rev()"), "rust.commit.memory"),
    c(LINEAR, "leak left out", ("v4 * 0.998f", "v4"), "c.observation"),
    rust(LINEAR, "leak on the sum", ("let v8: f32 = v6 + v7", "let v8: f32 = (v5 + v7) * 0.998"), "rust.observation"),
    c(LEGS, "wrong column of a choice", ("legs_greedy(&outputs[1], 2u)", "legs_greedy(&outputs[0], 2u)"), "c.action_index.right"),
    c(LEGS, "fallback of one output alone", ("command->duty[1] = legs_select(usable, v37, 0.0f)", "command->duty[1] = legs_select(legs_flag((int)(front->usable & front->sound & ~(uint32_t)(legs_far(v37, 0x7F800000u) >> 31))), v37, 0.0f)"), "c.duty.right"),
    c(LEGS, "a status bit of one output left out", ("\n                          | (f34 << 5)", ""), "c.status"),
    rust(LEGS, "coefficient of the other mapping", ("self.mapping_b_right * front", "self.mapping_b_left * front"), "rust.duty.right"),
    rust(LEGS, "soft caps exchanged", ("self.soft_cap_left = v3;\n        self.soft_cap_right = v7;", "self.soft_cap_left = v7;\n        self.soft_cap_right = v3;"), "rust.commit.soft_cap.left"),
    c(GAINS, "products added in another order", ("v10 = v5 + v9", "v10 = front->base + (v4 + v9)"), "c.duty_sim"),
    rust(GAINS, "limits of a gain left out", ("clamp(v2, 0.004, 0.02)", "v2"), "rust.duty_sim"),
    c(GAINS, "sign of a gain", ("v15 * -0.05f", "v15 * 0.05f"), "c.duty_sim"),
    c(GAINS, "gains exchanged", ("scheduled_tanh(outputs[0])", "scheduled_tanh(outputs[3])"), "c.duty_sim"),
    c(GAINS, "a factor behind its scale", ("front->factor[1] = ", "front->factor[1] = 200.0f * "), "c.duty_sim"),
    rust(GAINS, "dead zone left out", ("select(front.still, front.base, v17)", "v17"), "rust.duty_sim"),
    rust(GAINS, "base left out", ("front.base + v4", "v4"), "rust.duty_sim"),
    c(ADC, "missing clip", ("adc_mapping_clamp(v10, -4.0f, 4.0f)", "v10"), "c.observation"),
    c(ADC, "tie to the highest index", ("output > best", "output >= best"), "c.action_index"),
    c(ADC, "wrong status bit", ("front->clipped << 3", "front->clipped << 4"), "c.status"),
    c(ADC, "limits swapped", ("adc_mapping_clamp(v16, 0.05f, 0.9f)", "adc_mapping_clamp(v16, 0.9f, 0.05f)"), "c.duty"),
    c(ADC, "sign of the slew limit", ("state->previous_command - 0.02f", "state->previous_command + 0.02f"), "c.duty"),
    c(ADC, "mapping coefficients exchanged", ("state->mapping_b * front", "state->mapping_r * front"), "c.duty"),
    c(ADC, "stale previous duty", ("state->previous_duty = command->duty_sim", "state->previous_duty = state->previous_duty"), "c.commit.remembered"),
    c(ADC, "fallback missing", ("adc_mapping_select(usable, v17, 0.0f)", "v17"), "c.duty"),
    c(ADC, "soft start goes on after a fallback", ("adc_mapping_select(front->usable, v2, 0.1f)", "v2"), "c.commit.soft_cap"),
    c(ADC, "damaged state not marked", ("(front->usable + (uint32_t)2) - (front->sound << 1)", "front->usable"), "c.commit.counters"),
    c(ADC, "primed not asked", ("| ((uint32_t)1 - state->primed) | state->primed;", ";"), "c.status"),
    c(LINEAR, "leak on the sum", ("v7 = v5 + v6", "v7 = (v4 + v6) * 0.998f"), "c.observation"),
    c(ADC, "a coefficient not guarded", ("state->mapping_check ^ 0x4B4B4B4Bu ^ adc_mapping_bits(state->mapping_a)", "state->mapping_check ^ 0x4B4B4B4Bu"), "c.status"),
    c(ADC, "the check word of old coefficients", ("state->mapping_check = 0x4B4B4B4Bu ^ adc_mapping_bits(a)", "state->mapping_check = 0x4B4B4B4Bu ^ adc_mapping_bits(state->mapping_b)"), "c.set_mapping"),
    c(ADC, "coefficient accepted too far", ("adc_mapping_within(a, 0.8f, 1.25f)", "adc_mapping_within(a, 0.8f, 1.5f)"), "c.set_mapping"),
    c(ADC, "sign of a coefficient at the start", ("state->mapping_b = -0.0015f", "state->mapping_b = 0.0015f"), "c.init"),
    c(FILTERS, "wrong feature order", ("front->observation[0] = v8;", "front->observation[0] = v13;"), "c.observation"),
    c(FILTERS, "delay one period too short", ("state->memory[0], v5)", "state->memory[1], v5)"), "c.observation"),
    c(FILTERS, "line not moved", ("state->memory[i] = filters_select(primed, state->memory[i + 1u], push0)", "state->memory[i] = filters_select(primed, state->memory[i], push0)"), "c.commit.memory"),
    rust(ADC, "missing clip", ("clamp(v10, -4.0, 4.0)", "v10"), "rust.observation"),
    rust(ADC, "argmax inverted", ("*q > best", "*q < best"), "rust.action_index"),
    rust(ADC, "wrong status bit", ("(front.held << 0)", "(front.held << 1)"), "rust.status"),
    rust(ADC, "off by one in the bad count", ("flag(self.bad_count <= 4)", "flag(self.bad_count < 4)"), "rust.commit.counters"),
    rust(ADC, "limits swapped", ("clamp(v16, 0.05, 0.9)", "clamp(v16, 0.9, 0.05)"), "rust.duty"),
    rust(ADC, "sign of the slew limit", ("self.previous_command - 0.02", "self.previous_command + 0.02"), "rust.duty"),
    rust(ADC, "mapping coefficients exchanged", ("self.mapping_a * chosen", "self.mapping_c * chosen"), "rust.duty"),
    rust(ADC, "duty before the mapping remembered as the command", ("self.previous_command = command.duty;", "self.previous_command = command.duty_sim;"), "rust.commit.remembered"),
    rust(ADC, "fallback missing", ("select(usable, chosen, 0.0)", "chosen"), "rust.duty_sim"),
    rust(ADC, "index of a damaged state", ("action_index & 0_u32.wrapping_sub(trusted)", "action_index"), "rust.action_index"),
    rust(ADC, "held one period too short", ("flag(bad_count <= 4)", "flag(bad_count <= 3)"), "rust.status"),
    rust(ADC, "the sign of the bad count not asked", ("wrapping_sub(self.bad_count) | self.bad_count", "wrapping_sub(self.bad_count)"), "rust.status"),
    rust(ADC, "the bad count not asked at its end", ("stray | 5u32.wrapping_sub(self.bad_count)", "stray"), "rust.status"),
    rust(ADC, "the check word not asked", ("any(self.mapping_flips() | (self.primed >> 1))", "any(self.primed >> 1)"), "rust.status"),
    rust(ADC, "primed not asked", ("any(self.mapping_flips() | (self.primed >> 1))", "any(self.mapping_flips())"), "rust.status"),
    rust(LINEAR, "leak left out", ("v5 * 0.998", "v5"), "rust.observation"),
    rust(ADC, "reset forgets a coefficient", ("mapping_a: self.mapping_a,", ""), "rust.reset"),
    rust(FILTERS, "limit of an integrator", ("clamp(v38, -0.5, 0.75)", "clamp(v38, -0.75, 0.75)"), "rust.observation"),
    rust(FILTERS, "the newest sample left out of a mean", ("sum + newest", "sum"), "rust.observation"),
    c(LEGS, "column of another output", ("legs_tanh(outputs[0])", "legs_tanh(outputs[1])"), "c.duty_sim.left"),
    c(LEGS, "limiter of the other output", ("state->previous_command_right - 0.049999997f", "state->previous_command_left - 0.049999997f"), "c.duty.right"),
    c(LEGS, "soft start of the other output", ("legs_flag(v32 > state->soft_cap_right)", "legs_flag(v32 > state->soft_cap_left)"), "c.status"),
    c(LEGS, "remembered duties exchanged", ("state->previous_command_left = command->duty[0]", "state->previous_command_left = command->duty[1]"), "c.commit.remembered.left"),
    c(LEGS, "a mapping written over the other", ("        state->mapping_a_right = a;", "        state->mapping_a_left = a;"), "c.set_mapping.right"),
    c(LEGS, "a check word of one output not asked", ("legs_any(legs_mapping_flips_right(state))", "legs_any(legs_mapping_flips_left(state))"), "c.status"),
    c(LEGS, "start of the other output", ("state->soft_cap_right = 0.1f", "state->soft_cap_right = 0.2f"), "c.reset"),
    c(LEGS, "one output not asked for a number", (" | legs_far(v37, 0x7F800000u)", ""), "c.duty.left"),
    rust(LEGS, "columns in another order", ("greedy([outputs[1], outputs[2]], &DUTIES1)", "greedy([outputs[2], outputs[1]], &DUTIES1)"), "rust.action_index.right"),
    rust(LEGS, "fallback of the other output", ("select(usable, v20, 0.25), select(usable, v37, 0.0)", "select(usable, v20, 0.0), select(usable, v37, 0.25)"), "rust.duty.left"),
    rust(LEGS, "one output not asked for a number", ("(v20.to_bits() >> 30) | (v37.to_bits() >> 30)", "v20.to_bits() >> 30"), "rust.duty.left"),
    rust(LEGS, "a source reads the other output", ("self.previous_command_right * 10.0", "self.previous_command_left * 10.0"), "rust.observation"),
];

impl Defect {
    /// The text in which it is planted.
    fn place<'c>(&self, code: &'c mut Code) -> &'c mut String {
        match self.language {
            In::C => &mut code.c,
            In::Rust => &mut code.rust,
        }
    }

    fn is_refuted(&self) -> Verdict {
        let Some(solver) = solver() else {
            return Verdict::NotRun("no solver".into());
        };
        let policy = load(self.policy);
        let mut code = Code::of(&policy);
        let text = self.place(&mut code);
        let (from, to) = self.edit;
        *text = text.replace(from, to);
        let goals: Vec<_> = code
            .goals(&policy)
            .into_iter()
            .filter(|goal| goal.name == self.goal)
            .collect();
        assert_eq!(goals.len(), 1, "{}: the goal {}", self.what, self.goal);
        run(&goals, &solver).remove(0).verdict
    }
}

/// All of them, in a plain run, too: an edit of a template must not leave a defect that is planted nowhere.
#[test]
fn every_defect_has_one_place_in_the_emitted_code() {
    let mut emitted = [ADC, FILTERS, LINEAR, GAINS, LEGS].map(|policy| (policy, Code::of(&load(policy))));
    let mut lost = Vec::new();
    for defect in &DEFECTS {
        let (_, code) = emitted.iter_mut().find(|(policy, _)| *policy == defect.policy).unwrap();
        let (from, to) = defect.edit;
        let count = defect.place(code).matches(from).count();
        if count != 1 || from == to {
            lost.push(format!(
                "{} in {}: `{from}` is there {count} times",
                defect.what, defect.policy
            ));
        }
    }
    assert!(lost.is_empty(), "{}", lost.join("\n"));
}

#[test]
fn every_planted_defect_is_refuted() {
    let count = if tests::full() { DEFECTS.len() } else { PLAIN };
    let mut open = Vec::new();
    for defect in &DEFECTS[..count] {
        match defect.is_refuted() {
            Verdict::Refuted(model) => assert!(model.len() > 1, "{}: a counterexample in words", defect.what),
            Verdict::NotRun(_) => return,
            other => open.push(format!("{} in {}: {other:?}", defect.what, defect.goal)),
        }
    }
    assert!(open.is_empty(), "{}", open.join("\n"));
}
