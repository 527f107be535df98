//! What goes with the scans of a run, as CSV: the poses of the ego, the labels of the other
//! vehicles, and the index of a folder of point clouds. `closecall_recorded::scans` reads them.
//!
//! Numbers are written such that they are read with the same bits.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use closecall_recorded::scans::{INDEX, companion};
use closecall_scenarios::Scenario;
use closecall_sensors::MountedLidar;
use closecall_sensors::lidar::{MirrorSide, RearLidar};
use closecall_simulation::StepView;
use closecall_traffic::atomic::{WriteError, write_file};
use closecall_traffic::ego_frame::EgoFrame;
use closecall_traffic::{Time, VehicleState};

use crate::tables::pcd::file_name;
use crate::tables::scan_columns::sign;

const POSES: &str = "poses";
const LABELS: &str = "labels";

/// The texts of the files.
pub(crate) struct Companions {
    poses: String,
    labels: String,
    index: String,
}

impl Default for Companions {
    fn default() -> Self {
        Self {
            poses: "time_s,x_m,y_m,yaw_rad,speed_mps,yaw_rate_radps,s_m,d_m,heading_rad\n".to_owned(),
            labels: "time_s,id,class,x_m,y_m,heading_rad,speed_mps,length_m,width_m\n".to_owned(),
            index: "file,time_s,sensor,mirror_side,sensor_x_m\n".to_owned(),
        }
    }
}

impl Companions {
    /// Appends the pose of the ego.
    pub(crate) fn pose(&mut self, time: Time, scenario: &Scenario, ego: &VehicleState) {
        let VehicleState { s_m, d_m, heading_rad, speed_mps, yaw_rate_radps, .. } = *ego;
        let plane = scenario.road.plane_pose(s_m, d_m, heading_rad);
        let values = [time.s(), plane.x_m, plane.y_m, plane.yaw_rad, speed_mps, yaw_rate_radps, s_m, d_m, heading_rad];
        self.poses += &values.map(|value| value.to_string()).join(",");
        self.poses.push('\n');
    }

    /// Appends the pose of the ego and the labels of the other vehicles.
    pub(crate) fn step(&mut self, view: &StepView<'_>) {
        let ego = view.scenario.ego;
        self.pose(view.time, view.scenario, &view.vehicles[ego].state);
        let frame = EgoFrame::new(&view.scenario.road, &view.vehicles[ego].state);
        for (index, other) in view.vehicles.iter().enumerate().filter(|(index, _)| *index != ego) {
            let at = frame.point(other.state.s_m, other.state.d_m);
            let size = other.vehicle.dimensions;
            let (id, class) = (&view.scenario.actors[index].id, other.vehicle.class.name());
            let values = [
                at.x_m,
                at.y_m,
                at.road_yaw_rad + other.state.heading_rad,
                other.state.speed_mps,
                size.length_m,
                size.width_m,
            ];
            let values = values.map(|value| value.to_string()).join(",");
            // Writing to a string does not fail.
            let _ = writeln!(self.labels, "{},{id},{class},{values}", view.time.s());
        }
    }

    /// Appends a file of the folder to the index.
    pub(crate) fn list(&mut self, mounted: &MountedLidar<'_>, frame: u32, lidar: &RearLidar) {
        let scan = lidar.latest();
        let side = match scan.mirror_side {
            _ if !lidar.has_mirror_sides() => "",
            MirrorSide::Plus => "plus",
            MirrorSide::Minus => "minus",
        };
        let (file, sensor_x_m) = (file_name(mounted, frame), sign(mounted) * scan.sensor_x_m);
        // Writing to a string does not fail.
        let _ = writeln!(self.index, "{file},{},{},{side},{sensor_x_m}", scan.end.s(), mounted.name);
    }

    /// Writes the files beside a table of scans.
    pub(crate) fn write_beside(&self, scans: &Path) -> Result<(), WriteError> {
        write(&companion(scans, POSES), &self.poses)?;
        write(&companion(scans, LABELS), &self.labels)
    }

    /// Writes the files into a folder of point clouds.
    pub(crate) fn write_in(&self, folder: &Path) -> Result<(), WriteError> {
        write(&folder.join(INDEX), &self.index)?;
        write(&folder.join(format!("{POSES}.csv")), &self.poses)?;
        write(&folder.join(format!("{LABELS}.csv")), &self.labels)
    }
}

fn write(path: &Path, text: &str) -> Result<(), WriteError> {
    write_file(path, |file| file.write_all(text.as_bytes()))
}

/// Returns the files that are written beside a table of scans; none for a folder, which holds them.
pub fn companion_files(scans: &Path) -> Vec<PathBuf> {
    match scans.extension().is_some_and(|end| end == "parquet") {
        true => [POSES, LABELS].map(|name| companion(scans, name)).to_vec(),
        false => Vec::new(),
    }
}
