//! The position of the edges of a face within a column, from the power of the outermost beams.
//!
//! ```text
//!      ┌──────────────────┐
//!   ┌──┼──┬─────┬─────┬───┼┬─────┐      A beam that meets the face with a part of its width returns that part of the power of its
//!   │ half│full │full │full│none │      neighbour, which meets it with all of it. The share gives the place of the edge.
//!   └──┼──┴─────┴─────┴───┼┴─────┘
//!      └──────────────────┘
//! ```
//!
//! Without this information, an edge lies anywhere within one column: at a constant gap, the middle
//! of a face is then off by up to half a column.

use super::LidarScan;
use super::boxes::{BoxFit, point};
use super::kind::MAX_LAYERS;
use super::power::MAX_INTENSITY;

/// Least power of the neighbour, in multiples of the detection threshold: half of it exceeds the
/// threshold by 2.5 standard deviations of the noise. Otherwise the outermost beam may be missed,
/// and the share says nothing.
const MIN_NEIGHBOUR_POWER: f64 = 3.0;
/// Least share of a beam that is seen. Two sub-rays side by side sample a footprint, so that a beam
/// meets a face with half of them or with all; a smaller share comes from noise.
const MIN_SHARE: f64 = 0.5;
/// Shares beyond which the two beams meet different materials, such as paint beside a headlamp
/// (assumption): the noise of the weakest neighbour and of the outer beam changes a share by 0.08
/// to 0.09.
const SAME_MATERIAL: std::ops::RangeInclusive<f64> = 0.35..=1.25;
/// Distance from the outermost point of the face within which a point is in the outermost column of
/// its layer (columns). A halo has the beams of the plate, and is elsewhere.
const OUTERMOST: f64 = 0.5;
/// Share by which a footprint may exceed a column due to rounding.
const ROUNDING: f64 = 1e-6;

/// Where the two edges of a face lie within the outermost columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edges {
    /// Distance of the right and the left edge outward of its mean position, given the outermost
    /// column (columns).
    pub(crate) shifts: [f64; 2],
    /// Standard deviation of what remains unknown, relative to that without knowledge of the
    /// powers.
    pub(crate) sd_share: f64,
}

/// Returns the positions of the edges, or `None` if the powers do not determine both: a beam on
/// another material at one edge makes the other edge doubtful.
///
/// `heading` has sine and cosine of the heading of the box.
pub(super) fn edges(fit: &BoxFit, heading: [f64; 2], members: &[u32], scan: &LidarScan) -> Option<Edges> {
    // Without a raster, the next beam is anywhere above or below.
    if !scan.resolution.is_raster {
        return None;
    }
    // Where footprints overlap, a beam beyond the edge may meet the face.
    if fit.footprint_columns > 1.0 + ROUNDING {
        return None;
    }
    let layers = scan.resolution.layers;
    let columns = members.iter().map(|&member| usize::from(scan.beam[member as usize]) / layers);
    let (first, last) = columns.fold((usize::MAX, 0), |(first, last), column| (first.min(column), last.max(column)));
    // The sweep begins on the left.
    let right = edge_shift(fit, -fit.across_m[0], -1.0, heading, members, last, scan)?;
    let left = edge_shift(fit, fit.across_m[1], 1.0, heading, members, first, scan)?;
    // An edge within the outermost beam is known to half of its width; one beyond it lies anywhere
    // before the middle of the next beam.
    let half = 0.5 * fit.footprint_columns;
    Some(Edges { shifts: [right, left], sd_share: ((1.0 - half).powi(3) + half.powi(3)).sqrt() })
}

/// Returns the shift of one edge, whose outermost point is `end_m` outward of the origin, in column
/// `outermost`.
fn edge_shift(
    fit: &BoxFit,
    end_m: f64,
    outward: f64,
    [sin, cos]: [f64; 2],
    members: &[u32],
    outermost: usize,
    scan: &LidarScan,
) -> Option<f64> {
    let layers = scan.resolution.layers;
    // For each layer: the powers in the outermost column and in the next column, and the place of
    // the outermost point.
    let mut powers = [[0.0_f32; 2]; MAX_LAYERS];
    let mut at = [0.0; MAX_LAYERS];
    for &member in members {
        let beam = usize::from(scan.beam[member as usize]);
        let (inward, layer) = ((beam / layers).abs_diff(outermost), beam % layers);
        let power = scan.intensity[member as usize];
        match powers[layer].get_mut(inward) {
            // Of two echoes, the stronger one counts.
            Some(strongest) if power > *strongest => *strongest = power,
            _ => continue,
        }
        if inward == 0 {
            let [x, y, _] = point(scan, member);
            at[layer] = (outward * (y * cos - x * sin) - end_m) / fit.spacing_m;
        }
    }
    let least = MIN_NEIGHBOUR_POWER * scan.resolution.threshold_per_m2 * fit.range_m * fit.range_m;
    let shift = |([outer, neighbour], at): (&[f32; 2], &f64)| {
        let share = f64::from(*outer) / f64::from(*neighbour);
        let is_told = f64::from(*neighbour) >= least
            && neighbour.max(*outer) < MAX_INTENSITY
            && SAME_MATERIAL.contains(&share)
            && *at >= -OUTERMOST;
        // An edge within the beam is where the share says; one beyond it, on average, half a column
        // outward of the beam.
        is_told.then(|| at + share.clamp(MIN_SHARE, 1.0) - 1.0 + 0.25 * fit.footprint_columns)
    };
    // A tyre or a grille is darker than the paint beside it, and a layer that meets it tells too
    // little. No edge is inward of the inner sub-rays of the outermost beam.
    let shift_columns = powers.iter().zip(&at).filter_map(shift).reduce(f64::max)?;
    Some(shift_columns.max(-0.5))
}
