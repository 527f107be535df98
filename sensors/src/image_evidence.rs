//! The association of the instances in an image with the LiDAR's detections, and the evidence of
//! each about the other.
//!
//! ```text
//!   instances of the image ──┐                     ┌▶ seen by both: scores, and width from the mask
//!                            ├▶ overlap in image ──┼▶ LiDAR only: the image says that there is no vehicle, if it would show one
//!   boxes of the detections ─┘                     └▶ camera only: a place on the road
//! ```

use crate::camera::{Instance, RearCamera, is_beside_road, overlap};
use crate::tracking::LaneGeometry;
use closecall_traffic::{ClassScores, Time, maths};

use crate::{Detection, Extent, Scene, SceneVehicle, SeenBy, SeenPart};

/// Least overlap at which an instance and a detection belong together, as a share of the smaller
/// box (assumption: a cluster may be a part of the vehicle, and the length of its box is often
/// assumed).
pub(crate) const MIN_OVERLAP: f64 = 0.5;
/// Such a share above which an instance is not the camera's alone (assumption).
const TOUCHING: f64 = 0.2;
/// Least intersection over union at which two instances are the same vehicle with two classes: the
/// value of a match in COCO.
const SAME_INSTANCE: f64 = 0.5;
/// Score from which an instance that no cluster belongs to counts as a vehicle: more likely than
/// not.
const MIN_ALONE_SCORE: f64 = 0.5;
/// Share of a detection's box in the image that the boxes of nearer detections may cover, if the
/// image shows it (assumption).
const MAX_HIDDEN: f64 = 0.3;
/// Range of plausible widths of a vehicle from its mask (m).
const WIDTHS_M: std::ops::RangeInclusive<f64> = 0.5..=2.8;
/// Standard deviations of the lowest row of a mask and of its edges (px), and of the pitch of the
/// body (rad): assumptions. They are one sampled pixel, and half of the pitch of hard braking.
const ROW_SD_PX: f64 = 3.0;
const EDGE_SD_PX: f64 = 3.0;
const PITCH_SD_RAD: f64 = 0.005;
/// Distance up to which the place of an instance on the road is used (m): at 60 m, its standard
/// deviation is 15 m.
const MAX_ALONE_M: f64 = 60.0;
/// A detection of the camera alone counts as much as a cluster of so many points. The tracker takes
/// the scores of such a cluster with full weight.
const ALONE_POINTS: usize = 12;

/// The evidence of the image about a detection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Evidence {
    /// Scores of the classes from the image alone.
    pub(crate) scores: ClassScores,
    /// Width from the mask (m).
    pub(crate) width_m: Option<f64>,
}

/// The result of one image.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ImageResult {
    /// For each detection, the evidence of the image; `None` if it says nothing.
    pub(crate) evidence: Vec<Option<Evidence>>,
    /// Vehicles that only the camera sees, in the ego's frame at the exposure.
    pub(crate) alone: Vec<Detection>,
}

/// Associates instances with detections.
pub(crate) fn associate(
    camera: &RearCamera,
    scene: &Scene<'_>,
    instances: &[Instance],
    detections: &[Detection],
) -> ImageResult {
    let lane = LaneGeometry::from_scene(scene);
    let network = camera.camera().mask_rcnn;
    let bounds: Vec<Option<[f64; 4]>> =
        detections.iter().map(|detection| camera.detection_bounds(&scene.ego, detection)).collect();
    let evidence = detections.iter().enumerate().map(|(index, detection)| {
        let detection_px = bounds[index].filter(|_| !is_beside_road(detection, &lane))?;
        match best(instances, &detection_px) {
            Some(instance) => Some(Evidence {
                scores: scores(instances, instance),
                width_m: width_m(camera, &scene.ego, instance, detection),
            }),
            None if detection_px[2] - detection_px[0] >= network.min_shown_px
                && !is_hidden(index, &detection_px, detections, &bounds) =>
            {
                missed_scores(network.missed).map(|scores| Evidence { scores, width_m: None })
            }
            None => None,
        }
    });
    let evidence = evidence.collect();
    let is_alone = |instance: &&Instance| {
        let others = bounds.iter().flatten();
        instance.score >= MIN_ALONE_SCORE
            && others.into_iter().all(|box_px| overlap(&instance.box_px, box_px) < TOUCHING)
    };
    let alone = instances.iter().filter(is_alone).filter_map(|instance| alone(camera, scene, instance, &lane));
    ImageResult { evidence, alone: alone.collect() }
}

/// Returns the scores of a detection that the image would show as a vehicle, and does not, if the
/// network misses this share of the vehicles. Returns `None` if it may miss all.
fn missed_scores(missed: f64) -> Option<ClassScores> {
    let vehicle = missed / (3.0 * missed + 1.0);
    (missed < 1.0).then_some(ClassScores([vehicle, vehicle, vehicle, 1.0 / (3.0 * missed + 1.0)]))
}

/// Returns the instance that a box in the image belongs to: the instance with the largest
/// intersection over union.
fn best<'a>(instances: &'a [Instance], detection_px: &[f64; 4]) -> Option<&'a Instance> {
    let near = instances.iter().filter(|instance| overlap(&instance.box_px, detection_px) >= MIN_OVERLAP);
    near.max_by(|a, b| union_share(&a.box_px, detection_px).total_cmp(&union_share(&b.box_px, detection_px)))
}

/// Returns the intersection over union of two boxes.
fn union_share(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    let area = |[left, top, right, bottom]: &[f64; 4]| (right - left).max(0.0) * (bottom - top).max(0.0);
    let common = overlap(a, b) * area(a).min(area(b));
    common / (area(a) + area(b) - common).max(f64::MIN_POSITIVE)
}

