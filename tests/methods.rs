//! The methods beside marching cubes, on both backends: the same bytes, closed whatever the samples, and every way of
//! extracting gives the same.

#[path = "methods/cap.rs"]
mod cap;
#[path = "methods/closed.rs"]
mod closed;
mod common;
#[path = "methods/ends.rs"]
mod ends;
#[path = "methods/parity.rs"]
mod parity;

#[path = "methods/placement.rs"]
mod placement;

use isoforge::extract::{Extractor, Method, Options, Source, extract_on_cpu};
use isoforge::mesh::Mesh;

/// The options of each method.
fn options(iso: f32) -> [Options; 3] {
    Method::ALL.map(|method| Options { method, ..Options::new(iso) })
}

fn on_cpu(source: &Source<'_>, options: &Options) -> Mesh {
    extract_on_cpu(source, options, &|_| {}).unwrap().0
}

fn on_gpu(extractor: &Extractor, source: &Source<'_>, options: &Options) -> Mesh {
    extractor.extract(source, options).unwrap().mesh.read(extractor.gpu()).unwrap()
}

/// The bytes of a mesh: NaN equals itself, −0 differs from 0.
fn bytes(mesh: &Mesh) -> (&[u8], &[u8]) {
    (bytemuck::cast_slice(&mesh.vertices), bytemuck::cast_slice(&mesh.triangles))
}
