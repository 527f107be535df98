//! Validates each lane-change criterion against known lane changes.
//!
//! ```text
//! CLOSECALL_DATA=DIR cargo run --release -p closecall-xtask -- validate-lane-changes
//! ```
//!
//! `DIR` contains `ngsim_us101` (trajectories of NGSIM US-101, DOI 10.21949/1504477, in the plain
//! layout, and `reference_lane_changes.csv`), `ngsim_i80_pairs` and `gps_lane_changes` (T.
//! Driessen, S. Prasad, P. Bazilinskyy, J. de Winter, AHFE 2022).
//!
//! - US-101: recall over the clear lane changes with 2 s of track on both sides, and precision
//!   against all listed lane changes, with exact intervals. The figures are given for all files
//!   together, for each file, and for halves of the vehicles and of the time. Agreement of the
//!   halves shows that the criteria are not tuned to one of them.
//! - I-80: vehicles that follow another vehicle in the same lane for 30 to 74 s. Every lane change
//!   that the peak criterion finds there by the lateral shift alone, without the recorded lane, is
//!   wrong.
//! - GPS: one car on Dutch motorways, four receivers at 1 Hz, lateral offset to the map-matched
//!   road, 58 lane changes annotated on video. A detected lane change agrees with an annotated one
//!   if it has the same direction and its middle is within 5 s.
#![expect(clippy::print_stdout, reason = "its output is what it is for")]

use std::path::{Path, PathBuf};

use closecall_recorded::lane_change::{
    Criterion, HitRate, LaneChange, LaneChangeDetector, LaneReliability, MIN_SHIFT_M, ReferenceChange, Score,
    TrackSpans, read_references, score,
};
use closecall_recorded::trajectory_data::{LaneMarkings, TrajectoryData, read};
use closecall_traffic::{Dimensions, Lane, Side, Time, Trajectory, TrajectoryPoint, VehicleClass};

/// The name of a subset of the data, and a predicate that selects lane changes by track number and
/// time (s).
type Part = (&'static str, fn(u64, f64) -> bool);

const PARTS: [Part; 5] = [
    ("all", |_, _| true),
    ("odd tracks", |track, _| track % 2 == 1),
    ("even tracks", |track, _| track % 2 == 0),
    ("before 8 s", |_, time_s| time_s < 8.0),
    ("from 8 s on", |_, time_s| time_s >= 8.0),
];

pub(crate) fn main() {
    let data =
        PathBuf::from(std::env::var_os("CLOSECALL_DATA").expect("CLOSECALL_DATA names the folder of trajectory files"));
    us101(&data.join("ngsim_us101"));
    i80(&data.join("ngsim_i80_pairs/i80_leader_follower_pairs.csv.gz"));
    gps(&data.join("gps_lane_changes"));
}

fn us101(folder: &Path) {
    let references = read_references(&folder.join("reference_lane_changes.csv")).expect("the list");
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder.join("trajectories"))
        .expect("recordings")
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    let data_sets: Vec<TrajectoryData> = paths.iter().map(|path| read(path).expect("a trajectory file")).collect();
    for criterion in [Criterion::Peak, Criterion::Distance] {
        println!("US-101, {} criterion", criterion.name());
        let changes: Vec<Vec<LaneChange>> = data_sets.iter().map(|data| detect_changes(data, criterion)).collect();
        for part in PARTS {
            let mut total = Score::default();
            for (data, changes) in data_sets.iter().zip(&changes) {
                total.add(&scored(data, changes, &references, part.1));
            }
            print(part.0, &total);
        }
        for (data, changes) in data_sets.iter().zip(&changes) {
            print(&data.name, &scored(data, changes, &references, |_, _| true));
        }
    }
}

fn detect_changes(data: &TrajectoryData, criterion: Criterion) -> Vec<LaneChange> {
    let detector = LaneChangeDetector::new(LaneReliability::Reliable, &data.markings);
    data.trajectories.iter().flat_map(|track| detector.detect(criterion, track, &[])).collect()
}

fn scored(
    data: &TrajectoryData,
    detected: &[LaneChange],
    references: &[ReferenceChange],
    belongs: fn(u64, f64) -> bool,
) -> Score {
    let listed: Vec<&ReferenceChange> = references
        .iter()
        .filter(|listed| listed.recording_id == data.name && belongs(listed.track_id, listed.time_s))
        .collect();
    let detected: Vec<LaneChange> =
        detected.iter().filter(|change| belongs(change.track_id, change.crossing_s)).cloned().collect();
    score(&detected, &listed, &spans(&data.trajectories))
}

