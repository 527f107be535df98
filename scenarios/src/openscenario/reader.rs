//! Reads attributes of elements: numbers and words. Their parameters are replaced before, see
//! [`super::structure`].

use std::path::{Path, PathBuf};

use super::dom::{ImportError, Node};

/// A file whose elements are read.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    pub(super) path: PathBuf,
}

impl Reader {
    pub(super) fn error(&self, node: &Node, message: impl Into<String>) -> ImportError {
        node.error(&self.path, message)
    }

    /// Returns an element that must be there.
    pub(super) fn child<'a>(&self, node: &'a Node, path: &[&str]) -> Result<&'a Node, ImportError> {
        node.at(path).ok_or_else(|| self.error(node, format!("it needs `{}`", path.join("/"))))
    }

    /// Returns the only child, such as the action inside a choice.
    pub(super) fn only<'a>(&self, node: &'a Node) -> Result<&'a Node, ImportError> {
        match &node.children[..] {
            [only] => Ok(only),
            _ => Err(self.error(node, "it needs exactly one element inside")),
        }
    }

    pub(super) fn text(&self, node: &Node, name: &str) -> Result<String, ImportError> {
        node.raw(name).map(str::to_owned).ok_or_else(|| self.error(node, format!("it needs `{name}`")))
    }

    pub(super) fn number(&self, node: &Node, name: &str) -> Result<f64, ImportError> {
        let text = self.text(node, name)?;
        match text.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(self.error(node, format!("`{name}` is `{text}`; a number is needed"))),
        }
    }

    pub(super) fn number_or(&self, node: &Node, name: &str, default: f64) -> Result<f64, ImportError> {
        if node.raw(name).is_some() { self.number(node, name) } else { Ok(default) }
    }

    /// Returns the path that an attribute names, relative to the folder of the file.
    pub(super) fn path_in(&self, node: &Node, name: &str) -> Result<PathBuf, ImportError> {
        Ok(self.path.parent().unwrap_or(Path::new("")).join(self.text(node, name)?))
    }
}

/// Returns whether an attribute is true; an absent one is false.
pub(super) fn is_true(node: &Node, name: &str) -> bool {
    matches!(node.raw(name), Some("true" | "1"))
}
