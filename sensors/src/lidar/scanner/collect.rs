//! The solids and the spray of a scene that a sweep may hit.

use closecall_traffic::{PlanePose, Roadside, maths};
use nalgebra::{Isometry3, Point3, Vector3};

use super::super::material::asphalt;
use super::super::roadside::{append_guard_rails, append_roadside};
use super::super::shapes::{append_rear_plate, append_solids};
use super::super::soft::{self, Plume};
use super::super::targets::{Beams, Surface, Targets};
use super::super::viewpoint::{Viewpoint, plane_from_body};
use super::super::{Material, MirrorSide, PointSource};
use super::Scanner;
use crate::{Scene, SceneVehicle};

/// Distance of a vehicle's centre beyond which the vehicle is ignored (m). From there only a plate
/// could give a return.
const MAX_CENTRE_DISTANCE_M: f64 = 300.0;

impl Scanner {
    /// Collects all solids and spray plumes that a beam could hit.
    pub(super) fn collect_targets(&mut self, scene: &Scene<'_>, mirror_side: MirrorSide, view: &Viewpoint) {
        self.targets.clear();
        self.plumes.clear();
        let ground = |_| asphalt(scene.environment);
        let surface = Surface { source: PointSource::Ground, reflectivity: &ground };
        self.targets.push_ground(&view.sensor_from_plane(0.0), surface);
        self.note_rest();
        if scene.road.has_guard_rails() {
            self.collect_along_road(scene, PointSource::GuardRail, mirror_side, view);
        }
        if *scene.road.roadside() != Roadside::default() {
            self.collect_along_road(scene, PointSource::Roadside, mirror_side, view);
        }
        self.collect_plume(&scene.ego, scene, view);
        for other in scene.others {
            self.collect_vehicle(other, scene, mirror_side, view);
            self.collect_plume(other, scene, view);
        }
    }

    /// Collects the guard rails, or the other things along the road.
    fn collect_along_road(
        &mut self,
        scene: &Scene<'_>,
        source: PointSource,
        mirror_side: MirrorSide,
        view: &Viewpoint,
    ) {
        self.guard_rails.clear();
        let append = if source == PointSource::GuardRail { append_guard_rails } else { append_roadside };
        append(scene.road, scene.ego.state.s_m, &mut self.guard_rails);
        let appearance = scene.ego.vehicle.appearance;
        let steel = |material: Material| material.reflectivity(None, &appearance, scene.environment);
        let surface = Surface { source, reflectivity: &steel };
        for (solid, pose) in &self.guard_rails {
            let placed = plane_from_body(*pose, 0.0);
            let before_end_s = self.crossing_before_end_s(view, &placed);
            let frozen = view.sensor_from_plane(before_end_s) * placed;
            self.targets.push(Beams { pattern: self.pattern, mirror_side }, solid, &frozen, surface);
            if self.has_drifts() {
                let velocity = velocity_mps(|before_s| view.sensor_from_plane(before_s) * placed, before_end_s);
                self.targets.note_drift(velocity, self.sweep_s() - before_end_s);
            }
        }
    }

    fn collect_vehicle(&mut self, other: &SceneVehicle, scene: &Scene<'_>, mirror_side: MirrorSide, view: &Viewpoint) {
        let pose = scene.road.plane_pose(other.state.s_m, other.state.d_m, other.state.heading_rad);
        let now = view.sensor_from_plane(0.0) * plane_from_body(pose, other.pitch_rad);
        let centre = now.translation.vector;
        if !(centre.norm() < MAX_CENTRE_DISTANCE_M && centre.x > -other.vehicle.dimensions.length_m) {
            return;
        }
        let before_end_s = self.crossing_before_end_s(view, &plane_from_body(pose, other.pitch_rad));
        let frozen = view.sensor_from_plane(before_end_s)
            * plane_from_body(moved_back(pose, other, before_end_s), other.pitch_rad);
        let appearance = other.vehicle.appearance;
        let plate = self.lidar.plate_reflectivity;
        let reflectivity = |material: Material| material.reflectivity(plate, &appearance, scene.environment);
        let surface = Surface { source: PointSource::Actor(other.actor), reflectivity: &reflectivity };
        self.solids.clear();
        append_solids(&other.vehicle, &mut self.solids);
        if scene.road.is_reversed() {
            append_rear_plate(&other.vehicle, &mut self.solids);
        }
        for solid in &self.solids {
            self.targets.push(Beams { pattern: self.pattern, mirror_side }, solid, &frozen, surface);
        }
        if self.has_drifts() {
            let placed = |before_end_s: f64| {
                let moved = moved_back(pose, other, before_end_s);
                view.sensor_from_plane(before_end_s) * plane_from_body(moved, other.pitch_rad)
            };
            self.targets.note_drift(velocity_mps(placed, before_end_s), self.sweep_s() - before_end_s);
        }
    }

