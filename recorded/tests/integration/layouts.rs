//! Layouts that hold the same data: highD's three files, CommonRoad XML and plain CSV. Also
//! synthetic highD and exiD files.

use std::path::Path;

use closecall_recorded::filters::smooth;
use closecall_recorded::lane_change::{LaneReliability, detect};
use closecall_recorded::trajectory_data::{
    AxisOptions, BadRows, Layout, LayoutChoice, ReadOptions, TrajectoryData, TrajectoryFileProblem, open, read,
    read_from, read_with,
};
use closecall_traffic::{Lane, Side, Time, maths};

use crate::support::{data_folder, read_text};

#[test]
fn the_highd_layout_yields_the_same_data_as_the_plain_layout() {
    let Some(data) = data_folder() else { return };
    let folder = data.join("highd_format_sample");
    let plain = read(&data.join("ngsim_us101/trajectories/us101_h.csv")).unwrap();
    let highd = read(&folder.join("01_tracks.csv")).unwrap();
    assert_eq!((highd.layout, highd.period), (Layout::Highd, Time::from_ms(100)));
    for path in
        [folder.clone(), folder.join("01"), folder.join("01_tracksMeta.csv"), folder.join("01_recordingMeta.csv")]
    {
        assert_eq!(read(&path).unwrap().trajectories, highd.trajectories, "{}", path.display());
    }
    assert_eq!(highd.trajectories.len(), 27);
    let instants = highd.trajectories.iter().map(|track| track.points.len()).sum::<usize>();
    assert_eq!(instants, 1_574, "each row of the file becomes a track point");
    assert!((highd.markings.lane_width_m(Lane(1)).unwrap() - 3.45).abs() < 1e-9);
    let crossings =
        |data| detect(&smooth(data)).iter().map(|change| (change.direction, change.crossing_s)).collect::<Vec<_>>();
    let (plain_crossings, highd_crossings) = (crossings(&plain), crossings(&highd));
    assert_eq!(
        highd_crossings.len(),
        4,
        "the highD file contains four lane changes; it lacks some rows of the plain file"
    );
    let is_same = |a: &(Side, f64), b: &(Side, f64)| a.0 == b.0 && (a.1 - b.1).abs() <= 0.101;
    assert!(
        highd_crossings.iter().all(|b| plain_crossings.iter().any(|a| is_same(a, b))),
        "{plain_crossings:?} {highd_crossings:?}"
    );
}

#[test]
fn commonroad_scenarios_yield_the_tracks_of_their_source_data() {
    let Some(data) = data_folder() else { return };
    let entries = std::fs::read_dir(data.join("ngsim_us101/commonroad_xml")).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let plain: Vec<TrajectoryData> = ["a", "b", "f", "g", "h", "i"]
        .map(|name| read(&data.join(format!("ngsim_us101/trajectories/us101_{name}.csv"))).unwrap())
        .into();
    let (mut compared, mut same_lane, mut rows) = (0, 0, 0);
    for path in &paths {
        let scenario = read(path).unwrap();
        assert_eq!((scenario.layout, scenario.period), (Layout::Commonroad, Time::from_ms(100)));
        assert!(scenario.trajectories.len() > 1, "{}", path.display());
        for track in &scenario.trajectories {
            rows += track.points.len();
            // Find the same vehicle in the plain files: same number and same sequence of speeds.
            let original = plain.iter().flat_map(|data| &data.trajectories).find_map(|other| {
                let speeds = |points: &[closecall_traffic::TrajectoryPoint]| {
                    points.iter().map(|point| (point.speed_mps * 10.0).round() as i64).collect::<Vec<_>>()
                };
                let (needle, hay) = (speeds(&track.points), speeds(&other.points));
                (other.vehicle_id == track.vehicle_id && needle.len() > 20 && hay.len() >= needle.len())
                    .then(|| hay.windows(needle.len()).position(|part| part == needle))
                    .flatten()
                    .map(|start| &other.points[start..start + needle.len()])
            });
            for (a, b) in track.points.iter().zip(original.unwrap_or_default()) {
                compared += 1;
                same_lane += usize::from(a.lane == b.lane && (a.d_m - b.d_m).abs() < 0.5);
            }
        }
    }
    assert!(rows > 10_000, "{rows}");
    assert!(compared > 3_000, "{compared}");
    assert!(same_lane * 100 >= compared * 95, "{same_lane} of {compared}");
}

