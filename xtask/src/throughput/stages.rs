//! The time of each stage of the loop, measured where one stage ends and the next begins.
//!
//! ```text
//!  physics step    ├ neighbours, margins ┤                               ├ drivers, motion ┤
//!  control step    ├ neighbours, margins │ sensors ├ ego stack ├ report ─┤ drivers, motion ┤
//!                  moved                           asked       answered  reported          moved
//! ```
//!
//! No part of the simulation reads a clock. The marks are the calls of an observer (`moved`,
//! `reported`) and of a controller (`asked`, `answered`), which both belong to this program.
//! Neighbours and sensors have no mark between them: a physics step without a control step has no
//! sensors, and gives the time of the neighbours. A mark takes some 30 ns, which is in the figures.
//! After the full sensors the caches are cold, and the time of the neighbours cannot be told apart:
//! it is then part of the motion. Each run is made three times, and the shortest time between two
//! marks counts, as other programs interrupt it.

use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

use closecall_controllers::{ControllerError, EgoCommand, EgoController, EgoInput, EgoSettings};
use closecall_scenarios::Scenario;
use closecall_simulation::{Arm, ControllerFactory, Observer, RunEvent, RunKey, SampleError, StepView, simulate};
use closecall_traffic::{Time, VehicleState};

/// Number of equal runs.
const REPETITIONS: usize = 3;

/// A place in the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    /// The run begins.
    Started,
    /// All vehicles have moved.
    Moved,
    /// The ego controller is called.
    Asked,
    /// The ego controller has answered.
    Answered,
    /// The control step was reported.
    Reported,
}

/// The time between two marks.
#[derive(Clone, Copy)]
struct Span {
    between: [Mark; 2],
    time_s: f64,
}

/// The time that each stage takes (s), all runs together.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stages {
    /// Preparation of a run, with the second in which its tracks settle.
    pub(crate) start_s: f64,
    /// Neighbours of all vehicles, and the ego's margins.
    pub(crate) neighbours_s: f64,
    /// The ego's sensors and trackers.
    pub(crate) sensors_s: f64,
    /// The ego's controller.
    pub(crate) stack_s: f64,
    /// Report of a control step to an observer that wants it.
    pub(crate) report_s: f64,
    /// Drivers, motion and contacts of all vehicles.
    pub(crate) motion_s: f64,
    /// The simulated time (s).
    pub(crate) simulated_s: f64,
    /// Number of control steps.
    pub(crate) control_steps: f64,
    /// Number of physics steps.
    pub(crate) physics_steps: f64,
}

/// The last mark of a run, and the spans so far.
#[derive(Default)]
struct Trace {
    last: Option<(Mark, Instant)>,
    spans: Vec<Span>,
}

thread_local! {
    /// The trace of this thread's run.
    static TRACE: RefCell<Trace> = const { RefCell::new(Trace { last: None, spans: Vec::new() }) };
}

/// Ends a span.
fn mark(mark: Mark) {
    let now = Instant::now();
    TRACE.with_borrow_mut(|trace| {
        if let Some((before, at)) = trace.last {
            trace.spans.push(Span { between: [before, mark], time_s: (now - at).as_secs_f64() });
        }
        trace.last = Some((mark, Instant::now()));
    });
}

/// Returns the spans of the shortest of several equal runs, span by span: a run does the same each
/// time, and what interrupts it does not. Also returns the simulated time (s).
fn spans(scenario: &Scenario, key: RunKey, arm: &Arm) -> Result<(Vec<Span>, f64), SampleError> {
    let (mut shortest, mut simulated_s): (Vec<Span>, f64) = (Vec::new(), 0.0);
    for _ in 0..REPETITIONS {
        TRACE.set(Trace::default());
        mark(Mark::Started);
        simulated_s = simulate(scenario, key, arm, &mut Marks)?.duration.s();
        let spans = TRACE.take().spans;
        if shortest.is_empty() {
            shortest = spans;
        } else {
            let pairs = shortest.iter_mut().zip(&spans);
            pairs.for_each(|(least, span)| least.time_s = least.time_s.min(span.time_s));
        }
    }
    Ok((shortest, simulated_s))
}

