//! The recordings of US-101, where the data is there: layouts agree, and lane changes are those of the reference list.

use std::collections::BTreeMap;
use std::path::Path;

use closecall_scenarios::filters::smooth;
use closecall_scenarios::lane_change::{LaneChange, detect};
use closecall_scenarios::recordings::{Layout, Recording, quality, read};
use closecall_traffic::{Lane, Side, Time};

use crate::support::data_folder;

/// A lane change of the reference list.
struct Reference {
    track_id: u64,
    time_s: f64,
    direction: Side,
    clear: bool,
}

/// The reference list by recording.
fn references(folder: &Path) -> BTreeMap<String, Vec<Reference>> {
    let text = std::fs::read_to_string(folder.join("ngsim_us101/reference_lane_changes.csv")).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let place = |name| header.iter().position(|column| *column == name).unwrap();
    let (recording, track, time) = (place("recording_id"), place("track_id"), place("time_s"));
    let (direction, clear) = (place("direction"), place("clear"));
    let mut found: BTreeMap<String, Vec<Reference>> = BTreeMap::new();
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        found.entry(fields[recording].to_owned()).or_default().push(Reference {
            track_id: fields[track].parse().unwrap(),
            time_s: fields[time].parse().unwrap(),
            direction: if fields[direction] == "left" { Side::Left } else { Side::Right },
            clear: fields[clear] == "1",
        });
    }
    found
}

fn recordings(folder: &Path) -> Vec<Recording> {
    let entries = std::fs::read_dir(folder.join("ngsim_us101/trajectories")).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| read(path).unwrap()).collect()
}

/// Largest difference between the crossing found and the reference's [s].
const CROSSING_S: f64 = 0.5;

fn agrees(found: &LaneChange, reference: &Reference) -> bool {
    found.track_id == reference.track_id
        && found.direction == reference.direction
        && (found.crossing_s - reference.time_s).abs() <= CROSSING_S
}

/// Clear ones with at least 2 s of track on both sides have to be found.
fn has_to_be_found(recording: &Recording, reference: &Reference) -> bool {
    const ON_EACH_SIDE_S: f64 = 2.0;
    let track = recording.trajectories.iter().find(|track| track.track_id == reference.track_id).unwrap();
    let (first, last) = track.span().unwrap();
    reference.clear
        && reference.time_s - first.s() >= ON_EACH_SIDE_S - 1e-9
        && last.s() - reference.time_s >= ON_EACH_SIDE_S - 1e-9
}

#[test]
fn lane_changes_are_those_of_the_reference_list() {
    let Some(folder) = data_folder() else { return };
    let mut references = references(&folder);
    let (mut needed, mut recalled, mut found_all, mut right) = (0, 0, 0, 0);
    for recording in recordings(&folder) {
        let listed = references.remove(&recording.name).unwrap_or_default();
        let found = detect(&smooth(&recording));
        for reference in listed.iter().filter(|reference| has_to_be_found(&recording, reference)) {
            needed += 1;
            recalled += usize::from(found.iter().any(|change| agrees(change, reference)));
        }
        found_all += found.len();
        right += found.iter().filter(|change| listed.iter().any(|reference| agrees(change, reference))).count();
    }
    assert!(needed >= 10 && found_all >= 20, "too little data to say: {needed} {found_all}");
    assert!(recalled * 100 >= needed * 95, "recall {recalled} of {needed}");
    assert!(right * 100 >= found_all * 95, "precision {right} of {found_all}");
}

#[test]
fn both_layouts_tell_the_same() {
    let Some(folder) = data_folder() else { return };
    let plain = read(&folder.join("ngsim_us101/trajectories/us101_a.csv")).unwrap();
    let feet = read(&folder.join("ngsim_us101/us101_a_ngsim18col_feet.csv")).unwrap();
    assert_eq!((plain.layout, feet.layout), (Layout::Plain, Layout::Ngsim18));
    assert_eq!(plain.trajectories.len(), feet.trajectories.len());
    for (a, b) in plain.trajectories.iter().zip(&feet.trajectories) {
        assert_eq!((a.track_id, a.points.len()), (b.track_id, b.points.len()));
        for (a, b) in a.points.iter().zip(&b.points) {
            assert_eq!((a.time, a.lane), (b.time, b.lane));
            // Lengths in feet are rounded to a tenth in that file.
            assert!(
                (a.s_m - b.s_m).abs() < 0.02
                    && (a.d_m - b.d_m).abs() < 0.01
                    && (a.speed_mps - b.speed_mps).abs() < 0.01
            );
        }
    }
    let crossings =
        |recording| detect(&smooth(recording)).iter().map(|c| (c.track_id, c.crossing_s)).collect::<Vec<_>>();
    assert_eq!(crossings(&plain), crossings(&feet));
}

#[test]
fn the_original_form_without_header_tells_the_same_as_the_one_with_commas() {
    let Some(folder) = data_folder() else { return };
    let path = folder.join("ngsim_us101/us101_a_ngsim18col_feet.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let blank: String = text.lines().skip(1).map(|line| line.replace(',', "   ") + "\r\n").collect();
    let original = closecall_scenarios::recordings::read_from(blank.as_bytes(), &path).unwrap();
    assert_eq!(original.trajectories, read(&path).unwrap().trajectories);
}

#[test]
fn the_catalogue_export_is_read() {
    let Some(folder) = data_folder() else { return };
    let path = folder.join("ngsim_raw_format_sample/ngsim_socrata_first_1000_rows_peachtree.csv");
    let recording = read(&path).unwrap();
    assert_eq!((recording.layout, recording.name.as_str()), (Layout::Ngsim25, "peachtree"));
    assert_eq!(quality(&recording).instants, 1_000);
}

#[test]
fn the_road_is_that_of_the_recordings_description() {
    let Some(folder) = data_folder() else { return };
    let recording = read(&folder.join("ngsim_us101/trajectories/us101_a.csv")).unwrap();
    assert_eq!(recording.period, Time::from_ms(100));
    for (lane, edge_m) in [(1, 3.5), (2, 6.9), (3, 10.1), (4, 13.5), (5, 17.2)] {
        let found = recording.markings.right_edge_m(Lane(lane)).unwrap();
        assert!((found + edge_m).abs() < 0.2, "lane {lane}: {found}");
    }
    assert!((recording.markings.typical_lane_width_m() - 3.4).abs() < 0.1);
    let found = quality(&recording);
    assert_eq!((found.vehicles, found.tracks, found.instants), (92, 105, 11_221));
}
