//! The vehicles of a scenario, from the file itself or from a catalogue.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use closecall_traffic::{Dimensions, Range, input};

use super::dom::{ImportError, Node, parse};
use super::formula::no_parameter;
use super::reader::Reader;
use super::storyboard::NOTED_OFFSET_M;
use super::structure::{self, Given};
use super::world::Vehicle;

/// The entities of a scenario.
#[derive(Default)]
pub(super) struct Entities {
    pub(super) vehicles: Vec<Vehicle>,
    /// The vehicles that have a controller, with the lines on which it stands.
    pub(super) controlled: Vec<(String, usize)>,
    /// The parts of the catalogues that are left out.
    pub(super) notes: Vec<String>,
}

/// Reads all entities.
///
/// # Errors
/// [`ImportError`] at an entity that is not a vehicle, or that no catalogue contains.
pub(super) fn read(reader: &Reader, root: &Node) -> Result<Entities, ImportError> {
    let mut entities = Entities::default();
    let (mut catalogs, mut names) = (Catalogs::default(), BTreeMap::new());
    for entity in &reader.child(root, &["Entities"])?.children {
        if entity.name != "ScenarioObject" {
            return Err(reader.error(entity, "only `ScenarioObject` is read"));
        }
        let name = reader.text(entity, "name")?;
        if let Some(line) = names.insert(name.clone(), entity.line) {
            return Err(reader
                .error(entity, format!("line {line} has an entity `{name}` already: each needs a name of its own")));
        }
        let mut vehicle = None;
        for child in &entity.children {
            match child.name.as_str() {
                "Vehicle" => vehicle = Some(read_vehicle(reader, child, &mut entities.notes)?),
                "CatalogReference" => vehicle = Some(vehicle_in_catalog(reader, root, &mut catalogs, child)?),
                "ObjectController" => entities.controlled.push((name.clone(), child.line)),
                _ => {
                    return Err(reader.error(
                        child,
                        format!("`{name}` is not a vehicle: a scenario has cars, trucks and motorcycles"),
                    ));
                }
            }
        }
        let Some(vehicle) = vehicle else { return Err(reader.error(entity, format!("`{name}` has no vehicle"))) };
        entities.vehicles.push(Vehicle { name, line: entity.line, ..vehicle });
    }
    entities.notes.extend(catalogs.notes);
    Ok(entities)
}

/// The catalogues of a scenario, each read once.
#[derive(Default)]
struct Catalogs {
    /// The files of a folder, in alphabetical order.
    folders: BTreeMap<PathBuf, Vec<PathBuf>>,
    documents: BTreeMap<PathBuf, Node>,
    /// The parts of the entries that are left out.
    notes: Vec<String>,
}

impl Catalogs {
    /// Returns the files of a folder that may hold a catalogue.
    fn files(&mut self, folder: &Path) -> Vec<PathBuf> {
        let read = || {
            let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
                .map(|entries| entries.filter_map(|entry| Some(entry.ok()?.path())).collect())
                .unwrap_or_default();
            files.retain(|path| path.extension().is_some_and(|end| end == "xosc"));
            files.sort();
            files
        };
        self.folders.entry(folder.to_owned()).or_insert_with(read).clone()
    }

    /// Returns the document of a file. An error points at `directory`, the element of the scenario
    /// that names the folder of the file.
    fn document(&mut self, path: &Path, reader: &Reader, directory: &Node) -> Result<&Node, ImportError> {
        match self.documents.entry(path.to_owned()) {
            Entry::Occupied(document) => Ok(document.into_mut()),
            Entry::Vacant(place) => {
                let text = input::read_text(path)
                    .map_err(|error| reader.error(directory, format!("failed to read {}: {error}", path.display())))?;
                Ok(place.insert(parse(path, &text)?))
            }
        }
    }
}

