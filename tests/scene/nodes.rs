//! Every kind of node and every transform against the function of the library that it stands for.

use super::{same, scene, values};
use glam::{DAffine3, DMat3, DVec3};
use isoforge::compare::compare;
use isoforge::extract::{Extractor, Options, Source};
use isoforge::field::Sense;
use isoforge::field::named;
use isoforge::graph::blobs::{BLOBBY, Blobs, Component, Ellipsoid, Ellipsoids, Kernel, skeleton};
use isoforge::graph::shapes::*;
use isoforge::graph::volume::{Border, Gradient, Interpolation, Lookup, VolumeLeaf};
use isoforge::graph::{Expr, x, y, z};
use isoforge::grid::Grid;
use isoforge::scene::{OpenOptions, Scene};
use isoforge::volume;
use std::path::Path;
use std::sync::Arc;

/// A scene of one node with these keys.
fn node(keys: &str) -> Scene {
    scene(&format!("iso = 0\n[nodes.it]\n{keys}"))
}

fn is(keys: &str, expected: impl Into<Expr>) {
    println!("{keys}");
    same(&node(keys), &expected.into());
}

#[test]
fn solids() {
    is("kind = 'sphere'\nradius = 1", sphere(1.0));
    is("kind = 'ellipsoid'\nradii = [1, 0.5, 2]", ellipsoid([1.0, 0.5, 2.0]).unwrap());
    is("kind = 'box'\nlow = [-1, 0, 0]\nhigh = [1, 1, 0.5]", box_([-1.0, 0.0, 0.0], [1.0, 1.0, 0.5]));
    let rounded = rounded_box([-1.0; 3], [1.0; 3], 0.25);
    is("kind = 'box'\nlow = [-1, -1, -1]\nhigh = [1, 1, 1]\nradius = 0.25", rounded);
    is("kind = 'half_space'\nnormal = [1, 2, 3]\noffset = 0.5", half_space([1.0, 2.0, 3.0], 0.5).unwrap());
    is("kind = 'cylinder'\nradius = 0.5\nheight = 2", cylinder(0.5, 2.0));
    is("kind = 'cylinder'\nradius = 0.5", infinite_cylinder(0.5));
    is(
        "kind = 'capsule'\na = [0, 0, 0]\nb = [1, 1, 0]\nradius = 0.5",
        capsule([0.0; 3], [1.0, 1.0, 0.0], 0.5),
    );
    is("kind = 'cone'\nradius = 1\nheight = 2", cone(1.0, 2.0).unwrap());
    is("kind = 'cone'\nradius = 1\ntop = 0.5\nheight = 2", frustum(1.0, 0.5, 2.0).unwrap());
    is("kind = 'torus'\nmajor = 1\nminor = 0.25", torus_distance(1.0, 0.25));
    let r = [1.0, 0.5, 2.0];
    is(
        "kind = 'superellipsoid'\nradii = [1, 0.5, 2]\ne1 = 0.5\ne2 = 2",
        superellipsoid(r, 0.5, 2.0).unwrap(),
    );
    is(
        "kind = 'superhyperboloid'\nradii = [1, 0.5, 2]\ne1 = 0.5\ne2 = 2",
        superhyperboloid(r, 0.5, 2.0).unwrap(),
    );
    let ring = supertorus(r, 2.0, 0.5, 2.0).unwrap();
    is("kind = 'supertorus'\nradii = [1, 0.5, 2]\nhole = 2\ne1 = 0.5\ne2 = 2", ring);
    let disc = infinite_cylinder(1.0);
    is("kind = 'extrude'\nof = {kind = 'cylinder', radius = 1}\nheight = 2", extrude(&disc, 2.0));
    let figure = "{kind = 'cylinder', radius = 0.5, translate = [1, 0, 0]}";
    is(
        &format!("kind = 'revolve'\nof = {figure}"),
        revolve(&infinite_cylinder(0.5).translate([1.0, 0.0, 0.0])),
    );
    let gyroid = named::ALL.iter().find(|d| d.name == "gyroid").unwrap();
    let gyroid = gyroid.expr(&[("period".into(), 2.0.into())]).unwrap();
    is("kind = 'field'\nname = 'gyroid'\nparameters = { period = 2 }", gyroid);
    let ball = named::ALL.iter().find(|d| d.name == "sphere").unwrap().expr(&[]).unwrap();
    is("kind = 'field'\nname = 'sphere'", ball.clone() - 1.0);
    is("kind = 'field'\nname = 'sphere'\niso = 0.5", ball - 0.5);
    is("kind = 'formula'\ntext = 'x^2 + y*z - 1'", x().square() + y() * z() - 1.0);
    let with = "kind = 'formula'\ntext = 'max(a, -b)'\n[nodes.it.with]\na = {kind = 'sphere', radius = 1}\nb = {kind = 'sphere', radius = 0.5}";
    is(with, sphere(1.0).difference(sphere(0.5)));
    let noise = Expr::noise(7).at([x() * 2.0, y() * 2.0, z() * 2.0]) * 0.5;
    is("kind = 'noise'\nseed = 7\nsize = 0.5\nheight = 0.5", noise);
    is("kind = 'noise'\nseed = 7\noctaves = 4\ngain = 0.6", Expr::fbm(7, 4, 0.6) * 1.0);
    is("kind = 'heightfield'\nheight = 'sin(x)*y'", z() - x().sin() * y());
    let hills = z() - Expr::noise(3).at([x(), y(), 0.0.into()]);
    is("kind = 'heightfield'\nof = {kind = 'noise', seed = 3}", hills);
}

