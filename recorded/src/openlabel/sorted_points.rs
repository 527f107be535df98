//! Sorts the points of all tracks by time, in temporary files.
//!
//! Tracks arrive one after the other, but a frame holds the vehicles of one instant. The points of
//! five million rows would take 270 MB of memory. An external merge sort needs less: it sorts runs
//! of points, writes each run to a file, and merges the runs.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

use closecall_traffic::{Time, TrajectoryPoint};

/// Number of points of a run: 64 MB.
const RUN_POINTS: usize = 1 << 20;

/// Offsets of the parts of a point in a file (bytes): time, track, five numbers, lane.
const TRACK_AT: usize = 8;
const NUMBERS_AT: usize = TRACK_AT + 4;
const LANE_AT: usize = NUMBERS_AT + 5 * 8;
/// Length of a point in a file (bytes).
const POINT_BYTES: usize = LANE_AT + 1;

/// A point of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LabelledPoint {
    pub(super) time: Time,
    /// Index of the track.
    pub(super) track: u32,
    pub(super) s_m: f64,
    pub(super) d_m: f64,
    pub(super) speed_mps: f64,
    pub(super) acceleration_mps2: f64,
    pub(super) lateral_speed_mps: f64,
    pub(super) lane: u8,
}

impl LabelledPoint {
    pub(super) fn new(track: u32, point: &TrajectoryPoint) -> Self {
        let &TrajectoryPoint { time, s_m, d_m, speed_mps, acceleration_mps2, lateral_speed_mps, lane, .. } = point;
        Self { time, track, s_m, d_m, speed_mps, acceleration_mps2, lateral_speed_mps, lane: lane.0 }
    }

    fn key(&self) -> (Time, u32) {
        (self.time, self.track)
    }

    fn numbers(&self) -> [f64; 5] {
        [self.s_m, self.d_m, self.speed_mps, self.acceleration_mps2, self.lateral_speed_mps]
    }

    fn write(&self, file: &mut impl Write) -> io::Result<()> {
        file.write_all(&self.time.ns().to_le_bytes())?;
        file.write_all(&self.track.to_le_bytes())?;
        self.numbers().iter().try_for_each(|number| file.write_all(&number.to_le_bytes()))?;
        file.write_all(&[self.lane])
    }

    fn read(file: &mut impl Read) -> io::Result<Self> {
        fn part<const N: usize>(bytes: &[u8; POINT_BYTES], offset: usize) -> [u8; N] {
            std::array::from_fn(|index| bytes[offset + index])
        }
        let mut bytes = [0; POINT_BYTES];
        file.read_exact(&mut bytes)?;
        let number = |index: usize| f64::from_le_bytes(part(&bytes, NUMBERS_AT + 8 * index));
        Ok(Self {
            time: Time::from_ns(i64::from_le_bytes(part(&bytes, 0))),
            track: u32::from_le_bytes(part(&bytes, TRACK_AT)),
            s_m: number(0),
            d_m: number(1),
            speed_mps: number(2),
            acceleration_mps2: number(3),
            lateral_speed_mps: number(4),
            lane: bytes[LANE_AT],
        })
    }
}

/// A sorted run in a temporary file, which the system removes.
struct Run {
    file: File,
    points: usize,
}

/// Gathers points in any order.
pub(super) struct PointSorter {
    /// Folder of the temporary files.
    folder: PathBuf,
    points: Vec<LabelledPoint>,
    runs: Vec<Run>,
}

