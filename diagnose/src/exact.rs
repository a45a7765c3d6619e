//! Functions whose bits are the same on every machine: those of a platform differ in the last one, and with it a report.

/// What `std` takes from the platform.
pub(crate) trait Exact {
    /// The root of the sum of two squares.
    fn hypotenuse(self, other: Self) -> Self;
}

impl Exact for f64 {
    fn hypotenuse(self, other: f64) -> f64 {
        libm::hypot(self, other)
    }
}
