//! Files of other programs: SUMO, Vissim, I-24 MOTION, Parquet, inD; what they mean, and what is
//! refused.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use closecall_recorded::filters::smooth;
use closecall_recorded::lane_change::{LaneReliability, detect};
use closecall_recorded::trajectory_data::{
    AxisOptions, BadRows, Layout, LayoutChoice, PIECE_STRIDE, ReadOptions, TrajectoryData, TrajectoryFileError,
    TrajectoryFileProblem, open_from, read, read_from, read_with,
};
use closecall_traffic::{Side, Time, VehicleClass, maths};
use parquet::basic::{Compression, GzipLevel, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::support::{PLAIN_HEADER, assert_mentions, read_text};

/// Width of SUMO's lanes in the made-up network (m).
const SUMO_LANE_M: f64 = 3.2;

/// One vehicle of a made-up road along +x: lanes 0 (right) to 2 (left), y up.
struct Drive {
    id: &'static str,
    kind: &'static str,
    /// Index of the first and of the last lane.
    lanes: [i32; 2],
    start_m: f64,
    speed_mps: f64,
}

const DRIVES: [Drive; 4] = [
    Drive { id: "f.0", kind: "car", lanes: [2, 2], start_m: 0.0, speed_mps: 32.0 },
    Drive { id: "f.1", kind: "car", lanes: [0, 1], start_m: 10.0, speed_mps: 30.0 },
    Drive { id: "t.0", kind: "trailer", lanes: [0, 0], start_m: 40.0, speed_mps: 24.0 },
    Drive { id: "f.2", kind: "car", lanes: [1, 1], start_m: -5.0, speed_mps: 31.0 },
];

impl Drive {
    /// Returns the front (m), y of the middle (m) and the lane at a time.
    fn at(&self, time_s: f64, jumps: bool) -> (f64, f64, i32) {
        let tau = if jumps { f64::from(u8::from(time_s >= 6.0)) } else { ((time_s - 4.0) / 4.0).clamp(0.0, 1.0) };
        let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        let [from, to] = self.lanes;
        let index = if share < 0.5 { from } else { to };
        let y_m = SUMO_LANE_M * (f64::from(from) + share * f64::from(to - from) - 2.5);
        (self.start_m + self.speed_mps * time_s, y_m, index)
    }

    /// Returns the row of the drive in the order `id, x, y, angle, type, speed, pos, lane`. The road
    /// consists of two edges, which meet at x = 150 m.
    fn row(&self, time_s: f64, jumps: bool) -> [String; 8] {
        let (front_m, y_m, index) = self.at(time_s, jumps);
        let edge = if front_m < 150.0 { "e0" } else { "e1" };
        [
            self.id.to_owned(),
            format!("{front_m:.3}"),
            format!("{y_m:.3}"),
            "90.00".to_owned(),
            self.kind.to_owned(),
            format!("{:.2}", self.speed_mps),
            format!("{:.2}", front_m.rem_euclid(150.0)),
            format!("{edge}_{index}"),
        ]
    }
}

const NAMES: [&str; 8] = ["id", "x", "y", "angle", "type", "speed", "pos", "lane"];

fn times_s() -> impl Iterator<Item = f64> {
    (0..120).map(|step| 0.1 * f64::from(step))
}

pub(crate) fn sumo_xml(jumps: bool) -> String {
    let mut text = "<?xml version=\"1.0\"?>\n<!-- by SUMO -->\n<fcd-export>\n".to_owned();
    for time_s in times_s() {
        writeln!(text, "<timestep time=\"{time_s:.2}\">").unwrap();
        for drive in &DRIVES {
            let values = drive.row(time_s, jumps);
            let attributes: Vec<String> =
                NAMES.iter().zip(&values).map(|(name, value)| format!("{name}=\"{value}\"")).collect();
            writeln!(text, "<vehicle {}/>", attributes.join(" ")).unwrap();
        }
        text += "<person id=\"p\" x=\"0\" y=\"0\"/>\n</timestep>\n";
    }
    text + "</fcd-export>\n"
}

/// Two pairs of vehicles side by side. From 6 s on, the names of the first pair are exchanged if `are_exchanged`.
fn side_by_side(are_exchanged: bool) -> String {
    let mut text = "<fcd-export>\n".to_owned();
    for time_s in times_s() {
        writeln!(text, "<timestep time=\"{time_s:.2}\">").unwrap();
        for (vehicle, lane, start_m) in [(0, 0, 0.0), (1, 1, 1.5), (2, 0, 60.0), (3, 1, 70.0)] {
            let other = if are_exchanged && vehicle < 2 && time_s >= 6.0 { 1 - vehicle } else { vehicle };
            let (front_m, y_m) = (start_m + 30.0 * time_s, SUMO_LANE_M * (f64::from(lane) - 2.5));
            writeln!(
                text,
                "<vehicle id=\"{other}\" x=\"{front_m:.3}\" y=\"{y_m:.3}\" angle=\"90.00\" type=\"car\" speed=\"30.00\" \
                 pos=\"{front_m:.2}\" lane=\"e0_{lane}\"/>"
            )
            .unwrap();
        }
        text += "</timestep>\n";
    }
    text + "</fcd-export>\n"
}

#[test]
fn a_table_of_floating_car_data_in_another_order_has_the_same_lane_change() {
    let text = sumo_table(";", true);
    let (header, rows) = text.split_once('\n').unwrap();
    let backwards: Vec<&str> = rows.lines().rev().collect();
    let data = read_text(format!("{header}\n{}\n", backwards.join("\n")).as_bytes()).unwrap();
    assert!(!data.is_in_doubt, "{:?}", data.notes);
    // The names are no numbers: vehicles are numbered in the order of their first rows.
    let changes = detect(&smooth(&data));
    assert_eq!(changes.iter().map(|change| (change.track_id, change.direction)).collect::<Vec<_>>(), [(3, Side::Left)]);
}

#[test]
fn exchanged_numbers_of_a_simulation_are_no_lane_changes_of_a_single_step() {
    let has_single_steps = |data: &TrajectoryData| data.notes.iter().any(|note| note.contains("a single step"));
    for (are_exchanged, jumps) in [(false, 0), (true, 2)] {
        let data = read_text(side_by_side(are_exchanged).as_bytes()).unwrap();
        assert_eq!(data.continuity.jumps, jumps, "{:?}", data.notes);
        assert!(detect(&smooth(&data)).is_empty() && !has_single_steps(&data), "{:?}", data.notes);
    }
    assert!(has_single_steps(&read_text(sumo_xml(true).as_bytes()).unwrap()));
}

fn sumo_table(separator: &str, has_prefix: bool) -> String {
    let name = |name: &&str| if has_prefix { format!("vehicle_{name}") } else { (*name).to_owned() };
    let mut header = vec![if has_prefix { "timestep_time".to_owned() } else { "time".to_owned() }];
    header.extend(NAMES.iter().map(name));
    let mut text = header.join(separator) + "\n";
    for time_s in times_s() {
        for drive in &DRIVES {
            writeln!(text, "{time_s:.2}{separator}{}", drive.row(time_s, false).join(separator)).unwrap();
        }
    }
    text
}

/// Returns the lanes in which each vehicle is in its first and in its last frame.
fn first_and_last_lanes(data: &TrajectoryData) -> Vec<(u8, u8)> {
    data.trajectories.iter().map(|track| (track.points[0].lane.0, track.points[119].lane.0)).collect()
}

/// Asserts that one vehicle changes lanes, number 2 to the left, and returns when it crosses the
/// marking (s).
fn assert_one_lane_change(data: &TrajectoryData) -> f64 {
    let changes = detect(&smooth(data));
    let [change] = &changes[..] else { panic!("{}", changes.len()) };
    assert_eq!((change.track_id, change.direction), (2, Side::Left));
    change.crossing_s
}

/// Asserts that the made-up road was read as it is.
fn assert_is_made_up_road(data: &TrajectoryData) {
    assert_eq!((data.layout, data.period), (Layout::Sumo, Time::from_ms(100)));
    assert_eq!(first_and_last_lanes(data), [(1, 1), (3, 2), (3, 3), (2, 2)], "SUMO counts its lanes from the right");
    assert!((data.markings.typical_lane_width_m() - SUMO_LANE_M).abs() < 0.01);
    let truck = &data.trajectories[2];
    assert_eq!((truck.class, truck.dimensions.length_m), (VehicleClass::Truck, 16.5));
    // The centre is half a length behind the front.
    let apart_m = truck.points[0].s_m - data.trajectories[1].points[0].s_m;
    assert!((apart_m - (30.0 - 0.5 * (16.5 - 5.0))).abs() < 0.01, "{apart_m}");
    assert!(data.notes.iter().any(|note| note.contains("`f.0` is 1")), "{:?}", data.notes);
    let crossing_s = assert_one_lane_change(data);
    assert!((crossing_s - 6.0).abs() < 0.15, "{crossing_s}");
}

#[test]
fn floating_car_data_of_sumo_is_read_as_xml_and_as_a_table() {
    assert_is_made_up_road(&read_text(sumo_xml(false).as_bytes()).unwrap());
    for (separator, has_prefix) in [(";", true), (",", true), (";", false)] {
        assert_is_made_up_road(&read_text(sumo_table(separator, has_prefix).as_bytes()).unwrap());
    }
    // Without the line end of the last row, and with decimal commas.
    let table = sumo_table(";", true).trim_end().replace('.', ",").replace("f,", "f.").replace("t,", "t.");
    assert_is_made_up_road(&read_text(table.as_bytes()).unwrap());
}

#[test]
fn a_lane_change_in_a_single_step_of_sumo_is_one_and_its_duration_is_named_as_meaningless() {
    let data = read_text(sumo_xml(true).as_bytes()).unwrap();
    assert_eq!(data.continuity.jumps, 0, "a simulation does not swap its vehicles");
    assert!(data.notes.iter().any(|note| note.starts_with("1 lane changes take a single step")), "{:?}", data.notes);
    let tracks = &data.trajectories;
    assert_eq!(tracks.len(), 4);
    assert!(tracks[1].points.windows(2).any(|pair| pair[0].lane != pair[1].lane));
}

#[test]
fn a_simulation_that_models_the_movement_is_in_doubt_if_its_frames_are_far_apart() {
    // Every fourth time step, 0.4 s apart.
    let coarse = |jumps: bool| {
        let text = sumo_xml(jumps);
        let (head, steps) = text.split_once("<timestep").unwrap();
        let kept: Vec<&str> = steps.trim_end_matches("</fcd-export>\n").split("<timestep").step_by(4).collect();
        let data = read_text(format!("{head}<timestep{}</fcd-export>\n", kept.join("<timestep")).as_bytes()).unwrap();
        let is_named = data.warnings().iter().any(|warning| warning.contains("a row only every 0.40 s"));
        (data.is_in_doubt, is_named)
    };
    assert_eq!(coarse(false), (true, true));
    // Between no two frames is a lane change of a single step lost.
    assert_eq!(coarse(true), (false, false));
}

#[test]
fn rows_whose_numbers_follow_one_another_are_far_apart_by_their_times() {
    let header = "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_Length,v_Width,v_Class,\
                  v_Vel,v_Acc,Lane_ID,Preceding,Following,Space_Headway,Time_Headway";
    let doubt = |step_ms: i64| {
        let mut text = header.to_owned() + "\n";
        for frame in 1..40 {
            let (time_ms, along_ft) = (1_118_846_980_000 + step_ms * frame, 100 + step_ms * frame / 20);
            writeln!(text, "7,{frame},40,{time_ms},20.0,{along_ft},0,0,15.0,6.0,2,50.0,0.0,2,0,0,0.0,0.0").unwrap();
        }
        let data = read_text(text.as_bytes()).unwrap();
        let is_named = data.warnings().iter().any(|warning| warning.contains("there is a row only every 0.3"));
        (data.is_in_doubt, is_named)
    };
    assert_eq!([100, 200, 300].map(doubt), [(false, false); 3]);
    assert_eq!(doubt(400), (true, true));
}

/// Fifteen vehicles that weave within three lanes of different widths, and a sixteenth that changes
/// lanes: name, lane, seconds, position along the road, to the left and lane at that time.
fn weaving(mut visit: impl FnMut(u32, f64, f64, f64, usize)) {
    const MIDDLES_M: [f64; 3] = [0.0, 3.3, 7.1];
    for step in 0..250 {
        let time_s = 0.1 * f64::from(step);
        for vehicle in 0..16_u32 {
            let speed_mps = 24.0 + 0.3 * f64::from(vehicle);
            let x_m = speed_mps * time_s;
            let (lane, shift_m) = match vehicle {
                15 => {
                    let tau = ((time_s - 10.0) / 5.0).clamp(0.0, 1.0);
                    let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
                    (usize::from(time_s >= 12.5), share * MIDDLES_M[1])
                }
                _ => {
                    let lane = vehicle as usize % 3;
                    let phase = 2.4 * f64::from(vehicle);
                    (lane, MIDDLES_M[lane] + 0.9 * maths::sin(x_m / 35.0 + phase))
                }
            };
            visit(vehicle, time_s, x_m, shift_m, lane);
        }
    }
}

/// Asserts that a recording of [`weaving`] has one lane change, and its positions within a few
/// decimetres.
fn assert_is_weaving(data: &TrajectoryData) {
    let changes: Vec<_> = detect(&smooth(data)).iter().map(|change| (change.vehicle_id, change.direction)).collect();
    let last = data.trajectories.last().unwrap();
    assert_eq!(changes, [(last.vehicle_id, Side::Left)]);
    let mut departures: Vec<f64> = Vec::new();
    weaving(|vehicle, time_s, _, left_m, lane| {
        let track = &data.trajectories[vehicle as usize];
        let point = track.at(Time::from_s(time_s)).unwrap();
        assert_eq!(usize::from(point.lane.0), 3 - lane, "vehicle {vehicle} at {time_s} s");
        departures.push(point.d_m - left_m);
    });
    departures.sort_by(f64::total_cmp);
    let spread_m = departures[departures.len() * 19 / 20] - departures[departures.len() / 20];
    assert!(spread_m < 0.9, "{spread_m}: a single driver weaves by 1.8 m");
}

#[test]
fn the_lanes_that_a_file_names_are_kept_while_every_driver_weaves() {
    let mut table = "timestep_time,vehicle_id,vehicle_x,vehicle_y,vehicle_angle,vehicle_type,vehicle_speed,vehicle_pos,vehicle_lane\n"
        .to_owned();
    weaving(|vehicle, time_s, x_m, left_m, lane| {
        let speed_mps = 24.0 + 0.3 * f64::from(vehicle);
        let edge = if x_m < 200.0 { "in" } else { "out" };
        writeln!(table, "{time_s:.2},{vehicle},{x_m:.3},{left_m:.3},90.00,car,{speed_mps:.2},0.00,{edge}_{lane}")
            .unwrap();
    });
    assert_is_weaving(&read_text(table.as_bytes()).unwrap());

    let folder = tempfile::tempdir().unwrap();
    let mut rows: Vec<(u32, String)> = Vec::new();
    weaving(|vehicle, time_s, x_m, left_m, lane| {
        let speed_mps = 24.0 + 0.3 * f64::from(vehicle);
        let lanelet = if x_m < 200.0 { 10 + lane } else { 20 + lane };
        let frame = (10.0 * time_s).round();
        let offset_m = left_m - [0.0, 3.3, 7.1][lane];
        let line = format!(
            "1,{vehicle},{frame},{x_m:.3},{left_m:.3},0.0,1.8,4.5,{speed_mps},0,{offset_m:.3},3.5,{lanelet},0\n"
        );
        rows.push((vehicle, line));
    });
    rows.sort_by_key(|(vehicle, _)| *vehicle);
    let header = "recordingId,trackId,frame,xCenter,yCenter,heading,width,length,lonVelocity,lonAcceleration,latLaneCenterOffset,\
                  laneWidth,laneletId,laneChange\n";
    let text: String = rows.iter().map(|(_, line)| line.as_str()).collect();
    std::fs::write(folder.path().join("01_tracks.csv"), header.to_owned() + &text).unwrap();
    let meta: String = (0..16).map(|vehicle| format!("1,{vehicle},250,car\n")).collect();
    std::fs::write(folder.path().join("01_tracksMeta.csv"), "recordingId,trackId,numFrames,class\n".to_owned() + &meta)
        .unwrap();
    std::fs::write(folder.path().join("01_recordingMeta.csv"), "recordingId,frameRate\n1,10\n").unwrap();
    assert_is_weaving(&read(folder.path()).unwrap());
}

#[test]
fn malformed_floating_car_data_is_refused() {
    let good = sumo_xml(false);
    let bomb = good.replace("<fcd-export>", "<!DOCTYPE a [<!ENTITY b \"bbbb\"><!ENTITY c \"&b;&b;\">]>\n<fcd-export>");
    for (text, needed) in [
        (bomb, vec!["line", "floating car data", "document type declaration"]),
        (good.replace("</timestep>", ""), vec!["floating car data"]),
        (good.chars().take(5_000).collect(), vec!["line", "floating car data", "not closed"]),
        (good.replacen("x=\"0.000\"", "x=\"nan\"", 1), vec!["line 5", "`x`", "is `nan`"]),
        (good.replacen("angle=\"90.00\"", "", 1), vec!["line 5", "`angle`", "-360 to 720"]),
        (good.replacen("speed=\"32.00\"", "speed=\"3200\"", 1), vec!["line 5", "`speed`", "0 to 150"]),
        (good.replacen("id=\"f.0\"", "id=\"\"", 1), vec!["line 5", "`id`", "name of a vehicle"]),
        (good.replacen("time=\"0.00\"", "time=\"x\"", 1), vec!["line 5", "`time`", "is `x`"]),
        (good.replace("fcd-export>", "fcd-exports>"), vec!["fcd-export` is needed"]),
        (sumo_table(";", true).replace("vehicle_angle", "vehicle_angel"), vec!["line 1", "no column `angle`", "SUMO"]),
        (sumo_table(";", true) + "12.0;f.0;1\n", vec!["line 482", "3 columns, but 9 are needed"]),
        ("<fcd-export>\n</fcd-export>\n".to_owned(), vec!["no rows"]),
    ] {
        let error = read_text(text.as_bytes()).expect_err(&text[..text.len().min(300)]);
        assert_mentions(&error, &needed, &text[..text.len().min(200)]);
        assert!(!error.is_io());
    }
    // Bad rows can be left out.
    let text = good.replacen("x=\"0.000\"", "x=\"nan\"", 1);
    let options = ReadOptions { bad_rows: BadRows::Skip, ..ReadOptions::default() };
    let mut tracks = open_from(text.as_bytes(), Path::new("fcd.xml"), options, usize::MAX).unwrap();
    while tracks.next_track().unwrap().is_some() {}
    assert_eq!(tracks.dropped().count(), 1);
}

/// Vehicles that drive in a circle about a centre, as at a roundabout, and some that turn off.
#[test]
fn traffic_without_a_road_is_refused_with_the_reason() {
    let mut text = "<fcd-export>\n".to_owned();
    for time_s in times_s() {
        writeln!(text, "<timestep time=\"{time_s:.2}\">").unwrap();
        for number in 0..12 {
            let (angle, is_left) = (30.0 * f64::from(number) + 9.0 * time_s, number % 2 == 0);
            let (radius_m, turn) = if is_left { (60.0, 1.0) } else { (160.0, -1.0) };
            let (sin, cos) = maths::sin_cos((turn * angle).to_radians());
            let heading = turn * angle + turn * 90.0;
            writeln!(
                text,
                "<vehicle id=\"{number}\" x=\"{:.2}\" y=\"{:.2}\" angle=\"{:.1}\" type=\"car\" speed=\"{:.2}\" lane=\"r_0\"/>",
                radius_m * cos,
                radius_m * sin,
                (90.0 - heading).rem_euclid(360.0),
                radius_m * 9.0_f64.to_radians(),
            )
            .unwrap();
        }
        text += "</timestep>\n";
    }
    text += "</fcd-export>\n";
    let error = read_text(text.as_bytes()).unwrap_err();
    assert_mentions(&error, &["does not follow a road", "roundabouts"], "a roundabout");
}

#[test]
fn headings_in_other_axes_than_the_positions_are_refused_by_that_reason() {
    let text = sumo_xml(false).replace("angle=\"90.00\"", "angle=\"0.00\"");
    assert_mentions(
        &read_text(text.as_bytes()).unwrap_err(),
        &["than its heading states", "different axes"],
        "headings",
    );
    // One heading for both carriageways.
    let text = unnamed_road(true, false).replace("angle=\"270\"", "angle=\"90\"");
    assert_mentions(
        &read_text(text.as_bytes()).unwrap_err(),
        &["in 47 % of the movements", "different axes"],
        "one heading",
    );
}

#[test]
fn speeds_and_times_in_other_units_are_the_reason_why_traffic_in_a_plane_does_not_seem_to_move() {
    let of_speed = |drive: &Drive| {
        (format!("speed=\"{:.2}\"", drive.speed_mps), format!("speed=\"{:.2}\"", 3.6 * drive.speed_mps))
    };
    let in_kmh = DRIVES.iter().map(of_speed).fold(sumo_xml(false), |text, (mps, kmh)| text.replace(&mps, &kmh));
    assert_mentions(&read_text(in_kmh.as_bytes()).unwrap_err(), &["is 0.278", "0.8 to 1.25"], "km/h");
    let columns = sumo_table(";", true);
    let (header, rows) = columns.split_once('\n').unwrap();
    let in_ms = rows.lines().map(|line| {
        let (time, rest) = line.split_once(';').unwrap();
        format!("{:.0};{rest}\n", 1_000.0 * time.parse::<f64>().unwrap())
    });
    let in_ms = format!("{header}\n{}", in_ms.collect::<String>());
    assert_mentions(&read_text(in_ms.as_bytes()).unwrap_err(), &["is 0.001", "time between two frames"], "ms");
}

#[test]
fn headings_of_exid_in_other_axes_are_refused_by_that_reason() {
    let folder = tempfile::tempdir().unwrap();
    exid(folder.path(), &[], true);
    let path = folder.path().join("05_tracks.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace(",0.0,1.9,4.7,", ",90.0,1.9,4.7,")).unwrap();
    assert_mentions(
        &read(folder.path()).unwrap_err(),
        &["05_tracks.csv", "100 % of the movements", "different axes"],
        "north",
    );
}

/// Three lanes without names, in which vehicle 2 changes to the left, and, if `is_two_way`, oncoming traffic
/// beside them.
fn unnamed_road(is_two_way: bool, is_mirrored: bool) -> String {
    let sense = if is_mirrored { -1.0 } else { 1.0 };
    let mut text = "<fcd-export>\n".to_owned();
    for time_s in times_s() {
        writeln!(text, "<timestep time=\"{time_s:.2}\">").unwrap();
        for number in 1..=36_u32 {
            let is_oncoming = number.is_multiple_of(2) && number > 2;
            if is_oncoming && !is_two_way {
                continue;
            }
            let tau = if number == 2 { ((time_s - 4.0) / 4.0).clamp(0.0, 1.0) } else { 0.0 };
            let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
            let right_m = VISSIM_LANE_M * (f64::from(number % 3) + 0.5 - share);
            let (along_m, angle) = (10.0 * f64::from(number) + 28.0 * time_s, 90);
            let (x_m, y_m, angle) =
                if is_oncoming { (900.0 - along_m, 6.0 + right_m, angle + 180) } else { (along_m, -right_m, angle) };
            writeln!(
                text,
                "<vehicle id=\"{number}\" x=\"{x_m:.3}\" y=\"{:.3}\" angle=\"{angle}\" type=\"car\" speed=\"28\"/>",
                sense * y_m
            )
            .unwrap();
        }
        text += "</timestep>\n";
    }
    text + "</fcd-export>\n"
}

#[test]
fn the_oncoming_traffic_shows_which_side_is_left_and_without_it_a_warning_says_that_nothing_does() {
    let axes = AxisOptions { mirror_d: true, lanes_from_right: true, ..AxisOptions::default() };
    let turned = ReadOptions { axes, ..ReadOptions::default() };
    let read = |is_two_way, is_mirrored, options| {
        let text = unnamed_road(is_two_way, is_mirrored);
        let tracks = open_from(text.as_bytes(), Path::new("a"), options, usize::MAX);
        let data = tracks.and_then(|tracks| tracks.collect_all()).unwrap();
        let changes = detect(&smooth(&data));
        let [change] = &changes[..] else { panic!("{changes:?}") };
        (change.direction, data.doubts_sides, data.is_in_doubt, data.notes.join("\n"))
    };
    let (side, doubts_sides, is_in_doubt, notes) = read(true, false, ReadOptions::default());
    assert_eq!((side, doubts_sides, is_in_doubt), (Side::Left, false, false), "{notes}");
    let (side, doubts_sides, is_in_doubt, notes) = read(true, true, ReadOptions::default());
    assert_eq!((side, doubts_sides, is_in_doubt), (Side::Right, true, true), "{notes}");
    assert!(notes.contains("the oncoming traffic is on the right"), "{notes}");
    let (side, doubts_sides, is_in_doubt, notes) = read(true, true, turned);
    assert_eq!((side, doubts_sides, is_in_doubt), (Side::Left, false, false), "{notes}");
    // What is turned although it is right is in doubt, too.
    assert!(read(true, false, turned).2);
    let (_, doubts_sides, is_in_doubt, notes) = read(false, false, ReadOptions::default());
    assert_eq!((doubts_sides, is_in_doubt), (true, false), "{notes}");
    assert!(notes.contains("which side is left"), "{notes}");
    assert!(!read(false, true, turned).1, "the caller states it");
}

#[test]
fn without_lanes_the_longest_path_of_a_lane_changer_is_no_reference_line() {
    let mut text = "<fcd-export>\n".to_owned();
    for time_s in times_s() {
        writeln!(text, "<timestep time=\"{time_s:.2}\">").unwrap();
        for number in 0..14_u32 {
            // The fastest vehicle has the longest path, and is the only one that changes lanes.
            let is_changing = number == 13;
            let (start_m, speed_mps) = if is_changing { (0.0, 33.0) } else { (5.0 * f64::from(number), 25.0) };
            let lane = if is_changing {
                let tau = ((time_s - 4.0) / 4.0).clamp(0.0, 1.0);
                2.0 - tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau)
            } else {
                f64::from(number % 3)
            };
            let (x_m, y_m) = (start_m + speed_mps * time_s, -VISSIM_LANE_M * (lane + 0.5));
            writeln!(
                text,
                "<vehicle id=\"{number}\" x=\"{x_m:.3}\" y=\"{y_m:.3}\" angle=\"90.0\" type=\"car\" speed=\"{speed_mps:.2}\"/>"
            )
            .unwrap();
        }
        text += "</timestep>\n";
    }
    text += "</fcd-export>\n";
    let changes = detect(&smooth(&read_text(text.as_bytes()).unwrap()));
    let detected: Vec<(u64, Side)> = changes.iter().map(|change| (change.track_id, change.direction)).collect();
    assert_eq!(detected, [(13, Side::Left)]);
}

fn vissim(columns: &str, row: impl Fn(&Drive, f64) -> String) -> String {
    let mut text = format!(
        "$VISSION\n* File: made-up\n*\n* POS: Position [m]\n* SPEED: Speed [km/h]\n*\n$VEHICLE:SIMSEC;NO;{columns}\n"
    );
    for time_s in times_s() {
        for (number, drive) in DRIVES.iter().enumerate() {
            writeln!(text, "{time_s:.2};{};{}", number + 1, row(drive, time_s)).unwrap();
        }
    }
    text
}

/// Positions on one link, with the position across the lane.
fn vissim_by_link() -> String {
    vissim_across(|across| across)
}

fn vissim_across(sense: fn(f64) -> f64) -> String {
    vissim(r"LANE\LINK\NO;LANE\INDEX;POS;POSLAT;SPEED;VEHTYPE;LENGTH", |drive, time_s| {
        let (front_m, y_m, index) = drive.at(time_s, false);
        let across = sense(y_m / SUMO_LANE_M + 3.0 - f64::from(index));
        let length_m = if drive.kind == "trailer" { 16.5 } else { 5.0 };
        let kind = if drive.kind == "trailer" { 200 } else { 100 };
        format!("7;{};{front_m:.3};{across:.4};{:.3};{kind};{length_m}", index + 1, 3.6 * drive.speed_mps)
    })
}

/// Lane width that is assumed for Vissim (m).
const VISSIM_LANE_M: f64 = 3.5;

fn vissim_by_coordinates() -> String {
    vissim("SPEED;VEHTYPE;COORDFRONT;COORDREAR;WIDTH", |drive, time_s| {
        let (front_m, y_m, _) = drive.at(time_s, false);
        let length_m = if drive.kind == "trailer" { 16.5 } else { 5.0 };
        let kind = if drive.kind == "trailer" { 200 } else { 100 };
        let (rear_m, y_m) = (front_m - length_m, y_m / SUMO_LANE_M * VISSIM_LANE_M);
        format!("{:.3};{kind};{front_m:.3} {y_m:.3} 0.0;{rear_m:.3} {y_m:.3} 0.0;1.8", 3.6 * drive.speed_mps)
    })
}

#[test]
fn vehicle_records_of_vissim_are_read_by_links_and_by_coordinates() {
    let in_small_letters = vissim_by_link().replace("$VEHICLE:SIMSEC;NO", "$vehicle:simsec;no");
    for text in [vissim_by_link(), in_small_letters, vissim_by_coordinates()] {
        let data = read_text(text.as_bytes()).unwrap();
        assert!(!data.is_in_doubt, "{:?}", data.notes);
        assert_eq!((data.layout, data.period), (Layout::Vissim, Time::from_ms(100)));
        assert_eq!(
            first_and_last_lanes(&data),
            [(1, 1), (3, 2), (3, 3), (2, 2)],
            "Vissim counts its lanes from the right"
        );
        assert_eq!(data.trajectories[2].class, VehicleClass::Truck);
        assert!((data.trajectories[0].points[5].speed_mps - 32.0).abs() < 0.01, "km/h");
        let crossing_s = assert_one_lane_change(&data);
        assert!((crossing_s - 6.0).abs() < 0.2, "{crossing_s}");
    }
}

#[test]
fn lanes_of_vissim_against_the_positions_across_them_are_in_doubt_because_either_may_be_turned() {
    let text = vissim_across(|across| 1.0 - across);
    let data = read_text(text.as_bytes()).unwrap();
    assert!(
        data.is_in_doubt && data.notes.iter().any(|note| note.contains("POSLAT grows against")),
        "{:?}",
        data.notes
    );
    assert!((assert_one_lane_change(&data) - 6.0).abs() < 0.2, "positions across the lane are turned");
    // A file that counts its lanes from the left.
    let axes = AxisOptions { mirror_d: true, lanes_from_right: true, ..AxisOptions::default() };
    let options = ReadOptions { axes, ..ReadOptions::default() };
    let tracks = open_from(text.as_bytes(), Path::new("a"), options, usize::MAX);
    let data = tracks.and_then(|tracks| tracks.collect_all()).unwrap();
    let changes = detect(&smooth(&data));
    let sides: Vec<Side> = changes.iter().map(|change| change.direction).collect();
    assert!(!data.is_in_doubt && sides == [Side::Right], "{sides:?}: {:?}", data.notes);
}

#[test]
fn a_name_of_several_vehicles_at_one_time_is_refused_by_that_reason() {
    // Two vehicles of a file with the name of one: beside each other, and on two links.
    let sumo = sumo_xml(false).replace("id=\"f.2\"", "id=\"f.0\"");
    let other_link = |line: &str| match line.split_once(";4;7;") {
        Some((time, rest)) => format!("{time};1;8;{rest}\n"),
        None => line.to_owned() + "\n",
    };
    let vissim: String = vissim_by_link().lines().map(other_link).collect();
    for text in [sumo, vissim] {
        let problem = read_text(text.as_bytes()).unwrap_err().problem;
        assert!(matches!(problem, TrajectoryFileProblem::SharedNumber { vehicle: 1, frame: 0, .. }), "{problem}");
    }
}

#[test]
fn the_same_names_in_a_second_simulation_of_a_file_are_other_vehicles_without_lane_changes_of_a_single_step() {
    let first = sumo_xml(false);
    let (_, second) = first.split_once("<fcd-export>\n").unwrap();
    let later = |line: &str| match line.split('"').collect::<Vec<&str>>()[..] {
        ["<timestep time=", time_s, end] => {
            format!("<timestep time=\"{:.2}\"{end}\n", time_s.parse::<f64>().unwrap() + 60.0)
        }
        _ => line.to_owned() + "\n",
    };
    let second: String = second.lines().map(later).collect();
    let data = read_text(first.replace("</fcd-export>\n", &second).as_bytes()).unwrap();
    let has_single_steps = data.notes.iter().any(|note| note.contains("a single step"));
    assert!(!has_single_steps && data.trajectories.len() == 8, "{:?}", data.notes);
    assert_eq!(detect(&smooth(&data)).len(), 2);
}

#[test]
fn lanes_of_vissim_beside_coordinates_are_the_recorded_lanes() {
    let text =
        vissim(r"LANE\LINK\NO;LANE\INDEX;SPEED;COORDFRONTX;COORDFRONTY;COORDREARX;COORDREARY", |drive, time_s| {
            let (front_m, y_m, _) = drive.at(time_s, false);
            // The file names the new lane half a second after the vehicle has crossed the marking.
            let (_, _, index) = drive.at(time_s - 0.5, false);
            let link = if front_m < 150.0 { 1 } else { 2 };
            let (rear_m, speed_kmh) = (front_m - 5.0, 3.6 * drive.speed_mps);
            format!("{link};{};{speed_kmh:.3};{front_m:.3};{y_m:.3};{rear_m:.3};{y_m:.3}", index + 1)
        });
    let data = read_text(text.as_bytes()).unwrap();
    assert_eq!(first_and_last_lanes(&data), [(1, 1), (3, 2), (3, 3), (2, 2)]);
    let points = &data.trajectories[1].points;
    let change = points.windows(2).position(|pair| pair[0].lane != pair[1].lane);
    assert!(change.is_some_and(|frame| (64..=65).contains(&frame)), "{change:?}");
    assert!(!data.notes.iter().any(|note| note.contains("states no lanes")), "{:?}", data.notes);
}

/// Mirrored positions of a made-up road with the indices of its lanes.
#[test]
fn mirrored_files_of_sumo_and_vissim_are_refused_and_the_named_options_mend_them() {
    let sumo = sumo_xml(false).replace("y=\"-", "y=\"");
    let columns = r"LANE\LINK\NO;LANE\INDEX;SPEED;COORDFRONTX;COORDFRONTY;COORDREARX;COORDREARY";
    let vissim = vissim(columns, |drive, time_s| {
        let (front_m, y_m, index) = drive.at(time_s, false);
        let (rear_m, speed_kmh) = (front_m - 5.0, 3.6 * drive.speed_mps);
        format!("1;{};{speed_kmh:.3};{front_m:.3};{:.3};{rear_m:.3};{:.3}", index + 1, -y_m, -y_m)
    });
    let axes = AxisOptions { mirror_d: true, lanes_from_right: true, ..AxisOptions::default() };
    let options = ReadOptions { axes, ..ReadOptions::default() };
    let table = sumo_table(";", true);
    let (header, rows) = table.split_once('\n').unwrap();
    let mut by_vehicle: Vec<Vec<&str>> = rows.lines().map(|row| row.split(';').collect()).collect();
    by_vehicle.sort_by_key(|fields| fields[1]);
    let by_vehicle = by_vehicle.into_iter().fold(format!("{header}\n"), |text, mut fields| {
        fields[3] = fields[3].trim_start_matches('-');
        text + &fields.join(";") + "\n"
    });
    for text in [sumo, vissim, by_vehicle] {
        let problem = read_text(text.as_bytes()).unwrap_err().problem;
        assert!(matches!(problem, TrajectoryFileProblem::IndexAgainstPosition { .. }), "{problem}");
        let tracks = open_from(text.as_bytes(), Path::new("a"), options, usize::MAX);
        let data = tracks.and_then(|tracks| tracks.collect_all()).unwrap();
        assert!(!data.is_in_doubt && !data.notes.iter().any(|note| note.contains("mirrored")), "{:?}", data.notes);
        assert_one_lane_change(&data);
        // Without the options, and without recorded lanes, the sides are in doubt.
        let options = ReadOptions { lanes: LaneReliability::Unreliable, ..ReadOptions::default() };
        let tracks = open_from(text.as_bytes(), Path::new("a"), options, usize::MAX);
        let data = tracks.and_then(|tracks| tracks.collect_all()).unwrap();
        assert!(data.is_in_doubt && data.notes.iter().any(|note| note.contains("mirrored")), "{:?}", data.notes);
    }
    // The options do not pass on a file that is as it should be.
    assert!(open_from(sumo_xml(false).as_bytes(), Path::new("a"), options, usize::MAX).is_err());
}

#[test]
fn coordinates_of_vissim_in_feet_are_read_as_their_comments_state() {
    const FOOT_M: f64 = 0.3048;
    let in_feet = vissim("SPEED;COORDFRONT;COORDREAR", |drive, time_s| {
        let (front_m, y_m, _) = drive.at(time_s, false);
        let [front, rear, y] =
            [front_m, front_m - 5.0, y_m / SUMO_LANE_M * VISSIM_LANE_M].map(|value_m| value_m / FOOT_M);
        format!("{:.3};{front:.3} {y:.3} 0.0;{rear:.3} {y:.3} 0.0", 3.6 * drive.speed_mps)
    });
    let units = "* POS: Position [m]\n* COORDFRONT: Front [ft]\n* COORDREAR: Rear [ft]\n";
    let data = read_text(in_feet.replace("* POS: Position [m]\n", units).as_bytes()).unwrap();
    assert!((data.trajectories[0].dimensions.length_m - 5.0).abs() < 0.01);
    assert_one_lane_change(&data);
    assert!(read_text(in_feet.as_bytes()).is_err(), "as metres, the speeds contradict the positions");
}

#[test]
fn a_track_of_vissim_ends_where_its_link_ends() {
    let text = vissim(r"LANE\LINK\NO;LANE\INDEX;POS;SPEED", |drive, time_s| {
        let (front_m, _, index) = drive.at(time_s, false);
        let (link, along_m) = if front_m < 150.0 { (1, front_m) } else { (2, front_m - 150.0) };
        format!("{link};{};{along_m:.3};{:.3}", index + 1, 3.6 * drive.speed_mps)
    });
    let data = read_text(text.as_bytes()).unwrap();
    assert_eq!(data.trajectories.len(), 8);
    assert_eq!(data.continuity.jumps, 0);
    assert!(data.notes.iter().any(|note| note.contains("each of 2 links")), "{:?}", data.notes);
    let far_m = data.trajectories[0].points[0].d_m - data.trajectories[7].points[0].d_m;
    assert!(far_m.abs() > 900.0, "the roads are apart: {far_m}");
    // A gap on each link: four tracks of each vehicle, with numbers of their own.
    let is_in_gap = |line: &str| {
        let fields: Vec<f64> = line.split(';').filter_map(|field| field.parse().ok()).collect();
        matches!(fields[..], [_, _, _, _, along_m, _] if (60.0..110.0).contains(&along_m))
    };
    let kept = text.lines().filter(|line| !is_in_gap(line)).collect::<Vec<_>>().join("\n");
    let data = read_text((kept + "\n").as_bytes()).unwrap();
    let numbers: Vec<u64> = data.trajectories.iter().map(|track| track.track_id).collect();
    let of_each = |piece: u64| (1..=4).map(move |vehicle| vehicle + piece * PIECE_STRIDE);
    assert_eq!(BTreeSet::from_iter(numbers), (0..4).flat_map(of_each).collect());
    assert_eq!(data.trajectories.len(), 16);
}

#[test]
fn a_gap_on_a_link_of_vissim_splits_a_track_and_hides_its_lane_change() {
    let time_s = |line: &str| line.split(';').next().unwrap().parse::<f64>().ok();
    let text = vissim_by_link();
    let kept = text.lines().filter(|line| time_s(line).is_none_or(|time_s| !(5.5..6.5).contains(&time_s)));
    let data = read_text((kept.collect::<Vec<_>>().join("\n") + "\n").as_bytes()).unwrap();
    let continuity = data.continuity;
    assert_eq!((continuity.vehicles, continuity.pieces, continuity.hidden_crossings), (4, 8, 1));
    assert!(data.is_in_doubt, "{:?}", data.warnings());
}

#[test]
fn malformed_vehicle_records_are_refused() {
    let good = vissim_by_link();
    for (text, needed) in [
        (good.replace("$VEHICLE:", "$VEHICLES:"), vec!["vehicle record of Vissim", "$VEHICLE:SIMSEC;NO"]),
        (good.replace(r"LANE\INDEX", r"LANE\IDX"), vec!["line 7", r"no column `LANE\INDEX`", "Vissim"]),
        (good.replace("[km/h]", "[furlong]"), vec!["line 5", "unit of SPEED is `furlong`", "km/h, mph"]),
        (good.replace("[km/h]", "[mph]"), vec!["share of what the recorded speed makes", "0.8 to 1.25"]),
        (good.clone() + "1;2;3\n", vec!["line 488", "3 columns, but 9 are needed"]),
        (good.replacen(";100;5", ";100;500", 1), vec!["line 8", "`LENGTH`", "is `500`", "0 and up to 60"]),
        (good.replacen("0.00;1;", "0.00;x;", 1), vec!["line 8", "`NO`", "is `x`"]),
        (vissim_by_coordinates().replacen(" 0.0;", ";", 1).replacen("0.000 ", "", 1), vec!["line 8", "COORDFRONT"]),
    ] {
        let error = read_text(text.as_bytes()).expect_err(&text[..text.len().min(400)]);
        assert_mentions(&error, &needed, &text[..text.len().min(200)]);
    }
    let in_metres = good.replace("[km/h]", "[m/s]");
    assert!(read_text(in_metres.as_bytes()).is_err(), "a wrong unit is found by the positions");
}

/// Two directions with 10 vehicles each; one changes lanes.
pub(crate) fn i24(is_array: bool) -> String {
    let mut documents = Vec::new();
    for number in 0..20_u32 {
        let (direction, first) = (if number % 2 == 0 { 1.0 } else { -1.0 }, 5.0 * f64::from(number));
        let lane = f64::from(number % 3);
        let mut lists = [const { Vec::new() }; 3];
        for frame in 0..250_u32 {
            let time_s = 0.04 * f64::from(frame);
            let tau = if number == 4 { ((time_s - 3.0) / 4.0).clamp(0.0, 1.0) } else { 0.0 };
            let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
            lists[0].push(format!("{:.2}", 1_669_122_000.0 + time_s));
            lists[1].push(format!("{:.3}", 310_000.0 + direction * (10.0 * first + 100.0 * time_s)));
            lists[2].push(format!("{:.3}", direction * (6.0 + 12.0 * (lane + share))));
        }
        let [timestamp, x, y] = lists.map(|list| list.join(","));
        documents.push(format!(
            "{{\"_id\":{{\"$oid\":\"637c{number}\"}},\"timestamp\":[{timestamp}],\"x_position\":[{x}],\"y_position\":[{y}],\
             \"length\":15.0,\"width\":6.0,\"height\":5.0,\"direction\":{direction},\"coarse_vehicle_class\":{},\"flags\":[]}}",
            if number == 6 { 4 } else { 0 }
        ));
    }
    if is_array { format!("[{}]", documents.join(",\n")) } else { documents.join("\n") }
}

#[test]
fn trajectories_of_i24_motion_are_read_in_feet_and_in_both_directions() {
    let with_mark = "\u{feff}".to_owned() + &i24(true);
    for text in [i24(true), i24(false), with_mark] {
        let data = read_text(text.as_bytes()).unwrap();
        assert_eq!((data.layout, data.period, data.trajectories.len()), (Layout::I24, Time::from_ms(40), 20));
        let track = &data.trajectories[4];
        assert!((track.points[100].speed_mps - 30.48).abs() < 0.05 && (track.dimensions.length_m - 4.572).abs() < 1e-6);
        assert_eq!(data.trajectories[6].class, VehicleClass::Truck);
        // The rear is stated: two vehicles are as far apart as their rears, whatever the direction.
        assert!(data.trajectories.iter().all(|track| track.points.windows(2).all(|pair| pair[1].s_m > pair[0].s_m)));
        assert_eq!((track.points[0].lane.0, track.points[249].lane.0), (2, 3));
        assert!((track.points[0].d_m + 1.5 * 3.6576).abs() < 0.01);
        let back = &data.trajectories[5];
        assert!(back.points[0].d_m < -1_000.0 && back.points[0].lane.0 > 8);
        let changes = detect(&smooth(&data));
        assert_eq!(
            changes.iter().map(|change| (change.track_id, change.direction)).collect::<Vec<_>>(),
            [(5, Side::Right)]
        );
    }
}

/// Returns a file of the eastbound direction with 20 vehicles, whose lateral positions (ft) are edited.
fn eastbound_i24(edit: impl Fn(f64) -> f64) -> String {
    let mut documents: serde_json::Value = serde_json::from_str(&i24(true)).unwrap();
    for document in documents.as_array_mut().unwrap() {
        if document["direction"].as_f64() == Some(-1.0) {
            document["direction"] = 1.into();
            for x in document["x_position"].as_array_mut().unwrap() {
                *x = (620_000.0 - x.as_f64().unwrap()).into();
            }
        }
        for y in document["y_position"].as_array_mut().unwrap() {
            *y = edit(y.as_f64().unwrap().abs()).into();
        }
    }
    documents.to_string()
}

#[test]
fn lateral_positions_of_i24_motion_that_count_from_elsewhere_are_in_doubt_or_refused() {
    let doubt = |edit: fn(f64) -> f64| {
        let data = read_text(eastbound_i24(edit).as_bytes()).unwrap();
        assert_eq!(data.is_in_doubt, data.doubts_lanes);
        data.notes.into_iter().find(|note| note.contains("count from elsewhere"))
    };
    assert_eq!(doubt(|y| y), None);
    assert_eq!(doubt(|y| -y), None, "all positions have the other sign");
    assert_eq!(doubt(|y| y + 2.0), None);
    assert!(doubt(|y| y + 5.0).unwrap().contains("1.5 m to the right of the middles"));
    assert!(doubt(|y| y - 5.0).unwrap().contains("1.5 m to the left of the middles"));
    assert!(doubt(|y| y - 10.0).unwrap().contains("beside the lanes"));
    let problem = read_text(eastbound_i24(|y| y - 14.0).as_bytes()).unwrap_err().problem;
    assert!(matches!(problem, TrajectoryFileProblem::BesideCarriageway { .. }), "{problem}");
}

#[test]
fn trajectories_of_i24_motion_against_their_direction_are_refused() {
    let turned = i24(true).replace("\"direction\":1,", "\"direction\":-1,");
    let error = read_text(turned.as_bytes()).unwrap_err();
    assert_mentions(&error, &["falls in the direction of travel of 10 of 20 vehicles"], "direction");
}

#[test]
fn a_number_of_i24_motion_that_is_given_to_another_vehicle_splits_its_track() {
    // From frame 100 on, the number belongs to a vehicle 3,000 ft ahead.
    let text = i24(true).lines().next().unwrap().trim_end_matches(',').to_owned() + "]";
    let clean = read_text(text.as_bytes()).unwrap();
    let mut document: serde_json::Value = serde_json::from_str(&text).unwrap();
    for x in &mut document[0]["x_position"].as_array_mut().unwrap()[100..] {
        *x = (x.as_f64().unwrap() + 3_000.0).into();
    }
    let data = read_text(document.to_string().as_bytes()).unwrap();
    assert_eq!((clean.continuity.jumps, data.continuity.jumps, data.trajectories.len()), (0, 1, 2));
    let speeds = data.trajectories.iter().flat_map(|track| &track.points).map(|point| point.speed_mps);
    assert!(speeds.clone().count() == 250 && speeds.into_iter().all(|mps| (mps - 30.48).abs() < 0.05));
}

#[test]
fn malformed_json_is_refused() {
    let good = i24(true);
    for (text, needed) in [
        (
            good.replacen("\"x_position\"", "\"x_positions\"", 1),
            vec!["line 1", "I-24 MOTION", "missing field `x_position`"],
        ),
        (
            good.replacen("\"direction\":1", "\"direction\":2", 1),
            vec!["trajectory 1", "`direction` is 2", "1 (eastbound)"],
        ),
        (good.replacen("\"length\":15.0", "\"length\":1500.0", 1), vec!["trajectory 1", "`length`", "up to 60 m"]),
        (good.replacen("\"coarse_vehicle_class\":0", "\"coarse_vehicle_class\":9", 1), vec!["from 0 to 6"]),
        (
            good.replacen("\"timestamp\":[1669122000.00,", "\"timestamp\":[", 1),
            vec!["trajectory 1", "a list of 250", "249"],
        ),
        (good.replacen("1669122000.04", "1669121000.04", 1), vec!["trajectory 1", "`timestamp`", "after 1669122000"]),
        (good.replacen("1669122000.04", "NaN", 1), vec!["line 1", "I-24 MOTION"]),
        (good.chars().take(9_000).collect(), vec!["I-24 MOTION", "EOF"]),
        (
            "{\"label\": {\"metadata\": {}}}".to_owned(),
            vec!["JSON without the fields of I-24 MOTION", "without `openlabel`"],
        ),
        ("[1, 2]".to_owned(), vec!["JSON without the fields"]),
    ] {
        let error = read_text(text.as_bytes()).expect_err(&text[..text.len().min(200)]);
        assert_mentions(&error, &needed, &text[..text.len().min(120)]);
    }
}

/// The columns of a Parquet file.
enum Column {
    Whole(&'static str, Vec<i64>),
    Number(&'static str, Vec<f64>),
    Text(&'static str, Vec<&'static str>),
}

fn parquet_of(columns: &[Column]) -> Vec<u8> {
    compressed_parquet_of(columns, Compression::UNCOMPRESSED)
}

fn compressed_parquet_of(columns: &[Column], codec: Compression) -> Vec<u8> {
    let schema: String = columns
        .iter()
        .map(|column| match column {
            Column::Whole(name, _) => format!("REQUIRED INT64 {name};"),
            Column::Number(name, _) => format!("REQUIRED DOUBLE {name};"),
            Column::Text(name, _) => format!("REQUIRED BYTE_ARRAY {name} (UTF8);"),
        })
        .collect();
    let schema = Arc::new(parse_message_type(&format!("message rows {{ {schema} }}")).unwrap());
    let mut bytes = Vec::new();
    let properties = WriterProperties::builder().set_compression(codec).build();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for column in columns {
        let mut writer = group.next_column().unwrap().unwrap();
        match column {
            Column::Whole(_, values) => writer.typed::<Int64Type>().write_batch(values, None, None).unwrap(),
            Column::Number(_, values) => writer.typed::<DoubleType>().write_batch(values, None, None).unwrap(),
            Column::Text(_, values) => {
                let values: Vec<ByteArray> = values.iter().map(|value| ByteArray::from(*value)).collect();
                writer.typed::<ByteArrayType>().write_batch(&values, None, None).unwrap()
            }
        };
        writer.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
    bytes
}

fn plain_columns(rows: usize, speed_mps: f64) -> Vec<Column> {
    let number = |value: f64| vec![value; rows];
    vec![
        Column::Text("recording_id", vec!["a, b"; rows]),
        Column::Whole("track_id", vec![3; rows]),
        Column::Whole("frame", (0..rows as i64).collect()),
        Column::Number("time_s", (0..rows).map(|row| 0.1 * row as f64).collect()),
        Column::Number("s_m", (0..rows).map(|row| 3.0 * row as f64).collect()),
        Column::Number("d_m", number(1.75)),
        Column::Number("lane_id", number(1.0)),
        Column::Number("speed_mps", number(speed_mps)),
        Column::Number("accel_mps2", number(0.0)),
        Column::Number("length_m", number(4.6)),
        Column::Number("width_m", number(1.8)),
        Column::Text("vehicle_class", vec!["car"; rows]),
    ]
}

#[test]
fn a_parquet_file_has_the_layout_of_its_columns() {
    let data = read_text(&parquet_of(&plain_columns(40, 30.0))).unwrap();
    assert_eq!((data.layout, data.name.as_str(), data.trajectories.len()), (Layout::Plain, "a, b", 1));
    assert_eq!(data.trajectories[0].points.len(), 40);
    assert!((data.trajectories[0].points[39].s_m - 117.0).abs() < 1e-9);

    let times: Vec<f64> = times_s().flat_map(|time_s| [time_s; DRIVES.len()]).collect();
    let rows: Vec<(f64, &Drive)> = times.iter().copied().zip(DRIVES.iter().cycle()).collect();
    let number = |value: fn(&Drive, f64) -> f64| rows.iter().map(|(time_s, drive)| value(drive, *time_s)).collect();
    let lanes = ["e0_0", "e0_1", "e0_2"];
    let sumo = [
        Column::Number("timestep_time", times.clone()),
        Column::Text("vehicle_id", rows.iter().map(|(_, drive)| drive.id).collect()),
        Column::Number("vehicle_x", number(|drive, time_s| drive.at(time_s, false).0)),
        Column::Number("vehicle_y", number(|drive, time_s| drive.at(time_s, false).1)),
        Column::Number("vehicle_angle", vec![90.0; rows.len()]),
        Column::Text("vehicle_type", rows.iter().map(|(_, drive)| drive.kind).collect()),
        Column::Number("vehicle_speed", number(|drive, _| drive.speed_mps)),
        Column::Text(
            "vehicle_lane",
            rows.iter().map(|(time_s, drive)| lanes[drive.at(*time_s, false).2 as usize]).collect(),
        ),
    ];
    assert_is_made_up_road(&read_text(&parquet_of(&sumo)).unwrap());
}

#[test]
fn a_compressed_parquet_file_has_the_rows_of_an_uncompressed_one() {
    let columns = plain_columns(40, 30.0);
    let plain = read_text(&parquet_of(&columns)).unwrap();
    let codecs = [
        Compression::SNAPPY,
        Compression::GZIP(GzipLevel::default()),
        Compression::ZSTD(ZstdLevel::default()),
        Compression::LZ4_RAW,
    ];
    for codec in codecs {
        let data = read_text(&compressed_parquet_of(&columns, codec)).unwrap();
        assert_eq!(data.trajectories[0].points, plain.trajectories[0].points, "{codec}");
    }
}

#[test]
fn malformed_parquet_is_refused() {
    let good = parquet_of(&plain_columns(40, 30.0));
    let error = |bytes: &[u8]| read_text(bytes).unwrap_err();
    assert_mentions(&error(&good[..good.len() / 2]), &["Parquet file"], "cut");
    assert_mentions(&error(&parquet_of(&plain_columns(40, -30.0))), &["line 2", "`speed_mps`", "0 to 150"], "negative");
    assert_mentions(&error(&parquet_of(&plain_columns(40, f64::NAN))), &["line 2", "`speed_mps`", "NaN"], "NaN");
    assert_mentions(&error(&parquet_of(&[Column::Whole("a", vec![1])])), &["1 column and", "starts with `a`"], "other");
    // In the metadata of a column, the number of its codec follows its name. In Thrift's compact
    // protocol, 8 is the number 4: Brotli.
    let (codec, of_column) = ([0x15, 0x08, 0x16], b"d_m\x15\x00\x16");
    let at = good.windows(of_column.len()).position(|window| window == of_column).unwrap();
    let mut packed = good.clone();
    packed[at + 3..at + 6].copy_from_slice(&codec);
    assert_mentions(&error(&packed), &["compressed with BROTLI", "Snappy, Gzip, Zstandard"], "another codec");
    let mut damaged = good.clone();
    let middle = good.len() / 3;
    damaged[middle..middle + 200].fill(0xff);
    if let Err(error) = read_text(&damaged) {
        assert!(!error.is_io(), "{error}");
    }
}

/// Writes a data set with exiD's columns without `columns`.
fn exid(folder: &Path, without: &[&str], changes_flagged: bool) {
    let all = [
        "recordingId",
        "trackId",
        "frame",
        "xCenter",
        "yCenter",
        "heading",
        "width",
        "length",
        "lonVelocity",
        "lonAcceleration",
        "latLaneCenterOffset",
        "laneWidth",
        "laneletId",
        "laneChange",
    ];
    let kept: Vec<usize> = (0..all.len()).filter(|index| !without.contains(&all[*index])).collect();
    let line = |values: &[String]| kept.iter().map(|index| values[*index].clone()).collect::<Vec<_>>().join(",") + "\n";
    let mut rows = line(&all.map(str::to_owned));
    let mut meta = "recordingId,trackId,numFrames,class\n".to_owned();
    // The vehicle that changes lanes has the longest path.
    for (vehicle, lane, speed_mps) in [(1, 0.0, 25.0), (2, 0.0, 33.0), (3, 1.0, 26.0), (4, 1.0, 24.0)] {
        writeln!(meta, "5,{vehicle},300,car").unwrap();
        for frame in 0..300_u32 {
            let time_s = 0.04 * f64::from(frame);
            let tau = if vehicle == 2 { ((time_s - 4.0) / 4.0).clamp(0.0, 1.0) } else { 0.0 };
            let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
            let y_m = 3.7 * (lane + share);
            let in_lane = if share < 0.5 { lane } else { lane + 1.0 };
            let is_flagged = changes_flagged && vehicle == 2 && frame == 150;
            let values = [
                "5".to_owned(),
                vehicle.to_string(),
                frame.to_string(),
                format!("{:.3}", speed_mps * time_s),
                format!("{y_m:.3}"),
                "0.0".to_owned(),
                "1.9".to_owned(),
                "4.7".to_owned(),
                speed_mps.to_string(),
                "0".to_owned(),
                format!("{:.3}", y_m - 3.7 * in_lane),
                "3.7".to_owned(),
                format!("{in_lane}"),
                u8::from(is_flagged).to_string(),
            ];
            rows += &line(&values);
        }
    }
    std::fs::write(folder.join("05_recordingMeta.csv"), "recordingId,frameRate\n5,25\n").unwrap();
    std::fs::write(folder.join("05_tracksMeta.csv"), meta).unwrap();
    std::fs::write(folder.join("05_tracks.csv"), rows).unwrap();
}

#[test]
fn a_lane_change_that_exid_does_not_flag_is_found_and_makes_no_others() {
    for is_flagged in [true, false] {
        let folder = tempfile::tempdir().unwrap();
        exid(folder.path(), &[], is_flagged);
        let data = read(folder.path()).unwrap();
        let changes = detect(&smooth(&data));
        let listed: Vec<_> = changes.iter().map(|change| (change.track_id, change.direction)).collect();
        assert_eq!(listed, [(2, Side::Left)], "flagged: {is_flagged}");
        assert!(data.warnings().is_empty(), "{:?}", data.warnings());
    }
}

#[test]
fn a_mirrored_data_set_of_exid_is_refused_and_the_named_options_mend_it() {
    let folder = tempfile::tempdir().unwrap();
    exid(folder.path(), &[], true);
    let path = folder.path().join("05_tracks.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let mirrored = text.lines().enumerate().map(|(number, line)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if number > 0 {
            fields[4] = format!("{:.3}", -fields[4].parse::<f64>().unwrap());
        }
        fields.join(",") + "\n"
    });
    std::fs::write(&path, mirrored.collect::<String>()).unwrap();
    let error = read(folder.path()).unwrap_err();
    assert_mentions(&error, &["05_tracks.csv", "`latLaneCenterOffset` contradict `yCenter`"], "mirrored");
    let axes = AxisOptions { mirror_d: true, lanes_from_right: true, ..AxisOptions::default() };
    let data = read_with(folder.path(), ReadOptions { axes, ..ReadOptions::default() }).unwrap();
    let changes = detect(&smooth(&data));
    let listed: Vec<_> = changes.iter().map(|change| (change.track_id, change.direction)).collect();
    assert_eq!(listed, [(2, Side::Left)]);
    // The options do not pass on a data set that is as it should be.
    exid(folder.path(), &[], true);
    let axes = AxisOptions { mirror_d: true, lanes_from_right: true, ..AxisOptions::default() };
    assert!(read_with(folder.path(), ReadOptions { axes, ..ReadOptions::default() }).is_err());
}

/// Returns the lane changes of exiD's data set after `edit` of its rows: their fields in [`exid`]'s order.
fn exid_changes(edit: impl Fn(Vec<Vec<String>>) -> Vec<Vec<String>>, separator: &str) -> Vec<(u64, Side)> {
    let folder = tempfile::tempdir().unwrap();
    exid(folder.path(), &[], true);
    let path = folder.path().join("05_tracks.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<String>>());
    let header = lines.next().unwrap();
    let rows = edit(lines.collect());
    let rows = std::iter::once(&header).chain(&rows).map(|row| row.join(separator) + "\n");
    std::fs::write(&path, rows.collect::<String>()).unwrap();
    // Each vehicle has as many rows as its metadata states.
    let meta = std::fs::read_to_string(folder.path().join("05_tracksMeta.csv")).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let rows_of = |vehicle: &str| text.lines().filter(|line| line.split(separator).nth(1) == Some(vehicle)).count();
    let meta = meta.lines().map(|line| match line.split(',').nth(1).filter(|_| line.starts_with('5')) {
        Some(vehicle) => format!("5,{vehicle},{},car\n", rows_of(vehicle)),
        None => line.to_owned() + "\n",
    });
    std::fs::write(folder.path().join("05_tracksMeta.csv"), meta.collect::<String>()).unwrap();
    let changes = detect(&smooth(&read(folder.path()).unwrap()));
    changes.iter().map(|change| (change.track_id, change.direction)).collect()
}

#[test]
fn a_data_set_of_exid_in_another_order_or_notation_has_the_same_lane_changes() {
    let by_frame = |mut rows: Vec<Vec<String>>| {
        rows.sort_by_key(|row| row[2].parse::<u32>().unwrap());
        rows
    };
    let backwards = |mut rows: Vec<Vec<String>>| {
        rows.reverse();
        rows
    };
    let fractions = |mut rows: Vec<Vec<String>>| {
        rows.iter_mut().for_each(|row| row[12] += ".0");
        rows
    };
    let expected = [(2, Side::Left)];
    assert_eq!(exid_changes(|rows| rows, ","), expected);
    assert_eq!(exid_changes(by_frame, ","), expected);
    assert_eq!(exid_changes(backwards, ","), expected);
    assert_eq!(exid_changes(fractions, ","), expected);
    assert_eq!(exid_changes(|rows| rows, "\t"), expected);
}

#[test]
fn a_number_of_exid_that_is_used_again_is_not_the_path_of_a_road() {
    // Vehicle 4 enters with the number of vehicle 3 after this has left.
    let reused = |mut rows: Vec<Vec<String>>| {
        for row in rows.iter_mut().filter(|row| row[1] == "4") {
            row[1] = "3".to_owned();
            row[2] = (row[2].parse::<u32>().unwrap() + 300).to_string();
        }
        rows
    };
    assert_eq!(exid_changes(reused, ","), [(2, Side::Left)]);
}

#[test]
fn a_lanelet_that_is_no_number_is_refused_by_its_column() {
    let folder = tempfile::tempdir().unwrap();
    exid(folder.path(), &[], true);
    let path = folder.path().join("05_tracks.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replace(",3.7,0,", ",3.7,right,").replace(",3.7,1,", ",3.7,left,")).unwrap();
    assert_mentions(&read(folder.path()).unwrap_err(), &["column `laneletId`", "is `right`"], "names of lanelets");
}

#[test]
fn urban_recordings_are_not_read_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    exid(folder.path(), &["latLaneCenterOffset", "laneWidth", "laneletId", "laneChange"], false);
    let data = read(folder.path()).unwrap();
    assert!(data.warnings()[0].contains("as in inD and rounD"), "{:?}", data.warnings());
    // The longest path is the one of the vehicle that changes lanes, and four vehicles do not show that.
    let few = "derived from the paths of 4 vehicles";
    assert!(data.is_in_doubt && data.warnings().iter().any(|warning| warning.contains(few)), "{:?}", data.warnings());
}

#[test]
fn semicolons_are_the_reason_why_a_data_set_of_several_files_is_refused() {
    for file in ["05_tracks.csv", "05_tracksMeta.csv", "05_recordingMeta.csv"] {
        let folder = tempfile::tempdir().unwrap();
        exid(folder.path(), &[], true);
        let path = folder.path().join(file);
        std::fs::write(&path, std::fs::read_to_string(&path).unwrap().replace(',', ";")).unwrap();
        let error = read(folder.path()).unwrap_err();
        assert_mentions(&error, &[file, "semicolon-separated"], file);
    }
}

#[test]
fn one_location_of_an_export_can_be_chosen() {
    let header = "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_Length,v_Width,\
                  v_Class,v_Vel,v_Acc,Lane_ID,Location";
    let mut text = header.to_owned() + "\n";
    for (location, lane) in [("us-101", 2), ("i-80", 3), ("lankershim", 1)] {
        for frame in 1..20 {
            writeln!(
                text,
                "7,{frame},20,{},20.0,{}.0,0,0,15.0,6.0,2,50.0,0.0,{lane},{location}",
                1_118_846_980_000_i64 + 100 * frame,
                100 + 5 * frame
            )
            .unwrap();
        }
    }
    let asked = |location| ReadOptions { location: Some(location), ..ReadOptions::default() };
    let read = |options| -> Result<TrajectoryData, TrajectoryFileError> {
        open_from(text.as_bytes(), Path::new("ngsim.csv"), options, usize::MAX)?.collect_all()
    };
    let refused = read(ReadOptions::default()).unwrap_err();
    assert!(matches!(refused.problem, TrajectoryFileProblem::SeveralRecordings { .. }), "{refused}");
    let data = read(asked("i-80")).unwrap();
    assert_eq!((data.name.as_str(), data.trajectories[0].points[0].lane.0), ("i-80", 3));
    let is_urban = |data: &TrajectoryData| data.warnings().iter().any(|warning| warning.contains("urban street"));
    assert!(!is_urban(&data) && is_urban(&read(asked("lankershim")).unwrap()));
    let error = read(asked("peachtree")).unwrap_err();
    assert_mentions(&error, &["`peachtree`", "i-80, lankershim, us-101"], "another location");
}

#[test]
fn a_layout_of_another_program_can_be_demanded() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text, layout) in [
        ("a.xml", sumo_xml(false), LayoutChoice::Sumo),
        ("a.fzp", vissim_by_link(), LayoutChoice::Vissim),
        ("a.json", i24(true), LayoutChoice::I24),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        let asked = |layout| read_with(&path, ReadOptions { layout: Some(layout), ..ReadOptions::default() });
        assert!(asked(layout).is_ok());
        assert_mentions(&asked(LayoutChoice::Csv).unwrap_err(), &["not in csv as asked for"], name);
    }
    assert!(read_from(PLAIN_HEADER.as_bytes(), Path::new("a.csv")).is_err());
}
