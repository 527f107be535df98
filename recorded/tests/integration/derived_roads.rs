//! Roads that are derived from traffic. If rows name lanes, a lane change is a change of the named lane,
//! wherever vehicles drive and however many names a lane has. If they do not, the traffic shows its lanes.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use closecall_recorded::filters::smooth;
use closecall_recorded::lane_change::{LaneReliability, detect};
use closecall_recorded::trajectory_data::{
    ReadOptions, TrajectoryData, TrajectoryFileProblem, open_from, read, read_with,
};
use closecall_traffic::{Side, Time, Trajectory, maths};

use crate::support::{data_folder, read_text};

/// Half the length of SUMO's standard car (m): its position is the middle of its front.
const HALF_CAR_M: f64 = 2.5;

/// A vehicle at one instant, on the road.
#[derive(Clone, Copy, Debug)]
struct Seen {
    vehicle: u64,
    time: Time,
    s_m: f64,
    /// Distance to the left of the road's left edge (m).
    d_m: f64,
    speed_mps: f64,
    /// Lane, counted from 1 at the left.
    lane: u8,
}

/// The course of the road in the plane.
#[derive(Clone, Copy, Debug)]
enum Course {
    Straight,
    /// A bend to the left with a radius of 800 m.
    Bend,
    /// The other side of a straight road: right is left.
    Mirrored,
}

impl Course {
    /// Returns x, y (m) and the heading (rad) at a place of the road.
    fn at(self, s_m: f64, d_m: f64) -> (f64, f64, f64) {
        const RADIUS_M: f64 = 800.0;
        match self {
            Self::Straight => (s_m, d_m, 0.0),
            Self::Mirrored => (s_m, -d_m, 0.0),
            Self::Bend => {
                let (angle_rad, radius_m) = (s_m / RADIUS_M, RADIUS_M - d_m);
                (radius_m * maths::sin(angle_rad), RADIUS_M - radius_m * maths::cos(angle_rad), angle_rad)
            }
        }
    }
}

/// The names along the road.
#[derive(Clone, Copy, Debug)]
enum Edges {
    One,
    /// Edges of this length (m).
    Of(f64),
    /// Edges of 100 m with 12 m in junctions.
    WithJunctions,
}

impl Edges {
    const ALL: [Self; 5] = [Self::One, Self::Of(100.0), Self::Of(60.0), Self::Of(30.0), Self::WithJunctions];

    /// Returns the name of the edge at `s_m`.
    fn name(self, s_m: f64) -> String {
        match self {
            Self::One => "E".to_owned(),
            Self::Of(length_m) => format!("E{}", (s_m / length_m).floor()),
            Self::WithJunctions if s_m.rem_euclid(100.0) < 12.0 => format!(":J{}_0", (s_m / 100.0).floor()),
            Self::WithJunctions => format!("E{}", (s_m / 100.0).floor()),
        }
    }
}

/// Returns floating car data of SUMO, whose lanes have the names that `name` gives.
fn sumo(seen: &[Seen], course: Course, name: impl Fn(&Seen) -> String) -> String {
    let mut steps: BTreeMap<Time, String> = BTreeMap::new();
    for row in seen {
        let (x_m, y_m, heading_rad) = course.at(row.s_m, row.d_m);
        let (x_m, y_m) = (x_m + HALF_CAR_M * maths::cos(heading_rad), y_m + HALF_CAR_M * maths::sin(heading_rad));
        writeln!(
            steps.entry(row.time).or_default(),
            "<vehicle id=\"{}\" x=\"{x_m:.2}\" y=\"{y_m:.2}\" angle=\"{:.3}\" type=\"car\" speed=\"{:.2}\" lane=\"{}\"/>",
            row.vehicle,
            90.0 - heading_rad.to_degrees(),
            row.speed_mps,
            name(row)
        )
        .unwrap();
    }
    let mut text = "<fcd-export>\n".to_owned();
    for (time, vehicles) in steps {
        writeln!(text, "<timestep time=\"{:.2}\">\n{vehicles}</timestep>", time.s()).unwrap();
    }
    text + "</fcd-export>\n"
}

/// Returns the name of a lane whose index SUMO counts from the right of seven lanes.
fn counted_from_right(edges: Edges) -> impl Fn(&Seen) -> String {
    move |row| format!("{}_{}", edges.name(row.s_m), 7 - row.lane)
}

/// The lane changes in a file: vehicle, direction and crossing (s).
fn lane_changes_of(data: &TrajectoryData) -> Vec<(u64, Side, f64)> {
    let changes = detect(&smooth(data));
    changes.iter().map(|change| (change.vehicle_id, change.direction, change.crossing_s)).collect()
}

