//! A folder of point clouds in the PCD format, version 0.7, of the Point Cloud Library (*The PCD
//! (Point Cloud Data) file format*), with an index that gives the time of each cloud.

use std::collections::{HashSet, VecDeque};
use std::io::Read;
use std::path::{Path, PathBuf};

use closecall_sensors::lidar::MirrorSide;
use closecall_traffic::{Time, input};

use super::cloud::{Cloud, Field, Number, PointBytes};
use super::error::{Origin, ScanFileError, ScanFileProblem};
use super::options::{ScanOptions, TakenScan, mirror_side};
use super::text_table::{TableFormat, read_table};

/// The name of the index in the folder.
pub const INDEX: &str = "scans.csv";
/// Largest number of points of a file.
const MAX_POINTS: usize = 4_000_000;
/// The index.
const INDEX_FORMAT: TableFormat = TableFormat {
    columns: &["file", "time_s", "sensor", "mirror_side", "sensor_x_m"],
    needed: 2,
    gives: "the time at which each scan ends (s), on the clock of the poses",
};

/// A scan in the index.
struct Entry {
    path: PathBuf,
    time: Time,
    sensor: usize,
    mirror_side: MirrorSide,
    sensor_x_m: Option<f32>,
}

/// The folder, with the scans that have not been read.
pub(super) struct PcdRecording {
    entries: VecDeque<Entry>,
}

impl PcdRecording {
    pub(super) fn open(folder: &Path, options: &ScanOptions) -> Result<Self, ScanFileError> {
        let origin = Origin::file(folder);
        let is_cloud = |path: &Path| path.extension().is_some_and(|end| end.eq_ignore_ascii_case("pcd"));
        let files = std::fs::read_dir(folder).map_err(|error| origin.error(error))?.filter_map(Result::ok);
        let mut clouds: Vec<PathBuf> = files.map(|file| file.path()).filter(|path| is_cloud(path)).collect();
        if clouds.is_empty() {
            return Err(origin.error(ScanFileProblem::EmptyFolder));
        }
        let rows = read_table(&folder.join(INDEX), INDEX_FORMAT)?;
        let (mut entries, mut listed) = (Vec::with_capacity(rows.len()), HashSet::new());
        for row in &rows {
            let name = row.needed_text(0)?;
            let path = folder.join(name);
            if !listed.insert(path.clone()) {
                return Err(row.place(0).error(ScanFileProblem::Csv(format!("`{name}` is listed twice"))));
            }
            let sensor = match row.text(2) {
                Some(name) => match options.sensor(name) {
                    Ok(Some(sensor)) => sensor,
                    Ok(None) => continue,
                    Err(problem) => return Err(row.place(2).error(problem)),
                },
                None => options.only_sensor().map_err(|problem| row.place(2).error(problem))?,
            };
            #[expect(clippy::cast_possible_truncation, reason = "the sensor's place is in single precision")]
            let sensor_x_m = row.number_or_none(4)?.map(|x_m| x_m as f32);
            entries.push(Entry {
                path,
                time: row.time(1)?,
                sensor,
                mirror_side: mirror_side(row.text(3)).map_err(|problem| row.place(3).error(problem))?,
                sensor_x_m,
            });
        }
        let index = Origin::file(folder.join(INDEX));
        if entries.is_empty() {
            return Err(index.error(ScanFileProblem::EmptyIndex));
        }
        clouds.retain(|path| !listed.contains(path));
        if let Some(first) = clouds.iter().min() {
            let first = first.file_name().unwrap_or_default().to_string_lossy().into_owned();
            return Err(index.error(ScanFileProblem::NotListed { number: clouds.len(), first }));
        }
        // Several sensors may be listed one after the other.
        entries.sort_by_key(|entry| entry.time);
        Ok(Self { entries: entries.into() })
    }

    pub(super) fn next_scan(&mut self, options: &ScanOptions) -> Result<Option<TakenScan>, ScanFileError> {
        let Some(entry) = self.entries.pop_front() else { return Ok(None) };
        let origin = Origin::file(&entry.path);
        let mut bytes = Vec::new();
        let file = input::open(&entry.path);
        file.and_then(|mut file| file.read_to_end(&mut bytes)).map_err(|error| origin.error(error))?;
        let cloud = parse(&bytes).map_err(|problem| origin.error(problem))?;
        let points = cloud.into_points(entry.time, options);
        let mut points = points.map_err(|problem| origin.error(problem))?;
        (points.mirror_side, points.sensor_x_m) = (entry.mirror_side, entry.sensor_x_m);
        Ok(Some(TakenScan { sensor: entry.sensor, origin, points }))
    }
}

