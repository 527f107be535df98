//! One child process, from its start to its end. Every wait has a time limit, whatever the process
//! does, and the process is always reaped.
//!
//! Three threads serve the process, each blocked on one pipe: one writes requests, one reads
//! answers, one drains standard error. Full pipes in both directions can therefore not block both
//! sides. The threads end with the process, whose pipes then close.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::FileExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{self, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, waitid};

use super::error::{ExecError, is_long};
use super::group::Group;
use super::late::keep_bad_end;
use super::lines::{Line, MAX_LINE_BYTES, Tail, excerpt, read_lines};
use super::processes::{self, Entry};
use super::protocol::{END, stated_error};
use super::settings::ExecSettings;
use super::start;

/// Interval at which the memory of the process is checked while its answer is awaited.
const MEMORY_CHECK_INTERVAL: Duration = Duration::from_millis(20);

/// Number of answers to control steps after which the memory is looked at again, besides: the same
/// steps in each repetition. A look takes a twentieth of the time of a fast controller's step.
const MEMORY_CHECK_ANSWERS: u64 = 8;

/// Time that a process has to end by itself once its standard input is closed, and its last output
/// to arrive.
const EXIT_TIMEOUT: Duration = Duration::from_millis(500);

/// Time that a process has to end once its standard output has ended, until it counts as one that
/// closed its output and goes on. A process may end slowly where many share the processors.
const CLOSED_TIMEOUT: Duration = Duration::from_secs(3);

/// Interval at which a process is polled for its end.
const EXIT_POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Interval at which a process is looked at that has to end.
const FINISH_POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Time in which the last lines of a process that has ended arrive, if another process holds its
/// pipe open.
const DRAIN_TIMEOUT: Duration = Duration::from_millis(50);

/// Number of lines that are buffered. A process that writes more lines than that has to wait.
const BUFFERED_LINES: usize = 2;

/// Size of the blocks in which standard error is read (bytes).
const CHUNK_BYTES: usize = 4_096;

/// How closely the memory of a process is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MemoryLook {
    /// At the answer to a control step. A peak since the last look is seen at the next one, which
    /// comes 20 ms later, or at the end of the process, which serves one run.
    Step,
    /// At the answer of a process that serves several samples: a peak belongs to the last one.
    Peak,
}

/// A child process with its pipes.
pub struct Child {
    process: process::Child,
    /// `None` once the standard input of the process is to be closed.
    requests: Option<Sender<Vec<u8>>>,
    answers: Receiver<(Line, bool)>,
    /// Whether the process wrote more together with the last line that was received.
    is_followed: bool,
    /// The pipe from which the reading thread reads, to see what it has not read yet.
    answer_pipe: Option<OwnedFd>,
    /// The end of standard error.
    stderr: Arc<Mutex<Tail>>,
    /// Disconnected once standard error is closed.
    stderr_end: Receiver<()>,
    memory_mib: u64,
    /// The group that limits the memory, where the system allows one.
    group: Option<Group>,
    /// Number of answers so far, including the greeting.
    answered: u64,
    /// The file that tells the resident memory of the process, if the system has one.
    resident: Option<File>,
    /// True from the first line on that cannot be written: the process has closed its input.
    has_closed_input: Arc<AtomicBool>,
    /// When the memory of its descendants was looked at last.
    tree_looked: Instant,
    /// Whether the process has failed. It is then killed without time to end by itself.
    has_failed: bool,
    /// The entry in the registry of processes; `None` once the process is reaped.
    entry: Option<Entry>,
}

