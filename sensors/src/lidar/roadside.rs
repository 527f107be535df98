//! Guard rails with their posts along both edges of the road.

use closecall_traffic::{PlanePose, Road};

use super::Material::Steel;
use super::solid::Solid;
use closecall_traffic::guard_rail::{BEAM_DEPTH_M, BEAM_TOP_M, POST_SPACING_M};

const BEAM_LOW_M: f64 = 0.44;
const POST_WIDTH_M: f64 = 0.10;
/// Length of the modelled rails behind the ego (m). Beyond this distance steel at so grazing an angle gives no return,
/// although the rail could still occlude something.
const RAIL_REACH_M: f64 = 160.0;
/// Length behind the ego on which posts are modelled (m).
const POST_REACH_M: f64 = 60.0;
/// Length of the chords that approximate a curved rail (m). At the tightest curvature that a road may have, a chord is
/// 4 cm off the arc.
const CHORD_M: f64 = 12.0;

/// A solid, and the pose of its frame in the plane.
pub(super) type PlacedSolid = (Solid, PlanePose);

/// Appends the guard rails behind the road position `s_m`.
pub(super) fn append_guard_rails(road: &Road, s_m: f64, placed: &mut Vec<PlacedSolid>) {
    let chord = if road.curvature_per_m() == 0.0 { RAIL_REACH_M } else { CHORD_M };
    let [left_m, right_m] = road.guard_rail_offsets_m();
    for (d_m, outward) in [(left_m, 1.0), (road.right_edge_m() - right_m, -1.0)] {
        let mut from = s_m - RAIL_REACH_M;
        while from < s_m {
            let to = (from + chord).min(s_m);
            let half = 0.5 * (to - from);
            let depth = [0.0, outward * BEAM_DEPTH_M];
            let low = [-half, depth[0].min(depth[1]), BEAM_LOW_M];
            let beam = Solid::cuboid(low, [half, depth[0].max(depth[1]), BEAM_TOP_M], Steel);
            placed.push((beam, road.plane_pose(0.5 * (from + to), d_m, 0.0)));
            from = to;
        }
        // Posts are fixed to the road: their positions along it are multiples of the spacing, wherever the ego is.
        let mut index = ((s_m - POST_REACH_M) / POST_SPACING_M).ceil();
        while index * POST_SPACING_M < s_m {
            let half = 0.5 * POST_WIDTH_M;
            let post = Solid::cuboid([-half, -half, 0.0], [half, half, BEAM_LOW_M], Steel);
            let d_post = d_m + outward * (BEAM_DEPTH_M + half);
            placed.push((post, road.plane_pose(index * POST_SPACING_M, d_post, 0.0)));
            index += 1.0;
        }
    }
}
