//! isoforge turns a density field into a triangle mesh with WGSL compute passes and leaves the
//! mesh on the GPU, ready to draw.
//!
//! ```text
//! field, volume ─► cull ─► sample ─► classify ─► scan ─► emit ─► GpuMesh ─► your draw call, or a PNG
//!                  active  values    edge masks  offsets vertices,    └──► Mesh ► check, write
//!                  bricks  9³ each   and counts          indices
//! ```
//!
//! The grid is cut into bricks of 8³ points; a brick is a workgroup's work. Every stage has a CPU twin
//! that runs the same algorithm on the same bytes ([`stage`]), and [`extract::extract_on_cpu`] runs the
//! twins end to end on all cores:
//!
//! ```
//! use glam::Vec3;
//! use isoforge::{extract::*, field::named::Named, grid::Grid};
//!
//! let torus = Named::new("torus")?;
//! let grid = Grid::from_bounds([64; 3], Vec3::splat(-1.5), Vec3::splat(1.5))?;
//! let (mesh, _) = extract_on_cpu(&Source::Field(&torus, grid), &Options::new(0.0), &|_| {})?;
//! let report = mesh.check();
//! assert_eq!((report.boundary_edges, report.genus), (0, Some(1)));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! On the GPU, with the device that you draw with:
//!
//! ```no_run
//! # use isoforge::{extract::*, field::named::Named, grid::Grid, gpu::*};
//! # fn draw(device: wgpu::Device, queue: wgpu::Queue, info: wgpu::AdapterInfo, grid: Grid,
//! #         pass: &mut wgpu::RenderPass<'_>) -> Result<(), Box<dyn std::error::Error>> {
//! let extractor = Extractor::new(Gpu::from_device(device, queue, info))?; // pipelines, built once
//! let torus = Named::new("torus")?;
//! let extraction = extractor.extract(&Source::Field(&torus, grid), &Options::new(0.0))?;
//! extraction.mesh.draw(pass); // vertex, index and indirect buffers; nothing was read back but totals
//! # Ok(()) }
//! ```
//!
//! Conventions: x is the fastest axis; world units are the caller's or the file's; inside is below iso for
//! distance-like fields and above it for volumes ([`field::Sense`]); a sample equal to iso is outside;
//! triangles are counter-clockwise and normals point outwards seen from outside the solid.
#![warn(missing_docs)]
#![deny(unsafe_code)]

pub mod accuracy;
mod atomic;
pub mod bench;
#[cfg(feature = "cli")]
pub mod cli;
pub mod colour;
pub mod compare;
pub mod components;
mod excerpt;
pub mod extract;
pub mod field;
pub mod gpu;
pub mod graph;
pub mod grid;
mod memory;
pub mod mesh;
pub mod octree;
pub mod refine;
pub mod render;
pub mod scene;
pub mod sharp;
pub mod stage;
pub mod table;
pub mod track;
pub mod volume;

pub use atomic::TargetError;
/// The versions that the API speaks of.
pub use {glam, wgpu};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
