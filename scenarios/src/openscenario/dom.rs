//! An XML document as a tree whose elements know their lines.

use std::path::{Path, PathBuf};

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Largest depth of elements: ten times the depth of a scenario.
const MOST_DEPTH: usize = 200;
/// Largest number of elements: a road network of a city has some hundred thousand.
const MOST_ELEMENTS: usize = 2_000_000;

/// A document that cannot be used, with its file, the line and the element.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("failed to import {}:{line}: {}{message}", path.display(), if element.is_empty() { String::new() } else { format!("`{element}`: ") })]
pub struct ImportError {
    /// The file.
    pub path: PathBuf,
    /// The line, counted from 1.
    pub line: usize,
    /// The element, or nothing if the document is no XML.
    pub element: String,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// An attribute.
#[derive(Clone, Debug)]
pub(super) struct Attribute {
    /// The name with its prefix, if it has one.
    pub(super) key: String,
    pub(super) value: String,
}

impl Attribute {
    /// Returns the name without its prefix.
    fn local_name(&self) -> &str {
        self.key.split_once(':').map_or(self.key.as_str(), |(_, name)| name)
    }

    /// Returns true for an attribute of XML or of its schemas, which is none of the format.
    pub(super) fn is_of_xml(&self) -> bool {
        let prefix = self.key.split_once(':').map_or(self.key.as_str(), |(prefix, _)| prefix);
        match prefix.len() == self.key.len() {
            true => prefix == "xmlns",
            false => matches!(prefix, "xml" | "xmlns" | "xsi"),
        }
    }
}

/// An element with its attributes and children.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    pub(super) name: String,
    /// Line on which its start tag begins.
    pub(super) line: usize,
    /// Number of the element in the document.
    pub(super) id: usize,
    pub(super) attributes: Vec<Attribute>,
    pub(super) children: Vec<Node>,
    pub(super) text: String,
}

impl Node {
    /// Returns an attribute as it stands in the document.
    pub(super) fn raw(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|attribute| attribute.key == name).map(|attribute| attribute.value.as_str())
    }

    /// Returns the first child of this name.
    pub(super) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// Returns all children of this name.
    pub(super) fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |child| child.name == name)
    }

    /// Returns the element at the end of a path of names.
    pub(super) fn at(&self, path: &[&str]) -> Option<&Self> {
        path.iter().try_fold(self, |node, name| node.child(name))
    }

    /// Returns the hash of all elements but the header, so that an edited file is noticed. White
    /// space between elements does not count.
    pub(super) fn content_hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        self.children.iter().filter(|child| child.name != "FileHeader").for_each(|child| child.add_to(&mut hasher));
        hasher.finalize().to_string()
    }

    fn add_to(&self, hasher: &mut blake3::Hasher) {
        let mut add = |text: &str| {
            hasher.update(&text.len().to_le_bytes());
            hasher.update(text.as_bytes());
        };
        add(&self.name);
        add(self.text.trim());
        add(&self.attributes.len().to_string());
        for attribute in &self.attributes {
            add(attribute.local_name());
            add(&attribute.value);
        }
        add(&self.children.len().to_string());
        self.children.iter().for_each(|child| child.add_to(hasher));
    }

    /// Returns an error at this element.
    pub(super) fn error(&self, path: &Path, message: impl Into<String>) -> ImportError {
        ImportError { path: path.to_owned(), line: self.line, element: self.name.clone(), message: message.into() }
    }
}

/// The message about text that belongs to no element.
const OUTSIDE: &str = "text is outside of the root element";

/// Parses a document.
///
/// Only the entities of XML itself are accepted: quick-xml expands none, and no document grows
/// while it is read.
///
/// # Errors
/// [`ImportError`] if the text is no XML document, has a document type declaration, or is too deep
/// or too large.
pub(super) fn parse(path: &Path, text: &str) -> Result<Node, ImportError> {
    if let Some((at, character)) = text.char_indices().find(|(_, character)| is_forbidden(*character)) {
        let line = 1 + text[..at].matches('\n').count();
        let message = forbidden(character);
        return Err(ImportError { path: path.to_owned(), line, element: String::new(), message });
    }
    let mut reader = Reader::from_str(text);
    reader.config_mut().expand_empty_elements = true;
    let (mut open, mut root): (Vec<Node>, Option<Node>) = (Vec::new(), None);
    let (mut count, mut line, mut counted) = (0, 1, 0);
    loop {
        let event = reader.read_event();
        // An element is where its start tag begins, which can have many lines.
        let begins = line;
        let at = usize::try_from(reader.buffer_position()).unwrap_or(usize::MAX).min(text.len());
        line += text.as_bytes()[counted.min(at)..at].iter().filter(|byte| **byte == b'\n').count();
        counted = at;
        let element = open.last().map(|node| node.name.clone()).unwrap_or_default();
        let line_of_event = if matches!(event, Ok(Event::Start(_))) { begins } else { line };
        let fail = |message: String| Err(ImportError { path: path.to_owned(), line: line_of_event, element, message });
        match event {
            Err(error) => return fail(format!("it is not an XML document: {error}")),
            Ok(Event::DocType(_)) => return fail("a document type declaration is not allowed".to_owned()),
            Ok(Event::Start(_)) if root.is_some() => return fail("the document has a second root element".to_owned()),
            Ok(Event::Start(start)) => {
                count += 1;
                if open.len() >= MOST_DEPTH || count > MOST_ELEMENTS {
                    return fail(format!("more than {MOST_DEPTH} levels or {MOST_ELEMENTS} elements"));
                }
                match node(&start, begins) {
                    Ok(node) => open.push(Node { id: count, ..node }),
                    Err(message) => return fail(message),
                }
            }
            Ok(Event::Text(part)) => match (part.decode(), open.last_mut()) {
                (Ok(part), Some(node)) => node.text.push_str(&part),
                (Err(error), _) => return fail(format!("it is not text: {error}")),
                (Ok(part), None) if part.trim_start_matches('\u{feff}').trim().is_empty() => {}
                (Ok(_), None) => return fail(OUTSIDE.to_owned()),
            },
            Ok(Event::CData(_) | Event::GeneralRef(_)) if open.is_empty() => return fail(OUTSIDE.to_owned()),
            Ok(Event::CData(part)) => {
                if let Some(node) = open.last_mut() {
                    node.text.push_str(&String::from_utf8_lossy(&part));
                }
            }
            Ok(Event::GeneralRef(name)) => {
                let name = String::from_utf8_lossy(&name).into_owned();
                match quick_xml::escape::unescape(&format!("&{name};")) {
                    Ok(text) => {
                        if let Some(node) = open.last_mut() {
                            node.text.push_str(&text);
                        }
                    }
                    Err(_) => return fail(format!("the entity `&{name};` is not known")),
                }
            }
            Ok(Event::End(_)) => match (open.pop(), open.last_mut()) {
                (Some(done), Some(parent)) => parent.children.push(done),
                (Some(done), None) => root = Some(done),
                (None, _) => return fail("an element ends that did not begin".to_owned()),
            },
            Ok(Event::Eof) => match root {
                Some(root) => return Ok(root),
                None => return fail("the document ends before its root element does".to_owned()),
            },
            Ok(_) => {}
        }
    }
}

