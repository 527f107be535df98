//! The vehicles in the 3D scene: bodies, lights, names, velocities, collisions, and the gaps around
//! the ego.
//!
//! Names, headways and texts of collisions are written, but hidden until the user switches them on.
//! On the ground and the sky of the scene the viewer's labels are not legible in its light theme,
//! and in a small scene they lie on each other. The title of the view from above explains the
//! colours, and that view has all names.

use closecall_traffic::geometry::BoxSide;
use closecall_traffic::{Dimensions, Indicator, Measured, PlanePose, Road, Time, VehicleClass, VehicleState, maths};
use rerun::{Arrows3D, Boxes3D, FillMode, LineStrips3D, Points3D, Quaternion, Transform3D};

use super::RecordingError;
use super::bodies;
use super::palette::{self, Rgba};
use super::stream::{Writer, changes};
use crate::run::film::{Film, Frame, Part, headway_text};
use closecall_scenarios::outcome::CRITICAL_THW_S;

/// An arrow shows the distance that the vehicle travels in this time (s).
const ARROW_S: f64 = 0.25;
/// Height of the arrows above the roof (m).
const ARROW_ABOVE_M: f64 = 0.4;
/// Heights of the names above the roof (m). They differ, and the names of vehicles that touch do
/// not cover each other. The name of the ego lies on the road, to its right.
const EGO_LABEL_AT_M: [f32; 3] = [5.0, -5.0, 0.0];
const LEAD_LABEL_M: f64 = 5.8;
const OTHER_LABEL_M: f64 = 1.6;
const REAR_LABEL_M: f64 = 3.2;
/// Distance of the text about the first collision behind the centre of the vehicle that carries it
/// (m). The text lies on the road, clear of the names of the vehicles.
const COLLISION_TEXT_BEHIND_M: f32 = 11.0;
/// Distance between the texts about two collisions (m).
const COLLISION_TEXT_SPACING_M: f32 = 4.0;
/// Position of the headways beside the ego (m): the rear one to its right and thus nearer to the
/// eye, the front one to its left, away from the name of the ego.
const REAR_TEXT_Y_M: f32 = -6.0;
const FRONT_TEXT_Y_M: f32 = 7.0;
/// Gap below which the vehicles touch and no headway is written (m).
const TOUCHING_M: f64 = 0.3;
/// Front gap below which no headway is written, since the name of the ego is there (m).
const NAMED_GAP_M: f64 = 25.0;
/// Share of the rear gap that is added to it.
const NAMED_GAP_SHARE: f64 = 0.4;
/// Height at which gaps are drawn (m).
const GAP_Z_M: f64 = 0.5;

/// Returns the height of the name of a vehicle above its roof (m).
const fn label_above_m(part: Part) -> f64 {
    match part {
        Part::Lead => LEAD_LABEL_M,
        Part::Rear => REAR_LABEL_M,
        Part::Ego | Part::Other(_) | Part::Background => OTHER_LABEL_M,
    }
}

/// Returns the path of the entity of an actor.
pub(super) fn entity(film: &Film, actor: usize) -> String {
    if actor == film.ego { "world/ego".to_owned() } else { format!("world/vehicles/{}", film.actors[actor].name) }
}

pub(super) fn write(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let all_times = film.times();
    for (index, actor) in film.actors.iter().enumerate().filter(|(_, actor)| !actor.present_frames.is_empty()) {
        let entity = entity(film, index);
        let colour = palette::part(actor.part);
        let times = &all_times[actor.present_frames.clone()];
        let states: Vec<&VehicleState> =
            film.frames[actor.present_frames.clone()].iter().map(|frame| &frame.states[index]).collect();
        let size = &actor.vehicle.dimensions;
        let body = (format!("{entity}/body"), bodies::body(&actor.vehicle, colour));
        if actor.present_frames == (0..all_times.len()) {
            writer.write_static(&body.0, &body.1)?;
        } else {
            // A body written statically could not disappear with its vehicle.
            writer.write_from(&body.0, times[0], &body.1)?;
        }
        write_motion(writer, &entity, times, &states, &film.road)?;
        if film.is_main(index) {
            write_velocity(writer, &entity, times, &states, size, colour)?;
            let above_m = size.height_m + label_above_m(actor.part);
            let at_m = if index == film.ego { EGO_LABEL_AT_M } else { [0.0, 0.0, above_m as f32] };
            // Dense recorded traffic has room for three names. The view from above has the others.
            if film.outcome.is_some() || !matches!(actor.part, Part::Other(_)) {
                let texts = names(film, index, writer.is_alone);
                write_name(writer, &entity, times, &texts, at_m, colour)?;
            }
        }
        write_lights(writer, &entity, times, &states, actor.vehicle.class, size)?;
        if let Some(&gone) = all_times.get(actor.present_frames.end) {
            writer.write_clear(&entity, gone)?;
        }
    }
    write_gaps(writer, film, &all_times)?;
    write_collisions(writer, film)?;
    write_rig(writer, film, &all_times)
}