/// Returns the scores of an instance: the scores of all instances that show the same vehicle, and
/// the rest for background.
fn scores(instances: &[Instance], matched: &Instance) -> ClassScores {
    let mut scores = [0.0_f64; 4];
    for instance in instances.iter().filter(|other| union_share(&other.box_px, &matched.box_px) >= SAME_INSTANCE) {
        let class = &mut scores[instance.class as usize];
        *class = class.max(instance.score);
    }
    let sum: f64 = scores.iter().sum();
    scores[ClassScores::BACKGROUND] = (1.0 - sum).max(0.0);
    let total: f64 = scores.iter().sum();
    ClassScores(scores.map(|score| score / total))
}

/// Returns whether nearer detections hide the box of one in the image.
fn is_hidden(index: usize, detection_px: &[f64; 4], detections: &[Detection], bounds: &[Option<[f64; 4]>]) -> bool {
    let area = |[left, top, right, bottom]: &[f64; 4]| (right - left) * (bottom - top);
    let distance = |at: usize| maths::hypot(detections[at].face_x_m, detections[at].face_y_m);
    bounds.iter().enumerate().any(|(other, bounds)| {
        other != index
            && distance(other) < distance(index)
            && bounds.is_some_and(|bounds| {
                overlap(&bounds, detection_px) * area(&bounds).min(area(detection_px)) > MAX_HIDDEN * area(detection_px)
            })
    })
}

/// Returns the width of a vehicle from its mask (m), if the image does not cut it off and the width
/// is plausible.
///
/// The outer edge of the mask is the edge of the front face. The inner edge, towards the place
/// straight behind, is the edge of the rear if the side between them is seen.
fn width_m(camera: &RearCamera, ego: &SceneVehicle, instance: &Instance, detection: &Detection) -> Option<f64> {
    let [left, _, right, _] = instance.mask.extent_px()?;
    let width_px = f64::from(camera.camera().resolution.width_px);
    if left < 1.0 || right > width_px - 1.0 {
        return None;
    }
    let depth_m = camera.depth_m(ego, detection.face_x_m)?;
    // Rays to the ego's left have positive slopes.
    let [low, high] = [left, right].map(|edge| camera.slope(edge));
    let at = |slope: f64, is_inner: bool| slope * if is_inner { depth_m + detection.length_m } else { depth_m };
    let width_m = at(high, high < 0.0) - at(low, low > 0.0);
    WIDTHS_M.contains(&width_m).then_some(width_m)
}

/// Returns the detection of an instance that the camera alone sees: where the lowest row of its
/// mask meets a flat road.
fn alone(camera: &RearCamera, scene: &Scene<'_>, instance: &Instance, lane: &LaneGeometry) -> Option<Detection> {
    let [left, _, right, bottom] = instance.mask.extent_px()?;
    if bottom > f64::from(camera.camera().resolution.height_px) - 1.0 {
        return None;
    }
    let ([x_m, y_m], below) = camera.on_ground(&scene.ego, [0.5 * (left + right), bottom])?;
    let depth_m = camera.depth_m(&scene.ego, x_m).filter(|depth_m| *depth_m <= MAX_ALONE_M)?;
    let typical = instance.class.typical_dimensions();
    let focal_px = camera.camera().focal_px;
    let slope = (y_m - camera.camera().left_m) / depth_m;
    let widening = camera.widening([left, right]);
    let width_m = (right - left) / focal_px * widening * depth_m;
    // The distance is h / tan β: its derivative by β is −h / sin² β, which is about d / tan β.
    let range_sd_m = depth_m / below * maths::hypot(ROW_SD_PX / focal_px, PITCH_SD_RAD);
    let mut scores = [0.0; 4];
    (scores[instance.class as usize], scores[ClassScores::BACKGROUND]) = (instance.score, 1.0 - instance.score);
    let detection = Detection {
        time: scene.time,
        face_x_m: x_m,
        face_y_m: y_m,
        range_sd_m,
        lateral_sd_m: maths::hypot(depth_m * EDGE_SD_PX / focal_px * widening, slope * range_sd_m),
        heading_rad: lane.direction_rad(x_m),
        length_m: typical.length_m,
        length: Extent::Assumed,
        width_m: if WIDTHS_M.contains(&width_m) { width_m } else { typical.width_m },
        width: Extent::Assumed,
        top_m: typical.height_m,
        seen_by: SeenBy::CameraAlone,
        points: ALONE_POINTS,
        is_centred: false,
        seen: SeenPart::FACE,
        class: ClassScores(scores),
    };
    (!is_beside_road(&detection, lane)).then_some(detection)
}

/// Returns a detection at another time and place of the ego, on the same spot of the road.
pub(crate) fn moved(detection: &Detection, from: &Exposed, scene: &Scene<'_>) -> Detection {
    let then = closecall_traffic::ego_frame::EgoFrame::new(scene.road, &from.ego.state);
    let now = closecall_traffic::ego_frame::EgoFrame::new(scene.road, &scene.ego.state);
    let (s_m, d_m) = then.road_position_m(detection.face_x_m, detection.face_y_m);
    let point = now.point(s_m, d_m);
    Detection { time: from.time, face_x_m: point.x_m, face_y_m: point.y_m, ..detection.clone() }
}

/// When an image was exposed, and where the ego was.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exposed {
    /// Time of the exposure.
    pub(crate) time: Time,
    /// The ego at that time.
    pub(crate) ego: SceneVehicle,
}

#[cfg(test)]
mod tests;
