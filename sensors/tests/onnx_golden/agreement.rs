//! A few crops, and the class probabilities that the shipped network gives for them in Python's
//! ONNX Runtime.

use closecall_sensors::camera::{CHANNELS, CROP_PX, Classifier, Crop};

/// Maximum difference of a probability. Backends sum in different orders.
const TOLERANCE: f64 = 1e-4;

/// Asserts that the classifier and Python agree on every crop.
pub(crate) fn assert_agrees(classifier: &mut Classifier) {
    let crops = include_bytes!("crops.rgb").chunks_exact(CROP_PX * CROP_PX * CHANNELS);
    let answers: Vec<Vec<f64>> = include_str!("scores.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|score| score.parse().expect("a number")).collect())
        .collect();
    assert!(answers.len() >= 8 && answers.len() == crops.len(), "{} answers", answers.len());
    for (index, (rgb, expected)) in crops.zip(&answers).enumerate() {
        let crop = Crop { rgb: rgb.to_vec(), ..Crop::default() };
        let actual = classifier.classify(&crop).expect("the network runs").0;
        for (actual, expected) in actual.iter().zip(expected) {
            assert!((actual - expected).abs() <= TOLERANCE, "crop {index}: {actual} instead of {expected}");
        }
    }
}
