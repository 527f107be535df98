//! Finds the line of a key in the text of a file.

use closecall_traffic::{KeyPath, Segment};
use toml_edit::{Document, Item, Table, TableLike, Value};

/// Returns the line, counted from 1, of the deepest part of `path` that the text contains. Returns
/// `None` if the text contains no part of it.
pub(super) fn line_of(text: &str, path: &KeyPath) -> Option<usize> {
    let document = Document::parse(text).ok()?;
    let mut node = Node::Item(document.as_item());
    let mut offset = None;
    for segment in &path.0 {
        let Some((next, at)) = node.descend(segment) else { break };
        offset = at.or(offset);
        node = next;
    }
    offset.map(|offset| line_at(text, offset))
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
                let (found_key, item) = self.table()?.get_key_value(key)?;
                let at = found_key.span().or_else(|| item.span()).map(|span| span.start);
                Some((Self::Item(item), at))
            }
            Segment::Index(index) => self.element(*index),
        }
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
    fn a_missing_key_is_located_at_the_table_that_should_contain_it() {
        assert_eq!(line(&["actor", "1", "vehicle"]), Some(5));
        assert_eq!(line(&["duration-s"]), None);
    }
}