/// Asserts that `data` has the lane changes of the reference, apart from one.
fn assert_has(data: &TrajectoryData, reference: &[(u64, Side, f64)], case: &str) {
    let detected = lane_changes_of(data);
    let is_same = |a: &(u64, Side, f64), b: &(u64, Side, f64)| a.0 == b.0 && a.1 == b.1 && (a.2 - b.2).abs() <= 0.5;
    let missing = reference.iter().filter(|&listed| !detected.iter().any(|other| is_same(listed, other))).count();
    let invented = detected.iter().filter(|&other| !reference.iter().any(|listed| is_same(listed, other))).count();
    assert!(missing <= 1 && invented <= 1, "{case}: {missing} of {} missing, {invented} invented", reference.len());
    assert!(!data.is_in_doubt, "{case}: {:?}", data.warnings());
}

/// Sixty vehicles that drive up to 0.5 m beside the middles of three lanes and sway slowly, each on
/// 250 m of a road of 600 m. Vehicle 58 changes from lane 2 to lane 1.
fn off_centre() -> Vec<Seen> {
    const LANE_M: f64 = 3.5;
    let mut seen = Vec::new();
    for vehicle in 1..=60_u32 {
        let (lane, first_m) = (1 + vehicle % 3, 6.0 * f64::from(vehicle));
        let phase = 0.37 * f64::from(vehicle);
        for step in 0..125_u32 {
            let s_m = first_m + 2.0 * f64::from(step);
            let is_changing = vehicle == 58;
            let tau = if is_changing { ((f64::from(step) - 30.0) / 60.0).clamp(0.0, 1.0) } else { 0.0 };
            let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
            let sway_m = if is_changing { 0.0 } else { 0.5 * maths::sin(TAU * (s_m / 220.0 + phase)) };
            let lane_m = LANE_M * (f64::from(lane) - 0.5 - share);
            seen.push(Seen {
                vehicle: u64::from(vehicle),
                time: Time::from_ms(100 * i64::from(step)),
                s_m,
                d_m: sway_m - lane_m,
                speed_mps: 20.0,
                lane: if share < 0.5 { lane as u8 } else { lane as u8 - 1 },
            });
        }
    }
    seen
}

#[test]
fn vehicles_beside_the_middles_of_their_lanes_change_no_lane() {
    for course in [Course::Straight, Course::Bend] {
        for edges in Edges::ALL {
            let data = read_text(sumo(&off_centre(), course, counted_from_right(edges)).as_bytes()).unwrap();
            let changes: Vec<(u64, Side)> = lane_changes_of(&data).iter().map(|change| (change.0, change.1)).collect();
            assert_eq!(changes, [(58, Side::Left)], "{course:?}, {edges:?}");
            assert!(!data.is_in_doubt, "{course:?}, {edges:?}: {:?}", data.warnings());
            let assumed = data.notes.iter().any(|note| note.contains("beside each other"));
            assert!(!assumed, "{course:?}, {edges:?}: {:?}", data.notes);
        }
    }
}

#[test]
fn lanes_that_sumo_counts_from_the_left_are_refused() {
    let read = read_text(sumo(&off_centre(), Course::Mirrored, counted_from_right(Edges::One)).as_bytes());
    let problem = read.unwrap_err().problem;
    assert!(matches!(problem, TrajectoryFileProblem::IndexAgainstPosition { percent: 90.0.., .. }), "{problem}");
}

#[test]
fn a_single_name_for_all_lanes_is_in_doubt() {
    let data = read_text(sumo(&off_centre(), Course::Straight, |_| "E_0".to_owned()).as_bytes()).unwrap();
    assert_eq!(lane_changes_of(&data), []);
    assert!(data.is_in_doubt);
    let warnings = data.warnings();
    assert!(
        warnings.iter().any(|warning| warning.contains("spread over more than the width of a lane")),
        "{warnings:?}"
    );
}

/// Returns the rows of tracks.
fn rows(tracks: &[Trajectory]) -> Vec<Seen> {
    let of_track = |track: &Trajectory| {
        let vehicle = track.track_id;
        let row = |point: &closecall_traffic::TrajectoryPoint| Seen {
            vehicle,
            time: point.time,
            s_m: point.s_m,
            d_m: point.d_m,
            speed_mps: point.speed_mps,
            lane: point.lane.0,
        };
        track.points.iter().map(row).collect::<Vec<_>>()
    };
    tracks.iter().flat_map(of_track).collect()
}

/// Track, direction and time of a lane change (s).
type Change = (u64, Side, f64);

