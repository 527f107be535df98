//! Reads attributes of elements: numbers and words, with their parameters replaced.

use std::path::{Path, PathBuf};

use super::dom::{ImportError, Node};
use super::formula::{Values, resolve};

/// A file with the values of its parameters.
#[derive(Clone, Debug)]
pub(super) struct Reader {
    pub(super) path: PathBuf,
    pub(super) values: Values,
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

    /// Returns an attribute as text, or `None` if it is absent.
    pub(super) fn optional(&self, node: &Node, name: &str) -> Result<Option<String>, ImportError> {
        let resolved = node.raw(name).map(|text| resolve(text, &self.values));
        resolved.transpose().map_err(|message| self.error(node, format!("`{name}`: {message}")))
    }

    pub(super) fn text(&self, node: &Node, name: &str) -> Result<String, ImportError> {
        self.optional(node, name)?.ok_or_else(|| self.error(node, format!("it needs `{name}`")))
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

    pub(super) fn is_true(&self, node: &Node, name: &str) -> Result<bool, ImportError> {
        Ok(self.optional(node, name)?.is_some_and(|text| text == "true" || text == "1"))
    }

    /// Returns the path that an attribute names, relative to the folder of the file.
    pub(super) fn path_in(&self, node: &Node, name: &str) -> Result<PathBuf, ImportError> {
        Ok(self.path.parent().unwrap_or(Path::new("")).join(self.text(node, name)?))
    }
}
