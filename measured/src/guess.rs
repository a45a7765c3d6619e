//! What unknown columns may be, by names that people give: a proposal for a map, never applied.

use crate::locate::Located;
use crate::metered::is_metered;
use crate::quantity::{Quantity, is_of, is_unit, split_unit};
use crate::sheet::{Column, Sheet};

/// What one word alone means, without case, umlauts and punctuation. One that could be two quantities (`current`, `voltage` beside
/// another) stands where it is most often right: the user decides.
const SYNONYMS: [(&str, &[&str]); 9] = [
    (
        "t",
        &[
            "t",
            "time",
            "times",
            "timestamp",
            "timestamps",
            "elapsed",
            "elapsedtime",
            "seconds",
            "secs",
            "zeit",
            "zeitstempel",
        ],
    ),
    (
        "duty",
        &[
            "d",
            "duty",
            "dutycycle",
            "dutyratio",
            "dutycmd",
            "dcmd",
            "dreal",
            "pwm",
            "pwmduty",
            "tastgrad",
            "tastverhaeltnis",
            "aussteuergrad",
        ],
    ),
    ("v_out", &["voltage", "spannung", "vc", "uc"]),
    ("i_l", &[]),
    ("i_out", &["current", "strom"]),
    ("v_in", &[]),
    (
        "r_load",
        &[
            "rload",
            "rl",
            "rlast",
            "loadresistance",
            "loadresistor",
            "lastwiderstand",
        ],
    ),
    (
        "i_load",
        &[
            "iload",
            "iset",
            "loadset",
            "setcurrent",
            "sollstrom",
            "eload",
            "electronicload",
            "elast",
        ],
    ),
    ("p_load", &["pload", "plast", "pset", "loadpower", "lastleistung"]),
];

/// Names of a voltage and of a current, in a name that says its place as well: `vout`, `Ausgangsspannung`, `U_Last`.
const KINDS: [(char, &[&str]); 2] = [
    ('v', &["spannung", "voltage", "volt", "v", "u"]),
    ('i', &["strom", "current", "i"]),
];

/// Places in the converter. The single letters are those of textbooks: a German output is `a`, its input `e`.
const PLACES: [(&str, &[&str]); 3] = [
    ("out", &["out", "output", "o", "aus", "ausgang", "a", "load", "last"]),
    (
        "in",
        &[
            "in",
            "input",
            "i",
            "ein",
            "eingang",
            "e",
            "bus",
            "dc",
            "dcbus",
            "dclink",
            "supply",
            "source",
            "quelle",
            "zwischenkreis",
        ],
    ),
    (
        "l",
        &[
            "l", "ind", "inductor", "coil", "choke", "lind", "spule", "spulen", "drossel",
        ],
    ),
];

/// Words that say how something was measured, not what.
const MANNERS: [&str; 12] = [
    "meas", "measured", "mess", "ist", "actual", "act", "avg", "mean", "raw", "adc", "sense", "sensor",
];

impl Sheet {
    /// Columns that nobody asked for and that are called like a quantity which was not found: its name and the column's.
    #[must_use]
    pub fn guesses<'a>(&'a self, located: &Located, wanted: &[Quantity<'_>]) -> Vec<(&'static str, &'a str)> {
        let missing = SYNONYMS
            .iter()
            .filter(|(name, _)| located.signal(name).is_none() && wanted.iter().any(|quantity| quantity.name == *name));
        let column = |(name, synonyms): &(&'static str, &[&str])| {
            let mut unused = located.unused.iter().filter_map(|index| self.columns().get(*index));
            let found = unused.find(|column| is_alike(&column.name, name, synonyms))?;
            Some((*name, found))
        };
        let mut found: Vec<_> = missing.filter_map(column).collect();
        found.extend(self.resistor(located, wanted, &found));
        let has_i_out = located.signal("i_out").is_some() || found.iter().any(|(name, _)| *name == "i_out");
        let asks_i_out = wanted.iter().any(|quantity| quantity.name == "i_out");
        // a load current that was read off a meter, whatever it is called
        let as_read = |(name, column): (&'static str, &'a Column)| match name {
            "i_load" if asks_i_out && !has_i_out && is_metered(&column.values) => ("i_out", column.name.as_str()),
            _ => (name, column.name.as_str()),
        };
        found.into_iter().map(as_read).collect()
    }
}

