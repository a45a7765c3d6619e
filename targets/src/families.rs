//! Microcontrollers by the names that are printed on them, for `--target`; the core of each is in its maker's data sheet.

use crate::TargetSpec;

/// Beginning of a part's name, in lower case, and the target of its core.
const FAMILIES: &[(&str, &str)] = &[
    ("stm32c0", "cortex-m0plus"),
    ("stm32f0", "cortex-m0plus"),
    ("stm32g0", "cortex-m0plus"),
    ("stm32l0", "cortex-m0plus"),
    ("stm32u0", "cortex-m0plus"),
    ("stm32f1", "cortex-m3"),
    ("stm32f2", "cortex-m3"),
    ("stm32l1", "cortex-m3"),
    ("stm32f3", "cortex-m4f"),
    ("stm32f4", "cortex-m4f"),
    ("stm32g4", "cortex-m4f"),
    ("stm32l4", "cortex-m4f"),
    ("stm32wba", "cortex-m33"),
    ("stm32wb0", "cortex-m0plus"),
    ("stm32wb", "cortex-m4f"),
    ("stm32f7", "cortex-m7"),
    ("stm32h7", "cortex-m7"),
    ("stm32h5", "cortex-m33"),
    ("stm32l5", "cortex-m33"),
    ("stm32u5", "cortex-m33"),
    ("rp2040", "cortex-m0plus"),
    ("rp2350", "cortex-m33"),
    ("nrf51", "cortex-m0plus"),
    ("nrf52", "cortex-m4f"),
    ("nrf53", "cortex-m33"),
    ("nrf91", "cortex-m33"),
    ("samd21", "cortex-m0plus"),
    ("atsamd21", "cortex-m0plus"),
    ("samd51", "cortex-m4f"),
    ("atsamd51", "cortex-m4f"),
    ("same70", "cortex-m7"),
    ("tm4c", "cortex-m4f"),
    ("msp432", "cortex-m4f"),
    ("xmc1", "cortex-m0plus"),
    ("xmc4", "cortex-m4f"),
    ("imxrt10", "cortex-m7"),
    ("tms320f28", "c2000-c28x"),
    ("f28", "c2000-c28x"),
    ("c2000", "c2000-c28x"),
    ("esp32c3", "riscv32imc"),
    ("esp32-c3", "riscv32imc"),
    ("esp32c6", "riscv32imc"),
    ("microlabbox", "dspace-ds1202"),
    ("ds1202", "dspace-ds1202"),
    ("cortex-m0", "cortex-m0plus"),
    ("thumbv6m", "cortex-m0plus"),
    ("thumbv7m-", "cortex-m3"),
    ("thumbv7em", "cortex-m4f"),
    ("thumbv8m.main", "cortex-m33"),
];

/// Beginnings of parts' names by target, one line each, for those who know their part and not its core.
#[must_use]
pub fn parts() -> String {
    let mut lines: Vec<String> = Vec::new();
    for (_, target) in FAMILIES {
        let line = format!("  {target:14} {}", of_target(target).join(" "));
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines.join("\n")
}

/// Beginnings of the names of a target's parts.
pub(crate) fn of_target(target: &str) -> Vec<&'static str> {
    let is_part = |name: &&str| !is_core(name);
    let names = FAMILIES.iter().filter(|(_, own)| *own == target).map(|(name, _)| *name);
    names.filter(is_part).collect()
}

/// The target of that name, or the one that has the core of that part.
///
/// A core or a compiler's triple that is nearly one is no part: what stands behind it is a slip, not a package.
#[must_use]
pub fn find_or_part(name: &str) -> Option<&'static TargetSpec> {
    let of_part = || of_part(name).filter(|_| !is_core(&name.to_ascii_lowercase()));
    crate::find(name).or_else(|| of_part().and_then(crate::find))
}

/// Whether the name begins as that of a core or of a compiler's triple.
fn is_core(name: &str) -> bool {
    name.starts_with("thumb") || name.starts_with("cortex")
}

/// The target of a part or a compiler's triple, if `name` begins as one that is known.
#[must_use]
pub fn of_part(name: &str) -> Option<&'static str> {
    // by its beginning: what follows in a part number is package, memory and temperature, not the core
    let name = name.to_ascii_lowercase();
    let part = FAMILIES.iter().find(|(part, _)| name.starts_with(part));
    part.map(|(_, target)| *target)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_lead_to_targets_that_exist() {
        for (part, target) in FAMILIES {
            assert!(crate::find(target).is_some(), "{part}");
            assert_eq!(of_part(&part.to_uppercase()), Some(*target), "hidden by one before it");
        }
        assert_eq!(of_part("STM32G474RE"), Some("cortex-m4f"));
        assert_eq!(of_part("pdp-11"), None);
        let target = |name| find_or_part(name).map(|target| target.name);
        assert_eq!(target("STM32G474RE"), Some("cortex-m4f"));
        assert_eq!(target("cortex-m3"), Some("cortex-m3"));
        for slip in ["cortex-m00", "thumbv6m-none", "cortex-m5", "pdp-11"] {
            assert_eq!(target(slip), None, "{slip}");
        }
    }
}
