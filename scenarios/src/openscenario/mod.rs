//! Reads scenarios of ASAM OpenSCENARIO XML 1.0 to 1.3, with their OpenDRIVE road.
//!
//! ```text
//!  FILE.xosc ─▶ parameters, vehicles, road ─▶ storyboard, played ─▶ speeds and lane changes at times ─▶ scenario file
//! ```
//!
//! The storyboard is played once with vehicles that follow their actions exactly. The motion of the
//! other vehicles becomes a prescribed driver: speeds and lane changes at their times, and a
//! lateral path if a vehicle drives beside the centre of its lane. If a trigger refers to the ego,
//! its time holds for an ego that keeps the speed of the file, as in a nominal encounter: it is the
//! same for every controller. An element that a scenario cannot express is an error with file, line
//! and element, or a note; nothing is left out in silence.

mod changing_lanes;
mod condition;
mod course;
mod distribution;
mod dom;
mod entities;
mod entry_lane;
mod follow;
mod formula;
mod numbering;
mod offset;
mod plane;
mod reader;
mod replaced;
mod road;
mod sections;
mod shape;
mod shift;
mod standard;
mod stochastic;
mod storyboard;
mod structure;
mod synchronize;
mod trajectory;
mod world;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io;
use std::iter;
use std::path::{Path, PathBuf};

use closecall_traffic::words::counted;
use closecall_traffic::{ActorId, AlignmentPoint, Environment, Segment, input, kebab_name};

pub use dom::ImportError;

use self::distribution::ValueSource;
use self::dom::{Node, parse};
use self::entities::Entities;
use self::formula::no_parameter;
use self::reader::Reader;
use self::road::{ImportedRoad, UsedRoad};
use self::stochastic::Stochastic;
use self::storyboard::Storyboard;
use self::structure::Given;
use self::world::Vehicle;
use crate::{ScenarioError, ScenarioFile, Setting};

/// Time gap of the ego's cruise control (s): an assumption, as the file has its own controller; 1
/// to 2 are plausible.
const TIME_GAP_S: f64 = 1.5;
/// Allowed durations of a lane change (s), as in a scenario file.
const LANE_CHANGE_S: [f64; 2] = [1.5, 20.0];
/// Deviation of a profile from the speeds of the storyboard (m/s).
const SPEED_TOLERANCE_MPS: f64 = 1e-3;
/// Time within which a change of speed belongs to the start (s): an assumption; 0.01 to 0.2 are
/// plausible.
const AT_START_S: f64 = 0.05;
/// Change of speed in one step of the storyboard above which no vehicle follows it (m/s): an
/// assumption; 0.2 to 1 are plausible.
const JUMP_MPS: f64 = 0.5;
/// Friction of the road with a friction scale of 1: the friction of a dry road.
const DRY_FRICTION: f64 = 0.9;

/// How a file is imported.
#[derive(Clone, Debug, Default)]
pub struct ImportOptions {
    /// Name of the vehicle that the controller under test drives, or `None` for `Ego`, or the only
    /// one with a controller.
    pub ego: Option<String>,
    /// Values of parameters that replace the values of the file.
    pub parameters: Vec<(String, String)>,
    /// Number of the combination or of the draw of values to use, from 1, of a file that holds
    /// values or distributions of parameters. `None` if it has one, or for the distributions
    /// themselves if the scenario is one that Closecall wrote.
    pub value_set: Option<u64>,
}

/// A scenario that was imported.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The text of the scenario file.
    pub text: String,
    /// The parts that the scenario expresses in another way than the file.
    pub notes: Vec<String>,
    /// When events begin and end (s), as the storyboard was played.
    pub events: Vec<(f64, String)>,
}

