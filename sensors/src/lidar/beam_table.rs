//! The pattern of a LiDAR that does not scan a raster, as a table of the directions and times of
//! its beams.
//!
//! ```text
//!   azimuth_deg,elevation_deg,time_offset_us        azimuth: to the sensor's left as it looks, about its axis
//!   -12.40,0.35,0.0                                 elevation: upward
//!   3.15,-1.20,10.0                                 time: after the beginning of the scan
//! ```
//!
//! Each beam becomes a column of one layer, in the order of the azimuths; beams of the same azimuth
//! keep the order of the table. The whole scan then works as a raster does, except for the
//! time: neighbouring columns are measured at any times. A vehicle is therefore cast at the mean
//! time of the beams near its azimuth, and the range of each beam follows from the motion of the
//! face that the beam hits ([`FaceDrift`](super::targets::FaceDrift)).
//!
//! The reader is our own: three columns of numbers need no quotes, and each error has to name line,
//! column and allowed range.

use closecall_traffic::{ConfigError, KeyPath, Problem, Range};

/// Greatest elevation of a beam (°).
pub(super) const MAX_ELEVATION_DEG: f64 = 45.0;
/// Greatest number of beams in a scan: beams are numbered with 16 bits.
pub(super) const MAX_BEAMS: usize = 65_535;
/// The first line of a table.
const HEADER: &str = "azimuth_deg,elevation_deg,time_offset_us";
/// The key of a table in a pattern.
const KEY: &str = "beams";
/// The columns of a table.
const COLUMNS: [&str; 3] = ["azimuth_deg", "elevation_deg", "time_offset_us"];
/// Half of the range of azimuths whose beams count as near (deg; assumption): a car 50 m away is 2°
/// wide.
const NEIGHBOURHOOD_DEG: f64 = 1.0;

/// The reason why a file with a table of beams is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BeamFileError {
    /// The first line does not name the columns.
    #[error("the first line is `{actual}`, but `{}` is needed", HEADER)]
    Header {
        /// The line in the file.
        actual: String,
    },
    /// A line has another number of columns.
    #[error("the line has {actual} columns, but {} are needed", COLUMNS.len())]
    Columns {
        /// Number of the line, counted from 1.
        line: usize,
        /// The number of columns in the file.
        actual: usize,
    },
    /// A value is not a number, or out of its range.
    #[error("column `{column}` is `{actual}`, but {allowed} is needed")]
    Number {
        /// Number of the line, counted from 1.
        line: usize,
        /// Name of the column.
        column: &'static str,
        /// The text in the file.
        actual: String,
        /// What is allowed.
        allowed: Range,
    },
}

impl BeamFileError {
    /// Returns the number of the line, counted from 1.
    pub fn line(&self) -> usize {
        match self {
            Self::Columns { line, .. } | Self::Number { line, .. } => *line,
            Self::Header { .. } => 1,
        }
    }
}

/// The limits of the values of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BeamLimits {
    /// Half of the horizontal field of view (deg).
    pub(super) half_field_deg: f64,
    /// Scans per second (Hz).
    pub(super) rate_hz: f64,
}

impl BeamLimits {
    /// Returns the allowed azimuths (deg), elevations (deg) and times (µs).
    fn ranges(self) -> [Range; 3] {
        [
            Range::closed(-self.half_field_deg, self.half_field_deg),
            Range::closed(-MAX_ELEVATION_DEG, MAX_ELEVATION_DEG),
            Range::closed(0.0, 1e6 / self.rate_hz),
        ]
    }
}

/// Reads a file with a table of beams: the azimuth (deg), the elevation (deg) and the time (µs) of
/// each beam, in the order of the file.
pub(super) fn read(text: &str, limits: BeamLimits) -> Result<Vec<[f64; 3]>, BeamFileError> {
    let mut lines = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim()));
    let first = lines.next().map_or("", |(_, line)| line);
    if first != HEADER {
        return Err(BeamFileError::Header { actual: first.to_owned() });
    }
    let ranges = limits.ranges();
    lines.filter(|(_, row)| !row.is_empty()).map(|(line, row)| beam(line, row, &ranges)).collect()
}

/// Reads the beam of a line.
fn beam(line: usize, row: &str, ranges: &[Range; 3]) -> Result<[f64; 3], BeamFileError> {
    let cells: Vec<&str> = row.split(',').map(str::trim).collect();
    if cells.len() != COLUMNS.len() {
        return Err(BeamFileError::Columns { line, actual: cells.len() });
    }
    let mut values = [0.0; 3];
    for (index, value) in values.iter_mut().enumerate() {
        let number = cells[index].parse::<f64>().ok().filter(|number| ranges[index].contains(*number));
        *value = number.ok_or_else(|| BeamFileError::Number {
            line,
            column: COLUMNS[index],
            actual: cells[index].to_owned(),
            allowed: ranges[index],
        })?;
    }
    Ok(values)
}

