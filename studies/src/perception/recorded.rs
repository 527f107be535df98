//! The shipped chain behind the rear LiDARs on a recording: its tracks, and their errors if the
//! recording has labels.
//!
//! ```text
//!  recording ─▶ scans ─┐
//!  poses ──────────────┼─▶ boxes, tracker, one step each 40 ms ─▶ tracks ─▶ lives
//!  labels ─────────────┴────────────────────────────────────────▶ truth ─▶ detection, errors, consistency
//! ```
//!
//! The figures with labels are as in the study of simulated sensors. A labelled vehicle takes the
//! place of an approach.

use closecall_recorded::scans::{Labels, Poses, Recording, ScanFileError, ScanFileProblem, TakenScan};
use closecall_sensors::lidar::{MAX_INTENSITY, RecordedPoints};
use closecall_sensors::{RecordedPerception, RecordedScanError, Scene, SceneVehicle, SensorError, TrackAudit};
use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::words::counted;
use closecall_traffic::{
    CONTROL_STEP, Dimensions, Environment, Road, Time, Track, TrackId, TrackStatus, Vehicle, VehicleClass,
    VehicleState, maths,
};

use crate::perception::approach::{Approach, GAPS_M, Observation, confirmed, errors, nearest};
use crate::perception::figures::Figures;

/// A recording whose scans the chain processes.
pub struct RecordedInput<'a> {
    /// The scans.
    pub recording: Recording,
    /// The names of the LiDARs that look back.
    pub lidars: Vec<&'static str>,
    /// The poses of the ego.
    pub poses: &'a Poses,
    /// The labels, if there are any.
    pub labels: Option<&'a Labels>,
    /// The chain before its first step.
    pub perception: RecordedPerception,
    /// The road: its lanes and guard rails. Poses without a map give its curvature.
    pub road: Road,
    /// Lateral position of the ego on the road, if the poses have no map (m).
    pub lane_d_m: f64,
    /// The ego.
    pub ego: Vehicle,
}

/// One control step of a recording.
pub struct RecordedStep<'a> {
    /// Time of the step.
    pub time: Time,
    /// The tracks at this time.
    pub tracks: &'a [Track],
    /// The ego and the labelled vehicles, if the labels reach to this time.
    pub scene: Option<&'a Scene<'a>>,
}

/// The reason for which the chain cannot process a recording.
#[derive(Debug, thiserror::Error)]
pub enum RecordedStudyError {
    /// A file is wrong.
    #[error(transparent)]
    File(#[from] ScanFileError),
    /// The processing fails.
    #[error("failed to process a recorded scan: {0}")]
    Sensor(#[from] SensorError),
}

/// The scans of one LiDAR.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LidarScans {
    /// Name of the LiDAR.
    pub name: &'static str,
    /// Number of its scans.
    pub scans: u64,
    /// Number of points in all of them.
    pub points: u64,
    /// Number of points outside of its field of view, which are left out.
    pub outside: u64,
}

/// The result of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedStudy {
    /// The scans of each LiDAR.
    pub lidars: Vec<LidarScans>,
    /// Time from the first to the last control step (s).
    pub duration_s: f64,
    /// Whether the poses state the place on the road.
    pub has_map: bool,
    /// Number of tracks.
    pub tracks: u64,
    /// The lives of the tracks that were confirmed, from the shortest to the longest (s).
    pub confirmed_lives_s: Vec<f64>,
    /// The figures by the labels, if there are any.
    pub truth: Option<TruthFigures>,
}

impl RecordedStudy {
    /// Returns why the labels may have another frame than the recording; `None` if some track belongs
    /// to a label, or there is no track that could.
    pub fn doubt(&self) -> Option<String> {
        let truth = self.truth.as_ref()?;
        let frame = "labels have x ahead of the ego's centre, negative behind it, and y to the left (m)";
        match truth.groups.first() {
            None => Some(format!(
                "no labelled vehicle is up to {} m behind the ego, where vehicles count: {frame}",
                GAPS_M[0]
            )),
            Some(all) if all.recall == 0.0 && !self.confirmed_lives_s.is_empty() => Some(format!(
                "{} behind the ego, and no confirmed track is ever near one: {frame}",
                counted(all.vehicles as u64, "labelled vehicle")
            )),
            Some(_) => None,
        }
    }
}

/// What the labels show.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthFigures {
    /// Time in which tracks were compared with labels (s).
    pub judged_s: f64,
    /// The figures of all labelled vehicles behind, and of the vehicles of each class.
    pub groups: Vec<VehicleGroup>,
    /// Mean normalised squared error of the confirmed tracks, 4 if their covariance is right; `None`
    /// without one.
    pub nees: Option<f64>,
    /// Number of times that the track of a vehicle changed its id.
    pub id_switches: u64,
    /// Number of confirmed tracks that belonged to no labelled vehicle, and were classified as one.
    pub false_tracks: u64,
}

