//! When a track is believed: confirmation by M hits in N scans, coasting over misses, deletion, and the probability
//! that there is anything at all.
//!
//! The probability follows Bayes on the two hypotheses "a vehicle" and "clutter that happened to be there": with P_D the
//! probability that a scan sees a vehicle in view and P_F that clutter gives another detection inside the gate, a hit
//! multiplies the odds by P_D/P_F and a miss by (1 − P_D)/(1 − P_F) (Bar-Shalom, Willett, Tian: *Tracking and Data
//! Fusion*, 2011, chapter on track-score functions; here the score is kept as log-odds).

use closecall_traffic::TrackStatus;

/// Scans that the history holds.
pub(crate) const MAX_WINDOW: u8 = 16;

/// Log-odds are kept within ±this, so that a track that was seen a thousand times can still die: existence 0.9999.
const MAX_LOG_ODDS: f64 = 9.2;

/// Even odds at the first detection.
const FIRST_LOG_ODDS: f64 = 0.0;

/// The rules, checked where the configuration is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LifecycleRules {
    /// Hits that confirm (M).
    pub(crate) confirm_hits: u32,
    /// Latest scans in which they must lie (N), 1 to [`MAX_WINDOW`].
    pub(crate) confirm_window: u32,
    /// Misses in a row after which a confirmed track is deleted.
    pub(crate) lost_after: u32,
    /// Probability that a scan sees a vehicle in view.
    pub(crate) detection_probability: f64,
    /// Probability that clutter gives a detection inside the gate.
    pub(crate) clutter_probability: f64,
}

/// What has happened to one track so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lifecycle {
    /// One bit for each scan, the latest lowest.
    history: u32,
    misses: u32,
    confirmed: bool,
    log_odds: f64,
}

impl Lifecycle {
    /// A track at its first detection.
    pub(crate) fn first_hit(rules: &LifecycleRules) -> Self {
        let mut lifecycle = Self { history: 0, misses: 0, confirmed: false, log_odds: FIRST_LOG_ODDS };
        lifecycle.hit(rules, true);
        lifecycle
    }

    /// The scan saw it. It may be confirmed only where `is_settled`.
    pub(crate) fn hit(&mut self, rules: &LifecycleRules, is_settled: bool) {
        self.history = self.history << 1 | 1;
        self.misses = 0;
        self.confirmed |= is_settled && self.hits_in_window(rules) >= rules.confirm_hits;
        self.weigh((rules.detection_probability / rules.clutter_probability).ln());
    }

    /// The scan could have seen it and did not.
    pub(crate) fn miss(&mut self, rules: &LifecycleRules) {
        self.unseen();
        self.weigh(((1.0 - rules.detection_probability) / (1.0 - rules.clutter_probability)).ln());
    }

    /// The scan could not have seen it: hidden or out of view. That says nothing against it, but it cannot coast forever.
    pub(crate) fn unseen(&mut self) {
        self.history <<= 1;
        self.misses += 1;
    }

    /// Multiplies the odds that it exists by exp(`log_likelihood_ratio`).
    pub(crate) fn weigh(&mut self, log_likelihood_ratio: f64) {
        self.log_odds = (self.log_odds + log_likelihood_ratio).clamp(-MAX_LOG_ODDS, MAX_LOG_ODDS);
    }

    /// True where it is time to forget it: a tentative track that can no longer reach M of N, or one lost for too long.
    pub(crate) fn is_dead(&self, rules: &LifecycleRules) -> bool {
        if self.confirmed {
            self.misses >= rules.lost_after
        } else {
            self.misses > rules.confirm_window - rules.confirm_hits
        }
    }

    pub(crate) fn status(&self) -> TrackStatus {
        match (self.confirmed, self.misses) {
            (false, _) => TrackStatus::Tentative,
            (true, 0) => TrackStatus::Confirmed,
            (true, _) => TrackStatus::Coasting,
        }
    }

    /// Probability that there is anything at all.
    pub(crate) fn existence(&self) -> f64 {
        1.0 / (1.0 + (-self.log_odds).exp())
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
        lost_after: 4,
        detection_probability: 0.9,
        clutter_probability: 0.05,
    };

    #[test]
    fn alternate_misses_still_confirm() {
        let mut track = Lifecycle::first_hit(&RULES);
        for _ in 0..2 {
            assert_eq!(track.status(), TrackStatus::Tentative);
            track.miss(&RULES);
            assert!(!track.is_dead(&RULES));
            track.hit(&RULES, true);
        }
        assert_eq!(track.status(), TrackStatus::Confirmed);
    }

    #[test]
    fn a_confirmed_track_coasts_and_then_dies() {
        let mut track = Lifecycle::first_hit(&RULES);
        track.hit(&RULES, true);
        track.hit(&RULES, true);
        let seen = track.existence();
        for _ in 0..3 {
            track.miss(&RULES);
            assert_eq!(track.status(), TrackStatus::Coasting);
            assert!(!track.is_dead(&RULES));
        }
        assert!(track.existence() < seen);
        track.miss(&RULES);
        assert!(track.is_dead(&RULES));
    }

    #[test]
    fn being_hidden_does_not_lower_existence() {
        let mut track = Lifecycle::first_hit(&RULES);
        let seen = track.existence();
        track.unseen();
        assert_eq!(track.existence().to_bits(), seen.to_bits());
    }

    #[test]
    fn an_unsettled_track_waits() {
        let mut track = Lifecycle::first_hit(&RULES);
        for _ in 0..4 {
            track.hit(&RULES, false);
        }
        assert_eq!(track.status(), TrackStatus::Tentative);
        track.hit(&RULES, true);
        assert_eq!(track.status(), TrackStatus::Confirmed);
    }
}
