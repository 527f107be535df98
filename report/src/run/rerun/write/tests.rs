use std::collections::{BTreeMap, BTreeSet};

use arrow::array::AsArray;
use arrow::datatypes::{Float32Type, Float64Type, UInt16Type, UInt32Type};
use closecall_controllers::{EgoCommand, Reason};
use closecall_recorded::encounter::{Lead, encounter};
use closecall_recorded::filters::smooth;
use closecall_recorded::lane_change::detect;
use closecall_scenarios::sampling::Design;
use closecall_sensors::SensorMode;
use closecall_traffic::geometry::BoxSide;
use rerun::log::Chunk;
use rerun::{StoreKind, TimelineName};

use super::super::stream::{OPENING_TIMELINE, STEP_TIMELINE, TIME_TIMELINE};
use super::*;
use crate::run::film::{EncounterComparison, FilmRecorder, NO_CLUSTER, Scan, film_encounter};
use closecall_campaign::runner::{Sampling, concrete};
use closecall_scenarios::outcome::{ClosedBy, Collision, Phase};
use closecall_scenarios::{RearDriver, ScenarioFile, reenact};
use closecall_simulation::controller::ControllerChoice;
use closecall_simulation::trajectories::TrafficRecorder;
use closecall_simulation::{Arm, CONTROL_STEP, RunKey, simulate};
use closecall_studies::attribution::attribute;
use closecall_studies::case::Case;

mod whole_image;

fn library(name: &str) -> ScenarioFile {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
    ScenarioFile::load(&folder.join(format!("{name}.toml")), &[]).unwrap()
}

/// Returns the film of one sample of a library scenario.
fn filmed(name: &str, controller: ControllerChoice, sensors: Option<SensorMode>, level: Level) -> Film {
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 1 };
    let scenario = concrete(&library(name), sampling, 0).unwrap();
    let arm = Arm { controller: controller.factory(), sensors };
    let key = RunKey { seed: 1, sample: 0 };
    let mut recorder = FilmRecorder::new(&scenario, key, &arm, level);
    let outcome = simulate(&scenario, key, &arm, &mut recorder).unwrap();
    recorder.finish(&outcome)
}

fn default_film() -> Film {
    filmed("low-thw-overtake", ControllerChoice::MIS, None, Level::Full)
}

/// Returns the films of an encounter in simulated traffic, used as recorded traffic, and of its
/// re-enactment with the MIS.
fn recorded_and_simulated(level: Level) -> [Film; 2] {
    let (sampling, key) = (Sampling { seed: 1, design: Design::Random, samples: 1 }, RunKey { seed: 1, sample: 0 });
    let arm = |controller: ControllerChoice| Arm { controller: controller.factory(), sensors: None };
    let scenario = concrete(&library("overtake-without-brake"), sampling, 0).unwrap();
    let mut traffic = TrafficRecorder::default();
    traffic.begin(&scenario);
    simulate(&scenario, key, &arm(ControllerChoice::ACC), &mut traffic).unwrap();
    let recording = smooth(&traffic.finish("own"));
    let changes = detect(&recording);
    let encounter = encounter(&recording, &changes[0], &changes, CONTROL_STEP, Lead::Required).unwrap();
    let again = reenact(&encounter, RearDriver::Model, Path::new("own"), &[]).unwrap();
    let again = again.concrete(&again.space().nominal()).unwrap();
    let mut recorder = FilmRecorder::new(&again, key, &arm(ControllerChoice::MIS), level);
    let outcome = simulate(&again, key, &arm(ControllerChoice::MIS), &mut recorder).unwrap();
    let (recorded, simulated) = (film_encounter(&encounter, level).unwrap(), recorder.finish(&outcome));
    let foreword =
        EncounterComparison::new(&encounter, &recorded, &simulated).markdown(&encounter, &simulated, RearDriver::Model);
    [recorded.with_foreword(foreword), simulated]
}

fn chunks(films: &[Film], kind: StoreKind) -> Vec<Chunk> {
    record(films).unwrap().take_chunks(kind)
}

/// Returns the latest moment on a timeline (ns).
fn latest_ns(chunks: &[Chunk], timeline: &'static str) -> i64 {
    let timeline = TimelineName::from_static_str(timeline);
    let columns = chunks.iter().filter_map(|chunk| chunk.timelines().get(&timeline));
    columns.map(|column| column.time_range().max().as_i64()).max().unwrap()
}

/// Returns all texts of a component of the blueprint.
fn texts(chunk: &Chunk, component: &str) -> Vec<String> {
    let mut texts = Vec::new();
    for list in chunk.components().values().filter(|column| column.descriptor.component.as_str() == component) {
        let values = list.list_array.values();
        let strings = values.as_any().downcast_ref::<arrow::array::StringArray>();
        texts.extend(strings.into_iter().flat_map(|strings| strings.iter().flatten().map(str::to_owned)));
    }
    texts
}

/// Returns the number of views, the entities that a view shows but the recording lacks, and the
/// timelines that the blueprint selects.
fn empty_views(films: &[Film]) -> (usize, Vec<String>, Vec<String>) {
    let data = chunks(films, StoreKind::Recording);
    let entities: BTreeSet<String> = data.iter().map(|chunk| chunk.entity_path().to_string()).collect();
    let has = |path: &str| {
        // An origin may lack the slash at its start.
        let path = format!("/{}", path.trim_start_matches('/'));
        entities.iter().any(|entity| *entity == path || entity.starts_with(&format!("{path}/")))
    };
    let (mut views, mut empty, mut timelines) = (0, Vec::new(), Vec::new());
    for chunk in chunks(films, StoreKind::Blueprint) {
        let origins = texts(&chunk, "ViewBlueprint:space_origin");
        views += origins.len();
        let queries = texts(&chunk, "ViewContents:query");
        let inherited = |query: &&String| query.contains("$origin");
        let named = queries.iter().filter(|query| !inherited(query)).flat_map(|query| query.split_whitespace());
        let named = named.map(|query| query.trim_start_matches('+').trim_end_matches("/**").to_owned());
        let rootless = |origin: &String| origin != "/";
        empty.extend(origins.into_iter().filter(rootless).chain(named).filter(|entity| !has(entity)));
        timelines.extend(texts(&chunk, "TimePanelBlueprint:timeline"));
    }
    (views, empty, timelines)
}

