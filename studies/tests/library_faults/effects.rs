//! The effects of faults on perception, and how each is recognised.

use closecall_sensors::Health;
use closecall_sensors::faults::NOTICED_AFTER_SCANS;
use closecall_traffic::{Source, Track, TrackStatus, VehicleClass, maths};

use crate::watch::{Car, Of, Pair, Step, pair};

/// Closing speed of an approaching vehicle (m/s), closing speed of a vehicle beside the ego, and
/// the error of the clock of the library (s).
const CLOSING_MPS: f64 = 10.0;
const CLOSING_BESIDE_MPS: f64 = 1.0;
/// Distance from the ego's middle to its bumper (m).
const HALF_EGO_M: f64 = 2.3;

/// The effect of a fault.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Effect {
    /// The sensor loses its tracks in this step, and has failed for the ego a second later.
    Dead { from_step: usize },
    /// The tracks repeat from this step on, and the sensor has failed a second later.
    Frozen { from_step: usize },
    /// The camera shows no new image, and has failed a second after this step.
    FrozenImage { from_step: usize },
    /// The score of the true class falls by more than this.
    Unclassified { loss: f64 },
    /// A vehicle this far to the left is not seen.
    Hidden { left_m: f64 },
    /// So many points per scan are where nothing is.
    FalsePoints { at_least: f64 },
    /// The same, and boxes and tracks equal the ones of a sensor without the fault.
    GhostPointsOnly { at_least: f64 },
    /// The images of vehicles behind a guard rail have tracks, in no lane.
    BesideTheRoad,
    /// So much of the points on vehicles is left.
    Points { share: [f64; 2] },
    /// The points on vehicles differ, and are higher by this (m).
    OtherPoints { higher_m: [f64; 2] },
    /// The first track is so much nearer.
    Range { share: [f64; 2] },
    /// The first track comes later by so many steps.
    Late { steps: [usize; 2] },
    /// In so many steps, the track is not measured.
    Coasts { share: [f64; 2] },
    /// The position along the road scatters this many times as much.
    ScattersAlong { times: f64 },
    /// An approaching vehicle appears nearer to the ego.
    Nearer { by_m: f64 },
    /// A vehicle appears farther to the left, by an angle seen from the sensor.
    ToLeft { by_deg: f64 },
    /// A vehicle appears faster.
    Faster { by_mps: f64 },
    /// A vehicle this far to the left counts as in another lane: 0 left, 2 right of the ego's. Its
    /// position is right.
    OtherLane { left_m: f64, lane: usize },
    /// There is a track without a vehicle.
    Ghost,
}

fn is_about(value: f64, expected: f64, tolerance: f64) -> Result<(), String> {
    if (value - expected).abs() <= tolerance { Ok(()) } else { Err(format!("{value:.3}, not {expected:.3}")) }
}

fn is_in<T: PartialOrd + std::fmt::Debug>(value: T, [least, most]: [T; 2]) -> Result<(), String> {
    if value >= least && value <= most { Ok(()) } else { Err(format!("{value:?}")) }
}

fn holds(is_so: bool, says: impl Into<String>) -> Result<(), String> {
    if is_so { Ok(()) } else { Err(says.into()) }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    sum / count
}

/// Returns the mean of a value of the tracks once they have settled.
fn settled(steps: &[Step], value: impl Fn(&Track) -> f64) -> f64 {
    mean(steps.iter().skip(60).filter_map(Step::track).map(value))
}

fn first(steps: &[Step]) -> Option<usize> {
    steps.iter().position(|step| step.track().is_some())
}

fn per_scan(steps: &[Step], count: impl Fn(&Step) -> usize) -> f64 {
    mean(steps.iter().map(|step| count(step) as f64))
}

