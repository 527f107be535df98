//! The Mask R-CNN in this process and in Python's ONNX Runtime finds the same in images that are
//! rendered for the test.
//!
//! Python reads the whole image. Rust reads only the pixels that the network samples. The test is a
//! separate program, because a process has one inference backend.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use std::process::Command;

use closecall_sensors::camera::{
    Backend, CHANNELS, HEIGHT_PX, Image, Instance, InstanceDetector, Mask, Sampling, WIDTH_PX,
};
use serde_json::Value;

/// Folder of the repository.
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Maximum differences of a box's sides (px) and of a score, and minimum intersection over union of
/// two masks.
const BOX_PX: f64 = 0.5;
const SCORE: f64 = 1e-3;
const MASK_OVERLAP: f64 = 0.98;
/// Side of a mask in cells.
const CELLS: usize = 28;
/// Number of instances with a score above a half that are compared at least.
const MIN_COMPARED: usize = 12;

/// What Python finds in an image.
struct Answer {
    version: String,
    boxes: Vec<[f64; 4]>,
    labels: Vec<usize>,
    scores: Vec<f64>,
    masks: Vec<Vec<f32>>,
}

/// Reads a line that the script has printed.
fn answer(line: &str) -> Answer {
    let mut answer: Value = serde_json::from_str(line).unwrap();
    let mut part = |key: &str| answer[key].take();
    Answer {
        version: serde_json::from_value(part("version")).unwrap(),
        boxes: serde_json::from_value(part("boxes")).unwrap(),
        labels: serde_json::from_value(part("labels")).unwrap(),
        scores: serde_json::from_value(part("scores")).unwrap(),
        masks: serde_json::from_value(part("masks")).unwrap(),
    }
}

/// Returns the pixels of an image file, three bytes each.
fn pixels(path: &Path) -> Vec<u8> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut rgb).unwrap();
    assert_eq!((frame.width, frame.height), (WIDTH_PX.into(), HEIGHT_PX.into()));
    assert_eq!(frame.color_type, png::ColorType::Rgb);
    rgb
}

/// Returns the pixels of a whole image at the columns and rows of a network.
fn picture(rgb: &[u8], sampling: &Sampling) -> Image {
    let at = |row: i32, column: i32| CHANNELS * (row as usize * usize::from(WIDTH_PX) + column as usize);
    let line =
        |row: i32| sampling.columns().iter().flat_map(move |column| rgb[at(row, *column)..][..CHANNELS].to_vec());
    let (width, height) = (sampling.columns().len() as u32, sampling.rows().len() as u32);
    Image { width, height, rgb: sampling.rows().iter().flat_map(|row| line(*row)).collect() }
}

/// Returns what Python finds in images whose bytes these files have.
fn answers(python: &Path, files: &[PathBuf]) -> Vec<Answer> {
    let script = Path::new(ROOT).join("tests/mask_rcnn_agreement/infer.py");
    let model = Path::new(ROOT).join("sensors/models/rear-mask-rcnn.onnx");
    let output = Command::new(python).arg(script).arg(model).args(files).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(answer).collect()
}

fn mask_overlap(first: &Mask, second: &Mask) -> f64 {
    let (first, second) = (first.pixels(), second.pixels());
    let count = |both: fn(bool, bool) -> bool| first.iter().zip(&second).filter(|(a, b)| both(**a, **b)).count();
    let union = count(|a, b| a || b);
    if union == 0 { 1.0 } else { count(|a, b| a && b) as f64 / union as f64 }
}

fn assert_same(instances: &[Instance], answer: &Answer, image: &Path) {
    let image = image.display();
    assert_eq!(instances.len(), answer.scores.len(), "{image}");
    for (index, instance) in instances.iter().enumerate() {
        assert_eq!(instance.class as usize + 1, answer.labels[index], "{image}, instance {index}");
        let off_px = instance
            .box_px
            .iter()
            .zip(answer.boxes[index])
            .map(|(instance, other)| (instance - other).abs())
            .fold(0.0, f64::max);
        assert!(off_px <= BOX_PX, "{image}, instance {index}: boxes differ by {off_px} px");
        let off = (instance.score - answer.scores[index]).abs();
        assert!(off <= SCORE, "{image}, instance {index}: scores differ by {off}");
        let theirs = Mask::new(answer.boxes[index], [CELLS, CELLS], answer.masks[index].clone()).unwrap();
        let share = mask_overlap(&instance.mask, &theirs);
        assert!(share >= MASK_OVERLAP, "{image}, instance {index}: masks overlap by {share}");
    }
}

#[test]
fn rust_and_python_find_the_same_in_fresh_renders() {
    let Some(library) = closecall_testing::onnxruntime() else { return };
    let Some(python) = closecall_testing::python_with_onnxruntime() else { return };
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("images");
    let output = Command::new(env!("CARGO_BIN_EXE_closecall"))
        .args(["tool", "render", "-n", "8", "--seed", "24112026", "--set", "held-out", "-o"])
        .arg(&images)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let entries = std::fs::read_dir(&images).unwrap().map(|entry| entry.unwrap().path());
    let mut images: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|end| end == "png")).collect();
    images.sort();
    assert_eq!(images.len(), 8);
    let whole: Vec<Vec<u8>> = images.iter().map(|path| pixels(path)).collect();
    let raw: Vec<PathBuf> = images.iter().map(|path| path.with_extension("rgb")).collect();
    raw.iter().zip(&whole).for_each(|(path, rgb)| std::fs::write(path, rgb).unwrap());
    let answers = answers(&python, &raw);
    assert_eq!(answers.len(), images.len());
    println!("compared with onnxruntime {}", answers[0].version);
    let mut detector = InstanceDetector::shipped(&Backend::OnnxRuntime(library)).unwrap();
    let mut compared = 0;
    for ((path, rgb), answer) in images.iter().zip(&whole).zip(&answers) {
        let picture = picture(rgb, detector.sampling());
        let instances = detector.detect(&picture).unwrap();
        assert_same(&instances, answer, path);
        compared += instances.iter().filter(|instance| instance.score > 0.5).count();
    }
    assert!(compared >= MIN_COMPARED, "{compared}");
    // Another image has other instances: the comparison can fail.
    let other = detector.detect(&picture(&whole[1], &detector.sampling().clone())).unwrap();
    let boxes: Vec<[f64; 4]> = other.iter().map(|instance| instance.box_px).collect();
    assert_ne!(boxes, answers[0].boxes);
}
