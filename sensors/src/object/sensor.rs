//! One object-level sensor: measures each vehicle in view, filters, confirms, and reports after its latency.
//!
//! ```text
//!  truth ─▶ in view? ─▶ + noise, lost? ─▶ filter (road axes) ─▶ lifecycle ─▶ wait L steps ─▶ predict by L ─▶ E's frame
//! ```
//!
//! Which vehicle a measurement belongs to is taken as known: an object-level sensor models what a sensor with its own
//! tracking delivers, and confusing two vehicles is left to the full LiDAR chain.

use closecall_traffic::{ClassScores, Environment, Source, Track, TrackId, VehicleClass};

use super::config::{MAX_LATENCY_STEPS, ObjectSensorModel};
use super::noise::{NoiseKey, ScanErrors, TargetNoise};
use super::visibility::{Field, View, Visibility};
use super::weather::range_in_weather_m;
use crate::ego_frame::EgoFrame;
use crate::perception::FieldOfView;
use crate::surroundings::OtherVehicle;
use crate::tracking::TrackList;
use crate::tracking::axis::{AxisEstimate, AxisFilter, AxisMeasurement};
use crate::tracking::lifecycle::Lifecycle;
use crate::tracking::motion::{ACROSS, ACROSS_WHITE, ALONG, ALONG_WHITE, Behind, EgoRear, Mode, Situation};
use crate::tracking::road_filter::in_ego_frame;
use crate::{Health, SCAN_PERIOD, Scene};

/// Speed of a vehicle not yet measured: E's own, within this [m/s].
const SPEED_PRIOR_SD_MPS: f64 = 10.0;
/// Position before the first measurement: nothing in particular [m].
const POSITION_PRIOR_SD_M: f64 = 1_000.0;
/// Lateral speed of a vehicle not yet measured [m/s].
const LATERAL_SPEED_PRIOR_SD_MPS: f64 = 0.7;
/// A track is confirmed only once its speed is known to within this [m/s]: nobody could act on it before.
const SETTLED_SPEED_SD_MPS: f64 = 1.0;
/// A sensor that reaches less than this share of its range is degraded [1].
pub(crate) const DEGRADED_SHARE: f64 = 0.5;

/// What the sensor knows of a vehicle at the end of one scan.
#[derive(Clone, Copy, Debug)]
struct Report {
    id: TrackId,
    lifecycle: Lifecycle,
    along: AxisEstimate,
    across: AxisEstimate,
}

/// One vehicle, seen or not.
#[derive(Clone, Debug)]
struct Target {
    actor: usize,
    noise: TargetNoise,
    filters: Option<(TrackId, Lifecycle, [AxisFilter; 2])>,
    /// Reports that still wait, at the place of their step modulo the length.
    waiting: [Option<Report>; MAX_LATENCY_STEPS + 1],
}

/// What one scan looks at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ScanView<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) frame: &'a EgoFrame<'a>,
    pub(crate) others: &'a [OtherVehicle],
}

/// An object-level sensor with all that it remembers.
#[derive(Clone, Debug)]
pub(crate) struct ObjectSensor {
    model: ObjectSensorModel,
    view: View,
    source: Source,
    channel: &'static str,
    key: NoiseKey,
    /// How vehicles move along and across the road.
    modes: [&'static [Mode]; 2],
    visibility: Visibility,
    /// The weather that `range_m` was worked out for.
    weather: Option<Environment>,
    /// Range in this weather [m].
    range_m: f64,
    targets: Vec<Target>,
    step: usize,
}

impl ObjectSensor {
    pub(crate) fn front_radar(model: ObjectSensorModel, key: &NoiseKey) -> Self {
        Self::new(model, View::Ahead, Source::Front, "front-radar", key)
    }

    pub(crate) fn surround(model: ObjectSensorModel, key: &NoiseKey) -> Self {
        Self::new(model, View::Around, Source::Surround, "surround", key)
    }

    pub(crate) fn rear_object(model: ObjectSensorModel, key: &NoiseKey) -> Self {
        Self::new(model, View::Behind, Source::Rear, "rear-object", key)
    }

    fn new(model: ObjectSensorModel, view: View, source: Source, channel: &'static str, key: &NoiseKey) -> Self {
        // The radar measures speed, and what is alongside is seen for a moment: one mode serves them.
        let modes = match view {
            View::Behind => [ALONG, ACROSS],
            View::Ahead | View::Around => [ALONG_WHITE, ACROSS_WHITE],
        };
        Self {
            model,
            view,
            source,
            channel,
            key: key.clone(),
            modes,
            visibility: Visibility::default(),
            weather: None,
            range_m: model.range_m,
            targets: Vec::new(),
            step: 0,
        }
    }

    /// Measures one scene and appends the tracks that are due to `list`.
    pub(crate) fn scan(&mut self, view: &ScanView<'_>, list: &mut TrackList) {
        let size = view.scene.ego.vehicle.dimensions;
        let ego_m = [size.length_m, size.width_m];
        let state = &view.scene.ego.state;
        let ego = EgoRear {
            s_m: state.s_m - 0.5 * size.length_m,
            d_m: state.d_m,
            speed_mps: state.speed_mps,
            half_lane_m: 0.5 * view.scene.road.lane_width_m(),
        };
        self.look_at_weather(view.scene.environment);
        let field = Field { view: self.view, range_m: self.range_m, half_angle_tan: self.model.half_angle_tan };
        self.visibility.look(self.view, view.others, ego_m);
        for other in view.others {
            let place = self.place_of(other.actor);
            let errors = self.targets[place].noise.next(&self.model);
            let in_view = self.visibility.sees(&field, other, ego_m);
            let errors = errors.towards(view.scene.road.overtaking_side());
            self.follow(place, other, (in_view, errors), &ego, list);
            self.report(place, other, view, list);
        }
        self.step += 1;
    }

