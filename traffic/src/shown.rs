//! Makes foreign text safe to show on a terminal and in HTML, Markdown and XML.
//!
//! A controller chooses the text of its messages, and the author of a folder chooses the names in
//! it. Control characters move the cursor of a terminal and hide text, characters for bidirectional
//! text change the order in which a line is read, and invisible characters carry text that no
//! reader sees. Each of them is shown as its number instead, in the notation of JSON: `\u001b`, and
//! `\udb40\udc41` beyond U+FFFF. A line of JSON therefore keeps its meaning.

use std::borrow::Cow;

/// Returns true if a character is shown as its number: a control character other than tab and line
/// feed, a character that changes the direction of text (Unicode UAX #9, section 2) or the end of a
/// line (U+2028, U+2029), or an invisible one (the property `Default_Ignorable_Code_Point` of
/// Unicode 16, and the interlinear annotations). The joiners and the variation selectors of scripts
/// and pictograms stay (U+180B to U+180D, U+180F, U+200C, U+200D, U+FE00 to U+FE0F).
const fn is_hidden(c: char) -> bool {
    match c {
        '\t' | '\n' => false,
        '\u{0}'..='\u{1f}' | '\u{7f}'..='\u{9f}' => true,
        '\u{61c}' | '\u{200b}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' => true,
        '\u{ad}' | '\u{34f}' | '\u{115f}' | '\u{1160}' | '\u{17b4}' | '\u{17b5}' | '\u{180e}' => true,
        '\u{3164}' | '\u{feff}' | '\u{ffa0}' | '\u{fff0}'..='\u{fffb}' => true,
        '\u{1bca0}'..='\u{1bca3}' | '\u{1d173}'..='\u{1d17a}' | '\u{e0000}'..='\u{e0fff}' => true,
        _ => false,
    }
}

/// Returns the text with its control, bidirectional and invisible characters as numbers. A carriage
/// return before a line feed stays.
pub fn shown(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len());
    let mut characters = text.chars().peekable();
    while let Some(c) = characters.next() {
        if is_hidden(c) && !(c == '\r' && characters.peek() == Some(&'\n')) {
            let units = c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")).collect::<String>();
            shown.push_str(&units);
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
    fn invisible_characters_are_shown_as_numbers() {
        let text = "a\u{feff}b\u{200b}c\u{ad}d\u{e0041}\u{e0001}e\u{2062}\u{3164}";
        assert_eq!(shown(text), "a\\ufeffb\\u200bc\\u00add\\udb40\\udc41\\udb40\\udc01e\\u2062\\u3164");
    }

    #[test]
    fn all_other_text_stays() {
        for text in [
            "",
            "tab\tline\nDOS\r\nend",
            "Umlaute äöü, עברית, العربية, 日本, ×, – 🚗",
            "می\u{200c}خواهم 👩\u{200d}🚒 ❤\u{fe0f} \u{fffd}",
        ] {
            assert_eq!(shown(text), text);
        }
    }
}
