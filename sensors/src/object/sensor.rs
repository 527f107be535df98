//! One object-level sensor: it measures each vehicle in view, filters, confirms tracks, and reports
//! them after its latency.
//!
//! ```text
//!  truth ─▶ in view? ─▶ + noise, lost? ─▶ filter (road axes) ─▶ lifecycle ─▶ predict by L ─▶ wait L steps ─▶ ego frame
//! ```
//!
//! L is the latency in control steps. The model knows which vehicle a measurement belongs to,
//! because an object-level sensor models the output of a sensor with its own tracking. Only the
//! full LiDAR chain can confuse two vehicles.

use rand::RngExt;

use closecall_traffic::{CONTROL_STEP, ClassScores, Source, StandardNormal, Track, VehicleClass};

use super::config::{MAX_LATENCY_STEPS, ObjectSensorModel};
use super::faulty::{FaultStreams, Faulty};
use super::fit::{PitchedRanges, TargetRanges};
use super::noise::{MeasurementErrors, NoiseKey, Scan, TargetNoise};
use super::ranges::Ranges;
use super::target::{Filters, PIECES, Report, Target};
use super::visibility::{Direction, Field, Visibility};
use crate::alterations::BACKGROUND;
use crate::faults::{FaultList, ObjectFault};
use crate::monitors::{Alarm, Alarms};
use crate::perception::FieldOfView;
use crate::surroundings::OtherVehicle;
use crate::tracking::Gaussian;
use crate::tracking::TrackList;
use crate::tracking::axis::{AxisEstimate, AxisFilter, AxisMeasurement};
use crate::tracking::lifecycle::Lifecycle;
use crate::tracking::motion::{
    ACROSS_MODES, ACROSS_WHITE_MODE, ALONG_MODES, ALONG_WHITE_MODE, EgoRear, Mode, RearVehicle, Situation,
};
use crate::tracking::road_filter::{LATERAL_SPEED_PRIOR_SD_MPS, POSITION_PRIOR_SD_M, SPEED_PRIOR_SD_MPS, in_ego_frame};
use crate::{Health, Scene};
use closecall_traffic::ego_frame::EgoFrame;

/// Standard deviation of a track's speed above which the track is not confirmed (m/s): no function
/// could act on it yet.
const SETTLED_SPEED_SD_MPS: f64 = 1.0;
/// Share of the nominal range below which a sensor counts as degraded.
pub(crate) const DEGRADED_SHARE: f64 = 0.5;

/// The input of one scan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanInput<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) frame: &'a EgoFrame<'a>,
    pub(crate) others: &'a [OtherVehicle],
}

/// An object-level sensor with its state.
#[derive(Clone, Debug)]
pub(crate) struct ObjectSensor {
    model: ObjectSensorModel,
    direction: Direction,
    source: Source,
    channel: &'static str,
    key: NoiseKey,
    /// Motion modes along and across the road.
    modes: [&'static [Mode]; 2],
    visibility: Visibility,
    ranges: Ranges,
    targets: Vec<Target>,
    step: usize,
    faulty: Faulty,
}

impl ObjectSensor {
    pub(crate) fn front_radar(model: ObjectSensorModel, key: &NoiseKey) -> Self {
        Self::new(model, Direction::Ahead, Source::Front, "front-radar", key)
    }

    pub(crate) fn surround(model: ObjectSensorModel, key: &NoiseKey) -> Self {
        Self::new(model, Direction::Around, Source::Surround, "surround", key)
    }

    pub(crate) fn rear_object(model: ObjectSensorModel, key: &NoiseKey) -> Self {
        Self::new(model, Direction::Behind, Source::Rear, "rear-object", key)
    }

