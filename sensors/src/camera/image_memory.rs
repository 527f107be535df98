//! The network's results about the objects of one run. The network classifies an object only while
//! another image can still add information.
//!
//! Successive images show a vehicle at nearly the same distance, in the same light and from the
//! same side. The network then makes the same error in each of them, and the tracker counts about
//! three scans as one observation. Scores that are up to 0.2 s old therefore carry as much
//! information as new scores, and cost nothing. A new object is always classified at once.
//!
//! Five clear images of one class in a second drive the class of a track to its bounds, whatever it
//! was before. Another image of the same class then changes nothing. Such an object is classified
//! again if its scale in the image has changed by a fifth, and at least once per second
//! (assumptions).

use closecall_traffic::{ClassScores, Time, maths};

use crate::tracking::Detection;

/// Age at which the scores of an object may be replaced: each object is classified at most five
/// times per second.
const MIN_AGE: Time = Time::from_ms(200);
/// Age at which the scores of an object are replaced in any case.
const MAX_AGE: Time = Time::from_ms(1_000);
/// Number of successive clear images of one class after which another image adds no information.
const SETTLED_IMAGES: u32 = 5;
/// Score from which an image is clear.
const CLEAR_SCORE: f64 = 0.9;
/// Relative change of the distance after which an image says something new.
const NEW_SCALE: f64 = 0.2;
/// Distance along and across the ego's axis by which an object may move between two scans that
/// detect it (m): a closing speed of 50 m/s over one control step, and a lane change over two.
const GATE_M: [f64; 2] = [2.0, 1.0];

/// An object that the network has classified.
#[derive(Clone, Copy, Debug)]
struct SeenObject {
    /// Position of its front face in the latest scan that has detected it (m).
    face_m: [f64; 2],
    /// Time of that scan.
    seen_at: Time,
    scores: ClassScores,
    /// Time of the image.
    taken_at: Time,
    /// Distance at which the image was taken (m).
    taken_from_m: f64,
    /// Number of successive clear images of the class.
    clear_images: u32,
}

impl SeenObject {
    /// Returns whether a new image would add information to the earlier images.
    fn is_due(&self, time: Time, distance_m: f64) -> bool {
        let age = time - self.taken_at;
        let has_new_scale = (distance_m / self.taken_from_m - 1.0).abs() > NEW_SCALE;
        age >= MAX_AGE || (age >= MIN_AGE && (self.clear_images < SETTLED_IMAGES || has_new_scale))
    }
}

/// Returns the class with the highest score, background included, and that score.
fn best(scores: &ClassScores) -> (usize, f64) {
    let by_score = |a: &(usize, f64), b: &(usize, f64)| a.1.total_cmp(&b.1);
    scores.0.into_iter().enumerate().max_by(by_score).unwrap_or((ClassScores::BACKGROUND, 0.0))
}

/// Returns the distance of a detection from the ego's origin (m).
fn distance_m(detection: &Detection) -> f64 {
    maths::hypot(detection.face_x_m, detection.face_y_m)
}

/// The objects of one run that the network has classified lately.
#[derive(Clone, Debug, Default)]
pub struct ImageMemory {
    time: Time,
    objects: Vec<SeenObject>,
}

impl ImageMemory {
    /// Begins the scan at `time`: forgets the objects that were not detected lately.
    pub(super) fn begin(&mut self, time: Time) {
        self.time = time;
        self.objects.retain(|object| time - object.seen_at < MIN_AGE);
    }

    /// Returns the network's scores of the object that a detection belongs to, or `None` if it must
    /// be classified.
    pub(super) fn recall(&mut self, detection: &Detection) -> Option<ClassScores> {
        let time = self.time;
        let object = self.object_of(detection)?;
        if object.is_due(time, distance_m(detection)) {
            return None;
        }
        object.face_m = [detection.face_x_m, detection.face_y_m];
        object.seen_at = time;
        Some(object.scores)
    }

