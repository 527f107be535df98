//! A road of parallel lanes: straight, of one curvature, or with an alignment.
//!
//! ```text
//!        d = 0 ─────────────────────────────  left edge of the leftmost lane
//!     lane 1     centre at d = −w/2                     s ──▶
//!              ── ── ── ── ── ── ── ── ── ──
//!     lane 2     centre at d = −3w/2
//!              ─────────────────────────────  right edge at d = −n·w
//! ```
//!
//! Lanes of their own widths lie beside each other in the same way: the right edge of lane k is at
//! d = −(w₁ + … + w_k). If the widths change along the road, d = 0 is the leftmost place of the left
//! edge, and the right edge of the road is the rightmost place of the right edge of the lanes.
//!
//! The reference line is d = 0. Its curvature is positive if the road bends to the left. It is
//! constant, or follows an [`Alignment`] of lines, arcs and clothoids. An alignment can lie beside
//! d = 0: it then is the reference line, along which s is measured.
//!
//! One lane may be an acceleration lane: see [`AccelerationLane`].

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

mod alignment;
mod course;
mod cross_sections;
mod widths;

pub use alignment::{Alignment, AlignmentPiece, AlignmentPoint, AlignmentPointConfig};
pub(crate) use course::{Course, OffsetLine};
pub use cross_sections::CrossSectionConfig;
use cross_sections::CrossSections;
pub use widths::LaneWidthsConfig;
use widths::{LaneWidths, MOST_LANES};

use crate::acceleration_lane::{AccelerationLane, AccelerationLaneConfig};
use crate::guard_rail::{LEFT_OFFSET_M, RIGHT_OFFSET_M};
use crate::{Check, ConfigError, Num, Parameters, Problem, Range, Roadside, RoadsideConfig, maths};

/// A lateral side: left or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// The left side, towards positive d.
    Left,
    /// The right side, towards negative d.
    Right,
}

impl Side {
    /// Returns the opposite side.
    #[must_use]
    pub const fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

/// The number of a lane, counted from 1 at the left.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Lane(pub u8);

impl fmt::Display for Lane {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// Why a vehicle cannot change to the lane beside its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoLaneBeside {
    /// The road ends there.
    #[error("lane {lane} of {lanes} has no lane on that side, counted from 1 at the left")]
    OffRoad {
        /// The lane of the vehicle.
        lane: Lane,
        /// The number of lanes.
        lanes: u8,
    },
    /// The lane is the acceleration lane.
    #[error("lane {lane} is the acceleration lane, which vehicles leave and do not enter")]
    Entry {
        /// The acceleration lane.
        lane: Lane,
    },
}

/// A pose in the Cartesian plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanePose {
    /// Position along the direction of the road at s = 0 (m).
    pub x_m: f64,
    /// Position to the left of that direction (m).
    pub y_m: f64,
    /// Heading, counter-clockwise from +x (rad).
    pub yaw_rad: f64,
}

/// A road as a scenario file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub struct RoadConfig {
    /// Number of lanes in the direction of travel, 1 to 8.
    pub lanes: u8,
    /// Width of each lane (m): one number for all lanes, or a list with one for each lane, from lane 1
    /// (leftmost) on.
    #[serde(default = "default_lane_width")]
    pub lane_width_m: LaneWidthsConfig,
    /// The lanes at positions along the road, between which their boundaries are lines: 1 to 4096
    /// instead of `lane-width-m`. The positions increase by 1 m or more. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cross_sections: Vec<CrossSectionConfig>,
    /// Curvature of the left edge (1/m), positive if the road bends to the left.
    #[serde(default = "default_curvature")]
    pub curvature_per_m: Num,
    /// The points between which the curvature changes linearly, 2 to 4096 instead of `curvature-per-m`:
    /// lines, arcs and clothoids. The positions increase by 1 m or more; a position that occurs twice
    /// is a jump. Default: none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alignment: Vec<AlignmentPointConfig>,
    /// Lateral position of the line of `alignment`, along which positions are measured (m): positive
    /// to the left of the left edge. Default: the left edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alignment_d_m: Option<Num>,
    /// Speed limit (m/s).
    #[serde(default = "default_speed_limit")]
    pub speed_limit_mps: Num,
    /// The side on which vehicles overtake.
    #[serde(default = "default_overtaking_side")]
    pub overtaking_side: Side,
    /// Whether guard rails with posts stand along both edges.
    #[serde(default)]
    pub guard_rails: bool,
    /// Other things that stand along the road. Default: none.
    #[serde(default, skip_serializing_if = "RoadsideConfig::is_empty")]
    pub roadside: RoadsideConfig,
    /// The acceleration lane of a ramp. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub acceleration_lane: Option<AccelerationLaneConfig>,
}

fn default_lane_width() -> LaneWidthsConfig {
    LaneWidthsConfig::Equal(Num::Fixed(3.75))
}
fn default_curvature() -> Num {
    Num::Fixed(0.0)
}
/// 130 km/h.
fn default_speed_limit() -> Num {
    Num::Fixed(36.1)
}
fn default_overtaking_side() -> Side {
    Side::Left
}

/// A checked road.
#[derive(Clone, Debug, PartialEq)]
pub struct Road {
    lanes: u8,
    widths: LaneWidths,
    course: Course,
    speed_limit_mps: f64,
    overtaking_side: Side,
    guard_rails: bool,
    roadside: Roadside,
    acceleration_lane: Option<AccelerationLane>,
    /// Whether the road runs against the traffic, so that its left edge is the right edge of the
    /// traffic.
    is_reversed: bool,
}

