//! One recorded pair of vehicles, checked for use in a calibration.

/// Shortest recording of a pair that is used (s): shorter recordings contain little information
/// about a driver.
const MIN_DURATION_S: f64 = 20.0;

/// Largest deviation of a step from the period of a pair (s): numerical.
const STEP_TOLERANCE_S: f64 = 0.011;

/// Time over which the leader's speed is differentiated (s): smooths the noise of recorded speeds.
const DIFFERENCE_S: f64 = 1.0;

/// Both vehicles at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowingInstant {
    /// Time since the start of the file's clock (s).
    pub time_s: f64,
    /// Position of the leader's rear along the lane (m).
    pub leader_rear_m: f64,
    /// Speed of the leader (m/s).
    pub leader_mps: f64,
    /// Acceleration of the leader, from its speed (m/s²).
    pub leader_mps2: f64,
    /// Position of the follower's front along the lane (m).
    pub follower_front_m: f64,
    /// Speed of the follower (m/s).
    pub follower_mps: f64,
}

impl FollowingInstant {
    /// Returns the recorded gap (m).
    pub fn gap_m(&self) -> f64 {
        self.leader_rear_m - self.follower_front_m
    }
}

/// A recorded pair: at least 20 s without a missing instant, and with a positive gap throughout.
#[derive(Clone, Debug, PartialEq)]
pub struct FollowingPair {
    /// Name of the pair in its file.
    pub name: String,
    /// Time between two instants (s).
    pub step_s: f64,
    /// The instants, in the order of time.
    pub instants: Vec<FollowingInstant>,
}

/// Returns one byte of the BLAKE3 hash of a name: the same on every machine, and in no relation to
/// the recording.
pub fn name_hash(name: &str) -> u8 {
    blake3::hash(name.as_bytes()).as_bytes()[0]
}

/// A recorded pair that is not used, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// Name of the pair.
    pub name: String,
    /// The reason.
    pub reason: String,
}

impl FollowingPair {
    /// Checks the instants of a pair. The leader's accelerations are computed here.
    pub(super) fn new(name: String, mut instants: Vec<FollowingInstant>) -> Result<Self, LeftOut> {
        let out = |reason: String| LeftOut { name: name.clone(), reason };
        let step_s = match &instants[..] {
            [first, second, ..] => second.time_s - first.time_s,
            _ => return Err(out("it has fewer than two instants".to_owned())),
        };
        if !(step_s > 0.0) {
            return Err(out("its times do not rise".to_owned()));
        }
        for pair in instants.windows(2) {
            if !((pair[1].time_s - pair[0].time_s - step_s).abs() < STEP_TOLERANCE_S) {
                return Err(out(format!("an instant is missing after {:.1} s", pair[0].time_s)));
            }
        }
        let duration_s = step_s * (instants.len() - 1) as f64;
        if duration_s < MIN_DURATION_S {
            return Err(out(format!("it lasts {duration_s:.1} s, less than {MIN_DURATION_S} s")));
        }
        if let Some(wrong) =
            instants.iter().find(|instant| !(instant.gap_m() > 0.0) || !instant.follower_mps.is_finite())
        {
            return Err(out(format!("the gap is {:.2} m at {:.1} s", wrong.gap_m(), wrong.time_s)));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small positive number")]
        let half = ((0.5 * DIFFERENCE_S / step_s).round() as usize).max(1);
        let speeds: Vec<f64> = instants.iter().map(|instant| instant.leader_mps).collect();
        for (index, instant) in instants.iter_mut().enumerate() {
            let (from, to) = (index.saturating_sub(half), (index + half).min(speeds.len() - 1));
            instant.leader_mps2 = (speeds[to] - speeds[from]) / (step_s * (to - from) as f64);
        }
        Ok(Self { name, step_s, instants })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instants(count: u32) -> Vec<FollowingInstant> {
        (0..count)
            .map(|index| {
                let time_s = 0.1 * f64::from(index);
                FollowingInstant {
                    time_s,
                    leader_rear_m: 20.0 + 10.0 * time_s,
                    leader_mps: 10.0 + 0.5 * time_s,
                    leader_mps2: f64::NAN,
                    follower_front_m: 10.0 * time_s,
                    follower_mps: 10.0,
                }
            })
            .collect()
    }

    #[test]
    fn the_acceleration_of_the_leader_follows_from_its_speed() {
        let pair = FollowingPair::new("a".to_owned(), instants(300)).unwrap();
        assert!((pair.step_s - 0.1).abs() < 1e-12);
        assert!(pair.instants.iter().all(|instant| (instant.leader_mps2 - 0.5).abs() < 1e-9));
    }

    #[test]
    fn a_short_pair_a_gap_in_time_or_an_overlap_is_left_out_with_its_reason() {
        let reason = |instants: Vec<FollowingInstant>| FollowingPair::new("a".to_owned(), instants).unwrap_err().reason;
        assert!(reason(instants(100)).contains("less than 20 s"));
        assert!(reason(instants(1)).contains("fewer than two"));
        let mut missing = instants(300);
        missing.remove(50);
        assert!(reason(missing).contains("missing after 4.9 s"));
        let mut overlap = instants(300);
        overlap[10].leader_rear_m -= 30.0;
        assert!(reason(overlap).contains("the gap is -10.00 m"), "{}", reason(instants(10)));
    }
}
