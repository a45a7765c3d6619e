//! The driver in C99.

use std::fmt::Write;

use policy::{Policy, Scalar};

use super::{Form, Settable, settable};
use crate::protocol::{MAGIC, kind, purity, sample_words};

/// Text of the driver for the generated `<name>.h`.
pub fn text(policy: &Policy, form: Form) -> String {
    let words = match form {
        Form::Hosted => HOSTED_WORDS,
        Form::Board => BOARD_WORDS,
    };
    [
        words,
        &head(policy),
        &step(policy, form),
        &set_mapping(policy),
        &integrity(policy),
        &main(policy),
    ]
    .concat()
}

/// Words through the C library.
const HOSTED_WORDS: &str = r"/* Driver of the differential check: events in, answers out, in words of the machine. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void start_words(void)
{
    static char in_buffer[1 << 16];
    static char out_buffer[1 << 16];
    setvbuf(stdin, in_buffer, _IOFBF, sizeof in_buffer);
    setvbuf(stdout, out_buffer, _IOFBF, sizeof out_buffer);
}

static void put(const void *words, size_t count)
{
    if (fwrite(words, 4u, count, stdout) != count) {
        exit(4);
    }
}

/* 0 at the end of the stream */
static int get(void *words, size_t count)
{
    return fread(words, 4u, count, stdin) == count;
}

/* each answer leaves at once: a crash then shows at its own event */
static void flush(void)
{
    fflush(stdout);
}

";

/// Words through a board.
const BOARD_WORDS: &str = r"/* Driver of the differential check: events in, answers out, in words of the target. */
#include <stdint.h>
#include <board.h>

static void start_words(void)
{
}

static void put(const void *words, size_t count)
{
    words_put(words, count);
}

/* 0 at the end of the stream */
static int get(void *words, size_t count)
{
    return words_get(words, count);
}

/* the board sends before it waits and in a fault */
static void flush(void)
{
}

";

/// Numbers from and to words.
pub(super) fn numbers(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => SINGLES,
        Scalar::F64 => DOUBLES,
    }
}

const SINGLES: &str = r"typedef float number;

static number number_of(const uint32_t *words)
{
    number x;
    memcpy(&x, words, 4u);
    return x;
}
";

const DOUBLES: &str = r"typedef double number;

static number number_of(const uint32_t *words)
{
    const uint64_t bits = (uint64_t)words[0] | ((uint64_t)words[1] << 32);
    number x;
    memcpy(&x, &bits, 8u);
    return x;
}
";

/// The driver's answers: numbers as words.
fn put_numbers(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::F32 => {
            r"
static void put_numbers(const number *x, size_t count)
{
    put(x, count);
}
"
        }
        Scalar::F64 => {
            r"
static void put_numbers(const number *x, size_t count)
{
    size_t i;
    for (i = 0u; i < count; ++i) {
        uint64_t bits;
        uint32_t words[2];
        memcpy(&bits, &x[i], 8u);
        words[0] = (uint32_t)bits;
        words[1] = (uint32_t)(bits >> 32);
        put(words, 2u);
    }
}
"
        }
    }
}

/// Memory, states, start.
fn head(policy: &Policy) -> String {
    let scalar = policy.numeric_format.scalar();
    let (numbers, put_numbers, words) = (numbers(scalar), put_numbers(scalar), scalar.words());
    let name = &policy.name;
    let macro_name = name.to_uppercase();
    format!(
        r#"#include "{name}.h"

#define STATE_WORDS (sizeof({name}_state) / 4u)
#define NUMBER_WORDS {words}u

{numbers}{put_numbers}
static {name}_state state;       /* advanced by step */
static {name}_state twin;        /* advanced by eval and commit */
static {name}_state before;
static {name}_measurement m;
static {name}_command command;
static number observation[{macro_name}_FEATURES];
static number q[{macro_name}_ACTIONS];

static void put_word(uint32_t word)
{{
    put(&word, 1u);
}}

static void put_state(void)
{{
    put_numbers((const number *)(const void *)&state, (STATE_WORDS - 2u) / NUMBER_WORDS);
    put(&state.bad_count, 1u);
    put(&state.primed, 1u);
}}

static void start(void)
{{
    /* garbage first: init must write every word */
    memset(&state, 0xA5, sizeof state);
    memset(&twin, 0x5A, sizeof twin);
    {name}_init(&state);
    {name}_init(&twin);
}}

"#
    )
}

