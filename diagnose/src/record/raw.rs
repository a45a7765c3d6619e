//! A table with its signals found and turned into SI units: duty, load, channels, time.

use measured::{ColumnMap, Located, Quantity, Sheet, Signal, is_metered, proposal, table_faults};
use plant::Load;
use toml_input::{Fault, Faults, Message, Sink};

use super::channels::QUANTITIES;
use super::digits::{lattice, rounding};
use super::source::Source;
use super::unread::Unread;

/// What a record may hold.
const NAMES: [&str; 12] = [
    "t", "duty", "v_out", "i_l", "i_out", "v_in", "r_load", "i_load", "p_load", "i_in", "v_sw", "v_pwm",
];
/// What only a capture has a use for.
const OF_CAPTURES: [&str; 3] = ["i_in", "v_sw", "v_pwm"];
/// What may say the load: set, or else measured.
const SET_LOADS: [&str; 3] = ["r_load", "i_load", "p_load"];
const LOADS: [&str; 4] = ["r_load", "i_load", "p_load", "i_out"];

/// A table with its signals found.
pub(super) struct Raw<'a> {
    pub sheet: &'a Sheet,
    pub located: Located,
    /// Each quantity in SI, NaN where nothing was measured; nothing if it is not there.
    values: Vec<(&'static str, Vec<f64>)>,
    pub repairs: Vec<String>,
    /// Columns that look like a channel and are not read as such.
    pub unread: Vec<Unread>,
    /// Time of the first row that is used, s.
    pub start: f64,
}

impl<'a> Raw<'a> {
    pub fn new(sheet: &'a Sheet, map: &ColumnMap) -> Result<Self, Faults> {
        let mut located = sheet.locate(&Quantity::all(&NAMES), map)?;
        let metered = take_for_a_meter(sheet, &mut located);
        let may_be_capture = OF_CAPTURES.iter().any(|name| located.signal(name).is_some());
        incomplete(sheet, &located, may_be_capture).propagate()?;
        let mut faults = table_faults();
        let mut values = Vec::new();
        for name in NAMES {
            if let Some(signal) = located.signal(name) {
                values.push((name, signal.values(sheet, &mut faults)));
            }
        }
        faults.propagate()?;
        let mut repairs = located.notes(sheet, &[]);
        repairs.extend(metered);
        let is_column = |name: &str| located.signal(name).is_some_and(|signal| signal.column().is_some());
        let is_set = |name: &str| {
            values
                .iter()
                .any(|(known, of)| *known == name && of.iter().any(|value| *value != 0.0))
        };
        // beside a measured load current nobody takes one for the other, and zeros are no load
        if is_column("i_load") && is_set("i_load") && !is_column("i_out") {
            repairs.push("i_load is read as the load that was set; a measured load current is i_out".to_owned());
        }
        let guesses = sheet.guesses(&located, &Quantity::all(&NAMES));
        // an unknown time is a question of its own
        let is_open = |name: &str| name != "t" && !map.says_none(name);
        let guesses: Vec<_> = guesses.into_iter().filter(|(name, _)| is_open(name)).collect();
        let mut unread = Vec::new();
        if let Some(map) = proposal(&guesses) {
            let alike: Vec<String> = guesses
                .iter()
                .map(|(name, column)| format!("`{column}` looks like {name}"))
                .collect();
            repairs.push(format!("{} and is not read as such: {map}", alike.join(", ")));
            unread.extend(
                guesses
                    .iter()
                    .filter_map(|(name, column)| Unread::looks_like(name, column)),
            );
        }
        Ok(Raw {
            repairs,
            unread,
            sheet,
            located,
            values,
            start: 0.0,
        })
    }

    /// What every record but a capture needs.
    pub fn needs_duty_and_channel(&self) -> Result<(), Faults> {
        incomplete(self.sheet, &self.located, false).propagate()
    }

    pub fn rows(&self) -> usize {
        self.sheet.rows()
    }

    /// What the file calls a quantity.
    pub fn label(&self, name: &str) -> String {
        self.located
            .signal(name)
            .map_or(name, |signal| &signal.label)
            .to_owned()
    }

