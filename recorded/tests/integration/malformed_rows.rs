//! Tables whose rows are wrong together: mixed-up units and columns that leave every single number
//! within its allowed range, cut rows, and rows in an order that a long file must not have.

use std::path::Path;

use closecall_recorded::trajectory_data::{
    AxisOptions, BadRows, ReadOptions, TrajectoryFileError, TrajectoryFileProblem, open_from,
};

use crate::support::{PLAIN_HEADER, assert_mentions, read_text};

/// Creates rows of one vehicle. `edit` changes each row's fields: time, s, d, speed, length, width.
pub(crate) fn drive(edit: impl Fn(&mut [f64; 6])) -> String {
    let mut text = format!("{PLAIN_HEADER}\n");
    for frame in 0..40 {
        let time_s = 0.1 * f64::from(frame);
        let mut at = [time_s, 50.0 + 25.0 * time_s, 5.2, 25.0, 4.6, 1.8];
        edit(&mut at);
        let [time_s, s_m, d_m, speed_mps, length_m, width_m] = at;
        text += &format!(
            "a,1,1,{frame},{time_s:.4},{s_m:.3},{d_m:.3},2,{speed_mps:.3},,0,0,0,{length_m:.3},{width_m:.3},car,x\n"
        );
    }
    text
}

#[test]
fn mixed_up_units_and_columns_are_detected() {
    const FEET_PER_M: f64 = 1.0 / 0.3048;
    assert!(read_text(drive(|_| {}).as_bytes()).is_ok());
    let steps = ["the median distance between two frames", "units or columns", "`time_s`, in seconds, wrong"];
    let cases: [(&str, String, &[&str]); 11] = [
        ("times in milliseconds", drive(|at| at[0] *= 1_000.0), &steps),
        ("km/h", drive(|at| at[3] *= 3.6), &steps),
        ("mph", drive(|at| at[3] *= 2.237), &steps),
        ("ft/s", drive(|at| at[3] *= FEET_PER_M), &steps),
        ("positions in feet", drive(|at| at[1] *= FEET_PER_M), &steps),
        ("s and d swapped", drive(|at| at.swap(1, 2)), &steps),
        ("driven backwards", drive(|at| at[1] = 500.0 - at[1]), &["line", "falls in the direction of travel"]),
        ("times in steps of a second", drive(|at| at[0] *= 10.0), &steps),
        (
            "sizes in feet",
            drive(|at| at.iter_mut().skip(4).for_each(|m| *m *= FEET_PER_M)),
            &["the median length of cars", "15.092 m", "2 to 12 m"],
        ),
        (
            "feet throughout, with sizes of a list",
            drive(|at| at[1..4].iter_mut().for_each(|value| *value *= FEET_PER_M)),
            &["the median speed of moving vehicles", "82.021 m/s", "up to 70 m/s"],
        ),
        ("length and width swapped", drive(|at| at.swap(4, 5)), &["the median length of cars"]),
    ];
    for (case, text, needed) in cases {
        assert_mentions(&read_text(text.as_bytes()).expect_err(case), needed, case);
    }
    // Metres instead of NGSIM's feet.
    let metres: String = (0..40)
        .map(|k| {
            format!("1 {k} 40 {} 5.2 {:.2} 0 0 4.6 1.8 2 25.0 0.0 2 0 0 0.0 0.0\n", 100 * k, 50.0 + 2.5 * f64::from(k))
        })
        .collect();
    assert_mentions(&read_text(metres.as_bytes()).unwrap_err(), &["the median length of cars", "1.402 m"], "metres");
}

#[test]
fn a_position_along_the_road_may_count_from_far_away() {
    let data = read_text(drive(|at| at[1] += 4_182_000.0).as_bytes()).unwrap();
    assert_eq!(data.trajectories[0].points.len(), 40);
    assert!(read_text(drive(|at| at[1] += 2e7).as_bytes()).is_err());
}

#[test]
fn negative_speeds_of_a_reversed_axis_are_turned_on_request() {
    let speed_mps = |at: &[f64; 6]| 25.0 + 0.5 * at[0];
    let clean = drive(|at| at[3] = speed_mps(at));
    let reversed = drive(|at| {
        at[1] = 500.0 - at[1];
        at[3] = -speed_mps(at);
    });
    let error = read_text(reversed.as_bytes()).unwrap_err();
    assert_mentions(&error, &["line 2", "`speed_mps`", "is `-25`", "0 to 150", "40 of 40 rows"], "negative speeds");
    let axes = AxisOptions { reverse_s: true, ..AxisOptions::default() };
    let options = ReadOptions { axes, ..ReadOptions::default() };
    let turned = open_from(reversed.as_bytes(), Path::new("made-up.csv"), options, usize::MAX).unwrap();
    let [turned, clean] = [turned.collect_all().unwrap(), read_text(clean.as_bytes()).unwrap()];
    for (turned, clean) in turned.trajectories[0].points.iter().zip(&clean.trajectories[0].points) {
        assert_eq!((turned.speed_mps, turned.d_m), (clean.speed_mps, clean.d_m));
        assert!((turned.s_m + 500.0 - clean.s_m).abs() < 0.002 && (turned.acceleration_mps2 - 0.5).abs() < 0.05);
    }
}

