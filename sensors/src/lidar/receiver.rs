//! The receiver: decides which echoes are detected, and computes the points that are reported for
//! them.
//!
//! The first and the last detected echo of each beam are reported. Their points lie on the *centre*
//! line of the beam, because the sensor cannot know which part of the footprint returned the light.

use fearless_simd::Simd;

use super::cast::ColumnHits;
use super::echo::{Echo, Echoes, ground_range_variances_m2, range_variances_m2};
use super::kind::THRESHOLD_OVER_NOISE;
use super::noise::{Noise, Purpose};
use super::pattern::{Column, Elevation, SUBRAYS};
use super::power::{MAX_INTENSITY, MIN_POWER};
use super::pulse::{self, DROPLET_VARIANCE_M2};
use super::soft::{self, Air, BeamIndex, ColumnDroplets, DropletEffect, Plume, SoftEcho};
use super::targets::{LayerMask, Targets};
use super::viewpoint::{Deskew, sensor_position_m, turned_axes};
use super::{Lidar, LidarScan, Material, PointSource, PointTruth, ScanTruth};
use crate::Scene;
use closecall_traffic::maths;

/// The sensor's pose as the ego estimates it: the pitch is measured with an error.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SensorPoseEstimate {
    sensor_m: [f32; 3],
    cos: f32,
    sin: f32,
    deskew: [f32; 4],
    /// Axes of a turned sensor in the ego's frame.
    turned: Option<[[f32; 3]; 3]>,
}

impl SensorPoseEstimate {
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    /// Returns the estimate for the end of the sweep, with a random error of the pitch.
    pub(crate) fn new(scene: &Scene<'_>, lidar: &Lidar, noise: Noise) -> Self {
        let error_rad = lidar.levelling_sd_rad * f64::from(noise.normal(lidar.kind.beams(), Purpose::Levelling));
        let pitch_rad = scene.ego.pitch_rad + error_rad;
        let back_m = 0.5 * scene.ego.vehicle.dimensions.length_m - lidar.inset_m;
        let sensor = sensor_position_m([back_m, lidar.left_m, lidar.mount_height_m], pitch_rad);
        let (sin, cos) = maths::sin_cos(pitch_rad + lidar.tilt_rad);
        Self {
            sensor_m: [sensor.x as f32, sensor.y as f32, sensor.z as f32],
            cos: cos as f32,
            sin: sin as f32,
            deskew: [1.0, 0.0, 0.0, 0.0],
            turned: lidar.is_turned().then(|| {
                let axes = turned_axes(lidar, pitch_rad).inverse();
                std::array::from_fn(|column| std::array::from_fn(|axis| axes[(axis, column)] as f32))
            }),
        }
    }

    /// Returns true if the sensor is turned to a side or about its axis.
    pub(crate) fn is_turned(&self) -> bool {
        self.turned.is_some()
    }

    /// Returns the position of the sensor to the left of the ego's centre line (m).
    pub(crate) fn sensor_y_m(&self) -> f32 {
        self.sensor_m[1]
    }

    /// Returns the height of the sensor above the road (m).
    pub(crate) fn sensor_z_m(&self) -> f32 {
        self.sensor_m[2]
    }

    /// Returns the longitudinal position of the sensor in the ego's frame (m).
    pub(crate) fn sensor_x_m(&self) -> f32 {
        self.sensor_m[0]
    }

    /// Returns this estimate for another instant of the sweep.
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    pub(crate) fn deskewed(&self, deskew: Deskew) -> Self {
        Self { deskew: [deskew.cos as f32, deskew.sin as f32, deskew.x_m as f32, deskew.y_m as f32], ..*self }
    }

    /// Transforms a point from the sensor's frame to the ego's frame at the end of the sweep (m).
    #[inline(always)]
    pub(crate) fn ego_frame_point_m(&self, at_m: [f32; 3]) -> [f32; 3] {
        match &self.turned {
            None => self.level_point_m(at_m),
            Some(axes) => self.turned_point_m(axes, at_m),
        }
    }

    /// Does what [`SensorPoseEstimate::ego_frame_point_m`] does for a turned sensor.
    #[cold]
    fn turned_point_m(&self, axes: &[[f32; 3]; 3], [x, y, z]: [f32; 3]) -> [f32; 3] {
        let along = |axis: usize| self.sensor_m[axis] + axes[0][axis] * x + axes[1][axis] * y + axes[2][axis] * z;
        self.at_end([along(0), along(1), along(2)])
    }

    /// Does what [`SensorPoseEstimate::ego_frame_point_m`] does for a sensor that is not turned,
    /// without branches.
    #[inline(always)]
    pub(crate) fn level_point_m(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let ahead = self.sensor_m[0] - self.cos * x + self.sin * z;
        let left = self.sensor_m[1] - y;
        let above = self.sensor_m[2] + self.sin * x + self.cos * z;
        self.at_end([ahead, left, above])
    }

