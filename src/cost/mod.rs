//! x
pub mod flip;
