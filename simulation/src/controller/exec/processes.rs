//! The processes of all controllers. None of them outlives its sample, and none outlives Closecall.
//!
//! ```text
//!  closecall ──▶ controller ──▶ descendants in its process group ── killed with the group
//!      │              └───────▶ descendants that called setsid ──── become children of closecall, found by their mark
//!      └───────▶ guard (sh) ── waits for the end of closecall, then kills every process with a mark
//! ```
//!
//! The environment of each controller holds a *mark*, which its descendants inherit.
//! [`adopt_orphans`] makes the program the subreaper of its descendants: a process whose parent has
//! ended becomes a child of this program, whatever session it belongs to. The end of a controller
//! kills the orphans with its mark.
//!
//! The guard covers the case in which this program is killed by SIGKILL and can do nothing itself.
//! One case remains: a process that has both left the process group and cleared its environment
//! survives a SIGKILL of this program.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitOptions, getpgid, kill_process, kill_process_group, set_child_subreaper,
    waitid, waitpid,
};

/// The environment variable that holds the mark of a controller's process.
const MARK: &str = "CLOSECALL_CONTROLLER_PROCESS";
/// Largest number of searches for orphans. Each round finds the children of the processes that the
/// round before has killed.
const MAX_ROUNDS: usize = 64;
/// Time that a killed process has to end.
const KILL_TIMEOUT: Duration = Duration::from_secs(1);
/// Interval at which a killed process is polled for its end.
const POLL_INTERVAL: Duration = Duration::from_micros(200);

