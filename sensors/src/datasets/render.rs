//! Renders a data set.

use super::files::Output;
use super::options::{CameraLooks, Content, DatasetOptions, Set};
use super::scenes::RandomScene;
use super::summary::{DatasetError, DatasetSummary};
use super::{coco, crops};
use crate::camera::Camera;
use closecall_traffic::{ActorId, Stream, stream};
use std::path::Path;

/// Renders a data set into `folder`, which is created if it does not exist. Each file is written
/// atomically.
///
/// The same options give the same bytes.
///
/// # Errors
/// Returns a [`DatasetError`] if a scene cannot be set up, or if a file cannot be encoded or
/// written.
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
    use crate::datasets::USUAL_VEHICLES;

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