#[test]
fn hand_made_commonroad_scenarios_are_read() {
    let Some(data) = data_folder() else { return };
    let merging = read(&data.join("commonroad_crime/ZAM_Zip-1_56_T-1.xml")).unwrap();
    assert_eq!((merging.name.as_str(), merging.trajectories.len()), ("ZAM_Zip-1_56_T-1", 3));
    let cut_in = read(&data.join("commonroad_crime/OSC_CutIn-1_2_T-1.xml")).unwrap();
    assert_eq!(cut_in.trajectories.len(), 2);
    for track in &cut_in.trajectories {
        assert!(track.points.iter().all(|point| point.speed_mps >= 0.0), "no vehicle drives backwards");
        assert!(track.points.windows(2).all(|pair| pair[1].s_m >= pair[0].s_m));
    }
}

/// Writes a highD data set. Vehicle 1 drives to the left on the upper carriageway, vehicle 2 to the
/// right on the lower one.
fn write_both_ways(folder: &Path) {
    let meta = "id,frameRate,upperLaneMarkings,lowerLaneMarkings\n7,25,8.5;12.5;16.5,21.0;25.0;29.0\n";
    std::fs::write(folder.join("07_recordingMeta.csv"), meta).unwrap();
    let meta = "id,numFrames,class,drivingDirection\n1,30,Car,1\n2,30,Truck,2\n";
    std::fs::write(folder.join("07_tracksMeta.csv"), meta).unwrap();
    let mut rows =
        "frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,yAcceleration,precedingId,laneId\n".to_owned();
    for frame in 1..=30 {
        let x_m = 400.0 - 1.2 * f64::from(frame);
        // The vehicle changes from the lane next to the median (laneId 3) to the outer lane, within
        // ten frames.
        let y_m = 13.5 - 0.4 * f64::from((frame - 10).clamp(0, 10));
        let lane = if y_m + 0.9 > 12.5 { 3 } else { 2 };
        rows += &format!("{frame},1,{x_m:.2},{y_m},4.5,1.8,-30.0,0,0.5,0,0,{lane}\n");
    }
    for frame in 1..=30 {
        let x_m = 10.0 + f64::from(frame);
        rows += &format!("{frame},2,{x_m:.2},25.75,12.0,2.5,25.0,0,-0.5,0,0,6\n");
    }
    std::fs::write(folder.join("07_tracks.csv"), rows).unwrap();
}

#[test]
fn both_carriageways_are_driven_forwards_and_are_separated() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    let data = read(folder.path()).unwrap();
    let [upper, lower] = data.trajectories.as_slice() else { panic!() };
    for track in [upper, lower] {
        assert!(track.points.iter().all(|point| point.speed_mps > 0.0));
        assert!(track.points.windows(2).all(|pair| pair[1].s_m > pair[0].s_m), "s increases");
    }
    assert_eq!((upper.points[0].acceleration_mps2, lower.points[0].acceleration_mps2), (-0.5, -0.5));
    // The lower carriageway has lanes 1 and 2, lane number 3 is left out for the median, and the
    // upper carriageway has lanes 4 and 5.
    assert_eq!(lower.points[0].lane, Lane(2));
    assert!(
        (lower.points[0].d_m + 6.0).abs() < 1e-9,
        "y = 27 m is 6 m below the uppermost marking of the lower carriageway"
    );
    assert_eq!((upper.points[0].lane, upper.points[29].lane), (Lane(4), Lane(5)));
    assert!(
        (upper.points[0].d_m + 1_000.0 + 8.0 + 2.1).abs() < 1e-9,
        "the left edge of the upper carriageway is 1 km to the right of the lower one's right edge"
    );
    assert!(upper.points[29].d_m < upper.points[0].d_m, "the vehicle moves to its right");
    assert_eq!(data.markings.lane_width_m(Lane(5)), Some(4.0));
}