/// Share of the rear gap by which the rig stays behind the ego. The rear vehicle is then in the
/// picture.
const RIG_SHARE: f64 = 0.75;
/// Largest distance of the rig behind the ego (m).
const MAX_RIG_M: f64 = 80.0;

/// Writes the rig of the scene's eye. It moves along the road with the ego, but does not turn with
/// it. As long as the rear vehicle is far, the rig stays back.
fn write_rig(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let rear = film.actors.iter().position(|actor| actor.part == Part::Rear);
    let pose = |frame: &Frame| {
        let ego = &frame.states[film.ego];
        let gap_m = rear.map_or(0.0, |rear| ego.s_m - frame.states[rear].s_m);
        let s_m = ego.s_m - (RIG_SHARE * gap_m).clamp(0.0, MAX_RIG_M);
        film.road.plane_pose(s_m, 0.5 * film.road.right_edge_m(), 0.0)
    };
    write_poses(writer, "world/rig", times, &film.frames.iter().map(pose).collect::<Vec<_>>())
}

fn write_motion(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    states: &[&VehicleState],
    road: &Road,
) -> Result<(), RecordingError> {
    let poses: Vec<_> = states.iter().map(|state| road.plane_pose(state.s_m, state.d_m, state.heading_rad)).collect();
    write_poses(writer, entity, times, &poses)
}

/// Writes the pose of an entity at each of these times.
pub(super) fn write_poses(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    poses: &[PlanePose],
) -> Result<(), RecordingError> {
    writer.write_rows(entity, times, |range| {
        let poses = &poses[range];
        Transform3D::update_fields()
            .with_many_translation(poses.iter().map(|pose| [pose.x_m as f32, pose.y_m as f32, 0.0]))
            .with_many_quaternion(poses.iter().map(|pose| yaw_rotation(pose.yaw_rad)))
            .columns_of_unit_batches()
    })
}

/// Returns a rotation about the vertical axis.
pub(super) fn yaw_rotation(yaw_rad: f64) -> Quaternion {
    let (sin, cos) = maths::sin_cos(0.5 * yaw_rad);
    Quaternion::from_xyzw([0.0, 0.0, sin as f32, cos as f32])
}

fn write_velocity(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    states: &[&VehicleState],
    size: &Dimensions,
    colour: Rgba,
) -> Result<(), RecordingError> {
    let entity = format!("{entity}/velocity");
    let above_m = (size.height_m + ARROW_ABOVE_M) as f32;
    let fixed = Arrows3D::update_fields()
        .with_origins([[0.0, 0.0, above_m]])
        .with_colors([palette::with_opacity(colour, 220)])
        .with_radii([0.09_f32]);
    writer.write_static(&entity, &fixed)?;
    writer.write_rows(&entity, times, |range| {
        Arrows3D::update_fields()
            .with_vectors(states[range].iter().map(|state| [(ARROW_S * state.speed_mps) as f32, 0.0, 0.0]))
            .columns_of_unit_batches()
    })
}

/// Returns the name of a vehicle, with its rounded speed if there is room, for each frame in which
/// it is present. A vehicle that touches the ego has none: the names would lie on each other, and
/// the collision's text has both.
fn names(film: &Film, actor: usize, has_room: bool) -> Vec<String> {
    let name = film.vehicle_label(actor);
    let text = |frame: &Frame| {
        let distance_m = || film.moving_box(frame, actor).shape.distance_m(&film.moving_box(frame, film.ego).shape);
        if actor != film.ego && film.outcome.is_some() && distance_m() < TOUCHING_M {
            return String::new();
        }
        match has_room {
            true => format!("{name} {:.0} m/s", frame.states[actor].speed_mps),
            false => name.clone(),
        }
    };
    film.frames[film.actors[actor].present_frames.clone()].iter().map(text).collect()
}

fn write_name(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    texts: &[String],
    at_m: [f32; 3],
    colour: Rgba,
) -> Result<(), RecordingError> {
    let entity = format!("{entity}/name");
    let fixed = Points3D::new([at_m]).with_colors([colour]).with_radii([0.05_f32]).with_show_labels(false);
    writer.write_static(&entity, &fixed)?;
    // Only a change of the rounded speed gives a new row.
    let rows = changes(texts);
    let times: Vec<Time> = rows.iter().map(|&row| times[row]).collect();
    writer.write_rows(&entity, &times, |range| {
        let texts = rows[range].iter().map(|&row| texts[row].as_str());
        Points3D::update_fields().with_labels(texts).columns_of_unit_batches()
    })
}