#[test]
fn every_scenario_of_the_library_fills_every_view_at_every_level() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let names = files.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    for name in names.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()) {
        for (level, least) in [(Level::Events, 7), (Level::Objects, 9), (Level::Full, 9)] {
            let films = [filmed(&name, ControllerChoice::MIS, Some(SensorMode::Object), level)];
            let (views, empty, timelines) = empty_views(&films);
            assert!(views >= least && empty.is_empty(), "{name}, {level:?}: {views} views, no entity at {empty:?}");
            assert_eq!(timelines, [OPENING_TIMELINE], "{name}, {level:?}");
        }
    }
}

#[test]
fn vehicles_of_any_name_have_entities_of_their_own() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/library");
    let path = folder.join("low-thw-overtake.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let names = [("\"front\"", "\"commanded\""), ("\"rear\"", "\"Ego\"")];
    let text = names.into_iter().fold(text, |text, (own, other)| text.replace(own, other));
    let file = ScenarioFile::parse(&path, &text, &[]).unwrap();
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 1 };
    let scenario = concrete(&file, sampling, 0).unwrap();
    let (arm, key) =
        (Arm { controller: ControllerChoice::MIS.factory(), sensors: None }, RunKey { seed: 1, sample: 0 });
    let mut recorder = FilmRecorder::new(&scenario, key, &arm, Level::Full);
    let outcome = simulate(&scenario, key, &arm, &mut recorder).unwrap();
    let data = chunks(&[recorder.finish(&outcome)], StoreKind::Recording);
    let has = |entity: &str| data.iter().any(|chunk| chunk.entity_path().to_string() == entity);
    for name in ["ego", "Ego", "commanded", "commanded/ego"] {
        assert!(has(&format!("/mis/plots/acceleration/{name}")), "{name}");
    }
    // A curve has one row for each time, so that no other curve has its entity.
    let rows = |name: &str| {
        let of_curve = |chunk: &&Chunk| chunk.entity_path().to_string() == format!("/mis/plots/acceleration/{name}");
        data.iter().filter(of_curve).map(Chunk::num_rows).max().unwrap()
    };
    assert_eq!(rows("commanded"), rows("ego"));
}

#[test]
fn a_pair_fills_every_view_and_shows_the_baseline_as_ghosts() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Objects);
    let films = [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    let (views, empty, _) = empty_views(&films);
    assert!(views >= 13 && empty.is_empty(), "{views} views, no entity at {empty:?}");
    let data = chunks(&films, StoreKind::Recording);
    for entity in ["/mis/world/ghosts/ego", "/mis/bird/ghosts", "/acc/world/ego/collision_1", "/mis/plots/margin/goal"]
    {
        assert!(data.iter().any(|chunk| chunk.entity_path().to_string() == entity), "{entity}");
    }
}

#[test]
fn recorded_and_simulated_traffic_share_timelines_and_are_ghosts_of_each_other() {
    for (level, least) in [(Level::Events, 8), (Level::Objects, 11), (Level::Full, 11)] {
        let films = recorded_and_simulated(level);
        let (views, empty, timelines) = empty_views(&films);
        assert!(views >= least && empty.is_empty(), "{level:?}: {views} views, no entity at {empty:?}");
        assert_eq!(timelines, [OPENING_TIMELINE], "{level:?}");
    }
    let films = recorded_and_simulated(Level::Objects);
    let data = chunks(&films, StoreKind::Recording);
    let chunks_under = |root: &str| -> Vec<Chunk> {
        data.iter().filter(|chunk| chunk.entity_path().to_string().starts_with(root)).cloned().collect()
    };
    let halves = [chunks_under("/recorded/"), chunks_under("/mis/")];
    for timeline in [TIME_TIMELINE, STEP_TIMELINE] {
        let [recorded, simulated] = [&halves[0], &halves[1]].map(|half| latest_ns(half, timeline));
        // The last state stays for one period; the recording may end a period earlier than the run.
        let period = if timeline == STEP_TIMELINE { 1 } else { films[1].period.ns() };
        assert!((recorded - simulated).abs() <= period, "{timeline}: {recorded} {simulated}");
    }
    assert!(halves.iter().all(|half| latest_ns(half, OPENING_TIMELINE) > 0));
    for entity in ["/recorded/world/ghosts/ego", "/mis/world/ghosts/rear", "/recorded/bird/ghosts", "/mis/bird/ghosts"]
    {
        assert!(data.iter().any(|chunk| chunk.entity_path().to_string() == entity), "{entity}");
    }
    let verdict = summary::verdict(&films);
    assert!(verdict.starts_with("**Recorded, and with MIS**") && verdict.contains("- **recorded: "), "{verdict}");
}

#[test]
fn full_sensors_show_points_boxes_ground_truth_and_images() {
    let films = [filmed("low-thw-overtake", ControllerChoice::MIS, Some(SensorMode::Full), Level::Full)];
    let data = chunks(&films, StoreKind::Recording);
    let entities = [
        "/mis/world/ego/lidar/clusters",
        "/mis/world/ego/lidar/intensity",
        "/mis/world/ego/lidar/rejected",
        "/mis/world/ego/lidar/boxes",
        "/mis/world/ego/tracks/rear/covariance",
        "/mis/world/ego/truth/known",
        "/mis/world/ego/truth/missed",
        "/mis/world/ego/truth/false_tracks",
        "/mis/world/ego/camera",
        "/mis/world/ego/camera/windows",
    ];
    for entity in entities {
        assert!(data.iter().any(|chunk| chunk.entity_path().to_string() == entity), "{entity}");
    }
    let (_, empty, _) = empty_views(&films);
    assert!(empty.is_empty(), "{empty:?}");
    assert!(encoded(&films).len() < 25_000_000);
}

