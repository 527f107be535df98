//! An FMU that this process has loaded, and its runs.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

use closecall_traffic::{CONTROL_STEP, maths};
use libloading::Library as Module;

use super::archive::{Unpacked, unpack};
use super::description::{Type, Version};
use super::mapping::{Get, Mapping, Set, VariableTable};
use super::{fmi2, fmi3};
use crate::external::arithmetic::Arithmetic;
use crate::external::error::LoadError;
use crate::external::exchange::{Answer, Input, Setup};
use crate::external::identity::{Identity, Run};
use crate::external::library::open;
use crate::external::platform;

/// An instance of an FMU, of either version. The messages name the function and quote the FMU.
pub(super) trait Instance: Send {
    /// Goes to the initialisation at a time (s).
    fn enter(&mut self, start_s: f64) -> Result<(), String>;
    /// Ends the initialisation.
    fn exit(&mut self) -> Result<(), String>;
    /// Sets a variable.
    fn set(&mut self, reference: u32, of_type: Type, value: f64) -> Result<(), String>;
    /// Returns a variable.
    fn get(&mut self, reference: u32, of_type: Type) -> Result<f64, String>;
    /// Goes from a time (s) a step (s) further.
    fn do_step(&mut self, time_s: f64, step_s: f64) -> Result<(), String>;
    /// Ends the simulation. Only [`Self::reset`] may follow.
    fn terminate(&mut self) -> Result<(), String>;
    /// Returns to the state after its creation.
    fn reset(&mut self) -> Result<(), String>;
}

/// An instance after whose calls the floating-point environment is restored. It is `None` while it
/// is dropped.
struct Restoring<I: Instance>(Option<I>);

impl<I: Instance> Restoring<I> {
    const fn new(instance: I) -> Self {
        Self(Some(instance))
    }

    fn call<T>(&mut self, call: impl FnOnce(&mut I) -> Result<T, String>) -> Result<T, String> {
        let _kept = Arithmetic::keep();
        self.0.as_mut().map_or_else(|| Err("the instance has ended".to_owned()), call)
    }
}

impl<I: Instance> Drop for Restoring<I> {
    fn drop(&mut self) {
        let _kept = Arithmetic::keep();
        drop(self.0.take());
    }
}

impl<I: Instance> Instance for Restoring<I> {
    fn enter(&mut self, start_s: f64) -> Result<(), String> {
        self.call(|instance| instance.enter(start_s))
    }

    fn exit(&mut self) -> Result<(), String> {
        self.call(Instance::exit)
    }

    fn set(&mut self, reference: u32, of_type: Type, value: f64) -> Result<(), String> {
        self.call(|instance| instance.set(reference, of_type, value))
    }

    fn get(&mut self, reference: u32, of_type: Type) -> Result<f64, String> {
        self.call(|instance| instance.get(reference, of_type))
    }

    fn do_step(&mut self, time_s: f64, step_s: f64) -> Result<(), String> {
        self.call(|instance| instance.do_step(time_s, step_s))
    }

    fn terminate(&mut self) -> Result<(), String> {
        self.call(Instance::terminate)
    }

    fn reset(&mut self) -> Result<(), String> {
        self.call(Instance::reset)
    }
}

#[derive(Clone, Copy, Debug)]
enum Functions {
    Two(fmi2::Functions),
    Three(fmi3::Functions),
}

/// An FMU that this process has loaded.
pub(crate) struct Fmu {
    functions: Functions,
    unpacked: Unpacked,
    /// Number of steps of the FMU in a control step.
    steps: u32,
    /// The instance, between two runs, of an FMU that can have only one instance.
    kept: Mutex<Option<Box<dyn Instance>>>,
    _module: Module,
}

impl std::fmt::Debug for Fmu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Fmu").field("description", &self.unpacked.description).finish_non_exhaustive()
    }
}

impl Fmu {
    /// Loads an FMU.
    pub(crate) fn load(path: &Path) -> Result<Self, LoadError> {
        let unpacked = unpack(path)?;
        let refuse = |reason: String| LoadError::Fmu { path: path.display().to_string(), reason };
        let steps = steps(unpacked.description.fixed_step_s).map_err(refuse)?;
        let (needed, prefix): (&[&str], _) = match unpacked.description.version {
            Version::Fmi2 => (&fmi2::NEEDED, "fmi2"),
            Version::Fmi3 => (&fmi3::NEEDED, "fmi3"),
        };
        // The folder of the binary has another name in each process.
        let in_archive = |error: LoadError| {
            let (binary, name) = (unpacked.binary.display().to_string(), unpacked.binary_name());
            refuse(error.to_string().replace(&binary, &name))
        };
        platform::check(&unpacked.binary, needed, prefix).map_err(in_archive)?;
        let _kept = Arithmetic::keep();
        let module = open(&unpacked.binary).map_err(in_archive)?;
        let functions = match unpacked.description.version {
            Version::Fmi2 => fmi2::Functions::of(&module).map(Functions::Two),
            Version::Fmi3 => fmi3::Functions::of(&module).map(Functions::Three),
        };
        let functions = functions.ok_or_else(|| refuse("its binary lacks functions of the interface".to_owned()))?;
        Ok(Self { functions, unpacked, steps, kept: Mutex::new(None), _module: module })
    }

    /// Returns the name and the version of the model.
    pub(crate) fn identity(&self) -> Identity {
        let description = &self.unpacked.description;
        Identity { name: Some(description.model.clone()), version: description.model_version.clone() }
    }

    /// Checks that every variable has its counterpart.
    pub(crate) fn check(&self, table: &VariableTable, setup: &Setup) -> Result<(), String> {
        Mapping::new(&self.unpacked.description, table, setup).map(drop)
    }

