//! Modes of the sensors that a caller asks for instead of the modes of the file.

use closecall_sensors::SensorMode;
use closecall_traffic::Check;

use super::inert_fault::refuse_absent;
use super::{ScenarioError, ScenarioFile};

impl ScenarioFile {
    /// Refuses a mode of the sensors, given instead of the file's, in which a fault or a perception
    /// program of the file could not act: the runs would pass for runs with it.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] with the fault or the program.
    pub fn check_faults_in(&self, mode: SensorMode) -> Result<(), ScenarioError> {
        let parameters = self.space().nominal();
        let at = format!(" (with the mode `{}`, which is given instead of the file's)", mode.name());
        let checked = self.config().sensors.check(&parameters).map_err(|error| error.within("sensors"));
        checked
            .and_then(|sensors| {
                let sensors = sensors.with_mode(mode);
                sensors.check_program_in_mode().map_err(|error| error.within("sensors"))?;
                refuse_absent(&self.config().fault, &sensors)
            })
            .map_err(|error| self.located(error, at))
    }
}
