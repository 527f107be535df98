//! Files that are smoothed while they are read give what files give that are read as a whole.

use std::fmt::Write as _;
use std::path::Path;

use closecall_recorded::criticality::{Judgement, criticality};
use closecall_recorded::filters::{smooth, smooth_file};
use closecall_recorded::trajectory_data::{ReadOptions, STREAM_ROWS, count_flaws, read};

/// Rows of one made-up vehicle.
const ROWS: usize = 120;

/// Writes more rows than are held at once: vehicles in two lanes. Every third changes lanes.
fn write_long(path: &Path, by_time: bool) {
    let vehicles = STREAM_ROWS / ROWS + 40;
    let row = |vehicle: usize, frame: usize| {
        let time_s = 0.1 * (frame + 7 * vehicle) as f64;
        let tau = if vehicle.is_multiple_of(3) { ((0.1 * frame as f64 - 4.0) / 4.0).clamp(0.0, 1.0) } else { 0.0 };
        let share = tau.powi(3) * (10.0 - 15.0 * tau + 6.0 * tau * tau);
        let right_m = 3.5 * ((vehicle % 2) as f64 + 0.5 + if vehicle.is_multiple_of(2) { share } else { -share });
        let lane = if right_m < 3.5 { 1 } else { 2 };
        let (frame_number, s_m) = (frame + 7 * vehicle, 2.5 * frame as f64);
        format!("{vehicle},{frame_number},{time_s:.1},{s_m:.2},{right_m:.3},{lane},25,0,4.5,1.8,car\n")
    };
    let mut rows: Vec<(usize, usize)> =
        (0..vehicles).flat_map(|vehicle| (0..ROWS).map(move |frame| (vehicle, frame))).collect();
    if by_time {
        rows.sort_by_key(|(vehicle, frame)| (frame + 7 * vehicle, *vehicle));
    }
    let mut text =
        "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n".to_owned();
    rows.into_iter().for_each(|(vehicle, frame)| text.write_str(&row(vehicle, frame)).unwrap());
    std::fs::write(path, text).unwrap();
}

#[test]
fn a_long_file_is_smoothed_while_it_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.csv");
    for by_time in [false, true] {
        write_long(&path, by_time);
        let whole = read(&path).unwrap();
        let (smoothed, streamed) = (smooth(&whole), smooth_file(&path, ReadOptions::default()).unwrap());
        assert_eq!(smoothed.tracks, streamed.data.tracks);
        assert_eq!(smoothed.markings, streamed.data.markings);
        assert_eq!(count_flaws(&whole).tracks, streamed.flaws.tracks);
        let evaluated = criticality(&streamed.data, &Judgement::default());
        assert!(evaluated.len() > 700, "{}", evaluated.len());
        assert_eq!(evaluated.len(), criticality(&smoothed, &Judgement::default()).len());
    }
}

#[test]
fn a_long_file_in_no_order_is_read_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mixed.csv");
    write_long(&path, false);
    let text = std::fs::read_to_string(&path).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    // Every second row, then the others.
    let halves = [0, 1].map(|half| rows.lines().skip(half).step_by(2).collect::<Vec<_>>().join("\n"));
    std::fs::write(&path, format!("{header}\n{}\n{}\n", halves[0], halves[1])).unwrap();
    let streamed = smooth_file(&path, ReadOptions::default()).unwrap();
    assert_eq!(streamed.data.tracks, smooth(&read(&path).unwrap()).tracks);
    // A wrong row is still refused.
    std::fs::write(&path, format!("{text}1,1,x,1,1,1,1,1,1,1,car\n")).unwrap();
    assert!(smooth_file(&path, ReadOptions::default()).unwrap_err().to_string().contains("`time_s`"));
}
