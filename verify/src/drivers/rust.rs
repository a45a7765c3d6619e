//! The driver in Rust.

use std::fmt::Write;

use policy::{Policy, Scalar};

use super::{Form, Settable, settable};
use crate::protocol::{MAGIC, kind, purity, sample_words};

/// Text of the driver for the generated module in the file `path`, relative to the driver.
pub fn text(policy: &Policy, path: &str, form: Form) -> String {
    let name = &policy.name;
    let (attributes, words) = match form {
        Form::Hosted => ("", HOSTED_WORDS),
        Form::Board => ("#![no_std]\n#![no_main]\n", BOARD_WORDS),
    };
    let mut text = String::new();
    // writing to a String cannot fail
    let _ = write!(
        text,
        r#"// Driver of the differential check: events in, answers out, in words of the machine.
{attributes}#[path = "{path}"]
#[allow(dead_code)]
mod {name};

use {name}::{{Command, Controller, IntegrityCheck, Measurement}};
{words}{number}{HELPERS}{parts}
{step}{set_mapping}{main}"#,
        number = number(policy.numeric_format.scalar()),
        parts = parts(policy),
        step = step(policy, form),
        set_mapping = set_mapping(policy),
        main = main(policy),
    );
    text
}

/// Numbers from and to words.
pub(super) fn number(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => {
            r"
type Number = f32;
const NUMBER_WORDS: usize = 1;

#[allow(dead_code)]
fn number(words: &[u32]) -> Number {
    f32::from_bits(words[0])
}

#[allow(dead_code)]
fn words_of(x: Number) -> [u32; NUMBER_WORDS] {
    [x.to_bits()]
}
"
        }
        Scalar::F64 => {
            r"
type Number = f64;
const NUMBER_WORDS: usize = 2;

#[allow(dead_code)]
fn number(words: &[u32]) -> Number {
    f64::from_bits(words[0] as u64 | (words[1] as u64) << 32)
}

#[allow(dead_code)]
fn words_of(x: Number) -> [u32; NUMBER_WORDS] {
    [x.to_bits() as u32, (x.to_bits() >> 32) as u32]
}
"
        }
    }
}

/// Words through the standard library.
const HOSTED_WORDS: &str = r#"
use std::io::{BufReader, BufWriter, ErrorKind, Read, Stdin, Stdout, Write};

struct Words {
    input: BufReader<Stdin>,
    output: BufWriter<Stdout>,
}

impl Words {
    fn new() -> Self {
        Words {
            input: BufReader::with_capacity(1 << 16, std::io::stdin()),
            output: BufWriter::with_capacity(1 << 16, std::io::stdout()),
        }
    }

    fn put(&mut self, word: u32) {
        self.output.write_all(&word.to_ne_bytes()).unwrap();
    }

    /// None at the end of the stream.
    fn get(&mut self) -> Option<u32> {
        let mut bytes = [0; 4];
        match self.input.read_exact(&mut bytes) {
            Ok(()) => Some(u32::from_ne_bytes(bytes)),
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => None,
            Err(error) => panic!("{}", error),
        }
    }

    /// Each answer leaves at once: a crash then shows at its own event.
    fn flush(&mut self) {
        self.output.flush().unwrap();
    }
}

fn main() {
    run();
}
"#;

/// Words through a board.
const BOARD_WORDS: &str = r#"
extern "C" {
    fn words_get(words: *mut u32, count: usize) -> i32;
    fn words_put(words: *const u32, count: usize);
    fn board_exit(code: i32) -> !;
}

struct Words;

impl Words {
    fn new() -> Self {
        Words
    }

    fn put(&mut self, word: u32) {
        unsafe { words_put(&word, 1) }
    }

    /// None at the end of the stream.
    fn get(&mut self) -> Option<u32> {
        let mut word = 0;
        if unsafe { words_get(&mut word, 1) } != 0 { Some(word) } else { None }
    }

    /// The board sends before it waits and in a fault.
    fn flush(&mut self) {}
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe { board_exit(97) }
}

