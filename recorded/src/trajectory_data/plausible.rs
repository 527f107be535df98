//! Plausibility check that detects mixed-up units and columns in trajectory data.
//!
//! A single number may be odd, and many of NGSIM's are. The check therefore judges medians over the
//! beginning of the file.
//!
//! | quantity | plausible | detects |
//! |---|---|---|
//! | steps that differ from the step before as no vehicle's do | at most half | numbers that are not unique for each vehicle |
//! | median length of cars | 2 to 12 m | feet instead of metres and the reverse, swapped length and width |
//! | median width of cars | 1 to 3 m | the same |
//! | median speed of moving vehicles | up to 70 m/s | feet instead of metres throughout a file, times that count too fast |
//! | vehicles whose position falls as they drive | below 5 % | a reversed axis, the other carriageway in the same file |
//! | vehicles that advance by more than 1.6 times what their recorded speeds make | at most 20 % | a column of zeros |
//! | median of (distance between two frames) / (speed · time) | 0.6 to 1.6; 0.8 to 1.25 in simulations | km/h, mph or ft/s instead of m/s (3.6, 2.2, 3.3), a wrong frame rate, swapped s and d, traffic that drives backwards |
//! | the same of all vehicles together, without jumps | 0.9 to 1.1, else a result is in doubt | a frame rate of 25 Hz for 30 Hz |
//! | median of (change of the speed in 5 s by the recorded accelerations) / (change of the recorded speed) | 0.5 to 2, else a result is in doubt | accelerations of 0, in ft/s² or g, with the other sign or in the axes of the vehicle |

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use closecall_traffic::statistics::quantiles::median;
use closecall_traffic::{Time, VehicleClass};

use super::continuity::{FrameClock, is_jump};
use super::error::TrajectoryFileProblem;
use super::file_layout::Layout;
use super::jumping_numbers::NumberSteps;
use super::source::{ReadError, Row};

/// Minimum speed of a vehicle for its steps to count (m/s). At lower speeds, position noise hides a
/// wrong unit.
pub(super) const MIN_SPEED_MPS: f64 = 5.0;

/// Largest median speed of moving vehicles (m/s): 252 km/h, above all limits of roads that have one, and above
/// the traffic of roads that have none. An assumption with a plausible range of 60 to 80 m/s.
const MOST_MEDIAN_MPS: f64 = 70.0;

/// Minimum number of steps between frames for their median to be judged.
pub(super) const MIN_STEPS: usize = 10;

/// Share of a vehicle's steps that lead backwards above which it drives against the road (-).
const AGAINST_STEPS: f64 = 0.5;
/// Share of vehicles against the road above which the file is refused (-): an error of numbers may
/// make a vehicle jump back once. An assumption with a plausible range of 0.01 to 0.1.
const AGAINST_VEHICLES: f64 = 0.05;

/// Distance of a vehicle as a share of what its speeds make, above which its speeds are too low (-).
const TOO_FAR: f64 = 1.6;
/// Share of the moving vehicles with too low speeds above which the file is refused (-). In the windows
/// of US-101, no vehicle is above 1.03. An assumption with a plausible range of 0.05 to 0.5.
const TOO_LOW_VEHICLES: f64 = 0.2;

/// Difference between the distance by positions and the distance by recorded speeds, of all moving
/// vehicles together, above which a result is in doubt, as a share of the distance by speeds (-). Frame
/// rates of 25 Hz and 30 Hz differ by 0.2. The windows of US-101 have 0.001, and 0.03 with two vehicles.
/// An assumption with a plausible range of 0.05 to 0.15.
const MOST_DISAGREEMENT: f64 = 0.1;

