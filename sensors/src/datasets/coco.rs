//! Annotations in the COCO format (Lin et al., *Microsoft COCO: common objects in context*, 2014).
//! The field names follow <https://cocodataset.org/#format-data>. Masks are uncompressed run
//! lengths in column-major order, and the first run counts zeros.

use closecall_traffic::{BodyShape, VehicleClass};
use serde::Serialize;

use super::scenes::RandomScene;
use super::{DatasetOptions, DatasetSummary};
use crate::camera::LabelledImage;

#[derive(Serialize)]
pub(super) struct Annotations {
    info: Info,
    images: Vec<ImageEntry>,
    annotations: Vec<Annotation>,
    categories: Vec<Category>,
}

#[derive(Serialize)]
struct Info {
    description: &'static str,
    set: super::Set,
    seed: u64,
}

#[derive(Serialize)]
struct ImageEntry {
    id: usize,
    file_name: String,
    width: u32,
    height: u32,
    light: closecall_traffic::Light,
    rain_mm_per_h: f64,
    visibility_m: f64,
}

#[derive(Serialize)]
struct Annotation {
    id: usize,
    image_id: usize,
    category_id: usize,
    /// Left, top, width and height (px).
    bbox: [usize; 4],
    area: usize,
    iscrowd: u8,
    segmentation: RunLengths,
    distance_m: f64,
    body_shape: BodyShape,
}

#[derive(Serialize)]
struct RunLengths {
    /// Height and width (px).
    size: [u32; 2],
    counts: Vec<u32>,
}

#[derive(Serialize)]
struct Category {
    id: usize,
    name: &'static str,
    supercategory: &'static str,
}

impl Annotations {
    pub(super) fn new(options: &DatasetOptions) -> Self {
        let category =
            |class: VehicleClass| Category { id: category(class), name: class.name(), supercategory: "vehicle" };
        Self {
            info: Info { description: "Closecall rear camera", set: options.set, seed: options.seed },
            images: Vec::new(),
            annotations: Vec::new(),
            categories: VehicleClass::ALL.map(category).into(),
        }
    }

    /// Adds one image, with an annotation for each vehicle that is visible in it.
    pub(super) fn add(
        &mut self,
        name: &str,
        picture: &LabelledImage,
        scene: &RandomScene,
        summary: &mut DatasetSummary,
    ) {
        let image_id = self.images.len() + 1;
        self.images.push(ImageEntry {
            id: image_id,
            file_name: name.to_owned(),
            width: picture.image.width,
            height: picture.image.height,
            light: scene.environment.light,
            rain_mm_per_h: scene.environment.rain_mm_per_h,
            visibility_m: scene.environment.visibility_m,
        });
        summary.pictures += 1;
        for (index, vehicle) in scene.others.iter().enumerate() {
            let Some((bbox, area)) = extent(picture, index) else { continue };
            summary.labels[vehicle.vehicle.class as usize] += 1;
            self.annotations.push(Annotation {
                id: self.annotations.len() + 1,
                image_id,
                category_id: category(vehicle.vehicle.class),
                bbox,
                area,
                iscrowd: 0,
                segmentation: run_lengths(picture, index),
                distance_m: scene.ego.state.s_m - vehicle.state.s_m,
                body_shape: vehicle.vehicle.appearance.body_shape,
            });
        }
    }
}

/// Returns the category id of a class. The ids start at 1.
fn category(class: VehicleClass) -> usize {
    class as usize + 1
}

/// Returns the bounding box `[left, top, width, height]` (px) and the number of the pixels that
/// show the vehicle with this index. Returns `None` if no pixel shows it.
fn extent(picture: &LabelledImage, index: usize) -> Option<([usize; 4], usize)> {
    let width = picture.image.width as usize;
    let pixels = picture.instances.iter().enumerate().filter(|(_, instance)| usize::from(**instance) == index + 1);
    let (mut left, mut top, mut right, mut bottom, mut area) = (usize::MAX, usize::MAX, 0, 0, 0);
    for (pixel, _) in pixels {
        let (column, row) = (pixel % width, pixel / width);
        (left, top) = (left.min(column), top.min(row));
        (right, bottom) = (right.max(column + 1), bottom.max(row + 1));
        area += 1;
    }
    (area > 0).then(|| ([left, top, right - left, bottom - top], area))
}

fn run_lengths(picture: &LabelledImage, index: usize) -> RunLengths {
    let (width, height) = (picture.image.width as usize, picture.image.height as usize);
    let mut counts = vec![0];
    let mut inside = false;
    for pixel in (0..width).flat_map(|column| (0..height).map(move |row| row * width + column)) {
        let is_visible = usize::from(picture.instances[pixel]) == index + 1;
        if is_visible != inside {
            counts.push(0);
            inside = is_visible;
        }
        if let Some(run) = counts.last_mut() {
            *run += 1;
        }
    }
    RunLengths { size: [picture.image.height, picture.image.width], counts }
}
