//! The lane sections of an OpenDRIVE road: where along the road each driving lane is.
//!
//! The import refuses a vehicle that drives where its lane is missing. It refuses a vehicle whose lane
//! has another number further on, too, unless the lanes have a [`Numbering`] of their own.

use std::collections::BTreeSet;
use std::path::Path;

use super::dom::{ImportError, Node};
use super::entry_lane;
use super::numbering::Numbering;

/// A lane section.
#[derive(Clone, Debug)]
struct LaneSection {
    /// Position at which it begins (m).
    from_m: f64,
    /// The driving lanes along the road.
    lanes: BTreeSet<i32>,
    /// Why no vehicle can drive on into the next section: a lane has another number there.
    renumbered: Option<ImportError>,
}

/// The lane sections of a road.
#[derive(Clone, Debug)]
pub(super) struct LaneSections(Vec<LaneSection>);

impl LaneSections {
    /// Reads the lane sections. `side` is the side of the reference line with the lanes along the
    /// road.
    pub(super) fn read(path: &Path, lanes: &Node, side: &str) -> Self {
        let section = |node: &Node| {
            let (from_m, lanes) = entry_lane::section(node, side).unwrap_or_default();
            let renumbered = lanes.iter().find_map(|(id, lane)| {
                let successor = lane.at(&["link", "successor"])?;
                let next: i32 = successor.raw("id")?.trim().parse().ok()?;
                let message = format!("lane {id} goes on as lane {next}: a lane of a scenario keeps its number");
                (next != *id).then(|| successor.error(path, message))
            });
            LaneSection { from_m, lanes: lanes.into_keys().collect(), renumbered }
        };
        let mut sections: Vec<LaneSection> = lanes.all("laneSection").map(section).collect();
        // The successors of the last section are lanes of another road.
        if let Some(last) = sections.last_mut() {
            last.renumbered = None;
        }
        Self(sections)
    }

    /// Gives the lanes the numbers that they have in the import.
    pub(super) fn renumber(&mut self, numbering: &Numbering) {
        for (index, section) in self.0.iter_mut().enumerate() {
            section.renumbered = None;
            section.lanes = section.lanes.iter().filter_map(|id| numbering.number(index, *id)).collect();
        }
    }

    /// Returns whether a driving lane begins or ends within the road.
    pub(super) fn differ(&self) -> bool {
        self.0.windows(2).any(|pair| pair[0].lanes != pair[1].lanes)
    }

    /// Returns the number of the section at a position (m), from 0. Beyond an end of the road it is
    /// the section at that end.
    pub(super) fn at(&self, s_m: f64) -> usize {
        self.0.partition_point(|section| section.from_m <= s_m).saturating_sub(1)
    }

    /// Returns whether a section has this driving lane.
    pub(super) fn has(&self, section: usize, lane: i32) -> bool {
        self.0.get(section).is_some_and(|section| section.lanes.contains(&lane))
    }

    /// Checks that each lane has the same number in the sections from `first` to `last`.
    ///
    /// # Errors
    /// [`ImportError`] at the link that gives a lane another number.
    pub(super) fn check_numbers(&self, first: usize, last: usize) -> Result<(), ImportError> {
        match self.0.iter().take(last).skip(first).find_map(|section| section.renumbered.clone()) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::dom::parse;
    use super::*;

    /// The sections of a road, each with its start and its lanes: numbers, or a number and its
    /// successor's.
    fn sections(places: &[(f64, &str)]) -> LaneSections {
        let lane = |lane: &str| {
            let (id, next) = lane.split_once(':').unwrap_or((lane, lane));
            format!("<lane id=\"{id}\" type=\"driving\"><link><successor id=\"{next}\"/></link></lane>")
        };
        let section = |(from_m, lanes): &(f64, &str)| {
            let lanes: String = lanes.split(' ').map(lane).collect();
            format!("<laneSection s=\"{from_m}\"><right>{lanes}</right></laneSection>\n")
        };
        let text = format!("<lanes>{}</lanes>", places.iter().map(section).collect::<String>());
        let path = Path::new("road.xodr");
        LaneSections::read(path, &parse(path, &text).unwrap(), "right")
    }

    #[test]
    fn a_lane_is_where_its_sections_are() {
        let road = sections(&[(0.0, "-1 -2"), (400.0, "-1"), (700.0, "-1")]);
        assert_eq!([-5.0, 0.0, 399.9, 400.0, 700.0, 9e9].map(|s_m| road.at(s_m)), [0, 0, 0, 1, 2, 2]);
        assert!(road.differ() && road.has(0, -2) && !road.has(1, -2) && road.has(2, -1) && !road.has(3, -1));
        assert!(!sections(&[(0.0, "-1"), (9.0, "-1")]).differ());
    }

    #[test]
    fn a_lane_that_gets_another_number_is_an_error_of_the_sections_on_both_sides() {
        let road = sections(&[(0.0, "-1"), (400.0, "-1:-2"), (700.0, "-1 -2:-7")]);
        for (first, last) in [(0, 0), (0, 1), (1, 1), (2, 2)] {
            assert!(road.check_numbers(first, last).is_ok(), "{first} {last}");
        }
        for (first, last) in [(0, 2), (1, 2)] {
            let message = road.check_numbers(first, last).unwrap_err().to_string();
            assert!(message.contains("road.xodr:2: `successor`: lane -1 goes on as lane -2"), "{message}");
        }
    }
}
