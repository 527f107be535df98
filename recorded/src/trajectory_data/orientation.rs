//! Checks whether a heading, a position in the plane or an offset in the lane, which some files state
//! besides the position, agree with the lateral position.
//!
//! | column | convention | compared with |
//! |---|---|---|
//! | `latLaneCenterOffset` (exiD) | positive to the left: it falls in lane changes to the right | the lateral movement of a vehicle from row to row |
//! | `heading_rel_rad` | positive to the left | the lateral movement of a vehicle from row to row |
//! | `x_m`, `y_m` | y is to the left of x | the side on which vehicles at the same place of the road are |
//!
//! If they contradict the lateral position, one of both is mirrored, and left and right lane changes
//! may be exchanged.

use std::collections::BTreeMap;

use closecall_traffic::maths;

use super::error::TrajectoryFileProblem;

/// Number of rows that are compared.
const ENOUGH_ROWS: usize = 100_000;
/// Least lateral movement between two rows that has a side (m): above the rounding of files.
const LEAST_MOVEMENT_M: f64 = 0.01;
/// Least heading that has a side (rad).
const LEAST_HEADING_RAD: f64 = 0.001;
/// Least distance between two rows of a vehicle that shows its direction in the plane (m).
const LEAST_STEP_M: f64 = 0.3;
/// Largest distance along the road (m) between two positions that are compared, and their least
/// lateral distance (m): a bend of a motorway departs by centimetres from its tangent.
const BESIDE_M: f64 = 2.0;
const LEAST_APART_M: f64 = 1.5;
/// Least evidence for a contradiction: lateral movement of the headings (m), and pairs of positions.
const LEAST_EVIDENCE_M: f64 = 2.0;
const LEAST_PAIRS: f64 = 20.0;
/// Share of the evidence above which the columns contradict (-). In the windows of US-101, columns that
/// agree reach 0.05.
const CONTRADICTED_SHARE: f64 = 0.75;

/// Largest change of an offset between two rows that is a movement (m): where a vehicle enters another
/// lane, the offset jumps by a lane width.
const LARGEST_MOVEMENT_M: f64 = 1.0;
/// Share of the lane changes to the other side above which the lanes contradict the offsets (-): at ramps,
/// lanelets may overlap. An assumption with a plausible range of 0.1 to 0.4.
const CONTRARY_SHARE: f64 = 0.25;

/// One row, as the file states it: `d_m` is positive to the right.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stated {
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) heading_rad: Option<f64>,
    pub(super) point: Option<(f64, f64)>,
}

/// A position on the road and in the plane, and the direction of travel in the plane (-).
#[derive(Clone, Copy, Debug)]
struct Located {
    s_m: f64,
    d_m: f64,
    point: (f64, f64),
    direction: (f64, f64),
}

/// The evidence for and against an agreement.
#[derive(Clone, Copy, Debug, Default)]
struct Evidence {
    agrees: f64,
    contradicts: f64,
}

impl Evidence {
    fn add(&mut self, agrees: bool, weight: f64) {
        *(if agrees { &mut self.agrees } else { &mut self.contradicts }) += weight;
    }

    /// Returns the share that contradicts (%), if it is too large. If the lateral position is mirrored,
    /// what agrees with the file contradicts its reading.
    fn contradiction(self, is_mirrored: bool, least: f64) -> Option<f64> {
        let against = if is_mirrored { self.agrees } else { self.contradicts };
        let all = self.agrees + self.contradicts;
        (all >= least && against > CONTRADICTED_SHARE * all).then(|| 100.0 * against / all)
    }
}

/// What the rows so far say of the sides.
#[derive(Debug, Default)]
pub(super) struct Orientation {
    rows: usize,
    latest: BTreeMap<u64, Stated>,
    heading: Evidence,
    located: Vec<Located>,
}

impl Orientation {
    /// Adds a row of a track.
    pub(super) fn add(&mut self, track: u64, row: Stated) {
        if self.rows >= ENOUGH_ROWS || (row.heading_rad.is_none() && row.point.is_none()) {
            return;
        }
        self.rows += 1;
        let Some(before) = self.latest.insert(track, row) else { return };
        // Traffic that drives against the road is refused by another check.
        if row.s_m <= before.s_m {
            return;
        }
        let moved_m = row.d_m - before.d_m;
        let has_side = |heading_rad: &f64| heading_rad.abs() >= LEAST_HEADING_RAD;
        if let Some(heading_rad) = row.heading_rad.filter(has_side)
            && moved_m.abs() >= LEAST_MOVEMENT_M
        {
            self.heading.add(heading_rad * moved_m < 0.0, moved_m.abs());
        }
        if let (Some(point), Some(from)) = (row.point, before.point) {
            let (dx, dy) = (point.0 - from.0, point.1 - from.1);
            let step_m = maths::hypot(dx, dy);
            if step_m >= LEAST_STEP_M {
                let direction = (dx / step_m, dy / step_m);
                self.located.push(Located { s_m: row.s_m, d_m: row.d_m, point, direction });
            }
        }
    }

