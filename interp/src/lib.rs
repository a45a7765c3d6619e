//! Reference interpreter of a policy, written from the numeric contract.
