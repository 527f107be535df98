//! From noisy recorded positions to smooth ones on a common clock.
//!
//! ```text
//!   recorded points ─▶ low-pass forwards and backwards ─▶ derivatives ─▶ resample to 5 Hz, on a grid shared by all vehicles
//! ```
//!
//! **Why.** Positions in NGSIM recordings come from tracking pixels: they jump by decimetres, and speeds are held over
//! several frames. Differentiating them twice as they stand gives accelerations of tens of m/s².
//!
//! **Order.** A Butterworth low-pass of second order with its corner at 1.3 Hz, run forwards and backwards, so that it
//! shifts nothing in time: the effective order is four, and the gain at 1.3 Hz one half. What is then kept is 5 Hz.
//! Published work on lane changes names the same two steps. Here the filter runs at the recorded rate, before samples
//! are dropped: were a recording of 10 Hz thinned first, its noise between 2.5 and 5 Hz would be folded onto the movement
//! before the filter could take it away. At 2.5 Hz, half of the common rate, the filter leaves 7 %. A recording slower
//! than 5 Hz is first brought to 5 Hz by linear interpolation and filtered there.
//!
//! **Edges.** The filter needs some samples beyond each end; they are made by odd reflection about the end point, over
//! 1.8 s: at 5 Hz that is 9 samples, three times the filter's length, as SciPy's `filtfilt` takes by itself. What is
//! filtered is the deviation from the straight line through both ends of the track, so that steady movement passes
//! unchanged right up to the ends.
//!
//! **Short tracks.** A track shorter than 1.8 s is reflected over what it has. A track of one sample is left as it is,
//! with the recorded speeds; one that covers no instant of the common clock is left out. Every other recorded vehicle
//! stays there as an opponent.
//!
//! **What is derived from what.** Lateral speed and acceleration are the first and second derivative of the smoothed
//! lateral position, by differences over five samples (gain 0.99 at 1.3 Hz and 10 Hz), fewer beside the ends. The speed
//! along the road is the recorded speed, smoothed by the same filter, and its acceleration the derivative of that:
//! differentiating the position twice would amplify its jumps by (2π · 1.3 Hz)² ≈ 67 per s².
//!
//! **Lanes.** A sample at 5 Hz has the lane recorded nearest to it. When a marking is crossed, and for how long a lane is
//! held, is taken from the recorded frames: each smoothed track keeps its *stays*.

mod butterworth;
mod resample;
mod smooth;
mod stays;

pub use butterworth::LowPass;
pub(crate) use resample::resample;
pub use smooth::{CORNER_HZ, PERIOD, Presence, SmoothedRecording, SmoothedTrack, smooth, smooth_track};
pub use stays::{Stay, stays_of};