    /// Creates a controller for one run.
    pub(crate) fn start(self: &Arc<Self>, setup: &Setup, table: &VariableTable) -> Result<FmuRun, String> {
        let mapping = Mapping::new(&self.unpacked.description, table, setup)?;
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner).take();
        let instance = match kept {
            Some(instance) => instance,
            None => self.instance()?,
        };
        Ok(FmuRun { fmu: self.clone(), instance: Some(instance), mapping, has_started: false, nearest: Vec::new() })
    }

    fn instance(&self) -> Result<Box<dyn Instance>, String> {
        let (description, resources) = (&self.unpacked.description, self.unpacked.resources());
        let _kept = Arithmetic::keep();
        Ok(match self.functions {
            Functions::Two(functions) => {
                Box::new(Restoring::new(fmi2::Instance2::new(functions, description, &resources)?))
            }
            Functions::Three(functions) => {
                Box::new(Restoring::new(fmi3::Instance3::new(functions, description, &resources)?))
            }
        })
    }
}

/// Largest deviation of a control step from a whole number of steps of an FMU (-): the rounding of
/// a description.
const STEP_TOLERANCE: f64 = 1e-9;

/// Returns the number of steps of an FMU in a control step. `fixed_s` is the step that it
/// prescribes (s), if it does.
fn steps(fixed_s: Option<f64>) -> Result<u32, String> {
    let Some(fixed_s) = fixed_s else { return Ok(1) };
    let control_s = CONTROL_STEP.s();
    let ratio = control_s / fixed_s;
    let whole = ratio.round();
    if !(whole >= 1.0 && whole <= f64::from(u32::MAX) && (ratio - whole).abs() <= STEP_TOLERANCE * whole) {
        return Err(format!(
            "it has a fixed step of {fixed_s} s, and a control step of {control_s} s is not a multiple of it; expected 0.04 s, or a \
             whole part of it, such as 0.02 s or 0.01 s"
        ));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked above")]
    Ok(whole as u32)
}

/// A controller of an FMU that drives one run.
pub(crate) struct FmuRun {
    fmu: Arc<Fmu>,
    /// `None` after the run.
    instance: Option<Box<dyn Instance>>,
    mapping: Mapping,
    has_started: bool,
    /// The indices of the tracks, the nearest first.
    nearest: Vec<usize>,
}

impl Run for FmuRun {
    fn step(&mut self, input: &Input) -> Result<Answer, String> {
        let Some(instance) = &mut self.instance else { return Err("the run has ended".to_owned()) };
        let tracks = input.tracks();
        self.nearest.clear();
        self.nearest.extend(0..tracks.len());
        let distance_m = |index: &usize| maths::hypot(tracks[*index].x_m, tracks[*index].y_m);
        self.nearest.sort_by(|a, b| distance_m(a).total_cmp(&distance_m(b)));
        let start_s = input.values().time_s;
        if !self.has_started {
            for set in &self.mapping.parameters {
                set.write_to(instance.as_mut(), set.quantity.value(input, &self.nearest))?;
            }
            instance.enter(start_s)?;
        }
        for set in &self.mapping.inputs {
            set.write_to(instance.as_mut(), set.quantity.value(input, &self.nearest))?;
        }
        if !self.has_started {
            instance.exit()?;
            self.has_started = true;
        }
        let step_s = CONTROL_STEP.s() / f64::from(self.fmu.steps);
        for step in 0..self.fmu.steps {
            instance.do_step(start_s + f64::from(step) * step_s, step_s)?;
        }
        let acceleration_mps2 = self.mapping.acceleration.read_from(instance.as_mut())?;
        let state = match &self.mapping.state {
            Some(get) => get.read_from(instance.as_mut())?,
            None => 0.0,
        };
        #[expect(clippy::cast_possible_truncation, reason = "a whole number; a cast saturates")]
        let answer = Answer::new(acceleration_mps2, state as i64);
        answer.map_err(|expected| format!("the FMU answered the state {state}: {expected}"))
    }

    fn finish(&mut self) -> Result<(), String> {
        match &mut self.instance {
            Some(instance) if self.has_started => instance.terminate(),
            _ => Ok(()),
        }
    }
}

impl Set {
    /// Sets the variable. The message of an error names it.
    fn write_to(&self, instance: &mut dyn Instance, value: f64) -> Result<(), String> {
        let set = instance.set(self.reference, self.of_type, value);
        set.map_err(|reason| format!("the variable `{}`: {reason}", self.name))
    }
}

impl Get {
    /// Reads the variable. The message of an error names it.
    fn read_from(&self, instance: &mut dyn Instance) -> Result<f64, String> {
        let value = instance.get(self.reference, self.of_type);
        value.map_err(|reason| format!("the variable `{}`: {reason}", self.name))
    }
}

impl Drop for FmuRun {
    fn drop(&mut self) {
        let Some(mut instance) = self.instance.take() else { return };
        if self.fmu.unpacked.description.is_only_once && instance.reset().is_ok() {
            *self.fmu.kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(instance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_control_step_is_a_whole_number_of_fixed_steps() {
        assert_eq!(steps(None), Ok(1));
        for (fixed_s, expected) in [(0.04, 1), (0.02, 2), (0.01, 4), (0.001, 40), (1e-3 / 3.0, 120)] {
            assert_eq!(steps(Some(fixed_s)), Ok(expected), "{fixed_s}");
        }
        for fixed_s in [0.1, 0.03, 0.05, 0.0, -0.01, f64::NAN, f64::INFINITY] {
            assert!(steps(Some(fixed_s)).unwrap_err().contains("fixed step"), "{fixed_s}");
        }
    }
}
