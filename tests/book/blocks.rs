//! The fenced blocks of a page, by the conventions that `docs/install.md` tells the reader.

use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};

/// What a block asks for.
#[derive(Debug, PartialEq)]
pub enum Kind {
    /// A file of this name, written where the reader is.
    File(String),
    /// Commands that end with this code.
    Commands { exit: i32 },
    /// Commands that cannot be run here, and why.
    NotTested { reason: String },
    /// Lines that the commands before must have printed.
    Shown,
}

/// A block that means something to the test.
#[derive(Debug, PartialEq)]
pub struct Block {
    /// Line of its first line in the page, from 1.
    pub line: usize,
    pub kind: Kind,
    pub text: String,
    /// A program or a target of Rust without which the block is left out.
    pub needs: Option<String>,
}

/// The page, relative to the root, where the reader of this one comes from: its files and commands are there already.
pub fn continues(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once("<!-- continues: ")?;
    rest.split_once(" -->").map(|(path, _)| path)
}

/// The blocks of a page, first to last.
///
/// # Errors
/// Lines and what is wrong there: an attribute that nobody knows, commands that the test would pass over.
pub fn read(page: &str) -> Result<Vec<Block>, Vec<String>> {
    let (mut blocks, mut faults) = (Vec::new(), Vec::new());
    let mut open: Option<(usize, Option<String>, String)> = None;
    let mut left_out: Option<String> = None;
    for (event, range) in Parser::new_ext(page, pulldown_cmark::Options::ENABLE_TABLES).into_offset_iter() {
        match event {
            Event::Start(Tag::CodeBlock(kind)) => {
                let info = match kind {
                    CodeBlockKind::Fenced(info) => Some(info.into_string()),
                    CodeBlockKind::Indented => None,
                };
                let fence = usize::from(info.is_some());
                open = Some((
                    page[..range.start].matches('\n').count() + 1 + fence,
                    info,
                    String::new(),
                ));
            }
            // a comment that a reader does not see, directly before its block
            Event::Html(comment) => left_out = reason(&comment),
            Event::Start(Tag::HtmlBlock) | Event::End(TagEnd::HtmlBlock) => {}
            Event::Start(_) => left_out = None,
            Event::Text(part) => {
                if let Some((_, _, text)) = &mut open {
                    text.push_str(&part);
                }
            }
            Event::End(TagEnd::CodeBlock) => {
                let Some((line, info, text)) = open.take() else {
                    continue;
                };
                match block(line, info.as_deref().unwrap_or_default(), text, left_out.take()) {
                    Ok(found) => blocks.extend(found),
                    Err(fault) => faults.push(format!("{line}: {fault}")),
                }
            }
            _ => {}
        }
    }
    let is_answered = |pair: &[Block]| pair[1].kind != Kind::Shown || matches!(pair[0].kind, Kind::Commands { .. });
    if let Some(pair) = blocks.windows(2).find(|pair| !is_answered(pair)) {
        faults.push(format!(
            "{}: nothing has been run that could have printed this",
            pair[1].line
        ));
    }
    if faults.is_empty() { Ok(blocks) } else { Err(faults) }
}

/// The reason in `<!-- not tested: REASON -->`.
fn reason(comment: &str) -> Option<String> {
    let rest = comment.trim().strip_prefix("<!-- not tested:")?;
    rest.strip_suffix("-->").map(|reason| reason.trim().to_owned())
}

fn block(line: usize, info: &str, text: String, left_out: Option<String>) -> Result<Option<Block>, String> {
    let mut words = info.split(',').map(str::trim);
    let language = words.next().unwrap_or_default();
    let attributes: Vec<&str> = words.collect();
    let first = text.lines().next().unwrap_or_default();
    let remark = |key: &str| first.strip_prefix(key).map(|rest| rest.trim().to_owned());
    let kind = match (language, attributes.as_slice()) {
        ("sh", []) if remark("# not tested:").is_some() => {
            return Err("say `<!-- not tested: REASON -->` before the block, where no reader sees it".into());
        }
        ("sh", []) => left_out.map_or(Kind::Commands { exit: 0 }, |reason| Kind::NotTested { reason }),
        _ if left_out.is_some() => return Err("only a block `sh` can be said to be not tested".into()),
        ("sh", [one]) => match one.strip_prefix("exit=").map(str::parse) {
            Some(Ok(exit)) => Kind::Commands { exit },
            _ => return Err(format!("`{one}`: commands know `exit=CODE` only")),
        },
        ("text", ["shown"]) => Kind::Shown,
        ("bash" | "shell" | "console", _) => return Err(format!("`{language}` is not run; write `sh`")),
        ("", []) if text.lines().any(is_command) => {
            return Err("looks like commands, which run only in a block of `sh`".into());
        }
        (_, []) => return Ok(None),
        (_, [one]) => match one.strip_prefix("file=") {
            Some(name) => Kind::File(name.to_owned()),
            None => return Err(format!("`{one}` means nothing to the test")),
        },
        _ => return Err(format!("`{info}`: one attribute at most")),
    };
    let needs = remark("# needs:");
    Ok(Some(Block {
        line,
        kind,
        text,
        needs,
    }))
}

