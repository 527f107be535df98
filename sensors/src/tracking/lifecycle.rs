//! Lifecycle of a track: confirmation by M hits in N scans, coasting over misses, deletion, and the
//! existence probability.
//!
//! The existence probability follows from Bayes' rule for the two hypotheses "vehicle" and
//! "clutter". P_D is the probability that a scan detects a vehicle in view, and P_F the probability
//! that clutter gives a detection inside the gate. A hit multiplies the odds by P_D/P_F, and a miss
//! by (1 − P_D)/(1 − P_F) (Bar-Shalom, Willett, Tian: *Tracking and Data Fusion*, 2011, chapter on
//! track-score functions; here the score is kept as log-odds).

use closecall_traffic::{TrackStatus, maths};

/// Maximum number of scans in the confirmation window.
pub const MAX_WINDOW: u8 = 16;

/// Maximum absolute value of the log-odds (an existence probability of 0.9999), so that misses can
/// still lower it for a track that was detected a thousand times.
const MAX_LOG_ODDS: f64 = 9.2;

/// Log-odds of existence before the first detection: even odds.
const INITIAL_LOG_ODDS: f64 = 0.0;

/// The rules of confirmation and deletion. The sensor's configuration checks the values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LifecycleRules {
    /// Number of hits that confirm a track (M).
    pub confirm_hits: u32,
    /// Number of latest scans in which the hits are counted (N): 1 to [`MAX_WINDOW`].
    pub confirm_window: u32,
    /// Number of successive scans without a hit after which a confirmed track is deleted.
    pub delete_after_misses: u32,
    /// Probability that a scan detects a vehicle in view (P_D).
    pub detection_probability: f64,
    /// Probability that clutter gives a detection inside the gate (P_F).
    pub clutter_probability: f64,
}

/// The lifecycle state of one track.
#[derive(Clone, Copy, Debug)]
pub struct Lifecycle {
    /// One bit per scan, 1 for a hit; the lowest bit is the latest scan.
    history: u32,
    /// Number of latest successive scans without a hit.
    misses: u32,
    confirmed: bool,
    /// Log-odds of existence.
    log_odds: f64,
}

impl Lifecycle {
    /// Creates the lifecycle of a track at its first detection.
    #[inline]
    pub fn first_hit(rules: &LifecycleRules) -> Self {
        let mut lifecycle = Self::new();
        lifecycle.hit(rules, true);
        lifecycle
    }

    /// Creates the lifecycle of a track that a sensor has found which confirms nothing.
    pub fn first_kept(rules: &LifecycleRules) -> Self {
        let mut lifecycle = Self::new();
        lifecycle.keep(rules);
        lifecycle
    }

    fn new() -> Self {
        Self { history: 0, misses: 0, confirmed: false, log_odds: INITIAL_LOG_ODDS }
    }

    /// Adds a scan that detected the track. The scan can confirm the track only if `is_settled`.
    #[inline]
    pub fn hit(&mut self, rules: &LifecycleRules, is_settled: bool) {
        self.history = self.history << 1 | 1;
        self.misses = 0;
        self.confirmed |= is_settled && self.hits_in_window(rules) >= rules.confirm_hits;
        self.add_evidence(maths::ln(rules.detection_probability / rules.clutter_probability));
    }

    /// Adds a scan in which only a sensor that confirms nothing has detected the track. It ends
    /// coasting, and is no hit in the window.
    pub fn keep(&mut self, rules: &LifecycleRules) {
        self.history <<= 1;
        self.misses = 0;
        self.add_evidence(maths::ln(rules.detection_probability / rules.clutter_probability));
    }

    /// Makes the latest scan, which [`Self::keep`] has added, a hit: a sensor that confirms has
    /// detected the track at the same time.
    pub fn count_kept_as_hit(&mut self, rules: &LifecycleRules, is_settled: bool) {
        self.history |= 1;
        self.confirmed |= is_settled && self.hits_in_window(rules) >= rules.confirm_hits;
    }

    /// Adds a scan that did not detect the track, although it was in view.
    #[inline]
    pub fn miss(&mut self, rules: &LifecycleRules) {
        self.skip();
        self.add_evidence(maths::ln((1.0 - rules.detection_probability) / (1.0 - rules.clutter_probability)));
    }