    /// Where a channel comes from, to say how its map would have to be.
    pub fn source(&self, name: &str) -> Source {
        let signal = self.located.signal(name);
        let column = signal
            .and_then(Signal::column)
            .and_then(|n| self.sheet.columns().get(n));
        Source {
            label: self.label(name),
            header: column.map_or(name, |column| &column.name).to_owned(),
            scale: signal.map_or(1.0, Signal::scale),
            stated: signal.is_some_and(Signal::is_stated),
        }
    }

    /// A fault of a quantity in a row.
    pub fn fault(&self, name: &str, row: usize, message: Message) -> Fault {
        match self.located.signal(name) {
            Some(signal) => signal.fault(self.sheet, row, message),
            None => self.sheet.row_fault(row, message),
        }
    }

    /// A quantity in SI.
    pub fn values(&self, name: &str) -> Option<Vec<f64>> {
        let found = self.values.iter().find(|(known, _)| *known == name);
        found.map(|(_, values)| values.clone())
    }

    /// A quantity that stands in a column; a constant is a setting, no measurement.
    pub fn measured(&self, name: &str) -> Option<Vec<f64>> {
        let is_column = self.located.signal(name)?.column().is_some();
        self.values(name).filter(|_| is_column)
    }

    /// A quantity in the rows that are used.
    pub fn pick(&self, name: &str, rows: &[Option<usize>]) -> Option<Vec<f64>> {
        let values = match name {
            "duty" => self.values(name),
            name => self.measured(name),
        }?;
        Some(rows.iter().map(|row| row.map_or(f64::NAN, |row| values[row])).collect())
    }

    /// Whether rows are settled points: what the user says, or that nothing looks like time.
    pub fn is_settled(&mut self, stated: Option<bool>) -> Result<bool, Faults> {
        let time = self.located.signal("t");
        match (stated, time) {
            (Some(true), time) => {
                let note = |time: &measured::Signal| {
                    format!("`{}` is not used: rows are said to be settled points", time.label)
                };
                let note = time.filter(|time| time.column().is_some()).map(note);
                self.repairs.extend(note);
                return Ok(true);
            }
            (_, Some(_)) => return Ok(false),
            (Some(false), None) => {
                let time = Quantity::all(&["t"]);
                let missing = |time| self.sheet.missing(time, ", since `settled = false`");
                time.iter().map(missing).collect::<Sink>().propagate()?;
            }
            (None, None) => {}
        }
        let Some((column, why)) = self.located.time_like(self.sheet) else {
            return Ok(true);
        };
        let name = &self.sheet.columns()[column].name;
        let message = Message::new(format!("no time column, but `{name}` looks like time"))
            .found(why)
            .expected("a time `t`, `time` or `timestamps`, in s or with its unit: `t_us`")
            .hint(format!(
                "if it is the time, its name has to be said: {}. Only where each row is an operating point that had settled, whatever \
                 this column counts: --settled",
                self.whole_map(name)
            ));
        Err(self.sheet.name_fault(column, message).into())
    }

    /// A map that says the time and whatever else looks like a quantity: nobody wants to be asked column by column.
    fn whole_map(&self, time: &str) -> String {
        let guesses = self.sheet.guesses(&self.located, &Quantity::all(&NAMES));
        let others = guesses.into_iter().filter(|(name, _)| *name != "t");
        let all: Vec<_> = std::iter::once(("t", time)).chain(others).collect();
        proposal(&all).unwrap_or_default()
    }

    pub fn check_duty(&self) -> Result<(), Faults> {
        let duty = self.values("duty").unwrap_or_default();
        let highest = duty.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        // rounding of a duty that somebody computed
        let outside = duty.iter().position(|d| *d < -1e-9 || *d > 1.0 + 1e-9);
        if let Some(row) = outside {
            let label = self.label("duty");
            let percent = highest > 1.5 && highest <= 100.0;
            let hint = match percent {
                true => format!("percent? call the column `{label} (%)`, or map it: --map duty=COLUMN*0.01"),
                false => "a duty is a share of the period".to_owned(),
            };
            let message = Message::new("a duty outside 0 to 1").found(duty[row].to_string());
            return Err(self.fault("duty", row, message.expected("0 to 1").hint(hint)).into());
        }
        Ok(())
    }

