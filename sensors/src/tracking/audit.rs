//! Tracks held against the truth: switches of identity, false tracks, and whether the covariance is consistent.
//!
//! Nothing here feeds back into perception. The normalised error squared (NEES) of a consistent filter has the mean 4,
//! the number of dimensions [x, y, vx, vy] of the nearest face (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2).

use closecall_traffic::{Source, Track, TrackId, TrackStatus};
use nalgebra::{Matrix2, Vector2, Vector4};

use crate::surroundings::{OtherVehicle, transform_scene};
use crate::{Scene, SensorError};

/// A track belongs to a vehicle whose nearest face is within this of the track's [m].
const MATCH_DISTANCE_M: f64 = 3.0;

/// A track keeps its vehicle while it is within this of it, or within so many standard deviations: one that coasts may
/// come near another, and is no track of that.
const KEPT_DEVIATIONS: f64 = 3.0;
/// Below this 95 % of the normalised errors squared of a consistent filter lie: χ² of 4 degrees of freedom.
pub const NEES_95: f64 = 9.488;

/// The vehicle of one track.
#[derive(Clone, Copy, Debug)]
struct Owned {
    id: TrackId,
    actor: usize,
}

/// The latest track of one vehicle.
#[derive(Clone, Copy, Debug)]
struct Followed {
    actor: usize,
    last_id: TrackId,
}

/// Counters over the confirmed rear tracks of a run.
#[derive(Clone, Debug, Default)]
pub struct TrackAudit {
    others: Vec<OtherVehicle>,
    owned: Vec<Owned>,
    followed: Vec<Followed>,
    false_ids: Vec<TrackId>,
    /// The normalised error squared of each step in which a confirmed track matched a vehicle, in order.
    pub nees: Vec<f64>,
    /// The same for [x, vx] alone and for [y, vy] alone; the mean of each is 2 for a consistent filter.
    pub nees_by_axis: Vec<[f64; 2]>,
    /// Times that the track of a vehicle changed its number.
    pub id_switches: u64,
    /// Sum of the squared errors of the speed along E's axis over these steps [m²/s²].
    pub speed_error_sum_m2ps2: f64,
}

impl TrackAudit {
    /// Compares the tracks of one step with the scene they come from.
    ///
    /// # Errors
    /// [`SensorError::NotFinite`] where the scene is not finite.
    pub fn observe(&mut self, tracks: &[Track], scene: &Scene<'_>) -> Result<(), SensorError> {
        let mut others = std::mem::take(&mut self.others);
        transform_scene(scene, &mut others)?;
        for other in &others {
            let owner = |track: &&Track| owner(&self.owned, track, &others) == Some(other.actor);
            let nearest = confirmed(tracks)
                .filter(owner)
                .min_by(|a, b| face_distance_m(a, other).total_cmp(&face_distance_m(b, other)));
            if let Some(track) = nearest {
                self.follow(track, other);
            }
        }
        for track in confirmed(tracks) {
            let owner = owner(&self.owned, track, &others);
            if let Some(actor) = owner {
                self.owned.retain(|owned| owned.id != track.id);
                self.owned.push(Owned { id: track.id, actor });
            } else if track.class.vehicle() > 0.5 && !self.false_ids.contains(&track.id) {
                self.false_ids.push(track.id);
            }
        }
        self.others = others;
        Ok(())
    }

    /// Confirmed tracks, taken for vehicles, that at some time belonged to none.
    pub fn false_tracks(&self) -> usize {
        self.false_ids.len()
    }

    /// Mean normalised error squared; `None` before the first match.
    pub fn mean_nees(&self) -> Option<f64> {
        self.mean_over_steps(self.nees.iter().sum())
    }

    /// Root mean square error of the speed [m/s]; `None` before the first match.
    pub fn speed_rmse_mps(&self) -> Option<f64> {
        self.mean_over_steps(self.speed_error_sum_m2ps2).map(f64::sqrt)
    }