    /// Adds a scan that could not detect the track, because it was hidden or out of view.
    ///
    /// Such a scan leaves the existence probability unchanged, but counts against the coasting
    /// time.
    #[inline]
    pub fn skip(&mut self) {
        self.history <<= 1;
        self.misses += 1;
    }

    /// Multiplies the odds of existence by exp(`log_likelihood_ratio`).
    #[inline]
    pub fn add_evidence(&mut self, log_likelihood_ratio: f64) {
        self.log_odds = (self.log_odds + log_likelihood_ratio).clamp(-MAX_LOG_ODDS, MAX_LOG_ODDS);
    }

    /// Returns whether the track has ended: a tentative track that can no longer reach M hits in N
    /// scans, or a confirmed track that was not detected for too long.
    #[inline]
    pub fn should_delete(&self, rules: &LifecycleRules) -> bool {
        if self.confirmed {
            self.misses >= rules.delete_after_misses
        } else {
            self.misses > rules.confirm_window - rules.confirm_hits
        }
    }

    /// Returns the status that is reported for the track.
    #[inline]
    pub fn status(&self) -> TrackStatus {
        match (self.confirmed, self.misses) {
            (false, _) => TrackStatus::Tentative,
            (true, 0) => TrackStatus::Confirmed,
            (true, _) => TrackStatus::Coasting,
        }
    }

    /// Returns the existence probability.
    #[inline]
    pub fn existence(&self) -> f64 {
        1.0 / (1.0 + maths::exp(-self.log_odds))
    }

    fn hits_in_window(&self, rules: &LifecycleRules) -> u32 {
        (self.history & ((1 << rules.confirm_window) - 1)).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: LifecycleRules = LifecycleRules {
        confirm_hits: 3,
        confirm_window: 5,
        delete_after_misses: 4,
        detection_probability: 0.9,
        clutter_probability: 0.05,
    };

    #[test]
    fn a_track_missed_in_every_other_scan_is_confirmed() {
        let mut track = Lifecycle::first_hit(&RULES);
        for _ in 0..2 {
            assert_eq!(track.status(), TrackStatus::Tentative);
            track.miss(&RULES);
            assert!(!track.should_delete(&RULES));
            track.hit(&RULES, true);
        }
        assert_eq!(track.status(), TrackStatus::Confirmed);
    }

    #[test]
    fn a_confirmed_track_coasts_and_then_ends() {
        let mut track = Lifecycle::first_hit(&RULES);
        track.hit(&RULES, true);
        track.hit(&RULES, true);
        let seen = track.existence();
        for _ in 0..3 {
            track.miss(&RULES);
            assert_eq!(track.status(), TrackStatus::Coasting);
            assert!(!track.should_delete(&RULES));
        }
        assert!(track.existence() < seen);
        track.miss(&RULES);
        assert!(track.should_delete(&RULES));
    }

    #[test]
    fn a_hidden_track_keeps_its_existence_probability() {
        let mut track = Lifecycle::first_hit(&RULES);
        let seen = track.existence();
        track.skip();
        assert_eq!(track.existence().to_bits(), seen.to_bits());
    }

    #[test]
    fn kept_scans_do_not_count_towards_confirmation() {
        let mut track = Lifecycle::first_kept(&RULES);
        for _ in 0..20 {
            track.keep(&RULES);
            assert!(track.status() == TrackStatus::Tentative && !track.should_delete(&RULES));
        }
        for _ in 0..2 {
            track.hit(&RULES, true);
            assert_eq!(track.status(), TrackStatus::Tentative);
        }
        track.keep(&RULES);
        assert_eq!(track.status(), TrackStatus::Tentative, "two hits and a scan that keeps it");
        track.count_kept_as_hit(&RULES, true);
        assert_eq!(track.status(), TrackStatus::Confirmed);
        (0..3).for_each(|_| track.miss(&RULES));
        track.keep(&RULES);
        assert_eq!(track.status(), TrackStatus::Confirmed, "it ends coasting");
    }

    #[test]
    fn a_track_is_not_confirmed_before_it_is_settled() {
        let mut track = Lifecycle::first_hit(&RULES);
        for _ in 0..4 {
            track.hit(&RULES, false);
        }
        assert_eq!(track.status(), TrackStatus::Tentative);
        track.hit(&RULES, true);
        assert_eq!(track.status(), TrackStatus::Confirmed);
    }
}