/// Changes the rows of a highD data set.
fn rewrite_rows(folder: &Path, change: impl Fn(&mut Vec<String>)) {
    let path = folder.join("07_tracks.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    let mut written = header.to_owned() + "\n";
    for row in rows.lines() {
        let mut fields: Vec<String> = row.split(',').map(str::to_owned).collect();
        change(&mut fields);
        written += &(fields.join(",") + "\n");
    }
    std::fs::write(&path, written).unwrap();
}

#[test]
fn metadata_of_highd_without_a_last_line_end_are_read_and_cut_ones_are_not() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    let clean = read(folder.path()).unwrap();
    for name in ["07_recordingMeta.csv", "07_tracksMeta.csv"] {
        let path = folder.path().join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.trim_end()).unwrap();
        assert_eq!(read(folder.path()).unwrap().trajectories, clean.trajectories, "{name}");
    }
    let path = folder.path().join("07_tracksMeta.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let cut = text.trim_end().rsplit_once(',').unwrap().0.to_owned();
    std::fs::write(&path, cut.clone() + ",").unwrap();
    assert!(read(folder.path()).unwrap_err().to_string().contains("07_tracksMeta.csv"));
    std::fs::write(&path, cut).unwrap();
    assert!(read(folder.path()).unwrap_err().to_string().contains("07_tracksMeta.csv"));
}

#[test]
fn a_mirrored_carriageway_of_highd_is_refused_and_the_named_option_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    let clean = read(folder.path()).unwrap();
    // The upper carriageway, mirrored at the marking next to the median, y = 16.5 m; then elsewhere.
    let mirrored = |sum_m: f64| {
        write_both_ways(folder.path());
        rewrite_rows(folder.path(), |fields| {
            if fields[1] == "1" {
                fields[3] = format!("{}", sum_m - fields[3].parse::<f64>().unwrap());
            }
        });
    };
    mirrored(31.2);
    let problem = read(folder.path()).unwrap_err().problem;
    let TrajectoryFileProblem::LanesAgainstPosition { is_mirrored, .. } = problem else { panic!("{problem}") };
    assert!(is_mirrored);
    let axes = AxisOptions { mirror_d: true, ..AxisOptions::default() };
    let options = ReadOptions { axes, ..ReadOptions::default() };
    let mended = read_with(folder.path(), options).unwrap();
    for (mended, clean) in mended.trajectories[0].points.iter().zip(&clean.trajectories[0].points) {
        assert!((mended.d_m - clean.d_m).abs() < 1e-9 && mended.lane == clean.lane, "{mended:?} {clean:?}");
    }
    mirrored(60.0);
    assert!(read(folder.path()).is_err());
    let mended = read_with(folder.path(), options).unwrap();
    let [mended, clean] = [&mended, &clean].map(|data| data.trajectories[0].points[0].d_m);
    assert!((mended - clean).abs() < 0.75, "{mended} {clean}: to a part of a lane");
}

#[test]
fn lane_numbers_of_highd_that_do_not_fit_its_markings_are_refused() {
    for off in [1, -1] {
        let folder = tempfile::tempdir().unwrap();
        write_both_ways(folder.path());
        rewrite_rows(folder.path(), |fields| {
            let lane: i64 = fields[11].parse().unwrap();
            fields[11] = (lane + off).to_string();
        });
        let problem = read(folder.path()).unwrap_err().problem;
        assert!(matches!(problem, TrajectoryFileProblem::LanesBesideMarkings { .. }), "{off}: {problem}");
        // Lanes that are not used may be wrong.
        let options = ReadOptions { lanes: LaneReliability::Unreliable, ..ReadOptions::default() };
        assert!(read_with(folder.path(), options).is_ok());
    }
}

