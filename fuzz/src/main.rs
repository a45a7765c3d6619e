//! `cargo run --profile fuzz -p fuzz -- --help`

use std::process::ExitCode;

fn main() -> ExitCode {
    fuzz::parent::main()
}