    fn new(
        model: ObjectSensorModel,
        direction: Direction,
        source: Source,
        channel: &'static str,
        key: &NoiseKey,
    ) -> Self {
        // One mode is enough for the radar, which measures speed, and for the surround sensors,
        // which see a vehicle only for a short time.
        let modes = match direction {
            Direction::Behind => [ALONG_MODES, ACROSS_MODES],
            Direction::Ahead | Direction::Around => [ALONG_WHITE_MODE, ACROSS_WHITE_MODE],
        };
        Self {
            model,
            direction,
            source,
            channel,
            key: key.clone(),
            modes,
            visibility: Visibility::default(),
            ranges: Ranges::new(&model),
            targets: Vec::new(),
            step: 0,
            faulty: Faulty::default(),
        }
    }

    /// Returns the same sensor with faults.
    pub(crate) fn with_faults(self, faults: FaultList<ObjectFault>) -> Self {
        let rng = self.key.stream(&format!("{}-fault", self.channel));
        Self { faulty: Faulty::new(faults, rng), ..self }
    }

    /// Measures one scene, and appends to `list` the tracks whose latency has elapsed.
    pub(crate) fn scan(&mut self, input: &ScanInput<'_>, list: &mut TrackList) {
        let size = input.scene.ego.vehicle.dimensions;
        let state = &input.scene.ego.state;
        let ego = EgoRear {
            s_m: state.s_m - 0.5 * size.length_m,
            d_m: state.d_m,
            speed_mps: state.speed_mps,
            half_lane_m: 0.5 * input.scene.road.lane_width_m(input.scene.road.lane_of(state), state.s_m),
        };
        // Fog and rain matter to the rear sensor only, which is optical. Radars are unaffected over
        // these distances.
        if self.direction == Direction::Behind && self.ranges.update(&self.model, input.scene.environment) {
            // Each vehicle gets its own when it is seen next.
            self.targets.iter_mut().for_each(|target| target.ranges = TargetRanges::UNKNOWN);
        }
        self.visibility.update(self.direction, input.others, &size);
        let before = list.tracks.len();
        let has_faults = self.faulty.has_faults();
        self.faulty.begin(input.scene.time, self.step, (self.direction, self.model.latency_steps));
        let [mut in_view, mut measured] = [0; 2];
        for (position, other) in input.others.iter().enumerate() {
            let index = self.target_index(other, position, input.scene.ego.pitch_rad);
            let errors = self.errors(index, (position, other), input);
            let is_classified = self.visibility.is_within(self.targets[index].ranges.class_range_m, position);
            // Nobody expects a measurement of a vehicle beyond its range.
            let expected = errors.filter(|_| !self.is_beyond_range(index, position));
            in_view += usize::from(expected.is_some());
            measured += usize::from(expected.is_some_and(|errors| !errors.is_lost));
            self.update_target(index, other, errors.map(|errors| (errors, is_classified)), &ego, list);
            self.report(index, other, input, list);
        }
        if has_faults {
            self.degrade([in_view, measured], before, input, list);
        }
        self.step += 1;
    }

    /// Returns whether a vehicle at this place in the list is so far away that it is seen at some
    /// distances only.
    fn is_beyond_range(&self, index: usize, position: usize) -> bool {
        let TargetRanges { range_m, intermittent_m, .. } = self.targets[index].ranges;
        intermittent_m > range_m && !self.visibility.is_within(range_m * self.faulty.range_share(), position)
    }