fn spans(tracks: &[Trajectory]) -> TrackSpans {
    tracks.iter().filter_map(|track| Some((track.track_id, track.span()?))).collect()
}

fn print(part: &str, score: &Score) {
    println!("  {part:<12} recall    {}", score.recall);
    println!("  {:<12} precision {}, times within {:.2} s", "", score.precision, score.max_time_error_s);
}

/// Counts the vehicles for which the peak criterion invents a lane change, among vehicles that keep
/// their lane.
fn i80(path: &Path) {
    let packed = std::fs::File::open(path).expect("the pairs");
    let mut reader = csv::Reader::from_reader(flate2::read::MultiGzDecoder::new(packed));
    let mut followers: std::collections::BTreeMap<String, Vec<TrajectoryPoint>> = std::collections::BTreeMap::new();
    for row in reader.deserialize() {
        let row: std::collections::BTreeMap<String, String> = row.expect("a row");
        let number = |name: &str| row[name].parse::<f64>().expect("a number");
        followers.entry(row["pair_id"].clone()).or_default().push(TrajectoryPoint {
            time: Time::from_s(number("time_s")),
            s_m: number("follower_front_y_m"),
            d_m: -number("follower_local_x_m"),
            speed_mps: number("follower_speed_mps"),
            acceleration_mps2: 0.0,
            lateral_speed_mps: 0.0,
            lateral_acceleration_mps2: 0.0,
            lane: Lane(1),
        });
    }
    let detector = LaneChangeDetector::new(LaneReliability::Unreliable, &LaneMarkings::default());
    let tracks: Vec<Trajectory> = followers.into_values().zip(1..).map(|(points, id)| car(id, points)).collect();
    let wrong = tracks.iter().filter(|track| !detector.detect(Criterion::Peak, track, &[]).is_empty()).count();
    let share = HitRate { hits: wrong as u64, of: tracks.len() as u64 };
    println!("I-80, vehicles that keep their lane; a lane change is invented for {share}");
}

fn car(track_id: u64, points: Vec<TrajectoryPoint>) -> Trajectory {
    let dimensions = Dimensions { length_m: 4.6, width_m: 1.85, height_m: 1.5 };
    Trajectory { track_id, vehicle_id: track_id, class: VehicleClass::Car, dimensions, points }
}

/// One annotated lane change.
struct Annotated {
    time_s: f64,
    direction: Side,
}

/// One position fix of a receiver.
struct Fix {
    time_s: f64,
    offset_m: f64,
    speed_mps: f64,
}

/// Maximum time between the middles of an annotated and a detected lane change that count as the
/// same (s).
const SAME_S: f64 = 5.0;

/// Minimum step of the lateral offset that is attributed to the map match instead of the car (m):
/// two lanes in a second.
const MAP_JUMP_M: f64 = 5.0;

/// Maximum time between two position fixes of one track (s).
const GAP_S: f64 = 2.5;

/// Lane width on Dutch motorways (m).
const DUTCH_LANE_M: f64 = 3.5;

/// Assumed distance from the matched road to the left edge of the lane grid, in lane widths. The
/// matched road counts as the middle of a lane; the data does not say which lane.
const LANES_TO_THE_LEFT: f64 = 5.5;

fn gps(folder: &Path) {
    let annotated = annotations(&folder.join("annotations/trip1_lane_changes.csv"));
    println!("GPS at 1 Hz, {} annotated lane changes", annotated.len());
    for receiver in ["gopro", "globalsat", "p20", "s9"] {
        let fixes = fixes(&folder.join(format!("gps/trip1_{receiver}.csv")));
        let tracks = tracks(&fixes);
        let covered: Vec<&Annotated> = annotated
            .iter()
            .filter(|change| tracks.iter().any(|track| covers(track, change.time_s - 2.0, change.time_s + 2.0)))
            .collect();
        println!("  {receiver}: {} fixes in {} pieces, {} changes covered", fixes.len(), tracks.len(), covered.len());
        for criterion in [Criterion::Peak, Criterion::Distance] {
            let detector = LaneChangeDetector::new(LaneReliability::Unreliable, &LaneMarkings::default());
            let detected: Vec<LaneChange> =
                tracks.iter().flat_map(|track| detector.detect(criterion, track, &[])).collect();
            print_gps(criterion, &covered, &detected);
            print_missed(&covered, &detected, &tracks);
        }
    }
}

