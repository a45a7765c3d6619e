//! Adam (Kingma and Ba, 2015, algorithm 1) and clipping by the global norm, both as PyTorch has them.

/// What Adam is told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdamSettings {
    /// Decay of the mean of gradients.
    pub beta1: f64,
    /// Decay of the mean of squared gradients.
    pub beta2: f64,
    /// Added to the root of the squared mean.
    pub epsilon: f64,
}

impl Default for AdamSettings {
    fn default() -> Self {
        Self {
            // those of Kingma and Ba, and PyTorch's
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
        }
    }
}

/// Adam's memory for one parameter vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Adam {
    settings: AdamSettings,
    /// Number of updates made.
    pub steps: u64,
    /// Running mean of the gradient.
    pub mean: Vec<f32>,
    /// Running mean of its square.
    pub square: Vec<f32>,
}

impl Adam {
    /// Memory for `length` parameters.
    #[must_use]
    pub fn new(length: usize, settings: AdamSettings) -> Self {
        Self {
            settings,
            steps: 0,
            mean: vec![0.0; length],
            square: vec![0.0; length],
        }
    }

    /// One update of `parameters` against `gradient`.
    pub fn update(&mut self, parameters: &mut [f32], gradient: &[f32], learning_rate: f64) {
        self.steps += 1;
        let AdamSettings { beta1, beta2, epsilon } = self.settings;
        // powers by repeated squaring: the same on every machine, unlike powf
        // at `i32::MAX` updates both powers are 0 for every beta that is allowed
        let steps = i32::try_from(self.steps).unwrap_or(i32::MAX);
        let rate = (learning_rate / (1.0 - power(beta1, steps))) as f32;
        let root = (1.0 / (1.0 - power(beta2, steps)).sqrt()) as f32;
        let (beta1, beta2, epsilon) = (beta1 as f32, beta2 as f32, epsilon as f32);
        let memory = self.mean.iter_mut().zip(&mut self.square);
        for ((parameter, &g), (mean, square)) in parameters.iter_mut().zip(gradient).zip(memory) {
            *mean = beta1 * *mean + (1.0 - beta1) * g;
            *square = beta2 * *square + (1.0 - beta2) * (g * g);
            *parameter -= rate * *mean / (square.sqrt() * root + epsilon);
        }
    }
}

fn power(base: f64, exponent: i32) -> f64 {
    let (mut result, mut square, mut rest) = (1.0, base, exponent);
    while rest > 0 {
        if rest & 1 == 1 {
            result *= square;
        }
        square *= square;
        rest >>= 1;
    }
    result
}

/// Scales `gradient` so that its Euclidean norm is at most `limit`; returns the norm before.
pub fn clip(gradient: &mut [f32], limit: f64) -> f64 {
    // eight sums side by side: one alone would wait for itself
    let mut sums = [0.0_f32; 8];
    let chunks = gradient.chunks_exact(8);
    let rest: f32 = chunks.remainder().iter().map(|g| g * g).sum();
    for chunk in chunks {
        for (sum, g) in sums.iter_mut().zip(chunk) {
            *sum += g * g;
        }
    }
    let norm = f64::from(sums.iter().sum::<f32>() + rest).sqrt();
    // 1e-6 is PyTorch's, whose updates the tests compare with
    let factor = limit / (norm + 1e-6);
    if factor < 1.0 {
        for g in gradient {
            *g *= factor as f32;
        }
    }
    norm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_update_moves_every_parameter_by_the_learning_rate() {
        let mut adam = Adam::new(3, AdamSettings::default());
        let mut parameters = [1.0, 1.0, 1.0];
        adam.update(&mut parameters, &[0.5, -20.0, 0.0], 1e-2);
        for (parameter, expected) in parameters.iter().zip([0.99, 1.01, 1.0]) {
            assert!((parameter - expected).abs() < 1e-6, "{parameters:?}");
        }
    }

    #[test]
    fn clipping_keeps_the_direction_and_small_gradients() {
        let mut gradient: Vec<f32> = (0..19).map(|n| n as f32 - 9.0).collect();
        let before = gradient.clone();
        let norm = clip(&mut gradient, 1.0);
        assert!((norm - 570.0_f64.sqrt()).abs() < 1e-4, "{norm}");
        for (after, before) in gradient.iter().zip(&before) {
            assert!((f64::from(*after) * norm - f64::from(*before)).abs() < 1e-4);
        }
        let mut small = [0.1, -0.2];
        clip(&mut small, 1.0);
        assert_eq!(small, [0.1, -0.2]);
    }
}
