//! (room shot)
