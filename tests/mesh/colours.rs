//! Colours: what is sampled, which colour it is, and what other readers find in the files.

use std::fs;

use glam::Vec3;
use isoforge::colour::{ColourError, Coloured, Colouring, Map, NO_VALUE, sample, usual_range};
use isoforge::field::{Closure, Sense};
use isoforge::graph::GraphField;
use isoforge::graph::volume::{Lookup, VolumeLeaf};
use isoforge::grid::Grid;
use isoforge::mesh::Mesh;
use isoforge::mesh::write::{Extra, WriteError, write_with};
use isoforge::volume::Volume;
use ply_rs_bw::ply::{DefaultElement, Property};

use crate::extracted::named;
use crate::shapes::{cube, mesh, tetrahedron};

/// A volume of a linear function, which trilinear interpolation gives back, as a field.
fn linear(low: Vec3, high: Vec3, hole: bool) -> (GraphField, Grid) {
    let grid = Grid::from_bounds([6, 7, 8], low, high).unwrap();
    let n = grid.points();
    let values = (0..grid.point_count() as u32).map(|i| {
        let p = grid.position(Vec3::new((i % n.x) as f32, (i / n.x % n.y) as f32, (i / (n.x * n.y)) as f32));
        if hole && i == 0 { f32::NAN } else { p.dot(Vec3::new(1.0, 2.0, -3.0)) + 4.0 }
    });
    let volume = Volume::new(grid, values.collect()).unwrap();
    let leaf = VolumeLeaf::new(volume.into(), Lookup::default()).unwrap();
    (GraphField::new(&leaf.expr(), Sense::Above), grid)
}

#[test]
fn values_are_the_fields_and_the_volumes() {
    let torus = named("torus", 20);
    let field = Closure::new(Sense::Below, |p| p.x * p.y - p.z);
    let found = sample(&field, None, &torus).unwrap();
    assert_eq!((found.outside, found.not_finite), (0, 0));
    assert!(
        torus.vertices.iter().zip(&found.values).all(|(v, value)| *value == v.at().x * v.at().y - v.at().z)
    );

    // Over half of the torus.
    let (field, grid) = linear(Vec3::splat(-2.0), Vec3::new(0.0, 2.0, 2.0), false);
    let found = sample(&field, Some(&grid), &torus).unwrap();
    let mut outside = 0;
    for (v, value) in torus.vertices.iter().zip(&found.values) {
        let expected = v.at().dot(Vec3::new(1.0, 2.0, -3.0)) + 4.0;
        outside += usize::from(v.at().x > 0.0 && value.is_nan());
        assert!(if v.at().x <= 0.0 {
            (value - expected).abs() < 1e-4
        } else {
            v.at().x < 1e-3 || value.is_nan()
        });
    }
    assert!(found.outside == outside && outside > torus.vertices.len() / 3 && found.not_finite == 0);

    // The box of the samples is inside, corners included; NaN samples are told apart from what is outside.
    let box_ = cube();
    let (field, grid) = linear(Vec3::ZERO, Vec3::ONE, true);
    let mut with_lost = box_.clone();
    with_lost.vertices[5].position[1] = f32::NAN;
    let found = sample(&field, Some(&grid), &with_lost).unwrap();
    assert_eq!((found.outside, found.not_finite), (1, 1));
    assert!(found.values[0].is_nan() && found.values[5].is_nan() && (found.values[7] - 4.0).abs() < 1e-5);
}

#[test]
fn disjoint_boxes_are_named() {
    let (field, grid) = linear(Vec3::splat(10.0), Vec3::splat(12.0), false);
    let error = sample(&field, Some(&grid), &cube()).unwrap_err();
    assert!(matches!(error, ColourError::Disjoint { .. }));
    let text = error.to_string();
    for part in ["from [0, 0, 0] to [1, 1, 1]", "from [10, 10, 10] to [12, 12, 12]"] {
        assert!(text.contains(part), "{text}");
    }
    // Nothing to colour is no error.
    assert!(sample(&field, Some(&grid), &Mesh::default()).unwrap().values.is_empty());
}

