//! Lines of C with their indentation.

/// Text under construction.
#[derive(Debug, Default)]
pub struct Text {
    /// Lines so far.
    pub lines: Vec<String>,
    depth: usize,
}

impl Text {
    /// A statement.
    pub fn line(&mut self, text: impl AsRef<str>) {
        self.lines
            .push(format!("{}{}", "    ".repeat(self.depth), text.as_ref()));
    }

    /// Statements.
    pub fn lines(&mut self, lines: impl IntoIterator<Item = impl AsRef<str>>) {
        lines.into_iter().for_each(|line| self.line(line));
    }

    /// A line of the preprocessor.
    pub fn directive(&mut self, text: impl Into<String>) {
        self.lines.push(text.into());
    }

    /// A block behind `head`.
    pub fn block(&mut self, head: &str, body: impl FnOnce(&mut Text)) {
        self.line(format!("{head}{{"));
        self.depth += 1;
        body(self);
        self.depth -= 1;
        self.line("}");
    }

    /// A body executed `count` times, counted by `index`; a block if once.
    pub fn repeat(&mut self, index: &str, count: usize, body: impl FnOnce(&mut Text)) {
        if count == 1 {
            self.block("", body);
        } else {
            self.count(index, 0, count, body);
        }
    }

    /// A loop from `first` on, however often.
    pub fn count(&mut self, index: &str, first: usize, count: usize, body: impl FnOnce(&mut Text)) {
        self.block(
            &format!("for ({index} = {first}u; {index} < {count}u; ++{index}) "),
            body,
        );
    }

    /// A function; its head is a line of its own.
    pub fn function(&mut self, head: &str, body: impl FnOnce(&mut Text)) {
        self.line(head);
        self.block("", body);
    }

    /// `special` where `condition` holds, else `otherwise`; `otherwise` alone if there is nothing special.
    pub fn either(
        &mut self,
        condition: &str,
        special: Option<impl FnOnce(&mut Text)>,
        otherwise: impl FnOnce(&mut Text),
    ) {
        let Some(special) = special else {
            return otherwise(self);
        };
        self.directive(format!("#if {condition}"));
        special(self);
        self.directive("#else");
        otherwise(self);
        self.directive("#endif");
    }
}
