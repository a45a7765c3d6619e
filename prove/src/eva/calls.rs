//! Drivers of what is not a step: damaged states are marked, and the other functions.

use policy::Shape;

use super::driver::{BITS_AND_FINITE, BOTH, COARSE, COARSE_FIRST, Entry, FINE, ONE, ONE_FINITE, Writer};
use super::head::Answer;
use super::stated::{Stated, label_of, stated, stated_of};

impl Writer<'_> {
    /// Every state that is not sound, one number outside at a time and all others arbitrary.
    pub fn marked(&mut self) -> Entry {
        let n = self.n().to_owned();
        self.marks();
        self.marked_step();
        self.text.line("void prove_marked(void)");
        self.text.line("{");
        // any state, made once: a copy costs a tenth of it
        self.text.lines([
            format!("{n}_state state;"),
            format!("{n}_state any;"),
            "marked();".to_owned(),
            "arbitrary(&any);".to_owned(),
        ]);
        for word in self.invariant.words.clone() {
            let Some((low, high)) = word.ends else { continue };
            // their check word answers for them, and what it says is a relation
            if word.place.starts_with("mapping_") {
                continue;
            }
            let (low, high) = (self.literal(low), self.literal(high));
            let place = format!("state.{}", word.place);
            for outside in [format!("{place} < {low}"), format!("{place} > {high}")] {
                self.text.lines([
                    "state = any;".to_owned(),
                    format!("if ({outside}) {{"),
                    "marks(state);".to_owned(),
                ]);
                self.text.line("}");
            }
            // one NaN stands for all: Eva does not tell them apart
            let nan = match self.number.kind() {
                "float" => "0x7FC00000u",
                _ => "(uint64_t)0x7FF80000u << 32",
            };
            self.text.lines([
                "state = any;".to_owned(),
                format!("{place} = {n}_from_bits({nan});"),
                "marks(state);".to_owned(),
            ]);
        }
        // two halves: in one interval the sign of what is counted down would be lost
        let counters = [("bad_count", self.invariant.hold + 2), ("primed", 2)];
        for (name, least) in counters {
            for (low, high) in [(least, 0x7FFF_FFFF), (0x8000_0000, u32::MAX)] {
                self.text.lines([
                    "state = any;".to_owned(),
                    format!("state.{name} = Frama_C_unsigned_int_interval({low}u, {high}u);"),
                    "marks(state);".to_owned(),
                ]);
            }
        }
        self.close();
        if !self.flips().is_empty() {
            let why = "that a coefficient with another check word is found, and that a step leaves the two together: relations, which intervals do not hold; the goals of `equivalence` say so";
            self.not_stated.push(("mapping_check".to_owned(), why));
        }
        Entry {
            function: "prove_marked",
            about: "a state with a number, coefficients of the mapping aside, or a counter outside of its ends and all else arbitrary, every measurement and action",
            stated: vec![
                stated(
                    "marked",
                    match self.policy.paths().len() {
                        1 => "The fallback is commanded, with FALLBACK and STATE set.",
                        _ => "Every output commands its own fallback, with FALLBACK and STATE set.",
                    },
                ),
                stated(
                    "kept",
                    "The state stays marked: `primed` becomes 2, memories and the count of bad steps 0.",
                ),
            ],
            runs: BOTH,
            parts: 1,
            assumed: Vec::new(),
            precisions: COARSE_FIRST,
        }
    }

    /// The check of the state alone: so each number costs little.
    fn marks(&mut self) {
        let n = self.n().to_owned();
        self.text.line(format!("static void marks({n}_state state)"));
        self.text.lines([
            "{".to_owned(),
            format!("{n}_front front;"),
            "front.usable = any_word;".to_owned(),
            format!("{n}_guard(&state, &front);"),
        ]);
        self.text
            .check("marked_found", "front.sound == 0u && front.usable == 0u");
        self.text.lines(["}", ""]);
    }

    /// What the rest of a step does with a state that was found.
    fn marked_step(&mut self) {
        let n = self.n().to_owned();
        self.text.line("static void marked(void)");
        self.text.lines([
            "{".to_owned(),
            format!("{n}_state state;"),
            format!("{n}_measurement measured;"),
            format!("{n}_command command;"),
            format!("{n}_front front;"),
            "arbitrary(&state);".to_owned(),
            "measure(&measured);".to_owned(),
            format!("{n}_sense(&state, &measured, &front);"),
            "front.sound = 0u;".to_owned(),
            "front.usable = 0u;".to_owned(),
        ]);
        let chosen = match self.answer() {
            Answer::Output => "ANY_NUMBER".to_owned(),
            Answer::Index => format!("Frama_C_unsigned_int_interval(0u, {}u)", self.policy.outputs() - 1),
            Answer::Gains(count) => {
                self.text.line(format!("{} outputs[{count}];", self.number.kind()));
                let any = (0..count).map(|index| format!("outputs[{index}] = ANY_NUMBER;"));
                self.text.lines(any.collect::<Vec<_>>());
                "outputs".to_owned()
            }
        };
        self.text
            .line(format!("{n}_decide(&state, &front, {chosen}, &command);"));
        // FALLBACK and STATE, and no other bit
        self.text
            .check("marked_status", &format!("command.status == {}u", (1 << 1) | (1 << 8)));
        self.fallbacks();
        self.kept();
        self.text.lines(["}", ""]);
    }

    fn kept(&mut self) {
        let n = self.n().to_owned();
        self.any_command("command");
        self.text.line(format!("{n}_advance(&state, &front, &command);"));
        self.text.check("kept_primed", "state.primed == 2u");
        self.text.check("kept_bad", "state.bad_count == 0u");
        for index in 0..self.invariant.memory {
            self.text
                .check(&format!("kept_{index}"), &format!("state.memory[{index}] == 0"));
        }
    }

    /// Start-up, coefficients, observation, integrity.
    pub fn others(&mut self) -> Entry {
        let n = self.n().to_owned();
        self.open("prove_others");
        let features = self.policy.features.len();
        self.text.lines([
            format!("{n}_check check;"),
            format!("{} observation[{features}];", self.number.kind()),
            "uint32_t answer;".to_owned(),
            "arbitrary(&state);".to_owned(),
            format!("{n}_init(&state);"),
        ]);
        for (index, word) in self.invariant.words.clone().iter().enumerate() {
            self.keeps("init", index, word);
        }
        self.text
            .check("init_counters", "state.bad_count == 0u && state.primed == 0u");
        self.text
            .lines(["sound(&state);".to_owned(), format!("{n}_reset(&state);")]);
        for (index, word) in self.invariant.words.clone().iter().enumerate() {
            self.keeps("reset", index, word);
        }
        let mut claims = vec![
            stated("init", "`init` leaves a sound state, whatever was there."),
            stated("reset", "`reset` leaves a sound state sound."),
        ];
        claims.extend(self.set_mapping());
        self.text.lines([
            "arbitrary(&state);".to_owned(),
            "measure(&measured);".to_owned(),
            format!("{n}_observe(&state, &measured, observation);"),
            "check.position = any_word;".to_owned(),
            "check.crc = any_word;".to_owned(),
            format!("answer = {n}_integrity_slice(&check, any_word);"),
        ]);
        self.text.check("integrity_answer", "answer <= 2u");
        self.text.line(format!("answer = {n}_integrity();"));
        self.text.check("integrity_flag", "answer <= 1u");
        self.close();
        claims.push(stated(
            "integrity",
            "`integrity` and `integrity_slice` give one of their answers, whatever the check holds.",
        ));
        Entry {
            function: "prove_others",
            about: "init, reset, set_mapping, observe, integrity and integrity_slice with every input",
            stated: claims,
            runs: BOTH,
            parts: 1,
            assumed: Vec::new(),
            precisions: COARSE_FIRST,
        }
    }

    /// The mapping of each output that has one.
    fn set_mapping(&mut self) -> Vec<Stated> {
        let mut claims = Vec::new();
        let n = self.n().to_owned();
        for output in self.policy.paths().iter().enumerate() {
            let path = output.1;
            let Some(mapping) = path.mapping else { continue };
            let count = 3 + usize::from(mapping.coefficients.r.is_some());
            let (function, arguments) = (path.named("set_mapping"), vec!["ANY_NUMBER"; count].join(", "));
            self.text.lines([
                "sound(&state);".to_owned(),
                format!("answer = {n}_{function}(&state, {arguments});"),
            ]);
            self.text.check(&label_of("mapping", output), "answer <= 1u");
            let text = format!("`{function}` answers 0 or 1, whatever it is given.");
            claims.push(stated_of("mapping", output, &text));
        }
        if !claims.is_empty() {
            let why = "what `set_mapping` takes over: its answer and its arguments are related, and intervals hold no relation";
            self.not_stated.push(("mapping coefficients".to_owned(), why));
        }
        claims
    }

    /// The network in integers, with every input of its box (contract section 6b); in the place of its text its contract stands
    /// everywhere else.
    pub fn network(&mut self) -> Option<Entry> {
        let scales = policy::scales::of(self.policy)?;
        let n = self.n().to_owned();
        self.text.lines([
            "void prove_network(void)".to_owned(),
            "{".to_owned(),
            format!("{n}_values values;"),
            "uint32_t i;".to_owned(),
            // what fills the last block counts nothing, whatever it is
            "for (i = 0u; i < INPUTS; ++i) {".to_owned(),
            "values.input[i] = Frama_C_int_interval(-32768, 32767);".to_owned(),
        ]);
        self.text.line("}");
        for (index, input) in scales.inputs.iter().enumerate() {
            let (low, high) = (input.low, input.high);
            self.text
                .line(format!("values.input[{index}] = Frama_C_int_interval({low}, {high});"));
        }
        self.text.line(format!("{n}_network(&values);"));
        self.close();
        Some(Entry {
            function: "prove_network",
            about: "the network in integers with every input that an observation can become",
            stated: Vec::new(),
            runs: ONE_FINITE,
            parts: 1,
            assumed: Vec::new(),
            precisions: self.sums_precisions(),
        })
    }

    /// The network with every observation.
    pub fn q_values(&mut self) -> Entry {
        let n = self.n().to_owned();
        let (features, actions) = (self.policy.features.len(), self.policy.outputs());
        let kind = self.number.kind();
        let e = if kind == "float" { "f" } else { "" };
        self.text.line("void prove_q_values(void)");
        self.text.lines([
            "{".to_owned(),
            format!("{} observation[{features}];", self.number.kind()),
            format!("{} q[{actions}];", self.number.kind()),
        ]);
        for index in 0..features {
            let far = self.far(index);
            self.text.lines([
                "#if defined(FINITE)".to_owned(),
                format!("observation[{index}] = Frama_C_{kind}_interval(-{far}{e}, {far}{e});"),
                "#else".to_owned(),
                format!("observation[{index}] = any_bits;"),
                "#endif".to_owned(),
            ]);
        }
        self.text.line(format!("{n}_q_values(observation, q);"));
        if self.is_integer() {
            // outputs are within 2^24 in units of at most 1 (contract section 6b): no NaN, whatever the observation
            for index in 0..actions {
                self.text.check(
                    &format!("number_{index}"),
                    &format!("q[{index}] >= 0 || q[{index}] <= 0"),
                );
            }
        }
        self.close();
        Entry {
            function: "prove_q_values",
            about: match self.is_integer() {
                true => "q_values with every observation",
                false => "q_values with every observation; finite numbers up to 2^20 times the observation's bound",
            },
            stated: match self.is_integer() {
                true => vec![stated("number", "Every Q value is a number, whatever the observation.")],
                false => Vec::new(),
            },
            runs: if self.is_integer() { ONE } else { BITS_AND_FINITE },
            parts: 1,
            assumed: Vec::from_iter(self.is_integer().then(|| "network".to_owned())),
            precisions: if self.is_integer() {
                COARSE_FIRST
            } else {
                self.sums_precisions()
            },
        }
    }

    /// The stored answers, with a network that gives any.
    pub fn self_test(&mut self) -> Entry {
        let n = self.n().to_owned();
        self.text.lines([
            "void prove_self_test(void)".to_owned(),
            "{".to_owned(),
            format!("const uint32_t answer = {n}_self_test();"),
        ]);
        // vectors of the self test, contract section 11
        self.text.check("self_test", "answer <= 16u");
        self.close();
        Entry {
            function: "prove_self_test",
            about: "self_test, whatever the network answers",
            stated: vec![stated("self_test", "`self_test` gives 0 or the number of a vector.")],
            runs: ONE,
            parts: 1,
            assumed: vec!["q_values".to_owned()],
            precisions: COARSE_FIRST,
        }
    }

    /// Sums and hinges need no relations between values; a rational function of one value in numerator and denominator does.
    pub fn sums_precisions(&self) -> &'static [u8] {
        let hinges = self
            .policy
            .layers
            .iter()
            .all(|layer| matches!(layer.activation.shape(), Shape::Hinge { .. }));
        match (self.is_integer(), hinges) {
            (true, true) => COARSE_FIRST,
            (false, true) => COARSE,
            (_, false) => FINE,
        }
    }
}
