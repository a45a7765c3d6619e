//! Which network would fit into a control period. Nothing is reckoned: the policy's own network is cut to size, built and
//! counted under the target's emulator.
//!
//! ```text
//!   layers as they are      f32: 4, then bisected ─► the widest that fits ─┐ the next format
//!                           i16: one step more than that, ... ◄────────────┘ has to be wider
//!   none in any format:     the same with a hidden layer fewer
//! ```

use codegen::Output;
use codegen::output::languages;
use policy::{NumericFormat, Policy, Scalar};
use targets::TargetSpec;

use crate::budget::{Budget, Clock, SCARCE};
use crate::measure::measure;
use crate::session::Files;
use crate::toolchain::{self, Build};

/// Hidden layers are cut to multiples of this: the loops of the generated code take as many rows at once.
const STEP: usize = 4;

/// Builds that are made at the same time. The same number on every machine, or another build could be named there.
const AT_ONCE: usize = 2;

/// Beyond this share in the builds that are fastest for the whole network the others are not tried: with small networks the order
/// changes, but by a few percent.
const FAR: f64 = 1.25;

/// A network in a build.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitting {
    /// Inputs, then neurons of each layer.
    pub sizes: Vec<usize>,
    /// Format of its numbers.
    pub format: NumericFormat,
    /// Name of the build, as [`Build::name`] says it.
    pub build: String,
    /// Least and largest share of the control period that the model says; where there is none, what one instruction a cycle takes, twice.
    pub share: (f64, f64),
}

impl Fitting {
    /// Whether it fits and leaves room for interrupt entry. The room is also what weights move: a constant of another size takes
    /// another instruction, so that of two networks of a size one can fit to the cycle and the other not.
    #[must_use]
    pub fn fits(&self) -> bool {
        self.share.1 <= 1.0 - SCARCE
    }

    fn nearer(found: Option<Self>, other: Self) -> Option<Self> {
        match found {
            Some(found) if found.share.1 <= other.share.1 => Some(found),
            _ => Some(other),
        }
    }
}

/// A format in which networks are tried.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Of the numbers.
    pub format: NumericFormat,
    /// Names of the builds, the one first that takes the whole network fastest.
    pub builds: Vec<String>,
    /// What that build takes of the whole network: any measure that grows with the time.
    pub takes: f64,
}

impl Candidate {
    /// Name of the fastest build.
    #[must_use]
    pub fn build(&self) -> &str {
        self.builds.first().map_or("", String::as_str)
    }
}

/// Where networks are tried.
#[derive(Debug, Clone, Copy)]
pub struct Bench<'a> {
    /// The processor.
    pub target: &'static TargetSpec,
    /// What is generated.
    pub outputs: &'a [Output],
    /// Clock of the processor.
    pub clock: Clock,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub enum Widest {
    /// The widest network that fits.
    Fits(Fitting),
    /// Not even four neurons in each hidden layer fit, nor in fewer layers: the nearest of the smallest networks, and the formats.
    None(Fitting, Vec<NumericFormat>),
    /// There is nothing to cut, or none of the networks could be built and counted.
    Unknown,
}