#[no_mangle]
pub extern "C" fn main() -> i32 {
    run();
    0
}
"#;

const HELPERS: &str = r#"
struct Driver {
    words: Words,
    /// Advanced by step.
    state: Controller,
    /// Advanced by eval and commit.
    twin: Controller,
    steps: u32,
}

impl Driver {
    fn put(&mut self, words: impl IntoIterator<Item = u32>) {
        for word in words {
            self.words.put(word);
        }
    }

    fn put_numbers(&mut self, numbers: &[Number]) {
        for number in numbers {
            self.put(words_of(*number));
        }
    }

    fn put_state(&mut self) {
        let words = self.state.state_words();
        self.put(words);
    }

    /// None at the end of the stream.
    fn get<const N: usize>(&mut self) -> Option<[u32; N]> {
        let mut words = [0; N];
        for word in &mut words {
            *word = self.words.get()?;
        }
        Some(words)
    }
}

"#;

/// The parts of a command as slices.
fn parts(policy: &Policy) -> String {
    let outputs = policy.paths().len();
    let slice = |part: &str| match outputs {
        1 => format!("core::slice::from_ref(&command.{part})"),
        _ => format!("&command.{part}[..]"),
    };
    let [duty, duty_sim, action_index] = ["duty", "duty_sim", "action_index"].map(slice);
    format!(
        r#"
fn duties(command: &Command) -> [&[Number]; 2] {{
    [{duty}, {duty_sim}]
}}

fn indices(command: &Command) -> &[u32] {{
    {action_index}
}}

fn is_same(a: &Command, b: &Command) -> bool {{
    let [x, y] = [a, b].map(duties);
    let bits = |x: &[Number], y: &[Number]| x.iter().zip(y).all(|(x, y)| words_of(*x) == words_of(*y));
    bits(x[0], y[0]) && bits(x[1], y[1]) && indices(a) == indices(b) && a.status == b.status
}}
"#
    )
}

/// The fields of a measurement from `words`.
pub(super) fn measurement_fields(policy: &Policy) -> String {
    let mut fields = String::new();
    let mut word = 0;
    for signal in &policy.signals {
        let value = match signal.adc {
            Some(_) => format!("words[{word}] as i32"),
            None => format!("number(&words[{word}..])"),
        };
        word += match signal.adc {
            Some(_) => 1,
            None => policy.numeric_format.scalar().words(),
        };
        // writing to a String cannot fail
        let _ = writeln!(fields, "            {}: {value},", signal.name);
    }
    fields
}

fn step(policy: &Policy, form: Form) -> String {
    let mask = form.purity_mask();
    let name = &policy.name;
    let words = sample_words(policy);
    let fields = measurement_fields(policy);
    let [observe, eval, repeat, step, commit] = [
        purity::OBSERVE_CHANGED_STATE,
        purity::EVAL_CHANGED_STATE,
        purity::EVAL_NOT_REPEATABLE,
        purity::STEP_IS_NOT_EVAL,
        purity::COMMIT_IS_NOT_STEP,
    ];
    format!(
        r#"
impl Driver {{
    /// `step` with a look at what must leave the state alone, and at `eval` and `commit` beside it.
    fn watch(&mut self, m: &Measurement, purity: &mut u32) -> Command {{
        let before = self.state.state_words();
        let flag = |wrong: bool, bit: u32| if wrong {{ bit }} else {{ 0 }};
        let _ = self.state.observe(m);
        *purity |= flag(before != self.state.state_words(), {observe});
        let first = self.state.eval(m);
        let second = self.state.eval(m);
        *purity |= flag(before != self.state.state_words(), {eval});
        *purity |= flag(!is_same(&first, &second), {repeat});
        let command = self.state.step(m);
        *purity |= flag(!is_same(&first, &command), {step});
        let third = self.twin.eval(m);
        self.twin.commit(m, &third);
        *purity |= flag(self.twin.state_words() != self.state.state_words(), {commit});
        command
    }}

    fn step(&mut self, words: [u32; {words}]) {{
        let m = Measurement {{
{fields}        }};
        let observation = self.state.observe(&m);
        let q = Controller::q_values(&observation);
        let mut purity = 0;
        let command = if self.steps & {mask} == 0 {{
            self.watch(&m, &mut purity)
        }} else {{
            let command = self.state.step(&m);
            self.twin = self.state.clone();
            command
        }};
        self.steps = self.steps.wrapping_add(1);
        let _: ([Number; {name}::FEATURES], [Number; {name}::ACTIONS]) = (observation, q);
        self.put_numbers(&observation);
        self.put_numbers(&q);
        for numbers in duties(&command) {{
            self.put_numbers(numbers);
        }}
        self.put(indices(&command).iter().copied());
        self.put([command.status]);
        self.put_state();
        self.put([purity]);
    }}
}}
"#
    )
}

