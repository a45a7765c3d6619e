//! How a page was made: the command line, and what it read.

use std::fmt::{self, Display};

use crate::error::ReportError;
use crate::markup::Markup;
use crate::page::Section;

/// Where the section goes, and the link of a picture. Who makes a page knows no command, and who knows it makes no page.
pub(crate) const SECTION: &str = "<!--how it was made-->\n";
pub(crate) const LINK: &str = "<!--its command-->\n";
/// Name of the section.
const MADE: &str = "made";
/// A command that is longer has a line for each of its options.
const LINE: usize = 72;

/// A command that can be typed: its words, quoted for a shell where they must be.
///
/// ```
/// let command = report::CommandLine::new("policyc diagnose").option("--model", "my plant.toml").flag("--settled", true);
/// assert_eq!(command.to_string(), "policyc diagnose --model 'my plant.toml' --settled");
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandLine {
    /// The first word or an option, with what belongs to it.
    parts: Vec<String>,
}

impl CommandLine {
    /// A command without arguments.
    pub fn new(command: impl Into<String>) -> Self {
        Self {
            parts: vec![command.into()],
        }
    }

    /// An argument without a name.
    #[must_use]
    pub fn argument(mut self, value: impl Display) -> Self {
        if let Some(last) = self.parts.last_mut() {
            last.push(' ');
            last.push_str(&quoted(&value.to_string()));
        }
        self
    }

    /// An option with its value.
    #[must_use]
    pub fn option(self, name: &str, value: impl Display) -> Self {
        self.flag(name, true).argument(value)
    }

    /// An option with all its values; nothing without one.
    #[must_use]
    pub fn options<V: Display>(self, name: &str, values: impl IntoIterator<Item = V>) -> Self {
        let mut values = values.into_iter().peekable();
        let is_given = values.peek().is_some();
        values.fold(self.flag(name, is_given), Self::argument)
    }

    /// An option without a value, if it is set.
    #[must_use]
    pub fn flag(mut self, name: &str, is_set: bool) -> Self {
        if is_set {
            self.parts.push(name.to_owned());
        }
        self
    }
}

impl Display for CommandLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let length: usize = self.parts.iter().map(|part| part.len() + 1).sum();
        let between = if length > LINE { " \\\n    " } else { " " };
        f.write_str(&self.parts.join(between))
    }
}

/// As a shell takes it for one word.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%*".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word.to_owned(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// The page `html` of [`Page::html`](crate::Page::html) with the command that makes it and what that read, by name and value. Every
/// picture then links to it. Paths are to be those that the user gave.
///
/// # Errors
/// None in practice: a table whose rows do not fit its columns.
pub fn made<K: Into<String>, V: Into<String>>(
    html: &str,
    command: &CommandLine,
    read: impl IntoIterator<Item = (K, V)>,
) -> Result<String, ReportError> {
    let section = Section::new("How this page was made")
        .code(command.to_string())
        .pairs(read);
    let mut out = Markup::default();
    section.whole(&mut out, &[("id", &MADE)], &mut 0)?;
    let link = format!("<a href=\"#{MADE}\">Its command.</a>\n");
    Ok(html.replacen(SECTION, &out.finish(), 1).replace(LINK, &link))
}