    /// Returns the errors of the measurement of a vehicle at this place in the list; `None` if it
    /// is not in view, or no scan arrives.
    fn errors(
        &mut self,
        index: usize,
        (position, other): (usize, &OtherVehicle),
        input: &ScanInput<'_>,
    ) -> Option<MeasurementErrors> {
        let (size, side) = (&input.scene.ego.vehicle.dimensions, input.scene.road.overtaking_side());
        let has_faults = self.faulty.has_faults();
        let field = Field {
            direction: self.direction,
            range_m: self.targets[index].ranges.intermittent_m * self.faulty.range_share(),
            half_angle_tan: self.model.half_angle_tan,
            blocked: self.faulty.blocked_slopes(),
        };
        let is_seen = self.visibility.sees(&field, position, other, size) && !(has_faults && self.faulty.hides(other));
        let is_beyond_range = self.is_beyond_range(index, position);
        let target = &mut self.targets[index];
        let is_far = !self.visibility.is_within(target.errors.far_m * self.faulty.range_share(), position);
        let share = target.ranges.intermittent_share;
        let is_shown = self.visibility.near_m(position).is_some_and(|near_m| target.is_seen_at(near_m, share));
        let scan = Scan {
            is_far,
            lost: match is_beyond_range && !is_shown {
                true => 1.0,
                false => target.errors.losses.probability(self.step, is_far && target.is_confirmed()),
            },
            speed_sd_mps: self.model.speed_sd_mps.unwrap_or(0.0),
        };
        if !has_faults {
            if is_seen {
                return Some(target.noise.draw(&target.errors, scan).mirrored_for(side));
            }
            target.noise.skip();
            return None;
        }
        // The errors are drawn whether the vehicle is seen or not, so that the faults' own draws
        // stay in step with the scans.
        let errors = target.noise.draw(&target.errors, scan);
        let errors = self.faulty.spoil(errors, target.fault_streams.as_mut()).mirrored_for(side);
        let mount_m = 0.5 * size.length_m * self.direction.sign();
        let [along_m, across_m] = self.faulty.shift_m(other, mount_m, input);
        let position_m = [errors.position_m[0] + along_m, errors.position_m[1] + across_m];
        (is_seen && !self.faulty.is_frame_lost()).then_some(MeasurementErrors { position_m, ..errors })
    }

    /// Applies the faults to the tracks of this step, which begin at the index `before`. A dead
    /// sensor has no tracks, a frozen sensor repeats its last tracks, and a ghost adds a track
    /// without a vehicle. `in_view` are the numbers of vehicles in view, and of those measured.
    fn degrade(&mut self, in_view: [usize; 2], before: usize, input: &ScanInput<'_>, list: &mut TrackList) {
        self.faulty.observe(in_view);
        if self.faulty.is_dead() {
            list.tracks.truncate(before);
            // After a restart, the sensor begins anew.
            for target in &mut self.targets {
                (target.filters, target.reports) = (None, [None; MAX_LATENCY_STEPS + 1]);
                target.history.clear();
            }
            return;
        }
        self.faulty.hold(before, input.scene.time, list);
        let track = self.faulty.ghost(self.direction == Direction::Ahead, self.source, input, list);
        list.tracks.extend(track);
    }

    /// Returns what the monitors of the sensor have noticed.
    pub(crate) fn alarms(&self) -> Alarms {
        let range_m = self.ranges.usual_m() * self.faulty.range_share();
        Alarms::NONE
            .with_if(Alarm::NothingNew, self.faulty.is_noticed())
            .with_if(Alarm::ShortRange, range_m < DEGRADED_SHARE * self.model.range_m)
            .with_if(Alarm::LostScans, self.faulty.transport().loses_scans())
            .with_if(Alarm::LateScans, self.faulty.transport().is_late())
    }

    /// Returns the sensor's health: failed if it has delivered nothing, or always the same, for a
    /// while; degraded if weather and dirt cost more than half of the range, or if scans are lost or
    /// late.
    pub(crate) fn health(&self) -> Health {
        let alarms = self.alarms();
        match (alarms.contains(Alarm::NothingNew), alarms.is_empty()) {
            (true, _) => Health::Failed,
            (false, false) => Health::Degraded,
            (false, true) => Health::Ok,
        }
    }

    /// Returns the field of view in the weather of the latest scan.
    pub(crate) fn field_of_view(&self) -> FieldOfView {
        FieldOfView::straight_back(self.model.half_angle_tan, self.ranges.usual_m())
    }

