//! A verification in words, for people.

mod inspection;

use std::fmt::{self, Write};

use interp::decisions::{Choices, Decisions};
use interp::duties::Duties;
use interp::gains::Gains;
use interp::golden::{GoldenResult, unproven};
use policy::{Head, Policy};
use report::{grouped, quantity};
use toml_input::Message;

use crate::drift::Drift;
use crate::report::{BuildReport, Difference, Outcome, Report};
use crate::toolchain::Install;

pub use inspection::inspection;

/// The whole report: golden vectors, decisions, a line per build, what differs, the verdict last. `drift` is that of the
/// folder that was verified, if it was one.
///
/// # Errors
/// Never, in fact: writing to a text does not fail.
pub fn report(policy: &Policy, report: &Report, drift: Option<&Drift>) -> Result<String, fmt::Error> {
    let mut out = String::new();
    if let Some(drift) = drift {
        write_drift(&mut out, drift)?;
    }
    if let Some(golden) = &report.golden {
        let read = if policy.numeric_format.is_integer() {
            "in f32: "
        } else {
            ""
        };
        writeln!(out, "golden vectors   {read}{golden}")?;
    }
    if let Some(decisions) = &report.decisions {
        for line in self::decisions(policy, decisions) {
            writeln!(out, "{line}")?;
        }
    }
    let width = report
        .builds
        .iter()
        .map(|build| build.build.len())
        .max()
        .unwrap_or_default();
    for build in &report.builds {
        let (verdict, detail) = verdict(build);
        writeln!(out, "{:width$}  {verdict:9}  {detail}", build.build)?;
    }
    for build in &report.builds {
        match &build.outcome {
            Outcome::Different { difference } => write_difference(&mut out, &build.build, difference)?,
            Outcome::Failed {
                event,
                reason,
                measurement,
                ..
            } => {
                writeln!(out, "\n{}: {reason}, in `{event}`", build.build)?;
                for item in measurement {
                    writeln!(out, "  {} = {} ({})", item.signal, item.sample.value, item.sample.bits)?;
                }
            }
            Outcome::CompileError { message } => writeln!(out, "\n{}: does not compile\n{message}", build.build)?,
            Outcome::Equal | Outcome::Skipped { .. } => {}
        }
    }
    writeln!(
        out,
        "\nseed {}, checksum of all compared words {}",
        report.seed, report.checksum
    )?;
    let builds_equal = report.builds_equal() && drift.is_none_or(Drift::is_empty);
    let word = if builds_equal { "equal" } else { "DIFFERENT" };
    writeln!(out, "{word}: {} against the interpreter", report.policy)?;
    if let Some(golden) = report.golden.as_ref().filter(|golden| !golden.passed()) {
        writeln!(
            out,
            "DIFFERENT: {} does not give the trainer's golden answers",
            report.policy
        )?;
        writeln!(out, "  = hint: {}", golden.hint())?;
    } else if report.golden.is_none() {
        writeln!(out, "note: {}", unproven(policy))?;
    }
    let read = report.golden.as_ref().is_none_or(GoldenResult::passed);
    // the decisions of a network that was read wrongly say nothing about its format
    if let Some(decisions) = report.decisions.as_ref().filter(|decisions| read && !decisions.kept()) {
        let (policy, format) = (&report.policy, decisions.numeric_format());
        for (output, own) in decisions.beyond() {
            let whose = output.map_or_else(String::new, |name| format!("output {name} of "));
            writeln!(out, "DIFFERENT: {whose}{policy} in {format} {}", beyond(own))?;
        }
        writeln!(out, "  = hint: {}", accepting(decisions))?;
    }
    Ok(out)
}

/// How what a format changes is accepted.
// a folder does not say what is accepted: whoever can edit generated files would accept for whoever verifies them
fn accepting(decisions: &Decisions) -> String {
    let once = decisions.accepting_share().map_or_else(String::new, |share| {
        format!(", or for this run --golden-decisions {share} (a folder does not carry what `compile` was told)")
    });
    format!(
        "to accept them for good: {} in [network] of the contract{once}",
        decisions.remedy()
    )
}

/// What the numeric format does to the trainer's decisions, and at which observation it does most: one line each. Losses are
/// shares of the operating range of Q, duties 0..1.
#[must_use]
pub fn decisions(policy: &Policy, decisions: &Decisions) -> Vec<String> {
    let each = decisions.each().into_iter();
    each.flat_map(|(output, own)| of_output(policy, output, own)).collect()
}