/// The list of kinds that users read names every kind and key.
#[test]
fn the_list_of_kinds_is_complete() {
    let error = super::parse("[nodes.n]\nkind = 'no such kind'").unwrap_err().to_string();
    let kinds = error.split_once("there are ").unwrap().1.lines().next().unwrap();
    assert!(kinds.split(", ").count() > 30, "{kinds}");
    for kind in kinds.split(", ") {
        assert!(isoforge::scene::KINDS.contains(&format!("`{kind}`")), "{kind}");
    }
    let error = super::parse("[nodes.n]\nkind = 'sphere'\nradius = 1\nno_key = 1").unwrap_err().to_string();
    let keys = error.split_once("there are kind, radius, ").unwrap().1.lines().next().unwrap();
    for key in keys.split(", ") {
        assert!(isoforge::scene::KINDS.contains(&format!("`{key}`")), "{key}");
    }
}

#[test]
fn operators() {
    let (a, b, c) = (sphere(1.0), box_([0.0; 3], [1.0; 3]), infinite_cylinder(0.5));
    let of = "of = [{kind = 'sphere', radius = 1}, {kind = 'box', low = [0, 0, 0], high = [1, 1, 1]}, {kind = 'cylinder', radius = 0.5}]";
    is(&format!("kind = 'union'\n{of}"), union([a.clone(), b.clone(), c.clone()]));
    is(&format!("kind = 'intersection'\n{of}"), intersection([a.clone(), b.clone(), c.clone()]));
    is(&format!("kind = 'difference'\n{of}"), a.difference_of([b.clone(), c.clone()]));
    is(&format!("kind = 'union'\n{of}\nradius = 0.5"), a.smooth_union(&b, 0.5).smooth_union(&c, 0.5));
    let blend = a.exponential_intersection(&b, 0.5).exponential_intersection(&c, 0.5);
    is(&format!("kind = 'intersection'\n{of}\nradius = 0.5\nblend = 'exponential'"), blend);
    let blend = a.r_difference(&b, 0.5).unwrap().r_difference(&c, 0.5).unwrap();
    is(&format!("kind = 'difference'\n{of}\nalpha = 0.5\nblend = 'r'"), blend);
    let ball = "of = {kind = 'sphere', radius = 1}";
    is(&format!("kind = 'negation'\n{ball}"), a.negation());
    is(&format!("kind = 'shell'\n{ball}\nthickness = 0.5"), a.shell(0.5));
    is(&format!("kind = 'offset'\n{ball}\ndistance = 0.5"), a.offset(0.5));
    is(&format!("kind = 'copy'\n{ball}"), a.clone());
    is(
        &format!("kind = 'displace'\n{ball}\nby = {{kind = 'formula', text = 'sin(9*x)/9'}}"),
        &a + (x() * 9.0).sin() / 9.0,
    );
    let two = "of = [{kind = 'sphere', radius = 1}, {kind = 'cylinder', radius = 0.5}]";
    is(&format!("kind = 'morph'\n{two}\npart = 0.25"), a.morph(&c, 0.25));
    is(&format!("kind = 'sum'\n{two}\nweights = [1, -2]"), a * 1.0 + c * -2.0);
}