impl Check for RoadConfig {
    type Checked = Road;

    fn check(&self, parameters: &Parameters) -> Result<Road, ConfigError> {
        if !(1..=8).contains(&self.lanes) {
            let problem = Problem::WrongCount { value: self.lanes.into(), allowed: "a number of lanes from 1 to 8" };
            return Err(ConfigError::new("lanes", problem));
        }
        if self.acceleration_lane.is_some() && self.lanes < 2 {
            let rule = "the acceleration lane is one of the lanes, and vehicles leave it for another one".to_owned();
            return Err(ConfigError::new("acceleration-lane", Problem::Contradiction { other: "lanes", rule }));
        }
        let number = |num, key, range| parameters.number(num, key, range);
        let curvature_per_m = number(&self.curvature_per_m, "curvature-per-m", Road::CURVATURE_PER_M)?;
        let course = match self.alignment.is_empty() {
            true => Course::Constant(curvature_per_m),
            false if self.curvature_per_m != default_curvature() => {
                let rule = "the curvature is constant, or has points between which it changes: one of both".to_owned();
                return Err(ConfigError::new("curvature-per-m", Problem::Contradiction { other: "alignment", rule }));
            }
            false => {
                let d_m = self.alignment_d_m.as_ref().map(|num| number(num, "alignment-d-m", Road::ALIGNMENT_D_M));
                let line = alignment::check(&self.alignment, parameters)?;
                Course::Varying(OffsetLine { line, d_m: d_m.transpose()?.unwrap_or(0.0) })
            }
        };
        if self.alignment_d_m.is_some() && self.alignment.is_empty() {
            let rule = "it is the place of the alignment, and the road has none".to_owned();
            return Err(ConfigError::new("alignment-d-m", Problem::Contradiction { other: "alignment", rule }));
        }
        let each = self.lane_width_m.check(self.lanes, parameters)?;
        let widths = match self.cross_sections.is_empty() {
            true => each,
            false if self.lane_width_m != default_lane_width() => {
                let rule = "each lane has one width, or the road has cross-sections: one of both".to_owned();
                return Err(ConfigError::new("lane-width-m", Problem::Contradiction { other: "cross-sections", rule }));
            }
            false => LaneWidths::Along(CrossSections::check(&self.cross_sections, self.lanes, parameters)?),
        };
        Ok(Road {
            lanes: self.lanes,
            widths,
            course,
            speed_limit_mps: number(&self.speed_limit_mps, "speed-limit-mps", Range::above(0.0, 100.0))?,
            overtaking_side: self.overtaking_side,
            guard_rails: self.guard_rails,
            roadside: self.roadside.check(parameters).map_err(|error| error.within("roadside"))?,
            acceleration_lane: self
                .acceleration_lane
                .as_ref()
                .map(|config| config.check(parameters))
                .transpose()
                .map_err(|error| error.within("acceleration-lane"))?,
            is_reversed: false,
        })
    }
}

impl Road {
    /// Widths of a lane that the models cover (m).
    pub const LANE_WIDTH_M: Range = widths::WIDTH_M;
    /// Curvatures of a road of one curvature that the models cover (1/m): 400 m is the smallest
    /// radius at which the small-angle lane geometry still holds. An alignment has
    /// [`Alignment::CURVATURE_PER_M`].
    pub const CURVATURE_PER_M: Range = Range::closed(-0.0025, 0.0025);
    /// Steepest boundary of lanes whose widths change (m/m).
    pub const STEEPEST_BOUNDARY: f64 = cross_sections::STEEPEST;
    /// Lateral positions of an alignment (m): a reference line in the middle of a road with 8 lanes
    /// per direction lies this far from their edge.
    pub const ALIGNMENT_D_M: Range = Range::closed(-50.0, 50.0);

    /// Creates a straight road of `lanes` lanes (clamped to 1 to 8), each 3.75 m wide, with a speed
    /// limit of 36.1 m/s, overtaking on the left and no guard rails.
    pub fn straight(lanes: u8) -> Self {
        Self {
            lanes: lanes.clamp(1, 8),
            widths: LaneWidths::Equal(3.75),
            course: Course::Constant(0.0),
            speed_limit_mps: 36.1,
            overtaking_side: Side::Left,
            guard_rails: false,
            roadside: Roadside::default(),
            acceleration_lane: None,
            is_reversed: false,
        }
    }

    /// Returns the same road with one curvature everywhere (1/m), clamped to ±0.0025.
    #[must_use]
    pub fn with_curvature(&self, curvature_per_m: f64) -> Self {
        Self { course: Course::Constant(curvature_per_m.clamp(-0.0025, 0.0025)), ..self.clone() }
    }

    /// Returns the same road with this alignment of its left edge.
    #[must_use]
    pub fn with_alignment(&self, line: Alignment) -> Self {
        self.with_alignment_at(line, 0.0)
    }

    /// Returns the same road with an alignment at the lateral position `d_m`, which is clamped to
    /// ±50 m.
    #[must_use]
    pub fn with_alignment_at(&self, line: Alignment, d_m: f64) -> Self {
        Self { course: Course::Varying(OffsetLine { line, d_m: d_m.clamp(-50.0, 50.0) }), ..self.clone() }
    }

