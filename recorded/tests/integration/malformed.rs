//! Malformed files: the reader rejects each with line, column and allowed values.

use std::io::Write as _;

use closecall_recorded::trajectory_data::{TrajectoryFileProblem, read, read_from};

use crate::support::{PLAIN_HEADER, read_text};

/// Creates a row of the plain layout with the given columns changed.
fn row(changes: &[(&str, &str)]) -> String {
    let usual = [
        ("recording_id", "a"),
        ("track_id", "1"),
        ("vehicle_id", "4"),
        ("frame", "0"),
        ("time_s", "0.0"),
        ("s_m", "297.4"),
        ("d_m", "16.4"),
        ("lane_id", "5"),
        ("speed_mps", "13.2"),
        ("accel_mps2", "1.2"),
        ("heading_rel_rad", "0.003"),
        ("x_m", "144.7"),
        ("y_m", "-123.2"),
        ("length_m", "4.8"),
        ("width_m", "1.5"),
        ("vehicle_class", "car"),
        ("source_scenario", "x"),
    ];
    let value = |(column, usual): (&str, &'static str)| {
        changes
            .iter()
            .rfind(|(changed, _)| *changed == column)
            .map_or(usual.to_owned(), |(_, value)| (*value).to_owned())
    };
    usual.map(value).join(",")
}

/// Creates the row of frame `k` of a car that moves at its recorded speed.
fn moving_row(k: u32) -> String {
    let (time_s, s_m) = (0.1 * f64::from(k), 297.4 + 1.32 * f64::from(k));
    row(&[("frame", &k.to_string()), ("time_s", &format!("{time_s:.1}")), ("s_m", &format!("{s_m:.2}"))])
}

fn plain(rows: &[String]) -> String {
    format!("{PLAIN_HEADER}\n{}\n", rows.join("\n"))
}

const NGSIM_ROW: &str = "1 12 884 1163368300000 54.0 983.7 0 0 16.0 4.9 2 43.6 4.1 5 0 3 0.0 0.0";

fn ngsim(changes: &[(usize, &str)]) -> String {
    let mut fields: Vec<&str> = NGSIM_ROW.split(' ').collect();
    changes.iter().for_each(|(index, value)| fields[*index] = value);
    fields.join(" ")
}

