//! The bench under a controller: it goes on from sample to sample with the duties that it is given.

use closed_loop::Error;
use closed_loop::environment::{Environment, LoadPath, Start};
use plant::{Load, Sample, Signals};
use toml_input::Message;

use super::{Bench, Noise};

/// Pieces of a period in which a load of constant power is a current.
const PIECES: u32 = 24;
/// Below this voltage constant power would ask for more than any load draws, V.
const FOLD: f64 = 5.0;

/// A bench in the loop. Noise is that of its meters: volts, then amperes.
#[derive(Debug, Clone)]
pub struct Controlled {
    bench: Bench,
    noise: [f64; 2],
    random: Noise,
    x: [f64; 2],
    filters: [f64; 4],
    load: Load,
    /// The duty of the period that is running at a sample.
    running: f64,
}

impl Controlled {
    pub fn new(bench: &Bench, noise: [f64; 2]) -> Self {
        Self {
            bench: bench.clone(),
            noise,
            random: Noise(1),
            x: [0.0; 2],
            filters: [0.0; 4],
            load: Load::default(),
            running: 0.5,
        }
    }

    /// Conductance and current that are drawn now.
    fn drawn(&self) -> (f64, f64) {
        let current = self.load.current + self.load.power / self.x[1].max(FOLD);
        (self.load.conductance, current)
    }

    /// From one place of a period of `duty` to another, both in periods.
    fn advance(&mut self, duty: f64, from: f64, to: f64) {
        let on = self.bench.carrier * (1.0 - duty);
        let (rise, fall) = (on + self.bench.lost, on + duty);
        let mut marks = vec![from, to];
        marks.extend([rise, fall].into_iter().filter(|at| (from..to).contains(at)));
        marks.extend(
            (0..=PIECES)
                .map(|n| f64::from(n) / f64::from(PIECES))
                .filter(|at| (from..to).contains(at)),
        );
        marks.sort_by(f64::total_cmp);
        for pair in marks.windows(2).filter(|pair| pair[1] > pair[0]) {
            let is_on = (rise..fall).contains(&(0.5 * (pair[0] + pair[1])));
            let load = self.drawn();
            self.bench
                .advance(&mut self.x, &mut self.filters, is_on, load, pair[1] - pair[0]);
        }
    }

    fn sample(&mut self) -> Sample {
        let on = self.bench.carrier * (1.0 - self.running);
        let is_on = (on + self.bench.lost..on + self.running).contains(&self.bench.sampled);
        let truth = self.bench.shown(self.x, is_on, self.drawn());
        let [volts, amperes] = self.noise;
        let sigma = [volts, amperes, amperes, volts];
        let shown: [f64; 4] = std::array::from_fn(|n| {
            let seen = if self.bench.slow[n] > 0.0 {
                self.filters[n]
            } else {
                truth[n]
            };
            seen * self.bench.gain[n] + self.bench.offset[n] + sigma[n] * self.random.normal()
        });
        Sample {
            v_out: truth[0],
            i_l: truth[1],
            i_out: truth[2],
            v_in: truth[3],
            measured: Signals {
                v_out: shown[0],
                i_l: shown[1],
                i_out: shown[2],
                v_in: shown[3],
            },
            ..Sample::default()
        }
    }
}

impl Environment for Controlled {
    fn t_sample(&self) -> f64 {
        1.0 / self.bench.f_sw
    }

    fn parameter(&self, _: &str) -> Option<f64> {
        None
    }

    fn ideal_ripple(&self, v_out: f64) -> f64 {
        v_out * (1.0 - v_out / self.bench.v_in) / self.bench.inductance / self.bench.f_sw
    }

    fn identity(&self) -> Vec<u8> {
        format!("{:?}", self.bench).into_bytes()
    }

    fn restart(&mut self, start: &Start<'_>) -> Result<Sample, Error> {
        self.random = Noise(start.seed + 1);
        (self.x, self.load) = ([start.i_l, start.v_out], start.load);
        self.running = start.v_out / self.bench.v_in;
        self.filters = self.bench.shown(self.x, false, self.drawn());
        Ok(self.sample())
    }

    /// The period that was running at the sample ends with the duty that it had; the commanded one holds from there on.
    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        let sampled = self.bench.sampled;
        let duty = if duty.is_finite() { duty.clamp(0.0, 1.0) } else { 0.0 };
        // the change of the load in places of the two periods: behind the sample, then before the next
        let change = load.change.map_or(f64::INFINITY, |(at, _)| sampled + at);
        for (period, duty) in [self.running, duty].into_iter().enumerate() {
            let (from, to) = if period == 0 { (sampled, 1.0) } else { (0.0, sampled) };
            let at = change - period as f64;
            let inside = at.clamp(from, to);
            self.advance(duty, from, inside);
            if let (true, Some((_, after))) = (at <= to && at >= from, load.change) {
                self.load = after;
            }
            self.advance(duty, inside, to);
        }
        self.running = duty;
        self.sample()
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        Err(Message::new("a bench cannot be saved").into())
    }

    fn load(&mut self, _: &[u8]) -> Result<(), Error> {
        Err(Message::new("a bench cannot be saved").into())
    }
}
