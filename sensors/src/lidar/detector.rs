//! The detector: turns a scan into detections, by point selection, clustering, box fitting and
//! classification.

use closecall_traffic::{ClassScores, Time, VehicleClass, maths};

use super::across::across;
use super::boxes::BoxFit;
use super::candidate::Candidate;
use super::classify::{class_scores, typical_size_m};
use super::clustering::{ClusteredPoints, Clustering, ClusteringCheck, ClusteringModel, NOISE};
use super::ground::select_candidates;
use super::parts::join_lamps;
use super::wheels::wheel_fronts;
use super::{LaneGeometry, LidarScan, PointSource, RESERVED_CLUSTERS, ScanTruth};
use crate::tracking::{SIDE_PROTRUSION_M, WheelFronts};

use crate::{Detection, Extent, SeenBy, SeenPart, SensorError};

/// Number of columns between the edges of two clusters within which the nearer cluster may occlude
/// the other.
const OCCLUSION_COLUMNS: f64 = 3.0;
/// Difference in range from which a cluster may occlude another (m).
const OCCLUSION_DEPTH_M: f64 = 1.0;
/// Standard deviation of the position of a vehicle's front (m), which is not flat: bumper, plate,
/// bonnet edge.
pub(crate) const FACE_SD_M: f64 = 0.034;
/// Additional standard deviation of the front if a side is seen too: its points lie close behind
/// the points of the front (m).
const CORNER_SD_M: f64 = 0.05;
/// Height of the lowest footprint on a car's front above which only the cabin was seen (m).
const CABIN_ONLY_FROM_M: f64 = 0.95;
/// Mean distance by which a car's bumper is ahead of its cabin (m).
const BUMPER_OFFSET_M: f64 = 0.9;
/// Standard deviation of that distance (m).
const BUMPER_OFFSET_SD_M: f64 = 0.6;
/// Distance from which only the rider of a motorcycle may be seen (m), because few beams hit the
/// wheel, the lamp and the fairing.
const RIDER_ONLY_FROM_M: f64 = 28.0;
/// Mean distance by which a motorcycle's front is then ahead of the points that are seen (m).
const RIDER_OFFSET_M: f64 = 0.2;
/// Standard deviation of that distance (m).
const RIDER_OFFSET_SD_M: f64 = 0.2;
/// Additional standard deviation of a nearer motorcycle's front (m), because the wheel's tread may
/// return too little light.
const WHEEL_SD_M: f64 = 0.08;
/// Standard deviation of a front outside of the field of view if the rear end is seen (m): the
/// standard deviation of vehicle lengths.
const TRUNCATED_LENGTH_SD_M: f64 = 0.5;
/// Standard deviation of such a front if the rear end is not seen either (m).
const TRUNCATED_SD_M: f64 = 3.0;
/// Length of the visible side from which a vehicle's length counts as measured (m).
const SIDE_SEEN_M: f64 = 3.0;
/// Spacing of the columns on a side below which the farthest point of the side counts as its end
/// (m).
const SIDE_SPACING_M: f64 = 0.5;

/// Distance of a vehicle up to which its wheels are searched (m; assumption): farther away, few beams
/// meet them below cab and guards.
const WHEELS_REACH_M: f64 = 25.0;

/// The detector of the rear LiDAR. It keeps no state from scan to scan except allocated memory.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    candidates: Vec<Candidate>,
    clustering: Clustering,
    /// Whether each clustering is compared with another implementation.
    check: Option<ClusteringCheck>,
    /// Indices of the clustered points in the scan, cluster by cluster.
    members: Vec<u32>,
    /// Index in `members` at which each cluster begins, followed by the length of `members`.
    starts: Vec<u32>,
    fits: Vec<BoxFit>,
    /// For each cluster, the cluster whose vehicle it is part of: usually itself.
    parents: Vec<u32>,
    /// For each cluster, whether it is a pair of headlamps.
    is_pair: Vec<bool>,
    detections: Vec<Detection>,
    /// The low points of a cluster: positions along and across (m).
    low: Vec<[f64; 2]>,
}

impl Detector {
    /// Creates a detector with memory for so many points. More need more memory.
    pub(crate) fn with_capacity(points: usize) -> Self {
        Self {
            candidates: Vec::with_capacity(points),
            clustering: Clustering::with_capacity(points),
            check: None,
            members: Vec::with_capacity(points),
            starts: Vec::with_capacity(RESERVED_CLUSTERS + 1),
            fits: Vec::with_capacity(RESERVED_CLUSTERS),
            parents: Vec::with_capacity(RESERVED_CLUSTERS),
            is_pair: Vec::with_capacity(RESERVED_CLUSTERS),
            detections: Vec::with_capacity(RESERVED_CLUSTERS),
            low: Vec::with_capacity(points),
        }
    }

