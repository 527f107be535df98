//! The work of a worker process: `closecall host …`.

use std::fs::File;
use std::io::{self, BufRead, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use closecall_controllers::ControllerError;
use closecall_controllers::external::{
    Kind, Loaded, VariableTable, Variables, bridge, unload_all, use_unpacked, watch,
};
use closecall_scenarios::ScenarioFile;
use closecall_sensors::camera::{Backend, Classifier};
use closecall_sensors::set_inference_backend;
use closecall_simulation::controller::exec::NEW_SAMPLE;
use closecall_simulation::controller::native::{Probe, UNPACKED};
use closecall_simulation::perception::{hosted, probe_library, serve_library};
use closecall_simulation::{Arm, SampleError};

use super::{Answer, CHANGED, Question, Stage, Task, UNREADABLE, task_identity};
use crate::manifest::version;
use crate::record::{ArmRecord, SampleFailure};
use crate::runner::{ArmRun, Work};
use crate::validity::CheckPlan;
use crate::workers::Samples;

/// The answer of a process that has loaded ONNX Runtime.
const ONNXRUNTIME_WORKS: &str = "onnxruntime";

/// Runs a worker process with the arguments after `closecall host`, and returns what went wrong.
///
/// | arguments | what the process does |
/// |---|---|
/// | `unpacked FOLDER …` | uses the folder of an FMU that is unpacked there already |
/// | `probe lib:PATH VARIABLES` | loads the file, and writes what it is |
/// | `step lib:PATH TABLE` | answers control steps, with the protocol of external processes |
/// | `samples` | runs whole samples |
/// | `probe-perception PATH` | loads the library of a perception, and writes what it is |
/// | `perceive PATH` | answers scans, with the protocol of perception processes |
/// | `onnxruntime PATH` | loads ONNX Runtime and the network |
///
/// # Errors
/// The message of the failure.
pub fn serve(arguments: &[String]) -> Result<(), String> {
    let result = serve_one(arguments);
    unload_all();
    result
}

fn serve_one(arguments: &[String]) -> Result<(), String> {
    let arguments = match arguments {
        [word, folder, rest @ ..] if word == UNPACKED => {
            use_unpacked(PathBuf::from(folder));
            rest
        }
        all => all,
    };
    // What a library prints must not be taken for an answer.
    let mut answers = take_output().map_err(|error| format!("failed to set up the output: {error}"))?;
    let requests = io::stdin().lock();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["probe", controller, variables] => {
            let (kind, path) = file(controller)?;
            let variables: Option<Variables> = read(variables)?;
            let probe = Probe::of(kind, Path::new(path), variables.as_ref());
            let text = serde_json::to_string(&probe).map_err(|error| error.to_string())?;
            writeln!(answers, "{text}").map_err(|error| error.to_string())
        }
        ["step", controller, table] => {
            let table: VariableTable = read(table)?;
            let (kind, path) = file(controller)?;
            let loaded = Loaded::open(kind, Path::new(path)).map_err(|error| error.to_string())?;
            bridge::serve(&loaded, &table, requests, answers)
        }
        ["probe-perception", path] => probe_library(Path::new(path), answers),
        ["perceive", path] => serve_library(Path::new(path), requests, answers),
        // Loading it runs its code.
        ["onnxruntime", library] => {
            let library = PathBuf::from(library);
            Classifier::shipped(&Backend::OnnxRuntime(library)).map_err(|error| error.to_string())?;
            writeln!(answers, "{ONNXRUNTIME_WORKS}").map_err(|error| error.to_string())
        }
        ["samples"] => samples(requests, &Arc::new(Mutex::new(answers))),
        _ => Err("expected `samples`, or `probe` or `step` with a controller such as `lib:PATH`".to_owned()),
    }
}

/// Returns the standard output as a file. From now on, only this file writes to it. Everything else
/// that the process prints goes to standard error.
fn take_output() -> io::Result<File> {
    // A process that the library starts must not hold the output open: the end of the output
    // reports the end of this process.
    let output = rustix::io::fcntl_dupfd_cloexec(io::stdout(), 3)?;
    rustix::stdio::dup2_stdout(io::stderr())?;
    Ok(File::from(output))
}

fn file(controller: &str) -> Result<(Kind, &str), String> {
    controller
        .split_once(':')
        .and_then(|(word, path)| Some((Kind::ALL.into_iter().find(|kind| kind.prefix() == word)?, path)))
        .ok_or_else(|| format!("`{controller}` is not `lib:PATH` or `fmu:PATH`"))
}

