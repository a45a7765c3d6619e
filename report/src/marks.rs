//! Lines and stripes across a panel, and where their labels find room.

use crate::axis::Scale;
use crate::colour::Colour;
use crate::font::{SMALL, width};
use crate::frame::{Area, BAND_OPACITY, LINE, rectangle};
use crate::markup::{Markup, Px};
use crate::series::Mark;

/// The line or stripe, without its label.
pub fn zone(out: &mut Markup, mark: &Mark, xs: Scale, ys: Scale) {
    let along = if mark.on_x { xs } else { ys };
    let (Some(a), Some(b)) = (along.at(mark.from), along.at(mark.to)) else {
        return;
    };
    let (start, size) = (a.min(b), (a - b).abs());
    let (wide, high) = (xs.to, ys.from);
    if mark.from == mark.to {
        let d = if mark.on_x {
            format!("M{},0V{}", Px(a), Px(high))
        } else {
            format!("M0,{}H{}", Px(a), Px(wide))
        };
        let pen: [(&str, &dyn std::fmt::Display); 3] =
            [("d", &d), ("stroke", &Colour::DIM), ("stroke-dasharray", &"4 3")];
        out.leaf("path", &pen);
        return;
    }
    let area = if mark.on_x {
        Area {
            x: start,
            y: 0.0,
            width: size,
            height: high,
        }
    } else {
        Area {
            x: 0.0,
            y: start,
            width: wide,
            height: size,
        }
    };
    rectangle(out, area, Colour::GREY, BAND_OPACITY);
}

/// Writes the label where no earlier label stands: beside the line, else on its other side, else further along.
pub fn label(out: &mut Markup, mark: &Mark, xs: Scale, ys: Scale, taken: &mut Vec<Area>) {
    let along = if mark.on_x { xs } else { ys };
    let (Some(a), Some(b)) = (along.at(mark.from), along.at(mark.to)) else {
        return;
    };
    if mark.label.is_empty() {
        return;
    }
    let (wide, high) = (xs.to, ys.from);
    let size = (width(&mark.label, SMALL), LINE);
    let box_at = |x: f64, y: f64| Area {
        x: x.clamp(4.0, (wide - size.0 - 4.0).max(4.0)),
        y: y.clamp(1.0, (high - size.1).max(1.0)),
        width: size.0,
        height: size.1,
    };
    let (near, far) = (a.min(b), a.max(b));
    let places: Vec<Area> = if mark.on_x {
        // six rows and three columns of places: a convention; with all taken the first is used, since a label is never
        // dropped
        let rows = (0..6).map(|row| f64::from(row) * LINE + 2.0);
        rows.flat_map(|y| [box_at(near + 5.0, y), box_at(far - size.0 - 5.0, y)])
            .collect()
    } else {
        let columns = [wide - size.0 - 6.0, 6.0, (wide - size.0) / 2.0];
        let heights = if near == far {
            [near - LINE, near + 2.0]
        } else {
            [near + 1.0, far - LINE]
        };
        columns.iter().flat_map(|x| heights.map(|y| box_at(*x, y))).collect()
    };
    let free = places
        .iter()
        .find(|place| !taken.iter().any(|other| overlap(place, other)));
    let Some(place) = free.or(places.first()).copied() else {
        return;
    };
    taken.push(place);
    out.text(
        "text",
        &[
            ("x", &Px(place.x)),
            ("y", &Px(place.y + 12.0)),
            ("fill", &Colour::DIM),
            // a seam of paper round the letters keeps them readable on lines and bands
            ("stroke", &Colour::PAPER),
            ("stroke-width", &3),
            ("paint-order", &"stroke"),
        ],
        &mark.label,
    );
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.x < b.right() && b.x < a.right() && a.y < b.bottom() && b.y < a.bottom()
}
