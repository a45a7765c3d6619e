//! A control period with anything in it: gate edges, the start of a PWM period, sensors that look earlier, a load step.
//!
//! ```text
//! s = 0                                                                          s = t_sw
//! sample ──── gate edge ──── start of PWM ──── load step ──── sensor looks ──── next sample
//!        duty in force       the new duty
//! ```
//!
//! Invariant: between two instants gates and load stand still. The path changes only where a diode ends the current.

use crate::entry::Way;
use crate::full::{Full, Path};
use crate::gates::Gate;
use crate::parameters::Model;
use crate::plain::Track;
use crate::plant::Plant;
use crate::signals::{Load, Sample, Signals};

/// Two instants closer than this fraction of a period are one.
// far above the rounding of a sum of instants, 1e-16, and far below any edge: 1e-16 s at 10 kHz
pub(crate) const SAME: f64 = 1e-12;

impl Plant {
    /// One control period in which `before` gives way to `after` at the fraction `at`.
    pub(crate) fn walk(&mut self, duty: f64, before: &Load, after: &Load, at: f64) -> Sample {
        let end = self.t_sw;
        let change = at * end;
        let start_of_pwm = if self.parameters.pwm.sampling_phase == 0.0 {
            0.0
        } else {
            (1.0 - self.parameters.pwm.sampling_phase) * end
        };
        let same = SAME * end;
        let mut track = Track::at(self.state.sample.i_l, self.state.sample.v_out);
        let (mut s, mut started) = (0.0, false);
        while s < end {
            // a sum of differences may end an ulp before the start
            if !started && s + same >= start_of_pwm {
                started = true;
                self.start_period(duty);
            }
            let origin = if started { start_of_pwm } else { start_of_pwm - end };
            let mut next = if started { end } else { start_of_pwm };
            if s + same < change && change < next {
                next = change;
            }
            // the next instant is the nearest of all kinds; nothing changes in between
            next = self.sensing.next_capture(s + same, next);
            next = origin + self.timing_edge(s + same - origin, next - origin);
            if next > end - same {
                next = end;
            }
            let load = if s + same < change { before } else { after };
            self.conduct(s - origin, next - s, load, &mut track);
            if self.sensing.looks_back {
                let signals = self.signals(load);
                let filtered = Full::filtered(&self.state.x);
                self.sensing
                    .capture(&mut self.state.memory, s + same, next + same, &signals, filtered);
            }
            s = next;
        }
        let load = if at < 1.0 { after } else { before };
        let signals = self.signals(load);
        self.finish(signals, track)
    }

    pub(crate) fn start_period(&mut self, duty: f64) {
        self.state.applied = self.modulate(duty);
        self.state.gates.plan(&self.timing, self.state.applied);
    }

    pub(crate) fn timing_edge(&self, t: f64, limit: f64) -> f64 {
        match self.parameters.converter.model {
            Model::Switched => self.state.gates.next_edge(&self.timing, t, limit),
            Model::Averaged => limit,
        }
    }

    /// Advances by `h` from `t` in the PWM period; the gates do not change meanwhile.
    pub(crate) fn conduct(&mut self, t: f64, h: f64, load: &Load, track: &mut Track) {
        self.conduct_seen(t, h, load, track, |_, _| ());
    }

    /// [`Plant::conduct`], with each path and the seconds for which it conducted.
    pub(crate) fn conduct_seen(
        &mut self,
        t: f64,
        h: f64,
        load: &Load,
        track: &mut Track,
        mut see: impl FnMut(&Path, f64),
    ) {
        // asked in the middle: at an end of the interval rounding would decide on which side of an edge it lies
        let gate = self.state.gates.at(&self.timing, t + 0.5 * h);
        let (mut rest, mut next) = (h, None);
        let is_switched = self.parameters.converter.model == Model::Switched;
        while rest > 0.0 {
            if self.node.is_there()
                && is_switched
                && let Some((path, whole)) = self.ramp(gate, load)
            {
                let used = self.follow(&path, load, whole.min(rest), track);
                see(&path, used);
                self.state.edge.pass(used);
                (rest, next) = (rest - used, None);
                continue;
            }
            let path = match (self.parameters.converter.model, next) {
                (Model::Averaged, _) => self.legs.averaged(self.state.applied),
                (Model::Switched, Some(path)) => path,
                (Model::Switched, None) => self.legs.path(gate, self.state.x[0], self.above(load)),
            };
            let used = self.follow(&path, load, rest, track);
            see(&path, used);
            if gate == Gate::Neither {
                self.state.edge.pass(used);
            }
            // only a diode ends its interval early; what is left then runs with an open leg
            rest = if path.only != 0.0 { rest - used } else { 0.0 };
            next = self.legs.after(&path, used);
        }
    }

