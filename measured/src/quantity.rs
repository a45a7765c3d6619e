//! The quantities that a table of measurements may hold, by name, and the units that may follow a name.

/// A quantity that is looked for in a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity<'a> {
    /// Its name.
    pub name: &'a str,
    /// Other names of it.
    pub aliases: &'a [&'a str],
    /// The unit in which it is wanted, such as `V`; empty if none can be told.
    pub unit: &'a str,
}

/// What the commands read, in SI units.
///
/// A settled point may say how much the voltage scattered (`v_std`) and whether it had settled (`settled`).
pub const VOCABULARY: [Quantity<'static>; 14] = [
    quantity(
        "t",
        &["time", "times", "timestamp", "timestamps", "time_stamp", "time_stamps"],
        "s",
    ),
    quantity("duty", &["d", "d_real"], "1"),
    quantity("v_out", &["v_o"], "V"),
    quantity("i_l", &[], "A"),
    quantity("i_out", &["i_o"], "A"),
    quantity("v_in", &[], "V"),
    quantity("i_in", &[], "A"),
    quantity("v_sw", &["v_switch", "switch_node"], "V"),
    quantity("v_pwm", &["pwm_pin"], "V"),
    quantity("r_load", &[], "ohm"),
    quantity("i_load", &[], "A"),
    quantity("p_load", &[], "W"),
    quantity("v_std", &[], "V"),
    quantity("settled", &[], ""),
];

/// A plan of `drm acquire` has the duty that was asked for beside the one that was measured: the latter counts.
const MEASURED_DUTY: &str = "d_real";

const fn quantity(name: &'static str, aliases: &'static [&'static str], unit: &'static str) -> Quantity<'static> {
    Quantity { name, aliases, unit }
}

