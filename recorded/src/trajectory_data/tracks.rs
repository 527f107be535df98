//! The output of every reader: complete tracks, one after the other.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use closecall_traffic::Time;

use super::assemble::step;
use super::axes::{self, Axes, AxisOptions};
use super::builder::TrackBuilder;
use super::class_names::UnknownClass;
use super::collected::is_lane_jump;
use super::common_crossings;
use super::continuity::{Continuity, FrameClock};
use super::data::{RecordedTrack, TrajectoryData};
use super::error::{TrajectoryFileError, TrajectoryFileProblem};
use super::estimated_lanes::{EstimatedLanes, NoLanesShown};
use super::file_layout::Layout;
use super::frame_times::{self, Ticks};
use super::input::Digest;
use super::lane_spacing;
use super::markings::LaneMarkings;
use super::ngsim;
use super::order::{WINDOW_ROWS, order_of};
use super::overlaps;
use super::plausible;
use super::side_by_side::{self, SideBySide};
use super::sides::Sides;
use super::skipped_rows::SkippedRows;
use super::source::{Clock, FileInfo, ReadError, Row, RowSource};
use crate::lane_change::LaneReliability;

/// Minimum time that counts from 1970 instead of from the start of the file: one day.
const MIN_EPOCH_TIME: Time = Time::from_ms(86_400_000);

/// Time between two data sets in one file after shifting them, so that their vehicles never meet.
const SEPARATION: Time = Time::from_ms(10_000);

/// Largest number of rows that are held at once: four times the rows of all NGSIM motorway data,
/// about 8 GiB.
const MAX_ROWS: usize = 50_000_000;

/// Number of pieces per vehicle above which short pieces are shreds.
const SHREDS_PER_VEHICLE: u64 = 3;
/// Mean duration below which pieces are shreds (s): no lane change fits into it.
const SHRED_S: f64 = 2.0;

/// Longest time between two frames at which no lane change is missed. The published method samples
/// at 5 Hz. In a window of US-101, frames of 0.3 s show all 21 lane changes, frames of 0.4 s 18 to 21.
const LONGEST_PERIOD: Time = Time::from_ms(300);

/// Smallest number of unusable rows that can be most of a file: fewer rows are damaged ones.
const LEAST_BAD_ROWS: u64 = 20;

/// One in this number of rows may be left out because its number belongs to another vehicle, too, before lane changes
/// are missing. An assumption with a plausible range of 20 to 1,000.
const ONE_SHARED_IN: u64 = 100;

/// The doubt about a road that was derived from traffic without lanes.
const NO_LANES_ALONG_THE_ROAD: &str = "the vehicles drive in no lanes along the road that was derived from the traffic: the road is another one, and a \
     lateral shift may be no lane change";

/// Options for reading a trajectory file.
#[derive(Clone, Copy, Debug, Default)]
pub struct ReadOptions {
    /// Required layout. If it is `None`, the content determines the layout.
    pub layout: Option<LayoutChoice>,
    /// Treatment of unusable rows.
    pub bad_rows: BadRows,
    /// Directions of the file that differ from the documented ones.
    pub axes: AxisOptions,
    /// Whether lane changes are found by the recorded lanes.
    pub lanes: LaneReliability,
    /// The data set to read of a file that holds several, by its name in the file.
    pub location: Option<&'static str>,
}

/// A layout that a caller can require by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LayoutChoice {
    /// NGSIM's columns.
    Ngsim,
    /// The three files of a highD or exiD data set.
    Highd,
    /// CommonRoad XML.
    Commonroad,
    /// The plain layout.
    Csv,
    /// A log of one vehicle that sees the lane markings.
    InCar,
    /// Floating car data of SUMO.
    Sumo,
    /// A vehicle record of Vissim.
    Vissim,
    /// Trajectories of I-24 MOTION.
    I24,
    /// ASAM OpenLABEL.
    OpenLabel,
    /// Messages of ASAM OSI.
    Osi,
}

