//! The kinds of nodes that are densities, high inside: blobs and volumes. With an `iso` each becomes a solid,
//! `iso − density`; without, densities are summed, displace others, or are meshed themselves. `kinds.md` has their
//! keys.

use super::error::{Fault, SceneError};
use super::table::Item;
use super::tree::{Build, Made, Node};
use crate::components;
use crate::graph::Expr;
use crate::graph::blobs::{BLOBBY, Blobs, Component, Ellipsoid, Ellipsoids, Kernel, skeleton};
use crate::graph::shapes::{ShapeError, Vector};
use crate::graph::volume::{Border, Gradient, Interpolation, Lookup, VolumeLeaf};
use crate::volume::{self, Endian, RawLayout, Scalar};
use glam::{DQuat, DVec3, Quat, Vec3};
use std::sync::Arc;

type Found<T> = Result<T, SceneError>;

pub const KINDS: &[(&str, Build)] = &[
    ("blob", blob),
    ("blobs", blobs),
    ("points", points),
    ("equipotential", |node| {
        let of = node.solid("of")?;
        let (height, falloff) = (node.table.number_or("height", 1.0)?, node.table.number_or("falloff", 1.0)?);
        with_iso(node, skeleton::equipotential(height, falloff, &of))
    }),
    ("volume", volume),
];

/// A density, or the solid that it makes with the node's `iso`.
pub fn with_iso(node: &Node<'_, '_>, density: Expr) -> Found<Made> {
    Ok(match node.table.get("iso") {
        Some(item) => Made::solid(item.number()? - density),
        None => Made::density(density),
    })
}

const KERNELS: [(&str, Kernel); 4] = [
    ("soft", Kernel::SoftObject),
    ("metaball", Kernel::Metaball),
    ("blobby", BLOBBY),
    ("inverse-square", Kernel::InverseSquare),
];

fn kernel(node: &Node<'_, '_>) -> Found<Kernel> {
    node.table.get("kernel").map_or(Ok(Kernel::SoftObject), |item| item.choice("kernel", &KERNELS))
}

#[derive(Clone, Copy)]
enum Skeleton {
    Point,
    Segment,
    Polyline,
    Circle,
    Superellipsoid,
}

fn blob(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let words = [
        ("point", Skeleton::Point),
        ("segment", Skeleton::Segment),
        ("polyline", Skeleton::Polyline),
        ("circle", Skeleton::Circle),
        ("superellipsoid", Skeleton::Superellipsoid),
    ];
    let of = table.get("skeleton").map_or(Ok(Skeleton::Point), |item| item.choice("skeleton", &words))?;
    let distance_square = match of {
        Skeleton::Point => skeleton::point_square(table.vector_or("at", [0.0; 3])?),
        Skeleton::Segment => skeleton::segment_square(table.vector("a")?, table.vector("b")?),
        Skeleton::Polyline => {
            let wanted = "a list of points, at least one";
            let item = table.need("points", wanted)?;
            let points =
                item.list(wanted)?.iter().map(|item| item.vector()).collect::<Found<Vec<Vector>>>()?;
            let line = skeleton::polyline_square(points);
            line.ok_or_else(|| item.fault(Fault::Type { wanted, found: "an empty list" }))?
        }
        Skeleton::Circle => skeleton::circle_square(table.size("major")?),
        Skeleton::Superellipsoid => skeleton::superellipsoid_square(table.whole("n", 8, 2..17)?),
    };
    let radius = node.check(crate::graph::shapes::positive("radius", table.number("radius")?))?;
    let expr = skeleton::kernel_expr(kernel(node)?, &distance_square, radius);
    with_iso(node, expr * table.number_or("weight", 1.0)?)
}

fn blobs(node: &Node<'_, '_>) -> Found<Made> {
    let wanted = "a list of tables like { at = [0, 0, 0], radius = 1, weight = 1 }";
    let list = node.table.need("components", wanted)?.list(wanted)?;
    let ellipsoids = list.iter().map(component).collect::<Found<Vec<_>>>()?;
    let kernel = kernel(node)?;
    let is_ball = |e: &Ellipsoid| e.scale == Vec3::ONE && e.rotation == Quat::IDENTITY;
    let sum = match ellipsoids.iter().all(is_ball) {
        true => {
            Blobs::new(kernel, ellipsoids.iter().map(|e| e.component).collect()).map(|blobs| blobs.expr())
        }
        false => Ellipsoids::new(kernel, &ellipsoids).map(|ellipsoids| ellipsoids.expr()),
    };
    with_iso(node, node.check(sum)?)
}

