//! What the system keeps a script's process from.

/// Limits that hold for the whole of the process: no core of it is left, no file is written.
#[cfg(unix)]
pub fn process() {
    use rustix::process::Resource;
    lower(Resource::Core, 0);
    lower(Resource::Fsize, 0);
}

/// Who has started the process: another number than at first once that one is gone. (A program that is killed hangs up,
/// which a script that runs on does not hear.)
#[cfg(unix)]
pub fn parent() -> i32 {
    rustix::process::getppid().map_or(0, |parent| parent.as_raw_nonzero().get())
}

#[cfg(not(unix))]
pub fn parent() -> i32 {
    0
}

/// Lets the process have so much processor time from now on.
#[cfg(unix)]
pub fn processor(seconds: u64) {
    use rustix::process::Resource;
    let used = crate::base::clock::process_time().as_secs() + 1;
    lower(Resource::Cpu, used + seconds);
}

/// Lets the process have so much more address space than it has now.
#[cfg(target_os = "linux")]
pub fn addresses(more: u64) {
    use rustix::process::Resource;
    let Ok(status) = std::fs::read_to_string("/proc/self/statm") else { return };
    let pages = status.split(' ').next().and_then(|pages| pages.parse::<u64>().ok());
    if let Some(pages) = pages {
        lower(Resource::As, pages * rustix::param::page_size() as u64 + more);
    }
}

/// Lets the process have as much address space as it was given.
#[cfg(unix)]
pub fn all_addresses() {
    lower(rustix::process::Resource::As, u64::MAX);
}

#[cfg(not(unix))]
pub fn all_addresses() {}

/// Where the system minds this limit at all, it does not say how much there is by now.
#[cfg(all(unix, not(target_os = "linux")))]
pub fn addresses(_: u64) {}

#[cfg(not(unix))]
pub fn process() {}

#[cfg(not(unix))]
pub fn processor(_: u64) {}

#[cfg(not(unix))]
pub fn addresses(_: u64) {}

/// Sets a limit that may be raised again, never above what the process was given.
#[cfg(unix)]
fn lower(resource: rustix::process::Resource, value: u64) {
    use rustix::process::{Rlimit, getrlimit, setrlimit};
    let maximum = getrlimit(resource).maximum;
    let current = maximum.map_or(Some(value), |maximum| Some(value.min(maximum))).filter(|value| *value < u64::MAX);
    // A system that does not know the limit is one that it does not hold on.
    let _ = setrlimit(resource, Rlimit { current, maximum });
}
