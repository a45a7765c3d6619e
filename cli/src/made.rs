//! The command line of this thread, for the pages that its command makes: as it was typed, but where the answer goes and how it is
//! said, so that two runs of one command make one page.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::OsString;

use report::CommandLine;

use crate::failure::Failure;

thread_local! {
    // a thread's own: the wheel runs commands in several
    static TYPED: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// Options that change no page: with a value, and without one.
const WITH_VALUE: [&str; 4] = ["--out", "--report", "--threads", "--color"];
const WITHOUT_VALUE: [&str; 7] = ["--force", "--json", "--resume", "-q", "--quiet", "-v", "--verbose"];

/// Options with their values.
pub type Out<'a> = &'a [(&'a str, &'a str)];

/// From here on the command line is this one, behind the program's name.
pub fn heed(arguments: impl IntoIterator<Item = OsString>) {
    let words = arguments.into_iter().map(|word| word.to_string_lossy().into_owned());
    TYPED.with(|typed| *typed.borrow_mut() = words.collect());
}

/// Puts the command and its inputs on every page among the files. `out` are the options that say where it writes, with names that could
/// be anybody's.
///
/// # Errors
/// None in practice.
pub fn signed(
    files: &mut BTreeMap<String, String>,
    out: Out<'_>,
    read: &[(&'static str, String)],
) -> Result<(), Failure> {
    let pages = files.iter_mut().filter(|(name, _)| name.ends_with(".html"));
    for (_, page) in pages {
        *page = signed_page(page, out, read)?;
    }
    Ok(())
}

/// [`signed`] for one page.
///
/// # Errors
/// None in practice.
pub fn signed_page(page: &str, out: Out<'_>, read: &[(&'static str, String)]) -> Result<String, Failure> {
    let command = TYPED.with(|typed| command(&typed.borrow(), out));
    match command {
        Some(command) => Ok(report::made(page, &command, read.to_vec())?),
        None => Ok(page.to_owned()),
    }
}

fn command(typed: &[String], out: Out<'_>) -> Option<CommandLine> {
    let mut words = typed.iter().map(String::as_str);
    let mut name = format!("policyc {}", words.next()?);
    if name == "policyc drm" {
        name = format!("{name} {}", words.next()?);
    }
    let mut command = CommandLine::new(name);
    while let Some(word) = words.next() {
        let is_left_out = |option: &&str| word.strip_prefix(*option).is_some_and(|rest| rest.starts_with('='));
        if WITH_VALUE.contains(&word) {
            words.next();
        } else if !WITHOUT_VALUE.contains(&word) && !WITH_VALUE.iter().any(is_left_out) {
            command = match word.starts_with("--") {
                true => command.flag(word, true),
                false => command.argument(word),
            };
        }
    }
    Some(
        out.iter()
            .fold(command, |command, (name, value)| command.option(name, value)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_the_command_but_where_it_writes_and_how_it_speaks() {
        let typed = "drm fit my.csv --out /somewhere/else.toml --terms 3 --json --report=/tmp/a.html -q";
        let typed: Vec<String> = typed.split(' ').map(str::to_owned).collect();
        let command = command(&typed, &[("--out", "drm.toml")]).expect("a command");
        assert_eq!(command.to_string(), "policyc drm fit my.csv --terms 3 --out drm.toml");
    }
}