    /// Returns the detector with these parameters of DBSCAN, and compares it with another
    /// implementation if `check` is given.
    pub(crate) fn with_clustering(mut self, model: ClusteringModel, check: Option<ClusteringCheck>) -> Self {
        self.clustering.model = model;
        self.check = check;
        self
    }

    /// Detects boxes in a scan.
    ///
    /// # Errors
    /// Returns [`SensorError::NotFinite`] if a point is not finite.
    pub fn detect(&mut self, scan: &LidarScan, lane: &LaneGeometry) -> Result<&[Detection], SensorError> {
        self.detections.clear();
        self.cluster(scan, lane)?;
        self.fit(scan, lane);
        let has_parts = self.find_parents(lane);
        if join_lamps(&self.fits, &mut self.parents, &mut self.is_pair) || has_parts {
            self.merge_parts(scan, lane);
        }
        for index in 0..self.fits.len() {
            let hidden = occluded_edges(index, &self.fits);
            let wheels = self.wheels_of(index, scan);
            self.detections.push(detection(&self.fits[index], hidden, self.is_pair[index], wheels, scan.start, lane));
        }
        Ok(&self.detections)
    }

    /// Merges each cluster into its parent.
    ///
    /// Front and sides come from the parent cluster alone, since the parts behind them would only
    /// blur the fit. A pair of headlamps has a box around both.
    fn merge_parts(&mut self, scan: &LidarScan, lane: &LaneGeometry) {
        self.clustering.merge(&self.parents);
        self.group_by_cluster();
        let is_own = |index: usize| self.parents[index] as usize == index;
        let mut kept = 0;
        for index in 0..self.fits.len() {
            if is_own(index) {
                self.fits[kept] = self.fits[index];
                self.is_pair[kept] = self.is_pair[index];
                kept += 1;
            }
        }
        self.fits.truncate(kept);
        self.is_pair.truncate(kept);
        for cluster in 0..kept {
            if self.is_pair[cluster] {
                let members = &self.members[self.starts[cluster] as usize..self.starts[cluster + 1] as usize];
                self.fits[cluster] = BoxFit::new(members, scan, lane);
            }
        }
    }

    /// Detects boxes in a scan whose points are assigned to the vehicles that they belong to.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub(crate) fn detect_by_truth(
        &mut self,
        (scan, truth): (&LidarScan, &ScanTruth),
        lane: &LaneGeometry,
    ) -> Result<&[Detection], SensorError> {
        self.detections.clear();
        select_candidates(scan, lane, scan.end, &mut self.candidates)?;
        self.clustering.assign(self.candidates.iter().map(|candidate| {
            match truth.points[candidate.index as usize].source {
                PointSource::Actor(actor) => Some(actor),
                _ => None,
            }
        }));
        self.group_by_cluster();
        self.fit(scan, lane);
        for index in 0..self.fits.len() {
            let hidden = occluded_edges(index, &self.fits);
            let wheels = self.wheels_of(index, scan);
            self.detections.push(detection(&self.fits[index], hidden, false, wheels, scan.start, lane));
        }
        Ok(&self.detections)
    }

    /// Returns the fronts of the wheels of a cluster, if a side is seen nearby.
    fn wheels_of(&mut self, cluster: usize, scan: &LidarScan) -> WheelFronts {
        let fit = &self.fits[cluster];
        if !fit.sees_side() || fit.range_m > WHEELS_REACH_M {
            return WheelFronts::NONE;
        }
        let members = &self.members[self.starts[cluster] as usize..self.starts[cluster + 1] as usize];
        wheel_fronts(fit, members, scan, &mut self.low)
    }

    /// Returns the boxes detected in the latest scan.
    pub fn latest(&self) -> &[Detection] {
        &self.detections
    }

    /// Returns the indices of one detection's points in the scan.
    pub fn point_indices_of(&self, detection: usize) -> &[u32] {
        &self.members[self.starts[detection] as usize..self.starts[detection + 1] as usize]
    }

    /// Selects points and assigns them to clusters. This step takes most of the detector's time.
    ///
    /// # Errors
    /// Returns the errors of [`Detector::detect`].
    pub fn cluster(&mut self, scan: &LidarScan, lane: &LaneGeometry) -> Result<(), SensorError> {
        select_candidates(scan, lane, scan.end, &mut self.candidates)?;
        self.clustering.run(&self.candidates);
        if let Some(check) = self.check {
            self.clustering.compare(check, scan.end)?;
        }
        self.group_by_cluster();
        Ok(())
    }

    /// Returns the latest clustering, before parts of a vehicle are merged if [`Detector::cluster`]
    /// made it.
    pub(crate) fn clustered(&self) -> ClusteredPoints {
        let (points, labels) = self.clustering.rows();
        ClusteredPoints { points: points.to_vec(), labels }
    }

    /// Returns a detector with the same parameters of DBSCAN, before its first scan.
    pub(crate) fn alike(&self) -> Self {
        Self::default().with_clustering(self.clustering.model, None)
    }

    /// Returns the points of each cluster of the latest clustering, by their indices in the scan.
    pub(crate) fn clusters(&self) -> Vec<Vec<u32>> {
        (0..self.clustering.count).map(|cluster| self.point_indices_of(cluster).to_vec()).collect()
    }

    /// Groups the indices of the candidates by cluster.
    fn group_by_cluster(&mut self) {
        let count = self.clustering.count;
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        let labels = &self.clustering.labels;
        for &label in labels.iter().filter(|&&label| label != NOISE) {
            self.starts[label as usize + 1] += 1;
        }
        for cluster in 0..count {
            self.starts[cluster + 1] += self.starts[cluster];
        }
        self.members.clear();
        self.members.resize(self.starts[count] as usize, 0);
        for (candidate, &label) in self.candidates.iter().zip(labels) {
            if label != NOISE {
                let next = &mut self.starts[label as usize];
                self.members[*next as usize] = candidate.index;
                *next += 1;
            }
        }
        // The loop above has advanced each start to the start of the next cluster. Shift them back.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// Fits a box to each cluster.
    fn fit(&mut self, scan: &LidarScan, lane: &LaneGeometry) {
        self.fits.clear();
        for cluster in 0..self.clustering.count {
            let members = &self.members[self.starts[cluster] as usize..self.starts[cluster + 1] as usize];
            self.fits.push(BoxFit::new(members, scan, lane));
        }
    }
}