    /// A row without duty has that of the row before.
    pub fn report_missing_duty(&mut self) {
        let missing = self
            .values("duty")
            .unwrap_or_default()
            .iter()
            .filter(|d| d.is_nan())
            .count();
        if missing > 0 {
            let text = format!("{missing} rows without duty: that of the row before is held");
            self.repairs.push(text);
        }
    }

    /// Whether only the meter of the load current knows the load.
    pub fn is_load_measured(&self) -> bool {
        let is_set = SET_LOADS.iter().any(|name| self.values(name).is_some());
        !is_set && self.measured("i_out").is_some()
    }

    pub fn loads(&self) -> Result<Vec<Load>, Faults> {
        let zero = vec![0.0; self.rows()];
        let set = |name: &str| self.values(name);
        let (resistance, current, power) = (set("r_load"), set("i_load"), set("p_load"));
        if resistance.is_none() && current.is_none() && power.is_none() {
            let drawn = self.values("i_out").unwrap_or(zero);
            return Ok(drawn.into_iter().map(Load::current).collect());
        }
        let (r, i, p) = (
            resistance.unwrap_or_else(|| zero.clone()),
            current.unwrap_or_else(|| zero.clone()),
            power.unwrap_or(zero),
        );
        let mut loads = Vec::with_capacity(r.len());
        let mut last = Load::default();
        for row in 0..r.len() {
            let (r, i, p) = (r[row], i[row], p[row]);
            if r < 0.0 || p < 0.0 {
                let message = Message::new("a negative load").found(format!("{r} ohm, {p} W"));
                return Err(self
                    .fault(if r < 0.0 { "r_load" } else { "p_load" }, row, message)
                    .into());
            }
            if !(r.is_nan() || i.is_nan() || p.is_nan()) {
                last = Load {
                    conductance: if r > 0.0 { 1.0 / r } else { 0.0 },
                    current: i,
                    power: p,
                };
            }
            loads.push(last);
        }
        Ok(loads)
    }

    /// A step of the converter that measured a channel, 0 if none shows.
    pub fn lattice(&self, name: &str) -> f64 {
        self.of_column(name, lattice)
    }

    /// What the numbers of a channel are rounded to.
    pub fn resolution(&self, name: &str) -> f64 {
        self.of_column(name, rounding)
    }

    /// A length that is read off the numbers as they are written, in SI.
    fn of_column(&self, name: &str, length: impl Fn(&[f64], u32) -> f64) -> f64 {
        let Some(signal) = self.located.signal(name) else {
            return 0.0;
        };
        let column = signal.column().and_then(|index| self.sheet.columns().get(index));
        column.map_or(0.0, |column| {
            signal.scale().abs() * length(&column.values, column.decimals)
        })
    }
}

/// A load current that is called as a set one, alone, and whose rows are those of a meter: it is the measured one.
fn take_for_a_meter(sheet: &Sheet, located: &mut Located) -> Option<String> {
    let signal = located.signal("i_load")?;
    signal.column()?;
    let label = signal.label.clone();
    let readings: Vec<f64> = (0..sheet.rows()).filter_map(|row| signal.number(sheet, row)).collect();
    if located.signal("i_out").is_some() {
        return None;
    }
    let reason = if is_metered(&readings) {
        "changes back and forth from row to row, as the readings of a meter do"
    } else if is_current_of_resistor(sheet, located) {
        "is v_out over r_load in nearly every row, the current of that resistor and no second load"
    } else {
        return None;
    };
    located.take_as("i_load", "i_out");
    Some(format!(
        "{label} {reason}: it is taken for i_out, the measured load current, and not for a load that was set"
    ))
}

/// A load that was set beside a resistor is `v_out / r_load` in few rows by chance: the voltage moves and the setting does not.
const ROWS_OF_RESISTOR: f64 = 0.8;
/// Gains of two meters and a resistor at its temperature are off by some percent together.
const RESISTOR_TOLERANCE: f64 = 0.05;
/// As for the jitter of a meter: fewer rows may be a table of settings.
const FEWEST_ROWS: usize = 40;