#[test]
fn maps_and_ranges() {
    let near = |a: [u8; 3], b: [u8; 3]| a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 16);
    // The ends and middles that matplotlib and Moreland's paper have; colorgrad's are smooth ways through a few of them.
    for (map, low, middle, high) in [
        (Map::Viridis, [68, 1, 84], [33, 145, 140], [253, 231, 37]),
        (Map::Magma, [0, 0, 4], [183, 55, 121], [252, 253, 191]),
        (Map::Coolwarm, [59, 76, 192], [221, 221, 221], [180, 4, 38]),
        (Map::Grey, [0; 3], [99; 3], [255; 3]),
    ] {
        let table = map.table();
        let found = [table[0], table[table.len() / 2], table[table.len() - 1]];
        assert!(near(found[0], low) && near(found[1], middle) && near(found[2], high), "{map}: {found:?}");
    }
    for map in Map::ALL {
        assert_eq!(map.to_string().parse(), Ok(map));
    }
    let error = "jet".parse::<Map>().unwrap_err().to_string();
    assert!(error.contains("jet") && error.contains("viridis, magma"), "{error}");

    let table = Map::Viridis.table();
    let last = table.len() - 1;
    let of = |range, values: &[f32]| Colouring::new(Map::Viridis, range).colour(values.to_vec()).colours;
    assert_eq!(of([1.0, 3.0], &[0.0, 1.0, 3.0, 9.0]), [table[0], table[0], table[last], table[last]]);
    assert_eq!(of([1.0, 3.0], &[f32::NAN, f32::INFINITY, -f32::INFINITY]), [NO_VALUE; 3]);
    assert_eq!(of([2.0, 2.0], &[1.0, 2.0, 3.0]), [table[0], table[last.div_ceil(2)], table[last]]);
    assert_eq!(of([-f32::MAX, f32::MAX], &[0.0]), [table[last.div_ceil(2)]]);
    // A constant 0 has either sign.
    assert_eq!(of([-0.0, 0.0], &[-0.0, 0.0]), [table[last.div_ceil(2)]; 2]);
    assert_eq!(of([3.0, 1.0], &[0.0, 3.0, 1.0]), [table[last], table[0], table[last]]);

    let mut values: Vec<f32> = (0..=100).map(|i| i as f32).rev().collect();
    values.extend([f32::NAN, f32::INFINITY]);
    assert_eq!(usual_range(&values), Some([2.0, 98.0]));
    assert_eq!(usual_range(&[1.0]), Some([1.0, 1.0]));
    assert_eq!(usual_range(&[f32::NAN]), None);
    // All but one the same.
    let mut values = vec![5.0; 200];
    values[7] = 6.0;
    assert_eq!(usual_range(&values), Some([5.0, 6.0]));
}

fn coloured(mesh: &Mesh) -> Coloured {
    let values = mesh.vertices.iter().enumerate().map(|(i, v)| if i == 1 { f32::NAN } else { v.at().x });
    Colouring::new(Map::Magma, [0.0, 1.0]).colour(values.collect())
}

