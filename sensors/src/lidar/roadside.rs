//! Objects along the road: guard rails with their posts along both edges, signs, gantries and
//! trees.

use closecall_traffic::{PlanePose, Road};

use super::Material::{Bark, Sign, Steel};
use super::solid::Solid;
use closecall_traffic::guard_rail::{BEAM_DEPTH_M, BEAM_TOP_M, POST_SPACING_M};
use closecall_traffic::roadside::{BESIDE_M, GANTRY_M, LEG_HALF_M, SHEET_M, SIGN_M, TREE_M, outer_edge, positions_m};

const BEAM_LOW_M: f64 = 0.44;
const POST_WIDTH_M: f64 = 0.10;
/// Length of the modelled rails behind the ego (m). Beyond this distance steel at so grazing an
/// angle gives no return, although the rail could still occlude something.
const RAIL_REACH_M: f64 = 160.0;
/// Length behind the ego on which posts are modelled (m).
const POST_REACH_M: f64 = 60.0;
/// Length of the chords that approximate a curved rail (m). At the tightest curvature that a road
/// may have, a chord is 7 cm off the arc.
const CHORD_M: f64 = 12.0;

/// A solid, and the pose of its frame in the plane.
pub(super) type PlacedSolid = (Solid, PlanePose);

/// Appends the guard rails behind the road position `s_m`.
pub(super) fn append_guard_rails(road: &Road, s_m: f64, placed: &mut Vec<PlacedSolid>) {
    let chord = if road.is_straight() { RAIL_REACH_M } else { CHORD_M };
    let [left_m, right_m] = road.guard_rail_offsets_m();
    for (d_m, outward) in [(left_m, 1.0), (road.right_edge_m() - right_m, -1.0)] {
        let mut from = s_m - RAIL_REACH_M;
        while from < s_m {
            let to = (from + chord).min(s_m);
            // A rail on the outside of a bend is longer than the line of s, and one on the inside
            // is shorter. The chords are scaled by it, so that they meet.
            let scale = if road.alignment().is_some() { road.path_scale(0.5 * (from + to), d_m) } else { 1.0 };
            let half = 0.5 * (to - from) * scale;
            let depth = [0.0, outward * BEAM_DEPTH_M];
            let low = [-half, depth[0].min(depth[1]), BEAM_LOW_M];
            let beam = Solid::cuboid(low, [half, depth[0].max(depth[1]), BEAM_TOP_M], Steel);
            placed.push((beam, road.plane_pose(0.5 * (from + to), d_m, 0.0)));
            from = to;
        }
        // Posts are fixed to the road: their positions along it are multiples of the spacing,
        // wherever the ego is.
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

/// Length of the road behind the ego on which these things are modelled (m).
const REACH_M: f64 = 200.0;

/// Appends the signs, gantries and trees behind the road position `s_m`.
pub(super) fn append_roadside(road: &Road, s_m: f64, placed: &mut Vec<PlacedSolid>) {
    // On a reversed road the traffic's right edge is d = 0, and signs face the other way.
    let (edge_m, outward) = outer_edge(road);
    let facing_rad = if road.is_reversed() { std::f64::consts::PI } else { 0.0 };
    let far_edge_m = road.right_edge_m() - edge_m;
    let roadside = road.roadside();
    for at_m in positions_m(roadside.sign_spacing_m, s_m, REACH_M) {
        let [width, height, low] = SIGN_M;
        let pose = road.plane_pose(at_m, edge_m + outward * (BESIDE_M + 0.5 * width), facing_rad);
        append_sign([0.5 * width, low, low + height], pose, placed);
        let [half, _] = LEG_HALF_M;
        placed.push((Solid::cuboid([SHEET_M, -half, 0.0], [SHEET_M + 2.0 * half, half, low + height], Steel), pose));
    }
    for at_m in positions_m(roadside.gantry_spacing_m, s_m, REACH_M) {
        let half_m = 0.5 * road.right_edge_m().abs() + BESIDE_M;
        let pose = road.plane_pose(at_m, 0.5 * road.right_edge_m(), facing_rad);
        append_sign([half_m, GANTRY_M[0], GANTRY_M[1]], pose, placed);
        let [_, half] = LEG_HALF_M;
        for end_m in [edge_m + outward * BESIDE_M, far_edge_m - outward * BESIDE_M] {
            let leg = Solid::cuboid([-half, -half, 0.0], [half, half, GANTRY_M[1]], Steel);
            placed.push((leg, road.plane_pose(at_m, end_m, 0.0)));
        }
    }
    for at_m in positions_m(roadside.tree_spacing_m, s_m, REACH_M) {
        let [beside, half, height] = TREE_M;
        let stem = Solid::cuboid([-half, -half, 0.0], [half, half, height], Bark);
        placed.push((stem, road.plane_pose(at_m, edge_m + outward * beside, 0.0)));
    }
}

/// Appends a sign that faces −x: its face, and its back of metal.
fn append_sign([half_m, low_m, high_m]: [f64; 3], pose: PlanePose, placed: &mut Vec<PlacedSolid>) {
    placed.push((Solid::cuboid([-SHEET_M, -half_m, low_m], [0.0, half_m, high_m], Sign), pose));
    placed.push((Solid::cuboid([0.0, -half_m, low_m], [SHEET_M, half_m, high_m], Steel), pose));
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Alignment, AlignmentPoint, maths};

    use super::*;

    #[test]
    fn the_chords_of_a_rail_follow_the_road_through_clothoids() {
        let points = [[0.0, 0.0], [60.0, 0.0025], [90.0, 0.0025], [150.0, -0.0025], [200.0, -0.0025]];
        let points = points.map(|[s_m, curvature_per_m]| AlignmentPoint { s_m, curvature_per_m });
        let road = Road::straight(3).with_guard_rails().with_alignment(Alignment::new(&points).unwrap());
        let mut placed = Vec::new();
        append_guard_rails(&road, 180.0, &mut placed);
        // The rail at the left edge comes first: 14 chords.
        let [left_m, _] = road.guard_rail_offsets_m();
        let chords = &placed[..14];
        let at = |pose: &PlanePose, along_m: f64| {
            let (sin, cos) = maths::sin_cos(pose.yaw_rad);
            road.road_position_m(pose.x_m + along_m * cos, pose.y_m + along_m * sin, 100.0)
        };
        for (index, (_, pose)) in chords.iter().enumerate() {
            let half_m = if index == 13 { 2.0 } else { 6.0 };
            for along_m in [-half_m, -0.5 * half_m, 0.0, half_m] {
                let (s_m, d_m) = at(pose, along_m);
                assert!((d_m - left_m).abs() < 0.05, "{index} {along_m}: {d_m} at {s_m}");
            }
        }
    }
}
