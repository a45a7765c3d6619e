//! What the rules ask of a Markdown page: its links, its headings, its words.

use std::collections::HashMap;

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

/// A link or picture with the line it stands in, from 1.
#[derive(Debug, PartialEq)]
pub struct Link {
    pub line: usize,
    pub target: String,
}

/// One page, read once.
#[derive(Debug, Default)]
pub struct Page {
    pub links: Vec<Link>,
    /// Where a link may point to in this page, as mdBook and GitHub name headings.
    pub anchors: Vec<String>,
    /// Words of the prose: code, tables and pictures apart.
    pub words: usize,
    /// Those of them that hold a digit.
    pub figures: usize,
}

impl Page {
    pub fn read(text: &str) -> Self {
        let mut page = Self::default();
        let mut repeated = HashMap::new();
        let mut heading = None;
        let mut silent = 0_usize;
        let options = Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH;
        for (event, range) in Parser::new_ext(text, options).into_offset_iter() {
            match event {
                Event::Start(tag) => {
                    silent += usize::from(is_silent(&tag));
                    match tag {
                        Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. } => page.links.push(Link {
                            line: text[..range.start].matches('\n').count() + 1,
                            target: dest_url.into_string(),
                        }),
                        Tag::Heading { .. } => heading = Some(String::new()),
                        _ => {}
                    }
                }
                Event::End(end) => {
                    silent = silent.saturating_sub(usize::from(is_silent_end(end)));
                    if let (TagEnd::Heading(_), Some(title)) = (end, heading.take_if(|_| is_heading(end))) {
                        page.anchors.push(unique(anchor(&title), &mut repeated));
                    }
                }
                Event::Text(words) | Event::Code(words) if heading.is_some() => {
                    if let Some(title) = &mut heading {
                        title.push_str(&words);
                    }
                }
                Event::Html(html) | Event::InlineHtml(html) => {
                    let line = text[..range.start].matches('\n').count() + 1;
                    page.links.extend(sources(&html).map(|target| Link { line, target }));
                }
                Event::Text(words) if silent == 0 => page.count(&words),
                _ => {}
            }
        }
        page
    }

    fn count(&mut self, text: &str) {
        for word in text
            .split_whitespace()
            .filter(|word| word.contains(char::is_alphanumeric))
        {
            self.words += 1;
            self.figures += usize::from(word.contains(|c: char| c.is_ascii_digit()));
        }
    }
}

fn is_heading(end: TagEnd) -> bool {
    matches!(end, TagEnd::Heading(_))
}

fn is_silent(tag: &Tag) -> bool {
    matches!(tag, Tag::CodeBlock(_) | Tag::Table(_) | Tag::Image { .. })
}

fn is_silent_end(end: TagEnd) -> bool {
    matches!(end, TagEnd::CodeBlock | TagEnd::Table | TagEnd::Image)
}

/// Pictures of an HTML tag: Markdown has no picture that differs between a telephone and a desk.
fn sources(html: &str) -> impl Iterator<Item = String> {
    let values = |key: &'static str| html.split(key).skip(1).filter_map(|rest| rest.split_once('"'));
    let found = values(" src=\"").chain(values(" srcset=\""));
    found.map(|(value, _)| value.to_owned())
}

/// The name of a heading in an address.
fn anchor(title: &str) -> String {
    let kept = title.trim().chars().filter_map(|c| match c {
        c if c.is_whitespace() => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => Some(c),
        _ => None,
    });
    kept.flat_map(char::to_lowercase).collect()
}

fn unique(name: String, repeated: &mut HashMap<String, usize>) -> String {
    let count = repeated.entry(name.clone()).or_insert(0);
    *count += 1;
    match *count {
        1 => name,
        more => format!("{name}-{}", more - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_pictures_have_their_line() {
        let page = Page::read("# Title\n\nSee [this](a.md#b)\nand ![that](c.svg).\n\n```\n[no](x.md)\n```\n");
        let found: Vec<_> = page
            .links
            .iter()
            .map(|link| (link.line, link.target.as_str()))
            .collect();
        assert_eq!(found, [(3, "a.md#b"), (4, "c.svg")]);
    }

    #[test]
    fn pictures_in_html_count_as_links() {
        let page = Page::read("<picture>\n  <source srcset=\"a.svg\">\n  <img src=\"b.svg\" alt=\"c\">\n</picture>\n");
        let found: Vec<_> = page
            .links
            .iter()
            .map(|link| (link.line, link.target.as_str()))
            .collect();
        assert_eq!(found, [(2, "a.svg"), (3, "b.svg")]);
    }

    #[test]
    fn headings_are_named_as_in_an_address_and_told_apart() {
        let page = Page::read("# The `f64` format, again\n## Who wins?\n## Who wins?\n");
        assert_eq!(page.anchors, ["the-f64-format-again", "who-wins", "who-wins-1"]);
    }

    #[test]
    fn only_prose_is_counted() {
        let page = Page::read("Two figures: 17 and 4.5 V.\n\n| 1 | 2 |\n|---|---|\n| 3 | 4 |\n\n```\n99\n```\n");
        assert_eq!((page.words, page.figures), (6, 2));
    }
}
