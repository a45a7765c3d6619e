//! Lines as path data: broken at gaps, and no finer than the picture.

use std::fmt::Write;

use crate::markup::Px;

/// Place in the picture; `None` is a gap.
pub type Point = Option<(f64, f64)>;

/// Of consecutive points in one column of pixels keeps first, lowest, highest and last, which draw the same line. Gaps
/// and the order of points stay.
pub fn thin(points: &[Point]) -> Vec<Point> {
    let column = |point: &Point| point.map(|(x, _)| x.floor() as i64);
    let mut kept = Vec::new();
    // runs and not columns: a line that comes back to a column later is drawn again
    for run in points.chunk_by(|a, b| a.is_some() == b.is_some() && column(a) == column(b)) {
        let height = |n: &usize| run[*n].map_or(0.0, |(_, y)| y);
        let lowest = (0..run.len()).min_by(|a, b| height(a).total_cmp(&height(b)));
        let highest = (0..run.len()).max_by(|a, b| height(a).total_cmp(&height(b)));
        let mut keep = [Some(0), lowest, highest, run.len().checked_sub(1)];
        // in the order of the data: the line enters and leaves the column where it did
        keep.sort_unstable();
        let mut last = None;
        for n in keep.into_iter().flatten() {
            if last != Some(n) {
                kept.push(run[n]);
                last = Some(n);
            }
        }
    }
    kept
}

/// Corners of a staircase that holds each value until the next one.
pub fn stairs(points: &[Point]) -> Vec<Point> {
    let mut corners = Vec::with_capacity(points.len() * 2);
    for (n, point) in points.iter().enumerate() {
        if let (Some((x, _)), Some(Some((_, before)))) = (point, n.checked_sub(1).map(|m| points[m])) {
            // the value before holds up to here; behind a gap there is none to hold
            corners.push(Some((*x, before)));
        }
        corners.push(*point);
    }
    corners
}

/// Path data of a broken line. A point between two gaps becomes a dot (round line caps draw it).
pub fn line(points: &[Point]) -> String {
    let mut path = String::new();
    for piece in points.split(Option::is_none) {
        draw(&mut path, piece.iter().flatten().copied(), false);
    }
    path
}

/// Path data of the area between two lines over the same points; a gap in either is a gap in both.
pub fn area(low: &[Point], high: &[Point]) -> String {
    let mut path = String::new();
    let whole: Vec<bool> = low.iter().zip(high).map(|(a, b)| a.is_some() && b.is_some()).collect();
    let mut from = 0;
    for piece in whole.chunk_by(|a, b| a == b) {
        let to = from + piece.len();
        if piece.first() == Some(&true) {
            // each edge is thinned by itself: they share no extremes
            let (there, back) = (thin(&high[from..to]), thin(&low[from..to]));
            draw(
                &mut path,
                there.into_iter().chain(back.into_iter().rev()).flatten(),
                true,
            );
        }
        from = to;
    }
    path
}

fn draw(path: &mut String, points: impl Iterator<Item = (f64, f64)>, close: bool) {
    let mut last: Option<(i64, i64)> = None;
    let mut moved = false;
    for (x, y) in points {
        let here = (Px(x).tenths(), Px(y).tenths());
        // writing to a `String` cannot fail
        let _ = match last {
            // compared as they are written, in tenths of a pixel
            Some(last) if last == here => Ok(()),
            Some(last) if last.1 == here.1 => write!(path, "H{}", Px(x)),
            Some(last) if last.0 == here.0 => write!(path, "V{}", Px(y)),
            Some(_) => write!(path, "L{},{}", Px(x), Px(y)),
            None => write!(path, "M{},{}", Px(x), Px(y)),
        };
        moved |= last.is_some_and(|last| last != here);
        last = Some(here);
    }
    match last {
        Some(_) if close => path.push('Z'),
        // without a line round ends have nothing to stand at, and the dot would be missing
        Some(_) if !moved => path.push_str("h0"),
        _ => {}
    }
}

/// Path data of dots, one for each place that differs by half a pixel.
pub fn dots(points: &[Point]) -> String {
    let mut path = String::new();
    let mut seen = std::collections::BTreeSet::new();
    for (x, y) in points.iter().flatten() {
        // thousands of points on one place would be thousands of equal dots
        let half = |v: f64| (v * 2.0).round() as i64;
        if seen.insert((half(*x), half(*y))) {
            // writing to a `String` cannot fail
            let _ = write!(path, "M{},{}h0", Px(*x), Px(*y));
        }
    }
    path
}
