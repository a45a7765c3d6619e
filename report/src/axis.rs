//! Axes: what they show, their range, their ticks.
//!
//! ```text
//! value ──place──► place (itself, or its decade) ──part──► 0..1 ──onto──► pixel
//!   None: NaN, infinite, beyond 1e150, <= 0 on a logarithmic axis: a gap, never a wrong point
//!
//! Axis (what is asked) ──settle, with the data──► Settled (range, ticks, title) ──onto──► Scale (on pixels)
//! ```
//!
//! Ticks are places computed from whole numbers, so that labels are exact and equal on every machine.

use crate::error::ReportError;
use crate::number::{
    decade, drawable, engineering_exponent, fixed, power_of_ten, prefix, raised_power, shifted, takes_prefix,
};

/// What an axis shows. Without [`range`](Axis::range) it covers all data drawn against it.
#[derive(Debug, Clone)]
pub struct Axis {
    pub(crate) label: String,
    unit: String,
    log: bool,
    range: Option<(f64, f64)>,
}

impl Axis {
    /// Linear axis without unit.
    pub fn new(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            unit: String::new(),
            log: false,
            range: None,
        }
    }

    /// Unit of the data. SI units (`s`, `V`, `A`, `W`, `Hz`, `H`, `F`, `Ω`, ...) get a prefix that fits the range: data
    /// in `s` may be shown in `ms`. Others (`%`, `dB`, `ticks`) are left alone.
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.unit = unit.into();
        self
    }

    /// Logarithmic axis; values of zero or below leave gaps.
    #[must_use]
    pub fn log(mut self) -> Self {
        self.log = true;
        self
    }

    /// Fixed range in the unit of the data; what lies outside is cut off.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    pub(crate) fn is_log(&self) -> bool {
        self.log
    }

    /// Place of a value before scaling to pixels; `None` where it has none.
    pub(crate) fn place(&self, value: f64) -> Option<f64> {
        match (drawable(value), self.log) {
            (true, false) => Some(value),
            // as far below 1 as the largest value that is drawn lies above
            (true, true) if value >= 1e-150 => Some(libm::log10(value)),
            _ => None,
        }
    }

    /// Settles range and ticks. `data` may hold values without a place; `margin` is the free part at the low and the
    /// high end.
    pub(crate) fn settle(
        &self,
        data: impl Iterator<Item = f64>,
        margin: [f64; 2],
        ticks: usize,
    ) -> Result<Settled, ReportError> {
        let (low, high) = match self.range {
            Some((low, high)) => match (self.place(low), self.place(high)) {
                // an empty range would divide by 0 in `part`
                (Some(a), Some(b)) if a < b => (a, b),
                _ => {
                    let axis = self.label.clone();
                    return Err(ReportError::Range { axis, low, high });
                }
            },
            None => self.cover(data, margin)?,
        };
        Ok(self.settle_between(low, high, ticks))
    }

    /// As [`settle`](Axis::settle) with both ends known, as places.
    pub(crate) fn settle_between(&self, low: f64, high: f64, ticks: usize) -> Settled {
        let (label, ticks) = if self.log {
            self.log_ticks(low, high, ticks)
        } else {
            self.linear_ticks(low, high, ticks)
        };
        Settled {
            axis: self.clone(),
            low,
            high,
            label,
            ticks,
        }
    }

    fn cover(&self, data: impl Iterator<Item = f64>, margin: [f64; 2]) -> Result<(f64, f64), ReportError> {
        let mut ends: Option<(f64, f64)> = None;
        for place in data.filter_map(|value| self.place(value)) {
            let (low, high) = ends.unwrap_or((place, place));
            ends = Some((low.min(place), high.max(place)));
        }
        let (low, high) = ends.ok_or_else(|| ReportError::Empty {
            what: self.label.clone(),
        })?;
        let size = low.abs().max(high.abs());
        // a constant has no span of its own, and the last bits of a double are no signal
        if high - low <= size * 1e-9 || high == low {
            // half a decade or 5 %: conventions, so that the line lies in the middle of an axis with ticks
            let half = if self.log || size < 1e-150 { 0.5 } else { size * 0.05 };
            return Ok((low - half, high + half));
        }
        let span = high - low;
        Ok((low - span * margin[0], high + span * margin[1]))
    }

    fn linear_ticks(&self, low: f64, high: f64, count: usize) -> (String, Vec<Tick>) {
        let (exponent, unit) = self.scaled_unit(low, high);
        let ticks = nice(shifted(low, -exponent), shifted(high, -exponent), count);
        let ticks = ticks.into_iter().map(|(value, label)| Tick {
            place: shifted(value, exponent),
            label: Some(label),
        });
        (titled(&self.label, unit.trim()), ticks.collect())
    }

    /// Power of ten to divide by, and the unit that is left.
    fn scaled_unit(&self, low: f64, high: f64) -> (i32, String) {
        let size = low.abs().max(high.abs());
        let exponent = match engineering_exponent(size) {
            // 0 to 0.9 W reads better than 0 to 900 mW
            small if small < 0 && shifted(size, -small) >= 500.0 => small + 3,
            fitting => fitting,
        };
        if takes_prefix(&self.unit) {
            (exponent, format!("{}{}", prefix(exponent), self.unit))
        } else if (-3..=3).contains(&exponent) {
            // from 0.001 to 999,999 as plain numbers, beyond with a power of ten: a convention
            (0, self.unit.clone())
        } else {
            (exponent, format!("{} {}", raised_power(exponent), self.unit))
        }
    }

    /// Labelled ticks at given values of a linear axis, all with as many decimals as one of them needs.
    pub(crate) fn ticks_at(&self, values: &[f64]) -> Vec<Tick> {
        let ends = (
            values.first().copied().unwrap_or(0.0),
            values.last().copied().unwrap_or(0.0),
        );
        let (exponent, _) = self.scaled_unit(ends.0, ends.1);
        // a relative 1e-6 is far below a pixel, and lets 0.1 + 0.2 be 0.3
        let close = |value: f64, decimals: usize| {
            let read = format!("{value:.decimals$}").parse::<f64>().unwrap_or(value);
            (read - value).abs() <= value.abs() * 1e-6
        };
        let scaled: Vec<f64> = values.iter().map(|value| shifted(*value, -exponent)).collect();
        let decimals = (0..6)
            .find(|n| scaled.iter().all(|value| close(*value, *n)))
            .unwrap_or(6);
        let ticks = values.iter().zip(scaled).filter_map(|(value, scaled)| {
            let label = Some(fixed(scaled, decimals));
            Some(Tick {
                place: self.place(*value)?,
                label,
            })
        });
        ticks.collect()
    }

    /// `low` and `high` are decades here.
    fn log_ticks(&self, low: f64, high: f64, count: usize) -> (String, Vec<Tick>) {
        let (first, last) = (libm::floor(low) as i32, libm::ceil(high) as i32);
        // labels at every n-th decade: hundreds of decades would write over each other
        let every = usize::try_from(last - first).unwrap_or(1).div_ceil(count.max(3)).max(1);
        // fewer than two decades would leave an axis with one labelled tick
        let labelled: &[u32] = if high - low < 1.5 { &[1, 2, 5] } else { &[1] };
        // one way of writing along an axis
        // from 0.001 to 10,000 as numbers, beyond as powers of ten: a convention
        let plain = low >= -3.0 && high <= 4.0;
        let mut ticks = Vec::new();
        for exponent in first..=last {
            let whole = exponent.rem_euclid(every as i32) == 0;
            for digit in 1..=9_u32 {
                let place = f64::from(exponent) + libm::log10(f64::from(digit));
                let inside = (low - 1e-9..=high + 1e-9).contains(&place);
                // beyond five decades the lines between would be a grey surface
                if !inside || digit > 1 && high - low > 5.0 {
                    continue;
                }
                let label = (whole && labelled.contains(&digit)).then(|| self.log_label(exponent, digit, plain));
                ticks.push(Tick { place, label });
            }
        }
        if takes_prefix(&self.unit) {
            (self.label.clone(), ticks)
        } else {
            (titled(&self.label, &self.unit), ticks)
        }
    }

    fn log_label(&self, exponent: i32, digit: u32, plain: bool) -> String {
        // towards minus infinity: 10^-4 is 100 u, not 0.1 m
        let three = exponent.div_euclid(3) * 3;
        if takes_prefix(&self.unit) && (-15..=12).contains(&three) {
            let number = f64::from(digit) * power_of_ten(exponent - three);
            return format!("{number} {}{}", prefix(three), self.unit);
        }
        match (plain, digit) {
            (true, _) => fixed(
                shifted(f64::from(digit), exponent),
                usize::try_from(-exponent).unwrap_or(0),
            ),
            (false, 1) if exponent == 0 => "1".to_owned(),
            (false, 1) => raised_power(exponent),
            (false, digit) => format!("{digit}·{}", raised_power(exponent)),
        }
    }
}

