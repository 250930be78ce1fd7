//! The mesh checker, clean-up, and files, from outside.

#[path = "mesh/check.rs"]
mod check;
#[path = "mesh/clean.rs"]
mod clean;
#[path = "mesh/colours.rs"]
mod colours;
mod common;
#[path = "mesh/crease.rs"]
mod crease;
#[path = "mesh/damage.rs"]
mod damage;
#[path = "mesh/extracted.rs"]
mod extracted;
#[path = "mesh/flip.rs"]
mod flip;
#[path = "mesh/formats.rs"]
mod formats;
#[path = "mesh/graph.rs"]
mod graph;
#[cfg(feature = "meshopt")]
#[path = "mesh/meshopt.rs"]
mod meshopt_tools;
#[path = "mesh/odd.rs"]
mod odd;
#[path = "mesh/polygons.rs"]
mod polygons;
#[path = "mesh/rib.rs"]
mod rib;
#[path = "mesh/shapes.rs"]
mod shapes;
#[path = "mesh/simplify.rs"]
mod simplify;
#[path = "mesh/targets.rs"]
mod targets;
#[path = "mesh/tools.rs"]
mod tools;