/// Shortest time over which accelerations are compared with speeds (s), and the least number of steps: filters smooth
/// and delay accelerations by a second or two, and some simulations state the acceleration of the step before.
const COMPARED_S: f64 = 5.0;
const COMPARED_STEPS: usize = 5;
/// Least change of the speed in this time that counts (m/s), and the least number of such changes. Errors of speeds,
/// which reach 0.5 m/s, make no such change.
const LEAST_CHANGE_MPS: f64 = 2.0;
const LEAST_CHANGES: usize = 20;
/// Plausible change of the speed by the recorded accelerations, as a share of the change of the recorded speed (-). The
/// windows of US-101 have 0.97, 0.77 with accelerations smoothed over 4 s, and 0.80 delayed by 1 s. Feet
/// instead of metres make 3.28 of 1.
const PLAUSIBLE_CHANGE: RangeInclusive<f64> = 0.5..=2.0;

/// One step of a vehicle between two frames.
struct RoadStep {
    vehicle: (u64, Time),
    /// Distance as a share of the distance that the speed predicts (-).
    ratio: f64,
    /// Line of the later row.
    line: u64,
}

/// Rejects rows whose medians are implausible for road traffic.
pub(super) fn check(rows: &[Row], layout: Layout, clock: FrameClock) -> Result<(), ReadError> {
    let mut numbers = NumberSteps::default();
    rows.iter().for_each(|row| numbers.add(row.number, row.origin, row.time, (row.s_m, row.d_m)));
    numbers.check().map_err(ReadError::of_file)?;
    let cars = || rows.iter().filter(|row| row.class == VehicleClass::Car);
    // In-car logs need not state the size of their vehicle, and that single vehicle may have any
    // size.
    if layout != Layout::InCar {
        let lengths = cars().map(|row| (row.length_m, row.line)).collect();
        let plausible =
            Plausible { quantity: "the median length of cars", unit: "m", range: (2.0, 12.0), allowed: "2 to 12 m" };
        check_median(lengths, plausible)?;
        let widths = cars().map(|row| (row.width_m, row.line)).collect();
        let plausible =
            Plausible { quantity: "the median width of cars", unit: "m", range: (1.0, 3.0), allowed: "1 to 3 m" };
        check_median(widths, plausible)?;
    }
    let steps = steps(rows, clock);
    if steps.len() >= MIN_STEPS {
        check_steps(steps, layout)?;
    }
    check_speeds(rows, clock)?;
    let speeds = rows.iter().filter(|row| row.speed_mps > MIN_SPEED_MPS).map(|row| (row.speed_mps, row.line)).collect();
    let plausible = Plausible {
        quantity: "the median speed of moving vehicles",
        unit: "m/s",
        range: (0.0, MOST_MEDIAN_MPS),
        allowed: "up to 70 m/s",
    };
    check_median(speeds, plausible)
}

/// Rejects steps of moving vehicles that contradict the recorded speeds.
fn check_steps(steps: Vec<RoadStep>, layout: Layout) -> Result<(), ReadError> {
    check_direction(&steps)?;
    let ratios: Vec<f64> = steps.into_iter().map(|step| step.ratio).collect();
    check_ratio(median(ratios), layout).map_err(ReadError::of_file)
}

/// Rejects a median `ratio` of the distance of a step to the distance that the speed predicts (-).
///
/// # Errors
/// The ratio is implausible for the layout.
pub(super) fn check_ratio(ratio: f64, layout: Layout) -> Result<(), TrajectoryFileProblem> {
    // A simulation has no noise: km/h and mph, which differ by 1.6, can be told apart.
    let (range, allowed) = match layout {
        Layout::Sumo | Layout::Vissim => ((0.8, 1.25), "0.8 to 1.25"),
        _ => ((0.6, 1.6), "0.6 to 1.6"),
    };
    let clock = match layout {
        Layout::Highd | Layout::Exid => "`frameRate`, in Hz,",
        Layout::Plain | Layout::InCar => "`time_s`, in seconds,",
        _ => "the time between two frames",
    };
    if ratio >= range.0 && ratio <= range.1 {
        return Ok(());
    }
    Err(TrajectoryFileProblem::ImplausibleSteps { ratio, allowed, clock })
}

