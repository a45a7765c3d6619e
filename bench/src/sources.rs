//! Programs around the code that is counted: 64 observations, then 64 steps, then 64 slices of the integrity check, then a few
//! words to the host.

use std::fmt::Write;

use policy::{Policy, Scalar};

/// Observations, steps and slices of the integrity check per program.
pub const CALLS: usize = 64;
/// Numbers of a slice.
const SLICE: u32 = 32;

/// Program in C for a board.
pub fn c(policy: &Policy) -> String {
    let name = &policy.name;
    let (features, actions) = (policy.features.len(), policy.outputs());
    let helpers = c_helpers(policy.numeric_format.scalar());
    let mut fields = String::new();
    for signal in &policy.signals {
        let kind = if signal.adc.is_some() { "int32_t" } else { "number" };
        // writing to a String cannot fail
        let _ = write!(fields, "m.{} = ({kind})draw(0.0f, 60.0f); ", signal.name);
    }
    format!(
        r#"#include "board.h"
#include "{name}.h"
{helpers}
static number o[{features}], q[{actions}];
static {name}_state s;
static {name}_measurement m;
static {name}_command c;
static {name}_check check;
static volatile uint32_t slice;
int main(void)
{{
    uint32_t out[3], depth = 0u;
    int i, k;
    for (k = 0; k < {CALLS}; ++k) {{
        for (i = 0; i < {features}; ++i) {{ o[i] = (number)draw(-1.0f, 1.0f); }}
        count_begin(); {name}_q_values(o, q); count_end();
        for (i = 0; i < {actions}; ++i) {{ add(q[i]); }}
    }}
    {name}_init(&s);
    for (k = 0; k < {CALLS}; ++k) {{
        {fields}
        stack_paint();
        count_begin(); {name}_step(&s, &m, &c); count_end();
        depth = stack_depth();
    }}
    for (k = 0; k < {CALLS}; ++k) {{
        count_begin(); slice = {name}_integrity_slice(&check, {SLICE}u); count_end();
    }}
    out[0] = {name}_self_test(); out[1] = crc; out[2] = depth;
    words_put(out, 3u); words_flush();
    return 0;
}}
"#
    )
}

/// The type of the numbers, pseudo-random ones, and the checksum over their words, the low one first.
fn c_helpers(scalar: Scalar) -> String {
    let (number, words) = match scalar {
        Scalar::F32 => ("float", 1),
        Scalar::F64 => ("double", 2),
    };
    format!(
        r#"typedef {number} number;
static uint32_t random = 1u, crc = 0xFFFFFFFFu;
static float draw(float low, float high)
{{
    random = random * 1664525u + 1013904223u;
    return low + (high - low) * ((float)(random >> 8) / 16777216.0f);
}}
static void add_word(uint32_t word)
{{
    int i;
    crc ^= word;
    for (i = 0; i < 32; ++i) {{ crc = (crc >> 1) ^ (0xEDB88320u & (0u - (crc & 1u))); }}
}}
static void add(number x)
{{
    uint{bits}_t bits;
    int i;
    __builtin_memcpy(&bits, &x, sizeof(bits));
    for (i = 0; i < {words}; ++i) {{ add_word((uint32_t)((uint64_t)bits >> (32 * i))); }}
}}
"#,
        bits = 32 * words
    )
}

/// The network as most people write it, with the functions of a controller that [`c`] calls; row-major weights.
pub fn naive(policy: &Policy) -> (String, String) {
    let header = "#ifndef NAIVE_H\n#define NAIVE_H\nvoid naive_q_values(const float *o, float *q);\n#endif\n";
    let mut text = String::from("#include \"naive.h\"\n");
    let row = |values: &[f32]| {
        let values: Vec<String> = values.iter().map(|value| format!("{value:e}f")).collect();
        values.join(", ")
    };
    let mut calls = String::new();
    let mut source = "o".to_owned();
    for (index, layer) in policy.layers.iter().enumerate() {
        let last = index + 1 == policy.layers.len();
        let sink = if last { "q".to_owned() } else { format!("h{index}") };
        let (inputs, outputs) = (layer.inputs, layer.outputs);
        let activated = if last { "sum" } else { "sum > 0.0f ? sum : 0.0f" };
        let _ = writeln!(
            text,
            "static const float w{index}[{outputs}][{inputs}] = {{ {} }};\nstatic const float b{index}[{outputs}] = {{ {} }};",
            layer
                .weights
                .chunks(inputs)
                .map(|weights| format!("{{ {} }}", row(weights)))
                .collect::<Vec<_>>()
                .join(", "),
            row(&layer.bias)
        );
        if !last {
            let _ = writeln!(calls, "    float {sink}[{outputs}];");
        }
        let _ = writeln!(
            calls,
            "    for (int r = 0; r < {outputs}; ++r) {{ float sum = b{index}[r]; \
             for (int i = 0; i < {inputs}; ++i) {{ sum += w{index}[r][i] * {source}[i]; }} {sink}[r] = {activated}; }}"
        );
        source = sink;
    }
    let _ = writeln!(text, "void naive_q_values(const float *o, float *q)\n{{\n{calls}}}");
    (header.to_owned(), text)
}

