//! The kinds of nodes that are solids, and what combines them: the functions of
//! [`graph::shapes`](crate::graph::shapes). `kinds.md` has their keys.

use super::densities::with_iso;
use super::error::{Fault, SceneError};
use super::tree::{Build, Made, Node};
use crate::field::named;
use crate::graph::shapes::*;
use crate::graph::{Expr, x, y, z};

type Found<T> = Result<T, SceneError>;

pub const KINDS: &[(&str, Build)] = &[
    ("sphere", |node| Ok(Made::solid(sphere(node.table.size("radius")?)))),
    ("ellipsoid", |node| solid(node, ellipsoid(node.table.vector("radii")?))),
    ("box", |node| {
        let (low, high) = corners(node)?;
        let radius = node.table.get("radius").map(|item| item.size()).transpose()?;
        Ok(Made::solid(match radius {
            Some(radius) => rounded_box(low, high, radius),
            None => box_(low, high),
        }))
    }),
    ("half_space", |node| {
        solid(node, half_space(node.table.vector("normal")?, node.table.number_or("offset", 0.0)?))
    }),
    ("cylinder", |node| {
        let radius = node.table.size("radius")?;
        let height = node.table.get("height").map(|item| item.size()).transpose()?;
        Ok(Made::solid(match height {
            Some(height) => cylinder(radius, height),
            None => infinite_cylinder(radius),
        }))
    }),
    ("capsule", |node| {
        let (a, b) = (node.table.vector("a")?, node.table.vector("b")?);
        Ok(Made::solid(capsule(a, b, node.table.size("radius")?)))
    }),
    ("cone", |node| {
        let radius = node.table.size("radius")?;
        let top = node.table.get("top").map_or(Ok(0.0.into()), |item| item.size())?;
        solid(node, frustum(radius, top, node.table.number("height")?))
    }),
    ("torus", |node| Ok(Made::solid(torus_distance(node.table.size("major")?, node.table.size("minor")?)))),
    ("superellipsoid", |node| {
        let (radii, e1, e2) = super_keys(node)?;
        solid(node, superellipsoid(radii, e1, e2))
    }),
    ("superhyperboloid", |node| {
        let (radii, e1, e2) = super_keys(node)?;
        solid(node, superhyperboloid(radii, e1, e2))
    }),
    ("supertorus", |node| {
        let (radii, e1, e2) = super_keys(node)?;
        let hole = node.table.size("hole")?;
        solid(node, supertorus(radii, hole, e1, e2))
    }),
    ("extrude", |node| Ok(Made::solid(extrude(&node.solid("of")?, node.table.size("height")?)))),
    ("revolve", |node| Ok(Made::solid(revolve(&node.solid("of")?)))),
    ("field", field),
    ("formula", |node| {
        let names = node.named()?;
        let item = node.table.need("text", "a formula")?;
        Ok(Made::solid(item.formula(item.text()?, &names)?))
    }),
    ("noise", noise),
    ("union", |node| {
        let of = node.solids("of")?;
        joined(node, of, union, Expr::smooth_union, Expr::exponential_union, Expr::r_union)
    }),
    ("intersection", |node| {
        let of = node.solids("of")?;
        let (smooth, exponential) = (Expr::smooth_intersection, Expr::exponential_intersection);
        joined(node, of, intersection, smooth, exponential, Expr::r_intersection)
    }),
    ("difference", |node| {
        let of = node.solids("of")?;
        let sharp = |of: Vec<Expr>| match &of[..] {
            [only] => only.clone(),
            [first, rest @ ..] => first.difference_of(rest.iter().cloned()),
            [] => 1.0.into(),
        };
        joined(node, of, sharp, Expr::smooth_difference, Expr::exponential_difference, Expr::r_difference)
    }),
    ("negation", |node| Ok(Made::solid(node.solid("of")?.negation()))),
    ("shell", |node| Ok(Made::solid(node.solid("of")?.shell(node.table.size("thickness")?)))),
    ("offset", |node| Ok(Made::solid(node.solid("of")?.offset(node.table.number("distance")?)))),
    ("displace", |node| {
        let Made { expr, dense } = node.any("of")?;
        Ok(Made { expr: expr + node.any("by")?.expr, dense })
    }),
    ("morph", |node| {
        let part = node.table.number("part")?;
        match &node.all("of")?[..] {
            [a, b] if a.dense == b.dense => Ok(Made { expr: a.expr.morph(&b.expr, part), dense: a.dense }),
            [_, _] => Err(node.table.fault(Fault::Density)),
            _ => Err(node.table.fault(Fault::Type { wanted: "two nodes", found: "another number of them" })),
        }
    }),
    ("sum", sum),
    ("copy", |node| node.any("of")),
];

fn solid(node: &Node<'_, '_>, made: Result<Expr, ShapeError>) -> Found<Made> {
    node.check(made).map(Made::solid)
}