    /// Returns the same road with another curvature by `added_per_m` (1/m) at each position. The
    /// results are clamped to the range of a road of its kind.
    #[must_use]
    pub fn with_added_curvature(&self, added_per_m: f64) -> Self {
        match &self.course {
            Course::Constant(curvature_per_m) => self.with_curvature(curvature_per_m + added_per_m),
            Course::Varying(OffsetLine { line, d_m }) => {
                let line = line.bent(|curvature_per_m| (curvature_per_m + added_per_m).clamp(-0.004, 0.004));
                Self { course: Course::Varying(OffsetLine { line, d_m: *d_m }), ..self.clone() }
            }
        }
    }

    /// Returns the same road with as many lanes as these widths (m), 1 to 8 of them. Each width is
    /// clamped to 2.5 to 5 m, and belongs to a lane from lane 1 on.
    #[must_use]
    pub fn with_lane_widths(&self, widths_m: &[f64]) -> Self {
        let widths_m: Vec<f64> = widths_m.iter().take(MOST_LANES).map(|width_m| clamped_width_m(*width_m)).collect();
        match u8::try_from(widths_m.len()) {
            Ok(lanes) if lanes > 0 => Self { lanes, widths: LaneWidths::new(&widths_m), ..self.clone() },
            _ => self.clone(),
        }
    }

    /// Returns the same road with lanes that are wider by `added_m` (m). The results are clamped to
    /// 2.5 to 5 m.
    #[must_use]
    pub fn with_added_lane_width(&self, added_m: f64) -> Self {
        let widths = self.widths.changed(self.lanes, |width_m| clamped_width_m(width_m + added_m));
        Self { widths, ..self.clone() }
    }

    /// Returns the same road with lanes whose widths change along it. Each cross-section has its position
    /// (m), the lateral position of the left edge of lane 1 (m, 0 or negative), and the width of each
    /// lane (m); the positions increase. Without a cross-section the road is the same.
    #[must_use]
    pub fn with_cross_sections(&self, sections: &[(f64, f64, Vec<f64>)]) -> Self {
        match CrossSections::new(sections) {
            Some(along) => Self { widths: LaneWidths::Along(along), ..self.clone() },
            None => self.clone(),
        }
    }

    /// Returns the same road with an acceleration lane, which is one of its lanes. A road of one lane
    /// has none.
    #[must_use]
    pub fn with_acceleration_lane(&self, lane: AccelerationLane) -> Self {
        Self { acceleration_lane: (self.lanes > 1).then_some(lane), ..self.clone() }
    }

    /// Returns the mirror image of a straight road: vehicles overtake on the other side, and lane 1
    /// corresponds to the original's last lane. Returns `None` for a curved road, because positions
    /// are measured along its left edge, which is the right edge of the mirror image.
    pub fn mirrored(&self) -> Option<Self> {
        let overtaking_side = self.overtaking_side.opposite();
        let widths = self.widths.reversed(self.lanes, |s_m| s_m);
        self.is_straight().then(|| Self { overtaking_side, widths, ..self.clone() })
    }

    /// Returns the same road in the opposite direction: s runs against the traffic, and d = 0 is
    /// the right edge of the traffic.
    #[must_use]
    pub fn reversed(&self) -> Self {
        // The original's right edge has another curvature than its left edge. Passed the other way,
        // it bends to the other side.
        let course = match &self.course {
            Course::Constant(curvature) => Course::Constant(-curvature / (1.0 - curvature * self.right_edge_m())),
            Course::Varying(OffsetLine { line, d_m }) => {
                Course::Varying(OffsetLine { line: line.reversed(), d_m: self.right_edge_m() - d_m })
            }
        };
        let overtaking_side = self.overtaking_side.opposite();
        let acceleration_lane =
            self.acceleration_lane.map(|lane| lane.moved(|s_m| self.reversed_position_m(s_m, 0.0).0));
        let widths = self.widths.reversed(self.lanes, |s_m| self.reversed_position_m(s_m, 0.0).0);
        let is_reversed = !self.is_reversed;
        Self { course, overtaking_side, acceleration_lane, widths, is_reversed, ..self.clone() }
    }

    /// Returns the position (s, d) (m) on the [`reversed`](Self::reversed) road of the point
    /// (`s_m`, `d_m`) of this road.
    pub fn reversed_position_m(&self, s_m: f64, d_m: f64) -> (f64, f64) {
        let right_edge_m = self.right_edge_m();
        let scale = match self.course {
            Course::Constant(curvature_per_m) => 1.0 - curvature_per_m * right_edge_m,
            Course::Varying(_) => 1.0,
        };
        (-s_m * scale, right_edge_m - d_m)
    }

    /// Returns true if the road runs against the traffic.
    pub fn is_reversed(&self) -> bool {
        self.is_reversed
    }

    /// Returns the distances of the faces of the guard rails from the left and from the right edge
    /// of the road (m).
    pub fn guard_rail_offsets_m(&self) -> [f64; 2] {
        match self.is_reversed {
            false => [LEFT_OFFSET_M, RIGHT_OFFSET_M],
            true => [RIGHT_OFFSET_M, LEFT_OFFSET_M],
        }
    }

    /// Returns the number of lanes.
    pub fn lanes(&self) -> u8 {
        self.lanes
    }