#[test]
fn densities() {
    let line = skeleton::segment_square([0.0; 3], [1.0, 0.0, 0.0]);
    is(
        "kind = 'blob'\nkernel = 'metaball'\nskeleton = 'segment'\na = [0, 0, 0]\nb = [1, 0, 0]\nradius = 1\nweight = 2",
        skeleton::kernel_expr(Kernel::Metaball, &line, 1.0) * 2.0,
    );
    let point = skeleton::point_square([1.0, 0.0, 0.0]);
    is(
        "kind = 'blob'\nat = [1, 0, 0]\nradius = 2\niso = 0.25",
        0.25 - skeleton::kernel_expr(Kernel::SoftObject, &point, 2.0) * 1.0,
    );
    let bent = skeleton::polyline_square([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]).unwrap();
    is(
        "kind = 'blob'\nkernel = 'blobby'\nskeleton = 'polyline'\npoints = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\nradius = 1",
        skeleton::kernel_expr(BLOBBY, &bent, 1.0) * 1.0,
    );
    let ring = skeleton::kernel_expr(Kernel::InverseSquare, &skeleton::circle_square(1.0), 1.0) * -1.0;
    is(
        "kind = 'blob'\nkernel = 'inverse-square'\nskeleton = 'circle'\nmajor = 1\nradius = 1\nweight = -1",
        ring,
    );
    let cube = skeleton::kernel_expr(Kernel::SoftObject, &skeleton::superellipsoid_square(8), 1.0) * 1.0;
    is("kind = 'blob'\nskeleton = 'superellipsoid'\nradius = 1", cube);
    let equal = skeleton::equipotential(2.0, 3.0, &torus_distance(1.0, 0.25));
    is(
        "kind = 'equipotential'\nheight = 2\nfalloff = 3\nof = {kind = 'torus', major = 1, minor = 0.25}",
        equal,
    );

    let at = |position, radius, weight| Component { position, radius, weight };
    let components = vec![at([0.0; 3], 1.0, 1.0), at([0.5, 0.0, 0.0], 0.5, -0.5)];
    let blobs = Blobs::new(Kernel::SoftObject, components).unwrap().expr();
    let keys =
        "kind = 'blobs'\ncomponents = [{at = [0, 0, 0]}, {at = [0.5, 0, 0], radius = 0.5, weight = -0.5}]";
    is(keys, blobs.clone());
    assert_eq!(node(keys).sense, Sense::Above, "densities are high inside");
    assert_eq!(node(&format!("{keys}\niso = 0.5")).sense, Sense::Below);
    let stretched = Ellipsoid {
        component: at([0.5, 0.0, 0.0], 0.5, -0.5),
        rotation: glam::Quat::from_axis_angle(glam::Vec3::Z, std::f32::consts::FRAC_PI_2),
        scale: glam::Vec3::new(1.0, 2.0, 3.0),
    };
    let ball = Ellipsoid {
        component: at([0.0; 3], 1.0, 1.0),
        rotation: glam::Quat::IDENTITY,
        scale: glam::Vec3::ONE,
    };
    let turned = Ellipsoids::new(Kernel::SoftObject, &[ball, stretched]).unwrap().expr();
    let more = ", rotate = {axis = [0, 0, 2], degrees = 90}, scale = [1, 2, 3]}]";
    is(&keys.replace("}]", more), turned);
    // Transforms of a density move it and leave its values.
    is(&format!("{keys}\nscale = 2"), blobs.at([x() * 0.5, y() * 0.5, z() * 0.5]));
    let sum = format!(
        "kind = 'sum'\niso = 0.5\nof = [{{{}}}, {{kind = 'blob', at = [1, 0, 0], radius = 2}}]",
        keys.replace('\n', ", ")
    );
    is(&sum, 0.5 - (blobs * 1.0 + (skeleton::kernel_expr(Kernel::SoftObject, &point, 2.0) * 1.0) * 1.0));
}

#[test]
fn volumes_and_points_from_files() {
    let brain = Path::new("tests/data/brain_24.nii.gz");
    let opened = volume::open(brain, &volume::OpenOptions::default()).unwrap().volume;
    let middle = opened.grid().position(opened.grid().cells().as_vec3() * 0.5).as_dvec3();
    let lookup =
        Lookup { value: Interpolation::Trilinear, gradient: Gradient::Exact, border: Border::Constant(0.0) };
    let leaf = VolumeLeaf::new(Arc::new(opened), lookup).unwrap().expr();
    let keys = format!(
        "kind = 'volume'\nfile = '../../tests/data/brain_24.nii.gz'\nborder = 0\ntranslate = [{:?}, {:?}, {:?}]\nscale = 0.1",
        -middle.x, -middle.y, -middle.z
    );
    let shrunk = leaf.translate(-middle).at([x() * (1.0 / 0.1), y() * (1.0 / 0.1), z() * (1.0 / 0.1)]);
    is(&keys, shrunk.clone());
    // Transforms are later than the iso value, which is in the volume's units.
    let solid = (10.0 - leaf).translate(-middle).scale(0.1).unwrap();
    is(&format!("iso = 10\n{keys}"), solid);

    let keys = "kind = 'points'\nfile = '../data/1A8O.pdb.gz'\ntranslate = [-19, -36, -16]\nscale = 0.05";
    let scene = node(keys);
    assert!(scene.notes.iter().any(|note| note.contains("water")), "{:?}", scene.notes);
    assert!(values(&scene.field()).iter().any(|v| *v > 0.5));
}

