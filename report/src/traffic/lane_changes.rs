//! Recorded lane changes as text for human readers: a table, their agreement with known ones, and
//! their criticality.

use std::fmt;

use closecall_recorded::criticality::{Counted, CriticalLaneChange, MetricResult, shares};
use closecall_recorded::filters::SmoothedFile;
use closecall_recorded::lane_change::{LaneChange, Score};
use closecall_traffic::Side;
use closecall_traffic::words;

/// Lane changes as a table, with their number.
#[derive(Clone, Copy, Debug)]
pub struct LaneChangesText<'a>(pub &'a [LaneChange]);

impl fmt::Display for LaneChangesText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let changes = self.0;
        writeln!(
            f,
            "track  class       direction  lanes      start    middle  crossing       end  duration     speed"
        )?;
        for change in changes {
            writeln!(f, "{}", line(change))?;
        }
        let complete = changes.iter().filter(|change| change.complete).count();
        let overlapping = changes.iter().filter(|change| change.overlapping).count();
        let double = changes.iter().filter(|change| change.double).count();
        writeln!(
            f,
            "{}, {complete} of them complete, {overlapping} overlapping, {double} of them parts of double ones",
            words::counted(changes.len(), "lane change")
        )?;
        Ok(())
    }
}

/// The agreement of detected lane changes with known ones.
#[derive(Clone, Copy, Debug)]
pub struct ScoreText<'a>(pub &'a Score);

impl ScoreText<'_> {
    /// Returns the text of a score.
    pub fn text(score: &Score) -> String {
        ScoreText(score).to_string()
    }
}

impl fmt::Display for ScoreText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let score = self.0;
        writeln!(f, "recall     {}", score.recall)?;
        writeln!(f, "precision  {}", score.precision)?;
        writeln!(f, "crossing times differ by at most {:.2} s", score.max_time_error_s)?;
        Ok(())
    }
}

/// The metrics of each lane change of a trajectory file, and how often each metric is critical.
#[derive(Clone, Copy, Debug)]
pub struct CriticalityText<'a> {
    /// The file, whose tracks are smoothed.
    pub file: &'a SmoothedFile,
    /// The lane changes of the file.
    pub changes: &'a [CriticalLaneChange],
    /// The lane changes to which the shares refer.
    pub counted: Counted,
}

impl fmt::Display for CriticalityText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, changes, counted } = *self;
        let quality = file.flaws;
        writeln!(
            f,
            "{}: {} of {}, {} every {}; {}, {}, {}",
            file.data.name,
            words::counted(quality.tracks, "track"),
            words::counted(quality.vehicles, "vehicle"),
            words::counted(quality.instants, "instant"),
            file.period,
            words::counted(quality.gaps, "gap"),
            words::counted(quality.jumps, "jump"),
            words::counted(quality.overlaps, "overlap"),
        )?;
        // The names of the metrics along the lanes are longer than the others.
        let width = if changes.iter().any(|change| change.curvilinear.is_some()) { 18 } else { 12 };
        for change in changes {
            writeln!(f, "{}", line(&change.lane_change))?;
            for (name, whole, crossing) in change.named() {
                let mark = if whole.is_critical() { "  CRITICAL" } else { "" };
                let is_implausible = whole.is_implausible() || crossing.is_implausible();
                let doubt = if is_implausible { "  implausible: beyond what a vehicle can do" } else { "" };
                let number =
                    |metric: MetricResult| metric.value().map_or("-".to_owned(), |value| format!("{value:.2}"));
                let (whole, crossing) = (number(whole), number(crossing));
                writeln!(f, "         {name:<width$} {whole:>9}  at the crossing {crossing:>9}{mark}{doubt}")?;
            }
        }
        let shares = shares(changes, counted);
        let kind = if counted == Counted::Complete { "complete lane changes" } else { "lane changes" };
        let left_out = match shares.left_out {
            0 => String::new(),
            number => format!(" ({number} others are left out)"),
        };
        writeln!(f, "of {} {kind}{left_out}, critical:", shares.lane_changes)?;
        for share in &shares.metrics {
            let percent = share.share.map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
            let interval = share
                .interval_95
                .map_or(String::new(), |[low, high]| format!("95 %: {:.0} to {:.0} %, ", 100.0 * low, 100.0 * high));
            let (metric, critical, absent) = (share.metric, share.critical, share.absent);
            let is_counted = |change: &&CriticalLaneChange| counted == Counted::All || change.lane_change.complete;
            let named = changes.iter().filter(is_counted).flat_map(|change| change.metrics.named());
            let doubt = match named.filter(|(name, value)| *name == metric && value.is_implausible()).count() {
                0 => String::new(),
                number => format!(", {number} of them implausible"),
            };
            writeln!(f, "  {metric:<width$} {critical:>4}  {percent:>6}  ({interval}{absent} absent{doubt})")?;
        }
        writeln!(f, "  {:<width$} {:>4}", "any", shares.any)?;
        Ok(())
    }
}

fn line(change: &LaneChange) -> String {
    let direction = match change.direction {
        Side::Left => "left",
        Side::Right => "right",
    };
    let mark = match (change.complete, change.double, change.overlapping) {
        (true, ..) => "complete",
        (false, true, _) => "double",
        (false, false, true) => "overlapping",
        (false, false, false) => "",
    };
    format!(
        "{:>5}  {:<10}  {direction:<9}  {} to {}  {:>7.2} s {:>7.2} s {:>7.2} s {:>7.2} s {:>7.2} s  {:>4.1} m/s  {mark}",
        change.track_id,
        change.vehicle_class.name(),
        change.from_lane,
        change.to_lane,
        change.start_s,
        change.midpoint_s,
        change.crossing_s,
        change.end_s,
        change.duration_s,
        change.speed_mps,
    )
}
