//! Settle, detect the steady state, measure.
//!
//! ```text
//! periods  |<-- window -->|<-- window -->|<-- window -->|
//! means         before          last           this        equal, nothing to come, no ringing: settled
//! ```
//!
//! The last window is the measurement. A point that never rests is measured all the same, and says so.

use plant::{Load, Parameters, Regulator, Signals};

use crate::acquire::{Bench, Hold, Measurement, PlanPoint};

/// How long is waited and measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Protocol {
    /// Periods whose mean is one figure. Should span several periods of the output filter's resonance.
    pub window: usize,
    /// After so many windows a point counts as unsettled.
    pub most_windows: usize,
}

impl Default for Protocol {
    fn default() -> Self {
        Protocol {
            // 50 ms at 10 kHz: more than four periods of 2 mH with 1.5 mF, which resonate at 92 Hz
            window: 500,
            // two seconds at 10 kHz: beyond the slowest source or load that is still called settled. A convention
            most_windows: 40,
        }
    }
}

/// Means of two windows that differ by less than this share of the input voltage are equal.
// 1 mV at 200 V. With twenty times as much a filter that rings for ever counts as settled
const AT_REST: f64 = 5e-6;
/// Standard errors of a mean that noise may move it by.
// a convention: noise alone exceeds it once in 370 comparisons; at 10 a filter that rings for ever counts as settled
const NOISE: f64 = 3.0;
/// An oscillation that keeps this share of its size from window to window is there to stay.
// what keeps 95 % from window to window outlives half of the windows allowed. A convention: 0.8 to 1 pass the tests
const STANDING: f64 = 0.95;

/// Measures one point of a plan.
///
/// `nominal` tells the regulator of a closed-loop point what it regulates. A point that does not settle in open loop
/// (a load or filter with too little damping) is tried once more in closed loop.
///
/// # Errors
/// Those of the bench.
pub fn measure<B: Bench + ?Sized>(
    bench: &mut B,
    nominal: &Parameters,
    point: &PlanPoint,
    protocol: &Protocol,
) -> Result<Measurement, B::Error> {
    let first = held(bench, nominal, point, point.hold, protocol)?;
    if first.settled || point.hold != Hold::OpenLoop {
        return Ok(first);
    }
    // what the nominal converter has without losses: near enough, because any voltage with its mean duty is a point
    let v_out = point.duty * nominal.converter.v_in;
    held(bench, nominal, point, Hold::ClosedLoop(v_out), protocol)
}

fn held<B: Bench + ?Sized>(
    bench: &mut B,
    nominal: &Parameters,
    point: &PlanPoint,
    hold: Hold,
    protocol: &Protocol,
) -> Result<Measurement, B::Error> {
    let load = point.load.load();
    let v_out = match hold {
        Hold::OpenLoop => point.duty * nominal.converter.v_in,
        Hold::ClosedLoop(v_out) => v_out,
    };
    let mut now = bench.start(v_out, &load)?;
    let mut drive = match hold {
        Hold::OpenLoop => Drive::Fixed(point.duty),
        Hold::ClosedLoop(v_out) => Drive::Regulated(Regulator::new(nominal, v_out, &now)),
    };
    let at_rest = AT_REST * nominal.converter.v_in;
    let mut windows: Vec<Window> = Vec::new();
    let mut settled = false;
    for _ in 0..protocol.most_windows.max(1) {
        let window = Window::run(bench, &mut drive, &load, &mut now, protocol.window.max(2))?;
        windows.push(window);
        if let [.., before, last, this] = &windows[..]
            && rests(before, last, this, at_rest)
        {
            settled = true;
            break;
        }
    }
    let last = windows.last().copied().unwrap_or_default();
    Ok(Measurement {
        d_real: last.duty,
        v_out: last.mean.v_out,
        i_out: last.mean.i_out,
        v_in: last.mean.v_in,
        v_std: last.v_std,
        settled,
        hold,
    })
}

enum Drive {
    Fixed(f64),
    Regulated(Regulator),
}

impl Drive {
    fn duty(&mut self, now: &Signals) -> f64 {
        match self {
            Drive::Fixed(duty) => *duty,
            Drive::Regulated(regulator) => regulator.duty(now),
        }
    }
}

/// What was seen in a row of periods.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    duty: f64,
    mean: Signals,
    /// Standard deviation of v_out, V.
    v_std: f64,
    /// The part of it that changes from sample to sample: noise, not drift or ringing, V.
    v_noise: f64,
    samples: f64,
}

impl Window {
    fn run<B: Bench + ?Sized>(
        bench: &mut B,
        drive: &mut Drive,
        load: &Load,
        now: &mut Signals,
        periods: usize,
    ) -> Result<Self, B::Error> {
        let mut window = Window {
            samples: periods as f64,
            ..Window::default()
        };
        let (mut squares, mut steps) = (0.0, 0.0);
        // sums from here on: a variance from squares of the whole voltage would lose the digits of a small ripple
        let origin = now.v_out;
        for _ in 0..periods {
            let duty = drive.duty(now);
            let next = bench.step(duty, load)?;
            window.duty += duty;
            window.mean.v_out += next.v_out - origin;
            window.mean.i_l += next.i_l;
            window.mean.i_out += next.i_out;
            window.mean.v_in += next.v_in;
            squares += (next.v_out - origin) * (next.v_out - origin);
            steps += (next.v_out - now.v_out) * (next.v_out - now.v_out);
            *now = next;
        }
        let n = window.samples;
        let mean = &mut window.mean;
        for sum in [
            &mut window.duty,
            &mut mean.v_out,
            &mut mean.i_l,
            &mut mean.i_out,
            &mut mean.v_in,
        ] {
            *sum /= n;
        }
        window.v_std = (squares / n - mean.v_out * mean.v_out).max(0.0).sqrt();
        // a difference of two samples has twice the variance of one
        window.v_noise = (0.5 * steps / n).sqrt();
        mean.v_out += origin;
        Ok(window)
    }
}

/// Whether three windows in a row show a steady state: the mean stands still, also where it would end if it went on in
/// geometric steps, and what oscillates is noise or there to stay.
fn rests(before: &Window, last: &Window, this: &Window, at_rest: f64) -> bool {
    // of the difference between two means
    let noise = NOISE * (2.0 / this.samples).sqrt() * this.v_noise;
    let enough = at_rest.max(noise);
    let step = |from: &Window, to: &Window| {
        let voltage = (to.mean.v_out - from.mean.v_out).abs();
        // in closed loop the voltage is held, and it is the duty that comes to rest
        voltage.max((to.duty - from.duty).abs() * to.mean.v_in)
    };
    let (earlier, later) = (step(before, last), step(last, this));
    if later > enough {
        return false;
    }
    // the sum of a geometric series; steps that do not shrink are noise here and have none. A slow bench moves little
    // from window to window and is still far from its end
    let shrinks = if earlier > later { later / earlier } else { 0.0 };
    // a shrinking that slow is noise of two equal steps: the bound keeps the quotient finite
    let to_come = later * shrinks / (1.0 - shrinks).max(1e-3);
    // quantisation and the ripple of an input harmonic stay for ever; ringing that dies out would still move the mean
    // white noise has 1, a slow swing far more; 1 to 3 pass the tests
    let oscillation = this.v_std > (1.5 * this.v_noise).max(at_rest);
    let dies_out = this.v_std < STANDING * last.v_std;
    to_come <= enough && !(oscillation && dies_out)
}
