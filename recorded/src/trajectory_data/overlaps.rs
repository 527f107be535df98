//! Vehicles in the place of other vehicles.
//!
//! ```text
//!   ──■■──────■───────■■──      two recordings of one road that were joined under different numbers,
//!   ─────■──────■■────────      or one that was joined twice
//! ```
//!
//! In the windows of US-101, no vehicle is in the place of another one in any row. Two windows that are joined have
//! 9 to 20 % of such rows.

use std::collections::BTreeSet;

use closecall_traffic::Time;

use super::source::Row;

/// Largest distance of the middles of two vehicles in one place, along and across the road, as a share of their
/// mean length or width (-). Two vehicles that touch each other have 1.
const SAME_PLACE: f64 = 0.8;
/// Number of later vehicles of the same instant with which a vehicle is compared.
const COMPARED: usize = 16;
/// Number of rows that are evaluated.
const ENOUGH_ROWS: usize = 1 << 18;
/// Least number of vehicles in the place of another one that shows a joined file: fewer are single errors.
const LEAST_VEHICLES: usize = 8;
/// Share of the rows in the place of another vehicle above which a result is in doubt (-). An assumption with a
/// plausible range of 0.02 to 0.08.
const IN_OTHERS_PLACE: f64 = 0.05;

/// Returns why a file may hold two recordings of one road, or one twice.
pub(super) fn doubt(rows: &[Row]) -> Option<String> {
    let instant = |row: &Row| -> (Time, Time) { (row.origin, row.time) };
    let mut sorted: Vec<&Row> = rows.iter().take(ENOUGH_ROWS).collect();
    sorted.sort_by(|a, b| instant(a).cmp(&instant(b)).then(a.s_m.total_cmp(&b.s_m)));
    let mut is_inside = vec![false; sorted.len()];
    for (index, rear) in sorted.iter().enumerate() {
        let later = sorted.iter().enumerate().skip(index + 1).take(COMPARED);
        for (other, front) in later.take_while(|(_, front)| instant(front) == instant(rear)) {
            let is_along = front.s_m - rear.s_m < SAME_PLACE * 0.5 * (front.length_m + rear.length_m);
            let is_across = (front.d_m - rear.d_m).abs() < SAME_PLACE * 0.5 * (front.width_m + rear.width_m);
            if is_along && is_across && front.number != rear.number {
                (is_inside[index], is_inside[other]) = (true, true);
            }
        }
    }
    let inside = || sorted.iter().zip(&is_inside).filter(|(_, is_inside)| **is_inside).map(|(row, _)| row.number);
    let (share, vehicles) = (inside().count() as f64 / sorted.len() as f64, inside().collect::<BTreeSet<_>>().len());
    (vehicles >= LEAST_VEHICLES && share > IN_OTHERS_PLACE).then(|| {
        format!(
            "in {:.0} % of the rows, a vehicle is in the place of another one: several recordings were joined, or vehicles are recorded \
             twice",
            100.0 * share
        )
    })
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use crate::trajectory_data::{ReadOptions, open_from};

    #[test]
    fn a_recording_that_stands_in_a_file_twice_under_other_numbers_is_in_doubt() {
        // Ten vehicles 40 m apart, and others that are moved against them.
        let doubt = |moved: Option<(f64, f64)>| {
            let mut text =
                "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n"
                    .to_owned();
            for (first, (along_m, right_m)) in std::iter::once((0, (0.0, 0.0))).chain(moved.map(|moved| (100, moved))) {
                for (vehicle, frame) in (0..10).flat_map(|vehicle| (0..50).map(move |frame| (vehicle, frame))) {
                    let (track, time_s) = (first + vehicle, 0.1 * f64::from(frame));
                    let (s_m, d_m) = (40.0 * f64::from(vehicle) + 30.0 * time_s + along_m, 1.8 + right_m);
                    let lane = if right_m > 2.0 { 2 } else { 1 };
                    writeln!(text, "{track},{frame},{time_s:.1},{s_m},{d_m},{lane},30,0,4.5,1.8,car").unwrap();
                }
            }
            let tracks = open_from(text.as_bytes(), Path::new("a.csv"), ReadOptions::default(), usize::MAX);
            let data = tracks.unwrap().collect_all().unwrap();
            assert_eq!(data.is_in_doubt, !data.notes.is_empty(), "{:?}", data.notes);
            data.notes
        };
        for moved in [(0.0, 0.0), (1.5, -0.5)] {
            let notes = doubt(Some(moved));
            assert!(notes.iter().any(|note| note.starts_with("in 100 % of the rows")), "{moved:?}: {notes:?}");
        }
        // A vehicle beside another one, and one close behind it.
        for moved in [None, Some((0.0, 3.6)), Some((5.0, 0.0))] {
            assert!(doubt(moved).is_empty(), "{moved:?}");
        }
    }
}