impl PointSorter {
    /// Creates a sorter with temporary files in `folder`.
    pub(super) fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), points: Vec::new(), runs: Vec::new() }
    }

    /// Adds a point.
    ///
    /// # Errors
    /// A temporary file cannot be written.
    pub(super) fn push(&mut self, point: LabelledPoint) -> io::Result<()> {
        self.points.push(point);
        if self.points.len() >= RUN_POINTS { self.end_run() } else { Ok(()) }
    }

    fn end_run(&mut self) -> io::Result<()> {
        self.points.sort_unstable_by_key(LabelledPoint::key);
        let mut file = BufWriter::new(tempfile::tempfile_in(&self.folder)?);
        self.points.iter().try_for_each(|point| point.write(&mut file))?;
        let mut file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.rewind()?;
        self.runs.push(Run { file, points: self.points.len() });
        self.points.clear();
        Ok(())
    }

    /// Returns the points in the order of their times, then of their tracks.
    ///
    /// # Errors
    /// A temporary file cannot be written or read.
    pub(super) fn sorted(mut self) -> io::Result<SortedPoints> {
        self.points.sort_unstable_by_key(LabelledPoint::key);
        let mut sorted = SortedPoints { sources: Vec::new(), heads: Vec::new(), order: BinaryHeap::new() };
        sorted.add(Source::Memory(self.points.into_iter()))?;
        for Run { file, points } in self.runs {
            sorted.add(Source::File { file: BufReader::new(file), left: points })?;
        }
        Ok(sorted)
    }
}

/// One sorted run: the last one is still in memory.
enum Source {
    Memory(std::vec::IntoIter<LabelledPoint>),
    File { file: BufReader<File>, left: usize },
}

impl Source {
    fn next(&mut self) -> io::Result<Option<LabelledPoint>> {
        match self {
            Self::Memory(points) => Ok(points.next()),
            Self::File { left: 0, .. } => Ok(None),
            Self::File { file, left } => {
                *left -= 1;
                LabelledPoint::read(file).map(Some)
            }
        }
    }
}

/// The merge of the sorted runs: an iterator over all points.
pub(super) struct SortedPoints {
    sources: Vec<Source>,
    /// The next point of each source.
    heads: Vec<Option<LabelledPoint>>,
    /// Keys of the next points, and their sources.
    order: BinaryHeap<Reverse<((Time, u32), usize)>>,
}

impl SortedPoints {
    fn add(&mut self, source: Source) -> io::Result<()> {
        self.sources.push(source);
        self.heads.push(None);
        self.advance(self.sources.len() - 1)
    }

    /// Reads the next point of a source, and puts its key into the order.
    fn advance(&mut self, source: usize) -> io::Result<()> {
        let next = self.sources[source].next()?;
        self.order.extend(next.map(|point| Reverse((point.key(), source))));
        self.heads[source] = next;
        Ok(())
    }

    /// Returns the next point.
    ///
    /// # Errors
    /// A temporary file cannot be read.
    pub(super) fn next(&mut self) -> io::Result<Option<LabelledPoint>> {
        let Some(Reverse((_, source))) = self.order.pop() else { return Ok(None) };
        let point = self.heads[source];
        self.advance(source)?;
        Ok(point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(ms: i64, track: u32) -> LabelledPoint {
        let s_m = 0.1 * ms as f64;
        LabelledPoint {
            time: Time::from_ms(ms),
            track,
            s_m,
            d_m: -1.75,
            speed_mps: 1.0 / 3.0,
            acceleration_mps2: -0.0,
            lateral_speed_mps: 1e-300,
            lane: 7,
        }
    }

    #[test]
    fn points_of_several_runs_come_back_unchanged_and_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let mut sorter = PointSorter::new(folder.path());
        for track in 0..4 {
            for ms in 0..30 {
                sorter.push(point(1_000 - 10 * ms + i64::from(track % 2), track)).unwrap();
                if ms == 17 {
                    sorter.end_run().unwrap();
                }
            }
        }
        let mut sorted = sorter.sorted().unwrap();
        let points: Vec<_> = std::iter::from_fn(|| sorted.next().unwrap()).collect();
        assert_eq!(points.len(), 120);
        assert!(points.windows(2).all(|pair| pair[0].key() < pair[1].key()));
        assert!(points.iter().all(|read| *read == point(read.time.ns() / 1_000_000, read.track)));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "no temporary file stays");
    }
}
