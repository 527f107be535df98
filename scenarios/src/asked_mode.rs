//! Modes of the sensors that a caller asks for instead of the modes of the file.

use closecall_sensors::SensorMode;
use closecall_traffic::Check;

use super::inert_fault::refuse_absent;
use super::{ScenarioError, ScenarioFile};

impl ScenarioFile {
    /// Refuses a mode of the sensors, given instead of the file's, in which a fault of the file could not act: the runs would pass
    /// for runs with the fault.
    ///
    /// # Errors
    /// [`ScenarioError::Value`] with the fault.
    pub fn check_faults_in(&self, mode: SensorMode) -> Result<(), ScenarioError> {
        let parameters = self.space().nominal();
        let at = format!(" (with the mode `{}`, which is given instead of the file's)", mode.name());
        let checked = self.config().sensors.check(&parameters).map_err(|error| error.within("sensors"));
        checked
            .and_then(|sensors| refuse_absent(&self.config().fault, &sensors.with_mode(mode)))
            .map_err(|error| self.located(error, at))
    }
}