/// Rejects steps that lead backwards: traffic of the other carriageway, or a reversed axis.
fn check_direction(steps: &[RoadStep]) -> Result<(), ReadError> {
    let mut vehicles: BTreeMap<(u64, Time), (usize, usize, u64)> = BTreeMap::new();
    for step in steps {
        let (backwards, all, _) = vehicles.entry(step.vehicle).or_insert((0, 0, step.line));
        *backwards += usize::from(step.ratio < 0.0);
        *all += 1;
    }
    let is_against = |(backwards, all): (usize, usize)| backwards as f64 > AGAINST_STEPS * all as f64;
    let against = vehicles.iter().filter(|(_, (backwards, all, _))| is_against((*backwards, *all)));
    let against: Vec<(u64, u64)> = against.map(|((number, _), (.., line))| (*number, *line)).collect();
    match against.first() {
        Some(&(first, line)) if against.len() as f64 > AGAINST_VEHICLES * vehicles.len() as f64 => {
            let (against, all) = (against.len(), vehicles.len());
            Err(ReadError::new(line, TrajectoryFileProblem::AgainstTheRoad { against, all, first }))
        }
        _ => Ok(()),
    }
}

/// The movement of a vehicle over all its steps between two frames.
#[derive(Clone, Copy, Debug, Default)]
struct Travel {
    steps: usize,
    time_s: f64,
    /// Distance by the positions (m).
    distance_m: f64,
    /// Distance by the recorded speeds (m).
    by_speed_m: f64,
    /// Line of the last row.
    line: u64,
}

impl Travel {
    fn is_moving(&self) -> bool {
        self.steps >= MIN_STEPS && self.distance_m > MIN_SPEED_MPS * self.time_s
    }
}

/// Rejects vehicles whose positions move although their recorded speeds say that they hardly do.
/// Position noise of vehicles at rest cancels out over their steps.
fn check_speeds(rows: &[Row], clock: FrameClock) -> Result<(), ReadError> {
    let moving = moving(rows, clock);
    let is_too_low = |travel: &Travel| travel.distance_m > TOO_FAR * travel.by_speed_m;
    let too_low = moving.iter().filter(|(_, travel)| is_too_low(travel)).count();
    match moving.iter().find(|(_, travel)| is_too_low(travel)) {
        Some(&(first, Travel { line, .. })) if too_low as f64 > TOO_LOW_VEHICLES * moving.len() as f64 => {
            let all = moving.len();
            Err(ReadError::new(line, TrajectoryFileProblem::SpeedsTooLow { too_low, all, first }))
        }
        _ => Ok(()),
    }
}

/// Returns the doubt about the clock, the positions or the speeds of a file, if the positions advance
/// further or less far than the speeds make.
pub(super) fn doubt(rows: &[Row], clock: FrameClock) -> Option<String> {
    let moving = moving(rows, clock);
    let sum = |value: fn(&Travel) -> f64| moving.iter().map(|(_, travel)| value(travel)).sum::<f64>();
    let (distance_m, by_speed_m) = (sum(|travel| travel.distance_m), sum(|travel| travel.by_speed_m));
    let share = distance_m / by_speed_m - 1.0;
    (by_speed_m > 0.0 && share.abs() > MOST_DISAGREEMENT).then(|| {
        let further = if share > 0.0 { "further" } else { "less far" };
        format!(
            "positions advance {:.0} % {further} than the recorded speeds make: the frame rate, the times, or a unit is wrong, and times and \
             headways with it",
            100.0 * share.abs()
        )
    })
}

/// The change of a vehicle's speed since a row, by its accelerations.
#[derive(Clone, Copy)]
struct SpeedChange {
    from: Row,
    latest: Row,
    steps: usize,
    by_acceleration_mps: f64,
}

