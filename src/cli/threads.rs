//! Worker threads, started once for the whole program.

use super::usage;
use crate::base::diagnostics::{Cause, Diagnostic, Diagnostics};
use crate::base::limits;

/// Starts so many worker threads, or as many as the environment or the machine says.
///
/// # Errors
/// More than may be asked for; the system does not give them.
pub fn start(wanted: Option<usize>) -> Result<(), Diagnostics> {
    let count = match wanted {
        Some(count) => count,
        None => from_environment(std::env::var("RAYON_NUM_THREADS").ok().as_deref())?,
    };
    let started = rayon::ThreadPoolBuilder::new().num_threads(count).build_global();
    started.map_err(|error| {
        let problem = Diagnostic::error(format!("cannot start {count} worker threads: {error}"));
        problem.because(Cause::Io).help("--threads 1 takes the fewest").into()
    })
}

/// The count that the usual variable of the thread pool asks for, or one for each core.
fn from_environment(variable: Option<&str>) -> Result<usize, Diagnostics> {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get()).min(limits::THREADS);
    match variable.filter(|text| !text.is_empty()).map(|text| text.parse::<usize>()) {
        None | Some(Ok(0)) => Ok(cores),
        Some(Ok(count)) if count <= limits::THREADS => Ok(count),
        Some(_) => {
            let text = variable.unwrap_or_default();
            Err(usage(format!("RAYON_NUM_THREADS={text}: expected a number from 1 to {}", limits::THREADS)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_environment_is_bounded_as_the_option_is() {
        assert_eq!(from_environment(Some("3")).unwrap(), 3);
        assert!(from_environment(Some("0")).unwrap() >= 1 && from_environment(None).unwrap() >= 1);
        for wrong in ["1000000", "many", "-1"] {
            assert!(from_environment(Some(wrong)).unwrap_err().to_string().contains("RAYON_NUM_THREADS"), "{wrong}");
        }
    }
}
