//! A network from an ONNX file with one input and one output of 32-bit floats, for detectors
//! outside of this crate.

use ort::session::Session;
use ort::value::TensorRef;

use super::classifier::{Backend, ClassifierError, environment, open_session};
use super::vector_registers::clear_upper_parts;

/// A network, loaded into one inference session on the backend of this process.
#[derive(Debug)]
pub struct Network {
    session: Session,
    /// Name of its file in errors.
    name: &'static str,
}

impl Network {
    /// Loads a network from the bytes of the ONNX file `name`.
    ///
    /// # Errors
    /// [`ClassifierError`] if the backend cannot be loaded, if the process uses another backend, or
    /// if `model` cannot be read.
    pub fn new(name: &'static str, model: &[u8], backend: &Backend) -> Result<Self, ClassifierError> {
        let session = open_session(model, environment(backend)?, backend);
        let session = session.map_err(|error| ClassifierError::Model { reason: error.to_string() })?;
        Ok(Self { session, name })
    }

    /// Returns the output for `values` of the given shape, with its own shape. The same input
    /// always gives the same bits.
    ///
    /// # Errors
    /// [`ClassifierError::Run`] if inference fails, and [`ClassifierError::Value`] if a value is
    /// not finite.
    pub fn run(&mut self, shape: [usize; 4], values: &[f32]) -> Result<(Vec<usize>, Vec<f32>), ClassifierError> {
        let run = |error: ort::Error| ClassifierError::Run { reason: error.to_string() };
        let input = TensorRef::from_array_view((shape, values)).map_err(run)?;
        let outputs = self.session.run(ort::inputs![input]);
        clear_upper_parts();
        let outputs = outputs.map_err(run)?;
        let (shape, values) = outputs[0].try_extract_tensor::<f32>().map_err(run)?;
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(ClassifierError::Value {
                model: self.name.to_owned(),
                tensor: outputs.keys().next().unwrap_or("").to_owned(),
                value: format!("{} as value {index}", values[index]),
                allowed: "finite values",
            });
        }
        Ok((shape.iter().map(|side| usize::try_from(*side).unwrap_or(0)).collect(), values.to_vec()))
    }
}
