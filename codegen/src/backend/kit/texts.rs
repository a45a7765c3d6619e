//! Statements of the kit that depend on the width of a number.

use policy::Scalar;

use crate::backend::c::duties;
use crate::program::{OutputCode, Program};

/// Statements for one controller of a kit.
pub struct Texts<'a> {
    /// Prefix of the kit's functions.
    pub kit: &'a str,
    /// The controller.
    pub program: &'a Program,
}

impl Texts<'_> {
    fn is_wide(&self) -> bool {
        self.program.scalar() == Scalar::F64
    }

    /// Assignments that fill the measurement from `word`, and how many words that takes.
    pub fn measurement(&self) -> (Vec<String>, usize) {
        let mut word = 0;
        let mut lines = Vec::new();
        for signal in &self.program.signals {
            let name = &signal.name;
            if self.is_wide() && !signal.is_code {
                // put together from two words: the table has the low one first on every processor
                lines.push(format!("measured.{name} = {}_number(&word[{word}]);", self.kit));
                word += 2;
            } else {
                lines.push(format!(
                    "memcpy(&measured.{name}, &word[{word}], sizeof(measured.{name}));"
                ));
                word += 1;
            }
        }
        (lines, word)
    }

    fn check_number(&self, what: &str, word: usize, number: &str) -> String {
        let (k, s) = (self.kit, &self.program.name);
        if self.is_wide() {
            format!("{k}_check_bits(\"{s}\", \"{what}\", event, &word[{word}], {k}_bits({number}));")
        } else {
            format!("{k}_check(\"{s}\", \"{what}\", event, word[{word}], {k}_bits({number}));")
        }
    }

    fn check(&self, what: &str, word: usize, found: &str) -> String {
        let (k, s) = (self.kit, &self.program.name);
        format!("{k}_check(\"{s}\", \"{what}\", event, word[{word}], {found});")
    }

    /// Comparisons of the command: as they stand in the trace, the duties, the duties before the mapping, the actions, status.
    pub fn answer(&self) -> Vec<String> {
        let (number, count) = (self.program.scalar().words(), self.program.outputs.len());
        let each = || self.program.outputs.iter().enumerate();
        let named = |output: &OutputCode| output.name.as_ref().map_or(String::new(), |name| format!(" {name}"));
        let place = |index: usize| duties::place(self.program, index);
        let duty = |(index, output): (usize, &OutputCode)| {
            let found = format!("command.duty{}", place(index));
            self.check_number(&format!("duty{}", named(output)), number * index, &found)
        };
        let duty_sim = |(index, output): (usize, &OutputCode)| {
            let what = format!("duty{} before the mapping", named(output));
            let found = format!("command.duty_sim{}", place(index));
            self.check_number(&what, number * (count + index), &found)
        };
        let action = |(index, output): (usize, &OutputCode)| {
            let found = format!("command.action_index{}", place(index));
            self.check(&format!("action{}", named(output)), 2 * number * count + index, &found)
        };
        let of_eval = |(index, output): (usize, &OutputCode)| {
            let what = format!("duty{} of eval", named(output));
            self.check_number(&what, number * index, &format!("first.duty{}", place(index)))
        };
        let status = self.check("status", (2 * number + 1) * count, "command.status");
        let command = each().map(duty).chain(each().map(duty_sim)).chain(each().map(action));
        command.chain([status]).chain(each().map(of_eval)).collect()
    }

    /// Checksum of the rest of the answer, its comparison, and the way to the next move.
    pub fn rest(&self) -> Vec<String> {
        let (k, u) = (self.kit, self.program.name.to_uppercase());
        let crc = if self.is_wide() { "crc_numbers" } else { "crc" };
        let last = (2 * self.program.scalar().words() + 1) * self.program.outputs.len() + 1;
        vec![
            format!("crc = {k}_{crc}(0xFFFFFFFFu, observation, are_numbers * {u}_FEATURES);"),
            format!("crc = {k}_{crc}(crc, q, are_numbers * {u}_ACTIONS);"),
            format!("crc = {};", self.state_crc("crc", "state->")),
            self.check("CRC of observation, Q values, state", last, "crc ^ 0xFFFFFFFFu"),
            format!("return word + {};", last + 1),
        ]
    }

    /// Checksum over the words of a state, from `start`; `member` is what stands before the name of a member.
    pub fn state_crc(&self, start: &str, member: &str) -> String {
        let (k, u) = (self.kit, self.program.name.to_uppercase());
        let state = if member == "state." { "&state" } else { "state" };
        if self.is_wide() {
            // the two counters stand behind the numbers
            let numbers = (self.program.state_words() - 2) / 2;
            format!(
                "{k}_crc({k}_crc({k}_crc_numbers({start}, {state}, {numbers}u), &{member}bad_count, 1u), &{member}primed, 1u)"
            )
        } else {
            format!("{k}_crc({start}, {state}, {u}_STATE_WORDS)")
        }
    }

    /// Network and comparison of a move that has an observation from `word` on, and the way to the next move.
    pub fn network(&self) -> Vec<String> {
        let (k, s, u) = (self.kit, &self.program.name, self.program.name.to_uppercase());
        let (number, crc) = match self.is_wide() {
            true => (format!("{k}_number(&word[2u * i])"), "crc_numbers"),
            false => (format!("{k}_float(word[i])"), "crc"),
        };
        let words = self.program.scalar().words() * self.program.features.len();
        vec![
            format!("for (i = 0u; i < {u}_FEATURES; ++i) {{"),
            format!("    observation[i] = {number};"),
            "}".to_owned(),
            format!("{s}_q_values(observation, q);"),
            self.check(
                "CRC of Q values of an observation",
                words,
                &format!("{k}_{crc}(0xFFFFFFFFu, q, {u}_ACTIONS) ^ 0xFFFFFFFFu"),
            ),
            format!("return word + {};", words + 1),
        ]
    }

    /// Declarations of the coefficients, read from `word`.
    pub fn coefficients(&self, names: &[&str]) -> Vec<String> {
        let k = self.kit;
        let line = |(index, name): (usize, &&str)| {
            if self.is_wide() {
                format!("const double {name} = {k}_number(&word[{}]);", 2 * index)
            } else {
                format!("const float {name} = {k}_float(word[{index}]);")
            }
        };
        names.iter().enumerate().map(line).collect()
    }
}