    /// Checks the rows so far; the lateral position is read as mirrored if `is_mirrored`.
    ///
    /// # Errors
    /// Names the columns that contradict the lateral position.
    pub(super) fn check(&self, is_mirrored: bool) -> Result<(), TrajectoryFileProblem> {
        if let Some(percent) = self.heading.contradiction(is_mirrored, LEAST_EVIDENCE_M) {
            let compared = "the lateral movement";
            return Err(TrajectoryFileProblem::SidesContradict {
                columns: "heading_rel_rad",
                position: "d_m",
                percent,
                compared,
            });
        }
        if let Some(percent) = self.plane().contradiction(is_mirrored, LEAST_PAIRS) {
            let compared = "the vehicles beside each other";
            return Err(TrajectoryFileProblem::SidesContradict {
                columns: "x_m, y_m",
                position: "d_m",
                percent,
                compared,
            });
        }
        Ok(())
    }

    /// Compares the sides of positions that are beside each other on the road.
    fn plane(&self) -> Evidence {
        let mut by_road = self.located.clone();
        by_road.sort_by(|a, b| a.s_m.total_cmp(&b.s_m));
        let mut evidence = Evidence::default();
        for pair in by_road.windows(2) {
            let [a, b] = pair else { continue };
            let right_m = b.d_m - a.d_m;
            if b.s_m - a.s_m > BESIDE_M || right_m.abs() < LEAST_APART_M {
                continue;
            }
            let (dx, dy) = (b.point.0 - a.point.0, b.point.1 - a.point.1);
            let left_m = a.direction.0 * dy - a.direction.1 * dx;
            evidence.add(left_m * right_m < 0.0, 1.0);
        }
        evidence
    }
}

/// The lateral position of a vehicle, and its offset from the centre of its lane (m), both positive to
/// the left. Lanes are counted from the left.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneOffset {
    pub(super) vehicle: u64,
    pub(super) d_m: f64,
    pub(super) offset_m: f64,
    pub(super) lane: u8,
}

/// What the offsets of the rows so far say of the sides. The rows of a vehicle follow one another.
#[derive(Debug, Default)]
pub(super) struct OffsetSides {
    latest: Option<LaneOffset>,
    evidence: Evidence,
    /// Lane changes to the side that the offset says, and to the other one.
    to_stated_side: u64,
    to_other_side: u64,
}

impl OffsetSides {
    /// Adds a row.
    pub(super) fn add(&mut self, row: LaneOffset) {
        let before = self.latest.replace(row).filter(|before| before.vehicle == row.vehicle);
        let Some(before) = before else { return };
        let (moved_m, changed_m) = (row.d_m - before.d_m, row.offset_m - before.offset_m);
        let is_movement = |m: f64| (LEAST_MOVEMENT_M..LARGEST_MOVEMENT_M).contains(&m.abs());
        if is_movement(moved_m) && is_movement(changed_m) {
            self.evidence.add(moved_m * changed_m > 0.0, moved_m.abs());
        }
        // A vehicle that enters the lane to the left is right of its centre.
        if changed_m.abs() > LARGEST_MOVEMENT_M && before.lane != row.lane {
            let is_stated_side = (changed_m < 0.0) == (row.lane < before.lane);
            *(if is_stated_side { &mut self.to_stated_side } else { &mut self.to_other_side }) += 1;
        }
    }

