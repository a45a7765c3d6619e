//! `include_policy!()`: a trained policy as a `no_std` controller in a firmware crate.
//!
//! ```ignore
//! policy_macro::include_policy!("policy/policy.toml");              // mod buck12 with buck12::Controller
//! policy_macro::include_policy!(pub Regulator = "policy/policy.toml"); // pub mod buck12 with buck12::Regulator
//! policy_macro::include_policy!("policy/policy.toml", target = "cortex-m4f"); // loops cut for that processor
//! ```

mod expand;

use proc_macro::TokenStream;

/// Expands to a module named after the policy, with `Measurement`, `Command`, `status` and the controller type.
///
/// `include_policy!([visibility] [Type =] "path/policy.toml" [, target = "name"])`. The path is relative to the crate's manifest folder and
/// must stay inside it, as must the files that the policy names. The crate is rebuilt when one of them changes.
///
/// `target` is a name of `policyc targets`. Any processor computes the same bits from the code of any target; its own is
/// faster. A macro cannot see what cargo compiles for, so without it the code is that of the target `host`.
///
/// The code needs `core` only: no allocation, no unsafe code, no panic. `Type::new()` is `const`.
///
/// # Errors
/// One `compile_error!` at the path with every fault of the policy.
#[proc_macro]
pub fn include_policy(input: TokenStream) -> TokenStream {
    expand::expand(input.into()).into()
}