    /// Returns the width of a lane at a position along the road (m). An acceleration lane has its full
    /// width.
    #[inline]
    pub fn lane_width_m(&self, lane: Lane, s_m: f64) -> f64 {
        self.widths.width_m(lane.0, s_m)
    }

    /// Returns the greatest width of a lane along the road (m).
    pub fn greatest_lane_width_m(&self, lane: Lane) -> f64 {
        match &self.widths {
            LaneWidths::Along(along) => along.greatest_m(lane.0),
            LaneWidths::Equal(_) | LaneWidths::Each(_) => self.lane_width_m(lane, 0.0),
        }
    }

    /// Returns the widths of the lanes at a position along the road (m), from lane 1 on.
    pub fn lane_widths_m(&self, s_m: f64) -> impl Iterator<Item = f64> {
        (1..=self.lanes).map(move |lane| self.widths.width_m(lane, s_m))
    }

    /// Returns the width of every lane (m), or `None` if the lanes have different widths.
    pub fn equal_lane_width_m(&self) -> Option<f64> {
        match self.widths {
            LaneWidths::Equal(width_m) => Some(width_m),
            LaneWidths::Each(_) | LaneWidths::Along(_) => None,
        }
    }

    /// Returns the positions between which the widths of the lanes change linearly (m), in their
    /// order. There is none if each lane has one width.
    pub fn cross_sections_m(&self) -> impl Iterator<Item = f64> {
        let along = match &self.widths {
            LaneWidths::Along(along) => Some(along),
            LaneWidths::Equal(_) | LaneWidths::Each(_) => None,
        };
        along.into_iter().flat_map(CrossSections::positions_m)
    }

    /// Returns true if the widths of the lanes change along the road.
    #[inline]
    pub fn has_changing_lanes(&self) -> bool {
        matches!(self.widths, LaneWidths::Along(_))
    }

    /// Returns the widths of the narrowest and of the widest lane (m), where it is wide enough for
    /// vehicles.
    pub fn lane_width_range_m(&self) -> [f64; 2] {
        self.widths.range_m(self.lanes)
    }

    /// Returns the lateral position of a boundary of the lanes at a position along the road (m), with
    /// the full width of an acceleration lane. Boundary 0 is the left edge of lane 1, and boundary n
    /// is the right edge of lane n.
    #[inline]
    pub fn full_boundary_m(&self, number: u8, s_m: f64) -> f64 {
        self.widths.boundary_m(number, s_m)
    }

    /// Returns true if the road is straight everywhere, as a road without curvature and without an
    /// alignment is.
    pub fn is_straight(&self) -> bool {
        self.course == Course::Constant(0.0)
    }

    /// Returns the curvature of the line along which s is measured at `s_m` (1/m): positive if the road
    /// bends to the left. The line is the left edge, or an alignment at
    /// [`alignment_d_m`](Self::alignment_d_m).
    pub fn curvature_at_per_m(&self, s_m: f64) -> f64 {
        match &self.course {
            Course::Constant(curvature_per_m) => *curvature_per_m,
            Course::Varying(course) => course.line.curvature_at_per_m(s_m),
        }
    }

    /// Returns the curvature if it is the same everywhere (1/m), or `None` on a road with an alignment.
    pub fn constant_curvature_per_m(&self) -> Option<f64> {
        match self.course {
            Course::Constant(curvature_per_m) => Some(curvature_per_m),
            Course::Varying(_) => None,
        }
    }

    /// Returns the smallest and the largest curvature (1/m).
    pub fn curvature_range_per_m(&self) -> [f64; 2] {
        match &self.course {
            Course::Constant(curvature_per_m) => [*curvature_per_m; 2],
            Course::Varying(course) => course.line.curvature_range_per_m(),
        }
    }

    /// Returns the alignment, or `None` on a road of one curvature.
    pub fn alignment(&self) -> Option<&Alignment> {
        self.varying().map(|course| &course.line)
    }

    /// Returns the lateral position of the line along which s is measured (m): 0 but for an alignment
    /// beside the left edge. On a [`reversed`](Self::reversed) road with an alignment, an original of
    /// 0 is the right edge.
    pub fn alignment_d_m(&self) -> f64 {
        self.varying().map_or(0.0, |course| course.d_m)
    }

    pub(crate) fn course(&self) -> &Course {
        &self.course
    }

    fn varying(&self) -> Option<&OffsetLine> {
        match &self.course {
            Course::Constant(_) => None,
            Course::Varying(course) => Some(course),
        }
    }

    /// Returns the length of the path that a vehicle at (`s_m`, `d_m`) covers per metre of s (m/m):
    /// below 1 on the inside of a bend.
    pub fn path_scale(&self, s_m: f64, d_m: f64) -> f64 {
        match &self.course {
            Course::Constant(curvature_per_m) => 1.0 - curvature_per_m * d_m,
            Course::Varying(course) => course.path_scale(s_m, d_m),
        }
    }

    /// Returns the curvature (1/m) at `s_m` of the line that runs at `d_m` along the road.
    pub fn parallel_curvature_per_m(&self, s_m: f64, d_m: f64) -> f64 {
        self.curvature_at_per_m(s_m) / self.path_scale(s_m, d_m)
    }

