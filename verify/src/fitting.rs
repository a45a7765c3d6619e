//! Which network would fit into a control period. Nothing is reckoned: the policy's own network is cut to size, built and
//! counted under the target's emulator.

use codegen::output::languages;
use codegen::{CodegenError, Output};
use policy::Policy;
use policy::activation::{Activation, Shape};
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
    /// Least and largest share of the control period that the model says.
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

impl Bench<'_> {
    /// The policy with its hidden layers cut to the largest width that fits; `None` if not even [`STEP`] neurons do.
    ///
    /// # Errors
    /// If code for a smaller network cannot be generated.
    pub fn widest(&self, policy: &Policy) -> Result<Option<Fitting>, CodegenError> {
        let fits = |steps: usize| -> Result<Option<Fitting>, CodegenError> {
            let Some(cut) = policy.cut_to(steps * STEP) else {
                return Ok(None);
            };
            let fitting = self.share(&cut)?.filter(|share| share.1 <= 1.0);
            Ok(fitting.map(|share| Fitting {
                sizes: sizes(&cut),
                share,
            }))
        };
        let Some(mut best) = fits(1)? else { return Ok(None) };
        // a wider network takes longer, so the widest that fits lies between these two
        let (mut fitting, mut missing) = (1, policy.widest_hidden().div_ceil(STEP));
        while missing > fitting + 1 {
            let middle = fitting.midpoint(missing);
            match fits(middle)? {
                Some(found) => (best, fitting) = (found, middle),
                None => missing = middle,
            }
        }
        Ok(Some(best))
    }

    /// The share with ReLU in the place of an activation that is a formula; `None` where there is none such.
    ///
    /// # Errors
    /// If its code cannot be generated.
    pub fn with_relu(&self, policy: &Policy) -> Result<Option<(f64, f64)>, CodegenError> {
        let is_formula = |layer: &policy::model::Layer| matches!(layer.activation.shape(), Shape::Sigmoid(_));
        if !policy.layers.iter().any(is_formula) {
            return Ok(None);
        }
        match policy.activated_by(Activation::Relu) {
            Some(policy) => self.share(&policy),
            None => Ok(None),
        }
    }

    /// What a step takes; `None` where it does not run here.
    fn share(&self, policy: &Policy) -> Result<Option<(f64, f64)>, CodegenError> {
        let cores: Vec<Output> = languages(self.outputs).iter().map(|language| language.core()).collect();
        let files = codegen::sources(policy, self.target, &cores, None)?.files;
        let costs = self
            .find(policy, &files)
            .and_then(|build| measure(policy, self.target, &files, &build).ok());
        let budget = costs.and_then(|costs| Budget::of(&costs, self.clock, policy.sample_period));
        Ok(budget.map(|budget| budget.share))
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
