//! Containers and views of a layout.
//!
//! The identifier of a node is its place in the layout, so the same films give the same layout.

use closecall_traffic::Time;
use rerun::blueprint::components::{ColumnShare, ContainerKind, PanelState, PlayState, RowShare, TimelineName};
use rerun::datatypes::Uuid;
use rerun::{AsComponents, EntityPath, TimeColumn};

use super::super::RecordingError;
use super::super::parts::{
    ContainerBlueprint, PanelBlueprint, TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint,
};
use super::super::recording::Recording;

/// The timeline on which the viewer reads a layout.
pub(in crate::run::rerun) const BLUEPRINT_TIMELINE: &str = "blueprint";

/// A view of a layout.
pub(super) struct View {
    class: &'static str,
    title: String,
    origin: String,
    contents: Vec<String>,
    /// Properties of the view, each with its path below the path of the view.
    properties: Vec<(String, Box<dyn AsComponents>)>,
}

impl View {
    pub(super) fn new(class: &'static str, title: impl Into<String>, origin: impl Into<String>) -> Self {
        let contents = vec!["$origin/**".to_owned()];
        Self { class, title: title.into(), origin: origin.into(), contents, properties: Vec::new() }
    }

    /// Sets the entities that the view shows.
    pub(super) fn with_contents(mut self, contents: impl IntoIterator<Item = String>) -> Self {
        self.contents = contents.into_iter().collect();
        self
    }

    /// Adds a property.
    pub(super) fn with(mut self, name: impl Into<String>, property: impl AsComponents + 'static) -> Self {
        self.properties.push((name.into(), Box::new(property)));
        self
    }
}

/// A node of a layout.
pub(super) enum Node {
    View(View),
    /// Nodes beside, below or behind each other, each with its share of the room.
    Container(ContainerKind, Vec<(f32, Node)>),
    /// A container with the name that its tab has.
    Named(&'static str, Box<Node>),
}

impl From<View> for Node {
    fn from(view: View) -> Self {
        Self::View(view)
    }
}

/// Returns a node that has a name as a tab. A view has a title of its own.
pub(super) fn named(name: &'static str, node: Node) -> Node {
    match node {
        Node::View(_) => node,
        container => Node::Named(name, Box::new(container)),
    }
}

/// Returns the nodes beside each other.
pub(super) fn beside(nodes: Vec<(f32, Node)>) -> Option<Node> {
    container(ContainerKind::Horizontal, nodes)
}

/// Returns the nodes below each other.
pub(super) fn below(nodes: Vec<(f32, Node)>) -> Option<Node> {
    container(ContainerKind::Vertical, nodes)
}

/// Returns the nodes as tabs. The first is open.
pub(super) fn tabs(nodes: Vec<Node>) -> Option<Node> {
    container(ContainerKind::Tabs, nodes.into_iter().map(|node| (1.0, node)).collect())
}

/// Returns a container. A single node needs none.
fn container(kind: ContainerKind, mut nodes: Vec<(f32, Node)>) -> Option<Node> {
    match nodes.len() {
        0 => None,
        1 => nodes.pop().map(|(_, node)| node),
        _ => Some(Node::Container(kind, nodes)),
    }
}

/// Writes a layout that opens on `timeline`.
pub(super) fn write(recording: &Recording, root: Node, timeline: &str) -> Result<(), RecordingError> {
    let mut writer = NodeWriter { recording, count: 0 };
    // The root of a layout must be a container.
    let root = match root {
        Node::View(view) => Node::Container(ContainerKind::Tabs, vec![(1.0, view.into())]),
        container @ (Node::Container(..) | Node::Named(..)) => container,
    };
    let root = writer.write(root)?;
    let viewport = ViewportBlueprint::new().with_root_container(uuid(root)).with_auto_layout(false);
    writer.push("viewport", &viewport.with_auto_views(false))?;
    for panel in ["blueprint_panel", "selection_panel"] {
        writer.push(panel, &PanelBlueprint::new().with_state(PanelState::Collapsed))?;
    }
    let time = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName(timeline.into()))
        .with_play_state(PlayState::Paused);
    writer.push("time_panel", &time)?;
    recording.activate_layout()
}

struct NodeWriter<'a> {
    recording: &'a Recording,
    count: u64,
}

impl NodeWriter<'_> {
    /// Writes a node and the nodes below it, and returns its number.
    fn write(&mut self, node: Node) -> Result<u64, RecordingError> {
        self.count += 1;
        let number = self.count;
        match node {
            Node::View(view) => self.write_view(number, view)?,
            Node::Container(kind, nodes) => self.write_container(number, kind, None, nodes)?,
            Node::Named(name, node) => match *node {
                Node::Container(kind, nodes) => self.write_container(number, kind, Some(name), nodes)?,
                // Only containers are named.
                other => return self.write(other),
            },
        }
        Ok(number)
    }

    fn write_view(&self, number: u64, view: View) -> Result<(), RecordingError> {
        let path = view_path(number);
        self.push(&format!("{path}/ViewContents"), &ViewContents::new(view.contents))?;
        let blueprint = ViewBlueprint::new(view.class).with_display_name(view.title).with_space_origin(view.origin);
        self.push(&path, &blueprint)?;
        for (name, property) in view.properties {
            self.push(&format!("{path}/{name}"), property.as_ref())?;
        }
        Ok(())
    }

    fn write_container(
        &mut self,
        number: u64,
        kind: ContainerKind,
        name: Option<&str>,
        nodes: Vec<(f32, Node)>,
    ) -> Result<(), RecordingError> {
        let shares: Vec<f32> = nodes.iter().map(|(share, _)| *share).collect();
        let mut paths = Vec::new();
        for (_, node) in nodes {
            let is_view = matches!(node, Node::View(_));
            let number = self.write(node)?;
            paths.push(if is_view { view_path(number) } else { container_path(number) });
        }
        let first = paths.first().cloned().unwrap_or_default();
        let blueprint = ContainerBlueprint::new(kind).with_contents(paths);
        let blueprint = match name {
            Some(name) => blueprint.with_display_name(name),
            None => blueprint,
        };
        let blueprint = match kind {
            ContainerKind::Horizontal => blueprint.with_col_shares(shares.into_iter().map(ColumnShare::from)),
            ContainerKind::Vertical => blueprint.with_row_shares(shares.into_iter().map(RowShare::from)),
            ContainerKind::Tabs | ContainerKind::Grid => blueprint.with_active_tab(first),
        };
        self.push(&container_path(number), &blueprint)
    }

    fn push(&self, path: &str, node: &dyn AsComponents) -> Result<(), RecordingError> {
        let time = TimeColumn::new_sequence(BLUEPRINT_TIMELINE, [Time::ZERO.ns()]);
        self.recording.send_layout(EntityPath::from(path), time, node)
    }
}

/// Returns the identifier of the node of this number.
fn uuid(number: u64) -> Uuid {
    let mut bytes = [0; 16];
    bytes[8..].copy_from_slice(&number.to_be_bytes());
    Uuid { bytes }
}

fn view_path(number: u64) -> String {
    format!("view/{}", hyphenated(number))
}

fn container_path(number: u64) -> String {
    format!("container/{}", hyphenated(number))
}

/// Returns the identifier of the node of this number as text.
fn hyphenated(number: u64) -> String {
    format!("00000000-0000-0000-{:04x}-{:012x}", number >> 48, number & 0xffff_ffff_ffff)
}
