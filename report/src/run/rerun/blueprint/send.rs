//! Sending a layout, with the properties that the library's blueprint builder cannot express.

use rerun::blueprint::BlueprintActivation;
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::log::LogMsg;
use rerun::{RecordingStream, RecordingStreamBuilder, StoreId, StoreKind};

use super::super::write::{APPLICATION, RecordingError};
use super::{FilmContents, Layout};

impl Layout {
    /// Writes the layout for these films into a recording.
    pub(in super::super) fn send(
        mut self,
        stream: &RecordingStream,
        films: &[FilmContents],
    ) -> Result<(), RecordingError> {
        let blueprint = self.blueprint(films);
        let (carrier, messages) = RecordingStreamBuilder::new(APPLICATION).memory()?;
        blueprint.send(&carrier, BlueprintActivation::default())?;
        let mut messages: Vec<LogMsg> = messages.take();
        messages.retain(|message| message.store_id().kind() == StoreKind::Blueprint && !is_activation(message));
        let Some(id) = messages.first().map(|message| message.store_id().clone()) else {
            return Err(RecordingError::Disabled);
        };
        messages.extend(self.property_messages(&id)?);
        stream.send_blueprint(messages, BlueprintActivationCommand::make_active(id));
        Ok(())
    }

    /// Returns the properties as messages of the blueprint store `id`.
    fn property_messages(self, id: &StoreId) -> Result<Vec<LogMsg>, RecordingError> {
        let (stream, messages) = RecordingStreamBuilder::from_store_id(id).send_properties(false).memory()?;
        // The viewer reads a blueprint on its only timeline.
        stream.set_time_sequence("blueprint", 0);
        for (path, property) in self.properties {
            stream.log(path, property.as_ref())?;
        }
        let mut messages = messages.take();
        messages.retain(|message| matches!(message, LogMsg::ArrowMsg(..)));
        Ok(messages)
    }
}

fn is_activation(message: &LogMsg) -> bool {
    matches!(message, LogMsg::BlueprintActivationCommand(_))
}