/// Units without a prefix, and what they measure; the first of a kind is its SI unit.
const UNITS: &[(&str, &str)] = &[
    ("s", "s"),
    ("sec", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("V", "V"),
    ("volt", "V"),
    ("volts", "V"),
    ("A", "A"),
    ("amp", "A"),
    ("amps", "A"),
    ("ampere", "A"),
    ("amperes", "A"),
    ("W", "W"),
    ("watt", "W"),
    ("watts", "W"),
    ("ohm", "ohm"),
    ("ohms", "ohm"),
    // the Greek letter and the sign of the unit look alike; so do the two signs for micro below
    ("\u{3a9}", "ohm"),
    ("\u{2126}", "ohm"),
    ("1", "1"),
    ("-", "1"),
];

/// Prefixes and their factors. There is none for millions: `MV` may be meant as millivolts, and nobody can tell.
const PREFIXES: &[(char, f64)] = &[
    ('n', 1e-9),
    ('u', 1e-6),
    ('\u{b5}', 1e-6),
    ('\u{3bc}', 1e-6),
    ('m', 1e-3),
    ('k', 1e3),
];

/// Shares of one.
const SHARES: [&str; 3] = ["%", "percent", "pct"];

/// What a unit measures, and how many SI units it is. The case of letters does not matter, but for a capital M.
fn unit(text: &str) -> Option<(&'static str, f64)> {
    let plain = |text: &str| {
        UNITS
            .iter()
            .find(|(name, _)| name.to_lowercase() == text.to_lowercase())
    };
    if SHARES.iter().any(|share| share.eq_ignore_ascii_case(text)) {
        return Some(("1", 0.01));
    }
    if let Some((_, of)) = plain(text) {
        return Some((of, 1.0));
    }
    // K, N and U can only be meant as the small letters; M may be milli or mega
    let first = text.chars().next().filter(|first| *first != 'M')?;
    let known = |(prefix, _): &&(char, f64)| first.to_lowercase().eq([*prefix]);
    let (_, factor) = PREFIXES.iter().find(known)?;
    // a share has no prefix: nobody can tell what `m%` means
    let (_, of) = plain(&text[first.len_utf8()..]).filter(|(_, of)| *of != "1")?;
    Some((of, *factor))
}

/// Whether a text is a unit.
pub(crate) fn is_unit(text: &str) -> bool {
    unit(text).is_some()
}

/// Whether a text is a unit of what `wanted` measures.
pub(crate) fn is_of(text: &str, wanted: &str) -> bool {
    unit(text).is_some_and(|(of, _)| of == wanted)
}

/// How many of `to` one of `from` is; nothing if they do not measure the same.
fn scale(from: &str, to: &str) -> Option<f64> {
    if from.eq_ignore_ascii_case(to) {
        return Some(1.0);
    }
    let ((of, from), (wanted, to)) = (unit(from)?, unit(to)?);
    (of == wanted).then(|| from / to)
}

impl Quantity<'_> {
    /// The quantity of the vocabulary with this name or alias, in any case of letters.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Quantity<'static>> {
        VOCABULARY.iter().find(|quantity| quantity.is_called(name))
    }

    /// The quantities of the vocabulary with these names, in the order of the vocabulary.
    #[must_use]
    pub fn all(names: &[&str]) -> Vec<Quantity<'static>> {
        VOCABULARY
            .into_iter()
            .filter(|quantity| names.contains(&quantity.name))
            .collect()
    }

    /// Its name and its aliases.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.name).chain(self.aliases.iter().copied())
    }

    pub(crate) fn is_called(&self, text: &str) -> bool {
        self.names().any(|name| name.eq_ignore_ascii_case(text))
    }

    /// What a header calls this quantity.
    pub(crate) fn called<'h>(&'h self, header: &'h str) -> &'h str {
        if self.is_called(header.trim()) {
            return header.trim();
        }
        let (base, _) = split_unit(header);
        // `v_out_mV` is called `v_out` where a fault names it
        let shorter = base.rsplit_once(['_', ' ']).map(|(shorter, _)| shorter.trim_end());
        let known = [Some(base), shorter].into_iter().flatten();
        known.into_iter().find(|text| self.is_called(text)).unwrap_or(self.name)
    }

    /// What a number below `header` must be multiplied by, if that is a name of this quantity, with a unit or without.
    pub(crate) fn scale_of(&self, header: &str) -> Option<f64> {
        // a name may have brackets itself, as an element of an array: `obs[0]`
        if self.is_called(header.trim()) {
            return Some(1.0);
        }
        let (base, unit) = split_unit(header);
        if self.is_called(base) {
            return unit.map_or(Some(1.0), |unit| self.scale_from(unit));
        }
        // `v_out_mV`, `t us`: only a known unit is one, for `v_out_old` is another column
        let (base, unit) = header.trim().rsplit_once(['_', ' '])?;
        let scale = scale(unit, self.unit).filter(|_| !self.unit.is_empty())?;
        self.is_called(base.trim_end()).then_some(scale)
    }

    /// How many of its own unit one of another is. A quantity without a unit takes any that has no prefix: what millivolts
    /// would have to be converted to, nobody has said.
    pub(crate) fn scale_from(&self, text: &str) -> Option<f64> {
        match self.unit {
            "" => unit(text).is_none_or(|(_, factor)| factor == 1.0).then_some(1.0),
            own => scale(text, own),
        }
    }

    /// Its unit with the prefixes that are read, for a fault.
    pub(crate) fn units(&self) -> String {
        match self.unit {
            "1" => "1 or %".to_owned(),
            unit => format!("{unit}, with a prefix n, u, m or k"),
        }
    }

    /// The quantity of the vocabulary that a header names, and the scale of the unit behind the name, if there is one.
    pub(crate) fn of_header(header: &str) -> Option<(&'static Quantity<'static>, Option<f64>)> {
        VOCABULARY.iter().find_map(|quantity| {
            let scale = quantity.scale_of(header)?;
            Some((quantity, (!quantity.is_called(header.trim())).then_some(scale)))
        })
    }

    /// The unit behind a name that a map gives: of the quantity's kind, or it is part of the name. In brackets, one of another kind
    /// is a fault ([`Quantity::foreign_unit`]).
    pub(crate) fn scale_behind(&self, header: &str) -> f64 {
        let (_, unit) = split_unit(header);
        let unit = unit.or_else(|| header.trim().rsplit_once(['_', ' ']).map(|(_, unit)| unit));
        unit.and_then(|unit| scale(unit, self.unit)).unwrap_or(1.0)
    }

    /// The unit in brackets or behind a stroke of a header, if it is one of another kind than this quantity's.
    pub(crate) fn foreign_unit<'h>(&self, header: &'h str) -> Option<&'h str> {
        let text = split_unit(header).1?;
        // a unit of a policy's own may be none of those that are known here
        let ((of, _), (wanted, _)) = (unit(text)?, unit(self.unit)?);
        (of != wanted).then_some(text)
    }

    /// Whether `header` is the duty that was measured where another column is the one that was asked for.
    pub(crate) fn is_measured_duty(header: &str) -> bool {
        let lower = header.trim().to_ascii_lowercase();
        lower
            .strip_prefix(MEASURED_DUTY)
            // `d_real [%]` and `d_real_pct` are meant, `d_really` is another column
            .is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
    }
}

