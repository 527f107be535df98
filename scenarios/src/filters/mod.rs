//! From noisy recorded positions to smooth ones on a common clock.
//!
//! ```text
//!   recorded points ─▶ resample to 10 Hz, on a grid shared by all vehicles ─▶ low-pass forwards and backwards ─▶ derivatives
//! ```
//!
//! **Why.** Positions in NGSIM recordings come from tracking pixels: they jump by decimetres, and speeds are held over
//! several frames. Differentiating them twice as they stand gives accelerations of tens of m/s².
//!
//! **What.** A Butterworth low-pass of second order with its corner at 1.3 Hz, run forwards and backwards, so that it
//! shifts nothing in time (the effective order is four, and the gain at 1.3 Hz one half). Published work on lane
//! changes applies this filter after reducing recordings to 5 Hz. Here it runs at 10 Hz: NGSIM is recorded at 10 Hz, so
//! dropping every second sample would fold the noise between 2.5 and 5 Hz onto the movement before the filter can take
//! it away, and would halve the resolution of the times found later. The corner stays where it was; a lane change
//! that follows a quintic path over 3 s or more passes with its duration changed by less than half a percent.
//!
//! **Short tracks.** The filter needs some samples beyond each end; they are made by odd reflection about the end point,
//! over three times the filter's length: 9 samples. A track of n < 10 samples is reflected over n − 1 instead. A track
//! of one sample is left as it is, with the recorded speeds. So every recorded vehicle stays there as an opponent.
//!
//! What is filtered is the deviation from the straight line through both ends of the track, so that steady movement
//! passes unchanged right up to the ends.
//!
//! **What is derived from what.** Lateral speed and acceleration are the first and second difference of the smoothed
//! lateral position. The speed along the road is the recorded speed, smoothed, and its acceleration the difference of
//! that: differentiating the position twice would amplify its jumps by (2π · 1.3 Hz)² ≈ 67 per s².

mod butterworth;
mod resample;
mod smooth;

pub use butterworth::LowPass;
pub use smooth::{CORNER_HZ, PERIOD, Presence, SmoothedRecording, smooth};
