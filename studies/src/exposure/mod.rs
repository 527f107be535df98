//! Exposure: how often the encounter happens on a road, and the net effect of the system per 10⁶
//! km.
//!
//! ```text
//!  trajectory files ─▶ the lead vehicle brakes while a rear vehicle is near: events, distance ─┐
//!  or a stated range of the rate ──────────────────────────────────────────────────────────────┼─▶ net effect per 10⁶ km
//!  paired campaign ─▶ prevented and induced collisions, given such an encounter ───────────────┘
//! ```
//!
//! The net effect is λ·(p − q)·10⁶ km, with the rate λ of encounters per kilometre, and the shares
//! p prevented and q induced of the samples. It follows from the printed inputs by the printed
//! equations. If an input is missing, the result names it.
//!
//! # Intervals
//! * λ from N events in D kilometres: quantiles of a gamma distribution with shape N + ½, divided
//!   by D (Jeffreys interval of a Poisson rate).
//! * p and q of n samples: Wilson score intervals (Wilson 1927).
//! * p − q and λ·(p − q): the method of variance estimates recovery (Zou and Donner, *Construction
//!   of confidence intervals about effect measures*, Statistics in Medicine 27 (2008) 1693–1702),
//!   which combines the distances of the bounds to the estimates like standard deviations; p and q
//!   of the same samples are correlated by −√(p·q/((1 − p)·(1 − q))).
//!
//! A stated range of λ has no confidence. The net effect then has the extremes of the products: the
//! ends of the range with the ends of the interval of p − q.
//!
//! The events count as independent of each other, and the sampled encounters count as encounters of
//! the road. The data can show neither, and the result says so.

mod arguments;
mod effect;
mod interval;
mod observe;
mod text;

pub use arguments::{Counted, StatedRange};
pub use effect::{CampaignShares, Exposure, Missing, NetEffect, Rate, exposure, shares_of};
pub use interval::{extremes, product, rate_interval, share_difference};
pub use observe::{EventRule, Observed, observe};
pub use text::ExposureText;
