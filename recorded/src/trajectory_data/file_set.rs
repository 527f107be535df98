//! Finds the three files of a highD or exiD data set, and reads the two metadata files.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::path::{Path, PathBuf};

use closecall_traffic::VehicleClass;

use super::class_names::UnknownClasses;
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::fields::{Bounds, FieldError, integer, number, wrong_value};
use super::header::Header;
use super::input::{Digest, open_file, with_path};
use super::plain::allowed;
use super::rows::{Fields, Lines, Separator};
use super::source::ReadError;

/// The suffixes of the three file names.
const TRACKS: &str = "_tracks.csv";
const TRACKS_META: &str = "_tracksMeta.csv";
const RECORDING_META: &str = "_recordingMeta.csv";

/// The suffix of a compressed file.
const GZ: &str = ".gz";

const FRAME_RATE_HZ: Bounds = Bounds::closed(1.0, 1_000.0);
/// Allowed lateral positions of markings (m).
const MARKING_M: Bounds = Bounds::closed(-1e7, 1e7);

/// Allowed number of rows per vehicle.
const ROWS: (i64, i64) = (0, 1_000_000_000);

/// The three files of one data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct FileSet {
    folder: PathBuf,
    /// The part of the file names before `_tracks.csv`.
    prefix: String,
}

impl FileSet {
    /// Finds the set that `path` denotes: `path` is one of its files, their folder, or the common
    /// prefix of their names. Returns `None` if `path` is a file of another kind.
    ///
    /// # Errors
    /// Fails if `path` is a folder that contains no such set, or several.
    pub(super) fn of(path: &Path) -> Result<Option<Self>, TrajectoryFileError> {
        if path.is_dir() {
            return Self::in_folder(path).map(Some);
        }
        let folder = path.parent().map(Path::to_owned).unwrap_or_default();
        let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return Ok(None) };
        let bare = name.strip_suffix(GZ).unwrap_or(name);
        let prefix = [TRACKS, TRACKS_META, RECORDING_META].iter().find_map(|suffix| bare.strip_suffix(suffix));
        if let Some(prefix) = prefix {
            return Ok(Some(Self { folder, prefix: prefix.to_owned() }));
        }
        let set = Self { folder, prefix: name.trim_end_matches('_').to_owned() };
        Ok((!path.exists() && set.path(TRACKS).exists()).then_some(set))
    }

    /// Finds the only set in `folder`.
    fn in_folder(folder: &Path) -> Result<Self, TrajectoryFileError> {
        let io = |error| with_path(folder, ReadError::of_file(TrajectoryFileProblem::Io(error)));
        let mut prefixes = Vec::new();
        for entry in std::fs::read_dir(folder).map_err(io)? {
            let name = entry.map_err(io)?.file_name();
            let name = name.to_string_lossy();
            let bare = name.strip_suffix(GZ).unwrap_or(&name);
            prefixes.extend(bare.strip_suffix(TRACKS).map(str::to_owned));
        }
        prefixes.sort();
        prefixes.dedup();
        match prefixes.as_slice() {
            [prefix] => Ok(Self { folder: folder.to_owned(), prefix: prefix.clone() }),
            [] => {
                let none = std::io::Error::new(
                    std::io::ErrorKind::IsADirectory,
                    "it is a folder without the files of a highD or exiD data set (NN_tracks.csv and the others)",
                );
                Err(io(none))
            }
            [first, .., last] => {
                let problem = TrajectoryFileProblem::SeveralInFolder {
                    first: first.clone(),
                    last: last.clone(),
                    count: prefixes.len(),
                };
                Err(with_path(folder, ReadError::of_file(problem)))
            }
        }
    }

    /// Returns the path of the file with the rows.
    pub(super) fn tracks(&self) -> PathBuf {
        self.path(TRACKS)
    }

    /// Returns the paths of all files of the set.
    pub(super) fn files(&self) -> [PathBuf; 3] {
        [TRACKS, TRACKS_META, RECORDING_META].map(|suffix| self.path(suffix))
    }

    /// Returns the path of the file with this suffix: the compressed file if only that one exists.
    fn path(&self, suffix: &str) -> PathBuf {
        let plain = self.folder.join(format!("{}{suffix}", self.prefix));
        let compressed = self.folder.join(format!("{}{suffix}{GZ}", self.prefix));
        if !plain.exists() && compressed.exists() { compressed } else { plain }
    }

    /// Reads the two metadata files. Their content enters the hash of the data set.
    pub(super) fn meta(&self, digest: &Digest) -> Result<Meta, TrajectoryFileError> {
        let (tracks_path, recording_path) = (self.path(TRACKS_META), self.path(RECORDING_META));
        let data = table(&recording_path, digest, recording_meta)?;
        let [(_, data)] = <[_; 1]>::try_from(data).map_err(|rows| {
            let problem = TrajectoryFileProblem::RowCount { actual: rows.len(), needed: 1 };
            with_path(&recording_path, ReadError::of_file(problem))
        })?;
        let mut vehicles = BTreeMap::new();
        let mut unknown_classes = UnknownClasses::default();
        for (line, VehicleRow { id, class, is_upper, rows }) in table(&tracks_path, digest, vehicle_row)? {
            let resolved = unknown_classes.resolve(class_named(&class), &class, "class");
            let class = resolved.map_err(|error| with_path(&tracks_path, ReadError::new(line, error)))?;
            let vehicle = VehicleMeta { class, is_upper, rows, rows_read: 0, line };
            if let Some(VehicleMeta { line: first_line, .. }) = vehicles.insert(id, vehicle) {
                let problem = TrajectoryFileProblem::VehicleTwice { vehicle: id, first_line };
                return Err(with_path(&tracks_path, ReadError::new(line, problem)));
            }
        }
        let file = tracks_path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Meta { data, vehicles, file, unknown_classes })
    }
}

