//! The sectors in which an object-level sensor sees nothing.

use super::visibility::Direction;
use super::visibility::union_width;
use crate::faults::Sectors;
use crate::surroundings::OtherVehicle;
use closecall_traffic::maths;

/// Blocked sectors in the coordinates of a sensor's visibility, in memory that is reused.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocked {
    /// For a sensor that looks ahead or back, the least and greatest slope of each sector.
    slopes: Vec<[f64; 2]>,
    /// For a sensor that looks around, the azimuths of each (rad).
    azimuths_rad: Vec<[f64; 2]>,
    parts: Vec<(f64, f64)>,
}

impl Blocked {
    /// Sets the sectors of a sensor that looks in this direction.
    pub(super) fn set(&mut self, sectors: &Sectors, direction: Direction) {
        self.slopes.clear();
        self.azimuths_rad.clear();
        let ends_rad = sectors.iter().flatten().map(|ends_deg| ends_deg.map(f64::to_radians));
        match direction {
            Direction::Around => self.azimuths_rad.extend(ends_rad),
            // Ahead, the left is on the left of the ego. Behind, a slope is the distance to the
            // left, too.
            Direction::Ahead | Direction::Behind => self.slopes.extend(ends_rad.map(|ends| ends.map(maths::tan))),
        }
    }

    /// Returns the slopes that are blocked.
    pub(super) fn slopes(&self) -> &[[f64; 2]] {
        &self.slopes
    }

    /// Returns the share of the vehicle's width that blocked azimuths hide from the ego's middle.
    pub(super) fn hidden_share(&mut self, other: &OtherVehicle) -> f64 {
        if self.azimuths_rad.is_empty() {
            return 0.0;
        }
        let azimuth_rad = |x_m: f64, y_m: f64| maths::atan2(y_m, -x_m);
        let centre_rad = azimuth_rad(other.x_m, other.y_m);
        let (ahead_m, left_m) = (0.5 * other.length_m, 0.5 * other.width_m);
        let corners = [(ahead_m, left_m), (ahead_m, -left_m), (-ahead_m, left_m), (-ahead_m, -left_m)];
        let offsets_rad = corners.map(|(ahead_m, left_m)| {
            let x_m = other.x_m + ahead_m * other.cos - left_m * other.sin;
            let y_m = other.y_m + ahead_m * other.sin + left_m * other.cos;
            wrapped(azimuth_rad(x_m, y_m) - centre_rad)
        });
        let low_rad = centre_rad + offsets_rad.into_iter().fold(f64::INFINITY, f64::min);
        let high_rad = centre_rad + offsets_rad.into_iter().fold(f64::NEG_INFINITY, f64::max);
        self.parts.clear();
        for [from_rad, to_rad] in &self.azimuths_rad {
            // A vehicle ahead of the ego lies across the azimuth of half a turn.
            for turn_rad in [-std::f64::consts::TAU, 0.0, std::f64::consts::TAU] {
                let part = ((from_rad + turn_rad).max(low_rad), (to_rad + turn_rad).min(high_rad));
                if part.0 < part.1 {
                    self.parts.push(part);
                }
            }
        }
        union_width(&mut self.parts) / (high_rad - low_rad)
    }
}

/// Returns an angle from half a turn to the right to half a turn to the left (rad).
fn wrapped(angle_rad: f64) -> f64 {
    let turns = (angle_rad / std::f64::consts::TAU).round();
    angle_rad - turns * std::f64::consts::TAU
}