/// The lines of a header.
#[derive(Default)]
struct Header {
    fields: Vec<String>,
    sizes: Vec<usize>,
    types: Vec<String>,
    counts: Option<Vec<usize>>,
    points: Option<usize>,
    width: Option<usize>,
    height: Option<usize>,
}

/// Returns the points of a file.
fn parse(bytes: &[u8]) -> Result<Cloud, ScanFileProblem> {
    let wrong = |message: String| ScanFileProblem::PcdHeader(message);
    let mut header = Header::default();
    let (mut rest, mut keys) = (bytes, HashSet::new());
    let format = loop {
        let Some(end) = rest.iter().position(|byte| *byte == b'\n') else {
            return Err(wrong("there is no line `DATA`".to_owned()));
        };
        let (line, after) = (&rest[..end], &rest[end + 1..]);
        rest = after;
        let line = std::str::from_utf8(line).map_err(|_| wrong("a line before `DATA` is not text".to_owned()))?.trim();
        let mut words = line.split_ascii_whitespace();
        let Some(key) = words.next().filter(|key| !key.starts_with('#')) else { continue };
        if !keys.insert(key.to_owned()) {
            return Err(ScanFileProblem::Twice { what: "the header line", name: key.to_owned() });
        }
        let values: Vec<&str> = words.collect();
        let numbers = || values.iter().map(|word| word.parse::<usize>()).collect::<Result<Vec<_>, _>>();
        let whole = || numbers().map_err(|_| wrong(format!("`{line}` needs whole numbers")));
        match key {
            "FIELDS" => header.fields = values.iter().map(ToString::to_string).collect(),
            "SIZE" => header.sizes = whole()?,
            "TYPE" => header.types = values.iter().map(ToString::to_string).collect(),
            "COUNT" => header.counts = Some(whole()?),
            "POINTS" => header.points = whole()?.first().copied(),
            "WIDTH" => header.width = whole()?.first().copied(),
            "HEIGHT" => header.height = whole()?.first().copied(),
            "VIEWPOINT" => {
                let identity = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
                let stated: Result<Vec<f64>, _> = values.iter().map(|word| word.parse::<f64>()).collect();
                if stated.as_deref() != Ok(&identity) {
                    let message = format!(
                        "`{line}`: only `VIEWPOINT 0 0 0 1 0 0 0` is read, points in the one frame of the recording"
                    );
                    return Err(wrong(message));
                }
            }
            "VERSION" => {}
            "DATA" => break values.first().copied().unwrap_or_default().to_owned(),
            _ => return Err(wrong(format!("the line `{line}` is unknown"))),
        }
    };
    let (fields, stride) = header.layout().map_err(wrong)?;
    let points = header.checked_points().map_err(wrong)?;
    match &*format {
        "ascii" => ascii(&fields, points, rest),
        "binary" => {
            // Some writers pad the data to whole pages.
            let size = points.saturating_mul(stride);
            let bytes = rest.get(..size).unwrap_or(rest);
            Cloud::of_bytes(&fields, PointBytes { bytes, count: points, stride })
        }
        "binary_compressed" => {
            let bytes = by_points(&fields, points, stride, rest)?;
            Cloud::of_bytes(&fields, PointBytes { bytes: &bytes, count: points, stride })
        }
        _ => Err(ScanFileProblem::PcdData(format)),
    }
}

