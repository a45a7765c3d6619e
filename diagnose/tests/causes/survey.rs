//! Figures of many drawn cases: `CASES=knee SEED=1 COUNT=12 cargo test --workspace --test causes -- --ignored --nocapture`.

use std::f64::consts::TAU;
use std::time::Instant;

use diagnose::findings::Named;

use crate::lab::{Drawn, InputFilter, Knee, Resistors, drawn};
use crate::{ALL, WITHOUT_I_OUT, found};

fn said(causes: &[Named]) -> String {
    let one = |cause: &Named| {
        let values = cause
            .parameters
            .iter()
            .map(|(name, p)| format!("{name} {:.4e} [{:.3e}, {:.3e}] {}", p.value, p.low, p.high, p.unit));
        let rivals: Vec<String> = cause
            .rivals
            .iter()
            .map(|r| format!("{r:?}").chars().take(150).collect())
            .collect();
        format!(
            "{} ({}; {}; {:.0}) rivals {rivals:?}",
            cause.id,
            cause.words,
            values.collect::<Vec<_>>().join(", "),
            cause.evidence.delta_chi2
        )
    };
    causes.iter().map(one).collect::<Vec<_>>().join("\n      ")
}

/// Seconds of all cores that this process has taken.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap_or("").split_whitespace().collect();
    let ticks = fields.get(11..13).unwrap_or_default().iter();
    ticks.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Hides what is asked for in a drawn bench, in one of its kinds; what it is.
fn hide(kind: &str, n: u64, d: &mut Drawn, resistors: &mut Resistors) -> String {
    match kind {
        "healthy" => "nothing".to_owned(),
        "resistors" => off(n, d, resistors),
        "edges" => edges(n, d),
        "filter" => filter(d),
        "knee" => {
            let knee = Knee {
                at: d.i_l * d.dice.between(0.95, 1.5),
                width: d.dice.between(0.1, 0.3),
                left: d.dice.between(0.15, 0.3),
            };
            d.lab.knee = Some(knee);
            format!("{knee:?}")
        }
        "grid" => grid(n, d),
        other => panic!("no {other}"),
    }
}

fn off(n: u64, d: &mut Drawn, resistors: &mut Resistors) -> String {
    let one = d.dice.sign() * d.dice.between(0.04, 0.1);
    resistors.off = std::array::from_fn(|_| match n % 3 {
        1 => d.dice.sign() * d.dice.between(0.03, 0.1),
        _ => one,
    });
    let more = d.v_out / d.i_l * d.dice.between(0.02, 0.06);
    match n / 3 % 3 {
        0 => d.lab.dcr += more,
        1 => d.lab.r_on += more,
        _ => {}
    }
    let lab = &d.lab;
    format!("{:.3?}, dcr {:.4e}, r_on {:.4e}", resistors.off, lab.dcr, lab.r_on)
}

fn edges(n: u64, d: &mut Drawn) -> String {
    let [a, b] = [(); 2].map(|()| d.dice.between(0.01, 0.05) / d.lab.f_sw);
    match n % 4 {
        0 => d.lab.late_on = a,
        1 => d.lab.late_off = a,
        2 => (d.lab.late_on, d.lab.late_off) = (a, b),
        _ => d.lab.node_charge = a * d.i_l,
    }
    let lab = &d.lab;
    format!(
        "on {:.3e}, off {:.3e}, charge {:.3e}",
        lab.late_on, lab.late_off, lab.node_charge
    )
}

/// It swings between a fifth and a thirtieth of the switching frequency.
fn filter(d: &mut Drawn) -> String {
    let seen = d.lab.v_in * d.lab.v_in / (d.v_out * d.v_out * d.g);
    let z = seen * d.dice.around(0.03, 0.12);
    let rate = TAU * d.lab.f_sw / d.dice.around(5.0, 30.0);
    let filter = InputFilter {
        r: seen * d.dice.around(0.006, 0.03),
        l: z / rate,
        c: 1.0 / (z * rate),
        esr: seen * d.dice.around(0.0005, 0.01),
    };
    d.lab.filter = Some(filter);
    format!("{filter:.4?}")
}

fn grid(n: u64, d: &mut Drawn) -> String {
    d.lab.counts = match n % 3 {
        0 => [32.0, 64.0, 128.0, 256.0][d.dice.below(4)],
        1 => d.dice.around(24.0, 220.0).round(),
        _ => d.dice.around(24.0, 220.0),
    };
    d.lab.floors = n % 4 == 3;
    if n % 2 == 1 {
        d.lab.dcr += d.v_out / d.i_l * d.dice.between(0.02, 0.06);
    }
    let lab = &d.lab;
    format!("counts {:.3}, cut off: {}, dcr {:.4e}", lab.counts, lab.floors, lab.dcr)
}

#[test]
#[ignore = "prints figures"]
fn survey() {
    let get = |name: &str, other: &str| std::env::var(name).unwrap_or(other.to_owned());
    let number = |name: &str, other: &str| get(name, other).parse::<u64>().unwrap();
    let (kind, seed) = (get("CASES", "healthy"), number("SEED", "1"));
    for n in 0..number("COUNT", "12") {
        let mut d = drawn(seed.wrapping_add(1_000_003 * n));
        let mut resistors = d.resistors();
        let columns: &[&str] = match n % 2 {
            0 => &ALL,
            _ if kind == "filter" => &["v_out", "i_l", "r_load"],
            _ => &WITHOUT_I_OUT,
        };
        let truth = hide(&kind, n, &mut d, &mut resistors);
        let (begin, start) = (cpu(), Instant::now());
        let f = found(&mut d, &resistors, columns);
        let lab = &d.lab;
        println!(
            "{kind} {n} {} v_in {:.1}, f_sw {:.0}, d {:.2}, i_l {:.2}: {truth}\n   {:?} {:.1} s of CPU, {:.1} s\n      {}\n      partial {}\n   {}",
            if lab.boost { "boost" } else { "buck" },
            lab.v_in,
            lab.f_sw,
            d.duty,
            d.i_l,
            f.verdict,
            cpu() - begin,
            start.elapsed().as_secs_f64(),
            said(&f.causes),
            said(&f.partial),
            f.sentence
        );
    }
}
