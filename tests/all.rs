//! All integration tests, in one binary.

#[path = "all/house.rs"]
mod house;
