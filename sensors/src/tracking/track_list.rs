//! The reported tracks of all sensors.

use closecall_traffic::{Track, TrackId};

/// The reported tracks of all sensors of the ego, and the next free track id.
#[derive(Clone, Debug, Default)]
pub struct TrackList {
    /// The tracks of the latest step.
    pub tracks: Vec<Track>,
    next_id: u32,
}

impl TrackList {
    /// Creates a list with memory for so many tracks. More need more memory.
    pub fn with_capacity(tracks: usize) -> Self {
        Self { tracks: Vec::with_capacity(tracks), next_id: 0 }
    }

    /// Returns an id that no track of this run has had.
    #[inline]
    pub fn new_id(&mut self) -> TrackId {
        let id = TrackId(self.next_id);
        self.next_id += 1;
        id
    }
}