impl Child {
    /// Starts the process in the given folder, or in the folder of this program.
    ///
    /// # Errors
    /// [`ExecError`] if it cannot be started.
    pub fn start(settings: &ExecSettings, folder: Option<&Path>) -> Result<Self, ExecError> {
        let invalid_command = || ExecError::Command { command: settings.command.clone() };
        let words = settings.words().ok_or_else(invalid_command)?;
        let (program, arguments) = words.split_first().ok_or_else(invalid_command)?;
        let path = match folder {
            // A path is relative to the folder. A bare name is looked for in PATH.
            Some(folder) if program.contains('/') => folder.join(program),
            _ => PathBuf::from(program),
        };
        let start_error = |source: io::Error| ExecError::Start {
            program: program.clone(),
            reason: start::reason(
                program,
                &folder.map_or_else(|| path.clone(), |folder| folder.join(program)),
                &source,
            ),
            source,
        };
        let mut command = Command::new(&path);
        if let Some(folder) = folder {
            command.current_dir(folder);
        }
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let (mut process, entry) = processes::start(&mut command).map_err(start_error)?;
        let pipes = (process.stdin.take(), process.stdout.take(), process.stderr.take());
        let (requests, request_receiver) = channel();
        let (answer_sender, answers) = sync_channel(BUFFERED_LINES);
        let (end_sender, stderr_end) = channel();
        let stderr_tail = Arc::new(Mutex::new(Tail::default()));
        // Created before the threads: if a thread cannot be started, the process is killed and
        // reaped.
        let mut child = Self {
            process,
            requests: Some(requests),
            answers,
            is_followed: false,
            answer_pipe: pipes.1.as_ref().and_then(|stdout| stdout.as_fd().try_clone_to_owned().ok()),
            stderr: Arc::clone(&stderr_tail),
            stderr_end,
            memory_mib: settings.memory_mib,
            group: None,
            answered: 0,
            resident: None,
            has_closed_input: Arc::default(),
            tree_looked: Instant::now(),
            has_failed: true,
            entry: Some(entry),
        };
        child.group = Group::of(child.process.id(), settings.memory_mib);
        child.resident = File::open(format!("/proc/{}/statm", child.process.id())).ok();
        if let (Some(stdin), Some(stdout), Some(stderr)) = pipes {
            let has_closed_input = Arc::clone(&child.has_closed_input);
            spawn_thread("write", move || write_all(stdin, &request_receiver, &has_closed_input))
                .map_err(start_error)?;
            spawn_thread("read", move || read_lines(stdout, &answer_sender)).map_err(start_error)?;
            spawn_thread("listen", move || drain(stderr, &stderr_tail, end_sender)).map_err(start_error)?;
        }
        child.has_failed = false;
        Ok(child)
    }

    /// Returns the number of the process.
    pub fn id(&self) -> u32 {
        self.process.id()
    }

    /// Tries whether the process can be started. It is killed at once.
    ///
    /// # Errors
    /// [`ExecError`] if it cannot be started.
    pub fn try_start(settings: &ExecSettings, folder: Option<&Path>) -> Result<(), ExecError> {
        let mut child = Self::start(settings, folder)?;
        // It need not end by itself.
        child.has_failed = true;
        Ok(())
    }

    /// Sends a line that needs no answer.
    pub fn send(&self, line: Vec<u8>) {
        // If the writing thread is gone, so is the process, which reading then reports.
        if let Some(requests) = &self.requests {
            drop(requests.send(line));
        }
    }

    /// Sends a line and waits for its answer. Returns `None` if there is none within `limit`: the
    /// process is then killed when this value is dropped.
    ///
    /// # Errors
    /// [`ExecError`] if the process ends, or does not keep to its limits.
    pub fn request_within(&mut self, line: Vec<u8>, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        // What the process writes before it is greeted is accepted as the answer to the greeting.
        let checked = if self.answered > 0 { self.reject_unrequested_line() } else { Ok(()) };
        let answer = checked.and_then(|()| {
            self.send(line);
            self.wait(limit, MemoryLook::Peak)
        });
        match &answer {
            Ok(Some(_)) => self.answered += 1,
            Ok(None) | Err(_) => self.has_failed = true,
        }
        answer
    }

    /// Waits for one more answer to the last line that was sent. Returns `None` if there is none
    /// within `limit`: the process is then killed when this value is dropped.
    ///
    /// # Errors
    /// [`ExecError`] if the process ends, or does not keep to its limits.
    pub fn more_within(&mut self, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        let answer = self.wait(limit, MemoryLook::Peak);
        self.has_failed |= !matches!(answer, Ok(Some(_)));
        answer
    }

