//! A network that reads the image and returns boxes, labels, scores and masks, as the Mask R-CNNs of
//! torchvision and of the ONNX model zoo do, or boxes, labels and scores alone. It runs in ONNX
//! Runtime: tract has no `RoiAlign`.
//!
//! ```text
//!   image   float [3, 800, 1280] or [1, 3, 800, 1280], as `MaskRcnnInput` says
//!     ▼
//!   boxes   float [n, 4]: left, top, right, bottom (px)      labels  int64 [n]
//!   scores  float [n]: 0 to 1                                masks   float [n, 1, height, width], 0 to 1
//! ```
//!
//! A detector without masks has the other three outputs, or all of them in one, as YOLO has after
//! non-maximum suppression. The box then takes the place of the mask.
//!
//! ```text
//!   rows    float [1, n, 6]: left, top, right, bottom (px), score, label; a row with the score 0 is empty
//! ```
//!
//! A mask has either the size of the image or divides its box. The metadata of a model may name the
//! columns and rows of the image that it reads (`closecall.columns`, `closecall.rows`): the others
//! are not rendered. If it also takes a picture of these pixels alone in place of the image
//! (`closecall.takes-sampled`: `yes`), it is given that, which saves the reading of 12 MB. It may
//! also name its labels (`closecall.labels`: `1=car 2=truck 3=motorcycle`).

use ort::session::{Session, SessionOutputs};
use ort::value::{Outlet, TensorElementType, TensorRef, ValueType};

use super::classifier::{Backend, ClassifierError, environment, open_session};
use super::image::{CHANNELS, Image};
use super::instance::{Instance, Mask};
use super::labels::LabelMap;
use super::mask_rcnn_config::MaskRcnnInput;
use super::picture::{HEIGHT_PX, WIDTH_PX};
use super::sampling::Sampling;
use super::vector_registers::clear_upper_parts;

/// The ONNX file of the Mask R-CNN that ships with Closecall. `xtask/training/mask_rcnn_train.py`
/// trained it, and `models/MASK_RCNN_CARD.md` reports its precision.
pub static SHIPPED_MASK_RCNN: &[u8] = include_bytes!("../../models/rear-mask-rcnn.onnx");

/// The layout that a network must have.
const WANTED: &str = "an input float [3, 800, 1280] or [1, 3, 800, 1280] (sides may be dynamic), and the outputs boxes float \
                      [n, 4], labels int64 [n], scores float [n], masks float [n, 1, height, width]; without masks the first three, \
                      or one output float [1, n, 6] of boxes, scores and labels after non-maximum suppression";
/// Rows and columns of the image.
const IMAGE: [usize; 2] = [HEIGHT_PX as usize, WIDTH_PX as usize];

/// Name of the file of [`SHIPPED_MASK_RCNN`].
const SHIPPED_FILE: &str = "rear-mask-rcnn.onnx";
/// Allowed boxes.
const SIDES: &str = "finite sides in the image: left, top, right beyond left, and bottom beyond top (px)";
/// Boxes of a network that does not return pixels.
const SHARES: &str = "sides in pixels of the image, not in shares of it,";
/// Number of values of a box, a score and a label in one row.
const ROW: usize = 6;
/// Allowed scores and masks.
const PROBABILITIES: &str = "probabilities from 0 to 1";
/// Difference by which a probability in single precision may be outside of 0 to 1.
const ROUNDING: f32 = 1e-4;

/// The names of the outputs.
#[derive(Debug)]
enum Outputs {
    /// Boxes, labels and scores, and the masks if the network makes any.
    Apart { boxes: String, labels: String, scores: String, masks: Option<String> },
    /// Boxes, scores and labels in one tensor.
    Rows(String),
}

/// A network, loaded into one inference session.
#[derive(Debug)]
pub struct InstanceDetector {
    session: Session,
    /// Name and rank of the input.
    input: (String, usize),
    outputs: Outputs,
    sampling: Sampling,
    labels: LabelMap,
    /// Name of the network in errors.
    name: String,
    colours: MaskRcnnInput,
    /// Rows and columns of the input: of the image, or of the pixels that the network reads.
    sides: [usize; 2],
    /// The input: three planes. Pixels that the network does not read stay 0.
    planes: Vec<f32>,
}

