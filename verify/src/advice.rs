//! What is said about the budget of a control step, and what to do where it is not met.

mod nearest;
mod unmodelled;

use codegen::output::languages;
use codegen::{CodegenError, Output};
use interp::decisions::{Decisions, decisions};
use policy::{NumericFormat, Policy};
use targets::TargetSpec;

use crate::budget::{Budget, Clock, Fit, Slot, percents};
use crate::costs::StepCosts;
use crate::fitting::{Bench, Candidate, Fitting, Widest};
use crate::lateness;
use crate::measure::Costs;
use nearest::{InFormat, nearest};

/// Whether a step of `outputs`' cores fits into its period at a clock, and which numeric format would if it does not: one
/// line each. `costs` are those of the policy's own format; those of the others are found out here, build by build.
///
/// # Errors
/// If code in another format cannot be generated.
pub fn lines(
    policy: &Policy,
    target: &'static TargetSpec,
    outputs: &[Output],
    costs: &StepCosts,
    clock: Clock,
) -> Result<Vec<String>, CodegenError> {
    let period = policy.sample_period;
    let budgets = costs
        .measured()
        .filter_map(|costs| Some((costs.build.as_str(), Budget::of(costs, clock, period)?)));
    let budgets: Vec<(&str, Budget)> = budgets.collect();
    // the build that is done first: who is in a hurry takes that one
    let soonest = budgets.iter().min_by(|a, b| a.1.share.1.total_cmp(&b.1.share.1));
    let mut lines = vec![format!(
        "budget of {} in {}:{}",
        policy.name,
        policy.numeric_format.name(),
        soonest.map_or_else(String::new, |(build, _)| {
            let found: Vec<Fit> = budgets.iter().map(|(_, budget)| budget.fit).collect();
            format!(" {}; soonest done: {build}", in_short(&found))
        })
    )];
    lines.extend(budgets.iter().map(|(build, budget)| budget.text(build, clock.slot)));
    if budgets.is_empty() {
        lines.extend(match target.cycles {
            None => unmodelled::lines(policy, target, outputs, costs, clock)?,
            Some(_) => vec!["  cannot be said: no step ran under the target's emulator here".to_owned()],
        });
        return Ok(lines);
    }
    if policy.numeric_format == NumericFormat::F32Fma {
        lines.push("  note: the model does not know fused operations; it says too little".to_owned());
    }
    lines.extend(soonest.and_then(|(_, budget)| lateness::note(budget, clock.slot, &policy.observers)));
    if budgets.iter().any(|(_, budget)| budget.fit == Fit::Met) {
        return Ok(lines);
    }
    let own = Proposal::of(policy, costs, clock);
    let others = proposals(policy, target, outputs, clock)?;
    let fits = others.iter().find(|proposal| proposal.share.1 <= 1.0);
    let all: Vec<&Proposal> = own.iter().chain(&others).collect();
    let whole = whole_period(policy, clock.slot, &all);
    // training again is worth more than another processor, and less than another format
    let (before, behind) = match fits {
        Some(_) => (None, whole),
        None => (whole, None),
    };
    lines.extend(before);
    match fits {
        Some(fitting) => lines.push(format!(
            "  = hint: --format {} takes {} % with {}{}",
            fitting.candidate.format.name(),
            percents(fitting.share),
            fitting.candidate.build(),
            what_it_changes(policy, fitting.candidate.format)
        )),
        None => lines.extend(too_slow(policy, Bench { target, outputs, clock }, &all)),
    }
    lines.extend(behind);
    Ok(lines)
}

/// The verdict on all builds in a few words.
fn in_short(found: &[Fit]) -> String {
    let met = found.iter().filter(|fit| **fit == Fit::Met).count();
    match met {
        0 if found.contains(&Fit::Doubtful) => "in doubt in the best build".to_owned(),
        0 => "NOT met in any build".to_owned(),
        met if met == found.len() => "met in every build".to_owned(),
        met => format!("met in {met} of {} builds", found.len()),
    }
}