    /// Returns the length of the path at `d_m` between two positions along the road (m); negative if
    /// the second one is behind the first one.
    pub fn path_length_m(&self, [from_m, to_m]: [f64; 2], d_m: f64) -> f64 {
        match &self.course {
            Course::Constant(curvature_per_m) => (to_m - from_m) * (1.0 - curvature_per_m * d_m),
            Course::Varying(course) => (to_m - from_m) - (d_m - course.d_m) * course.line.turn_rad(from_m, to_m),
        }
    }

    /// Returns the position along the road (m) after a short path at `d_m`. The scale of the path is
    /// the one in its middle, so that the error is of third order in its length.
    pub fn advanced_m(&self, s_m: f64, d_m: f64, path_m: f64) -> f64 {
        s_m + path_m / self.path_scale(s_m + 0.5 * path_m, d_m)
    }

    /// Returns the speed limit (m/s).
    pub fn speed_limit_mps(&self) -> f64 {
        self.speed_limit_mps
    }

    /// Returns the side on which vehicles overtake.
    pub fn overtaking_side(&self) -> Side {
        self.overtaking_side
    }

    /// Returns true if guard rails with posts stand along both edges.
    pub fn has_guard_rails(&self) -> bool {
        self.guard_rails
    }

    /// Returns the other objects along the road.
    pub fn roadside(&self) -> &Roadside {
        &self.roadside
    }

    /// Returns the acceleration lane, or `None` if the road has none.
    pub fn acceleration_lane(&self) -> Option<&AccelerationLane> {
        self.acceleration_lane.as_ref()
    }

    /// Returns the number of the acceleration lane: the lane at the edge opposite to the overtaking
    /// side. Returns `None` if the road has no acceleration lane.
    pub fn entry_lane(&self) -> Option<Lane> {
        self.acceleration_lane.map(|_| match self.overtaking_side {
            Side::Left => Lane(self.lanes),
            Side::Right => Lane(1),
        })
    }

    /// Returns the lateral position of a [boundary](Self::full_boundary_m) of the lanes at `s_m` (m).
    /// The outer boundary of the acceleration lane moves inwards where the lane narrows.
    pub fn boundary_at_m(&self, number: u8, s_m: f64) -> f64 {
        let full_m = self.full_boundary_m(number, s_m);
        let (Some(lane), Some(entry)) = (self.acceleration_lane, self.entry_lane()) else { return full_m };
        let missing_m = || (1.0 - lane.width_share(s_m)) * self.lane_width_m(entry, s_m);
        match self.overtaking_side {
            Side::Left if number == self.lanes => full_m + missing_m(),
            Side::Right if number == 0 => full_m - missing_m(),
            Side::Left | Side::Right => full_m,
        }
    }

    /// Divides a part of the road into stretches (m), so that on each stretch the boundaries of the
    /// lanes move linearly or not at all. Returns the starts and ends.
    pub fn stretches_m(&self, [from_m, to_m]: [f64; 2]) -> Vec<[f64; 2]> {
        let taper_m = self.acceleration_lane.map(|lane| [lane.to_m, lane.taper_end_m]).into_iter().flatten();
        let ends_m = taper_m.chain(self.cross_sections_m());
        let mut starts_m = vec![from_m];
        starts_m.extend(ends_m.filter(|end_m| from_m < *end_m && *end_m < to_m));
        starts_m.sort_by(f64::total_cmp);
        starts_m.dedup();
        let ends_m = starts_m.iter().skip(1).copied().chain([to_m]);
        starts_m.iter().copied().zip(ends_m).map(|(start_m, end_m)| [start_m, end_m]).collect()
    }

    /// Returns the same road with guard rails on both sides.
    #[must_use]
    pub fn with_guard_rails(&self) -> Self {
        Self { guard_rails: true, ..self.clone() }
    }

    /// Returns the same road without guard rails.
    #[must_use]
    pub fn without_guard_rails(&self) -> Self {
        Self { guard_rails: false, ..self.clone() }
    }

    /// Returns the lateral position of the centre of a lane at a position along the road (m), which
    /// is negative.
    #[inline]
    pub fn lane_centre_m(&self, lane: Lane, s_m: f64) -> f64 {
        self.widths.centre_m(lane.0, s_m)
    }

    /// Returns the lateral position of the line that a driver in a lane follows (m), and its first
    /// (m/m) and second derivative (1/m) with respect to s: the centre of the lane, without the kinks
    /// of lanes whose widths change. Where the lane is narrower than 2.5 m, the line leads to the lane
    /// beside it.
    pub fn driving_line(&self, lane: Lane, s_m: f64) -> [f64; 3] {
        match &self.widths {
            LaneWidths::Along(along) => along.driving_line(self.lanes, lane.0, s_m),
            LaneWidths::Equal(_) | LaneWidths::Each(_) => [self.lane_centre_m(lane, s_m), 0.0, 0.0],
        }
    }

    /// Returns the lane that a driver in a lane is in if it follows its [driving
    /// line](Self::driving_line): the lane beside it where the lane has no width any more, or not yet.
    pub fn followed_lane(&self, lane: Lane, s_m: f64) -> Lane {
        match &self.widths {
            LaneWidths::Along(along) => Lane(along.followed(self.lanes, lane.0, s_m)),
            LaneWidths::Equal(_) | LaneWidths::Each(_) => lane,
        }
    }

    /// Returns the lane in which the point (`s_m`, `d_m`) lies; beyond an edge, the lane at that edge.
    #[inline]
    pub fn lane_at(&self, s_m: f64, d_m: f64) -> Lane {
        Lane(self.widths.lane_at(self.lanes, s_m, d_m))
    }

