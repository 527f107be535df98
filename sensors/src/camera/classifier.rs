//! The neural network that classifies a crop, run through the API of ONNX Runtime.
//!
//! Two backends implement this API: tract, written in Rust and linked into this binary, and
//! Microsoft's ONNX Runtime, loaded from a shared library if one is named. A process keeps one
//! backend for its whole life, so the first classifier decides which. A session runs one crop at a
//! time, so each worker thread has its own.
//!
//! The network takes pixel values from 0 to 255 and returns probabilities: scaling, calibration (by
//! a temperature) and softmax are part of the graph. `xtask/training/train.py` trained and exported
//! it, and `models/MODEL_CARD.md` reports its accuracy.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use closecall_traffic::{ClassScores, input};
use ort::environment::Environment;
use ort::session::Session;
use ort::session::builder::GraphOptimizationLevel;
use ort::value::TensorRef;

use super::image::{CHANNELS, CROP_PX, Crop};
use super::vector_registers::clear_upper_parts;

/// The ONNX file of the network that ships with Closecall.
pub static SHIPPED_MODEL: &[u8] = include_bytes!("../../models/rear-classifier.onnx");

/// Number of samples in a crop.
const SAMPLES: usize = CROP_PX * CROP_PX;

/// The inference backend that runs the network.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// tract, which is pure Rust and needs no installation.
    #[default]
    Tract,
    /// ONNX Runtime, version 1.24 or later, loaded from this shared library.
    OnnxRuntime(PathBuf),
}

impl Backend {
    /// Selects ONNX Runtime from the shared library `named` by the user, or else from the library
    /// in `environment` (the value of `ORT_DYLIB_PATH`), or else selects tract.
    pub fn choose(named: Option<&Path>, environment: Option<PathBuf>) -> Self {
        match named.map(Path::to_owned).or(environment).filter(|path| !path.as_os_str().is_empty()) {
            Some(path) => Self::OnnxRuntime(path),
            None => Self::Tract,
        }
    }
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tract => f.write_str("tract"),
            Self::OnnxRuntime(path) => write!(f, "ONNX Runtime ({})", path.display()),
        }
    }
}

/// The reason why a classifier cannot be set up or run.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClassifierError {
    /// The shared library does not exist, or is not an ONNX Runtime of a suitable version.
    #[error("failed to load the inference backend {backend}: {reason}")]
    Load {
        /// The requested backend.
        backend: Backend,
        /// The reason that the library gives.
        reason: String,
    },
    /// The process already uses another backend.
    #[error("failed to switch to the inference backend {asked}: this process has {chosen}")]
    Switch {
        /// The backend that the process uses.
        chosen: Backend,
        /// The requested backend.
        asked: Backend,
    },
    /// The file of a network, or of the inference backend, cannot be read.
    #[error("failed to read {path}: {reason}")]
    Read {
        /// The file.
        path: String,
        /// The reason that the system gives.
        reason: String,
    },
    /// The bytes of the model are not a network that the backend can run.
    #[error("failed to read the classifier's network: {reason}")]
    Model {
        /// The reason that the library gives.
        reason: String,
    },
    /// The network needs ONNX Runtime, and this process has none.
    #[error(
        "failed to load the Mask R-CNN: it needs ONNX Runtime, because tract has no RoiAlign; `pip install onnxruntime` installs it"
    )]
    NeedsOnnxRuntime,
    /// The network has other inputs or outputs.
    #[error("failed to use the network: it has {actual}; wanted are {wanted}")]
    Layout {
        /// The actual layout.
        actual: String,
        /// The required layout.
        wanted: &'static str,
    },
    /// The network failed during inference. The session must not be used again.
    #[error("failed to run the classifier's network: {reason}")]
    Run {
        /// The reason that the library gives.
        reason: String,
    },
    /// The output of the network is not four probabilities.
    #[error("failed to read the answer of {model}: {actual:?} in its tensor `{tensor}` are not four probabilities")]
    Answer {
        /// The name of the network, or the path of its file.
        model: String,
        /// The name of the output.
        tensor: String,
        /// The values that the network returned.
        actual: Vec<String>,
    },
    /// The network returned a value that its output cannot have.
    #[error("failed to read the answer of {model}: its tensor `{tensor}` has {value}, but {allowed} are needed")]
    Value {
        /// The name of the network, or the path of its file.
        model: String,
        /// The name of the output.
        tensor: String,
        /// The value, and where it is.
        value: String,
        /// What the values must be.
        allowed: &'static str,
    },
}

