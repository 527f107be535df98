//! The points on the side of a vehicle beside the ego, whose front the field of view may cut off.
//!
//! ```text
//!              rear end    axle        followed point p
//!                 ┌─────────┬───────────────┃━━━━━━┐        The front is seen: p is the front.
//!   field of view │         │          │    ┃      │        The front is out of view: p keeps its distances from
//!                 └─────────┴──────────│────┃━━━━━━┘        the points on the side that were seen before.
//!                 ◀───── behind_m ──────────┃
//! ```
//!
//! The parts that a scan shows end at the load, the cab, a guard or a wheel: beams at another
//! height meet other parts, and weak returns are lost. Each of these points keeps its place on the
//! vehicle. Other ends do not: where a layer of beams passes below the load, the end of the visible
//! part moves over the vehicle.
//!
//! The fronts of the wheels keep their places. Where known wheels are seen, they alone count.
//!
//! [`Ends`] remember the distances of the points behind the followed point. A point measures it
//! once it has kept its distance for some scans. The estimate does not jump when the visible end
//! changes. The end of a box would jump if its front or length followed from the visible end of
//! each scan.

use super::detection::WheelFronts;

/// Number of distances that are remembered: the ends of cab, load, guard and wheels (assumption).
const POINTS: usize = 8;
/// Largest difference at which a point matches a remembered point, in addition to the spacing of
/// the columns and the deviation of the estimate (m; assumption): more than the noise of a range,
/// less than the distance of two wheels.
const SAME_POINT_M: f64 = 0.15;
/// Upper bound of that difference (m; assumption).
const MAX_SAME_POINT_M: f64 = 0.8;
/// Difference up to which a point keeps its distance (m; assumption), in addition to a share of the
/// spacing of the columns: the noise of a range.
const KEPT_M: f64 = 0.05;
/// That share.
const KEPT_COLUMNS: f64 = 0.5;
/// Number of scans in which a point keeps its distance before it measures (assumption). Where the
/// end of the visible part stays beside the ego, a vehicle that is faster by 0.5 m/s moves on by
/// 0.16 m meanwhile.
const PROVEN_SCANS: u8 = 8;
/// Least share by which a remembered distance is corrected while the front is seen (assumption).
const LEARNING_SHARE: f64 = 0.05;

/// Number of wheels that are remembered.
const WHEELS: usize = WheelFronts::MOST;
/// Difference up to which two wheels agree (m; assumption): twice the noise of a range.
const WHEELS_AGREE_M: f64 = 0.1;

/// A point on a vehicle's side as a scan shows it: the end of one of the vehicle's parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SidePoint {
    /// Distance behind the followed point (m).
    pub(crate) behind_m: f64,
    /// Spacing of the columns there (m).
    pub(crate) spacing_m: f64,
}

/// The known ends of a track's vehicle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ends {
    /// Whether the followed point is the front.
    pub(crate) has_front: bool,
    /// Distance of the rearmost point that was seen behind the followed point (m).
    pub(crate) rearmost_m: f64,
    points: [Option<Remembered>; POINTS],
    /// Index of the next point to replace.
    next: usize,
    /// Distances of the fronts of the wheels behind the followed point (m).
    wheels_m: [Option<f64>; WHEELS],
    /// Index of the next wheel to replace.
    next_wheel: usize,
    /// Number of latest scans in a row with a part that is nearer to the ego than the known side.
    nearer_scans: u8,
}

/// A point on a vehicle's side that was seen before.
#[derive(Clone, Copy, Debug)]
struct Remembered {
    /// Distance behind the followed point (m).
    behind_m: f64,
    /// Number of scans in which it has kept this distance, at most [`PROVEN_SCANS`].
    scans: u8,
}

impl Ends {
    /// Creates the ends of a vehicle whose followed point is the front, or else its rear end.
    ///
    /// If nothing else of the vehicle is seen, the rear end is its first point, and measures from
    /// the start.
    pub(crate) const fn new(has_front: bool) -> Self {
        let mut points = [None; POINTS];
        points[0] = Some(Remembered { behind_m: 0.0, scans: PROVEN_SCANS });
        Self { has_front, rearmost_m: 0.0, points, next: 1, wheels_m: [None; WHEELS], next_wheel: 0, nearer_scans: 0 }
    }

    /// Moves the followed point ahead by `offset_m`, to the front.
    pub(crate) fn follow_front(&mut self, offset_m: f64) {
        self.has_front = true;
        self.rearmost_m += offset_m;
        self.points.iter_mut().flatten().for_each(|point| point.behind_m += offset_m);
        self.wheels_m.iter_mut().flatten().for_each(|behind_m| *behind_m += offset_m);
    }

    /// Lets the followed point be the front of a wheel.
    pub(crate) fn follow_wheel(&mut self) {
        self.points = [None; POINTS];
        self.next = 0;
        (self.wheels_m[0], self.next_wheel) = (Some(0.0), 1);
    }

