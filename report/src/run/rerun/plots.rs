//! Plots over time: curves of margins, speeds and accelerations, with the moments of the encounter
//! as vertical lines.

mod bands;

pub(super) use self::bands::{ENTITY as STATES_ENTITY, phase_name};

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::array::StringArray;
use closecall_controllers::{EgoState, MisPlan};
use closecall_recorded::criticality::{CRITICAL_DCE_M, CRITICAL_TTCE_S};
use closecall_traffic::Time;
use closecall_traffic::metrics::Encounter;
use rerun::{AsComponents, ComponentDescriptor, ComponentIdentifier, SerializedComponentBatch, SeriesLines};

use super::RecordingError;
use super::palette::{self, Rgba};
use super::stream::Writer;
use crate::run::figure::is_another;
use crate::run::film::{Film, Frame};
use closecall_scenarios::outcome::CRITICAL_THW_S;

/// Width of a curve (UI points).
const LINE_WIDTH: f32 = 3.0;
/// Width of a curve that is less important (UI points). The edges of a curve fade over one pixel: a
/// narrower one has no pixel in its full colour, and too little contrast.
const THIN_LINE_WIDTH: f32 = 2.0;

/// Reads a value from a frame; `None` if the frame lacks it.
type Of<T> = fn(&Frame) -> Option<T>;

/// The role of a film among the films of a recording, which share the plots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// The only film.
    Alone,
    /// The film to compare with. Its curves are thin and lighter.
    Baseline,
    /// The film that is compared with the baseline.
    Tested,
}

/// A plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Headway,
    Acceleration,
    Speed,
    Gap,
    Ttc,
    Encounter,
    Margin,
}

/// All plots, in their order in the layout.
pub(super) const KINDS: [Kind; 7] =
    [Kind::Headway, Kind::Acceleration, Kind::Speed, Kind::Gap, Kind::Ttc, Kind::Margin, Kind::Encounter];

impl Kind {
    /// Returns the name of the plot's entities.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Headway => "headway",
            Self::Acceleration => "acceleration",
            Self::Speed => "speed",
            Self::Gap => "gap",
            Self::Ttc => "ttc",
            Self::Encounter => "encounter",
            Self::Margin => "margin",
        }
    }

    /// Returns the title, which names the colours of the curves. In recorded traffic the subject is
    /// the vehicle that changes lanes.
    pub(super) const fn title(self, is_traffic: bool) -> &'static str {
        match self {
            Self::Acceleration if is_traffic => "Acceleration [m/s²] · subject blue",
            Self::Headway => "Headway [s] · ahead orange, behind pink",
            Self::Acceleration => "Acceleration [m/s²] · E blue · F orange · R pink",
            Self::Speed => "Speed [m/s]",
            Self::Gap => "Gap [m] · seen grey",
            Self::Ttc => "Rear TTC [s]",
            Self::Encounter => "TTCE [s] · DCE [m]",
            Self::Margin => "Headway gained [s]",
        }
    }

    /// Returns the unit of a curve of the plot.
    fn unit(self, curve: &str) -> &'static str {
        match self {
            Self::Acceleration => "m/s²",
            Self::Speed => "m/s",
            Self::Gap => "m",
            Self::Encounter if curve.contains("dce") => "m",
            Self::Headway | Self::Ttc | Self::Encounter | Self::Margin => "s",
        }
    }

    /// Returns the plot to which an entity belongs.
    fn of_entity(entity: &str) -> Option<Self> {
        KINDS.into_iter().find(|kind| entity.starts_with(&format!("plots/{}/", kind.name())))
    }

    /// Returns the smallest span of the value axis. With a smaller one, noise would look like an
    /// event.
    const fn least_range(self) -> [f64; 2] {
        match self {
            Self::Headway => [0.0, 3.0],
            Self::Acceleration => [-6.0, 2.0],
            Self::Speed => [f64::INFINITY, f64::NEG_INFINITY],
            Self::Gap => [0.0, 60.0],
            Self::Ttc | Self::Encounter => [0.0, 10.0],
            Self::Margin => [-0.5, 2.5],
        }
    }

    /// Returns the largest span of the value axis. Curves may leave it.
    const fn largest_range(self) -> [f64; 2] {
        match self {
            Self::Headway => [0.0, 3.8],
            Self::Acceleration => [-11.0, 5.0],
            Self::Speed => [0.0, f64::INFINITY],
            Self::Gap => [0.0, 130.0],
            Self::Ttc | Self::Encounter => [0.0, 10.0],
            Self::Margin => [-1.0, 2.8],
        }
    }
}

