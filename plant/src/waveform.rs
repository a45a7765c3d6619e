//! What the sensors show at any instant of a period in steady state, as an oscilloscope sees it.

use crate::effects::load_setting;
use crate::full::Full;
use crate::parameters::Sensor;
use crate::plain::Track;
use crate::plant::Plant;
use crate::sensing::array;
use crate::signals::{Load, Signals};

/// Two instants closer than this fraction of a period are one, as in `walk`.
const SAME: f64 = 1e-12;

/// One period of a steady state.
#[derive(Debug, Clone, PartialEq)]
pub struct Waveform {
    /// What the sensors show at each instant asked for.
    pub shown: Vec<Signals>,
    /// Whether the inductor current rests for a part of the period.
    pub discontinuous: bool,
    /// Whether the plant came to rest.
    pub rests: bool,
    /// When the switch node rises and falls, as fractions of the period from its start; beyond 1 in the next one. These are the edges of
    /// the main switch's gate where the current is positive. A negative one flows through the body diode of the main switch as soon as
    /// the lower switch turns off.
    pub edges: [f64; 2],
}

/// Intervals in which the switch node is high, s from the start of the period.
#[derive(Debug, Default)]
struct Pulses {
    list: Vec<[f64; 2]>,
}

impl Pulses {
    /// One more part, which may go on with the last.
    fn add(&mut self, start: f64, end: f64, same: f64) {
        match self.list.last_mut() {
            Some(last) if start <= last[1] + same => last[1] = end,
            _ => self.list.push([start, end]),
        }
    }

    /// The longest in a steady state of `period`, in which the end of a period goes on with its start; nothing if there is none, or no
    /// end of it.
    fn longest(mut self, period: f64, same: f64) -> Option<[f64; 2]> {
        if let [first, .., last] = self.list[..]
            && first[0] <= same
            && last[1] >= period - same
        {
            self.list.remove(0);
            self.list.last_mut()?[1] = period + first[1];
        }
        let length = |pulse: &[f64; 2]| pulse[1] - pulse[0];
        let longest = self.list.into_iter().max_by(|a, b| length(a).total_cmp(&length(b)))?;
        (length(&longest) < period - same).then_some(longest)
    }
}

impl Plant {
    /// Brings the plant to rest at `duty` ([`Plant::rest`]) and returns what the sensors show at the instants `at` of its
    /// PWM period: fractions of it from its start, ascending, 0 to below 1. Noise and quantisation of the sensors are left
    /// out; their delays shift nothing either: an oscilloscope's trigger is free.
    ///
    /// Only a plant that is sampled at the start of its period, `pwm.sampling_phase` 0, has its state there; of any other the
    /// instants count from the sampling instant.
    pub fn waveform(&mut self, duty: f64, load: &Load, at: &[f64]) -> Waveform {
        let (_, rests) = self.rest(duty, load);
        let drawn = load_setting::drawn(&self.parameters.load, load);
        let end = self.t_sw;
        let same = SAME * end;
        let mut track = Track::at(self.state.sample.i_l, self.state.sample.v_out);
        let mut shown = Vec::with_capacity(at.len());
        let mut looks = at.iter().map(|fraction| fraction * end).peekable();
        let mut s = 0.0;
        let legs = self.legs.clone();
        let mut pulses = Pulses::default();
        self.start_period(duty);
        while s < end {
            if looks.next_if(|look| *look <= s + same).is_some() {
                shown.push(self.seen(&drawn));
                continue;
            }
            let limit = looks.peek().copied().unwrap_or(end).min(end);
            let mut next = self.timing_edge(s + same, limit);
            if next > end - same {
                next = end;
            }
            let mut at = s;
            self.conduct_seen(s, next - s, &drawn, &mut track, |path, used| {
                if legs.is_on(path) {
                    pulses.add(at, at + used, same);
                }
                at += used;
            });
            s = next;
        }
        // fractions of 1 and more belong to the next period
        shown.extend(looks.map(|_| self.seen(&drawn)));
        let signals = self.signals(&drawn);
        self.finish(signals, track);
        Waveform {
            edges: pulses
                .longest(end, same)
                .unwrap_or_else(|| self.timing.edges(self.state.applied))
                .map(|edge| edge / end),
            shown,
            discontinuous: track.discontinuous,
            rests,
        }
    }