impl Effect {
    /// Returns the vehicle of the drive, and the number of steps.
    fn scene(&self, sensor: Of) -> (Option<Car>, i64) {
        let beside = sensor == Of::Surround;
        let near_m: f64 = if beside { 6.0 } else { 60.0 };
        let closing_mps = if beside { CLOSING_BESIDE_MPS } else { CLOSING_MPS };
        let steady = |gap_m, left_m| Some(Car { gap_m, left_m, closing_mps: 0.0 });
        match *self {
            Self::Dead { .. } | Self::Frozen { .. } => (steady(near_m.min(40.0), 0.0), 160),
            Self::FrozenImage { .. } => (steady(40.0, 0.0), 160),
            Self::Unclassified { .. } => (steady(70.0, 0.0), 60),
            Self::Hidden { left_m } => (steady(if beside { -3.0 } else { 40.0 }, left_m), 60),
            Self::FalsePoints { .. } | Self::GhostPointsOnly { .. } => (steady(30.0, 0.0), 60),
            Self::BesideTheRoad => (steady(25.0, 4.2), 100),
            Self::Points { .. } => (steady(40.0, 0.0), 60),
            Self::Range { .. } if beside => (Some(Car { gap_m: 25.0, left_m: 0.0, closing_mps: 3.0 }), 220),
            Self::Range { .. } => (Some(Car { gap_m: 170.0, left_m: 0.0, closing_mps: 13.0 }), 300),
            Self::Late { .. } => (steady(near_m.min(40.0), 0.0), 40),
            Self::Coasts { .. } => (steady(near_m.min(40.0), 0.0), 160),
            Self::ScattersAlong { .. } => (steady(near_m.min(40.0), 0.0), 250),
            Self::Nearer { .. } if beside => (Some(Car { gap_m: 9.0, left_m: 0.0, closing_mps }), 110),
            Self::Nearer { .. } => (Some(Car { gap_m: 80.0, left_m: 0.0, closing_mps }), 110),
            Self::OtherPoints { .. } => (steady(25.0, 0.0), 110),
            Self::ToLeft { .. } | Self::Faster { .. } => (steady(near_m, 0.0), 110),
            Self::OtherLane { left_m, .. } => (steady(62.0, left_m), 110),
            Self::Ghost => (None, 80),
        }
    }

