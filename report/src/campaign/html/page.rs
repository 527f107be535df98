//! The frame of a page, and what several parts of a page share.

use std::fmt::Display;

use closecall_traffic::shown::shown;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// The style sheet of all pages.
pub(in crate::campaign) const STYLE: &str = include_str!("style.css");

/// Returns a whole page, without control characters.
pub fn document(title: &str, body: &Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (shown(title)) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { (PreEscaped(shown(&with_whole_percentages(&body.0)))) } }
        }
    }
}

/// Returns the head of the page of a study: its title, a line about it, and the settings of its
/// scenario.
pub fn head(title: &str, settings: &[String], line: &str) -> Markup {
    html! {
        header {
            div {
                h1 { (title) }
                p.what { (line) }
                @for setting in settings { p.note { "with " code { (setting) } } }
            }
        }
    }
}

/// Returns a table; `head` holds cells, `rows` holds rows. On a narrow page each row becomes a list
/// in which every cell has the name of its column, and on a page that is wider but not wide enough
/// the table scrolls sideways.
pub fn table(head: &Markup, rows: &Markup) -> Markup {
    html! {
        div.wide tabindex="0" {
            table {
                thead { tr { (head) } }
                tbody { (PreEscaped(with_names(&column_names(&head.0), &rows.0))) }
            }
        }
    }
}

/// Returns the texts of the cells of a head.
fn column_names(head: &str) -> Vec<String> {
    let cells = head.split("<t").filter(|part| part.starts_with(['h', 'd']));
    let text = |cell: &str| {
        let inside = cell.split_once('>').map_or("", |(_, inside)| inside);
        inside.split('<').next().unwrap_or_default().replace('"', "&quot;")
    };
    cells.map(text).collect()
}

/// Adds the name of its column to each cell of the rows.
fn with_names(names: &[String], rows: &str) -> String {
    let mut named = String::with_capacity(rows.len());
    let mut column = 0;
    for (index, part) in rows.split_inclusive("<t").enumerate() {
        // Each part but the first follows the beginning of an element.
        let is_element = |name: char| index > 0 && part.starts_with(name) && part[1..].starts_with([' ', '>']);
        if is_element('r') {
            column = 0;
        }
        if is_element('d') {
            let name = names.get(column).map_or("", String::as_str);
            named.push_str(&format!("d data-name=\"{name}\"{}", &part[1..]));
            column += 1;
        } else {
            named.push_str(part);
        }
    }
    named
}

/// Returns an expression that a browser breaks only between words: at spaces, after `_` and `(`,
/// and after a `.` between names.
pub(crate) fn breakable(expression: &str) -> Markup {
    let mut last = ' ';
    let ends_word = |letter: char| {
        let is_end = matches!(letter, '_' | '(') || letter == '.' && last.is_alphabetic();
        last = letter;
        is_end
    };
    html! { @for piece in expression.split_inclusive(ends_word) { (piece) wbr; } }
}

/// Elements whose text is run or copied, and stays as it is.
const VERBATIM: [&str; 4] = ["script", "style", "code", "pre"];

/// Returns markup in which no line ends between a number and its percent sign.
fn with_whole_percentages(markup: &str) -> String {
    let mut whole = String::with_capacity(markup.len());
    let mut verbatim: Option<&str> = None;
    for part in markup.split_inclusive('>') {
        let (text, tag) = part.split_at(part.rfind('<').unwrap_or(part.len()));
        match verbatim {
            Some(name) => {
                whole.push_str(text);
                verbatim = verbatim.filter(|_| !is_tag(tag, &format!("</{name}")));
            }
            None => {
                push_whole_percentages(&mut whole, text);
                verbatim = VERBATIM.into_iter().find(|name| is_tag(tag, &format!("<{name}")));
            }
        }
        whole.push_str(tag);
    }
    whole
}

/// Returns whether a tag begins like this, and its name ends there.
fn is_tag(tag: &str, begin: &str) -> bool {
    tag.strip_prefix(begin).is_some_and(|rest| rest.starts_with([' ', '>']))
}

/// Appends a text, with a space that does not break a line before each percent sign after a digit.
fn push_whole_percentages(whole: &mut String, text: &str) {
    for (index, piece) in text.split(" %").enumerate() {
        if index > 0 {
            whole.push_str(if whole.ends_with(|last: char| last.is_ascii_digit()) { "\u{a0}%" } else { " %" });
        }
        whole.push_str(piece);
    }
}