#[test]
fn other_readers_find_values_and_colours() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = cube();
    let coloured = coloured(&mesh);
    let extra = Extra { colours: Some(&coloured), ..Default::default() };
    let path = folder.path().join("a.ply");
    let bytes = write_with(&mesh, &extra, &path).unwrap();
    assert_eq!(bytes, fs::metadata(&path).unwrap().len());
    let ply = ply_rs_bw::parser::Parser::<DefaultElement>::new()
        .read_ply(&mut fs::File::open(&path).unwrap())
        .unwrap();
    for (i, vertex) in ply.payload["vertex"].iter().enumerate() {
        let Property::Float(value) = vertex["value"] else { panic!("{vertex:?}") };
        assert_eq!(value.to_bits(), coloured.values[i].to_bits());
        let colour = ["red", "green", "blue"].map(|name| match vertex[name] {
            Property::UChar(byte) => byte,
            ref other => panic!("{other:?}"),
        });
        assert_eq!(colour, coloured.colours[i]);
    }
    assert_eq!(coloured.colours[1], NO_VALUE);
    assert_eq!(isoforge::mesh::read::read(&path).unwrap().mesh, mesh);

    let path = folder.path().join("a.glb");
    let bytes = write_with(&mesh, &extra, &path).unwrap();
    assert_eq!(bytes, fs::metadata(&path).unwrap().len());
    // With the crate's validation.
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&fs::read(&path).unwrap()).unwrap();
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    let reader = primitive.reader(|_| blob.as_deref());
    let found: Vec<[f32; 4]> = reader.read_colors(0).unwrap().into_rgba_f32().collect();
    for (found, colour) in found.iter().zip(&coloured.colours) {
        for (k, byte) in colour.iter().enumerate() {
            let c = f64::from(*byte) / 255.0;
            let linear = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
            assert!((f64::from(found[k]) - linear).abs() < 1e-5);
        }
        assert_eq!(found[3], 1.0);
    }
    let accessor = primitive.get(&gltf::Semantic::Extras("VALUE".into())).unwrap();
    let view = accessor.view().unwrap();
    let values: Vec<f32> = blob.as_deref().unwrap()[view.offset()..view.offset() + view.length()]
        .chunks(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let want: Vec<f32> = coloured.values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect();
    assert_eq!((values, accessor.count()), (want, 8));
    assert_eq!(isoforge::mesh::read::read(&path).unwrap().mesh, mesh);
}

#[test]
fn formats_without_a_place_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let (mesh, other) = (tetrahedron(), mesh(&[[0.0; 3]], &[]));
    let path = |ending| folder.path().join(format!("a.{ending}"));
    let coloured = coloured(&mesh);
    for ending in ["off", "obj", "stl", "rib"] {
        let error =
            write_with(&mesh, &Extra { colours: Some(&coloured), ..Default::default() }, &path(ending))
                .unwrap_err();
        assert!(
            matches!(&error, WriteError::NoPlace { .. }) && error.to_string().contains(".ply or .glb"),
            "{error}"
        );
    }
    let strip = [0, 2, 1, 1];
    for ending in ["off", "obj", "stl", "rib", "ply"] {
        let error = write_with(&mesh, &Extra { strip: Some(&strip), ..Default::default() }, &path(ending))
            .unwrap_err();
        assert!(error.to_string().contains("name the file .glb"), "{error}");
    }
    let error = write_with(&other, &Extra { colours: Some(&coloured), ..Default::default() }, &path("ply"))
        .unwrap_err();
    assert!(error.to_string().contains("4 values and 4 colours for 1 vertices"), "{error}");
    let error = write_with(&mesh, &Extra { strip: Some(&[0, 1, 2, 9]), ..Default::default() }, &path("glb"))
        .unwrap_err();
    assert!(matches!(error, WriteError::BadIndex { triangle: 1, vertex: 9, .. }));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_strip_in_a_file_reads_as_its_triangles() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("strip.glb");
    // Two of the tetrahedron's triangles, a way over two that repeat a vertex, and the other two.
    let strip = [0, 2, 1, 3, 3, 0, 0, 1, 3, 2];
    let mesh = tetrahedron();
    write_with(&mesh, &Extra { strip: Some(&strip), ..Default::default() }, &path).unwrap();
    let document = gltf::Gltf::open(&path).unwrap().document;
    let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(
        (primitive.mode(), primitive.indices().unwrap().count()),
        (gltf::mesh::Mode::TriangleStrip, 10)
    );
    let found = isoforge::mesh::read::read(&path).unwrap().mesh;
    assert_eq!(found.triangles, isoforge::mesh::triangles_of_strip(&strip));
    // No triangles, no primitive.
    write_with(&mesh, &Extra { strip: Some(&[]), ..Default::default() }, &path).unwrap();
    assert_eq!(isoforge::mesh::read::read(&path).unwrap().mesh, Mesh::default());
}