/// A component of a list.
fn component(item: &Item<'_>) -> Found<Ellipsoid> {
    let table = item.table("a table like { at = [0, 0, 0], radius = 1, weight = 1 }")?;
    let at = table.need("at", "its centre, three numbers")?.plain_triple()?;
    let position = at.map(|c| c as f32);
    let (radius, weight) = (table.setting_or("radius", 1.0)? as f32, table.setting_or("weight", 1.0)? as f32);
    let scale = table.get("scale").map_or(Ok([1.0; 3]), |item| item.plain_triple())?;
    let rotation = table.get("rotate").map_or(Ok(DQuat::IDENTITY), |item| {
        let table = item.table("a table { axis, degrees }, or turns for degrees")?;
        let axis = DVec3::from(table.need("axis", "its direction, three numbers")?.plain_triple()?);
        let turns = match (table.get("degrees"), table.get("turns")) {
            (Some(degrees), None) => degrees.setting()? / 360.0,
            (None, Some(turns)) => turns.setting()?,
            _ => return Err(table.fault(Fault::One { keys: vec!["`degrees`", "`turns`"] })),
        };
        let axis =
            axis.try_normalize().ok_or_else(|| table.fault(ShapeError::NoDirection { what: "axis" }))?;
        table.finish()?;
        Ok(DQuat::from_axis_angle(axis, turns * std::f64::consts::TAU))
    })?;
    table.finish()?;
    let (rotation, scale) = (rotation.as_quat(), Vec3::from(scale.map(|s| s as f32)));
    Ok(Ellipsoid { component: Component { position, radius, weight }, rotation, scale })
}

fn points(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let kernel = kernel(node)?;
    // A lone point's surface lies at its radius, at this density or the one named.
    let iso = table.get("iso").map_or(Ok(0.5), |item| item.setting())? as f32;
    let support = match table.get("support") {
        Some(item) => item.setting()? as f32,
        None => match kernel.support_for(iso) {
            Some(support) => support,
            None => {
                let (wanted, found) =
                    ("a density that a lone point has (or a `support`)".into(), iso.to_string());
                return Err(table.fault(Fault::Range { wanted, found }));
            }
        },
    };
    let options = components::OpenOptions {
        radius: table.setting_or("radius", 1.0)? as f32,
        // The lists that points are sorted by take as much again, and half of that.
        max_bytes: node.files.left().map(|bytes| bytes / 5 * 2),
    };
    let (file, path) = table.file("file", "the file of points")?;
    let loaded = components::open(&path, &options).map_err(|error| file.fault(error))?;
    node.files.took(loaded.components.len() as u64 * 50, loaded.notes);
    let blobs = node.check(Blobs::of_points(kernel, loaded.components, iso, support))?;
    with_iso(node, blobs.expr())
}

fn volume(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let interpolations = [("nearest", Interpolation::Nearest), ("trilinear", Interpolation::Trilinear)];
    let gradients = [
        ("exact", Gradient::Exact),
        ("central", Gradient::Central(Interpolation::Trilinear)),
        ("central-nearest", Gradient::Central(Interpolation::Nearest)),
        ("sobel", Gradient::Sobel(Interpolation::Trilinear)),
        ("sobel-nearest", Gradient::Sobel(Interpolation::Nearest)),
    ];
    let value = table.get("value").map(|item| item.choice("interpolation", &interpolations)).transpose()?;
    let gradient = table.get("gradient").map(|item| item.choice("gradient", &gradients)).transpose()?;
    let border = match table.get("border") {
        None => Border::Clamp,
        Some(item) if item.value.is_str() => {
            item.choice("border (or a number)", &[("clamp", Border::Clamp)])?
        }
        Some(item) => Border::Constant(item.plain()? as f32),
    };
    let lookup = Lookup { value: value.unwrap_or_default(), gradient: gradient.unwrap_or_default(), border };
    let (file, path) = table.file("file", "the volume's file")?;
    let is_raw = match volume::is_volume_ending(&path) {
        true => volume::is_raw_ending(&path),
        false => table.get("dims").is_some(),
    };
    let raw = if is_raw { Some(raw_layout(node)?) } else { None };
    let options = volume::OpenOptions { raw, max_bytes: node.files.left(), ..Default::default() };
    let opened = volume::open(&path, &options).map_err(|error| file.fault(error))?;
    node.files.took(opened.volume.bytes(), opened.notes);
    let leaf = node.check(VolumeLeaf::new(Arc::new(opened.volume), lookup))?;
    with_iso(node, leaf.expr())
}

/// How a raw file is laid out.
fn raw_layout(node: &Node<'_, '_>) -> Found<RawLayout> {
    let table = &node.table;
    let wanted = "three whole numbers";
    let dims = table.need("dims", "the samples of a raw file along each axis, [512, 512, 400]")?;
    let counts = dims.list(wanted)?.iter().map(|n| n.whole(2..u32::MAX)).collect::<Found<Vec<_>>>()?;
    let counts = counts.try_into().map_err(|_| dims.type_fault(wanted))?;
    let item = table.need("type", "the type of its samples, \"u16\"")?;
    let word =
        |fault: String| Fault::Range { wanted: fault, found: item.value.as_str().unwrap_or("").into() };
    let scalar: Scalar =
        item.text()?.parse().map_err(|_| item.fault(word("u8 i8 u16 i16 u32 i32 f32 or f64".into())))?;
    let plain = RawLayout::new(counts, scalar);
    let endian = [("little", Endian::Little), ("big", Endian::Big)];
    let triple = |key, default: [f32; 3]| -> Found<[f32; 3]> {
        table.get(key).map_or(Ok(default), |item| Ok(item.plain_triple()?.map(|c| c as f32)))
    };
    Ok(RawLayout {
        endian: table.get("endian").map_or(Ok(plain.endian), |item| item.choice("byte order", &endian))?,
        spacing: triple("spacing", plain.spacing)?,
        origin: triple("origin", plain.origin)?,
        skip_bytes: u64::from(table.whole("skip_bytes", 0, 0..u32::MAX)?),
        ..plain
    })
}