#[test]
fn every_lidar_has_its_points_and_boxes_where_it_looks() {
    let text = "base = \"low-thw-overtake\"\nname = \"three\"\nduration-s = 3.0\nsensors.mode = \"full\"\n\
                sensors.rear-camera.pipeline = \"off\"\nsensors.front-lidar.name = \"nose\"\n\
                sensors.additional-rear-lidars = [{ name = \"left\", left-m = 0.8, azimuth-deg = 45.0 }]\n";
    let films = [filmed_text(text, Level::Full)];
    let data = chunks(&films, StoreKind::Recording);
    for root in ["lidar", "lidars/nose", "lidars/left"] {
        for layer in ["clusters", "intensity", "rejected", "boxes"] {
            let entity = format!("/mis/world/ego/{root}/{layer}");
            assert!(data.iter().any(|chunk| chunk.entity_path().to_string() == entity), "{entity}");
        }
    }
    let frames = &films[0].frames;
    let scans_of = |name: &str| -> Vec<&Scan> {
        frames
            .iter()
            .flat_map(|frame| &frame.other_scans)
            .filter(|(other, _)| *other == name)
            .map(|(_, scan)| scan)
            .collect()
    };
    // The lead vehicle and its box are ahead. The corner sensor sees more of its own side.
    assert!(scans_of("nose").iter().any(|scan| !scan.boxes.is_empty()));
    assert!(scans_of("nose").iter().all(|scan| scan.points_m().all(|[x, ..]| x > 0.0)));
    assert!(
        scans_of("nose")
            .iter()
            .flat_map(|scan| &scan.boxes)
            .all(|detection| detection.centre_m().0 > detection.face_x_m)
    );
    let left = scans_of("left").iter().flat_map(|scan| scan.points_m()).filter(|[_, y, _]| *y > 0.8).count();
    let all = scans_of("left").iter().map(|scan| scan.points_m().count()).sum::<usize>();
    assert!(all > 500 && 3 * left > 2 * all, "{left} of {all}");
    let (_, empty, _) = empty_views(&films);
    assert!(empty.is_empty(), "{empty:?}");
    assert!(frames.iter().all(|frame| frame.rear_fields.len() == 2));
}

#[test]
fn every_camera_has_its_pictures_and_a_view() {
    let text = "base = \"low-thw-overtake\"\nname = \"two\"\nduration-s = 3.0\nsensors.mode = \"full\"\n\
                sensors.additional-rear-cameras = [{ name = \"tele\", field-of-view-deg = 25.0, left-m = 0.5 }]\n";
    let films = [filmed_text(text, Level::Full)];
    let data = chunks(&films, StoreKind::Recording);
    for root in ["camera", "cameras/tele"] {
        for layer in ["", "/windows", "/labels"] {
            let entity = format!("/mis/world/ego/{root}{layer}");
            assert!(data.iter().any(|chunk| chunk.entity_path().to_string() == entity), "{entity}");
        }
    }
    let layout = chunks(&films, StoreKind::Blueprint);
    let origins: Vec<String> = layout.iter().flat_map(|chunk| texts(chunk, "ViewBlueprint:space_origin")).collect();
    assert!(origins.iter().any(|origin| origin.ends_with("world/ego/cameras/tele")), "{origins:?}");
    let (_, empty, _) = empty_views(&films);
    assert!(empty.is_empty(), "{empty:?}");
}

/// Returns the film of a short run behind which a car drives, in mode `full` with these keys.
fn filmed_with(keys: &str) -> Film {
    let text = format!(
        "base = \"low-thw-overtake\"\nname = \"radars\"\nduration-s = 4.0\nsensors.mode = \"full\"\n\
         sensors.rear-camera.pipeline = \"off\"\nroad.guard-rails = true\n{keys}"
    );
    filmed_text(&text, Level::Objects)
}

/// Returns the film of the nominal run of a scenario with this text.
fn filmed_text(text: &str, level: Level) -> Film {
    let file = ScenarioFile::parse(Path::new("own.toml"), text, &[]).unwrap();
    let scenario = file.concrete(&file.space().nominal()).unwrap();
    let arm = Arm { controller: ControllerChoice::MIS.factory(), sensors: None };
    let key = RunKey { seed: 1, sample: 0 };
    let mut recorder = FilmRecorder::new(&scenario, key, &arm, level);
    let outcome = simulate(&scenario, key, &arm, &mut recorder).unwrap();
    recorder.finish(&outcome)
}

#[test]
fn rear_radars_have_points_with_radial_speeds_and_ghosts_are_no_vehicles() {
    let radar = "sensors.rear-radar = { range-m = 300, detection-probability = 1.0, ghost-probability = 1.0 }\n";
    let films = [filmed_with(radar)];
    let data = chunks(&films, StoreKind::Recording);
    for (index, side) in ["left", "right"].into_iter().enumerate() {
        let entity = format!("/mis/world/ego/radars/{side}");
        let (mut speeds_mps, mut exists, mut units) = (Vec::new(), Vec::new(), Vec::new());
        let time = TimelineName::from_static_str(TIME_TIMELINE);
        let rows = data.iter().filter(|chunk| chunk.entity_path().to_string() == entity);
        for chunk in rows.filter(|chunk| chunk.timelines().contains_key(&time)) {
            let columns = chunk.components().values().map(|column| (column.descriptor.component.as_str(), column));
            for (name, column) in columns.collect::<BTreeMap<_, _>>() {
                let values = column.list_array.values();
                match name {
                    "radial_mps" => {
                        speeds_mps.extend_from_slice(values.as_primitive::<Float64Type>().values());
                        units.extend(column.descriptor.component_type.map(|unit| unit.as_str().to_owned()));
                    }
                    "exists" => exists.extend(values.as_boolean().iter().flatten()),
                    _ => {}
                }
            }
        }
        let returns = films[0].frames.iter().filter_map(|frame| Some(&frame.radar_returns.as_ref()?[index]));
        let returns: Vec<_> = returns.flatten().collect();
        assert_eq!(speeds_mps, returns.iter().map(|one| one.measured.radial_mps).collect::<Vec<_>>(), "{side}");
        assert_eq!(exists, returns.iter().map(|one| one.source.exists()).collect::<Vec<_>>(), "{side}");
        assert!(exists.contains(&true) && exists.contains(&false), "{side}: {exists:?}");
        assert_eq!(units, ["m/s"], "{side}");
    }
    let has = |data: &[Chunk], entity: &str| data.iter().any(|chunk| chunk.entity_path().to_string() == entity);
    assert!(has(&data, "/states/7_rear_radars/with_MIS"), "their ghosts are no fault");
    let without = chunks(&[filmed_with("")], StoreKind::Recording);
    assert!(!has(&without, "/states/7_rear_radars/with_MIS") && !has(&without, "/mis/world/ego/radars/left"));
}