    fn collect_plume(&mut self, vehicle: &SceneVehicle, scene: &Scene<'_>, view: &Viewpoint) {
        let Some((solid, extinction_per_m)) =
            soft::spray_plume(&vehicle.vehicle, vehicle.state.speed_mps, scene.environment)
        else {
            return;
        };
        let pose = scene.road.plane_pose(vehicle.state.s_m, vehicle.state.d_m, vehicle.state.heading_rad);
        let placed = view.sensor_from_plane(0.0) * plane_from_body(pose, 0.0);
        // No beam points forward. A plume that lies entirely ahead would only cost each beam a
        // test.
        if !solid.corners().any(|corner| (placed * corner).x > 0.0) {
            return;
        }
        let water = |_| 0.0;
        let surface = Surface { source: PointSource::Spray, reflectivity: &water };
        let columns = Targets::columns_of(self.pattern, &solid, &placed);
        let faces = self.targets.push_faces(&solid, &placed, surface);
        self.plumes.push(Plume::new(faces, columns, &solid, &placed, extinction_per_m));
        self.note_rest();
    }

    /// Returns whether neighbouring beams are measured at any times, so that the motion of a solid
    /// during the scan matters.
    fn has_drifts(&self) -> bool {
        self.pattern.kind().table.is_some()
    }

    /// Notes that the latest faces rest relative to the sensor, as the road and spray do: both look
    /// the same from wherever the ego is.
    fn note_rest(&mut self) {
        if self.has_drifts() {
            self.targets.note_drift(Vector3::zeros(), 0.0);
        }
    }

    /// Returns how long before its end the sweep crosses the origin of a body's frame (s).
    fn crossing_before_end_s(&self, view: &Viewpoint, plane_from_thing: &Isometry3<f64>) -> f64 {
        let middle = view.sensor_from_plane(0.0) * (plane_from_thing * Point3::origin());
        self.sweep_s() - self.pattern.kind().sweep_offset_s(maths::atan2(middle.y, middle.x).to_degrees())
    }
}

/// Step over which a velocity is taken (s).
const VELOCITY_STEP_S: f64 = 1e-3;

/// Returns the velocity of a solid in the sensor's frame (m/s), whose pose there `before_end_s`
/// before the end of the scan is `placed`.
fn velocity_mps(placed: impl Fn(f64) -> Isometry3<f64>, before_end_s: f64) -> Vector3<f64> {
    let at = |before_end_s: f64| placed(before_end_s).translation.vector;
    (at(before_end_s - VELOCITY_STEP_S) - at(before_end_s)) / VELOCITY_STEP_S
}

/// Returns the pose of a vehicle `before_end_s` earlier, extrapolated at its current speed and
/// heading.
fn moved_back(pose: PlanePose, vehicle: &SceneVehicle, before_end_s: f64) -> PlanePose {
    let distance_m = vehicle.state.speed_mps * before_end_s;
    let (sin, cos) = maths::sin_cos(pose.yaw_rad);
    PlanePose { x_m: pose.x_m - distance_m * cos, y_m: pose.y_m - distance_m * sin, ..pose }
}
