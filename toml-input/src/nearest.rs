//! Did you mean ...?

/// The hint where `name` is none of the `candidates`, if one of them is near.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, candidates).map(|near| format!("did you mean `{near}`?"))
}

/// The candidate that differs least from `name`, if the difference is small enough for a slip.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let limit = (name.chars().count() / 3).clamp(1, 3);
    candidates
        .into_iter()
        .filter(|candidate| candidate.len().abs_diff(name.len()) <= 8)
        .map(|candidate| (distance(name, candidate), candidate))
        .filter(|(distance, _)| *distance <= limit)
        // of two at one distance the one of which `name` is a part: `cortexm4` is `cortex-m4f` cut short, not `cortex-m3`
        .min_by_key(|(distance, candidate)| (*distance, !is_cut_from(name, candidate)))
        .map(|(_, candidate)| candidate)
}

/// Whether all characters of `name` stand in `whole` in this order.
fn is_cut_from(name: &str, whole: &str) -> bool {
    let mut rest = whole.chars();
    name.chars().all(|c| rest.any(|other| other == c))
}

/// Levenshtein distance.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let cost = if ca == *cb {
                diagonal
            } else {
                1 + diagonal.min(row[j]).min(row[j + 1])
            };
            diagonal = row[j + 1];
            row[j + 1] = cost;
        }
    }
    row[b.len()]
}