/// The beams of a scan, in the order of their azimuths. All lists have the same length.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BeamTable {
    /// Azimuth of each beam (deg).
    pub(super) azimuths_deg: Vec<f64>,
    /// Elevation of each beam (deg).
    pub(super) elevations_deg: Vec<f64>,
    /// Time of measurement of each beam after the beginning of the scan (ns).
    pub(super) offsets_ns: Vec<u32>,
}

impl BeamTable {
    /// Checks the azimuth (deg), the elevation (deg) and the time (µs) of each beam.
    ///
    /// # Errors
    /// [`ConfigError`] at the first wrong number.
    pub(super) fn new(beams: &[[f64; 3]], limits: BeamLimits) -> Result<Self, ConfigError> {
        if !(1..=MAX_BEAMS).contains(&beams.len()) {
            let problem = Problem::WrongLength { value: beams.len() as u64, allowed: "1 to 65,535" };
            return Err(ConfigError::new(KEY, problem));
        }
        for (index, beam) in beams.iter().enumerate() {
            for (column, (value, range)) in beam.iter().zip(limits.ranges()).enumerate() {
                if !range.contains(*value) {
                    let problem = Problem::OutOfRange { value: *value, allowed: range };
                    let at = ConfigError { path: KeyPath::default(), problem };
                    return Err(at.within_index(column).within_index(index).within(KEY));
                }
            }
        }
        let mut beams = beams.to_vec();
        // The order is stable, so that the same table always gives the same beams.
        beams.sort_by(|[a, ..], [b, ..]| a.total_cmp(b));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be 0 to 1 s")]
        let offset_ns = |time_us: f64| (time_us * 1e3).round() as u32;
        Ok(Self {
            azimuths_deg: beams.iter().map(|[azimuth_deg, ..]| *azimuth_deg).collect(),
            elevations_deg: beams.iter().map(|[_, elevation_deg, _]| *elevation_deg).collect(),
            offsets_ns: beams.iter().map(|[.., time_us]| offset_ns(*time_us)).collect(),
        })
    }