fn write_lights(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    states: &[&VehicleState],
    class: VehicleClass,
    size: &Dimensions,
) -> Result<(), RecordingError> {
    let (rear_m, front_m) = (-0.5 * size.length_m, 0.5 * size.length_m);
    // A motorcycle has one brake light in the middle; the other vehicles have two at the corners.
    let side_m = 0.5 * size.width_m - if class == VehicleClass::Motorcycle { 0.5 * size.width_m } else { 0.25 };
    let lamp_m = 0.5 * size.height_m.min(1.8);
    let brake = Lamps {
        name: "brake_lights",
        at_m: [[rear_m, side_m, lamp_m], [rear_m, -side_m, lamp_m]],
        half_m: [0.06, 0.2, 0.11],
        colour: palette::BRAKE_LIGHT,
    };
    write_lamps(writer, entity, times, &brake, &states.iter().map(|state| state.brake_light).collect::<Vec<_>>())?;
    for (side, name, sign) in [(Indicator::Left, "indicators_left", 1.0), (Indicator::Right, "indicators_right", -1.0)]
    {
        let edge_m = sign * 0.5 * size.width_m;
        let lamps = Lamps {
            name,
            at_m: [[rear_m, edge_m, lamp_m], [front_m, edge_m, lamp_m]],
            half_m: [0.16, 0.12, 0.11],
            colour: palette::INDICATOR,
        };
        // The indicators do not blink: every single frame shows them.
        let lit: Vec<bool> = states.iter().map(|state| state.indicator == side).collect();
        write_lamps(writer, entity, times, &lamps, &lit)?;
    }
    Ok(())
}

/// A pair of lamps that are switched together.
struct Lamps {
    name: &'static str,
    at_m: [[f64; 3]; 2],
    half_m: [f32; 3],
    colour: Rgba,
}

fn write_lamps(
    writer: &Writer<'_>,
    entity: &str,
    times: &[Time],
    lamps: &Lamps,
    lit: &[bool],
) -> Result<(), RecordingError> {
    let rows = changes(lit);
    if !lit.contains(&true) {
        return Ok(());
    }
    let entity = format!("{entity}/{}", lamps.name);
    let fixed = Boxes3D::update_fields().with_colors([lamps.colour]).with_fill_mode(FillMode::Solid);
    writer.write_static(&entity, &fixed)?;
    let times: Vec<Time> = rows.iter().map(|&row| times[row]).collect();
    writer.write_rows(&entity, &times, |range| {
        let lengths: Vec<usize> = rows[range].iter().map(|&row| if lit[row] { lamps.at_m.len() } else { 0 }).collect();
        let count = lengths.iter().sum();
        let centres = lamps.at_m.iter().cycle().take(count).map(|at| at.map(|value| value as f32));
        Boxes3D::update_fields()
            .with_centers(centres)
            .with_half_sizes(std::iter::repeat_n(lamps.half_m, count))
            .columns(lengths)
    })
}