    /// Checks the rows so far, of this number of vehicles; the lateral position is read as
    /// mirrored if `is_mirrored`.
    ///
    /// # Errors
    /// The offsets contradict the positions, or the sides of lane changes.
    pub(super) fn check(&self, is_mirrored: bool, vehicles: usize) -> Result<(), TrajectoryFileProblem> {
        if let Some(percent) = self.evidence.contradiction(is_mirrored, LEAST_EVIDENCE_M) {
            return Err(TrajectoryFileProblem::SidesContradict {
                columns: "latLaneCenterOffset",
                position: "yCenter",
                percent,
                compared: "the lateral movement",
            });
        }
        let all = self.to_stated_side + self.to_other_side;
        let contrary = if is_mirrored { self.to_stated_side } else { self.to_other_side };
        if contrary as f64 > CONTRARY_SHARE * all as f64 {
            return Err(TrajectoryFileProblem::LaneChangesToTheOtherSide { contrary, all, vehicles });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_contradict_a_mirrored_position_and_jumps_of_the_lane_count_for_nothing() {
        // Ten vehicles move by a lane to the left, in steps of 5 cm; halfway, the offset jumps back.
        let moved = |sign: f64| {
            let mut sides = OffsetSides::default();
            for vehicle in 0..10 {
                for step in 0..70_u32 {
                    let left_m = 0.05 * f64::from(step);
                    let offset_m = if step < 35 { left_m } else { left_m - 3.5 };
                    sides.add(LaneOffset { vehicle, d_m: sign * left_m, offset_m, lane: 1 });
                }
            }
            sides
        };
        assert!(moved(1.0).check(false, 10).is_ok() && moved(-1.0).check(true, 10).is_ok());
        for (sign, is_mirrored) in [(-1.0, false), (1.0, true)] {
            let message = moved(sign).check(is_mirrored, 10).unwrap_err().to_string();
            assert!(message.contains("`latLaneCenterOffset` contradict `yCenter`"), "{message}");
        }
        let mut constant = OffsetSides::default();
        for step in 0..1_000_u32 {
            constant.add(LaneOffset { vehicle: 1, d_m: -0.05 * f64::from(step), offset_m: 0.1, lane: 1 });
        }
        assert!(constant.check(false, 1).is_ok());
    }

    #[test]
    fn lane_changes_to_the_other_side_than_the_offset_says_are_refused() {
        // Each vehicle changes from lane 2 to `lane` on the derived road, whose line follows its path. It
        // enters the lane to the left, where its offset jumps back.
        let changed = |lanes: &[u8]| {
            let mut sides = OffsetSides::default();
            for (vehicle, lane) in (0..).zip(lanes) {
                sides.add(LaneOffset { vehicle, d_m: 0.0, offset_m: 1.7, lane: 2 });
                sides.add(LaneOffset { vehicle, d_m: 0.0, offset_m: -1.7, lane: *lane });
            }
            sides
        };
        for fine in [&[][..], &[1], &[2], &[1, 1, 1, 3]] {
            assert!(changed(fine).check(false, 4).is_ok(), "{fine:?}");
        }
        for (contrary, words) in [(&[3][..], "in 1 of 1 lane changes"), (&[1, 3], "in 1 of 2 lane changes")] {
            let message = changed(contrary).check(false, 2).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("the paths of 2 vehicles"), "{message}");
        }
        assert!(changed(&[3]).check(true, 1).is_ok() && changed(&[1]).check(true, 1).is_err());
    }

    /// Three vehicles in three lanes on a road towards the north-west; the second one changes lanes.
    fn recorded(heading_sign: f64, plane_sign: f64) -> Orientation {
        let mut orientation = Orientation::default();
        for frame in 0..100 {
            for track in 0..3_u32 {
                let s_m = 2.5 * f64::from(frame) + 0.5 * f64::from(track);
                let shift = if track == 1 { 0.035 * f64::from(frame) } else { 0.0 };
                let d_m = 1.75 + 3.5 * f64::from(track) + shift;
                let heading_rad = (track == 1).then_some(-heading_sign * 0.014);
                let right_m = plane_sign * d_m;
                let diagonal = std::f64::consts::FRAC_1_SQRT_2;
                let point = Some((diagonal * (right_m - s_m), diagonal * (s_m + right_m)));
                orientation.add(u64::from(track), Stated { s_m, d_m, heading_rad, point });
            }
        }
        orientation
    }

    fn columns(orientation: &Orientation, is_mirrored: bool) -> Option<&'static str> {
        match orientation.check(is_mirrored) {
            Err(TrajectoryFileProblem::SidesContradict { columns, .. }) => Some(columns),
            _ => None,
        }
    }

    #[test]
    fn a_heading_or_a_plane_of_the_other_side_contradicts() {
        assert_eq!(columns(&recorded(1.0, 1.0), false), None);
        assert_eq!(columns(&recorded(-1.0, 1.0), false), Some("heading_rel_rad"));
        assert_eq!(columns(&recorded(1.0, -1.0), false), Some("x_m, y_m"));
        // A mirrored lateral position that is read as such agrees again.
        assert_eq!(columns(&recorded(-1.0, -1.0), true), None);
        assert_eq!(columns(&recorded(1.0, 1.0), true), Some("heading_rel_rad"));
    }

    #[test]
    fn a_file_without_these_columns_is_not_judged() {
        let mut orientation = Orientation::default();
        for k in 0..1_000_u32 {
            let (s_m, d_m) = (f64::from(k), 0.1 * f64::from(k));
            orientation.add(1, Stated { s_m, d_m, heading_rad: None, point: None });
        }
        assert_eq!(columns(&orientation, false), None);
    }
}
