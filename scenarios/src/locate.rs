//! Finds the line of a key in the text of a file.

use closecall_traffic::{KeyPath, Segment};
use toml_edit::{Document, Item, Table, TableLike, Value};

/// The text of a file, in which lines are counted, and the whole text of the scenario: with the
/// keys of the file's base, and with the settings of the command line.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    /// The text of the file.
    file: String,
    /// The whole text; `None` if it is the text of the file.
    whole: Option<String>,
}

impl Origin {
    pub(super) fn new(file: &str, whole: &str) -> Self {
        Self { file: file.to_owned(), whole: (file != whole).then(|| whole.to_owned()) }
    }

    /// Returns the line, counted from 1, of the deepest part of `path` that the whole text
    /// contains. Returns `None` if this part comes from the base or from a setting, and not from
    /// the file.
    pub(super) fn line_of(&self, path: &KeyPath) -> Option<usize> {
        let in_file = deepest(&self.file, path)?;
        let depth_of = |whole: &String| deepest(whole, path).map(|part| part.segments);
        let is_in_file = self.whole.as_ref().is_none_or(|whole| depth_of(whole) == Some(in_file.segments));
        is_in_file.then_some(in_file.line)
    }

    /// Returns the line, counted from 1, of a byte offset of `text`: the text of the file, or the
    /// text with the keys of its base. Returns `None` if the file does not contain the key there.
    pub(super) fn line_at(&self, text: &str, offset: usize) -> Option<usize> {
        match &self.whole {
            None => Some(line_at(text, offset)),
            Some(_) => self.line_of(&path_at(text, offset)),
        }
    }
}

/// Returns the line, counted from 1, of the deepest part of `path` that the text contains. Returns
/// `None` if the text contains no part of it.
pub(super) fn line_of(text: &str, path: &KeyPath) -> Option<usize> {
    deepest(text, path).map(|part| part.line)
}

/// The leading segments of a path that a text contains.
struct PathPart {
    /// Line of the last segment, counted from 1.
    line: usize,
    /// Number of segments.
    segments: usize,
}

/// Returns the deepest part of `path` that the text contains.
fn deepest(text: &str, path: &KeyPath) -> Option<PathPart> {
    let document = Document::parse(text).ok()?;
    let mut node = Node::Item(document.as_item());
    let (mut last_offset, mut segments) = (None, 0);
    for segment in &path.0 {
        let Some((child, offset)) = node.descend(segment) else { break };
        last_offset = offset.or(last_offset);
        segments += 1;
        node = child;
    }
    Some(PathPart { line: line_at(text, last_offset?), segments })
}

/// Returns the path of the last key or element of a list that begins at a byte offset or before it.
fn path_at(text: &str, offset: usize) -> KeyPath {
    let Ok(document) = Document::parse(text) else { return KeyPath::default() };
    let mut last = Located { offset: 0, path: KeyPath::default() };
    find_last(&Node::Item(document.as_item()), &KeyPath::default(), offset, &mut last);
    last.path
}

/// A path, and the byte offset at which its last segment begins.
struct Located {
    offset: usize,
    path: KeyPath,
}

/// Replaces `last` by each path below `path` that begins at the offset of `last` or behind it, but
/// not behind `limit`.
fn find_last(node: &Node<'_>, path: &KeyPath, limit: usize, last: &mut Located) {
    for segment in node.segments() {
        let Some((child, key_offset)) = node.descend(&segment) else { continue };
        let child_path = KeyPath(path.0.iter().cloned().chain([segment]).collect());
        // The header of a table begins before its key.
        let offset = child.header().or(key_offset);
        if let Some(offset) = offset.filter(|offset| (last.offset..=limit).contains(offset)) {
            *last = Located { offset, path: child_path.clone() };
        }
        find_last(&child, &child_path, limit, last);
    }
}

/// Returns the line, counted from 1, of a byte offset.
pub(super) fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

