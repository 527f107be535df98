//! Putting HTML together so that no text is taken for markup.

use std::fmt::Display;

/// A text as it stands in HTML, in content and in attributes.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// A page in the making.
#[derive(Debug, Default)]
pub(super) struct Html(String);

impl Html {
    /// Markup as it is.
    pub(super) fn raw(&mut self, markup: &str) {
        self.0.push_str(markup);
        self.0.push('\n');
    }

    /// An element with a text.
    pub(super) fn element(&mut self, tag: &str, text: impl Display) {
        self.raw(&element(tag, "", text));
    }

    /// An element of a class with a text.
    pub(super) fn classed(&mut self, tag: &str, class: &str, text: impl Display) {
        self.raw(&element(tag, class, text));
    }

    /// A row of a table: markup of its cells.
    pub(super) fn row(&mut self, class: &str, cells: &[String]) {
        let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
        self.raw(&format!("<tr{class}>{}</tr>", cells.concat()));
    }

    /// The head of a table, with its columns; those that begin with `#` hold numbers.
    pub(super) fn table(&mut self, columns: &[&str]) {
        let head = |column: &&str| match column.strip_prefix('#') {
            Some(column) => element("th", "number", column),
            None => element("th", "", column),
        };
        let head: String = columns.iter().map(head).collect();
        self.raw(&format!("<div class=\"wide\"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>"));
    }

    /// The end of a table.
    pub(super) fn end_table(&mut self) {
        self.raw("</tbody></table></div>");
    }

    pub(super) fn finish(self) -> String {
        self.0
    }
}

/// An element with a text.
pub(super) fn element(tag: &str, class: &str, text: impl Display) -> String {
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    format!("<{tag}{class}>{}</{tag}>", escape(&text.to_string()))
}

/// A cell with a text.
pub(super) fn cell(text: impl Display) -> String {
    element("td", "", text)
}

/// A cell with a number.
pub(super) fn number(text: impl Display) -> String {
    element("td", "number", text)
}

/// A cell with markup.
pub(super) fn markup(markup: &str) -> String {
    format!("<td>{markup}</td>")
}

/// A probability in percent.
pub(super) fn percent(probability: f64) -> String {
    format!("{:.2} %", 100.0 * probability)
}
