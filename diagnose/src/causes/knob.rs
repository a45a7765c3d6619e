//! The parameters that causes move, and how far they may go in a converter of any size.

use crate::drive::Model;

/// Typical magnitudes of a converter, which make bounds and steps of parameters of any size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bases {
    /// Output voltage, V.
    pub v: f64,
    /// Current, A.
    pub i: f64,
    /// Source voltage, V.
    pub v_in: f64,
    /// Switching period, s.
    pub t_sw: f64,
    /// Frequency at which the output filter of a buck of these parts swings, Hz.
    pub filter: f64,
    /// Inductance of the converter, H.
    pub inductance: f64,
    /// Mean square of the voltage across the inductor, V^2.
    pub across: f64,
}

/// How a parameter may move: lowest, highest, and the step that counts as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reach {
    /// In shares of the model's own value.
    Own(f64, f64, f64),
    /// In units of v / i: highest and step.
    Resistance(f64, f64),
    /// Of what a resistance rises by with the square of a current, in units of v / i^3: highest and step.
    RiseOfResistance(f64, f64),
    /// Of the source, in units of v / i, or of 0.4 v_in^2 / (v i) where that is more: of what the converter is to its source, which the load
    /// is behind a converter that steps far down. Lowest, highest and step.
    SourceResistance(f64, f64, f64),
    /// In units of t_sw i / v.
    Capacitance(f64, f64, f64),
    /// In units of t_sw v / i.
    Inductance(f64, f64, f64),
    /// In shares of the converter's inductance, which divides the switched voltage with it: highest and step; and highest in henry.
    BesideInductor(f64, f64, f64),
    /// In units of i / v.
    Conductance(f64, f64),
    /// Of a conductance across the inductor, in shares of the load's power that it takes.
    LossAcross(f64, f64),
    /// In units of v_in.
    Source(f64, f64, f64),
    /// In units of v.
    Voltage(f64, f64, f64),
    /// In units of i.
    Current(f64, f64, f64),
    /// In switching periods.
    Time(f64, f64, f64),
    /// Below what the output filter swings at: lowest and highest in hertz, the share of the filter's frequency that is the highest where
    /// that is more, and the step in hertz.
    BelowFilter(f64, f64, f64, f64),
    /// As it is.
    Plain(f64, f64, f64),
    /// The share that a part loses along its curve: lowest, highest and step. A part may lose all of it, so that the upper end, close to all,
    /// cuts nothing off.
    Share(f64, f64, f64),
}

/// Lags shorter than this share of a period are left out: between samples a period apart they leave no trace (e^-100), and the
/// integrator would take 400 steps a period for them.
const NO_LAG: f64 = 0.01;

/// Share of what the converter is to its source that makes one unit of the source's resistance: half of it takes a fifth of the source's
/// voltage, as half of the load's resistance takes a third of the output's.
const SEEN: f64 = 0.4;

/// Least value of numbers that keep their ratio: below anything that could be told from 0, and far above where products of two are 0.
const LEAST: f64 = 1e-12;

/// One parameter of a cause.
#[derive(Debug, Clone, Copy)]
pub struct Knob {
    /// Name in the results.
    pub name: &'static str,
    /// Keys of the plant that take its value; none for the sampling instant and the resistors of the load.
    pub keys: &'static [&'static str],
    /// The first of the keys alone takes the value, and the others keep their ratio to it.
    pub in_proportion: bool,
    pub(super) reach: Reach,
    /// A step of the duty that cuts off what is no whole count: to the nearest one of half a count less.
    pub(super) cuts_off: bool,
    /// The resistor of the load whose factor it is.
    pub(super) resistor: Option<usize>,
    /// A time constant, of which one far shorter than a period is none.
    pub(super) is_lag: bool,
}

/// A number so many times as large as any that is typical is none of this part: a diode of an ohm where a tenth is much. Data sheets
/// differ by less, and converters of 400 V have other resistances than those of 5 V.
const UNTYPICAL: f64 = 5.0;
/// Share of the largest conductance that is tried which is nothing odd: a tenth of the load. A convention.
const USUAL_OF_LOAD: f64 = 1.0 / 3.0;

impl Knob {
    /// One that moves within `[low, high, step]`, whatever the converter's size.
    pub(crate) const fn plain(name: &'static str, keys: &'static [&'static str], [low, high, step]: [f64; 3]) -> Self {
        Knob {
            name,
            keys,
            in_proportion: false,
            reach: Reach::Plain(low, high, step),
            cuts_off: false,
            resistor: None,
            is_lag: false,
        }
    }

    /// Whether it is what one resistor of the load is off by.
    #[must_use]
    pub fn is_resistor(&self) -> bool {
        self.resistor.is_some()
    }

    /// The keys that are given its very value.
    #[must_use]
    pub fn valued_keys(&self) -> &'static [&'static str] {
        match self.in_proportion {
            true => &self.keys[..1],
            false => self.keys,
        }
    }