#[test]
fn markings_of_highd_beside_its_traffic_and_a_wrong_frame_rate_are_named() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    let is_shifted = |note: &String| note.contains("1.5 m to the right of the middles of their lanes");
    let clean = read(folder.path()).unwrap();
    assert!(!clean.notes.iter().any(|note| note.contains("middles")), "{:?}", clean.notes);
    // The lower carriageway lies 1.5 m further to the right, still within the markings of its lane.
    rewrite_rows(folder.path(), |fields| {
        if fields[1] == "2" {
            fields[3] = format!("{}", fields[3].parse::<f64>().unwrap() + 1.5);
        }
    });
    let shifted = read(folder.path()).unwrap();
    assert!(shifted.notes.iter().any(is_shifted), "{:?}", shifted.notes);
    write_both_ways(folder.path());
    let path = folder.path().join("07_recordingMeta.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace("7,25,", "7,10,")).unwrap();
    let message = read(folder.path()).unwrap_err().to_string();
    assert!(
        message.contains("as a share of what the recorded speed makes") && message.contains("`frameRate`"),
        "{message}"
    );
}

#[test]
fn a_frame_rate_that_is_wrong_by_a_fifth_is_in_doubt() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    let path = folder.path().join("07_recordingMeta.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let with_rate = |rate: &str| {
        std::fs::write(&path, text.replace("7,25,", &format!("7,{rate},"))).unwrap();
        let data = read(folder.path()).unwrap();
        let note = data.notes.iter().find(|note| note.contains("than the recorded speeds make")).cloned();
        assert_eq!(data.is_in_doubt, note.is_some(), "{rate} Hz: {:?}", data.notes);
        note
    };
    assert_eq!(with_rate("25"), None);
    assert_eq!(with_rate("26"), None, "errors of speeds are as large");
    let note = with_rate("30").expect("a note");
    assert!(note.starts_with("positions advance 20 % further") && note.contains("frame rate"), "{note}");
    let note = with_rate("20").expect("a note");
    assert!(note.starts_with("positions advance 20 % less far"), "{note}");
}

#[test]
fn highd_traffic_beside_its_carriageway_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    // The driving directions follow the mirrored x, so that the vehicles keep to the other side of the
    // median, as in traffic on the left.
    rewrite_rows(folder.path(), |fields| {
        let (x_m, length_m): (f64, f64) = (fields[2].parse().unwrap(), fields[4].parse().unwrap());
        fields[2] = format!("{:.2}", 400.0 - x_m - length_m);
        fields[6] = format!("{}", -fields[6].parse::<f64>().unwrap());
        fields[8] = format!("{}", -fields[8].parse::<f64>().unwrap());
    });
    let meta = "id,numFrames,class,drivingDirection\n1,30,Car,2\n2,30,Truck,1\n";
    std::fs::write(folder.path().join("07_tracksMeta.csv"), meta).unwrap();
    for lanes in [LaneReliability::Reliable, LaneReliability::Unreliable] {
        let error = read_with(folder.path(), ReadOptions { lanes, ..ReadOptions::default() }).unwrap_err();
        let is_beside = matches!(error.problem, TrajectoryFileProblem::BesideCarriageway { .. });
        assert!(is_beside && error.to_string().contains("drives on the left"), "{error}");
    }
}

#[test]
fn a_carriageway_of_highd_without_markings_is_refused_by_that_reason() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    assert!(read(folder.path()).is_ok());
    let meta = "id,frameRate,upperLaneMarkings,lowerLaneMarkings\n7,25,,21.0;25.0;29.0\n";
    std::fs::write(folder.path().join("07_recordingMeta.csv"), meta).unwrap();
    let message = read(folder.path()).unwrap_err().to_string();
    assert!(message.contains("vehicle 1") && message.contains("no `upperLaneMarkings`"), "{message}");
}