/// Reads one recording of US-101, if it is available: its rows, and its lane changes.
fn us_101(name: &str) -> Option<(TrajectoryData, Vec<Change>)> {
    let data = read(&data_folder()?.join("ngsim_us101/trajectories").join(format!("{name}.csv"))).unwrap();
    let changes = detect(&smooth(&data));
    let listed = changes.iter().map(|change| (change.track_id, change.direction, change.crossing_s)).collect();
    Some((data, listed))
}

#[test]
fn us_101_as_sumo_has_its_lane_changes_however_many_edges_the_road_has() {
    for name in ["us101_a", "us101_b"] {
        let Some((data, listed)) = us_101(name) else { return };
        for course in [Course::Straight, Course::Bend] {
            for edges in Edges::ALL {
                let text = sumo(&rows(&data.trajectories), course, counted_from_right(edges));
                let case = format!("{name}, {course:?}, {edges:?}");
                assert_has(&read_text(text.as_bytes()).unwrap(), &listed, &case);
            }
        }
    }
}

#[test]
fn vehicles_of_us_101_that_keep_their_named_lane_change_no_lane_in_dense_traffic() {
    for name in ["us101_a", "us101_b"] {
        let Some((data, _)) = us_101(name) else { return };
        let keeps = |track: &Trajectory| track.points.windows(2).all(|pair| pair[0].lane == pair[1].lane);
        let keepers: Vec<Trajectory> = data.trajectories.into_iter().filter(keeps).collect();
        for edges in Edges::ALL {
            let text = sumo(&rows(&keepers), Course::Straight, counted_from_right(edges));
            assert_eq!(lane_changes_of(&read_text(text.as_bytes()).unwrap()), [], "{name}, {edges:?}");
        }
        // One lane alone.
        let lane_4: Vec<Seen> = rows(&keepers).into_iter().filter(|row| row.lane == 4).collect();
        let text = sumo(&lane_4, Course::Straight, counted_from_right(Edges::One));
        assert_eq!(lane_changes_of(&read_text(text.as_bytes()).unwrap()), [], "{name}, lane 4");
    }
}

#[test]
fn us_101_in_a_plane_without_names_of_lanes_has_the_lane_changes_of_estimated_lanes() {
    // A known road says more than positions in a plane: what is found along it is what can be found.
    let unnamed = || ReadOptions { lanes: LaneReliability::Unreliable, ..ReadOptions::default() };
    let sides = |changes: &[Change]| -> Vec<(u64, Side)> {
        changes.iter().map(|&(vehicle, side, _)| (vehicle, side)).collect()
    };
    for course in [Course::Straight, Course::Bend] {
        let (mut along_the_road, mut in_a_plane, mut of_both, mut true_ones) = (0, 0, 0, 0);
        for name in ["us101_a", "us101_b", "us101_f", "us101_g", "us101_h"] {
            let Some((data, listed)) = us_101(name) else { return };
            let path = data_folder().unwrap().join("ngsim_us101/trajectories").join(format!("{name}.csv"));
            let estimated = detect(&smooth(&read_with(&path, unnamed()).unwrap()));
            let estimated: Vec<_> = estimated.iter().map(|change| (change.track_id, change.direction)).collect();
            let text = sumo(&rows(&data.trajectories), course, |_| String::new()).replace(" lane=\"\"", "");
            let tracks = open_from(text.as_bytes(), Path::new("made-up.xml"), unnamed(), usize::MAX).unwrap();
            let derived = sides(&lane_changes_of(&tracks.collect_all().unwrap()));
            let listed = sides(&listed);
            along_the_road += estimated.len();
            in_a_plane += derived.len();
            of_both += estimated.iter().filter(|change| derived.contains(change)).count();
            true_ones += derived.iter().filter(|change| listed.contains(change)).count();
            eprintln!("{name}, {course:?}: {derived:?} in a plane, {estimated:?} along the road");
        }
        assert!(along_the_road >= 25, "too little data for a statement: {along_the_road}");
        assert!(of_both * 10 >= along_the_road * 9, "{course:?}: {of_both} of {along_the_road} are found");
        assert!(true_ones * 10 >= in_a_plane * 9, "{course:?}: {true_ones} of {in_a_plane} are in the recording");
    }
}

/// Says whether `laneChange` is 1 in a row of exiD whose vehicle changes lanes or not, and enters a lanelet or not.
type Flag = fn(changes: bool, enters: bool) -> bool;

