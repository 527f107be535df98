//! The thresholds of the Wiedemann 99 model and the regimes between them.
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
//! Here g is the gap, v the own speed, v_l the speed of the lead vehicle, and Δv = v_l − v
//! (negative while closing):
//!
//! | threshold | value | meaning |
//! |---|---|---|
//! | safe | cc0 + cc1·min(v, v_l) | gap below which the driver does not go intentionally |
//! | follow | safe + cc2 | gap up to which the driver only follows |
//! | approach | follow + cc3·(Δv − cc4) | gap at which an approaching driver begins to slow down |
//! | closing | cc4 − c·g²; cc4 once noticed | the driver notices closing below this Δv |
//! | opening | cc5 + c·g² | the driver notices opening above this Δv |
//!
//! | regime | condition |
//! |---|---|
//! | emergency | g ≤ safe and Δv < closing, or g < cc0 and Δv < 0 |
//! | approaching | g < approach and Δv < closing |
//! | following | g ≤ follow and Δv ≤ opening |
//! | free | otherwise |
//!
//! Sources: PTV Vissim user manual, "Defining the Wiedemann 99 model" (the parameters and their
//! meaning); Wiedemann, *Simulation des Straßenverkehrsflusses*, Karlsruhe 1974 (the plane and its
//! thresholds); Aghabayk, Sarvi, Young and Kautzsch, *A novel methodology for evolutionary
//! calibration of Vissim by multi-threading*, Australasian Transport Research Forum 2013 (the
//! formulas of the thresholds). `docs/reference/wiedemann99-regimes.svg` shows the plane.

use super::Parameters99;
use crate::driver::Lead;

/// Unit of cc6 (1/(m·s)) (PTV Vissim user manual, 2022).
const CC6_UNIT: f64 = 1e-4;

/// The regime of a following driver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Regime {
    /// The driver accelerates freely, as without a lead vehicle.
    #[default]
    Free,
    /// The driver slows down towards the safe gap.
    Approaching,
    /// The driver follows, with a small oscillation because humans do not hold a speed exactly.
    Following,
    /// The gap is too small and still closing.
    Emergency,
}

impl Regime {
    /// Returns true if the driver has noticed the closing and reacts to it.
    fn is_closing(self) -> bool {
        matches!(self, Self::Approaching | Self::Emergency)
    }
}

/// The thresholds at given speeds and gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Gap below which the driver does not go intentionally (m).
    pub safe_m: f64,
    /// Gap up to which the driver only follows (m).
    pub follow_m: f64,
    /// Gap below which an approaching driver slows down (m).
    pub approach_m: f64,
    /// Speed difference, lead minus own, below which the driver notices closing (m/s).
    pub closing_mps: f64,
    /// Speed difference, lead minus own, above which the driver notices opening (m/s).
    pub opening_mps: f64,
}

impl Thresholds {
    /// Computes the thresholds at `speed_mps` behind `lead`. `before` is the regime at the previous
    /// step.
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

    /// Returns the regime at a gap and a speed difference, lead minus own. `cc0_m` is the gap at
    /// standstill.
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
