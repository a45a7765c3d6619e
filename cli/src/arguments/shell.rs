//! The command lines of what an installation asks for once, and of the page.

use std::path::PathBuf;

use clap::Args;
use clap_complete::Shell;

use crate::one_of::OneOf;
use crate::ownership::Replacing;

#[derive(Debug, Args)]
pub struct Completions {
    /// The shell
    #[arg(value_parser = shell())]
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct Manpages {
    /// Folder for policyc.1 and a page for each command, such as policyc-drm-fit.1; made if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub replacing: Replacing,
}

#[derive(Debug, Args)]
pub struct Studio {
    /// Write the page into this folder, as a static site, instead of serving it
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub replacing: Replacing,
    /// Port on 127.0.0.1; without it a free one
    #[arg(
        long,
        value_name = "PORT",
        default_value_t = 0,
        hide_default_value = true,
        conflicts_with = "out"
    )]
    pub port: u16,
    /// A page that `cargo xtask studio` has made, in the place of the one inside this program
    #[arg(long, value_name = "DIR")]
    pub from: Option<PathBuf>,
}

/// Reads the name of a shell.
fn shell() -> OneOf<Shell> {
    OneOf::new(
        "shell",
        [
            (
                "bash",
                "to be sourced, or put into its folder of completions",
                Shell::Bash,
            ),
            ("zsh", "a file `_policyc` in a folder of `fpath`", Shell::Zsh),
            ("fish", "a file of its folder of completions", Shell::Fish),
            ("powershell", "a part of the profile", Shell::PowerShell),
            ("elvish", "a part of rc.elv", Shell::Elvish),
        ],
    )
}
