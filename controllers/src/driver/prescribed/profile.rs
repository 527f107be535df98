//! Speed as a function of time: linear between points, constant before the first and after the
//! last.

/// An acceleration that holds from a given time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AccelerationStep {
    pub(super) from_s: f64,
    pub(super) acceleration_mps2: f64,
}

/// A speed profile: at least one point, with times that do not decrease.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SpeedProfile {
    /// Times (s) and speeds (m/s).
    points: Vec<(f64, f64)>,
}

impl SpeedProfile {
    /// Creates a profile through `points`, which must not be empty.
    pub(super) fn new(points: Vec<(f64, f64)>) -> Self {
        debug_assert!(!points.is_empty(), "a profile has at least one point");
        Self { points }
    }

    /// Integrates the accelerations `steps` from the speed `start_mps`, limited to speeds from 0 to
    /// `max_mps`.
    pub(super) fn integrated(start_mps: f64, steps: &[AccelerationStep], max_mps: f64) -> Self {
        let mut points = vec![(0.0, start_mps)];
        for (index, step) in steps.iter().enumerate() {
            let &(time_s, speed_mps) = points.last().unwrap_or(&(0.0, start_mps));
            if step.from_s > time_s {
                points.push((step.from_s, speed_mps));
            }
            let limit_mps = if step.acceleration_mps2 < 0.0 { 0.0 } else { max_mps.max(speed_mps) };
            let until_limit_s =
                if step.acceleration_mps2 == 0.0 { 0.0 } else { (limit_mps - speed_mps) / step.acceleration_mps2 };
            let next_s = steps.get(index + 1).map_or(f64::INFINITY, |next| next.from_s);
            let duration_s = until_limit_s.min(next_s - step.from_s);
            points.push((step.from_s + duration_s, speed_mps + step.acceleration_mps2 * duration_s));
        }
        Self { points }
    }

    /// Returns the distance driven from the start of the run until `until_s` (m).
    pub(super) fn distance_m(&self, until_s: f64) -> f64 {
        let inner_s = self.points.iter().map(|(time_s, _)| *time_s).filter(|time_s| *time_s > 0.0 && *time_s < until_s);
        let times_s: Vec<f64> = std::iter::once(0.0).chain(inner_s).chain([until_s]).collect();
        let stretch_m = |pair: &[f64]| 0.5 * (self.at(pair[0]).0 + self.at(pair[1]).0) * (pair[1] - pair[0]);
        times_s.windows(2).map(stretch_m).sum()
    }

    /// Returns the speed (m/s) and its slope (m/s²) at `time_s`.
    pub(super) fn at(&self, time_s: f64) -> (f64, f64) {
        let after = self.points.partition_point(|(time, _)| *time <= time_s);
        match (after.checked_sub(1).map(|before| self.points[before]), self.points.get(after)) {
            (Some((t0, v0)), Some((t1, v1))) => {
                let slope = (v1 - v0) / (t1 - t0);
                (v0 + slope * (time_s - t0), slope)
            }
            (Some((_, speed)), None) | (None, Some(&(_, speed))) => (speed, 0.0),
            (None, None) => unreachable!("a profile has at least one point"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_are_linear_between_points_and_constant_outside() {
        let profile = SpeedProfile::new(vec![(1.0, 30.0), (3.0, 20.0)]);
        assert_eq!(profile.at(0.0), (30.0, 0.0));
        assert_eq!(profile.at(2.0), (25.0, -5.0));
        assert_eq!(profile.at(9.0), (20.0, 0.0));
    }

    #[test]
    fn the_distance_is_the_integral_of_the_speed() {
        let profile = SpeedProfile::new(vec![(1.0, 30.0), (3.0, 20.0)]);
        for (until_s, distance_m) in [(0.0, 0.0), (0.5, 15.0), (2.0, 57.5), (3.0, 80.0), (5.0, 120.0)] {
            assert!((profile.distance_m(until_s) - distance_m).abs() < 1e-9, "{until_s}");
        }
    }

    #[test]
    fn accelerations_are_integrated_between_standstill_and_the_maximum_speed() {
        let step = |from_s, acceleration_mps2| AccelerationStep { from_s, acceleration_mps2 };
        let steps = [step(1.0, -5.0), step(3.0, 0.0), step(4.0, 2.5), step(6.0, -10.0), step(20.0, 1.0)];
        let profile = SpeedProfile::integrated(30.0, &steps, 22.0);
        let expected =
            [(0.5, 30.0), (1.0, 30.0), (2.0, 25.0), (3.0, 20.0), (3.5, 20.0), (4.4, 21.0), (5.0, 22.0), (5.9, 22.0)];
        for (time_s, speed_mps) in expected.into_iter().chain([(7.0, 12.0), (9.0, 0.0), (20.0, 0.0), (25.0, 5.0)]) {
            assert!((profile.at(time_s).0 - speed_mps).abs() < 1e-9, "{time_s}: {:?}", profile.at(time_s));
        }
        assert_eq!(profile.at(1e5), (22.0, 0.0));
    }
}
