//! Lane changes by lanes that are estimated from the traffic: found where the traffic shows its
//! lanes, never invented, and refused with the reason where it does not.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use closecall_recorded::filters::smooth;
use closecall_recorded::lane_change::{LaneChange, LaneReliability, Score, detect, read_references, score};
use closecall_recorded::trajectory_data::{ReadOptions, TrajectoryData, TrajectoryFileProblem, open_from, read_with};
use closecall_traffic::{Lane, Side, maths};

use crate::support::data_folder;

const LANE_M: f64 = 3.4;

const WITHOUT_LANES: fn() -> ReadOptions =
    || ReadOptions { lanes: LaneReliability::Unreliable, ..ReadOptions::default() };

/// The lateral position to the right (m) of a made-up vehicle at a time (s).
type Lateral = Box<dyn Fn(f64) -> f64>;

/// Reads made-up vehicles, whose file states lane 0 throughout, without lanes.
fn read_without_lanes(vehicles: &[Lateral]) -> TrajectoryData {
    let mut text =
        "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
    for (number, lateral) in vehicles.iter().enumerate() {
        for frame in 0..150 {
            let time_s = 0.1 * f64::from(frame);
            let s_m = 40.0 * number as f64 + 25.0 * time_s;
            writeln!(text, "{},{frame},{time_s:.1},{s_m:.2},{:.3},0,25,0,4.5,1.8,car", number + 1, lateral(time_s))
                .unwrap();
        }
    }
    open_from(text.as_bytes(), Path::new("made-up.csv"), WITHOUT_LANES(), usize::MAX).unwrap().collect_all().unwrap()
}

/// A vehicle that sways by `sway_m` about the position `right_m`.
fn keeps(right_m: f64, sway_m: f64, phase: f64) -> Lateral {
    Box::new(move |time_s| right_m + sway_m * maths::sin(TAU * (time_s / 9.0 + phase)))
}

/// A vehicle that changes from one lane to another on a quintic path.
fn changes(from: f64, to: f64) -> Lateral {
    Box::new(move |time_s| {
        let tau = ((time_s - 4.0) / 5.0).clamp(0.0, 1.0);
        let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        LANE_M * (from + 0.5 + share * (to - from))
    })
}

/// Traffic in three lanes that begin at `left_m`, 0.2 m to the right of their middles.
fn traffic(left_m: f64) -> Vec<Lateral> {
    (0..36_u32)
        .map(|number| {
            let (lane, phase) = (f64::from(number % 3), 0.37 * f64::from(number));
            keeps(left_m + LANE_M * (lane + 0.5) + 0.2, 0.25, phase)
        })
        .collect()
}

fn listed(changes: &[LaneChange]) -> Vec<(u64, Side, u8, u8)> {
    changes.iter().map(|change| (change.track_id, change.direction, change.from_lane, change.to_lane)).collect()
}

#[test]
fn lane_changes_are_found_by_the_lanes_that_the_traffic_shows() {
    let mut vehicles = traffic(0.0);
    vehicles.extend([changes(1.0, 0.0), changes(1.0, 2.0)]);
    let data = read_without_lanes(&vehicles);
    assert_eq!(data.lanes, LaneReliability::Estimated);
    let changes = detect(&smooth(&data));
    assert_eq!(listed(&changes), [(37, Side::Left, 2, 1), (38, Side::Right, 2, 3)]);
    for (lane, edge_m) in [(1, LANE_M), (2, 2.0 * LANE_M)] {
        assert!((data.markings.right_edge_m(Lane(lane)).unwrap() + edge_m).abs() < 0.15, "{:?}", data.markings);
    }
    for change in &changes {
        assert!((change.crossing_s - 6.5).abs() < 0.25 && change.complete, "{change:?}");
    }
}