/// Whether `i_load` is what the resistor `r_load` takes at `v_out`.
fn is_current_of_resistor(sheet: &Sheet, located: &Located) -> bool {
    let [Some(v), Some(i), Some(r)] = ["v_out", "i_load", "r_load"].map(|name| located.signal(name)) else {
        return false;
    };
    let rows =
        (0..sheet.rows()).filter_map(|row| Some([v.number(sheet, row)?, i.number(sheet, row)?, r.number(sheet, row)?]));
    let rows: Vec<[f64; 3]> = rows.filter(|[.., r]| *r > 0.0).collect();
    let alike = rows
        .iter()
        .filter(|[v, i, r]| (i - v / r).abs() < RESISTOR_TOLERANCE * (v / r).abs());
    let moves = rows.windows(2).filter(|pair| pair[0][1] != pair[1][1]).count();
    // a current that stays while the voltage moves was set, whatever its size
    let is_read = 2 * moves > rows.len();
    rows.len() >= FEWEST_ROWS && is_read && alike.count() as f64 >= ROWS_OF_RESISTOR * rows.len() as f64
}

/// What no record can do without; the first fault proposes a map of the columns that look like it.
fn incomplete(sheet: &Sheet, located: &Located, may_be_capture: bool) -> Sink {
    let has = |name: &str| located.signal(name).is_some();
    let mut list = Vec::new();
    // a capture has its duty in its edges
    if !has("duty") && !may_be_capture {
        let hint = "; a map file can do so as well: --columns MAP.toml with [columns] duty = \"...\". A capture of \
                    an oscilloscope may have the pin v_pwm or the switch node v_sw instead";
        let duty = Quantity::all(&["duty"]);
        list.extend(duty.iter().map(|duty| sheet.missing(duty, hint)));
    }
    let mut guesses = sheet.guesses(located, &Quantity::all(&NAMES));
    if let (None, false, Some((column, _))) = (
        located.signal("t"),
        guesses.iter().any(|(name, _)| *name == "t"),
        located.time_like(sheet),
    ) {
        // asked for as soon as the others are mapped
        guesses.insert(0, ("t", &sheet.columns()[column].name));
    }
    let is_guessed = |names: &[&str]| guesses.iter().any(|(name, _)| names.contains(name));
    if !QUANTITIES.into_iter().any(has) && !may_be_capture {
        let problem = match is_guessed(&QUANTITIES) {
            true => "no column is known as a measured one: the columns have names of their own and no map",
            false => "nothing is measured in this record",
        };
        let message = Message::new(problem).found(sheet.listed());
        list.push(sheet.header_fault(message.expected("at least one of v_out, i_l, i_out, v_in")));
    }
    // a map that is proposed already mends it
    if !LOADS.into_iter().any(has) && (list.is_empty() || !is_guessed(&LOADS)) {
        let message = Message::new("nothing says what the load is").found(sheet.listed());
        let hint = "give r_load, i_load or p_load as a column if the load was set, i_out if its current was measured; or for the \
                    whole record: --map r_load=10, or under [constants] in the map file";
        list.push(sheet.header_fault(message.expected("r_load, i_load, p_load or i_out").hint(hint)));
    }
    let map = proposal(&guesses);
    if let (Some(first), Some(map)) = (list.first_mut(), map) {
        let metered = match map.contains("i_load=") {
            true => " (i_load is a load that was set; for what a meter showed write i_out)",
            false => "",
        };
        // the map last: what is copied ends with the line
        let named = NAMES.iter().filter_map(|name| Some((name, located.signal(name)?)));
        let by_name: Vec<String> = named
            .filter(|(name, signal)| signal.column().is_some() && signal.label != **name)
            .map(|(name, signal)| format!("{} as {name}", signal.label))
            .collect();
        let others = match by_name.is_empty() {
            true => String::new(),
            false => format!(
                "; {} need{} no map",
                by_name.join(", "),
                if by_name.len() == 1 { "s" } else { "" }
            ),
        };
        let proposed = format!(
            "these columns look like it, check each{metered}{others}; as [records.NAME.columns] of a map file, NAME a file without its \
             ending, where other files have others: {map}"
        );
        first.hint = Some(match first.hint.take() {
            Some(hint) if has("duty") => format!("{hint}; {proposed}"),
            _ => proposed,
        });
    }
    let mut faults = table_faults();
    faults.extend(list);
    faults
}