/// A name and the unit in brackets, behind a stroke or as a percent sign: `v_out [mV]`, `i_l/A`, `duty (%)`, `d%`.
pub(crate) fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim();
    match header.find(['[', '(', '/', '%']) {
        // a sign at the start is all of the name: `%` alone measures nothing
        Some(start) if start > 0 => {
            let unit = header[start..].trim_matches(|c: char| c == ' ' || "[]()/".contains(c));
            (header[..start].trim_end_matches([' ', '_']), Some(unit))
        }
        _ => (header, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scale_to_si(header: &str) -> Option<(&'static str, f64)> {
        VOCABULARY
            .iter()
            .find_map(|quantity| Some((quantity.name, quantity.scale_of(header)?)))
    }

    #[test]
    fn units_in_the_header_are_scaled_to_si() {
        for (header, expected) in [
            ("v_o [mV]", Some(("v_out", 1e-3))),
            ("v_out/mV", Some(("v_out", 1e-3))),
            ("V_OUT [V]", Some(("v_out", 1.0))),
            ("t_us", Some(("t", 1e-6))),
            ("timestamps [\u{b5}s]", Some(("t", 1e-6))),
            ("time_s", Some(("t", 1.0))),
            ("Time (s)", Some(("t", 1.0))),
            ("d (%)", Some(("duty", 0.01))),
            ("duty%", Some(("duty", 0.01))),
            ("d_percent", Some(("duty", 0.01))),
            ("d_real", Some(("duty", 1.0))),
            ("i_out [uA]", Some(("i_out", 1e-6))),
            ("v_in/kV", Some(("v_in", 1e3))),
            ("V_IN [KV]", Some(("v_in", 1e3))),
            ("v_out [Volt]", Some(("v_out", 1.0))),
            ("r_load [k\u{3a9}]", Some(("r_load", 1e3))),
            ("p_load_kW", Some(("p_load", 1e3))),
            ("time (sec)", Some(("t", 1.0))),
            ("duty [m%]", None),
            ("i_out [MA]", None),
            ("v_out [us]", None),
            ("v_out [dBV]", None),
            ("v_out_old", None),
            ("v_in", Some(("v_in", 1.0))),
            ("v_offset", None),
            ("temperature", None),
            ("T [degC]", None),
            ("", None),
            ("%", None),
        ] {
            assert_eq!(scale_to_si(header), expected, "{header}");
        }
    }

    #[test]
    fn a_unit_that_is_no_si_unit_is_reached_as_well() {
        let quantity = Quantity {
            name: "v",
            aliases: &[],
            unit: "mV",
        };
        assert_eq!(quantity.scale_of("v [V]"), Some(1e3));
        assert_eq!(quantity.scale_of("v [mV]"), Some(1.0));
        let odd = Quantity {
            name: "x",
            aliases: &[],
            unit: "degC",
        };
        assert_eq!(odd.scale_of("x [degC]"), Some(1.0));
        assert_eq!(odd.scale_of("x [V]"), None);
    }
}