/// Returns malformed texts, each with the parts that the error message must contain.
fn cases() -> Vec<(String, Vec<&'static str>)> {
    let cell = |column: &'static str, value: &'static str| {
        plain(&[row(&[]), row(&[("frame", "1"), ("time_s", "0.1"), (column, value)])])
    };
    let second = |changes: &[(&str, &str)]| plain(&[row(&[]), row(changes)]);
    vec![
        (String::new(), vec!["no rows"]),
        ("\n\n  \n".to_owned(), vec!["no rows"]),
        (format!("{PLAIN_HEADER}\n"), vec!["no rows"]),
        ("hello world\n1,2,3\n".to_owned(), vec!["line 1", "neither a header", "hello world"]),
        (format!("{}\n", row(&[])), vec!["line 1", "neither a header"]),
        ("1 2 3\n".to_owned(), vec!["line 1", "3 columns"]),
        (plain(&[row(&[])]).replacen("d_m,", "", 1), vec!["line 1", "no column `d_m`", "plain layout"]),
        (plain(&[row(&[])]).replacen("s_m,d_m", "d_m,d_m", 1), vec!["line 1", "`d_m` twice"]),
        (
            "Vehicle_ID,Frame_ID,Local_X,Local_Y,v_Vel\n1,2,3,4,5\n".to_owned(),
            vec!["line 1", "no column `Global_Time`"],
        ),
        (plain(&[row(&[]), row(&[("frame", "1")])[..30].to_owned()]), vec!["line 3", "columns, but 17 are needed"]),
        (plain(&[row(&[]) + ",extra"]), vec!["line 2", "18 columns, but 17 are needed"]),
        (cell("speed_mps", "nan"), vec!["line 3", "`speed_mps`", "is `nan`", "a number from 0 to 150"]),
        (cell("s_m", "inf"), vec!["line 3", "`s_m`", "is `inf`", "a number from"]),
        (cell("d_m", "-Infinity"), vec!["line 3", "`d_m`"]),
        (cell("s_m", "12..5"), vec!["line 3", "`s_m`", "is `12..5`"]),
        (cell("s_m", "fast"), vec!["line 3", "`s_m`", "is `fast`"]),
        (cell("s_m", ""), vec!["line 3", "`s_m`", "is ``"]),
        (cell("x_m", "NaN"), vec!["line 3", "`x_m`"]),
        (cell("heading_rel_rad", "3.51"), vec!["line 3", "`heading_rel_rad`", "in degrees"]),
        (cell("heading_rel_rad", "361"), vec!["line 3", "`heading_rel_rad`", "from -3.2 to 3.2 is needed"]),
        (ngsim(&[(4, "54,0")]).replace(' ', "\t"), vec!["line 1", "decimal commas", "`54,0`"]),
        (cell("length_m", "-4.8"), vec!["line 3", "`length_m`", "above 0 and up to 60"]),
        (cell("width_m", "0"), vec!["line 3", "`width_m`", "above 0"]),
        (cell("speed_mps", "-3"), vec!["line 3", "`speed_mps`"]),
        (cell("speed_mps", "1e308"), vec!["line 3", "`speed_mps`"]),
        (cell("track_id", "1.5"), vec!["line 3", "`track_id`", "a whole number"]),
        (cell("track_id", "-1"), vec!["line 3", "`track_id`", "a whole number from 0"]),
        (cell("frame", "99999999999999999999"), vec!["line 3", "`frame`"]),
        (cell("lane_id", "900"), vec!["line 3", "`lane_id`", "from 0 to 255"]),
        (cell("vehicle_class", "2"), vec!["line 3", "`vehicle_class`", "car, truck, motorcycle"]),
        (cell("recording_id", "b"), vec!["line 3", "`recording_id`", "`b`", "`a`", "one data set for each file"]),
        (cell("accel_mps2", "?"), vec!["line 3", "`accel_mps2`"]),
        (
            second(&[("speed_mps", "13.3")]),
            vec!["line 3", "frame 0 of vehicle 1 stands there twice", "line 2", "other values"],
        ),
        (second(&[("time_s", "5.0")]), vec!["line 3", "stands there twice"]),
        (
            plain(&[
                row(&[]),
                row(&[("frame", "1"), ("time_s", "0.1")]),
                row(&[("frame", "2"), ("time_s", "0.15")]),
                row(&[("frame", "3"), ("time_s", "0.3")]),
            ]),
            vec!["line 4", "goes on by 0.05", "0.1 s is needed"],
        ),
        (
            plain(&[
                row(&[]),
                row(&[("frame", "2"), ("time_s", "0.1")]),
                row(&[("frame", "1"), ("time_s", "0.2")]),
                row(&[("frame", "3"), ("time_s", "0.3")]),
            ]),
            vec!["line", "vehicle 1"],
        ),
        (format!("{PLAIN_HEADER}\n\"a,1,4\n"), vec!["line 2", "quoted field does not end"]),
        (format!("{}{PLAIN_HEADER}\n", plain(&[row(&[])])), vec!["line 3", "the header stands here again"]),
        (format!("{}\n{}\n", ngsim(&[]), ngsim(&[(0, "2"), (11, "abc")])), vec!["line 2", "`v_Vel`", "is `abc`"]),
        (ngsim(&[(8, "-16")]), vec!["line 1", "`v_Length`"]),
        (ngsim(&[(10, "7")]), vec!["line 1", "`v_Class`", "motorcycle"]),
        (ngsim(&[(3, "-5")]), vec!["line 1", "`Global_Time`"]),
        (format!("{}\n{}", ngsim(&[]), "1 13 884 11633"), vec!["line 2", "4 columns, but 18 are needed"]),
        (
            format!("{}\n{}\n", ngsim(&[]), ngsim(&[(11, "43.7")])),
            vec!["line 2", "frame 12 of vehicle 1 stands there twice"],
        ),
        (
            format!("{}\n{}\n", ngsim(&[]), ngsim(&[(1, "19"), (3, "1163368300100")])),
            vec!["line 2", "from frame 12 (line 1) to frame 19"],
        ),
        (
            format!("{}\n{}\n", ngsim(&[]), ngsim(&[(1, "13"), (3, "1163368300037")])),
            vec!["line 2", "goes on by 0.037"],
        ),
    ]
}

#[test]
fn each_malformed_file_is_rejected_with_location_and_allowed_values() {
    for (text, needed) in cases() {
        let error = read_text(text.as_bytes()).expect_err(&text);
        let message = error.to_string();
        assert!(message.starts_with("failed to read the trajectory file made-up.csv"), "{message}");
        for part in needed {
            assert!(message.contains(part), "`{message}` does not say `{part}`\nfor {text}");
        }
        assert!(!error.is_io());
    }
}

