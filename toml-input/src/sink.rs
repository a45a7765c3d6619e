//! Where readers leave what is wrong, so that a user sees all of it at once.

use crate::fault::{Fault, Faults, Message, Place, in_file_order};

/// Collects faults while the readers go on.
///
/// A reader takes `&mut Sink` and returns an `Option`: nothing means that a fault was left here. A driver reads, and
/// [propagates](Sink::propagate) before the step that cannot do without what was read:
///
/// ```
/// # use toml_input::{Faults, Message, Sink};
/// # fn parse(text: &str, faults: &mut Sink) -> Vec<f64> {
/// #     let number = |word: &str| word.parse::<f64>().map_err(|_| faults.push(Message::new("no number").found(word))).ok();
/// #     text.split(' ').filter_map(number).collect()
/// # }
/// # fn check(numbers: &[f64], faults: &mut Sink) {
/// #     faults.extend(numbers.iter().filter(|x| **x < 0.0).map(|x| Message::new("below 0").found(x.to_string()).into()));
/// # }
/// fn sum(text: &str) -> Result<f64, Faults> {
///     let mut faults = Sink::new();
///     let numbers = parse(text, &mut faults);
///     faults.propagate()?;
///     check(&numbers, &mut faults);
///     faults.propagate()?;
///     Ok(numbers.iter().sum())
/// }
/// assert_eq!(sum("1 2").ok(), Some(3.0));
/// assert_eq!(sum("one 2 three").err().map(|faults| faults.list.len()), Some(2));
/// ```
#[derive(Debug, Clone)]
pub struct Sink {
    list: Vec<Fault>,
    /// All of them, kept or not.
    count: usize,
    most: usize,
}

impl Default for Sink {
    fn default() -> Self {
        Self::at_most(usize::MAX)
    }
}

impl Sink {
    /// An empty one.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// One that keeps the first `most` faults and counts the others: a table has as many faults as it has rows.
    #[must_use]
    pub fn at_most(most: usize) -> Self {
        Sink {
            list: Vec::new(),
            count: 0,
            most,
        }
    }

    /// One more fault.
    pub fn push(&mut self, fault: impl Into<Fault>) {
        self.count += 1;
        if self.list.len() < self.most {
            self.list.push(fault.into());
        }
    }

    /// The value of a result; its faults stay here.
    pub fn keep<T, E: Into<Faults>>(&mut self, result: Result<T, E>) -> Option<T> {
        result.map_err(|faults| self.extend(faults.into().list)).ok()
    }

    /// The faults of another sink behind those of this one.
    pub fn append(&mut self, other: Sink) {
        // what the other sink has only counted is still a fault
        let beyond = other.count - other.list.len();
        self.extend(other.list);
        self.count += beyond;
    }

    /// How many faults there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Gives `hint` to the faults behind the first `before` that have none.
    pub fn hint_since(&mut self, before: usize, hint: &str) {
        for fault in self.list.iter_mut().skip(before) {
            fault.hint.get_or_insert_with(|| hint.to_owned());
        }
    }

    /// Nothing, if nothing is wrong so far. The sink is empty afterwards.
    ///
    /// # Errors
    /// The faults in the order of the files, each once.
    pub fn propagate(&mut self) -> Result<(), Faults> {
        let Sink { mut list, count, .. } = std::mem::replace(self, Self::at_most(self.most));
        if list.is_empty() {
            return Ok(());
        }
        let more = count - list.len();
        in_file_order(&mut list);
        // behind the others: what has no line comes first in the order of a file
        if let (true, Some(last)) = (more > 0, list.last()) {
            let message = Message::new(format!("{more} more faults of this kind"));
            list.push(Fault::new(&last.file, Place::File, message));
        }
        Err(Faults { list })
    }

    /// `value`, if nothing is wrong.
    ///
    /// # Errors
    /// The faults as in [`Sink::propagate`]; `incomplete` if there is no value for no reason given.
    pub fn conclude<T>(mut self, value: Option<T>, incomplete: impl FnOnce() -> Fault) -> Result<T, Faults> {
        self.propagate()?;
        // a part that is missing has left a fault; if ever one did not, refuse all the same
        value.ok_or_else(|| incomplete().into())
    }
}

impl Extend<Fault> for Sink {
    fn extend<I: IntoIterator<Item = Fault>>(&mut self, faults: I) {
        faults.into_iter().for_each(|fault| self.push(fault));
    }
}

impl FromIterator<Fault> for Sink {
    fn from_iter<I: IntoIterator<Item = Fault>>(faults: I) -> Self {
        let mut sink = Self::new();
        sink.extend(faults);
        sink
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> Fault {
        Message::new(text).into()
    }

    #[test]
    fn an_empty_sink_lets_a_driver_go_on() {
        assert_eq!(Sink::new().propagate(), Ok(()));
        assert_eq!(Sink::new().conclude(Some(1), || fault("incomplete")), Ok(1));
    }

    #[test]
    fn what_was_propagated_does_not_come_twice() {
        let mut sink: Sink = [fault("a"), fault("b")].into_iter().collect();
        assert_eq!(sink.propagate().unwrap_err().list.len(), 2);
        assert!(sink.is_empty() && sink.propagate().is_ok());
    }

    #[test]
    fn a_value_beside_a_fault_is_not_handed_out() {
        let sink: Sink = [fault("a")].into_iter().collect();
        assert!(sink.conclude(Some(1), || fault("incomplete")).is_err());
        let none = Sink::new().conclude(None::<u8>, || fault("incomplete")).unwrap_err();
        assert_eq!(none.list, [fault("incomplete")]);
    }

    #[test]
    fn beyond_the_most_faults_are_counted() {
        let mut sink = Sink::at_most(2);
        sink.extend(["a", "b", "c", "d"].map(fault));
        assert_eq!(sink.count(), 4);
        let problems: Vec<_> = sink
            .propagate()
            .unwrap_err()
            .list
            .into_iter()
            .map(|f| f.problem)
            .collect();
        assert_eq!(problems, ["a", "b", "2 more faults of this kind"]);
        sink.extend(["a", "b", "c"].map(fault));
        assert_eq!(sink.propagate().unwrap_err().list.len(), 3, "the limit holds again");
    }

    #[test]
    fn a_hint_is_given_to_new_faults_without_one() {
        let mut sink = Sink::new();
        sink.push(Message::new("old"));
        sink.push(Message::new("new"));
        sink.push(Message::new("new").hint("own"));
        sink.hint_since(1, "given");
        let hints: Vec<_> = sink.propagate().unwrap_err().list.into_iter().map(|f| f.hint).collect();
        assert_eq!(hints, [None, Some("given".to_owned()), Some("own".to_owned())]);
    }
}
