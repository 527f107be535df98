//! A perception library that this process has loaded.

#![expect(unsafe_code, reason = "functions of a loaded library are called")]

use std::ffi::c_void;
use std::path::Path;

use closecall_controllers::external::{Arithmetic, Identity, LoadError, SharedLibrary, foreign_call, text};

use super::abi::{
    ABI, AbiFunction, AnswerView, AnswersFunction, CreateFunction, DestroyFunction, Detection, ErrorFunction,
    StepFunction, TextFunction, Track,
};
use super::view::{Setup, with_input};
use crate::perception::answer::{Kind, MOST_OBJECTS, USUAL_TOP_M};
use crate::perception::message::Scans;

/// The functions that a library must export.
const NEEDED: [&str; 5] = [
    "closecall_perception_abi",
    "closecall_perception_answers",
    "closecall_perception_create",
    "closecall_perception_step",
    "closecall_perception_destroy",
];

/// The function that says why the last call failed.
const ERROR: &str = "closecall_perception_error";

/// The beginning of the names of the interface.
const PREFIX: &str = "closecall_perception";

/// A library that this process has loaded.
pub(super) struct Library {
    create: CreateFunction,
    step: StepFunction,
    destroy: DestroyFunction,
    error: Option<ErrorFunction>,
    kind: Kind,
    identity: Identity,
    /// Kept loaded for as long as its functions can be called.
    _shared: SharedLibrary,
}

impl Library {
    /// Loads a library. This runs code of the file: only a process that may crash does so.
    ///
    /// # Errors
    /// [`LoadError`] if the file cannot be used.
    pub(super) fn load(path: &Path) -> Result<Self, LoadError> {
        let shared = SharedLibrary::open(path, &NEEDED, PREFIX)?;
        let [abi, answers, create, step, destroy] = NEEDED;
        let _kept = Arithmetic::keep();
        // SAFETY: the header declares the functions with these types. The version is asked for
        // first.
        unsafe {
            let stated_abi = shared.function::<AbiFunction>(abi)?;
            let actual = foreign_call(abi, || stated_abi());
            if actual != ABI {
                return Err(LoadError::Abi { path: shared.path().to_owned(), actual, expected: ABI });
            }
            let stated_kind = shared.function::<AnswersFunction>(answers)?;
            let kind = match foreign_call(answers, || stated_kind()) {
                0 => Kind::Detections,
                1 => Kind::Tracks,
                other => {
                    return Err(LoadError::Value {
                        path: shared.path().to_owned(),
                        function: answers,
                        actual: other.into(),
                        allowed: "0 (detections) or 1 (tracks)",
                    });
                }
            };
            let stated =
                |name| shared.optional::<TextFunction>(name).and_then(|stated| text(foreign_call(name, || stated())));
            let identity =
                Identity { name: stated("closecall_perception_name"), version: stated("closecall_perception_version") };
            Ok(Self {
                create: shared.function(create)?,
                step: shared.function(step)?,
                destroy: shared.function(destroy)?,
                error: shared.optional(ERROR),
                kind,
                identity,
                _shared: shared,
            })
        }
    }

    /// Returns what the library answers.
    pub(super) const fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns what the library states about itself.
    pub(super) const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Creates the perception of one run, or returns why there is none.
    pub(super) fn start(&self, setup: &Setup) -> Result<Run<'_>, String> {
        let _kept = Arithmetic::keep();
        // SAFETY: the view is valid during the call.
        let perception = setup.with_view(|view| foreign_call(NEEDED[2], || unsafe { (self.create)(view) }));
        if perception.is_null() {
            let reason = self.reason(perception);
            return Err(format!("{} answered null: the library created no perception{reason}", NEEDED[2]));
        }
        Ok(Run { library: self, perception })
    }

    /// Returns the library's text about its last failure, as the end of a message.
    fn reason(&self, perception: *mut c_void) -> String {
        // SAFETY: the perception is null, or lives.
        let stated = self.error.and_then(|error| unsafe { text(foreign_call(ERROR, || error(perception))) });
        stated.map_or_else(|| format!("; a text of `{ERROR}` would say why"), |stated| format!(": {stated}"))
    }
}

/// The objects that a library has answered.
pub(super) enum Objects {
    Detections(Vec<Detection>),
    Tracks(Vec<Track>),
}

/// The perception of one run.
pub(super) struct Run<'a> {
    library: &'a Library,
    perception: *mut c_void,
}

impl Run<'_> {
    /// Returns the answer to a question, or why there is none.
    pub(super) fn step(&mut self, setup: &Setup, question: &Scans) -> Result<Objects, String> {
        let (mut detections, mut tracks) = (Vec::new(), Vec::new());
        match self.library.kind {
            Kind::Detections => detections.resize(MOST_OBJECTS, unset_detection(question.time_ns)),
            Kind::Tracks => tracks.resize(MOST_OBJECTS, UNSET_TRACK),
        }
        let mut answer = AnswerView {
            detections: if detections.is_empty() { std::ptr::null_mut() } else { detections.as_mut_ptr() },
            tracks: if tracks.is_empty() { std::ptr::null_mut() } else { tracks.as_mut_ptr() },
            capacity: MOST_OBJECTS as u64,
            count: 0,
        };
        let kept = Arithmetic::keep();
        // SAFETY: the perception lives until it is dropped, and both views with their lists are
        // valid during the call.
        let result = with_input(setup, question, |input| {
            foreign_call(NEEDED[3], || unsafe { (self.library.step)(self.perception, input, &mut answer) })
        })?;
        drop(kept);
        if result != 0 {
            let reason = self.library.reason(self.perception);
            return Err(format!("the library answered with the error {result}{reason}"));
        }
        let count = usize::try_from(answer.count).ok().filter(|count| *count <= MOST_OBJECTS);
        let what = self.library.kind.key();
        let count = count
            .ok_or_else(|| format!("the library answered {} {what}; there is room for {MOST_OBJECTS}", answer.count))?;
        detections.truncate(count);
        tracks.truncate(count);
        Ok(match self.library.kind {
            Kind::Detections => Objects::Detections(detections),
            Kind::Tracks => Objects::Tracks(tracks),
        })
    }
}

impl Drop for Run<'_> {
    fn drop(&mut self) {
        let _kept = Arithmetic::keep();
        // SAFETY: the library has created the perception, and nothing uses it any more.
        foreign_call(NEEDED[4], || unsafe { (self.library.destroy)(self.perception) });
    }
}

/// Returns a detection with the defaults of the interface. What has none is NaN, and refused if it
/// stays so.
const fn unset_detection(time_ns: i64) -> Detection {
    Detection {
        x_m: f64::NAN,
        y_m: f64::NAN,
        covariance: [f64::NAN; 4],
        heading_rad: 0.0,
        length_m: f64::NAN,
        width_m: f64::NAN,
        top_m: USUAL_TOP_M,
        class: [0.0; 4],
        time_ns,
        points: 0,
        length_is_seen: 0,
        width_is_seen: 0,
        reserved: 0,
    }
}

/// A track with the defaults of the interface. What has none is NaN, or no status, and refused if
/// it stays so.
const UNSET_TRACK: Track = Track {
    id: 0,
    status: -1,
    x_m: f64::NAN,
    y_m: f64::NAN,
    vx_mps: f64::NAN,
    vy_mps: f64::NAN,
    covariance: [f64::NAN; 16],
    heading_rad: 0.0,
    length_m: f64::NAN,
    width_m: f64::NAN,
    class: [0.0; 4],
    existence: f64::NAN,
};