    /// Closes the standard input of the process, and checks that it has written only its answers,
    /// and that no signal ends it. A process that does not end by itself in a short time is killed,
    /// which is no error.
    ///
    /// # Errors
    /// [`ExecError`] if a line is left over: an earlier line may have been taken for the answer to
    /// another question. [`ExecError::BadEnd`] if the process ends by a signal.
    pub fn finish(&mut self) -> Result<(), ExecError> {
        match self.end()? {
            Some(_) if self.has_exceeded() => Err(ExecError::Memory { limit_mib: self.memory_mib }),
            Some(status) if status.signal().is_some() => Err(ExecError::BadEnd { status, stderr: self.last_lines() }),
            Some(_) | None => Ok(()),
        }
    }

    /// Closes the standard input of the process, and checks that it has written only its answers.
    /// Returns its exit status if it ends by itself in a short time. If it does not, it is killed.
    fn end(&mut self) -> Result<Option<process::ExitStatus>, ExecError> {
        // A peak since the last look.
        if self.exceeds_memory(MemoryLook::Peak) {
            self.has_failed = true;
            return Err(ExecError::Memory { limit_mib: self.memory_mib });
        }
        self.requests = None;
        let started = Instant::now();
        let mut ended: Option<Instant> = None;
        let left_over = loop {
            match self.receive_within(FINISH_POLL_INTERVAL) {
                Ok(line) => break Some(line),
                Err(RecvTimeoutError::Disconnected) => break None,
                // It has had its time to end by itself.
                Err(RecvTimeoutError::Timeout) if started.elapsed() >= EXIT_TIMEOUT => break None,
                // A descendant may hold the pipe open after the end of the process. What the
                // process has written still arrives.
                Err(RecvTimeoutError::Timeout) if ended.is_some_and(|at| at.elapsed() >= DRAIN_TIMEOUT) => break None,
                Err(RecvTimeoutError::Timeout) => {
                    if ended.is_none() && self.has_ended() {
                        ended = Some(Instant::now());
                    }
                }
            }
        };
        match left_over {
            None => Ok(self.own_end(EXIT_TIMEOUT.saturating_sub(started.elapsed()))),
            Some(line) => {
                self.has_failed = true;
                Err(match line {
                    Line::Whole(line) => ExecError::OutOfTurn { answered: self.answered, line: excerpt(&line) },
                    Line::TooLong => ExecError::LongLine { limit: MAX_LINE_BYTES },
                })
            }
        }
    }

    /// Works like [`Self::finish`], for a process of this program with nothing left to do than to
    /// unload a library. How that ends the process is no error: the process of a campaign unloads
    /// the library after all its samples. A bad end is kept under `name`: see
    /// [`take_bad_ends`](super::take_bad_ends).
    ///
    /// # Errors
    /// [`ExecError`] if a line is left over.
    pub fn finish_unloading(&mut self, name: &str) -> Result<(), ExecError> {
        if let Some(status) = self.end()?.filter(|status| !status.success()) {
            keep_bad_end(name, status, &self.last_lines());
        }
        Ok(())
    }

    /// Lets a process of this program free what it has run, and then ends it like
    /// [`Self::finish_unloading`]. `limit` is the time limit of the freeing.
    ///
    /// # Errors
    /// [`ExecError`] if the process ends or hangs as it frees it, or if a line is left over.
    pub fn finish_run(&mut self, name: &str, limit: Duration) -> Result<(), ExecError> {
        let answer = self.request(format!("{END}\n").into_bytes(), limit)?;
        if answer != END.as_bytes() {
            self.has_failed = true;
            let out_of_turn =
                || ExecError::OutOfTurn { answered: self.answered.saturating_sub(1), line: excerpt(&answer) };
            return Err(stated_error(&answer).unwrap_or_else(out_of_turn));
        }
        self.finish_unloading(name)
    }

    /// Returns the files that the process has mapped or opened, if the system tells.
    pub fn open_files(&self) -> Vec<PathBuf> {
        let of_process = PathBuf::from(format!("/proc/{}", self.process.id()));
        let maps = std::fs::read_to_string(of_process.join("maps")).unwrap_or_default();
        let is_shared = |line: &&str| line.split_whitespace().nth(1).is_some_and(|rights| rights.starts_with("rw-s"));
        let mapped = maps
            .lines()
            .filter(|line| !is_shared(line))
            .filter_map(|line| Some(PathBuf::from(&line[line.find('/')?..])));
        let opened = std::fs::read_dir(of_process.join("fd")).into_iter().flatten().flatten();
        // A file that the process writes changes, and is no part of it.
        let is_read = |link: &std::fs::DirEntry| {
            let info = std::fs::read_to_string(of_process.join("fdinfo").join(link.file_name())).unwrap_or_default();
            let flags = info.lines().find_map(|line| line.strip_prefix("flags:"));
            flags.is_some_and(|flags| flags.trim().ends_with(['0', '4']))
        };
        let opened = opened.filter(is_read).filter_map(|link| std::fs::read_link(link.path()).ok());
        let mut files: Vec<PathBuf> =
            mapped.chain(opened).filter(|path| path.is_absolute() && path.is_file()).collect();
        files.sort();
        files.dedup();
        files
    }