impl Sheet {
    /// The one column in ohms, where nothing else says what the load is.
    fn resistor<'a>(
        &'a self,
        located: &Located,
        wanted: &[Quantity<'_>],
        found: &[(&'static str, &'a Column)],
    ) -> Option<(&'static str, &'a Column)> {
        const LOADS: [&str; 3] = ["r_load", "i_load", "p_load"];
        let has = |name: &&str| located.signal(name).is_some() || found.iter().any(|(known, _)| known == name);
        if LOADS.iter().any(has) || !wanted.iter().any(|quantity| quantity.name == "r_load") {
            return None;
        }
        let unused = located.unused.iter().filter_map(|index| self.columns().get(*index));
        let mut ohms = unused.filter(|column| is_of(split_unit(&column.name).1.unwrap_or_default(), "ohm"));
        let one = ohms.next()?;
        ohms.next().is_none().then_some(("r_load", one))
    }

    /// A column that nobody asked for and that has one of a quantity's names up to case and punctuation: `vo` for `v_o`.
    #[must_use]
    pub fn nearly<'a>(&'a self, located: &Located, quantity: &Quantity<'_>) -> Option<&'a str> {
        let names: Vec<String> = quantity.names().map(plain).collect();
        let unused = located.unused.iter().filter_map(|index| self.columns().get(*index));
        let mut headers = unused.map(|column| column.name.as_str());
        headers.find(|header| names.contains(&plain(header)))
    }

    /// A column that is called like a quantity.
    pub(crate) fn resembling(&self, quantity: &str) -> Option<&str> {
        let (_, synonyms) = SYNONYMS.iter().find(|(name, _)| *name == quantity)?;
        self.headers().find(|header| is_alike(header, quantity, synonyms))
    }
}

/// Guesses as a map: an argument of `--map`, or a line of a map file where a name could not stand there. Nothing without a guess.
#[must_use]
pub fn proposal(guesses: &[(&str, &str)]) -> Option<String> {
    if guesses.is_empty() {
        return None;
    }
    let is_plain = |name: &str| !name.contains([',', '*', '=', '\'']) && name.parse::<f64>().is_err();
    if guesses.iter().any(|(_, column)| !is_plain(column)) {
        let entries: Vec<String> = guesses
            .iter()
            .map(|(name, column)| format!("{name} = {column:?}"))
            .collect();
        return Some(format!(
            "--columns MAP.toml with the line: columns = {{ {} }}",
            entries.join(", ")
        ));
    }
    let entries: Vec<String> = guesses
        .iter()
        .map(|(name, column)| format!("{name}={column}"))
        .collect();
    Some(argument(&entries.join(",")))
}

/// `--map` with what stands behind it, as a shell takes it.
#[must_use]
pub fn argument(map: &str) -> String {
    let is_word = |c: char| c.is_ascii_alphanumeric() || "_.=,-*".contains(c);
    match map.chars().all(is_word) {
        true => format!("--map {map}"),
        false => format!("--map '{map}'"),
    }
}

/// Whether a header may mean a quantity: by a word that alone means it, or by kind and place.
fn is_alike(header: &str, quantity: &str, synonyms: &[&str]) -> bool {
    let name = plain(header);
    let is_elsewhere = || SYNONYMS.iter().any(|(_, others)| others.contains(&name.as_str()));
    synonyms.contains(&name.as_str()) || (!is_elsewhere() && placed(&name) == Some(quantity))
}

/// The quantity of a name that is a kind and a place and nothing else, in either order: `uaus`, `outv`, `eingangsspannung`.
fn placed(name: &str) -> Option<&'static str> {
    let place_of = |rest: &str| {
        // the joint of a German compound: Ausgang-s-spannung
        let is_of = |known: &&str| *known == rest || rest.strip_suffix('s') == Some(*known) && known.len() > 3;
        PLACES
            .iter()
            .find(|(_, words)| words.iter().any(is_of))
            .map(|(place, _)| *place)
    };
    let pairs = KINDS
        .iter()
        .flat_map(|(kind, words)| words.iter().map(move |word| (*kind, *word)));
    pairs
        .filter_map(|(kind, word)| {
            let behind = name.strip_prefix(word).and_then(place_of);
            let place = behind.or_else(|| name.strip_suffix(word).and_then(place_of))?;
            Some(match (kind, place) {
                ('v', "out") => "v_out",
                ('v', "in") => "v_in",
                ('i', "out") => "i_out",
                ('i', "l") => "i_l",
                _ => return None,
            })
        })
        .next()
}

