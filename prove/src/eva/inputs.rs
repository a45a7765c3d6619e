//! What the drivers begin with: any measurement, any state, sound states, and the contracts of what other entries show.

use super::driver::Writer;
use super::head::Answer;

impl Writer<'_> {
    /// Functions that make the inputs.
    pub fn inputs(&mut self) {
        let (n, kind) = (self.n().to_owned(), self.number.kind());
        let most = self.literal(self.number.largest());
        self.text.lines([format!("#include \"{n}.h\""), String::new()]);
        self.vouches();
        self.contracts();
        self.text.lines([
            format!("#include \"{n}.c\""),
            "#include \"__fc_builtin.h\"".to_owned(),
            String::new(),
        ]);
        self.network_contract();
        self.curve_contracts();
        self.text.lines([
            "/* every bit pattern of the type */".to_owned(),
            format!("extern volatile {kind} any_bits;"),
            "extern volatile uint32_t any_word;".to_owned(),
            "extern volatile int32_t any_code;".to_owned(),
            String::new(),
            "#if defined(FINITE)".to_owned(),
            format!("#define ANY_NUMBER Frama_C_{kind}_interval(-{most}, {most})"),
            "#else".to_owned(),
            "#define ANY_NUMBER any_bits".to_owned(),
            "#endif".to_owned(),
            String::new(),
        ]);
        self.text
            .line(format!("static void measure({n}_measurement *measured)"));
        self.text.line("{");
        for signal in &self.policy.signals {
            let any = if signal.adc.is_some() { "any_code" } else { "ANY_NUMBER" };
            self.text.line(format!("measured->{} = {any};", signal.name));
        }
        self.text.lines(["}", ""]);
        self.text.line(format!("static void arbitrary({n}_state *state)"));
        self.text.line("{");
        for word in &self.invariant.words {
            self.text.line(format!("state->{} = any_bits;", word.place));
        }
        self.check_word(false);
        self.text
            .lines(["state->bad_count = any_word;", "state->primed = any_word;", "}", ""]);
        self.text.line(format!("static void sound({n}_state *state)"));
        self.text.line("{");
        for word in &self.invariant.words {
            let value = match word.ends {
                Some(ends) => self.between(ends),
                None => "ANY_NUMBER".to_owned(),
            };
            self.text.line(format!("state->{} = {value};", word.place));
        }
        self.check_word(true);
        let most = self.invariant.hold + 1;
        self.text.lines([
            format!("state->bad_count = Frama_C_unsigned_int_interval(0u, {most}u);"),
            "state->primed = Frama_C_unsigned_int_interval(0u, 1u);".to_owned(),
            "}".to_owned(),
            String::new(),
        ]);
    }

    /// That the check word of a sound state is that of the coefficients: a relation, which intervals do not hold. So it is a
    /// contract of the function that compares them, and stands for its text where a step begins with a sound state.
    fn vouches(&mut self) {
        let flips = self.flips();
        if flips.is_empty() {
            return;
        }
        let (n, word) = (self.n().to_owned(), self.number.word());
        self.text.lines([
            format!("extern volatile {word} any_check;"),
            "static uint32_t vouched;".to_owned(),
            String::new(),
        ]);
        for function in flips {
            self.text.lines([
                "/*@ assigns \\result \\from *state, vouched;".to_owned(),
                "  @ ensures vouched: vouched == 0 || \\result == 0;".to_owned(),
                "  @*/".to_owned(),
                format!("static {word} {n}_{function}(const {n}_state *state);"),
                String::new(),
            ]);
        }
    }

    /// The check word: any, and whether it is taken for that of the coefficients.
    fn check_word(&mut self, vouched: bool) {
        let paths = self.policy.paths();
        let mut checks = paths.iter().filter(|path| path.mapping.is_some()).peekable();
        if checks.peek().is_some() {
            self.text.line(format!("vouched = {}u;", u32::from(vouched)));
        }
        for path in checks {
            self.text
                .line(format!("state->{} = any_check;", path.named("mapping_check")));
        }
    }

    /// Contracts of the network and of the choice of an action: shown by the entries that analyse them, given to all others.
    fn contracts(&mut self) {
        let (n, kind) = (self.n().to_owned(), self.number.kind());
        let (features, actions) = (self.policy.features.len(), self.policy.outputs());
        let assigns = "/*@ assigns \\result \\from *state, *measured;";
        let (answer, outputs) = match self.answer() {
            Answer::Output => {
                // where bit patterns are looked at, the output may be one that is no number
                let finite = "  @ ensures finite: \\is_finite(\\result);";
                self.text.lines(["#if defined(FINITE)", assigns, finite, "  @*/"]);
                self.text.lines(["#else", assigns, "  @*/", "#endif"]);
                (kind, String::new())
            }
            Answer::Index => {
                let index = format!("  @ ensures index: \\result < {actions}u;");
                self.text.lines([assigns, &index, "  @*/"]);
                ("uint32_t", String::new())
            }
            Answer::Gains(count) => {
                let range = format!("(0 .. {})", count - 1);
                let assigns = format!("/*@ assigns outputs[0 .. {}] \\from *state, *measured;", count - 1);
                let written = format!("  @ ensures written: \\initialized(outputs + {range});");
                self.text.lines(["#if defined(FINITE)", &assigns, &written]);
                let finite = |index| format!("  @ ensures finite_{index}: \\is_finite(outputs[{index}]);");
                self.text.lines((0..count).map(finite).collect::<Vec<_>>());
                self.text
                    .lines(["  @*/", "#else", &assigns, &written, "  @*/", "#endif"]);
                ("void", format!(", {kind} *outputs"))
            }
        };
        self.text.line(format!(
            "static {answer} {n}_choose(const {n}_state *state, const {n}_measurement *measured{outputs});"
        ));
        let bits = format!(
            "  @ assigns q[0 .. {last}] \\from observation[0 .. {}];\n  @ ensures written: \\initialized(q + (0 .. {last}));",
            features - 1,
            last = actions - 1
        );
        let prototype = format!("void {n}_q_values(const {kind} *observation, {kind} *q);");
        if self.is_integer() {
            self.text.line("/*@");
            self.text.lines(bits.lines());
            self.text.lines(["  @*/", &prototype, ""]);
            return;
        }
        self.text.lines(["#if defined(FINITE)", "/*@"]);
        for index in 0..features {
            let far = self.far(index);
            let near = format!("requires near_{index}: -{far} <= observation[{index}] <= {far};");
            self.text.line(format!("  @ {near}"));
        }
        self.text.lines(bits.lines());
        for index in 0..actions {
            self.text
                .line(format!("  @ ensures finite_{index}: \\is_finite(q[{index}]);"));
        }
        self.text.lines(["  @*/", &prototype, "#else", "/*@"]);
        self.text.lines(bits.lines());
        self.text.lines(["  @*/", &prototype, "#endif", ""]);
    }

    /// The network in integers: its inputs lie in the box of section 6b, which is asked for at each call.
    fn network_contract(&mut self) {
        let Some(scales) = policy::scales::of(self.policy) else {
            return;
        };
        let n = self.n().to_owned();
        let (features, last) = (scales.inputs.len(), self.policy.outputs() - 1);
        self.text.lines([
            format!("enum {{ INPUTS = sizeof((({n}_values *)0)->input) / sizeof((({n}_values *)0)->input[0]) }};"),
            "/*@".to_owned(),
        ]);
        for (index, input) in scales.inputs.iter().enumerate() {
            let (low, high) = (input.low, input.high);
            self.text.line(format!(
                "  @ requires box_{index}: {low} <= values->input[{index}] <= {high};"
            ));
        }
        self.text.lines([
            format!("  @ requires rest: \\initialized(values->input + ({features} .. INPUTS - 1));"),
            format!("  @ assigns values->q[0 .. {last}] \\from values->input[0 .. INPUTS - 1];"),
            format!("  @ ensures written: \\initialized(values->q + (0 .. {last}));"),
            "  @*/".to_owned(),
            format!("static void {n}_network({n}_values *values);"),
            String::new(),
        ]);
    }

    /// What an observation's size is not above: a power of two, which C and ACSL read as the same number.
    ///
    /// Its bound (contract section 5) times 2^20: intervals lose what a chain of filters keeps, and only that no sum overflows
    /// hangs on it.
    pub fn far(&self, feature: usize) -> String {
        let bound = self.policy.features.get(feature).map_or(0.0, |feature| {
            let bound = feature.bound;
            bound.low.abs().max(bound.high.abs())
        });
        format!("{:?}", (bound.max(1.0).log2().ceil() + 20.0).exp2())
    }

    /// Any number between two.
    pub fn between(&self, (low, high): (f64, f64)) -> String {
        let (low, high) = (self.literal(low), self.literal(high));
        format!("Frama_C_{}_interval({low}, {high})", self.number.kind())
    }
}