/// The corners of a box, which may be flat.
fn corners(node: &Node<'_, '_>) -> Found<(Vector, Vector)> {
    let (low, high) = (node.table.vector("low")?, node.table.vector("high")?);
    let sides = ["box along x", "box along y", "box along z"];
    for ((from, to), what) in low.0.iter().zip(&high.0).zip(sides) {
        match (from.constant(), to.constant()) {
            (Some(from), Some(to)) if to < from => {
                return Err(node.table.fault(ShapeError::Empty { what, from, to }));
            }
            _ => {}
        }
    }
    Ok((low, high))
}

/// Radii and exponents of superquadrics.
fn super_keys(node: &Node<'_, '_>) -> Found<(Vector, Expr, Expr)> {
    let table = &node.table;
    Ok((table.vector("radii")?, table.number("e1")?, table.number("e2")?))
}

#[derive(Clone, Copy, PartialEq)]
enum Blend {
    Polynomial,
    Exponential,
    R,
}

/// The solids joined, sharply or by one of the blends, from the first on.
fn joined(
    node: &Node<'_, '_>,
    of: Vec<Expr>,
    sharp: impl Fn(Vec<Expr>) -> Expr,
    polynomial: impl Fn(&Expr, Expr, Expr) -> Expr,
    exponential: impl Fn(&Expr, Expr, Expr) -> Expr,
    r: impl Fn(&Expr, Expr, Expr) -> Result<Expr, ShapeError>,
) -> Found<Made> {
    let words = [("polynomial", Blend::Polynomial), ("exponential", Blend::Exponential), ("r", Blend::R)];
    let blend = node.table.get("blend").map(|item| item.choice("blend", &words)).transpose()?;
    let (key, wanted) = if blend == Some(Blend::R) {
        ("alpha", "a number above -1 and at most 1, as 0")
    } else {
        ("radius", "how wide the blend is")
    };
    if blend.is_none() && node.table.get(key).is_none() {
        return Ok(Made::solid(sharp(of)));
    }
    let how = node.table.need(key, wanted)?;
    let how = if blend == Some(Blend::R) { how.number()? } else { how.size()? };
    let mut of = of.into_iter();
    let first = of.next().unwrap_or_else(|| 1.0.into());
    let all = of.try_fold(first, |a, b| match blend {
        Some(Blend::Exponential) => Ok(exponential(&a, b, how.clone())),
        Some(Blend::R) => node.check(r(&a, b, how.clone())),
        Some(Blend::Polynomial) | None => Ok(polynomial(&a, b, how.clone())),
    })?;
    Ok(Made::solid(all))
}

fn field(node: &Node<'_, '_>) -> Found<Made> {
    let name = node.table.need("name", "the name of a field, as `isoforge fields` lists them")?;
    let Some(definition) = named::ALL.iter().find(|d| d.name == name.value.as_str().unwrap_or("")) else {
        name.text()?;
        return Err(name.unknown("field", named::ALL.iter().map(|d| d.name.to_string()).collect()));
    };
    let mut parameters = Vec::new();
    if let Some(item) = node.table.get("parameters") {
        for (key, item) in item.table("a table of numbers, as in { R = 0.5 }")?.entries() {
            parameters.push((key.to_string(), item.number()?));
        }
    }
    let expr = node.check(definition.expr(&parameters))?;
    let iso = node.table.number_or("iso", f64::from(definition.iso))?;
    Ok(Made::solid(expr - iso))
}

fn noise(node: &Node<'_, '_>) -> Found<Made> {
    let table = &node.table;
    let seed = table.whole("seed", 0, 0..u32::MAX)?;
    let octaves = table.whole("octaves", 1, 1..17)?;
    let gain = table.setting_or("gain", 0.5)?;
    let noise = if octaves == 1 { Expr::noise(seed) } else { Expr::fbm(seed, octaves, gain) };
    let size = node.check(positive("size", table.number_or("size", 1.0)?))?;
    let per_unit = 1.0 / &size;
    let placed = noise.at([x() * &per_unit, y() * &per_unit, z() * &per_unit]);
    Ok(Made::solid(placed * table.number_or("height", 1.0)?))
}

fn sum(node: &Node<'_, '_>) -> Found<Made> {
    let of = node.all("of")?;
    let dense = of.iter().any(|made| made.dense);
    let mut weights = vec![Expr::from(1.0); of.len()];
    if let Some(item) = node.table.get("weights") {
        let wanted = "a list of as many numbers as there are nodes";
        let given = item.list(wanted)?;
        if given.len() != of.len() {
            return Err(item.fault(Fault::Type { wanted, found: "a list of another length" }));
        }
        weights = given.iter().map(|item| item.number()).collect::<Found<_>>()?;
    }
    let terms = of.into_iter().zip(weights).map(|(made, weight)| made.expr * weight);
    let expr = terms.reduce(|a, b| a + b).unwrap_or_else(|| 0.0.into());
    if dense { with_iso(node, expr) } else { Ok(Made::solid(expr)) }
}
