//! Evaluation of tracks against the true scene: identity switches, false tracks, and consistency of
//! the covariance.
//!
//! Nothing here feeds back into perception. The normalised estimation error squared (NEES) of a
//! consistent filter has the mean 4, the number of dimensions `[x, y, vx, vy]` of the nearest face
//! (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2).

use closecall_traffic::{Source, Track, TrackId, TrackStatus, maths};
use nalgebra::{Matrix2, Vector2, Vector4};

use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Scene, SensorError};

/// Maximum distance between the nearest faces of a track and of the vehicle that it is matched with
/// (m).
const MATCH_DISTANCE_M: f64 = 3.0;

/// Number of standard deviations of its position within which a track keeps its vehicle, even
/// beyond [`MATCH_DISTANCE_M`]. A coasting track that comes near another vehicle is therefore not
/// matched with that vehicle.
const KEPT_DEVIATIONS: f64 = 3.0;

/// Upper bound of 95 % of a consistent filter's NEES values: the quantile of χ² with 4 degrees of
/// freedom.
pub const NEES_QUANTILE_95: f64 = 9.488;

/// The vehicle that one track is matched with.
#[derive(Clone, Copy, Debug)]
struct TrackOwner {
    id: TrackId,
    actor: usize,
}

/// The latest track that was matched with one vehicle.
#[derive(Clone, Copy, Debug)]
struct LatestTrack {
    actor: usize,
    last_id: TrackId,
}

/// The vehicle that a track is matched with, and the errors of the track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackMatch {
    /// Index of the vehicle in the scenario's list of actors.
    pub actor: usize,
    /// Distance between the nearest faces of the track and of the vehicle (m).
    pub distance_m: f64,
    /// Errors of `[x, y, vx, vy]` of the nearest face (m, m/s): the errors whose NEES
    /// [`TrackAudit`] computes.
    pub error: [f64; 4],
}

/// Matches all tracks of a run with the vehicles, as [`TrackAudit`] matches the confirmed ones.
#[derive(Clone, Debug, Default)]
pub struct TrackMatcher {
    others: Vec<OtherVehicle>,
    owners: Vec<TrackOwner>,
}

impl TrackMatcher {
    /// Returns the match of each track of a step, in their order; `None` for a track without a
    /// vehicle within reach.
    ///
    /// # Errors
    /// Returns [`SensorError::NotFinite`] if a vehicle's state in the scene is not finite.
    pub fn observe(&mut self, tracks: &[Track], scene: &Scene<'_>) -> Result<Vec<Option<TrackMatch>>, SensorError> {
        let mut others = std::mem::take(&mut self.others);
        transform_scene(scene, &mut others)?;
        let matched = tracks.iter().map(|track| {
            let actor = owner(&self.owners, track, &others)?;
            let other = others.iter().find(|other| other.actor == actor)?;
            let error = face_error(track, other);
            Some(TrackMatch { actor, distance_m: face_distance_m(track, other), error: error.into() })
        });
        let matches: Vec<_> = matched.collect();
        for (track, matched) in tracks.iter().zip(&matches).filter(|(track, _)| track.status != TrackStatus::Tentative)
        {
            if let Some(TrackMatch { actor, .. }) = *matched {
                note_owner(&mut self.owners, TrackOwner { id: track.id, actor });
            }
        }
        self.others = others;
        Ok(matches)
    }
}

/// Statistics of the confirmed rear tracks of a run.
#[derive(Clone, Debug, Default)]
pub struct TrackAudit {
    others: Vec<OtherVehicle>,
    owners: Vec<TrackOwner>,
    latest_tracks: Vec<LatestTrack>,
    false_ids: Vec<TrackId>,
    /// The NEES of each match of a confirmed track with a vehicle, in order of time.
    pub nees: Vec<f64>,
    /// The NEES of `[x, vx]` and of `[y, vy]` for the same matches. Each has the mean 2 for a
    /// consistent filter.
    pub nees_by_axis: Vec<[f64; 2]>,
    /// Number of times that a vehicle's track changed its id.
    pub id_switches: u64,
    /// Sum over the same matches of the squared error of the speed along the ego's axis (m²/s²).
    pub speed_error_sum_m2ps2: f64,
}

impl TrackAudit {
    /// Compares the tracks of one step with the scene that they come from.
    ///
    /// # Errors
    /// Returns [`SensorError::NotFinite`] if a vehicle's state in the scene is not finite.
    pub fn observe(&mut self, tracks: &[Track], scene: &Scene<'_>) -> Result<(), SensorError> {
        let mut others = std::mem::take(&mut self.others);
        transform_scene(scene, &mut others)?;
        for other in &others {
            let owner = |track: &&Track| owner(&self.owners, track, &others) == Some(other.actor);
            let nearest = confirmed(tracks)
                .filter(owner)
                .min_by(|a, b| face_distance_m(a, other).total_cmp(&face_distance_m(b, other)));
            if let Some(track) = nearest {
                self.add_match(track, other);
            }
        }
        for track in confirmed(tracks) {
            let owner = owner(&self.owners, track, &others);
            if let Some(actor) = owner {
                note_owner(&mut self.owners, TrackOwner { id: track.id, actor });
            } else if track.class.vehicle() > 0.5 && !self.false_ids.contains(&track.id) {
                self.false_ids.push(track.id);
            }
        }
        self.others = others;
        Ok(())
    }