impl Detector {
    /// Finds the clusters that are part of a nearer cluster's vehicle, such as points below a
    /// truck's cabin or past a rider.
    ///
    /// Returns true if there is such a cluster.
    fn find_parents(&mut self, lane: &LaneGeometry) -> bool {
        self.parents.clear();
        for (index, (fit, own_index)) in self.fits.iter().zip(0..).enumerate() {
            let is_parent = |other: &usize| *other != index && contains(&self.fits[*other], fit, lane);
            let parent = (0..self.fits.len()).find(is_parent);
            #[expect(clippy::cast_possible_truncation, reason = "fewer clusters than points")]
            self.parents.push(parent.map_or(own_index, |parent| parent as u32));
        }
        self.parents.iter().zip(0..).any(|(&parent, own_index)| parent != own_index)
    }
}

/// Returns true if `part` lies behind the front of `whole` and within the typical size of its
/// class.
fn contains(whole: &BoxFit, part: &BoxFit, lane: &LaneGeometry) -> bool {
    if part.range_m <= whole.range_m || part.points >= whole.points {
        return false;
    }
    let class = class_scores(whole, true, lane);
    let [length, width] = typical_size_m(class.best_vehicle_class() as usize);
    let (sin, cos) = maths::sin_cos(part.heading_rad - whole.heading_rad);
    let across = 0.5 * (part.across_m[0] + part.across_m[1]);
    let (u, v) = (part.front_u_m * cos - across * sin, part.front_u_m * sin + across * cos);
    let middle = 0.5 * (whole.across_m[0] + whole.across_m[1]);
    let reach = length.max(whole.length_m());
    let half = 0.5 * width.max(whole.width_m());
    // Wheels and mirrors protrude from the side, and the middle of the front is known only to one
    // column.
    let half = half + SIDE_PROTRUSION_M + whole.spacing_m;
    class.vehicle() > 0.5 && u <= whole.front_u_m && u >= whole.front_u_m - reach && (v - middle).abs() <= half
}

/// Returns whether the edge at the least and at the greatest azimuth is occluded by a nearer
/// cluster or truncated by the field of view.
fn occluded_edges(index: usize, fits: &[BoxFit]) -> [bool; 2] {
    let fit = &fits[index];
    let margin = OCCLUSION_COLUMNS * fit.spacing_m / fit.range_m.max(1.0);
    let hides = |edge: f64| {
        fits.iter().enumerate().any(|(other, nearer)| {
            other != index
                && nearer.range_m + OCCLUSION_DEPTH_M < fit.range_m
                && nearer.azimuth_rad[0] - margin < edge
                && edge < nearer.azimuth_rad[1] + margin
        })
    };
    [0, 1].map(|side| hides(fit.azimuth_rad[side]) || fit.truncated[side])
}

