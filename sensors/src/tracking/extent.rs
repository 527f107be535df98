//! How long and wide a track is.
//!
//! An extent whose both ends were seen is averaged over the scans; one that never was is the usual one of the most
//! probable class, or what was seen of it if that is more.

use closecall_traffic::{ClassScores, Dimensions};

use crate::{Detection, Extent};

/// Standard deviation of an extent measured from one scan [m]: beam spacing and range noise at both ends (assumption).
const MEASURED_SD_M: f64 = 0.3;
/// Below this variance an extent is not averaged further, so that a slow error can still be corrected [m²].
const LEAST_VARIANCE_M2: f64 = 0.003;

/// One extent.
#[derive(Clone, Copy, Debug, Default)]
struct OneExtent {
    /// Average and its variance, once both ends were seen [m, m²].
    seen: Option<(f64, f64)>,
    /// The most that was seen or assumed while they were not [m].
    at_least_m: f64,
}

impl OneExtent {
    fn look(&mut self, extent_m: f64, kind: Extent) {
        let noise_m2 = MEASURED_SD_M * MEASURED_SD_M;
        match (kind, &mut self.seen) {
            (Extent::Assumed, _) => self.at_least_m = extent_m,
            (Extent::Seen, seen @ None) => *seen = Some((extent_m, noise_m2)),
            (Extent::Seen, Some((mean_m, variance_m2))) => {
                let gain = *variance_m2 / (*variance_m2 + noise_m2);
                *mean_m += gain * (extent_m - *mean_m);
                *variance_m2 = (*variance_m2 * (1.0 - gain)).max(LEAST_VARIANCE_M2);
            }
        }
    }

    fn value_m(&self, usual_m: f64) -> f64 {
        self.seen.map_or(usual_m.max(self.at_least_m), |(mean_m, _)| mean_m)
    }
}

/// Length and width of one track.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TrackExtent {
    length: OneExtent,
    width: OneExtent,
}

impl TrackExtent {
    /// Takes in the box of one scan.
    pub(super) fn look(&mut self, detection: &Detection) {
        self.length.look(detection.length_m, detection.length);
        self.width.look(detection.width_m, detection.width);
    }

    /// Length and width [m] of something that is probably of this class.
    pub(super) fn size_m(&self, class: &ClassScores) -> (f64, f64) {
        let Dimensions { length_m, width_m, .. } = class.best_vehicle_class().typical_dimensions();
        (self.length.value_m(length_m), self.width.value_m(width_m))
    }
}
