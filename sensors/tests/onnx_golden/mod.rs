//! A few crops, and what the shipped network says of them in Python's ONNX Runtime.

use closecall_sensors::camera::{CHANNELS, CROP_PX, Classifier, Crop};

/// Backends add up in different orders; they must agree within this.
const TOLERANCE: f64 = 1e-4;

/// Fails where the classifier and Python differ on any crop.
pub(crate) fn assert_agrees(classifier: &mut Classifier) {
    let crops = include_bytes!("crops.rgb").chunks_exact(CROP_PX * CROP_PX * CHANNELS);
    let answers: Vec<Vec<f64>> = include_str!("scores.csv")
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|score| score.parse().expect("a number")).collect())
        .collect();
    assert!(answers.len() >= 8 && answers.len() == crops.len(), "{} answers", answers.len());
    for (place, (rgb, wanted)) in crops.zip(&answers).enumerate() {
        let crop = Crop { rgb: rgb.to_vec(), ..Crop::default() };
        let got = classifier.classify(&crop).expect("the network runs").0;
        for (got, wanted) in got.iter().zip(wanted) {
            assert!((got - wanted).abs() <= TOLERANCE, "crop {place}: {got} instead of {wanted}");
        }
    }
}
