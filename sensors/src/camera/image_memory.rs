//! What the network has said about the objects of one run, so that it classifies each only a few times per second.
//!
//! Successive images of a vehicle show it at nearly the same distance, in the same light and from the same side, so that
//! the network errs alike in them: the tracker counts about three scans as one observation. Scores that are up to 0.2 s
//! old therefore say as much as new ones, and cost nothing. A new object is always classified at once.

use closecall_traffic::{ClassScores, Time};

use crate::Detection;

/// Age at which the scores of an object are replaced: each object is classified at most five times per second.
const MAX_AGE: Time = Time::from_ms(200);
/// Distance along and across the ego's axis by which an object may move between two scans that detect it (m): a closing
/// speed of 50 m/s over one control step, and a lane change over two.
const GATE_M: [f64; 2] = [2.0, 1.0];

/// An object that the network has classified.
#[derive(Clone, Copy, Debug)]
struct SeenObject {
    /// Position of its front face in the latest scan that has detected it (m).
    face_m: [f64; 2],
    scores: ClassScores,
    /// Time of the image.
    taken_at: Time,
}

/// The objects of one run that the network has classified lately.
#[derive(Clone, Debug, Default)]
pub struct ImageMemory {
    time: Time,
    objects: Vec<SeenObject>,
}

impl ImageMemory {
    /// Begins the scan at `time`: forgets the scores that are too old.
    pub(super) fn begin(&mut self, time: Time) {
        self.time = time;
        self.objects.retain(|object| time - object.taken_at < MAX_AGE);
    }

    /// Returns the network's scores of the object that a detection belongs to, or `None` if it must be classified.
    pub(super) fn recall(&mut self, detection: &Detection) -> Option<ClassScores> {
        let apart_m = |object: &SeenObject| {
            [(object.face_m[0] - detection.face_x_m).abs(), (object.face_m[1] - detection.face_y_m).abs()]
        };
        let in_gate = |object: &&mut SeenObject| apart_m(object).iter().zip(GATE_M).all(|(m, gate_m)| *m <= gate_m);
        let distance_m = |object: &SeenObject| apart_m(object).iter().sum::<f64>();
        let nearest = self.objects.iter_mut().filter(in_gate);
        let nearest = nearest.min_by(|one, other| distance_m(one).total_cmp(&distance_m(other)))?;
        nearest.face_m = [detection.face_x_m, detection.face_y_m];
        Some(nearest.scores)
    }

    /// Stores the network's scores of a detection.
    pub(super) fn store(&mut self, detection: &Detection, scores: ClassScores) {
        let face_m = [detection.face_x_m, detection.face_y_m];
        self.objects.push(SeenObject { face_m, scores, taken_at: self.time });
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{CONTROL_STEP, VehicleClass};

    use super::*;
    use crate::Extent;

    fn at(face_x_m: f64, face_y_m: f64) -> Detection {
        Detection {
            time: Time::ZERO,
            face_x_m,
            face_y_m,
            range_sd_m: 0.1,
            lateral_sd_m: 0.1,
            heading_rad: 0.0,
            length_m: 4.5,
            length: Extent::Assumed,
            width_m: 1.8,
            width: Extent::Seen,
            top_m: 1.5,
            points: 50,
            class: ClassScores::UNKNOWN,
        }
    }

    #[test]
    fn an_object_is_classified_five_times_per_second_and_keeps_its_scores_in_between() {
        let (mut memory, mut taken, truck) = (ImageMemory::default(), 0, ClassScores::certain(VehicleClass::Truck));
        for step in 0..50_i32 {
            memory.begin(CONTROL_STEP * i64::from(step));
            // The object closes in at 20 m/s.
            let detection = at(-60.0 + 0.8 * f64::from(step), 0.0);
            match memory.recall(&detection) {
                Some(scores) => assert_eq!(scores, truck),
                None => {
                    taken += 1;
                    memory.store(&detection, truck);
                }
            }
        }
        assert_eq!(taken, 10);
    }

    #[test]
    fn another_object_is_classified_at_once() {
        let mut memory = ImageMemory::default();
        memory.store(&at(-30.0, 0.0), ClassScores::certain(VehicleClass::Car));
        memory.begin(CONTROL_STEP);
        assert!(memory.recall(&at(-30.0, 3.75)).is_none());
        assert!(memory.recall(&at(-37.0, 0.0)).is_none());
        assert!(memory.recall(&at(-30.5, 0.1)).is_some());
    }
}
