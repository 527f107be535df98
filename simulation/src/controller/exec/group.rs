//! The control group (cgroup v2) of a process: the kernel itself keeps the process and its
//! descendants within their memory, between two looks at it, too.
//!
//! ```text
//!  delegated scope or container: this user may write there, and it passes memory on
//!   ├─ own group: Closecall
//!   └─ closecall-PID-NUMBER: one process with its descendants, `memory.max`
//! ```
//!
//! Source: "Control Group v2" of the Linux kernel's documentation. A group with processes of its
//! own passes no controller on to children, except at the root of the hierarchy: the groups are
//! therefore siblings of Closecall's own one. A slice of systemd is no place for them ("Control
//! Group APIs and Delegation" of systemd): who kills the scope of Closecall would not reach them.
//!
//! The sum over the descendants is looked at besides, since a process is moved into its group just
//! after its start. Without a place, as under cgroup v1 or in most containers, there is no group.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::{Access, access};

/// The beginning of the names of groups. The identifier of the program and a number follow.
const PREFIX: &str = "closecall-";
/// The end of the names of systemd's inner groups.
const SLICE: &str = "slice";
/// The controller that limits memory.
const MEMORY: &str = "memory";
/// The file that lists the processes of a group, and takes one that is moved into it.
const PROCESSES: &str = "cgroup.procs";
/// The file that lists the controllers that a group passes on to its children.
const PASSED_ON: &str = "cgroup.subtree_control";
/// Time that killed processes have to leave a group.
const REMOVE_TIMEOUT: Duration = Duration::from_secs(1);
/// Interval at which a group is looked at that is to be removed.
const POLL_INTERVAL: Duration = Duration::from_micros(200);
/// Bytes of a MiB.
const MIB: u64 = 1 << 20;

/// The group in which groups of processes can be created; `None` if there is none.
static PARENT: OnceLock<Option<PathBuf>> = OnceLock::new();
/// Number of groups so far.
static CREATED: AtomicU64 = AtomicU64::new(0);

/// The group of one process and its descendants. They are killed, and the group is removed, when
/// this value is dropped.
#[derive(Debug)]
pub(super) struct Group(PathBuf);

impl Group {
    /// Moves a process that has just started into a group of its own, whose memory is limited;
    /// `None` if this user has no place for one.
    pub(super) fn of(process: u32, memory_mib: u64) -> Option<Self> {
        let parent = PARENT.get_or_init(|| {
            let parent = own_parent()?;
            remove_abandoned(&parent);
            Some(parent)
        });
        Self::create(parent.as_deref()?, process, memory_mib).ok()
    }

    fn create(parent: &Path, process: u32, memory_mib: u64) -> io::Result<Self> {
        let number = CREATED.fetch_add(1, Ordering::Relaxed);
        let folder = parent.join(format!("{PREFIX}{}-{number}", std::process::id()));
        fs::create_dir(&folder)?;
        let group = Self(folder);
        group.write("memory.max", &memory_mib.saturating_mul(MIB).to_string())?;
        // A kernel without swap has no such file.
        group.write("memory.swap.max", "0").ok();
        // All processes end together: a parent would go on without its child.
        group.write("memory.oom.group", "1").ok();
        group.write(PROCESSES, &process.to_string())?;
        Ok(group)
    }

    /// Returns true if the kernel has killed a process because the group needed too much memory.
    pub(super) fn has_exceeded(&self) -> bool {
        let events = fs::read_to_string(self.0.join("memory.events")).unwrap_or_default();
        has_oom_kill(&events)
    }

    /// Writes to a file of the group, which the kernel has created.
    fn write(&self, file: &str, text: &str) -> io::Result<()> {
        let file = fs::OpenOptions::new().write(true).open(self.0.join(file))?;
        // The kernel takes each call as a whole.
        io::Write::write_all(&mut &file, text.as_bytes())
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        // Kernels before 5.14 have no such file.
        self.write("cgroup.kill", "1").ok();
        let started = Instant::now();
        // The folder is busy until the last process has left.
        while fs::remove_dir(&self.0).is_err_and(|error| error.kind() == io::ErrorKind::ResourceBusy)
            && started.elapsed() < REMOVE_TIMEOUT
        {
            thread::sleep(POLL_INTERVAL);
        }
    }
}

/// Returns true if the events of a group say that a process was killed for its memory.
fn has_oom_kill(events: &str) -> bool {
    let counts = events.lines().filter_map(|line| line.strip_prefix("oom_kill "));
    counts.filter_map(|count| count.trim().parse::<u64>().ok()).any(|count| count > 0)
}

/// Returns the group beside which this program runs, if groups that limit memory can be created
/// there.
fn own_parent() -> Option<PathBuf> {
    if !cfg!(target_os = "linux") {
        return None;
    }
    let read = |path| fs::read_to_string(path).ok();
    let own = own_group(&read("/proc/self/mountinfo")?, &read("/proc/self/cgroup")?)?;
    own.parent().filter(|parent| is_place(parent)).map(Path::to_owned)
}

/// Returns true if this user may create groups in a group, and they can limit memory.
fn is_place(group: &Path) -> bool {
    let passed_on = fs::read_to_string(group.join(PASSED_ON)).unwrap_or_default();
    // A process is moved only by who may write to the common ancestor of both groups.
    let is_ours = |path: &Path| access(path, Access::WRITE_OK).is_ok();
    let is_slice = group.extension().is_some_and(|extension| extension == SLICE);
    let has_memory = passed_on.split_whitespace().any(|controller| controller == MEMORY);
    !is_slice && has_memory && is_ours(group) && is_ours(&group.join(PROCESSES))
}

