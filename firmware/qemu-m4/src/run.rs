//! One run of the closed loop: which load when, what is looked at. The same on the processor and on the machine that
//! checks it.

use crate::converter::Converter;

/// Control periods of a run.
pub const PERIODS: u32 = 2000;
/// The load steps up and down again.
const STEP_UP: u32 = 500;
const STEP_DOWN: u32 = 1250;
/// Periods before a step, or the end, in which the converter has settled.
const WINDOW: u32 = 250;
/// W.
const LIGHT: f64 = 200.0;
const HEAVY: f64 = 800.0;

/// The converter in its run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    converter: Converter,
    period: u32,
    checksum: u64,
    lowest: f64,
    highest: f64,
    /// Largest distance from 100 V in the settled windows.
    settled_error: f64,
}

/// What a run shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outcome {
    /// Over duty, status and output voltage of every period, in their bits.
    pub checksum: u64,
    /// Lowest and highest sampled output voltage from the first load step on, mV.
    pub extremes: [i32; 2],
    /// Largest distance from 100 V once settled, mV.
    pub settled_error: i32,
}

impl Run {
    /// At 100 V and a light load.
    pub const fn new() -> Self {
        Self {
            converter: Converter { i_l: 2.0, v_out: 100.0 },
            period: 0,
            checksum: 0xcbf2_9ce4_8422_2325,
            lowest: f64::INFINITY,
            highest: f64::NEG_INFINITY,
            settled_error: 0.0,
        }
    }

    /// `v_out`, `i_l`, `i_out` as the ADC sees them, V and A.
    pub fn samples(&self) -> [f32; 3] {
        let Converter { i_l, v_out } = self.converter;
        [v_out as f32, i_l as f32, self.converter.i_out(self.power()) as f32]
    }

    /// One period under the duty that was commanded for it.
    pub fn advance(&mut self, duty: f32, status: u32) {
        self.converter.period(f64::from(duty), self.power());
        self.period += 1;
        let v_out = self.converter.v_out;
        let bits = v_out.to_bits();
        for word in [duty.to_bits(), status, bits as u32, (bits >> 32) as u32] {
            // FNV-1a, a word at a time
            self.checksum = (self.checksum ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3);
        }
        if self.period >= STEP_UP {
            self.lowest = self.lowest.min(v_out);
            self.highest = self.highest.max(v_out);
        }
        let is_before = |end: u32| self.period <= end && self.period + WINDOW > end;
        if is_before(STEP_UP) || is_before(STEP_DOWN) || is_before(PERIODS) {
            self.settled_error = self.settled_error.max((v_out - 100.0).abs());
        }
    }

    /// Periods so far.
    pub fn period(&self) -> u32 {
        self.period
    }

    /// So far.
    pub fn outcome(&self) -> Outcome {
        let millivolts = |v: f64| (v * 1e3) as i32;
        Outcome {
            checksum: self.checksum,
            extremes: [millivolts(self.lowest), millivolts(self.highest)],
            settled_error: millivolts(self.settled_error),
        }
    }

    fn power(&self) -> f64 {
        if (STEP_UP..STEP_DOWN).contains(&self.period) {
            HEAVY
        } else {
            LIGHT
        }
    }
}