/// A header without unit, case, umlauts, punctuation and manner of measuring.
fn plain(header: &str) -> String {
    let (base, _) = split_unit(header);
    let base = match base.rsplit_once(['_', ' ', '.', '-']) {
        Some((shorter, unit)) if is_unit(unit) => shorter,
        _ => base,
    };
    let lower = base.to_lowercase();
    let words = lower.split(|c: char| !c.is_alphanumeric());
    let words: String = words.filter(|word| !MANNERS.contains(word)).collect();
    let spelled = |c: char| match c {
        'ä' => "ae".to_owned(),
        'ö' => "oe".to_owned(),
        'ü' => "ue".to_owned(),
        'ß' => "ss".to_owned(),
        other => other.to_string(),
    };
    words.chars().map(spelled).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{plain, proposal};
    use crate::{ColumnMap, Options, Quantity, Sheet, VOCABULARY};

    fn proposed(header: &str) -> Option<String> {
        let text = format!("{header}\n{}\n", vec!["1"; header.split(';').count()].join(";"));
        let sheet = Sheet::parse(Path::new("a.csv"), text.into_bytes(), &Options::default()).unwrap();
        let located = sheet.locate(&VOCABULARY, &ColumnMap::default()).unwrap();
        proposal(&sheet.guesses(&located, &VOCABULARY))
    }

    #[test]
    fn case_punctuation_units_and_manner_do_not_matter() {
        for (header, expected) in [
            ("V-Out", "vout"),
            ("V.out [mV]", "vout"),
            ("vout_V", "vout"),
            ("Vout (meas)", "vout"),
            ("I_L_avg", "il"),
            ("Tastverhältnis", "tastverhaeltnis"),
        ] {
            assert_eq!(plain(header), expected, "{header}");
        }
    }

    /// A policy has signals of its own, which no list knows.
    #[test]
    fn a_name_that_differs_in_punctuation_alone_is_near() {
        let text = b"vo,I-L,io2,k\n1,2,3,4\n".to_vec();
        let sheet = Sheet::parse(Path::new("a.csv"), text, &Options::default()).unwrap();
        let quantity = |name| Quantity {
            name,
            aliases: &[],
            unit: "",
        };
        let wanted = ["v_o", "i_l", "i_o"].map(quantity);
        let located = sheet.locate(&wanted, &ColumnMap::default()).unwrap();
        let found = wanted.each_ref().map(|quantity| sheet.nearly(&located, quantity));
        assert_eq!(found, [Some("vo"), Some("I-L"), None]);
    }

    #[test]
    fn a_bench_with_names_of_its_own_gets_a_whole_map() {
        assert_eq!(
            proposed("Vout;Iout;IL;Vin;D;time_s").as_deref(),
            Some("--map v_out=Vout,i_l=IL,i_out=Iout,v_in=Vin")
        );
        assert_eq!(
            proposed("Zeit;Tastgrad;Spannung [mV];Spulenstrom").as_deref(),
            Some("--map 't=Zeit,duty=Tastgrad,v_out=Spannung [mV],i_l=Spulenstrom'")
        );
    }

    #[test]
    fn a_name_of_kind_and_place_is_understood_in_either_order_and_language() {
        for (header, quantity) in [
            ("I_Last", Some("i_out")),
            ("U_Last", Some("v_out")),
            ("Laststrom", Some("i_out")),
            ("Ausgangsspannung [V]", Some("v_out")),
            ("Zwischenkreisspannung", Some("v_in")),
            ("InputVoltage", Some("v_in")),
            ("voltage_in", Some("v_in")),
            ("Drosselstrom_A", Some("i_l")),
            ("u_dc", Some("v_in")),
            ("Uoutput", Some("v_out")),
            ("Iload", Some("i_load")),
            ("eload_A", Some("i_load")),
            ("R_Last", Some("r_load")),
            // neither is a quantity that is read, or says which
            ("Iin", None),
            ("v_l", None),
            ("v_ref", None),
            ("i", None),
            ("u", None),
            ("Vout_old", None),
            ("vi_loop", None),
        ] {
            // everything else is there
            let guessed = proposed(&format!("lamp;{header}"));
            let expected = quantity.map(|quantity| format!("{quantity}="));
            assert_eq!(
                guessed
                    .as_deref()
                    .map(|map| map.contains(expected.as_deref().unwrap_or("?"))),
                expected.as_ref().map(|_| true),
                "{header}: {guessed:?}"
            );
        }
    }

    #[test]
    fn the_one_column_in_ohms_is_the_load_where_nothing_else_is() {
        assert_eq!(
            proposed("t;duty;v_out;R_set [Ohm]").as_deref(),
            Some("--map 'r_load=R_set [Ohm]'")
        );
        for header in [
            "t;duty;v_out;R_1 [Ohm];R_2 [Ohm]",
            "t;duty;v_out;i_load;R_set [Ohm]",
            "t;duty;v_out;R_set [V]",
        ] {
            let map = proposed(header).unwrap_or_default();
            assert!(!map.contains("r_load"), "{header}: {map}");
        }
    }

    #[test]
    fn a_load_current_is_what_was_set_or_what_a_meter_showed_as_its_rows_say() {
        // what was set: a step; what a meter showed: the same with a jitter of some milliamperes
        let set = |n: u32| if n < 30 { 2.0 } else { 5.0 };
        let jitter = |n: u32| f64::from(n.wrapping_mul(2_654_435_761) >> 16) / 65_536.0 - 0.5;
        let of_rows = |load: &dyn Fn(u32) -> f64, other: Option<&str>| {
            let header = format!(
                "t;duty;v_out;Iload{}",
                other.map(|name| format!(";{name}")).unwrap_or_default()
            );
            let row = |n: u32| {
                format!(
                    "{};0.25;12.1;{:.5}{}\n",
                    f64::from(n) * 1e-5,
                    load(n),
                    other.map_or("", |_| ";2.0")
                )
            };
            let text = format!("{header}\n{}", (0..60).map(row).collect::<String>());
            let sheet = Sheet::parse(Path::new("a.csv"), text.into_bytes(), &Options::default()).unwrap();
            let located = sheet.locate(&VOCABULARY, &ColumnMap::default()).unwrap();
            proposal(&sheet.guesses(&located, &VOCABULARY))
        };
        let proposed = |noise: f64, other: Option<&str>| of_rows(&|n| set(n) + noise * jitter(n), other);
        assert_eq!(proposed(0.0, None).as_deref(), Some("--map i_load=Iload"));
        assert_eq!(proposed(0.02, None).as_deref(), Some("--map i_out=Iload"));
        // a meter whose last digit shows what noise there is, beside one row in five
        let last_digit = |n: u32| {
            if n % 5 == 3 {
                [0.01, -0.01][(n / 5 % 2) as usize]
            } else {
                0.0
            }
        };
        assert_eq!(
            of_rows(&|n| set(n) + last_digit(n), None).as_deref(),
            Some("--map i_out=Iload")
        );
        // a set load that goes to and fro stays for some rows
        let to_and_fro = |n: u32| [5.0, 5.2][(n / 6 % 2) as usize];
        assert_eq!(of_rows(&to_and_fro, None).as_deref(), Some("--map i_load=Iload"));
        // another one is the measured load current
        assert_eq!(proposed(0.02, Some("i_out")).as_deref(), Some("--map i_load=Iload"));
    }

    #[test]
    fn a_source_is_called_by_the_letter_of_either_language() {
        assert_eq!(
            proposed("Time_us;PWM_pct;Uout_V;Icoil_A;Ubus_V").as_deref(),
            Some("--map duty=PWM_pct,v_out=Uout_V,i_l=Icoil_A,v_in=Ubus_V")
        );
    }

    #[test]
    fn names_that_the_command_line_cannot_hold_go_into_a_file() {
        assert_eq!(
            proposed("Vout*2;d").as_deref(),
            None,
            "a name with a factor in it is not the quantity"
        );
        assert_eq!(
            proposal(&[("v_out", "Vout, V")]).as_deref(),
            Some("--columns MAP.toml with the line: columns = { v_out = \"Vout, V\" }")
        );
    }

    #[test]
    fn nothing_is_proposed_for_what_is_known_or_strange() {
        assert_eq!(proposed("t;d;v_o;i_l;lamp;temperature;v_offset;Vout_old"), None);
        assert_eq!(proposed("v_out;Vout"), None, "v_out is there");
    }
}