/// The content of both metadata files.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Meta {
    pub(super) data: RecordingMeta,
    pub(super) vehicles: BTreeMap<u64, VehicleMeta>,
    /// Name of the file that describes the vehicles.
    pub(super) file: String,
    pub(super) unknown_classes: UnknownClasses,
}

/// The content of `NN_recordingMeta.csv`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RecordingMeta {
    pub(super) id: String,
    /// Frames per second (Hz).
    pub(super) frame_rate_hz: f64,
    /// Positions y of the upper carriageway's markings in the image frame, from top to bottom (m);
    /// highD only.
    pub(super) upper_m: Vec<f64>,
    /// Positions y of the lower carriageway's markings in the image frame, from top to bottom (m);
    /// highD only.
    pub(super) lower_m: Vec<f64>,
}

/// The entry of one vehicle in `NN_tracksMeta.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VehicleMeta {
    pub(super) class: VehicleClass,
    /// `true` if the vehicle drives on the upper carriageway; highD only.
    pub(super) is_upper: bool,
    /// Number of rows that the metadata states.
    pub(super) rows: u64,
    /// Number of rows read so far.
    pub(super) rows_read: u64,
    /// Line of the entry, counted from 1.
    pub(super) line: u64,
}

/// One row of `NN_tracksMeta.csv` as it is written.
struct VehicleRow {
    id: u64,
    /// Name of the class.
    class: String,
    is_upper: bool,
    rows: u64,
}

/// One row of a metadata table, with the table's header.
struct Cells<'a> {
    header: &'a Header,
    line: &'a str,
    fields: &'a Fields,
}