fn titled(label: &str, unit: &str) -> String {
    if unit.is_empty() {
        label.to_owned()
    } else {
        format!("{label} ({unit})")
    }
}

/// Multiples of 1, 2 or 5 times a power of ten between `low` and `high`, about `count` of them but at least three, with
/// their labels.
fn nice(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    // an axis with fewer than three ticks cannot be read; ten tries end it for ranges of a few last places
    let mut denser = (count..count + 10).map(|count| spaced(low, high, count));
    denser
        .find(|ticks| ticks.len() > 2)
        .unwrap_or_else(|| spaced(low, high, count))
}

fn spaced(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let rough = (high - low) / count.max(2) as f64;
    let exponent = decade(rough);
    let digit = match rough / power_of_ten(exponent) {
        // the quotient may miss a whole digit by its last bits, and would take the next larger step
        d if d <= 1.0 + 1e-9 => 1.0,
        d if d <= 2.0 + 1e-9 => 2.0,
        d if d <= 5.0 + 1e-9 => 5.0,
        _ => 10.0,
    };
    let exponent = if digit == 10.0 { exponent + 1 } else { exponent };
    let digit = if digit == 10.0 { 1.0 } else { digit };
    let step = shifted(digit, exponent);
    let decimals = usize::try_from(-exponent).unwrap_or(0);
    // a tick at the very end of the range counts in spite of rounding
    let (first, last) = (libm::ceil(low / step - 1e-9), libm::floor(high / step + 1e-9));
    // hostile ranges, such as 1 to 1 + 2^-52, must neither hang nor fill the memory
    let number = (last - first).clamp(0.0, 50.0) as usize;
    let tick = |n: usize| {
        // a whole number, shifted with one rounding: adding up steps of 0.1 would give 0.30000000000000004
        let value = shifted((first + n as f64) * digit, exponent);
        (value, fixed(value, decimals))
    };
    (0..=number).map(tick).collect()
}

