//! The memory of a controller (contract section 1).

use crate::real::Real;

/// Coefficients of the duty ratio mapping in use: `d_real = a d_sim + b i_out + c (+ r i_out d_sim)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients<T> {
    /// Gain on the duty.
    pub a: T,
    /// Per ampere of load current.
    pub b: T,
    /// Constant.
    pub c: T,
    /// Product term per ampere; `None` in the three-term form.
    pub r: Option<T>,
}

impl<T: Real> Coefficients<T> {
    /// The check word that stands beside them in the state (section 1), as wide as the format.
    #[must_use]
    pub fn check_word(&self) -> u64 {
        // not 0, so that words that are all 0 do not belong together; a word of the format has one byte again and again
        let constant = T::low_bits(0x4B4B_4B4B_4B4B_4B4B);
        let own = [Some(self.a), Some(self.b), Some(self.c), self.r];
        own.into_iter().flatten().fold(constant, |word, x| word ^ x.bits())
    }
}

/// Everything a controller remembers from one step to the next, in the order of contract section 1.
#[derive(Debug, Clone, PartialEq)]
pub struct State<T> {
    /// Last good sample per signal, in units of the signal.
    pub held: Vec<T>,
    /// Filter memories by feature, then filter, oldest sample first.
    pub memory: Vec<T>,
    /// Duty of the chosen action of the last step, before the mapping.
    pub previous_duty: T,
    /// Duty that left the controller in the last step.
    pub previous_command: T,
    /// Upper limit of the duty during a soft start; `None` without one.
    pub soft_cap: Option<T>,
    /// `None` without a mapping.
    pub mapping: Option<Coefficients<T>>,
    /// Check word of the coefficients, as wide as the format; `None` without a mapping.
    pub mapping_check: Option<u64>,
    /// The five parts above of several outputs, without the first; empty where there is one.
    pub others: Vec<Remembered<T>>,
    /// Consecutive bad steps, saturating at K + 1.
    pub bad_count: u32,
    /// 1 if the filter memories hold samples, else 0; 2 after a state that was not sound.
    pub primed: u32,
}

/// What is remembered of one output; the fields are those of [`State`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remembered<T> {
    /// Duty before the mapping.
    pub previous_duty: T,
    /// Duty that left the controller.
    pub previous_command: T,
    /// Upper limit during a soft start.
    pub soft_cap: Option<T>,
    /// Coefficients of the mapping.
    pub mapping: Option<Coefficients<T>>,
    /// Their check word.
    pub mapping_check: Option<u64>,
}

impl<T: Real> Remembered<T> {
    /// Whether both have the same parts.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.soft_cap.is_some() == other.soft_cap.is_some()
            && self.mapping.map(|own| own.r.is_some()) == other.mapping.map(|own| own.r.is_some())
            && self.mapping_check.is_some() == other.mapping_check.is_some()
    }

    fn numbers(self) -> impl Iterator<Item = T> {
        let coefficients = self.mapping.map(|own| [Some(own.a), Some(own.b), Some(own.c), own.r]);
        [self.previous_duty, self.previous_command]
            .into_iter()
            .chain(self.soft_cap)
            .chain(coefficients.into_iter().flatten().flatten())
    }
}

impl<T: Real> State<T> {
    /// What is remembered of the output of that index; of the first where there is no such one.
    pub fn output(&self, index: usize) -> Remembered<T> {
        let other = index.checked_sub(1).and_then(|index| self.others.get(index));
        other.copied().unwrap_or(Remembered {
            previous_duty: self.previous_duty,
            previous_command: self.previous_command,
            soft_cap: self.soft_cap,
            mapping: self.mapping,
            mapping_check: self.mapping_check,
        })
    }

    /// How many outputs there are.
    pub fn outputs(&self) -> usize {
        1 + self.others.len()
    }

    /// Replaces what is remembered of the output of that index.
    pub fn set_output(&mut self, index: usize, to: Remembered<T>) {
        match index.checked_sub(1) {
            None => {
                (self.previous_duty, self.previous_command) = (to.previous_duty, to.previous_command);
                (self.soft_cap, self.mapping, self.mapping_check) = (to.soft_cap, to.mapping, to.mapping_check);
            }
            Some(index) => {
                if let Some(other) = self.others.get_mut(index) {
                    *other = to;
                }
            }
        }
    }

    /// The state as 32-bit words in the order of contract section 1, a number of two words with the low one first.
    pub fn words(&self) -> Vec<u32> {
        let mut words = Vec::new();
        self.append_words(&mut words);
        words
    }

    /// The numbers among the words, in their order; the check words and the two counters stand behind them.
    pub fn numbers_mut(&mut self) -> impl Iterator<Item = &mut T> {
        let mapping = self
            .mapping
            .iter_mut()
            .flat_map(|own| [Some(&mut own.a), Some(&mut own.b), Some(&mut own.c), own.r.as_mut()]);
        let duties = [&mut self.previous_duty, &mut self.previous_command];
        let others = self.others.iter_mut().flat_map(|own| {
            let mapping = own.mapping.iter_mut();
            let mapping =
                mapping.flat_map(|own| [Some(&mut own.a), Some(&mut own.b), Some(&mut own.c), own.r.as_mut()]);
            let duties = [&mut own.previous_duty, &mut own.previous_command];
            duties.into_iter().chain(&mut own.soft_cap).chain(mapping.flatten())
        });
        let numbers = self.held.iter_mut().chain(&mut self.memory).chain(duties);
        numbers.chain(&mut self.soft_cap).chain(mapping.flatten()).chain(others)
    }

    /// Appends [`State::words`] to a buffer.
    pub fn append_words(&self, words: &mut Vec<u32>) {
        for number in self.held.iter().chain(&self.memory) {
            number.append_words(words);
        }
        let outputs = || (0..self.outputs()).map(|index| self.output(index));
        for number in outputs().flat_map(Remembered::numbers) {
            number.append_words(words);
        }
        for check in outputs().filter_map(|output| output.mapping_check) {
            T::append_bits(check, words);
        }
        words.extend([self.bad_count, self.primed]);
    }
}