    /// Checks that a scenario of the library has this effect.
    ///
    /// # Errors
    /// The value that differs from the effect.
    pub(crate) fn check(&self, name: &str, sensor: Of) -> Result<(), String> {
        let is_timed = matches!(self, Self::Dead { .. } | Self::Frozen { .. } | Self::FrozenImage { .. } | Self::Ghost);
        let Pair { usual, faulty } = pair(name, sensor, self.scene(sensor), is_timed);
        holds(usual.iter().all(|step| step.health == Health::Ok), "the usual sensor is not well")?;
        let z_m = |steps: &[Step]| mean(steps.iter().flat_map(|step| &step.points_z_m).map(|z_m| f64::from(*z_m)));
        match *self {
            Self::Dead { from_step } => {
                has_failed_after(&faulty, from_step)?;
                let is_gone = |step: &Step| step.tracks.is_empty();
                // The camera is no condition of a track.
                holds(
                    sensor == Of::RearCamera || !is_gone(&faulty[from_step - 1]) && is_gone(&faulty[159]),
                    "tracks remain",
                )
            }
            Self::FrozenImage { from_step } => has_failed_after(&faulty, from_step),
            Self::Frozen { from_step } => {
                has_failed_after(&faulty, from_step)?;
                // The tracker of a LiDAR goes on with the same boxes.
                let state = |steps: &[Step], step: usize| steps[step].track().map(|track| track.state);
                let repeats = state(&faulty, from_step + 1) == state(&faulty, from_step + 20);
                let is_lidar = matches!(sensor, Of::RearLidar | Of::FrontLidar);
                let height = |step: usize| faulty[step].points_z_m.clone();
                let is_repeated = if is_lidar { height(from_step + 1) == height(from_step + 20) } else { repeats };
                holds(is_repeated && state(&usual, from_step + 1) != state(&usual, from_step + 20), "nothing repeats")
            }
            Self::Unclassified { loss } => {
                let score = |steps: &[Step]| settled_class(steps);
                holds(score(&usual) - score(&faulty) > loss, format!("{} {}", score(&usual), score(&faulty)))
            }
            Self::Hidden { .. } => holds(
                first(&usual).is_some() && first(&faulty).is_none(),
                format!("{:?} {:?}", first(&usual), first(&faulty)),
            ),
            Self::FalsePoints { at_least } | Self::GhostPointsOnly { at_least } => {
                let [before, after] = [&usual, &faulty].map(|steps| per_scan(steps, |step| step.false_points));
                holds(before == 0.0 && after >= at_least, format!("{before} {after}"))?;
                let same = usual.iter().zip(&faulty).all(|(usual, faulty)| usual.tracks == faulty.tracks);
                holds(same || !matches!(self, Self::GhostPointsOnly { .. }), "tracks differ")
            }
            Self::BesideTheRoad => {
                let ghosts = |steps: &[Step]| {
                    let all = steps.iter().flat_map(|step| step.tracks.clone());
                    all.filter(|track| track.y_m() > 7.4).collect::<Vec<_>>()
                };
                holds(ghosts(&usual).is_empty(), "they are there with the right map")?;
                let ghost_tracks = ghosts(&faulty);
                let in_no_lane =
                    ghost_tracks.iter().all(|track| track.lane.iter().all(|probability| *probability < 0.1));
                holds(ghost_tracks.len() > 30 && in_no_lane, format!("{} tracks", ghost_tracks.len()))
            }
            Self::Points { share } => {
                let [before, after] = [&usual, &faulty].map(|steps| per_scan(steps, |step| step.points_z_m.len()));
                is_in(after / before, share)
            }
            Self::OtherPoints { higher_m } => {
                let differ = usual.iter().zip(&faulty).filter(|(usual, faulty)| usual.points_z_m != faulty.points_z_m);
                let differ = differ.count();
                holds(differ >= 50, format!("the points differ in {differ} scans only"))?;
                is_in(z_m(&faulty) - z_m(&usual), higher_m)
            }
            Self::Range { share } => {
                let gap_m = |steps: &[Step]| {
                    let track = steps.iter().find_map(Step::track);
                    track.map_or(f64::NAN, |track| track.x_m().abs() - 2.0 * HALF_EGO_M)
                };
                is_in(gap_m(&faulty) / gap_m(&usual), share)
            }
            Self::Late { steps } => match (first(&usual), first(&faulty)) {
                (Some(usual), Some(faulty)) => is_in(faulty.saturating_sub(usual), steps),
                value => Err(format!("{value:?}")),
            },
            Self::Coasts { share } => {
                let coasting = |steps: &[Step]| {
                    let tracks: Vec<&Track> = steps.iter().skip(20).filter_map(Step::track).collect();
                    mean(tracks.iter().map(|track| f64::from(u8::from(track.status == TrackStatus::Coasting))))
                };
                holds(coasting(&usual) < 0.12, format!("usually {}", coasting(&usual)))?;
                is_in(coasting(&faulty), share)
            }
            Self::ScattersAlong { times } => {
                let scatter = |steps: &[Step]| {
                    let centre_m = settled(steps, Track::x_m);
                    settled(steps, |track| (track.x_m() - centre_m).powi(2)).sqrt()
                };
                let ratio = scatter(&faulty) / scatter(&usual);
                holds(ratio > times, format!("{ratio} times"))
            }
            Self::Nearer { by_m } => {
                let apart_m = |steps: &[Step]| settled(steps, |track| track.x_m().abs());
                is_about(apart_m(&usual) - apart_m(&faulty), by_m, 0.3 * by_m)
            }
            Self::ToLeft { by_deg } => {
                let moved_m = settled(&faulty, Track::y_m) - settled(&usual, Track::y_m);
                let mount_m = if sensor.source() == Source::Surround { 0.0 } else { HALF_EGO_M };
                let apart_m = settled(&usual, |track| track.x_m().abs()) - mount_m;
                let expected_m = apart_m * maths::sin(by_deg.to_radians());
                is_about(moved_m, expected_m, 0.25 * expected_m.abs())
            }
            Self::Faster { by_mps } => {
                let moved_m = settled(&faulty, Track::x_m) - settled(&usual, Track::x_m);
                is_about(moved_m, 0.0, 0.1)?;
                is_about(settled(&faulty, Track::vx_mps) - settled(&usual, Track::vx_mps), by_mps, 0.1)
            }
            Self::OtherLane { lane, .. } => {
                is_about(settled(&faulty, Track::y_m) - settled(&usual, Track::y_m), 0.0, 0.1)?;
                let [settled_usual, other] =
                    [settled(&usual, |track| track.lane[1]), settled(&faulty, |track| track.lane[lane])];
                holds(settled_usual > 0.5 && other > 0.5, format!("own lane {settled_usual}, then {other}"))
            }
            Self::Ghost => {
                let [before, after] = [&usual, &faulty].map(|steps| per_scan(steps, |step| step.tracks.len()));
                // From 2 s on, that is in 30 of 80 steps.
                holds(before == 0.0 && (after - 0.375).abs() < 1e-9, format!("{before} {after}"))
            }
        }
    }
}

/// Returns the mean score of the true class.
fn settled_class(steps: &[Step]) -> f64 {
    mean(steps.iter().filter_map(Step::track).map(|track| track.class.0[VehicleClass::Car as usize]))
}

/// Checks that the sensor has failed for the ego a second after this step, and not before.
fn has_failed_after(steps: &[Step], from_step: usize) -> Result<(), String> {
    let noticed = steps.iter().position(|step| step.health == Health::Failed);
    holds(noticed == Some(from_step + NOTICED_AFTER_SCANS as usize - 1), format!("noticed in step {noticed:?}"))
}