#[test]
fn the_states_name_the_fault_of_a_radar_and_when_the_ego_notices_it() {
    let radar = "sensors.rear-radar = {}\n[[fault.rear-radar]]\nside = \"left\"\ndead = true\nfrom-s = 1.0\n";
    let data = chunks(&[filmed_with(radar)], StoreKind::Recording);
    let rows = data.iter().filter(|chunk| chunk.entity_path().to_string() == "/states/2_rear_radars/with_MIS");
    let states: Vec<String> = rows.flat_map(|chunk| texts(chunk, "StateChange:state")).collect();
    let states: Vec<&str> = states.iter().filter(|state| !state.is_empty()).map(String::as_str).collect();
    let fault = "rear radar `left` dead";
    let begins = ["healthy".to_owned(), format!("faulty, not noticed: {fault}"), format!("degraded: {fault}")];
    assert_eq!(states.len(), 3, "{states:?}");
    for (state, begin) in states.iter().zip(&begins) {
        assert!(state.starts_with(begin.as_str()), "{states:?}");
    }
}

#[test]
fn the_states_give_the_reason_for_which_a_sensor_is_degraded() {
    let data = chunks(&[filmed_with("[[fault.rear-lidar]]\ndelay-s = 0.2\nfrom-s = 1.0\n")], StoreKind::Recording);
    let rows = data.iter().filter(|chunk| chunk.entity_path().to_string() == "/states/2_rear_sensors/with_MIS");
    let states: Vec<String> = rows.flat_map(|chunk| texts(chunk, "StateChange:state")).collect();
    let states: Vec<&str> = states.iter().filter(|state| !state.is_empty()).map(String::as_str).collect();
    let fault = "rear LiDAR late by 0.20 s";
    let begins = [
        "healthy".to_owned(),
        format!("faulty, not noticed: {fault}"),
        format!("degraded, as time stamps do not fit the times of arrival: {fault}"),
    ];
    assert_eq!(states.len(), 3, "{states:?}");
    for (state, begin) in states.iter().zip(&begins) {
        assert!(state.starts_with(begin.as_str()), "{states:?}");
    }
}

#[test]
fn all_timelines_span_the_run_and_the_opening_one_begins_with_the_critical_moment() {
    let films = [default_film()];
    let chunks = chunks(&films, StoreKind::Recording);
    let (film, end) = (&films[0], films[0].end());
    let after_end = end + film.period;
    for timeline in [TIME_TIMELINE, OPENING_TIMELINE] {
        assert_eq!(latest_ns(&chunks, timeline), after_end.ns(), "{timeline}");
    }
    assert_eq!(latest_ns(&chunks, STEP_TIMELINE), after_end.ns() / film.period.ns());
    let opening = TimelineName::from_static_str(OPENING_TIMELINE);
    let copy = (Time::ZERO - film.period).ns();
    let is_copy = |chunk: &&Chunk| chunk.timelines().get(&opening).is_some_and(|times| times.times_raw() == [copy]);
    let copies: Vec<&Chunk> = chunks.iter().filter(is_copy).collect();
    assert!(copies.len() > 10, "{} copies", copies.len());
    // The copy is on the opening timeline alone, and equals the row of the critical moment.
    assert!(copies.iter().all(|chunk| chunk.timelines().len() == 1));
    let clock = copies.iter().find(|chunk| chunk.entity_path().to_string() == "/mis/bird/clock").unwrap();
    let text = format!("with MIS · {:.2} s", film.critical_frame_time().s());
    assert_eq!(texts(clock, "Points2D:labels"), [text]);
}

/// Returns the bytes of the recording of the films.
fn encoded(films: &[Film]) -> Vec<u8> {
    let recording = record(films).unwrap();
    recording.complete().unwrap();
    let mut bytes = Vec::new();
    recording.encode(&mut bytes).unwrap();
    bytes
}

#[test]
fn the_same_films_give_the_same_rows_and_other_films_another_name() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Objects);
    let pair = || [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    for kind in [StoreKind::Blueprint, StoreKind::Recording] {
        let [first, second] = [chunks(&pair(), kind), chunks(&pair(), kind)];
        assert_eq!(first.len(), second.len());
        for (first, second) in first.iter().zip(&second) {
            // Everything except the numbers of chunks and rows, which follow the clock.
            Chunk::ensure_similar(first, second).unwrap();
        }
    }
    let name = |films: &[Film]| record(films).unwrap().name();
    let [baseline, tested] = pair();
    let alone = std::slice::from_ref(&tested);
    assert_eq!(name(alone), name(alone));
    assert_ne!(name(&[baseline]), name(&[tested]));
}

#[test]
fn what_holds_for_the_whole_run_precedes_what_changes() {
    let data = chunks(&[default_film()], StoreKind::Recording);
    let fixed = data.iter().take_while(|chunk| chunk.is_static()).count();
    assert!(fixed > 10 && data[fixed..].iter().all(|chunk| !chunk.is_static()));
    assert!(data.len() > fixed + 10);
}

#[cfg(target_os = "linux")]
#[test]
fn the_threads_of_recordings_end() {
    const RECORDINGS: usize = 200;
    for _ in 0..RECORDINGS {
        Recording::new("closecall-test", "empty").unwrap().encode(std::io::sink()).unwrap();
    }
    // A stream has two threads. Other tests run beside this one.
    let threads = std::fs::read_dir("/proc/self/task").unwrap().count();
    assert!(threads < 2 * RECORDINGS, "{threads}");
}

