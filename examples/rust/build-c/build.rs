//! `buck12_ffi.rs` in `OUT_DIR`, and the compiled C behind it.

fn main() -> Result<(), policy_build::Error> {
    policy_build::Build::new("../../buck12/policy.toml").c()
}