    /// Advances by `h` along a path, or until that ends by itself. Returns the time used.
    fn follow(&mut self, path: &Path, load: &Load, h: f64, track: &mut Track) -> f64 {
        let used = if self.way < Way::Full {
            let mut x = (self.state.x[0], self.state.x[1]);
            let used = self.plain.advance(&mut x, &self.legs.drive(path), load, h, track);
            (self.state.x[0], self.state.x[1]) = x;
            track.discontinuous |= path.open;
            used
        } else {
            let span = (self.state.time, h);
            self.full.advance(&mut self.state.x, path, load, span, track)
        };
        self.state.path = *path;
        self.state.time += used;
        used
    }

    /// The path of a node between both sides, and for how long it goes on; nothing if the node is at one of them.
    fn ramp(&mut self, gate: Gate, load: &Load) -> Option<(Path, f64)> {
        let i = self.state.x[0];
        let signals = self.signals(load);
        let legs = &self.legs;
        let ramp = self.node.ramp(&mut self.state.edge, gate, i, |from| {
            legs.sides(from).map(|path| legs.v_l(path, i, &signals))
        })?;
        Some((self.legs.ramp(&ramp, i, &signals), ramp.rest))
    }

    /// How far the output lies above the source while no current flows, V; asked only where a current could begin.
    fn above(&self, load: &Load) -> f64 {
        if !self.legs.starts || self.state.x[0] != 0.0 {
            return f64::INFINITY;
        }
        if self.way < Way::Full {
            return self.state.x[1] - self.parameters.converter.v_in;
        }
        let open = crate::full::Path::OPEN;
        let signals = self.full.signals(&self.state.x, &open, load, self.state.time);
        signals.v_out - signals.v_in
    }

    /// What is true now, just before any edge that may come now.
    pub(crate) fn signals(&self, load: &Load) -> Signals {
        if self.way < Way::Full {
            let v_out = self.state.x[1];
            return Signals {
                v_out,
                i_l: self.state.x[0],
                i_out: self.plain.load_current(load, v_out),
                v_in: self.parameters.converter.v_in,
            };
        }
        // after a diode has stopped, no current flows
        let stopped = self.state.path.only != 0.0 && self.state.x[0] == 0.0;
        let path = if stopped {
            crate::full::Path::OPEN
        } else {
            self.state.path
        };
        self.full.signals(&self.state.x, &path, load, self.state.time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Parameters, Rectifier};

    #[test]
    fn the_general_way_gives_the_bits_of_the_fast_one() {
        for rectifier in [Rectifier::Diode, Rectifier::Synchronous] {
            let mut p = Parameters::paper_table();
            p.converter.rectifier = rectifier;
            p.inductor.dcr = 0.1;
            let load = Load::power(100.0);
            let (mut fast, mut walk) = (Plant::new(&p).unwrap(), Plant::new(&p).unwrap());
            fast.reset_at(100.0, 1.0, &load);
            walk.reset_at(100.0, 1.0, &load);
            for n in 0..300 {
                let duty = [0.5, 0.31, 0.62, 0.0, 1.0, 0.513][n * 5 % 6];
                assert_eq!(fast.step(duty, &load), walk.walk(duty, &load, &load, 1.0), "{n}");
            }
        }
    }

    /// The pieces of a period are sums of differences and may end an ulp before the instant they should.
    #[test]
    fn every_sampling_phase_and_edge_comes_to_the_end_of_the_period() {
        let (done, ended) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let load = Load::resistor(20.0);
            for n in 1..400 {
                let mut p = Parameters::paper_table();
                p.pwm.sampling_phase = f64::from(n) / 400.0;
                p.switch.turn_on_delay = 1e-5 / 3.0 * f64::from(n % 7);
                p.sensors.v_out.delay = 1e-4 / 7.0 * f64::from(n % 11);
                let mut plant = Plant::new(&p).unwrap();
                plant.reset_at(100.0, 5.0, &load);
                for step in 0..20 {
                    let at = 1.0 - p.pwm.sampling_phase;
                    plant.step_with_change(0.1 + 0.037 * f64::from(step), &load, &Load::resistor(10.0), at);
                }
            }
            done.send(()).unwrap();
        });
        let waited = ended.recv_timeout(std::time::Duration::from_secs(60));
        assert!(waited.is_ok(), "a period did not end");
    }
}