    /// Lets the process be killed without time to end by itself.
    pub const fn condemn(&mut self) {
        self.has_failed = true;
    }

    /// Returns the number of answers so far.
    pub const fn answered(&self) -> u64 {
        self.answered
    }

    /// Sends a line and waits for its answer. `limit` is the time limit.
    ///
    /// # Errors
    /// [`ExecError`] if the process ends, does not answer in time, or does not keep to its limits.
    pub fn request(&mut self, line: Vec<u8>, limit: Duration) -> Result<Vec<u8>, ExecError> {
        let answer = self.exchange(line, limit);
        match &answer {
            Ok(_) => self.answered += 1,
            Err(_) => self.has_failed = true,
        }
        answer
    }

    fn exchange(&mut self, line: Vec<u8>, limit: Duration) -> Result<Vec<u8>, ExecError> {
        // A greeting that the process writes before it is greeted is accepted as the answer to the
        // greeting.
        if self.answered > 0 {
            self.reject_unrequested_line()?;
        }
        self.send(line);
        match self.wait(limit, MemoryLook::Step)? {
            Some(answer) => Ok(answer),
            // A second wait distinguishes a late process from one that hangs. The limit of a start
            // is long enough for that.
            None => Err(match if is_long(limit.as_millis()) { None } else { self.wait(limit, MemoryLook::Step)? } {
                Some(_) => ExecError::Late { limit_ms: limit.as_millis(), answered: self.answered },
                None => {
                    let has_closed_input = self.has_closed_input.load(Ordering::Relaxed);
                    let (limit_ms, answered, stderr) = (limit.as_millis(), self.answered, self.last_lines());
                    ExecError::Hangs { limit_ms, answered, has_closed_input, stderr }
                }
            }),
        }
    }

    /// Returns an error if the process has written a line since its last answer, which would be
    /// mistaken for the next one.
    fn reject_unrequested_line(&mut self) -> Result<(), ExecError> {
        let line = match self.answers.try_recv() {
            // The process has written, and the reading thread has not come to it.
            Err(TryRecvError::Empty) if self.is_followed || self.has_unread() => self.receive_within(EXIT_TIMEOUT),
            Err(TryRecvError::Empty) => return Ok(()),
            Err(TryRecvError::Disconnected) => return Err(self.exit_error()),
            Ok((line, _)) => Ok(line),
        };
        match line {
            Ok(Line::Whole(line)) => Err(ExecError::OutOfTurn { answered: self.answered, line: excerpt(&line) }),
            Ok(Line::TooLong) => Err(ExecError::LongLine { limit: MAX_LINE_BYTES }),
            Err(RecvTimeoutError::Disconnected) => Err(self.exit_error()),
            // The beginning of a line: its end may come as an answer.
            Err(RecvTimeoutError::Timeout) => Ok(()),
        }
    }

    /// Returns the next line.
    fn receive_within(&mut self, limit: Duration) -> Result<Line, RecvTimeoutError> {
        let (line, is_followed) = self.answers.recv_timeout(limit)?;
        self.is_followed = is_followed;
        Ok(line)
    }

    /// Returns whether the process has written what nobody has read yet.
    fn has_unread(&self) -> bool {
        self.answer_pipe.as_ref().is_some_and(|pipe| rustix::io::ioctl_fionread(pipe).is_ok_and(|bytes| bytes > 0))
    }

