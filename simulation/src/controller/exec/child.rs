//! One process, from its start to its end: nothing that it does or omits keeps this one waiting for ever, and it is
//! always reaped.
//!
//! Three threads serve it, each blocked on one pipe: one writes, one reads lines, one drains standard error. So neither
//! side can wait for the other with a full pipe in each direction. They end with the process, whose pipes then close.

use std::io::{Read, Write};
use std::os::unix::process::CommandExt;
use std::process::{self, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use super::error::ExecError;
use super::lines::{LONGEST_LINE, Line, Tail, excerpt, read_lines};
use super::settings::ExecSettings;

/// How often a process that is being waited for has its memory looked at.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// How long a process that was told to end may take to do so.
const FAREWELL: Duration = Duration::from_millis(500);

/// How often it is looked whether it has ended.
const PEEK_EVERY: Duration = Duration::from_millis(1);

/// Lines that are read ahead of their use; a process that writes more of them has to wait.
const LINES_AHEAD: usize = 2;

/// Bytes that are read of standard error at a time.
const CHUNK: usize = 4_096;

/// A process with its pipes.
pub(super) struct Child {
    process: process::Child,
    /// Nothing once it was told that no more is asked of it.
    requests: Option<Sender<Vec<u8>>>,
    answers: Receiver<Line>,
    words: Arc<Mutex<Tail>>,
    /// Disconnected once standard error is closed.
    words_end: Receiver<()>,
    memory_mib: u64,
    /// Answers so far, the greeting among them.
    answered: u64,
    /// True once it has failed, so that it need not be given time to end by itself.
    has_failed: bool,
    is_reaped: bool,
}

impl Child {
    /// Starts the command.
    pub(super) fn start(settings: &ExecSettings) -> Result<Self, ExecError> {
        let command = || ExecError::Command { command: settings.command.clone() };
        let words = settings.words().ok_or_else(command)?;
        let (program, arguments) = words.split_first().ok_or_else(command)?;
        let fail = |source| ExecError::Start { program: program.clone(), source };
        let mut process = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            // A group of its own, so that whatever it starts can be killed with it.
            .process_group(0)
            .spawn()
            .map_err(fail)?;
        let pipes = (process.stdin.take(), process.stdout.take(), process.stderr.take());
        let (requests, to_write) = channel();
        let (line_sender, answers) = sync_channel(LINES_AHEAD);
        let (end_sender, words_end) = channel();
        let words = Arc::new(Mutex::new(Tail::default()));
        // Made before the threads are, so that the process is killed and reaped if one cannot be started.
        let mut child = Self {
            process,
            requests: Some(requests),
            answers,
            words: Arc::clone(&words),
            words_end,
            memory_mib: settings.memory_mib,
            answered: 0,
            has_failed: true,
            is_reaped: false,
        };
        if let (Some(stdin), Some(stdout), Some(stderr)) = pipes {
            serve("write", move || write_all(stdin, &to_write)).map_err(fail)?;
            serve("read", move || read_lines(stdout, &line_sender)).map_err(fail)?;
            serve("listen", move || drain(stderr, &words, end_sender)).map_err(fail)?;
        }
        child.has_failed = false;
        Ok(child)
    }

    /// Sends a line and waits for the answer to it.
    pub(super) fn ask(&mut self, line: Vec<u8>, limit: Duration) -> Result<Vec<u8>, ExecError> {
        let answer = self.exchange(line, limit);
        match &answer {
            Ok(_) => self.answered += 1,
            Err(_) => self.has_failed = true,
        }
        answer
    }

    fn exchange(&mut self, line: Vec<u8>, limit: Duration) -> Result<Vec<u8>, ExecError> {
        // Greeting before one is greeted is no offence: what was written then is taken for the answer.
        if self.answered > 0 {
            self.check_silence()?;
        }
        // Where the writer is gone, the process is, and reading will tell.
        if let Some(requests) = &self.requests {
            drop(requests.send(line));
        }
        match self.wait(limit)? {
            Some(answer) => Ok(answer),
            // One that is late is told from one that hangs.
            None => Err(match self.wait(limit)? {
                Some(_) => ExecError::Late { limit_ms: limit.as_millis(), answered: self.answered },
                None => {
                    let (limit_ms, answered, words) = (limit.as_millis(), self.answered, self.words());
                    ExecError::Hangs { limit_ms, answered, words }
                }
            }),
        }
    }

    /// Refuses what was written since the last answer: it would be taken for the next one.
    fn check_silence(&mut self) -> Result<(), ExecError> {
        match self.answers.try_recv() {
            Ok(Line::Whole(line)) => Err(ExecError::OutOfTurn { answered: self.answered, line: excerpt(&line) }),
            Ok(Line::TooLong) => Err(ExecError::LongLine { limit: LONGEST_LINE }),
            Err(TryRecvError::Disconnected) => Err(self.obituary()),
            Err(TryRecvError::Empty) => Ok(()),
        }
    }

    /// The next line, or nothing where none comes in time.
    fn wait(&mut self, limit: Duration) -> Result<Option<Vec<u8>>, ExecError> {
        let started = Instant::now();
        loop {
            let left = limit.saturating_sub(started.elapsed());
            let line = self.answers.recv_timeout(left.min(LOOK_EVERY));
            if line != Err(RecvTimeoutError::Disconnected) && self.peak_memory_mib() > self.memory_mib {
                return Err(ExecError::Memory { limit_mib: self.memory_mib });
            }
            match line {
                Ok(Line::Whole(line)) => return Ok(Some(line)),
                Ok(Line::TooLong) => return Err(ExecError::LongLine { limit: LONGEST_LINE }),
                Err(RecvTimeoutError::Disconnected) => return Err(self.obituary()),
                Err(RecvTimeoutError::Timeout) if left.is_zero() => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The most memory that it ever held (MiB); 0 where the system does not say, as when it has just ended.
    fn peak_memory_mib(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id())).unwrap_or_default();
        let peak_kib = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak_kib
            .and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok())
            .map_or(0, |kib| kib.div_ceil(1_024))
    }

    /// Why there is nothing more to read.
    fn obituary(&mut self) -> ExecError {
        let (has_ended, answered) = (self.ends_within(FAREWELL), self.answered);
        let status = self.reap();
        // Whatever it wrote before it ended is in the pipe, and read by now or soon.
        let _ = self.words_end.recv_timeout(FAREWELL);
        match status {
            Ok(status) if has_ended => ExecError::Ended { status, answered, words: self.words() },
            _ => ExecError::Closed { answered, words: self.words() },
        }
    }

    fn words(&self) -> String {
        self.words.lock().map_or_else(|poisoned| poisoned.into_inner().words(), |words| words.words())
    }

    /// True where it has ended by itself within `limit`; it is not reaped yet.
    fn ends_within(&self, limit: Duration) -> bool {
        let started = Instant::now();
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        loop {
            // An error means that there is nothing to wait for.
            if !matches!(waitid(WaitId::Pid(self.pid()), options), Ok(None)) {
                return true;
            }
            if started.elapsed() >= limit {
                return false;
            }
            thread::sleep(PEEK_EVERY);
        }
    }

    fn pid(&self) -> Pid {
        Pid::from_child(&self.process)
    }

    /// Kills what is left of it, with everything that it has started, and reaps it.
    fn reap(&mut self) -> std::io::Result<process::ExitStatus> {
        // While it is not reaped its number stands for it and its group, even where it has ended.
        if !self.is_reaped {
            let _ = kill_process_group(self.pid(), Signal::KILL);
            self.is_reaped = true;
        }
        self.process.wait()
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // Its standard input ends with the writer.
        self.requests = None;
        if !self.is_reaped && !self.has_failed {
            self.ends_within(FAREWELL);
        }
        drop(self.reap());
    }
}

fn serve(name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
    thread::Builder::new().name(format!("controller-{name}")).spawn(work).map(drop)
}

fn write_all(mut stdin: ChildStdin, lines: &Receiver<Vec<u8>>) {
    // One that does not read any more is found out by its silence.
    while let Ok(line) = lines.recv() {
        if stdin.write_all(&line).and_then(|()| stdin.flush()).is_err() {
            return;
        }
    }
}

/// Reads standard error to its end and keeps the last of it; `end` is dropped then.
fn drain(mut stderr: impl Read, words: &Mutex<Tail>, end: Sender<()>) {
    let mut chunk = [0; CHUNK];
    while let Ok(read @ 1..) = stderr.read(&mut chunk) {
        if let Ok(mut words) = words.lock() {
            words.push(&chunk[..read]);
        }
    }
    drop(end);
}
