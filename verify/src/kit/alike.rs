//! Two observations that are clipped by exactly the same bits, and no other one: an exclusive or in the place of the or that joins the two
//! words shows there alone.
//!
//! ```text
//! x ─► clip ─► c_x     x xor c_x = y xor c_y     y = c_y xor (x xor c_x): a number that is looked for, one number at a time
//! y ─► clip ─► c_y                               by halvings, and among the numbers next to where they end
//! ```

use interp::{InputError, Real, Trace};
use policy::{Policy, Scalar};
use random::SplitMix;

use super::SEED;
use super::course::Course;
use super::place::{Place, Probe};
use crate::traces::Event;

/// Places that are tried for one observation.
// a convention: each costs at most some thousand steps without the network
const PLACES: usize = 40;
/// Halvings that bring two numbers of either format next to each other.
const HALVINGS: usize = 64;
/// Numbers to either side of where the halvings end.
const BESIDE: usize = 12;

/// Of each feature the bits that its clip changes.
fn words<T: Real>(trace: &Trace<T>) -> Vec<u64> {
    let word = |feature: &interp::FeatureTrace<T>| feature.unclipped.bits() ^ feature.observation.bits();
    trace.features.iter().map(word).collect()
}

/// Whether the words before that one join to what it is itself, and none behind it says so again.
fn hides<T: Real>(trace: &Trace<T>, feature: usize) -> bool {
    let words = words(trace);
    let before = words[..feature].iter().fold(0, |all, word| all | word);
    before == words[feature] && before != 0 && words[feature + 1..].iter().all(|word| *word == 0)
}

impl<T: Real> Course<'_, T> {
    /// For each clipped observation a step in which the clip of an earlier one has the same bits, if one is found.
    pub fn alike(&mut self) -> Result<(), InputError> {
        let policy = self.policy;
        let mut probe = Probe::<T>::new(policy);
        let mut random = SplitMix::new(SEED);
        let clipped = |(index, feature): (usize, &policy::Feature)| feature.clip.map(|_| index);
        let clipped: Vec<usize> = policy.features.iter().enumerate().filter_map(clipped).collect();
        for feature in clipped.iter().skip(1) {
            let mut places = (0..PLACES).map(|_| probe.anywhere(&mut random)).collect::<Vec<Place>>();
            // the usual place first: one number moved from there takes least memory
            places.insert(0, Place::default());
            let Some(place) = places
                .iter()
                .find_map(|place| alike(policy, &mut probe, place, *feature))
            else {
                continue;
            };
            self.play(Event::Init)?;
            let damage = probe.damage(&place);
            self.put(|state| damage.apply(state));
            self.play(Event::Step(probe.samples(&place)))?;
        }
        Ok(())
    }
}

/// A place near that one where the clip of the feature hides.
fn alike<T: Real>(policy: &Policy, probe: &mut Probe<'_, T>, place: &Place, feature: usize) -> Option<Place> {
    let start = probe.sense(place)?;
    let before = words(&start);
    let others = before[..feature].iter().fold(0, |all, word| all | word);
    if others == 0 || before[feature + 1..].iter().any(|word| *word != 0) {
        return None;
    }
    let clip = policy.features[feature].clip?;
    for end in [clip.low, clip.high] {
        let bits = T::nearest(end).bits() ^ others;
        let wanted = match policy.numeric_format.scalar() {
            Scalar::F32 => f32::from_bits(bits as u32).into(),
            Scalar::F64 => f64::from_bits(bits),
        };
        let is_beyond = if end == clip.low { wanted < end } else { wanted > end };
        if !is_beyond {
            continue;
        }
        for knob in 0..probe.ends().len() {
            let found = halved(probe, place, feature, knob, wanted);
            if found.is_some() {
                return found;
            }
        }
    }
    None
}

/// Moves one knob until the feature is that number before its clip.
fn halved<T: Real>(probe: &mut Probe<'_, T>, place: &Place, feature: usize, knob: usize, wanted: f64) -> Option<Place> {
    let scalar = probe.scalar();
    let (mut low, mut high) = probe.ends()[knob];
    let mut at = |x: f64| -> Option<f64> {
        let trace = probe.sense(&place.with(knob, x))?;
        Some(trace.features[feature].unclipped.to_f64())
    };
    let (from, to) = (at(low)?, at(high)?);
    if (from < wanted) == (to < wanted) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match (at(middle)? < wanted) == (from < wanted) {
            true => low = middle,
            false => high = middle,
        }
    }
    let mut x = T::nearest(low).to_f64();
    for _ in 0..BESIDE {
        x = scalar.next_down(x);
    }
    for _ in 0..2 * BESIDE {
        let near = place.with(knob, x);
        if probe.sense(&near).is_some_and(|trace| hides(&trace, feature)) {
            return Some(near);
        }
        x = scalar.next_up(x);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The suite clips two observations, of which the second follows from what the first and one word of memory are.
    #[test]
    fn the_clips_of_the_suite_hide_each_other_in_one_move() {
        let policy = crate::kit::constructs().unwrap();
        let mut course = Course::<f32>::new(&policy);
        let before = course.trace.steps();
        course.alike().unwrap();
        assert_eq!(course.trace.steps() - before, 1);
    }
}