    /// Returns the next line, or `None` if there is none within the time limit.
    fn wait(&mut self, limit: Duration, look: MemoryLook) -> Result<Option<Vec<u8>>, ExecError> {
        let started = Instant::now();
        loop {
            let left = limit.saturating_sub(started.elapsed());
            let line = self.receive_within(left.min(MEMORY_CHECK_INTERVAL));
            if line != Err(RecvTimeoutError::Disconnected) && self.exceeds_memory(look) {
                return Err(ExecError::Memory { limit_mib: self.memory_mib });
            }
            match line {
                Ok(Line::Whole(line)) => return Ok(Some(line)),
                Ok(Line::TooLong) => return Err(ExecError::LongLine { limit: MAX_LINE_BYTES }),
                Err(RecvTimeoutError::Disconnected) => return Err(self.exit_error()),
                // A descendant may hold the pipe open after the end of the process. What the
                // process has written still arrives.
                Err(RecvTimeoutError::Timeout) if self.has_ended() => match self.receive_within(EXIT_TIMEOUT) {
                    Ok(Line::Whole(line)) => return Ok(Some(line)),
                    _ => return Err(self.exit_error()),
                },
                Err(RecvTimeoutError::Timeout) if left.is_zero() => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Returns whether the process, or the process with its descendants, holds or held more memory
    /// than allowed.
    fn exceeds_memory(&mut self, look: MemoryLook) -> bool {
        let is_due = self.tree_looked.elapsed() >= MEMORY_CHECK_INTERVAL;
        if is_due {
            self.tree_looked = Instant::now();
        }
        let is_counted = self.answered.is_multiple_of(MEMORY_CHECK_ANSWERS);
        let limit = self.memory_mib;
        (is_counted && self.resident_mib() > limit)
            || ((is_due || look == MemoryLook::Peak) && self.peak_memory_mib() > limit)
            || (is_due && self.tree_memory_mib() > limit)
    }

    /// Returns the resident memory of the process (MiB), or 0 if the system does not report it.
    fn resident_mib(&self) -> u64 {
        let mut text = [0; 128];
        let read = self.resident.as_ref().and_then(|file| file.read_at(&mut text, 0).ok()).unwrap_or(0);
        // Number of pages: of the address space, and of the resident part.
        let pages =
            std::str::from_utf8(&text[..read]).ok().and_then(|text| text.split(' ').nth(1)?.parse::<u64>().ok());
        pages.map_or(0, |pages| (pages * page_bytes()).div_ceil(1 << 20))
    }

    /// Returns the peak resident memory of the process (MiB), or 0 if the system does not report
    /// it, for example because the process has just ended.
    fn peak_memory_mib(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id())).unwrap_or_default();
        let peak_kib = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak_kib
            .and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok())
            .map_or(0, |kib| kib.div_ceil(1_024))
    }

    /// Returns the memory of the process and its descendants (MiB), each page counted once, or 0 if
    /// the process has none. A peak between two looks is not seen.
    fn tree_memory_mib(&self) -> u64 {
        let process = self.process.id();
        let orphans = self.entry.as_ref().map_or_else(Vec::new, processes::orphans);
        // A process that has no others is looked at by its peak.
        let roots = orphans.iter().copied().chain([process]);
        let below: Vec<u32> = roots.flat_map(processes::descendants).collect();
        if orphans.is_empty() && below.is_empty() {
            return 0;
        }
        let tree = orphans.into_iter().chain(below).chain([process]);
        tree.map(proportional_kib).sum::<u64>().div_ceil(1_024)
    }

    /// Returns whether the system has killed the process or a descendant for its memory.
    fn has_exceeded(&self) -> bool {
        self.group.as_ref().is_some_and(Group::has_exceeded)
    }

    /// Returns why standard output has ended: with the process, or before it.
    fn exit_error(&mut self) -> ExecError {
        let (has_ended, answered) = (self.ends_within(CLOSED_TIMEOUT), self.answered);
        let status = self.reap();
        // What the process wrote before its end may still be in the pipe: wait until it is read.
        let _ = self.stderr_end.recv_timeout(EXIT_TIMEOUT);
        match status {
            _ if self.has_exceeded() => ExecError::Memory { limit_mib: self.memory_mib },
            Ok(status) if has_ended => ExecError::Ended { status, answered, stderr: self.last_lines() },
            _ => ExecError::Closed { answered, stderr: self.last_lines() },
        }
    }