/// What a policy that samples inside of its period takes of the whole one, which it has if it is trained so: of the most exact format that
/// fits then, else of one that may; `None` where none does.
fn whole_period(policy: &Policy, slot: Slot, all: &[&Proposal]) -> Option<String> {
    let Slot::Behind(part) = slot else { return None };
    let whole = |proposal: &Proposal| (part * proposal.share.0, part * proposal.share.1);
    let surely = all.iter().find(|proposal| whole(proposal).1 <= 1.0);
    let perhaps = || all.iter().find(|proposal| whole(proposal).0 <= 1.0);
    let chosen = surely.or_else(perhaps)?;
    Some(format!(
        "{}: {} with {} takes {} % of that",
        trained_for_the_whole(policy),
        chosen.candidate.format.name(),
        chosen.candidate.build(),
        percents(whole(chosen))
    ))
}

/// How a policy that samples inside of its period gets the whole of it.
fn trained_for_the_whole(policy: &Policy) -> String {
    let and_there = match policy.observers.is_empty() {
        true => "",
        false => ", and compute_delay = 1 in each [[observer]]",
    };
    format!(
        "  = hint: trained again with pwm.sampling_phase = 0 and pwm.duty_delay = 1 in the plant file{and_there}, a step has the whole period"
    )
}

/// What would help where no format fits: another clock or period, a smaller network, another activation.
fn too_slow(policy: &Policy, bench: Bench<'_>, all: &[&Proposal]) -> Vec<String> {
    let Some(nearest) = nearest(policy, all) else {
        let hint = "  = hint: no numeric format fits: a faster clock, a longer period or a smaller network is needed";
        return vec![hint.to_owned()];
    };
    let Proposal { candidate, share } = nearest.of;
    let mut lines = vec![format!(
        "  = hint: no numeric format {}; next to it comes {} with {}, {} %: it fills a period of {:.0} us{}{}",
        if share.0 <= 1.0 { "surely fits" } else { "fits" },
        candidate.format.name(),
        candidate.build(),
        percents(*share),
        (1e6 * policy.sample_period * share.1).ceil(),
        or_faster(bench.clock, share.1),
        nearest.remarks(policy)
    )];
    let candidates: Vec<Candidate> = all.iter().map(|proposal| proposal.candidate.clone()).collect();
    let again = bench.retrained(policy, &candidates);
    let with = again.with;
    lines.extend(again.whole.as_ref().map(|whole| {
        format!(
            "  = hint: trained with relu the same network takes {} % in {} with {}",
            percents(whole.share),
            whole.format.name(),
            whole.build
        )
    }));
    if again.whole.as_ref().is_some_and(Fitting::fits) {
        return lines;
    }
    match bench.widest(again.or(policy), &candidates) {
        Widest::Fits(Fitting {
            sizes,
            format,
            build,
            share,
        }) => lines.push(format!(
            "  = hint: this network cut down to {}{with} takes {} % in {} with {build}: train one of that size; interrupt entry and \
             drivers come on top",
            arrows(&sizes),
            percents(share),
            format.name()
        )),
        Widest::None(smallest, formats) => lines.push(format!(
            "  = hint: not even four neurons in each hidden layer surely fit and leave room for interrupt entry, tried in {}: {}{with} takes \
             {} % in {} with {}; a faster clock, a longer period or another processor is needed",
            tried(&formats),
            arrows(&smallest.sizes),
            percents(smallest.share),
            smallest.format.name(),
            smallest.build
        )),
        Widest::Unknown => {}
    }
    lines
}

/// Parts of one core differ by this much in their clocks, and by no more: a Cortex-M4F has 64 to 240 MHz, a Cortex-M0+ 16 to 64 MHz and
/// few have 133.
const CLOCKS: f64 = 3.0;

/// The clock that would do, where a part of this core may have it.
fn or_faster(clock: Clock, times: f64) -> String {
    if times > CLOCKS {
        return String::new();
    }
    format!(
        ", or the present one at {:.0} MHz, where the part can run at it",
        (1e-6 * clock.hz * times).ceil()
    )
}

/// `f32 and i16`
fn tried(formats: &[NumericFormat]) -> String {
    let names: Vec<&str> = formats.iter().map(|format| format.name()).collect();
    names.join(" and ")
}

