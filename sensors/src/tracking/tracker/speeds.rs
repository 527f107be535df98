//! The correction of the speeds of tracks by radars.

use closecall_traffic::ego_frame::EgoFrame;

use super::Tracker;
use crate::tracking::radar::{Candidate, Match, MeasuredSpeed, RadarDetection, RadarScan};

impl Tracker {
    /// Corrects the speed of each track that a detection belongs to. Each radar corrects a track
    /// once, by the detection that fits best. No track starts or ends by a radar; a speed that is
    /// known better may confirm a track earlier. `rear_x_m` is the position of the ego's rear end
    /// (m).
    ///
    /// A scan that is older than the tracks is not used: no filter is predicted backwards.
    pub fn correct_speeds(&mut self, scan: &RadarScan<'_>, rear_x_m: f64) {
        if scan.time < self.time || self.tracks.is_empty() {
            return;
        }
        let frame = EgoFrame::new(scan.road, &scan.ego);
        let ego = Self::ego_rear(scan.road, &scan.ego, rear_x_m);
        self.predict_to(scan.time, &ego);
        for detections in scan.detections {
            for (track, measured) in self.speeds(detections, &frame, scan.ego.speed_mps) {
                self.tracks[track].filter.measure_speed(measured.speed_mps, measured.sd_mps);
            }
        }
    }

    /// Returns the speeds that the detections of one radar measure, each with the index of its
    /// track.
    fn speeds(&self, detections: &[RadarDetection], frame: &EgoFrame<'_>, ego_mps: f64) -> Vec<(usize, MeasuredSpeed)> {
        let candidates: Vec<Candidate> = self
            .tracks
            .iter()
            .map(|track| Candidate {
                estimate: track.filter.estimate(),
                span_m: track.span_m(),
                width_m: track.size_m().1,
            })
            .collect();
        let mut best: Vec<Option<Match>> = vec![None; candidates.len()];
        for detection in detections {
            let compared = candidates.iter().enumerate();
            let mut fitting =
                compared.filter_map(|(track, candidate)| Some((track, candidate.compare(detection, frame, ego_mps)?)));
            // A detection that fits two tracks may be of either.
            let (Some((track, fit)), None) = (fitting.next(), fitting.next()) else { continue };
            if best[track].is_none_or(|other| fit.squared_distance < other.squared_distance) {
                best[track] = Some(fit);
            }
        }
        best.into_iter().enumerate().filter_map(|(track, fit)| Some((track, fit?.measured))).collect()
    }
}