    /// Returns how the process ends by itself within `limit`. If it does not, it is killed.
    fn own_end(&mut self, limit: Duration) -> Option<process::ExitStatus> {
        let has_ended = self.ends_within(limit);
        // The system may still write the memory dump of a process that has crashed. Its status then
        // names the signal of the crash.
        let is_killed = |status: process::ExitStatus| !has_ended && status.signal() == Some(Signal::KILL.as_raw());
        let status = self.reap().ok().filter(|status| !is_killed(*status))?;
        if !status.success() {
            // What the process wrote before its end may still be in the pipe.
            let _ = self.stderr_end.recv_timeout(EXIT_TIMEOUT);
        }
        Some(status)
    }

    /// Returns the last lines of standard error.
    fn last_lines(&self) -> String {
        self.stderr.lock().map_or_else(|poisoned| poisoned.into_inner().last_lines(), |tail| tail.last_lines())
    }

    /// Returns whether the process ends by itself within `limit`. It is not reaped by this.
    fn ends_within(&self, limit: Duration) -> bool {
        let started = Instant::now();
        loop {
            if self.has_ended() {
                return true;
            }
            if started.elapsed() >= limit {
                return false;
            }
            thread::sleep(EXIT_POLL_INTERVAL);
        }
    }

    /// Returns whether the process has ended. It is not reaped by this.
    fn has_ended(&self) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        // An error means that there is no process to wait for.
        !matches!(waitid(WaitId::Pid(self.pid()), options), Ok(None))
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.process)
    }

    /// Kills the process with its descendants, and reaps it.
    fn reap(&mut self) -> std::io::Result<process::ExitStatus> {
        match self.entry.take() {
            Some(entry) => processes::end(&mut self.process, &entry),
            None => self.process.wait(),
        }
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // The writing thread ends, and closes the standard input of the process.
        self.requests = None;
        if self.entry.is_some() && !self.has_failed {
            self.ends_within(EXIT_TIMEOUT);
        }
        drop(self.reap());
    }
}

/// Returns the size of a page (bytes), which the system tells each process at its start, or 4 KiB.
fn page_bytes() -> u64 {
    /// The key of the size among the pairs of key and value (`AT_PAGESZ` of `getauxval`).
    const KEY: usize = 6;
    const WORD: usize = size_of::<usize>();
    static BYTES: OnceLock<u64> = OnceLock::new();
    *BYTES.get_or_init(|| {
        let told = std::fs::read("/proc/self/auxv").unwrap_or_default();
        let word = |bytes: &[u8]| bytes.try_into().map(usize::from_ne_bytes).unwrap_or_default();
        let mut pairs = told.chunks_exact(2 * WORD).map(|pair| (word(&pair[..WORD]), word(&pair[WORD..])));
        pairs.find(|(key, _)| *key == KEY).map_or(4_096, |(_, bytes)| bytes as u64)
    })
}

/// Returns the memory of a process (KiB), of shared pages its share; 0 if the system does not tell.
fn proportional_kib(process: u32) -> u64 {
    let summary = std::fs::read_to_string(format!("/proc/{process}/smaps_rollup")).unwrap_or_default();
    let pss = summary.lines().find_map(|line| line.strip_prefix("Pss:"));
    pss.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

fn spawn_thread(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    thread::Builder::new().name(format!("controller-{name}")).spawn(work).map(drop)
}

/// Writes every received line to standard input.
fn write_all(mut stdin: ChildStdin, lines: &Receiver<Vec<u8>>, has_closed_input: &AtomicBool) {
    // A process that has stopped reading does not answer, which `request` reports.
    while let Ok(line) = lines.recv() {
        if stdin.write_all(&line).and_then(|()| stdin.flush()).is_err() {
            has_closed_input.store(true, Ordering::Relaxed);
            return;
        }
    }
}

/// Reads standard error to its end into `tail`, then drops `end`.
fn drain(mut stderr: impl Read, tail: &Mutex<Tail>, end: Sender<()>) {
    let mut chunk = [0; CHUNK_BYTES];
    while let Ok(read @ 1..) = stderr.read(&mut chunk) {
        if let Ok(mut tail) = tail.lock() {
            tail.push(&chunk[..read]);
        }
    }
    drop(end);
}
