//! The instances that the Mask R-CNN found in an image: boxes with class and score, and masks.

use closecall_sensors::RearImage;
use closecall_sensors::camera::{Instance, MASK_THRESHOLD};
use closecall_traffic::{Time, VehicleClass};

use super::{Shown, class_colour, clear_covered, fixed_marks, in_picture, labels_entity, labels_in_strip};
use crate::run::rerun::RecordingError;
use crate::run::rerun::palette::{self, Rgba};
use crate::run::rerun::stream::Writer;
use rerun::datatypes::ImageFormat;
use rerun::{AnnotationContext, AsComponents, Boxes2D, ChannelDatatype, Points2D, Rgba32, SegmentationImage};

/// Score from which an instance is more likely right than not: it has the colour of its class, and
/// its mask is shown.
const LIKELY: f64 = 0.5;
/// Opacity of the masks (0 to 1), which leaves the vehicles visible.
const MASK_OPACITY: f32 = 0.4;

fn boxes_entity(entity: &str) -> String {
    format!("{entity}/instances")
}

fn masks_entity(entity: &str) -> String {
    format!("{entity}/masks")
}

/// Writes the properties of all images: the classes of the masks, and the look of the boxes.
pub(super) fn write_fixed(writer: &Writer<'_>, entity: &str) -> Result<(), RecordingError> {
    writer.write_static(&boxes_entity(entity), &fixed_marks())?;
    let class = |class: VehicleClass| (mask_class(class).into(), class.name(), colour_of(class_colour(class)));
    let background = (0_u16, "background", colour_of([0; 4]));
    writer.write_static(
        &masks_entity(entity),
        &AnnotationContext::new(std::iter::once(background).chain(VehicleClass::ALL.map(class)).collect::<Vec<_>>()),
    )
}

/// Writes the instances of these images.
pub(super) fn write<'a>(
    writer: &Writer<'_>,
    (entity, part): (&str, &Shown),
    images: impl Iterator<Item = &'a RearImage>,
) -> Result<(), RecordingError> {
    let images: Vec<(Time, &[Instance])> = images.map(|image| (image.time, &image.instances[..])).collect();
    let marks = images.iter().map(|(time, instances)| (*time, boxes(part, instances)));
    let (boxes, labels): (Vec<_>, Vec<_>) =
        marks.map(|(time, (boxes, labels))| ((time, boxes), (time, labels))).unzip();
    let masks: Vec<(Time, SegmentationImage)> =
        images.iter().map(|(time, instances)| (*time, masks(part, instances))).collect();
    writer.write_each(&boxes_entity(entity), &rows(&boxes))?;
    writer.write_each(&labels_entity(entity), &rows(&labels))?;
    writer.write_each(&masks_entity(entity), &rows(&masks))
}

fn rows<T: AsComponents>(whats: &[(Time, T)]) -> Vec<(Time, &dyn AsComponents)> {
    whats.iter().map(|(time, archetype)| (*time, archetype as _)).collect()
}

/// Returns the boxes of the instances with class and score, cut to the shown picture, and their
/// labels.
fn boxes(part: &Shown, instances: &[Instance]) -> (Boxes2D, Points2D) {
    let ends = |instance: &Instance| in_picture(part, instance.box_px.map(|side| side as f32));
    let is_shown = |instance: &&Instance| ends(instance).1.iter().all(|side| *side > 0.0);
    let shown: Vec<&Instance> = instances.iter().filter(is_shown).collect();
    let colour = |instance: &&Instance| match instance.score >= LIKELY {
        true => class_colour(instance.class),
        false => palette::QUIET,
    };
    let places: Vec<([f32; 2], [f32; 2])> = shown.iter().map(|instance| ends(instance)).collect();
    let mut labels: Vec<String> = shown.iter().map(|instance| label(instance)).collect();
    let width_px = part.size_px()[0];
    clear_covered(&places, &mut labels, width_px);
    let points = labels_in_strip(&places, &labels, width_px);
    let boxes = Boxes2D::from_mins_and_sizes(places.iter().map(|place| place.0), places.iter().map(|place| place.1))
        .with_colors(shown.iter().map(colour))
        .with_labels(labels)
        .with_class_ids(shown.iter().map(|instance| u16::from(mask_class(instance.class))));
    (boxes, points)
}

/// Returns class and score. An instance that is probably no vehicle has no label, so the image
/// stays visible.
fn label(instance: &Instance) -> String {
    if instance.score < LIKELY {
        return String::new();
    }
    format!("{} {:.2}", instance.class.name(), instance.score)
}

/// Returns the class of each pixel of the shown picture: the class of the likeliest instance whose
/// mask covers it, or 0.
fn masks(part: &Shown, instances: &[Instance]) -> SegmentationImage {
    let mut likely: Vec<&Instance> = instances.iter().filter(|instance| instance.score >= LIKELY).collect();
    likely.sort_by(|a, b| b.score.total_cmp(&a.score));
    let step = usize::from(part.step_px);
    let middle = |pixel: u32| f64::from(pixel) + 0.5 * f64::from(part.step_px);
    let columns = (0..u32::from(part.image.width_px)).step_by(step).map(middle);
    let rows = part.rows_px.clone().step_by(step).map(|row| middle(row.into()));
    let class_at = |at: [f64; 2]| {
        let covers = |instance: &&&Instance| instance.mask.at(at) >= MASK_THRESHOLD;
        likely.iter().find(covers).map_or(0, |instance| mask_class(instance.class))
    };
    let size = [columns.len(), rows.len()].map(|count| count as u32);
    let pixels: Vec<u8> = rows.flat_map(|v| columns.clone().map(move |u| [u, v])).map(class_at).collect();
    SegmentationImage::new(pixels, ImageFormat::segmentation(size, ChannelDatatype::U8)).with_opacity(MASK_OPACITY)
}

/// Returns the number of a class in the masks, in which 0 is background.
fn mask_class(class: VehicleClass) -> u8 {
    class as u8 + 1
}

fn colour_of([red, green, blue, opacity]: Rgba) -> Rgba32 {
    Rgba32::from_unmultiplied_rgba(red, green, blue, opacity)
}