fn is_command(line: &str) -> bool {
    let line = line.trim_start();
    ["policyc ", "cargo ", "$ "].iter().any(|start| line.starts_with(start))
}

/// Whether every shown line stands in the output, in this order. `...` stands for any text in a line, alone for any lines.
///
/// # Errors
/// The first line that does not.
pub fn is_in_output(shown: &str, output: &str) -> Result<(), String> {
    let mut rest = output.lines();
    for line in shown
        .lines()
        .map(str::trim_end)
        .filter(|line| !line.is_empty() && *line != "...")
    {
        if !rest.any(|found| is_like(line, found.trim_end())) {
            return Err(format!("not printed, or not in this order: {line}"));
        }
    }
    Ok(())
}

fn is_like(pattern: &str, line: &str) -> bool {
    let mut parts = pattern.split("...");
    let Some(mut rest) = parts.next().and_then(|start| line.strip_prefix(start)) else {
        return false;
    };
    let mut last = None;
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        last = Some(part);
        rest = &rest[at + part.len()..];
    }
    // without dots, and behind the last of them, the line ends where the pattern does
    rest.is_empty() || last == Some("") || last.is_some_and(|part| line.ends_with(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_convention_is_read_with_its_line() {
        let page = "# Page\n```sh\npolicyc a\n```\n```text,shown\nok\n```\n```toml,file=a/b.toml\nx = 1\n```\n\
                    ```sh,exit=1\nfalse\n```\n<!-- not tested: needs MATLAB -->\n```sh\nmatlab\n```\n```rust\nlet x;\n```\n\
                    ```sh\n# needs: fmpy\nfmpy\n```\n";
        let blocks = read(page).unwrap();
        let kinds: Vec<_> = blocks.iter().map(|block| (block.line, &block.kind)).collect();
        let reason = "needs MATLAB".to_owned();
        assert_eq!(
            kinds,
            [
                (3, &Kind::Commands { exit: 0 }),
                (6, &Kind::Shown),
                (9, &Kind::File("a/b.toml".into())),
                (12, &Kind::Commands { exit: 1 }),
                (16, &Kind::NotTested { reason }),
                (22, &Kind::Commands { exit: 0 }),
            ]
        );
        assert_eq!(blocks[5].needs.as_deref(), Some("fmpy"));
        assert_eq!(blocks[2].text, "x = 1\n");
    }

    #[test]
    fn commands_that_would_not_run_are_faults() {
        for page in [
            "```\npolicyc demo\n```\n",
            "text\n\n    cargo build\n",
            "```bash\nls\n```\n",
            "```sh,ignore\nls\n```\n",
            "```sh\n# not tested: a reason\nls\n```\n",
            "<!-- not tested: a reason -->\n```toml,file=x\n```\n",
            "```toml,shown\nx = 1\n```\n",
            "```toml,file=x\n```\n```text,shown\nok\n```\n",
        ] {
            assert!(read(page).is_err(), "{page}");
        }
    }

    #[test]
    fn shown_lines_are_looked_for_in_order() {
        let output = "one 1.5 s\ntwo\nthree\n";
        for shown in ["one ... s\n...\nthree\n", "one ...\ntwo\n", "... s", "two"] {
            assert_eq!(is_in_output(shown, output), Ok(()), "{shown}");
        }
        for shown in ["three\ntwo\n", "tw", "wo", "one ... m\n", "four ..."] {
            assert!(is_in_output(shown, output).is_err(), "{shown}");
        }
    }
}
