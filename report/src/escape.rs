//! Escaping of text for XML and HTML.

use closecall_traffic::shown::shown;

/// Escapes `text` for use between tags and in double-quoted attributes, without control characters.
pub(crate) fn escaped(text: &str) -> String {
    shown(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_keeps_its_meaning_when_it_is_shown() {
        let value = serde_json::json!({ "a": "\u{1b}\u{202e}\u{7f}\u{2028}" });
        let text = value.to_string();
        assert_ne!(shown(&text), text);
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown(&text)).unwrap(), value);
    }
}