/// A grid line, with a label or (between labelled ones) without.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub place: f64,
    pub label: Option<String>,
}

/// An axis with its range and ticks settled.
#[derive(Debug, Clone)]
pub(crate) struct Settled {
    axis: Axis,
    pub low: f64,
    pub high: f64,
    /// Title with unit and prefix.
    pub label: String,
    pub ticks: Vec<Tick>,
}

impl Settled {
    /// Maps onto pixels `from..to`; `to` may be the smaller (upward axes).
    pub fn onto(&self, from: f64, to: f64) -> Scale<'_> {
        Scale {
            settled: self,
            from,
            to,
        }
    }

    /// Power of ten by which values are divided where they are shown; nothing on a logarithmic axis.
    pub fn shown_exponent(&self) -> Option<i32> {
        (!self.axis.log).then(|| self.axis.scaled_unit(self.low, self.high).0)
    }

    /// Whether the caller gave the range.
    pub fn is_fixed(&self) -> bool {
        self.axis.range.is_some()
    }

    /// Part of the way from low to high; `None` where the value has no place.
    pub fn part(&self, value: f64) -> Option<f64> {
        let place = self.axis.place(value)?;
        Some((place - self.low) / (self.high - self.low))
    }
}

/// A settled axis on a stretch of pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale<'a> {
    pub settled: &'a Settled,
    pub from: f64,
    pub to: f64,
}

impl Scale<'_> {
    /// Pixel of a value; `None` where it has no place.
    pub fn at(&self, value: f64) -> Option<f64> {
        self.settled
            .part(value)
            .map(|part| self.from + part * (self.to - self.from))
    }

    /// Pixel of a tick.
    pub fn tick(&self, tick: &Tick) -> f64 {
        let part = (tick.place - self.settled.low) / (self.settled.high - self.settled.low);
        self.from + part * (self.to - self.from)
    }
}
