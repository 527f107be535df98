//! Whether a file shows which side is left.
//!
//! ```text
//!   ◀──■────────────    oncoming traffic is on the left: the positions are as documented
//!   ────────────■──▶
//! ```
//!
//! A mirrored file has every lane change on the wrong side. Where the file names lanes, they are compared
//! with the positions; see `axes`, `lane_sides` and `orientation`. Lateral positions that count from the
//! left edge of the road are positive. Otherwise, only the oncoming traffic shows the side. Speeds do not:
//! in windows of US-101, up to nine of ten vehicles are faster than the vehicle to their left.

use closecall_traffic::Side;

use super::file_layout::Layout;
use super::source::{Row, RowSource};

/// What shows which side is left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sides {
    /// The lateral position or the names of lanes by their definition, the oncoming traffic, or the caller.
    Shown,
    /// Nothing.
    Unknown,
    /// The oncoming traffic is on the right.
    Mirrored,
    /// The vehicles are to the left of the left edge, from which the layout counts.
    BesideTheRoad,
}

/// Share of the rows to the left of the left edge above which the lateral position points to the left (-): of
/// a road that begins elsewhere, some vehicles are to the right. An assumption with a plausible range of 0.8 to 1.
const BESIDE_SHARE: f64 = 0.95;

impl Sides {
    /// Returns what the beginning of a file shows, whose lateral position the caller mirrors if
    /// `is_mirrored`.
    pub(super) fn of(rows: &[Row], source: &dyn RowSource, is_mirrored: bool) -> Self {
        let oncoming = source.oncoming_side().map(|side| if is_mirrored { side.opposite() } else { side });
        match oncoming {
            Some(Side::Left) => Self::Shown,
            Some(Side::Right) => Self::Mirrored,
            None if counts_from_left_edge(source) && are_beside(rows) => Self::BesideTheRoad,
            None if is_mirrored || source.names_sides() => Self::Shown,
            None => Self::Unknown,
        }
    }

    /// Returns what a reader of results has to know.
    pub(super) fn warning(self) -> Option<&'static str> {
        match self {
            Self::Shown => None,
            Self::Unknown => Some(
                "nothing in the file but its positions shows which side is left: if they are mirrored, left and right lane changes \
                 are exchanged",
            ),
            Self::Mirrored => Some(
                "the oncoming traffic is on the right: the file is mirrored, so that left is called right, or its traffic drives on \
                 the left",
            ),
            Self::BesideTheRoad => Some(
                "the vehicles drive to the left of the left edge of lane 1, from which lateral positions count to the right: the \
                 positions are mirrored, so that left is called right, or they count from elsewhere",
            ),
        }
    }

    /// Returns `true` if the warning is a doubt about all lane changes.
    pub(super) fn is_doubt(self) -> bool {
        matches!(self, Self::Mirrored | Self::BesideTheRoad)
    }
}

/// Returns `true` if the file states lateral positions, which count from the left edge of lane 1.
fn counts_from_left_edge(source: &dyn RowSource) -> bool {
    matches!(source.info().layout, Layout::Plain | Layout::Ngsim18 | Layout::Ngsim25)
}

/// Returns `true` if nearly all rows are to the left of the left edge.
fn are_beside(rows: &[Row]) -> bool {
    rows.iter().filter(|row| row.d_m > 0.0).count() as f64 > BESIDE_SHARE * rows.len() as f64
}