/// Returns the doubt about the accelerations of a file, if they contradict the changes of the speeds.
pub(super) fn doubt_of_accelerations(rows: &[Row], clock: FrameClock) -> Option<String> {
    let mut open: BTreeMap<(u64, Time), SpeedChange> = BTreeMap::new();
    // The median of them leaves out crashes, which change a speed in a single step.
    let mut shares = Vec::new();
    for row in rows {
        let begun = SpeedChange { from: *row, latest: *row, steps: 0, by_acceleration_mps: 0.0 };
        let change = open.entry((row.number, row.origin)).or_insert(begun);
        let before = std::mem::replace(&mut change.latest, *row);
        let accelerations = before.acceleration_mps2.zip(row.acceleration_mps2);
        let Some((from_mps2, to_mps2)) = accelerations
            .filter(|_| row.frame == before.frame + clock.frames && row.time > before.time && !is_jump(&before, row))
        else {
            *change = begun;
            continue;
        };
        change.steps += 1;
        change.by_acceleration_mps += 0.5 * (from_mps2 + to_mps2) * (row.time - before.time).s();
        if change.steps >= COMPARED_STEPS && (row.time - change.from.time).s() >= COMPARED_S {
            let change_mps = row.speed_mps - change.from.speed_mps;
            if change_mps.abs() >= LEAST_CHANGE_MPS {
                shares.push(change.by_acceleration_mps / change_mps);
            }
            *change = begun;
        }
    }
    if shares.len() < LEAST_CHANGES {
        return None;
    }
    let share = median(shares);
    (!PLAUSIBLE_CHANGE.contains(&share)).then(|| {
        format!(
            "the recorded accelerations make {:.0} % of the changes of the recorded speeds: they are missing, in another unit, or in other \
             axes, and metrics of the acceleration are wrong with them",
            100.0 * share
        )
    })
}

/// Returns the numbers and the movements of the vehicles that move.
fn moving(rows: &[Row], clock: FrameClock) -> Vec<(u64, Travel)> {
    let mut latest: BTreeMap<(u64, Time), &Row> = BTreeMap::new();
    let mut travels: BTreeMap<(u64, Time), Travel> = BTreeMap::new();
    for row in rows {
        let vehicle = (row.number, row.origin);
        let Some(before) = latest.insert(vehicle, row) else { continue };
        let time_s = (row.time - before.time).s();
        if row.frame == before.frame + clock.frames && time_s > 0.0 && !is_jump(before, row) {
            let travel = travels.entry(vehicle).or_default();
            travel.steps += 1;
            travel.time_s += time_s;
            travel.distance_m += row.s_m - before.s_m;
            travel.by_speed_m += 0.5 * (row.speed_mps + before.speed_mps) * time_s;
            travel.line = row.line;
        }
    }
    let numbered = travels.into_iter().map(|((number, _), travel)| (number, travel));
    numbered.filter(|(_, travel)| travel.is_moving()).collect()
}

/// Returns the steps between two frames.
fn steps(rows: &[Row], clock: FrameClock) -> Vec<RoadStep> {
    let mut latest: BTreeMap<(u64, Time), &Row> = BTreeMap::new();
    let mut steps = Vec::new();
    for row in rows {
        let vehicle = (row.number, row.origin);
        // A second row of a frame is refused by that reason later.
        if latest.get(&vehicle).is_some_and(|before| before.frame == row.frame) {
            continue;
        }
        let Some(before) = latest.insert(vehicle, row) else { continue };
        let (time_s, speed_mps) = ((row.time - before.time).s(), 0.5 * (row.speed_mps + before.speed_mps));
        let follows = row.frame == before.frame + clock.frames && time_s > 0.0;
        if follows && speed_mps > MIN_SPEED_MPS {
            let ratio = (row.s_m - before.s_m) / (speed_mps * time_s);
            steps.push(RoadStep { vehicle, ratio, line: row.line });
        }
    }
    steps
}

