//! The adaptive refiner.

mod common;
#[path = "refine/tools.rs"]
mod tools;

#[path = "refine/bad_input.rs"]
mod bad_input;
#[path = "refine/error.rs"]
mod error;
#[path = "refine/gpu.rs"]
mod gpu;
#[path = "refine/hostile.rs"]
mod hostile;
#[path = "refine/topology.rs"]
mod topology;