#[test]
fn driving_directions_of_highd_against_its_velocities_are_refused_as_a_whole() {
    let skip = ReadOptions { bad_rows: BadRows::Skip, ..ReadOptions::default() };
    let swap_directions = |folder: &Path| {
        let path = folder.join("07_tracksMeta.csv");
        let text = std::fs::read_to_string(&path).unwrap().replace("Car,1", "Car,3").replace("Truck,2", "Truck,1");
        std::fs::write(path, text.replace("Car,3", "Car,2")).unwrap();
    };
    let mirror_x = |folder: &Path| {
        rewrite_rows(folder, |fields| {
            let (x_m, length_m): (f64, f64) = (fields[2].parse().unwrap(), fields[4].parse().unwrap());
            fields[2] = format!("{:.2}", 400.0 - x_m - length_m);
            fields[6] = format!("{}", -fields[6].parse::<f64>().unwrap());
        });
    };
    let without_sign =
        |folder: &Path| rewrite_rows(folder, |fields| fields[6] = fields[6].trim_start_matches('-').to_owned());
    let cases: [&dyn Fn(&Path); 3] = [&swap_directions, &mirror_x, &without_sign];
    for change in cases {
        let folder = tempfile::tempdir().unwrap();
        write_both_ways(folder.path());
        change(folder.path());
        for options in [ReadOptions::default(), skip] {
            let error = read_with(folder.path(), options).unwrap_err();
            let is_whole = matches!(error.problem, TrajectoryFileProblem::AgainstDrivingDirection { .. });
            assert!(is_whole && error.to_string().contains("07_tracksMeta.csv"), "{error}");
        }
    }
    // A single wrong row is left out.
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    rewrite_rows(folder.path(), |fields| {
        if fields[0] == "7" && fields[1] == "2" {
            fields[6] = "-25.0".to_owned();
        }
    });
    assert!(read(folder.path()).unwrap_err().problem.affects_one_row());
    assert!(read_with(folder.path(), skip).is_ok());
}

#[test]
fn a_file_of_another_layout_than_required_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    write_both_ways(folder.path());
    let path = folder.path().join("07_tracks.csv");
    let asked = |layout| read_with(&path, ReadOptions { layout: Some(layout), ..ReadOptions::default() });
    assert!(asked(LayoutChoice::Highd).is_ok());
    let error = asked(LayoutChoice::Ngsim).unwrap_err();
    assert!(error.to_string().contains("the layout highd, not in ngsim as asked for"), "{error}");
    assert!(open(&path, ReadOptions::default()).is_ok());
    let alone = read_from(std::fs::File::open(&path).unwrap(), &path).unwrap_err();
    assert!(matches!(alone.problem, TrajectoryFileProblem::NeedsMetadata));
}

/// Writes an exiD data set of a road that bends with a radius of 2 km and is driven in both
/// directions. The first direction has two lanes. Vehicle 1 keeps the right lane, vehicle 2 changes
/// from the right to the left lane, vehicle 3 keeps the left lane, and vehicle 4 drives in the
/// opposite direction. Each lane is a lanelet, or, unless `names_lanes`, all lanes are one lanelet.
fn write_bent_both_ways(folder: &Path, names_lanes: bool) {
    const RADIUS_M: f64 = 2_000.0;
    const LANE_M: f64 = 3.75;
    let meta = "recordingId,locationId,frameRate\n3,0,25\n";
    std::fs::write(folder.join("03_recordingMeta.csv"), meta).unwrap();
    let header = "recordingId,trackId,initialFrame,finalFrame,numFrames,width,length,class\n";
    let vehicles = ["car", "van", "truck", "motorcycle"];
    let meta: String =
        vehicles.iter().enumerate().map(|(k, class)| format!("3,{},0,249,250,1.9,4.7,{class}\n", k + 1)).collect();
    std::fs::write(folder.join("03_tracksMeta.csv"), format!("{header}{meta}")).unwrap();
    let mut rows = "recordingId,trackId,frame,xCenter,yCenter,heading,width,length,xVelocity,yVelocity,lonVelocity,\
                    latVelocity,lonAcceleration,latAcceleration,laneWidth,laneletId,laneChange\n"
        .to_owned();
    for vehicle in 1..=4 {
        for frame in 0..250 {
            let time_s = 0.04 * f64::from(frame);
            let tau = ((time_s - 3.0) / 4.0).clamp(0.0, 1.0);
            let shape = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
            // Offset to the left of the middle of the first direction's right lane.
            let left_m = match vehicle {
                1 => 0.0,
                2 => LANE_M * shape,
                3 => LANE_M,
                _ => 4.0 * LANE_M,
            };
            let is_back = vehicle == 4;
            let along_m = if is_back { 290.0 - 29.0 * time_s } else { 20.0 + (24.0 + f64::from(vehicle)) * time_s };
            let angle = along_m / RADIUS_M;
            let (x_m, y_m) =
                ((RADIUS_M - left_m) * maths::sin(angle), RADIUS_M - (RADIUS_M - left_m) * maths::cos(angle));
            let heading = angle.to_degrees() + if is_back { 180.0 } else { 0.0 };
            let speed_mps = if is_back { 29.0 } else { 24.0 + f64::from(vehicle) };
            let changes = u8::from(vehicle == 2 && frame == 125);
            let lanelet = match vehicle {
                _ if !names_lanes => 12,
                1 => 12,
                2 if frame < 125 => 12,
                2 | 3 => 13,
                _ => 14,
            };
            rows += &format!(
                "3,{vehicle},{frame},{x_m:.4},{y_m:.4},{heading:.4},1.9,4.7,0,0,{speed_mps},0,0.5,0,{LANE_M};3.7,{lanelet};99,{changes}\n"
            );
        }
    }
    std::fs::write(folder.join("03_tracks.csv"), rows).unwrap();
}