/// Program in C for a board around [`naive`].
pub fn naive_main(policy: &Policy) -> String {
    let helpers = c_helpers(Scalar::F32);
    let (features, actions) = (policy.features.len(), policy.outputs());
    format!(
        r#"#include "board.h"
#include "naive.h"
static float o[{features}], q[{actions}];
{helpers}
int main(void)
{{
    uint32_t out[3], depth = 0u;
    int i, k;
    for (k = 0; k < 2 * {CALLS}; ++k) {{
        for (i = 0; i < {features}; ++i) {{ o[i] = draw(-1.0f, 1.0f); }}
        stack_paint();
        count_begin(); naive_q_values(o, q); count_end();
        depth = stack_depth();
        if (k < {CALLS}) {{ for (i = 0; i < {actions}; ++i) {{ add(q[i]); }} }}
    }}
    out[0] = 0u; out[1] = crc; out[2] = depth;
    words_put(out, 3u); words_flush();
    return 0;
}}
"#
    )
}

/// Program in C for a board around the function `peer_q_values` of a peer, compared with [`naive`]: the first of the words out
/// is the number, from 1, of an observation with a Q value further off than `limit` times its largest; 0 if there is none.
pub fn peer_main(policy: &Policy, start: &str, limit: f64) -> String {
    let helpers = c_helpers(Scalar::F32);
    let (features, actions) = (policy.features.len(), policy.outputs());
    format!(
        r#"#include "board.h"
#include "naive.h"
void peer_q_values(const float *o, float *q);
static float o[{features}], q[{actions}], known[{actions}];
{helpers}
static float magnitude(float x) {{ return x < 0.0f ? -x : x; }}
int main(void)
{{
    uint32_t out[3], depth = 0u;
    int i, k;
    {start}
    out[0] = 0u;
    for (k = 0; k < {CALLS}; ++k) {{
        float largest = 0.0f, error = 0.0f;
        for (i = 0; i < {features}; ++i) {{ o[i] = draw(-1.0f, 1.0f); }}
        stack_paint();
        count_begin(); peer_q_values(o, q); count_end();
        depth = stack_depth();
        naive_q_values(o, known);
        for (i = 0; i < {actions}; ++i) {{
            largest = magnitude(known[i]) > largest ? magnitude(known[i]) : largest;
            error = magnitude(known[i] - q[i]) > error ? magnitude(known[i] - q[i]) : error;
            add(q[i]);
        }}
        if (!(error <= {limit:e}f * largest)) {{ out[0] = (uint32_t)k + 1u; }}
    }}
    out[1] = crc; out[2] = depth;
    words_put(out, 3u); words_flush();
    return 0;
}}
"#
    )
}