/// Least span of the axis of speeds (m/s).
const LEAST_SPEED_SPAN_MPS: f64 = 12.0;
/// Room above and below the curves, as a share of their span.
const AXIS_ROOM: f64 = 0.05;

/// A plot that has a curve, with the range of its value axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plot {
    pub(super) kind: Kind,
    pub(super) range: [f64; 2],
}

/// Writes all curves and bands of a film, and returns the plots that have a curve.
pub(super) fn write(writer: &Writer<'_>, film: &Film, role: Role) -> Result<Vec<Plot>, RecordingError> {
    let plots = Plots { writer, film, role, times: film.times(), spans: RefCell::default() };
    let mut kinds = Vec::new();
    let mut note = |kind: Kind, has_curve: bool| kinds.extend(has_curve.then_some(kind));
    note(Kind::Headway, plots.headways()?);
    note(Kind::Gap, plots.gaps()?);
    note(Kind::Ttc, plots.time_to_collision()?);
    note(Kind::Encounter, plots.encounter()?);
    plots.motion()?;
    note(Kind::Speed, true);
    note(Kind::Acceleration, true);
    note(Kind::Margin, plots.margin()?);
    let ranges: Vec<Plot> = kinds.into_iter().map(|kind| Plot { kind, range: plots.range(kind) }).collect();
    for plot in &ranges {
        plots.moment_lines(plot)?;
        plots.collision_lines(plot)?;
    }
    plots.bands()?;
    Ok(ranges)
}

/// The writer of the plots of one film.
struct Plots<'a> {
    writer: &'a Writer<'a>,
    film: &'a Film,
    role: Role,
    times: Vec<Time>,
    /// Smallest and largest value of each plot so far.
    spans: RefCell<BTreeMap<&'static str, [f64; 2]>>,
}

/// Name and style of a curve.
struct CurveStyle<'a> {
    name: &'a str,
    colour: Rgba,
    width: f32,
}