impl LayoutChoice {
    /// Returns the name of the layout on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ngsim => "ngsim",
            Self::Highd => "highd",
            Self::Commonroad => "commonroad",
            Self::Csv => "csv",
            Self::InCar => "in-car",
            Self::Sumo => "sumo",
            Self::Vissim => "vissim",
            Self::I24 => "i24",
            Self::OpenLabel => "openlabel",
            Self::Osi => "osi",
        }
    }

    /// Returns `true` if `layout` is one of the layouts that the choice covers.
    pub fn includes(self, layout: Layout) -> bool {
        let choice = match layout {
            Layout::Plain => Self::Csv,
            Layout::Ngsim18 | Layout::Ngsim25 => Self::Ngsim,
            Layout::Highd | Layout::Exid => Self::Highd,
            Layout::Commonroad => Self::Commonroad,
            Layout::InCar => Self::InCar,
            Layout::Sumo => Self::Sumo,
            Layout::Vissim => Self::Vissim,
            Layout::I24 => Self::I24,
            Layout::OpenLabel => Self::OpenLabel,
            Layout::Osi => Self::Osi,
        };
        choice == self
    }
}

/// Treatment of rows that cannot be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BadRows {
    /// The first such row ends the reading with an error. None of the file's data is used.
    #[default]
    Reject,
    /// Such rows are skipped and counted, with the reason and the line of the first such row.
    Skip,
}

/// The tracks of a trajectory file. Each becomes available as soon as it is complete.
pub struct Tracks<'a> {
    path: PathBuf,
    source: Box<dyn RowSource + 'a>,
    digest: Digest,
    bad_rows: BadRows,
    axis_options: AxisOptions,
    axes: Axes,
    /// What a reader of results has to know of the axes.
    axis_warning: Option<String>,
    /// Why the recorded lanes are in doubt.
    lane_doubt: Option<String>,
    /// Why the times, the positions, the speeds, the accelerations or the numbers of vehicles are in doubt.
    row_doubts: Vec<String>,
    /// Why lanes that the positions show are in doubt.
    crossing_doubt: Option<String>,
    /// What shows which side is left.
    sides: Sides,
    /// `true` if the file is of a simulation, in which a lane change may take a single step.
    is_simulated: bool,
    /// `true` if it changes lanes in single steps, which no distance between frames hides.
    jumps_to_lanes: bool,
    lanes: LaneReliability,
    /// The lanes that are estimated from the traffic, or the reason why they cannot be.
    estimated: Option<Result<EstimatedLanes, NoLanesShown>>,
    builder: TrackBuilder,
    /// Rows of the window that are not yet in the builder, in their documented directions.
    window: std::vec::IntoIter<Row>,
    period: Time,
    /// The clock of the file, if its times are rounded, or jitter.
    ticks: Option<Ticks>,
    markings: LaneMarkings,
    dropped: SkippedRows,
    rows: u64,
    ended: bool,
}

impl<'a> Tracks<'a> {
    /// Reads the first `window` rows, or all rows if the file is not longer.
    pub(super) fn new(
        path: &Path,
        digest: Digest,
        mut source: Box<dyn RowSource + 'a>,
        options: ReadOptions,
        window: usize,
    ) -> Result<Self, TrajectoryFileError> {
        if options.axes.reverse_s {
            source.expect_reversed();
        }
        if options.lanes != LaneReliability::Reliable {
            source.expect_no_lanes();
        }
        if options.axes.mirror_d {
            source.expect_mirrored();
        }
        let builder = TrackBuilder::for_sorted(FrameClock::every_frame(ngsim::PERIOD), Time::ZERO);
        let mut tracks = Self {
            path: path.to_owned(),
            source,
            digest,
            bad_rows: options.bad_rows,
            axis_options: options.axes,
            axes: Axes::default(),
            axis_warning: None,
            lane_doubt: None,
            row_doubts: Vec::new(),
            crossing_doubt: None,
            sides: Sides::Shown,
            is_simulated: false,
            jumps_to_lanes: false,
            lanes: options.lanes,
            estimated: None,
            builder,
            window: Vec::new().into_iter(),
            period: ngsim::PERIOD,
            ticks: None,
            markings: LaneMarkings::default(),
            dropped: SkippedRows::default(),
            rows: 0,
            ended: false,
        };
        tracks.read_window(window).map_err(|error| tracks.with_path(error))?;
        Ok(tracks)
    }

    /// Returns the name that the file states, or else the file name without its extension.
    pub fn name(&self) -> String {
        let file_name = self.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let stem = || file_name.split('.').next().unwrap_or_default().to_owned();
        self.source.info().name.unwrap_or_else(stem)
    }

