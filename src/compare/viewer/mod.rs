//! The viewer of pictures for pages: blink, wipe, side by side, differences, FLIP, zoom with the values of pixels.
//!
//! One script and one style, to be put into a page as they are. `AnimViewer.create` in the script says how it is used.

/// The script; it declares `AnimViewer` and nothing else.
pub const SCRIPT: &str = include_str!("viewer.js");

/// The style; its colours follow the variables of the page, where that sets them.
pub const STYLE: &str = include_str!("viewer.css");
