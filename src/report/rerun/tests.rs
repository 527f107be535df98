use std::collections::BTreeSet;

use closecall_scenarios::sampling::Design;
use closecall_traffic::geometry::BoxSide;
use rerun::log::{Chunk, LogMsg};
use rerun::{StoreKind, TimelineName};

use super::stream::{OPENING_TIMELINE, TIME_TIMELINE};
use super::*;
use crate::campaign::runner::{Sampling, concrete};
use crate::controller::BuiltIn;
use crate::outcome::{ClosedBy, Collision, Phase};
use crate::scenario::ScenarioFile;
use crate::simulation::{Arm, RunKey, simulate};

/// A sample of the headline scenario, recorded with the margin increase system.
fn recorded(path: &Path) -> (RunRecorder, Outcome) {
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/library/low-thw-overtake.toml");
    let file = ScenarioFile::load(&library, &[]).unwrap();
    let sampling = Sampling { seed: 1, design: Design::Random, samples: 1 };
    let scenario = concrete(&file, sampling, 0).unwrap();
    let mut recorder = RunRecorder::new(path, &scenario, "a run").unwrap();
    let arm = Arm { controller: BuiltIn::Mis.factory(), sensors: None };
    let outcome = simulate(&scenario, RunKey { seed: 1, sample: 0 }, &arm, &mut recorder).unwrap();
    (recorder, outcome)
}

fn film<'a>(recorder: &'a RunRecorder, outcome: &'a Outcome) -> Film<'a> {
    Film {
        scenario: &recorder.scenario,
        title: &recorder.title,
        frames: &recorder.frames,
        happenings: &recorder.happenings,
        outcome,
    }
}

fn chunks(film: &Film<'_>, kind: StoreKind) -> Vec<Chunk> {
    let messages = record(film).unwrap().take();
    let of_kind = messages.iter().filter(|message| message.store_id().kind() == kind);
    of_kind
        .filter_map(|message| match message {
            LogMsg::ArrowMsg(_, arrow) => Some(Chunk::from_arrow_msg(arrow).unwrap()),
            _ => None,
        })
        .collect()
}

/// The latest moment on a timeline [ns].
fn latest_ns(chunks: &[Chunk], timeline: &'static str) -> i64 {
    let timeline = TimelineName::from_static_str(timeline);
    let columns = chunks.iter().filter_map(|chunk| chunk.timelines().get(&timeline));
    columns.map(|column| column.time_range().max().as_i64()).max().unwrap()
}

#[test]
fn every_view_of_the_blueprint_has_something_to_show() {
    let folder = tempfile::tempdir().unwrap();
    let (recorder, outcome) = recorded(&folder.path().join("run.rrd"));
    let film = film(&recorder, &outcome);
    let entities: BTreeSet<String> =
        chunks(&film, StoreKind::Recording).iter().map(|chunk| chunk.entity_path().to_string()).collect();
    let origins = [
        "/world/ego",
        "/world/road",
        "/world/vehicles/front",
        "/world/vehicles/rear",
        "/world/ego/tracks",
        "/states",
        "/log",
        "/summary",
        "/plots/headway",
        "/plots/gap",
        "/plots/encounter",
        "/plots/speed",
        "/plots/acceleration",
        "/plots/margin",
    ];
    for origin in origins {
        assert!(entities.iter().any(|entity| entity.starts_with(origin)), "{origin} is empty: {entities:?}");
    }
    let views = chunks(&film, StoreKind::Blueprint);
    assert!(views.iter().any(|chunk| chunk.entity_path().to_string().ends_with("/EyeControls3D")));
}

#[test]
fn the_opening_timeline_ends_at_the_critical_moment() {
    let folder = tempfile::tempdir().unwrap();
    let (recorder, outcome) = recorded(&folder.path().join("run.rrd"));
    let film = film(&recorder, &outcome);
    let chunks = chunks(&film, StoreKind::Recording);
    let opening = film.critical_moment() + AFTER_CRITICAL;
    let latest = latest_ns(&chunks, OPENING_TIMELINE);
    assert!(latest <= opening.ns() && latest > film.critical_moment().ns(), "{latest} {opening:?}");
    assert_eq!(latest_ns(&chunks, TIME_TIMELINE), recorder.frames.last().unwrap().time.ns());
}

#[test]
fn a_collision_of_ego_is_what_matters_most() {
    let folder = tempfile::tempdir().unwrap();
    let (recorder, mut outcome) = recorded(&folder.path().join("run.rrd"));
    let actors = &recorder.scenario.actors;
    let collision = |time, between: [usize; 2]| Collision {
        time,
        between: between.map(|actor| actors[actor].id.clone()),
        struck_side: [BoxSide::Rear, BoxSide::Front],
        closed_by: ClosedBy::Second,
        phase: Phase::Critical,
        relative_speed_mps: 5.0,
        delta_v_mps: [2.5, 2.5],
    };
    let ego = recorder.scenario.ego;
    let others: Vec<usize> = (0..actors.len()).filter(|&actor| actor != ego).collect();
    outcome.collisions = vec![collision(Time::from_ms(1_000), [others[0], others[1]])];
    assert_eq!(film(&recorder, &outcome).critical_moment(), Time::from_ms(1_000));
    outcome.collisions.push(collision(Time::from_ms(2_000), [ego, others[1]]));
    let film = film(&recorder, &outcome);
    assert_eq!(film.critical_moment(), Time::from_ms(2_000));
    let marks = chunks(&film, StoreKind::Recording);
    assert!(marks.iter().any(|chunk| chunk.entity_path().to_string() == "/world/ego/collision_2"));
}

#[test]
fn the_file_is_whole_and_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.rrd");
    let (recorder, outcome) = recorded(&path);
    assert!(!path.exists());
    recorder.finish(&outcome).unwrap();
    assert_eq!(&std::fs::read(&path).unwrap()[..4], b"RRF2");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let (recorder, _) = recorded(&path);
    let error = RunRecorder::new(&folder.path().join("no/folder.rrd"), &recorder.scenario, "a run").err().unwrap();
    assert!(error.to_string().contains("no/folder.rrd"), "{error}");
}