#[test]
fn a_collision_has_a_line_in_each_plot_a_row_of_states_and_properties() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Events);
    let films = [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    let data = chunks(&films, StoreKind::Recording);
    let has = |entity: &str| data.iter().any(|chunk| chunk.entity_path().to_string() == entity);
    for plot in ["headway", "acceleration", "speed", "gap", "ttc", "encounter"] {
        assert!(has(&format!("/acc/plots/{plot}/collisions/1")), "{plot}");
        assert!(!has(&format!("/mis/plots/{plot}/collisions/1")), "{plot}");
    }
    assert!(has("/states/4_collisions/without_MIS") && !has("/states/4_collisions/with_MIS"));
    assert!(has("/states/2_reason/with_MIS") && !has("/states/2_reason/without_MIS"));
    assert!(has("/__properties/arms/acc/collision_1") && !has("/__properties/arms/mis/collision_1"));
}

#[test]
fn a_vehicle_is_out_of_sight_while_the_ego_does_not_believe_in_its_track() {
    let (sampling, key) = (Sampling { seed: 77, design: Design::Random, samples: 24 }, RunKey { seed: 77, sample: 23 });
    let scenario = concrete(&library("rear-vehicle-is-followed"), sampling, key.sample).unwrap();
    let arm = Arm { controller: ControllerChoice::MIS.factory(), sensors: None };
    let mut recorder = FilmRecorder::new(&scenario, key, &arm, Level::Events);
    let outcome = simulate(&scenario, key, &arm, &mut recorder).unwrap();
    let film = recorder.finish(&outcome);
    let (sentence, sight) = (film.sentence().unwrap().to_string(), film.sight().unwrap());
    assert!(sentence.contains("not sooner: vehicle behind not seen in the lane, 2.9 to 4.6 s"), "{sentence}");
    assert!(sight.ends_with(" It was lost 2 times, first from 0.72 to 4.56 s."), "{sight}");
}

#[test]
fn a_vehicle_that_the_second_scan_shows_is_seen_from_the_start() {
    let film = filmed("paper-figure", ControllerChoice::MIS, None, Level::Events);
    assert!(film.frames[0].rear_seen.is_empty(), "the first scan shows it");
    let sight = film.sight().unwrap();
    assert!(sight.starts_with("R was seen behind from the start ("), "{sight}");
}

#[test]
fn a_reason_that_holds_from_the_start_to_the_end_has_its_row() {
    let film = filmed("empty-wet-road", ControllerChoice::MIS, Some(SensorMode::GroundTruth), Level::Events);
    let has_none_behind = |command: EgoCommand| command.reason == Reason::NoRear;
    assert!(film.frames.iter().all(|frame| frame.command.is_some_and(has_none_behind)));
    let data = chunks(&[film], StoreKind::Recording);
    assert!(data.iter().any(|chunk| chunk.entity_path().to_string() == "/states/2_reason/with_MIS"));
}

#[test]
fn each_collision_has_the_answer_of_an_explanation_by_whom_it_was_avoidable() {
    let film = filmed("paper-figure", ControllerChoice::ACC, None, Level::Events);
    let case = Case {
        file: library("paper-figure"),
        sampling: Sampling { seed: 1, design: Design::Random, samples: 1 },
        sample: 0,
        arm: Arm { controller: ControllerChoice::ACC.factory(), sensors: None },
        parameters: None,
        reference: None,
    };
    let (_, attribution) = attribute(&case, &[]).unwrap();
    let answer = attribution.unwrap().avoidable;
    assert!(answer.careful_in_striking.is_some(), "a front struck a rear: {answer:?}");
    assert_eq!((film.avoidable.len(), film.avoidable[0]), (film.collisions().len(), Some(answer)));
    let words: Vec<String> = film.avoidable.iter().flatten().map(|avoidable| avoidable.words().to_owned()).collect();
    let data = chunks(&[film], StoreKind::Recording);
    let of = |number: usize| -> Vec<String> {
        let path = format!("/__properties/arms/acc/collision_{number}");
        let rows = data.iter().filter(|chunk| chunk.entity_path().to_string() == path);
        rows.flat_map(|chunk| texts(chunk, "avoidable_by")).collect()
    };
    for (index, words) in words.iter().enumerate() {
        assert_eq!(of(index + 1), std::slice::from_ref(words));
    }
    assert!(of(words.len() + 1).is_empty());
    let passes = filmed("paper-figure", ControllerChoice::MIS, None, Level::Events);
    assert!(passes.avoidable.is_empty() && passes.collisions().is_empty());
}

#[test]
fn each_of_two_collisions_is_readable_in_the_row_of_states() {
    let mut film = filmed("paper-figure", ControllerChoice::ACC, None, Level::Events);
    let first = film.worst_collision().unwrap().clone();
    let lead =
        library("paper-figure").config().actors.iter().map(|actor| actor.id.clone()).find(|id| !first.involves(id));
    let ego = film.outcome().unwrap().ego.clone();
    let second = Collision {
        time: first.time + Time::from_ms(640),
        between: [ego, lead.unwrap()],
        struck_side: [BoxSide::Front, BoxSide::Rear],
        closed_by: ClosedBy::First,
        ..first.clone()
    };
    let expected = format!("none until R → E at {:.1} s, then E → F at {:.1} s", first.time.s(), second.time.s());
    film.outcome.as_mut().unwrap().collisions = vec![first, second];
    let data = chunks(&[film], StoreKind::Recording);
    let of = |component: &str| -> Vec<String> {
        let row = data.iter().filter(|chunk| chunk.entity_path().to_string() == "/states/4_collisions/without_MIS");
        row.flat_map(|chunk| texts(chunk, component)).collect()
    };
    let (labels, values) = (of("StateConfiguration:labels"), of("StateConfiguration:values"));
    assert!(labels.contains(&expected), "{labels:?}");
    assert!(
        values.iter().any(|value| value.contains("R struck E") && value.contains(", then E struck F")),
        "{values:?}"
    );
}

