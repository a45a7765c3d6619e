//! Driver of the back-to-back kit on a board without a C library: runs it and answers with the number of differences.

use policy::Policy;

/// In C; the kit is built with `<NAME>_KIT_NO_MAIN` and `<NAME>_KIT_NO_STDIO`.
pub fn c(policy: &Policy) -> String {
    let name = &policy.name;
    format!(
        r"/* Driver of the back-to-back kit: the number of differences out, exit code 1 if there are any. */
#include <stdint.h>
#include <board.h>

uint32_t {name}_kit_run(void);

int main(void)
{{
    const uint32_t failed = {name}_kit_run();
    words_put(&failed, 1u);
    words_flush();
    return failed != 0u;
}}
"
    )
}