/// Library in Rust with the same `main` for a board.
pub fn rust(policy: &Policy) -> String {
    let number = rust_number(policy);
    let name = &policy.name;
    let (features, actions) = (policy.features.len(), policy.outputs());
    let fields: Vec<String> = policy
        .signals
        .iter()
        .map(|signal| {
            let kind = if signal.adc.is_some() { "i32" } else { number };
            format!("{}: draw(&mut random, 0.0, 60.0) as {kind}", signal.name)
        })
        .collect();
    let fields = fields.join(", ");
    format!(
        r#"#![no_std]
#[path = "{name}.rs"]
#[allow(dead_code)]
mod {name};
use {name}::{{Controller, IntegrityCheck, Measurement}};
use core::hint::black_box;
extern "C" {{
    fn count_begin();
    fn count_end();
    fn words_put(words: *const u32, count: usize);
    fn words_flush();
    fn stack_paint();
    fn stack_depth() -> u32;
    fn board_exit(code: i32);
}}
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {{
    unsafe {{ board_exit(9) }}
    loop {{}}
}}
#[inline(never)]
fn q_values(o: &[{number}; {features}]) -> [{number}; {actions}] {{
    Controller::q_values(o)
}}
fn draw(random: &mut u32, low: f32, high: f32) -> f32 {{
    *random = random.wrapping_mul(1664525).wrapping_add(1013904223);
    low + (high - low) * ((*random >> 8) as f32 / 16777216.0)
}}
#[no_mangle]
pub extern "C" fn main() -> i32 {{
    let mut random = 1u32;
    let mut crc = !0u32;
    for _ in 0..{CALLS} {{
        let mut o = [0.0; {features}];
        for x in &mut o {{ *x = draw(&mut random, -1.0, 1.0) as {number}; }}
        unsafe {{ count_begin() }};
        let q = q_values(black_box(&o));
        unsafe {{ count_end() }};
        for x in &q {{
            for word in 0..core::mem::size_of::<{number}>() / 4 {{
                crc ^= (x.to_bits() as u64 >> (32 * word)) as u32;
                for _ in 0..32 {{ crc = (crc >> 1) ^ (0xEDB88320 & 0u32.wrapping_sub(crc & 1)); }}
            }}
        }}
    }}
    let mut controller = Controller::new();
    let mut depth = 0;
    for _ in 0..{CALLS} {{
        let m = Measurement {{ {fields} }};
        unsafe {{ stack_paint(); count_begin() }};
        black_box(controller.step(black_box(&m)));
        unsafe {{ count_end(); depth = stack_depth() }};
    }}
    let mut check = IntegrityCheck::new();
    for _ in 0..{CALLS} {{
        unsafe {{ count_begin() }};
        let _ = black_box(black_box(&mut check).slice({SLICE}));
        unsafe {{ count_end() }};
    }}
    let out = [Controller::self_test().err().unwrap_or(0), crc, depth];
    unsafe {{ words_put(out.as_ptr(), 3); words_flush() }};
    0
}}
"#
    )
}

fn rust_number(policy: &Policy) -> &'static str {
    match policy.numeric_format.scalar() {
        Scalar::F32 => "f32",
        Scalar::F64 => "f64",
    }
}

/// Program for the host: times ours and the naive loop in turns, prints the ratio of the shortest times.
pub fn host(policy: &Policy) -> String {
    let helpers = c_helpers(policy.numeric_format.scalar());
    let name = &policy.name;
    let (features, actions) = (policy.features.len(), policy.outputs());
    format!(
        r#"#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdint.h>
#include <time.h>
#include "naive.h"
{helpers}
void {name}_q_values(const number *observation, number *q);
static float o[256][{features}], q[{actions}];
static number own[256][{features}], answer[{actions}];
static double now(void) {{ struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec; }}
int main(void)
{{
    double best[2] = {{ 1e9, 1e9 }};
    int turn, k, i;
    for (k = 0; k < 256; ++k) {{ for (i = 0; i < {features}; ++i) {{ o[k][i] = draw(-1.0f, 1.0f); own[k][i] = (number)o[k][i]; }} }}
    for (turn = 0; turn < 400; ++turn) {{
        double start = now(), middle, end;
        for (k = 0; k < 256; ++k) {{ naive_q_values(o[k], q); __asm__ volatile("" : : "r"(q) : "memory"); }}
        middle = now();
        for (k = 0; k < 256; ++k) {{ {name}_q_values(own[k], answer); __asm__ volatile("" : : "r"(answer) : "memory"); }}
        end = now();
        if (middle - start < best[0]) {{ best[0] = middle - start; }}
        if (end - middle < best[1]) {{ best[1] = end - middle; }}
    }}
    for (k = 0; k < 64; ++k) {{ {name}_q_values(own[k], answer); for (i = 0; i < {actions}; ++i) {{ add(answer[i]); }} }}
    printf("%.6f %08x\n", best[1] / best[0], (unsigned)crc);
    return 0;
}}
"#
    )
}

/// The Rust controller as a C function for [`host`].
pub fn host_rust(policy: &Policy) -> String {
    let number = rust_number(policy);
    let name = &policy.name;
    let (features, actions) = (policy.features.len(), policy.outputs());
    format!(
        r#"#[path = "{name}.rs"]
#[allow(dead_code)]
mod {name};
#[no_mangle]
pub unsafe extern "C" fn {name}_q_values(o: *const [{number}; {features}], q: *mut [{number}; {actions}]) {{
    *q = {name}::Controller::q_values(&*o);
}}
"#
    )
}
