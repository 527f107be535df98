//! The names of the vehicles in the view from above, with their speeds and headways, and of tracks
//! that belong to no vehicle.

use closecall_traffic::{Measured, Time, Track};
use rerun::Points2D;

use super::super::RecordingError;
use super::super::palette;
use super::super::stream::Writer;
use super::super::truth::{NO_VEHICLE, belongs_to_a_vehicle};
use super::{Canvas, MARK_ORDER, clock_m, collision_m, is_shown_track};
use crate::run::film::{Frame, Part, headway_text};

/// Number of vehicles that are named, by their order among the actors.
const NAMED: usize = 5;

/// A label beside the road.
struct Name {
    /// Position of what it names, and of the label (m in the picture).
    named_m: f64,
    x_m: f64,
    is_above: bool,
    text: String,
    /// Texts for a row with less room, the longest last.
    shorter: Vec<String>,
    /// Room that the name takes, with the distance to the next (m in the picture).
    width_m: f64,
}

/// Writes the names of the vehicles with their speeds and headways. Names of vehicles behind the
/// ego or left of it lie above the road, the others below it. Names in one row are kept apart.
pub(super) fn write(writer: &Writer<'_>, canvas: &Canvas<'_>, times: &[Time]) -> Result<(), RecordingError> {
    let entity = "bird/names";
    let film = canvas.film;
    let rows: Vec<Vec<Name>> = (0..film.frames.len()).map(|row| names(canvas, row)).collect();
    let fixed = Points2D::update_fields()
        .with_colors([palette::LABEL])
        .with_radii([0.05_f32])
        .with_draw_order(MARK_ORDER)
        .with_show_labels(true);
    writer.write_static(entity, &fixed)?;
    let y_m = |name: &Name| if name.is_above { canvas.above_m() } else { canvas.below_m() };
    writer.write_rows(entity, times, |range| {
        let all = || rows[range.clone()].iter().flatten();
        Points2D::update_fields()
            .with_positions(all().map(|name| [name.x_m as f32, y_m(name) as f32]))
            .with_labels(all().map(|name| name.text.as_str()))
            .columns(rows[range.clone()].iter().map(Vec::len).collect::<Vec<_>>())
    })
}

/// Returns the names in a frame.
fn names(canvas: &Canvas<'_>, row: usize) -> Vec<Name> {
    let film = canvas.film;
    let frame = &film.frames[row];
    let ego = &frame.states[film.ego];
    let own_lane_m = film.road.lane_width_m(film.road.lane_of(ego), ego.s_m);
    let labelled_m = canvas.labelled_m();
    // A headway after a collision says nothing, and its room is taken by the text of the collision.
    let has_collided = film.worst_collision().is_some_and(|collision| frame.time >= collision.time);
    let mut named: Vec<usize> =
        (0..film.actors.len()).filter(|&actor| film.is_main(actor) && film.is_present(actor, row)).collect();
    // The ego and the vehicles ahead of it and behind it first, then lead and rear vehicle, then
    // the nearest others.
    let rank = |actor: &usize| match film.actors[*actor].part {
        Part::Ego => -2.0,
        _ if is_neighbour(frame, *actor) => -1.0,
        Part::Lead | Part::Rear => 0.0,
        Part::Other(_) | Part::Background => (frame.states[*actor].s_m - ego.s_m).abs(),
    };
    named.sort_by(|a, b| rank(a).total_cmp(&rank(b)));
    named.truncate(NAMED);
    let mut names: Vec<Name> = named
        .into_iter()
        .filter_map(|actor| {
            let state = &frame.states[actor];
            let x_m = state.s_m - ego.s_m;
            let is_inside = x_m > labelled_m[0] && x_m < labelled_m[1];
            let is_shown = is_inside || is_neighbour(frame, actor);
            let label = format!("{}{}", arrow(x_m, labelled_m), film.vehicle_label(actor));
            let is_above = actor != film.ego && (x_m < 0.0 || state.d_m - ego.d_m > 0.5 * own_lane_m);
            let headway = if has_collided { String::new() } else { headway_of(frame, actor) };
            let moving = format!("{label} {:.1} m/s", state.speed_mps);
            let text = format!("{moving}{headway}");
            let width_m = canvas.label_m(text.chars().count());
            is_shown.then_some(Name { named_m: x_m, x_m, is_above, text, shorter: vec![label, moving], width_m })
        })
        .collect();
    names.extend(false_tracks(canvas, frame));
    let mut placed = Vec::new();
    for is_above in [true, false] {
        let (clock_m, mark_m) = if is_above { (clock_m(canvas), collision_m(canvas, row)) } else { (0.0, 0.0) };
        let room_m = [labelled_m[0] + clock_m, labelled_m[1] - mark_m];
        let (mut of_row, rest): (Vec<Name>, Vec<Name>) = names.into_iter().partition(|name| name.is_above == is_above);
        names = rest;
        make_room(&mut of_row, room_m[1] - room_m[0], |letters| canvas.label_m(letters));
        of_row.sort_by(|a, b| a.x_m.total_cmp(&b.x_m));
        keep_apart(room_m, &mut of_row);
        point(&mut of_row, room_m[1] - room_m[0], |letters| canvas.label_m(letters));
        keep_apart(room_m, &mut of_row);
        placed.extend(of_row);
    }
    placed
}

