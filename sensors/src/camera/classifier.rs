//! The network that says what a crop shows, run through ONNX Runtime's interface.
//!
//! The interface has two implementations: tract, in Rust and part of this binary, and Microsoft's ONNX Runtime, loaded
//! from a shared library where one is named. A process has one of them for its life, so the first classifier decides;
//! a session answers one question at a time, so each worker has its own.
//!
//! The graph takes bytes as numbers and gives probabilities: scaling, calibration (a temperature) and softmax are part
//! of it. It was trained and exported by `training/train.py`; `models/MODEL_CARD.md` says how well it does.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use closecall_traffic::ClassScores;
use ort::environment::Environment;
use ort::session::Session;
use ort::session::builder::GraphOptimizationLevel;
use ort::value::TensorRef;

use super::image::{CHANNELS, CROP_PX, Crop};

/// The network that ships.
pub const SHIPPED_MODEL: &[u8] = include_bytes!("../../models/rear-classifier.onnx");

/// Samples of a crop.
const SAMPLES: usize = CROP_PX * CROP_PX;

/// What runs the network.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// Tract: pure Rust, nothing to install.
    #[default]
    Tract,
    /// ONNX Runtime, 1.24 or later, from this shared library.
    OnnxRuntime(PathBuf),
}

impl Backend {
    /// The shared library that the user names, or else the value of `ORT_DYLIB_PATH`, or else tract.
    pub fn choose(named: Option<&Path>, environment: Option<PathBuf>) -> Self {
        match named.map(Path::to_owned).or(environment).filter(|path| !path.as_os_str().is_empty()) {
            Some(path) => Self::OnnxRuntime(path),
            None => Self::Tract,
        }
    }
}

/// A classifier that could not be set up or run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClassifierError {
    /// The shared library is not there, or is no ONNX Runtime of the right version.
    #[error("failed to load the inference backend {backend:?}: {reason}")]
    Load {
        /// What was asked for.
        backend: Backend,
        /// The library's reason.
        reason: String,
    },
    /// The process has a backend already, and it is another one.
    #[error("failed to switch to the inference backend {asked:?}: this process has {chosen:?}")]
    Switch {
        /// What the process has.
        chosen: Backend,
        /// What was asked for.
        asked: Backend,
    },
    /// The model's bytes are no network that the backend can run.
    #[error("failed to read the classifier's network: {reason}")]
    Model {
        /// The library's reason.
        reason: String,
    },
    /// The network stopped. The session should not be used again.
    #[error("failed to run the classifier's network: {reason}")]
    Run {
        /// The library's reason.
        reason: String,
    },
    /// The network's answer is not four probabilities.
    #[error("failed to read the classifier's answer: {found:?} are not four probabilities")]
    Answer {
        /// What came out.
        found: Vec<String>,
    },
}

/// One session of the network.
#[derive(Debug)]
pub struct Classifier {
    session: Session,
    planes: Vec<f32>,
}

impl Classifier {
    /// The network that ships, on this backend.
    ///
    /// # Errors
    /// [`ClassifierError`] where the backend cannot be loaded, or the process has another one.
    pub fn shipped(backend: &Backend) -> Result<Self, ClassifierError> {
        Self::new(SHIPPED_MODEL, backend)
    }

    /// A network of the same input and output as the one that ships.
    ///
    /// # Errors
    /// [`ClassifierError`] where the backend cannot be loaded, the process has another one, or `model` cannot be read.
    pub fn new(model: &[u8], backend: &Backend) -> Result<Self, ClassifierError> {
        let environment = environment(backend)?;
        let session =
            open(model, environment, backend).map_err(|error| ClassifierError::Model { reason: error.to_string() })?;
        Ok(Self { session, planes: vec![0.0; SAMPLES * CHANNELS] })
    }

    /// What the crop shows. The same crop gives the same bits.
    ///
    /// # Errors
    /// [`ClassifierError::Run`] where the network stopped, [`ClassifierError::Answer`] where it gave no probabilities.
    pub fn classify(&mut self, crop: &Crop) -> Result<ClassScores, ClassifierError> {
        for (sample, rgb) in crop.rgb.chunks_exact(CHANNELS).enumerate().take(SAMPLES) {
            for (channel, value) in rgb.iter().enumerate() {
                self.planes[channel * SAMPLES + sample] = f32::from(*value);
            }
        }
        let run = |error: ort::Error| ClassifierError::Run { reason: error.to_string() };
        let shape = [1, CHANNELS, CROP_PX, CROP_PX];
        let input = TensorRef::from_array_view((shape, self.planes.as_slice())).map_err(run)?;
        let outputs = self.session.run(ort::inputs![input]).map_err(run)?;
        let (_, answer) = outputs[0].try_extract_tensor::<f32>().map_err(run)?;
        scores(answer)
    }
}