/// A median, as the error names it, and its plausible range.
struct Plausible {
    quantity: &'static str,
    unit: &'static str,
    range: (f64, f64),
    /// The range as text.
    allowed: &'static str,
}

/// Rejects `values` if their median lies outside the plausible range. The error names the line of
/// the median.
fn check_median(mut values: Vec<(f64, u64)>, plausible: Plausible) -> Result<(), ReadError> {
    let Plausible { quantity, unit, range: (low, high), allowed } = plausible;
    if values.is_empty() {
        return Ok(());
    }
    let middle = values.len() / 2;
    let (median, line) = *values.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).1;
    if median >= low && median <= high {
        return Ok(());
    }
    let actual = format!("{median:.3} {unit}").trim_end().to_owned();
    Err(ReadError::new(line, TrajectoryFileProblem::Implausible { quantity, actual, allowed }))
}

#[cfg(test)]
mod tests {
    use std::fmt::Write;
    use std::path::Path;

    use closecall_traffic::maths;

    use crate::trajectory_data::{ReadOptions, open_from};

    #[test]
    fn accelerations_that_contradict_the_speeds_cause_doubt_and_noise_or_a_crash_does_not() {
        // Five vehicles over 40 s, whose position, speed and acceleration `motion` gives.
        let notes = |motion: &dyn Fn(f64) -> (f64, f64, Option<f64>)| {
            let mut text =
                "track_id,frame,time_s,s_m,d_m,lane_id,speed_mps,accel_mps2,length_m,width_m,vehicle_class\n"
                    .to_owned();
            for (track, frame) in (1..=5).flat_map(|track| (0..400).map(move |frame| (track, frame))) {
                let time_s = 0.1 * f64::from(frame);
                let (along_m, speed_mps, mps2) = motion(time_s);
                let s_m = 60.0 * f64::from(track) + along_m;
                let acceleration = mps2.map_or(String::new(), |mps2| format!("{mps2:.3}"));
                writeln!(text, "{track},{frame},{time_s:.1},{s_m:.3},1.8,1,{speed_mps:.3},{acceleration},4.5,1.8,car")
                    .unwrap();
            }
            let tracks = open_from(text.as_bytes(), Path::new("a.csv"), ReadOptions::default(), usize::MAX);
            let data = tracks.unwrap().collect_all().unwrap();
            (data.is_in_doubt, data.notes)
        };
        // Speeds between 22 and 28 m/s.
        let wave = |time_s: f64, factor: Option<f64>| {
            let (sine, cosine) = (maths::sin(0.5 * time_s), maths::cos(0.5 * time_s));
            (25.0 * time_s - 6.0 * cosine, 25.0 + 3.0 * sine, factor.map(|factor| factor * 1.5 * cosine))
        };
        for factor in [0.0, -1.0, 1.0 / 0.3048, 1.0 / 9.81] {
            let (is_in_doubt, notes) = notes(&|time_s| wave(time_s, Some(factor)));
            let is_named = |note: &String| note.starts_with("the recorded accelerations make");
            assert!(is_in_doubt && notes.iter().any(is_named), "{factor}: {notes:?}");
        }
        for factor in [Some(1.0), None] {
            assert_eq!(notes(&|time_s| wave(time_s, factor)), (false, Vec::new()));
        }
        // Steady vehicles whose speeds have errors of 0.6 m/s.
        let steady = |time_s: f64| (25.0 * time_s, 25.0 + 0.6 * ((10.0 * time_s).round() % 3.0 - 1.0), Some(0.0));
        assert_eq!(notes(&steady), (false, Vec::new()));
        // Vehicles that stop in a single step.
        let crash = |time_s: f64| match wave(time_s.min(33.0), Some(1.0)) {
            (along_m, ..) if time_s > 33.0 => (along_m, 0.0, Some(0.0)),
            moving => moving,
        };
        assert_eq!(notes(&crash), (false, Vec::new()));
    }
}