    /// Returns the index in `targets` of the vehicle `actor`, and adds the vehicle if it is new. It
    /// is usually `position`, that in the list of other vehicles. The ego has this pitch (rad).
    fn target_index(&mut self, other: &OtherVehicle, position: usize, pitch_rad: f64) -> usize {
        let actor = other.actor;
        let is_at = |target: &Target| target.actor == actor;
        let index = match self.targets.get(position).is_some_and(is_at) {
            true => position,
            false => self.targets.iter().position(is_at).unwrap_or_else(|| self.add_target(other)),
        };
        if self.targets[index].ranges.range_m.is_nan() {
            let deviation = self.targets[index].range_deviation;
            let pitched = self.ranges.of(&self.model, other, deviation);
            let errors = self.ranges.errors(&self.model, other, pitched.at(0.0).range_m);
            let target = &mut self.targets[index];
            target.noise.draw_skipped(&target.errors);
            target.ranges = pitched.at(pitch_rad);
            (target.pitched, target.errors) = (pitched, errors);
        } else if self.model.is_range_pitched() {
            let target = &mut self.targets[index];
            target.ranges = target.pitched.at(pitch_rad);
        }
        index
    }

    /// Adds a vehicle, and returns its index in `targets`.
    fn add_target(&mut self, other: &OtherVehicle) -> usize {
        let actor = other.actor;
        let errors = self.ranges.errors(&self.model, other, f64::INFINITY);
        let noise = TargetNoise::new(&self.key, self.channel, actor);
        let stream = |purpose: &str| self.key.stream_about(&format!("{}-{purpose}", self.channel), actor);
        let has_faults = self.faulty.has_faults();
        let fault_streams = has_faults.then(|| FaultStreams::new(&self.key, self.channel, actor));
        let (range_deviation, pieces) = match self.model.fit.is_some() {
            true => (stream("range").sample(StandardNormal), stream("intermittent").random()),
            false => (0.0, [1.0; PIECES]),
        };
        self.targets.push(Target {
            actor,
            range_deviation,
            pitched: PitchedRanges::default(),
            ranges: TargetRanges::UNKNOWN,
            pieces,
            errors,
            noise,
            filters: None,
            reports: [None; MAX_LATENCY_STEPS + 1],
            history: Vec::new(),
            fault_streams,
        });
        self.targets.len() - 1
    }

    /// Predicts and corrects the filters of one vehicle. `seen` holds the errors of the
    /// measurement, and whether the vehicle is near enough for its class to be known; it is `None`
    /// if the vehicle is not in view.
    fn update_target(
        &mut self,
        index: usize,
        other: &OtherVehicle,
        seen: Option<(MeasurementErrors, bool)>,
        ego: &EgoRear,
        list: &mut TrackList,
    ) {
        let (model, target) = (&self.model, &mut self.targets[index]);
        if let Some(Filters { axes: [along, across], .. }) = &mut target.filters {
            // The filter estimates the position of the vehicle's centre.
            let AxisEstimate { position_m, speed_mps, .. } = along.estimate();
            let front_s_m = position_m + 0.5 * other.length_m + speed_mps * CONTROL_STEP.s();
            let situation =
                Situation::of(&RearVehicle { front_s_m, d_m: across.estimate().position_m, speed_mps }, ego);
            for (axis, slow_decay) in [along, across].into_iter().zip(target.errors.slow_decay) {
                axis.predict(CONTROL_STEP.s(), slow_decay, situation);
            }
        }
        if let Some((errors, is_classified)) = seen.filter(|(errors, _)| !errors.is_lost) {
            let measured_m = [other.road_m[0] + errors.position_m[0], other.road_m[1] + errors.position_m[1]];
            let is_new = target.filters.is_none();
            let track = target.filters.get_or_insert_with(|| {
                let along_mps = Gaussian::new(ego.speed_mps, SPEED_PRIOR_SD_MPS);
                let across_mps = Gaussian::new(0.0, LATERAL_SPEED_PRIOR_SD_MPS);
                let prior = |axis: usize, speed_mps| {
                    let position_m = Gaussian::new(measured_m[axis], POSITION_PRIOR_SD_M);
                    AxisFilter::prior(self.modes[axis], position_m, speed_mps)
                };
                Filters {
                    id: list.new_id(),
                    lifecycle: Lifecycle::first_hit(&model.rules),
                    axes: [prior(0, along_mps), prior(1, across_mps)],
                    is_classified: false,
                }
            });
            // A vehicle that the camera has recognised stays recognised.
            track.is_classified |= is_classified;
            let Filters { lifecycle, axes: [along, across], .. } = track;
            for (road_axis, axis) in [&mut *along, across].into_iter().enumerate() {
                axis.measure_position(&AxisMeasurement {
                    position_m: measured_m[road_axis],
                    white_sd_m: errors.white_sd_m[road_axis],
                    slow_sd_m: errors.slow_sd_m[road_axis],
                    time_offset_s: 0.0,
                });
            }
            if let Some(sd_mps) = model.speed_sd_mps {
                along.measure_speed(other.road_mps[0] + errors.speed_mps, sd_mps);
            }
            if !is_new {
                lifecycle.hit(&model.rules, along.estimate().speed_variance_m2ps2.sqrt() <= SETTLED_SPEED_SD_MPS);
            }
        } else if let Some(Filters { lifecycle, .. }) = &mut target.filters {
            if seen.is_some() {
                lifecycle.miss(&model.rules)
            } else {
                lifecycle.skip()
            }
            if lifecycle.should_delete(&model.rules) {
                target.filters = None;
            }
        }
    }

