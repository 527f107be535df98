//! From smoothed trajectories to lane changes.

use closecall_traffic::{Lane, Side, Trajectory};

use super::LaneChange;
use super::peaks::{find_peaks, width};
use crate::filters::{PERIOD, SmoothedRecording};
use crate::recordings::LaneMarkings;

/// A peak of lateral speed needs this prominence [m/s]; see the module's documentation.
pub const MIN_PROMINENCE_MPS: f64 = 0.15;

/// A complete lane change shifts the vehicle by at least this [m]: most of a lane, but a vehicle need not end in its middle.
pub const MIN_SHIFT_M: f64 = 2.5;

/// Samples for which a lane must be held before and after a crossing: 0.5 s.
const MIN_DWELL_SAMPLES: usize = 5;

/// A crossing this far beyond a manoeuvre's estimated ends still belongs to it [samples]: the estimate rounds to samples.
const END_TOLERANCE_SAMPLES: f64 = 0.5;

/// The lane changes of all tracks, in the order of track numbers and then of time.
pub fn detect(recording: &SmoothedRecording) -> Vec<LaneChange> {
    recording.trajectories.iter().flat_map(|track| detect_in(track, &recording.markings)).collect()
}

/// Share of a quintic lane change's duration that its peak of lateral speed is wide, measured at the share
/// `height_share` of the peak: √(1 − √h).
pub fn quintic_width_share(height_share: f64) -> f64 {
    (1.0 - height_share.sqrt()).sqrt()
}

/// A peak of lateral speed as a manoeuvre, in samples of its track.
struct Manoeuvre {
    direction: Side,
    peak_mps: f64,
    width: f64,
    duration: f64,
    start: f64,
    end: f64,
}

/// A change of the recorded lane.
struct Crossing {
    sample: usize,
    from: Lane,
    to: Lane,
}

impl Crossing {
    fn direction(&self) -> Side {
        if self.to < self.from { Side::Left } else { Side::Right }
    }
}

fn detect_in(track: &Trajectory, markings: &LaneMarkings) -> Vec<LaneChange> {
    let crossings = crossings(track);
    if crossings.is_empty() {
        return Vec::new();
    }
    let manoeuvres = manoeuvres(track, height_share(track, markings));
    let owners: Vec<Option<usize>> = crossings.iter().map(|crossing| owner(crossing, &manoeuvres)).collect();
    let found = crossings.iter().zip(&owners).filter_map(|(crossing, owner)| {
        let sole = owner.is_some() && owners.iter().filter(|other| *other == owner).count() == 1;
        Some(lane_change(track, crossing, manoeuvres.get((*owner)?)?, sole))
    });
    found.collect()
}

/// h = (w_vehicle / w_lane) / 2, the height at which widths are measured as a share of the peak.
fn height_share(track: &Trajectory, markings: &LaneMarkings) -> f64 {
    0.5 * (track.dimensions.width_m / markings.typical_lane_width_m()).min(1.0)
}

/// The highest peak in the crossing's direction between whose ends it lies.
fn owner(crossing: &Crossing, manoeuvres: &[Manoeuvre]) -> Option<usize> {
    let sample = crossing.sample as f64;
    let candidates = manoeuvres.iter().enumerate().filter(|(_, manoeuvre)| {
        manoeuvre.direction == crossing.direction()
            && sample >= manoeuvre.start - END_TOLERANCE_SAMPLES
            && sample <= manoeuvre.end + END_TOLERANCE_SAMPLES
    });
    candidates.max_by(|(_, a), (_, b)| a.peak_mps.total_cmp(&b.peak_mps)).map(|(index, _)| index)
}

fn manoeuvres(track: &Trajectory, height_share: f64) -> Vec<Manoeuvre> {
    let mut found = Vec::new();
    for (direction, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
        let speeds: Vec<f64> = track.points.iter().map(|point| sign * point.lateral_speed_mps).collect();
        // Rest before and after the track makes peaks of manoeuvres that the recording cuts at their fastest.
        let between_rests: Vec<f64> = [&[0.0], speeds.as_slice(), &[0.0]].concat();
        let peaks = find_peaks(&between_rests, MIN_PROMINENCE_MPS);
        for peak in peaks.into_iter().filter(|peak| peak.height > 0.0) {
            let (left, right) = width(&speeds, peak.index - 1, height_share * peak.height);
            let width = right - left;
            let duration = width / quintic_width_share(height_share);
            let beyond = 0.5 * (duration - width);
            let (start, end) = (left - beyond, right + beyond);
            found.push(Manoeuvre { direction, peak_mps: peak.height, width, duration, start, end });
        }
    }
    found
}

/// Changes between lanes that are each held for the least dwell; shorter stays are passed over.
fn crossings(track: &Trajectory) -> Vec<Crossing> {
    let stays = track.points.chunk_by(|a, b| a.lane == b.lane);
    let mut crossings = Vec::new();
    let (mut sample, mut held) = (0, None);
    for stay in stays {
        if stay.len() >= MIN_DWELL_SAMPLES {
            let to = stay[0].lane;
            if let Some(from) = held.filter(|from| *from != to) {
                crossings.push(Crossing { sample, from, to });
            }
            held = Some(to);
        }
        sample += stay.len();
    }
    crossings
}

