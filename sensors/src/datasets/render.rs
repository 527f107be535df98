//! Renders a data set.

use super::files::Output;
use super::scenes::RandomScene;
use super::{coco, crops};
use crate::camera::{Camera, Optics};
use closecall_traffic::{ActorId, ConfigError, Stream, stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// One of the two disjoint data sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Set {
    /// The set for training, with its own shapes and paints.
    Training,
    /// The set for evaluation, with the held-out shapes and paints.
    HeldOut,
}

/// The kind of content that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Content {
    /// Whole images with COCO annotations.
    Images,
    /// Crops in the format of the classifier's input.
    Crops,
}

/// How the cameras of a data set differ from the ideal one. The default is the ideal camera, with which the network was trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraLooks {
    /// The lens.
    pub optics: Optics,
    /// Time from the reading of the first row of an image to that of the last (s).
    pub readout_s: f64,
    /// Brightness of the night sky, relative to the sky over a town (0 to 1).
    pub night_sky: f64,
}

impl Default for CameraLooks {
    fn default() -> Self {
        Self { optics: Optics::default(), readout_s: 0.0, night_sky: 1.0 }
    }
}

/// The options of a data set to be rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DatasetOptions {
    /// The set to render, training or held-out.
    pub set: Set,
    /// The content to render, images or crops.
    pub content: Content,
    /// Number of random scenes.
    pub scenes: u32,
    /// Seed of the scenes. 0 is a seed like any other.
    pub seed: u64,
    /// How the cameras differ from the ideal one. The scenes are the same for all of them.
    pub looks: CameraLooks,
    /// Least and largest number of vehicles in a scene: [`USUAL_VEHICLES`], or what an empty or a crowded road has. A scene without room
    /// has fewer.
    pub vehicles: [usize; 2],
}

/// Least and largest number of vehicles that a scene usually has.
pub const USUAL_VEHICLES: [usize; 2] = [1, 5];
/// Largest number of vehicles that may be asked for.
pub const MAX_VEHICLES: usize = 40;

/// The summary of a written data set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DatasetSummary {
    /// Number of random scenes.
    pub scenes: u32,
    /// Number of images or crops.
    pub pictures: usize,
    /// Number of labels of each class: car, truck, motorcycle, background.
    pub labels: [usize; 4],
}