    /// Returns how far ahead of its estimate the followed point is by these wheels, given by their
    /// distances behind it (m). The estimate has the standard deviation `sd_m`. Returns `None` if
    /// no wheel was seen before.
    ///
    /// Of several wheels, the wheel nearest to the prediction counts, and all wheels that agree
    /// with it.
    pub(crate) fn measure_wheels(&mut self, wheels_m: &[f64], sd_m: f64) -> Option<f64> {
        let offsets_m = wheels_m.iter().filter_map(|&behind_m| Some(*self.wheel(behind_m, sd_m)? - behind_m));
        let base_m = offsets_m.min_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        let (mut sum_m, mut count) = (0.0, 0.0);
        for &behind_m in wheels_m {
            if let Some(remembered_m) = self.wheel(behind_m + base_m, 0.0) {
                (sum_m, count) = (sum_m + *remembered_m - behind_m, count + 1.0);
            }
        }
        // The remembered wheel that gives the base is one of them.
        let offset_m = sum_m / count;
        for &behind_m in wheels_m {
            if self.wheel(behind_m + offset_m, 0.0).is_none() {
                self.remember_wheel(behind_m + offset_m);
            }
        }
        Some(offset_m)
    }

    /// Returns whether wheels of the vehicle are known.
    pub(crate) fn has_wheels(&self) -> bool {
        self.wheels_m.iter().any(Option::is_some)
    }

    /// Counts a scan whose nearest part is nearer to the ego than the known side. Returns whether
    /// this part is the vehicle's side: it has been seen in some scans in a row.
    pub(crate) fn is_side_proven(&mut self, is_nearer: bool) -> bool {
        self.nearer_scans = if is_nearer { self.nearer_scans + 1 } else { 0 };
        let is_proven = self.nearer_scans >= PROVEN_SCANS;
        if is_proven {
            self.nearer_scans = 0;
        }
        is_proven
    }

    /// Learns the distances of these wheels behind the followed point (m). The followed point is
    /// `offset_m` ahead of its estimate.
    pub(crate) fn learn_wheels(&mut self, wheels_m: &[f64], offset_m: f64) {
        for &behind_m in wheels_m {
            match self.wheel(behind_m + offset_m, 0.0) {
                Some(remembered_m) => *remembered_m += LEARNING_SHARE * (behind_m + offset_m - *remembered_m),
                None => self.remember_wheel(behind_m + offset_m),
            }
        }
    }

    fn remember_wheel(&mut self, behind_m: f64) {
        self.wheels_m[self.next_wheel] = Some(behind_m);
        self.next_wheel = (self.next_wheel + 1) % WHEELS;
    }

    /// Returns the remembered wheel nearest to a wheel, if it may be the same.
    fn wheel(&mut self, behind_m: f64, sd_m: f64) -> Option<&mut f64> {
        let limit_m = (WHEELS_AGREE_M + 2.0 * sd_m).min(MAX_SAME_POINT_M);
        let off_m = |remembered_m: &f64| (remembered_m - behind_m).abs();
        let nearest = self.wheels_m.iter_mut().flatten().min_by(|a, b| off_m(a).total_cmp(&off_m(b)));
        nearest.filter(|nearest| off_m(nearest) <= limit_m)
    }

    /// Returns how far ahead of its estimate the followed point is by these points, and the spacing
    /// of the columns on the best of them (m). The estimate has the standard deviation `sd_m`.
    /// Returns `None` if no point measures it.
    ///
    /// Of several points, the point nearest to the prediction counts, and all points that agree
    /// with it.
    pub(crate) fn measure(&mut self, points: &[SidePoint], sd_m: f64) -> Option<[f64; 2]> {
        let offset_m = |remembered: &Remembered, point: &SidePoint| remembered.behind_m - point.behind_m;
        let proven = points.iter().filter_map(|point| {
            let remembered = self.nearest(point, sd_m).filter(|remembered| remembered.scans >= PROVEN_SCANS)?;
            Some([offset_m(remembered, point), point.spacing_m])
        });
        let best = proven.min_by(|a, b| a[0].abs().total_cmp(&b[0].abs()));
        let base_m = best.map_or(0.0, |[offset_m, _]| offset_m);
        let (mut sum, mut weights, mut least_m) = (0.0, 0.0, f64::INFINITY);
        for point in points {
            let Some(remembered) = self.nearest(point, sd_m) else {
                self.remember(point);
                continue;
            };
            let offset_m = offset_m(remembered, point);
            if (offset_m - base_m).abs() > KEPT_M + KEPT_COLUMNS * point.spacing_m {
                *remembered = Remembered { behind_m: point.behind_m + base_m, scans: 0 };
            } else if remembered.scans >= PROVEN_SCANS {
                // Weighted by the inverse squares of the spacings.
                let weight = 1.0 / (KEPT_M + point.spacing_m).powi(2);
                (sum, weights, least_m) = (sum + weight * offset_m, weights + weight, point.spacing_m.min(least_m));
            } else {
                remembered.scans += 1;
            }
        }
        (weights > 0.0).then(|| [sum / weights, least_m])
    }