/// Runs the samples whose numbers `requests` gives, after the task in its first line.
fn samples(requests: impl BufRead, answers: &Arc<Mutex<File>>) -> Result<(), String> {
    let mut lines = requests.lines();
    let Some(first) = lines.next() else { return Ok(()) };
    let first = first.map_err(|error| error.to_string())?;
    // The task of another version may have another form.
    let Stated { version: there } = read(&first)?;
    if there != version() {
        let reason = format!(
            "Closecall has changed since the start: it was {there}, and is {}. The results so far are kept",
            version()
        );
        return refuse(answers, lines.next(), CHANGED, reason);
    }
    let task: Task = read(&first)?;
    set_inference_backend(Backend::choose(task.onnxruntime.as_deref(), None));
    let identity = task_identity(first.as_bytes());
    let timeout_ms = task.controller.timeout_ms();
    let kind = if task.controller.native().is_some() { CHANGED } else { UNREADABLE };
    let controller = match task.controller.in_this_process() {
        Ok(controller) => controller,
        Err(reason) => return refuse(answers, lines.next(), kind, reason),
    };
    let name = controller.name().to_owned();
    if let Some((name, words)) = task.hosted_perception {
        hosted::register(&name, words);
    }
    let file = ScenarioFile::parse(&task.path, &task.text, &[]).map_err(|error| error.to_string())?;
    let file = file.with_program_in(task.program_folder.as_deref().map(Path::new));
    let arms = vec![Arm { controller, sensors: task.sensors }];
    let work = Work { file, sampling: task.sampling, arms, checks: task.checks, retry_crashed: 0 };
    let unchecked = Work { checks: CheckPlan::off(), ..work.clone() };
    let is_answered = Arc::new(AtomicBool::new(true));
    let current: Arc<Mutex<Current>> = Arc::default();
    let answering = Answering { answers: answers.clone(), process: std::process::id() };
    let late = {
        let (answering, is_answered, current) = (answering.clone(), is_answered.clone(), current.clone());
        move |time, limit: Duration| {
            let reason = format!("no answer within {} ms", limit.as_millis());
            let error = SampleError::from(ControllerError::Late { reason, time });
            if is_answered.swap(true, Ordering::SeqCst) {
                return;
            }
            let Current { question, outcome } = std::mem::take(&mut *lock(&current));
            let run = match outcome {
                // The sample has its outcome: the time is over for its checks.
                Some(run) => run.unchecked(&error),
                None => {
                    let record = ArmRecord::new(name.clone(), Err(SampleFailure::from(error)));
                    ArmRun { record, wall_s: limit.as_secs_f64(), check_s: 0.0 }
                }
            };
            // The process ends after this. If the answer is lost, its end is the error of the
            // sample.
            answering.answer(question, run, Stage::Last).ok();
        }
    };
    watch::start(Duration::from_millis(timeout_ms), late).map_err(|error| error.to_string())?;
    let limit = Duration::MAX;
    for line in lines {
        let question: Question = line.map_err(|error| error.to_string()).and_then(|line| read(&line))?;
        if question.task != identity {
            return Err(format!("{question} is not of the task {identity}"));
        }
        io::stderr().write_all(&[NEW_SAMPLE]).map_err(|error| error.to_string())?;
        *lock(&current) = Current { question: Some(question.clone()), outcome: None };
        is_answered.store(false, Ordering::SeqCst);
        let asked = if question.is_repetition { &unchecked } else { &work };
        let run = asked.run(question.sample, 0, limit, &|run| {
            lock(&current).outcome = Some(run.clone());
            if !is_answered.load(Ordering::SeqCst) {
                // If it is lost, so is the answer of the sample, which reports it.
                answering.answer(Some(&question), run.clone(), Stage::ChecksFollow).ok();
            }
        });
        if !is_answered.swap(true, Ordering::SeqCst) {
            answering.answer(Some(question), run, Stage::Done)?;
        }
    }
    Ok(())
}

/// The part of a task that every version has.
#[derive(serde::Deserialize)]
struct Stated {
    version: String,
}

/// The sample that a process runs, with its outcome once only the checks are left.
#[derive(Default)]
struct Current {
    question: Option<Question>,
    outcome: Option<ArmRun>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Answers the first question, if there is one, with the reason for which this process runs no
/// sample, and its kind. The question of another version may have any form.
fn refuse(
    answers: &Arc<Mutex<File>>,
    question: Option<io::Result<String>>,
    kind: &str,
    message: String,
) -> Result<(), String> {
    let Some(question) = question else { return Ok(()) };
    let question: serde_json::Value = question.map_err(|error| error.to_string()).and_then(|line| read(&line))?;
    let failure = SampleFailure { kind: kind.to_owned(), message };
    let record = ArmRecord::new(String::new(), Err(failure));
    let answering = Answering { answers: answers.clone(), process: std::process::id() };
    answering.answer(question, ArmRun { record, wall_s: 0.0, check_s: 0.0 }, Stage::Last)
}

fn read<T: serde::de::DeserializeOwned>(line: &str) -> Result<T, String> {
    serde_json::from_str(line).map_err(|error| format!("failed to read a message: {error}"))
}

/// The output of the answers, and the process that gives them.
#[derive(Clone)]
struct Answering {
    answers: Arc<Mutex<File>>,
    /// The number of the process when it got its task. A copy that the controller has made of it
    /// (`fork`) has another one.
    process: u32,
}

impl Answering {
    fn answer<Q: serde::Serialize>(&self, question: Q, run: ArmRun, stage: Stage) -> Result<(), String> {
        let ArmRun { record, wall_s, check_s } = run;
        let copied_from = (std::process::id() != self.process).then_some(self.process);
        let answer = Answer { question, copied_from, record, wall_s, check_s, stage };
        let mut line = serde_json::to_vec(&answer).map_err(|error| error.to_string())?;
        line.push(b'\n');
        lock(&self.answers).write_all(&line).map_err(|error| error.to_string())
    }
}