/// Name of the file of [`SHIPPED_MODEL`].
const SHIPPED_FILE: &str = "rear-classifier.onnx";

/// The network, loaded into one inference session.
#[derive(Debug)]
pub struct Classifier {
    session: Session,
    planes: Vec<f32>,
    /// The name of the network, or the path of its file.
    name: String,
}

impl Classifier {
    /// Loads the network that ships with Closecall on this backend.
    ///
    /// # Errors
    /// Returns a [`ClassifierError`] if the backend cannot be loaded, or if the process uses
    /// another backend.
    pub fn shipped(backend: &Backend) -> Result<Self, ClassifierError> {
        Self::new(SHIPPED_MODEL, backend)
    }

    /// Loads a network from the bytes of an ONNX file. Its input and output must have the form that
    /// [`SHIPPED_MODEL`] has.
    ///
    /// # Errors
    /// Returns a [`ClassifierError`] if the backend cannot be loaded, if the process uses another
    /// backend, or if `model` cannot be read.
    pub fn new(model: &[u8], backend: &Backend) -> Result<Self, ClassifierError> {
        let environment = environment(backend)?;
        let session = open_session(model, environment, backend)
            .map_err(|error| ClassifierError::Model { reason: error.to_string() })?;
        Ok(Self { session, planes: vec![0.0; SAMPLES * CHANNELS], name: SHIPPED_FILE.to_owned() })
    }

    /// Loads the network of a file, or the one that ships with Closecall, and evaluates a black
    /// crop.
    ///
    /// # Errors
    /// Returns a [`ClassifierError`] with the path if the file cannot be read, or if its network
    /// has another input, or another output than four probabilities.
    pub fn of(file: Option<&str>, backend: &Backend) -> Result<Self, ClassifierError> {
        let Some(path) = file else { return Self::shipped(backend) };
        let at = |reason: String| {
            let needed = format!("it must take float [1, {CHANNELS}, {CROP_PX}, {CROP_PX}] and answer float [1, 4]");
            ClassifierError::Model { reason: format!("{path}: {reason}; {needed}") }
        };
        let bytes = read_network(path)?;
        let classifier = Self::new(&bytes, backend).map_err(|error| match error {
            ClassifierError::Model { reason } => at(reason),
            other => other,
        })?;
        let mut classifier = Self { name: path.to_owned(), ..classifier };
        classifier.classify(&Crop::default()).map_err(|error| match error {
            ClassifierError::Run { reason } => at(reason),
            other => other,
        })?;
        Ok(classifier)
    }

    /// Returns the class scores of a crop. The same crop always gives the same bits.
    ///
    /// # Errors
    /// Returns [`ClassifierError::Run`] if inference fails, and [`ClassifierError::Answer`] if the
    /// output is not four probabilities.
    pub fn classify(&mut self, crop: &Crop) -> Result<ClassScores, ClassifierError> {
        for (channel, plane) in self.planes.chunks_exact_mut(SAMPLES).enumerate() {
            let values = crop.rgb[channel..].iter().step_by(CHANNELS);
            plane.iter_mut().zip(values).for_each(|(to, value)| *to = f32::from(*value));
        }
        let run = |error: ort::Error| ClassifierError::Run { reason: error.to_string() };
        let shape = [1, CHANNELS, CROP_PX, CROP_PX];
        let input = TensorRef::from_array_view((shape, self.planes.as_slice())).map_err(run)?;
        let outputs = self.session.run(ort::inputs![input]);
        clear_upper_parts();
        let outputs = outputs.map_err(run)?;
        let (_, output) = outputs[0].try_extract_tensor::<f32>().map_err(run)?;
        let invalid = |actual| {
            let (model, tensor) = (self.name.clone(), outputs.keys().next().unwrap_or("").to_owned());
            ClassifierError::Answer { model, tensor, actual }
        };
        scores_from(output).map_err(invalid)
    }
}

