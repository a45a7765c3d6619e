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
pub const VOCABULARY: [Quantity<'static>; 11] = [
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

/// Units by what they measure, and how many SI units they are.
///
/// A prefix counts in the case that it has in SI: `mV` is known, `MV` is not, since nobody can tell which was meant.
const UNITS: &[(&str, &str, f64)] = &[
    ("s", "s", 1.0),
    ("ms", "s", 1e-3),
    ("us", "s", 1e-6),
    ("\u{b5}s", "s", 1e-6),
    ("\u{3bc}s", "s", 1e-6),
    ("ns", "s", 1e-9),
    ("v", "V", 1.0),
    ("mv", "V", 1e-3),
    ("kv", "V", 1e3),
    ("a", "A", 1.0),
    ("ma", "A", 1e-3),
    ("w", "W", 1.0),
    ("mw", "W", 1e-3),
    ("kw", "W", 1e3),
    ("ohm", "ohm", 1.0),
    ("\u{3a9}", "ohm", 1.0),
    ("\u{2126}", "ohm", 1.0),
    ("1", "1", 1.0),
    ("-", "1", 1.0),
    ("%", "1", 0.01),
    ("percent", "1", 0.01),
    ("pct", "1", 0.01),
];

/// How many of `to` one of `from` is; nothing if they do not measure the same.
fn scale(from: &str, to: &str) -> Option<f64> {
    if from.eq_ignore_ascii_case(to) {
        return Some(1.0);
    }
    let find = |unit: &str| {
        let mega = unit.starts_with('M') && unit.chars().count() > 1;
        let lower = unit.to_ascii_lowercase();
        UNITS
            .iter()
            .find(|(name, ..)| !mega && (*name == lower || *name == unit))
    };
    let ((_, of, from), (_, wanted, to)) = (find(from)?, find(to)?);
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
        let (base, _) = split_unit(header);
        let shorter = base.rsplit_once(['_', ' ']).map(|(shorter, _)| shorter.trim_end());
        let known = [Some(base), shorter].into_iter().flatten();
        known.into_iter().find(|text| self.is_called(text)).unwrap_or(self.name)
    }

    /// What a number below `header` must be multiplied by, if that is a name of this quantity, with a unit or without.
    pub(crate) fn scale_of(&self, header: &str) -> Option<f64> {
        let (base, unit) = split_unit(header);
        if self.is_called(base) {
            return unit.map_or(Some(1.0), |unit| scale(unit, self.unit));
        }
        // `v_out_mV`, `t us`: only a known unit is one, for `v_out_old` is another column
        let (base, unit) = header.trim().rsplit_once(['_', ' '])?;
        let scale = scale(unit, self.unit).filter(|_| !self.unit.is_empty())?;
        self.is_called(base.trim_end()).then_some(scale)
    }

    /// The unit behind a name that a map gives: of the quantity's kind, or it is part of the name.
    pub(crate) fn scale_behind(&self, header: &str) -> f64 {
        let (_, unit) = split_unit(header);
        let unit = unit.or_else(|| header.trim().rsplit_once(['_', ' ']).map(|(_, unit)| unit));
        unit.and_then(|unit| scale(unit, self.unit)).unwrap_or(1.0)
    }

    /// Whether `header` is the duty that was measured where another column is the one that was asked for.
    pub(crate) fn is_measured_duty(header: &str) -> bool {
        let lower = header.trim().to_ascii_lowercase();
        lower
            .strip_prefix(MEASURED_DUTY)
            .is_some_and(|rest| !rest.starts_with(char::is_alphanumeric))
    }
}

/// A name and the unit in brackets, behind a stroke or as a percent sign: `v_out [mV]`, `i_l/A`, `duty (%)`, `d%`.
pub(crate) fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim();
    match header.find(['[', '(', '/', '%']) {
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