    /// Learns the distances of these points while the front or a wheel is seen. The followed point
    /// is `offset_m` ahead of its estimate.
    pub(crate) fn learn(&mut self, points: &[SidePoint], offset_m: f64) {
        for point in points {
            let point = &SidePoint { behind_m: point.behind_m + offset_m, ..*point };
            let Some(remembered) = self.nearest(point, 0.0) else {
                self.remember(point);
                continue;
            };
            let off_m = point.behind_m - remembered.behind_m;
            if off_m.abs() > KEPT_M + KEPT_COLUMNS * point.spacing_m {
                *remembered = Remembered { behind_m: point.behind_m, scans: 0 };
            } else {
                remembered.behind_m += off_m * LEARNING_SHARE.max(1.0 / (f64::from(remembered.scans) + 2.0));
                remembered.scans = PROVEN_SCANS.min(remembered.scans + 1);
            }
        }
    }

    fn remember(&mut self, point: &SidePoint) {
        self.points[self.next] = Some(Remembered { behind_m: point.behind_m, scans: 0 });
        self.next = (self.next + 1) % POINTS;
    }

    /// Returns the remembered point nearest to a point, if it may be the same.
    fn nearest(&mut self, point: &SidePoint, sd_m: f64) -> Option<&mut Remembered> {
        let off_m = |remembered: &Remembered| (remembered.behind_m - point.behind_m).abs();
        let limit_m = (SAME_POINT_M + point.spacing_m + 2.0 * sd_m).min(MAX_SAME_POINT_M);
        let nearest = self.points.iter_mut().flatten().min_by(|a, b| off_m(a).total_cmp(&off_m(b)));
        nearest.filter(|nearest| off_m(nearest) <= limit_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points<const N: usize>(behind_m: [f64; N]) -> [SidePoint; N] {
        behind_m.map(|behind_m| SidePoint { behind_m, spacing_m: 0.1 })
    }

    #[test]
    fn a_point_measures_once_it_has_kept_its_distance() {
        let mut ends = Ends::new(true);
        for _ in 0..=PROVEN_SCANS {
            assert_eq!(ends.measure(&points([18.0]), 0.0), None);
        }
        // The next scan of the mirror's other side ends at an axle, and the scan after it at the
        // rear end again.
        assert_eq!(ends.measure(&points([16.8]), 0.0), None);
        let [offset_m, _] = ends.measure(&points([18.08]), 0.0).unwrap();
        assert!((offset_m + 0.08).abs() < 1e-9);
    }

    #[test]
    fn an_end_that_moves_over_the_vehicle_never_measures() {
        let mut ends = Ends::new(true);
        // It stays beside the ego, while the vehicle is 2 m/s faster.
        for scan in 0..100 {
            assert_eq!(ends.measure(&points([4.0 + 0.08 * f64::from(scan)]), 0.05), None);
        }
    }

    #[test]
    fn a_point_that_disagrees_with_the_prediction_counts_for_nothing_beside_one_that_agrees() {
        let mut ends = Ends::new(true);
        (0..=PROVEN_SCANS).for_each(|_| ends.learn(&points([3.0, 9.0]), 0.0));
        let [offset_m, _] = ends.measure(&points([2.98, 9.2]), 0.1).unwrap();
        assert!((offset_m - 0.02).abs() < 1e-9, "{offset_m}");
    }

    #[test]
    fn wheels_measure_from_their_second_scan_on_and_refuse_one_that_disagrees() {
        let mut ends = Ends::new(true);
        assert_eq!(ends.measure_wheels(&[2.0, 12.0], 0.1), None);
        ends.learn_wheels(&[2.0, 12.0], 0.0);
        let offset_m = ends.measure_wheels(&[1.96, 11.94], 0.1).unwrap();
        assert!((offset_m - 0.05).abs() < 1e-9, "{offset_m}");
        // The nearest to the prediction counts, and the other becomes a wheel of its own.
        let offset_m = ends.measure_wheels(&[1.98, 12.25], 0.1).unwrap();
        assert!((offset_m - 0.02).abs() < 1e-9, "{offset_m}");
        let offset_m = ends.measure_wheels(&[12.27], 0.0).unwrap();
        assert!(offset_m.abs() < 1e-9, "{offset_m}");
    }

    #[test]
    fn one_wheel_that_two_fronts_resemble_gives_a_finite_offset() {
        let mut ends = Ends::new(false);
        ends.follow_wheel();
        let offset_m = ends.measure_wheels(&[0.3, -0.2, 0.25], 0.5).unwrap();
        assert!((offset_m - 0.2).abs() < 0.1, "{offset_m}");
    }

    #[test]
    fn the_remembered_points_keep_their_places_when_the_front_comes_into_view() {
        let mut ends = Ends::new(false);
        assert!(ends.measure(&points([0.05]), 0.0).is_some());
        ends.follow_front(12.0);
        assert!(ends.has_front && ends.rearmost_m == 12.0);
        assert!(ends.measure(&points([12.05]), 0.0).is_some());
    }
}
