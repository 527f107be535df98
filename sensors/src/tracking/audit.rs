//! Tracks held against the truth: switches of identity, false tracks, and whether the covariance is honest.
//!
//! Nothing here feeds back into perception. The normalised error squared (NEES) of a consistent filter has the mean 4,
//! the number of dimensions [x, y, vx, vy] of the nearest face (Bar-Shalom, Li, Kirubarajan 2001, section 5.4.2).

use closecall_traffic::{Source, Track, TrackId, TrackStatus};
use nalgebra::Vector4;

use crate::surroundings::{Other, survey};
use crate::{Scene, SensorError};

/// A track belongs to a vehicle whose nearest face is within this of the track's [m].
const MATCH_DISTANCE_M: f64 = 3.0;

/// What was seen of one vehicle.
#[derive(Clone, Copy, Debug)]
struct Followed {
    actor: usize,
    last_id: TrackId,
}

/// Counters over the confirmed rear tracks of a run.
#[derive(Clone, Debug, Default)]
pub struct TrackAudit {
    others: Vec<Other>,
    followed: Vec<Followed>,
    false_ids: Vec<TrackId>,
    /// Times that the track nearest to a vehicle changed its number.
    pub id_switches: u64,
    /// Steps in which a confirmed track matched a vehicle.
    pub matched_steps: u64,
    /// Sum of the normalised errors squared over these.
    pub nees_sum: f64,
    /// Sum of the squared errors of the speed along E's axis over these [m²/s²].
    pub speed_error_sum_m2ps2: f64,
}

impl TrackAudit {
    /// Compares the tracks of one step with the scene they come from.
    ///
    /// # Errors
    /// [`SensorError::NotFinite`] where the scene is not finite.
    pub fn observe(&mut self, tracks: &[Track], scene: &Scene<'_>) -> Result<(), SensorError> {
        let mut others = std::mem::take(&mut self.others);
        survey(scene, &mut others)?;
        for other in &others {
            let distance_m = |track: &&Track| face_distance_m(track, other);
            let nearest = confirmed(tracks).min_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
            if let Some(track) = nearest.filter(|track| distance_m(track) <= MATCH_DISTANCE_M) {
                self.follow(track, other);
            }
        }
        for track in confirmed(tracks).filter(|track| track.class.vehicle() > 0.5) {
            let is_near = |other: &Other| face_distance_m(track, other) <= MATCH_DISTANCE_M;
            if !others.iter().any(is_near) && !self.false_ids.contains(&track.id) {
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
        (self.matched_steps > 0).then(|| self.nees_sum / self.matched_steps as f64)
    }

    /// Root mean square error of the speed [m/s]; `None` before the first match.
    pub fn speed_rmse_mps(&self) -> Option<f64> {
        (self.matched_steps > 0).then(|| (self.speed_error_sum_m2ps2 / self.matched_steps as f64).sqrt())
    }

    fn follow(&mut self, track: &Track, other: &Other) {
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
        self.nees_sum += inverse.map_or(f64::INFINITY, |inverse| (error.transpose() * inverse * error)[0]);
        self.matched_steps += 1;
    }
}

/// The rear tracks that a controller may act on.
fn confirmed(tracks: &[Track]) -> impl Iterator<Item = &Track> {
    tracks.iter().filter(|track| track.source == Source::Rear && track.status != TrackStatus::Tentative)
}

/// Half a length from a centre at `x_m` to the face that is nearest to E [m], along the heading.
fn to_face_m(x_m: f64, length_m: f64) -> f64 {
    if x_m < 0.0 { 0.5 * length_m } else { -0.5 * length_m }
}

/// Error of the nearest face's position and of the velocity, in E's frame.
fn face_error(track: &Track, other: &Other) -> Vector4<f64> {
    let seen_m = to_face_m(track.x_m(), track.length_m);
    let true_m = to_face_m(other.x_m, other.length_m);
    let (sin, cos) = track.heading_rad.sin_cos();
    Vector4::new(
        track.x_m() + seen_m * cos - other.x_m - true_m * other.cos,
        track.y_m() + seen_m * sin - other.y_m - true_m * other.sin,
        track.vx_mps() - other.speed_mps * other.cos,
        track.vy_mps() - other.speed_mps * other.sin,
    )
}

fn face_distance_m(track: &Track, other: &Other) -> f64 {
    let error = face_error(track, other);
    error[0].hypot(error[1])
}