#[test]
fn both_halves_of_a_pair_open_at_the_same_moment() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Objects);
    let films = [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    let shown = films[0].worst_collision().unwrap().time;
    assert!(films[1].critical_moment() != shown, "the moments of the arms differ");
    let opening = TimelineName::from_static_str(OPENING_TIMELINE);
    let copy = (Time::ZERO - films[0].period).ns();
    let data = chunks(&films, StoreKind::Recording);
    let clocks: Vec<String> = ["/acc/bird/clock", "/mis/bird/clock"]
        .into_iter()
        .flat_map(|entity| {
            let is_copy = |chunk: &&Chunk| {
                chunk.entity_path().to_string() == entity
                    && chunk.timelines().get(&opening).is_some_and(|times| times.times_raw() == [copy])
            };
            texts(data.iter().find(is_copy).unwrap(), "Points2D:labels")
        })
        .collect();
    let time = format!("{:.2} s", films[0].critical_frame_time().s());
    assert_eq!(clocks, [format!("without MIS · {time}"), format!("with MIS · {time}")]);
}

#[test]
fn without_a_vehicle_behind_the_smallest_front_headway_is_the_critical_moment() {
    let film = filmed("acc/acc-lead-slows", ControllerChoice::ACC, None, Level::Events);
    assert!(film.worst_collision().is_none() && film.frames.iter().all(|frame| frame.margins.thw_rear_s.is_err()));
    let headways_s = film.frames.iter().filter_map(|frame| frame.margins.thw_front_s.ok());
    let smallest_s = headways_s.reduce(f64::min).unwrap();
    let critical = film.critical_moment();
    let shown_s = film.frame_at(critical).unwrap().margins.thw_front_s.unwrap();
    assert!(shown_s <= smallest_s && critical < film.end(), "{shown_s} s at {critical:?}, smallest {smallest_s} s");
}

#[test]
fn a_half_that_ends_shortly_before_the_critical_moment_sets_the_moment_of_both() {
    let film = filmed("overtake-without-brake", ControllerChoice::MIS, None, Level::Objects);
    assert!(film.worst_collision().is_none());
    let critical = film.critical_frame_time();
    let ended = |before: Time| {
        let mut early = film.clone();
        early.frames.retain(|frame| frame.time + before <= critical);
        early
    };
    let early = ended(Time::from_ms(240));
    let films = [early.clone(), film.clone()];
    assert_eq!(Film::shown_moment(&films), early.end());
    let much_earlier = [ended(Time::from_ms(4_000)), film.clone()];
    assert_eq!(Film::shown_moment(&much_earlier), critical, "the critical moment is shown");
    let clock = |films: &[Film; 2]| -> Vec<String> {
        let canvases = bird::Canvas::of_films(films);
        canvases.iter().map(|canvas| bird::clock_text(canvas, canvas.film.end())).collect()
    };
    let expected =
        [format!("with MIS · ended {:.2} s", early.end().s()), format!("with MIS · {:.2} s", film.end().s())];
    assert_eq!(clock(&films), expected);
}

#[test]
fn a_fault_is_in_the_verdict_and_in_the_states_of_its_sensor() {
    let film = |name| filmed(name, ControllerChoice::MIS, None, Level::Events);
    for (fault, words, row) in [
        ("faults/lidar-dead", "rear LiDAR dead", "2_rear_sensors"),
        ("faults/front-radar-ghost", "a vehicle that does not exist", "2_front_sensor"),
        ("faults/map-curvature", "map with wrong curvature", "2_odometry_and_map"),
    ] {
        let films = [film(fault)];
        let verdict = summary::verdict(&films);
        assert!(verdict.contains("faults: ") && verdict.contains(words), "{verdict}");
        let data = chunks(&films, StoreKind::Recording);
        let entity = format!("/states/{row}/with_MIS");
        let states: Vec<String> = data
            .iter()
            .filter(|chunk| chunk.entity_path().to_string() == entity)
            .flat_map(|chunk| texts(chunk, "StateConfiguration:values"))
            .collect();
        assert!(states.iter().any(|state| state.starts_with("failed") || state.starts_with("faulty")), "{states:?}");
        assert!(states.iter().any(|state| state.contains(words)), "{states:?}");
    }
    let healthy = summary::verdict(&[default_film()]);
    assert!(healthy.contains("faults: none"), "{healthy}");
}

#[test]
fn the_verdict_on_a_pair_is_its_first_word() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Events);
    let [baseline, tested] = [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    let first = |films: &[Film]| summary::verdict(films).lines().next().unwrap_or_default().to_owned();
    let sample = " · paper-figure · seed 1 · sample 0";
    assert_eq!(first(&[baseline.clone(), tested.clone()]), format!("**PREVENTED{sample}**"));
    assert_eq!(first(&[tested.clone(), baseline.clone()]), format!("**INDUCED{sample}**"));
    assert_eq!(first(&[baseline.clone(), baseline.clone()]), format!("**BOTH COLLIDE{sample}**"));
    assert_eq!(first(&[tested.clone(), tested.clone()]), format!("**NEITHER COLLIDES{sample}**"));
    let text = summary::verdict(&[baseline, tested]);
    assert!(text.contains("- **without MIS: R struck E from behind at "), "{text}");
    assert!(text.contains(" s after F braked"), "{text}");
    assert!(text.contains("- **with MIS: no vehicle collided; F braked at "), "{text}");
    assert!(text.contains("; the MIS engaged for R at ") && text.contains("; faults: none**\n"), "{text}");
    let headways = text.lines().find(|line| line.starts_with("- **Smallest headway: front ")).unwrap();
    assert!(headways.contains("; without MIS: front "), "{headways}");
}

#[test]
fn every_line_of_verdict_and_story_is_in_the_strong_colour() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Events);
    let films = [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    for page in [summary::verdict(&films), summary::story(&films)] {
        for line in page.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
            match line.strip_prefix('|') {
                Some(_) if line.starts_with("| ---") => {}
                Some(cells) => {
                    let cells: Vec<&str> = cells.trim_end_matches('|').split('|').map(str::trim).collect();
                    assert_eq!(cells.len(), 2, "{line}");
                    assert!(cells.iter().all(|cell| cell.starts_with("**") && cell.ends_with("**")), "{line}");
                }
                None => {
                    let text = line.trim_start_matches("- ");
                    assert!(text.starts_with("**") && text.ends_with("**"), "{line}");
                    assert_eq!(text.matches("**").count(), 2, "{line}");
                }
            }
        }
    }
}