/// Waits for the end of standard input, which is the end of Closecall, and kills every process
/// whose environment holds the first argument. The exit status of `grep` says nothing: the last
/// file that cannot be read decides it.
const GUARD: &str = r#"
trap '' HUP INT TERM
read -r end
round=0
while [ $round -lt 50 ]; do
    found=$(grep -lsF "$1" /proc/[0-9]*/environ)
    [ -n "$found" ] || exit 0
    for file in $found; do
        process=${file#/proc/}
        kill -KILL "${process%/environ}"
    done
    round=$((round + 1))
    sleep 0.05
done 2>/dev/null
"#;

static REGISTRY: Mutex<Registry> = Mutex::new(Registry {
    adopts: false,
    is_closed: false,
    prefix: None,
    guard: None,
    started: 0,
    live: BTreeMap::new(),
});

/// The processes of this program.
struct Registry {
    /// True if this program is the subreaper of its descendants, and has no other children than
    /// those listed here.
    adopts: bool,
    /// True if no further process may be started.
    is_closed: bool,
    /// The part of the mark that all processes of this program share.
    prefix: Option<String>,
    /// The guard, whose standard input ends with this program.
    guard: Option<(Child, Option<ChildStdin>)>,
    /// Number of processes started so far.
    started: u64,
    /// The controllers that have not been reaped, by their numbers.
    live: BTreeMap<u64, Pid>,
}

/// The entry of a controller in the registry.
#[derive(Debug)]
pub(super) struct Entry {
    number: u64,
    mark: String,
}

/// Makes this program responsible for all descendants of its controllers, also for those that leave
/// their process group.
///
/// The program must have no other children: it kills and reaps every child that is not a running
/// controller. On systems other than Linux this does nothing, and only the process groups of the
/// controllers are killed.
pub fn adopt_orphans() {
    lock().adopts = set_child_subreaper(Some(rustix::process::getpid())).is_ok();
}

/// Kills all controllers with their descendants. No controller can be started afterwards.
pub fn end_all() {
    let mut registry = lock();
    registry.is_closed = true;
    let live: Vec<Pid> = registry.live.values().copied().collect();
    for pid in &live {
        let _ = kill_process_group(*pid, Signal::KILL);
    }
    // The descendants of a process become children of this program when that process ends.
    let started = Instant::now();
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    while live.iter().any(|pid| matches!(waitid(WaitId::Pid(*pid), options), Ok(None)))
        && started.elapsed() < KILL_TIMEOUT
    {
        thread::sleep(POLL_INTERVAL);
    }
    registry.end_orphans(None);
}

/// Starts a controller in a separate process group.
pub(super) fn start(command: &mut Command) -> io::Result<(Child, Entry)> {
    // The lock is held until the process is listed: no other thread takes it for an orphan.
    let mut registry = lock();
    if registry.is_closed {
        return Err(io::Error::new(io::ErrorKind::Interrupted, "the program is ending"));
    }
    let prefix = registry.prefix().to_owned();
    let number = registry.started;
    let mark = format!("{prefix}{number}.");
    let process = command.env(MARK, &mark).process_group(0).spawn()?;
    registry.started += 1;
    registry.live.insert(number, Pid::from_child(&process));
    Ok((process, Entry { number, mark }))
}

/// Kills the process group of a controller, reaps the controller, and kills its remaining
/// descendants.
pub(super) fn end(process: &mut Child, entry: &Entry) -> io::Result<ExitStatus> {
    // Until it is reaped, its process ID identifies it and its group, even if it has ended.
    let _ = kill_process_group(Pid::from_child(process), Signal::KILL);
    let status = process.wait();
    let mut registry = lock();
    registry.live.remove(&entry.number);
    registry.end_orphans(Some(&entry.mark));
    status
}

fn lock() -> MutexGuard<'static, Registry> {
    REGISTRY.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Registry {
    /// Returns the part of the mark that all processes of this program share. Starts the guard at
    /// the first call.
    fn prefix(&mut self) -> &str {
        if self.adopts && self.guard.is_none() {
            let prefix = self.prefix.get_or_insert_with(new_prefix);
            // Without a guard, only a SIGKILL of this program leaves processes behind.
            self.guard = start_guard(&format!("{MARK}={prefix}")).ok();
        }
        self.prefix.get_or_insert_with(new_prefix)
    }

    /// Returns the children of this program that are no orphans: the controllers and the guard.
    fn kept(&self) -> BTreeSet<i32> {
        let mut kept: BTreeSet<i32> = self.live.values().map(|pid| pid.as_raw_nonzero().get()).collect();
        kept.extend(self.guard.iter().map(|(guard, _)| Pid::from_child(guard).as_raw_nonzero().get()));
        kept
    }

    /// Kills and reaps the orphans with this mark, or all orphans. Reaps processes that have ended
    /// by themselves.
    fn end_orphans(&mut self, mark: Option<&str>) {
        if !self.adopts {
            return;
        }
        let kept = self.kept();
        for _ in 0..MAX_ROUNDS {
            let mut has_killed = false;
            for pid in own_children().into_iter().filter(|pid| !kept.contains(&pid.as_raw_nonzero().get())) {
                // This reaps an orphan that has ended.
                let has_ended = !matches!(waitpid(Some(pid), WaitOptions::NOHANG), Ok(None));
                if !has_ended && mark.is_none_or(|mark| has_mark(pid, mark)) {
                    kill_and_reap(pid);
                    has_killed = true;
                }
            }
            if !has_killed {
                return;
            }
        }
    }
}

/// Returns a text that identifies this program among all that run, and have run, on this machine.
fn new_prefix() -> String {
    format!("{}.{:016x}.", std::process::id(), RandomState::new().build_hasher().finish())
}

fn start_guard(mark: &str) -> io::Result<(Child, Option<ChildStdin>)> {
    let mut guard = Command::new("sh")
        .args(["-c", GUARD, "closecall-guard", mark])
        .current_dir("/")
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        // A signal to the process group of this program does not reach the guard.
        .process_group(0)
        .spawn()?;
    let stdin = guard.stdin.take();
    Ok((guard, stdin))
}

/// Kills an orphan, with its process group if it leads one, and reaps it.
fn kill_and_reap(pid: Pid) {
    if getpgid(Some(pid)) == Ok(pid) {
        let _ = kill_process_group(pid, Signal::KILL);
    }
    let _ = kill_process(pid, Signal::KILL);
    let started = Instant::now();
    while matches!(waitpid(Some(pid), WaitOptions::NOHANG), Ok(None)) && started.elapsed() < KILL_TIMEOUT {
        thread::sleep(POLL_INTERVAL);
    }
}

/// Returns the descendants of a process. Those whose parents have ended are children of this
/// program, and not among them: see [`orphans`].
pub(super) fn descendants(process: u32) -> Vec<u32> {
    let mut tree = vec![process];
    let mut index = 0;
    while let Some(parent) = tree.get(index).copied() {
        let threads = fs::read_dir(format!("/proc/{parent}/task")).into_iter().flatten().flatten();
        let lists = threads.filter_map(|thread| fs::read_to_string(thread.path().join("children")).ok());
        let children: Vec<u32> = lists
            .flat_map(|list| list.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<_>>())
            .collect();
        tree.extend(children.into_iter().filter(|child| !tree.contains(child)).collect::<Vec<_>>());
        index += 1;
    }
    tree.split_off(1)
}

/// Returns the descendants of a controller whose parents have ended, such as a process that a
/// controller sends into the background. There are none if this program does not adopt them: see
/// [`adopt_orphans`]. A process that has cleared its environment is not among them.
pub(super) fn orphans(entry: &Entry) -> Vec<u32> {
    let registry = lock();
    if !registry.adopts {
        return Vec::new();
    }
    let kept = registry.kept();
    drop(registry);
    // The system gives orphans to the first thread of the program that adopts them.
    let list = format!("/proc/self/task/{}/children", std::process::id());
    let adopted = fs::read_to_string(list).unwrap_or_default();
    let adopted = adopted.split_whitespace().filter_map(|id| id.parse().ok()).filter_map(Pid::from_raw);
    let orphans = adopted.filter(|pid| !kept.contains(&pid.as_raw_nonzero().get()) && has_mark(*pid, &entry.mark));
    orphans.filter_map(|pid| u32::try_from(pid.as_raw_nonzero().get()).ok()).collect()
}

/// Returns the children of this program, which include adopted ones.
fn own_children() -> Vec<Pid> {
    let Ok(threads) = fs::read_dir("/proc/self/task") else { return Vec::new() };
    let lists = threads.filter_map(|thread| fs::read_to_string(thread.ok()?.path().join("children")).ok());
    let ids = |list: String| list.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<i32>>();
    lists.flat_map(ids).filter_map(Pid::from_raw).collect()
}

/// Returns true if the environment of a process holds this mark.
fn has_mark(pid: Pid, mark: &str) -> bool {
    let wanted = format!("{MARK}={mark}");
    let environment = fs::read(format!("/proc/{}/environ", pid.as_raw_nonzero())).unwrap_or_default();
    environment.split(|byte| *byte == 0).any(|entry| entry == wanted.as_bytes())
}
