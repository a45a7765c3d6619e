//! Where one side of a profile comes to the level at which its interval ends.

use super::{LEVEL, TWO_SIDED};

/// Values that are tried beside those of [`PLACES`] until one lies near the end of an interval. A flat curve is doubled, to more than 16
/// standard deviations; flatter still, the interval is said to reach the bound. A convention.
const FURTHER: usize = 4;
/// As near to [`TWO_SIDED`], in standard deviations, the curve between two values is a parabola for every purpose. A convention.
const NEAR: f64 = 0.35;
/// The curve on one side of the best value.
pub(super) struct Side {
    pub value: f64,
    /// 1 above the value, -1 below.
    pub sign: f64,
    pub range: [f64; 2],
    /// The farthest value known that costs less than [`LEVEL`], and its cost.
    pub inner: (f64, f64),
    /// The nearest that costs more, if one is known.
    pub outer: Option<(f64, f64)>,
}

impl Side {
    /// Where the cost comes to [`LEVEL`]. What is tried is added to the curve.
    // the parabola of the covariance alone would do where the curve is one; two parameters that do nearly the same follow each other along
    // a bent valley, and the curve is steeper on one side
    pub fn end(&mut self, curve: &mut Vec<(f64, f64)>, cost: &dyn Fn(f64) -> f64) -> f64 {
        for point in curve.iter() {
            self.learn(*point);
        }
        for _ in 0..FURTHER {
            let Some(next) = self.next() else { break };
            let point = (next, cost(next));
            curve.push(point);
            self.learn(point);
        }
        let (x, cost) = self.inner;
        match self.outer {
            Some(_) => self.crossing(),
            None if self.is_at_end(x) => x,
            // below a third of what one standard deviation costs, after all doublings: no data on this side
            None if cost > 0.3 => self.by_parabola().clamp(self.range[0], self.range[1]),
            None => self.range[usize::from(self.sign > 0.0)],
        }
    }

    fn distance(&self, x: f64) -> f64 {
        self.sign * (x - self.value)
    }

    fn is_at_end(&self, x: f64) -> bool {
        x <= self.range[0] && self.sign < 0.0 || x >= self.range[1] && self.sign > 0.0
    }

    fn learn(&mut self, (x, cost): (f64, f64)) {
        let is_before = |outer: (f64, f64)| self.distance(x) < self.distance(outer.0);
        if self.distance(x) <= 0.0 || !self.outer.is_none_or(is_before) {
            return;
        }
        match cost < LEVEL {
            true if self.distance(x) > self.distance(self.inner.0) => self.inner = (x, cost),
            true => {}
            false => self.outer = Some((x, cost)),
        }
        // a curve that rises and falls again ends where it first comes to the level
        if self.distance(self.inner.0) >= self.outer.map_or(f64::INFINITY, |outer| self.distance(outer.0)) {
            self.inner = (self.value, 0.0);
        }
    }

    /// The value to try next; none where the end is known well enough.
    fn next(&self) -> Option<f64> {
        let (x, cost) = self.inner;
        let Some(outer) = self.outer else {
            let next = (self.value + 2.0 * (x - self.value)).clamp(self.range[0], self.range[1]);
            return (!self.is_at_end(x) && next != x).then_some(next);
        };
        let is_near = TWO_SIDED - cost.sqrt() < NEAR || outer.1.sqrt() - TWO_SIDED < NEAR;
        let next = self.crossing();
        (!is_near && next != x && next != outer.0).then_some(next)
    }

    /// The parabola through the best value and the farthest one, carried to the level.
    fn by_parabola(&self) -> f64 {
        let (x, cost) = self.inner;
        self.value + (x - self.value) * (LEVEL / cost).sqrt()
    }

    /// Where the curve crosses the level: between two values that are not far from each other, else by the parabola, or between them where
    /// that leads beyond what is known to cost more.
    fn crossing(&self) -> f64 {
        let (x, cost) = self.inner;
        let Some((far, more)) = self.outer else {
            return self.by_parabola();
        };
        let is_wide = self.distance(far) > 2.0 * self.distance(x);
        let carried = self.by_parabola();
        if is_wide && cost > 0.0 && self.distance(carried) < self.distance(far) {
            return carried;
        }
        let (near, beyond) = (cost.sqrt(), more.sqrt());
        x + (far - x) * (TWO_SIDED - near) / (beyond - near)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{LEVEL, PLACES};
    use super::Side;

    /// The end of an interval around 0 of a curve whose covariance says 1.
    fn end(sign: f64, range: [f64; 2], outer: Option<(f64, f64)>, cost: &dyn Fn(f64) -> f64) -> (f64, usize) {
        let places = PLACES.map(|x| x.clamp(range[0], range[1]));
        let mut curve: Vec<(f64, f64)> = places.map(|x| (x, cost(x))).to_vec();
        let mut side = Side {
            value: 0.0,
            sign,
            range,
            inner: (0.0, 0.0),
            outer,
        };
        let found = side.end(&mut curve, cost);
        (found, curve.len() - places.len())
    }

    #[test]
    fn an_interval_ends_where_the_cost_comes_to_the_level_whatever_the_curve() {
        const WIDE: [f64; 2] = [-100.0, 100.0];
        let level = LEVEL.sqrt();
        for sign in [-1.0, 1.0] {
            let (found, tried) = end(sign, WIDE, None, &|x| x * x);
            assert!((found - sign * level).abs() < 0.01 && tried == 0, "{found}, {tried}");
            // steeper on the far side of one standard deviation, as where another parameter is at its end
            let bent = |x: f64| x * x + 30.0 * (x.abs() - 1.0).max(0.0).powi(2);
            let (found, _) = end(sign, WIDE, None, &bent);
            assert!((bent(found) - LEVEL).abs() < 0.6, "{found}: {}", bent(found));
            // flatter than at its lowest point
            let flat = |x: f64| 0.02 * x * x;
            let (found, _) = end(sign, WIDE, None, &flat);
            assert!((flat(found) - LEVEL).abs() < 0.1, "{found}");
            let (found, _) = end(sign, WIDE, None, &|x| 1e-9 * x.abs());
            assert_eq!(found, 100.0 * sign);
            let (found, _) = end(sign, [-1.5, 1.5], None, &|x| x * x);
            assert_eq!(found, 1.5 * sign, "cut off");
        }
        // without the cause chi-square is far worse, which says nothing of how flat the curve is beside the value
        let (found, _) = end(-1.0, WIDE, Some((-30.0, 1e6)), &|x| x * x);
        assert!((found + level).abs() < 0.01, "{found}");
        // ... and where the curve is flat all the way, the interval ends before it
        let (found, _) = end(-1.0, WIDE, Some((-3.0, 20.0)), &|x| 0.1 * x * x);
        assert!(found > -3.0 && found < -1.3, "{found}");
    }
}