    /// Returns the least and the greatest elevation (deg).
    pub(super) fn elevation_bounds_deg(&self) -> [f64; 2] {
        let fold = |from: f64, pick: fn(f64, f64) -> f64| self.elevations_deg.iter().copied().fold(from, pick);
        [fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Returns the time of the last beam after the beginning of the scan (ns).
    pub(super) fn duration_ns(&self) -> u32 {
        self.offsets_ns.iter().copied().max().unwrap_or(0)
    }

    /// Returns the numbers of beams within `margin_deg` of the left and of the right end of the
    /// field of view, as the pattern orders them: first the lowest azimuths.
    pub(super) fn edge_beams(&self, half_field_deg: f64, margin_deg: f64) -> [usize; 2] {
        let low = self.azimuths_deg.partition_point(|azimuth_deg| *azimuth_deg < margin_deg - half_field_deg);
        let high = self.azimuths_deg.partition_point(|azimuth_deg| *azimuth_deg <= half_field_deg - margin_deg);
        [low, self.azimuths_deg.len() - high]
    }

    /// Returns the mean time of the beams near an azimuth after the beginning of the scan (s).
    /// Where there are none, returns the mean time of all beams.
    pub(super) fn mean_offset_s(&self, azimuth_deg: f64) -> f64 {
        let end = |limit_deg: f64| self.azimuths_deg.partition_point(|beam_deg| *beam_deg < limit_deg);
        let near = end(azimuth_deg - NEIGHBOURHOOD_DEG)..end(azimuth_deg + NEIGHBOURHOOD_DEG);
        let offsets_ns = if near.is_empty() { &self.offsets_ns[..] } else { &self.offsets_ns[near] };
        let sum_ns: f64 = offsets_ns.iter().map(|offset_ns| f64::from(*offset_ns)).sum();
        sum_ns * 1e-9 / offsets_ns.len() as f64
    }

    /// Returns the number of the beam whose direction is nearest to this azimuth and elevation
    /// (deg).
    pub(super) fn nearest(&self, [azimuth_deg, elevation_deg]: [f64; 2]) -> Option<u16> {
        let off = |beam: usize| {
            let [across, up] = [self.azimuths_deg[beam] - azimuth_deg, self.elevations_deg[beam] - elevation_deg];
            across * across + up * up
        };
        let end = |limit_deg: f64| self.azimuths_deg.partition_point(|beam_deg| *beam_deg < limit_deg);
        let nearest_of = |mut beams: std::ops::Range<usize>| {
            let first = beams.next()?;
            Some(beams.fold(first, |best, beam| if off(beam) < off(best) { beam } else { best }))
        };
        let near = nearest_of(end(azimuth_deg - NEIGHBOURHOOD_DEG)..end(azimuth_deg + NEIGHBOURHOOD_DEG));
        // A beam that is farther away in azimuth is farther away.
        let is_nearest = |beam: &usize| off(*beam) <= NEIGHBOURHOOD_DEG * NEIGHBOURHOOD_DEG;
        let nearest = near.filter(is_nearest).or_else(|| nearest_of(0..self.azimuths_deg.len()))?;
        u16::try_from(nearest).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: BeamLimits = BeamLimits { half_field_deg: 60.0, rate_hz: 10.0 };

    fn table(rows: &str) -> BeamTable {
        BeamTable::new(&read(&format!("{HEADER}\n{rows}"), LIMITS).unwrap(), LIMITS).unwrap()
    }

    #[test]
    fn beams_are_ordered_by_azimuth_and_keep_the_order_of_the_table_otherwise() {
        let table = table("3,1,30\n-2.5,0.5,10\r\n3,-1,20.5\n\n");
        assert_eq!(table.azimuths_deg, [-2.5, 3.0, 3.0]);
        assert_eq!(table.elevations_deg, [0.5, 1.0, -1.0]);
        assert_eq!(table.offsets_ns, [10_000, 30_000, 20_500]);
        assert_eq!((table.elevation_bounds_deg(), table.duration_ns()), ([-1.0, 1.0], 30_000));
        assert_eq!(table.nearest([2.8, -0.4]), Some(2));
    }

    #[test]
    fn a_wrong_file_is_answered_with_line_column_and_allowed_range() {
        let refused = |rows: &str| {
            let error = read(&format!("{HEADER}\n{rows}"), LIMITS).unwrap_err();
            (error.line(), error.to_string())
        };
        let of_azimuth = "column `azimuth_deg` is `60.1`, but a number from -60 to 60 is needed";
        assert_eq!(refused("1,2,3\n60.1,0,0"), (3, of_azimuth.to_owned()));
        let of_elevation = "column `elevation_deg` is `NaN`, but a number from -45 to 45 is needed";
        assert_eq!(refused("1,NaN,3"), (2, of_elevation.to_owned()));
        let of_time = "column `time_offset_us` is `100000.5`, but a number from 0 to 100000 is needed";
        assert_eq!(refused("1,2,100000.5"), (2, of_time.to_owned()));
        assert_eq!(refused("1,2"), (2, "the line has 2 columns, but 3 are needed".to_owned()));
        let error = read("azimuth,elevation,time\n1,2,3", LIMITS).unwrap_err();
        assert!(error.to_string().contains("`azimuth_deg,elevation_deg,time_offset_us` is needed"), "{error}");
    }

    #[test]
    fn a_wrong_table_is_answered_with_the_place_of_the_number() {
        let refused = |beams: &[[f64; 3]]| BeamTable::new(beams, LIMITS).unwrap_err().to_string();
        assert_eq!(refused(&[]), "`beams` has 0 entries, but 1 to 65,535 are allowed");
        let of_elevation = "`beams[1][1]` is -50, but a number from -45 to 45 is needed";
        assert_eq!(refused(&[[1.0, 2.0, 3.0], [1.0, -50.0, 3.0]]), of_elevation);
    }

    #[test]
    fn a_vehicle_is_scanned_at_the_mean_time_of_the_beams_near_its_azimuth() {
        let table = table("0,0,10\n0.5,0,30\n20,0,1000\n21.5,0,5000");
        assert!((table.mean_offset_s(0.2) - 20e-6).abs() < 1e-12);
        assert!((table.mean_offset_s(20.2) - 1e-3).abs() < 1e-12);
        // Nothing is scanned there.
        assert!((table.mean_offset_s(-40.0) - 1.51e-3).abs() < 1e-12);
    }

    #[test]
    fn the_beams_at_the_ends_of_the_field_of_view_are_known() {
        let table = table("-59.5,0,0\n-58,0,0\n0,0,0\n59.2,0,0\n60,0,0");
        assert_eq!(table.edge_beams(60.0, 1.0), [1, 2]);
    }
}
