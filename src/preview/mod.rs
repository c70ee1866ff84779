//! Scenes and scripts while they are written: files that are watched, and a page that shows what they make.
//!
//! The server listens on the loopback and answers from the [`board`]; the one [`worker`] that has the shot fills it. What
//! the page is told is one JSON object with a version: whoever knows an older one asks and waits.
//!
//! | file | |
//! |---|---|
//! | [`watching`] | [`FileWatch`](watching::FileWatch): which files hold something else than before |
//! | [`board`] | where worker and pages meet: what is shown, and orders |
//! | [`worker`], `show`, `messages` | opens, sketches, relights, traces, writes; and how the page is told of it |
//! | [`pictures`], `refining` | pictures in memory, bounded; those that grow sharp |
//! | [`describe`], [`trial`] | fields of the scene with their places; values that are tried out |
//! | [`guard`], [`server`] | who gets in; what is asked and answered |
//! | `page/` | the page itself: its text, style and scripts, put together when the program is compiled |

pub mod board;
pub mod describe;
pub mod guard;
mod messages;
mod page;
pub mod pictures;
mod refining;
pub mod server;
mod show;
pub mod trial;
pub mod watching;
pub mod worker;

use std::path::PathBuf;

use crate::shot::OpenOptions;
use crate::shot::reuse::ReusePolicy;

/// What is shown, and how.
#[derive(Clone, Debug)]
pub struct PreviewOptions {
    /// The script or scene.
    pub input: PathBuf,
    /// How it is opened; the scene is kept.
    pub open: OpenOptions,
    /// Where frames are written and looked for, as `anim render` has it.
    pub out: Option<String>,
    /// What is kept between pictures, and how much of it.
    pub policy: ReusePolicy,
    /// 0 for any that is free.
    pub port: u16,
}
