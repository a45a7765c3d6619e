//! Whether the refitted mapping is worth anything at the hidden bench.

use std::fmt::Write;

use crate::control::Figures;
use crate::plan::Kind;
use crate::score::table::{Asked, Line};

/// Duty from which on an effect is one that a mapping repairs: 0.4 V at 200 V.
pub const REPAIRABLE: f64 = 2e-3;
/// A mean error within this share, or so many volts, is the same.
const SAME_SHARE: f64 = 0.05;
const SAME_V: f64 = 0.01;

/// A case in closed loop.
#[derive(Debug, Clone, PartialEq)]
pub struct Closed {
    /// Kind.
    pub kind: Kind,
    /// What is hidden.
    pub hidden: Vec<String>,
    /// Change of the settled duty by what is hidden.
    pub duty: f64,
    /// With the policy's own mapping.
    pub before: Figures,
    /// With that of the diagnosis.
    pub after: Figures,
}

impl Closed {
    fn better(&self) -> bool {
        self.after.mean_abs < self.before.mean_abs
    }

    fn no_worse(&self) -> bool {
        self.after.mean_abs <= self.before.mean_abs * (1.0 + SAME_SHARE) + SAME_V
    }
}

/// The lines of the closed loop as Markdown.
#[must_use]
pub fn closed_table(cases: &[(String, Closed)]) -> String {
    let all: Vec<&Closed> = cases.iter().map(|(_, closed)| closed).collect();
    let line = |what, among: Vec<&&Closed>, hit: fn(&Closed) -> bool, asked| Line {
        what,
        hits: among.iter().filter(|closed| hit(closed)).count(),
        of: among.len(),
        asked,
    };
    let repairable = all.iter().filter(|closed| closed.duty >= REPAIRABLE).collect();
    let others = all
        .iter()
        .filter(|closed| closed.duty < REPAIRABLE && closed.kind != Kind::None)
        .collect();
    let none = all.iter().filter(|closed| closed.kind == Kind::None).collect();
    let lines = [
        line(
            "effects that move the settled duty by 0.002 or more: better with the refitted mapping",
            repairable,
            Closed::better,
            Asked::AtLeast(0.9),
        ),
        line("other effects: no worse", others, Closed::no_worse, Asked::AtLeast(0.9)),
        line("no effect: no worse", none, Closed::no_worse, Asked::AtLeast(1.0)),
    ];
    let mut text =
        "\n## Closed loop at the hidden bench\n\n| question | count | share (95 %, Clopper-Pearson) | asked | met |\n\
                    |---|---|---|---|---|\n"
            .to_owned();
    for line in lines {
        let _ = writeln!(text, "{}", line.text());
    }
    text.push_str(
        "\nBefore and after; V, settling in ms.\n\n| case | hidden | duty moved | mean error | largest mean error of a tail | \
         largest error | settling |\n|---|---|---|---|---|---|---|\n",
    );
    for (case, closed) in cases {
        let (a, b) = (&closed.before, &closed.after);
        let _ = writeln!(
            text,
            "| {case} | {} | {:.4} | {:.3}, {:.3} | {:.3}, {:.3} | {:.2}, {:.2} | {:.1}, {:.1} |",
            closed.hidden.join(", "),
            closed.duty,
            a.mean_abs,
            b.mean_abs,
            a.tail_mean,
            b.tail_mean,
            a.deviation,
            b.deviation,
            1e3 * a.settling,
            1e3 * b.settling
        );
    }
    text
}
