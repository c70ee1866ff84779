//! (room script)
