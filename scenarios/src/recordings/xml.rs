//! XML by events, with the line of each, within bounds.
//!
//! No entity is expanded: a document type declaration is refused, because entities can only be declared there, and with
//! them a small file that unfolds to gigabytes. Elements nested deeper than any scenario's are refused, and so is a
//! single tag or text that goes on and on.

use std::cell::Cell;
use std::io::{self, BufRead, Read};
use std::rc::Rc;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::RecordingProblem;
use super::rows::io_problem;
use super::source::Refusal;

/// The deepest nesting that is read; CommonRoad's own is 8.
const DEEPEST: usize = 64;

/// The longest tag, text or comment [bytes].
const LONGEST_EVENT: u64 = 1 << 20;

/// What happens next in an XML file.
#[derive(Debug)]
pub(super) enum Node {
    /// An element begins; its attributes are those that were asked for.
    Begin { name: String, attributes: Vec<(&'static str, String)> },
    /// An element ends, with the text in it.
    End { text: String },
    /// The file ends.
    EndOfFile,
}

/// An element's name and those of its attributes that are wanted.
type Begun = (String, Vec<(&'static str, String)>);

/// The elements of an XML file.
pub(super) struct Xml<R> {
    reader: Reader<Guard<R>>,
    buffer: Vec<u8>,
    text: String,
    /// The names of the elements that have begun and not ended.
    path: Vec<String>,
    meter: Rc<Meter>,
    /// An element without content ends in the next call.
    is_empty: bool,
    /// Attributes that are wanted.
    wanted: &'static [&'static str],
}

impl<R: BufRead> Xml<R> {
    pub(super) fn new(source: R, wanted: &'static [&'static str]) -> Self {
        let meter = Rc::<Meter>::default();
        let reader = Reader::from_reader(Guard { source, meter: Rc::clone(&meter) });
        let (buffer, text, path) = (Vec::new(), String::new(), Vec::new());
        Self { reader, buffer, text, path, meter, is_empty: false, wanted }
    }

    /// The line that is being read, counted from 1.
    pub(super) fn line(&self) -> u64 {
        self.meter.lines.get() + 1
    }

    /// The names of the elements that have begun and not ended, the root first.
    pub(super) fn path(&self) -> &[String] {
        &self.path
    }

    /// Leaves the element whose end was told: the names of the elements down to it.
    pub(super) fn leave(&mut self) -> Vec<String> {
        self.text.clear();
        std::mem::take(&mut self.path)
    }

    /// Goes on in the element around the one that was left.
    pub(super) fn back_to(&mut self, mut path: Vec<String>) {
        path.pop();
        self.path = path;
    }

    pub(super) fn refuse<T>(&self, what: impl Into<String>) -> Result<T, Refusal> {
        Err(Refusal::new(self.line(), RecordingProblem::Xml { what: what.into() }))
    }

    /// The next node. After an end, [`Xml::leave`] and [`Xml::back_to`] have to be called.
    pub(super) fn next(&mut self) -> Result<Node, Refusal> {
        if std::mem::take(&mut self.is_empty) {
            return Ok(Node::End { text: String::new() });
        }
        loop {
            self.buffer.clear();
            self.meter.allowed.set(LONGEST_EVENT);
            match self.reader.read_event_into(&mut self.buffer) {
                Ok(Event::Start(start)) => {
                    let begun = begin(&start, self.wanted);
                    return self.enter(begun);
                }
                Ok(Event::Empty(start)) => {
                    let begun = begin(&start, self.wanted);
                    self.is_empty = true;
                    return self.enter(begun);
                }
                Ok(Event::End(_)) => return Ok(Node::End { text: std::mem::take(&mut self.text) }),
                Ok(Event::Text(text)) => match std::str::from_utf8(&text) {
                    Ok(text) => self.text.push_str(text),
                    Err(_) => return Err(Refusal::new(self.line(), RecordingProblem::Binary)),
                },
                Ok(Event::DocType(_)) => {
                    return self.refuse("a document type declaration is not allowed, as it can declare entities");
                }
                Ok(Event::GeneralRef(_)) => self.text.push('&'),
                Ok(Event::Eof) => {
                    return match self.path.last() {
                        Some(open) => self.refuse(format!("the file ends inside the element `{open}`: it is cut")),
                        None => Ok(Node::EndOfFile),
                    };
                }
                Ok(Event::CData(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_)) => {}
                Err(quick_xml::Error::Io(error)) => {
                    let error = io::Error::new(error.kind(), error.to_string());
                    let problem = if self.meter.allowed.get() == 0 {
                        RecordingProblem::LineTooLong { allowed: LONGEST_EVENT }
                    } else {
                        io_problem(error)
                    };
                    return Err(Refusal::new(self.line(), problem));
                }
                Err(error) => return self.refuse(error.to_string()),
            }
            if self.text.len() as u64 > LONGEST_EVENT {
                return Err(Refusal::new(self.line(), RecordingProblem::LineTooLong { allowed: LONGEST_EVENT }));
            }
        }
    }

    fn enter(&mut self, begun: Result<Begun, String>) -> Result<Node, Refusal> {
        let (name, attributes) = begun.or_else(|what| self.refuse(what))?;
        if self.path.len() >= DEEPEST {
            return self.refuse(format!("elements are nested deeper than {DEEPEST}"));
        }
        self.text.clear();
        self.path.push(name.clone());
        Ok(Node::Begin { name, attributes })
    }
}

/// The name of an element, and the attributes that are wanted.
fn begin(start: &BytesStart<'_>, wanted: &[&'static str]) -> Result<Begun, String> {
    let text = |bytes: &[u8]| {
        std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| "a name is no text in UTF-8".to_owned())
    };
    let name = text(start.name().as_ref())?;
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| format!("the attributes of `{name}`: {error}"))?;
        if let Some(known) = wanted.iter().find(|known| known.as_bytes() == attribute.key.as_ref()) {
            attributes.push((*known, text(&attribute.value)?));
        }
    }
    Ok((name, attributes))
}

/// What was read, and what may still be read before the next event.
#[derive(Default)]
struct Meter {
    lines: Cell<u64>,
    allowed: Cell<u64>,
}

/// A source that counts lines and stops where one event is too long.
struct Guard<R> {
    source: R,
    meter: Rc<Meter>,
}

impl<R: BufRead> Read for Guard<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(buffer.len());
        buffer[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Guard<R> {
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