    /// Returns the number of confirmed tracks that were classified as a vehicle while they matched
    /// none.
    pub fn false_tracks(&self) -> usize {
        self.false_ids.len()
    }

    /// Returns the mean NEES. Returns `None` before the first match.
    pub fn mean_nees(&self) -> Option<f64> {
        self.mean_over_steps(self.nees.iter().sum())
    }

    /// Returns the root mean square error of the speed (m/s). Returns `None` before the first
    /// match.
    pub fn speed_rmse_mps(&self) -> Option<f64> {
        self.mean_over_steps(self.speed_error_sum_m2ps2).map(f64::sqrt)
    }

    /// Appends the errors of the matches of `other`, in their order.
    pub fn extend(&mut self, other: &Self) {
        self.nees.extend_from_slice(&other.nees);
        self.nees_by_axis.extend_from_slice(&other.nees_by_axis);
        self.speed_error_sum_m2ps2 += other.speed_error_sum_m2ps2;
    }

    fn mean_over_steps(&self, sum: f64) -> Option<f64> {
        (!self.nees.is_empty()).then(|| sum / self.nees.len() as f64)
    }

    /// Adds the match of a track with a vehicle to the statistics.
    fn add_match(&mut self, track: &Track, other: &OtherVehicle) {
        match self.latest_tracks.iter_mut().find(|latest| latest.actor == other.actor) {
            Some(latest) if latest.last_id == track.id => {}
            Some(latest) => {
                latest.last_id = track.id;
                self.id_switches += 1;
            }
            None => self.latest_tracks.push(LatestTrack { actor: other.actor, last_id: track.id }),
        }
        let error = face_error(track, other);
        self.speed_error_sum_m2ps2 += error[2] * error[2];
        // A singular covariance claims certainty, which is inconsistent with any nonzero error.
        let inverse = track.covariance.try_inverse();
        let nees = inverse.map_or(f64::INFINITY, |inverse| (error.transpose() * inverse * error)[0]);
        self.nees.push(nees);
        self.nees_by_axis.push([0, 1].map(|axis| axis_nees(track, &error, axis)));
    }
}

/// Returns the NEES of position and speed along one of the ego's axes.
fn axis_nees(track: &Track, error: &Vector4<f64>, axis: usize) -> f64 {
    let error = Vector2::new(error[axis], error[axis + 2]);
    let part = |row: usize, column: usize| track.covariance[(axis + 2 * row, axis + 2 * column)];
    let inverse = Matrix2::from_fn(part).try_inverse();
    inverse.map_or(f64::INFINITY, |inverse| (error.transpose() * inverse * error)[0])
}

/// Returns the vehicle that a track is matched with: the vehicle of the previous match while it is
/// near enough, else the nearest vehicle.
fn owner(owners: &[TrackOwner], track: &Track, others: &[OtherVehicle]) -> Option<usize> {
    let keep_distance_m = KEPT_DEVIATIONS * (track.covariance[(0, 0)] + track.covariance[(1, 1)]).sqrt();
    let before = owners.iter().find(|entry| entry.id == track.id).map(|entry| entry.actor);
    let kept = others.iter().find(|other| Some(other.actor) == before);
    if kept.is_some_and(|other| face_distance_m(track, other) <= keep_distance_m.max(MATCH_DISTANCE_M)) {
        return before;
    }
    let nearest = others.iter().min_by(|a, b| face_distance_m(track, a).total_cmp(&face_distance_m(track, b)));
    nearest.filter(|other| face_distance_m(track, other) <= MATCH_DISTANCE_M).map(|other| other.actor)
}

/// Notes the vehicle that a track is matched with, in place of an earlier one.
fn note_owner(owners: &mut Vec<TrackOwner>, owner: TrackOwner) {
    owners.retain(|entry| entry.id != owner.id);
    owners.push(owner);
}

/// Returns the rear tracks that a controller may act on.
fn confirmed(tracks: &[Track]) -> impl Iterator<Item = &Track> {
    tracks.iter().filter(|track| track.source == Source::Rear && track.status != TrackStatus::Tentative)
}

/// Returns the error of a track's position and velocity in the ego's frame.
///
/// The position is the nearest face along the vehicle and the centre across it. The sensor measures
/// the face, and the face defines gaps. The error of the centres therefore loses half of the
/// difference between the lengths.
fn face_error(track: &Track, other: &OtherVehicle) -> Vector4<f64> {
    let half_difference_m = 0.5 * (track.length_m - other.length_m);
    // A vehicle behind the ego shows its front. A rear sensor has seen only the front of a vehicle
    // that is alongside by now.
    let shift_m = if other.x_m < 0.0 || track.source == Source::Rear { half_difference_m } else { -half_difference_m };
    Vector4::new(
        track.x_m() + shift_m * other.cos - other.x_m,
        track.y_m() + shift_m * other.sin - other.y_m,
        track.vx_mps() - other.speed_mps * other.cos,
        track.vy_mps() - other.speed_mps * other.sin,
    )
}

/// Returns the distance between the nearest faces of a track and a vehicle.
fn face_distance_m(track: &Track, other: &OtherVehicle) -> f64 {
    let error = face_error(track, other);
    maths::hypot(error[0], error[1])
}
