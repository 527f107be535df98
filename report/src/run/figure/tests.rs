use std::path::Path;

use closecall_scenarios::sampling::Design;

use super::*;
use crate::run::film::{Film, FilmRecorder, Level, Part};
use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::ScenarioFile;
use closecall_scenarios::outcome::{ClosedBy, Collision, Phase};
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::{Arm, RunKey, simulate};
use closecall_traffic::ActorId;
use closecall_traffic::geometry::BoxSide;

fn films(name: &str, arms: &[ControllerChoice]) -> Vec<Film> {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenarios/library/{name}.toml"));
    let file = ScenarioFile::load(&library, &[]).unwrap();
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 1 };
    let scenario = concrete(&file, sampling, 0).unwrap();
    let key = RunKey { seed: 1, sample: 0 };
    let film = |controller: &ControllerChoice| {
        let arm = Arm { controller: controller.factory(), sensors: None };
        let mut recorder = FilmRecorder::new(&scenario, key, &arm, Level::Objects);
        let outcome = simulate(&scenario, key, &arm, &mut recorder).unwrap();
        recorder.finish(&outcome)
    };
    arms.iter().map(film).collect()
}

#[test]
fn the_figure_of_the_papers_scenario_shows_all_five_moments_and_the_prevented_collision() {
    let films = films("paper-figure", &[ControllerChoice::ACC, ControllerChoice::MIS]);
    let text = encounter(&films);
    for letter in [
        "(a)",
        "(b)",
        "(c)",
        "(d)",
        "(e)",
        "PREVENTED · paper-figure · acc and mis · seed 1 · sample 0<",
        "R struck E from behind at ",
        "no collision",
        "m from E",
        "critical 0.9 s",
        "increasing",
    ] {
        assert!(text.contains(letter), "{letter}");
    }
    assert!(!text.contains("NaN") && !text.contains("inf"), "the figure contains a number that is not finite");
}

#[test]
fn in_dense_traffic_all_but_ego_lead_and_rear_vehicle_are_grey_and_share_one_entry_of_the_legend() {
    let films = films("traffic/busy-overtake", &[ControllerChoice::ACC, ControllerChoice::MIS]);
    let film = &films[1];
    assert!(film.actors.len() > 8, "{}", film.actors.len());
    let names: Vec<String> = (0..film.actors.len()).map(|actor| colours::legend_name(film, actor)).collect();
    let named: Vec<&String> = names.iter().filter(|name| !name.is_empty()).collect();
    assert_eq!(named.len(), 4, "{named:?}");
    let colours: std::collections::BTreeSet<&str> =
        (0..film.actors.len()).map(|actor| colours::colour(film, actor)).collect();
    assert_eq!(colours.len(), 4, "{colours:?}");
    assert_eq!(film.actors.iter().filter(|actor| actor.is_plotted).count(), 3);
    let card = card(&films, "closecall replay . 0");
    assert!(card.len() < 300_000, "{} bytes", card.len());
    assert!(card.contains("R struck E from behind at ") && card.contains("animateTransform"), "{card}");
    assert!(card.contains("R struck E; avoidable by: "), "{card}");
    assert!(card.contains("closecall replay . 0") && card.matches("<svg").count() == 4);
    for loaded in ["<script", "<link", "<img", "src=", "url(", "http://", "https://", "NaN"] {
        assert!(!card.contains(loaded), "{loaded}");
    }
}

#[test]
fn in_traffic_without_an_encounter_the_plotted_vehicles_are_the_neighbours_of_the_ego() {
    let film = &films("traffic/dense-traffic", &[ControllerChoice::ACC])[0];
    let neighbours = [Part::Lead, Part::Rear].map(|part| film.actors.iter().position(|actor| actor.part == part));
    assert_eq!(neighbours, [film.frames[0].lead(), film.frames[0].follower()]);
    assert!(neighbours.iter().flatten().all(|&actor| film.actors[actor].is_plotted), "{neighbours:?}");
}

