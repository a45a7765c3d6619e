//! Did you mean ...?

/// The hint where `name` is none of the `candidates`, if one of them is near.
pub fn did_you_mean<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, candidates).map(|near| format!("did you mean `{near}`?"))
}

/// The candidate that differs least from `name`, if the difference is small enough for a slip; case does not matter.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let asked = name.to_ascii_lowercase();
    // a convention: one slip in three letters, and never more than three
    let limit = (asked.chars().count() / 3).clamp(1, 3);
    // a part of four letters is meant, `ds1202` of `dspace-ds1202`; a shorter one stands in many names
    let is_part = |candidate: &str| asked.len() >= 4 && candidate.contains(&asked);
    candidates
        .into_iter()
        // `ds1202` is 7 letters shorter than `dspace-ds1202`
        .filter(|candidate| candidate.len().abs_diff(name.len()) <= 8)
        .map(|candidate| (distance(&asked, &candidate.to_ascii_lowercase()), candidate))
        .filter(|(distance, candidate)| *distance <= limit || is_part(candidate))
        // of two at one distance the one of which `name` is a part: `cortexm4` is `cortex-m4f` cut short, not `cortex-m3`
        .min_by_key(|(distance, candidate)| {
            (
                digits(&asked) != digits(candidate),
                *distance,
                // false sorts before true
                !is_cut_from(&asked, candidate),
            )
        })
        .map(|(_, candidate)| candidate)
}

/// The digits of a name: `cortex-m7f` is nearer to `cortex-m7` than to `cortex-m4f`.
fn digits(name: &str) -> String {
    name.chars().filter(char::is_ascii_digit).collect()
}

/// Whether all characters of `name` stand in `whole` in this order.
fn is_cut_from(name: &str, whole: &str) -> bool {
    let mut rest = whole.chars();
    name.chars().all(|c| rest.any(|other| other == c))
}

/// Letters to insert, remove, replace or swap with their neighbour (optimal string alignment): a swap is the commonest slip
/// of a typist, and two edits where it does not count as one.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut before: Vec<usize> = Vec::new();
    let mut above: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = above[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(above[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(before[j - 2] + 1);
            }
            row.push(least);
        }
        before = std::mem::replace(&mut above, row);
    }
    above[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_near_and_another_word_is_not() {
        let targets = ["host", "cortex-m3", "cortex-m4f", "cortex-m7", "dspace-ds1202"];
        for (typed, meant) in [
            ("cortexm4", Some("cortex-m4f")),
            ("Cortex-M7", Some("cortex-m7")),
            ("cortexm7", Some("cortex-m7")),
            ("ds1202", Some("dspace-ds1202")),
            ("hsot", Some("host")),
            ("cortex-m7f", Some("cortex-m7")),
            ("z80", None),
        ] {
            assert_eq!(nearest(typed, targets), meant, "{typed}");
        }
        assert_eq!(nearest("scael", ["scale", "source", "clip"]), Some("scale"));
        assert_eq!(nearest("i_uot", ["i_out", "v_out"]), Some("i_out"));
    }

    #[test]
    fn a_swap_of_neighbours_is_one_edit() {
        assert_eq!(distance("rleu", "relu"), 1);
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
    }
}