/// Returns the vehicle that `reference` names in a catalogue.
fn vehicle_in_catalog(
    reader: &Reader,
    root: &Node,
    catalogs: &mut Catalogs,
    reference: &Node,
) -> Result<Vehicle, ImportError> {
    let [catalog, entry] = ["catalogName", "entryName"].map(|name| reader.text(reference, name));
    let (catalog, entry) = (catalog?, entry?);
    let Some(locations) = root.child("CatalogLocations") else {
        return Err(reader.error(reference, "the file has no `CatalogLocations`"));
    };
    let mut searched = Vec::new();
    for location in &locations.children {
        let Some(directory) = location.child("Directory") else { continue };
        let folder = reader.path_in(directory, "path")?;
        for path in catalogs.files(&folder) {
            let document = catalogs.document(&path, reader, directory)?;
            let has_name = |node: &&Node| node.raw("name") == Some(&catalog);
            let Some(entries) = document.child("Catalog").filter(has_name) else { continue };
            searched.push(path.display().to_string());
            if let Some(node) = entries.children.iter().find(|node| node.raw("name") == Some(&entry)) {
                if node.name != "Vehicle" {
                    let message =
                        format!("`{entry}` is a `{}`: a scenario has cars, trucks and motorcycles", node.name);
                    return Err(reader.error(reference, message));
                }
                let mut entry = node.clone();
                let assigned = assigned_values(reader, reference, &entry)?;
                let mut notes = structure::check(&path, &mut entry, &assigned)?;
                let vehicle = read_vehicle(&Reader { path: path.clone() }, &entry, &mut notes)?;
                // Several vehicles have one entry.
                for note in notes.iter().map(|note| format!("{}, {note}", path.display())) {
                    if !catalogs.notes.contains(&note) {
                        catalogs.notes.push(note);
                    }
                }
                return Ok(vehicle);
            }
        }
    }
    let places =
        if searched.is_empty() { "no file has a catalogue of that name".to_owned() } else { searched.join(", ") };
    Err(reader.error(reference, format!("no entry `{entry}` in the catalogue `{catalog}` ({places})")))
}

/// Returns the values that a reference assigns to the parameters of a catalogue's entry.
fn assigned_values(reader: &Reader, reference: &Node, entry: &Node) -> Result<Given, ImportError> {
    let lists = entry.all("ParameterDeclarations").flat_map(|list| list.all("ParameterDeclaration"));
    let names: BTreeSet<&str> = lists.filter_map(|declaration| declaration.raw("name")).collect();
    let mut assigned = Given::new();
    for assignment in
        reference.child("ParameterAssignments").into_iter().flat_map(|list| list.all("ParameterAssignment"))
    {
        let name = reader.text(assignment, "parameterRef")?;
        if !names.contains(name.as_str()) {
            return Err(reader.error(assignment, no_parameter(&name, &names)));
        }
        assigned.insert(name, reader.text(assignment, "value")?);
    }
    Ok(assigned)
}

/// Reads an element `Vehicle`, and adds notes on what is left out of it.
fn read_vehicle(reader: &Reader, node: &Node, notes: &mut Vec<String>) -> Result<Vehicle, ImportError> {
    let category = reader.text(node, "vehicleCategory")?;
    let class = match category.as_str() {
        "car" | "van" => "car",
        "truck" | "bus" | "semitrailer" => "truck",
        "motorbike" => "motorcycle",
        _ => return Err(reader.error(node, format!("a `{category}` is not a car, truck or motorcycle"))),
    };
    let size = reader.child(node, &["BoundingBox", "Dimensions"])?;
    let length_m = within(reader, size, "length", Dimensions::LENGTH_M, "m")?;
    let width_m = within(reader, size, "width", Dimensions::WIDTH_M, "m")?;
    let height_m = within(reader, size, "height", Dimensions::HEIGHT_M, "m")?;
    let centre = reader.child(node, &["BoundingBox", "Center"])?;
    // The reference point lies under the box, or not far from it.
    for (name, size_m) in [("x", length_m), ("y", width_m), ("z", height_m)] {
        if centre.raw(name).is_some() {
            within(reader, centre, name, Range::closed(-size_m, size_m), "m")?;
        }
    }
    let beside_m = reader.number_or(centre, "y", 0.0)?;
    if beside_m.abs() > NOTED_OFFSET_M {
        notes.push(format!(
            "line {}: the centre of the box lies {:.2} m beside the reference point: here it keeps the centre of the lane",
            centre.line,
            beside_m.abs()
        ));
    }
    let mass_kg = match reader.number_or(node, "mass", 0.0)? {
        // Some programs write a mass of 0 if they do not know it.
        0.0 => None,
        _ => Some(within(reader, node, "mass", closecall_traffic::Vehicle::MASS_KG, "kg")?),
    };
    Ok(Vehicle {
        class,
        length_m,
        width_m,
        height_m,
        mass_kg,
        centre_m: reader.number(centre, "x")?,
        ..Vehicle::default()
    })
}

/// Returns a number in the range that a vehicle of a scenario can have.
fn within(reader: &Reader, node: &Node, name: &str, range: Range, unit: &str) -> Result<f64, ImportError> {
    let value = reader.number(node, name)?;
    match range.contains(value) {
        true => Ok(value),
        false => {
            let message = format!("`{name}` is {value}; {} to {} {unit} are needed", range.low(), range.high());
            Err(reader.error(node, message))
        }
    }
}