impl InstanceDetector {
    /// Loads the network that ships with Closecall.
    ///
    /// # Errors
    /// As [`InstanceDetector::new`].
    pub fn shipped(backend: &Backend) -> Result<Self, ClassifierError> {
        Self::new(SHIPPED_MASK_RCNN, None, backend)
    }

    /// Loads a network from the bytes of an ONNX file. `labels` names its labels if its metadata do
    /// not.
    ///
    /// # Errors
    /// [`ClassifierError`] if the backend is not ONNX Runtime or cannot be loaded, if the process
    /// uses another backend, if `model` cannot be read or has another layout, or if no labels are
    /// known.
    pub fn new(model: &[u8], labels: Option<&LabelMap>, backend: &Backend) -> Result<Self, ClassifierError> {
        if *backend == Backend::Tract {
            return Err(ClassifierError::NeedsOnnxRuntime);
        }
        let session = open_session(model, environment(backend)?, backend);
        let session = session.map_err(|error| ClassifierError::Model { reason: error.to_string() })?;
        let (input, outputs) = layout(&session)?;
        let reason = |reason: String| ClassifierError::Model { reason };
        let word = |key: &str| session.metadata().ok().and_then(|metadata| metadata.custom(key));
        let sampling = match (word("closecall.columns"), word("closecall.rows")) {
            (Some(columns), Some(rows)) => {
                Sampling::parse(&columns, &rows).map_err(|error| reason(error.to_string()))?
            }
            _ => Sampling::all(),
        };
        let labels = match (labels, word("closecall.labels")) {
            (Some(labels), _) => labels.clone(),
            (None, Some(text)) => LabelMap::parse(&text)
                .map_err(|word| reason(format!("its metadata closecall.labels have {word:?}, not label=class")))?,
            (None, None) => {
                return Err(reason(
                    "it names no labels: `labels` must, such as \"3=car 4=motorcycle 8=truck\"".to_owned(),
                ));
            }
        };
        let takes_sampled = word("closecall.takes-sampled").is_some_and(|text| text == "yes");
        let sides = if takes_sampled { [sampling.rows().len(), sampling.columns().len()] } else { IMAGE };
        let (colours, planes) = (MaskRcnnInput::Rgb, vec![0.0; sides[0] * sides[1] * CHANNELS]);
        Ok(Self { session, input, outputs, sampling, labels, name: SHIPPED_FILE.to_owned(), colours, sides, planes })
    }

    /// Returns the same network, whose errors name it so: the path of its file.
    #[must_use]
    pub fn with_name(self, name: &str) -> Self {
        Self { name: name.to_owned(), ..self }
    }

    /// Returns the same network, which takes these values for the colours of a pixel.
    /// [`MaskRcnnInput::Rgb`] is usual.
    #[must_use]
    pub fn with_input(self, colours: MaskRcnnInput) -> Self {
        Self { colours, ..self }
    }

    /// Returns the columns and rows of the image that the network reads.
    pub fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// Returns the instances in a picture of the pixels at the columns and rows of
    /// [`InstanceDetector::sampling`], in the order of the network. The same picture always gives
    /// the same bits.
    ///
    /// # Errors
    /// [`ClassifierError::Run`] if inference fails, [`ClassifierError::Layout`] if an output has
    /// another shape, and [`ClassifierError::Value`] if a box is not finite or has no sides, or a
    /// score or a mask is not a probability.
    pub fn detect(&mut self, picture: &Image) -> Result<Vec<Instance>, ClassifierError> {
        self.fill(picture);
        let run = |error: ort::Error| ClassifierError::Run { reason: error.to_string() };
        let sides = [1, CHANNELS, self.sides[0], self.sides[1]];
        let (name, rank) = &self.input;
        let input = TensorRef::from_array_view((&sides[4 - rank..], self.planes.as_slice())).map_err(run)?;
        let outputs = self.session.run(ort::inputs![name.as_str() => input]);
        clear_upper_parts();
        instances(&outputs.map_err(run)?, &self.outputs, &self.labels, &self.name)
    }
}