    /// Keys of the plant file under which a user knows the number. The sampling instant and the resistors of the load, which a record may
    /// move away from it, have them, too.
    #[must_use]
    pub fn known_as(&self) -> &'static [&'static str] {
        match (self.resistor, self.keys) {
            (Some(_), _) => &["load.resistor_gain"],
            (None, []) => &["pwm.sampling_phase"],
            (None, keys) => keys,
        }
    }

    /// Whether it is the share that a part loses along its curve.
    #[must_use]
    pub fn is_share(&self) -> bool {
        matches!(self.reach, Reach::Share(..))
    }

    /// Whether a value is far above what is typical, and above the model's own; of a range that [`Knob::range`] gave.
    #[must_use]
    pub(crate) fn is_untypical(&self, value: f64, model: f64, [_, high, _]: &[f64; 3]) -> bool {
        let parameter = self.keys.first().and_then(|key| plant::parameter(key));
        let most = parameter.map_or(f64::INFINITY, |parameter| parameter.typical.1.abs());
        // of a load that is drawn beside the set one its share counts, whatever the converter's size
        let of_load = match self.reach {
            Reach::Conductance(..) => USUAL_OF_LOAD * high,
            _ => 0.0,
        };
        value.abs() > (UNTYPICAL * most.max(model.abs())).max(of_load)
    }

    /// SI unit.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        match self.keys.first().and_then(|key| plant::parameter(key)) {
            Some(parameter) => parameter.unit,
            None if self.resistor.is_some() => "1",
            None => "s",
        }
    }

    /// Value in a model.
    #[must_use]
    pub fn get(&self, model: &Model) -> f64 {
        if let Some(number) = self.resistor {
            return model.resistors.get(number).map_or(1.0, |one| one.factor);
        }
        match self.keys.first().and_then(|key| plant::parameter(key)) {
            Some(parameter) => parameter.get(&model.plant),
            None => model.late,
        }
    }

    /// Gives a model the value.
    pub fn set(&self, model: &mut Model, value: f64) {
        let value = self.snapped(model, value);
        if let Some(number) = self.resistor {
            if let Some(one) = model.resistors.get_mut(number) {
                one.factor = value;
            }
            return;
        }
        if self.keys.is_empty() {
            model.late = value;
        }
        if self.cuts_off {
            // less than half by what decimals miss of a whole count
            model.plant.pwm.duty_offset = -(0.5 - 1e-6) * value;
        }
        let mut parameters = self.keys.iter().filter_map(|key| plant::parameter(key));
        if let Some(first) = parameters.next().filter(|_| self.in_proportion) {
            // of nothing there would be no ratio to go on from
            let by = value.max(LEAST) / first.get(&model.plant);
            for parameter in [first].into_iter().chain(parameters) {
                let scaled = by * parameter.get(&model.plant);
                parameter.set(&mut model.plant, scaled);
            }
            return;
        }
        for parameter in self.keys.iter().filter_map(|key| plant::parameter(key)) {
            parameter.set(&mut model.plant, value);
        }
    }

    /// A lag far shorter than a period is none: it would only cost steps of the integrator.
    fn snapped(&self, model: &Model, value: f64) -> f64 {
        let shortest = NO_LAG * model.plant.t_sw();
        if self.is_lag && value < shortest { 0.0 } else { value }
    }

    /// Lowest value, highest value, and step, for a converter of these magnitudes around `own`.
    #[must_use]
    pub fn range(&self, own: f64, bases: &Bases) -> [f64; 3] {
        let by = |unit: f64, low: f64, high: f64, step: f64| [low * unit, high * unit, step * unit];
        match self.reach {
            // for numbers that every converter has: shares of a 0 would leave no room
            Reach::Own(low, high, step) => by(own, low, high, step),
            Reach::Resistance(high, step) => by(bases.v / bases.i, 0.0, high, step),
            Reach::RiseOfResistance(high, step) => by(bases.v / bases.i.powi(3), 0.0, high, step),
            Reach::SourceResistance(low, high, step) => {
                let seen = bases.v_in * bases.v_in / (bases.v * bases.i);
                by((bases.v / bases.i).max(SEEN * seen), low, high, step)
            }
            Reach::Capacitance(low, high, step) => by(bases.t_sw * bases.i / bases.v, low, high, step),
            Reach::Inductance(low, high, step) => by(bases.t_sw * bases.v / bases.i, low, high, step),
            Reach::BesideInductor(high, step, most) => {
                [0.0, most.min(high * bases.inductance), step * bases.inductance]
            }
            Reach::Conductance(high, step) => by(bases.i / bases.v, 0.0, high, step),
            Reach::LossAcross(high, step) => by(bases.v * bases.i / bases.across, 0.0, high, step),
            Reach::Source(low, high, step) => by(bases.v_in, low, high, step),
            Reach::Voltage(low, high, step) => by(bases.v, low, high, step),
            Reach::Current(low, high, step) => by(bases.i, low, high, step),
            Reach::Time(low, high, step) => by(bases.t_sw, low, high, step),
            Reach::BelowFilter(low, high, share, step) => [low, high.max(share * bases.filter), step],
            Reach::Plain(low, high, step) | Reach::Share(low, high, step) => [low, high, step],
        }
    }
}
