//! The elements of a file as serialisable values.

use std::collections::BTreeMap;

use serde::Serialize;

/// The first and the last frame of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(super) struct FrameInterval {
    pub(super) frame_start: i64,
    pub(super) frame_end: i64,
}

/// A value with a name: a number, a text or a flag.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Named<T> {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    kind: Option<&'static str>,
    val: T,
    #[serde(skip_serializing_if = "Option::is_none")]
    attributes: Option<Data>,
}

impl<T> Named<T> {
    pub(super) fn new(name: impl Into<String>, val: T) -> Self {
        Self { name: Some(name.into()), kind: None, val, attributes: None }
    }

    /// Returns the value of a tag, which has a kind in place of a name.
    pub(super) fn of_tag(kind: &'static str, val: T) -> Self {
        Self { name: None, kind: Some(kind), val, attributes: None }
    }

    pub(super) fn with(self, attributes: Data) -> Self {
        Self { attributes: Some(attributes), ..self }
    }
}

/// The values of an element that does not change from frame to frame.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Data {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) num: Vec<Named<f64>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) text: Vec<Named<String>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) boolean: Vec<Named<bool>>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(super) vec: Vec<Named<Values>>,
}

/// A list of numbers or of texts.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Values {
    Numbers(Vec<f64>),
    Texts(Vec<&'static str>),
}

/// Where the values of a name stand.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Pointer {
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) frame_intervals: Vec<FrameInterval>,
}

/// A vehicle.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Object {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) ontology_uid: &'static str,
    pub(super) frame_intervals: [FrameInterval; 1],
    pub(super) object_data: Data,
    pub(super) object_data_pointers: BTreeMap<&'static str, Pointer>,
}

/// A lane change.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Action {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) ontology_uid: &'static str,
    pub(super) frame_intervals: [FrameInterval; 1],
    pub(super) action_data: Data,
}

/// A lane.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Context {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ontology_uid: Option<&'static str>,
    pub(super) context_data: Data,
}

/// A statement on the whole file.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Tag {
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) ontology_uid: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) tag_data: Option<Data>,
}

/// The number of an element, and its kind.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Agent {
    pub(super) uid: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
}

/// The relation of a vehicle and a lane change.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Relation {
    pub(super) name: String,
    #[serde(rename = "type")]
    pub(super) kind: &'static str,
    pub(super) rdf_subjects: [Agent; 1],
    pub(super) rdf_objects: [Agent; 1],
}
