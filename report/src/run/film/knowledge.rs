//! The ego's knowledge of the vehicle behind it: since when it was tracked, its distance at that
//! time, and when it was lost.

use closecall_sensors::SceneVehicle;
use closecall_traffic::{Source, Time, Track, TrackId, TrackStatus};

use super::{Film, Frame};

/// Largest distance along the road between a track and the vehicle that it belongs to (m): an
/// assumption; 3 to 10 are plausible.
const SAME_VEHICLE_M: f64 = 5.0;

/// Probability of existence from which on the ego believes in a track: below it, the ego stack acts
/// as if nothing were there.
const BELIEVED: f64 = 0.5;

/// Time within which a vehicle counts as seen from the start (s): an assumption; 0.05 to 0.2 are
/// plausible. The ego begins to believe in a track with the second scan.
const AT_START_S: f64 = 0.1;

/// The vehicle of a track that belongs to none.
const NO_VEHICLE: &str = "a vehicle that does not exist";

/// A vehicle behind the ego, as the rear sensors know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::run) struct RearSeen {
    /// Number of its track.
    pub(in crate::run) track: TrackId,
    /// Index of the vehicle among the actors; `None` for a track that belongs to no vehicle.
    pub(in crate::run) actor: Option<usize>,
    /// Distance from its front to the rear of the ego (m).
    pub(in crate::run) gap_m: f64,
}

/// A span of time in which a vehicle behind the ego was or was not known.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::run) struct KnownSpan {
    /// Index of the first frame.
    pub(in crate::run) first_frame: usize,
    /// Time of the first frame.
    pub(in crate::run) time: Time,
    /// Distance at the beginning (m), if a vehicle was known.
    pub(in crate::run) from_m: Option<f64>,
    /// True if a vehicle was known before.
    is_later: bool,
}

impl KnownSpan {
    /// Returns the words for a short bar of the band of states.
    pub(in crate::run) fn short_words(&self) -> String {
        self.from_m.map_or("none".to_owned(), |from_m| format!("{from_m:.0} m"))
    }

    /// Returns the words for the band of states.
    pub(in crate::run) fn words(&self) -> String {
        match (self.from_m, self.is_later) {
            (Some(from_m), _) => format!("seen from {from_m:.0} m on"),
            (None, false) => "no vehicle seen".to_owned(),
            (None, true) => "out of sight".to_owned(),
        }
    }
}

/// Returns the confirmed tracks of vehicles behind the ego that the ego believes in. A track that has
/// passed the rear bumper is not behind.
pub(super) fn rear_seen(tracks: &[Track], vehicles: &[SceneVehicle], ego: usize) -> Vec<RearSeen> {
    let ego_vehicle = &vehicles[ego];
    let is_known = |track: &&Track| {
        track.source == Source::Rear
            && track.status != TrackStatus::Tentative
            && track.existence >= BELIEVED
            && track.class.vehicle() >= 0.5
    };
    let belongs = |track: &Track| {
        let lateral_m = |index: &usize| (vehicles[*index].state.d_m - ego_vehicle.state.d_m - track.y_m()).abs();
        let is_near = |index: &usize| {
            (vehicles[*index].state.s_m - ego_vehicle.state.s_m - track.x_m()).abs() < SAME_VEHICLE_M && *index != ego
        };
        (0..vehicles.len()).filter(is_near).min_by(|a, b| lateral_m(a).total_cmp(&lateral_m(b)))
    };
    let ego_length_m = ego_vehicle.vehicle.dimensions.length_m;
    let rear_vehicle = |track: &Track| RearSeen {
        track: track.id,
        actor: belongs(track),
        gap_m: -track.x_m() - 0.5 * (track.length_m + ego_length_m),
    };
    tracks.iter().filter(is_known).map(rear_vehicle).filter(|rear_vehicle| rear_vehicle.gap_m > 0.0).collect()
}

impl Film {
    /// Returns the spans in which a vehicle behind the ego was or was not known, in order of time.
    /// Recorded traffic has none.
    pub(in crate::run) fn known_spans(&self) -> Vec<KnownSpan> {
        let mut spans: Vec<KnownSpan> = Vec::new();
        if self.outcome.is_none() {
            return spans;
        }
        let relevant = self.relevant_rear();
        for (first_frame, frame) in self.frames.iter().enumerate() {
            let gap_m = nearest_gap(frame, relevant);
            if spans.last().is_none_or(|span| span.from_m.is_some() != gap_m.is_some()) {
                let is_later = spans.iter().any(|span| span.from_m.is_some());
                spans.push(KnownSpan { first_frame, time: frame.time, from_m: gap_m, is_later });
            }
        }
        spans
    }