impl Bench<'_> {
    /// The policy with its hidden layers cut to the largest width that fits in one of the formats, in any of its builds; with hidden
    /// layers left out where no width does. Of formats that take the same width the first of `candidates` is named. The policy as it
    /// is fits in none.
    #[must_use]
    pub fn widest(&self, policy: &Policy, candidates: &[Candidate]) -> Widest {
        let sensible: Vec<&Candidate> = self.sensible(candidates);
        let most = policy.widest_hidden();
        let mut nearest = None;
        // the policy as it is has this width and does not fit; with a layer less it may
        let mut missing = most.div_ceil(STEP);
        let mut cut = Some(policy.clone());
        while let Some(policy) = cut {
            let mut best: Option<(usize, Fitting)> = None;
            for candidate in &sensible {
                let from = best.as_ref().map_or(1, |(width, _)| width + 1);
                let policy = policy.clone().with_format(candidate.format);
                let found = self.widest_of(&policy, candidate, from..missing, &mut nearest);
                best = found.or(best);
            }
            if let Some((_, fitting)) = best {
                return Widest::Fits(fitting);
            }
            missing = most.div_ceil(STEP) + 1;
            cut = policy.without_a_hidden_layer();
        }
        let formats = sensible.iter().map(|candidate| candidate.format).collect();
        nearest.map_or(Widest::Unknown, |nearest| Widest::None(nearest, formats))
    }

    /// Those that can be the best for a small network: floats where they are computed in hardware, for there they need no scaling
    /// between the layers; of the integers the more exact where the other is no faster. No model knows fused operations.
    fn sensible<'c>(&self, candidates: &'c [Candidate]) -> Vec<&'c Candidate> {
        let in_hardware = |format: NumericFormat| match format {
            NumericFormat::F32Fma => false,
            _ => format.is_integer() || self.target.fpu.has(format.scalar() == Scalar::F64),
        };
        let is_beaten = |one: &Candidate| {
            one.format == NumericFormat::I8
                && candidates
                    .iter()
                    .any(|other| other.format == NumericFormat::I16 && other.takes <= one.takes)
        };
        candidates
            .iter()
            .filter(|candidate| in_hardware(candidate.format) && !is_beaten(candidate))
            .collect()
    }

    /// The largest number of steps among `steps` that fits, and the network.
    fn widest_of(
        &self,
        policy: &Policy,
        candidate: &Candidate,
        steps: std::ops::Range<usize>,
        nearest: &mut Option<Fitting>,
    ) -> Option<(usize, Fitting)> {
        let mut best: Option<(usize, Fitting)> = None;
        let mut missing = steps.end;
        // a wider network takes longer, so the widest that fits lies between these two
        while missing > best.as_ref().map_or(steps.start, |(fitting, _)| fitting + 1) {
            // the smallest first: where not even that fits, nothing else is tried
            let middle = best
                .as_ref()
                .map_or(steps.start, |(fitting, _)| fitting.midpoint(missing));
            let cut = policy.cut_to(middle * STEP);
            let Some(found) = cut.and_then(|cut| self.fastest(&cut, candidate)) else {
                break;
            };
            if found.fits() {
                best = Some((middle, found));
            } else if best.is_none() {
                if middle == 1 {
                    *nearest = Fitting::nearer(nearest.take(), found);
                }
                return None;
            } else {
                missing = middle;
            }
        }
        best
    }

    /// The build that takes a network fastest, of those that are tried until one fits; `None` if none can be counted.
    fn fastest(&self, policy: &Policy, candidate: &Candidate) -> Option<Fitting> {
        let mut fastest: Option<Fitting> = None;
        for builds in candidate.builds.chunks(AT_ONCE) {
            let shares: Vec<Option<(f64, f64)>> = std::thread::scope(|scope| {
                let started: Vec<_> = builds
                    .iter()
                    .map(|build| scope.spawn(move || self.share(policy, build)))
                    .collect();
                started.into_iter().map(|share| share.join().ok().flatten()).collect()
            });
            for (build, share) in builds.iter().zip(shares) {
                let Some(share) = share else { continue };
                let found = Fitting {
                    sizes: sizes(policy),
                    format: policy.numeric_format,
                    build: build.clone(),
                    share,
                };
                fastest = Fitting::nearer(fastest, found);
            }
            if fastest
                .as_ref()
                .is_some_and(|found| found.fits() || found.share.1 > FAR)
            {
                break;
            }
        }
        fastest
    }

    /// The format and the build that take the policy fastest, as wide as it is; `None` where it cannot be counted.
    fn whole(&self, policy: &Policy, candidates: &[Candidate]) -> Option<Fitting> {
        let found = self.sensible(candidates).into_iter().filter_map(|candidate| {
            let policy = policy.clone().with_format(candidate.format);
            self.fastest(&policy, candidate)
        });
        found.fold(None, Fitting::nearer)
    }

    /// The policy with ReLU, and what it would take as wide as it is.
    #[must_use]
    pub fn retrained(&self, policy: &Policy, candidates: &[Candidate]) -> Retrained {
        let relu = with_relu(policy);
        Retrained {
            whole: relu.as_ref().and_then(|relu| self.whole(relu, candidates)),
            with: if relu.is_some() { " with relu" } else { "" },
            relu,
        }
    }

    /// What a step takes, as [`Fitting::share`]; `None` where it cannot be built or does not run here.
    fn share(&self, policy: &Policy, build: &str) -> Option<(f64, f64)> {
        let cores: Vec<Output> = languages(self.outputs).iter().map(|language| language.core()).collect();
        let files = codegen::sources(policy, self.target, &cores, None).ok()?.files;
        let build = self.find(policy, &files, build)?;
        let costs = measure(policy, self.target, &files, &build).ok()?;
        if self.target.cycles.is_none() {
            let cycles = self.clock.hz * policy.sample_period * self.clock.slot.part();
            let share = costs.instructions_max as f64 / cycles;
            return Some((share, share));
        }
        Budget::of(&costs, self.clock, policy.sample_period).map(|budget| budget.share)
    }

    fn find(&self, policy: &Policy, files: &Files, name: &str) -> Option<Build> {
        let plain = toolchain::builds(self.target, &[], &[]).into_iter();
        let mut each = plain.flat_map(|build| [build.with_assembly(policy, self.target, files), Some(build)]);
        each.find_map(|build| build.filter(|build| build.name() == name))
    }
}