/// Returns the sum of the times between two marks (s), and their number.
fn sum(spans: &[Span], between: [Mark; 2]) -> (f64, f64) {
    let matching = spans.iter().filter(|span| span.between == between);
    matching.fold((0.0, 0.0), |(sum_s, count), span| (sum_s + span.time_s, count + 1.0))
}

/// Returns the time of each stage in all runs. What happens after a collision of the ego, which
/// then neither perceives nor acts, counts as physics steps.
fn stages_of(spans: &[Span], simulated_s: f64) -> Stages {
    let mean_s = |(sum_s, count): (f64, f64)| if count > 0.0 { sum_s / count } else { 0.0 };
    let step = sum(spans, [Mark::Moved, Mark::Moved]);
    let perceived = sum(spans, [Mark::Moved, Mark::Asked]);
    let moved = sum(spans, [Mark::Reported, Mark::Moved]);
    let neighbours_s = (mean_s(step) - mean_s(moved)).max(0.0);
    let physics_steps = step.1 + perceived.1;
    Stages {
        start_s: sum(spans, [Mark::Started, Mark::Moved]).0,
        neighbours_s: neighbours_s * physics_steps,
        sensors_s: (perceived.0 - neighbours_s * perceived.1).max(0.0),
        stack_s: sum(spans, [Mark::Asked, Mark::Answered]).0,
        report_s: sum(spans, [Mark::Answered, Mark::Reported]).0,
        motion_s: step.0 + moved.0 - neighbours_s * step.1,
        simulated_s,
        control_steps: perceived.1,
        physics_steps,
    }
}

/// The observer whose calls are marks.
struct Marks;

impl Observer for Marks {
    fn step(&mut self, _: &StepView<'_>) {
        mark(Mark::Reported);
    }

    fn event(&mut self, _: Time, _: &RunEvent) {}

    fn moved(&mut self, _: Time, _: &mut dyn Iterator<Item = VehicleState>) {
        mark(Mark::Moved);
    }
}

/// A built-in controller whose calls are marks, and its factory.
struct Marked<T>(T);

impl EgoController for Marked<Box<dyn EgoController>> {
    fn step(&mut self, input: &EgoInput<'_>) -> Result<EgoCommand, ControllerError> {
        mark(Mark::Asked);
        let command = self.0.step(input);
        mark(Mark::Answered);
        command
    }

    fn finish(&mut self, time: Time) -> Result<(), ControllerError> {
        self.0.finish(time)
    }
}

impl ControllerFactory for Marked<Arc<dyn ControllerFactory>> {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn settings(&self, settings: &EgoSettings) -> EgoSettings {
        self.0.settings(settings)
    }

    fn has_mis(&self, settings: &EgoSettings) -> bool {
        self.0.has_mis(settings)
    }

    fn looks_back(&self, settings: &EgoSettings) -> bool {
        self.0.looks_back(settings)
    }

    fn build(&self, settings: &EgoSettings) -> Box<dyn EgoController> {
        Box::new(Marked(self.0.build(settings)))
    }
}

/// Runs samples of an arm one after the other, and returns the time of each stage.
pub(crate) fn stages<'a>(runs: impl Iterator<Item = (&'a Scenario, RunKey)>, arm: &Arm) -> Result<Stages, SampleError> {
    let arm = Arm { controller: Arc::new(Marked(arm.controller.clone())), sensors: arm.sensors };
    let (mut all, mut simulated_s) = (Vec::new(), 0.0);
    for (scenario, key) in runs {
        let (spans, run_s) = spans(scenario, key, &arm)?;
        all.extend(spans);
        simulated_s += run_s;
    }
    Ok(stages_of(&all, simulated_s))
}
