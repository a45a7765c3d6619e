//! A certificate for people: maps and a page.

use std::collections::BTreeSet;

use policy::{Action, Head, Interval, Policy};
use report::{Axis, Cell, HeatMap, Page, Ramp, ReportError, Section, Svg, Table, Verdict, grouped};

use crate::summary::{changed_text, digits, loss_text, share_text};
use crate::{Certificate, Coordinate, Domain, Map, Memory, Statement};

pub use crate::summary::summary;

/// The slices of a certificate of `policy` as pictures: one for each output, if it has a map and a cell of it is proven.
///
/// # Errors
/// If an axis has no extent.
pub fn maps(policy: &Policy, certificate: &Certificate) -> Result<Vec<Option<Svg>>, ReportError> {
    let heads = policy.paths().into_iter().map(|path| path.head);
    let both = certificate.statements.iter().zip(heads);
    both.map(|(statement, head)| picture(policy, certificate, (statement, head.actions())))
        .collect()
}

fn picture(
    policy: &Policy,
    certificate: &Certificate,
    (statement, actions): (&Statement, &[Action]),
) -> Result<Option<Svg>, ReportError> {
    let Some(map) = &statement.map else { return Ok(None) };
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
        let action = action.and_then(|action| actions.get(action));
        action.map_or(f64::NAN, |action| action.duty)
    };
    let cells: Vec<f64> = map.actions.iter().map(duty).collect();
    let title = format!(
        "{} in {}: proven actions{}",
        certificate.name,
        certificate.numeric_format.name(),
        statement.of()
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

/// The whole page as HTML; `pictures` are those of [`maps`].
///
/// # Errors
/// Never, in fact: its tables have the columns that they say.
pub fn page(policy: &Policy, certificate: &Certificate, pictures: Vec<Option<Svg>>) -> Result<String, ReportError> {
    let format = certificate.numeric_format.name();
    let statements = &certificate.statements;
    let decides = statements.iter().any(|statement| statement.duty_span().is_none());
    let subject = match (statements.len(), decides) {
        (1, true) => "decision",
        (1, false) => "duty",
        _ => "outputs",
    };
    let said = statements.iter().map(|statement| match statement.duty_span() {
        Some(span) => of_actor(format, statement, span),
        None => of_choice(format, statement),
    });
    let (verdicts, sentences): (Vec<Verdict>, Vec<String>) = said.unzip();
    let verdict = match verdicts.contains(&Verdict::Warn) {
        true => Verdict::Warn,
        false => Verdict::Note,
    };
    let title = format!("{}: what {format} does to the {subject}", certificate.name);
    let mut page = Page::new(title).verdict(verdict, sentences.join(" "));
    let paths = policy.paths();
    for ((statement, path), picture) in statements.iter().zip(&paths).zip(pictures) {
        page = match statement.duty_span() {
            Some(span) => page.section(duty(statement, span)),
            None => page.section(bounds(path.head, statement)).section(shares(statement)),
        };
        if let Some(map) = &statement.map {
            page = page.section(map_section(policy, statement, map, picture));
        }
    }
    page.section(meaning(policy, certificate)).html()
}

fn of_choice(format: &str, statement: &Statement) -> (Verdict, String) {
    let sentence = format!(
        "In {format} no Q value{} differs from real arithmetic by more than {} in any state; the action provably stays the same in {} of the states.",
        statement.of(),
        digits(statement.state_bound.bound.largest),
        statement.proven_share.as_ref().map(share_text).unwrap_or_default()
    );
    match statement.golden.as_ref().map(|golden| &golden.measured) {
        Some(golden) if golden.changed_actions > 0 => (
            Verdict::Warn,
            format!(
                "{sentence} At the golden observations it changes at {}.",
                changed_text(golden)
            ),
        ),
        _ => (Verdict::Note, sentence),
    }
}

fn of_actor(format: &str, statement: &Statement, span: f64) -> (Verdict, String) {
    let bound = statement.state_bound.bound.largest;
    let sentence = format!(
        "In {format} no duty{} differs from real arithmetic by more than {} in any state, which is {:.2} % of the duty's range.",
        statement.of(),
        digits(bound),
        100.0 * bound / span
    );
    (Verdict::Note, sentence)
}

/// Of a head without a choice: no actions, no map.
fn duty(statement: &Statement, span: f64) -> Section {
    let mut pairs = vec![
        ("proven for every state", digits(statement.state_bound.bound.largest)),
        (
            "proven for every observation of the clamped box",
            digits(statement.box_bound.largest),
        ),
        (
            "largest seen",
            format!(
                "{} at {} random states",
                digits(statement.measured.largest_error),
                grouped(statement.measured.observations as u64)
            ),
        ),
    ];
    pairs.extend(statement.golden.as_ref().map(|golden| {
        (
            "largest seen at the golden observations",
            digits(golden.measured.largest_error),
        )
    }));
    pairs.push(("range of the duty", digits(span)));
    Section::new(format!("Error of the duty{} before the mapping", statement.of())).pairs(pairs)
}

/// What an action is: a duty, or what it adds to that of a law.
fn offered(head: &Head) -> &'static str {
    match head.residual() {
        Some(_) => "offset",
        None => "duty",
    }
}

fn bounds(head: &Head, statement: &Statement) -> Section {
    let mut table = Table::new("Proven bounds of |Q in the format - real Q|")
        .text("action")
        .number(offered(head), 4)
        .text("every state")
        .text("every observation of the box");
    for (index, action) in head.actions().iter().enumerate() {
        let bound = |bounds: &[f64]| Cell::Text(bounds.get(index).map(|b| digits(*b)).unwrap_or_default());
        table = table.row([
            Cell::Text(index.to_string()),
            Cell::Number(action.duty),
            bound(&statement.state_bound.bound.per_action),
            bound(&statement.box_bound.per_action),
        ]);
    }
    let measured = &statement.measured;
    Section::new(format!("Error of the Q values{}", statement.of()))
        .pairs([
            ("proven for every state", digits(statement.state_bound.bound.largest)),
            (
                "proven for every observation of the clamped box",
                digits(statement.box_bound.largest),
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

fn shares(statement: &Statement) -> Section {
    let mut pairs = vec![
        (
            "states whose action provably cannot change".to_owned(),
            statement.proven_share.as_ref().map(share_text).unwrap_or_default(),
        ),
        (
            "random states at which it was seen to change".to_owned(),
            changed_text(&statement.measured),
        ),
    ];
    if let Some(golden) = &statement.golden {
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
    Section::new(format!("Action{}", statement.of())).pairs(pairs)
}

fn map_section(policy: &Policy, statement: &Statement, map: &Map, picture: Option<Svg>) -> Section {
    let domain = Domain::of(policy, map.slice.memory);
    let fixed: Vec<String> = domain
        .coordinates()
        .iter()
        .zip(&map.slice.at)
        .enumerate()
        .filter(|(index, _)| *index != map.slice.x.0 && *index != map.slice.y.0)
        .map(|(_, (coordinate, value))| {
            let text = format!("{} = {} {}", coordinate.name, plain(*value), coordinate.unit);
            text.trim_end().to_owned()
        })
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
    let section = Section::new(format!("Where on the map{}", statement.of())).pairs([
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

/// A value to the six digits that a duty of binary32 has; its binary64 would show sixteen.
fn plain(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    rounded.to_string()
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
            text(&plain(range.low)),
            text(&plain(range.high)),
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
