//! include_policy!(): a trained policy as a no_std controller.