#[test]
fn transforms() {
    let a = || box_([0.0; 3], [1.0, 0.5, 0.25]);
    let keys = |transform: &str| format!("kind = 'box'\nlow = [0, 0, 0]\nhigh = [1, 0.5, 0.25]\n{transform}");
    let with = |transform: &str, expected: Expr| is(&keys(transform), expected);
    with("translate = [1, 2, 3]", a().translate([1.0, 2.0, 3.0]));
    with("rotate = {axis = [1, 1, 0], degrees = 90}", a().rotate([1.0, 1.0, 0.0], 0.25).unwrap());
    with("rotate = {axis = [1, 1, 0], turns = 0.1}", a().rotate([1.0, 1.0, 0.0], 0.1).unwrap());
    with("scale = 2", a().scale(2.0).unwrap());
    with("scale = [2, 1, 3]", a().scale_axes([2.0, 1.0, 3.0]).unwrap());
    with("mirror = {normal = [1, 0, 0], offset = 0.5}", a().mirror([1.0, 0.0, 0.0], 0.5).unwrap());
    with("symmetric = {normal = [1, 1, 0]}", a().symmetric([1.0, 1.0, 0.0], 0.0).unwrap());
    let matrix =
        DMat3::from_cols(DVec3::new(1.0, 5.0, 9.0), DVec3::new(2.0, 6.0, 1.0), DVec3::new(3.0, 7.0, 11.0));
    let map = DAffine3 { matrix3: matrix, translation: DVec3::new(4.0, 8.0, 12.0) };
    with("affine = [[1, 2, 3, 4], [5, 6, 7, 8], [9, 1, 11, 12]]", a().affine(map).unwrap());
    with("twist = {turns_per_length = 0.25, from = -1, to = 1}", a().twist(0.25, -1.0, 1.0).unwrap());
    with("bend = {turns_per_length = 0.25, from = -1, to = 1}", a().bend(0.25, -1.0, 1.0).unwrap());
    with("taper = {low = 1, high = 0.5, from = -1, to = 1}", a().taper(1.0, 0.5, -1.0, 1.0).unwrap());
    with("repeat = {axis = 'y', period = 2, limit = 1}", a().repeat(Axis::Y, 2.0, Some(1)).unwrap());
    let moved = [[0.1, 0.0, 0.0]; 8];
    let lattice = Lattice::new([-1.0; 3], [1.0; 3], [2; 3], moved).unwrap();
    let list = ["[0.1, 0, 0]"; 8].join(", ");
    let keys = format!(
        "free_form = {{low = [-1, -1, -1], high = [1, 1, 1], counts = [2, 2, 2], displacements = [{list}]}}"
    );
    with(&keys, a().free_form(&lattice));
    with("warp = ['x + 0.1*sin(9*y)', 'y', 'z']", a().at([x() + (y() * 9.0).sin() * 0.1, y(), z()]));
}

/// In the order in which they are written, which is not that of the alphabet.
#[test]
fn the_order_of_transforms() {
    let a = || sphere(0.5);
    let ball = "kind = 'sphere'\nradius = 0.5\n";
    let moved = a().translate([1.0, 0.0, 0.0]).scale(2.0).unwrap();
    is(&format!("{ball}translate = [1, 0, 0]\nscale = 2"), moved.clone());
    is(
        &format!("{ball}scale = 2\ntranslate = [1, 0, 0]"),
        a().scale(2.0).unwrap().translate([1.0, 0.0, 0.0]),
    );
    is(&format!("{ball}transform = [{{translate = [1, 0, 0]}}, {{scale = 2}}]"), moved.clone());
    let again = moved.translate([1.0, 0.0, 0.0]);
    is(
        &format!("{ball}transform = [{{translate = [1, 0, 0], scale = 2}}, {{translate = [1, 0, 0]}}]"),
        again,
    );
}

#[test]
fn parameters_compile_nothing_and_reach_everywhere() {
    let text = "[parameters]\nr = 0.5\nturn = 10\n[nodes.ball]\nkind = 'sphere'\nradius = 'r*2'\n\
                rotate = {axis = [0, 0, 1], degrees = 'turn'}\ntranslate = ['r', 0, 0]\n\
                [nodes.whole]\nkind = 'union'\nof = 'ball'\n";
    let mut field = scene(text).field();
    let names: Vec<String> = field.parameters().map(|(name, _)| name.into()).collect();
    assert_eq!(names.len(), 2, "{names:?}");
    field.set("r", 0.25).unwrap();
    let other = scene(&text.replace("r = 0.5", "r = 0.25")).field();
    assert_eq!(values(&field), values(&other));
}