/// The same of one output of several, by its name; of the only one without.
pub(crate) fn of_output(policy: &Policy, output: Option<&str>, decisions: &Decisions) -> Vec<String> {
    let paths = policy.paths();
    let path = paths.iter().find(|path| path.name == output);
    let head = path.map_or(&policy.head, |path| path.head);
    let mut lines = match decisions {
        Decisions::Choice(decisions) => choices(policy, head, decisions),
        Decisions::Continuous(duties) => self::duties(policy, duties),
        Decisions::Schedule(gains) => self::gains(policy, gains),
        Decisions::Several(_) => self::decisions(policy, decisions),
    };
    if let (Some(name), Some(first)) = (output, lines.first_mut()) {
        *first = format!("{name}: {first}");
    }
    lines
}

/// What is said of a format that changes more than allowed.
fn beyond(decisions: &Decisions) -> &'static str {
    match decisions {
        Decisions::Continuous(_) => "commands other duties than its trainer's network by more than allowed",
        Decisions::Schedule(_) => "sets other gains than its trainer's network by more than allowed",
        Decisions::Choice(_) | Decisions::Several(_) => {
            "decides otherwise than its trainer's network more often than allowed"
        }
    }
}

fn duties(policy: &Policy, duties: &Duties) -> Vec<String> {
    let Duties {
        numeric_format,
        observations,
        range,
        largest,
        mean,
        allowed,
        worst,
    } = duties;
    let word = if duties.kept() { "" } else { "DIFFERENT: " };
    let mut lines = vec![format!(
        "duties in {numeric_format}: {word}off by at most {} of their range {}, on average {} (allowed {}), {observations} observations",
        quantity(*largest, "", 2),
        quantity(*range, "", 3),
        quantity(*mean, "", 2),
        quantity(*allowed, "", 3),
    )];
    lines.extend(worst.as_ref().map(|worst| {
        format!(
            "  most at golden vector {}: duty {:.6} becomes {:.6}, at {}",
            worst.row,
            worst.expected,
            worst.found,
            place(policy, &worst.observation)
        )
    }));
    lines
}

fn gains(policy: &Policy, gains: &Gains) -> Vec<String> {
    let Gains {
        numeric_format,
        observations,
        largest,
        mean,
        allowed,
        worst,
    } = gains;
    let word = if gains.kept() { "" } else { "DIFFERENT: " };
    let range = worst
        .as_ref()
        .map(|worst| format!(", {} of gain {}", quantity(worst.range, "", 3), worst.gain));
    let mut lines = vec![format!(
        "gains in {numeric_format}: {word}off by at most {} of their ranges{}, on average {} (allowed {}), {observations} observations",
        quantity(*largest, "", 2),
        range.unwrap_or_default(),
        quantity(*mean, "", 2),
        quantity(*allowed, "", 3),
    )];
    lines.extend(worst.as_ref().map(|worst| {
        format!(
            "  most at golden vector {}: gain {} of {:.6} becomes {:.6}, at {}",
            worst.row,
            worst.gain,
            worst.expected,
            worst.found,
            place(policy, &worst.observation)
        )
    }));
    lines
}

/// An observation by the names of its features.
fn place(policy: &Policy, observation: &[f32]) -> String {
    let values = policy.features.iter().zip(observation);
    let place: Vec<String> = values
        .map(|(feature, value)| format!("{} = {value}", feature.name))
        .collect();
    place.join(", ")
}

fn choices(policy: &Policy, head: &Head, decisions: &Choices) -> Vec<String> {
    let Choices {
        numeric_format,
        observations,
        changed,
        ties,
        allowed,
        operating_range,
        largest_loss,
        mean_loss,
        worst,
    } = decisions;
    let ties = match ties {
        0 => String::new(),
        1 => ", 1 tie apart".to_owned(),
        ties => format!(", {ties} ties apart"),
    };
    let word = if decisions.kept() { "" } else { "DIFFERENT: " };
    let mut lines = vec![format!(
        "decisions in {numeric_format}: {word}{changed} of {observations} changed ({:.1} %, allowed {} %){ties}",
        100.0 * decisions.share(),
        quantity(100.0 * allowed, "", 3),
    )];
    let Some(change) = worst.first() else { return lines };
    lines.push(format!(
        "  they give up at most {} and on average {} of the operating range of Q, which is {} (mean of best less worst Q)",
        quantity(*largest_loss, "", 3),
        quantity(*mean_loss, "", 3),
        quantity(*operating_range, "", 3)
    ));
    let duty = |action: usize| head.actions().get(action).map_or(f64::NAN, |action| action.duty);
    lines.push(format!(
        "  most at golden vector {}: {} {} becomes {}, at {}",
        change.row,
        if head.residual().is_some() { "offset" } else { "duty" },
        duty(change.expected),
        duty(change.found),
        place(policy, &change.observation)
    ));
    lines
}

