//! A certificate for people: a few lines, a map, a page.

use std::collections::BTreeSet;

use policy::{Interval, Policy};
use report::{Axis, Cell, HeatMap, Page, Ramp, ReportError, Section, Svg, Table, Verdict, grouped, quantity};

use crate::{Certificate, Coordinate, Domain, Map, Measured, Memory, Share};

/// The answer in a few lines; errors have the unit of Q.
#[must_use]
pub fn summary(certificate: &Certificate) -> String {
    if let Some(span) = certificate.duty_span() {
        return of_actor(certificate, span);
    }
    let bound = certificate.state_bound.bound.largest;
    let measured = &certificate.measured;
    let mut lines = vec![
        format!(
            "{} in {}: |Q - real Q| <= {} for every state, {} for every observation of the clamped box (proven)",
            certificate.name,
            certificate.numeric_format.name(),
            digits(bound),
            digits(certificate.box_bound.largest)
        ),
        format!(
            "  largest seen: {} at {} states; real Q values of a state are {} apart on average",
            digits(measured.largest_error),
            grouped(measured.observations as u64),
            digits(measured.mean_spread)
        ),
    ];
    lines.extend(certificate.proven_share.as_ref().map(|share| {
        format!(
            "  action provably unchanged: {} of the states; seen to change at {}",
            share_text(share),
            changed_text(measured)
        )
    }));
    if let Some(golden) = &certificate.golden {
        lines.push(format!(
            "  golden observations: largest error {}, action changed at {}; {}",
            digits(golden.measured.largest_error),
            changed_text(&golden.measured),
            loss_text(&golden.measured)
        ));
    }
    if let Some(map) = &certificate.map {
        lines.push(format!(
            "  map: {:.1} % of the area provably unchanged, changes seen at {}",
            100.0 * map.proven_share,
            changed_text(&map.measured)
        ));
    }
    lines.join("\n")
}

fn of_actor(certificate: &Certificate, span: f64) -> String {
    let measured = &certificate.measured;
    let mut lines = vec![
        format!(
            "{} in {}: |duty - real duty| <= {} for every state, {} for every observation of the clamped box (proven); the duty's range is {}",
            certificate.name,
            certificate.numeric_format.name(),
            digits(certificate.state_bound.bound.largest),
            digits(certificate.box_bound.largest),
            digits(span)
        ),
        format!(
            "  largest seen: {} at {} states",
            digits(measured.largest_error),
            grouped(measured.observations as u64)
        ),
    ];
    lines.extend(certificate.golden.as_ref().map(|golden| {
        format!(
            "  golden observations: largest error {}",
            digits(golden.measured.largest_error)
        )
    }));
    lines.join("\n")
}

