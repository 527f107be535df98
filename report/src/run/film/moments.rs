//! The instants of a film that matter: the critical one, and the five moments of the encounter, (a) to (e).

use closecall_traffic::Time;

use super::Film;
use closecall_simulation::outcome::MomentAt;

impl Film {
    /// The moment to look at first: when E collided, else anyone; where nobody did, when the vehicle behind was at its
    /// smallest time headway; in recorded traffic, when the marking was crossed in an encounter, or anyone was closest;
    /// where there was none of all this, the end, with the whole run before it.
    pub fn critical_moment(&self) -> Time {
        if let Some(collision) = self.worst_collision() {
            return collision.time;
        }
        if let Some(highlight) = self.highlight {
            return highlight;
        }
        if self.outcome.is_none() {
            return self.closest_moment();
        }
        let headways = self.frames.iter().filter_map(|frame| Some((frame.time, frame.margins.thw_rear_s.ok()?)));
        let closest = headways.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time);
        closest.unwrap_or_else(|| self.end())
    }

    /// The time of the last frame.
    pub(crate) fn end(&self) -> Time {
        self.frames.last().map_or(Time::ZERO, |frame| frame.time)
    }

    /// The moments of the encounter that were reached, in order of time.
    pub(crate) fn moments(&self) -> &[MomentAt] {
        self.outcome.as_ref().map_or(&[], |outcome| &outcome.moments)
    }

    /// When another vehicle was nearest to E in recorded traffic, from box to box.
    fn closest_moment(&self) -> Time {
        let distance = |row: usize| {
            let frame = &self.frames[row];
            let own = self.moving(frame, self.ego).shape;
            let others = (0..self.cast.len()).filter(|&actor| actor != self.ego && self.is_there(actor, row));
            others.map(|actor| own.distance_m(&self.moving(frame, actor).shape)).min_by(f64::total_cmp)
        };
        let rows = (0..self.frames.len()).filter_map(|row| Some((row, distance(row)?)));
        let closest = rows.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(row, _)| self.frames[row].time);
        closest.unwrap_or_else(|| self.end())
    }
}