    /// Returns the layout.
    pub fn layout(&self) -> Layout {
        self.source.info().layout
    }

    /// Returns the time between two frames.
    pub fn period(&self) -> Time {
        self.period
    }

    /// Returns `true` if the frames are too far apart for every lane change to be found.
    fn is_coarse(&self) -> bool {
        !self.jumps_to_lanes && self.mean_period() > LONGEST_PERIOD
    }

    /// Returns the mean time between two rows of a vehicle, without the frames that bridge gaps.
    fn mean_period(&self) -> Time {
        let bridged = self.builder.continuity().bridged_frames;
        let share = if self.rows > 0 { bridged as f64 / self.rows as f64 } else { 0.0 };
        self.period + Time::from_s(share * self.period.s())
    }

    /// Returns `true` if the file is of a simulation, in which a lane change may take a single step.
    pub fn is_simulated(&self) -> bool {
        self.is_simulated
    }

    /// Returns the lane markings that the file states, or else those derived from the tracks among
    /// the first [`WINDOW_ROWS`] rows.
    pub fn markings(&self) -> &LaneMarkings {
        &self.markings
    }

    /// Returns `true` if the file states its markings, or if they are estimated: further tracks do not
    /// change them.
    pub fn states_markings(&self) -> bool {
        matches!(self.estimated, Some(Ok(_))) || self.source.info().markings.is_some()
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of rows read so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Returns how the rows so far became tracks. If no lane is taken as recorded or estimated, none is
    /// changed.
    pub fn continuity(&self) -> Continuity {
        let continuity = self.builder.continuity();
        match self.lanes() {
            LaneReliability::Unreliable => Continuity {
                recorded_crossings: 0,
                hidden_crossings: 0,
                split_crossings: 0,
                edge_crossings: 0,
                ..continuity
            },
            LaneReliability::Reliable | LaneReliability::Estimated => continuity,
        }
    }

    /// Returns `true` if a warning on the file or on the rows so far says that lane changes may be
    /// wrong or missing, or that the recorded lanes are none.
    pub fn is_in_doubt(&self) -> bool {
        let is_of_file = self.lane_doubt.is_some()
            || !self.row_doubts.is_empty()
            || self.crossing_doubt.is_some()
            || self.source.is_in_doubt();
        let are_missing = ONE_SHARED_IN * self.dropped.of_shared_numbers() > self.rows;
        is_of_file
            || are_missing
            || self.cut_by_jumps().is_some()
            || self.sides.is_doubt()
            || self.is_coarse()
            || self.continuity().hides_lane_changes()
    }

    /// Returns the duration of all tracks so far together (s).
    fn recorded_s(&self) -> f64 {
        (self.rows - self.builder.continuity().repeated_rows) as f64 * self.period.s()
    }

    /// Returns the share of the lane changes that jumps cut off (-), if a result is in doubt by it.
    fn cut_by_jumps(&self) -> Option<f64> {
        self.builder.continuity().cut_by_jumps(self.recorded_s())
    }

    /// Returns `true` if a warning says that the recorded lanes are none: vehicles of one lane drive
    /// beside each other.
    pub fn doubts_lanes(&self) -> bool {
        self.lane_doubt.is_some()
    }

    /// Returns `true` if a warning says that left and right may be exchanged.
    pub fn doubts_sides(&self) -> bool {
        self.sides != Sides::Shown
    }

    /// Returns the rows skipped so far.
    pub fn dropped(&self) -> &SkippedRows {
        &self.dropped
    }

    /// Returns the unknown names of vehicle classes found so far, and the classes as which they are
    /// read.
    pub fn unknown_classes(&self) -> &[UnknownClass] {
        self.source.unknown_classes()
    }

    /// Returns by which lanes lane changes are found.
    pub fn lanes(&self) -> LaneReliability {
        if matches!(self.estimated, Some(Ok(_))) { LaneReliability::Estimated } else { self.lanes }
    }

    /// Returns what a reader of results has to know of the file and of the rows read so far.
    pub fn warnings(&self) -> Vec<String> {
        let unknown = self.unknown_classes().iter().map(ToString::to_string);
        self.notes().into_iter().chain(self.continuity().warnings()).chain(unknown).collect()
    }

    /// Returns what the reader and the estimate of the lanes note on the file.
    fn notes(&self) -> Vec<String> {
        let reason = self.estimated.as_ref().and_then(|estimated| estimated.as_ref().err());
        let unknown_lanes = reason.map(|reason| {
            format!(
                "the traffic does not show its lanes ({reason}): a lane change is a lateral shift by most of a lane, and it is \
                 located at half of the shift"
            )
        });
        let coarse = self.is_coarse().then(|| coarse_frames(self.mean_period()));
        let sides = self.sides.warning().map(str::to_owned);
        let doubts =
            self.axis_warning.iter().chain(&self.lane_doubt).chain(&self.row_doubts).chain(&self.crossing_doubt);
        let doubts = doubts.cloned().chain(sides);
        let shared = self.dropped.of_shared_numbers();
        let shared = (shared > 0).then(|| {
            format!(
                "{shared} of {} rows were left out because their vehicle is at another place in the same frame: a number belongs to \
                 several vehicles, and only one of them is read",
                self.rows
            )
        });
        let cut = self.cut_by_jumps().map(|share| {
            format!(
                "{} jumps that no vehicle makes, in {:.0} s of all tracks together, cut off about {:.0} % of the lane changes: numbers are \
                 not unique for each vehicle",
                self.builder.continuity().jumps,
                self.recorded_s(),
                100.0 * share
            )
        });
        let notes = self.source.warnings().into_iter().chain(doubts).chain(shared).chain(cut);
        notes.chain(coarse).chain(unknown_lanes).collect()
    }

    /// Returns the BLAKE3 hash of the bytes read so far, in hexadecimal digits. After the last
    /// track, it covers the whole file.
    pub fn hash(&self) -> String {
        self.digest.hex()
    }

    /// Returns the next complete track. Returns `None` after the last track and after an error.
    ///
    /// # Errors
    /// Returns a [`TrajectoryFileError`] with file, line, column and allowed values.
    pub fn next_track(&mut self) -> Result<Option<RecordedTrack>, TrajectoryFileError> {
        let next = self.advance();
        self.ended |= next.is_err();
        next.map_err(|error| self.with_path(error))
    }

    /// Collects all tracks.
    ///
    /// # Errors
    /// Fails as [`Tracks::next_track`] does.
    pub fn collect_all(mut self) -> Result<TrajectoryData, TrajectoryFileError> {
        let mut trajectories = Vec::new();
        while let Some(track) = self.next_track()? {
            trajectories.push(track.trajectory);
        }
        let FileInfo { layout, markings, .. } = self.source.info();
        let mut data = TrajectoryData::new(&self.name(), self.period, trajectories);
        if let Some(markings) = markings {
            data.markings = markings;
        }
        let (hash, continuity) = (self.hash(), self.continuity());
        let (notes, lanes, is_in_doubt) = (self.notes(), self.lanes(), self.is_in_doubt());
        let (doubts_lanes, doubts_sides) = (self.doubts_lanes(), self.doubts_sides());
        if let Some(estimated) = self.estimated_markings() {
            data.markings = estimated;
        }
        Ok(TrajectoryData {
            layout,
            hash,
            continuity,
            notes,
            lanes,
            is_in_doubt,
            doubts_lanes,
            doubts_sides,
            unknown_classes: self.unknown_classes().to_vec(),
            ..data
        })
    }

    /// Reads rows until the next track is complete.
    fn advance(&mut self) -> Result<Option<RecordedTrack>, ReadError> {
        loop {
            if let Some(track) = self.builder.pop() {
                return Ok(Some(track));
            }
            if let Some(row) = self.window.next() {
                self.push(row)?;
                continue;
            }
            if self.ended {
                return Ok(None);
            }
            // The rows of the window are no longer needed.
            self.window = Vec::new().into_iter();
            match self.next_row()? {
                Some(mut row) => {
                    self.snap(&mut row);
                    self.axes.turn(&mut row);
                    self.assign_lane(&mut row);
                    self.push(row)?;
                }
                None => {
                    self.ended = true;
                    self.finish()?;
                }
            }
        }
    }

    /// Returns the next usable row.
    fn next_row(&mut self) -> Result<Option<Row>, ReadError> {
        loop {
            match self.source.next_row() {
                Ok(Some(row)) => {
                    self.rows += 1;
                    return Ok(Some(row));
                }
                Ok(None) => return Ok(None),
                Err(error) => {
                    self.rows += 1;
                    self.drop_row(error)?;
                }
            }
        }
    }

    /// Returns the markings of the estimated lanes.
    fn estimated_markings(&self) -> Option<LaneMarkings> {
        self.estimated.as_ref().and_then(|estimated| estimated.as_ref().ok()).map(EstimatedLanes::markings)
    }

    /// Gives a row its estimated lane, if lanes are estimated.
    fn assign_lane(&self, row: &mut Row) {
        if let Some(Ok(estimated)) = &self.estimated {
            row.lane = estimated.at(row.d_m);
        }
    }

    /// Replaces a time that is rounded, or jitters.
    fn snap(&self, row: &mut Row) {
        if let Some(ticks) = &self.ticks {
            ticks.snap(row);
        }
    }

    fn push(&mut self, row: Row) -> Result<(), ReadError> {
        self.builder.push(row).or_else(|error| self.drop_row(error))
    }

    /// Skips a row if the caller asked for it and the rest of the file is still usable. Otherwise
    /// returns the error.
    fn drop_row(&mut self, error: ReadError) -> Result<(), ReadError> {
        if self.bad_rows == BadRows::Reject || !error.affects_one_row() {
            return Err(error);
        }
        self.dropped.add(error);
        Ok(())
    }

    /// Reads the window, determines the period, the start time and the order from it, and creates
    /// the builder.
    fn read_window(&mut self, window: usize) -> Result<(), ReadError> {
        let mut rows = Vec::new();
        while rows.len() < window {
            if rows.len() >= MAX_ROWS {
                return Err(ReadError::of_file(TrajectoryFileProblem::TooManyRows { allowed: MAX_ROWS }));
            }
            match self.next_row() {
                Ok(Some(row)) => rows.push(row),
                Ok(None) => {
                    self.ended = true;
                    break;
                }
                Err(error) => return Err(self.judged(error, rows.len())),
            }
        }
        self.check_skipped()?;
        if rows.is_empty() {
            return Err(self.dropped.take_first().unwrap_or(ReadError::of_file(TrajectoryFileProblem::Empty)));
        }
        if self.ended && !is_in_order(&rows) {
            sort(&mut rows);
        }
        let beginning = &rows[..rows.len().min(WINDOW_ROWS)];
        let frame_period = self.source.info().period.unwrap_or_else(|| period(beginning));
        let clock = FrameClock::of_rows(beginning, frame_period);
        self.ticks = frame_times::ticks(beginning, clock)?;
        let clock = self.ticks.map_or(clock, |ticks| ticks.clock(clock));
        rows.iter_mut().for_each(|row| self.snap(row));
        let beginning = &rows[..rows.len().min(WINDOW_ROWS)];
        self.period = clock.period;
        let start = start(beginning);
        let stated = self.source.info().markings;
        self.axes = Axes::new(self.axis_options, beginning, stated.as_ref());
        rows.iter_mut().for_each(|row| self.axes.turn(row));
        let beginning = &rows[..rows.len().min(WINDOW_ROWS)];
        let checked = self.check_beginning(beginning, stated.as_ref(), clock);
        checked.map_err(|error| {
            let is_along = matches!(
                error.problem,
                TrajectoryFileProblem::AgainstTheRoad { .. }
                    | TrajectoryFileProblem::ImplausibleSteps { .. }
                    | TrajectoryFileProblem::JumpingNumbers { .. }
                    | TrajectoryFileProblem::SpeedsTooLow { .. }
            );
            let shared = self.shared_number(beginning, clock);
            shared.or_else(|| self.off_road().filter(|_| is_along)).unwrap_or(error)
        })?;
        self.is_simulated = beginning.first().is_some_and(|row| row.clock == Clock::Simulated);
        self.jumps_to_lanes = self.is_simulated && jump_to_lanes(beginning, clock);
        // The log of one vehicle shows no lanes of a road.
        if self.lanes == LaneReliability::Unreliable && self.source.info().layout != Layout::InCar {
            self.estimated = Some(EstimatedLanes::of(&rows[..rows.len().min(WINDOW_ROWS)]));
            rows.iter_mut().for_each(|row| self.assign_lane(row));
        }
        let is_estimated = matches!(self.estimated, Some(Ok(_)));
        if is_estimated || (self.lanes == LaneReliability::Reliable && self.source.derives_lanes()) {
            self.crossing_doubt = common_crossings::doubt(&rows[..rows.len().min(WINDOW_ROWS)]);
        } else if matches!(self.estimated, Some(Err(NoLanesShown::NoWidth { .. }))) && self.source.derives_lanes() {
            self.crossing_doubt = Some(NO_LANES_ALONG_THE_ROAD.to_owned());
        }
        if self.ended {
            separate_data_sets(&mut rows);
            sort(&mut rows);
            self.builder = TrackBuilder::for_sorted(clock, start);
        } else {
            self.builder = TrackBuilder::for_stream(clock, start, order_of(&rows, clock)?);
        }
        if !self.ended && self.states_markings() {
            // Nothing has to be known of the tracks in the window: they are built when they are asked
            // for.
            self.markings = self.estimated_markings().or(self.source.info().markings).unwrap_or_default();
            self.window = rows.into_iter();
            return Ok(());
        }
        rows.into_iter().try_for_each(|row| self.push(row))?;
        if self.ended {
            self.finish()?;
        }
        let derived = || LaneMarkings::from_tracks(self.builder.ready().map(|track| &track.trajectory));
        let stated = self.estimated_markings().or(self.source.info().markings);
        self.markings = stated.unwrap_or_else(derived);
        Ok(())
    }

    /// Checks the rows at the beginning of the file against the markings that it states. Keeps what a reader of
    /// results has to know.
    fn check_beginning(
        &mut self,
        beginning: &[Row],
        stated: Option<&LaneMarkings>,
        clock: FrameClock,
    ) -> Result<(), ReadError> {
        let layout = self.source.info().layout;
        self.source.check_velocities()?;
        plausible::check(beginning, layout, clock)?;
        let speeds = plausible::doubt(beginning, clock).or_else(|| plausible::doubt_of_accelerations(beginning, clock));
        let states_unit = self.lanes != LaneReliability::Unreliable
            || !matches!(layout, Layout::Plain | Layout::Ngsim18 | Layout::Ngsim25);
        let unit = if states_unit { None } else { side_by_side::doubt_of_unit(beginning) };
        self.row_doubts = speeds.or(unit).into_iter().chain(overlaps::doubt(beginning)).collect();
        // Other readers derive the lanes from the positions, so that only an option can part them.
        let states_lanes =
            matches!(layout, Layout::Plain | Layout::Ngsim18 | Layout::Ngsim25 | Layout::Highd | Layout::OpenLabel);
        if states_lanes || self.axis_options != AxisOptions::default() {
            axes::check_order(beginning, stated, self.lanes)?;
        }
        self.source.check_sides(self.axis_options.mirror_d)?;
        if self.lanes == LaneReliability::Reliable {
            self.source.check_lane_sides(self.axis_options.mirror_d)?;
        }
        self.sides = Sides::of(beginning, &*self.source, self.axis_options.mirror_d);
        if states_lanes && self.lanes == LaneReliability::Reliable {
            let side_by_side = SideBySide::of(beginning);
            side_by_side.check(layout)?;
            self.lane_doubt = side_by_side.doubt();
        }
        // The other layouts state their units, or derive the lanes from the positions.
        if layout == Layout::Plain && self.lanes == LaneReliability::Reliable {
            lane_spacing::check(beginning)?;
        }
        // The maps of the other layouts can have roads that end, exits and shoulders, where vehicles drive, too.
        if let (Layout::Highd | Layout::I24, Some(markings)) = (layout, stated)
            && (layout == Layout::Highd || self.lanes == LaneReliability::Reliable)
        {
            axes::check_carriageways(beginning, markings)?;
        }
        if let (Layout::Highd, LaneReliability::Reliable, Some(markings)) = (layout, self.lanes, stated) {
            self.axis_warning = axes::check_markings(beginning, markings)?;
        }
        if let (Layout::I24 | Layout::Commonroad | Layout::Osi, LaneReliability::Reliable, Some(markings)) =
            (layout, self.lanes, stated)
        {
            let beside = match layout {
                Layout::I24 => axes::doubt_of_edges(beginning, markings),
                _ => self.source.map_doubt(),
            };
            self.lane_doubt = beside.or_else(|| axes::doubt_of_middles(beginning, markings));
        }
        Ok(())
    }

    /// Returns the refusal of a number that belongs to several vehicles, if there is one and no row may be left out.
    /// Such numbers are a reason why rows contradict other checks.
    fn shared_number(&self, rows: &[Row], clock: FrameClock) -> Option<ReadError> {
        let mut latest: BTreeMap<(u64, Time, Time), &Row> = BTreeMap::new();
        let shared = rows.iter().find_map(|row| {
            let before = latest.insert((row.number, row.origin, row.time), row)?;
            let error = step(before, row, clock).err()?;
            matches!(error.problem, TrajectoryFileProblem::SharedNumber { .. }).then_some(error)
        });
        shared.filter(|_| self.bad_rows == BadRows::Reject)
    }

    /// Returns the refusal of traffic that does not follow the road of the map, if there is one. Positions along the
    /// road are then a reason why rows contradict other checks.
    fn off_road(&self) -> Option<ReadError> {
        let percent = self.source.off_road_percent()?;
        Some(ReadError::of_file(TrajectoryFileProblem::NoRoad { percent }))
    }

    /// Returns `error`, or the problem of the whole file that it belongs to, as the further rows show.
    /// `used` rows before it can be used.
    fn judged(&mut self, error: ReadError, used: usize) -> ReadError {
        if !error.affects_one_row() {
            return error;
        }
        let (mut rows, mut bad) = (used as u64 + 1, 1);
        while rows < WINDOW_ROWS as u64 {
            match self.source.next_row() {
                Ok(Some(_)) => rows += 1,
                Err(other) if other.affects_one_row() => {
                    rows += 1;
                    bad += 1;
                }
                Err(ReadError { problem: problem @ TrajectoryFileProblem::AgainstDrivingDirection { .. }, .. }) => {
                    return ReadError { problem, ..error };
                }
                Ok(None) | Err(_) => break,
            }
        }
        if is_most(bad, rows) { of_most_rows(error, bad, rows) } else { error }
    }

    /// Rejects a file if most of its rows so far were skipped.
    fn check_skipped(&mut self) -> Result<(), ReadError> {
        let bad = self.dropped.count();
        if !is_most(bad, self.rows) {
            return Ok(());
        }
        self.dropped.take_first().map_or(Ok(()), |first| Err(of_most_rows(first, bad, self.rows)))
    }

    /// Completes all tracks, and checks that they are tracks and not shreds of them.
    fn finish(&mut self) -> Result<(), ReadError> {
        self.check_skipped()?;
        self.builder.finish()?;
        let Continuity { vehicles, pieces, jumps, .. } = self.continuity();
        let piece_s = self.recorded_s() / pieces as f64;
        if pieces > SHREDS_PER_VEHICLE * vehicles && piece_s < SHRED_S {
            if let Some(error) = self.off_road() {
                return Err(error);
            }
            let usual = if 2 * jumps > pieces - vehicles {
                "numbers jump from place to place: they are not unique for each vehicle, or positions have errors of metres"
            } else {
                "frames are missing throughout"
            };
            let cause = self.lane_doubt.clone().unwrap_or_else(|| usual.to_owned());
            return Err(ReadError::of_file(TrajectoryFileProblem::Shreds { vehicles, pieces, piece_s, cause }));
        }
        Ok(())
    }

    /// Attaches the path of the file to an error.
    fn with_path(&self, ReadError { line, column, problem }: ReadError) -> TrajectoryFileError {
        TrajectoryFileError { path: self.path.clone(), line, column, problem }
    }
}

impl Iterator for Tracks<'_> {
    type Item = Result<RecordedTrack, TrajectoryFileError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_track().transpose()
    }
}

