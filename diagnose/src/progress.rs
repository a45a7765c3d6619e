//! How far a diagnosis is.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::parallel;

/// What a listener hears.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress<'a> {
    /// A stage begins.
    Stage(&'a str),
    /// So many of all pieces of work of the stage are done. The pieces are alike in kind, not in time.
    Done {
        /// Done by now.
        done: usize,
        /// All of them.
        total: usize,
    },
    /// What the records look like before any fit. It stands in the answer, too; the search behind it may take minutes.
    Noticed(&'a str),
}

/// Hears how far it is, from any thread.
pub type Listener<'a> = &'a (dyn Fn(Progress<'_>) + Sync);

/// A stage: `work` of every item on all cores, each heard when it is done.
pub(crate) fn map<T: Sync, R: Send>(
    say: Listener<'_>,
    stage: &str,
    items: &[T],
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    say(Progress::Stage(stage));
    let (done, total) = (AtomicUsize::new(0), items.len());
    parallel::map(items, |item| {
        let result = work(item);
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        say(Progress::Done { done, total });
        result
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::{Progress, map};

    #[test]
    fn a_stage_is_named_first_and_every_piece_is_counted() {
        let heard = Mutex::new((Vec::new(), Vec::new()));
        let say = |what: Progress<'_>| {
            let mut heard = heard.lock().unwrap();
            match what {
                Progress::Stage(stage) => heard.0.push(stage.to_owned()),
                Progress::Done { done, total } => heard.1.push((done, total)),
                Progress::Noticed(_) => {}
            }
        };
        assert_eq!(map(&say, "squares", &[1, 2, 3], |n| n * n), [1, 4, 9]);
        let (stages, mut counts) = heard.into_inner().unwrap();
        counts.sort_unstable();
        assert_eq!(
            (stages, counts),
            (vec!["squares".to_owned()], vec![(1, 3), (2, 3), (3, 3)])
        );
    }
}