/// Returns the class scores of an output, or its values if they are not four probabilities.
fn scores_from(output: &[f32]) -> Result<ClassScores, Vec<String>> {
    /// Four probabilities in single precision sum to 1 within this tolerance.
    const TOLERANCE: f64 = 1e-4;
    /// Number of values that a message shows.
    const SHOWN: usize = 8;
    let invalid_output = || {
        let shown = output.iter().take(SHOWN).map(f32::to_string);
        let rest = (output.len() > SHOWN).then(|| format!("… {} values", output.len()));
        shown.chain(rest).collect::<Vec<_>>()
    };
    let probabilities: [f32; 4] = output.try_into().map_err(|_| invalid_output())?;
    let probabilities = probabilities.map(f64::from);
    let sum: f64 = probabilities.iter().sum();
    let are_probabilities = probabilities.iter().all(|score| *score >= 0.0) && (sum - 1.0).abs() <= TOLERANCE;
    if !are_probabilities {
        return Err(invalid_output());
    }
    Ok(ClassScores(probabilities.map(|score| score / sum)))
}

pub(super) fn open_session(model: &[u8], environment: &Environment, backend: &Backend) -> Result<Session, ort::Error> {
    let builder = Session::builder(environment)?;
    let mut builder = builder.with_optimization_level(GraphOptimizationLevel::Level3)?;
    if *backend != Backend::Tract {
        // The workers already run in parallel, and a single thread always sums in the same order.
        builder = builder.with_intra_threads(1)?.with_inter_threads(1)?;
    }
    builder.commit_from_memory(model)
}

/// Returns the environment of the process's backend, which the first call sets up.
pub(super) fn environment(backend: &Backend) -> Result<&'static Environment, ClassifierError> {
    static CHOSEN: OnceLock<(Backend, Result<Environment, String>)> = OnceLock::new();
    let (chosen, loaded) = CHOSEN.get_or_init(|| (backend.clone(), load_backend(backend)));
    if chosen != backend {
        return Err(ClassifierError::Switch { chosen: chosen.clone(), asked: backend.clone() });
    }
    loaded.as_ref().map_err(|reason| ClassifierError::Load { backend: backend.clone(), reason: reason.clone() })
}

/// Largest file of a network (bytes): a limit of this program.
const MOST_NETWORK_BYTES: u64 = 2 << 30;

/// Reads the file of a network.
///
/// # Errors
/// [`ClassifierError::Read`], or [`ClassifierError::Model`] if the file is too large.
pub(super) fn read_network(path: &str) -> Result<Vec<u8>, ClassifierError> {
    input::read(Path::new(path), MOST_NETWORK_BYTES).map_err(|error| match input::is_of_content(&error) {
        true => ClassifierError::Model { reason: format!("{path}: {error}") },
        false => ClassifierError::Read { path: path.to_owned(), reason: error.to_string() },
    })
}