fn set_mapping(policy: &Policy) -> String {
    let case = |own: &Settable| {
        let (output, function) = (own.output, &own.function);
        let arguments = if own.has_product { "a, b, c, r" } else { "a, b, c" };
        format!(
            "            {output} => {{
                self.twin.{function}({arguments});
                self.state.{function}({arguments})
            }}
"
        )
    };
    let cases: String = settable(policy).iter().map(case).collect();
    format!(
        r#"
impl Driver {{
    fn set_mapping(&mut self, output: u32, words: [u32; 4 * NUMBER_WORDS]) {{
        #[allow(unused_variables)]
        let [a, b, c, r] = [0, 1, 2, 3].map(|n| number(&words[n * NUMBER_WORDS..]));
        let accepted: bool = match output {{
{cases}            _ => panic!("no mapping"),
        }};
        self.put([accepted as u32]);
        self.put_state();
    }}
}}
"#
    )
}

fn main(policy: &Policy) -> String {
    let name = &policy.name;
    let (step, set, reset, init) = (kind::STEP, kind::SET_MAPPING, kind::RESET, kind::INIT);
    let network = kind::NETWORK;
    format!(
        r#"
fn run() {{
    let mut driver = Driver {{
        words: Words::new(),
        state: Controller::new(),
        twin: Controller::new(),
        steps: 0,
    }};
    let self_test: Result<(), u32> = Controller::self_test();
    let mut check = IntegrityCheck::new();
    let mut integrity: bool = Controller::integrity();
    // the whole check, then twice the one in slices: all must say the same
    for _ in 0..2 {{
        let mut calls = 1;
        let found = loop {{
            match check.slice(101) {{
                Some(intact) => break intact,
                None => calls += 1,
            }}
        }};
        integrity &= found && calls == IntegrityCheck::LENGTH.div_ceil(101);
    }}
    let state_words = driver.state.state_words().len() as u32;
    driver.put([{MAGIC}, self_test.err().unwrap_or(0), integrity as u32, {signals}]);
    driver.put([{name}::FEATURES as u32, {name}::ACTIONS as u32, state_words]);
    driver.words.flush();
    while let Some([kind]) = driver.get() {{
        let truncated = "event ends early";
        match kind {{
            {step} => {{
                let words = driver.get().expect(truncated);
                driver.step(words);
            }}
            {set} => {{
                let [output] = driver.get().expect(truncated);
                let words = driver.get().expect(truncated);
                driver.set_mapping(output, words);
            }}
            {reset} => {{
                driver.state.reset();
                driver.twin.reset();
                driver.put_state();
            }}
            {init} => {{
                driver.state = Controller::new();
                driver.twin = Controller::new();
                driver.put_state();
            }}
            {network} => {{
                let words: [u32; NUMBER_WORDS * {name}::FEATURES] = driver.get().expect(truncated);
                let mut observation = [0.0; {name}::FEATURES];
                for (x, words) in observation.iter_mut().zip(words.chunks(NUMBER_WORDS)) {{
                    *x = number(words);
                }}
                let q = Controller::q_values(&observation);
                driver.put_numbers(&q);
            }}
            _ => panic!("unknown event"),
        }}
        driver.words.flush();
    }}
}}
"#,
        signals = policy.signals.len(),
    )
}
