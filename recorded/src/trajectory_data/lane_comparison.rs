//! Comparison of the lanes on a derived road with the lane changes that the file states.
//!
//! Lanes are numbered by their names, so that both agree unless names were joined wrongly. A vehicle
//! may change lanes exactly where one name ends and the next begins. No row states such a lane change,
//! but the vehicle moves sideways. If a file states a lane change wherever a name ends, most vehicles keep their
//! lanes there, and do not move sideways.

/// Distance before and after a change of lanes over which a vehicle moves sideways (m): half of a lane
/// change of 6 s at 33 m/s. In slow traffic the distance is shorter.
const CHANGING_M: f64 = 100.0;

/// Least lateral movement of a lane change, as a share of the lane width (-).
const LEAST_SHIFT: f64 = 0.5;

/// One in this number of lane changes may contradict the file before a result is in doubt. An
/// assumption with a plausible range of 5 to 20.
const ONE_WRONG_IN: u64 = 10;

/// One in this number of lane changes that the file states may come without a movement sideways: where a ramp ends
/// in the lane beside it, a vehicle goes straight on. An assumption with a plausible range of 2 to 10.
const ONE_UNMOVED_IN: u64 = 4;

/// Number of lane changes without a movement sideways that may have another cause: a track may end
/// soon after its vehicle changes lanes where one name ends and the next begins.
const FEW_UNSTATED: u64 = 1;

/// A row that names its lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct ComparedRow {
    pub(super) vehicle: u64,
    /// `true` if the file states that the vehicle leaves its lane in this row.
    pub(super) changes_lane: bool,
    /// Position along the derived road and across it (m), and the lane there.
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) lane: u8,
}

/// Numbers of lane changes of all vehicles.
#[derive(Clone, Debug, Default)]
pub(super) struct LaneComparison {
    rows: Vec<ComparedRow>,
    /// Lane changes that the file states.
    stated: u64,
    /// Lane changes on the derived road.
    derived: u64,
    /// Lane changes on the derived road that the file does not state, without a movement sideways.
    unstated: u64,
    /// Lane changes that the file states and that are none on the derived road.
    unfollowed: u64,
    /// Lane changes that the file states while rows show whether the vehicle moves sideways, and those without such a
    /// movement.
    shown: u64,
    unmoved: u64,
}

impl LaneComparison {
    /// Adds a row on a road with this lane width. The rows of a vehicle have to follow one another.
    pub(super) fn add(&mut self, row: ComparedRow, lane_width_m: f64) {
        if self.rows.first().is_some_and(|first| first.vehicle != row.vehicle) {
            self.end_vehicle(lane_width_m);
        }
        self.rows.push(row);
    }

    /// Ends the rows of a vehicle.
    pub(super) fn end_vehicle(&mut self, lane_width_m: f64) {
        let rows = std::mem::take(&mut self.rows);
        let (mut stated, mut derived, mut unstated) = (0_u64, 0_u64, 0_u64);
        for (k, pair) in rows.windows(2).enumerate() {
            let (before, row) = (&pair[0], &pair[1]);
            stated += u64::from(row.changes_lane && !before.changes_lane);
            if before.lane != row.lane {
                derived += 1;
                let Sideways { moves, is_shown } = Sideways::about(&rows, k, lane_width_m);
                unstated += u64::from(!row.changes_lane && !moves);
                self.shown += u64::from(row.changes_lane && is_shown);
                self.unmoved += u64::from(row.changes_lane && is_shown && !moves);
            }
        }
        self.stated += stated;
        self.derived += derived;
        // Some files state a lane change a few rows earlier or later.
        self.unstated += unstated.min(derived.saturating_sub(stated));
        self.unfollowed += stated.saturating_sub(derived);
    }

    /// Returns why the lanes on the derived road are in doubt.
    pub(super) fn doubts(&self) -> Vec<String> {
        let Self { stated, derived, unstated, unfollowed, shown, unmoved, .. } = *self;
        let is_many = |wrong: u64, all: u64| ONE_WRONG_IN * wrong > all;
        let mut doubts = Vec::new();
        if unstated > FEW_UNSTATED && is_many(unstated, derived) {
            doubts.push(format!(
                "{unstated} of {derived} lane changes on the road that was derived from the traffic have no change of the lane that \
                 the file names: its lanes were not followed"
            ));
        }
        if is_many(unfollowed, stated) {
            doubts.push(format!(
                "{unfollowed} of {stated} lane changes that the file states are none on the road that was derived from the traffic: \
                 its lanes were not followed"
            ));
        }
        if unmoved > FEW_UNSTATED && ONE_UNMOVED_IN * unmoved > shown {
            doubts.push(format!(
                "in {unmoved} of {shown} lane changes that the file states, the vehicle does not move sideways: what states them (in \
                 exiD `laneChange`) is wrong, or the positions are"
            ));
        }
        doubts
    }
}

/// The movement of a vehicle to the side about a change of lanes.
struct Sideways {
    /// `true` if the vehicle moves by most of a lane.
    moves: bool,
    /// `true` if its rows reach as far as a lane change may, before and after.
    is_shown: bool,
}

impl Sideways {
    /// Returns the movement about the change of lanes after row `k`.
    fn about(rows: &[ComparedRow], k: usize, lane_width_m: f64) -> Self {
        let at_m = rows[k].s_m;
        let before = rows[..=k].iter().rev().find(|row| row.s_m <= at_m - CHANGING_M);
        let after = rows[k..].iter().find(|row| row.s_m >= at_m + CHANGING_M);
        let ends = before.or(rows.first()).zip(after.or(rows.last()));
        let moves = ends.is_some_and(|(from, to)| (to.d_m - from.d_m).abs() >= LEAST_SHIFT * lane_width_m);
        Self { moves, is_shown: before.is_some() && after.is_some() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH_M: f64 = 3.5;

    /// Returns the doubts about ten vehicles that drive 300 m. After 150 m, their lane on the derived
    /// road changes if `is_derived`, the file states a lane change if `is_stated`, and they move by
    /// `shift_m`.
    fn doubts(is_derived: bool, is_stated: bool, shift_m: f64) -> Vec<String> {
        let mut comparison = LaneComparison::default();
        for vehicle in 0..10 {
            for step in 0..60_u32 {
                let s_m = 5.0 * f64::from(step);
                let d_m = shift_m * ((s_m - 120.0) / 60.0).clamp(0.0, 1.0);
                let lane = if is_derived && step >= 30 { 2 } else { 1 };
                let changes_lane = is_stated && step == 30;
                comparison.add(ComparedRow { vehicle, changes_lane, s_m, d_m, lane }, WIDTH_M);
            }
        }
        comparison.end_vehicle(WIDTH_M);
        comparison.doubts()
    }

    #[test]
    fn lane_changes_without_a_change_of_the_stated_lane_are_in_doubt_unless_vehicles_move() {
        assert_eq!(doubts(true, true, 3.5), [""; 0]);
        assert_eq!(doubts(false, false, 0.3), [""; 0]);
        assert_eq!(doubts(true, false, 3.5), [""; 0], "they change lanes where a name ends");
        assert!(doubts(true, false, 0.3)[0].starts_with("10 of 10 lane changes on the road"));
        assert!(doubts(false, true, 3.5)[0].starts_with("10 of 10 lane changes that the file states"));
        assert!(doubts(true, true, 0.3)[0].starts_with("in 10 of 10 lane changes that the file states, the vehicle"));
    }
}