impl InstanceDetector {
    /// Writes a picture into the planes of the input.
    fn fill(&mut self, picture: &Image) {
        let (rows, columns) = (self.sampling.rows(), self.sampling.columns());
        let plane = self.sides[0] * self.sides[1];
        let is_image = self.sides == IMAGE;
        for (y, line) in picture.rgb.chunks_exact(columns.len() * CHANNELS).enumerate() {
            for (x, rgb) in line.chunks_exact(CHANNELS).enumerate() {
                #[expect(clippy::cast_sign_loss, reason = "columns and rows lie in the image")]
                let [row, column] = if is_image { [rows[y] as usize, columns[x] as usize] } else { [y, x] };
                for (channel, value) in rgb.iter().enumerate() {
                    let (place, value) = self.colours.place(channel, *value);
                    self.planes[place * plane + row * self.sides[1] + column] = value;
                }
            }
        }
    }
}

/// Returns the instances of the network's outputs.
fn instances(
    outputs: &SessionOutputs<'_>,
    names: &Outputs,
    map: &LabelMap,
    model: &str,
) -> Result<Vec<Instance>, ClassifierError> {
    let run = |error: ort::Error| ClassifierError::Run { reason: error.to_string() };
    let floats = |name: &str| outputs[name].try_extract_tensor::<f32>().map_err(run);
    let wrong_layout = |actual| Err(ClassifierError::Layout { actual, wanted: WANTED });
    match names {
        Outputs::Rows(name) => {
            let (shape, values) = floats(name)?;
            if !values.len().is_multiple_of(ROW) || shape.last() != Some(&(ROW as i64)) {
                return wrong_layout(format!("{name} {shape:?}"));
            }
            let part = |range: std::ops::Range<usize>| -> Vec<f32> {
                values.chunks_exact(ROW).flat_map(|row| row[range.clone()].to_vec()).collect()
            };
            let (boxes, scores, labels) = (part(0..4), part(4..5), part(5..6));
            let is_no_label = |label: &f32| label.fract() != 0.0;
            let tensor = |values, place| Tensor { name, values, place };
            tensor(&labels, |row| ROW * row + 5).refuse(labels.iter().position(is_no_label), "whole labels", model)?;
            #[expect(clippy::cast_possible_truncation, reason = "whole, and one that is out of range has no class")]
            let labels: Vec<i64> = labels.iter().map(|label| *label as i64).collect();
            let boxes = tensor(&boxes, |side| side / 4 * ROW + side % 4);
            let scores = tensor(&scores, |row| ROW * row + 4);
            Answer { boxes, labels: &labels, scores, masks: None }.instances(map, model)
        }
        Outputs::Apart { boxes, labels, scores, masks } => {
            let ((boxes_shape, box_sides), (scores_shape, score_values)) = (floats(boxes)?, floats(scores)?);
            let (labels_shape, label_values) = outputs[labels.as_str()].try_extract_tensor::<i64>().map_err(run)?;
            let masks =
                masks.as_ref().map(|name| floats(name).map(|(shape, values)| (name, shape, values))).transpose()?;
            let count = score_values.len();
            let side = |shape: &[i64], index: usize| shape.get(index).and_then(|side| usize::try_from(*side).ok());
            let cells = masks.as_ref().map(|(_, shape, _)| [3, 2].map(|index| side(shape, index).unwrap_or(0)));
            let are_masks_right = masks.as_ref().zip(cells).is_none_or(|((_, _, values), [columns, rows])| {
                values.len() == count * rows * columns && (count == 0 || rows * columns > 0)
            });
            if box_sides.len() != 4 * count || label_values.len() != count || !are_masks_right {
                let of_masks = masks.map_or_else(String::new, |(_, shape, _)| format!(", masks {shape:?}"));
                return wrong_layout(format!(
                    "boxes {boxes_shape:?}, labels {labels_shape:?}, scores {scores_shape:?}{of_masks}"
                ));
            }
            let tensor = |name, values| Tensor { name, values, place: |index| index };
            let masks = masks.zip(cells).map(|((name, _, values), cells)| (tensor(name, values), cells));
            let (boxes, scores) = (tensor(boxes, box_sides), tensor(scores, score_values));
            Answer { boxes, labels: label_values, scores, masks }.instances(map, model)
        }
    }
}

