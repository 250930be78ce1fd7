//! The adaptive refiner on grids of 80³ cells, on all cores: alone, with the extraction of its start mesh, and on the GPU,
//! if there is an adapter: of a mesh that is there, and stays there.
//!
//! `cargo bench --bench refine [-- FILTER]`. Throughput is in triangles of the refined mesh.

#[path = "../tests/refine/tools.rs"]
mod tools;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use isoforge::extract::Extractor;
use isoforge::gpu::{AdapterChoice, Gpu, GpuMesh};
use tools::{cube, figure, graph, kugeldiff, start};

fn refiner(criterion: &mut Criterion) {
    let extractor = Gpu::open(AdapterChoice::Best).ok().and_then(|gpu| Extractor::new(gpu).ok());
    // A sphere minus a sphere, small and large in the grid; a figure of ten stretched spheres.
    for (name, field, half) in [
        ("kugeldiff-small", graph(&kugeldiff()), 9.0),
        ("kugeldiff", graph(&kugeldiff()), 2.5),
        ("figure", graph(&figure()), 1.2),
    ] {
        let grid = cube(80, half);
        let first = start(&field, 0.0, grid);
        let (mesh, report) = first.refined(|_| {});
        println!("{name}: {} triangles to {}, {report:?}", first.mesh.triangles.len(), mesh.triangles.len());
        let mut group = criterion.benchmark_group(format!("refine/{name}"));
        group.sample_size(20).throughput(Throughput::Elements(mesh.triangles.len() as u64));
        group.bench_function("refine", |b| b.iter(|| first.refined(|_| {})));
        group.bench_function("extract+refine", |b| b.iter(|| start(&field, 0.0, grid).refined(|_| {})));
        if let Some(extractor) = &extractor {
            let given = GpuMesh::upload(extractor.gpu(), &first.mesh).expect("a mesh");
            let refined = || extractor.refine(&first.surface, &given, &first.settings, &|_| {});
            // The same bytes, or the comparison is none.
            let found = refined().expect("a mesh").0.read(extractor.gpu()).expect("a mesh");
            println!("{name} on {}: the same bytes: {}", extractor.gpu().info.name, found == mesh);
            group.bench_function("refine on the GPU", |b| b.iter(|| refined().expect("a mesh")));
        }
    }
}

criterion_group!(benches, refiner);
criterion_main!(benches);