    /// Stores the network's scores of a detection.
    pub(super) fn store(&mut self, detection: &Detection, scores: ClassScores) {
        let time = self.time;
        let (class, score) = best(&scores);
        let remembered = self.object_of(detection).map(|object| *object);
        self.objects.retain(|object| remembered.is_none_or(|remembered| object.face_m != remembered.face_m));
        let same = remembered.filter(|remembered| best(&remembered.scores).0 == class);
        let before = same.map_or(0, |remembered| remembered.clear_images);
        self.objects.push(SeenObject {
            face_m: [detection.face_x_m, detection.face_y_m],
            seen_at: time,
            scores,
            taken_at: time,
            taken_from_m: distance_m(detection),
            clear_images: if score >= CLEAR_SCORE { before + 1 } else { 0 },
        });
    }

    /// Returns the object that a detection belongs to: the nearest object within the gate.
    fn object_of(&mut self, detection: &Detection) -> Option<&mut SeenObject> {
        let apart_m = |object: &SeenObject| {
            [(object.face_m[0] - detection.face_x_m).abs(), (object.face_m[1] - detection.face_y_m).abs()]
        };
        let in_gate = |object: &&mut SeenObject| apart_m(object).iter().zip(GATE_M).all(|(m, gate_m)| *m <= gate_m);
        let apart = |object: &SeenObject| apart_m(object).iter().sum::<f64>();
        self.objects.iter_mut().filter(in_gate).min_by(|a, b| apart(a).total_cmp(&apart(b)))
    }
}

#[cfg(test)]
mod tests {
    use closecall_traffic::{CONTROL_STEP, VehicleClass};

    use super::*;
    use crate::tracking::{Extent, SeenBy, SeenPart};

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
            seen_by: SeenBy::Lidar,
            points: 50,
            is_centred: false,
            seen: SeenPart::FACE,
            class: ClassScores::UNKNOWN,
        }
    }

    /// Returns the number of images of an object at these distances, one in each control step,
    /// whose scores are `scores`.
    fn images(distances_m: impl Iterator<Item = f64>, scores: ClassScores) -> usize {
        let (mut memory, mut taken) = (ImageMemory::default(), 0);
        for (step, distance_m) in (0..).zip(distances_m) {
            memory.begin(CONTROL_STEP * step);
            let detection = at(-distance_m, 0.0);
            match memory.recall(&detection) {
                Some(recalled) => assert_eq!(recalled, scores),
                None => {
                    taken += 1;
                    memory.store(&detection, scores);
                }
            }
        }
        taken
    }

    #[test]
    fn an_unclear_object_is_classified_five_times_per_second_and_keeps_its_scores_in_between() {
        let unclear = ClassScores([0.2, 0.7, 0.05, 0.05]);
        assert_eq!(images((0..100).map(|_| 60.0), unclear), 20);
    }

    #[test]
    fn a_clear_object_is_classified_once_per_second_unless_its_scale_changes() {
        let truck = ClassScores::certain(VehicleClass::Truck);
        // Five images in the first second, the last at 0.8 s, and then one after each second: at
        // 1.8, 2.8 and 3.8 s.
        assert_eq!(images((0..100).map(|_| 60.0), truck), 8);
        // At 20 m/s from 100 m, the distance falls by a fifth in 1 s, and then ever sooner.
        let closing = images((0..100).map(|step| 100.0 - 0.8 * f64::from(step)), truck);
        assert!((10..=15).contains(&closing), "{closing}");
    }

    #[test]
    fn an_object_whose_class_changes_is_unclear_again() {
        let (mut memory, mut taken) = (ImageMemory::default(), Vec::new());
        for step in 0..100 {
            memory.begin(CONTROL_STEP * step);
            if memory.recall(&at(-60.0, 0.0)).is_none() {
                taken.push(step);
                let class = if step < 50 { VehicleClass::Car } else { VehicleClass::Truck };
                memory.store(&at(-60.0, 0.0), ClassScores::certain(class));
            }
        }
        // Settled at 0.8 s, taken again at 1.8 s and, with the new class, at 2.8 s: then at 5 Hz,
        // five times.
        assert_eq!(taken, [0, 5, 10, 15, 20, 45, 70, 75, 80, 85, 90]);
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