/// The reason why a data set cannot be written. Every file in the folder is complete, from this run or from an earlier
/// one, except that a temporary file may remain.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file could not be written.
    #[error("failed to write {path}: {source}")]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// The reason that the system gives.
        source: std::io::Error,
    },
    /// An image could not be encoded.
    #[error("failed to encode {path}: {source}")]
    Encode {
        /// The file.
        path: std::path::PathBuf,
        /// The reason that the encoder gives.
        source: png::EncodingError,
    },
    /// The annotations could not be encoded.
    #[error("failed to encode the annotations: {0}")]
    Annotations(#[from] serde_json::Error),
    /// A random scene fails the checks that also apply to scenario files.
    #[error("failed to set up a random scene: {0}")]
    Scene(#[from] ConfigError),
    /// The fixed name of the random streams is invalid.
    #[error("failed to name the random stream: {0}")]
    Stream(#[from] closecall_traffic::InvalidActorId),
}

/// Renders a data set into `folder`, which is created if it does not exist. Each file is written atomically.
///
/// The same options give the same bytes.
///
/// # Errors
/// Returns a [`DatasetError`] if a scene cannot be set up, or if a file cannot be encoded or written.
pub fn render_dataset(options: &DatasetOptions, folder: &Path) -> Result<DatasetSummary, DatasetError> {
    let output = Output::new(folder)?;
    let mut summary = DatasetSummary { scenes: options.scenes, pictures: 0, labels: [0; 4] };
    match options.content {
        Content::Images => {
            let mut annotations = coco::Annotations::new(options);
            for index in 0..options.scenes {
                let scene = random_scene(options, index)?;
                let key = crate::camera::ExposureKey(crate::camera::mix(options.seed ^ u64::from(index)));
                let picture = crate::camera::RearCamera::new(scene.camera).render_image(&scene.scene(), key);
                let name = format!("image-{index:06}.png");
                output.png(&name, &picture.image)?;
                annotations.add(&name, &picture, &scene, &mut summary);
            }
            output.write("annotations.json", &serde_json::to_vec_pretty(&annotations)?)?;
        }
        Content::Crops => {
            let mut crops = crops::Crops::default();
            for index in 0..options.scenes {
                let scene = random_scene(options, index)?;
                let mut rng =
                    stream(options.seed, u64::from(index), &ActorId::new("ego")?, options.set.channel("crops"));
                crops.add(&scene, &mut rng, &mut summary);
            }
            output.write("crops.rgb", &crops.rgb)?;
            output.write("crops.csv", crops.csv.as_bytes())?;
        }
    }
    Ok(summary)
}

impl Set {
    /// Returns the channel of the random stream for this set and purpose. The two sets use separate streams.
    fn channel(self, purpose: &str) -> &'static str {
        match (self, purpose == "crops") {
            (Self::Training, true) => "training-crops",
            (Self::Training, false) => "training-scenes",
            (Self::HeldOut, true) => "held-out-crops",
            (Self::HeldOut, false) => "held-out-scenes",
        }
    }
}

/// Returns the random stream of a scene.
pub(super) fn scene_rng(set: Set, seed: u64, index: u32) -> Result<Stream, DatasetError> {
    Ok(stream(seed, u64::from(index), &ActorId::new("ego")?, set.channel("scenes")))
}

fn random_scene(options: &DatasetOptions, index: u32) -> Result<RandomScene, DatasetError> {
    let mut rng = scene_rng(options.set, options.seed, index)?;
    let [least, largest] = options.vehicles;
    let mut scene = RandomScene::draw(options.set, least..=largest.max(least), &mut rng)?;
    let CameraLooks { optics, readout_s, night_sky } = options.looks;
    scene.camera = Camera { optics, readout_s, night_sky, ..scene.camera };
    Ok(scene)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> std::path::PathBuf {
        std::env::temp_dir().join(format!("closecall-dataset-{name}-{}", std::process::id()))
    }

    #[test]
    fn each_crop_has_a_row_and_the_same_options_give_the_same_bytes() {
        let options = DatasetOptions {
            set: Set::HeldOut,
            content: Content::Crops,
            scenes: 6,
            seed: 3,
            looks: CameraLooks::default(),
            vehicles: USUAL_VEHICLES,
        };
        let (first, second) = (folder("a"), folder("b"));
        let summary = render_dataset(&options, &first).unwrap();
        render_dataset(&options, &second).unwrap();
        let read = |folder: &Path, name: &str| std::fs::read(folder.join(name)).unwrap();
        assert_eq!(read(&first, "crops.rgb"), read(&second, "crops.rgb"));
        let csv = String::from_utf8(read(&first, "crops.csv")).unwrap();
        assert_eq!(csv.lines().count(), summary.pictures + 1);
        assert_eq!(read(&first, "crops.rgb").len(), summary.pictures * 32 * 32 * 3);
        assert_eq!(summary.labels.iter().sum::<usize>(), summary.pictures);
        assert!(summary.labels[3] > 0 && summary.labels[..3].iter().sum::<usize>() > 0);
        for folder in [first, second] {
            std::fs::remove_dir_all(folder).unwrap();
        }
    }

    #[test]
    fn a_road_can_be_empty_or_crowded() {
        let with = |vehicles| DatasetOptions {
            set: Set::HeldOut,
            content: Content::Images,
            scenes: 4,
            seed: 2,
            looks: CameraLooks::default(),
            vehicles,
        };
        let drawn = |options: &DatasetOptions| random_scene(options, 1).unwrap().others.len();
        assert_eq!(drawn(&with([0, 0])), 0);
        assert!(drawn(&with([8, 12])) > USUAL_VEHICLES[1]);
    }

    #[test]
    fn the_masks_of_an_image_fit_their_bounding_boxes() {
        let options = DatasetOptions {
            set: Set::Training,
            content: Content::Images,
            scenes: 1,
            seed: 1,
            looks: CameraLooks::default(),
            vehicles: USUAL_VEHICLES,
        };
        let folder = folder("images");
        render_dataset(&options, &folder).unwrap();
        let text = std::fs::read(folder.join("annotations.json")).unwrap();
        let json: serde_json::Value = serde_json::from_slice(&text).unwrap();
        assert!(folder.join(json["images"][0]["file_name"].as_str().unwrap()).exists());
        let annotations = json["annotations"].as_array().unwrap();
        assert!(!annotations.is_empty());
        for annotation in annotations {
            let counts: Vec<u64> = serde_json::from_value(annotation["segmentation"]["counts"].clone()).unwrap();
            assert_eq!(counts.iter().sum::<u64>(), 1280 * 800);
            let covered: u64 = counts.iter().skip(1).step_by(2).sum();
            assert_eq!(annotation["area"].as_u64(), Some(covered));
            let sides: Vec<u64> = serde_json::from_value(annotation["bbox"].clone()).unwrap();
            assert!(covered <= sides[2] * sides[3]);
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
