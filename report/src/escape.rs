//! Escaping of text for XML and HTML.

/// Escapes `text` for use between tags and in double-quoted attributes.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