    /// Only the optical sensor, the rear one, is troubled by fog and rain; radars are not, over these distances.
    fn look_at_weather(&mut self, environment: &Environment) {
        if self.view == View::Behind && self.weather != Some(*environment) {
            self.weather = Some(*environment);
            self.range_m = range_in_weather_m(self.model.range_m, environment);
        }
    }

    /// Degraded where the weather has cost more than half of the range.
    pub(crate) fn health(&self) -> Health {
        if self.range_m < DEGRADED_SHARE * self.model.range_m { Health::Degraded } else { Health::Ok }
    }

    /// Where it looks, in the weather of the latest scan.
    pub(crate) fn field_of_view(&self) -> FieldOfView {
        FieldOfView { half_angle_tan: self.model.half_angle_tan, range_m: self.range_m }
    }

    /// Where the vehicle `actor` is kept; makes room for one that is new.
    fn place_of(&mut self, actor: usize) -> usize {
        self.targets.iter().position(|target| target.actor == actor).unwrap_or_else(|| {
            let noise = TargetNoise::new(&self.key, self.channel, actor, &self.model);
            self.targets.push(Target { actor, noise, filters: None, waiting: [None; MAX_LATENCY_STEPS + 1] });
            self.targets.len() - 1
        })
    }

    /// Predicts and corrects the filters of one vehicle.
    fn follow(
        &mut self,
        place: usize,
        other: &OtherVehicle,
        (in_view, errors): (bool, ScanErrors),
        ego: &EgoRear,
        list: &mut TrackList,
    ) {
        let (model, target) = (&self.model, &mut self.targets[place]);
        if let Some((_, _, [along, across])) = &mut target.filters {
            // The filter follows the middle of the vehicle.
            let AxisEstimate { position_m, speed_mps, .. } = along.now();
            let front_s_m = position_m + 0.5 * other.length_m + speed_mps * SCAN_PERIOD.s();
            let situation = Situation::of(&Behind { front_s_m, d_m: across.now().position_m, speed_mps }, ego);
            for axis in [along, across] {
                axis.predict(SCAN_PERIOD.s(), model.drift_decay, situation);
            }
        }
        if in_view && !errors.is_lost {
            let measured_m = [other.road_m[0] + errors.position_m[0], other.road_m[1] + errors.position_m[1]];
            let is_new = target.filters.is_none();
            let (_, lifecycle, [along, across]) = target.filters.get_or_insert_with(|| {
                let speeds_mps = [[ego.speed_mps, SPEED_PRIOR_SD_MPS], [0.0, LATERAL_SPEED_PRIOR_SD_MPS]];
                let prior = |axis: usize| {
                    let position_m = [measured_m[axis], POSITION_PRIOR_SD_M];
                    AxisFilter::prior(self.modes[axis], position_m, speeds_mps[axis])
                };
                (list.new_id(), Lifecycle::first_hit(&model.rules), [prior(0), prior(1)])
            });
            for (place, axis) in [&mut *along, across].into_iter().enumerate() {
                axis.measure_position(&AxisMeasurement {
                    position_m: measured_m[place],
                    white_sd_m: model.white_sd_m[place],
                    slow_sd_m: model.drift_sd_m,
                    lever_s: 0.0,
                });
            }
            if let Some(sd_mps) = model.speed_sd_mps {
                along.measure_speed(other.road_mps[0] + errors.speed_mps, sd_mps);
            }
            if !is_new {
                lifecycle.hit(&model.rules, along.now().speed_m2ps2.sqrt() <= SETTLED_SPEED_SD_MPS);
            }
        } else if let Some((_, lifecycle, _)) = &mut target.filters {
            if in_view {
                lifecycle.miss(&model.rules)
            } else {
                lifecycle.unseen()
            }
            if lifecycle.is_dead(&model.rules) {
                target.filters = None;
            }
        }
    }

    /// Puts what is known now in the queue, and appends what was put there `latency_steps` ago.
    fn report(&mut self, place: usize, other: &OtherVehicle, view: &ScanView<'_>, list: &mut TrackList) {
        let latency_s = self.model.latency_steps as f64 * SCAN_PERIOD.s();
        let target = &mut self.targets[place];
        let length = target.waiting.len();
        target.waiting[self.step % length] = target.filters.map(|(id, lifecycle, [along, across])| Report {
            id,
            lifecycle,
            along: along.ahead(latency_s),
            across: across.ahead(latency_s),
        });
        // Before the first report is due, the place still holds none.
        let due = target.waiting[(self.step + length - self.model.latency_steps) % length];
        if let Some(report) = due {
            list.tracks.push(self.track(&report, other, view));
        }
    }

    /// A report in road axes as a track in E's frame.
    fn track(&self, report: &Report, other: &OtherVehicle, view: &ScanView<'_>) -> Track {
        let estimate = in_ego_frame(&[report.along, report.across], view.frame);
        let across = &report.across;
        Track {
            id: report.id,
            source: self.source,
            status: report.lifecycle.status(),
            time: view.scene.time,
            state: estimate.state,
            covariance: estimate.covariance,
            heading_rad: estimate.heading_rad,
            length_m: other.length_m,
            width_m: other.width_m,
            class: class_scores(other.class, self.model.class_confidence),
            existence: report.lifecycle.existence(),
            lane: view.frame.lane_probabilities(across.position_m, across.position_m2.sqrt()),
        }
    }
}

/// `confidence` for the true class, the rest in equal shares for the three others.
fn class_scores(class: VehicleClass, confidence: f64) -> ClassScores {
    let mut scores = [(1.0 - confidence) / 3.0; 4];
    scores[class as usize] = confidence;
    ClassScores(scores)
}