    /// Returns by how much a sensor that is not turned sees a point higher for each metre along its
    /// axis, and for each metre above it.
    pub(crate) fn level_slopes(&self) -> [f32; 2] {
        [self.sin, self.cos]
    }

    /// Returns the vector of the level road's plane in the sensor's frame (1/m), see
    /// [`targets`](super::targets), as far as the ego knows it.
    pub(crate) fn road_inverse(&self) -> [f32; 3] {
        let up = match &self.turned {
            None => [self.sin, 0.0, self.cos],
            Some(axes) => axes.map(|[_, _, up]| up),
        };
        up.map(|component| -component / self.sensor_m[2])
    }

    /// Turns a direction of a sensor that is not turned from its frame to the ego's frame at the
    /// end of the sweep.
    #[inline(always)]
    pub(crate) fn level_direction(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let [cos, sin, ..] = self.deskew;
        let (ahead, above) = (self.sin * z - self.cos * x, self.sin * x + self.cos * z);
        [cos * ahead + sin * y, sin * ahead - cos * y, above]
    }

    /// Transforms a point from the ego's frame at the time of the column to that at the end of the
    /// sweep (m).
    #[inline(always)]
    fn at_end(&self, [ahead, left, above]: [f32; 3]) -> [f32; 3] {
        let [cos, sin, shift_x, shift_y] = self.deskew;
        [cos * ahead - sin * left + shift_x, sin * ahead + cos * left + shift_y, above]
    }
}

/// A return that reaches the receiver and may be detected.
#[derive(Clone, Copy, Debug)]
struct PotentialReturn {
    range_m: f32,
    power: f32,
    /// Variance of the range within the echo (m²). 0 for a surface unless the scan notes its
    /// echoes.
    range_variance_m2: f32,
    source: PointSource,
    material: Material,
}

/// A detected return.
#[derive(Clone, Copy, Debug)]
struct DetectedReturn {
    potential: PotentialReturn,
    measured_m: f32,
    measured_power: f32,
}

/// The receiver and its inputs for one column.
pub(crate) struct Receiver<'a> {
    /// Index of the column.
    pub(crate) column_index: usize,
    /// Number of beams in a scan.
    pub(crate) beams: usize,
    pub(crate) column: &'a Column,
    pub(crate) elevations: &'a [Elevation],
    pub(crate) pose: SensorPoseEstimate,
    pub(crate) targets: &'a Targets,
    pub(crate) plumes: &'a [Plume],
    pub(crate) air: Air<'a>,
    /// Share of returns that are lost regardless of their power.
    pub(crate) dropout: f32,
}

