//! Malformed highD data sets, CommonRoad XML, in-car logs and compressed files.

use std::io::Read;
use std::path::Path;

use closecall_recorded::trajectory_data::{
    ReadOptions, TrajectoryFileError, TrajectoryFileProblem, open, read, read_from,
};
use closecall_traffic::VehicleClass;

use crate::malformed_rows::drive;
use crate::support::{PLAIN_HEADER, assert_mentions, read_text};

const IN_CAR: &str = "time_s,s_m,d_left_m,speed_mps,left_marking_m,right_marking_m";

fn in_car(rows: &[&str]) -> String {
    format!("{IN_CAR}\n{}\n", rows.join("\n"))
}

#[test]
fn malformed_in_car_logs_are_rejected() {
    let good = ["0.00,0.0,-5.6,30,1.9,1.8", "0.04,1.2,-5.6,30,1.9,1.8", "0.08,2.4,-5.6,30,1.9,1.8"];
    let with = |row: &str| in_car(&[good[0], good[1], row]);
    assert!(read_text(in_car(&good).as_bytes()).is_ok());
    for (text, needed) in [
        (in_car(&good).replace("right_marking_m", "right_m"), vec!["line 1", "no column `right_marking_m`", "in-car"]),
        (in_car(&good).replace(",s_m,", ",s_m2,"), vec!["line 1", "no column `s_m`"]),
        (with("0.08,2.4,-5.6,30"), vec!["line 4", "4 columns, but 6 are needed"]),
        (with("0.04,2.4,-5.6,30,1.9,1.8"), vec!["line 4", "`time_s`", "time has to go on"]),
        (with("0.01,2.4,-5.6,30,1.9,1.8"), vec!["line 4", "is 0.01, after 0.04"]),
        (with("0.055,2.4,-5.6,30,1.9,1.8"), vec!["line 4", "between two of their ticks"]),
        (with("0.08,nan,-5.6,30,1.9,1.8"), vec!["line 4", "`s_m`", "is `nan`"]),
        (with("0.08,2.4,-5.6,30,inf,1.8"), vec!["line 4", "`left_marking_m`", "is `inf`"]),
        (with("0.08,2.4,-5.6,30,1.9,NaN"), vec!["line 4", "`right_marking_m`"]),
        (with("0.08,2.4,-5.6,-30,1.9,1.8"), vec!["line 4", "`speed_mps`", "0 to 150"]),
        (with("0.08,2.4,-5.6,30,190,1.8"), vec!["line 4", "`left_marking_m`", "-20 to 20"]),
        (with("x,2.4,-5.6,30,1.9,1.8"), vec!["line 4", "`time_s`", "is `x`"]),
        (in_car(&good).trim_end().trim_end_matches('8').to_owned(), vec!["line 4", "does not end"]),
        (in_car(&["0,0,0,,1.9,1.8", "0.04,0,0,,1.9,1.8"]), vec!["no rows"]),
    ] {
        let error = read_text(text.as_bytes()).expect_err(&text);
        assert_mentions(&error, &needed, &text);
        assert!(!error.is_io());
    }
}