/// Returns the folder of this program's group. `mounts` is `/proc/self/mountinfo`, `groups` is
/// `/proc/self/cgroup`. There is none at the root of the mount, whose parent is no group.
fn own_group(mounts: &str, groups: &str) -> Option<PathBuf> {
    // The line of version 2 has no controllers: `0::/user.slice/…`.
    let path = Path::new(groups.lines().find_map(|line| line.strip_prefix("0::"))?);
    let (root, mount) = mounts.lines().find_map(cgroup2_mount)?;
    let below = path.strip_prefix(root).ok()?;
    // A group outside of the namespace is shown as `/../…`.
    let is_plain = below.components().all(|part| matches!(part, Component::Normal(_)));
    (is_plain && below != Path::new("")).then(|| Path::new(mount).join(below))
}

/// Returns the root within the hierarchy and the mount point, if a line of `/proc/self/mountinfo`
/// describes cgroup v2: `30 23 0:26 / /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw`.
fn cgroup2_mount(line: &str) -> Option<(&str, &str)> {
    let (mount, system) = line.split_once(" - ")?;
    let mut fields = mount.split(' ').skip(3);
    (system.split(' ').next() == Some("cgroup2")).then_some(())?;
    Some((fields.next()?, fields.next()?))
}

/// Removes groups of programs that were killed before they could do so.
fn remove_abandoned(parent: &Path) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let program = name.strip_prefix(PREFIX).and_then(|rest| rest.split('-').next()?.parse::<u32>().ok());
        if program.is_some_and(|program| !Path::new(&format!("/proc/{program}")).exists()) {
            // Fails while a process is left in it.
            fs::remove_dir(entry.path()).ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    const MOUNTS: &str = "22 28 0:21 / /proc rw,nosuid - proc proc rw\n\
                          30 23 0:26 / /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw,nsdelegate\n";

    /// Returns a folder with the files of a group that its parent has created.
    fn group(passed_on: &str) -> TempDir {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(PASSED_ON), passed_on).unwrap();
        fs::write(folder.path().join(PROCESSES), "").unwrap();
        folder
    }

    #[test]
    fn the_own_group_is_the_one_of_version_2_below_its_mount() {
        let scope = "/user.slice/user-1000.slice/user@1000.service/app.slice/run-r1.scope";
        let expected = Some(PathBuf::from(format!("/sys/fs/cgroup{scope}")));
        assert_eq!(own_group(MOUNTS, &format!("0::{scope}\n")), expected);
        // A hybrid hierarchy lists the groups of version 1 first.
        assert_eq!(own_group(MOUNTS, &format!("4:memory:/other\n1:cpu:/\n0::{scope}\n")), expected);
        // A mount that shows a part of the hierarchy.
        let part = MOUNTS.replace("0:26 / ", "0:26 /user.slice ");
        let below = scope.strip_prefix("/user.slice").unwrap();
        assert_eq!(own_group(&part, &format!("0::{scope}\n")), Some(PathBuf::from(format!("/sys/fs/cgroup{below}"))));
        // At the root, outside of the namespace, outside of the mount, under version 1 alone.
        for groups in ["0::/\n", "0::/../outside\n", "4:memory:/user.slice\n", ""] {
            assert_eq!(own_group(MOUNTS, groups), None, "{groups}");
        }
        assert_eq!(own_group(&part, "0::/system.slice/a.service\n"), None);
        assert_eq!(own_group("22 28 0:21 / /proc rw,nosuid - proc proc rw\n", &format!("0::{scope}\n")), None);
    }

    #[test]
    fn a_group_that_does_not_pass_memory_on_is_no_place() {
        assert!(is_place(group("cpu memory pids\n").path()));
        assert!(!is_place(group("cpu pids\n").path()));
        assert!(!is_place(group("memory_recursiveprot\n").path()));
        assert!(!is_place(tempfile::tempdir().unwrap().path()));
        let without_processes = group("memory");
        fs::remove_file(without_processes.path().join(PROCESSES)).unwrap();
        assert!(!is_place(without_processes.path()));
        // A slice belongs to systemd.
        let delegated = group("memory");
        let slice = delegated.path().join("app.slice");
        fs::create_dir(&slice).unwrap();
        for file in [PASSED_ON, PROCESSES] {
            fs::copy(delegated.path().join(file), slice.join(file)).unwrap();
        }
        assert!(is_place(delegated.path()) && !is_place(&slice));
    }

    /// A folder in which no kernel creates the files of a group.
    #[test]
    fn a_group_that_cannot_be_limited_leaves_nothing_behind() {
        let parent = group("memory");
        assert!(Group::create(parent.path(), std::process::id(), 64).is_err());
        assert!(fs::read_dir(parent.path()).unwrap().flatten().all(|entry| entry.path().is_file()));
    }

    #[test]
    fn groups_of_programs_that_are_gone_are_removed() {
        let parent = group("memory");
        // No process has a larger number than 2²² on Linux.
        let names = [format!("{PREFIX}4194305-0"), format!("{PREFIX}{}-7", std::process::id()), "other".to_owned()];
        names.iter().for_each(|name| fs::create_dir(parent.path().join(name)).unwrap());
        remove_abandoned(parent.path());
        let left = names.map(|name| parent.path().join(name).exists());
        assert_eq!(left, [false, true, true]);
    }

    #[test]
    fn only_a_kill_for_memory_counts() {
        assert!(has_oom_kill("low 0\nhigh 0\nmax 41\noom 1\noom_kill 1\noom_group_kill 1\n"));
        assert!(!has_oom_kill("low 0\nhigh 0\nmax 41\noom 1\noom_kill 0\noom_group_kill 0\n"));
        assert!(!has_oom_kill(""));
    }
}
