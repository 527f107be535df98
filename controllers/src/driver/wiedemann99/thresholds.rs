//! The thresholds of Wiedemann 99, and the regimes between them, all in one place.
//!
//! ```text
//!   gap ▲                    free
//!       │   ╲ approach
//!       │     ╲  distance          ─ ─ ─ ─ ─ ─   follow = safe + cc2
//!       │ approaching ╲  following │  free
//!       │─ ─ ─ ─ ─ ─ ─ ─│─ ─ ─ ─ ─ │─ ─ ─ ─ ─   safe = cc0 + cc1·v
//!       │  emergency    │ falling  │  coasting
//!       │               │ back     │
//!       └───────────────┴────┬─────┴──────▶ Δv = v_lead − v
//!                      cc4 − c·g²  0   cc5 + c·g²          c = cc6 · 10⁻⁴
//! ```
//!
//! With gap g, speed v, lead speed v_l, Δv = v_l − v (negative while closing):
//!
//! | threshold | value | meaning |
//! |---|---|---|
//! | safe | cc0 + cc1·min(v, v_l) | the gap that is never undercut on purpose |
//! | follow | safe + cc2 | the gap up to which the driver just follows |
//! | approach | follow + cc3·(Δv − cc4) | where a driver who closes in begins to slow down |
//! | closing | cc4 − c·g²; cc4 once noticed | closing is noticed below this Δv |
//! | opening | cc5 + c·g² | opening is noticed above this Δv |
//!
//! | regime | where |
//! |---|---|
//! | emergency | g ≤ safe and Δv < closing, or g < cc0 and Δv < 0 |
//! | approaching | g < approach and Δv < closing |
//! | following | g ≤ follow and Δv ≤ opening |
//! | free | else |
//!
//! Sources: PTV Vissim user manual, "Defining the Wiedemann 99 model" (the parameters and what they mean); Wiedemann,
//! *Simulation des Straßenverkehrsflusses*, Karlsruhe 1974 (the plane and its thresholds); Aghabayk, Sarvi, Young and
//! Kautzsch, *A novel methodology for evolutionary calibration of Vissim by multi-threading*, Australasian Transport
//! Research Forum 2013 (the thresholds as formulas). `docs/wiedemann99-regimes.svg` shows the plane.

use super::Parameters99;
use crate::driver::Lead;

/// cc6 is given in units of this [rad/s].
const CC6_UNIT: f64 = 1e-4;

/// What a follower is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Regime {
    /// Drives as if nobody were ahead.
    #[default]
    Free,
    /// Slows down towards the safe gap.
    Approaching,
    /// Follows, with the small oscillation of one who does not look at the speedometer.
    Following,
    /// Is too close and still closing.
    Emergency,
}

impl Regime {
    /// True where the driver has noticed that it closes in, and reacts to it.
    pub(super) fn is_closing(self) -> bool {
        matches!(self, Self::Approaching | Self::Emergency)
    }
}

/// The thresholds for one situation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Gap that is never undercut on purpose [m].
    pub safe_m: f64,
    /// Gap up to which the driver just follows [m].
    pub follow_m: f64,
    /// Gap below which a driver who closes in slows down [m].
    pub approach_m: f64,
    /// Difference of speeds, lead minus own, below which closing is noticed [m/s].
    pub closing_mps: f64,
    /// Difference of speeds above which opening is noticed [m/s].
    pub opening_mps: f64,
}

impl Thresholds {
    /// The thresholds at `speed_mps` behind `lead`, for a driver in the regime `before`.
    pub(super) fn new(p: &Parameters99, speed_mps: f64, lead: &Lead, before: Regime) -> Self {
        let safe_m = p.cc0_m + p.cc1_s * speed_mps.min(lead.speed_mps).max(0.0);
        let follow_m = safe_m + p.cc2_m;
        let widening_mps = p.cc6 * CC6_UNIT * lead.gap_m * lead.gap_m;
        Self {
            safe_m,
            follow_m,
            approach_m: follow_m + p.cc3_s * (lead.speed_mps - speed_mps - p.cc4_mps),
            closing_mps: if before.is_closing() { p.cc4_mps } else { p.cc4_mps - widening_mps },
            opening_mps: p.cc5_mps + widening_mps,
        }
    }

    /// The regime at a gap and a difference of speeds, lead minus own, where `cc0_m` is the gap at standstill.
    pub(super) fn regime(&self, gap_m: f64, opening_mps: f64, cc0_m: f64) -> Regime {
        let closing = opening_mps < self.closing_mps;
        if (gap_m <= self.safe_m && closing) || (gap_m < cc0_m && opening_mps < 0.0) {
            Regime::Emergency
        } else if closing && gap_m < self.approach_m {
            Regime::Approaching
        } else if gap_m <= self.follow_m && opening_mps <= self.opening_mps {
            Regime::Following
        } else {
            Regime::Free
        }
    }
}