    /// What sensors without noise and steps show now.
    fn seen(&self, drawn: &Load) -> Signals {
        let (now, filtered) = (array(&self.signals(drawn)), Full::filtered(&self.state.x));
        let all = &self.parameters.sensors;
        let sensors: [&Sensor; 4] = [&all.v_out, &all.i_l, &all.i_out, &all.v_in];
        let [v_out, i_l, i_out, v_in] = std::array::from_fn(|n| {
            let sensor = sensors[n];
            let value = if sensor.low_pass > 0.0 { filtered[n] } else { now[n] };
            sensor.gain * value + sensor.offset
        });
        Signals {
            v_out,
            i_l,
            i_out,
            v_in,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Carrier, Load, Parameters, Plant};

    fn plant(phase: f64) -> Plant {
        let mut p = Parameters::paper_table();
        (p.inductor.dcr, p.capacitor.esr) = (0.1, 0.05);
        (p.pwm.carrier, p.pwm.sampling_phase) = (Carrier::Centre, phase);
        (p.switch.turn_on_delay, p.switch.turn_off_delay) = (2e-6, 3e-6);
        Plant::new(&p).unwrap()
    }

    /// The sampling instant of a plant file may be moved through the period: each place has to show what the waveform has there.
    #[test]
    fn a_waveform_is_what_samples_at_each_phase_show() {
        let load = Load::resistor(12.0);
        let at: Vec<f64> = (0..20).map(|n| f64::from(n) / 20.0).collect();
        let wave = plant(0.0).waveform(0.4, &load, &at);
        assert!(wave.rests && !wave.discontinuous);
        // 40 us in the middle of 100, 2 us late to rise and 3 us to fall
        assert!(
            (wave.edges[0] - 0.32).abs() < 1e-9 && (wave.edges[1] - 0.73).abs() < 1e-9,
            "{:?}",
            wave.edges
        );
        for (phase, seen) in at.iter().zip(&wave.shown) {
            let mut sampled = plant(*phase);
            let (sample, rests) = sampled.rest(0.4, &load);
            assert!(rests);
            let (v, i) = ((sample.v_out - seen.v_out).abs(), (sample.i_l - seen.i_l).abs());
            assert!(v < 1e-6 && i < 1e-6, "{phase}: {v} V, {i} A");
        }
    }

    /// Current that is negative while both switches are off flows back through the body diode of the upper one: the node rises when the
    /// lower switch turns off, not when the upper one turns on.
    #[test]
    fn the_node_rises_before_its_gate_where_the_current_is_negative() {
        for (load, rises, falls) in [
            (Load::current(8.0), 0.02, 0.4),
            (Load::current(0.1), 0.0, 0.4),
            (Load::current(-8.0), 0.0, 0.42),
        ] {
            for carrier in [Carrier::Trailing, Carrier::Centre, Carrier::Leading] {
                let mut p = Parameters::paper_table();
                p.converter.rectifier = crate::Rectifier::Synchronous;
                (p.inductor.dcr, p.switch.dead_time) = (0.1, 2e-6);
                p.pwm.carrier = carrier;
                let start = match carrier {
                    Carrier::Trailing => 0.0,
                    Carrier::Centre => 0.3,
                    Carrier::Leading => 0.6,
                };
                let [on, off] = Plant::new(&p).unwrap().waveform(0.4, &load, &[]).edges;
                assert!((on - start - rises).abs() < 1e-9, "{carrier:?} {load:?}: rises at {on}");
                assert!(
                    (off - start - falls).abs() < 1e-9,
                    "{carrier:?} {load:?}: falls at {off}"
                );
            }
        }
    }

    #[test]
    fn a_light_load_shows_the_current_at_rest() {
        let mut p = Parameters::paper_table();
        p.inductor.dcr = 0.1;
        let wave = Plant::new(&p)
            .unwrap()
            .waveform(0.3, &Load::current(0.2), &[0.0, 0.3, 0.95]);
        assert!(wave.discontinuous && wave.rests);
        assert_eq!(wave.shown[2].i_l, 0.0);
        // a triangle that carries 0.2 A: v = v_in / (1 + 2 l f i / (d^2 v_in)), and a peak of (v_in - v) d / (l f)
        let v = 200.0 / (1.0 + 2.0 * 2e-3 * 1e4 * 0.2 / (0.09 * 200.0));
        let peak = (200.0 - v) * 0.3 / (2e-3 * 1e4);
        assert!((wave.shown[1].i_l / peak - 1.0).abs() < 0.02, "{} A", wave.shown[1].i_l);
    }
}