fn lane_change(track: &Trajectory, crossing: &Crossing, manoeuvre: &Manoeuvre, sole: bool) -> LaneChange {
    let last = (track.points.len() - 1) as f64;
    let is_recorded = manoeuvre.start >= 0.0 && manoeuvre.end <= last;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the track's samples")]
    let point = |sample: f64| &track.points[sample.clamp(0.0, last) as usize];
    let shift = point(manoeuvre.end.ceil()).d_m - point(manoeuvre.start.floor()).d_m;
    let lateral_shift_m = if manoeuvre.direction == Side::Left { shift } else { -shift };
    let seconds = |samples: f64| samples * PERIOD.s();
    let time_s = |sample: f64| track.points[0].time.s() + seconds(sample);
    let at_crossing = &track.points[crossing.sample];
    LaneChange {
        track_id: track.track_id,
        vehicle_id: track.vehicle_id,
        vehicle_class: track.class,
        direction: manoeuvre.direction,
        from_lane: crossing.from.0,
        to_lane: crossing.to.0,
        start_s: time_s(manoeuvre.start),
        crossing_s: at_crossing.time.s(),
        end_s: time_s(manoeuvre.end),
        duration_s: seconds(manoeuvre.duration),
        width_s: seconds(manoeuvre.width),
        speed_mps: at_crossing.speed_mps,
        peak_lateral_speed_mps: manoeuvre.peak_mps,
        lateral_shift_m,
        complete: is_recorded && sole && lateral_shift_m >= MIN_SHIFT_M,
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::filters::smooth;
    use crate::recordings::test_support::{changing_track, recording_of, straight_track};

    fn found(track: Trajectory) -> Vec<LaneChange> {
        detect(&smooth(&recording_of(vec![track])))
    }

    #[test]
    fn the_published_share_of_a_quintic_path() {
        assert!((quintic_width_share(0.5 * 1.85 / 3.75) - 0.71).abs() < 0.005);
    }

    #[test]
    fn keeping_the_lane_is_no_lane_change() {
        assert!(found(straight_track(1, 0.0, 25.0, -1.75, 200)).is_empty());
    }

    #[test]
    fn a_swerve_that_stays_in_its_lane_is_none() {
        let mut track = straight_track(1, 0.0, 25.0, -1.75, 200);
        for (k, point) in track.points.iter_mut().enumerate() {
            point.d_m += (0.1 * k as f64).sin();
        }
        assert!(found(track).is_empty());
    }

    #[test]
    fn both_lane_changes_of_an_overtaking_are_found() {
        let out = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 5.0), 300);
        let back = changing_track(1, (0.0, 30.0), (0.0, -3.5), (18.0, 6.0), 300);
        let mut track = out.clone();
        for (point, back) in track.points.iter_mut().zip(&back.points) {
            point.d_m += back.d_m;
            point.lane = Lane(if point.d_m > -3.5 { 1 } else { 2 });
        }
        let found = found(track);
        assert_eq!(found.iter().map(|change| change.direction).collect::<Vec<_>>(), [Side::Left, Side::Right]);
        assert!(found.iter().all(|change| change.complete));
        assert!((found[0].crossing_s - 6.5).abs() <= 0.1 && (found[1].crossing_s - 21.0).abs() <= 0.1);
        assert!((found[0].duration_s - 5.0).abs() < 0.25 && (found[1].duration_s - 6.0).abs() < 0.3);
    }

    #[test]
    fn a_lane_change_that_the_recording_cuts_is_not_complete() {
        let found = found(changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 80));
        assert_eq!(found.len(), 1);
        assert!(!found[0].complete && (found[0].crossing_s - 7.0).abs() <= 0.1);
    }

    #[test]
    fn a_track_that_begins_or_ends_at_the_fastest_moment_still_has_its_crossing() {
        let whole = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        for range in [0..76, 64..150] {
            let found = found(whole.with_points(whole.points[range].to_vec()));
            assert_eq!(found.len(), 1);
            assert!(!found[0].complete && (found[0].crossing_s - 7.0).abs() <= 0.1);
        }
    }

    #[test]
    fn one_sweep_over_two_markings_is_two_lane_changes() {
        let found = found(changing_track(1, (0.0, 30.0), (-8.75, -1.75), (4.0, 9.0), 180));
        assert_eq!(found.iter().map(|change| (change.from_lane, change.to_lane)).collect::<Vec<_>>(), [(3, 2), (2, 1)]);
        assert!(found.iter().all(|change| !change.complete));
    }

    #[test]
    fn flicker_of_the_recorded_lane_is_passed_over() {
        let mut track = changing_track(1, (0.0, 30.0), (-5.25, -1.75), (4.0, 6.0), 150);
        for k in [20, 21, 68, 100] {
            track.points[k].lane = Lane(3 - track.points[k].lane.0);
        }
        assert_eq!(found(track).len(), 1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn durations_come_back_within_five_percent(
            start_s in 1.0_f64..4.0,
            duration_s in 2.0_f64..12.0,
            to_the_left in any::<bool>(),
        ) {
            let lanes = if to_the_left { (-5.25, -1.75) } else { (-1.75, -5.25) };
            let found = found(changing_track(7, (0.0, 30.0), lanes, (start_s, duration_s), 200));
            prop_assert_eq!(found.len(), 1);
            prop_assert!(found[0].complete);
            let error = (found[0].duration_s - duration_s) / duration_s;
            prop_assert!(error.abs() < 0.05, "{} instead of {duration_s}", found[0].duration_s);
            prop_assert!((found[0].crossing_s - start_s - 0.5 * duration_s).abs() <= 0.11);
        }
    }
}
