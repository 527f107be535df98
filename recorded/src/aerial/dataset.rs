//! Data sets of labelled pictures in the layout of DOTA (G.-S. Xia et al., *DOTA: A Large-Scale
//! Dataset for Object Detection in Aerial Images*, CVPR 2018): `images/NAME.png`, and
//! `labels/NAME.txt` with one line for each vehicle, the four corners of its oriented box in
//! pixels, its class, and whether it is difficult.
//!
//! ```text
//! 412.3 80.1 449.9 82.0 449.2 96.5 411.6 94.6 car 0
//! ```
//!
//! A vehicle is *difficult* (1) if less than a third of its box shows it. `labels/NAME.json` holds
//! the pose of the camera.

use std::fmt::{self, Write as _};
use std::path::Path;

use closecall_sensors::camera::Image;
use closecall_sensors::datasets::Set;
use closecall_traffic::atomic::write_file;
use closecall_traffic::words::counted;
use closecall_traffic::{ActorId, VehicleClass, stream};
use rayon::prelude::*;
use serde::Serialize;

use crate::aerial::camera::{HEIGHT_PX, WIDTH_PX};
use crate::aerial::error::AerialError;
use crate::aerial::picture::{AerialPicture, AerialScene, render};
use crate::aerial::random_scene::{Frame, random_scene};

/// The strip in which a road is watched.
const STRIP: Frame = Frame { size_px: [WIDTH_PX, HEIGHT_PX], is_across: true };
/// A square for which the camera looks in any direction.
const SQUARE: Frame = Frame { size_px: [512, 512], is_across: false };

/// The options of a data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AerialDatasetOptions {
    /// The set to render, training or held-out: their body shapes differ.
    pub set: Set,
    /// Number of pictures. Every second one is a strip across the road, the others are squares in
    /// any direction.
    pub pictures: u32,
    /// Seed of the scenes. 0 is a seed like any other.
    pub seed: u64,
}

/// The summary of a written data set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct AerialDatasetSummary {
    /// Number of pictures.
    pub pictures: u32,
    /// Number of labelled cars.
    pub cars: usize,
    /// Number of labelled trucks.
    pub trucks: usize,
    /// Number of labels that count as difficult.
    pub difficult: usize,
}

impl fmt::Display for AerialDatasetSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pictures, cars, trucks, difficult } = self;
        let (pictures, cars, trucks) = (counted(*pictures, "image"), counted(*cars, "car"), counted(*trucks, "truck"));
        write!(f, "{pictures} with {cars} and {trucks}, {difficult} of them difficult")
    }
}

/// Returns picture `index` of a data set with its scene.
///
/// # Errors
/// [`AerialError::Stream`] if the fixed name of the random stream is invalid.
pub fn dataset_picture(
    options: &AerialDatasetOptions,
    index: u32,
) -> Result<(AerialPicture, AerialScene, crate::aerial::camera::AerialCamera), AerialError> {
    let channel = if options.set == Set::Training { "training-aerial" } else { "held-out-aerial" };
    let mut rng = stream(options.seed, u64::from(index), &ActorId::new("ego")?, channel);
    let frame = if index.is_multiple_of(2) { STRIP } else { SQUARE };
    let (scene, camera) = random_scene(options.set, frame, &mut rng);
    Ok((render(&scene, &camera), scene, camera))
}

/// Renders a data set into `folder`, which is created if it does not exist. The same options give
/// the same bytes.
///
/// # Errors
/// [`AerialError`] if a file cannot be encoded or written.
pub fn render_aerial_dataset(
    options: &AerialDatasetOptions,
    folder: &Path,
) -> Result<AerialDatasetSummary, AerialError> {
    let write_picture = |index: u32| -> Result<AerialDatasetSummary, AerialError> {
        let (picture, scene, camera) = dataset_picture(options, index)?;
        let name = format!("aerial-{index:06}");
        let (text, summary) = labels_text(&picture, &scene);
        write_png(&folder.join("images").join(format!("{name}.png")), &picture.image)?;
        write_file(&folder.join("labels").join(format!("{name}.txt")), |file| file.write_all(text.as_bytes()))?;
        let pose = serde_json::to_vec_pretty(camera.view())?;
        write_file(&folder.join("labels").join(format!("{name}.json")), |file| file.write_all(&pose))?;
        Ok(summary)
    };
    for name in ["images", "labels"] {
        let path = folder.join(name);
        std::fs::create_dir_all(&path).map_err(|source| AerialError::Folder { path, source })?;
    }
    let all: Vec<_> = (0..options.pictures).into_par_iter().map(write_picture).collect::<Result<_, _>>()?;
    let add = |a: AerialDatasetSummary, b: AerialDatasetSummary| AerialDatasetSummary {
        pictures: a.pictures + 1,
        cars: a.cars + b.cars,
        trucks: a.trucks + b.trucks,
        difficult: a.difficult + b.difficult,
    };
    Ok(all.into_iter().fold(AerialDatasetSummary::default(), add))
}

fn labels_text(picture: &AerialPicture, scene: &AerialScene) -> (String, AerialDatasetSummary) {
    let mut text = String::new();
    let mut summary = AerialDatasetSummary::default();
    let [width, height] = [picture.image.width, picture.image.height].map(f64::from);
    for label in &picture.labels {
        let [column, row] = label.image_box.centre_px;
        let Some(vehicle) = scene.vehicles.iter().find(|vehicle| vehicle.id == label.id) else { continue };
        if !(-100.0..width + 100.0).contains(&column) || !(-100.0..height + 100.0).contains(&row) {
            continue;
        }
        // A box whose centre lies outside is no target, and no mistake either if it is found.
        let is_inside = (0.0..width).contains(&column) && (0.0..height).contains(&row);
        let is_difficult = !(label.is_visible && is_inside);
        for [x, y] in label.image_box.corners_px() {
            let _infallible = write!(text, "{x:.2} {y:.2} ");
        }
        let class = vehicle.vehicle.class;
        let _infallible = writeln!(text, "{} {}", class.name(), u8::from(is_difficult));
        match class {
            VehicleClass::Truck => summary.trucks += 1,
            VehicleClass::Car | VehicleClass::Motorcycle => summary.cars += 1,
        }
        summary.difficult += usize::from(is_difficult);
    }
    (text, summary)
}

/// Writes an image as a PNG file, atomically.
///
/// # Errors
/// [`AerialError`] if the image cannot be encoded or written.
pub fn write_png(path: &Path, image: &Image) -> Result<(), AerialError> {
    let bytes = image.png().map_err(|source| AerialError::Encode { path: path.to_owned(), source })?;
    Ok(write_file(path, |file| file.write_all(&bytes))?)
}