/// A node of the parsed text.
enum Node<'a> {
    Item(&'a Item),
    Table(&'a Table),
    Value(&'a Value),
}

impl<'a> Node<'a> {
    /// Returns the node that `segment` identifies below this one, and its byte offset if it is
    /// known.
    fn descend(&self, segment: &Segment) -> Option<(Self, Option<usize>)> {
        match segment {
            Segment::Key(key) => {
                let (key, item) = self.table()?.get_key_value(key)?;
                let offset = key.span().or_else(|| item.span()).map(|span| span.start);
                Some((Self::Item(item), offset))
            }
            Segment::Index(index) => self.element(*index),
        }
    }

    /// Returns the steps to the nodes directly below this one.
    fn segments(&self) -> Vec<Segment> {
        let count = match self {
            Self::Item(Item::ArrayOfTables(tables)) => tables.len(),
            Self::Item(item) => item.as_array().map_or(0, toml_edit::Array::len),
            Self::Value(value) => value.as_array().map_or(0, toml_edit::Array::len),
            Self::Table(_) => 0,
        };
        let keys = self.table().into_iter().flat_map(|table| table.iter());
        keys.map(|(key, _)| Segment::Key(key.to_owned())).chain((0..count).map(Segment::Index)).collect()
    }

    /// Returns the byte offset of the header of a table that has one.
    fn header(&self) -> Option<usize> {
        let table = match self {
            Self::Item(Item::Table(table)) => table,
            Self::Table(table) => *table,
            _ => return None,
        };
        table.span().map(|span| span.start)
    }

    fn table(&self) -> Option<&'a dyn TableLike> {
        match self {
            Self::Item(item) => item.as_table_like(),
            Self::Table(table) => Some(*table),
            Self::Value(value) => value.as_inline_table().map(|table| table as &dyn TableLike),
        }
    }

    fn element(&self, index: usize) -> Option<(Self, Option<usize>)> {
        let array = match self {
            Self::Item(Item::ArrayOfTables(tables)) => {
                let table = tables.get(index)?;
                return Some((Self::Table(table), table.span().map(|span| span.start)));
            }
            Self::Item(item) => item.as_array()?,
            Self::Value(value) => value.as_array()?,
            Self::Table(_) => return None,
        };
        let value = array.get(index)?;
        Some((Self::Value(value), value.span().map(|span| span.start)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
name = 'x'
[[actor]]
id = 'ego'
driver = { ego-stack = { acc = { time-gap-s = 9 } } }
[[actor]]
id = 'rear'
[[actor.event]]
id = 'brakes'
then = { brake = { deceleration-mps2 = -1 } }
";

    fn line(path: &[&str]) -> Option<usize> {
        let segment = |part: &&str| match part.parse() {
            Ok(index) => Segment::Index(index),
            Err(_) => Segment::Key((*part).to_owned()),
        };
        line_of(TEXT, &KeyPath(path.iter().map(segment).collect()))
    }

    #[test]
    fn a_key_is_found_in_tables_arrays_and_inline_tables() {
        assert_eq!(line(&["name"]), Some(1));
        assert_eq!(line(&["actor", "0", "driver", "ego-stack", "acc", "time-gap-s"]), Some(4));
        assert_eq!(line(&["actor", "1", "event", "0", "then", "brake", "deceleration-mps2"]), Some(9));
    }

    #[test]
    fn the_key_at_an_offset_is_found_in_tables_arrays_and_inline_tables() {
        for (words, path) in [
            ("'x'", "name"),
            ("9 }", "actor[0].driver.ego-stack.acc.time-gap-s"),
            ("[[actor]]\nid = 'rear'", "actor[1]"),
            ("'rear'", "actor[1].id"),
            ("[[actor.event]]", "actor[1].event[0]"),
            ("-1", "actor[1].event[0].then.brake.deceleration-mps2"),
        ] {
            assert_eq!(path_at(TEXT, TEXT.find(words).unwrap()).to_string(), path, "{words}");
        }
        assert_eq!(path_at("[a.b]\nc = [1, [2, 3]]", "[a.b]\nc = [1, [2, ".len()).to_string(), "a.b.c[1][1]");
    }

    #[test]
    fn a_key_of_the_base_or_of_a_setting_has_no_line() {
        let path = |keys: &[&str]| KeyPath(keys.iter().map(|key| Segment::Key((*key).to_owned())).collect());
        let origin = Origin::new("base = 'x'\n[a]\nb = 1\n", "[a]\nb = 1\nc = 2\n[d]\ne = 3\n");
        assert_eq!(origin.line_of(&path(&["a", "b"])), Some(3));
        assert_eq!(origin.line_of(&path(&["a", "c"])), None, "of the base");
        assert_eq!(origin.line_of(&path(&["d", "e"])), None);
        assert_eq!(origin.line_of(&path(&["a", "x"])), Some(2), "of none of both");
    }

    #[test]
    fn a_missing_key_is_located_at_the_table_that_should_contain_it() {
        assert_eq!(line(&["actor", "1", "vehicle"]), Some(5));
        assert_eq!(line(&["duration-s"]), None);
    }
}