/// A file that cannot be imported.
#[derive(Debug, thiserror::Error)]
pub enum ImportFailure {
    /// The file cannot be read.
    #[error("failed to read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// An element is wrong, or is not read.
    #[error(transparent)]
    Element(#[from] ImportError),
    /// The scenario that the file describes is none that can run.
    #[error("failed to import {}: the scenario that it describes is not valid: {source}", path.display())]
    Scenario {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: Box<ScenarioError>,
    },
}

fn read_text(path: &Path) -> Result<String, ImportFailure> {
    input::read_text(path).map_err(|source| match source.kind() {
        io::ErrorKind::InvalidData => {
            let (path, message) = (path.to_owned(), source.to_string());
            ImportError { path, line: 1, element: String::new(), message }.into()
        }
        _ => ImportFailure::Read { path: path.to_owned(), source },
    })
}

/// Imports a file.
///
/// # Errors
/// [`ImportFailure`] with file, line and element.
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportFailure> {
    let mut root = parse(path, &read_text(path)?)?;
    let reader = Reader { path: path.to_owned() };
    check_kind(&reader, &root)?;
    if root.child("ParameterValueDistribution").is_some() {
        structure::check(path, &mut root, &Given::new())?;
        return of_values(&reader, &root, options);
    }
    if options.value_set.is_some() {
        return Err(reader.error(&root, "it is a scenario, not a file of values: it has no value sets").into());
    }
    import_scenario(&reader, root, options)
}

/// Imports the scenario that a file of values names, with one combination of these values.
fn of_values(reader: &Reader, root: &Node, options: &ImportOptions) -> Result<Imported, ImportFailure> {
    let distribution = reader.child(root, &["ParameterValueDistribution"])?;
    let file = distribution::read(reader, root, distribution)?;
    let scenario = Reader { path: file.scenario.clone() };
    let text = input::read_text(&scenario.path).map_err(|error| {
        let named = distribution.child("ScenarioFile").unwrap_or(distribution);
        reader.error(named, format!("failed to read {}: {error}", scenario.path.display()))
    })?;
    let scenario_root = parse(&scenario.path, &text)?;
    check_kind(&scenario, &scenario_root)?;
    if let Some(inner) = scenario_root.child("ParameterValueDistribution") {
        return Err(scenario
            .error(inner, "a file of values must name a scenario, and this is a file of values")
            .into());
    }
    if let (ValueSource::Stochastic(stochastic), None, Some(text)) =
        (&file.values, options.value_set, text_of_closecall(&scenario_root))
    {
        return of_closecall(&scenario, &scenario_root, text, options, Some((stochastic, reader.path.as_path())));
    }
    let count = file.count();
    let number = match options.value_set {
        None if count == 1 => 1,
        Some(number) if (1..=count).contains(&number) => number,
        _ => {
            let message = format!("it has {count} {}: choose one value set from 1 to {count}", file.plural());
            return Err(reader.error(distribution, message).into());
        }
    };
    let mut values = file.combination(number);
    values.extend(options.parameters.iter().cloned());
    let stated: Vec<_> = values.iter().map(|(name, value)| format!("{name} = {value}")).collect();
    let note = format!("{}: {}", file.description(number), stated.join(", "));
    let options = ImportOptions { ego: options.ego.clone(), parameters: values.into_iter().collect(), value_set: None };
    let mut imported = import_scenario(&scenario, scenario_root, &options)?;
    let mut notes = vec![note];
    if let ValueSource::Stochastic(stochastic) = file.values {
        notes.extend(stochastic.notes);
    }
    notes.append(&mut imported.notes);
    imported.notes = notes;
    Ok(imported)
}

/// Imports a document that is a scenario.
fn import_scenario(reader: &Reader, mut root: Node, options: &ImportOptions) -> Result<Imported, ImportFailure> {
    let path = &reader.path;
    if let Some(text) = text_of_closecall(&root) {
        return of_closecall(reader, &root, text, options, None);
    }
    check_options(reader, &root, options)?;
    let mut notes = structure::check(path, &mut root, &options.parameters.iter().cloned().collect())?;
    let Entities { vehicles, controlled, notes: of_entities } = entities::read(reader, &root)?;
    notes.extend(of_entities);
    let ego = ego_of(reader, &root, &vehicles, &controlled, options.ego.as_deref())?;
    let storyboard = reader.child(&root, &["Storyboard"])?;
    let road = road_of(reader, &root, storyboard)?;
    let mut played = Storyboard::new(reader.clone(), &road, vehicles, ego);
    played.notes = notes;
    played.notes.extend(road.notes.iter().map(|note| format!("the road has {note}")));
    for (name, line) in &controlled {
        if let Some(vehicle) = played.vehicles.iter().position(|vehicle| vehicle.name == *name) {
            played.note_controller(*line, vehicle);
        }
    }
    let globals = played.init(storyboard)?;
    let starts = played.vehicles.clone();
    played.play(storyboard)?;
    let environment = environment(reader, &globals, &mut played.notes)?;
    let text = scenario_text(path, &mut played, &starts, &environment)?;
    let parsed = ScenarioFile::parse(path, &text, &[]).and_then(|file| file.check());
    parsed.map_err(|source| at_element(reader, &root, &starts, source))?;
    Ok(Imported { text, notes: played.notes, events: played.events })
}

/// Checks that the file declares the parameters whose values the options give.
fn check_options(reader: &Reader, root: &Node, options: &ImportOptions) -> Result<(), ImportError> {
    let lists = root.all("ParameterDeclarations").flat_map(|list| list.all("ParameterDeclaration"));
    let names: BTreeSet<&str> = lists.filter_map(|declaration| declaration.raw("name")).collect();
    match options.parameters.iter().find(|(name, _)| !names.contains(name.as_str())) {
        Some((unknown, _)) => Err(reader.error(root, no_parameter(unknown, &names))),
        None => Ok(()),
    }
}

/// Returns the error of the scenario that a file describes at the element that describes its part:
/// the lines of the scenario file are none of the reader's.
fn at_element(reader: &Reader, root: &Node, vehicles: &[Vehicle], error: ScenarioError) -> ImportFailure {
    let ScenarioError::Value { source, .. } = &error else {
        return ImportFailure::Scenario { path: reader.path.clone(), source: Box::new(error) };
    };
    let message = format!("the scenario that it describes is not valid: {source}");
    let (vehicle, keys) = match &source.path.0[..] {
        [Segment::Key(key), Segment::Index(index), keys @ ..] if key == "actor" => (vehicles.get(*index), keys),
        _ => (None, <&[Segment]>::default()),
    };
    let Some(vehicle) = vehicle else { return reader.error(root, message).into() };
    let is = |segment: Option<&Segment>, name: &str| matches!(segment, Some(Segment::Key(key)) if key == name);
    let (line, element) = match is(keys.first(), "start") && !is(keys.last(), "speed-mps") {
        true => vehicle.start.clone(),
        false => (vehicle.line, "ScenarioObject".to_owned()),
    };
    let message = format!("`{}`: {message}", vehicle.name);
    ImportError { path: reader.path.clone(), line, element, message }.into()
}

fn check_kind(reader: &Reader, root: &Node) -> Result<(), ImportError> {
    if root.name != "OpenSCENARIO" {
        return Err(reader.error(root, "the root element must be `OpenSCENARIO`"));
    }
    let header = reader.child(root, &["FileHeader"])?;
    let version = (reader.text(header, "revMajor")?, reader.text(header, "revMinor")?);
    if version.0 != "1" || !["0", "1", "2", "3"].contains(&version.1.as_str()) {
        let message = format!("version {}.{}: the versions 1.0 to 1.3 are read", version.0, version.1);
        return Err(reader.error(header, message));
    }
    match root.child("Catalog") {
        Some(catalog) => Err(reader.error(catalog, "a catalogue is not a scenario")),
        None => Ok(()),
    }
}

/// Name of the property in the header of a logical scenario that has the hash of all other
/// elements.
pub const CONTENT_PROPERTY: &str = "closecall-content";

/// Returns the hash of the elements of a document without its header; `None` if it is no XML.
pub fn content_hash(text: &str) -> Option<String> {
    Some(parse(Path::new(""), text).ok()?.content_hash())
}

/// Returns the scenario that Closecall wrote into the header of a logical scenario, with the values
/// of the options in place of its parameters. The distributions of another file, whose path stands
/// with them, replace the distributions of its parameters.
///
/// # Errors
/// [`ImportFailure`] if the other elements are not those that were written with it, or an option or
/// a distribution does not fit.
fn of_closecall(
    reader: &Reader,
    root: &Node,
    text: &str,
    options: &ImportOptions,
    distributions: Option<(&Stochastic, &Path)>,
) -> Result<Imported, ImportFailure> {
    let path = &reader.path;
    let header = reader.child(root, &["FileHeader"])?;
    let properties = reader.child(header, &["Properties"])?;
    let written = properties.all("Property").find(|property| property.raw("name") == Some(CONTENT_PROPERTY));
    if written.and_then(|property| property.raw("value")) != Some(root.content_hash().as_str()) {
        let message = "it carries a scenario file of Closecall, and the elements beside it are not those that were \
                       written with it: edit the scenario file instead, or remove `CustomContent` to import the \
                       elements alone";
        return Err(reader.error(header, message).into());
    }
    let invalid = |source| ImportFailure::Scenario { path: path.clone(), source: Box::new(source) };
    let file = ScenarioFile::parse(path, text, &[]).map_err(invalid)?;
    let ego = file.ego_id().map(ToString::to_string).unwrap_or_default();
    if let Some(asked) = options.ego.as_ref().filter(|asked| **asked != ego) {
        let message = format!("the ego of its scenario is `{ego}`, and cannot be `{asked}`");
        return Err(reader.error(header, message).into());
    }
    let mut notes = vec![
        "Closecall wrote this file: the scenario in it is used, and neither the road nor the catalogue is read"
            .to_owned(),
    ];
    let mut whole = text.to_owned();
    if let Some((stochastic, source)) = distributions {
        let (replaced, replaced_notes) = replaced::with_distributions(&file, stochastic, source)?;
        whole = replaced;
        let runs = counted(stochastic.runs, "run");
        notes.push(match stochastic.seed {
            Some(seed) => format!("the distributions ask for {runs} with the random seed {seed}"),
            None => format!("the distributions ask for {runs}, and for no random seed"),
        });
        notes.extend(replaced_notes);
    }
    let mut settings = Vec::new();
    for (written, value) in &options.parameters {
        let name = written.replace('_', "-");
        if !file.space().iter().any(|(parameter, _)| parameter.as_str() == name) {
            let names: Vec<_> =
                file.space().iter().map(|(parameter, _)| parameter.as_str().replace('-', "_")).collect();
            let message = format!("there is no parameter `{written}`, only {}", names.join(", "));
            return Err(reader.error(root, message).into());
        }
        let setting = format!("{name}={value}").parse::<Setting>();
        settings.push(setting.map_err(|source| invalid(ScenarioError::Set { path: path.clone(), source }))?);
        notes.push(format!("`{name}` is {value} in every sample"));
    }
    let file = ScenarioFile::parse(path, &whole, &settings).map_err(invalid)?;
    file.check().map_err(invalid)?;
    Ok(Imported { text: file.text().to_owned(), notes, events: Vec::new() })
}

/// Returns the text of the scenario that Closecall wrote into the header of a logical scenario.
fn text_of_closecall(root: &Node) -> Option<&str> {
    let header = root.child("FileHeader").filter(|header| header.raw("author") == Some("Closecall"))?;
    header.at(&["Properties", "CustomContent"]).map(|node| node.text.as_str())
}

fn ego_of(
    reader: &Reader,
    root: &Node,
    vehicles: &[Vehicle],
    controlled: &[(String, usize)],
    asked: Option<&str>,
) -> Result<usize, ImportError> {
    let position = |name: &str| vehicles.iter().position(|vehicle| vehicle.name == name);
    let names: Vec<_> = vehicles.iter().map(|vehicle| vehicle.name.as_str()).collect();
    let entities = root.child("Entities").unwrap_or(root);
    let refuse = |problem: String| {
        Err(reader.error(entities, format!("{problem}: name one of {} as the ego", names.join(", "))))
    };
    match (asked, controlled) {
        (Some(name), _) => position(name).map_or_else(|| refuse(format!("there is no vehicle `{name}`")), Ok),
        (None, controlled) => {
            let mut usual = (0..vehicles.len()).filter(|&index| vehicles[index].name.eq_ignore_ascii_case("ego"));
            let (usual, second) = (usual.next(), usual.next());
            if let (Some(usual), Some(second)) = (usual, second) {
                return refuse(format!("`{}` and `{}` could be the ego", names[usual], names[second]));
            }
            let only = if let [(name, _)] = controlled { position(name) } else { None };
            usual
                .or(only)
                .map_or_else(|| refuse("no vehicle is named `Ego`, and not one alone has a controller".to_owned()), Ok)
        }
    }
}

fn road_of(reader: &Reader, root: &Node, storyboard: &Node) -> Result<ImportedRoad, ImportFailure> {
    let network = reader.child(root, &["RoadNetwork"])?;
    let logic = reader.child(network, &["LogicFile"])?;
    let mut stack = vec![storyboard];
    let (mut first, mut is_in_plane) = (None, false);
    while let Some(node) = stack.pop() {
        if node.name == "LanePosition" {
            first = Some(node);
            break;
        }
        is_in_plane |= node.name == "WorldPosition";
        stack.extend(node.children.iter().rev());
    }
    let used = match first {
        #[expect(clippy::cast_possible_truncation, reason = "compared with the lanes of the road")]
        Some(position) => UsedRoad::Lane {
            road_id: reader.text(position, "roadId")?,
            lane: reader.number(position, "laneId")? as i32,
            reader,
            position,
        },
        None if is_in_plane => UsedRoad::Only,
        None => {
            let message = "no vehicle starts at a `LanePosition` or a `WorldPosition`, which says on which road";
            return Err(reader.error(storyboard, message).into());
        }
    };
    let path = reader.path_in(logic, "filepath")?;
    let text = input::read_text(&path)
        .map_err(|error| reader.error(logic, format!("failed to read {}: {error}", path.display())))?;
    Ok(road::read(&path, &text, &used)?)
}

/// Returns the environment as a table of TOML.
fn environment(reader: &Reader, globals: &[Node], notes: &mut Vec<String>) -> Result<String, ImportError> {
    let mut keys = Vec::new();
    for action in globals {
        if action.name != "EnvironmentAction" {
            return Err(reader.error(action, "this action is not read"));
        }
        let Some(environment) = action.child("Environment") else {
            notes.push(format!("line {}: an environment of a catalogue: it is a clear, dry day", action.line));
            continue;
        };
        if let Some(fog) = environment.at(&["Weather", "Fog"]) {
            let visibility_m = reader.number(fog, "visualRange")?;
            if !(20.0..=100_000.0).contains(&visibility_m) {
                notes.push(format!(
                    "line {}: a visibility of {visibility_m} m: the nearest from 20 to 100,000 m",
                    fog.line
                ));
            }
            keys.push(format!("visibility-m = {:?}", visibility_m.clamp(20.0, 100_000.0)));
        }
        if let Some(rain) = environment.at(&["Weather", "Precipitation"]) {
            keys.extend(rain_key(reader, rain, notes)?);
        }
        if let Some(surface) = environment.child("RoadCondition") {
            let scale = reader.number(surface, "frictionScaleFactor")?;
            if !Environment::FRICTION.contains(DRY_FRICTION * scale) {
                let [low, high] =
                    [Environment::FRICTION.low(), Environment::FRICTION.high()].map(|friction| friction / DRY_FRICTION);
                let message = format!("`frictionScaleFactor` is {scale}; {low:.2} to {high:.2} are possible");
                return Err(reader.error(surface, message));
            }
            keys.push(format!("friction = {:?}", DRY_FRICTION * scale));
        }
        notes.push(format!("line {}: of the environment, visibility, rain and friction are read", action.line));
    }
    Ok(keys.join(", "))
}

/// Returns the key of the rain, or `None` if there is none.
fn rain_key(reader: &Reader, rain: &Node, notes: &mut Vec<String>) -> Result<Option<String>, ImportError> {
    let kind = reader.text(rain, "precipitationType")?;
    if kind == "dry" {
        return Ok(None);
    }
    // Version 1.0 has an intensity without a unit, from 0 to 1.
    let has_unit = rain.raw("precipitationIntensity").is_some();
    let intensity = reader.number(rain, if has_unit { "precipitationIntensity" } else { "intensity" })?;
    if kind == "rain" && has_unit {
        let range = Environment::RAIN_MM_PER_H;
        if !range.contains(intensity) {
            let (low, high) = (range.low(), range.high());
            let message = format!("`precipitationIntensity` is {intensity}; {low} to {high} mm/h are possible");
            return Err(reader.error(rain, message));
        }
        return Ok(Some(format!("rain-mm-per-h = {intensity:?}")));
    }
    if intensity > 0.0 {
        let reason = if kind == "snow" { "a scenario has no snow" } else { "an `intensity` has no unit" };
        notes.push(format!("line {}: `{}`: {reason}: it does not fall", rain.line, rain.name));
    }
    Ok(None)
}

/// Returns the names of the vehicles in the scenario file. A vehicle keeps its name if a scenario can
/// have it; another one gets the nearest name that no vehicle has, with a note.
fn actor_names(vehicles: &[Vehicle], notes: &mut Vec<String>) -> Vec<ActorId> {
    let kept: Vec<Option<ActorId>> = vehicles.iter().map(|vehicle| ActorId::new(&vehicle.name).ok()).collect();
    let mut taken: BTreeSet<ActorId> = kept.iter().flatten().cloned().collect();
    let mut names = Vec::with_capacity(vehicles.len());
    for (vehicle, kept) in vehicles.iter().zip(kept) {
        names.push(kept.unwrap_or_else(|| {
            let nearest = ActorId::nearest(&vehicle.name);
            let numbered = (2..).map(|number| ActorId::nearest(&format!("{nearest}_{number}")));
            let free = iter::once(nearest.clone()).chain(numbered).find(|name| !taken.contains(name));
            let name = free.unwrap_or(nearest);
            taken.insert(name.clone());
            notes.push(format!("`{}` is named `{name}`: a name has {}", vehicle.name, ActorId::ALLOWED));
            name
        }));
    }
    names
}

/// Returns the points of a profile: the speeds between which it is linear.
fn points(speeds: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = speeds.first().copied().into_iter().collect();
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for pair in speeds.windows(2) {
        let Some(&(t0, v0)) = points.last() else { continue };
        let slope = |value: f64| (value - v0) / (pair[1].0 - t0);
        let exact = slope(pair[1].1);
        if !(low..=high).contains(&exact) {
            points.push(pair[0]);
            let (t0, v0) = pair[0];
            let slope = |value: f64| (value - v0) / (pair[1].0 - t0);
            (low, high) = (slope(pair[1].1 - SPEED_TOLERANCE_MPS), slope(pair[1].1 + SPEED_TOLERANCE_MPS));
        } else {
            low = low.max(slope(pair[1].1 - SPEED_TOLERANCE_MPS));
            high = high.min(slope(pair[1].1 + SPEED_TOLERANCE_MPS));
        }
    }
    match (points.last(), speeds.last()) {
        (Some(end), Some(last)) if end.0 < last.0 && (points.len() > 1 || end.1 != last.1) => points.push(*last),
        _ => {}
    }
    points
}

fn scenario_text(
    path: &Path,
    played: &mut Storyboard<'_>,
    starts: &[Vehicle],
    environment: &str,
) -> Result<String, ImportError> {
    let road = played.road;
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let limit = road.speed_limit_mps.filter(|limit| *limit > 0.0 && *limit <= 100.0);
    let acceleration_lane = road.acceleration_lane.map(|lane| {
        let [length_m, taper_m] = [lane.to_m - lane.from_m, lane.taper_end_m - lane.to_m];
        format!(
            ", acceleration-lane = {{ from-m = {:?}, length-m = {length_m:?}, taper-m = {taper_m:?} }}",
            lane.from_m
        )
    });
    let mut actors = String::new();
    let names = actor_names(starts, &mut played.notes);
    for ((index, start), id) in starts.iter().enumerate().zip(names) {
        let mut speeds = played.speeds[index].clone();
        let at_start =
            speeds.iter().rev().find(|(at_s, _)| *at_s <= AT_START_S).map_or(start.speed_mps, |(_, mps)| *mps);
        if (at_start - start.speed_mps).abs() > JUMP_MPS {
            played.notes.push(format!("`{}` starts with the {at_start} m/s that its first action sets", start.name));
            speeds.iter_mut().take_while(|(at_s, _)| *at_s <= AT_START_S).for_each(|(_, mps)| *mps = at_start);
        }
        let follows = played.following.iter().find(|following| following.vehicle == index).copied();
        let is_prescribed = index != played.ego && follows.is_none();
        for pair in speeds.windows(2).filter(|pair| is_prescribed && (pair[1].1 - pair[0].1).abs() > JUMP_MPS) {
            played.notes.push(format!(
                "`{}` changes its speed at once at {:.2} s, by {:.2} m/s: here it takes as long as a vehicle needs",
                start.name,
                pair[1].0,
                pair[1].1 - pair[0].1
            ));
        }
        let speed_mps = speeds.first().map_or(start.speed_mps, |(_, mps)| *mps);
        let lane_index = road.index(start.lane).unwrap_or_default();
        let lane = lane_index + 1;
        let mass =
            start.mass_kg.filter(|mass| *mass > 0.0).map(|mass| format!(", mass-kg = {mass:?}")).unwrap_or_default();
        let _ = write!(
            actors,
            "\n[[actor]]\nid = \"{id}\"\nvehicle = {{ class = \"{}\", length-m = {:?}, width-m = {:?}, height-m = {:?}{mass} }}\n\
             start = {{ absolute = {{ lane = {lane}, s-m = {:?}, speed-mps = {speed_mps:?} }} }}\n",
            start.class,
            start.length_m,
            start.width_m,
            start.height_m,
            start.s_m + start.centre_m,
        );
        if index != played.ego
            && let Some(path) = played.path(index, lane_index)?
        {
            let points = path.iter().map(|point| {
                let [travelled_m, d_m] = point.map(|value| (value * 1e6).round() / 1e6);
                format!("[{travelled_m:?}, {d_m:?}]")
            });
            let _ = writeln!(actors, "path = [{}]", points.collect::<Vec<_>>().join(", "));
        }
        if index == played.ego {
            let set = if speed_mps > 0.0 { format!(", set-speed-mps = {speed_mps:?}") } else { String::new() };
            let _ = writeln!(
                actors,
                "driver = {{ ego-stack = {{ acc = {{ time-gap-s = {TIME_GAP_S:?}{set} }}, aeb = {{}}, mis = {{}} }} }} # assumed: the file has no such controller"
            );
            continue;
        }
        if let Some(following) = follows {
            if played.moves[index] > 1 {
                let message = format!("`{}` has other actions: a driver that follows has none", start.name);
                let (line, element) = (following.line, "LongitudinalDistanceAction".to_owned());
                return Err(ImportError { path: path.to_owned(), line, element, message });
            }
            let desired_mps = speeds.iter().map(|(_, mps)| *mps).fold(speed_mps, f64::max);
            let _ = writeln!(actors, "driver = {}", following.driver(desired_mps));
            continue;
        }
        let profile: Vec<_> =
            points(&speeds).iter().map(|(at_s, mps)| format!("[{:?}, {mps:?}]", (at_s * 1e6).round() / 1e6)).collect();
        let mut changes = Vec::new();
        for change in played.lane_changes.iter().filter(|change| change.vehicle == index) {
            if !(LANE_CHANGE_S[0]..=LANE_CHANGE_S[1]).contains(&change.duration_s) {
                let message = format!("it takes {:.2} s; a lane change takes 1.5 to 20 s", change.duration_s);
                let element = change.element.to_owned();
                return Err(ImportError { path: path.to_owned(), line: change.line, element, message });
            }
            let side = if change.to > change.from { "left" } else { "right" };
            changes.push(format!(
                "{{ at-s = {:?}, to = \"{side}\", duration-s = {:?} }}",
                (change.at_s * 1e6).round() / 1e6,
                change.duration_s
            ));
        }
        let changes =
            if changes.is_empty() { String::new() } else { format!(", lane-changes = [{}]", changes.join(", ")) };
        let _ = writeln!(actors, "driver = {{ prescribed = {{ profile = [{}]{changes} }} }}", profile.join(", "));
    }
    let duration_s = ((played.end_s * 10.0).ceil() / 10.0).clamp(0.1, 3_600.0);
    let mut text = format!("# Imported from {}. Said in another way than there:\n", plain(&path.display().to_string()));
    for note in &played.notes {
        let _ = writeln!(text, "#   {}", plain(note));
    }
    let course = match &road.alignment {
        None => format!("curvature-per-m = {:?}", road.curvature_per_m),
        Some(alignment) => {
            let point = |point: &AlignmentPoint| {
                format!("{{ s-m = {:?}, curvature-per-m = {:?} }}", point.s_m, point.curvature_per_m)
            };
            let points: Vec<String> = alignment.points().iter().map(point).collect();
            let beside = match road.alignment_d_m == 0.0 {
                true => String::new(),
                false => format!(", alignment-d-m = {:?}", road.alignment_d_m),
            };
            format!("alignment = [{}]{beside}", points.join(", "))
        }
    };
    let widths = match (&road.changing, &road.widths_m[..]) {
        (Some(changing), _) => format!("cross-sections = {}", changing.text()),
        (None, [first_m, others_m @ ..]) if others_m.iter().all(|width_m| width_m == first_m) => {
            format!("lane-width-m = {first_m:?}")
        }
        (None, widths_m) => format!("lane-width-m = {widths_m:?}"),
    };
    let _ = write!(
        text,
        "schema-version = 1\nname = \"{}\"\ndescription = \"Imported from OpenSCENARIO\"\nduration-s = {duration_s:?}\n\
         road = {{ lanes = {}, {widths}, {course}{}{}{} }}\n",
        kebab_name(&stem),
        road.lanes.len(),
        limit.map(|limit| format!(", speed-limit-mps = {limit:?}")).unwrap_or_default(),
        if road.is_left_hand { ", overtaking-side = \"right\"" } else { "" },
        acceleration_lane.unwrap_or_default(),
    );
    if !environment.is_empty() {
        let _ = writeln!(text, "environment = {{ {environment} }}");
    }
    text.push_str(&actors);
    Ok(text)
}

/// Returns the text in one line.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_profile_has_a_point_where_the_slope_changes() {
        let speeds: Vec<_> = (0..=1_000)
            .map(|step| f64::from(step) * 0.01)
            .map(|t| (t, 30.0 - 4.0 * (t - 2.0).clamp(0.0, 3.0)))
            .collect();
        let profile = points(&speeds);
        let times: Vec<_> = profile.iter().map(|(t, _)| (t * 100.0).round()).collect();
        assert_eq!(times, [0.0, 200.0, 500.0, 1_000.0]);
        assert_eq!(points(&[(0.0, 30.0), (0.01, 30.0), (9.0, 30.0)]), [(0.0, 30.0)]);
    }

    #[test]
    fn a_vehicle_keeps_its_name_and_another_name_is_like_none_of_the_others() {
        let written = ["Car 1", "Ego", "ego", "Car.1", "Car_1", "1", "_1", "é", "", "Car_1_2", "front"];
        let vehicles = written.map(|name| Vehicle { name: name.to_owned(), ..Vehicle::default() });
        let mut notes = Vec::new();
        let names = actor_names(&vehicles, &mut notes);
        let names: Vec<&str> = names.iter().map(ActorId::as_str).collect();
        assert_eq!(names, ["Car_1_3", "Ego", "ego", "Car_1_4", "Car_1", "_1_2", "_1", "_", "__2", "Car_1_2", "front"]);
        assert_eq!(notes.len(), 5, "{notes:?}");
        assert!(notes[0].starts_with("`Car 1` is named `Car_1_3`: a name has letters (a-z, A-Z)"), "{notes:?}");
    }
}