#[test]
fn unix_times_count_from_the_first_row() {
    let unix = drive(|at| at[0] += 1_600_000_000.0);
    let [unix, clean] = [unix, drive(|_| {})].map(|text| read_text(text.as_bytes()).unwrap());
    assert_eq!((unix.period, unix.trajectories), (clean.period, clean.trajectories));
}

#[test]
fn speeds_of_zero_of_moving_vehicles_are_detected() {
    let speeds = ["line", "1 of 1 moving vehicles", "speeds"];
    for speed_mps in [0.0, 2.5] {
        let error = read_text(drive(|at| at[3] = speed_mps).as_bytes()).unwrap_err();
        assert_mentions(&error, &speeds, "speeds without motion");
    }
    // Position noise at rest is no motion.
    let at_rest = drive(|at| {
        at[1] = 50.0 + if (10.0 * at[0]).round() % 2.0 == 0.0 { 0.8 } else { 0.0 };
        at[3] = 0.0;
    });
    assert!(read_text(at_rest.as_bytes()).is_ok());
}

#[test]
fn windows_line_ends_and_a_byte_order_mark_do_not_change_the_data() {
    let text = drive(|_| {});
    let windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
    let (a, b) = (read_text(text.as_bytes()).unwrap(), read_text(windows.as_bytes()).unwrap());
    assert_eq!(a.trajectories, b.trajectories);
}

#[test]
fn a_truncated_last_row_is_detected() {
    let text = drive(|_| {});
    let last_row = text.trim_end().rfind('\n').unwrap() + 1;
    let whole = read_text(text.trim_end().as_bytes()).unwrap();
    assert_eq!(whole.trajectories, read_text(text.as_bytes()).unwrap().trajectories, "only the end of the line lacks");
    for cut in last_row + 1..text.len() - 1 {
        let error = read_text(&text.as_bytes()[..cut]).expect_err("a cut row");
        assert_eq!(error.line, Some(41), "{error}");
    }
}

#[test]
fn bad_rows_are_skipped_and_counted_on_request() {
    let text = drive(|_| {});
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[5] = lines[4].replace("25.000", "25.100");
    lines[9] = lines[9].replace("25.000", "fast");
    lines[20] = "a,1,1".to_owned();
    let text = lines.join("\n") + "\n";
    let options = ReadOptions { bad_rows: BadRows::Skip, ..ReadOptions::default() };
    let mut tracks = open_from(text.as_bytes(), Path::new("made-up.csv"), options, usize::MAX).unwrap();
    let mut pieces = 0;
    while let Some(track) = tracks.next_track().unwrap() {
        assert_eq!(track.trajectory.vehicle_id, 1);
        pieces += 1;
    }
    assert_eq!(pieces, 1, "the gaps of three skipped rows are bridged");
    let continuity = tracks.continuity();
    assert_eq!((continuity.bridged_gaps, continuity.bridged_frames), (3, 3));
    let dropped: Vec<_> = tracks.dropped().reasons().map(|(why, rows)| (why, rows.count, rows.first_line)).collect();
    let expected =
        [("cut rows", 1, Some(21)), ("duplicated rows", 1, Some(6)), ("values that are not allowed", 1, Some(10))];
    assert_eq!(dropped, expected);
    assert_eq!(read_text(text.as_bytes()).unwrap_err().line, Some(10), "by default a bad row ends the reading");
}

#[test]
fn a_number_of_two_vehicles_at_once_is_refused_by_that_reason_and_in_doubt_if_its_rows_are_skipped() {
    let text = drive(|_| {});
    let shared = |vehicles: usize| {
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        for number in 1..=vehicles {
            let mut fields: Vec<String> = lines[number].split(',').map(str::to_owned).collect();
            fields[5] = format!("{}", fields[5].parse::<f64>().unwrap() + 50.0);
            lines.push(fields.join(","));
        }
        lines.join("\n") + "\n"
    };
    // The rows of the other vehicle at the end of the file, and by time.
    let by_time = {
        let mut lines: Vec<String> = shared(40).lines().map(str::to_owned).collect();
        lines[1..].sort_by_key(|line| line.split(',').nth(3).unwrap().parse::<u32>().unwrap());
        lines.join("\n") + "\n"
    };
    for text in [shared(1), by_time] {
        let error = read_text(text.as_bytes()).unwrap_err();
        assert!(matches!(error.problem, TrajectoryFileProblem::SharedNumber { .. }), "{error}");
        assert!(error.to_string().contains("belongs to several vehicles"), "{error}");
    }
    let options = ReadOptions { bad_rows: BadRows::Skip, ..ReadOptions::default() };
    let text = shared(5);
    let tracks = open_from(text.as_bytes(), Path::new("made-up.csv"), options, usize::MAX).unwrap();
    let data = tracks.collect_all().unwrap();
    assert_eq!(data.trajectories, read_text(drive(|_| {}).as_bytes()).unwrap().trajectories);
    assert!(data.is_in_doubt, "{:?}", data.notes);
    assert!(data.notes.iter().any(|note| note.starts_with("5 of 45 rows were left out")), "{:?}", data.notes);
}