/// Writes the gaps in front of and behind the ego, bumper to bumper, with their time headways. A
/// critical gap is red.
fn write_gaps(writer: &Writer<'_>, film: &Film, times: &[Time]) -> Result<(), RecordingError> {
    let bumper_m = 0.5 * film.actors[film.ego].vehicle.dimensions.length_m;
    let front = |frame: &Frame| {
        let (gap_m, thw_s) = (frame.margins.gap_front_m, frame.margins.thw_front_s);
        // In the smaller scenes of a pair, the headways would lie on the names; the view from above
        // has them.
        if !writer.is_alone {
            return Gap::new([bumper_m, 1.0], gap_m, thw_s, f64::INFINITY);
        }
        // From farther back the names of the ego and of the lead vehicle are closer together.
        let named_m = NAMED_GAP_M + NAMED_GAP_SHARE * frame.margins.gap_rear_m.unwrap_or(0.0).clamp(0.0, MAX_RIG_M);
        Gap::new([bumper_m, 1.0], gap_m, thw_s, named_m)
    };
    let rear_named_m = if writer.is_alone { TOUCHING_M } else { f64::INFINITY };
    let rear =
        |frame: &Frame| Gap::new([-bumper_m, -1.0], frame.margins.gap_rear_m, frame.margins.thw_rear_s, rear_named_m);
    let both: [(&str, Vec<Option<Gap>>); 2] = [
        ("world/ego/gap_front", film.frames.iter().map(front).collect()),
        ("world/ego/gap_rear", film.frames.iter().map(rear).collect()),
    ];
    for (entity, gaps) in both {
        writer.write_static(entity, &LineStrips3D::update_fields().with_radii([0.06_f32]))?;
        let text_entity = format!("{entity}/headway");
        let fixed = Points3D::update_fields().with_radii([0.03_f32]).with_show_labels(false);
        writer.write_static(&text_entity, &fixed)?;
        let lengths = |gaps: &[Option<Gap>]| gaps.iter().map(|gap| usize::from(gap.is_some())).collect::<Vec<_>>();
        writer.write_rows(entity, times, |range| {
            let shown = || gaps[range.clone()].iter().flatten();
            LineStrips3D::new(shown().map(|gap| gap.ends_m))
                .with_colors(shown().map(|gap| gap.colour))
                .columns(lengths(&gaps[range.clone()]))
        })?;
        writer.write_rows(&text_entity, times, |range| {
            let shown = || gaps[range.clone()].iter().flatten();
            Points3D::new(shown().map(|gap| gap.text_m))
                .with_colors(shown().map(|gap| gap.colour))
                .with_labels(shown().map(|gap| gap.text.as_str()))
                .columns(lengths(&gaps[range.clone()]))
        })?;
    }
    Ok(())
}

/// The line that shows a gap.
struct Gap {
    ends_m: [[f32; 3]; 2],
    /// Position of the text, beside the lane.
    text_m: [f32; 3],
    colour: Rgba,
    text: String,
}

impl Gap {
    /// Returns the gap that begins at `bumper_m` and extends in the direction of `sign`, in the ego
    /// frame, or `None` if there is no positive gap. Below `named_m` it has no text.
    fn new([bumper_m, sign]: [f64; 2], gap_m: Measured, thw_s: Measured, named_m: f64) -> Option<Self> {
        let gap_m = gap_m.ok().filter(|&gap_m| gap_m > 0.0)?;
        let is_critical = thw_s.is_ok_and(|thw_s| thw_s < CRITICAL_THW_S);
        let end = |x_m: f64| [x_m as f32, 0.0, GAP_Z_M as f32];
        let text = match thw_s {
            _ if gap_m < named_m => String::new(),
            Ok(thw_s) => headway_text(thw_s),
            Err(_) => format!("{gap_m:.1} m"),
        };
        Some(Self {
            ends_m: [end(bumper_m), end(bumper_m + sign * gap_m)],
            text_m: [
                (bumper_m + 0.5 * sign * gap_m) as f32,
                if sign > 0.0 { FRONT_TEXT_Y_M } else { REAR_TEXT_Y_M },
                0.0,
            ],
            colour: if is_critical { palette::CRITICAL } else { palette::SAFE },
            text,
        })
    }
}

/// Writes a mark on the struck side of the first vehicle of each collision, and the changes of
/// velocity as a text on the road behind it. Both move with the vehicle.
fn write_collisions(writer: &Writer<'_>, film: &Film) -> Result<(), RecordingError> {
    let mut text_x_m = -COLLISION_TEXT_BEHIND_M;
    for (number, collision) in film.collisions().iter().enumerate() {
        let index = film.actors.iter().position(|actor| actor.name == collision.between[0].as_str());
        let Some(index) = index else { continue };
        let size = &film.actors[index].vehicle.dimensions;
        let at_m = match collision.struck_side[0] {
            BoxSide::Front => [0.5 * size.length_m, 0.0],
            BoxSide::Rear => [-0.5 * size.length_m, 0.0],
            BoxSide::Left => [0.0, 0.5 * size.width_m],
            BoxSide::Right => [0.0, -0.5 * size.width_m],
        };
        let entity = format!("{}/collision_{}", entity(film, index), number + 1);
        let [x, y] = at_m.map(|at_m| at_m as f32);
        let mark = Points3D::new([[x, y, 0.6], [text_x_m, 0.0, 0.0]])
            .with_colors([palette::CRITICAL])
            .with_radii([0.45_f32, 0.05])
            .with_labels([String::new(), film.mark_text(collision)])
            .with_show_labels(false);
        // The mark appears at the first frame at or after the contact: in earlier frames the
        // vehicles are still apart.
        let appears_at = film.frames.iter().map(|frame| frame.time).find(|&time| time >= collision.time);
        writer.write_from(&entity, appears_at.unwrap_or(collision.time), &mark)?;
        text_x_m -= COLLISION_TEXT_SPACING_M;
    }
    Ok(())
}
