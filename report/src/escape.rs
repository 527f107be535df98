//! Escaping of text for XML, HTML and Markdown.

use closecall_traffic::shown::shown;

/// Escapes `text` for use between tags and in double-quoted attributes, without control characters.
pub(crate) fn escaped(text: &str) -> String {
    shown(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Returns text in one line, in which nothing starts HTML, an entity, an emphasis, a formula, an
/// image, a link, a mention or the number of an issue, and nothing at its begin a heading or a
/// list: a controller's message may hold all of them. Only text between backticks stays, since
/// nothing is marked in it. It is for the Markdown of GitHub and GitLab.
pub(crate) fn in_markdown(text: &str) -> String {
    let text: Vec<char> = text.chars().map(|c| if matches!(c, '\n' | '\r') { ' ' } else { c }).collect();
    let mut escaped = String::with_capacity(text.len());
    let mut index = block_start(&text, &mut escaped);
    while let Some(&c) = text.get(index) {
        if c == '`' {
            index = code_span(&text, index, &mut escaped);
            continue;
        }
        let before = index.checked_sub(1).map(|before| text[before]);
        push_character(c, before, &text[index + 1..], &mut escaped);
        index += 1;
    }
    escaped
}

/// Escapes what would start a heading, a quotation or a list at the beginning of a text. Returns
/// the index of the first character that is left.
fn block_start(text: &[char], escaped: &mut String) -> usize {
    let blanks = text.iter().take_while(|c| c.is_whitespace()).count();
    let digits = text[blanks..].iter().take_while(|c| c.is_ascii_digit()).count();
    let is_mark = match text.get(blanks + digits) {
        Some('#' | '>' | '-' | '+' | '=') => digits == 0,
        Some('.' | ')') => digits > 0 && text.get(blanks + digits + 1).is_none_or(|c| c.is_whitespace()),
        _ => false,
    };
    if !is_mark {
        return 0;
    }
    escaped.extend(&text[..blanks + digits]);
    escaped.push('\\');
    escaped.push(text[blanks + digits]);
    blanks + digits + 1
}

/// Returns Markdown in which no underscore emphasises text: a vehicle may have the name `_lead_`.
pub(crate) fn plain_underscores(markdown: &str) -> String {
    let text: Vec<char> = markdown.chars().collect();
    let mut escaped = String::with_capacity(markdown.len());
    let mut index = 0;
    while let Some(&c) = text.get(index) {
        if c == '`' {
            index = code_span(&text, index, &mut escaped);
            continue;
        }
        let is_word =
            |at: Option<usize>| at.and_then(|at| text.get(at)).is_some_and(|neighbour| neighbour.is_alphanumeric());
        if c == '_' && !(is_word(index.checked_sub(1)) && is_word(Some(index + 1))) {
            escaped.push('\\');
        }
        escaped.push(c);
        index += 1;
    }
    escaped
}

/// Copies a code span that starts at `start`, or escapes backticks that start none. Returns the
/// index after them.
fn code_span(text: &[char], start: usize, escaped: &mut String) -> usize {
    let ticks = |from: usize| text[from..].iter().take_while(|c| **c == '`').count();
    let length = ticks(start);
    let mut index = start + length;
    while index < text.len() {
        match ticks(index) {
            0 => index += 1,
            closing if closing == length => {
                escaped.extend(&text[start..index + length]);
                return index + length;
            }
            other => index += other,
        }
    }
    (0..length).for_each(|_| escaped.push_str("\\`"));
    start + length
}

/// Appends a character between its neighbours.
fn push_character(c: char, before: Option<char>, after: &[char], escaped: &mut String) {
    let next = after.first().copied();
    let is_blank = |neighbour: Option<char>| neighbour.is_none_or(char::is_whitespace);
    let is_word = |neighbour: Option<char>| neighbour.is_some_and(char::is_alphanumeric);
    match (c, next) {
        ('\\', Some(next)) if next.is_ascii_punctuation() => escaped.push_str("\\\\"),
        ('<', Some(next)) if next.is_ascii_alphabetic() || matches!(next, '/' | '!' | '?') => escaped.push_str("&lt;"),
        ('&', Some(next)) if next.is_ascii_alphabetic() || next == '#' => escaped.push_str("&amp;"),
        ('*', _) if !(is_blank(before) && is_blank(next)) => escaped.push_str("\\*"),
        ('_', _) if !(is_word(before) && is_word(next)) => escaped.push_str("\\_"),
        ('~' | '$', _) | (']', Some('(' | '[' | ':')) => escaped.extend(['\\', c]),
        // GitHub and GitLab link what a text node holds: the name or number is in another one.
        ('@', Some(next)) if next.is_alphanumeric() && !is_word(before) => escaped.push_str("<span>@</span>"),
        ('#', Some(next)) if next.is_ascii_digit() => escaped.push_str("<span>#</span>"),
        (':', _) if after.starts_with(&['/', '/']) => escaped.push_str("<span>:</span>"),
        ('.', _) if escaped.ends_with("www") => escaped.push_str("<span>.</span>"),
        _ => escaped.push(c),
    }
}

/// Returns a text that [`in_markdown`] has escaped.
pub(crate) fn from_markdown(text: &str) -> String {
    let text = text.replace("<span>", "").replace("</span>", "").replace("&lt;", "<");
    let mut plain = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        match (c, characters.peek()) {
            ('\\', Some(next)) if next.is_ascii_punctuation() => plain.extend(characters.next()),
            _ => plain.push(c),
        }
    }
    plain.replace("&amp;", "&")
}

/// Returns text as code of Markdown, in one line.
pub(crate) fn markdown_code(text: &str) -> String {
    let text = text.replace(['\n', '\r'], " ");
    let longest = text.split(|c: char| c != '`').map(str::len).max().unwrap_or_default();
    let fence = "`".repeat(longest + 1);
    let blank = if longest > 0 { " " } else { "" };
    format!("{fence}{blank}{text}{blank}{fence}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_marked_in_foreign_text() {
        for (text, expected) in [
            (
                "**b** ~~s~~ &lt;b&gt; @user #12",
                r"\*\*b\*\* \~\~s\~\~ &amp;lt;b&amp;gt; <span>@</span>user <span>#</span>12",
            ),
            ("_i_ __init__ *i*", r"\_i\_ \_\_init\_\_ \*i\*"),
            ("<img src=x> <!-- x", "&lt;img src=x> &lt;!-- x"),
            ("![a](b) [a][b] [a]: b", r"![a\](b) [a\][b] [a\]: b"),
            ("https://a.b www.a.b", "https<span>:</span>//a.b www<span>.</span>a.b"),
            ("$x$ one`tick ``two", r"\$x\$ one\`tick \`\`two"),
            (r"\*a\* \u001b", r"\\\*a\\\* \u001b"),
            ("# a", r"\# a"),
            (" - a", r" \- a"),
            ("12. a", r"12\. a"),
            ("a\nb", "a b"),
        ] {
            assert_eq!(in_markdown(text), expected);
            if !text.contains('\n') {
                assert_eq!(from_markdown(expected), text);
            }
        }
    }

    #[test]
    fn usual_text_stays() {
        for text in [
            "",
            "p1(min_ttc_rear_s) >= 1.0, a | b, 2 * 3 < 7, 25 % (95 %: 20 % to 30 %)",
            "low-thw-overtake@idm: 11 of 1,000 & more",
            "`exec:python3 my_controller.py` could not be started",
            "the code `**a** @user #1 <b>` is as it is",
            "1.5 m/s, 3 × FLAKY",
        ] {
            assert_eq!(in_markdown(text), text);
            assert_eq!(from_markdown(text), text);
        }
    }

    #[test]
    fn an_underscore_of_a_name_emphasises_nothing() {
        for (text, expected) in [
            ("- **acc:** _lead_ struck E", r"- **acc:** \_lead\_ struck E"),
            ("__x__ OverTaker_2 a_", r"\_\_x\_\_ OverTaker_2 a\_"),
            ("the code `_a_`", "the code `_a_`"),
        ] {
            assert_eq!(plain_underscores(text), expected);
        }
    }

    #[test]
    fn code_holds_any_text() {
        assert_eq!(markdown_code("closecall replay . 3"), "`closecall replay . 3`");
        assert_eq!(markdown_code("a`b``c"), "``` a`b``c ```");
    }

    #[test]
    fn json_keeps_its_meaning_when_it_is_shown() {
        let value = serde_json::json!({ "a": "\u{1b}\u{202e}\u{7f}\u{2028}\u{feff}\u{e0041}" });
        let text = value.to_string();
        assert_ne!(shown(&text), text);
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown(&text)).unwrap(), value);
    }
}
