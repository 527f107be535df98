//! Smoothing of noisy recorded positions, and resampling to a clock that all vehicles share.
//!
//! ```text
//!   recorded points ─▶ low-pass filter, forwards and backwards ─▶ derivatives ─▶ resampling to a common 5 Hz clock
//! ```
//!
//! **Purpose.** Positions in NGSIM data come from tracking pixels: they jump by decimetres, and
//! speeds are held over several frames. Differentiating the raw positions twice gives accelerations
//! of tens of m/s².
//!
//! **Filter, then resample.** A second-order Butterworth low-pass with its corner at 1.3 Hz runs
//! forwards and backwards, and therefore causes no time shift. The effective order is four, and the
//! gain at 1.3 Hz is one half. The result is resampled to 5 Hz. Published work on lane changes
//! names the same two steps. Here the filter runs at the recorded rate, before resampling: if 10 Hz
//! data were decimated first, its noise between 2.5 and 5 Hz would alias onto the movement, and the
//! filter could no longer remove it. At 2.5 Hz, half of the common rate, the filter leaves 7 %.
//! Data recorded at less than 5 Hz is first interpolated linearly to 5 Hz and filtered at that
//! rate.
//!
//! **Ends of a track.** The filter needs samples beyond each end. Odd reflection about the end
//! point supplies them over 1.8 s: at 5 Hz these are 9 samples, three times the filter's length,
//! which is also the default of SciPy's `filtfilt`. The filter acts on the deviation from the
//! straight line through both ends of the track: steady movement passes unchanged up to the ends.
//!
//! **Short tracks.** A track shorter than 1.8 s is reflected over its whole length. A track of one
//! sample stays as it is, with the recorded speeds. A track that covers no instant of the common
//! clock is dropped. All other recorded vehicles remain as opponents.
//!
//! **Derived quantities.** Lateral speed and acceleration are the first and second derivative of
//! the smoothed lateral position, from differences over five samples (gain 0.99 at 1.3 Hz and 10
//! Hz), or fewer near the ends. The speed along the road is the recorded speed, smoothed by the
//! same filter, and the acceleration along the road is its derivative: differentiating the position
//! twice would amplify its jumps by (2π · 1.3 Hz)² ≈ 67 per s².
//!
//! **Lanes.** A 5 Hz sample takes the lane of the nearest recorded point. The time of a lane
//! crossing and the dwell time in a lane come from the recorded frames: each smoothed track keeps
//! its lane *stays*.

mod butterworth;
mod resample;
mod smooth;
mod smooth_file;
mod stays;

pub use butterworth::LowPass;
pub(crate) use resample::resample;
pub use smooth::{CORNER_HZ, PERIOD, Presence, SmoothedTrack, SmoothedTrajectoryData, smooth, smooth_track};
pub use smooth_file::{SmoothedFile, smooth_file};
pub use stays::{Stay, stays_of};
