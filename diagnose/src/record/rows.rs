//! Rows that are missing: what is held over them, and where a new stretch begins.

use plant::Load;

use super::Segment;

/// Gaps are filled with the value before.
pub fn held(values: Vec<f64>) -> Vec<f64> {
    let mut last = values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let hold = |value: f64| {
        if value.is_finite() {
            last = value.clamp(0.0, 1.0);
        }
        last
    };
    values.into_iter().map(hold).collect()
}

pub fn held_loads(rows: &[Option<usize>], loads: &[Load]) -> Vec<Load> {
    let mut last = rows.iter().flatten().next().map_or(Load::default(), |row| loads[*row]);
    let hold = |row: &Option<usize>| {
        if let Some(row) = row {
            last = loads[*row];
        }
        last
    };
    rows.iter().map(hold).collect()
}

/// Stretches without a long gap; a short one is bridged with the duty held (as in a record of a slower rate).
pub fn segments(rows: &[Option<usize>], settled: bool) -> Vec<Segment> {
    if settled {
        return (0..rows.len()).map(|n| n..n + 1).collect();
    }
    let used: Vec<usize> = (0..rows.len()).filter(|n| rows[*n].is_some()).collect();
    let mut steps: Vec<usize> = used.windows(2).map(|n| n[1] - n[0]).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1);
    let mut segments = Vec::new();
    let mut start = used.first().copied().unwrap_or(0);
    for pair in used.windows(2) {
        if pair[1] - pair[0] > usual {
            segments.push(start..pair[0] + 1);
            start = pair[1];
        }
    }
    segments.push(start..used.last().map_or(0, |n| n + 1));
    segments.retain(|segment| segment.len() > 4);
    segments
}
