//! Which action of a list a logged duty is: who logs what was commanded has said what was chosen.

use policy::{DutyPath, Head};

/// Duties that differ by less than this share of the largest are one: binary32 of a decimal.
const ONE: f64 = 1e-6;

/// The actions of the rows that command `duties`, which the log calls `name`, and what is to be said of it. No actions where it cannot be
/// told: of an output without a list of duties, or where two of the values would be one action.
pub(super) fn chosen(path: &DutyPath<'_>, duties: &[f64], name: &str) -> (Option<Vec<u32>>, Option<String>) {
    let unsaid = |why: &str| {
        let action = path.named("action");
        let text = format!(
            "`{name}` does not say which action was chosen, {why}: the choices are not compared. A column `{action}`, the index of the choice \
             from 0, does"
        );
        (None, Some(text))
    };
    let table: Vec<f64> = match path.head {
        Head::Choice(table) => table.iter().map(|action| action.duty).collect(),
        Head::Residual(_) => return unsaid("for a law adds to it"),
        Head::Continuous(_) | Head::Schedule(_) | Head::Several(_) => return (None, None),
    };
    let largest = duties
        .iter()
        .chain(&table)
        .fold(0.0_f64, |most, duty| most.max(duty.abs()));
    let sorted = |values: &[f64]| {
        let mut values = values.to_vec();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() <= ONE * largest);
        values
    };
    let values = sorted(duties);
    if sorted(&table).len() < table.len() {
        return unsaid("for two actions command one duty");
    }
    if values.len() > table.len() {
        return unsaid(&format!(
            "for it has {} values and the contract {} duties, as behind a mapping or a limit",
            values.len(),
            table.len()
        ));
    }
    let far = |action: usize, duty: f64| table.get(action).map_or(f64::INFINITY, |own| (own - duty).abs());
    let nearest = |duty: f64| {
        (0..table.len())
            .min_by(|a, b| far(*a, duty).total_cmp(&far(*b, duty)))
            .unwrap_or(0)
    };
    let mut ranked: Vec<usize> = (0..table.len()).collect();
    ranked.sort_by(|a, b| table[*a].total_cmp(&table[*b]));
    // where all occur the order tells more than the distance: a duty that is wrong in the contract may be nearer to its neighbour
    let taken: Vec<usize> = match values.len() == table.len() {
        true => ranked,
        false => values.iter().map(|value| nearest(*value)).collect(),
    };
    if taken.windows(2).any(|pair| pair[0] == pair[1]) {
        return unsaid("for two of its values are nearest to one duty of the contract");
    }
    let action = |duty: &f64| {
        let place = values.partition_point(|value| *value < duty - ONE * largest);
        taken.get(place).map_or(0, |action| *action as u32)
    };
    let actions = duties.iter().map(action).collect();
    let text = format!(
        "the action of a row is the one whose duty comes nearest to `{name}`: the log has no column `{}`",
        path.named("action")
    );
    (Some(actions), Some(text))
}