/// Returns whether a vehicle is directly ahead of the ego or behind it. Such a vehicle has its name
/// at the end of the labelled stretch if it is beyond it.
fn is_neighbour(frame: &Frame, actor: usize) -> bool {
    frame.lead() == Some(actor) || frame.follower() == Some(actor)
}

/// Gives each name that lies beside its vehicle an arrow to it, as long as the row has room: it may
/// lie over another vehicle.
fn point(names: &mut [Name], room_m: f64, label_m: impl Fn(usize) -> f64) {
    let mut free_m = room_m - names.iter().map(|name| name.width_m).sum::<f64>();
    for name in names {
        let half_m = 0.5 * name.width_m;
        let text = format!("{}{}", arrow(name.named_m, [name.x_m - half_m, name.x_m + half_m]), name.text);
        let wider_m = label_m(text.chars().count()) - name.width_m;
        if text != name.text && !name.text.starts_with(ARROWS) && wider_m <= free_m {
            free_m -= wider_m;
            name.width_m += wider_m;
            name.text = text;
        }
    }
}

/// The arrows with which a name begins.
const ARROWS: [char; 2] = ['←', '→'];

/// Returns an arrow to a vehicle beyond the labelled stretch, which begins a name.
fn arrow(x_m: f64, [from_m, to_m]: [f64; 2]) -> &'static str {
    if x_m <= from_m {
        "← "
    } else if x_m >= to_m {
        "→ "
    } else {
        ""
    }
}

/// Returns a label for each shown track that belongs to no vehicle. It lies below the road.
fn false_tracks(canvas: &Canvas<'_>, frame: &Frame) -> Vec<Name> {
    let (labelled_m, width_m) = (canvas.labelled_m(), canvas.label_m(NO_VEHICLE.chars().count()));
    let is_false =
        |track: &&Track| is_shown_track(canvas.film, frame, track) && !belongs_to_a_vehicle(canvas.film, frame, track);
    let positions = frame.tracks.iter().filter(is_false).map(Track::x_m);
    let shown = positions.filter(|x_m| *x_m > labelled_m[0] && *x_m < labelled_m[1]);
    let name =
        |x_m| Name { named_m: x_m, x_m, is_above: false, text: NO_VEHICLE.to_owned(), shorter: Vec::new(), width_m };
    shown.map(name).collect()
}

/// Returns the headway that belongs to a vehicle, as it follows its speed.
fn headway_of(frame: &Frame, actor: usize) -> String {
    let margins = &frame.margins;
    let text =
        |thw_s: Measured, side: &str| thw_s.map_or(String::new(), |thw_s| format!(" · {} {side}", headway_text(thw_s)));
    if margins.lead.is_ok_and(|lead| lead.actor == actor) {
        text(margins.thw_front_s, "ahead")
    } else if margins.follower == Some(actor) {
        text(margins.thw_rear_s, "behind")
    } else {
        String::new()
    }
}

/// Shortens names, the longest first, until a row has room for all. The names are in the order of
/// their rank: if none can be shortened, the last is left out.
fn make_room(names: &mut Vec<Name>, room_m: f64, label_m: impl Fn(usize) -> f64) {
    while !names.is_empty() && names.iter().map(|name| name.width_m).sum::<f64>() > room_m {
        let can_shorten = (0..names.len()).filter(|&index| !names[index].shorter.is_empty());
        let longest = can_shorten.max_by(|&a, &b| names[a].width_m.total_cmp(&names[b].width_m));
        match longest.and_then(|index| Some((index, names[index].shorter.pop()?))) {
            Some((index, text)) => {
                names[index].width_m = label_m(text.chars().count());
                names[index].text = text;
            }
            None => {
                names.pop();
            }
        }
    }
}

