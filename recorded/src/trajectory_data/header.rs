//! The header of a text file.

use super::error::TrajectoryFileProblem;
use super::rows::{Fields, Separator};

/// The column names of a header in lower case, because NGSIM's spelling varies.
pub(super) struct Header {
    names: Vec<String>,
}

impl Header {
    /// Creates a header from its column names.
    pub(super) fn new<'l>(names: impl Iterator<Item = &'l str>) -> Self {
        Self { names: names.map(str::to_ascii_lowercase).collect() }
    }

    /// Splits `line` into column names. Also returns their separator and their number.
    pub(super) fn parse(line: &str) -> Result<(Self, Separator, usize), TrajectoryFileProblem> {
        let separator = match (line.contains(';'), line.contains(',')) {
            (true, _) => Separator::Semicolon,
            (false, true) => Separator::Comma,
            (false, false) => Separator::Blank,
        };
        let mut fields = Fields::default();
        fields.split(line, separator)?;
        Ok((Self::new((0..fields.len()).map(|index| fields.get(line, index))), separator, fields.len()))
    }

    /// Returns the index of a column, or `None` if it is absent.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|title| title.eq_ignore_ascii_case(name))
    }

    /// Returns the index of a required column.
    pub(super) fn require(&self, name: &'static str, layout: &'static str) -> Result<usize, TrajectoryFileProblem> {
        self.find(name).ok_or(TrajectoryFileProblem::MissingColumn { name, layout })
    }

    /// Returns how many of these `names` the header contains.
    pub(super) fn count(&self, names: &[&str]) -> usize {
        names.iter().filter(|name| self.find(name).is_some()).count()
    }

    /// Rejects a header that contains a name twice.
    pub(super) fn check_no_duplicates(&self) -> Result<(), TrajectoryFileProblem> {
        for (index, name) in self.names.iter().enumerate() {
            if self.names[..index].contains(name) {
                return Err(TrajectoryFileProblem::DuplicateColumn { name: name.clone() });
            }
        }
        Ok(())
    }

    /// Returns `true` if all names are numbers, so that the line is a row instead of a header.
    pub(super) fn is_numeric(&self) -> bool {
        self.names.iter().all(|name| name.parse::<f64>().is_ok())
    }
}