/// The largest loss in Q, and as `compile` and `verify` say it: as a share of the operating range of Q.
fn loss_text(measured: &Measured) -> String {
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
fn digits(value: f64) -> String {
    quantity(value, "", 3)
}

fn share_text(share: &Share) -> String {
    format!(
        "{:.1} % (95 %: {:.1} to {:.1} %)",
        100.0 * share.proven as f64 / share.samples.max(1) as f64,
        100.0 * share.low,
        100.0 * share.high
    )
}

fn changed_text(measured: &Measured) -> String {
    let (changed, all) = (measured.changed_actions as u64, measured.observations as u64);
    format!("{} of {}", grouped(changed), grouped(all))
}

/// The slice of a certificate of `policy` as a picture, if it has one and a cell of it is proven.
///
/// # Errors
/// If its axes have no extent.
pub fn map(policy: &Policy, certificate: &Certificate) -> Result<Option<Svg>, ReportError> {
    let Some(map) = &certificate.map else { return Ok(None) };
    let domain = Domain::of(policy, map.slice.memory);
    let axis = |index: usize| {
        let axis = |coordinate: &Coordinate| Axis::new(coordinate.name.as_str()).unit(&coordinate.unit);
        domain.coordinates().get(index).map_or_else(|| Axis::new(""), axis)
    };
    let centres = |range: Interval, count: usize| -> Vec<f64> {
        (0..count)
            .map(|n| range.low + (range.high - range.low) * (n as f64 + 0.5) / count as f64)
            .collect()
    };
    let duty = |action: &Option<usize>| {
        let action = action.and_then(|action| policy.actions().get(action));
        action.map_or(f64::NAN, |action| action.duty)
    };
    let cells: Vec<f64> = map.actions.iter().map(duty).collect();
    let title = format!(
        "{} in {}: proven actions",
        certificate.name,
        certificate.numeric_format.name()
    );
    let mut picture = HeatMap::new(title, axis(map.slice.x.0), axis(map.slice.y.0))
        .values(
            Axis::new("duty of the proven action"),
            centres(map.slice.x.1, map.columns),
            centres(map.slice.y.1, map.rows),
            cells,
        )
        .ramp(Ramp::Sequential);
    if !map.changes.is_empty() {
        let (x, y): (Vec<f64>, Vec<f64>) = thinned(map).into_iter().unzip();
        picture = picture.dots("action seen to change", x, y);
    }
    match picture.svg() {
        Ok(svg) => Ok(Some(svg)),
        // not one cell is proven: there is nothing to draw
        Err(_) if map.actions.iter().all(Option::is_none) => Ok(None),
        Err(error) => Err(error),
    }
}

/// One point for each square of finest cells, so that dots stay dots.
fn thinned(map: &Map) -> Vec<(f64, f64)> {
    // a convention: some ten pixels of the picture
    const SQUARES: f64 = 72.0;
    let square = |x: f64, range: Interval| (SQUARES * (x - range.low) / (range.high - range.low)) as i64;
    let mut seen = BTreeSet::new();
    let is_first = |&(x, y): &(f64, f64)| seen.insert((square(x, map.slice.x.1), square(y, map.slice.y.1)));
    map.changes.iter().copied().filter(is_first).collect()
}

/// The whole page as HTML; `picture` is that of [`map`].
///
/// # Errors
/// Never, in fact: its tables have the columns that they say.
pub fn page(policy: &Policy, certificate: &Certificate, picture: Option<Svg>) -> Result<String, ReportError> {
    let format = certificate.numeric_format.name();
    if let Some(span) = certificate.duty_span() {
        return actor_page(policy, certificate, span);
    }
    let sentence = format!(
        "In {format} no Q value differs from real arithmetic by more than {} in any state; the action provably stays the same in {} of the states.",
        digits(certificate.state_bound.bound.largest),
        certificate.proven_share.as_ref().map(share_text).unwrap_or_default()
    );
    let golden = certificate.golden.as_ref().map(|golden| &golden.measured);
    let (verdict, sentence) = match golden {
        Some(golden) if golden.changed_actions > 0 => (
            Verdict::Warn,
            format!(
                "{sentence} At the golden observations it changes at {}.",
                changed_text(golden)
            ),
        ),
        _ => (Verdict::Note, sentence),
    };
    let mut page = Page::new(format!("{}: what {format} does to the decision", certificate.name))
        .verdict(verdict, sentence)
        .section(bounds(policy, certificate))
        .section(shares(certificate));
    if let Some(map) = &certificate.map {
        page = page.section(map_section(policy, map, picture));
    }
    page.section(meaning(policy, certificate)).html()
}

/// The page of a head without a choice: no actions, no map.
fn actor_page(policy: &Policy, certificate: &Certificate, span: f64) -> Result<String, ReportError> {
    let format = certificate.numeric_format.name();
    let bound = certificate.state_bound.bound.largest;
    let sentence = format!(
        "In {format} no duty differs from real arithmetic by more than {} in any state, which is {:.2} % of the duty's range.",
        digits(bound),
        100.0 * bound / span
    );
    let mut pairs = vec![
        ("proven for every state", digits(bound)),
        (
            "proven for every observation of the clamped box",
            digits(certificate.box_bound.largest),
        ),
        (
            "largest seen",
            format!(
                "{} at {} random states",
                digits(certificate.measured.largest_error),
                grouped(certificate.measured.observations as u64)
            ),
        ),
    ];
    pairs.extend(certificate.golden.as_ref().map(|golden| {
        (
            "largest seen at the golden observations",
            digits(golden.measured.largest_error),
        )
    }));
    pairs.push(("range of the duty", digits(span)));
    Page::new(format!("{}: what {format} does to the duty", certificate.name))
        .verdict(Verdict::Note, sentence)
        .section(Section::new("Error of the duty before the mapping").pairs(pairs))
        .section(meaning(policy, certificate))
        .html()
}

/// What an action is: a duty, or what it adds to that of a law.
fn offered(policy: &Policy) -> &'static str {
    match policy.head.residual() {
        Some(_) => "offset",
        None => "duty",
    }
}

