//! What is said of a processor whose cycles are not modelled: how many instructions a step needs for each cycle, and who cannot do that.
//!
//! ```text
//! needed   0 ─────────────── 1.1 ──────────────────── 1.1 · most ───────────►
//!            the board says      who begins one a cycle       nobody
//!                                does not do it               does it
//! ```
//!
//! A counted instruction takes a cycle or more where one begins at a time. So a need above 1 is a verdict, and one below it is none.

use codegen::{CodegenError, Output};
use policy::{NumericFormat, Policy};
use report::grouped;
use targets::TargetSpec;

use super::nearest::{InFormat, nearest};
use super::{arrows, in_format, or_faster, others, trained_for_the_whole, tried, what_it_changes};
use crate::budget::{Clock, Slot};
use crate::costs::StepCosts;
use crate::fitting::{Bench, Candidate, Fitting, Widest};
use crate::measure::Costs;

/// A branch may be folded into the instructions beside it, so that a cycle ends more than begin in it: in the loops of a network less
/// than a tenth of the instructions are branches.
const FOLDED: f64 = 1.1;

/// A policy on a processor.
#[derive(Clone, Copy)]
struct Case<'a> {
    policy: &'a Policy,
    target: &'static TargetSpec,
    outputs: &'a [Output],
    clock: Clock,
    /// Cycles that a step has.
    cycles: f64,
}

/// What a step needs in a numeric format, in the shortest build.
struct Need {
    /// `takes` is instructions for each cycle.
    candidate: Candidate,
    instructions: u64,
}

impl Need {
    /// Instructions for each cycle.
    fn a_cycle(&self) -> f64 {
        self.candidate.takes
    }
}

impl InFormat for Need {
    fn candidate(&self) -> &Candidate {
        &self.candidate
    }

    fn takes(&self) -> String {
        format!("{:.2}", self.a_cycle())
    }
}

/// Who cannot do it.
#[derive(Clone, Copy, PartialEq)]
enum Beyond {
    /// Nobody that is known of.
    None,
    /// A processor that begins one instruction a cycle.
    One,
    /// Every processor of the target.
    All,
}

/// Verdict and advice for a target without a cycle model, one line each; `costs` are those of the policy's own format.
pub(super) fn lines(
    policy: &Policy,
    target: &'static TargetSpec,
    outputs: &[Output],
    costs: &StepCosts,
    clock: Clock,
) -> Result<Vec<String>, CodegenError> {
    let case = Case {
        policy,
        target,
        outputs,
        clock,
        cycles: clock.hz * policy.sample_period * clock.slot.part(),
    };
    let Some(own) = case.need(policy.numeric_format, costs) else {
        return Ok(vec![format!("  cannot be said: {}", case.cycles_alone())]);
    };
    let mut rest = Vec::new();
    for format in others(policy, target) {
        let costs = in_format(&policy.clone().with_format(format), target, outputs)?;
        rest.extend(case.need(format, &costs));
    }
    let mut lines = vec![case.verdict(&own)];
    if !rest.is_empty() {
        let each = rest.iter().map(|need| {
            format!(
                "{:.2} in {}{}",
                need.a_cycle(),
                need.candidate.format.name(),
                case.in_short(need)
            )
        });
        let each: Vec<String> = each.collect();
        lines.push(format!("  in the other formats it needs {}", each.join(", ")));
    }
    if case.beyond(&own) != Beyond::None {
        lines.extend(case.advice(&own, &rest));
    }
    lines.extend(case.by_comparison());
    if case.beyond(&own) != Beyond::All {
        lines.push("  a cycle counter on the board says the rest".to_owned());
    }
    Ok(lines)
}

