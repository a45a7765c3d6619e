//! What the checks beside the control cost: the self test, the checksum of all tables, and a slice of it.

use codegen::Output;

use super::{counter, target};

/// Five passages: the self test, all tables, a first slice of 64 numbers, the one behind it, and one of 128.
const PROGRAM: &str = r#"
#include "board.h"
#include "buck12.h"
static buck12_check check;
static volatile uint32_t answer;
int main(void)
{
    uint32_t found;
    count_begin();
    found = buck12_self_test();
    count_end();
    answer = found;
    if (answer != 0u) { return 1; }
    count_begin();
    found = buck12_integrity();
    count_end();
    answer = found;
    if (answer != 1u) { return 1; }
    count_begin();
    found = buck12_integrity_slice(&check, 64u);
    count_end();
    answer = found;
    count_begin();
    found = buck12_integrity_slice(&check, 64u);
    count_end();
    answer = found;
    count_begin();
    found = buck12_integrity_slice(&check, 128u);
    count_end();
    answer = found;
    return answer == BUCK12_INTEGRITY_RUNNING && check.position == 256u ? 0 : 1;
}
"#;

/// Instructions of each passage, for the example as `gcc -O2` builds it.
fn instructions(name: &str) -> Vec<u64> {
    let target = target(name);
    let policy = policy::load(&tests::example()).unwrap();
    let files = codegen::generate(&policy, target, &[Output::C], None).unwrap().files;
    let files = ["buck12.c", "buck12.h"].map(|name| (name, files[name].as_str()));
    let beside = ["-O2", "-std=c99", "-ffp-contract=off", "buck12.c", "-lgcc"];
    let counts = counter::counts(target, PROGRAM, &files, &beside);
    let first = |line: &String| line.split(' ').next().unwrap().parse().unwrap();
    counts.iter().map(first).collect()
}

#[test]
fn a_slice_of_the_checksum_costs_its_share_of_all_tables() {
    for name in ["cortex-m4f", "cortex-m0plus"] {
        let counts = instructions(name);
        println!("{name}: self test, integrity, slices of 64, 64, 128: {counts:?} instructions");
        let [self_test, integrity, first, second, twice] = counts[..] else {
            panic!("{counts:?}")
        };
        // 5,248 weights, 140 biases and 12 duties: 5,400 numbers, of which a slice reads 64
        let share = integrity as f64 * 64.0 / 5400.0;
        // 64 numbers more cost their share, whatever a call costs by itself
        let more = twice as f64 - second as f64;
        assert!((more / share - 1.0).abs() < 0.01, "{name}: {counts:?}");
        assert!(
            first as f64 > share && (first as f64) < 1.2 * share,
            "{name}: {counts:?}"
        );
        // the same code over other numbers; the first call finds everything at 0
        assert!(first.abs_diff(second) < 50, "{name}: {counts:?}");
        // no known answer is cheaper than a pass through the network, which takes a load, a product and a sum each weight
        assert!(self_test > 5248, "{name}: {counts:?}");
    }
}