#[test]
fn a_file_of_bad_rows_is_refused_as_a_whole() {
    let text = drive(|_| {});
    let spoilt = |bad: usize| {
        let spoil = |(index, line): (usize, &str)| {
            if (1..=bad).contains(&index) { line.replace(",25.000,", ",fast,") } else { line.to_owned() }
        };
        text.lines().enumerate().map(spoil).collect::<Vec<_>>().join("\n") + "\n"
    };
    let read_all = |text: &str, bad_rows: BadRows, window: usize| {
        let options = ReadOptions { bad_rows, ..ReadOptions::default() };
        open_from(text.as_bytes(), Path::new("made-up.csv"), options, window).and_then(|tracks| tracks.collect_all())
    };
    for (bad_rows, window) in [(BadRows::Reject, usize::MAX), (BadRows::Skip, usize::MAX), (BadRows::Skip, 5)] {
        let error = read_all(&spoilt(30), bad_rows, window).unwrap_err();
        assert_mentions(&error, &["line 2", "`speed_mps`", "is `fast`", "30 of", "rows cannot be used"], "30");
        assert!(!error.problem.affects_one_row(), "{error}");
    }
    assert!(read_all(&spoilt(30), BadRows::Reject, 5).is_err());
    let error = read_all(&spoilt(12), BadRows::Reject, usize::MAX).unwrap_err();
    assert!(error.problem.affects_one_row(), "{error}");
    assert!(read_all(&spoilt(12), BadRows::Skip, usize::MAX).is_ok());
}

/// Creates a file with more rows than the window. `vehicle_and_frame` gives vehicle and frame (from
/// its first) of a row.
fn long_file(vehicles: u64, frames: u64, vehicle_and_frame: impl Fn(u64) -> (u64, u64)) -> String {
    let mut text =
        "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
    for k in 0..vehicles * frames {
        let (vehicle, age) = vehicle_and_frame(k);
        let frame = 5 * vehicle + age;
        let time_s = 0.1 * frame as f64;
        text += &format!("{vehicle},{frame},{time_s:.1},{:.1},5.2,2,20,0,4.6,1.8,car\n", 2.0 * age as f64);
    }
    text
}

fn open_with_window(text: &str, window: usize) -> Result<Vec<(u64, usize)>, TrajectoryFileError> {
    let tracks = open_from(text.as_bytes(), Path::new("made-up.csv"), ReadOptions::default(), window)?;
    let mut ids = tracks
        .map(|track| track.map(|track| (track.trajectory.track_id, track.trajectory.points.len())))
        .collect::<Result<Vec<_>, _>>()?;
    ids.sort_unstable();
    Ok(ids)
}

#[test]
fn long_files_are_streamed_if_sorted_and_rejected_otherwise() {
    let (vehicles, frames) = (40, 30);
    let by_vehicle = long_file(vehicles, frames, |k| (k / frames, k % frames));
    let whole = open_with_window(&by_vehicle, usize::MAX).unwrap();
    assert_eq!(whole, (0..vehicles).map(|vehicle| (vehicle, 30)).collect::<Vec<_>>());
    assert_eq!(open_with_window(&by_vehicle, 100).unwrap(), whole);
    // Sorted by time: vehicle v is present in frames 5v to 5v + 29.
    let (header, rows) = by_vehicle.split_once('\n').unwrap();
    let mut rows: Vec<&str> = rows.lines().collect();
    rows.sort_by_key(|row| row.split(',').nth(1).unwrap().parse::<u64>().unwrap());
    let by_time = format!("{header}\n{}\n", rows.join("\n"));
    assert_eq!(open_with_window(&by_time, 100).unwrap(), whole);
    // Unsorted from the first row, and then unsorted only after the window.
    rows.sort_by_key(|row| row.split(',').nth(3).unwrap().parse::<f64>().unwrap() as u64 * 7 % 31);
    let unsorted = format!("{header}\n{}\n", rows.join("\n"));
    assert_eq!(open_with_window(&unsorted, usize::MAX).unwrap(), whole, "a short file may be in any order");
    let error = open_with_window(&unsorted, 100).unwrap_err();
    assert_mentions(&error, &["line", "sorted by vehicle or by time throughout"], "unsorted");
    let mut lines: Vec<&str> = by_vehicle.lines().collect();
    lines.swap(200, 900);
    let error = open_with_window(&(lines.join("\n") + "\n"), 100).unwrap_err();
    assert_eq!(error.line, Some(202), "a row of vehicle 29 comes before: {error}");
    assert_mentions(&error, &["sorted by vehicle"], "swapped");
}