impl Case<'_> {
    fn need(&self, format: NumericFormat, costs: &StepCosts) -> Option<Need> {
        let mut ranked: Vec<&Costs> = costs.measured().collect();
        ranked.sort_by_key(|costs| costs.instructions_max);
        let least = ranked.first()?;
        Some(Need {
            candidate: Candidate {
                format,
                builds: ranked.iter().map(|costs| costs.build.clone()).collect(),
                takes: least.instructions_max as f64 / self.cycles,
            },
            instructions: least.instructions_max,
        })
    }

    fn beyond(&self, need: &Need) -> Beyond {
        match self.target.most_per_cycle {
            Some(most) if need.a_cycle() > FOLDED * f64::from(most) => Beyond::All,
            Some(_) if need.a_cycle() > FOLDED => Beyond::One,
            _ => Beyond::None,
        }
    }

    /// Whether the target is one processor; else it is an instruction set, of which there are many.
    fn is_a_processor(&self) -> bool {
        self.target.name.starts_with("cortex-")
    }

    fn time(&self) -> String {
        match self.clock.slot {
            Slot::Behind(part) => format!("the {:.0} % of a control period behind the sample", 100.0 * part),
            _ => "a control period".to_owned(),
        }
    }

    fn cycles_alone(&self) -> String {
        format!(
            "no cycles are modelled for {} (`policyc targets` says for which they are); {} is {} cycles at {}",
            self.target.name,
            self.time(),
            grouped(self.cycles as u64),
            self.clock
        )
    }

    fn verdict(&self, own: &Need) -> String {
        let is_many = format!(
            "{} instructions in the shortest build, {}, are {:.2} for each of {} cycles at {}",
            grouped(own.instructions),
            own.candidate.build(),
            own.a_cycle(),
            grouped(self.cycles as u64),
            self.clock
        );
        let period = self.time().trim_start_matches("a ").to_owned();
        match self.beyond(own) {
            Beyond::All => {
                let most = self.target.most_per_cycle.unwrap_or(1);
                let shortest = own.instructions as f64 / (FOLDED * f64::from(most)) / self.clock.hz;
                format!(
                    "  {period} NOT met: {is_many}, and {} begins {most} a cycle at most, branches apart: in less than {} the dearest step \
                     does not end",
                    self.target.name,
                    micros(shortest)
                )
            }
            Beyond::One if !self.is_a_processor() => format!(
                "  {period} NOT met by a core that begins one instruction a cycle, as most of {} do, and cannot be said of one that begins \
                 two: {is_many}",
                self.target.name
            ),
            _ => format!(
                "  cannot be said: {}, and {} instructions in the shortest build, {}: it fits if the processor does {:.2} instructions a \
                 cycle or more, with its wait states",
                self.cycles_alone(),
                grouped(own.instructions),
                own.candidate.build(),
                own.a_cycle()
            ),
        }
    }

    fn in_short(&self, need: &Need) -> &'static str {
        match self.beyond(need) {
            Beyond::All => " (NOT met)",
            Beyond::One if !self.is_a_processor() => " (NOT met by a core that begins one)",
            Beyond::One | Beyond::None => "",
        }
    }

    /// What comes down to one instruction a cycle, by the instructions alone.
    fn advice(&self, own: &Need, rest: &[Need]) -> Vec<String> {
        if let Some(need) = rest.iter().find(|need| need.a_cycle() <= 1.0) {
            return vec![format!(
                "  = hint: --format {} needs {:.2} instructions a cycle with {}, and the board decides{}",
                need.candidate.format.name(),
                need.a_cycle(),
                need.candidate.build(),
                what_it_changes(self.policy, need.candidate.format)
            )];
        }
        let all = || std::iter::once(own).chain(rest);
        let needs: Vec<&Need> = all().collect();
        let Some(nearest) = nearest(self.policy, &needs) else {
            return Vec::new();
        };
        let (candidate, a_cycle) = (&nearest.of.candidate, nearest.of.a_cycle());
        let mut lines: Vec<String> = self.whole_period(all()).into_iter().collect();
        lines.push(format!(
            "  = hint: no numeric format comes down to one instruction a cycle; next to it comes {} with {}, {a_cycle:.2}: one \
             instruction a cycle fills a period of {:.0} us{}{}",
            candidate.format.name(),
            candidate.build(),
            (1e6 * self.policy.sample_period * a_cycle).ceil(),
            or_faster(self.clock, a_cycle),
            nearest.remarks(self.policy)
        ));
        let bench = Bench {
            target: self.target,
            outputs: self.outputs,
            clock: self.clock,
        };
        let candidates: Vec<Candidate> = all().map(|need| need.candidate.clone()).collect();
        let again = bench.retrained(self.policy, &candidates);
        let with = again.with;
        lines.extend(again.whole.as_ref().map(|whole| {
            format!(
                "  = hint: trained with relu the same network needs {:.2} in {} with {}",
                whole.share.1,
                whole.format.name(),
                whole.build
            )
        }));
        if again.whole.as_ref().is_some_and(Fitting::fits) {
            return lines;
        }
        match bench.widest(again.or(self.policy), &candidates) {
            Widest::Fits(Fitting {
                sizes,
                format,
                build,
                share,
            }) => lines.push(format!(
                "  = hint: this network cut down to {}{with} needs {:.2} in {} with {build}: train one of that size or below; the board decides",
                arrows(&sizes),
                share.0,
                format.name()
            )),
            Widest::None(smallest, formats) => lines.push(format!(
                "  = hint: not even four neurons in each hidden layer come down to one instruction a cycle, tried in {}: {}{with} needs {:.2} in \
                 {} with {}; a faster clock, a longer period or another processor is needed",
                tried(&formats),
                arrows(&smallest.sizes),
                smallest.share.0,
                smallest.format.name(),
                smallest.build
            )),
            Widest::Unknown => {}
        }
        lines
    }

    /// As for a modelled processor: what a policy that samples inside of its period needs of the whole one.
    fn whole_period<'a>(&self, mut all: impl Iterator<Item = &'a Need>) -> Option<String> {
        let Slot::Behind(part) = self.clock.slot else {
            return None;
        };
        let fits = all.find(|need| part * need.a_cycle() <= 1.0)?;
        Some(format!(
            "{}: {} with {} needs {:.2} instructions a cycle then",
            trained_for_the_whole(self.policy),
            fits.candidate.format.name(),
            fits.candidate.build(),
            part * fits.a_cycle()
        ))
    }

    /// What a modelled processor takes, for one who has to judge whether a need is much, or looks for another part; `None` where it
    /// cannot be counted.
    fn by_comparison(&self) -> Option<String> {
        // where nothing is known of the core, another says nothing about it
        self.target.most_per_cycle?;
        let costs = in_format(self.policy, targets::find("cortex-m4f")?, self.outputs).ok()?;
        let cycles = costs
            .measured()
            .filter_map(|costs| Some((costs.instructions_max, costs.model_cycles?)));
        let (instructions, (least, most)) = cycles.min_by_key(|(_, (_, most))| *most)?;
        let a_cycle = |cycles: u64| instructions as f64 / cycles as f64;
        let does = match self.is_a_processor() {
            true => format!(
                "whose cycles are modelled, does {:.2} to {:.2} instructions a cycle in this code at 0 wait states, and takes",
                a_cycle(most),
                a_cycle(least)
            ),
            // other instructions, so that their number says nothing here
            false => "which has an FPU and whose cycles are modelled, takes at 0 wait states".to_owned(),
        };
        Some(format!(
            "  by comparison: a Cortex-M4F, {does} {} to {} for a step at this clock",
            micros(least as f64 / self.clock.hz),
            micros(most as f64 / self.clock.hz)
        ))
    }
}

fn micros(seconds: f64) -> String {
    format!("{:.1} us", 1e6 * seconds)
}
