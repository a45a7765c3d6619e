//! HTML pages: one file, nothing loaded, no script but that of the charts.

use crate::command;
use crate::error::ReportError;
use crate::frame::Svg;
use crate::live;
use crate::markup::{Attributes, Markup};
use crate::table::Table;

/// How the verdict of a page came out; it is written as a word, not by colour alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// As required.
    Pass,
    /// With reservations.
    Warn,
    /// Not as required.
    Fail,
    /// Nothing was judged.
    Note,
}

impl Verdict {
    fn class(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Warn => "warn",
            Self::Fail => "fail",
            Self::Note => "note",
        }
    }
}

/// A page: title, verdict, sections.
///
/// ```
/// use report::{Page, Section, Verdict};
/// let html = Page::new("Load step")
///     .verdict(Verdict::Pass, "v_out stays within its limits.")
///     .section(Section::new("Setup").pairs([("f_sw", "100 kHz")]).text("Measured at 25 °C."))
///     .html()?;
/// # Ok::<(), report::ReportError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    verdict: Option<(Verdict, &'static str, String)>,
    sections: Vec<Section>,
}

/// A heading and what stands below it, in the order added.
#[derive(Debug, Clone)]
pub struct Section {
    heading: String,
    blocks: Vec<Block>,
}

#[derive(Debug, Clone)]
enum Block {
    Text(String),
    Chart(Svg, String),
    Table(Table),
    Pairs(Vec<(String, String)>),
    Code(String),
    Details(Section),
    Pick(String, Vec<Section>),
}

impl Page {
    /// Page without sections.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            verdict: None,
            sections: Vec::new(),
        }
    }

    /// The answer in one sentence, at the top.
    #[must_use]
    pub fn verdict(self, verdict: Verdict, sentence: impl Into<String>) -> Self {
        // a note judges nothing: its sentence stands alone
        let word = if verdict == Verdict::Note { "" } else { verdict.class() };
        self.verdict_as(verdict, word, sentence)
    }

    /// As [`verdict`](Page::verdict) with a word of its own; none if it is empty.
    #[must_use]
    pub fn verdict_as(mut self, verdict: Verdict, word: &'static str, sentence: impl Into<String>) -> Self {
        self.verdict = Some((verdict, word, sentence.into()));
        self
    }

    /// Adds a section.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// The whole file.
    ///
    /// # Errors
    /// A table whose row has another number of cells than the table has columns.
    pub fn html(&self) -> Result<String, ReportError> {
        let mut out = Markup::default();
        out.raw("<!DOCTYPE html>\n");
        out.open("html", &[("lang", &"en")]);
        out.open("head", &[]);
        out.leaf("meta", &[("charset", &"utf-8")]);
        out.leaf(
            "meta",
            &[
                ("name", &"viewport"),
                ("content", &"width=device-width, initial-scale=1"),
            ],
        );
        // whose page it is: policyc replaces its own pages, and no others
        out.leaf("meta", &[("name", &"generator"), ("content", &"policyc")]);
        let script = self.sections.iter().any(Section::is_live).then(live::script);
        let policy = live::content_policy(script.as_deref());
        out.leaf(
            "meta",
            &[("http-equiv", &"Content-Security-Policy"), ("content", &policy)],
        );
        out.text("title", &[], &self.title);
        out.open("style", &[]);
        // inside the page, which loads nothing
        out.raw(include_str!("page.css"));
        if script.is_some() {
            out.raw(live::STYLE);
        }
        out.close("style");
        out.close("head");
        out.open("body", &[]);
        out.open("main", &[]);
        out.text("h1", &[], &self.title);
        if let Some((verdict, word, sentence)) = &self.verdict {
            let class = verdict.class();
            out.open("p", &[("class", &format_args!("verdict {class}"))]);
            if !word.is_empty() {
                out.text("strong", &[], word);
            }
            out.text("span", &[], sentence);
            out.close("p");
        }
        let mut picks = 0;
        for section in &self.sections {
            section.whole(&mut out, &[], &mut picks)?;
        }
        out.raw(command::SECTION);
        out.close("main");
        if let Some(script) = script {
            // its digest stands in the policy, so not a byte beside it
            out.raw("<script>");
            out.raw(&script);
            out.raw("</script>\n");
        }
        for name in ["body", "html"] {
            out.close(name);
        }
        Ok(out.finish())
    }
}

