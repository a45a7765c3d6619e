//! Noise of any colour shows no line, and what swings does.

use std::f64::consts::TAU;

use super::{LOWEST, peaks, transform};

/// Twelve uniform numbers of a linear congruential generator make a normal one.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum()
    }

    /// Noise of a colour: an autoregression of two poles, heavy tails, or steps of a converter.
    fn course(&mut self, rows: usize, [a, b]: [f64; 2], kind: usize) -> Vec<f64> {
        let mut last = [0.0; 2];
        let mut list = Vec::new();
        for n in 0..rows + 100 {
            let mut fresh = self.normal();
            if kind == 1 && self.uniform() > 0.45 {
                fresh *= 3.0;
            }
            let value = fresh + a * last[0] + b * last[1];
            last = [value, last[0]];
            if n >= 100 {
                list.push(if kind == 2 { value.round() + 1e-9 } else { value });
            }
        }
        list
    }
}

const COLOURS: [[f64; 2]; 8] = [
    [0.0, 0.0],
    [0.5, 0.0],
    [0.8, 0.0],
    [-0.5, 0.0],
    [-0.8, 0.0],
    [0.3, 0.3],
    [0.9, -0.5],
    [0.0, -0.5],
];

#[test]
fn noise_of_any_colour_and_length_shows_no_line() {
    let mut noise = Noise(11);
    let (mut all, mut alarms) = (0, Vec::new());
    for rows in [48, 64, 90, 120, 150, 250, 400, 600, 1000, 2000] {
        for colour in COLOURS {
            for kind in 0..3 {
                for _ in 0..12 {
                    let values = noise.course(rows, colour, kind);
                    all += 1;
                    if let Some(peak) = peaks(&values, &values, LOWEST, LOWEST).first() {
                        alarms.push((rows, colour, kind, *peak));
                    }
                }
            }
        }
    }
    println!("{} of {all}: {alarms:?}", alarms.len());
    // one in a hundred records, of four channels each: a record holds four of these courses
    assert!(400 * alarms.len() <= all, "{} of {all}: {alarms:?}", alarms.len());
}

/// What a limit cycle, a dither and a line of a disturber look like, ten times as high in the spectrum as the noise.
#[test]
fn a_line_ten_times_as_high_as_the_noise_is_seen() {
    let mut noise = Noise(12);
    for kind in 0..4 {
        let (mut seen, mut all) = (0, 0);
        for rows in [120, 180, 250, 600, 2000] {
            for colour in COLOURS {
                for _ in 0..6 {
                    let mut values = noise.course(rows, colour, 0);
                    let f = [0.25, 0.5, 0.07 + 0.4 * (noise.uniform() + 0.5), 1.0 / 3.0][kind];
                    let angle = TAU * f;
                    let [a, b] = colour;
                    // spectrum of the noise at the line
                    let re = 1.0 - a * angle.cos() - b * (2.0 * angle).cos();
                    let im = a * angle.sin() + b * (2.0 * angle).sin();
                    let floor = 1.0 / (re * re + im * im);
                    // a line of amplitude A is n A^2 / 4 there, at half the rate n A^2
                    let share = if kind == 1 { 1.0 } else { 0.25 };
                    let size = 10.0 * (floor / (share * rows as f64)).sqrt();
                    let phase = if kind == 1 { 0.25 * TAU } else { TAU * noise.uniform() };
                    for (n, value) in values.iter_mut().enumerate() {
                        *value += size * (angle * n as f64 + phase).sin();
                    }
                    all += 1;
                    let found = peaks(&values, &[0.0].repeat(rows), LOWEST, LOWEST);
                    let hit = found.iter().any(|peak| {
                        (peak.frequency - f).abs() * (rows as f64) < 1.0 && (peak.amplitude / size - 1.0).abs() < 0.5
                    });
                    seen += usize::from(hit || size < super::LEAST);
                }
            }
        }
        println!("kind {kind}: {seen} of {all}");
        assert!(100 * seen >= 95 * all, "kind {kind}: {seen} of {all}");
    }
}

/// A filter rings behind steps, each in a phase of its own; a limit cycle at the same frequency goes on.
#[test]
fn a_ring_behind_steps_is_no_line_and_a_limit_cycle_at_its_frequency_is_one() {
    let mut noise = Noise(14);
    let (mut rings, mut cycles) = (0, 0);
    for _ in 0..60 {
        let values = noise.course(240, [0.0, 0.0], 0);
        let (mut ring, mut cycle) = (values.clone(), values);
        let mut since = 0.0;
        for n in 0..240 {
            if n % 47 == 0 {
                since = 12.0 * noise.uniform();
            }
            let angle = TAU * 0.07 * n as f64;
            ring[n] += 6.0 * (-((n % 47) as f64) / 14.0).exp() * (angle + since).sin();
            cycle[n] += 1.5 * angle.sin();
        }
        rings += usize::from(!peaks(&ring, &ring, LOWEST, 0.14).is_empty());
        cycles += usize::from(!peaks(&cycle, &[0.0; 240], LOWEST, 0.14).is_empty());
    }
    // rings of six times the noise behind five steps have one phase in four stretches now and then
    assert!(rings <= 6 && cycles >= 57, "{rings} rings, {cycles} cycles");
}

#[test]
fn the_transform_is_the_sum_that_defines_it() {
    let mut noise = Noise(13);
    let values: Vec<f64> = (0..16).map(|_| noise.normal()).collect();
    let (mut re, mut im) = (values.clone(), vec![0.0; 16]);
    transform(&mut re, &mut im);
    for k in 0..16 {
        let sum = |f: fn(f64) -> f64| -> f64 {
            let each = values.iter().enumerate();
            each.map(|(n, v)| v * f(TAU * (k * n) as f64 / 16.0)).sum()
        };
        assert!(
            (re[k] - sum(f64::cos)).abs() < 1e-9 && (im[k] + sum(f64::sin)).abs() < 1e-9,
            "{k}"
        );
    }
}