impl Plots<'_> {
    /// Writes a curve whose values `value` reads from the frames. Returns true if it has any value.
    fn curve(
        &self,
        entity: &str,
        style: &CurveStyle<'_>,
        value: impl Fn(&Frame) -> Option<f64>,
    ) -> Result<bool, RecordingError> {
        self.series(entity, style, &self.film.frames.iter().map(value).collect::<Vec<_>>())
    }

    /// Writes a curve of `values`, one per frame. Returns true if it has any value.
    fn series(&self, entity: &str, style: &CurveStyle<'_>, values: &[Option<f64>]) -> Result<bool, RecordingError> {
        if values.iter().all(Option::is_none) {
            return Ok(false);
        }
        self.note_span(entity, values);
        self.write_style(entity, style)?;
        self.writer.write_series(entity, &self.times, values)?;
        Ok(true)
    }

    /// Writes a curve about the vehicle that `vehicle` reads from the frames. The curve is
    /// interrupted where another vehicle begins. Returns true if it has any value.
    fn curve_about(
        &self,
        entity: &str,
        style: &CurveStyle<'_>,
        vehicle: Of<usize>,
        value: Of<f64>,
    ) -> Result<bool, RecordingError> {
        let frames = self.film.frames.iter().map(|frame| (vehicle(frame), value(frame)));
        self.series(entity, style, &interrupted(frames))
    }

    /// Extends the range of the plot to which `entity` belongs.
    fn note_span(&self, entity: &str, values: &[Option<f64>]) {
        let Some(kind) = Kind::of_entity(entity) else { return };
        let mut spans = self.spans.borrow_mut();
        let span = spans.entry(kind.name()).or_insert([f64::INFINITY, f64::NEG_INFINITY]);
        for value in values.iter().flatten() {
            *span = [span[0].min(*value), span[1].max(*value)];
        }
    }

    /// Returns the range of the value axis of a plot.
    fn range(&self, kind: Kind) -> [f64; 2] {
        let spans = self.spans.borrow();
        let least = kind.least_range();
        let [low, high] = spans.get(kind.name()).map_or(least, |span| [span[0].min(least[0]), span[1].max(least[1])]);
        let lacking = if kind == Kind::Speed { (LEAST_SPEED_SPAN_MPS - (high - low)).max(0.0) } else { 0.0 };
        let room = AXIS_ROOM * (high - low) + 0.5 * lacking;
        let largest = kind.largest_range();
        with_two_ticks([(low - room).max(largest[0]), (high + room).min(largest[1])])
    }

    /// Writes a red vertical line at each collision. The line of the baseline is thin.
    fn collision_lines(&self, plot: &Plot) -> Result<(), RecordingError> {
        let width = if self.role == Role::Baseline { THIN_LINE_WIDTH } else { LINE_WIDTH };
        for (number, collision) in self.film.collisions().iter().enumerate() {
            let entity = format!("plots/{}/collisions/{}", plot.kind.name(), number + 1);
            let style = SeriesLines::new()
                .with_names([self.named(&self.film.struck_text(collision))])
                .with_colors([palette::CRITICAL])
                .with_widths([width]);
            self.writer.write_static(&entity, &style)?;
            self.writer.write_series(&entity, &[collision.time; 2], &self.ends(plot).map(Some))?;
        }
        Ok(())
    }

    /// Returns the ends of a vertical line. The view of a pair can show more than the range of this
    /// film.
    fn ends(&self, plot: &Plot) -> [f64; 2] {
        let largest = plot.kind.largest_range();
        [0, 1].map(|end| if largest[end].is_finite() { largest[end] } else { plot.range[end] })
    }

    /// Returns the name of a curve, followed by the name of the arm if there are several.
    fn named(&self, name: &str) -> String {
        match self.role {
            Role::Alone => name.to_owned(),
            Role::Baseline | Role::Tested => format!("{name} {}", self.film.arm_label()),
        }
    }

    /// Writes a vertical line at each moment of the encounter. The baseline of a pair writes none.
    fn moment_lines(&self, plot: &Plot) -> Result<(), RecordingError> {
        if self.role == Role::Baseline {
            return Ok(());
        }
        let moments = self.film.moments();
        let ends = self.ends(plot);
        for (number, noted) in moments.iter().enumerate() {
            let entity = format!("plots/{}/moments/{}", plot.kind.name(), number + 1);
            let style = SeriesLines::new()
                .with_names([self.film.letters.moment_label(noted)])
                .with_colors([palette::moment(noted.moment)])
                .with_widths([THIN_LINE_WIDTH]);
            self.writer.write_static(&entity, &style)?;
            self.writer.write_series(&entity, &[noted.time; 2], &ends.map(Some))?;
        }
        Ok(())
    }

    /// Writes name and style of a curve.
    fn write_style(&self, entity: &str, curve: &CurveStyle<'_>) -> Result<(), RecordingError> {
        let name = self.named(curve.name);
        let (colour, width) = match self.role {
            Role::Baseline => (palette::lighter(curve.colour), THIN_LINE_WIDTH),
            Role::Alone | Role::Tested => (curve.colour, curve.width),
        };
        self.write_line(entity, SeriesLines::new().with_names([name]).with_colors([colour]).with_widths([width]))
    }

    /// Writes the style of a curve with the unit of its values.
    fn write_line(&self, entity: &str, style: SeriesLines) -> Result<(), RecordingError> {
        let unit = Kind::of_entity(entity).map_or("", |kind| kind.unit(entity));
        self.writer.write_static(entity, &WithUnit { style, unit })
    }

    /// Writes a reference level from the first to the last frame. The baseline writes none, since
    /// the tested film has the same.
    fn level(&self, entity: &str, name: &str, level: f64) -> Result<(), RecordingError> {
        if self.role == Role::Baseline {
            return Ok(());
        }
        let style =
            SeriesLines::new().with_names([name]).with_colors([palette::CRITICAL]).with_widths([THIN_LINE_WIDTH]);
        self.write_line(entity, style)?;
        let (Some(&first), Some(&last)) = (self.times.first(), self.times.last()) else { return Ok(()) };
        self.writer.write_series(entity, &[first, last], &[Some(level); 2])
    }

    /// Writes the time headways in front of and behind the ego.
    fn headways(&self) -> Result<bool, RecordingError> {
        let front = CurveStyle { name: "front", colour: palette::FRONT, width: LINE_WIDTH };
        let front =
            self.curve_about("plots/headway/front", &front, Frame::lead, |frame| frame.margins.thw_front_s.ok())?;
        let rear = CurveStyle { name: "rear", colour: palette::REAR, width: LINE_WIDTH };
        let rear =
            self.curve_about("plots/headway/rear", &rear, Frame::follower, |frame| frame.margins.thw_rear_s.ok())?;
        if front || rear {
            self.level("plots/headway/critical", "0.9 s", CRITICAL_THW_S)?;
        }
        Ok(front || rear)
    }

    /// Writes the gaps in front of and behind the ego, and the rear gap as the MIS estimates it.
    fn gaps(&self) -> Result<bool, RecordingError> {
        let front = CurveStyle { name: "front", colour: palette::FRONT, width: LINE_WIDTH };
        let front = self.curve_about("plots/gap/front", &front, Frame::lead, |frame| frame.margins.gap_front_m.ok())?;
        let rear = CurveStyle { name: "rear", colour: palette::REAR, width: LINE_WIDTH };
        let rear = self.curve_about("plots/gap/rear", &rear, Frame::follower, |frame| frame.margins.gap_rear_m.ok())?;
        let style = CurveStyle { name: "rear, MIS", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        let perceived = self.curve("plots/gap/rear_seen", &style, |frame| Some(plan(frame)?.rear_gap_m))?;
        Ok(front || rear || perceived)
    }

    /// Writes the time to collision of the vehicle behind the ego.
    fn time_to_collision(&self) -> Result<bool, RecordingError> {
        let rear = CurveStyle { name: "rear", colour: palette::REAR, width: LINE_WIDTH };
        self.curve_about("plots/ttc/rear", &rear, Frame::follower, |frame| frame.margins.ttc_rear_s.ok())
    }

    /// Writes the next closest encounter at the present velocities, in the ground truth and as the
    /// MIS estimates it.
    fn encounter(&self) -> Result<bool, RecordingError> {
        let encounters: Vec<Option<Encounter>> =
            (0..self.times.len()).map(|row| self.film.soonest_encounter(row)).collect();
        let value =
            |value: fn(&Encounter) -> f64| encounters.iter().map(|at| at.as_ref().map(value)).collect::<Vec<_>>();
        let ttce = CurveStyle { name: "TTCE", colour: palette::REAR, width: LINE_WIDTH };
        let has_ttce = self.series("plots/encounter/ttce", &ttce, &value(|encounter| encounter.ttce_s))?;
        // The distance of an encounter that is far ahead says little, so only near encounters are
        // shown.
        let near = |encounter: &Encounter| (encounter.ttce_s < CRITICAL_TTCE_S).then_some(encounter.dce_m);
        let distances: Vec<_> = encounters.iter().map(|at| at.as_ref().and_then(near)).collect();
        let dce = CurveStyle { name: "DCE if near", colour: palette::WARNING, width: LINE_WIDTH };
        self.series("plots/encounter/dce", &dce, &distances)?;
        let style = CurveStyle { name: "TTCE, MIS", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        let perceived = self.curve("plots/encounter/ttce_seen", &style, |frame| plan(frame)?.ttce_s.ok())?;
        let planned = CurveStyle { name: "t_c, MIS", colour: palette::EGO, width: THIN_LINE_WIDTH };
        self.curve("plots/encounter/planned", &planned, |frame| plan(frame)?.time_to_critical_s.ok())?;
        if has_ttce || perceived {
            self.level("plots/encounter/critical_ttce", "2.6 s", CRITICAL_TTCE_S)?;
            self.level("plots/encounter/critical_dce", "1.0 m", CRITICAL_DCE_M)?;
        }
        Ok(has_ttce || perceived)
    }

    /// Writes speeds and accelerations of the vehicles, the commanded acceleration of the ego, and
    /// its limits.
    fn motion(&self) -> Result<(), RecordingError> {
        for (index, actor) in self.film.actors.iter().enumerate().filter(|(_, actor)| actor.is_plotted) {
            let colour = palette::part(actor.part);
            let style = CurveStyle { name: &actor.name, colour, width: LINE_WIDTH };
            let value = |value: fn(&closecall_traffic::VehicleState) -> f64| {
                let rows = self.film.frames.iter().enumerate();
                rows.map(|(row, frame)| actor.present_frames.contains(&row).then(|| value(&frame.states[index])))
                    .collect::<Vec<_>>()
            };
            self.series(&format!("plots/speed/{}", actor.name), &style, &value(|state| state.speed_mps))?;
            self.series(
                &format!("plots/acceleration/{}", actor.name),
                &style,
                &value(|state| state.acceleration_mps2),
            )?;
        }
        let commanded = CurveStyle { name: "ego, commanded", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        // Vehicles have names of one part, so that none takes the place of these curves.
        self.curve("plots/acceleration/commanded/ego", &commanded, |frame| Some(frame.command?.acceleration_mps2))?;
        for (number, limit) in self.film.acceleration_limits.iter().enumerate() {
            self.level(&format!("plots/acceleration/limits/{}", number + 1), &limit.name, limit.value)?;
        }
        Ok(())
    }

    /// Writes the front time headway gained since the MIS first engaged, with its goal.
    fn margin(&self) -> Result<bool, RecordingError> {
        // A pause of emergency braking is no engagement, so the summary decides.
        let mis = self.film.outcome().and_then(|outcome| outcome.mis.as_ref().ok());
        let from = match mis.map(|mis| mis.engaged_at_s) {
            Some(Err(_)) => return Ok(false),
            Some(Ok(engaged_at_s)) => Time::from_s(engaged_at_s),
            None => Time::ZERO,
        };
        let is_increasing = |frame: &&Frame| {
            frame.time >= from && frame.command.is_some_and(|command| command.state == EgoState::Increasing)
        };
        let first = self.film.frames.iter().find(is_increasing);
        let start = first.and_then(|frame| Some((frame.time, frame.margins.thw_front_s.ok()?, plan(frame))));
        let Some((since, thw_s, planned)) = start else { return Ok(false) };
        let gained = |frame: &Frame, thw: Option<f64>| thw.filter(|_| frame.time >= since).map(|now_s| now_s - thw_s);
        let style = CurveStyle { name: "gained", colour: palette::EGO, width: LINE_WIDTH };
        self.curve("plots/margin/gained", &style, |frame| gained(frame, frame.margins.thw_front_s.ok()))?;
        let style = CurveStyle { name: "foreseen", colour: palette::NEUTRAL, width: THIN_LINE_WIDTH };
        self.curve("plots/margin/foreseen", &style, |frame| gained(frame, plan(frame)?.thw_at_critical_s.ok()))?;
        let goal_s = planned.map(|plan| plan.goal_thw_s - thw_s);
        let style = CurveStyle { name: "goal", colour: palette::SAFE, width: THIN_LINE_WIDTH };
        self.curve("plots/margin/goal", &style, |frame| goal_s.filter(|_| frame.time >= since))?;
        Ok(true)
    }
}

/// Least distance between two numbered ticks of the value axis, as a share of the plot's height: 22
/// of the 85 px of the lowest plot.
const LEAST_TICK_SHARE: f64 = 0.26;

/// Steps between the ticks of a value axis: the viewer puts them at multiples of a power of ten.
const STEPS: [f64; 8] = [0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1_000.0, 10_000.0];
/// Room beyond a tick to which an axis is extended, as a share of the step.
const TICK_ROOM: f64 = 0.05;

/// Extends a range of a value axis until two of its ticks have a number.
fn with_two_ticks([mut low, mut high]: [f64; 2]) -> [f64; 2] {
    // Each extension makes the range longer, and perhaps also the step.
    while let Some(step) = STEPS.into_iter().find(|step| *step >= LEAST_TICK_SHARE * (high - low)) {
        let [first, last] = [(low / step).ceil() * step, (high / step).floor() * step];
        if last > first {
            break;
        }
        let [below, above] = [first - step, last + step];
        if low - below <= above - high { low = below - TICK_ROOM * step } else { high = above + TICK_ROOM * step }
    }
    [low, high]
}

/// A curve's style, and the unit of its values, in the component `unit`.
struct WithUnit {
    style: SeriesLines,
    unit: &'static str,
}

impl AsComponents for WithUnit {
    fn as_serialized_batches(&self) -> Vec<SerializedComponentBatch> {
        let component = ComponentIdentifier::from("unit");
        let descriptor = ComponentDescriptor { archetype: None, component, component_type: None };
        let unit = SerializedComponentBatch::new(Arc::new(StringArray::from(vec![self.unit])), descriptor);
        self.style.as_serialized_batches().into_iter().chain([unit]).collect()
    }
}

/// Returns the values of a curve, each with its vehicle. The first value of another vehicle is left
/// out: the line would join the values of two vehicles.
fn interrupted(values: impl Iterator<Item = (Option<usize>, Option<f64>)>) -> Vec<Option<f64>> {
    let mut last = None;
    let value_of = |(vehicle, value): (Option<usize>, Option<f64>)| {
        let value = value.filter(|_| !is_another(last, vehicle));
        last = vehicle;
        value
    };
    values.map(value_of).collect()
}

/// Returns the plan of the MIS in a frame, if there is one.
fn plan(frame: &Frame) -> Option<MisPlan> {
    frame.command?.plan
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the number of ticks that have a number in a plot of the least height.
    fn ticks([low, high]: [f64; 2]) -> usize {
        let step = STEPS.into_iter().find(|step| *step >= LEAST_TICK_SHARE * (high - low)).unwrap();
        let count = (high / step).floor() - (low / step).ceil() + 1.0;
        if count > 0.0 { count as usize } else { 0 }
    }

    #[test]
    fn a_curve_does_not_join_the_values_of_two_vehicles() {
        let row = |vehicle, value| (vehicle, Some(value));
        let of_two = [row(Some(2), 1.0), row(Some(2), 1.1), row(Some(3), 5.0), row(Some(3), 4.9)];
        assert_eq!(interrupted(of_two.into_iter()), [Some(1.0), Some(1.1), None, Some(4.9)]);
        // A vehicle in the path is not yet in the lane: a curve of one vehicle has no other gap.
        let of_one = [row(None, 3.0), row(Some(2), 2.9), (Some(2), None), row(Some(2), 2.7)];
        assert_eq!(interrupted(of_one.into_iter()), [Some(3.0), Some(2.9), None, Some(2.7)]);
    }

    #[test]
    fn every_value_axis_has_two_ticks() {
        assert_eq!(with_two_ticks([0.0, 3.0]), [0.0, 3.0]);
        assert_eq!(ticks([-7.0, 2.0]), 1);
        for range in [
            [-7.0, 2.0],
            [-6.3, 2.1],
            [22.0, 36.0],
            [31.0, 38.0],
            [0.0, 60.0],
            [0.0, 130.0],
            [-0.5, 2.5],
            [0.0, 10.0],
            [28.5, 28.6],
        ] {
            let [low, high] = with_two_ticks(range);
            assert!(low <= range[0] && high >= range[1] && ticks([low, high]) >= 2, "{range:?}: {low} to {high}");
        }
        for kind in KINDS {
            let range = kind.least_range();
            assert!(range[0] > range[1] || ticks(with_two_ticks(range)) >= 2, "{kind:?}");
        }
    }
}
