//! Duty ratio mapping (contract section 8).

use crate::real::{Range, Real};
use crate::state::Coefficients;

/// The mapping's fixed part; its coefficients are state.
#[derive(Debug, Clone)]
pub(crate) struct Mapping<T> {
    pub initial: Coefficients<T>,
    pub load_current: usize,
    valid_i_out: Range<T>,
    valid_d_sim: Range<T>,
    adjust: [Range<T>; 4],
}

impl<T: Real> Mapping<T> {
    pub fn new(mapping: &policy::Mapping) -> Self {
        let policy::Coefficients { a, b, c, r } = mapping.coefficients;
        Self {
            initial: Coefficients {
                a: T::nearest(a),
                b: T::nearest(b),
                c: T::nearest(c),
                r: r.map(T::nearest),
            },
            load_current: mapping.load_current,
            // to nearest, as the actions are: one at the end of the range is inside; what is accepted at run time is
            // rounded inwards, so that it lies in the interval as written
            valid_i_out: Range::nearest(mapping.valid_i_out),
            valid_d_sim: Range::nearest(mapping.valid_d_sim),
            adjust: [mapping.adjust_a, mapping.adjust_b, mapping.adjust_c, mapping.adjust_r].map(Range::inwards),
        }
    }

    /// What each coefficient may be set to, in the order of the state.
    pub fn adjustable(&self) -> impl Iterator<Item = Range<T>> {
        let count = if self.initial.r.is_some() { 4 } else { 3 };
        self.adjust.into_iter().take(count)
    }

    /// The duty for the plant from the duty `d` for the simulation at load current `i`.
    pub fn apply(coefficients: Coefficients<T>, d: T, i: T) -> T {
        let Coefficients { a, b, c, r } = coefficients;
        // every product and every sum is rounded by itself; Rust never makes one fused operation of them
        let mut t = a * d;
        t = t + b * i;
        t = t + c;
        if let Some(r) = r {
            t = t + (r * i) * d;
        }
        t
    }

    /// Whether `d` or `i` lies outside the validity range.
    pub fn outside(&self, d: T, i: T) -> bool {
        // not the negation of `contains`: a NaN is no extrapolation, its bit is STATE
        self.valid_d_sim.clamps(d) || self.valid_i_out.clamps(i)
    }

    /// Whether the coefficients may replace those in use. The form must stay: `r` if and only if there was one.
    pub fn accepts(&self, new: Coefficients<T>) -> bool {
        let [adjust_a, adjust_b, adjust_c, adjust_r] = self.adjust;
        let form_and_r = match (self.initial.r, new.r) {
            (None, None) => true,
            (Some(_), Some(r)) => {
                // the slope a + r i is a line in i: above 0 at both ends, it is above 0 between them
                let rises = |i: T| new.a + r * i > T::ZERO;
                adjust_r.contains(r) && rises(self.valid_i_out.lo) && rises(self.valid_i_out.hi)
            }
            _ => false,
        };
        form_and_r && adjust_a.contains(new.a) && adjust_b.contains(new.b) && adjust_c.contains(new.c)
    }
}

#[cfg(test)]
mod tests {
    use policy::Interval;

    use super::*;

    fn mapping(r: Option<f64>) -> Mapping<f32> {
        let interval = |low, high| Interval { low, high };
        Mapping::new(&policy::Mapping {
            coefficients: policy::Coefficients {
                a: 0.95,
                b: 0.002,
                c: 0.01,
                r,
            },
            load_current: 0,
            valid_i_out: interval(0.0, 10.0),
            valid_d_sim: interval(0.25, 0.75),
            adjust_a: interval(0.1, 1.2),
            adjust_b: interval(-0.1, 0.1),
            adjust_c: interval(-0.05, 0.05),
            adjust_r: interval(-0.3, 0.3),
            simulation: None,
        })
    }

    fn coefficients(a: f32, b: f32, c: f32, r: Option<f32>) -> Coefficients<f32> {
        Coefficients { a, b, c, r }
    }

    #[test]
    fn three_term_form_is_a_d_plus_b_i_plus_c() {
        // all exact in binary: 0.5 * 0.5 + 0.125 * 2 + 0.0625
        assert_eq!(Mapping::apply(coefficients(0.5, 0.125, 0.0625, None), 0.5, 2.0), 0.5625);
    }

    #[test]
    fn four_term_form_adds_r_i_d_last() {
        assert_eq!(
            Mapping::apply(coefficients(0.5, 0.125, 0.0625, Some(-0.25)), 0.5, 2.0),
            0.3125
        );
        // order of the sum: (big + 1) - big loses the one
        assert_eq!(
            Mapping::apply(coefficients(33_554_432.0, 1.0, -33_554_432.0, Some(0.0)), 1.0, 1.0),
            0.0
        );
    }

    #[test]
    fn ends_of_the_validity_range_are_inside() {
        let m = mapping(None);
        assert!(!m.outside(0.25, 0.0) && !m.outside(0.75, 10.0));
        assert!(m.outside(0.75_f32.next_up(), 5.0) && m.outside(0.5, -f32::from_bits(1)));
    }

    #[test]
    fn coefficients_are_accepted_within_their_intervals_only() {
        let m = mapping(None);
        assert!(m.accepts(coefficients(1.0, 0.0, 0.0, None)));
        // 0.1_f32 is above 0.1, 1.2_f32 is above 1.2: the lower end is inside, the upper end is not
        assert!(m.accepts(coefficients(0.1, 0.0, 0.0, None)));
        assert!(!m.accepts(coefficients(1.2, 0.0, 0.0, None)));
        assert!(m.accepts(coefficients(1.2_f32.next_down(), 0.0, 0.0, None)));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(!m.accepts(coefficients(bad, 0.0, 0.0, None)));
            assert!(!m.accepts(coefficients(1.0, bad, 0.0, None)));
            assert!(!m.accepts(coefficients(1.0, 0.0, bad, None)));
        }
    }

    #[test]
    fn four_term_coefficients_must_rise_with_the_duty_at_both_ends_of_the_current() {
        let m = mapping(Some(0.01));
        assert!(m.accepts(coefficients(1.0, 0.0, 0.0, Some(-0.09))));
        // 1 - 0.1 * 10 = 0 is not above 0; 1 - 0.25 * 10 < 0
        assert!(!m.accepts(coefficients(1.0, 0.0, 0.0, Some(-0.25))));
        assert!(!m.accepts(coefficients(1.0, 0.0, 0.0, Some(f32::NAN))));
        assert!(!m.accepts(coefficients(1.0, 0.0, 0.0, Some(0.31))));
    }

    #[test]
    fn the_form_of_the_mapping_cannot_change() {
        assert!(!mapping(None).accepts(coefficients(1.0, 0.0, 0.0, Some(0.0))));
        assert!(!mapping(Some(0.0)).accepts(coefficients(1.0, 0.0, 0.0, None)));
    }
}