/// What the files of a folder alone tell, where nothing was built.
///
/// # Errors
/// Never, in fact: writing to a text does not fail.
pub fn files_alone(policy: &str, drift: &Drift) -> Result<String, fmt::Error> {
    let mut out = String::new();
    write_drift(&mut out, drift)?;
    let word = if drift.is_empty() { "equal" } else { "DIFFERENT" };
    writeln!(out, "{word}: {policy}, by its files; no build was made")?;
    Ok(out)
}

fn verdict(build: &BuildReport) -> (&'static str, String) {
    let steps = grouped(build.steps_compared);
    match &build.outcome {
        // whether the network gives the trainer's answers is said once, above: a build with equal bits gives the same
        Outcome::Equal => ("equal", format!("{steps} steps   {}", build.compiler)),
        Outcome::Different { .. } => ("DIFFERENT", format!("after {steps} equal steps")),
        Outcome::Failed { .. } => ("FAILED", format!("after {steps} equal steps")),
        Outcome::CompileError { .. } => ("REFUSED", "by the compiler".to_owned()),
        Outcome::Skipped { missing } => (
            "skipped",
            missing.iter().map(ToString::to_string).collect::<Vec<_>>().join(", "),
        ),
    }
}

/// Why no build was compared, and what to type.
#[must_use]
pub fn nothing_compared(report: &Report) -> Message {
    let builds: Vec<String> = report
        .skipped()
        .map(|build| format!("{}: {}", build.build, verdict(build).1))
        .collect();
    let install = report.to_install();
    let package = |install: &&Install| match install {
        Install::Package(package) => Some(package.clone()),
        Install::RustTarget(_) => None,
    };
    let triple = |install: &&Install| match install {
        Install::Package(_) => None,
        Install::RustTarget(triple) => Some(format!("rustup target add {triple}")),
    };
    let packages: Vec<String> = install.iter().filter_map(package).collect();
    let apt = (!packages.is_empty()).then(|| format!("sudo apt-get install {}", packages.join(" ")));
    let commands: Vec<String> = apt.into_iter().chain(install.iter().filter_map(triple)).collect();
    Message::new(format!("nothing could be compared for target {}", report.target))
        .found(builds.join("; "))
        .maybe_hint((!commands.is_empty()).then(|| commands.join("; ")))
}

fn write_difference(out: &mut String, build: &str, difference: &Difference) -> fmt::Result {
    let Difference {
        step,
        event,
        what,
        expected,
        got,
        measurement,
    } = difference;
    writeln!(out, "\n{build}: first difference at step {step}, in `{event}`: {what}")?;
    writeln!(out, "  interpreter     {} ({})", expected.value, expected.bits)?;
    writeln!(out, "  generated code  {} ({})", got.value, got.bits)?;
    for item in measurement {
        writeln!(
            out,
            "  with {} = {} ({})",
            item.signal, item.sample.value, item.sample.bits
        )?;
    }
    Ok(())
}

fn write_drift(out: &mut String, drift: &Drift) -> fmt::Result {
    if drift.is_empty() {
        writeln!(out, "files            as the policy yields them today")?;
        return Ok(());
    }
    writeln!(out, "files            DIFFERENT from what the policy yields today")?;
    for path in &drift.missing {
        writeln!(out, "  {path}: missing")?;
    }
    for path in &drift.extra {
        writeln!(out, "  {path}: the policy yields no such file")?;
    }
    for change in &drift.changed {
        let text = |line: &Option<String>| line.clone().unwrap_or_else(|| "(end of file)".to_owned());
        writeln!(out, "  {}:{}", change.path, change.line)?;
        if change.differs_at_its_end() {
            writeln!(
                out,
                "    differs in the white space or line ending at its end (LF is expected)"
            )?;
            continue;
        }
        writeln!(
            out,
            "    today {}\n    found {}",
            text(&change.expected),
            text(&change.found)
        )?;
    }
    writeln!(
        out,
        "  = hint: run `policyc compile` again if the policy was meant to change\n"
    )?;
    Ok(())
}