#[test]
fn files_that_are_not_text_are_rejected() {
    let noise: Vec<u8> = (0..4_000_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    for bytes in [noise.as_slice(), b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"track_id,frame\xff\xfe\n1,2\n"] {
        let error = read_text(bytes).unwrap_err();
        assert!(matches!(error.problem, TrajectoryFileProblem::Binary), "{error}");
    }
    let mut late = plain(&[row(&[])]).into_bytes();
    late.extend_from_slice(b"a,1,\xc3\x28\n");
    assert_eq!(read_text(&late).unwrap_err().line, Some(3));
    let endless = read_text(&vec![b'7'; 100_000]).unwrap_err();
    assert!(matches!(endless.problem, TrajectoryFileProblem::LineTooLong { .. }), "{endless}");
}

#[test]
fn a_truncated_gzip_stream_is_rejected_and_a_complete_one_read() {
    let rows: Vec<String> = (0..50).map(moving_row).collect();
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(plain(&rows).as_bytes()).unwrap();
    let packed = encoder.finish().unwrap();
    assert_eq!(read_text(&packed).unwrap().trajectories[0].points.len(), 50);
    // Two concatenated gzip members form one stream. The second member repeats the header, which is
    // not a valid row.
    assert_eq!(read_text(&[packed.clone(), packed.clone()].concat()).unwrap_err().line, Some(52));
    for kept in [3, 12, packed.len() / 2, packed.len() - 1] {
        let error = read_text(&packed[..kept]).unwrap_err();
        assert!(matches!(error.problem, TrajectoryFileProblem::Gzip(_)), "{kept}: {error}");
    }
    let mut damaged = packed.clone();
    damaged[packed.len() / 2] ^= 0x55;
    assert!(read_text(&damaged).is_err());
}

#[test]
fn a_missing_file_is_an_io_error() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("none.csv"), folder.path().to_owned()] {
        let error = read(&path).unwrap_err();
        assert!(error.is_io(), "{error}");
        assert!(error.to_string().contains(&path.display().to_string()));
    }
}

#[test]
fn the_row_order_does_not_change_the_tracks() {
    let rows: Vec<String> = (0..40)
        .map(|k| {
            row(&[
                ("track_id", if k % 2 == 0 { "1" } else { "2" }),
                ("frame", &(k / 2).to_string()),
                ("s_m", &format!("{:.2}", 300.0 + 1.32 * f64::from(k / 2))),
                ("time_s", &format!("{:.1}", 0.1 * f64::from(k / 2))),
            ])
        })
        .collect();
    let mut turned = rows.clone();
    turned.reverse();
    turned.swap(3, 17);
    let (a, b) = (read_text(plain(&rows).as_bytes()).unwrap(), read_text(plain(&turned).as_bytes()).unwrap());
    assert_eq!(a.trajectories, b.trajectories);
    assert_eq!(a.trajectories.len(), 2);
}

#[test]
fn a_vehicle_that_reappears_gets_a_second_track() {
    let at = |frame: i64, y: &str| {
        ngsim(&[(1, &frame.to_string()), (3, &(1_163_368_300_000 + 100 * frame).to_string()), (5, y)])
    };
    let text = [at(11, "900"), at(2, "880"), at(1, "870"), at(12, "910")].join("\n") + "\n";
    let data = read_from(text.as_bytes(), "x/i80.txt".as_ref()).unwrap();
    assert_eq!(data.name, "i80");
    let tracks: Vec<_> =
        data.trajectories.iter().map(|track| (track.track_id, track.vehicle_id, track.points.len())).collect();
    assert_eq!(tracks, [(1, 1, 2), (1_000_000_000_001, 1, 2)]);
    let first = data.trajectories[0].points[0];
    assert_eq!(first.time.ns(), 0);
    assert!((first.s_m - 0.3048 * (870.0 - 8.0)).abs() < 1e-9, "the centre is half a vehicle length behind the front");
    assert!((first.d_m + 0.3048 * 54.0).abs() < 1e-9, "d is positive to the left");
}

mod properties {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn arbitrary_bytes_do_not_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            let _ = read_text(&bytes);
        }

        #[test]
        fn truncation_and_damage_do_not_make_the_reader_panic(
            cut in 0_usize..900,
            index in 0_usize..900,
            byte in any::<u8>(),
        ) {
            let rows: Vec<String> = (0..6).map(moving_row).collect();
            let mut bytes = plain(&rows).into_bytes();
            let length = bytes.len();
            bytes[index % length] = byte;
            bytes.truncate(cut.min(length));
            if let Ok(data) = read_text(&bytes) {
                for point in data.trajectories.iter().flat_map(|track| &track.points) {
                    prop_assert!(point.s_m.is_finite() && point.d_m.is_finite() && point.speed_mps.is_finite());
                }
            }
        }
    }
}
