//! The distributions of the ego's margins.

use closecall_traffic::Measured;

use closecall_scenarios::outcome::{CRITICAL_THW_S, Outcome};

/// Number of bins of a distribution.
pub const BINS: usize = 40;

/// One margin. Its range is the same in every report, so that reports can be compared.
#[derive(Clone, Copy, Debug)]
pub struct MarginKind {
    /// The key in the other reports; it ends with the unit.
    pub key: &'static str,
    /// The name on the page, with the unit.
    pub title: &'static str,
    /// The upper end of the range, in the margin's unit. Larger values belong to the last bin.
    pub high: f64,
    /// The value that separates small margins from sufficient ones, or the goal, if there is one,
    /// with its name.
    pub limit: Option<(f64, &'static str)>,
    value: fn(&Outcome) -> Measured,
}

/// The headway that the method asks the system to gain (s).
const GOAL_GAIN_S: f64 = 2.0;

/// Returns the front headway gained from the engagement of the MIS until the vehicle behind is at
/// the critical distance (s).
fn gained_s(outcome: &Outcome) -> Measured {
    let mis = outcome.mis.as_ref().map_err(|absent| *absent)?;
    Ok((mis.thw_front_at_critical_s? - mis.thw_front_at_engagement_s?).max(0.0))
}

/// The margins that are shown.
pub const MARGINS: [MarginKind; 9] = [
    MarginKind {
        key: "gained_thw_front_s",
        title: "front time headway gained [s]",
        high: 4.0,
        limit: Some((GOAL_GAIN_S, "goal 2 s")),
        value: gained_s,
    },
    MarginKind {
        key: "min_thw_front_s",
        title: "smallest front time headway [s]",
        high: 3.0,
        limit: Some((CRITICAL_THW_S, "critical 0.9 s")),
        value: |outcome| outcome.margins.min_thw_front_s,
    },
    MarginKind {
        key: "min_thw_rear_s",
        title: "smallest rear time headway [s]",
        high: 1.5,
        limit: Some((CRITICAL_THW_S, "critical 0.9 s")),
        value: |outcome| outcome.margins.min_thw_rear_s,
    },
    MarginKind {
        key: "min_gap_rear_m",
        title: "smallest rear gap [m]",
        high: 40.0,
        limit: None,
        value: |outcome| outcome.margins.min_gap_rear_m,
    },
    MarginKind {
        key: "min_ttc_rear_s",
        title: "smallest rear time to collision [s]",
        high: 10.0,
        limit: None,
        value: |outcome| outcome.margins.min_ttc_rear_s,
    },
    MarginKind {
        key: "min_gap_front_m",
        title: "smallest front gap [m]",
        high: 60.0,
        limit: None,
        value: |outcome| outcome.margins.min_gap_front_m,
    },
    MarginKind {
        key: "max_deceleration_mps2",
        title: "largest deceleration [m/s²]",
        high: 10.0,
        limit: None,
        value: |outcome| Ok(outcome.margins.max_deceleration_mps2),
    },
    MarginKind {
        key: "max_jerk_mps3",
        title: "largest jerk [m/s³]",
        high: 40.0,
        limit: None,
        value: |outcome| Ok(outcome.margins.max_jerk_mps3),
    },
    MarginKind {
        key: "max_speed_deficit_mps",
        title: "largest speed below the vehicle ahead [m/s]",
        high: 20.0,
        limit: None,
        value: |outcome| Ok(outcome.margins.max_speed_deficit_mps),
    },
];

/// The distribution of one margin in one arm.
#[derive(Clone, Debug, PartialEq)]
pub struct MarginBins {
    /// The number of samples in each of [`BINS`] bins of equal width from 0 to the upper end of the
    /// margin's range. The last bin also counts larger values.
    pub counts: [u64; BINS],
    /// The number of samples that have no such margin.
    pub absent: u64,
}

impl MarginBins {
    pub(super) const EMPTY: Self = Self { counts: [0; BINS], absent: 0 };

    pub(super) fn push(&mut self, kind: &MarginKind, outcome: &Outcome) {
        match (kind.value)(outcome) {
            Ok(value) => {
                // A value that is not a number counts as the smallest margin, so that it never
                // looks safe.
                let share = if value.is_nan() { 0.0 } else { (value / kind.high).clamp(0.0, 1.0) };
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to the bins")]
                let bin = (share * BINS as f64) as usize;
                self.counts[bin.min(BINS - 1)] += 1;
            }
            Err(_) => self.absent += 1,
        }
    }
}
