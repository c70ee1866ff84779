//! Time that the processor has worked, which a busy machine does not lengthen. It decides nothing but failures.

use std::time::Duration;

/// What this thread has used of the processor.
pub fn thread_time() -> Duration {
    system::thread()
}

/// What all threads of this process have used of processors.
pub fn process_time() -> Duration {
    system::process()
}

#[cfg(unix)]
mod system {
    use rustix::time::{ClockId, Timespec, clock_gettime};
    use std::time::Duration;

    fn duration(time: Timespec) -> Duration {
        Duration::new(time.tv_sec.max(0) as u64, time.tv_nsec.max(0) as u32)
    }

    pub fn thread() -> Duration {
        duration(clock_gettime(ClockId::ThreadCPUTime))
    }

    pub fn process() -> Duration {
        duration(clock_gettime(ClockId::ProcessCPUTime))
    }
}

#[cfg(windows)]
mod system {
    use std::time::Duration;

    pub fn thread() -> Duration {
        cpu_time::ThreadTime::try_now().map(|time| time.as_duration()).unwrap_or_default()
    }

    pub fn process() -> Duration {
        cpu_time::ProcessTime::try_now().map(|time| time.as_duration()).unwrap_or_default()
    }
}

/// Elsewhere the clock on the wall has to do.
#[cfg(not(any(unix, windows)))]
mod system {
    use std::sync::LazyLock;
    use std::time::{Duration, Instant};

    static START: LazyLock<Instant> = LazyLock::new(Instant::now);

    pub fn thread() -> Duration {
        START.elapsed()
    }

    pub fn process() -> Duration {
        START.elapsed()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleep_is_no_work() {
        let start = thread_time();
        std::thread::sleep(Duration::from_millis(60));
        let slept = thread_time() - start;
        assert!(slept < Duration::from_millis(40), "{slept:?}");
        while thread_time() - start < Duration::from_millis(20) {
            std::hint::spin_loop();
        }
        assert!(process_time() >= Duration::from_millis(20));
    }
}