    /// Takes in the errors of other steps, their order included.
    pub fn extend(&mut self, other: &Self) {
        self.nees.extend_from_slice(&other.nees);
        self.nees_by_axis.extend_from_slice(&other.nees_by_axis);
        self.speed_error_sum_m2ps2 += other.speed_error_sum_m2ps2;
    }

    fn mean_over_steps(&self, sum: f64) -> Option<f64> {
        (!self.nees.is_empty()).then(|| sum / self.nees.len() as f64)
    }

    fn follow(&mut self, track: &Track, other: &OtherVehicle) {
        match self.followed.iter_mut().find(|followed| followed.actor == other.actor) {
            Some(followed) if followed.last_id == track.id => {}
            Some(followed) => {
                followed.last_id = track.id;
                self.id_switches += 1;
            }
            None => self.followed.push(Followed { actor: other.actor, last_id: track.id }),
        }
        let error = face_error(track, other);
        self.speed_error_sum_m2ps2 += error[2] * error[2];
        // A covariance without inverse claims certainty, which no error but zero satisfies.
        let inverse = track.covariance.try_inverse();
        let nees = inverse.map_or(f64::INFINITY, |inverse| (error.transpose() * inverse * error)[0]);
        self.nees.push(nees);
        self.nees_by_axis.push([0, 1].map(|axis| axis_nees(track, &error, axis)));
    }
}

/// The normalised error squared of position and speed along one of E's axes.
fn axis_nees(track: &Track, error: &Vector4<f64>, axis: usize) -> f64 {
    let error = Vector2::new(error[axis], error[axis + 2]);
    let part = |row: usize, column: usize| track.covariance[(axis + 2 * row, axis + 2 * column)];
    let inverse = Matrix2::from_fn(part).try_inverse();
    inverse.map_or(f64::INFINITY, |inverse| (error.transpose() * inverse * error)[0])
}

/// The vehicle that a track belongs to: the one that it had, while it is near enough, else the nearest.
fn owner(owned: &[Owned], track: &Track, others: &[OtherVehicle]) -> Option<usize> {
    let reach_m = KEPT_DEVIATIONS * (track.covariance[(0, 0)] + track.covariance[(1, 1)]).sqrt();
    let before = owned.iter().find(|owned| owned.id == track.id).map(|owned| owned.actor);
    let kept = others.iter().find(|other| Some(other.actor) == before);
    if kept.is_some_and(|other| face_distance_m(track, other) <= reach_m.max(MATCH_DISTANCE_M)) {
        return before;
    }
    let nearest = others.iter().min_by(|a, b| face_distance_m(track, a).total_cmp(&face_distance_m(track, b)));
    nearest.filter(|other| face_distance_m(track, other) <= MATCH_DISTANCE_M).map(|other| other.actor)
}

/// The rear tracks that a controller may act on.
fn confirmed(tracks: &[Track]) -> impl Iterator<Item = &Track> {
    tracks.iter().filter(|track| track.source == Source::Rear && track.status != TrackStatus::Tentative)
}

/// Error of the nearest face's position along the vehicle and of the centre's across it, and of the velocity, in E's
/// frame. Half of the difference of the lengths is taken out: the face is what is measured, and what gaps are made of.
fn face_error(track: &Track, other: &OtherVehicle) -> Vector4<f64> {
    let half_m = 0.5 * (track.length_m - other.length_m);
    // What is behind E shows its front, and a rear sensor has seen nothing else of what has come alongside since.
    let longer_m = if other.x_m < 0.0 || track.source == Source::Rear { half_m } else { -half_m };
    Vector4::new(
        track.x_m() + longer_m * other.cos - other.x_m,
        track.y_m() + longer_m * other.sin - other.y_m,
        track.vx_mps() - other.speed_mps * other.cos,
        track.vy_mps() - other.speed_mps * other.sin,
    )
}

fn face_distance_m(track: &Track, other: &OtherVehicle) -> f64 {
    let error = face_error(track, other);
    error[0].hypot(error[1])
}