/// Returns true for a character that no XML document can have.
const fn is_forbidden(character: char) -> bool {
    matches!(character, '\0'..='\u{8}' | '\u{b}' | '\u{c}' | '\u{e}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}')
}

fn forbidden(character: char) -> String {
    format!("the character U+{:04X} is not allowed in an XML document", u32::from(character))
}

fn node(start: &BytesStart<'_>, line: usize) -> Result<Node, String> {
    let name = String::from_utf8_lossy(start.local_name().as_ref()).into_owned();
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| format!("`{name}`: {error}"))?;
        let key = String::from_utf8_lossy(attribute.key.as_ref()).into_owned();
        let raw = String::from_utf8_lossy(&attribute.value).into_owned();
        let value = quick_xml::escape::unescape(&raw).map_err(|error| format!("`{name}`: `{key}`: {error}"))?;
        if let Some(character) = value.chars().find(|character| is_forbidden(*character)) {
            return Err(format!("`{name}`: `{key}`: {}", forbidden(character)));
        }
        attributes.push(Attribute { key, value: value.into_owned() });
    }
    Ok(Node { name, line, attributes, ..Node::default() })
}

/// Returns the finite number in an attribute.
///
/// # Errors
/// [`ImportError`] if the attribute is absent, or no finite number.
pub(super) fn number(path: &Path, node: &Node, name: &str) -> Result<f64, ImportError> {
    let Some(text) = node.raw(name) else { return Err(node.error(path, format!("it needs `{name}`"))) };
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(node.error(path, format!("`{name}` is `{text}`; a number is needed"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_has_one_root_and_nothing_beside_it() {
        let parsed =
            |text: &str| parse(Path::new("a.xml"), text).map(|root| root.name).map_err(|error| error.to_string());
        let around = "\u{feff}<?xml version=\"1.0\"?>\n<!-- one -->\n<a><b/></a>\n<!-- two --><?three?>\n";
        assert_eq!(parsed(around), Ok("a".to_owned()));
        for (text, line, word) in [
            ("<a/>\n<b/>", 2, "a second root element"),
            ("<a/>\n<a>", 2, "a second root element"),
            ("<a/>\n\nand more", 3, "text is outside of the root element"),
            ("before <a/>", 1, "text is outside of the root element"),
            ("<a/><![CDATA[x]]>", 1, "text is outside of the root element"),
            ("<a/>&lt;", 1, "text is outside of the root element"),
            ("<a/>\n</a>", 2, "it is not an XML document"),
            ("<!-- nothing -->", 1, "ends before its root element does"),
        ] {
            let message = parsed(text).unwrap_err();
            assert!(message.contains(word) && message.contains(&format!("a.xml:{line}")), "{text}: {message}");
        }
    }

    #[test]
    fn an_element_is_on_the_line_on_which_its_start_tag_begins() {
        let text = "<a>\n  text\n  <b\n    x=\"1\"\n    y=\"2\n\"\n  /><c/>\n  <d\n  >\n  <!-- \n --><e/></d></a>";
        let root = parse(Path::new("a.xml"), text).unwrap();
        let lines: Vec<_> = root.children.iter().map(|child| (child.name.as_str(), child.line)).collect();
        assert_eq!((root.line, &lines[..]), (1, &[("b", 3), ("c", 7), ("d", 8)][..]));
        assert_eq!(root.at(&["d", "e"]).map(|node| node.line), Some(11));
        let wrong = text.replace("y=\"2\n\"", "x=\"2\n\"");
        let error = parse(Path::new("a.xml"), &wrong).unwrap_err();
        assert_eq!((error.line, error.element.as_str()), (3, "a"), "{error}");
    }
}
