//! `buck12.rs` in `OUT_DIR`.

fn main() -> Result<(), policy_build::Error> {
    policy_build::Build::new("../../buck12/policy.toml").rust()
}
