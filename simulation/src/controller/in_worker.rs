//! Controllers in the worker process that runs them.

use std::sync::Arc;

use super::hosted::in_worker;
use super::isolated::Isolated;
use crate::run::ControllerFactory;

impl Isolated {
    /// Returns the factory in a worker process.
    ///
    /// # Errors
    /// The reason for which this process cannot run the controller that was named: its file has
    /// changed, or it cannot be loaded here.
    pub fn in_this_process(self) -> Result<Arc<dyn ControllerFactory>, String> {
        match self {
            Self::Native(native) => {
                native.check_unchanged()?;
                Ok(Arc::new(native.in_this_process()))
            }
            Self::Hosted(hosted) => in_worker(hosted),
        }
    }
}
