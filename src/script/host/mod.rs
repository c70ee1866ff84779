//! Scripts in processes of their own.
//!
//! The program runs itself again with a hidden word, tells that process over a pipe which script to open, and is
//! answered with edits as bytes. A script that ends its process ends nothing else: the end is an error like others, with
//! the frame and, found by running once more to the step before, the line. There are as many processes as threads ask at
//! once; each is told the scene once.
//!
//! | | Linux | macOS and other Unix | Windows |
//! |---|---|---|---|
//! | operations, sizes of values, nesting ([`limits`]) | by the engine | by the engine | by the engine |
//! | bytes held, also within one operation | by the allocator | by the allocator | by the allocator |
//! | address space | `RLIMIT_AS` | where the system minds it | - |
//! | stack | a thread of 64 MiB | a thread of 64 MiB | a thread of 64 MiB |
//! | processor time | by the engine, a watching thread, `RLIMIT_CPU` | the same | by the engine and a watching thread |
//! | ends when the program is killed | within a tenth of a second | the same | when the call is done |
//! | no file can be written, no core is left | `RLIMIT_FSIZE`, `RLIMIT_CORE` | the same | - |
//!
//! What the process may read is what a script may read: the engine offers nothing else. It is not kept from the network
//! or from files by the system, since no script can ask for them.
//!
//! [`limits`]: crate::base::limits

mod autopsy;
mod confine;
mod pool;
mod protocol;
mod server;
mod worker;

pub use pool::{HostPool, Opened};
pub use protocol::MadeStates;
pub use server::serve;

use std::ffi::OsString;
use std::io;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

/// The hidden command by which the program becomes a script's process.
pub const HOST_WORD: &str = "script-host";

/// How a script's process is started.
#[derive(Clone, Debug)]
pub struct HostCommand {
    program: PathBuf,
    arguments: Vec<OsString>,
}

impl HostCommand {
    /// A program that calls [`serve`], as `anim` does for [`HOST_WORD`]; it must be of this very version.
    pub fn new(program: impl Into<PathBuf>, arguments: impl IntoIterator<Item = OsString>) -> Self {
        HostCommand { program: program.into(), arguments: arguments.into_iter().collect() }
    }

    /// This program itself, even if its file has been replaced since it was started, where the system can say so.
    ///
    /// # Errors
    /// The system does not know its file.
    pub fn this_program() -> io::Result<Self> {
        let itself = PathBuf::from("/proc/self/exe");
        let program = if itself.exists() { itself } else { std::env::current_exe()? };
        Ok(HostCommand::new(program, [HOST_WORD.into()]))
    }

    fn start(&self) -> io::Result<Child> {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        apart(&mut command);
        command.spawn()
    }
}

/// An interrupt at the keyboard is for the program: it ends its scripts' processes itself.
#[cfg(unix)]
fn apart(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0).arg0("anim");
}

#[cfg(windows)]
fn apart(command: &mut Command) {
    use std::os::windows::process::CommandExt;
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    const CREATE_NO_WINDOW: u32 = 0x0800_0000;
    command.creation_flags(CREATE_NEW_PROCESS_GROUP | CREATE_NO_WINDOW);
}

#[cfg(not(any(unix, windows)))]
fn apart(_: &mut Command) {}
