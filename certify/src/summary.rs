//! A certificate in a few lines.

use report::{grouped, quantity};

use crate::{Certificate, Measured, Share, Statement};

/// The answer in a few lines, for each output; errors have the unit of Q, and of a head without a choice that of the duty.
#[must_use]
pub fn summary(certificate: &Certificate) -> String {
    let of = |statement: &Statement| match statement.duty_span() {
        Some(span) => of_actor(certificate, statement, span),
        None => of_choice(certificate, statement),
    };
    let all: Vec<String> = certificate.statements.iter().map(of).collect();
    all.join("\n")
}

/// Whose figures these are: the policy, or an output of it.
fn subject(certificate: &Certificate, statement: &Statement) -> String {
    let name = &certificate.name;
    match &statement.output {
        Some(output) => format!("{name}, output {output}"),
        None => name.clone(),
    }
}

fn of_choice(certificate: &Certificate, statement: &Statement) -> String {
    let bound = statement.state_bound.bound.largest;
    let measured = &statement.measured;
    let mut lines = vec![
        format!(
            "{} in {}: |Q - real Q| <= {} for every state, {} for every observation of the clamped box (proven)",
            subject(certificate, statement),
            certificate.numeric_format.name(),
            digits(bound),
            digits(statement.box_bound.largest)
        ),
        format!(
            "  largest seen: {} at {} states; real Q values of a state are {} apart on average",
            digits(measured.largest_error),
            grouped(measured.observations as u64),
            digits(measured.mean_spread)
        ),
    ];
    lines.extend(statement.proven_share.as_ref().map(|share| {
        format!(
            "  action provably unchanged: {} of the states; seen to change at {}",
            share_text(share),
            changed_text(measured)
        )
    }));
    if let Some(golden) = &statement.golden {
        lines.push(format!(
            "  golden observations: largest error {}, action changed at {}; {}",
            digits(golden.measured.largest_error),
            changed_text(&golden.measured),
            loss_text(&golden.measured)
        ));
    }
    if let Some(map) = &statement.map {
        lines.push(format!(
            "  map: {:.1} % of the area provably unchanged, changes seen at {}",
            100.0 * map.proven_share,
            changed_text(&map.measured)
        ));
    }
    lines.join("\n")
}

fn of_actor(certificate: &Certificate, statement: &Statement, span: f64) -> String {
    let measured = &statement.measured;
    let mut lines = vec![
        format!(
            "{} in {}: |duty - real duty| <= {} for every state, {} for every observation of the clamped box (proven); the duty's range is {}",
            subject(certificate, statement),
            certificate.numeric_format.name(),
            digits(statement.state_bound.bound.largest),
            digits(statement.box_bound.largest),
            digits(span)
        ),
        format!(
            "  largest seen: {} at {} states",
            digits(measured.largest_error),
            grouped(measured.observations as u64)
        ),
    ];
    lines.extend(statement.golden.as_ref().map(|golden| {
        format!(
            "  golden observations: largest error {}",
            digits(golden.measured.largest_error)
        )
    }));
    lines.join("\n")
}

/// The largest loss in Q, and as `compile` and `verify` say it: as a share of the operating range of Q.
pub(crate) fn loss_text(measured: &Measured) -> String {
    // a network with one value for all actions has no range: a loss of 0 is 0 of it
    let range = measured.mean_spread.max(f64::MIN_POSITIVE);
    format!(
        "the worst change gives up {} of Q: {} of the operating range of Q, which is {} (mean of best less worst Q)",
        digits(measured.largest_loss),
        digits(measured.largest_loss / range),
        digits(measured.mean_spread)
    )
}

/// Three significant digits.
pub(crate) fn digits(value: f64) -> String {
    quantity(value, "", 3)
}

pub(crate) fn share_text(share: &Share) -> String {
    format!(
        "{:.1} % (95 %: {:.1} to {:.1} %)",
        100.0 * share.proven as f64 / share.samples.max(1) as f64,
        100.0 * share.low,
        100.0 * share.high
    )
}

pub(crate) fn changed_text(measured: &Measured) -> String {
    let (changed, all) = (measured.changed_actions as u64, measured.observations as u64);
    format!("{} of {}", grouped(changed), grouped(all))
}