/// Returns the detection for a fitted box. `hidden` tells whether its edge at the least and at the
/// greatest azimuth is hidden, `is_pair` whether it surrounds a pair of headlamps.
fn detection(
    fit: &BoxFit,
    hidden: [bool; 2],
    is_pair: bool,
    wheels: WheelFronts,
    start: Time,
    lane: &LaneGeometry,
) -> Detection {
    // Vehicles point in about the same direction as the ego: the edge at the least azimuth is also
    // that at the least v.
    let width_seen = !hidden[0] && !hidden[1];
    let class = class_scores(fit, width_seen, lane);
    let [typical_length, typical_width] = typical_size_m(class.best_vehicle_class() as usize);
    let across = across(fit, hidden, typical_width);
    let length_seen = has_seen_length(fit);
    let (front_u_m, range_sd_m) = front(fit, &class);
    let (sin, cos) = maths::sin_cos(fit.heading_rad);
    #[expect(clippy::cast_possible_truncation, reason = "offsets lie within a sweep")]
    let time = start + Time::from_ns(fit.offset_ns as i64);
    Detection {
        time,
        face_x_m: front_u_m * cos - across.middle_m * sin,
        face_y_m: front_u_m * sin + across.middle_m * cos,
        range_sd_m,
        lateral_sd_m: across.sd_m,
        heading_rad: fit.heading_rad,
        length_m: if length_seen { fit.length_m() } else { typical_length.max(fit.length_m()) },
        length: if length_seen { Extent::Seen } else { Extent::Assumed },
        width_m: across.width_m,
        width: across.extent,
        top_m: fit.top_m,
        seen_by: SeenBy::Lidar,
        points: fit.points,
        is_centred: is_pair || across.is_by_plate,
        seen: SeenPart {
            is_cut: fit.is_truncated() && fit.sees_side(),
            along_m: [fit.rear_u_m, fit.front_u_m].map(|u_m| u_m - front_u_m),
            across_m: fit.across_m.map(|v_m| v_m - across.middle_m),
            spacing_m: [fit.rear_u_m, fit.front_u_m].map(|u_m| side_spacing_m(fit, u_m)),
            wheels: wheels.shifted(-front_u_m),
        },
        class,
    }
}

/// Returns the position of the front face along the box's heading, and its standard deviation (m).
fn front(fit: &BoxFit, class: &ClassScores) -> (f64, f64) {
    let face_sd_m = if fit.sees_side() { maths::hypot(FACE_SD_M, CORNER_SD_M) } else { FACE_SD_M };
    let sd = maths::hypot(face_sd_m, fit.point_sd_m / (fit.front_points.max(1) as f64).sqrt());
    if fit.is_truncated() {
        // The vehicle is partly or entirely beside the ego. The front follows from the rear end and
        // the typical length.
        let [typical_length, _] = typical_size_m(class.best_vehicle_class() as usize);
        return match sees_rear(fit) && fit.length_m() < typical_length {
            true => (fit.rear_u_m + typical_length, TRUNCATED_LENGTH_SD_M),
            false => (fit.front_u_m, TRUNCATED_SD_M),
        };
    }
    match class.best_vehicle_class() {
        VehicleClass::Car if fit.front_bottom_m - 0.5 * fit.footprint_m() > CABIN_ONLY_FROM_M => {
            (fit.front_u_m + BUMPER_OFFSET_M, maths::hypot(sd, BUMPER_OFFSET_SD_M))
        }
        VehicleClass::Motorcycle if fit.range_m > RIDER_ONLY_FROM_M => {
            (fit.front_u_m + RIDER_OFFSET_M, maths::hypot(sd, RIDER_OFFSET_SD_M))
        }
        VehicleClass::Motorcycle => (fit.front_u_m, maths::hypot(sd, WHEEL_SD_M)),
        VehicleClass::Car | VehicleClass::Truck => (fit.front_u_m, sd),
    }
}

/// Returns true if a side is visible to its end.
fn has_seen_length(fit: &BoxFit) -> bool {
    !fit.is_truncated() && fit.length_m() >= SIDE_SEEN_M && sees_rear(fit)
}

/// Returns true if the columns hit the side so densely that its farthest point is the rear end.
fn sees_rear(fit: &BoxFit) -> bool {
    side_spacing_m(fit, fit.rear_u_m) < SIDE_SPACING_M
}

/// Returns the spacing of the columns on the side at the position `u_m` along the box's heading
/// (m); infinite if the box is straight behind the sensor, so that no side is seen.
fn side_spacing_m(fit: &BoxFit, u_m: f64) -> f64 {
    // At distance r and lateral offset y, columns with the azimuth step Δφ hit a side every
    // Δφ·r²/y.
    let (sin, cos) = maths::sin_cos(fit.heading_rad);
    let middle = 0.5 * (fit.across_m[0] + fit.across_m[1]);
    let (x, y) = (u_m * cos - middle * sin, u_m * sin + middle * cos);
    let step_rad = fit.spacing_m / fit.range_m.max(1.0);
    let y = y - fit.sensor_y_m;
    if y.abs() > 1.0 { step_rad * (x * x + y * y) / y.abs() } else { f64::INFINITY }
}
