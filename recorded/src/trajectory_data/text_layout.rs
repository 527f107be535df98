//! The interface of the text layouts, which have one row per line.

use closecall_traffic::Side;

use super::class_names::UnknownClass;
use super::error::TrajectoryFileProblem;
use super::fields::FieldError;
use super::rows::Fields;
use super::source::{FileInfo, Row};

/// The columns of one text layout.
pub(super) trait TextLayout {
    /// Returns the knowledge about the file so far, apart from a name that the rows state.
    fn info(&self) -> FileInfo;

    /// Returns the column that names the data set and its value in this row, or `None` if the
    /// layout has no such column.
    fn data<'l>(&self, line: &'l str, fields: &Fields) -> Option<(&'static str, &'l str)>;

    /// Parses one line into a row in SI units. Returns `None` if the line yields no row.
    ///
    /// # Errors
    /// Returns the column and the problem.
    fn parse(&mut self, line: &str, fields: &Fields) -> Result<Option<Row>, FieldError>;

    /// Returns the unknown names of vehicle classes found so far.
    fn unknown_classes(&self) -> &[UnknownClass] {
        &[]
    }

    /// Returns what a reader of results has to know of the file.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// Returns `true` if a warning says why lane changes may be wrong or missing.
    fn is_in_doubt(&self) -> bool {
        false
    }

    /// Checks that the columns which are not read agree with the lateral position, which is mirrored
    /// if `is_mirrored`, in the rows so far.
    ///
    /// # Errors
    /// Returns the columns that contradict it.
    fn check_sides(&self, _is_mirrored: bool) -> Result<(), TrajectoryFileProblem> {
        Ok(())
    }

    /// Returns `true` if the file states, apart from its positions, which lane is to the left.
    fn names_sides(&self) -> bool {
        true
    }

    /// Returns `true` if rows are in the lanes at their positions, because the file states no lanes and has no map.
    fn derives_lanes(&self) -> bool {
        false
    }

    /// Returns the side on which vehicles pass the oncoming traffic, if the positions show it.
    fn oncoming_side(&self) -> Option<Side> {
        None
    }

    /// States that the position along the road falls in the direction of travel, so that speeds may be
    /// negative. It is called before the first row.
    fn expect_reversed(&mut self) {}

    /// States that no lane is taken as recorded, so that rows may state none. It is called before the first
    /// row.
    fn expect_no_lanes(&mut self) {}

    /// Checks, at the end of the file, that nothing is missing.
    ///
    /// # Errors
    /// Returns what is missing. Each further call returns the next missing item.
    fn end(&mut self) -> Result<(), FieldError> {
        Ok(())
    }
}
