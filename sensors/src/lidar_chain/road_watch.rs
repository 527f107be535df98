//! The road monitor of one LiDAR: which beams it looks at in which scan.
//!
//! The field of view is divided into sectors of 1.5°, so that a blocked sector of 3° contains one
//! of them, wherever it lies. Each scan visits two sectors, one column of each. The SCALA has 89
//! sectors, which take 1.8 s.

use std::ops::Range;

use crate::Scene;
use crate::lidar::{LidarKind, RearLidar};
use crate::monitors::{Alarms, RoadBeam, RoadMonitor};

/// Width of a sector (deg), at most.
const SECTOR_DEG: f64 = 1.5;
/// Number of sectors that a scan visits.
const VISITS: usize = 2;
/// Least visibility at which the air counts as clear (m): the greatest that counts as fog (WMO).
const CLEAR_FROM_M: f64 = 1_000.0;
/// Speed of the ego from which heights of the road are judged (m/s): an assumption. In a jam,
/// vehicles on all sides may stand so near that most low returns are theirs.
const HEIGHTS_FROM_MPS: f64 = 10.0;

/// The road monitor of one LiDAR, with the beams that it looks at.
pub(super) struct RoadWatch {
    monitor: RoadMonitor,
    /// The columns of each sector.
    sectors: Vec<Range<usize>>,
    /// The sector that is visited next, and the number of times that all have been visited.
    next: usize,
    passes: usize,
    beams: Vec<RoadBeam>,
}

impl RoadWatch {
    /// Returns the monitor of a LiDAR of this kind, before its first scan.
    pub(super) fn new(kind: &LidarKind) -> Self {
        let sectors = sectors(&kind.azimuths_deg, kind.half_field_deg);
        let monitor = RoadMonitor::new(sectors.len());
        Self { monitor, sectors, next: 0, passes: 0, beams: Vec::with_capacity(RESERVED_BEAMS) }
    }

    /// Looks at some beams of the latest scan.
    ///
    /// A wet road and droplets in the air take an unknown part of the light. A rain sensor tells
    /// the ego of them, and the monitor pauses.
    pub(super) fn look(&mut self, lidar: &mut RearLidar, scene: &Scene<'_>) {
        let environment = scene.environment;
        let is_wet = environment.water_film_mm > 0.0 || environment.rain_mm_per_h > 0.0;
        if is_wet || !(environment.visibility_m >= CLEAR_FROM_M) || self.sectors.is_empty() {
            return;
        }
        let count = self.sectors.len();
        let visited: [usize; VISITS] = std::array::from_fn(|visit| (self.next + visit) % count);
        let columns = visited.map(|sector| {
            let columns = &self.sectors[sector];
            columns.start + self.passes % columns.len()
        });
        lidar.look_at_road(&columns, environment, &mut self.beams);
        // In a scene turned by half a turn, the ego drives backward.
        if scene.ego.state.speed_mps.abs() < HEIGHTS_FROM_MPS {
            self.beams.iter_mut().for_each(RoadBeam::forget_height);
        }
        if !self.beams.is_empty() {
            let of_column = self.beams.len() / VISITS;
            for (sector, beams) in visited.into_iter().zip(self.beams.chunks_exact(of_column)) {
                self.monitor.observe(sector, beams);
            }
            self.monitor.end_scan();
        }
        self.next += VISITS;
        if self.next >= count {
            self.next %= count;
            self.passes += 1;
        }
    }

    /// Returns what the monitor has noticed.
    pub(super) fn alarms(&self) -> Alarms {
        self.monitor.alarms()
    }
}

/// Number of beams for which memory is reserved.
const RESERVED_BEAMS: usize = 16;

/// Divides columns with these azimuths, in ascending order (deg), into sectors. Sectors without a
/// column are left out.
fn sectors(azimuths_deg: &[f64], half_field_deg: f64) -> Vec<Range<usize>> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "170° at most")]
    let count = (2.0 * half_field_deg / SECTOR_DEG).ceil() as usize;
    let width_deg = 2.0 * half_field_deg / count as f64;
    let first_from = |sector: usize| match sector {
        0 => 0,
        sector if sector == count => azimuths_deg.len(),
        sector => {
            let from_deg = -half_field_deg + sector as f64 * width_deg;
            azimuths_deg.partition_point(|azimuth_deg| *azimuth_deg < from_deg)
        }
    };
    (0..count).map(|sector| first_from(sector)..first_from(sector + 1)).filter(|columns| !columns.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lidar::LidarModel;

    #[test]
    fn the_sectors_cover_all_columns_once_and_a_blocked_sector_of_three_degrees_contains_one() {
        for model in [LidarModel::Scala2, LidarModel::Os1With64] {
            let kind = model.kind();
            let sectors = sectors(&kind.azimuths_deg, kind.half_field_deg);
            let all: Vec<usize> = sectors.iter().cloned().flatten().collect();
            assert_eq!(all, (0..kind.azimuths_deg.len()).collect::<Vec<_>>());
            for first_deg in -60..57 {
                let blocked = f64::from(first_deg) + 0.3..f64::from(first_deg) + 3.3;
                let is_within =
                    |columns: &Range<usize>| kind.azimuths_deg[columns.clone()].iter().all(|at| blocked.contains(at));
                let is_in_view = blocked.start > -kind.half_field_deg && blocked.end < kind.half_field_deg;
                assert!(!is_in_view || sectors.iter().any(is_within), "{}: {blocked:?}", kind.name);
            }
        }
        assert_eq!(sectors(&LidarModel::Scala2.kind().azimuths_deg, 66.5).len(), 89);
    }

    #[test]
    fn sectors_without_a_beam_are_left_out() {
        assert_eq!(sectors(&[-9.0, -8.9, 8.0], 10.0), [0..2, 2..3]);
        assert!(sectors(&[], 10.0).is_empty());
    }
}
