//! The points of the latest scan: the beams that they come from, and the false alarms among them.

use super::super::PointBeam;
use super::super::false_alarms::FalseAlarms;
use super::{Scanner, Sweep};
use closecall_traffic::maths;

impl Scanner {
    /// Returns the beam of a point of the latest scan, and the range that was measured along it.
    pub(crate) fn point_beam(&self, point: usize) -> PointBeam {
        let (beam, layers) = (self.scan.beam[point], self.scan.resolution.layers);
        let (azimuth_rad, elevation_rad) = self.pattern.direction_rad(self.scan.mirror_side, beam);
        #[expect(clippy::cast_possible_truncation, reason = "a part of a number of 16 bits")]
        let [column, layer] = [usize::from(beam) / layers, usize::from(beam) % layers].map(|index| index as u16);
        PointBeam { column, layer, azimuth_rad, elevation_rad, range_m: self.range_m(point) }
    }

    /// Returns the range of a point from where the sensor was when it measured the point (m).
    #[expect(clippy::cast_possible_truncation, reason = "points are in single precision")]
    fn range_m(&self, point: usize) -> f32 {
        let scan = &self.scan;
        let at_m = [scan.x_m[point], scan.y_m[point], scan.z_m[point]].map(f64::from);
        let Some(sweep) = &self.latest else { return at_m.iter().map(|axis| axis * axis).sum::<f64>().sqrt() as f32 };
        let to = sweep.viewpoint.deskew(self.sweep_s() - f64::from(scan.offset_ns[point]) * 1e-9);
        let (x_m, y_m) = (at_m[0] - to.x_m, at_m[1] - to.y_m);
        let (ahead_m, left_m) = (to.cos * x_m + to.sin * y_m, to.cos * y_m - to.sin * x_m);
        let up_m = at_m[2] - f64::from(sweep.pose.sensor_z_m());
        let left_m = left_m - f64::from(sweep.pose.sensor_y_m());
        maths::hypot(maths::hypot(ahead_m - f64::from(sweep.pose.sensor_x_m()), left_m), up_m) as f32
    }

    /// Returns true if the sensor has a mirror with two sides.
    pub(crate) fn has_mirror_sides(&self) -> bool {
        self.pattern.kind().mirror_cubic_deg.is_some()
    }

    /// Adds the false alarms of the receiver.
    #[expect(clippy::cast_possible_truncation, reason = "ranges in single precision")]
    pub(super) fn raise_false_alarms(&mut self, sweep: &Sweep) {
        let before = self.scan.len();
        if self.lidar.false_alarm_rate > 0.0 {
            let sweep_s = self.sweep_s();
            let alarms = FalseAlarms {
                rate: self.lidar.false_alarm_rate,
                reach_m: (self.lidar.nominal_range_m as f32).min(sweep.link.max_range_m),
                link: &sweep.link,
                noise: sweep.noise.of_false_alarms(),
                pattern: self.pattern,
            };
            let deskew = |offset_ns: u32| sweep.viewpoint.deskew(sweep_s - f64::from(offset_ns) * 1e-9);
            alarms.append(|offset_ns| sweep.pose.deskewed(deskew(offset_ns)), (&mut self.scan, &mut self.truth));
        }
        self.false_alarms = self.scan.len() - before;
    }
}
