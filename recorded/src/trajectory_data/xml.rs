//! Bounded reading of XML by events, with the line number of each event.
//!
//! The reader expands no entities. It rejects document type declarations, because only they can
//! declare entities, and entities let a small file expand to gigabytes. It also rejects elements
//! nested deeper than in any scenario, and a single tag or text that exceeds a maximum length.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::error::TrajectoryFileProblem;
use super::rows::io_problem;
use super::source::ReadError;

/// Maximum nesting depth; CommonRoad's own is 8.
const MAX_DEPTH: usize = 64;

/// Maximum length of a tag, text or comment (bytes).
const MAX_EVENT_BYTES: u64 = 1 << 20;

/// The next event in an XML file.
#[derive(Debug)]
pub(super) enum Node {
    /// An element begins. Only the requested attributes are included.
    Begin { name: String, attributes: Vec<(&'static str, String)> },
    /// An element ends; `text` is its text.
    End { text: String },
    /// The file ends.
    EndOfFile,
}

/// The name of an element and its requested attributes.
type StartTag = (String, Vec<(&'static str, String)>);

/// The stream of a file's XML elements.
pub(super) struct Xml<R> {
    reader: Reader<BoundedSource<R>>,
    buffer: Vec<u8>,
    text: String,
    /// Names of the open elements, the root first.
    path: Vec<String>,
    meter: Rc<Meter>,
    /// `true` if the latest element has no content, so that it ends with the next call.
    is_empty: bool,
    /// Names of the requested attributes.
    wanted: &'static [&'static str],
    /// The format of the file, for messages.
    format: &'static str,
}

impl<R: BufRead> Xml<R> {
    /// Creates a reader that reports the `wanted` attributes.
    pub(super) fn new(source: R, wanted: &'static [&'static str], format: &'static str) -> Self {
        let meter = Rc::<Meter>::default();
        let reader = Reader::from_reader(BoundedSource { source, meter: Rc::clone(&meter) });
        let (buffer, text, path) = (Vec::new(), String::new(), Vec::new());
        Self { reader, buffer, text, path, meter, is_empty: false, wanted, format }
    }

    /// Returns the current line, counted from 1.
    pub(super) fn line(&self) -> u64 {
        self.meter.lines.get() + 1
    }

    /// Returns the names of the open elements, the root first.
    pub(super) fn path(&self) -> &[String] {
        &self.path
    }

    /// Hands over the path of the element that has just ended, from the root down to it.
    pub(super) fn leave(&mut self) -> Vec<String> {
        self.text.clear();
        std::mem::take(&mut self.path)
    }

    /// Takes back the path from [`Xml::leave`] and continues in the parent of its last element.
    pub(super) fn back_to(&mut self, mut path: Vec<String>) {
        path.pop();
        self.path = path;
    }

    /// Returns an error at the current line.
    pub(super) fn fail<T>(&self, reason: impl Into<String>) -> Result<T, ReadError> {
        let problem = TrajectoryFileProblem::Unreadable { format: self.format, reason: reason.into() };
        Err(ReadError::new(self.line(), problem))
    }

    /// Returns the next node. After an end node, the caller must call [`Xml::leave`] and
    /// [`Xml::back_to`].
    pub(super) fn next(&mut self) -> Result<Node, ReadError> {
        if std::mem::take(&mut self.is_empty) {
            return Ok(Node::End { text: String::new() });
        }
        loop {
            self.buffer.clear();
            self.meter.allowed.set(MAX_EVENT_BYTES);
            match self.reader.read_event_into(&mut self.buffer) {
                Ok(Event::Start(start)) => {
                    let start_tag = parse_start_tag(&start, self.wanted);
                    return self.enter(start_tag);
                }
                Ok(Event::Empty(start)) => {
                    let start_tag = parse_start_tag(&start, self.wanted);
                    self.is_empty = true;
                    return self.enter(start_tag);
                }
                Ok(Event::End(_)) => return Ok(Node::End { text: std::mem::take(&mut self.text) }),
                Ok(Event::Text(text)) => match std::str::from_utf8(&text) {
                    Ok(text) => self.text.push_str(text),
                    Err(_) => return Err(ReadError::new(self.line(), TrajectoryFileProblem::Binary)),
                },
                Ok(Event::DocType(_)) => {
                    return self.fail("a document type declaration is not allowed, as it can declare entities");
                }
                Ok(Event::GeneralRef(_)) => self.text.push('&'),
                Ok(Event::Eof) => {
                    return match self.path.last() {
                        Some(open) => self.fail(format!("the file ends inside the element `{open}`: it is cut")),
                        None => Ok(Node::EndOfFile),
                    };
                }
                Ok(Event::CData(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_)) => {}
                Err(quick_xml::Error::Io(error)) => {
                    let error = io::Error::new(error.kind(), error.to_string());
                    let problem = if self.meter.allowed.get() == 0 {
                        TrajectoryFileProblem::LineTooLong { allowed: MAX_EVENT_BYTES }
                    } else {
                        io_problem(error)
                    };
                    return Err(ReadError::new(self.line(), problem));
                }
                Err(error) => return self.fail(error.to_string()),
            }
            if self.text.len() as u64 > MAX_EVENT_BYTES {
                return Err(ReadError::new(
                    self.line(),
                    TrajectoryFileProblem::LineTooLong { allowed: MAX_EVENT_BYTES },
                ));
            }
        }
    }

    /// Pushes an element that begins onto the path.
    fn enter(&mut self, start_tag: Result<StartTag, String>) -> Result<Node, ReadError> {
        let (name, attributes) = start_tag.or_else(|reason| self.fail(reason))?;
        if self.path.len() >= MAX_DEPTH {
            return self.fail(format!("elements are nested deeper than {MAX_DEPTH}"));
        }
        self.text.clear();
        self.path.push(name.clone());
        Ok(Node::Begin { name, attributes })
    }
}

/// Parses the name of an element and its requested attributes.
fn parse_start_tag(start: &BytesStart<'_>, wanted: &[&'static str]) -> Result<StartTag, String> {
    let text = |bytes: &[u8]| {
        std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| "a name is not text in UTF-8".to_owned())
    };
    let name = text(start.name().as_ref())?;
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| format!("the attributes of `{name}`: {error}"))?;
        if let Some(wanted_name) = wanted.iter().find(|wanted_name| wanted_name.as_bytes() == attribute.key.as_ref()) {
            attributes.push((*wanted_name, text(&attribute.value)?));
        }
    }
    Ok((name, attributes))
}

/// Counters shared by the XML reader and its source: lines read, and bytes still permitted before
/// the next event.
#[derive(Default)]
struct Meter {
    lines: Cell<u64>,
    allowed: Cell<u64>,
}

/// A source that counts lines and stops reading if a single event is too long.
struct BoundedSource<R> {
    source: R,
    meter: Rc<Meter>,
}

impl<R: BufRead> Read for BoundedSource<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(buffer.len());
        buffer[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for BoundedSource<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.meter.allowed.get() == 0 {
            return Err(io::Error::other("one element or text is too long"));
        }
        let buffer = self.source.fill_buf()?;
        let allowed = usize::try_from(self.meter.allowed.get()).unwrap_or(usize::MAX);
        let length = buffer.len().min(allowed);
        Ok(&buffer[..length])
    }

    fn consume(&mut self, count: usize) {
        if let Ok(buffer) = self.source.fill_buf() {
            let lines = buffer.iter().take(count).filter(|byte| **byte == b'\n').count() as u64;
            self.meter.lines.set(self.meter.lines.get() + lines);
        }
        self.meter.allowed.set(self.meter.allowed.get().saturating_sub(count as u64));
        self.source.consume(count);
    }
}