/// Returns the heads of columns of text.
pub fn text_heads(names: &[&str]) -> Markup {
    html! { @for name in names { @if name.is_empty() { td {} } @else { th { (name) } } } }
}

/// Returns the heads of columns of numbers.
pub fn number_heads(names: &[&str]) -> Markup {
    html! { @for name in names { th.number { (name) } } }
}

/// Returns a cell with a number.
pub fn number(value: impl Display) -> Markup {
    html! { td.number { (value.to_string()) } }
}

/// Returns an entry of a legend, in the colour that the charts use.
pub(crate) fn legend_key(colour: &str, text: &str) -> Markup {
    html! { span.key style={ "--key:" (colour) } { (text) } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_the_name_of_its_column() {
        let head = html! { th { "sample" } th.number { "ΔV \"max\"" } td {} };
        let rows = html! { tr { td { "1" } td.number { "2" } td { "3" } } tr.collided { td { "4" } } };
        let table = table(&head, &rows).into_string();
        let body = table.split_once("<tbody>").unwrap().1;
        assert_eq!(body.matches("data-name=\"sample\"").count(), 2, "{body}");
    }

    #[test]
    fn an_expression_is_broken_between_words_alone() {
        let expression = "upper(imposed_braking_mps2 > 3 | baseline.imposed_braking_mps2 < 3) <= 0.05";
        let written = breakable(expression).into_string();
        let pieces: Vec<&str> = written.split("<wbr>").flat_map(|piece| piece.split(' ')).collect();
        // A cell on a page of 390 px has room for some 30 letters, and in a narrow column for 16.
        assert!(pieces.iter().all(|piece| piece.len() <= 16), "{pieces:?}");
        for word in ["upper(", "imposed_", "braking_", "mps2", "baseline.", "0.05"] {
            assert!(pieces.contains(&word), "{word}: {pieces:?}");
        }
        // What is copied from the page is the expression.
        assert_eq!(written.replace("<wbr>", "").replace("&gt;", ">").replace("&lt;", "<"), expression);
        // The style sheet leaves the pieces whole: `anywhere` would let a column be narrower than a
        // word.
        assert!(STYLE.contains("\n.gates code { overflow-wrap: break-word; }\n"));
    }

    #[test]
    fn no_line_ends_between_a_number_and_its_percent_sign() {
        let markup =
            "<p title=\"1 %\">6 of 30 (<b>20 %</b>), in %</p><pre>7 % 2</pre><p>3 %</p><script>4 %'<p>'5 %</script>6 %";
        let expected = "<p title=\"1 %\">6 of 30 (<b>20\u{a0}%</b>), in %</p><pre>7 % 2</pre><p>3\u{a0}%</p><script>4 %'<p>'5 %</script>6\u{a0}%";
        assert_eq!(with_whole_percentages(markup), expected);
        let page = document("t", &html! { p { "at most 3 %" } }).into_string();
        assert!(page.contains("at most 3\u{a0}%"), "{page}");
    }

    #[test]
    fn paper_has_the_sections_of_a_study() {
        let hiding = STYLE.split('}').filter(|rule| rule.contains("display: none"));
        let selectors: Vec<&str> = hiding.filter_map(|rule| rule.rsplit('{').nth(1)).collect();
        assert!(selectors.iter().any(|selector| selector.contains(".scenario")), "{selectors:?}");
        for selector in selectors.iter().flat_map(|list| list.rsplit("*/").next().unwrap_or_default().split(',')) {
            let selector = selector.trim();
            assert!(!selector.starts_with("section") && selector != "figure" && selector != "table", "{selector}");
        }
        let page = document("Study", &html! { (head("Study", &["a=1".to_owned()], "b")) section { h2 { "Factors" } } });
        let page = page.into_string();
        assert!(page.contains("<main><header><div><h1>Study</h1>") && page.contains("<code>a=1</code>"), "{page}");
    }

    #[test]
    fn text_cannot_become_markup() {
        let page = document("<b> & \"c\"\u{1}", &html! { p { "<script>\u{202e}" } }).into_string();
        assert!(page.contains("<title>&lt;b&gt; &amp; &quot;c&quot;\\u0001</title>"), "{page}");
        assert!(page.contains("<p>&lt;script&gt;\\u202e</p>"), "{page}");
    }
}
