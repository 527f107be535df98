//! Rows, lines, messages and trajectories that stand in a file twice: with the same values one of them is left
//! out and counted, with other values the file is refused.

use crate::malformed_layouts::{state, trajectory};
use crate::malformed_rows::drive;
use crate::other_programs::{i24, sumo_xml};
use crate::support::{assert_mentions, read_text};

/// Returns `text` with its line `index` a second time, directly after itself or at the end.
fn with_line_again(text: &str, index: usize, at_end: bool) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    lines.insert(if at_end { lines.len() } else { index + 1 }, lines[index]);
    lines.join("\n") + "\n"
}

#[test]
fn what_stands_in_a_file_twice_with_the_same_values_counts_once() {
    let plain = drive(|_| {});
    let in_car = (0..20)
        .fold("time_s,s_m,d_left_m,speed_mps,left_marking_m,right_marking_m\n".to_owned(), |text, k| {
            text + &format!("{:.2},{:.1},-5.6,30,1.9,1.8\n", 0.04 * f64::from(k), 1.2 * f64::from(k))
        });
    let ngsim = (0..20).fold(String::new(), |text, k| {
        let (time_ms, y_feet) = (1_163_368_300_000_i64 + 100 * i64::from(k), 983.7 + 4.36 * f64::from(k));
        text + &format!("1 {} 884 {time_ms} 54.0 {y_feet:.2} 0 0 16.0 4.9 2 43.6 0.0 5 0 3 0.0 0.0\n", 12 + k)
    });
    let states = [state("10", "0"), state("12", "1"), state("14", "2")];
    let twice = [&states[..2], &states[1..]].concat();
    let sumo = sumo_xml(false);
    let (begin, end) = ("<timestep time=\"3.00\">", "<timestep time=\"3.10\">");
    let step = &sumo[sumo.find(begin).unwrap()..sumo.find(end).unwrap()];
    let (change, after_change) = ("<timestep time=\"6.00\">", "<timestep time=\"6.10\">");
    let change = &sumo[sumo.find(change).unwrap()..sumo.find(after_change).unwrap()];
    let documents = i24(true);
    let first = documents.trim_start_matches('[').split(",\n").next().unwrap();
    let cases = [
        ("plain", plain.clone(), with_line_again(&plain, 7, false), 1),
        ("plain, at the end", plain.clone(), with_line_again(&plain, 7, true), 1),
        ("in-car", in_car.clone(), with_line_again(&in_car, 7, false), 1),
        ("NGSIM", ngsim.clone(), with_line_again(&ngsim, 7, true), 1),
        ("CommonRoad", trajectory(&states), trajectory(&twice), 1),
        ("SUMO", sumo.clone(), sumo.replacen(end, &format!("{step}{end}"), 1), 4),
        // In the first row of a new lane.
        ("SUMO, lane change", sumo.clone(), sumo.replacen(after_change, &format!("{change}{after_change}"), 1), 4),
        ("I-24 MOTION", documents.clone(), documents.replacen('[', &format!("[{first},\n"), 1), 250),
    ];
    for (case, text, again, rows) in cases {
        let [data, twice] = [&text, &again].map(|text| read_text(text.as_bytes()).unwrap());
        assert_eq!((data.continuity.repeated_rows, twice.continuity.repeated_rows), (0, rows), "{case}");
        let points = |data: &closecall_recorded::trajectory_data::TrajectoryData| {
            data.trajectories.iter().map(|track| track.points.clone()).collect::<Vec<_>>()
        };
        assert_eq!(points(&twice), points(&data), "{case}");
        assert_eq!(twice.is_in_doubt, data.is_in_doubt, "{case}: {:?}", twice.notes);
        let said = format!("left out: {rows} row");
        assert!(twice.warnings().iter().any(|warning| warning.starts_with(&said)), "{case}: {:?}", twice.warnings());
    }
}

#[test]
fn what_stands_in_a_file_twice_with_other_values_is_refused_by_that_reason() {
    let plain = drive(|_| {});
    let (row, faster) = (plain.lines().nth(7).unwrap(), plain.lines().nth(7).unwrap().replace("25.000", "25.100"));
    let sumo = sumo_xml(false);
    let (begin, end) = ("<timestep time=\"3.00\">", "<timestep time=\"3.10\">");
    let step = sumo[sumo.find(begin).unwrap()..sumo.find(end).unwrap()].replace("32.00", "32.10");
    let states = [state("10", "0"), state("12", "1"), state("12.1", "1"), state("14", "2")];
    for (case, text) in [
        ("plain", plain.replacen(row, &format!("{row}\n{faster}"), 1)),
        ("CommonRoad", trajectory(&states)),
        ("SUMO", sumo.replacen(end, &format!("{step}{end}"), 1)),
    ] {
        let error = read_text(text.as_bytes()).expect_err(case);
        assert_mentions(&error, &["stands there twice", "with other values"], case);
    }
}