/// Writes a small highD data set with one text of one file replaced, and returns the error from
/// reading it.
fn highd(file: &str, from: &str, to: &str) -> TrajectoryFileError {
    let folder = tempfile::tempdir().unwrap();
    let mut rows =
        "frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,yAcceleration,precedingId,laneId\n".to_owned();
    for frame in 1..=20 {
        rows += &format!("{frame},2,{}.5,25.75,12.0,2.5,25.0,0,-0.5,0,0,6\n", 10 + frame);
    }
    let files = [
        (
            "07_recordingMeta.csv",
            "id,frameRate,upperLaneMarkings,lowerLaneMarkings\n7,25,8.5;12.5;16.5,21.0;25.0;29.0\n".to_owned(),
        ),
        ("07_tracksMeta.csv", "id,numFrames,class,drivingDirection\n2,20,Truck,2\n".to_owned()),
        ("07_tracks.csv", rows),
    ];
    for (name, text) in files {
        let text = if name == file { text.replacen(from, to, 1) } else { text };
        if !(name == file && to == "-") {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
    }
    read(&folder.path().join("07_tracks.csv")).expect_err(&format!("{file}: {from} -> {to}"))
}

#[test]
fn malformed_highd_data_sets_are_rejected() {
    let (tracks, vehicles, data) = ("07_tracks.csv", "07_tracksMeta.csv", "07_recordingMeta.csv");
    for (file, from, to, needed) in [
        (tracks, "laneId", "lane", vec!["07_tracks.csv, line 1", "no column `laneId`", "highD"]),
        (tracks, "3,2,13.5", "3,9,13.5", vec!["line 4", "`id`", "is `9`", "07_tracksMeta.csv"]),
        (tracks, "3,2,13.5", "2,2,13.5", vec!["line 4", "frame 2 of vehicle 2 stands there twice", "line 3"]),
        (tracks, "3,2,13.5", "3,-2,13.5", vec!["line 4", "`id`", "is `-2`"]),
        (tracks, "3,2,13.5", "3,2,nan", vec!["line 4", "`x`", "is `nan`"]),
        (tracks, "25.0,0", "-25.0,0", vec!["line 2", "`xVelocity`", "towards +x", "07_tracksMeta.csv"]),
        (tracks, "25.0,0", "abc,0", vec!["line 2", "`xVelocity`"]),
        (tracks, "12.0,2.5", "-12.0,2.5", vec!["line 2", "`width`", "above 0"]),
        (
            tracks,
            "20,2,30.5,25.75,12.0,2.5,25.0,0,-0.5,0,0,6\n",
            "",
            vec!["vehicle 2 has 19 rows, but 20 are stated", "line 2 of 07_tracksMeta.csv"],
        ),
        (vehicles, "20,Truck", "21,Truck", vec!["20 rows, but 21 are stated"]),
        (vehicles, "Truck", "7", vec!["07_tracksMeta.csv, line 2", "`class`", "is `7`"]),
        (vehicles, "Truck,2", "Truck,3", vec!["line 2", "`drivingDirection`", "1 (towards -x) or 2"]),
        (vehicles, "Truck,2", "Truck,1", vec!["07_tracks.csv, line 2", "towards -x"]),
        (
            vehicles,
            "2,20,Truck,2\n",
            "2,20,Truck,2\n2,20,Truck,2\n",
            vec!["line 3", "vehicle 2 stands there twice, first in line 2"],
        ),
        (vehicles, "numFrames", "frames", vec!["line 2", "no column `numFrames`"]),
        (vehicles, "2,20,Truck,2\n", "", vec!["07_tracksMeta.csv", "no rows"]),
        (data, "7,25,", "7,0,", vec!["07_recordingMeta.csv, line 2", "`frameRate`", "1 to 1000"]),
        (data, "7,25,", "7,nan,", vec!["line 2", "`frameRate`", "is `nan`"]),
        // A wrong frame rate: the positions then move at another speed than recorded.
        (data, "7,25,", "7,50,", vec!["07_tracks.csv: ", "0.6 to 1.6", "`frameRate`"]),
        (data, "21.0;25.0;29.0", "29.0;25.0;21.0", vec!["`lowerLaneMarkings`", "rising"]),
        (data, "21.0;25.0;29.0", "", vec!["07_tracks.csv, line 2", "lowerLaneMarkings"]),
        (data, "\n7,25", "\n8,25,,1;2\n7,25", vec!["2 rows, but 1 is needed"]),
    ] {
        let error = highd(file, from, to);
        assert_mentions(&error, &needed, &format!("{file}: {from} -> {to}"));
        assert!(!error.is_io(), "{error}");
    }
    for file in [vehicles, data] {
        let error = highd(file, "", "-");
        assert!(error.is_io() && error.to_string().contains(file), "the error names the missing file: {error}");
    }
}

#[test]
fn folders_with_no_data_set_or_several_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let error = read(folder.path()).unwrap_err();
    assert!(error.is_io() && error.to_string().contains("NN_tracks.csv"), "{error}");
    for name in ["01_tracks.csv", "02_tracks.csv.gz"] {
        std::fs::write(folder.path().join(name), "x").unwrap();
    }
    assert_mentions(
        &read(folder.path()).unwrap_err(),
        &["2 data sets in this folder", "01_tracks.csv to 02_tracks.csv"],
        "two",
    );
}

fn scenario(inside: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<commonRoad timeStepSize=\"0.1\" benchmarkID=\"T\">\n<lanelet id=\"1\">\n\
         <leftBound><point><x>0</x><y>0</y></point><point><x>500</x><y>0</y></point></leftBound>\n\
         <rightBound><point><x>0</x><y>-3.5</y></point><point><x>500</x><y>-3.5</y></point></rightBound>\n\
         </lanelet>\n{inside}\n</commonRoad>\n"
    )
}

fn obstacle(states: &str) -> String {
    format!(
        "<dynamicObstacle id=\"3\"><type>car</type><shape><rectangle><length>4.5</length><width>1.8</width></rectangle>\
         </shape>\n{states}</dynamicObstacle>"
    )
}

pub(crate) fn state(x: &str, time: &str) -> String {
    format!(
        "<state><position><point><x>{x}</x><y>-1.7</y></point></position><orientation><exact>0</exact></orientation>\
         <time><exact>{time}</exact></time><velocity><exact>20</exact></velocity></state>\n"
    )
}