    /// Stores the current estimate in the ring buffer, and appends the estimate stored
    /// `latency_steps` ago to `list`.
    fn report(&mut self, index: usize, other: &OtherVehicle, input: &ScanInput<'_>, list: &mut TrackList) {
        let has_faults = self.faulty.has_faults();
        let latency_steps = if has_faults { self.faulty.age_steps() } else { self.model.latency_steps };
        let latency_s = latency_steps as f64 * CONTROL_STEP.s();
        let target = &mut self.targets[index];
        let length = target.reports.len();
        let (latest, due) = (self.step % length, (self.step + length - latency_steps) % length);
        let predicted = |track: &Filters| Report {
            id: track.id,
            lifecycle: track.lifecycle,
            along: track.axes[0].predicted(latency_s),
            across: track.axes[1].predicted(latency_s),
            is_classified: track.is_classified,
        };
        // The entry is still `None` before the first report is due.
        let due = if has_faults {
            target.history.resize(length, None);
            target.history[latest] = target.filters;
            target.history[due].as_ref().map(predicted)
        } else {
            target.reports[latest] = target.filters.as_ref().map(predicted);
            target.reports[due]
        };
        if let Some(report) = due {
            list.tracks.push(self.track(&report, other, input));
        }
    }

    /// Transforms a report from road axes to a track in the ego's frame.
    fn track(&self, report: &Report, other: &OtherVehicle, input: &ScanInput<'_>) -> Track {
        let estimate = in_ego_frame(&[report.along, report.across], input.frame);
        let across = &report.across;
        Track {
            id: report.id,
            source: self.source,
            status: report.lifecycle.status(),
            time: input.scene.time,
            state: estimate.state,
            covariance: estimate.covariance,
            heading_rad: estimate.heading_rad,
            length_m: other.length_m,
            width_m: other.width_m,
            class: match self.model.is_class_background {
                true => BACKGROUND,
                false if report.is_classified => class_scores(other.class, self.model.class_confidence.of(other.class)),
                false => unrecognised(self.model.class_confidence.of(other.class)),
            },
            existence: report.lifecycle.existence(),
            lane: input.frame.lane_probabilities(
                report.along.position_m,
                across.position_m,
                across.position_variance_m2.sqrt(),
            ),
        }
    }
}

/// Returns the scores of a vehicle that is not recognised yet: the full chain takes it for
/// background.
fn unrecognised(confidence: f64) -> ClassScores {
    let mut scores = [(1.0 - confidence) / 3.0; 4];
    scores[ClassScores::BACKGROUND] = confidence;
    ClassScores(scores)
}

/// Returns class scores with `confidence` for `class` and equal shares of the rest for the three
/// others.
fn class_scores(class: VehicleClass, confidence: f64) -> ClassScores {
    let mut scores = [(1.0 - confidence) / 3.0; 4];
    scores[class as usize] = confidence;
    ClassScores(scores)
}