/// What a policy becomes for one who trains it again, and may choose the activation then.
#[derive(Debug)]
pub struct Retrained {
    /// With ReLU, where the activation is a formula.
    relu: Option<Policy>,
    /// What that takes; `None` where it cannot be counted.
    pub whole: Option<Fitting>,
    /// Said of it.
    pub with: &'static str,
}

impl Retrained {
    /// The network that is cut down, `policy` as it is if its activation is no formula.
    #[must_use]
    pub fn or<'a>(&'a self, policy: &'a Policy) -> &'a Policy {
        self.relu.as_ref().unwrap_or(policy)
    }
}

/// The policy with ReLU in the place of an activation that is a formula; `None` where there is none such.
fn with_relu(policy: &Policy) -> Option<Policy> {
    let is_formula = |layer: &policy::model::Layer| layer.activation.curve().is_some();
    let has_formula = policy.layers.iter().any(is_formula);
    has_formula.then(|| policy.activated_by(policy::Activation::Relu))?
}

fn sizes(policy: &Policy) -> Vec<usize> {
    let outputs = policy.layers.iter().map(|layer| layer.outputs);
    std::iter::once(policy.features.len()).chain(outputs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leaves_no_room_for_interrupt_entry_does_not_fit() {
        let fits = |most: f64| {
            let fitting = Fitting {
                sizes: vec![6, 4, 1],
                format: NumericFormat::F32,
                build: String::new(),
                share: (0.7, most),
            };
            fitting.fits()
        };
        assert!(fits(0.99) && !fits(0.9995) && !fits(1.002));
    }

    #[test]
    fn floats_are_tried_where_there_is_an_fpu_and_8_bits_where_they_are_faster() {
        let formats = |target: &str, takes: [f64; 4]| -> Vec<NumericFormat> {
            let formats = [
                NumericFormat::F32Fma,
                NumericFormat::F32,
                NumericFormat::I16,
                NumericFormat::I8,
            ];
            let candidates = formats.into_iter().zip(takes).map(|(format, takes)| Candidate {
                format,
                builds: Vec::new(),
                takes,
            });
            let candidates: Vec<Candidate> = candidates.collect();
            let bench = Bench {
                target: targets::find(target).unwrap(),
                outputs: &[],
                clock: Clock::parse("100MHz").unwrap(),
            };
            let sensible = bench.sensible(&candidates);
            sensible.iter().map(|candidate| candidate.format).collect()
        };
        let alike = [7.0, 7.0, 4.0, 4.0];
        assert_eq!(formats("cortex-m4f", alike), [NumericFormat::F32, NumericFormat::I16]);
        assert_eq!(formats("cortex-m0plus", alike), [NumericFormat::I16]);
        let faster = [7.0, 7.0, 4.0, 3.0];
        assert_eq!(
            formats("cortex-m0plus", faster),
            [NumericFormat::I16, NumericFormat::I8]
        );
    }
}
