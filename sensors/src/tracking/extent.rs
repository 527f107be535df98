//! Length and width of a track.
//!
//! An extent (length or width) that was measured is averaged over the scans. An extent that was
//! never measured is the larger of two values: the usual extent of the most probable class, and the
//! extent that the latest detection assumed.

use closecall_traffic::{ClassScores, Dimensions};

use crate::tracking::{Detection, Extent};

/// Standard deviation of an extent measured in one scan (m): beam spacing and range noise at both
/// ends (assumption).
const MEASURED_SD_M: f64 = 0.3;
/// Least variance of an averaged extent (m²), so that later scans can still correct a slow error.
const MIN_VARIANCE_M2: f64 = 0.003;
/// Share of the excess over the present length by which the length grows in one scan (assumption).
const GROWTH_SHARE: f64 = 0.3;

/// The estimate of one extent.
#[derive(Clone, Copy, Debug, Default)]
struct ExtentEstimate {
    /// Average (m) and its variance (m²); `None` if the extent was never measured.
    measured: Option<(f64, f64)>,
    /// The latest assumed extent (m).
    assumed_m: f64,
    /// The extent that parts of the vehicle have shown together (m): it is at least as long.
    least_m: f64,
}

impl ExtentEstimate {
    /// Updates the estimate with the extent of one detection.
    fn update(&mut self, extent_m: f64, kind: Extent) {
        let noise_m2 = MEASURED_SD_M * MEASURED_SD_M;
        match (kind, &mut self.measured) {
            (Extent::Assumed, _) => self.assumed_m = extent_m,
            (Extent::Seen, measured @ None) => *measured = Some((extent_m, noise_m2)),
            (Extent::Seen, Some((mean_m, variance_m2))) => {
                let gain = *variance_m2 / (*variance_m2 + noise_m2);
                *mean_m += gain * (extent_m - *mean_m);
                *variance_m2 = (*variance_m2 * (1.0 - gain)).max(MIN_VARIANCE_M2);
            }
        }
    }

    /// Returns the extent of a track whose class has the usual extent `usual_m`.
    fn value_m(&self, usual_m: f64) -> f64 {
        let extent_m = self.measured.map_or(usual_m.max(self.assumed_m), |(mean_m, _)| mean_m);
        extent_m.max(self.least_m)
    }
}

/// Length and width of one track.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TrackExtent {
    length: ExtentEstimate,
    width: ExtentEstimate,
}

impl TrackExtent {
    /// Updates length and width with the box of one scan.
    pub(crate) fn update(&mut self, detection: &Detection) {
        self.length.update(detection.length_m, detection.length);
        self.width.update(detection.width_m, detection.width);
    }

    /// Lets the length grow towards the distance between two ends of the vehicle's parts. The
    /// vehicle is at least that long.
    ///
    /// A single scan that takes a part of another vehicle for one of this vehicle changes it
    /// little.
    pub(crate) fn span_length(&mut self, length_m: f64) {
        self.length.least_m += GROWTH_SHARE * (length_m - self.length.least_m).max(0.0);
    }

    /// Returns the length that parts of the vehicle have shown together (m); 0 before there are
    /// several.
    pub(crate) fn spanned_m(&self) -> f64 {
        self.length.least_m
    }

    /// Returns length and width (m) of a track with the class scores `class`.
    pub(crate) fn size_m(&self, class: &ClassScores) -> (f64, f64) {
        let Dimensions { length_m, width_m, .. } = class.best_vehicle_class().typical_dimensions();
        (self.length.value_m(length_m), self.width.value_m(width_m))
    }
}
