//! On the GPU: the bytes of the CPU's refiner.

use crate::common::{self, named, small_brain};
use crate::tools::*;
use glam::Vec3;
use isoforge::extract::{Options, Source, extract_on_cpu};
use isoforge::field::user::UserField;
use isoforge::field::{Closure, Sense, Surface};
use isoforge::gpu::GpuMesh;
use isoforge::graph::volume::{Gradient, Interpolation, Lookup, VolumeLeaf};
use isoforge::graph::{GraphField, shapes::*};
use isoforge::mesh::Mesh;
use isoforge::refine::{RefineReport, Settings, refine};
use std::sync::Arc;

/// Both, if there is a GPU: on a software adapter all bytes and all counts must agree, else about.
fn both(name: &str, surface: &Surface<'_>, mesh: &Mesh, settings: &Settings) -> Option<RefineReport> {
    let extractor = common::extractor()?;
    let gpu = extractor.gpu();
    let (wanted, of_cpu) = refine(surface, mesh, settings, &|_| {}).expect("a mesh");
    let given = GpuMesh::upload(gpu, mesh).expect("a mesh");
    let (found, of_gpu) = extractor.refine(surface, &given, settings, &|_| {}).expect("a mesh");
    let found = found.read(gpu).expect("a mesh");
    if !gpu.is_software() {
        let apart = wanted.triangles.len().abs_diff(found.triangles.len());
        assert!(apart <= 4 + wanted.triangles.len() / 100, "{name}: {apart} triangles apart");
        return Some(of_gpu);
    }
    let untimed = |report: &RefineReport| RefineReport { seconds: 0.0, ..report.clone() };
    assert_eq!(untimed(&of_gpu), untimed(&of_cpu), "{name}");
    let first = found.vertices.iter().zip(&wanted.vertices).position(|(a, b)| bytes(a) != bytes(b));
    assert_eq!(first.map(|i| (i, found.vertices[i], wanted.vertices[i])), None, "{name}: the first vertex");
    let first = found.triangles.iter().zip(&wanted.triangles).position(|(a, b)| a != b);
    assert_eq!(first.map(|i| (i, found.triangles[i], wanted.triangles[i])), None, "{name}: the first triangle");
    assert_eq!(found.vertices.len(), wanted.vertices.len(), "{name}");
    assert_eq!(found.triangles.len(), wanted.triangles.len(), "{name}");
    assert_eq!(given.read(gpu).expect("a mesh"), *mesh, "{name}: what was given stays as it is");
    Some(of_gpu)
}

fn bytes(vertex: &isoforge::mesh::Vertex) -> &[u8] {
    bytemuck::bytes_of(vertex)
}

#[test]
fn named_fields() {
    for (name, n) in [("torus", 24), ("gyroid", 24), ("sphere", 5), ("cube", 9), ("octahedron", 16)] {
        let (field, grid) = named(name, n);
        let s = start(&field, field.definition().iso, grid);
        for (flatness, depth) in [(0.8, 3), (0.95, 4), (0.999, 3), (1.0, 2), (0.95, 0)] {
            let settings = Settings { flatness, depth, ..s.settings };
            both(&format!("{name}, {flatness}, {depth}"), &s.surface, &s.mesh, &settings);
        }
    }
}