impl<'a> Cells<'a> {
    /// Returns a required field. `names` lists the spellings of its column.
    fn require(&self, names: &[&'static str]) -> Result<&'a str, FieldError> {
        self.find(names).ok_or_else(|| {
            let name = names.first().copied().unwrap_or_default();
            TrajectoryFileProblem::MissingColumn { name, layout: "highD or exiD" }.into()
        })
    }

    /// Returns a field, or `None` if the table lacks its column.
    fn find(&self, names: &[&'static str]) -> Option<&'a str> {
        names.iter().find_map(|name| self.header.find(name)).map(|index| self.fields.get(self.line, index))
    }
}

/// Reads the rows of a small table with a header, each with its line number.
fn table<T>(
    path: &Path,
    digest: &Digest,
    read: fn(&Cells<'_>) -> Result<T, FieldError>,
) -> Result<Vec<(u64, T)>, TrajectoryFileError> {
    let input = digest.input(open_file(path)?).map_err(|error| with_path(path, error))?;
    rows(input, read).map_err(|error| with_path(path, error))
}

fn rows<T>(input: impl BufRead, read: fn(&Cells<'_>) -> Result<T, FieldError>) -> Result<Vec<(u64, T)>, ReadError> {
    let at_line = |(line, problem): (u64, TrajectoryFileProblem)| ReadError::new(line, problem);
    let mut lines = Lines::new(input);
    let mut fields = Fields::default();
    let Some((number, first)) = lines.next().map_err(at_line)? else {
        return Err(ReadError::of_file(TrajectoryFileProblem::Empty));
    };
    fields.split(first, Separator::Comma).map_err(|problem| ReadError::new(number, problem))?;
    if fields.len() == 1 && first.contains(';') {
        return Err(ReadError::new(number, TrajectoryFileProblem::SemicolonSeparated));
    }
    let header = Header::new((0..fields.len()).map(|index| fields.get(first, index)));
    let needed = fields.len();
    let mut numbered_rows = Vec::new();
    let mut usual_last_field = 0;
    while let Some((number, line)) = lines.next().map_err(at_line)? {
        fields.split(line, Separator::Comma).map_err(|problem| ReadError::new(number, problem))?;
        if fields.len() != needed {
            return Err(ReadError::new(number, TrajectoryFileProblem::ColumnCount { actual: fields.len(), needed }));
        }
        let row = read(&Cells { header: &header, line, fields: &fields });
        numbered_rows.push((number, row.map_err(|error| ReadError::new(number, error))?));
        let last_field = fields.last_len();
        if lines.is_unterminated() && last_field < usual_last_field {
            return Err(ReadError::new(number, TrajectoryFileProblem::CutLine));
        }
        usual_last_field = last_field;
    }
    if numbered_rows.is_empty() {
        return Err(ReadError::of_file(TrajectoryFileProblem::Empty));
    }
    Ok(numbered_rows)
}

fn recording_meta(cells: &Cells<'_>) -> Result<RecordingMeta, FieldError> {
    Ok(RecordingMeta {
        id: cells.require(&["id", "recordingId"])?.to_owned(),
        frame_rate_hz: number(cells.require(&["frameRate"])?, "frameRate", FRAME_RATE_HZ)?,
        upper_m: markings(cells.find(&["upperLaneMarkings"]).unwrap_or_default(), "upperLaneMarkings")?,
        lower_m: markings(cells.find(&["lowerLaneMarkings"]).unwrap_or_default(), "lowerLaneMarkings")?,
    })
}

/// Parses a list of markings such as `8.51;12.59;16.43`: at least two, rising.
fn markings(text: &str, column: &'static str) -> Result<Vec<f64>, FieldError> {
    if text.is_empty() {
        return Ok(Vec::new());
    }
    let edges_m = text.split(';').map(|part| number(part.trim(), column, MARKING_M)).collect::<Result<Vec<_>, _>>()?;
    if edges_m.len() < 2 || edges_m.windows(2).any(|pair| pair[0] >= pair[1]) {
        return Err(FieldError::at(column, wrong_value(text, "a list of at least two rising positions".to_owned())));
    }
    Ok(edges_m)
}

fn vehicle_row(cells: &Cells<'_>) -> Result<VehicleRow, FieldError> {
    let id = integer(cells.require(&["id", "trackId"])?, "id", allowed::IDS)?.unsigned_abs();
    let rows = integer(cells.require(&["numFrames"])?, "numFrames", ROWS)?.unsigned_abs();
    let class = cells.require(&["class"])?.to_owned();
    let is_upper = match cells.find(&["drivingDirection"]) {
        None | Some("2") => false,
        Some("1") => true,
        Some(other) => {
            let allowed = "1 (towards -x) or 2 (towards +x)".to_owned();
            return Err(FieldError::at("drivingDirection", wrong_value(other, allowed)));
        }
    };
    Ok(VehicleRow { id, class, is_upper, rows })
}

/// Returns the vehicle class with this name, if it is known. highD has cars and trucks; exiD spells
/// them in lower case, and also has vans and motorcycles.
fn class_named(text: &str) -> Option<VehicleClass> {
    match text.to_ascii_lowercase().as_str() {
        "car" | "van" => Some(VehicleClass::Car),
        "truck" | "truck_bus" | "bus" | "trailer" => Some(VehicleClass::Truck),
        "motorcycle" => Some(VehicleClass::Motorcycle),
        _ => None,
    }
}