impl Header {
    /// Returns the fields and the number of bytes of a point.
    fn layout(&self) -> Result<(Vec<Field>, usize), String> {
        if self.fields.is_empty() {
            return Err("there is no line `FIELDS`".to_owned());
        }
        let count = self.fields.len();
        let counts = self.counts.clone().unwrap_or_else(|| vec![1; count]);
        for (key, length) in [("SIZE", self.sizes.len()), ("TYPE", self.types.len()), ("COUNT", counts.len())] {
            if length != count {
                return Err(format!("`{key}` has {length} values, but `FIELDS` has {count}"));
            }
        }
        let (mut fields, mut offset) = (Vec::with_capacity(count), 0_usize);
        for (index, name) in self.fields.iter().enumerate() {
            let number = match (&*self.types[index], self.sizes[index]) {
                ("I", 1) => Number::I8,
                ("U", 1) => Number::U8,
                ("I", 2) => Number::I16,
                ("U", 2) => Number::U16,
                ("I", 4) => Number::I32,
                ("U", 4) => Number::U32,
                ("F", 4) => Number::F32,
                ("F", 8) => Number::F64,
                (kind, size) => {
                    return Err(format!(
                        "the field `{name}` has the type {kind} with {size} bytes; I and U with 1, 2 or 4 and F with 4 or 8 are read"
                    ));
                }
            };
            // Each of the values of a field has a column of its own in the data; only the first has
            // a name.
            for value in 0..counts[index].min(MAX_POINTS) {
                let name = if value == 0 { name.clone() } else { String::new() };
                fields.push(Field { name, number, offset });
                offset += number.size();
            }
        }
        Ok((fields, offset))
    }

    fn checked_points(&self) -> Result<usize, String> {
        let area = self.width.zip(self.height).and_then(|(width, height)| width.checked_mul(height));
        match (self.points.or(area), area) {
            (None, _) => Err("there is no line `POINTS`".to_owned()),
            (Some(points), Some(area)) if points != area => {
                Err(format!("`POINTS` is {points}, but `WIDTH` times `HEIGHT` is {area}"))
            }
            (Some(points), _) if points > MAX_POINTS => {
                Err(format!("`POINTS` is {points}; at most {MAX_POINTS} are read"))
            }
            (Some(points), _) => Ok(points),
        }
    }
}

fn ascii(fields: &[Field], points: usize, text: &[u8]) -> Result<Cloud, ScanFileProblem> {
    let text = std::str::from_utf8(text).map_err(|_| ScanFileProblem::Points("the points are not text".to_owned()))?;
    let mut rows = Vec::with_capacity(points);
    for (point, line) in text.lines().filter(|line| !line.trim().is_empty()).enumerate() {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if words.len() != fields.len() {
            let message = format!("point {point} has {} values, but the header states {}", words.len(), fields.len());
            return Err(ScanFileProblem::Points(message));
        }
        let values: Result<Vec<f64>, &str> = words.iter().map(|word| word.parse().map_err(|_| *word)).collect();
        match values {
            Ok(values) => rows.push(values),
            Err(word) => {
                return Err(ScanFileProblem::Points(format!("point {point} has `{word}`, which is not a number")));
            }
        }
    }
    if rows.len() != points {
        let message = format!("there are {} points, but the header states {points}", rows.len());
        return Err(ScanFileProblem::Points(message));
    }
    Cloud::of_rows(fields, &rows)
}