/// Labelled vehicles with their figures.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleGroup {
    /// `all`, or the class.
    pub name: &'static str,
    /// Number of vehicles.
    pub vehicles: usize,
    /// Share of the steps with a vehicle behind in which it had a confirmed track.
    pub recall: f64,
    /// The other figures.
    pub figures: Figures,
}

/// The life of a track.
struct Life {
    id: TrackId,
    first: Time,
    last: Time,
    was_confirmed: bool,
}

/// Processes a recording, and shows each control step to `see`.
///
/// # Errors
/// [`RecordedStudyError`] if a file is wrong, or the processing fails.
pub fn study_recording(
    mut input: RecordedInput<'_>,
    see: &mut dyn FnMut(&RecordedStep<'_>),
) -> Result<RecordedStudy, RecordedStudyError> {
    let mut lidars: Vec<LidarScans> =
        input.lidars.iter().map(|&name| LidarScans { name, scans: 0, points: 0, outside: 0 }).collect();
    let mut next = input.recording.next_scan()?;
    let Some(start) = next.as_ref().map(|scan| scan.points.end) else {
        return Err(input.recording.error(ScanFileProblem::NoScans(input.lidars.join(", "))).into());
    };
    let linger = Time::from_s(input.perception.longest_period_s()) - CONTROL_STEP;
    let (mut lives, mut judge) = (Vec::new(), input.labels.map(Judge::new));
    let (mut latest, mut last_step) = (start, start);
    let mut brightness = Brightness::default();
    for step in 0.. {
        let time = start + CONTROL_STEP * step;
        while let Some(scan) = next.take_if(|scan| scan.points.end <= time) {
            latest = latest.max(scan.points.end);
            brightness.note(&scan.points);
            input.take(scan, &mut lidars)?;
            next = input.recording.next_scan()?;
        }
        if next.is_none() && (time > input.poses.last() || time > latest + linger) {
            break;
        }
        last_step = time;
        let (road, ego) = input.poses.place_at(time, &input.road, input.lane_d_m)?;
        let tracks = input.perception.step(time, (&road, ego));
        note_lives(tracks, time, &mut lives);
        match &mut judge {
            Some(judge) if judge.labels.cover(time) => judge.step(tracks, (&road, ego), (time, input.ego), see)?,
            _ => see(&RecordedStep { time, tracks, scene: None }),
        }
    }
    if lidars.iter().all(|lidar| lidar.outside == lidar.points) {
        return Err(input.recording.error(ScanFileProblem::NothingSeen(input.lidars.join(", "))).into());
    }
    brightness.check().map_err(|problem| input.recording.error(problem))?;
    let truth = judge.map(Judge::finish);
    if let Some(labels) = input.labels.filter(|_| truth.as_ref().is_some_and(|truth| truth.judged_s == 0.0)) {
        let problem = ScanFileProblem::NoLabels { labels_s: labels.span_s(), scans_s: [start.s(), latest.s()] };
        return Err(input.recording.error(problem).into());
    }
    let confirmed = lives.iter().filter(|life| life.was_confirmed);
    let mut confirmed_lives_s: Vec<f64> = confirmed.map(|life| (life.last - life.first).s()).collect();
    confirmed_lives_s.sort_by(f64::total_cmp);
    Ok(RecordedStudy {
        lidars,
        duration_s: (last_step - start).s(),
        has_map: input.poses.has_map(),
        tracks: lives.len() as u64,
        confirmed_lives_s,
        truth,
    })
}

impl RecordedInput<'_> {
    /// Passes a scan to the chain.
    fn take(&mut self, scan: TakenScan, lidars: &mut [LidarScans]) -> Result<(), RecordedStudyError> {
        let TakenScan { sensor, origin, points } = scan;
        let (road, ego) = self.poses.place_at(points.end, &self.road, self.lane_d_m)?;
        let count = points.len() as u64;
        let outside = self.perception.take(sensor, points, &road, ego).map_err(|error| match error {
            RecordedScanError::Point(error) => origin.error(error).into(),
            RecordedScanError::Sensor(error) => RecordedStudyError::Sensor(error),
        })?;
        let of_lidar = &mut lidars[sensor];
        of_lidar.scans += 1;
        of_lidar.points += count;
        of_lidar.outside += outside as u64;
        Ok(())
    }
}

/// The intensities of all points that have one.
#[derive(Default)]
struct Brightness {
    points: u64,
    /// Number of points with an intensity above 0.
    lit: u64,
    /// Number of points with an intensity above the intensity at which a receiver saturates.
    brighter: u64,
}

impl Brightness {
    fn note(&mut self, points: &RecordedPoints) {
        for value in points.intensity.iter().flatten() {
            self.points += 1;
            self.lit += u64::from(*value > 0.0);
            self.brighter += u64::from(*value > MAX_INTENSITY);
        }
    }

    /// Refuses intensities in another unit.
    fn check(&self) -> Result<(), ScanFileProblem> {
        let Self { points, lit, brighter } = *self;
        match (points, lit) {
            (1.., 0) => Err(ScanFileProblem::NoIntensity),
            _ if 2 * brighter > points => Err(ScanFileProblem::Intensity { brighter, points }),
            _ => Ok(()),
        }
    }
}