#[test]
fn a_run_without_other_vehicles_nearby_has_a_still_and_a_figure() {
    let films = films("empty-wet-road", &[ControllerChoice::MIS]);
    for text in [still(&films[0]), encounter(&films)] {
        assert!(text.contains("no collision") && !text.contains("NaN") && !text.contains("inf"));
    }
}

#[test]
fn the_curves_of_a_figure_are_interrupted_where_another_vehicle_begins() {
    let film = &films("empty-wet-road", &[ControllerChoice::ACC])[0];
    let middle = film.frames.len() / 2;
    let another_from = film.frames[middle].time;
    let vehicle = |frame: &Frame| Some(usize::from(frame.time >= another_from));
    let points = points_over_time(&film.frames, vehicle, |_| Some(1.0));
    assert_eq!(points.len(), film.frames.len() + 1);
    for (index, (_, value)) in points.iter().enumerate() {
        assert_eq!(value.is_none(), index == middle);
    }
    assert!(is_another(Some(1), Some(2)) && !is_another(Some(1), Some(1)) && !is_another(None, Some(1)));
}

/// The areas of the labels of vehicles in a picture: left, top, right and bottom (px).
fn label_areas(svg: &str) -> Vec<[f64; 4]> {
    let number = |line: &str, name: &str| -> f64 {
        line.split(&format!(" {name}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
    };
    let labels = svg.lines().filter(|line| line.ends_with(" m/s</text>") && line.contains("text-anchor=\"middle\""));
    labels
        .map(|line| {
            let text = line.split('>').nth(1).unwrap().trim_end_matches("</text");
            let half = 0.5 * 6.0 * text.chars().count() as f64;
            let [x, y] = ["x", "y"].map(|name| number(line, name));
            [x - half, y - 8.0, x + half, y + 2.0]
        })
        .collect()
}

#[test]
fn labels_of_several_rear_vehicles_cover_each_other_nowhere_and_lie_on_the_road() {
    for name in ["rear-vehicles-one-after-another", "rear-vehicle-is-followed", "paper-figure"] {
        let films = films(name, &[ControllerChoice::ACC, ControllerChoice::MIS]);
        let pictures = [(encounter(&films), [78.0, 742.0]), (still(&films[0]), [8.0, 352.0])];
        for (svg, [left, right]) in pictures {
            let areas = label_areas(&svg);
            assert!(areas.len() > 1, "{name}");
            for (index, one) in areas.iter().enumerate() {
                assert!(one[0] > left - 0.1 && one[2] < right + 0.1, "{name}: {one:?}");
                for other in &areas[index + 1..] {
                    let is_apart = one[2] <= other[0] || other[2] <= one[0] || one[3] <= other[1] || other[3] <= one[1];
                    assert!(is_apart, "{name}: {one:?} and {other:?}");
                }
            }
        }
    }
}

#[test]
fn a_vehicle_outside_of_the_picture_has_no_label() {
    let films = films("rear-vehicles-one-after-another", &[ControllerChoice::MIS]);
    let film = &films[0];
    let rear = film.actors.iter().position(|actor| actor.part == Part::Rear).unwrap();
    let states = &film.frames[0].states;
    let ahead_m = states[rear].s_m - states[film.ego].s_m;
    let drawn = |rear_end_m: f64| {
        let mut svg = svg::Svg::new([560.0, 330.0]);
        let area = svg::Area { left: 10.0, top: 46.0, width: 540.0, height: 96.0 };
        strip::draw(&mut svg, film, None, 0, area, [rear_end_m, 75.0]);
        svg.finish()
    };
    let [within, beyond] = [drawn(ahead_m - 20.0), drawn(ahead_m + 20.0)];
    assert!(within.contains(">E ego ") && within.contains(">R rear "), "{within}");
    assert!(beyond.contains(">E ego ") && !beyond.contains(">R rear "), "{beyond}");
}

#[test]
fn a_vehicle_in_the_left_lane_has_its_label_beside_it_if_there_is_room_nowhere_else() {
    let mut films = films("rear-vehicles-one-after-another", &[ControllerChoice::MIS]);
    let film = &mut films[0];
    let [rear, lead] =
        [Part::Rear, Part::Lead].map(|part| film.actors.iter().position(|actor| actor.part == part).unwrap());
    let ego = film.frames[0].states[film.ego];
    let left_m = film.road.lane_centre_m(closecall_traffic::Lane(1), 0.0);
    let states = &mut film.frames[0].states;
    (states[lead].s_m, states[rear].s_m, states[rear].d_m) = (ego.s_m + 20.0, ego.s_m + 24.0, left_m);
    let mut svg = svg::Svg::new([360.0, 120.0]);
    let area = svg::Area { left: 8.0, top: 8.0, width: 344.0, height: 100.0 };
    strip::draw(&mut svg, &*film, None, 0, area, [-38.0, 70.0]);
    let text = svg.finish();
    assert!(text.contains(">F front ") && text.contains(">R rear "), "{text}");
}

#[test]
fn from_above_only_ego_lead_and_rear_vehicle_and_vehicles_that_collide_are_named() {
    let films = films("rear-vehicles-one-after-another", &[ControllerChoice::ACC]);
    let film = &films[0];
    let text = encounter(&films);
    let others: Vec<usize> = (0..film.actors.len()).filter(|&actor| !film.is_labelled(actor)).collect();
    assert!(others.iter().any(|&actor| film.is_main(actor)), "a vehicle right behind the ego that does not collide");
    for actor in 0..film.actors.len() {
        let label = format!(">{} ", film.vehicle_label(actor));
        assert_eq!(text.contains(&label), !others.contains(&actor), "{label}");
    }
}

#[test]
fn a_still_is_narrow_enough_for_a_phone_and_names_a_vehicle_of_the_background_that_collides() {
    let mut films = films("traffic/busy-overtake", &[ControllerChoice::ACC]);
    let film = &mut films[0];
    let text = still(film);
    let width: f64 = text.split("viewBox=\"0 0 ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(width <= 360.0 && text.contains("m/s</text>"), "{width}");
    // A vehicle of the background drives right behind the ego.
    let index = film.frames.len() / 2;
    let is_there = |actor: &usize| !film.is_main(*actor) && film.is_present(*actor, index);
    let other = (0..film.actors.len()).find(is_there).unwrap();
    let name = film.actors[other].name.clone();
    let [s_m, d_m] = [film.frames[index].states[film.ego].s_m, film.frames[index].states[film.ego].d_m];
    film.frames[index].states[other].s_m = s_m - 9.0;
    film.frames[index].states[other].d_m = d_m;
    let drawn = |film: &Film| {
        let mut svg = svg::Svg::new([560.0, 330.0]);
        let area = svg::Area { left: 10.0, top: 46.0, width: 540.0, height: 96.0 };
        strip::draw(&mut svg, film, None, index, area, [-65.0, 75.0]);
        svg.finish()
    };
    let label = format!(">{name} ");
    assert!(!drawn(film).contains(&label), "{label}");
    let ids = [film.actors[film.ego].name.as_str(), name.as_str()].map(|name| ActorId::new(name).unwrap());
    let collision = Collision {
        time: film.frames[index].time,
        between: ids,
        struck_side: [BoxSide::Rear, BoxSide::Front],
        closed_by: ClosedBy::Second,
        phase: Phase::Critical,
        relative_speed_mps: 5.0,
        delta_v_mps: [2.5; 2],
    };
    film.outcome.as_mut().unwrap().collisions = vec![collision];
    assert!(film.collides(other) && film.collides(film.ego), "{name}");
    assert!(drawn(film).contains(&label), "{}", drawn(film));
    // The sentence of a card names it, and so does the picture.
    let ego = film.ego;
    for frame in &mut film.frames[index..] {
        let [s_m, d_m] = [frame.states[ego].s_m, frame.states[ego].d_m];
        frame.states[other].s_m = s_m - 9.0;
        frame.states[other].d_m = d_m;
    }
    let label = format!(">{name}</text>");
    let with_collision = card(&films, "closecall replay . 0");
    assert_eq!(with_collision.matches(&label).count(), 1, "{with_collision}");
    films[0].outcome.as_mut().unwrap().collisions.clear();
    assert!(!card(&films, "closecall replay . 0").contains(&label));
}