    /// Returns the vehicle for which the system engaged, in words: its letter or its name. `None`
    /// if it never engaged, or states no track.
    pub(in crate::run) fn engaged_for(&self) -> Option<&str> {
        let engaged_at = Time::from_s(self.outcome.as_ref()?.mis.as_ref().ok()?.engaged_at_s.ok()?);
        let frame = self.frame_at(engaged_at)?;
        let track = frame.command?.plan?.track;
        let seen = frame.rear_seen.iter().find(|vehicle| vehicle.track == track)?;
        Some(seen.actor.map_or(NO_VEHICLE, |actor| self.vehicle_letter(actor)))
    }

    /// Returns a sentence on when the ego first saw the relevant vehicle behind it, with the
    /// weather if that is not clear.
    pub(in crate::run) fn sight(&self) -> Option<String> {
        let spans = self.known_spans();
        if spans.is_empty() {
            return None;
        }
        let weather = self.weather().map_or(String::new(), |weather| format!("; {weather}"));
        let first = spans.iter().find_map(|span| Some((span.time, span.from_m?)));
        let lost = self.lost(&spans);
        let vehicle = self.relevant_rear().map_or("The vehicle behind", |actor| self.vehicle_letter(actor));
        Some(match first {
            Some((time, from_m)) if time.s() - self.frames[0].time.s() > AT_START_S => {
                format!("{vehicle} was not seen behind until {:.2} s ({from_m:.0} m{weather}).{lost}", time.s())
            }
            Some((_, from_m)) => format!("{vehicle} was seen behind from the start ({from_m:.0} m{weather}).{lost}"),
            None => format!("No vehicle was seen behind{}.", weather.replacen("; ", " (", 1) + closing(&weather)),
        })
    }
}

impl Film {
    /// Returns the relevant vehicle behind: the vehicle that collides with the ego, else the last
    /// vehicle behind it in its lane at the critical moment. `None` if there is none.
    fn relevant_rear(&self) -> Option<usize> {
        let critical = self.critical_moment();
        let until = self.frames.partition_point(|frame| frame.time <= critical);
        let follower = self.frames[..until].iter().rev().find_map(|frame| frame.margins.follower);
        let ego = self.actors[self.ego].name.as_str();
        let partner = self.worst_collision().filter(|collision| collision.between.iter().any(|id| id.as_str() == ego));
        let struck = partner.and_then(|collision| {
            let other = collision.between.iter().find(|id| id.as_str() != ego)?;
            self.actors.iter().position(|actor| actor.name == other.as_str())
        });
        // The ego may have run into a vehicle ahead, which was never behind.
        let was_behind =
            |actor: &usize| self.frames[..until].iter().any(|frame| frame.margins.follower == Some(*actor));
        struck.filter(was_behind).or(follower)
    }

    /// Returns a sentence on the spans before the critical moment in which a known vehicle is out
    /// of sight.
    fn lost(&self, spans: &[KnownSpan]) -> String {
        let critical = self.critical_moment();
        let ends =
            spans.windows(2).filter(|pair| pair[0].is_later && pair[0].from_m.is_none() && pair[1].time <= critical);
        let texts: Vec<String> =
            ends.map(|pair| format!("{:.2} to {:.2} s", pair[0].time.s(), pair[1].time.s())).collect();
        match texts.as_slice() {
            [] => String::new(),
            [sensor] => format!(" It was lost from {sensor}."),
            more => format!(" It was lost {} times, first from {}.", more.len(), more[0]),
        }
    }
}

/// Returns the bracket that closes the weather, if there is one.
fn closing(weather: &str) -> &'static str {
    if weather.is_empty() { "" } else { ")" }
}

/// Returns the distance of the nearest vehicle that is known, or of the vehicle `relevant` alone
/// (m).
fn nearest_gap(frame: &Frame, relevant: Option<usize>) -> Option<f64> {
    let vehicles = frame.rear_seen.iter().filter(|vehicle| relevant.is_none() || vehicle.actor == relevant);
    vehicles.map(|vehicle| vehicle.gap_m).min_by(f64::total_cmp)
}
