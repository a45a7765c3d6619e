//! Drivers of the measurement: one step at a time between the marks of the instruction counter, on painted stack.
//!
//! They read one word per signal and answer with the depth of the stack below the call, in bytes.

use policy::{Policy, Scalar};

use super::{c, rust};
use crate::protocol::sample_words;

/// In C.
pub fn c(policy: &Policy) -> String {
    let name = &policy.name;
    let words = sample_words(policy);
    let measurement = c::measurement(policy);
    let scalar = policy.numeric_format.scalar();
    let numbers = if scalar == Scalar::F64 && policy.signals.iter().any(|signal| signal.adc.is_none()) {
        c::numbers(scalar)
    } else {
        ""
    };
    format!(
        r#"/* Driver of the measurement: samples in, depth of the stack out. */
#include <stdint.h>
#include <board.h>
#include "{name}.h"

{numbers}
static {name}_state state;
static {name}_measurement m;
static {name}_command command;

int main(void)
{{
    uint32_t words[{words}];
    {name}_init(&state);
    while (words_get(words, {words}u)) {{
        uint32_t depth;
{measurement}        stack_paint();
        count_begin();
        {name}_step(&state, &m, &command);
        count_end();
        depth = stack_depth();
        words_put(&depth, 1u);
    }}
    return 0;
}}
"#
    )
}

/// In Rust, for the generated module in the file `path`.
pub fn rust(policy: &Policy, path: &str) -> String {
    let name = &policy.name;
    let words = sample_words(policy);
    let fields = rust::measurement_fields(policy);
    let number = rust::number(policy.numeric_format.scalar());
    format!(
        r#"// Driver of the measurement: samples in, depth of the stack out.
#![no_std]
#![no_main]
#[path = "{path}"]
#[allow(dead_code)]
mod {name};

use {name}::{{Command, Controller, Measurement}};

extern "C" {{
    fn words_get(words: *mut u32, count: usize) -> i32;
    fn words_put(words: *const u32, count: usize);
    fn count_begin();
    fn count_end();
    fn stack_paint();
    fn stack_depth() -> u32;
    fn board_exit(code: i32) -> !;
}}

{number}
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {{
    unsafe {{ board_exit(97) }}
}}

// a function of its own, as a caller in another unit has it
#[inline(never)]
fn measured(controller: &mut Controller, m: &Measurement) -> Command {{
    controller.step(m)
}}

#[no_mangle]
pub extern "C" fn main() -> i32 {{
    let mut controller = Controller::new();
    let mut words = [0_u32; {words}];
    while unsafe {{ words_get(words.as_mut_ptr(), {words}) }} != 0 {{
        let m = Measurement {{
{fields}        }};
        unsafe {{
            stack_paint();
            count_begin();
        }}
        core::hint::black_box(measured(&mut controller, &m));
        let depth = unsafe {{
            count_end();
            stack_depth()
        }};
        unsafe {{ words_put(&depth, 1) }}
    }}
    0
}}
"#
    )
}
