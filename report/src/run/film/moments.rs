//! The critical moment of a film, and the moments of its encounter.

use closecall_traffic::{Measured, Time};

use super::Film;
use closecall_scenarios::outcome::ReachedMoment;
use closecall_simulation::CurrentMargins;

/// Time by which the moment at which a recording opens may precede the critical moment.
const A_LITTLE: Time = Time::from_ms(2_000);

impl Film {
    /// Returns the critical moment of the film, at which its views open.
    ///
    /// This is the first of these that exists:
    /// 1. the first collision of the ego, else of any vehicles
    /// 2. in a recorded encounter: the time at which the rear vehicle crosses the lane marking
    /// 3. in a recorded lane change: the time of a critical metric, else the time at which another
    ///    vehicle is closest to the ego
    /// 4. in a run: the time of the smallest time headway of the vehicle behind, else of the ego to
    ///    the vehicle ahead
    /// 5. the end
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
        let smallest = |headway: fn(&CurrentMargins) -> Measured| {
            let headways = self.frames.iter().filter_map(|frame| Some((frame.time, headway(&frame.margins).ok()?)));
            headways.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(time, _)| time)
        };
        let closest = smallest(|margins| margins.thw_rear_s).or_else(|| smallest(|margins| margins.thw_front_s));
        closest.unwrap_or_else(|| self.end())
    }

    /// Returns the time of the frame that shows the critical moment: for a collision, the first
    /// frame in which the vehicles touch.
    pub(in crate::run) fn critical_frame_time(&self) -> Time {
        let critical = self.critical_moment();
        let at = self.frames.partition_point(|frame| frame.time < critical);
        self.frames.get(at).map_or_else(|| self.end(), |frame| frame.time)
    }

    /// Returns the moment at which a recording of these films opens, the same in all of them: the
    /// collision of the last film that has one, else the critical moment of the last film. A film
    /// that ends a little earlier could only show its last frame, so all show that moment then.
    pub(in crate::run) fn shown_moment(films: &[Self]) -> Time {
        let collided = films.iter().rev().find(|film| film.worst_collision().is_some());
        let shown = collided.or(films.last()).map_or(Time::ZERO, Self::critical_frame_time);
        let first_end = films.iter().map(Self::end).min().unwrap_or(shown);
        let is_a_little_earlier = first_end < shown && shown - first_end <= A_LITTLE;
        if collided.is_none() && is_a_little_earlier { first_end } else { shown }
    }

    /// Returns the times of the first and of the last frame of any of these films.
    pub(in crate::run) fn span(films: &[Self]) -> [Time; 2] {
        let start = films.iter().filter_map(|film| film.frames.first()).map(|frame| frame.time).min();
        let end = films.iter().map(Self::end).max();
        [start, end].map(|time| time.unwrap_or(Time::ZERO))
    }

    /// Returns the time of the last frame.
    pub(crate) fn end(&self) -> Time {
        self.frames.last().map_or(Time::ZERO, |frame| frame.time)
    }

    /// Returns the moments of the encounter that the run reached, in order of time.
    pub(crate) fn moments(&self) -> &[ReachedMoment] {
        self.outcome.as_ref().map_or(&[], |outcome| &outcome.moments)
    }

    /// Returns the time at which the box of another vehicle is closest to the box of the ego.
    fn closest_moment(&self) -> Time {
        let distance_m = |frame_index: usize| {
            let frame = &self.frames[frame_index];
            let ego = self.moving_box(frame, self.ego).shape;
            let others =
                (0..self.actors.len()).filter(|&actor| actor != self.ego && self.is_present(actor, frame_index));
            others.map(|actor| ego.distance_m(&self.moving_box(frame, actor).shape)).min_by(f64::total_cmp)
        };
        let distances = (0..self.frames.len()).filter_map(|index| Some((index, distance_m(index)?)));
        let closest = distances.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| self.frames[index].time);
        closest.unwrap_or_else(|| self.end())
    }
}
