//! Memory: what the program holds, and what it may hold.
//!
//! Large things are estimated before they are allocated, and compared with what is left of a budget. A program that has a counting allocator says so once, as `main` of `anim` does. A library cannot choose the allocator
//! of the program that it is part of: where nobody has said anything, nothing is known, and where nobody has set a budget,
//! everything fits.

use std::path::Path;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use super::diagnostics::Diagnostic;

/// What a counting allocator can tell and do.
#[derive(Clone, Copy)]
pub struct AllocatorHooks {
    /// Bytes that are allocated now.
    pub held: fn() -> usize,
    /// Lets an allocation that would lead beyond so many bytes fail, which ends the process.
    pub limit: fn(usize),
}

static HOOKS: OnceLock<AllocatorHooks> = OnceLock::new();

/// Says once how the allocator of this program is asked.
pub fn install(hooks: AllocatorHooks) {
    // Whoever comes second speaks of the same allocator: a program has one.
    let _ = HOOKS.set(hooks);
}

/// Bytes that are allocated now.
pub fn held() -> Option<usize> {
    HOOKS.get().map(|hooks| (hooks.held)())
}

/// Lets allocations beyond so many bytes fail.
pub fn limit(bytes: usize) {
    if let Some(hooks) = HOOKS.get() {
        (hooks.limit)(bytes);
    }
}

/// Bytes that the program may hold.
static BUDGET: AtomicU64 = AtomicU64::new(u64::MAX);

/// Sets how many bytes the program may hold; what is estimated to take more is not begun.
pub fn set_budget(bytes: u64) {
    BUDGET.store(bytes, Ordering::Relaxed);
}

/// Bytes that may be allocated yet; `None` where there is no budget.
pub fn left() -> Option<u64> {
    let budget = BUDGET.load(Ordering::Relaxed);
    (budget != u64::MAX).then(|| budget.saturating_sub(held().map_or(0, |bytes| bytes as u64)))
}

/// Sees to it that so many bytes more can be held; `what` says who needs them, as "image.png: 16384 x 8192 pixels".
///
/// # Errors
/// They cannot.
pub fn check(bytes: u64, what: impl FnOnce() -> String) -> Result<(), Diagnostic> {
    let Some(left) = left().filter(|left| *left < bytes) else { return Ok(()) };
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let budget = BUDGET.load(Ordering::Relaxed);
    let problem = format!(
        "{} take about {} MiB of memory, and of {} MiB that may be used {} are left",
        what(),
        mib(bytes),
        budget >> 20,
        left >> 20
    );
    Err(Diagnostic::error(problem).help("make it smaller, or allow more with --memory"))
}

/// Bytes of memory that this machine has, or that its control group leaves to the program; `None` where the system does
/// not say.
pub fn of_machine() -> Option<u64> {
    let total = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| total_of(&text));
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let limits = limit_files(&groups).into_iter().filter_map(|file| {
        // Where there is no limit the file says `max`, or the largest number that there is.
        std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok()
    });
    total.into_iter().chain(limits).min()
}

fn total_of(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib * 1024)
}

/// The files that say how much memory the groups of a process may hold, those of the groups above included.
fn limit_files(groups: &str) -> Vec<String> {
    let mut files = Vec::new();
    for line in groups.lines() {
        let mut parts = line.splitn(3, ':').skip(1);
        let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { continue };
        let (root, name) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            _ if controllers.split(',').any(|one| one == "memory") => {
                ("/sys/fs/cgroup/memory", "memory.limit_in_bytes")
            }
            _ => continue,
        };
        for group in Path::new(path).ancestors() {
            let group = group.to_string_lossy();
            files.push(format!("{root}{}/{name}", group.trim_end_matches('/')));
        }
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_and_those_above_them_say_what_may_be_held() {
        let files = limit_files("0::/user/job 7\n");
        let name = |group: &str| format!("/sys/fs/cgroup{group}/memory.max");
        assert_eq!(files, [name("/user/job 7"), name("/user"), name("")]);
        assert_eq!(limit_files("4:memory:/\n3:cpu,cpuacct:/a\n"), ["/sys/fs/cgroup/memory/memory.limit_in_bytes"]);
        assert_eq!(total_of("MemTotal:       24683612 kB\nMemFree: 1 kB\n"), Some(24_683_612 << 10));
        assert_eq!(total_of("nothing"), None);
    }
}
