//! Positions of the lane markings, derived from the recorded lanes.

use std::collections::BTreeMap;

use closecall_traffic::{Lane, Trajectory};

/// Lane width if the data gives none (m). It is the usual width on motorways in built-up areas and lies between NGSIM's
/// 3.4 m and the 3.75 m of motorways outside of them.
pub const DEFAULT_LANE_WIDTH_M: f64 = 3.5;

/// Lateral positions of lane markings.
///
/// A marking lies where the recorded lane of vehicles changes to the adjacent lane. Its position is the median over all
/// such changes, each taken halfway between its two frames. The left edge of lane 1 is d = 0 by definition.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LaneMarkings {
    /// Right edge of each lane (m), by lane number.
    right_edge_m: BTreeMap<u8, f64>,
}

impl LaneMarkings {
    /// Derives the markings from the recorded lanes of `trajectories`.
    pub fn from_trajectories(trajectories: &[Trajectory]) -> Self {
        Self::from_tracks(trajectories.iter())
    }

    /// Works like [`LaneMarkings::from_trajectories`], for tracks that are not in one slice.
    pub fn from_tracks<'t>(trajectories: impl Iterator<Item = &'t Trajectory>) -> Self {
        let mut crossings: BTreeMap<u8, Vec<f64>> = BTreeMap::new();
        for pair in trajectories.flat_map(|track| track.points.windows(2)) {
            let [before, after] = pair else { continue };
            if before.lane.0.abs_diff(after.lane.0) == 1 {
                let left = before.lane.0.min(after.lane.0);
                crossings.entry(left).or_default().push(0.5 * (before.d_m + after.d_m));
            }
        }
        Self { right_edge_m: crossings.into_iter().filter_map(|(lane, d)| Some((lane, median(d)?))).collect() }
    }

    /// Creates markings from the right edge of each lane (m), which the data states.
    pub fn from_right_edges(right_edges_m: impl IntoIterator<Item = (Lane, f64)>) -> Self {
        Self { right_edge_m: right_edges_m.into_iter().map(|(lane, edge_m)| (lane.0, edge_m)).collect() }
    }

    /// Returns the lateral position of the marking to the right of `lane` (m), or `None` if it is unknown.
    pub fn right_edge_m(&self, lane: Lane) -> Option<f64> {
        self.right_edge_m.get(&lane.0).copied()
    }

    /// Returns the lateral position of the marking to the left of `lane` (m), or `None` if it is unknown.
    pub fn left_edge_m(&self, lane: Lane) -> Option<f64> {
        if lane.0 == 1 { Some(0.0) } else { self.right_edge_m(Lane(lane.0.checked_sub(1)?)) }
    }

    /// Returns the width of `lane` (m), or `None` unless both of its markings are known.
    pub fn lane_width_m(&self, lane: Lane) -> Option<f64> {
        let width = self.left_edge_m(lane)? - self.right_edge_m(lane)?;
        (width > 0.0).then_some(width)
    }

    /// Returns the median of the known lane widths (m), or [`DEFAULT_LANE_WIDTH_M`] if none is known.
    pub fn typical_lane_width_m(&self) -> f64 {
        let widths = self.right_edge_m.keys().filter_map(|lane| self.lane_width_m(Lane(*lane)));
        median(widths.collect()).unwrap_or(DEFAULT_LANE_WIDTH_M)
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    Some(if values.len() % 2 == 1 { upper } else { 0.5 * (values[middle - 1] + upper) })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Time, TrajectoryPoint, VehicleClass};

    use super::*;

    #[test]
    fn markings_lie_where_the_recorded_lane_changes() {
        let crossing = |lane: u8, d_m: f64| {
            let point = |k: u8| TrajectoryPoint {
                time: Time::from_ms(100 * i64::from(k)),
                s_m: 2.0 * f64::from(k),
                d_m: d_m + 0.1 * (1.5 - f64::from(k)),
                speed_mps: 20.0,
                acceleration_mps2: 0.0,
                lateral_speed_mps: 0.0,
                lateral_acceleration_mps2: 0.0,
                lane: Lane(if k < 2 { lane } else { lane + 1 }),
            };
            let class = VehicleClass::Car;
            let dimensions = class.typical_dimensions();
            Trajectory { track_id: 1, vehicle_id: 1, class, dimensions, points: (0..4).map(point).collect() }
        };
        let markings = LaneMarkings::from_trajectories(&[crossing(1, -3.4), crossing(1, -3.6), crossing(2, -7.1)]);
        assert!((markings.right_edge_m(Lane(1)).unwrap() + 3.5).abs() < 1e-9);
        assert!((markings.lane_width_m(Lane(2)).unwrap() - 3.6).abs() < 1e-9);
        assert_eq!(markings.lane_width_m(Lane(3)), None);
        assert!((markings.typical_lane_width_m() - 3.55).abs() < 1e-9);
        assert_eq!(LaneMarkings::default().typical_lane_width_m(), DEFAULT_LANE_WIDTH_M);
    }
}