#[test]
fn the_road_of_exid_data_is_inferred_from_its_traffic() {
    let folder = tempfile::tempdir().unwrap();
    write_bent_both_ways(folder.path(), true);
    let data = read(folder.path()).unwrap();
    assert!(!data.is_in_doubt, "{:?}", data.warnings());
    assert_eq!((data.layout, data.period), (Layout::Exid, Time::from_ms(40)));
    let [keeps, changes, left, back] = data.trajectories.as_slice() else { panic!() };
    let lanes = |track: &closecall_traffic::Trajectory| (track.points[0].lane.0, track.points[249].lane.0);
    assert_eq!((lanes(keeps), lanes(changes), lanes(left), lanes(back)), ((2, 2), (2, 1), (1, 1), (4, 4)));
    for track in &data.trajectories {
        assert!(track.points.windows(2).all(|pair| pair[1].s_m > pair[0].s_m), "s increases");
    }
    let d_m = |track: &closecall_traffic::Trajectory| track.points[249].d_m;
    assert!((d_m(keeps) + 1.5 * 3.75).abs() < 0.05 && (d_m(changes) + 0.5 * 3.75).abs() < 0.05);
    assert!((d_m(back) + 2.0 * 3.75 + 1_000.0 + 0.5 * 3.75).abs() < 0.05, "{}", d_m(back));
    let changes = detect(&smooth(&data));
    assert_eq!(changes.iter().map(|change| change.track_id).collect::<Vec<_>>(), [2]);
    assert!((changes[0].crossing_s - 5.0).abs() < 0.2, "{}", changes[0].crossing_s);
}

#[test]
fn a_lane_change_of_exid_without_another_lanelet_is_in_doubt() {
    let folder = tempfile::tempdir().unwrap();
    write_bent_both_ways(folder.path(), false);
    let data = read(folder.path()).unwrap();
    assert!(detect(&smooth(&data)).is_empty() && data.is_in_doubt);
    let warnings = data.warnings();
    assert!(
        warnings.iter().any(|warning| warning.starts_with("1 of 1 lane changes that the file states")),
        "{warnings:?}"
    );
}

#[test]
fn positions_far_from_the_origin_of_a_road_are_read() {
    let mut text =
        "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
    for frame in 0..40 {
        let time_s = 0.1 * f64::from(frame);
        text += &format!("1,{frame},{time_s:.1},{:.2},1.75,1,30,0,4.5,1.8,car\n", 5_300_000.0 + 30.0 * time_s);
    }
    let data = read_text(text.as_bytes()).unwrap();
    assert!((data.trajectories[0].points[39].s_m - 5_300_117.0).abs() < 0.01);
}