fn bounds(policy: &Policy, certificate: &Certificate) -> Section {
    let mut table = Table::new("Proven bounds of |Q in the format - real Q|")
        .text("action")
        .number(offered(policy), 4)
        .text("every state")
        .text("every observation of the box");
    for (index, action) in policy.actions().iter().enumerate() {
        let bound = |bounds: &[f64]| Cell::Text(bounds.get(index).map(|b| digits(*b)).unwrap_or_default());
        table = table.row([
            Cell::Text(index.to_string()),
            Cell::Number(action.duty),
            bound(&certificate.state_bound.bound.per_action),
            bound(&certificate.box_bound.per_action),
        ]);
    }
    let measured = &certificate.measured;
    Section::new("Error of the Q values")
        .pairs([
            ("proven for every state", digits(certificate.state_bound.bound.largest)),
            (
                "proven for every observation of the clamped box",
                digits(certificate.box_bound.largest),
            ),
            (
                "largest seen",
                format!(
                    "{} at {} random states",
                    digits(measured.largest_error),
                    grouped(measured.observations as u64)
                ),
            ),
            (
                "real Q values of a state, largest less smallest, mean",
                digits(measured.mean_spread),
            ),
        ])
        .details(Section::new("Per action").table(table))
}

fn shares(certificate: &Certificate) -> Section {
    let mut pairs = vec![
        (
            "states whose action provably cannot change".to_owned(),
            certificate.proven_share.as_ref().map(share_text).unwrap_or_default(),
        ),
        (
            "random states at which it was seen to change".to_owned(),
            changed_text(&certificate.measured),
        ),
    ];
    if let Some(golden) = &certificate.golden {
        pairs.push((
            "golden observations at which it was seen to change".to_owned(),
            format!(
                "{}; largest error {}; {}",
                changed_text(&golden.measured),
                digits(golden.measured.largest_error),
                loss_text(&golden.measured)
            ),
        ));
        for near in &golden.neighbourhoods {
            pairs.push((
                format!(
                    "boxes of +-{} % around golden observations that are proven",
                    100.0 * near.radius
                ),
                share_text(&near.share),
            ));
        }
    }
    Section::new("Action").pairs(pairs)
}

fn map_section(policy: &Policy, map: &Map, picture: Option<Svg>) -> Section {
    let domain = Domain::of(policy, map.slice.memory);
    let fixed: Vec<String> = domain
        .coordinates()
        .iter()
        .zip(&map.slice.at)
        .enumerate()
        .filter(|(index, _)| *index != map.slice.x.0 && *index != map.slice.y.0)
        .map(|(_, (coordinate, value))| format!("{} = {value} {}", coordinate.name, coordinate.unit))
        .collect();
    let caption = format!(
        "Colour: the action that is proven for the whole cell, in real arithmetic and in the format. Grey: not proven; the borders \
         between two actions are always in it. Dots: the action was seen to change there. {}{}",
        match map.slice.memory {
            Memory::Settled => "Delayed samples equal the present ones. ",
            Memory::Free => "",
        },
        fixed.join(", ")
    );
    let section = Section::new("Where on the map").pairs([
        ("proven share of the area", format!("{:.1} %", 100.0 * map.proven_share)),
        (
            "points at which the action was seen to change",
            changed_text(&map.measured),
        ),
        ("largest error seen on the map", digits(map.measured.largest_error)),
    ]);
    match picture {
        Some(picture) => section.chart(picture, caption),
        None => section.text("Not one cell is proven, so there is no picture."),
    }
}

fn meaning(policy: &Policy, certificate: &Certificate) -> Section {
    let mut table = Table::new("Coordinates of a state")
        .text("coordinate")
        .text("from")
        .text("to")
        .text("unit");
    for Coordinate { name, unit, range, .. } in &certificate.coordinates {
        let text = |text: &str| Cell::Text(text.to_owned());
        table = table.row([
            text(name),
            text(&range.low.to_string()),
            text(&range.high.to_string()),
            text(unit),
        ]);
    }
    Section::new("What is meant")
        .text(
            "Real Q is the network of the policy file in exact arithmetic. A state is a point of the box of coordinates below: \
             everything that the signals can be within their plausible ranges, each delay by itself. Shares are of its volume.",
        )
        .text(
            "Proven means: by affine arithmetic with outward rounding, for every state of a box, in real arithmetic and in the \
             format. What is not proven may still be unchanged.",
        )
        .table(table)
        .pairs(certificate.copies.iter().map(|copy| {
            let name = |index: usize| policy.features.get(index).map_or("?", |feature| &feature.name);
            let offset = match copy.offset {
                0.0 => String::new(),
                offset => format!(" + ({})", digits(offset)),
            };
            let formula = format!("{} = {} * {}{offset}, before the clip", name(copy.feature), copy.factor, name(copy.of));
            ("a feature that says nothing new", formula)
        }))
}
