//! Whether lanes that the positions of the traffic show hold on all of the road.
//!
//! ```text
//!   ──────────────────────────────   lane 1
//!   ──────────────────────────────   lane 2
//!     ─  ─  ─ ╱ ╱ ─  ─  ─  ─  ─      a ramp, which has no lane beside the road:
//!           ╱ ╱                      all of its vehicles cross the same marking at the same place
//! ```
//!
//! Drivers change lanes at different places, and most vehicles beside them keep their lanes. Where most vehicles
//! cross a marking alike, another lane lies there than on the rest of the road.

use std::collections::{BTreeMap, BTreeSet};

use super::source::Row;

/// Half the length of the parts of the road that are compared (m): a ramp with a slope of 1 in 30 crosses a
/// marking within 20 m, and ends within a few hundred metres. An assumption with a plausible range of 25 to 100 m.
const SECTION_M: f64 = 50.0;
/// Least number of vehicles that cross a marking alike: one or two may do so by chance.
const LEAST_VEHICLES: usize = 3;
/// One in this number of the crossings may be common before a result is in doubt. An assumption with a plausible
/// range of 5 to 20.
const ONE_COMMON_IN: usize = 10;

/// A change from one lane to another in a section of the road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Crossing {
    section: i64,
    from: u8,
    to: u8,
}

/// The vehicles in parts of the road. Each part is two sections long and begins with a section.
#[derive(Debug, Default)]
struct Parts {
    in_lane: BTreeMap<(i64, u8), BTreeSet<u64>>,
    crossing: BTreeMap<Crossing, BTreeSet<u64>>,
}

impl Parts {
    /// Returns `true` if most vehicles of both lanes cross the marking between them in a part of the road.
    fn is_common(&self, Crossing { section, from, to }: Crossing) -> bool {
        [section - 1, section].into_iter().any(|section| {
            let crossing = self.crossing.get(&Crossing { section, from, to }).map_or(0, BTreeSet::len);
            let in_lanes = [from, to].into_iter().filter_map(|lane| self.in_lane.get(&(section, lane))).flatten();
            crossing >= LEAST_VEHICLES && 2 * crossing > in_lanes.collect::<BTreeSet<_>>().len()
        })
    }
}

/// Returns the doubt about the lanes of `rows`, which their positions show.
pub(super) fn doubt(rows: &[Row]) -> Option<String> {
    let mut in_order: Vec<&Row> = rows.iter().collect();
    in_order.sort_by_key(|row| (row.number, row.origin, row.time));
    let (mut parts, mut crossings) = (Parts::default(), Vec::new());
    let mut latest: Option<(u64, u8, i64)> = None;
    for row in in_order {
        #[expect(clippy::cast_possible_truncation, reason = "a float cast saturates")]
        let section = (row.s_m / SECTION_M).floor() as i64;
        let here = (row.number, row.lane, section);
        let before = latest.replace(here);
        if before == Some(here) {
            continue;
        }
        let from = before.filter(|(number, lane, _)| *number == row.number && *lane != row.lane);
        for begin in [section - 1, section] {
            parts.in_lane.entry((begin, row.lane)).or_default().insert(row.number);
            if let Some((_, from, _)) = from {
                let crossing = Crossing { section: begin, from, to: row.lane };
                parts.crossing.entry(crossing).or_default().insert(row.number);
            }
        }
        crossings.extend(from.map(|(_, from, _)| Crossing { section, from, to: row.lane }));
    }
    let common = crossings.iter().filter(|crossing| parts.is_common(**crossing)).count();
    (ONE_COMMON_IN * common > crossings.len()).then(|| {
        format!(
            "{common} of {} changes of the lane are at places where most vehicles make the same one: ramps or exits lie there, and not the \
             lanes that the positions show elsewhere, so that vehicles seem to change lanes",
            crossings.len()
        )
    })
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{Time, VehicleClass};

    use super::super::data::MarkingDistances;
    use super::super::source::Clock;
    use super::*;

    fn row(vehicle: u64, frame: i64, s_m: f64, lane: u8) -> Row {
        Row {
            number: vehicle,
            origin: Time::ZERO,
            vehicle_id: vehicle,
            frame,
            time: Time::from_ms(100) * frame,
            clock: Clock::Continuous,
            s_m,
            d_m: -3.5 * f64::from(lane),
            lane,
            speed_mps: 50.0,
            acceleration_mps2: None,
            length_m: 4.5,
            width_m: 1.8,
            class: VehicleClass::Car,
            marking_distances: MarkingDistances::default(),
            line: 0,
        }
    }

    /// 40 vehicles in two lanes of 3.5 m along 600 m. One in two changes lanes, each at another place. `ramp` further
    /// ones come from the right, across the lanes 4 and 3, to lane 2.
    fn rows(ramp: u64) -> Vec<Row> {
        let lane = |vehicle: u64, s_m: f64| {
            let first = u8::from(vehicle.is_multiple_of(2)) + 1;
            let is_over = vehicle % 4 < 2 && s_m > 60.0 + 12.0 * vehicle as f64;
            match vehicle {
                0..40 if is_over => 3 - first,
                0..40 => first,
                _ if s_m < 110.0 + (vehicle % 5) as f64 => 4,
                _ if s_m < 170.0 + (vehicle % 5) as f64 => 3,
                _ => 2,
            }
        };
        let path = |vehicle: u64| (0..120).map(move |frame: u32| (vehicle, frame, 5.0 * f64::from(frame)));
        let vehicles = (0..40 + ramp).flat_map(path);
        vehicles.map(|(vehicle, frame, s_m)| row(vehicle, i64::from(frame), s_m, lane(vehicle, s_m))).collect()
    }

    #[test]
    fn vehicles_of_a_ramp_cross_markings_at_the_same_place_and_others_do_not() {
        assert_eq!(doubt(&rows(0)), None);
        assert_eq!(doubt(&rows(2)), None, "two vehicles");
        // The crossings into lane 2 are among vehicles that keep it.
        let common = doubt(&rows(6)).unwrap();
        assert!(common.starts_with("6 of 32 changes of the lane"), "{common}");
    }
}