pub(crate) fn trajectory(states: &[String]) -> String {
    scenario(&obstacle(&format!("<trajectory>{}</trajectory>", states.concat())))
}

#[test]
fn malformed_commonroad_scenarios_are_rejected() {
    let good = trajectory(&[state("10", "0"), state("12", "1"), state("14", "2")]);
    assert_eq!(read_text(good.as_bytes()).unwrap().trajectories[0].points.len(), 3);
    let bomb = "<!DOCTYPE b [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;&a;&a;\">]>\n<commonRoad timeStepSize=\"0.1\"/>";
    let deep = scenario(&"<a>".repeat(100_000));
    let long = scenario(&format!("<a b=\"{}\"/>", "x".repeat(3_000_000)));
    let endless_text = scenario(&format!("<a>{}</a>", "x".repeat(3_000_000)));
    for (text, needed) in [
        ("<html><body>404</body></html>".to_owned(), vec!["line 1", "the root element is `html`"]),
        ("<".to_owned(), vec!["line 1", "no CommonRoad scenario"]),
        ("<?xml version=\"1.0\"?>\n".to_owned(), vec!["there is no element"]),
        ("<commonRoad/>\n".to_owned(), vec!["timeStepSize"]),
        (good.replace("timeStepSize=\"0.1\"", "timeStepSize=\"0\""), vec!["`timeStepSize`", "is `0`"]),
        (good.replace("timeStepSize=\"0.1\"", "timeStepSize=\"nan\""), vec!["is `nan`"]),
        (good[..good.len() / 2].to_owned(), vec!["line 8", "before end of input"]),
        (
            good[..good.find("</state>").unwrap() + 8].to_owned(),
            vec!["line 8", "inside the element `trajectory`", "it is cut"],
        ),
        (good.replace("</trajectory>", "</trajectry>"), vec!["line", "no CommonRoad scenario"]),
        (good.replace("<x>12</x>", "<x>nan</x>"), vec!["line 9", "`x`", "is `nan`"]),
        (good.replace("<x>12</x>", "<x>&boom;</x>"), vec!["line 9", "`x`"]),
        (good.replace("<x>12</x>", ""), vec!["line 9", "a `position` that is a point"]),
        (good.replace("<exact>1</exact>", "<exact>0</exact>"), vec!["frame 0 of vehicle 3 stands there twice"]),
        (good.replace("<exact>1</exact>", "<exact>-1</exact>"), vec!["line 9", "`time`", "is `-1`"]),
        (good.replace("<exact>1</exact>", "<intervalStart>1</intervalStart>"), vec!["line 9", "an exact `time`"]),
        (good.replace("<type>car</type>", "<type>7</type>"), vec!["`type`", "is `7`"]),
        (good.replace("<type>car</type>", ""), vec!["needs a `type`"]),
        (good.replace("<length>4.5</length>", "<length>-4.5</length>"), vec!["`length`", "above 0"]),
        (good.replace("id=\"3\"", "id=\"-3\""), vec!["`id`", "is `-3`"]),
        (good.replace("<point><x>500</x><y>0</y></point>", ""), vec!["line 6", "lanelet 1", "two points"]),
        (good.replace("lanelet", "lanelit"), vec!["no lanelets"]),
        (scenario(""), vec!["no rows"]),
        (bomb.to_owned(), vec!["line 1", "document type declaration"]),
        (deep, vec!["nested deeper than 64"]),
        (long, vec!["longer than 1048576 bytes"]),
        (endless_text, vec!["longer than 1048576 bytes"]),
    ] {
        let error = read_text(text.as_bytes()).expect_err(&text[..text.len().min(400)]);
        assert_mentions(&error, &needed, &text[..text.len().min(400)]);
        assert!(!error.is_io(), "{error}");
    }
    let mut not_text = good.into_bytes();
    let index = not_text.windows(6).position(|part| part == b"<x>12<").unwrap() + 3;
    not_text[index] = 0xff;
    assert!(read_text(&not_text).is_err());
}

#[test]
fn an_initial_state_that_is_repeated_as_the_first_state_counts_once() {
    let initial = |text: String| text.replace("<state>", "<initialState>").replace("</state>", "</initialState>");
    let states = [state("10", "0"), state("12", "1"), state("14", "2")].concat();
    let with_initial =
        |first: String| scenario(&obstacle(&format!("{}<trajectory>{states}</trajectory>", initial(first))));
    let repeated = read_text(with_initial(state("10", "0")).as_bytes()).unwrap();
    assert_eq!(repeated.trajectories[0].points.len(), 3);
    let contradicting = read_text(with_initial(state("10.5", "0")).as_bytes()).unwrap_err();
    assert_mentions(&contradicting, &["frame 0 of vehicle 3 stands there twice"], "another position");
}