fn scores(answer: &[f32]) -> Result<ClassScores, ClassifierError> {
    /// Single precision adds four probabilities up to 1 within this.
    const TOLERANCE: f64 = 1e-4;
    let refused = || ClassifierError::Answer { found: answer.iter().map(f32::to_string).collect() };
    let four: [f32; 4] = answer.try_into().map_err(|_| refused())?;
    let four = four.map(f64::from);
    let sum: f64 = four.iter().sum();
    let are_probabilities = four.iter().all(|score| *score >= 0.0) && (sum - 1.0).abs() <= TOLERANCE;
    if !are_probabilities {
        return Err(refused());
    }
    Ok(ClassScores(four.map(|score| score / sum)))
}

fn open(model: &[u8], environment: &Environment, backend: &Backend) -> Result<Session, ort::Error> {
    let builder = Session::builder(environment)?;
    let mut builder = builder.with_optimization_level(GraphOptimizationLevel::Level3)?;
    if *backend != Backend::Tract {
        // Workers are parallel already; and one thread adds up in one order.
        builder = builder.with_intra_threads(1)?.with_inter_threads(1)?;
    }
    builder.commit_from_memory(model)
}

/// The process's backend, set up by the first who asks.
fn environment(backend: &Backend) -> Result<&'static Environment, ClassifierError> {
    static CHOSEN: OnceLock<(Backend, Result<Environment, String>)> = OnceLock::new();
    let (chosen, loaded) = CHOSEN.get_or_init(|| (backend.clone(), load(backend)));
    if chosen != backend {
        return Err(ClassifierError::Switch { chosen: chosen.clone(), asked: backend.clone() });
    }
    loaded.as_ref().map_err(|reason| ClassifierError::Load { backend: backend.clone(), reason: reason.clone() })
}

fn load(backend: &Backend) -> Result<Environment, String> {
    let builder = match backend {
        Backend::Tract => {
            if !ort::set_api(ort_tract::api()) {
                return Err("another backend was set up outside of this crate".to_owned());
            }
            ort::init()
        }
        Backend::OnnxRuntime(path) => ort::init_from(path).map_err(|error| error.to_string())?,
    };
    builder.build().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_named_library_goes_before_the_environments() {
        let (named, other) = (Path::new("/a.so"), PathBuf::from("/b.so"));
        assert_eq!(Backend::choose(Some(named), Some(other.clone())), Backend::OnnxRuntime(named.to_owned()));
        assert_eq!(Backend::choose(None, Some(other.clone())), Backend::OnnxRuntime(other));
        assert_eq!(Backend::choose(None, Some(PathBuf::new())), Backend::Tract);
    }

    #[test]
    fn a_process_keeps_its_backend() {
        assert!(Classifier::shipped(&Backend::Tract).is_ok());
        let asked = Backend::OnnxRuntime("/nowhere/libonnxruntime.so".into());
        let error = Classifier::shipped(&asked).unwrap_err();
        assert_eq!(error, ClassifierError::Switch { chosen: Backend::Tract, asked });
    }

    #[test]
    fn bytes_that_are_no_network_are_refused() {
        let error = Classifier::new(b"no network", &Backend::Tract).unwrap_err();
        assert!(matches!(error, ClassifierError::Model { .. }), "{error}");
    }

    #[test]
    fn only_probabilities_are_taken_for_an_answer() {
        assert!(scores(&[0.25, 0.25, 0.25, 0.25]).is_ok());
        for wrong in [&[0.5, 0.5, 0.5, 0.5][..], &[f32::NAN, 0.0, 0.0, 1.0], &[-0.5, 0.5, 0.5, 0.5], &[1.0]] {
            assert!(scores(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn the_same_crop_gives_the_same_bits() {
        let mut crop = Crop::default();
        for (place, value) in crop.rgb.iter_mut().enumerate() {
            *value = (place * 37 % 251) as u8;
        }
        let bits = |classifier: &mut Classifier| classifier.classify(&crop).unwrap().0.map(f64::to_bits);
        let mut first = Classifier::shipped(&Backend::Tract).unwrap();
        let mut second = Classifier::shipped(&Backend::Tract).unwrap();
        let expected = bits(&mut first);
        assert_eq!(bits(&mut first), expected);
        assert_eq!(bits(&mut second), expected);
    }
}
