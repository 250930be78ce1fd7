//! What moves and deforms a node: keys beside its own, applied in the order in which they are written. `kinds.md`
//! has their values, the methods of [`graph::shapes`](crate::graph::shapes) say what each does.

use super::error::{Fault, SceneError};
use super::table::{Item, Table};
use super::tree::Made;
use crate::graph::shapes::{Axis, Lattice, Vector};
use crate::graph::{Expr, x, y, z};
use glam::{DAffine3, DMat3, DVec3};

type Found<T> = Result<T, SceneError>;

/// The node under all transforms of its table.
pub fn apply(table: &Table<'_>, node: Made) -> Found<Made> {
    table.allow(KEYS);
    let entries = table.entries();
    entries
        .iter()
        .filter(|(key, _)| KEYS.contains(key))
        .try_fold(node, |node, (key, item)| one(key, item, node))
}

const KEYS: &[&str] = &[
    "translate",
    "rotate",
    "scale",
    "mirror",
    "symmetric",
    "affine",
    "twist",
    "bend",
    "taper",
    "repeat",
    "free_form",
    "warp",
    "transform",
];

fn one(key: &str, item: &Item<'_>, made: Made) -> Found<Made> {
    let Made { expr, dense } = made;
    let expr = match key {
        "translate" => expr.translate(item.vector()?),
        "scale" => scaled(item, &expr, dense)?,
        "affine" => check(item, expr.affine(affine(item)?))?,
        "warp" => expr.at(item.vector()?.0),
        "transform" => {
            let mut made = Made { expr, dense };
            for item in item.list("a list of tables, each with a transform")? {
                let table = item.table("a table with a transform, as { scale = 2 }")?;
                made = apply(&table, made)?;
                table.finish()?;
            }
            return Ok(made);
        }
        _ => {
            let table = item.table("a table of its keys, which `isoforge nodes` lists")?;
            let expr = of_table(key, &table, &expr)?;
            table.finish()?;
            expr
        }
    };
    Ok(Made { expr, dense })
}

fn check<T>(item: &Item<'_>, result: Result<T, crate::graph::shapes::ShapeError>) -> Found<T> {
    result.map_err(|error| item.fault(error))
}

/// The transforms that have several keys.
fn of_table(key: &str, table: &Table<'_>, expr: &Expr) -> Found<Expr> {
    let range = || Ok::<_, SceneError>((table.number("from")?, table.number("to")?));
    let plane = || Ok::<_, SceneError>((table.vector("normal")?, table.number_or("offset", 0.0)?));
    let result = match key {
        "rotate" => {
            let turns = match (table.get("degrees"), table.get("turns")) {
                (Some(degrees), None) => degrees.number()? / 360.0,
                (None, Some(turns)) => turns.number()?,
                _ => return Err(table.fault(Fault::One { keys: vec!["`degrees`", "`turns`"] })),
            };
            expr.rotate(table.vector("axis")?, turns)
        }
        "mirror" => plane().map(|(normal, offset)| expr.mirror(normal, offset))?,
        "symmetric" => plane().map(|(normal, offset)| expr.symmetric(normal, offset))?,
        "twist" => {
            let (from, to) = range()?;
            expr.twist(table.number("turns_per_length")?, from, to)
        }
        "bend" => {
            let (from, to) = range()?;
            expr.bend(table.number("turns_per_length")?, from, to)
        }
        "taper" => {
            let (from, to) = range()?;
            expr.taper(table.number("low")?, table.number("high")?, from, to)
        }
        "repeat" => {
            let axes = [("x", Axis::X), ("y", Axis::Y), ("z", Axis::Z)];
            let axis = table.need("axis", "\"x\", \"y\" or \"z\"")?.choice("axis", &axes)?;
            let limit = table.get("limit").map(|item| item.whole(0..1 << 24)).transpose()?;
            expr.repeat(axis, table.number("period")?, limit)
        }
        // The keys are those of `KEYS`.
        _ => Ok(expr.free_form(&lattice(table)?)),
    };
    result.map_err(|error| table.fault(error))
}

/// Larger by a factor, or one an axis. Densities keep their values.
fn scaled(item: &Item<'_>, expr: &Expr, dense: bool) -> Found<Expr> {
    let factors = match item.value.is_array() {
        true => item.vector()?,
        false => {
            let factor = item.number()?;
            Vector([factor.clone(), factor.clone(), factor])
        }
    };
    let scaled = match item.value.is_array() {
        true => expr.scale_axes(&factors),
        false => expr.scale(factors.0[0].clone()),
    };
    let scaled = check(item, scaled)?;
    if dense {
        let [a, b, c] = factors.0.map(|factor| 1.0 / factor);
        return Ok(expr.at([x() * a, y() * b, z() * c]));
    }
    Ok(scaled)
}

fn affine(item: &Item<'_>) -> Found<DAffine3> {
    let wanted = "three rows of four numbers";
    let mut rows = [[0.0; 4]; 3];
    let list = item.list(wanted)?;
    if list.len() != 3 {
        return Err(item.fault(Fault::Type { wanted, found: "a list of another length" }));
    }
    for (row, item) in rows.iter_mut().zip(list) {
        let numbers = item.list(wanted)?.iter().map(|n| n.setting()).collect::<Found<Vec<_>>>()?;
        *row = numbers
            .try_into()
            .map_err(|_| item.fault(Fault::Type { wanted, found: "a row of another length" }))?;
    }
    let column = |i: usize| DVec3::new(rows[0][i], rows[1][i], rows[2][i]);
    Ok(DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) })
}

fn lattice(table: &Table<'_>) -> Found<Lattice> {
    let (low, high) = (table.vector("low")?, table.vector("high")?);
    let item = table.need("counts", "the control points along each axis, as [2, 2, 3]")?;
    let counts =
        item.list("three whole numbers")?.iter().map(|n| n.whole(0..1 << 16)).collect::<Found<Vec<_>>>()?;
    let counts: [u32; 3] = counts.try_into().map_err(|_| item.type_fault("three whole numbers"))?;
    let wanted = "a list of vectors, one a control point, x fastest";
    let item = table.need("displacements", wanted)?;
    let displacements = item.list(wanted)?.iter().map(|v| v.vector()).collect::<Found<Vec<_>>>()?;
    let lattice = Lattice::new(low, high, counts.map(|n| n as usize), displacements);
    lattice.map_err(|error| table.fault(error))
}