/// Values of one kind in an output.
struct Tensor<'a> {
    /// Name of the output.
    name: &'a str,
    values: &'a [f32],
    /// Returns the place in the output of the value with this index.
    place: fn(usize) -> usize,
}

impl Tensor<'_> {
    /// Refuses the value with this index, if there is one.
    fn refuse(&self, index: Option<usize>, allowed: &'static str, model: &str) -> Result<(), ClassifierError> {
        let Some(index) = index else { return Ok(()) };
        let value = format!("{} as value {}", self.values[index], (self.place)(index));
        Err(ClassifierError::Value { model: model.to_owned(), tensor: self.name.to_owned(), value, allowed })
    }
}

/// What the network returned for an image: as many boxes, labels and scores.
struct Answer<'a> {
    boxes: Tensor<'a>,
    labels: &'a [i64],
    scores: Tensor<'a>,
    /// The masks, each with so many columns and rows, if the network makes any.
    masks: Option<(Tensor<'a>, [usize; 2])>,
}

impl Answer<'_> {
    /// Returns the instances whose labels are classes of vehicles. A score of 0 is none: exports of
    /// YOLO fill up their rows with zeros.
    fn instances(&self, map: &LabelMap, model: &str) -> Result<Vec<Instance>, ClassifierError> {
        let (boxes, scores) = (self.boxes.values, self.scores.values);
        let [width_px, height_px] = [WIDTH_PX, HEIGHT_PX].map(f32::from);
        let is_box = |sides: &[f32]| {
            sides.iter().all(|side| side.is_finite())
                && sides[0] <= sides[2].min(width_px)
                && sides[1] <= sides[3].min(height_px)
                && sides[2] >= 0.0
                && sides[3] >= 0.0
        };
        let wrong_side = |sides: &[f32]| sides.iter().position(|side| !side.is_finite()).unwrap_or(2);
        let wrong_box = boxes.chunks_exact(4).enumerate().find(|(_, sides)| !is_box(sides));
        let wrong_box = wrong_box.map(|(index, sides)| 4 * index + wrong_side(sides));
        self.boxes.refuse(wrong_box, SIDES, model)?;
        let found = || (0..scores.len()).filter(|index| scores[*index] != 0.0);
        // No camera shows all vehicles within the first pixel.
        let are_shares = found().all(|index| boxes[4 * index..][..4].iter().all(|side| *side <= 1.0));
        self.boxes.refuse(found().next().filter(|_| are_shares).map(|index| 4 * index + 2), SHARES, model)?;
        let is_no_probability = |value: &f32| !(-ROUNDING..=1.0 + ROUNDING).contains(value);
        self.scores.refuse(scores.iter().position(is_no_probability), PROBABILITIES, model)?;
        if let Some((masks, _)) = &self.masks {
            masks.refuse(masks.values.iter().position(is_no_probability), PROBABILITIES, model)?;
        }
        let instances = found().filter_map(|index| {
            let box_px: [f64; 4] = std::array::from_fn(|part| f64::from(boxes[4 * index + part]));
            let class = map.class(self.labels[index])?;
            let mask = match &self.masks {
                None => Mask::new(box_px, [1, 1], vec![1.0])?,
                Some((masks, [columns, rows])) => {
                    let is_image = [*columns, *rows] == [usize::from(WIDTH_PX), usize::from(HEIGHT_PX)];
                    let area_px = if is_image { [0.0, 0.0, WIDTH_PX.into(), HEIGHT_PX.into()] } else { box_px };
                    let cells = masks.values[index * rows * columns..][..rows * columns].to_vec();
                    Mask::new(area_px, [*columns, *rows], cells)?
                }
            };
            Some(Instance { box_px, class, score: f64::from(scores[index]).clamp(0.0, 1.0), mask })
        });
        Ok(instances.collect())
    }
}

