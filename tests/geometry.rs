//! What the meshes are, whichever backend makes them: where vertices lie, what they enclose, how they
//! close.

mod common;
#[path = "geometry/edges.rs"]
mod edges;
#[path = "geometry/shapes.rs"]
mod shapes;
#[path = "geometry/topology.rs"]
mod topology;

use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::mesh::Mesh;

/// The mesh of each backend that there is.
fn meshes(source: &Source<'_>, options: &Options) -> Vec<Mesh> {
    let mut all = vec![on_cpu(source, options)];
    if let Some(extractor) = common::extractor() {
        all.push(extractor.extract(source, options).unwrap().mesh.read(extractor.gpu()).unwrap());
    }
    all
}

fn on_cpu(source: &Source<'_>, options: &Options) -> Mesh {
    extract_on_cpu(source, options, &|_| {}).unwrap().0
}