fn note_lives(tracks: &[Track], time: Time, lives: &mut Vec<Life>) {
    for track in tracks {
        let is_confirmed = track.status != TrackStatus::Tentative;
        match lives.iter_mut().rev().find(|life| life.id == track.id) {
            Some(life) => (life.last, life.was_confirmed) = (time, life.was_confirmed || is_confirmed),
            None => lives.push(Life { id: track.id, first: time, last: time, was_confirmed: is_confirmed }),
        }
    }
}

/// Compares tracks with labels.
struct Judge<'a> {
    labels: &'a Labels,
    audit: TrackAudit,
    steps: u64,
    /// The class of each labelled vehicle, and its observations while it is behind.
    vehicles: Vec<(VehicleClass, Approach)>,
}

impl<'a> Judge<'a> {
    fn new(labels: &'a Labels) -> Self {
        let vehicles = labels.names.iter().map(|_| (VehicleClass::Car, Approach::default())).collect();
        Self { labels, audit: TrackAudit::default(), steps: 0, vehicles }
    }

    fn step(
        &mut self,
        tracks: &[Track],
        (road, ego): (&Road, VehicleState),
        (time, ego_vehicle): (Time, Vehicle),
        see: &mut dyn FnMut(&RecordedStep<'_>),
    ) -> Result<(), SensorError> {
        let frame = EgoFrame::new(road, &ego);
        let others: Vec<(SceneVehicle, [f64; 2])> = self
            .labels
            .at(time)
            .map(|(actor, label)| {
                let [x_m, y_m] = label.at_m;
                let (s_m, d_m) = frame.road_position_m(x_m, y_m);
                let heading_rad = label.heading_rad - frame.point(s_m, d_m).road_yaw_rad;
                let typical = Vehicle::typical(label.class);
                let [length_m, width_m] = label.size_m;
                let dimensions = Dimensions { length_m, width_m, ..typical.dimensions };
                let state =
                    VehicleState { s_m, d_m, heading_rad, speed_mps: label.speed_mps, ..VehicleState::default() };
                let vehicle = Vehicle { dimensions, ..typical };
                // The middle of the front.
                let (sin, cos) = maths::sin_cos(label.heading_rad);
                let front_m = [x_m + 0.5 * length_m * cos, y_m + 0.5 * length_m * sin];
                (SceneVehicle { actor, vehicle, state, pitch_rad: 0.0 }, front_m)
            })
            .collect();
        let vehicles: Vec<SceneVehicle> = others.iter().map(|(other, _)| *other).collect();
        let ego = SceneVehicle { actor: usize::MAX, vehicle: ego_vehicle, state: ego, pitch_rad: 0.0 };
        let scene = Scene { time, road, environment: &Environment::CLEAR_DAY, ego, others: &vehicles };
        self.audit.observe(tracks, &scene)?;
        self.steps += 1;
        let confirmed: Vec<&Track> = confirmed(tracks).collect();
        for (other, front_m) in &others {
            let gap_m = -front_m[0] - 0.5 * ego_vehicle.dimensions.length_m;
            let (class, approach) = &mut self.vehicles[other.actor];
            *class = other.vehicle.class;
            if (0.0..=GAPS_M[0]).contains(&gap_m) {
                let tracked = nearest(&confirmed, *front_m).map(|track| errors(track, *front_m, other));
                approach.observations.push(Observation { gap_m, tracked, gospa_m: 0.0 });
            }
        }
        see(&RecordedStep { time, tracks, scene: Some(&scene) });
        Ok(())
    }

    fn finish(self) -> TruthFigures {
        let seen: Vec<(VehicleClass, Approach)> =
            self.vehicles.into_iter().filter(|(_, approach)| !approach.observations.is_empty()).collect();
        let group = |name, is_of: &dyn Fn(VehicleClass) -> bool| {
            let of_group = seen.iter().filter(|(class, _)| is_of(*class)).map(|(_, approach)| approach.clone());
            let approaches: Vec<Approach> = of_group.collect();
            let steps = approaches.iter().flat_map(|approach| &approach.observations);
            let (tracked, all) = steps.fold((0_u64, 0_u64), |(tracked, all), observation| {
                (tracked + u64::from(observation.tracked.is_some()), all + 1)
            });
            (all > 0).then(|| VehicleGroup {
                name,
                vehicles: approaches.len(),
                recall: tracked as f64 / all as f64,
                figures: Figures::of(&approaches),
            })
        };
        let classes = VehicleClass::ALL.into_iter().map(|of| group(of.name(), &|class| class == of));
        TruthFigures {
            judged_s: self.steps as f64 * CONTROL_STEP.s(),
            groups: std::iter::once(group("all", &|_| true)).chain(classes).flatten().collect(),
            nees: self.audit.mean_nees(),
            id_switches: self.audit.id_switches,
            false_tracks: self.audit.false_tracks() as u64,
        }
    }
}