impl Section {
    /// Empty section; an empty heading is left out.
    pub fn new(heading: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            blocks: Vec::new(),
        }
    }

    /// Paragraph.
    #[must_use]
    pub fn text(self, text: impl Into<String>) -> Self {
        self.block(Block::Text(text.into()))
    }

    /// Chart with a caption; an empty one is left out.
    #[must_use]
    pub fn chart(self, svg: Svg, caption: impl Into<String>) -> Self {
        self.block(Block::Chart(svg, caption.into()))
    }

    /// Chart with a caption, or the reason why it could not be drawn in its place: a picture must not cost the rest of the page.
    #[must_use]
    pub fn chart_or_reason(self, svg: Result<Svg, ReportError>, caption: impl Into<String>) -> Self {
        match svg {
            Ok(svg) => self.chart(svg, caption),
            Err(reason) => self.text(format!("A picture is missing here: {reason}.")),
        }
    }

    /// Table.
    #[must_use]
    pub fn table(self, table: Table) -> Self {
        self.block(Block::Table(table))
    }

    /// Names with their values.
    #[must_use]
    pub fn pairs<K: Into<String>, V: Into<String>>(self, pairs: impl IntoIterator<Item = (K, V)>) -> Self {
        let pairs = pairs.into_iter().map(|(key, value)| (key.into(), value.into()));
        let pairs = pairs.collect();
        self.block(Block::Pairs(pairs))
    }

    /// Text in a fixed-width font with its line breaks: a command, a file.
    #[must_use]
    pub fn code(self, code: impl Into<String>) -> Self {
        self.block(Block::Code(code.into()))
    }

    /// Section that opens at a click on its heading.
    #[must_use]
    pub fn details(self, inner: Section) -> Self {
        self.block(Block::Details(inner))
    }

    /// Sections of which one is shown at a time, picked by its heading; `what` says what is picked. In print all of them stand. One
    /// alone needs no choice, and has its heading.
    #[must_use]
    pub fn pick(self, what: impl Into<String>, sections: Vec<Section>) -> Self {
        self.block(Block::Pick(what.into(), sections))
    }

    /// Whether a chart in it has data for the script.
    fn is_live(&self) -> bool {
        self.blocks.iter().any(|block| match block {
            Block::Chart(svg, _) => svg.live.is_some(),
            Block::Details(inner) => inner.is_live(),
            Block::Pick(_, sections) => sections.iter().any(Section::is_live),
            Block::Text(_) | Block::Table(_) | Block::Pairs(_) | Block::Code(_) => false,
        })
    }

    fn block(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    pub(crate) fn whole(&self, out: &mut Markup, attributes: Attributes, picks: &mut usize) -> Result<(), ReportError> {
        out.open("section", attributes);
        if !self.heading.is_empty() {
            out.text("h2", &[], &self.heading);
        }
        self.write(out, picks)?;
        out.close("section");
        Ok(())
    }

    fn write(&self, out: &mut Markup, picks: &mut usize) -> Result<(), ReportError> {
        for block in &self.blocks {
            match block {
                Block::Text(text) => out.text("p", &[], text),
                Block::Chart(svg, caption) => {
                    out.open("figure", if svg.live.is_some() { &[("class", &"data")] } else { &[] });
                    // the style shows one of both, as there is room; beside a live chart one is for print alone, and narrow
                    let both = [("still wide", svg.as_str()), ("still narrow", svg.narrow.as_str())];
                    for (class, picture) in both.into_iter().skip(usize::from(svg.live.is_some())) {
                        out.open("div", &[("class", &class)]);
                        out.raw(picture);
                        out.close("div");
                    }
                    if let Some(data) = &svg.live {
                        out.raw("<script type=\"application/json\">");
                        out.raw(data);
                        out.raw("</script>\n");
                    }
                    out.open("figcaption", &[]);
                    out.text("span", &[], caption);
                    out.raw(command::LINK);
                    out.close("figcaption");
                    out.close("figure");
                }
                Block::Table(table) => table.write(out)?,
                Block::Pairs(pairs) => {
                    out.open("dl", &[]);
                    for (key, value) in pairs {
                        out.text("dt", &[], key);
                        out.text("dd", &[], value);
                    }
                    out.close("dl");
                }
                // it may be wider than the screen
                Block::Code(code) => out.text("pre", &[("tabindex", &0)], code),
                Block::Details(inner) => {
                    out.open("details", &[]);
                    out.text("summary", &[], &inner.heading);
                    inner.write(out, picks)?;
                    out.close("details");
                }
                Block::Pick(what, sections) => pick(out, what, sections, picks)?,
            }
        }
        Ok(())
    }
}

/// A button for each section, in front of it: so the style alone can tell which one is shown, and no script is needed.
fn pick(out: &mut Markup, what: &str, sections: &[Section], picks: &mut usize) -> Result<(), ReportError> {
    if let [only] = sections {
        return only.whole(out, &[], picks);
    }
    // each choice has a name of its own
    let number = *picks;
    *picks += 1;
    out.open("div", &[("class", &"pick"), ("role", &"group"), ("aria-label", &what)]);
    for (n, section) in sections.iter().enumerate() {
        let id = format!("pick-{number}-{n}");
        let name = format!("pick-{number}");
        let mut attributes: Vec<(&str, &dyn std::fmt::Display)> = vec![
            ("type", &"radio"),
            ("id", &id),
            ("name", &name),
            ("autocomplete", &"off"),
        ];
        if n == 0 {
            attributes.push(("checked", &"checked"));
        }
        out.leaf("input", &attributes);
        out.text("label", &[("for", &id)], &section.heading);
        section.whole(out, &[], picks)?;
    }
    out.close("div");
    Ok(())
}