    /// Returns the lane next to `lane` on one side, or `None` if the road has none there.
    pub fn beside(&self, lane: Lane, side: Side) -> Option<Lane> {
        match side {
            Side::Left => (lane.0 > 1).then(|| Lane(lane.0 - 1)),
            Side::Right => (lane.0 < self.lanes).then(|| Lane(lane.0 + 1)),
        }
    }

    /// Returns the lane to which a vehicle in `lane` changes on one side.
    ///
    /// # Errors
    /// [`NoLaneBeside`] if the road has no lane there, or only its acceleration lane.
    pub fn lane_to_enter(&self, lane: Lane, side: Side) -> Result<Lane, NoLaneBeside> {
        match self.beside(lane, side) {
            None => Err(NoLaneBeside::OffRoad { lane, lanes: self.lanes }),
            Some(target) if self.entry_lane() == Some(target) => Err(NoLaneBeside::Entry { lane: target }),
            Some(target) => Ok(target),
        }
    }

    /// Returns true if a lane has room for vehicles from a position to one behind it (m): 2.5 m or
    /// more. The lanes of a road have it unless their widths change.
    #[inline]
    pub fn is_open(&self, lane: Lane, [from_m, to_m]: [f64; 2]) -> bool {
        let LaneWidths::Along(along) = &self.widths else { return true };
        let is_wide = |s_m: f64| along.width_m(lane.0, s_m) >= Self::LANE_WIDTH_M.low();
        is_wide(from_m) && is_wide(to_m) && along.positions_between_m([from_m, to_m]).all(is_wide)
    }

    /// Returns the lateral position of the right edge of the road (m), which is negative: the
    /// rightmost place of the right edge of the lanes.
    pub fn right_edge_m(&self) -> f64 {
        self.widths.right_edge_m(self.lanes)
    }

    /// Returns the pose in the plane of a point at `s_m`, `d_m` with `heading_rad` relative to the
    /// road.
    pub fn plane_pose(&self, s_m: f64, d_m: f64, heading_rad: f64) -> PlanePose {
        let curvature = match &self.course {
            Course::Constant(curvature_per_m) => *curvature_per_m,
            Course::Varying(course) => {
                let pose = course.pose(s_m, d_m);
                return PlanePose { yaw_rad: pose.yaw_rad + heading_rad, ..pose };
            }
        };
        if curvature == 0.0 {
            return PlanePose { x_m: s_m, y_m: d_m, yaw_rad: heading_rad };
        }
        let angle = curvature * s_m;
        let (sin, cos) = maths::sin_cos(angle);
        PlanePose {
            x_m: sin / curvature - d_m * sin,
            y_m: (1.0 - cos) / curvature + d_m * cos,
            yaw_rad: angle + heading_rad,
        }
    }

    /// Returns the road coordinates s and d (m) of a point in the plane. They are unique within half
    /// a turn of s = 0. On a road with an alignment, the search begins at `near_m`, from where the
    /// road turns by less than a right angle.
    pub fn road_position_m(&self, x_m: f64, y_m: f64, near_m: f64) -> (f64, f64) {
        let curvature = match &self.course {
            Course::Constant(curvature_per_m) => *curvature_per_m,
            Course::Varying(course) => {
                let near = course.pose(near_m, 0.0);
                let (sin, cos) = maths::sin_cos(near.yaw_rad);
                let (to_x, to_y) = (x_m - near.x_m, y_m - near.y_m);
                let way_m = [to_x * cos + to_y * sin, to_y * cos - to_x * sin];
                let [s_m, d_m] = course.position_m([near_m, 0.0], way_m, near_m);
                return (s_m, d_m);
            }
        };
        if curvature == 0.0 {
            return (x_m, y_m);
        }
        // Distance and bearing from the centre of the circle at (0, 1/κ).
        let radius = 1.0 / curvature;
        let (to_x, to_y) = (x_m, y_m - radius);
        let angle = if curvature > 0.0 { maths::atan2(to_x, -to_y) } else { -maths::atan2(to_x, to_y) };
        (angle * radius, radius - maths::hypot(to_x, to_y) * radius.signum())
    }
}