/// Writes the rows of tracks as exiD's files, with lanelets of this length (m).
fn write_exid(folder: &Path, tracks: &[Trajectory], lanelet_m: f64, flag: Flag) {
    let mut text = "recordingId,trackId,frame,xCenter,yCenter,heading,width,length,lonVelocity,lonAcceleration,laneWidth,laneletId,\
                    laneChange\n"
        .to_owned();
    let mut meta = "recordingId,trackId,numFrames,class\n".to_owned();
    for track in tracks {
        let rows = rows(std::slice::from_ref(track));
        writeln!(meta, "0,{},{},car", track.track_id, rows.len()).unwrap();
        let mut before = None;
        for (row, point) in rows.into_iter().zip(&track.points) {
            let lanelet = 1_000.0 + 10.0 * (row.s_m / lanelet_m).floor() + f64::from(row.lane);
            let changes = before.is_some_and(|(lane, _)| lane != row.lane);
            let flag = u8::from(flag(changes, before.is_some_and(|(_, before)| before != lanelet)));
            before = Some((row.lane, lanelet));
            let frame = (10.0 * row.time.s()).round();
            writeln!(
                text,
                "0,{},{frame},{:.3},{:.3},0.0,1.8,4.5,{:.3},{:.3},3.5,{lanelet},{flag}",
                row.vehicle, row.s_m, row.d_m, row.speed_mps, point.acceleration_mps2
            )
            .unwrap();
        }
    }
    std::fs::write(folder.join("00_tracks.csv"), text).unwrap();
    std::fs::write(folder.join("00_tracksMeta.csv"), meta).unwrap();
    std::fs::write(folder.join("00_recordingMeta.csv"), "recordingId,frameRate\n0,10\n").unwrap();
}

#[test]
fn us_101_as_exid_has_its_lane_changes_however_short_the_lanelets_are() {
    for name in ["us101_a", "us101_b"] {
        let Some((data, listed)) = us_101(name) else { return };
        for lanelet_m in [1_000.0, 60.0, 40.0, 30.0] {
            let folder = tempfile::tempdir().unwrap();
            write_exid(folder.path(), &data.trajectories, lanelet_m, |changes, _| changes);
            assert_has(&read(folder.path()).unwrap(), &listed, &format!("{name}, lanelets of {lanelet_m} m"));
        }
    }
}

#[test]
fn lane_changes_that_exid_states_where_no_vehicle_moves_sideways_are_in_doubt() {
    let Some((data, _)) = us_101("us101_a") else { return };
    let flags: [(&str, Flag); 3] = [
        ("all rows", |_, _| true),
        ("all but the lane changes", |changes, _| !changes),
        ("new lanelets", |_, enters| enters),
    ];
    for (case, flag) in flags {
        let folder = tempfile::tempdir().unwrap();
        write_exid(folder.path(), &data.trajectories, 60.0, flag);
        let data = read(folder.path()).unwrap();
        let is_told = data.notes.iter().any(|note| note.contains("the vehicle does not move sideways"));
        assert!(data.is_in_doubt && is_told, "{case}: {:?}", data.notes);
    }
}

/// The vehicles of [`off_centre`], and `ramp` others that come from the right along a ramp without lanes of its own.
fn beside_a_ramp(ramp: u64) -> Vec<Seen> {
    let mut seen = off_centre();
    for vehicle in 101..101 + ramp {
        for step in 0..100_i32 {
            let s_m = 0.3 * (vehicle % 7) as f64 + 2.0 * f64::from(step);
            let from_right_m = 0.06 * (150.0 - s_m).max(0.0);
            let (time, d_m) = (Time::from_ms(100 * i64::from(step)), -1.75 - 7.0 - from_right_m);
            seen.push(Seen { vehicle, time, s_m, d_m, speed_mps: 20.0, lane: 3 });
        }
    }
    seen
}

#[test]
fn a_ramp_that_crosses_the_lanes_of_the_positions_is_in_doubt() {
    for lanes in [LaneReliability::Reliable, LaneReliability::Unreliable] {
        let options = ReadOptions { lanes, ..ReadOptions::default() };
        let read = |ramp: u64| {
            let text = sumo(&beside_a_ramp(ramp), Course::Straight, |_| String::new()).replace(" lane=\"\"", "");
            open_from(text.as_bytes(), Path::new("made-up.xml"), options, usize::MAX).unwrap().collect_all().unwrap()
        };
        let is_told = |data: &TrajectoryData| data.notes.iter().any(|note| note.contains("ramps or exits lie there"));
        let (without, with) = (read(0), read(9));
        assert!(!without.is_in_doubt && !is_told(&without), "{lanes:?}: {:?}", without.notes);
        assert!(with.is_in_doubt && is_told(&with), "{lanes:?}: {:?}", with.notes);
    }
}
