//! Elements of an XML document, which are built before they are written.

use std::fmt::Display;
use std::io::{self, Write};

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// An element with its attributes, its text and its children.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    text: Option<String>,
    children: Vec<Element>,
}

impl Element {
    pub(super) const fn new(name: &'static str) -> Self {
        Self { name, attributes: Vec::new(), text: None, children: Vec::new() }
    }

    /// Returns the element with one more attribute.
    pub(super) fn with(mut self, name: &'static str, value: impl Display) -> Self {
        self.attributes.push((name, legal(&value.to_string())));
        self
    }

    /// Returns the element with this text in place of children.
    pub(super) fn containing(mut self, text: &str) -> Self {
        self.text = Some(legal(text));
        self
    }

    /// Returns the element with one more child.
    pub(super) fn child(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    /// Returns the element with more children.
    pub(super) fn children(mut self, children: impl IntoIterator<Item = Self>) -> Self {
        self.children.extend(children);
        self
    }

    /// Returns the element inside an element of this name.
    pub(super) fn within(self, name: &'static str) -> Self {
        Self::new(name).child(self)
    }

    /// Returns a document with this root, as text.
    pub(super) fn document(&self) -> String {
        let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
        // A vector takes every byte.
        let written = xml
            .write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))
            .and_then(|()| self.write(&mut xml));
        debug_assert!(written.is_ok(), "{written:?}");
        let mut text = String::from_utf8_lossy(&xml.into_inner()).into_owned();
        text.push('\n');
        text
    }

    fn write<W: Write>(&self, xml: &mut Writer<W>) -> io::Result<()> {
        let mut start = BytesStart::new(self.name);
        for (name, value) in &self.attributes {
            start.push_attribute((*name, value.as_str()));
        }
        if self.children.is_empty() && self.text.is_none() {
            return xml.write_event(Event::Empty(start));
        }
        xml.write_event(Event::Start(start))?;
        if let Some(text) = &self.text {
            xml.write_event(Event::Text(BytesText::new(text)))?;
        }
        self.children.iter().try_for_each(|child| child.write(xml))?;
        xml.write_event(Event::End(BytesEnd::new(self.name)))
    }
}

/// Returns the text without the control characters that XML 1.0 does not allow.
fn legal(text: &str) -> String {
    text.chars().filter(|c| !c.is_control() || matches!(c, '\n' | '\t')).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attributes_and_texts_are_escaped_and_hold_no_control_characters() {
        let element = Element::new("A").with("b", "<\"&\u{1b}>").child(Element::new("C").containing("1 < 2"));
        let text = element.document();
        assert!(text.contains("<A b=\"&lt;&quot;&amp;&gt;\">"), "{text}");
        assert!(text.contains("<C>1 &lt; 2</C>"), "{text}");
    }
}
