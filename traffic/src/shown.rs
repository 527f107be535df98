//! Makes foreign text safe to show on a terminal and in HTML, Markdown and XML.
//!
//! A controller chooses the text of its messages, and the author of a folder chooses the names in
//! it. Control characters move the cursor of a terminal and hide text, and characters for
//! bidirectional text change the order in which a line is read. Each of them is shown as its number
//! instead, in the notation of JSON: `\u001b`. A line of JSON therefore keeps its meaning.

use std::borrow::Cow;

/// Returns true if a character is shown as its number: a control character other than tab and line
/// feed, or a character that changes the direction of text (Unicode UAX #9, section 2) or the end
/// of a line (U+2028, U+2029).
const fn is_hidden(c: char) -> bool {
    match c {
        '\t' | '\n' => false,
        '\u{0}'..='\u{1f}' | '\u{7f}'..='\u{9f}' => true,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => true,
        _ => false,
    }
}

/// Returns the text with its control and bidirectional characters as numbers. A carriage return
/// before a line feed stays.
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        if is_hidden(c) && !(c == '\r' && characters.peek() == Some(&'\n')) {
            shown.push_str(&format!("\\u{:04x}", u32::from(c)));
        } else {
            shown.push(c);
        }
    }
    Cow::Owned(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_and_bidirectional_characters_are_shown_as_numbers() {
        let text = "a\u{1b}[31m\u{0}\u{8}\u{7f}\u{9b}\u{202e}\u{2066}\u{200f}\u{61c}\rb";
        let expected = "a\\u001b[31m\\u0000\\u0008\\u007f\\u009b\\u202e\\u2066\\u200f\\u061c\\u000db";
        assert_eq!(shown(text), expected);
    }

    #[test]
    fn all_other_text_stays() {
        for text in ["", "tab\tline\nDOS\r\nend", "Umlaute äöü, עברית, العربية, 日本, ×, – 🚗"] {
            assert_eq!(shown(text), text);
        }
    }
}