fn print_gps(criterion: Criterion, covered: &[&Annotated], detected: &[LaneChange]) {
    let recalled = covered.iter().filter(|annotated| detected.iter().any(|change| same(change, annotated))).count();
    let right = detected.iter().filter(|change| covered.iter().any(|annotated| same(change, annotated))).count();
    let recall = HitRate { hits: recalled as u64, of: covered.len() as u64 };
    let precision = HitRate { hits: right as u64, of: detected.len() as u64 };
    println!("    {:<9} recall {recall}", criterion.name());
    println!("    {:<9} precision {precision}", "");
}

fn same(change: &LaneChange, annotated: &Annotated) -> bool {
    change.direction == annotated.direction && (change.midpoint_s - annotated.time_s).abs() <= SAME_S
}

/// Counts why lane changes were missed, by the movement of the recorded position from 4 s before to
/// 4 s after the annotation.
fn print_missed(covered: &[&Annotated], detected: &[LaneChange], tracks: &[Trajectory]) {
    const AROUND_S: f64 = 4.0;
    let (mut jump, mut against, mut small, mut other) = (0, 0, 0, 0);
    for annotated in covered.iter().filter(|annotated| !detected.iter().any(|change| same(change, annotated))) {
        let [from_s, to_s] = [annotated.time_s - AROUND_S, annotated.time_s + AROUND_S];
        let Some(track) = tracks.iter().find(|track| covers(track, from_s, to_s)) else {
            jump += 1;
            continue;
        };
        let at = |time_s| track.at(Time::from_s(time_s)).map_or(f64::NAN, |point| point.d_m);
        let towards = if annotated.direction == Side::Left { 1.0 } else { -1.0 };
        match towards * (at(to_s) - at(from_s)) {
            shift_m if shift_m < 0.0 => against += 1,
            shift_m if shift_m < MIN_SHIFT_M => small += 1,
            _ => other += 1,
        }
    }
    println!(
        "    {:<9} missed: {jump} at a gap or jump of the map match, {against} moving the other way on the map, {small} by less \
         than {MIN_SHIFT_M} m on it, {other} otherwise",
        ""
    );
}

fn covers(track: &Trajectory, from_s: f64, to_s: f64) -> bool {
    track.span().is_some_and(|(first, last)| first.s() <= from_s && last.s() >= to_s)
}

fn annotations(path: &Path) -> Vec<Annotated> {
    let mut reader = csv::Reader::from_path(path).expect("the annotations");
    let rows = reader.deserialize().map(|row| row.expect("a row"));
    let annotated = rows.filter_map(|row: std::collections::BTreeMap<String, String>| {
        let direction = match row["direction"].as_str() {
            "left" => Side::Left,
            "right" => Side::Right,
            _ => return None,
        };
        Some(Annotated { time_s: row["t_lc"].parse().ok()?, direction })
    });
    annotated.collect()
}

fn fixes(path: &Path) -> Vec<Fix> {
    let mut reader = csv::Reader::from_path(path).expect("a receiver's readings");
    let rows = reader.deserialize().map(|row| row.expect("a row"));
    let fix = |row: std::collections::BTreeMap<String, String>| {
        let number = |name: &str| row[name].parse::<f64>().ok();
        Some(Fix { time_s: number("t")?, offset_m: number("offset")?, speed_mps: number("speed_geod")? })
    };
    rows.filter_map(fix).collect()
}

/// Splits position fixes into tracks without gaps and without jumps of the map match. The offset
/// grows to the right.
fn tracks(fixes: &[Fix]) -> Vec<Trajectory> {
    let pieces = fixes.chunk_by(|a, b| {
        b.time_s > a.time_s && b.time_s - a.time_s <= GAP_S && (b.offset_m - a.offset_m).abs() <= MAP_JUMP_M
    });
    let point = |fix: &Fix| TrajectoryPoint {
        time: Time::from_s(fix.time_s),
        s_m: 0.0,
        d_m: -fix.offset_m - LANES_TO_THE_LEFT * DUTCH_LANE_M,
        speed_mps: fix.speed_mps,
        acceleration_mps2: 0.0,
        lateral_speed_mps: 0.0,
        lateral_acceleration_mps2: 0.0,
        lane: Lane(1),
    };
    let numbered = pieces.filter(|piece| piece.len() > 1).zip(1..);
    let track = |(piece, track_id): (&[Fix], u64)| car(track_id, piece.iter().map(point).collect());
    numbered.map(track).collect()
}
