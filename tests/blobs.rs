//! Sums of blobs: kernels, sums against an independent reference, bounds, parts, and both backends.

mod common;

#[path = "blobs/bad_input.rs"]
mod bad_input;
#[path = "blobs/bounds.rs"]
mod bounds;
#[path = "blobs/ellipsoids.rs"]
mod ellipsoids;
#[path = "blobs/extraction.rs"]
mod extraction;
#[path = "blobs/kernels.rs"]
mod kernels;
#[path = "blobs/reference.rs"]
mod reference;
#[path = "blobs/skeletons.rs"]
mod skeletons;
#[path = "blobs/sums.rs"]
mod sums;