fn step(policy: &Policy, form: Form) -> String {
    let name = &policy.name;
    let macro_name = name.to_uppercase();
    let measurement = measurement(policy);
    let outputs = policy.paths().len();
    // several are arrays, and one is a member
    let duties = if outputs == 1 { "&" } else { "" };
    let purity_tests = purity_tests(name, outputs);
    let mask = form.purity_mask();
    format!(
        r#"static int read_measurement(void)
{{
    uint32_t words[{words}];
    if (!get(words, {words}u)) {{
        return 0;
    }}
{measurement}    return 1;
}}

/* `step` with a look at what must leave the state alone, and at `eval` and `commit` beside it */
static uint32_t watched_step(void)
{{
    {name}_command first;
    {name}_command second;
    {name}_command third;
    uint32_t purity = 0u;
    memset(&first, 0, sizeof first);
    memset(&second, 0xFF, sizeof second);
    memset(&third, 0xFF, sizeof third);
    memset(&command, 0xFF, sizeof command);
    memcpy(&before, &state, sizeof state);
{purity_tests}
    return purity;
}}

static void step(void)
{{
    static uint32_t steps;
    uint32_t purity = 0u;
    if ((steps++ & {mask}u) == 0u) {{
        purity = watched_step();
    }} else {{
        {name}_observe(&state, &m, observation);
        {name}_q_values(observation, q);
        {name}_step(&state, &m, &command);
        memcpy(&twin, &state, sizeof twin);
    }}
    put_numbers(observation, {macro_name}_FEATURES);
    put_numbers(q, {macro_name}_ACTIONS);
    put_numbers({duties}command.duty, {outputs}u);
    put_numbers({duties}command.duty_sim, {outputs}u);
    put({duties}command.action_index, {outputs}u);
    put_word(command.status);
    put_state();
    put_word(purity);
}}
"#,
        words = sample_words(policy),
    )
}

/// The integrity check of the driver's start.
fn integrity(policy: &Policy) -> String {
    let name = &policy.name;
    let macro_name = name.to_uppercase();
    format!(
        r#"
/* The whole check, then twice the one in slices: all must say the same. */
static uint32_t integrity(void)
{{
    {name}_check check = {{ 0u, 0u }};
    uint32_t intact = {name}_integrity(), found = {macro_name}_INTEGRITY_RUNNING, calls = 0u, turn;
    for (turn = 0u; turn < 2u; ++turn) {{
        for (calls = 1u; (found = {name}_integrity_slice(&check, 101u)) == {macro_name}_INTEGRITY_RUNNING; ++calls) {{
        }}
        intact &= (uint32_t)(found == {macro_name}_INTEGRITY_INTACT);
        intact &= (uint32_t)(calls == ({macro_name}_TABLE_NUMBERS + 100u) / 101u);
    }}
    return intact;
}}
"#
    )
}

fn main(policy: &Policy) -> String {
    let name = &policy.name;
    let macro_name = name.to_uppercase();
    let (step, set, reset, init) = (kind::STEP, kind::SET_MAPPING, kind::RESET, kind::INIT);
    let network = kind::NETWORK;
    format!(
        r#"
static int network(void)
{{
    uint32_t words[NUMBER_WORDS * {macro_name}_FEATURES];
    uint32_t i;
    if (!get(words, NUMBER_WORDS * {macro_name}_FEATURES)) {{
        return 0;
    }}
    for (i = 0u; i < {macro_name}_FEATURES; ++i) {{
        observation[i] = number_of(&words[NUMBER_WORDS * i]);
    }}
    {name}_q_values(observation, q);
    put_numbers(q, {macro_name}_ACTIONS);
    return 1;
}}

int main(void)
{{
    uint32_t kind;
    start_words();
    put_word({MAGIC}u);
    put_word({name}_self_test());
    put_word(integrity());
    put_word({macro_name}_SIGNALS);
    put_word({macro_name}_FEATURES);
    put_word({macro_name}_ACTIONS);
    put_word((uint32_t)STATE_WORDS);
    flush();
    start();
    while (get(&kind, 1u)) {{
        switch (kind) {{
        case {step}u:
            if (!read_measurement()) {{
                return 2;
            }}
            step();
            break;
        case {set}u:
            if (!set_mapping()) {{
                return 2;
            }}
            break;
        case {reset}u:
            {name}_reset(&state);
            {name}_reset(&twin);
            put_state();
            break;
        case {init}u:
            start();
            put_state();
            break;
        case {network}u:
            if (!network()) {{
                return 2;
            }}
            break;
        default:
            return 3;
        }}
        flush();
    }}
    return 0;
}}
"#
    )
}

