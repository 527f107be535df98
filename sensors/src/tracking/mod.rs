//! From detections to tracks: association, filter, lifecycle.

pub(crate) mod lifecycle;