/// Returns name and rank of the input, and the names of the outputs.
///
/// The outputs are told apart by their names or, if these are others, by their number and order.
fn layout(session: &Session) -> Result<((String, usize), Outputs), ClassifierError> {
    let (inputs, outputs) = (session.inputs(), session.outputs());
    let wrong = || {
        let list = |outlets: &[Outlet]| {
            let words: Vec<String> =
                outlets.iter().map(|outlet| format!("{} {}", outlet.name(), outlet.dtype())).collect();
            if words.is_empty() { "none".to_owned() } else { words.join(", ") }
        };
        ClassifierError::Layout {
            actual: format!("inputs {}; outputs {}", list(inputs), list(outputs)),
            wanted: WANTED,
        }
    };
    let sides = [1, CHANNELS as i64, HEIGHT_PX.into(), WIDTH_PX.into()];
    let [input] = inputs else { return Err(wrong()) };
    let rank = match shape(input, TensorElementType::Float32) {
        Some(shape) if fits(&shape, &sides[1..]) || fits(&shape, &sides) => shape.len(),
        _ => return Err(wrong()),
    };
    let input = (input.name().to_owned(), rank);
    let has = |outlet, kind, sides: &[i64]| shape(outlet, kind).is_some_and(|shape| fits(&shape, sides));
    if let [rows] = outputs {
        let is_right = has(rows, TensorElementType::Float32, &[1, -1, ROW as i64]);
        return if is_right { Ok((input, Outputs::Rows(rows.name().to_owned()))) } else { Err(wrong()) };
    }
    let named = |name: &str| outputs.iter().find(|output| output.name() == name);
    let (boxes, labels, scores, masks) = match (named("boxes"), named("labels"), named("scores"), outputs) {
        (Some(boxes), Some(labels), Some(scores), _) => (boxes, labels, scores, named("masks")),
        (_, _, _, [boxes, labels, scores]) => (boxes, labels, scores, None),
        (_, _, _, [boxes, labels, scores, masks]) => (boxes, labels, scores, Some(masks)),
        _ => return Err(wrong()),
    };
    let is_right = has(boxes, TensorElementType::Float32, &[-1, 4])
        && has(labels, TensorElementType::Int64, &[-1])
        && has(scores, TensorElementType::Float32, &[-1])
        && masks.is_none_or(|masks| has(masks, TensorElementType::Float32, &[-1, 1, -1, -1]));
    if !is_right {
        return Err(wrong());
    }
    let name = |outlet: &Outlet| outlet.name().to_owned();
    let masks = masks.map(name);
    Ok((input, Outputs::Apart { boxes: name(boxes), labels: name(labels), scores: name(scores), masks }))
}

/// Returns the shape of a tensor of this kind of element, with −1 for a dynamic side. Returns
/// `None` for anything else.
fn shape(outlet: &Outlet, kind: TensorElementType) -> Option<Vec<i64>> {
    match outlet.dtype() {
        ValueType::Tensor { ty, shape, .. } if *ty == kind => Some(shape.to_vec()),
        _ => None,
    }
}

/// Returns whether a shape can be one with these sides. A negative side is dynamic, or any.
fn fits(shape: &[i64], sides: &[i64]) -> bool {
    shape.len() == sides.len()
        && shape.iter().zip(sides).all(|(dimension, side)| dimension == side || *dimension < 0 || *side < 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use closecall_traffic::VehicleClass;

    #[test]
    fn labels_are_read_and_wrong_ones_are_named() {
        let map = LabelMap::parse("3=car 8=truck 4=motorcycle").unwrap();
        assert_eq!(map.class(8), Some(VehicleClass::Truck));
        assert_eq!(map.class(1), None);
        assert_eq!(LabelMap::parse("3=car 8=bus"), Err("8=bus".to_owned()));
        assert_eq!(LabelMap::parse("car"), Err("car".to_owned()));
        assert_eq!(LabelMap::parse(" "), Err(" ".to_owned()));
    }

    #[test]
    fn without_onnx_runtime_the_error_says_how_to_get_it() {
        let error = InstanceDetector::shipped(&Backend::Tract).unwrap_err().to_string();
        assert!(error.contains("pip install onnxruntime"), "{error}");
    }
}
