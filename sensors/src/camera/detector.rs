//! An instance segmentation network that reads the image and returns boxes, labels, scores and
//! masks, as the Mask R-CNNs of torchvision and of the ONNX model zoo do. It runs in ONNX Runtime:
//! tract has no `RoiAlign`.
//!
//! ```text
//!   image   float [3, 800, 1280] or [1, 3, 800, 1280], as `MaskRcnnInput` says
//!     ▼
//!   boxes   float [n, 4]: left, top, right, bottom (px)      labels  int64 [n]
//!   scores  float [n]: 0 to 1                                masks   float [n, 1, height, width], 0 to 1
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
pub const SHIPPED_MASK_RCNN: &[u8] = include_bytes!("../../models/rear-mask-rcnn.onnx");

/// The layout that a network must have.
const WANTED: &str = "an input float [3, 800, 1280] or [1, 3, 800, 1280] (sides may be dynamic), and the outputs boxes float \
                      [n, 4], labels int64 [n], scores float [n], masks float [n, 1, height, width]";
/// Rows and columns of the image.
const IMAGE: [usize; 2] = [HEIGHT_PX as usize, WIDTH_PX as usize];

/// Name of the file of [`SHIPPED_MASK_RCNN`].
const SHIPPED_FILE: &str = "rear-mask-rcnn.onnx";
/// Allowed scores and masks.
const PROBABILITIES: &str = "probabilities from 0 to 1";
/// Difference by which a probability in single precision may be outside of 0 to 1.
const ROUNDING: f32 = 1e-4;

/// A network, loaded into one inference session.
#[derive(Debug)]
pub struct InstanceDetector {
    session: Session,
    /// Name and rank of the input.
    input: (String, usize),
    /// Names of boxes, labels, scores and masks.
    outputs: [String; 4],
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
    names: &[String; 4],
    map: &LabelMap,
    model: &str,
) -> Result<Vec<Instance>, ClassifierError> {
    let [boxes, labels, scores, masks] = names;
    let run = |error: ort::Error| ClassifierError::Run { reason: error.to_string() };
    let (boxes_shape, boxes) = outputs[boxes.as_str()].try_extract_tensor::<f32>().map_err(run)?;
    let (labels_shape, labels) = outputs[labels.as_str()].try_extract_tensor::<i64>().map_err(run)?;
    let (scores_shape, scores) = outputs[scores.as_str()].try_extract_tensor::<f32>().map_err(run)?;
    let (masks_shape, masks) = outputs[masks.as_str()].try_extract_tensor::<f32>().map_err(run)?;
    let side = |index: usize| masks_shape.get(index).map_or(0, |side| usize::try_from(*side).unwrap_or(0));
    let (rows, columns, count) = (side(2), side(3), scores.len());
    let is_right = boxes.len() == 4 * count && labels.len() == count && masks.len() == count * rows * columns;
    if !is_right || (count > 0 && rows * columns == 0) {
        let actual =
            format!("boxes {boxes_shape:?}, labels {labels_shape:?}, scores {scores_shape:?}, masks {masks_shape:?}");
        return Err(ClassifierError::Layout { actual, wanted: WANTED });
    }
    let check = |tensor: &String, place: Option<usize>, values: &[f32], allowed: &'static str| {
        let Some(index) = place else { return Ok(()) };
        let value = format!("{} as value {index}", values[index]);
        Err(ClassifierError::Value { model: model.to_owned(), tensor: tensor.clone(), value, allowed })
    };
    let is_no_box =
        |sides: &[f32]| sides.iter().any(|side| !side.is_finite()) || sides[2] < sides[0] || sides[3] < sides[1];
    let wrong_side = |sides: &[f32]| sides.iter().position(|side| !side.is_finite()).unwrap_or(2);
    let wrong_box = boxes.chunks_exact(4).enumerate().find(|(_, sides)| is_no_box(sides));
    let wrong_box = wrong_box.map(|(index, sides)| 4 * index + wrong_side(sides));
    check(&names[0], wrong_box, boxes, "finite sides: left, top, right beyond left, and bottom beyond top (px)")?;
    let is_no_probability = |value: &f32| !(-ROUNDING..=1.0 + ROUNDING).contains(value);
    check(&names[2], scores.iter().position(is_no_probability), scores, PROBABILITIES)?;
    check(&names[3], masks.iter().position(is_no_probability), masks, PROBABILITIES)?;
    let is_image = [columns, rows] == [usize::from(WIDTH_PX), usize::from(HEIGHT_PX)];
    let instances = (0..count).filter_map(|index| {
        let box_px: [f64; 4] = std::array::from_fn(|part| f64::from(boxes[4 * index + part]));
        let class = map.class(labels[index])?;
        let area_px = if is_image { [0.0, 0.0, WIDTH_PX.into(), HEIGHT_PX.into()] } else { box_px };
        let mask = Mask::new(area_px, [columns, rows], masks[index * rows * columns..][..rows * columns].to_vec())?;
        Some(Instance { box_px, class, score: f64::from(scores[index]).clamp(0.0, 1.0), mask })
    });
    Ok(instances.collect())
}

/// Returns name and rank of the input, and the names of boxes, labels, scores and masks.
///
/// The outputs are told apart by their names or, if these are others, by their order.
fn layout(session: &Session) -> Result<((String, usize), [String; 4]), ClassifierError> {
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
    let names = ["boxes", "labels", "scores", "masks"];
    let by_name = names.map(|name| outputs.iter().find(|output| output.name() == name));
    let by_place = [0, 1, 2, 3].map(|place| outputs.get(place).filter(|_| outputs.len() == 4));
    let chosen = if by_name.iter().all(Option::is_some) { by_name } else { by_place };
    let [Some(boxes), Some(labels), Some(scores), Some(masks)] = chosen else { return Err(wrong()) };
    let has = |outlet, kind, sides: &[i64]| shape(outlet, kind).is_some_and(|shape| fits(&shape, sides));
    let is_right = has(boxes, TensorElementType::Float32, &[-1, 4])
        && has(labels, TensorElementType::Int64, &[-1])
        && has(scores, TensorElementType::Float32, &[-1])
        && has(masks, TensorElementType::Float32, &[-1, 1, -1, -1]);
    if !is_right {
        return Err(wrong());
    }
    Ok(((input.name().to_owned(), rank), [boxes, labels, scores, masks].map(|outlet| outlet.name().to_owned())))
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