/// Moves names along the row so that all lie in its room and none covers another. They are in the
/// order of the row.
fn keep_apart([from_m, to_m]: [f64; 2], names: &mut [Name]) {
    let mut free_from_m = from_m;
    for name in names.iter_mut() {
        let half_m = 0.5 * name.width_m;
        name.x_m = name.x_m.max(free_from_m + half_m);
        free_from_m = name.x_m + half_m;
    }
    let mut free_to_m = to_m;
    for name in names.iter_mut().rev() {
        let half_m = 0.5 * name.width_m;
        name.x_m = name.x_m.min(free_to_m - half_m);
        free_to_m = name.x_m - half_m;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_covers_another_and_none_leaves_its_room() {
        let width_m = |text: &str| 1.2 * text.chars().count() as f64 + 2.0;
        let name = |x_m, text: &str| Name {
            named_m: x_m,
            x_m,
            is_above: true,
            text: text.to_owned(),
            shorter: Vec::new(),
            width_m: width_m(text),
        };
        for at_m in [[-34.0, -33.0, -30.0], [70.0, 72.0, 74.0], [0.0, 1.0, 74.0]] {
            let mut names: Vec<Name> = at_m
                .into_iter()
                .zip(["R rear 30.0 m/s", "left-2", "E ego"])
                .map(|(x_m, text)| name(x_m, text))
                .collect();
            keep_apart([-20.0, 60.0], &mut names);
            let ends: Vec<[f64; 2]> =
                names.iter().map(|name| [-0.5, 0.5].map(|side| name.x_m + side * name.width_m)).collect();
            assert!(ends[0][0] >= -20.0 - 1e-9 && ends[2][1] <= 60.0 + 1e-9, "{ends:?}");
            assert!(ends.windows(2).all(|pair| pair[0][1] <= pair[1][0] + 1e-9), "{ends:?}");
        }
    }

    #[test]
    fn a_name_beyond_the_stretch_begins_with_an_arrow() {
        assert_eq!([-35.0, -34.9, 74.9, 75.0].map(|x_m| arrow(x_m, [-35.0, 75.0])), ["← ", "", "", "→ "]);
    }

    #[test]
    fn a_name_that_lies_beside_its_vehicle_points_at_it_while_there_is_room() {
        let named = |room_m: [f64; 2]| -> Vec<String> {
            let name = |named_m, text: &str| Name {
                named_m,
                x_m: named_m,
                is_above: true,
                text: text.to_owned(),
                shorter: Vec::new(),
                width_m: text.chars().count() as f64,
            };
            let mut row = vec![name(-28.0, "third"), name(-21.0, "second"), name(20.0, "left-2")];
            keep_apart(room_m, &mut row);
            point(&mut row, room_m[1] - room_m[0], |letters| letters as f64);
            keep_apart(room_m, &mut row);
            assert!(
                row.windows(2)
                    .all(|pair| { pair[0].x_m + 0.5 * pair[0].width_m <= pair[1].x_m - 0.5 * pair[1].width_m + 1e-9 })
            );
            row.into_iter().map(|name| name.text).collect()
        };
        assert_eq!(named([-30.0, 40.0]), ["third", "second", "left-2"], "each lies above its vehicle");
        assert_eq!(named([-2.0, 40.0]), ["← third", "← second", "left-2"], "the clock takes the room");
        assert_eq!(named([-2.0, 17.0]), ["← third", "second", "left-2"], "there is room for one arrow");
    }

    #[test]
    fn a_full_row_loses_headways_before_speeds_and_speeds_before_names() {
        let names = |room_m: f64| -> Vec<String> {
            let name = |texts: [&str; 3]| Name {
                named_m: 0.0,
                x_m: 0.0,
                is_above: false,
                text: texts[2].to_owned(),
                shorter: texts[..2].iter().map(|&text| text.to_owned()).collect(),
                width_m: texts[2].chars().count() as f64,
            };
            let ghost = Name { shorter: Vec::new(), ..name(["", "", NO_VEHICLE]) };
            let mut row = vec![
                name(["E ego", "E ego 24.6 m/s", "E ego 24.6 m/s"]),
                name(["F front", "F front 23.5 m/s", "F front 23.5 m/s · 2.10 s ahead"]),
                ghost,
            ];
            make_room(&mut row, room_m, |letters| letters as f64);
            assert!(row.iter().map(|name| name.width_m).sum::<f64>() <= room_m.max(0.0), "{room_m}");
            row.into_iter().map(|name| name.text).collect()
        };
        assert_eq!(names(60.0), ["E ego 24.6 m/s", "F front 23.5 m/s · 2.10 s ahead", NO_VEHICLE]);
        assert_eq!(names(50.0), ["E ego 24.6 m/s", "F front 23.5 m/s", NO_VEHICLE]);
        assert_eq!(names(26.0), ["E ego", "F front", NO_VEHICLE]);
        // The last in the order of the ranks goes first.
        assert_eq!(names(12.0), ["E ego", "F front"]);
        assert_eq!(names(-1.0), Vec::<String>::new(), "a row that the clock and the collision fill");
    }
}