fn load_backend(backend: &Backend) -> Result<Environment, String> {
    let builder = match backend {
        Backend::Tract => {
            if !ort::set_api(ort_tract::api()) {
                return Err("another backend was set up outside of this crate".to_owned());
            }
            ort::init()
        }
        Backend::OnnxRuntime(path) => {
            // Opened before it is loaded: the loader waits for a named pipe.
            input::open(path).map_err(|error| error.to_string())?;
            ort::init_from(path).map_err(|error| error.to_string())?
        }
    };
    builder.build().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_named_library_takes_precedence_over_the_environment_variable() {
        let (named, other) = (Path::new("/a.so"), PathBuf::from("/b.so"));
        assert_eq!(Backend::choose(Some(named), Some(other.clone())), Backend::OnnxRuntime(named.to_owned()));
        assert_eq!(Backend::choose(None, Some(other.clone())), Backend::OnnxRuntime(other));
        assert_eq!(Backend::choose(None, Some(PathBuf::new())), Backend::Tract);
    }

    #[test]
    fn a_process_keeps_its_first_backend() {
        assert!(Classifier::shipped(&Backend::Tract).is_ok());
        let asked = Backend::OnnxRuntime("/nowhere/libonnxruntime.so".into());
        let error = Classifier::shipped(&asked).unwrap_err();
        let said = "backend ONNX Runtime (/nowhere/libonnxruntime.so): this process has tract";
        assert!(error.to_string().ends_with(said), "{error}");
        assert_eq!(error, ClassifierError::Switch { chosen: Backend::Tract, asked });
    }

    #[test]
    fn bytes_that_are_not_a_network_are_rejected() {
        let error = Classifier::new(b"no network", &Backend::Tract).unwrap_err();
        assert!(matches!(error, ClassifierError::Model { .. }), "{error}");
    }

    #[test]
    fn a_network_of_a_file_is_tried_and_a_wrong_file_is_named() {
        let folder = std::env::temp_dir().join(format!("closecall-classifier-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        let (good, bad) = (path("good.onnx"), path("bad.onnx"));
        std::fs::write(&good, SHIPPED_MODEL).unwrap();
        std::fs::write(&bad, &SHIPPED_MODEL[..SHIPPED_MODEL.len() / 2]).unwrap();
        let crop = Crop::default();
        let mut own = Classifier::of(Some(&good), &Backend::Tract).unwrap();
        let mut shipped = Classifier::of(None, &Backend::Tract).unwrap();
        assert_eq!(own.classify(&crop).unwrap(), shipped.classify(&crop).unwrap());
        assert_eq!((own.name, shipped.name), (good, SHIPPED_FILE.to_owned()));
        let error = Classifier::of(Some(&bad), &Backend::Tract).unwrap_err();
        assert!(matches!(&error, ClassifierError::Model { reason } if reason.starts_with(&bad)), "{error}");
        let none = path("none.onnx");
        let error = Classifier::of(Some(&none), &Backend::Tract).unwrap_err();
        assert!(matches!(&error, ClassifierError::Read { path, .. } if *path == none), "{error}");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn an_output_that_is_not_four_probabilities_is_rejected() {
        assert!(scores_from(&[0.25, 0.25, 0.25, 0.25]).is_ok());
        for wrong in [&[0.5, 0.5, 0.5, 0.5][..], &[f32::NAN, 0.0, 0.0, 1.0], &[-0.5, 0.5, 0.5, 0.5], &[1.0]] {
            assert!(scores_from(wrong).is_err(), "{wrong:?}");
        }
        let shown = scores_from(&[0.0; 4_000]).unwrap_err();
        assert_eq!((shown.len(), &shown[8][..]), (9, "… 4000 values"), "a message shows a few");
    }

    #[test]
    fn the_same_crop_gives_the_same_bits() {
        let mut crop = Crop::default();
        for (index, value) in crop.rgb.iter_mut().enumerate() {
            *value = (index * 37 % 251) as u8;
        }
        let bits = |classifier: &mut Classifier| classifier.classify(&crop).unwrap().0.map(f64::to_bits);
        let mut first = Classifier::shipped(&Backend::Tract).unwrap();
        let mut second = Classifier::shipped(&Backend::Tract).unwrap();
        let expected = bits(&mut first);
        assert_eq!(bits(&mut first), expected);
        assert_eq!(bits(&mut second), expected);
    }
}