/// The narrowest curve that has a pixel in its full colour (UI points): the edges fade over one pixel.
const LEAST_WIDTH: f32 = 2.0;

#[test]
fn no_curve_is_so_thin_that_its_colour_fades() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Events);
    let data = chunks(&[film(ControllerChoice::ACC), film(ControllerChoice::MIS)], StoreKind::Recording);
    let mut widths = 0;
    for chunk in &data {
        let columns = chunk.components().values();
        for column in columns.filter(|column| column.descriptor.component.as_str() == "SeriesLines:widths") {
            for width in column.list_array.values().as_primitive::<Float32Type>().values() {
                assert!(*width >= LEAST_WIDTH, "{}: {width}", chunk.entity_path());
                widths += 1;
            }
        }
    }
    assert!(widths > 20, "{widths}");
}

/// Returns the names beside the vehicles in the view from above.
fn names_from_above(data: &[Chunk]) -> Vec<String> {
    let names = data.iter().filter(|chunk| chunk.entity_path().to_string() == "/mis/bird/names");
    names.flat_map(|chunk| texts(chunk, "Points2D:labels")).collect()
}

#[test]
fn the_vehicles_next_to_the_ego_have_names_from_above_and_the_scene_shows_no_label() {
    let film = filmed("rear-vehicles-one-after-another", ControllerChoice::MIS, None, Level::Objects);
    let data = chunks(&[film], StoreKind::Recording);
    // A name beside its vehicle begins with an arrow to it.
    let labels: Vec<String> =
        names_from_above(&data).iter().map(|label| label.trim_start_matches(['←', '→', ' ']).to_owned()).collect();
    for name in ["R rear ", "second "] {
        assert!(labels.iter().any(|label| label.starts_with(name) && label.ends_with(" behind")), "{name}");
    }
    for chunk in data.iter().filter(|chunk| chunk.entity_path().to_string().contains("/world/")) {
        for column in
            chunk.components().values().filter(|column| column.descriptor.component.as_str().ends_with(":show_labels"))
        {
            assert!(
                !column.list_array.values().as_boolean().iter().flatten().any(|shown| shown),
                "{}",
                chunk.entity_path()
            );
        }
    }
}

#[test]
fn the_verdict_names_the_vehicle_that_was_seen_and_the_vehicle_of_the_engagement() {
    let film = filmed("rear-vehicles-one-after-another", ControllerChoice::MIS, None, Level::Events);
    let verdict = summary::verdict(&[film]);
    assert!(verdict.contains("the MIS engaged for R at "), "{verdict}");
    assert!(!verdict.contains("The vehicle behind was"), "{verdict}");
}

#[test]
fn the_rows_of_states_of_a_pair_end_together() {
    let film = |controller| filmed("paper-figure", controller, None, Level::Events);
    let films = [film(ControllerChoice::ACC), film(ControllerChoice::MIS)];
    assert!(films[0].end() != films[1].end(), "the arms end at different times");
    let timeline = TimelineName::from_static_str(TIME_TIMELINE);
    let data = chunks(&films, StoreKind::Recording);
    let ends: BTreeMap<String, i64> = data
        .iter()
        .filter(|chunk| chunk.entity_path().to_string().starts_with("/states/"))
        .filter_map(|chunk| {
            Some((chunk.entity_path().to_string(), *chunk.timelines().get(&timeline)?.times_raw().last()?))
        })
        .collect();
    assert!(ends.len() > 4, "{ends:?}");
    let end = (films.iter().map(Film::end).max().unwrap() + CONTROL_STEP).ns();
    assert!(ends.values().all(|&row| row == end), "{end}: {ends:?}");
}

#[test]
fn a_track_that_belongs_to_no_vehicle_is_labelled_from_above() {
    let film = filmed("faults/object-ghost", ControllerChoice::MIS, Some(SensorMode::Object), Level::Objects);
    let data = chunks(std::slice::from_ref(&film), StoreKind::Recording);
    let labels = names_from_above(&data);
    assert!(labels.iter().any(|label| label == "does not exist"), "{} labels", labels.len());
    let verdict = summary::verdict(&[film]);
    assert!(verdict.contains("the MIS engaged for a vehicle that does not exist at 2."), "{verdict}");
    for ghost in ["faults/surround-ghost", "faults/front-radar-ghost"] {
        let film = filmed(ghost, ControllerChoice::MIS, Some(SensorMode::Object), Level::Objects);
        let labels = names_from_above(&chunks(&[film], StoreKind::Recording));
        assert!(labels.iter().any(|label| label == "does not exist"), "{ghost}: {} labels", labels.len());
    }
    let truck = filmed("traffic/trucks-alongside", ControllerChoice::MIS, Some(SensorMode::Object), Level::Objects);
    let beside = names_from_above(&chunks(&[truck], StoreKind::Recording));
    assert!(!beside.iter().any(|label| label == "does not exist"), "a truck beside the ego exists");
    let healthy = chunks(&[default_film()], StoreKind::Recording);
    assert!(!healthy.iter().any(|chunk| texts(chunk, "Points2D:labels").iter().any(|label| label == "does not exist")));
}

