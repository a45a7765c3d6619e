//! Plant file and tables as somebody writes them.

use std::fmt::Write;

use crate::independent::board::{Carrier, Load, Topology};
use crate::independent::draw::{Design, round};
use crate::independent::instruments::CHANNELS;
use crate::independent::program::Table;
use crate::rng::Rng;

/// What the builder believes of the converter.
pub fn plant(design: &Design) -> String {
    let board = &design.world.board;
    let (stage, gates, set) = (&board.stage, &board.gates, &design.world.instruments);
    let mut text = String::new();
    let mut section = |name: &str, keys: &[(&str, f64)]| {
        if keys.iter().all(|(_, value)| *value == 0.0) {
            return;
        }
        let _ = writeln!(text, "\n[{name}]");
        for (key, value) in keys.iter().filter(|(_, value)| *value != 0.0) {
            let _ = writeln!(text, "{key} = {value:e}");
        }
    };
    section("inductor", &[("dcr", stage.r_winding)]);
    section("capacitor", &[("esr", stage.esr), ("esl", stage.esl)]);
    let low = if stage.synchronous { stage.r_second } else { 0.0 };
    section(
        "switch",
        &[
            ("r_ds_on", stage.r_main),
            ("r_ds_on_low", low),
            ("v_f", stage.v_f),
            ("r_d", stage.r_d),
            ("dead_time", gates.dead),
        ],
    );
    section(
        "load",
        &[("cpl_time_constant", board.sink.tau), ("v_fold", board.sink.fold)],
    );
    for (name, channel) in CHANNELS[..4].iter().zip(&set.channels) {
        let noise = if design.noise_stated { channel.noise } else { 0.0 };
        section(
            &format!("sensors.{name}"),
            &[("low_pass", channel.low_pass), ("noise", noise), ("lsb", channel.lsb)],
        );
    }
    let topology = match board.topology {
        Topology::Buck => "buck",
        Topology::Boost => "boost",
        Topology::BuckBoost => "buck-boost",
    };
    let carrier = match gates.carrier {
        Carrier::Trailing => "trailing",
        Carrier::Leading => "leading",
        Carrier::Centre => "centre",
    };
    let rectifier = if stage.synchronous { "synchronous" } else { "diode" };
    format!(
        "[converter]\ntopology = \"{topology}\"\nrectifier = \"{rectifier}\"\nv_in = {:e}\ninductance = {:e}\ncapacitance = {:e}\n\
         f_sw = {:e}\n\n[pwm]\ncarrier = \"{carrier}\"\nsampling_phase = {}\n{text}",
        board.source.v, stage.l, stage.c, gates.f_sw, set.phase
    )
}

/// How a program writes a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    separator: char,
    comma: bool,
    crlf: bool,
    mark: bool,
    remark: bool,
    long_names: bool,
    /// Thousandths for currents, percent for the duty, microseconds for time.
    small_units: bool,
}

impl Style {
    pub fn draw(random: &mut Rng) -> Self {
        let comma = random.chance(0.15);
        Self {
            separator: match (comma, random.below(4)) {
                (true, _) => ';',
                (_, 0) => '\t',
                (_, 1) => ';',
                _ => ',',
            },
            comma,
            crlf: random.chance(0.3),
            mark: random.chance(0.15),
            remark: random.chance(0.2),
            long_names: random.chance(0.3),
            small_units: random.chance(0.25),
        }
    }
}

/// A number of a load.
type Part = fn(&Load) -> f64;

/// The columns of a table by name, units and all.
fn columns(table: &Table, style: Style, floors: &[f64; 6]) -> Vec<(String, Vec<f64>)> {
    let mut columns = Vec::new();
    let (name, factor) = if style.small_units {
        ("t_us", 1e6)
    } else {
        (if style.long_names { "time" } else { "t" }, 1.0)
    };
    if !table.t.is_empty() {
        columns.push((name.to_owned(), table.t.iter().map(|t| round(t * factor, 12)).collect()));
    }
    let (name, factor) = if style.small_units {
        ("duty [%]", 100.0)
    } else {
        ("duty", 1.0)
    };
    columns.push((
        name.to_owned(),
        table.duty.iter().map(|d| round(d * factor, 9)).collect(),
    ));
    for (index, values) in table.values[..4].iter().enumerate() {
        if values.is_empty() {
            continue;
        }
        let current = CHANNELS[index].starts_with('i');
        let factor = if style.small_units && current { 1000.0 } else { 1.0 };
        let unit = match (style.small_units, current) {
            (true, true) => " [mA]",
            (true, false) => " [V]",
            _ => "",
        };
        let name = match (style.long_names, CHANNELS[index]) {
            (true, "v_out") => "v_o",
            (true, "i_out") => "i_o",
            (_, name) => name,
        };
        // a tenth of the noise is as fine as anybody writes
        let digits = (1.0 - libm::floor(libm::log10(floors[index].max(1e-9) * factor))).max(0.0);
        let scale = libm::pow(10.0, digits);
        let written = |value: &f64| libm::round(value * factor * scale) / scale;
        columns.push((format!("{name}{unit}"), values.iter().map(written).collect()));
    }
    let set: [(&str, Part); 3] = [
        ("r_load", |load| if load.g > 0.0 { 1.0 / load.g } else { 0.0 }),
        ("i_load", |load| load.i),
        ("p_load", |load| load.p),
    ];
    for (name, of) in set {
        let values: Vec<f64> = table.load.iter().map(|load| round(of(load), 9)).collect();
        if values.iter().any(|value| *value != 0.0) {
            columns.push((name.to_owned(), values));
        }
    }
    columns
}

/// A table as text.
pub fn csv(table: &Table, style: Style, floors: &[f64; 6]) -> String {
    let columns = columns(table, style, floors);
    let mut text = String::new();
    let separator = style.separator.to_string();
    if style.mark {
        text.push('\u{feff}');
    }
    if style.remark {
        text.push_str("# bench 2\n");
    }
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    let _ = writeln!(text, "{}", names.join(&separator));
    for row in 0..table.rows() {
        let cells: Vec<String> = columns
            .iter()
            .map(|(_, values)| number(values[row], style.comma))
            .collect();
        let _ = writeln!(text, "{}", cells.join(&separator));
    }
    if style.crlf { text.replace('\n', "\r\n") } else { text }
}

fn number(value: f64, comma: bool) -> String {
    let small = value != 0.0 && value.abs() < 1e-4;
    let text = if small {
        format!("{value:e}")
    } else {
        format!("{value}")
    };
    if comma { text.replace('.', ",") } else { text }
}
