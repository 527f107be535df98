//! Pass criteria: the demands of a scenario file, a project file or the command line on the
//! outcomes of a campaign.
//!
//! ```text
//!  "p99(min_ttc_rear_s) >= 1.0" ─▶ Expression { aggregate, quantity, condition, operator, bound }
//!                                                  └─▶ Measure: one value per outcome
//! ```
//!
//! This module holds the language and the measures of one run. The crate `closecall-campaign`
//! evaluates criteria over many.

mod config;
mod event;
mod expression;
mod implied;
mod measure;

pub use config::{FlagName, GateConfig};
pub use event::{Event, EventError, EventExpression, Guide, GuideError};
pub use expression::{Aggregate, Comparison, Expression, ExpressionError, Operator, Quantity, Side};
pub use measure::{
    EGO_COLLIDED, LEAD_BRAKED, MEASURES, Measure, MeasureKind, PairFlag, REAR_NEAR, SLOWED_FOR_REAR, SLOWED_MPS,
    SLOWED_UNPROMPTED, UNPROMPTED_DEFICIT,
};