#[test]
fn a_collision_of_the_ego_precedes_earlier_ones_of_others() {
    let mut film = default_film();
    let ids: Vec<_> = library("low-thw-overtake").config().actors.iter().map(|actor| actor.id.clone()).collect();
    let collision = |time, between: [usize; 2]| Collision {
        time,
        between: between.map(|actor| ids[actor].clone()),
        struck_side: [BoxSide::Rear, BoxSide::Front],
        closed_by: ClosedBy::Second,
        phase: Phase::Critical,
        relative_speed_mps: 5.0,
        delta_v_mps: [2.5, 2.5],
    };
    let ego = film.ego;
    let others: Vec<usize> = (0..ids.len()).filter(|&actor| actor != ego).collect();
    let mut collide = |time_ms, between| {
        if let Some(outcome) = &mut film.outcome {
            outcome.collisions.push(collision(Time::from_ms(time_ms), between));
        }
        film.clone()
    };
    let film = collide(1_000, [others[0], others[1]]);
    assert_eq!(film.critical_moment(), Time::from_ms(1_000));
    let film = collide(2_000, [ego, others[1]]);
    assert_eq!(film.critical_moment(), Time::from_ms(2_000));
    let marks = chunks(&[film], StoreKind::Recording);
    assert!(marks.iter().any(|chunk| chunk.entity_path().to_string() == "/mis/world/ego/collision_2"));
}

#[test]
fn the_file_is_complete_and_no_temporary_file_remains() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    check_recording_possible(&path).unwrap();
    assert!(!path.exists());
    write_recording_unchecked(&path, &[default_film()]).unwrap();
    assert_eq!(&std::fs::read(&path).unwrap()[..4], b"RRF2");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let error = check_recording_possible(&folder.path().join("no/folder.rrd")).unwrap_err();
    assert!(error.to_string().contains("no/folder.rrd"), "{error}");
}

/// A point as it was measured: beam, time after the start of the sweep (ns), and bits of the
/// intensity.
type Measured = (u16, u32, u32);

/// Returns the measured points of each step that a recording has in a layer.
fn measured_points(chunks: &[Chunk], entity: &str) -> BTreeMap<i64, Vec<Measured>> {
    let mut steps = BTreeMap::new();
    let timeline = TimelineName::from_static_str(STEP_TIMELINE);
    for chunk in chunks.iter().filter(|chunk| chunk.entity_path().to_string() == entity) {
        // Static values, and the copy of the critical moment, have no step.
        let Some(times) = chunk.timelines().get(&timeline) else { continue };
        let lists = |name: &str| {
            let mut columns = chunk.components().values();
            let column = columns.find(|column| column.descriptor.component.as_str() == name);
            column.unwrap_or_else(|| panic!("no {name}")).list_array.clone()
        };
        let [beams, offsets, intensities] = ["beam", "offset_ns", "intensity"].map(lists);
        for (row, &step) in times.times_raw().iter().enumerate() {
            let (beams, offsets, intensities) = (beams.value(row), offsets.value(row), intensities.value(row));
            let beams = beams.as_primitive::<UInt16Type>().values();
            let offsets = offsets.as_primitive::<UInt32Type>().values();
            let intensities = intensities.as_primitive::<Float32Type>().values();
            assert!(beams.len() == offsets.len() && beams.len() == intensities.len());
            let points = beams.iter().zip(offsets).zip(intensities);
            steps.insert(
                step,
                points.map(|((beam, offset), intensity)| (*beam, *offset, intensity.to_bits())).collect(),
            );
        }
    }
    steps
}

#[test]
fn recorded_beam_time_and_intensity_are_those_of_the_scan() {
    let films = [filmed("low-thw-overtake", ControllerChoice::MIS, Some(SensorMode::Full), Level::Full)];
    let data = chunks(&films, StoreKind::Recording);
    let film = &films[0];
    for (layer, is_clustered) in [("clusters", true), ("rejected", false)] {
        let recorded = measured_points(&data, &format!("/mis/world/ego/lidar/{layer}"));
        let mut points = 0;
        for frame in &film.frames {
            let Some(scan) = &frame.scan else { continue };
            let is_in_layer = |point: &usize| (scan.clusters[*point] != NO_CLUSTER) == is_clustered;
            let measured = |point: usize| {
                let points = &scan.points;
                (points.beam[point], points.offset_ns[point], points.intensity[point].to_bits())
            };
            let expected: Vec<Measured> = (0..scan.points.len()).filter(is_in_layer).map(measured).collect();
            let step = frame.time.ns() / film.period.ns();
            assert_eq!(recorded.get(&step), Some(&expected), "{layer}, step {step}");
            points += expected.len();
        }
        assert!(points > 1_000, "{layer}: {points}");
        let all: Vec<&Measured> = recorded.values().flatten().collect();
        let differs = |value: fn(&Measured) -> u32| all.iter().any(|point| value(point) != value(all[0]));
        assert!(differs(|point| point.0.into()) && differs(|point| point.1) && differs(|point| point.2), "{layer}");
    }
}

#[test]
fn a_recording_that_is_sent_loops_the_seconds_around_its_critical_moment_before_its_layout_is_activated() {
    use crate::run::rerun::LoopedRecording;
    use rerun::log::LogMsg;

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let film = filmed("low-thw-overtake", ControllerChoice::MIS, None, Level::Objects);
    write_recording_unchecked(&path, std::slice::from_ref(&film)).unwrap();
    let messages = LoopedRecording::read(&path).unwrap().with_loop().unwrap();
    let panels: Vec<(usize, Chunk)> = messages
        .iter()
        .enumerate()
        .filter_map(|(index, message)| match message {
            LogMsg::ArrowMsg(id, rows) if id.kind() == StoreKind::Blueprint => {
                Some((index, Chunk::from_arrow_msg(rows).unwrap()))
            }
            _ => None,
        })
        .filter(|(_, chunk)| chunk.entity_path().to_string() == "/time_panel")
        .collect();
    let activation = messages.iter().position(|message| matches!(message, LogMsg::BlueprintActivationCommand(_)));
    let [(_, of_file), (index, sent)] = &panels[..] else { panic!("{} panels", panels.len()) };
    assert!(Some(*index) < activation);
    let has = |chunk: &Chunk, part: &str| chunk.components_identifiers().any(|name| name.as_str().contains(part));
    assert!(has(sent, "time_selection") && has(sent, "loop_mode") && has(sent, "play_state"));
    // A file opens paused, at its critical moment.
    assert!(!has(of_file, "time_selection"));
    // A file without a run, and a file that is no recording, have no loop.
    std::fs::write(folder.path().join("other.rrd"), "RRF2").unwrap();
    assert!(LoopedRecording::read(&folder.path().join("other.rrd")).is_none());
}