/// Copies `words` into the measurement `m`.
pub(super) fn measurement(policy: &Policy) -> String {
    let mut text = String::new();
    let scalar = policy.numeric_format.scalar();
    let mut word = 0;
    for signal in &policy.signals {
        let name = &signal.name;
        // writing to a String cannot fail
        if scalar == Scalar::F64 && signal.adc.is_none() {
            let _ = writeln!(text, "    m.{name} = number_of(&words[{word}]);");
            word += scalar.words();
        } else {
            let _ = writeln!(text, "    memcpy(&m.{name}, &words[{word}], 4u);");
            word += 1;
        }
    }
    text
}

fn purity_tests(name: &str, outputs: usize) -> String {
    let purity_bits = [
        purity::OBSERVE_CHANGED_STATE,
        purity::EVAL_CHANGED_STATE,
        purity::EVAL_NOT_REPEATABLE,
        purity::STEP_IS_NOT_EVAL,
        purity::COMMIT_IS_NOT_STEP,
    ];
    let [observe, eval, repeat, step, commit] = purity_bits;
    let same = |a: &str, b: &str| {
        format!(
            "memcmp(&{a}.duty, &{b}.duty, {outputs}u * sizeof(number))\n        \
             || memcmp(&{a}.duty_sim, &{b}.duty_sim, {outputs}u * sizeof(number))\n        \
             || memcmp(&{a}.action_index, &{b}.action_index, {outputs}u * 4u) || {a}.status != {b}.status"
        )
    };
    let first_second = same("first", "second");
    let first_command = same("first", "command");
    format!(
        "    {name}_observe(&state, &m, observation);
    {name}_q_values(observation, q);
    purity |= memcmp(&before, &state, sizeof state) ? {observe}u : 0u;
    {name}_eval(&state, &m, &first);
    {name}_eval(&state, &m, &second);
    purity |= memcmp(&before, &state, sizeof state) ? {eval}u : 0u;
    purity |= ({first_second}) ? {repeat}u : 0u;
    {name}_step(&state, &m, &command);
    purity |= ({first_command}) ? {step}u : 0u;
    {name}_eval(&twin, &m, &third);
    {name}_commit(&twin, &m, &third);
    purity |= memcmp(&twin, &state, sizeof state) ? {commit}u : 0u;"
    )
}

fn set_mapping(policy: &Policy) -> String {
    let name = &policy.name;
    let outputs = settable(policy);
    if outputs.is_empty() {
        return "\nstatic int set_mapping(void)\n{\n    return 0;\n}\n".to_owned();
    }
    let case = |own: &Settable| {
        let (output, function) = (own.output, &own.function);
        let arguments = match own.has_product {
            true => "k(0u), k(1u), k(2u), k(3u)",
            false => "k(0u), k(1u), k(2u)",
        };
        format!(
            "    case {output}u:
        (void){name}_{function}(&twin, {arguments});
        put_word({name}_{function}(&state, {arguments}));
        break;
"
        )
    };
    let cases: String = outputs.iter().map(case).collect();
    format!(
        "
static uint32_t coefficients[4u * NUMBER_WORDS];

static number k(uint32_t index)
{{
    return number_of(&coefficients[NUMBER_WORDS * index]);
}}

static int set_mapping(void)
{{
    uint32_t output;
    if (!get(&output, 1u) || !get(coefficients, 4u * NUMBER_WORDS)) {{
        return 0;
    }}
    switch (output) {{
{cases}    default:
        return 0;
    }}
    put_state();
    return 1;
}}
"
    )
}