/// Returns true if the rows of each vehicle are in the order of their times, as the checks follow them.
fn is_in_order(rows: &[Row]) -> bool {
    let mut latest: BTreeMap<(u64, Time), Time> = BTreeMap::new();
    rows.iter().all(|row| latest.insert((row.number, row.origin), row.time).is_none_or(|before| before <= row.time))
}

/// Sorts rows by vehicle and time.
fn sort(rows: &mut [Row]) {
    rows.sort_by_key(|row| (row.number, row.origin, row.time, row.frame, row.line));
}

/// Returns true if `bad` rows are more than half of all `rows`, and no damage of single rows.
fn is_most(bad: u64, rows: u64) -> bool {
    bad >= LEAST_BAD_ROWS && 2 * bad > rows
}

/// Returns the error of a file of `rows` rows with `bad` ones; the first bad row has the `first` error.
fn of_most_rows(first: ReadError, bad: u64, rows: u64) -> ReadError {
    let ReadError { line, column, problem } = first;
    ReadError { line, column, problem: TrajectoryFileProblem::MostRows { first: Box::new(problem), bad, rows } }
}

/// Returns true if most changes of the lane take a single step, as in a simulation that does not model the movement.
fn jump_to_lanes(rows: &[Row], clock: FrameClock) -> bool {
    let mut latest: BTreeMap<u64, &Row> = BTreeMap::new();
    let (mut changes, mut jumps) = (0_u64, 0_u64);
    for row in rows {
        let before = latest.insert(row.number, row);
        let follows = |before: &&Row| before.lane != row.lane && row.time <= clock.bridged_until(before.time);
        if let Some(before) = before.filter(follows) {
            changes += 1;
            jumps += u64::from(is_lane_jump(before, row));
        }
    }
    2 * jumps > changes
}

