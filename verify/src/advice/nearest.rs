//! Which numeric format comes nearest to fitting, where none does.

use interp::decisions::decisions;
use policy::{NumericFormat, Policy};

use super::{EXACT_FIRST, what_it_changes};
use crate::fitting::Candidate;

/// Of formats that take about as much the most exact is proposed: 8 bits need no fewer instructions than 16 on many cores.
const ALIKE: f64 = 1.1;

/// A format that changes more than allowed comes before one that takes more than this many times as long: it can be allowed, or trained
/// for, and nobody waits for floats of a library. A convention.
const MUCH: f64 = 2.0;

/// What can be had in a format.
pub(super) trait InFormat {
    /// Format and builds.
    fn candidate(&self) -> &Candidate;
    /// What it takes, as it is said.
    fn takes(&self) -> String;
}

/// Formats that come near.
pub(super) struct Nearest<'a, T> {
    /// The most exact of those that take least and keep the decisions, where keeping them does not cost too much.
    pub of: &'a T,
    /// One that takes less and changes more decisions than allowed.
    refused: Option<&'a T>,
}

/// Of `all`; nothing of none.
pub(super) fn nearest<'a, T: InFormat>(policy: &Policy, all: &[&'a T]) -> Option<Nearest<'a, T>> {
    let (kept, refused): (Vec<&T>, Vec<&T>) =
        (all.iter().copied()).partition(|one| keeps(policy, one.candidate().format));
    let (kept, refused) = (most_exact(&kept), most_exact(&refused));
    let faster = |one: &&T, times: f64| kept.is_none_or(|kept| times * one.candidate().takes < kept.candidate().takes);
    Some(match (kept, refused) {
        (_, Some(of)) if faster(&of, MUCH) => Nearest { of, refused: None },
        (of, refused) => Nearest {
            of: of?,
            refused: refused.filter(|one| faster(one, ALIKE)),
        },
    })
}

impl<T: InFormat> Nearest<'_, T> {
    /// What its format changes, and a faster one that is refused.
    pub fn remarks(&self, policy: &Policy) -> String {
        let own = what_it_changes(policy, self.of.candidate().format);
        let faster = self.refused.map_or_else(String::new, |one| {
            let format = one.candidate().format;
            let (name, changes) = (format.name(), what_it_changes(policy, format));
            format!(
                "; {name} with {} takes {}{changes}",
                one.candidate().build(),
                one.takes()
            )
        });
        own + &faster
    }
}

/// The most exact of those that take about as much as the one that takes least.
fn most_exact<'a, T: InFormat>(all: &[&'a T]) -> Option<&'a T> {
    let takes = all.iter().map(|one| one.candidate().takes);
    let least = takes.fold(f64::INFINITY, f64::min);
    let alike = all.iter().filter(|one| one.candidate().takes <= ALIKE * least);
    alike.copied().min_by_key(|one| exactness(one.candidate().format))
}

/// Place in the order from the most exact on; a fused operation is one of binary32.
fn exactness(format: NumericFormat) -> usize {
    let format = match format {
        NumericFormat::F32Fma => NumericFormat::F32,
        other => other,
    };
    let place = EXACT_FIRST.iter().position(|other| *other == format);
    place.unwrap_or(EXACT_FIRST.len())
}

/// Whether a format changes no more golden decisions than allowed, as far as there are any.
fn keeps(policy: &Policy, format: NumericFormat) -> bool {
    !format.is_integer()
        || decisions(&policy.clone().with_format(format), None).is_none_or(|decisions| decisions.kept())
}
