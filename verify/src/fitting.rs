//! Which network would fit into a control period. Nothing is reckoned: the policy's own network is cut to size, built and
//! counted under the target's emulator.

use codegen::Output;
use codegen::output::languages;
use policy::Policy;
use policy::activation::Activation;
use targets::TargetSpec;

use crate::budget::{Budget, Clock};
use crate::measure::measure;
use crate::session::Files;
use crate::toolchain::{self, Build};

/// Hidden layers are cut to multiples of this: the loops of the generated code take as many rows at once.
const STEP: usize = 4;

/// A network in a build.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitting {
    /// Inputs, then neurons of each layer.
    pub sizes: Vec<usize>,
    /// Least and largest share of the control period that the model says; where there is none, what one instruction a cycle takes, twice.
    pub share: (f64, f64),
}

/// Where networks are tried: one build of one format.
#[derive(Debug, Clone, Copy)]
pub struct Bench<'a> {
    /// The processor.
    pub target: &'static TargetSpec,
    /// What is generated.
    pub outputs: &'a [Output],
    /// Name of the build, as [`Build::name`] says it.
    pub build: &'a str,
    /// Clock of the processor.
    pub clock: Clock,
}

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub enum Widest {
    /// The widest network that fits.
    Fits(Fitting),
    /// Not even four neurons in each hidden layer fit.
    None,
    /// There is nothing to cut, or one of the networks could not be built and counted.
    Unknown,
}

impl Bench<'_> {
    /// The policy with its hidden layers cut to the largest width that fits. The policy as it is does not.
    #[must_use]
    pub fn widest(&self, policy: &Policy) -> Widest {
        let most = policy.widest_hidden();
        if most <= STEP {
            return Widest::Unknown;
        }
        let tried = |steps: usize| {
            let cut = policy.cut_to(steps * STEP)?;
            let share = self.share(&cut)?;
            Some(Fitting {
                sizes: sizes(&cut),
                share,
            })
        };
        let mut best = None;
        // a wider network takes longer, so the widest that fits lies between these two
        let (mut fitting, mut missing) = (0, most.div_ceil(STEP));
        while missing > fitting + 1 {
            // the smallest first: where not even that fits, nothing else is tried
            let middle = if fitting == 0 { 1 } else { fitting.midpoint(missing) };
            match tried(middle) {
                None => return Widest::Unknown,
                Some(found) if found.share.1 <= 1.0 => (best, fitting) = (Some(found), middle),
                Some(_) => missing = middle,
            }
        }
        best.map_or(Widest::None, Widest::Fits)
    }

    /// The share with ReLU in the place of an activation that is a formula; `None` where there is none such, or where it cannot
    /// be counted.
    #[must_use]
    pub fn with_relu(&self, policy: &Policy) -> Option<(f64, f64)> {
        let is_formula = |layer: &policy::model::Layer| layer.activation.curve().is_some();
        if !policy.layers.iter().any(is_formula) {
            return None;
        }
        self.share(&policy.activated_by(Activation::Relu)?)
    }

    /// What a step takes, as [`Fitting::share`]; `None` where it cannot be built or does not run here.
    fn share(&self, policy: &Policy) -> Option<(f64, f64)> {
        let cores: Vec<Output> = languages(self.outputs).iter().map(|language| language.core()).collect();
        let files = codegen::sources(policy, self.target, &cores, None).ok()?.files;
        let build = self.find(policy, &files)?;
        let costs = measure(policy, self.target, &files, &build).ok()?;
        if self.target.cycles.is_none() {
            let cycles = self.clock.hz * policy.sample_period * self.clock.slot.part();
            let share = costs.instructions_max as f64 / cycles;
            return Some((share, share));
        }
        Budget::of(&costs, self.clock, policy.sample_period).map(|budget| budget.share)
    }

    fn find(&self, policy: &Policy, files: &Files) -> Option<Build> {
        let plain = toolchain::builds(self.target, &[], &[]).into_iter();
        let mut each = plain.flat_map(|build| [build.with_assembly(policy, self.target, files), Some(build)]);
        each.find_map(|build| build.filter(|build| build.name() == self.build))
    }
}

fn sizes(policy: &Policy) -> Vec<usize> {
    let outputs = policy.layers.iter().map(|layer| layer.outputs);
    std::iter::once(policy.features.len()).chain(outputs).collect()
}