/// Returns the width of a lane within the range that the models cover (m).
fn clamped_width_m(width_m: f64) -> f64 {
    width_m.clamp(Road::LANE_WIDTH_M.low(), Road::LANE_WIDTH_M.high())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn lanes_are_counted_from_the_left() {
        let road = Road::straight(3);
        assert_eq!(road.lane_at(0.0, -0.1), Lane(1));
        assert_eq!(road.lane_at(0.0, -3.76), Lane(2));
        assert_eq!(road.lane_at(0.0, -99.0), Lane(3));
        assert_eq!(road.lane_at(0.0, 1.0), Lane(1));
        assert_eq!(road.lane_centre_m(Lane(2), 0.0), -5.625);
        assert_eq!(road.beside(Lane(1), Side::Left), None);
        assert_eq!(road.beside(Lane(2), Side::Left), Some(Lane(1)));
        assert_eq!(road.beside(Lane(3), Side::Right), None);
    }

    const ENTRY: AccelerationLane = AccelerationLane { from_m: 100.0, to_m: 350.0, taper_end_m: 410.0 };

    /// Returns the lateral positions of the left and of the right edge of the lanes at `s_m` (m).
    fn edges_at_m(road: &Road, s_m: f64) -> [f64; 2] {
        [0, road.lanes].map(|number| road.boundary_at_m(number, s_m))
    }

    #[test]
    fn the_acceleration_lane_is_the_lane_opposite_to_the_overtaking_side() {
        let road = Road::straight(3).with_acceleration_lane(ENTRY);
        assert_eq!(road.entry_lane(), Some(Lane(3)));
        assert_eq!(
            [0.0, 350.0, 380.0, 410.0, 900.0].map(|s_m| edges_at_m(&road, s_m)[1]),
            [-11.25, -11.25, -9.375, -7.5, -7.5]
        );
        let mirrored = road.mirrored().unwrap();
        assert_eq!(mirrored.entry_lane(), Some(Lane(1)));
        assert_eq!(edges_at_m(&mirrored, 380.0), [-1.875, -11.25]);
        assert_eq!(Road::straight(3).entry_lane(), None);
        assert_eq!(edges_at_m(&Road::straight(3), 900.0), [0.0, -11.25]);
        assert_eq!(Road::straight(1).with_acceleration_lane(ENTRY).acceleration_lane(), None);
    }

    #[test]
    fn the_acceleration_lane_of_a_reversed_road_lies_at_the_same_places() {
        for curvature in [0.0, 0.002, -0.002] {
            let road = Road::straight(3).with_curvature(curvature).with_acceleration_lane(ENTRY);
            let reversed = road.reversed();
            assert_eq!(reversed.entry_lane(), Some(Lane(1)));
            for s_m in [50.0, 360.0, 400.0, 500.0] {
                let edge_m = edges_at_m(&road, s_m)[1];
                let (there_m, expected_m) = road.reversed_position_m(s_m, edge_m);
                let [left_m, right_m] = edges_at_m(&reversed, there_m);
                assert!((left_m - expected_m).abs() < 1e-9, "{left_m} {expected_m}");
                assert_eq!(right_m, -11.25);
            }
        }
    }

    #[test]
    fn the_stretches_of_a_part_end_where_a_width_begins_or_ends_to_change() {
        let road = Road::straight(3).with_acceleration_lane(ENTRY);
        assert_eq!(road.stretches_m([0.0, 500.0]), [[0.0, 350.0], [350.0, 410.0], [410.0, 500.0]]);
        assert_eq!(road.stretches_m([360.0, 400.0]), [[360.0, 400.0]]);
        assert_eq!(road.stretches_m([500.0, 600.0]), [[500.0, 600.0]]);
        assert_eq!(Road::straight(3).stretches_m([0.0, 500.0]), [[0.0, 500.0]]);
        let section = |s_m, width_m| (s_m, 0.0, vec![3.5, width_m, 3.5]);
        let road = road.with_cross_sections(&[section(350.0, 3.5), section(380.0, 3.25)]);
        assert_eq!(road.stretches_m([0.0, 400.0]), [[0.0, 350.0], [350.0, 380.0], [380.0, 400.0]]);
    }

    #[test]
    fn a_wrong_acceleration_lane_is_refused_by_its_key() {
        let check = |lanes, length_m: f64| {
            let config = RoadConfig {
                lanes,
                lane_width_m: default_lane_width(),
                curvature_per_m: default_curvature(),
                cross_sections: Vec::new(),
                alignment: Vec::new(),
                alignment_d_m: None,
                speed_limit_mps: default_speed_limit(),
                overtaking_side: Side::Left,
                guard_rails: false,
                roadside: RoadsideConfig::default(),
                acceleration_lane: Some(AccelerationLaneConfig {
                    from_m: 100.0.into(),
                    length_m: length_m.into(),
                    taper_m: 60.0.into(),
                }),
            };
            config.check(&Parameters::default()).map_err(|error| error.path.to_string())
        };
        assert_eq!(check(3, 250.0).unwrap().acceleration_lane(), Some(&ENTRY));
        assert_eq!(check(1, 250.0).unwrap_err(), "acceleration-lane");
        assert_eq!(check(3, 10.0).unwrap_err(), "acceleration-lane.length-m");
        assert_eq!(check(3, f64::NAN).unwrap_err(), "acceleration-lane.length-m");
    }

    #[test]
    fn the_curvature_of_a_road_is_one_number_or_an_alignment() {
        let check_at = |d_m: Option<f64>, curvature_per_m: f64, points: &[[f64; 2]]| {
            let point = |&[s_m, curvature_per_m]: &[f64; 2]| AlignmentPointConfig {
                s_m: s_m.into(),
                curvature_per_m: curvature_per_m.into(),
            };
            let config = RoadConfig {
                lanes: 3,
                lane_width_m: default_lane_width(),
                curvature_per_m: curvature_per_m.into(),
                cross_sections: Vec::new(),
                alignment: points.iter().map(point).collect(),
                alignment_d_m: d_m.map(Num::Fixed),
                speed_limit_mps: default_speed_limit(),
                overtaking_side: Side::Left,
                guard_rails: false,
                roadside: RoadsideConfig::default(),
                acceleration_lane: None,
            };
            config.check(&Parameters::default()).map_err(|error| error.to_string())
        };
        let check = |curvature_per_m, points: &[[f64; 2]]| check_at(None, curvature_per_m, points);
        let points = [[0.0, 0.0], [100.0, 0.002]];
        let road = check(0.0, &points).unwrap();
        assert_eq!(road.alignment().unwrap().points().len(), 2);
        assert_eq!([50.0, 500.0].map(|s_m| road.curvature_at_per_m(s_m)), [0.001, 0.002]);
        let both = check(0.001, &points).unwrap_err();
        assert!(both.starts_with("`curvature-per-m` contradicts `alignment`"), "{both}");
        let tight = check(0.0, &[[0.0, 0.0], [100.0, 0.0041]]).unwrap_err();
        assert!(tight.starts_with("`alignment[1].curvature-per-m` is 0.0041"), "{tight}");
        assert!(check(0.004, &[]).unwrap_err().starts_with("`curvature-per-m` is 0.004"));
        assert_eq!(road.alignment_d_m(), 0.0);
        assert_eq!(check_at(Some(2.75), 0.0, &points).unwrap().alignment_d_m(), 2.75);
        for d_m in [50.1, f64::NAN] {
            let wrong = check_at(Some(d_m), 0.0, &points).unwrap_err();
            assert!(wrong.starts_with("`alignment-d-m` is "), "{wrong}");
        }
        let alone = check_at(Some(2.75), 0.001, &[]).unwrap_err();
        assert!(alone.starts_with("`alignment-d-m` contradicts `alignment`"), "{alone}");
        let one = check(0.0, &points[..1]).unwrap_err();
        assert!(one.starts_with("`alignment` has 1 entry"), "{one}");
    }

    /// An arc beside the road is an arc at its left edge, whose radius is smaller or larger by the
    /// distance.
    #[test]
    fn an_alignment_beside_the_left_edge_is_the_same_road_measured_along_another_line() {
        for (curvature_per_m, at_m) in [(0.002, 2.75), (-0.002, 2.75), (0.0024, -6.0)] {
            let points = [0.0, 100.0].map(|s_m| AlignmentPoint { s_m, curvature_per_m });
            let beside = Road::straight(3).with_alignment_at(Alignment::new(&points).unwrap(), at_m);
            let scale = 1.0 + curvature_per_m * at_m;
            let arc = Road::straight(3).with_curvature(curvature_per_m / scale);
            for (s_m, d_m) in [(-80.0, 0.0), (40.0, -9.4), (300.0, -1.9)] {
                let (pose, expected) = (beside.plane_pose(s_m, d_m, 0.1), arc.plane_pose(s_m * scale, d_m, 0.1));
                let away_m = maths::hypot(pose.x_m - expected.x_m, pose.y_m - expected.y_m);
                assert!(away_m < 1e-9 && (pose.yaw_rad - expected.yaw_rad).abs() < 1e-12, "{pose:?} {expected:?}");
                let [curvature, expected] =
                    [(&beside, s_m), (&arc, s_m * scale)].map(|(road, s_m)| road.parallel_curvature_per_m(s_m, d_m));
                assert!((curvature - expected).abs() < 1e-15, "{curvature} {expected}");
                let path_m = beside.path_length_m([0.0, s_m], d_m) - arc.path_length_m([0.0, s_m * scale], d_m);
                assert!(path_m.abs() < 1e-9, "{path_m}");
                // The same holds in the opposite direction.
                let [there, expected] = [(&beside, s_m), (&arc, s_m * scale)].map(|(road, s_m)| {
                    let (s_m, d_m) = road.reversed_position_m(s_m, d_m);
                    road.reversed().plane_pose(s_m, d_m, 0.0)
                });
                let away_m = maths::hypot(there.x_m - expected.x_m, there.y_m - expected.y_m);
                assert!(away_m < 1e-9, "{there:?} {expected:?}");
                let (back_s_m, back_d_m) = beside.road_position_m(pose.x_m, pose.y_m, s_m);
                assert!((back_s_m - s_m).abs() < 1e-9 && (back_d_m - d_m).abs() < 1e-9, "{back_s_m} {back_d_m}");
            }
        }
    }

    #[test]
    fn an_error_of_the_map_bends_each_place_of_an_alignment() {
        let points = [[0.0, 0.0], [100.0, 0.002]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        let map = Road::straight(3).with_alignment(Alignment::new(&points).unwrap()).with_added_curvature(0.000_4);
        for (s_m, expected) in [(-50.0, 0.0004), (50.0, 0.0014), (200.0, 0.0024)] {
            assert!((map.curvature_at_per_m(s_m) - expected).abs() < 1e-12);
        }
        assert_eq!(Road::straight(3).with_added_curvature(0.001), Road::straight(3).with_curvature(0.001));
    }

    proptest! {
        #[test]
        fn road_and_plane_are_inverse(s in -500.0..500.0, d in -12.0..2.0, curvature in -0.0025..0.0025) {
            let road = Road::straight(3).with_curvature(curvature);
            let pose = road.plane_pose(s, d, 0.0);
            let (back_s, back_d) = road.road_position_m(pose.x_m, pose.y_m, 0.0);
            prop_assert!((back_s - s).abs() < 1e-6, "{back_s} {s}");
            prop_assert!((back_d - d).abs() < 1e-6, "{back_d} {d}");
        }

        #[test]
        fn a_vanishing_curvature_is_straight(s in -500.0..500.0, d in -12.0..2.0) {
            let bent = Road::straight(3).with_curvature(1e-9).plane_pose(s, d, 0.0);
            prop_assert!((bent.x_m - s).abs() < 1e-3 && (bent.y_m - d).abs() < 1e-3);
        }
    }
}
