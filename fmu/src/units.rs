//! Whether a variable of an FMU has the unit that it is wired to.
//!
//! A plant file is in SI units. An FMU may declare a unit by name, and define the name by exponents of the base units with factor
//! and offset. A definition is compared by these; a bare name has to be a usual one. A variable without unit is taken.

/// Exponents of kg, m, s, A; factor and offset to SI.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BaseUnit {
    /// kg, m, s, A, and the rest (K, mol, cd, rad) as one sum of sizes: none of our units has them.
    pub exponents: [i32; 5],
    pub factor: f64,
    pub offset: f64,
}

/// Unit in a plant file, names it goes by, exponents of kg, m, s, A.
const UNITS: [(&str, &[&str], [i32; 4]); 9] = [
    ("1", &["1", "-", "", "1/1"], [0, 0, 0, 0]),
    ("V", &["V", "volt", "Volt"], [1, 2, -3, -1]),
    ("A", &["A", "ampere", "Ampere"], [0, 0, 0, 1]),
    ("W", &["W", "watt", "Watt", "V.A", "V*A"], [1, 2, -3, 0]),
    ("ohm", &["Ohm", "ohm", "Ω", "\u{2126}", "V/A"], [1, 2, -3, -2]),
    ("S", &["S", "1/Ohm", "1/ohm", "A/V", "siemens"], [-1, -2, 3, 2]),
    ("H", &["H", "henry", "Henry", "V.s/A"], [1, 2, -2, -2]),
    ("F", &["F", "farad", "Farad", "A.s/V"], [-1, -2, 4, 2]),
    ("Hz", &["Hz", "1/s", "hertz"], [0, 0, -1, 0]),
];

/// Whether a variable that declares `unit`, defined as `base` if at all, is in `wanted` (as the plant's catalogue writes it).
pub(crate) fn is_in(wanted: &str, unit: &str, base: Option<&BaseUnit>) -> bool {
    let Some((_, names, exponents)) = UNITS.iter().find(|(name, ..)| *name == wanted) else {
        // seconds and what is rarer still: by name alone
        return unit == wanted && base.is_none_or(|base| base.factor == 1.0 && base.offset == 0.0);
    };
    match base {
        None => names.contains(&unit),
        Some(base) => {
            base.factor == 1.0 && base.offset == 0.0 && base.exponents[..4] == *exponents && base.exponents[4] == 0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_judged_by_its_definition_and_only_then_by_its_name() {
        let volt = BaseUnit {
            exponents: [1, 2, -3, -1, 0],
            factor: 1.0,
            offset: 0.0,
        };
        let milli = BaseUnit {
            factor: 1e-3,
            ..volt.clone()
        };
        assert!(is_in("V", "V", None) && is_in("V", "u1", Some(&volt)));
        assert!(!is_in("V", "mV", None) && !is_in("V", "V", Some(&milli)) && !is_in("A", "A", Some(&volt)));
        assert!(is_in("1", "", None) && !is_in("1", "%", None));
        assert!(is_in("s", "s", None) && !is_in("s", "ms", None));
    }

    /// From the definitions of the SI: what multiplies and divides to another unit does so in exponents.
    #[test]
    fn the_exponents_agree_with_each_other() {
        let of = |name: &str| UNITS.iter().find(|unit| unit.0 == name).unwrap().2;
        let sum = |a: [i32; 4], b: [i32; 4]| std::array::from_fn::<i32, 4, _>(|n| a[n] + b[n]);
        let second = [0, 0, 1, 0];
        assert_eq!(sum(of("V"), of("A")), of("W"));
        assert_eq!(sum(of("ohm"), of("A")), of("V"));
        assert_eq!(sum(of("ohm"), of("S")), of("1"));
        assert_eq!(sum(of("ohm"), second), of("H"));
        assert_eq!(sum(of("S"), second), of("F"));
        assert_eq!(sum(of("Hz"), second), of("1"));
    }
}
