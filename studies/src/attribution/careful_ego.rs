//! The competent and careful driver of UN Regulation 157 as the ego, with the gap of the scenario.

use closecall_controllers::{EgoController, EgoSettings, R157Driver};
use closecall_simulation::ControllerFactory;

/// The competent and careful driver in the place of the ego: it starts where the ego starts, and
/// follows with its gap.
pub(super) struct CarefulEgo;

impl ControllerFactory for CarefulEgo {
    fn name(&self) -> &str {
        "r157-driver-in-place-of-ego"
    }

    fn settings(&self, settings: &EgoSettings) -> EgoSettings {
        R157Driver::settings(*settings).with_time_gap(settings.time_gap_s())
    }

    fn has_mis(&self, _: &EgoSettings) -> bool {
        false
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(R157Driver::new(self.settings(settings)))
    }
}