#[test]
fn what_stands_at_the_top() {
    let text = "surface = 'b'\niso = 0.25\ninside = 'above'\nbounds = [[-1, -2, -3], [1, 2, 3]]\ncells = [10, 20, 30]\n\
                camera = {azimuth = 10, fov = 20}\n\
                [nodes.a]\nkind = 'sphere'\nradius = 1\n[nodes.b]\nkind = 'cylinder'\nradius = 1\n";
    let found = scene(text);
    same(&found, &infinite_cylinder(1.0));
    assert_eq!((found.iso, found.sense, found.cells), (Some(0.25), Sense::Above, Some([10, 20, 30])));
    assert_eq!(found.bounds, Some([glam::Vec3::new(-1.0, -2.0, -3.0), glam::Vec3::new(1.0, 2.0, 3.0)]));
    assert_eq!(
        (found.camera.azimuth, found.camera.elevation, found.camera.fov),
        (Some(10.0), None, Some(20.0))
    );
    // The one node that is part of no other.
    same(
        &scene("[nodes.z]\nkind = 'sphere'\nradius = 1\n[nodes.a]\nkind = 'negation'\nof = 'z'"),
        &-sphere(1.0),
    );
}

/// Long chains and deep ones take no stack.
#[test]
fn ten_thousand_nodes_in_a_chain() {
    let mut text = String::from("[nodes.n0]\nkind = 'sphere'\nradius = 1\n");
    for i in 1..10_000 {
        text += &format!("[nodes.n{i}]\nkind = 'offset'\ndistance = 0.001\nof = 'n{}'\n", i - 1);
    }
    let field = scene(&text).field();
    assert!(
        (values(&field)[0] - (values(&scene("[nodes.a]\nkind = 'sphere'\nradius = 1").field())[0] - 9.999))
            .abs()
            < 1e-2
    );
}

/// Goes red where each node's reading takes as long as the file: then this takes minutes.
#[test]
fn reading_takes_no_longer_than_the_file() {
    let count = 60_000;
    let mut text = String::from("surface = 'n0'\n");
    (0..count).for_each(|i| text += &format!("[nodes.n{i}]\nkind = 'copy'\nof = 'n{}'\n", i + 1));
    text += &format!("[nodes.n{count}]\nkind = 'sphere'\nradius = 1\n");
    let start = std::time::Instant::now();
    scene(&text);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());

    // Nor where each formula looks for its name among all of them.
    let count = 40_000;
    let mut text = String::from("[parameters]\n");
    (0..count).for_each(|i| text += &format!("p{i} = 0.5\n"));
    text += "[nodes.a]\nkind = 'union'\nof = [\n";
    (0..count).for_each(|i| text += &format!("  {{ kind = 'sphere', radius = 'p{i}' }},\n"));
    let start = std::time::Instant::now();
    scene(&(text + "]\n"));
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());

    // Nor where what should be nodes is none.
    let start = std::time::Instant::now();
    let error = super::parse(&format!("[nodes.a]\nkind = 'union'\nof = [{}]", "0,\n".repeat(400_000)));
    assert!(error.unwrap_err().to_string().contains("nodes.a.of[0]: a number stands here"));
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn example_scenes_are_the_same_on_both_backends() {
    let gpu = super::common::gpu();
    for entry in std::fs::read_dir("examples/scenes").unwrap() {
        let path = entry.unwrap().path();
        if !isoforge::scene::is_scene_ending(&path) {
            continue;
        }
        let scene = Scene::open(&path, &OpenOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let [low, high] = scene.bounds.expect("an example names its bounds");
        let grid = Grid::from_bounds([24; 3], low, high).unwrap();
        let field = scene.field();
        let source = Source::Field(&field, grid);
        let options = Options::new(scene.iso.expect("an example's is a solid"));
        let (mesh, _) = isoforge::extract::extract_on_cpu(&source, &options, &|_| {}).unwrap();
        assert!(mesh.triangles.len() > 500, "{}: {} triangles", path.display(), mesh.triangles.len());
        if let Some(gpu) = gpu {
            let extractor = Extractor::new(gpu.clone()).unwrap();
            let found = compare(&extractor, &source, &options).unwrap();
            assert!(found.agrees(), "{}:\n{found}", path.display());
        }
    }
}
