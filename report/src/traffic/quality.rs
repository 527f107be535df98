//! The flaws of a trajectory file as text.

use std::fmt;

use closecall_recorded::trajectory_data::{QualityInspector, Tracks};
use closecall_traffic::words::counted;

/// The flaws of a trajectory file as text for human readers.
pub struct QualityText<'a> {
    /// The tracks, which have been read to their end.
    pub tracks: &'a Tracks<'a>,
    /// The flaws of the tracks.
    pub inspector: &'a QualityInspector,
}

impl fmt::Display for QualityText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tracks, inspector } = self;
        let quality = inspector.count_flaws();
        writeln!(f, "{} ({})", tracks.name(), tracks.layout().name())?;
        writeln!(
            f,
            "  {}; {} of {}, {} every {:.3} s",
            counted(tracks.rows(), "row"),
            counted(quality.tracks, "track"),
            counted(quality.vehicles, "vehicle"),
            counted(quality.instants, "instant"),
            tracks.period().s()
        )?;
        for (name, flaw) in inspector.flaws().named() {
            match &flaw.first {
                None => writeln!(f, "  {:>8}  {name}", flaw.count)?,
                Some(first) => {
                    let line = first.line.map(|line| format!("line {line}, ")).unwrap_or_default();
                    let (track, time_s, message) = (first.track_id, first.time_s, &first.what);
                    writeln!(f, "  {:>8}  {name}; first: {line}track {track} at {time_s:.2} s: {message}", flaw.count)?;
                }
            }
        }
        for warning in tracks.warnings() {
            writeln!(f, "  warning: {warning}")?;
        }
        let markings = tracks.markings();
        writeln!(f, "  lanes {:.2} m wide", markings.typical_lane_width_m())?;
        for ignored in markings.ignored() {
            writeln!(f, "  warning: {ignored}")?;
        }
        if inspector.unchecked_points() > 0 {
            writeln!(
                f,
                "  overlaps were not checked at {} instants: the other vehicles of these times were not in memory",
                inspector.unchecked_points()
            )?;
        }
        for (reason, rows) in tracks.dropped().reasons() {
            let line = rows.first_line.map(|line| format!("line {line}: ")).unwrap_or_default();
            writeln!(f, "  {:>8}  skipped: {reason}; first: {line}{}", rows.count, rows.first)?;
        }
        Ok(())
    }
}
