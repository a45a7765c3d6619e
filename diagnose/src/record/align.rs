//! From the times of the rows to switching periods: which row stands for which period, and when in it was sampled.

use toml_input::{Faults, Message};

use super::raw::Raw;
use super::stamp::Clock;

/// Most rows in a switching period, and most periods between rows. A period of 500 rows is an oscilloscope's (50 MHz at 100 kHz),
/// and between rows 100 periods apart all that swings has died away. Beyond these a sampling period is more likely mistyped.
const MOST_PER_PERIOD: f64 = 500.0;
const MOST_PERIODS: f64 = 100.0;

impl Raw<'_> {
    /// The usual time between rows, s; faults of the time column are found here.
    pub fn row_step(&mut self) -> Result<f64, Faults> {
        let time = self.values("t").unwrap_or_default();
        if let Some(row) = time.iter().position(|t| t.is_nan()) {
            let hint = "leave the row out, or fill in its time";
            return Err(self
                .fault("t", row, Message::new("a row without time").hint(hint))
                .into());
        }
        if let Some(row) = (1..time.len()).find(|n| time[*n] < time[*n - 1]) {
            let message = Message::new("time goes backward").found(format!("{} after {}", time[row], time[row - 1]));
            return Err(self
                .fault("t", row, message.hint("cut the file into one record for each run"))
                .into());
        }
        let twice = (1..time.len()).filter(|n| time[*n] == time[*n - 1]).count();
        if twice > 0 {
            let text = format!("{twice} rows repeat the time of the row before: the first of each is kept");
            self.repairs.push(text);
        }
        let mut steps: Vec<f64> = time
            .windows(2)
            .map(|t| t[1] - t[0])
            .filter(|step| *step > 0.0)
            .collect();
        steps.sort_by(f64::total_cmp);
        let Some(step) = steps.get(steps.len() / 2).copied() else {
            return Err(self
                .sheet
                .fault(Message::new("too few rows").expected("20 or more"))
                .into());
        };
        // 3.33 us in whole microseconds are 3 and 4: no step is the usual one, and their mean is
        if self.resolution("t") > 0.01 * step {
            let usual = steps.iter().filter(|other| (0.5..1.5).contains(&(*other / step)));
            let (sum, count) = usual.fold((0.0, 0.0), |(sum, count), other| (sum + other, count + 1.0));
            return Ok(sum / count);
        }
        Ok(step)
    }

    /// Rows for each control period in order (nothing in a gap), and the sampling phase.
    pub fn align(&mut self, clock: Clock, phase: Option<f64>) -> Result<(Vec<Option<usize>>, f64), Faults> {
        let time = self.values("t").unwrap_or_default();
        let Clock { step, t_sw, .. } = clock;
        let ratio = step / t_sw;
        let (fast, slow) = ((1.0 / ratio).round(), ratio.round());
        // a convention: clocks are far better, but times are written with few digits, and f_sw is a rounded number
        let fits = |a: f64, b: f64| (a / b - 1.0).abs() < 0.02;
        let faster = (1.0..=MOST_PER_PERIOD).contains(&fast) && fits(1.0 / ratio, fast);
        let slower = (1.0..=MOST_PERIODS).contains(&slow) && fits(ratio, slow);
        if !(faster || slower) {
            let message = Message::new("the sample rate does not fit the switching frequency")
                .found(format!("a row every {step:e} s"))
                .expected(format!(
                    "the period, {t_sw:e} s, a whole multiple or a whole part of it"
                ))
                .hint(
                    "is the time in us or ms? name the column `t_us`; is `converter.f_sw` right? If each row is a settled \
                     point: --settled. A capture of an oscilloscope holds 8 rows a period or more, and a whole period",
                );
            return Err(self.sheet.fault(message).into());
        }
        Ok(self.place(&time, clock, phase))
    }

    fn place(&mut self, time: &[f64], clock: Clock, phase: Option<f64>) -> (Vec<Option<usize>>, f64) {
        let Clock { step, t_sw, .. } = clock;
        let fraction = (time[0] / t_sw).rem_euclid(1.0);
        let phase = phase.unwrap_or_else(|| self.stamped(time, clock));
        // here and below: between one row a period and two
        let skip = match step < 0.75 * t_sw {
            true => (phase - fraction).rem_euclid(1.0) * t_sw,
            false => 0.0,
        };
        let first = time[0] + skip;
        self.start = first;
        let slot = |t: f64| ((t - first) / t_sw).round();
        let count = time.last().map_or(0.0, |t| slot(*t)) as usize + 1;
        // 1000 s at 10 kHz, 160 MB: one wrong time must not ask for more
        let mut rows: Vec<Option<usize>> = vec![None; count.min(10_000_000)];
        let (mut jitter, mut used) = (0.0f64, 0);
        for (row, t) in time.iter().enumerate() {
            let place = slot(*t);
            let off = ((t - first) / t_sw - place).abs();
            let fast = step < 0.75 * t_sw;
            // the row nearest to the instant is half a step off at most; the hundredth is for rounding
            if place < 0.0 || place as usize >= rows.len() || (fast && off * t_sw > 0.51 * step) {
                continue;
            }
            let entry = &mut rows[place as usize];
            if entry.is_none() {
                (*entry, used) = (Some(row), used + 1);
                jitter = jitter.max(off);
            }
        }
        while rows.last() == Some(&None) {
            rows.pop();
        }
        if step < 0.75 * t_sw {
            let text = format!("{used} of {} rows used: one each switching period", time.len());
            self.repairs.push(text);
        } else if jitter > 0.02 + self.resolution("t") / t_sw {
            let text = format!("sampling instants jitter by up to {:.1} % of a period", 100.0 * jitter);
            self.repairs.push(text);
        }
        (rows, phase)
    }
}