/// Returns the warning for frames that are too far apart.
fn coarse_frames(period: Time) -> String {
    format!(
        "there is a row only every {period}, but the method needs one every {LONGEST_PERIOD} at least: lane changes near the ends of \
         tracks are missed, and shares may differ by several lane changes"
    )
}

/// The time and the frame of a row.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Instant {
    time: Time,
    frame: i64,
}

/// The extent of one vehicle's rows: their number, the first and the last.
struct Extent {
    rows: usize,
    first: Instant,
    last: Instant,
}

/// Returns the mean time step of the vehicle with the most rows. Returns NGSIM's period if no
/// vehicle has two frames, or if frame numbers may restart.
fn period(rows: &[Row]) -> Time {
    let mut extents: BTreeMap<(u64, Time), Extent> = BTreeMap::new();
    for row in rows {
        let at = Instant { time: row.time, frame: row.frame };
        let extent = extents.entry((row.number, row.origin)).or_insert(Extent { rows: 0, first: at, last: at });
        extent.rows += 1;
        extent.first = extent.first.min(at);
        extent.last = extent.last.max(at);
    }
    let longest = extents.values().rev().max_by_key(|extent| extent.rows);
    let Some(Extent { first, last, .. }) = longest else { return ngsim::PERIOD };
    let frames = last.frame - first.frame;
    let step_ns = if frames > 0 { (last.time - first.time).ns() / frames } else { 0 };
    let may_restart = rows.first().is_some_and(|row| row.clock == Clock::MayRestart);
    if may_restart || step_ns <= 0 { ngsim::PERIOD } else { Time::from_ns(step_ns) }
}

/// Returns the time to subtract from all times: the earliest one if times count from 1970,
/// otherwise zero.
fn start(rows: &[Row]) -> Time {
    let earliest = rows.iter().map(|row| row.time).min();
    earliest.filter(|time| *time >= MIN_EPOCH_TIME).unwrap_or(Time::ZERO)
}

/// Shifts data sets of different origin to later times, so that none overlaps the previous one.
fn separate_data_sets(rows: &mut [Row]) {
    let mut spans: BTreeMap<Time, (Time, Time)> = BTreeMap::new();
    for row in &*rows {
        let span = spans.entry(row.origin).or_insert((row.time, row.time));
        *span = (span.0.min(row.time), span.1.max(row.time));
    }
    if spans.len() < 2 {
        return;
    }
    let mut shifts = BTreeMap::new();
    let mut free_from = None;
    for (origin, (first, last)) in spans {
        let shift = free_from.map_or(Time::ZERO, |from: Time| (from - first).max(Time::ZERO));
        free_from = Some(last + shift + SEPARATION);
        shifts.insert(origin, shift);
    }
    for row in rows {
        row.time += shifts.get(&row.origin).copied().unwrap_or_default();
    }
}