#[test]
fn a_plain_file_without_lanes_is_read_if_they_are_to_be_estimated() {
    let Some(folder) = data_folder() else { return };
    let path = folder.join("ngsim_us101/trajectories/us101_a.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let column = text.lines().next().unwrap().split(',').position(|name| name == "lane_id").unwrap();
    let edited = |edit: &dyn Fn(&mut Vec<&str>)| {
        let line = |line: &str| {
            let mut fields: Vec<&str> = line.split(',').collect();
            edit(&mut fields);
            fields.join(",") + "\n"
        };
        text.lines().map(line).collect::<String>()
    };
    let without = edited(&|fields| {
        fields.remove(column);
    });
    let empty = edited(&|fields| {
        if fields[column] != "lane_id" {
            fields[column] = "";
        }
    });
    let read = |text: &str, options: ReadOptions| {
        open_from(text.as_bytes(), Path::new("made-up.csv"), options, usize::MAX)?.collect_all()
    };
    let error = read(&without, ReadOptions::default()).unwrap_err();
    assert!(matches!(error.problem, TrajectoryFileProblem::NoLanes { .. }), "{error}");
    assert!(error.to_string().contains("no column `lane_id`"), "{error}");
    assert!(read(&empty, ReadOptions::default()).unwrap_err().to_string().contains("`lane_id`"));
    let expected = listed(&detect(&smooth(&read_with(&path, WITHOUT_LANES()).unwrap())));
    assert!(expected.len() > 10, "{}", expected.len());
    for text in [without, empty] {
        assert_eq!(listed(&detect(&smooth(&read(&text, WITHOUT_LANES()).unwrap()))), expected);
    }
}

#[test]
fn positions_to_the_left_of_the_left_edge_are_in_doubt_because_they_may_be_mirrored() {
    let mut vehicles = traffic(0.0);
    vehicles.push(changes(1.0, 0.0));
    let data = read_without_lanes(&vehicles);
    assert!(!data.is_in_doubt && !data.doubts_sides, "{:?}", data.notes);
    let mirrored: Vec<Lateral> =
        vehicles.into_iter().map(|right_m| Box::new(move |time_s| -right_m(time_s)) as Lateral).collect();
    let data = read_without_lanes(&mirrored);
    assert_eq!(listed(&detect(&smooth(&data)))[0].1, Side::Right);
    assert!(data.is_in_doubt && data.doubts_sides, "{:?}", data.notes);
    assert!(data.notes.iter().any(|note| note.contains("mirrored")), "{:?}", data.notes);
}

#[test]
fn a_road_that_does_not_begin_at_zero_has_its_lanes_where_its_vehicles_drive() {
    let mut vehicles = traffic(-21.4);
    vehicles.push(Box::new(|time_s| changes(1.0, 0.0)(time_s) - 21.2));
    let data = read_without_lanes(&vehicles);
    assert_eq!(listed(&detect(&smooth(&data))), [(37, Side::Left, 2, 1)]);
}

#[test]
fn an_empty_lane_between_others_is_counted() {
    // Lane 2 has no vehicle but the ones that change to it.
    let mut vehicles: Vec<Lateral> =
        (0..24_u32).map(|n| keeps(LANE_M * (2.0 * f64::from(n % 2) + 0.7), 0.25, 0.37 * f64::from(n))).collect();
    vehicles.push(changes(2.0, 0.0));
    let data = read_without_lanes(&vehicles);
    let changes = listed(&detect(&smooth(&data)));
    assert_eq!(changes, [(25, Side::Left, 3, 2), (25, Side::Left, 2, 1)], "{:?}", data.markings);
}

#[test]
fn a_vehicle_that_sways_in_its_lane_or_about_a_marking_changes_no_lane() {
    let mut vehicles = traffic(0.0);
    // By 1.2 m about the middle of its lane, and by 0.4 m about a marking.
    vehicles.extend([keeps(1.5 * LANE_M, 1.2, 0.0), keeps(LANE_M, 0.4, 0.3), keeps(2.0 * LANE_M, 0.4, 0.6)]);
    let data = read_without_lanes(&vehicles);
    assert_eq!(data.lanes, LaneReliability::Estimated);
    assert_eq!(listed(&detect(&smooth(&data))), []);
}

#[test]
fn traffic_that_shows_no_lanes_says_so_and_is_searched_by_lateral_shift() {
    let reason = |vehicles: &[Lateral]| {
        let data = read_without_lanes(vehicles);
        assert_eq!(data.lanes, LaneReliability::Unreliable);
        let changes = detect(&smooth(&data));
        let note = data.notes.into_iter().find(|note| note.contains("does not show its lanes"));
        (note.expect("a note"), listed(&changes).len())
    };
    let few: Vec<Lateral> = vec![keeps(1.7, 0.2, 0.0), changes(1.0, 0.0)];
    assert_eq!(reason(&few).1, 1);
    assert!(reason(&few).0.contains("2 vehicles are too few"));
    let even: Vec<Lateral> = (0..60).map(|number| keeps(0.21 * f64::from(number), 0.2, 0.0)).collect();
    assert!(reason(&even).0.contains("no lane width stands out"), "{}", reason(&even).0);
    let single: Vec<Lateral> = (0..20).map(|number| keeps(1.7, 0.2, 0.1 * f64::from(number))).collect();
    assert!(reason(&single).0.contains("a single lane"), "{}", reason(&single).0);
}

#[test]
fn estimated_lanes_find_nine_of_ten_lane_changes_of_us_101() {
    let Some(folder) = data_folder() else { return };
    let references = read_references(&folder.join("ngsim_us101/reference_lane_changes.csv")).unwrap();
    let mut entries: Vec<_> = std::fs::read_dir(folder.join("ngsim_us101/trajectories"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    let mut total = Score::default();
    for path in entries {
        let data = read_with(&path, WITHOUT_LANES()).unwrap();
        let listed: Vec<_> = references.iter().filter(|listed| listed.recording_id == data.name).collect();
        let spans = data.trajectories.iter().filter_map(|track| Some((track.track_id, track.span()?))).collect();
        let scored = score(&detect(&smooth(&data)), &listed, &spans);
        eprintln!("{}: {:?}; recall {}, precision {}", data.name, data.lanes, scored.recall, scored.precision);
        total.add(&scored);
    }
    let Score { recall, precision, .. } = total;
    assert!(recall.of >= 15 && precision.of >= 20, "too little data for a statement: {recall}, {precision}");
    assert!(recall.hits * 100 >= recall.of * 90, "recall {recall}");
    assert!(precision.hits * 100 >= precision.of * 90, "precision {precision}");
}