/// What an integer format does to the decisions, in the same breath: one that is too coarse for the policy is refused.
fn what_it_changes(policy: &Policy, format: NumericFormat) -> String {
    if !format.is_integer() {
        return String::new();
    }
    let found = decisions(&policy.clone().with_format(format), None).filter(|decisions| !decisions.kept());
    match found {
        None if policy.golden.is_none() => {
            let made = match policy.log_tells_answers() {
                true => " (`policyc replay --golden` makes them of a log)",
                false => "",
            };
            format!(
                "; golden answers would tell what it changes of the {}{made}",
                commanded(policy)
            )
        }
        None => format!("; it changes the golden {} by no more than allowed", commanded(policy)),
        Some(decisions) => {
            let what = decisions.beyond().map(|(output, own)| {
                let of = output.map_or_else(String::new, |name| format!(" of {name}"));
                match own {
                    Decisions::Choice(choices) => {
                        format!("{} of {} golden decisions{of}", choices.changed, choices.observations)
                    }
                    Decisions::Schedule(_) => format!("golden gains{of}"),
                    Decisions::Continuous(_) | Decisions::Several(_) => format!("golden duties{of}"),
                }
            });
            let what = what.collect::<Vec<_>>().join(", ");
            format!(
                "; it changes {what}, more than allowed, and is refused without `{}`",
                decisions.remedy()
            )
        }
    }
}

/// What the network decides on.
fn commanded(policy: &Policy) -> &'static str {
    match (policy.head.is_choice(), policy.head.schedule()) {
        (true, _) => "decisions",
        (false, Some(_)) => "gains",
        (false, None) => "duties",
    }
}

/// `6 -> 24 -> 12`
fn arrows(sizes: &[usize]) -> String {
    let texts: Vec<String> = sizes.iter().map(usize::to_string).collect();
    texts.join(" -> ")
}

/// What a format takes in its fastest build.
#[derive(Debug, Clone)]
struct Proposal {
    /// `takes` is the larger share.
    candidate: Candidate,
    share: (f64, f64),
}

impl InFormat for Proposal {
    fn candidate(&self) -> &Candidate {
        &self.candidate
    }

    fn takes(&self) -> String {
        format!("{} %", percents(self.share))
    }
}

impl Proposal {
    /// That of the policy's format; `None` where no build was counted.
    fn of(policy: &Policy, costs: &StepCosts, clock: Clock) -> Option<Self> {
        let budgets = costs
            .measured()
            .filter_map(|costs| Some((costs, Budget::of(costs, clock, policy.sample_period)?)));
        let mut ranked: Vec<(&Costs, Budget)> = budgets.collect();
        ranked.sort_by(|(_, a), (_, b)| a.share.1.total_cmp(&b.share.1));
        let share = ranked.first()?.1.share;
        let builds = ranked.iter().map(|(costs, _)| costs.build.clone()).collect();
        let candidate = Candidate {
            format: policy.numeric_format,
            builds,
            takes: share.1,
        };
        Some(Self { candidate, share })
    }
}

/// What may be proposed, the most exact first; the cycle models do not know fused operations.
const EXACT_FIRST: [NumericFormat; 4] = [
    NumericFormat::F64,
    NumericFormat::F32,
    NumericFormat::I16,
    NumericFormat::I8,
];

/// The other formats, each with the build of the least cycles among those that can be made here: the most exact first, and
/// none behind one that fits.
fn proposals(
    policy: &Policy,
    target: &'static TargetSpec,
    outputs: &[Output],
    clock: Clock,
) -> Result<Vec<Proposal>, CodegenError> {
    let mut found = Vec::new();
    for format in others(policy, target) {
        let policy = policy.clone().with_format(format);
        let costs = in_format(&policy, target, outputs)?;
        let proposal = Proposal::of(&policy, &costs, clock);
        let is_met = proposal.as_ref().is_some_and(|proposal| proposal.share.1 <= 1.0);
        found.extend(proposal);
        if is_met {
            break;
        }
    }
    Ok(found)
}

/// The formats beside the policy's own that suit a target.
fn others(policy: &Policy, target: &'static TargetSpec) -> impl Iterator<Item = NumericFormat> {
    let own = policy.numeric_format;
    // binary64 from a library takes longer than anything else; whether it does, the target knows
    let natural = |format: &NumericFormat| *format != NumericFormat::F64 || target.fpu.has(true);
    EXACT_FIRST
        .into_iter()
        .filter(natural)
        .filter(move |format| *format != own)
}

/// Costs of a step of the cores of `outputs`, in every build that can be made here.
fn in_format(policy: &Policy, target: &'static TargetSpec, outputs: &[Output]) -> Result<StepCosts, CodegenError> {
    let languages = languages(outputs);
    let cores: Vec<Output> = languages.iter().map(|language| language.core()).collect();
    let files = codegen::sources(policy, target, &cores, None)?.files;
    Ok(StepCosts::of(policy, target, &languages, &files))
}
