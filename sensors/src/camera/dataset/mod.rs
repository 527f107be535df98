//! Labelled pictures for training and for judging classifiers, made by the renderer itself.
//!
//! Two kinds, of the same random scenes:
//! - *images*: `image-000000.png` … and `annotations.json` in the COCO format: bounding boxes, masks (run lengths) and
//!   classes of every vehicle that is seen;
//! - *crops*: `crops.rgb`, 32 × 32 × 3 bytes for each, one after the other, and `crops.csv` with a row for each:
//!   what the classifier is trained on. Boxes are off by as much as those fitted to LiDAR clusters are.
//!
//! The two sets share no body shape ([`HELD_OUT`](super::HELD_OUT)), no paint and no random numbers.

mod coco;
mod crops;
mod files;
mod scenes;

use std::path::Path;

use closecall_traffic::{ActorId, ConfigError, stream};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use files::Output;
use scenes::DrawnScene;

/// Which of the disjoint sets is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Set {
    /// Shapes and paints for training.
    Training,
    /// Held-out shapes and paints.
    HeldOut,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Content {
    /// Whole images with COCO annotations.
    Images,
    /// Crops as the classifier sees them.
    Crops,
}

/// What to render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DatasetOptions {
    /// Training or held-out.
    pub set: Set,
    /// Images or crops.
    pub content: Content,
    /// Number of random scenes.
    pub scenes: u32,
    /// Seed of the scenes; 0 is a seed like any other.
    pub seed: u64,
}

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DatasetSummary {
    /// Number of scenes drawn.
    pub scenes: u32,
    /// Number of images or crops.
    pub pictures: usize,
    /// Labels by class: car, truck, motorcycle, background.
    pub labels: [usize; 4],
}

/// A data set that could not be written. What was there before is still there; temporary files may be left.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A file could not be written.
    #[error("failed to write {path}: {source}")]
    Write {
        /// The file.
        path: std::path::PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// An image could not be encoded.
    #[error("failed to encode {path}: {source}")]
    Encode {
        /// The file.
        path: std::path::PathBuf,
        /// The encoder's reason.
        source: png::EncodingError,
    },
    /// The annotations could not be encoded.
    #[error("failed to encode the annotations: {0}")]
    Annotations(#[from] serde_json::Error),
    /// A drawn scene was refused by the checks that scenario files pass too.
    #[error("failed to set up a random scene: {0}")]
    Scene(#[from] ConfigError),
    /// The fixed name of the random streams was refused.
    #[error("failed to name the random stream: {0}")]
    Stream(#[from] closecall_traffic::InvalidActorId),
}

/// Renders a data set into `folder`, which is made where it does not exist. Each file appears whole or not at all.
///
/// The same options give the same bytes.
///
/// # Errors
/// [`DatasetError`] where a file cannot be written.
pub fn render_dataset(options: &DatasetOptions, folder: &Path) -> Result<DatasetSummary, DatasetError> {
    let output = Output::new(folder)?;
    let mut summary = DatasetSummary { scenes: options.scenes, pictures: 0, labels: [0; 4] };
    match options.content {
        Content::Images => {
            let mut annotations = coco::Annotations::new(options);
            for index in 0..options.scenes {
                let scene = draw(options, index)?;
                let key = super::ExposureKey(super::hash::mix(options.seed ^ u64::from(index)));
                let picture = super::RearCamera::new(scene.camera).render_image(&scene.scene(), key);
                let name = format!("image-{index:06}.png");
                output.png(&name, &picture.image)?;
                annotations.add(&name, &picture, &scene, &mut summary);
            }
            output.write("annotations.json", &serde_json::to_vec_pretty(&annotations)?)?;
        }
        Content::Crops => {
            let mut crops = crops::Crops::default();
            for index in 0..options.scenes {
                let scene = draw(options, index)?;
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
    /// The two sets draw from streams of their own.
    fn channel(self, purpose: &str) -> &'static str {
        match (self, purpose == "crops") {
            (Self::Training, true) => "training-crops",
            (Self::Training, false) => "training-scenes",
            (Self::HeldOut, true) => "held-out-crops",
            (Self::HeldOut, false) => "held-out-scenes",
        }
    }
}

fn draw(options: &DatasetOptions, index: u32) -> Result<DrawnScene, DatasetError> {
    let mut rng = stream(options.seed, u64::from(index), &ActorId::new("ego")?, options.set.channel("scenes"));
    Ok(DrawnScene::draw(options.set, &mut rng)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> std::path::PathBuf {
        std::env::temp_dir().join(format!("closecall-dataset-{name}-{}", std::process::id()))
    }

    #[test]
    fn crops_come_with_a_row_each_and_the_same_options_give_the_same_bytes() {
        let options = DatasetOptions { set: Set::HeldOut, content: Content::Crops, scenes: 6, seed: 3 };
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
    fn an_image_has_annotations_whose_masks_fit_their_boxes() {
        let options = DatasetOptions { set: Set::Training, content: Content::Images, scenes: 1, seed: 1 };
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