#[test]
fn an_unknown_type_is_read_as_the_nearest_class_and_counted() {
    let text = trajectory(&[state("10", "0"), state("12", "1"), state("14", "2")]).replace("car<", "truckWithTrailer<");
    let data = read_text(text.as_bytes()).unwrap();
    assert_eq!(data.trajectories[0].class, VehicleClass::Truck);
    let warning = "the vehicle class `truckWithTrailer` is unknown and read as truck (1 entry)";
    assert_eq!(data.warnings(), [warning]);
}

#[test]
fn optional_columns_may_be_empty() {
    let plain = drive(|_| {});
    let header = PLAIN_HEADER.split(',').collect::<Vec<_>>();
    let emptied = plain.lines().enumerate().map(|(number, line)| {
        let cells = line.split(',').zip(&header).map(|(cell, name)| {
            let is_optional =
                ["recording_id", "vehicle_id", "heading_rel_rad", "x_m", "y_m", "accel_mps2"].contains(name);
            if number > 0 && is_optional { "" } else { cell }
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    });
    let (full, emptied) =
        (read_text(plain.as_bytes()).unwrap(), read_text(emptied.collect::<String>().as_bytes()).unwrap());
    assert_eq!(full.trajectories[0].points.len(), emptied.trajectories[0].points.len());
    assert_eq!(emptied.trajectories[0].vehicle_id, emptied.trajectories[0].track_id);
    let optional = ",accel_mps2,heading_rad,lane_id,length_m,width_m,vehicle_class,recording_id";
    let rows = "0.00,0.0,-5.6,30,1.9,1.8,,,3,,,,\n0.04,1.2,-5.6,30,1.9,1.8,,,,,,,\n";
    let log = read_text(format!("{IN_CAR}{optional}\n{rows}").as_bytes()).unwrap();
    assert_eq!(log.trajectories[0].points.iter().map(|point| point.lane.0).collect::<Vec<_>>(), [3, 3]);
    assert_eq!(log.trajectories[0].dimensions, VehicleClass::Car.typical_dimensions());
}

#[test]
fn archives_are_rejected_by_name() {
    for (bytes, kind) in [
        (&b"PK\x03\x04\x14\0\0\0"[..], "a ZIP archive"),
        (b"BZh91AY&SY", "a bzip2 file"),
        (b"\xfd7zXZ\0\0", "an xz file"),
        (b"\x28\xb5\x2f\xfd\0", "a Zstandard file"),
    ] {
        assert_mentions(&read_text(bytes).unwrap_err(), &["made-up.csv", kind, "gzip"], kind);
    }
}

fn packed(source: &mut impl Read) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::copy(source, &mut encoder).unwrap();
    encoder.finish().unwrap()
}

#[test]
fn compressed_files_with_no_or_too_much_content_are_rejected_in_little_memory() {
    assert!(matches!(read_text(&packed(&mut &b""[..])).unwrap_err().problem, TrajectoryFileProblem::Empty));
    assert!(matches!(read_text(&packed(&mut &b"\n\n"[..])).unwrap_err().problem, TrajectoryFileProblem::Empty));
    // 200 MB of one letter, compressed to 0.9 MB: as a line, as a line after a header, and as a
    // tag.
    for (start, line) in [("", 1), (PLAIN_HEADER, 2), ("<commonRoad ", 1)] {
        let break_at = if start == PLAIN_HEADER { "\n" } else { "" };
        let mut text = start.as_bytes().chain(break_at.as_bytes()).chain(std::io::repeat(b'x').take(200_000_000));
        let error = read_text(&packed(&mut text)).unwrap_err();
        assert!(matches!(error.problem, TrajectoryFileProblem::LineTooLong { .. }), "{error}");
        assert_eq!(error.line, Some(line));
    }
    // Of a file that is compressed twice, only one layer is decompressed.
    let twice = packed(&mut packed(&mut &b"hello"[..]).as_slice());
    assert!(matches!(read_text(&twice).unwrap_err().problem, TrajectoryFileProblem::Binary));
    let mut followed = packed(&mut &b"a,b\n"[..]);
    followed.extend_from_slice(b"rubbish behind the end");
    assert!(read_text(&followed).is_err());
}

#[test]
fn missing_files_are_io_errors() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["none.csv", "none.xml", "03_tracks.csv", "03_tracksMeta.csv"] {
        let Err(error) = open(&folder.path().join(name), ReadOptions::default()) else { panic!("{name}") };
        assert!(error.is_io(), "{error}");
    }
    assert!(read_from(std::io::empty(), Path::new("x.csv")).is_err());
}