impl Receiver<'_> {
    /// Appends the detected returns of these layers (a bit mask) of this column to the scan and to
    /// its ground truth.
    #[inline(always)]
    pub(crate) fn receive<S: Simd>(
        &self,
        simd: S,
        hits: &ColumnHits,
        droplets: &ColumnDroplets,
        layers: LayerMask,
        scan: &mut LidarScan,
        truth: &mut ScanTruth,
    ) {
        let in_air = !self.plumes.is_empty() || self.air.link.has_fog();
        let are_noted = scan.echoes.are_noted;
        let mut echoes = Echoes::NONE;
        let mut left = layers;
        while left != 0 {
            let layer = left.trailing_zeros() as usize;
            left &= left - 1;
            let elevation = &self.elevations[layer];
            let droplets = in_air.then(|| droplets.computed(layer).unwrap_or_else(|| self.droplet_effect(layer)));
            let mut variances_m2 = None;
            if hits.is_tested(layer) {
                let beam = (&hits.beams[layer], elevation);
                echoes.set(simd, beam, &self.targets.faces, self.air.link);
                variances_m2 = are_noted.then(|| range_variances_m2(beam, &self.targets.faces));
            } else if layer < hits.ground_below {
                let centre = self.column.centre[elevation.group];
                let ground = &self.targets.faces[0];
                echoes.set_ground(centre, elevation, ground, self.air.link);
                variances_m2 = are_noted.then(|| ground_range_variances_m2(centre, elevation, ground));
            } else {
                echoes.clear();
            }
            let into = (&mut *scan, &mut *truth);
            let variances_m2 = variances_m2.as_ref();
            match droplets {
                Some(droplets) => {
                    let transmission = |range_m| droplets.transmission(range_m);
                    self.detect(layer, (echoes.as_slice(), droplets.echo, variances_m2), transmission, into);
                }
                None => self.detect(layer, (echoes.as_slice(), None, variances_m2), |_| 1.0, into),
            }
        }
    }

    /// Returns the effect of the droplets in the air on a beam.
    pub(crate) fn droplet_effect(&self, layer: usize) -> DropletEffect {
        let [cos, sin] = self.column.centre[self.elevations[layer].group];
        let centre = [cos, sin, self.elevations[layer].centre[0]];
        let at = BeamIndex { column: self.column_index, layer, layers: self.elevations.len() };
        soft::droplet_effect(at, centre, self.plumes, self.targets, &self.air)
    }

    /// Returns two numbers of beams, of the layers in a bit mask: the beams on which droplets may
    /// give a detectable return, and the beams that the model examines closely.
    #[cfg(test)]
    pub(crate) fn droplet_returns(&self, looked_at: LayerMask) -> [usize; 2] {
        let mut counts = [0; 2];
        for layer in 0..self.elevations.len() {
            let is_found = self.droplet_effect(layer).is_detectable();
            let is_looked_at = looked_at >> layer & 1 == 1;
            assert!(is_looked_at || !is_found, "column {}, layer {layer}", self.column_index);
            counts[0] += usize::from(is_found);
            counts[1] += usize::from(is_looked_at);
        }
        counts
    }

    /// Appends the first and the last detected return of a beam to the scan and to its ground
    /// truth. The variances of the range within the echoes are `None` unless the scan notes them.
    #[inline(always)]
    fn detect(
        &self,
        layer: usize,
        (echoes, soft, variances_m2): (&[Echo], Option<SoftEcho>, Option<&[f32; SUBRAYS]>),
        transmission: impl Fn(f32) -> f32,
        (scan, truth): (&mut LidarScan, &mut ScanTruth),
    ) {
        let beam = self.column_index * self.elevations.len() + layer;
        let before_hard = |soft: &SoftEcho| echoes.first().is_none_or(|echo| soft.range_m < echo.range_m);
        let soft = soft.filter(before_hard).map(|soft| PotentialReturn {
            range_m: soft.range_m,
            power: soft.power,
            range_variance_m2: DROPLET_VARIANCE_M2,
            source: soft.source,
            material: Material::Water,
        });
        let hard = echoes.iter().enumerate().map(|(index, echo)| {
            let face = &self.targets.faces[echo.face as usize];
            // The air can only attenuate: an echo that is too weak without attenuation needs no
            // exponential.
            let is_strong = echo.power > MIN_POWER;
            let through =
                if is_strong { self.air.link.transmission(echo.range_m) * transmission(echo.range_m) } else { 1.0 };
            let power = echo.power * through;
            let range_m = self.targets.drifted_m(echo.face, echo.range_m, self.column.offset_ns);
            let range_variance_m2 = variances_m2.map_or(0.0, |variances_m2| variances_m2[index]);
            PotentialReturn { range_m, power, range_variance_m2, source: face.source, material: face.material }
        });
        let (mut is_first, mut last) = (true, None);
        for (index, potential) in soft.into_iter().chain(hard).enumerate() {
            let Some(detected) = self.detect_one(index * self.beams + beam, potential) else { continue };
            if is_first {
                self.append(layer, &detected, scan, truth);
                is_first = false;
            } else {
                last = Some(detected);
            }
        }
        if let Some(detected) = last {
            self.append(layer, &detected, scan, truth);
        }
    }

    /// Returns the measurement if the power with noise exceeds the threshold and the return is not
    /// dropped.
    #[inline(always)]
    fn detect_one(&self, address: usize, potential: PotentialReturn) -> Option<DetectedReturn> {
        if !(potential.power > MIN_POWER) || potential.range_m > self.air.link.max_range_m {
            return None;
        }
        let measured_power =
            potential.power + self.air.noise.normal(address, Purpose::Detection) / THRESHOLD_OVER_NOISE;
        let is_dropped = || self.dropout > 0.0 && self.air.noise.uniform(address, Purpose::Dropout) < self.dropout;
        if !(measured_power > 1.0) || is_dropped() {
            return None;
        }
        let error = self.air.link.range_sd_m(measured_power) * self.air.noise.normal(address, Purpose::Range);
        Some(DetectedReturn { potential, measured_m: potential.range_m + error, measured_power })
    }

    /// Appends a detected return to the scan and to its ground truth.
    #[inline(always)]
    fn append(&self, layer: usize, detected: &DetectedReturn, scan: &mut LidarScan, truth: &mut ScanTruth) {
        let [cos, sin] = self.column.centre[self.elevations[layer].group];
        let [tan, cosine] = self.elevations[layer].centre;
        let level = detected.measured_m * cosine;
        let [x, y, z] = self.pose.ego_frame_point_m([level * cos, level * sin, level * tan]);
        scan.x_m.push(x);
        scan.y_m.push(y);
        scan.z_m.push(z);
        let square = detected.measured_m * detected.measured_m;
        scan.intensity.push((detected.measured_power * square / self.air.link.gain_m2).min(MAX_INTENSITY));
        let DetectedReturn { potential, measured_m, measured_power } = *detected;
        scan.echoes.note(|| {
            let width_ns = pulse::width_ns(measured_power, potential.range_variance_m2);
            [width_ns, self.air.link.reported_intensity(measured_power, measured_m)]
        });
        scan.offset_ns.push(self.column.offset_ns);
        #[expect(clippy::cast_possible_truncation, reason = "a pattern has at most 65,535 beams")]
        scan.beam.push((self.column_index * self.elevations.len() + layer) as u16);
        let PotentialReturn { range_m, source, material, .. } = detected.potential;
        truth.points.push(PointTruth { source, material, range_m });
    }
}