/// Decompresses points. The values lie field by field in the compressed data, and point by point in
/// the result.
fn by_points(fields: &[Field], points: usize, stride: usize, data: &[u8]) -> Result<Vec<u8>, ScanFileProblem> {
    const SIZES: usize = 8;
    let size_at =
        |offset: usize| -> Option<usize> { Some(u32::from_le_bytes(*data.get(offset..)?.first_chunk()?) as usize) };
    let cut = ScanFileProblem::Compressed("they end too early");
    let (Some(compressed), Some(size)) = (size_at(0), size_at(SIZES / 2)) else { return Err(cut) };
    let Some(compressed) = data.get(SIZES..).and_then(|data| data.get(..compressed)) else { return Err(cut) };
    if points.checked_mul(stride) != Some(size) {
        return Err(ScanFileProblem::Size { actual: size, points, stride });
    }
    let by_fields = super::lzf::decompress(compressed, size).map_err(ScanFileProblem::Compressed)?;
    let mut bytes = vec![0; size];
    let mut from = 0;
    for field in fields {
        let width = field.number.size();
        for point in 0..points {
            let at = point * stride + field.offset;
            bytes[at..at + width].copy_from_slice(&by_fields[from..from + width]);
            from += width;
        }
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str =
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n";

    fn options() -> ScanOptions {
        ScanOptions { lidars: vec!["rear-lidar"], ..ScanOptions::default() }
    }

    fn read(bytes: &[u8]) -> Result<Vec<[f32; 3]>, String> {
        let cloud = parse(bytes).map_err(|problem| problem.to_string())?;
        let points = cloud.into_points(Time::ZERO, &options()).map_err(|problem| problem.to_string())?;
        Ok((0..points.len()).map(|point| [0, 1, 2].map(|axis| points.at_m[axis][point])).collect())
    }

    #[test]
    fn text_binary_and_compressed_points_are_the_same() {
        let expected = vec![[-12.5, 1.25, 0.5], [-3.0, -2.0, 0.75]];
        let text = format!("{HEADER}DATA ascii\n-12.5 1.25 0.5\n-3 -2 0.75\n");
        assert_eq!(read(text.as_bytes()), Ok(expected.clone()));
        let point_by_point: Vec<u8> = expected.iter().flatten().flat_map(|value: &f32| value.to_le_bytes()).collect();
        let binary = [format!("{HEADER}DATA binary\n").as_bytes(), &point_by_point].concat();
        assert_eq!(read(&binary), Ok(expected.clone()));
        let by_field: Vec<u8> = [0, 1, 2]
            .iter()
            .flat_map(|axis| expected.iter().flat_map(move |point| point[*axis].to_le_bytes()))
            .collect();
        // All bytes as literals: a control byte of 23 introduces 24 of them.
        let compressed = [&25_u32.to_le_bytes()[..], &24_u32.to_le_bytes(), &[23], &by_field].concat();
        let bytes = [format!("{HEADER}DATA binary_compressed\n").as_bytes(), &compressed].concat();
        assert_eq!(read(&bytes), Ok(expected));
    }

    #[test]
    fn a_wrong_file_gets_a_message_that_says_what_is_allowed() {
        let with = |header: String, points: &str| read(format!("{header}{points}").as_bytes()).unwrap_err();
        let two = "DATA ascii\n1 2 3\n4 5 6\n";
        for (header, data, expected) in [
            (HEADER.replace("x y z", "y z w"), two, "no field `x`, only y, z, w"),
            (HEADER.replace("SIZE 4 4 4", "SIZE 4 4"), two, "`SIZE` has 2 values, but `FIELDS` has 3"),
            (HEADER.replace("SIZE 4 4 4", "SIZE 4 4 2"), two, "`z` has the type F with 2 bytes; I and U"),
            (HEADER.replace("POINTS 2", "POINTS 3"), two, "`POINTS` is 3, but `WIDTH` times `HEIGHT` is 2"),
            (HEADER.replace("POINTS 2", "POINTS two"), two, "`POINTS two` needs whole numbers"),
            (HEADER.replace("VERSION 0.7", "VIEWPOINT 1 0 0 1 0 0 0"), two, "only `VIEWPOINT 0 0 0 1 0 0 0` is read"),
            (HEADER.to_owned(), "DATA ascii\n1 2 3\n4 5\n", "point 1 has 2 values, but the header states 3"),
            (HEADER.to_owned(), "DATA ascii\n1 2 3\n4 5 b\n", "point 1 has `b`, which is not a number"),
            (HEADER.to_owned(), "DATA ascii\n1 2 3\n", "there are 1 points, but the header states 2"),
            (HEADER.to_owned(), "DATA binary\n1234", "have 4 bytes, but 2 points of 12 bytes are stated"),
            (HEADER.to_owned(), "DATA binary_big\n", "`binary_big` is unknown; `ascii`, `binary` and"),
            (HEADER.to_owned(), "DATA binary_compressed\n", "they end too early"),
            (HEADER.to_owned(), "", "there is no line `DATA`"),
            (HEADER.replace("x y z", "x x z"), two, "the field `x` is there twice; one is needed"),
            (HEADER.replace("x y z", "x x z"), "DATA binary\n", "the field `x` is there twice; one is needed"),
            (HEADER.replace("HEIGHT 1", "HEIGHT 1\nWIDTH 2"), two, "the header line `WIDTH` is there twice"),
        ] {
            let message = with(header, data);
            assert!(message.contains(expected), "{message} instead of {expected}");
        }
    }
}
