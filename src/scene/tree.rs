//! The nodes of a scene, made one after the other, parts first.

use super::error::{Fault, SceneError};
use super::files::Files;
use super::table::{Item, Source, Table};
use super::{densities, files, solids, transform};
use crate::graph::Expr;
use crate::graph::formula::Names;
use std::collections::{HashMap, HashSet};
use toml::de::DeValue;

/// A node's expression.
#[derive(Debug, Clone)]
pub struct Made {
    pub expr: Expr,
    /// Whether it is high inside: a density. Solids are below 0 inside.
    pub dense: bool,
}

impl Made {
    pub fn solid(expr: Expr) -> Self {
        Self { expr, dense: false }
    }

    pub fn density(expr: Expr) -> Self {
        Self { expr, dense: true }
    }
}

type Found<T> = Result<T, SceneError>;

/// Makes a node of its table.
pub type Build = fn(&Node<'_, '_>) -> Found<Made>;

/// The keys whose values are nodes, by name or in place.
const OPERANDS: [&str; 2] = ["of", "by"];
/// The key of a formula whose value is a table of nodes.
const WITH: &str = "with";
const NODE: &str = "a node: its name, or a table with a `kind`";
const TABLE: &str = "a table with a `kind`";

/// A node that is being made.
pub struct Node<'t, 'b> {
    pub table: Table<'t>,
    pub files: &'b Files,
    made: &'b HashMap<&'t str, Made>,
}

impl<'t> Node<'t, '_> {
    /// The error for a part of the library that refused the node.
    pub fn check<T, E: Into<Fault>>(&self, result: Result<T, E>) -> Found<T> {
        result.map_err(|error| self.table.fault(error))
    }

    fn part(&self, item: &Item<'t>) -> Found<Made> {
        match item.value {
            DeValue::String(name) => self.made.get(&**name).cloned().ok_or_else(|| item.type_fault(NODE)),
            _ => make(item, self.files, self.made),
        }
    }

    /// The node under a key, of either sort.
    pub fn any(&self, key: &'static str) -> Found<Made> {
        self.part(&self.table.need(key, NODE)?)
    }

    /// The solid under a key.
    pub fn solid(&self, key: &'static str) -> Found<Expr> {
        let item = self.table.need(key, NODE)?;
        self.solid_part(&item)
    }

    fn solid_part(&self, item: &Item<'t>) -> Found<Expr> {
        let made = self.part(item)?;
        if made.dense { Err(item.fault(Fault::Density)) } else { Ok(made.expr) }
    }

    fn items(&self, key: &'static str) -> Found<Vec<Item<'t>>> {
        let wanted = "a node, or a list of nodes: names, or tables with a `kind`";
        let item = self.table.need(key, wanted)?;
        let items = if item.value.is_array() { item.list(wanted)? } else { vec![item.clone()] };
        if items.is_empty() {
            Err(item.fault(Fault::Type { wanted, found: "an empty list" }))
        } else {
            Ok(items)
        }
    }

    /// The solids under a key, at least one.
    pub fn solids(&self, key: &'static str) -> Found<Vec<Expr>> {
        self.items(key)?.iter().map(|item| self.solid_part(item)).collect()
    }

    /// The nodes under a key, of either sort, at least one.
    pub fn all(&self, key: &'static str) -> Found<Vec<Made>> {
        self.items(key)?.iter().map(|item| self.part(item)).collect()
    }

    /// Nodes under names of their own, for a formula.
    pub fn named(&self) -> Found<Names> {
        let mut names = Names::default();
        let Some(item) = self.table.get(WITH) else { return Ok(names) };
        let table = item.table("a table of names for nodes, as in { d = \"body\" }")?;
        for (name, item) in table.entries() {
            item.check_name(name)?;
            names.insert(name, self.part(&item)?.expr);
        }
        Ok(names)
    }
}

/// Makes the node of a table, which may hold others in place.
fn make<'t>(item: &Item<'t>, files: &Files, made: &HashMap<&'t str, Made>) -> Found<Made> {
    let node = Node { table: item.table(TABLE)?, files, made };
    let kind = node.table.need("kind", "the word that says what it is, as in kind = \"sphere\"")?;
    let word = kind.text()?;
    let kinds = || solids::KINDS.iter().chain(densities::KINDS).chain(files::KINDS);
    let Some((_, build)) = kinds().find(|(name, _)| *name == word) else {
        return Err(kind.unknown("kind", kinds().map(|(name, _)| (*name).to_string()).collect()));
    };
    let plain = build(&node)?;
    let transformed = transform::apply(&node.table, plain)?;
    node.table.finish()?;
    Ok(transformed)
}

/// The names of nodes that a node's table has, and those of nodes in place within it.
fn references<'t>(item: &Item<'t>, out: &mut Vec<Item<'t>>) {
    // No error is made where there is none: its excerpt takes time.
    let Some(Ok(table)) = item.value.is_table().then(|| item.table(TABLE)) else { return };
    let mut collect = |item: Item<'t>| match item.value {
        DeValue::String(_) => out.push(item),
        // As deep as the file is nested, which its parser bounds.
        _ => references(&item, out),
    };
    for (key, item) in table.entries() {
        if OPERANDS.contains(&key) {
            match item.value.is_array().then(|| item.list(NODE)) {
                Some(Ok(items)) => items.into_iter().for_each(&mut collect),
                _ => collect(item),
            }
        } else if key == WITH
            && let Ok(table) = item.table(NODE)
        {
            table.entries().into_iter().for_each(|(_, item)| collect(item));
        }
    }
}

/// A node whose parts are being made.
struct Open<'t> {
    name: &'t str,
    parts: Vec<Item<'t>>,
    /// How many of the parts were looked at.
    next: usize,
}

/// Makes all nodes, and finds the one that is meshed.
pub fn surface<'t>(
    source: &Source<'t>,
    nodes: Option<Item<'t>>,
    surface: Option<Item<'t>>,
    files: &Files,
) -> Found<Made> {
    let Some(nodes) = nodes else { return Err(source.fault(0, "", Fault::NoNode)) };
    let entries = nodes.table("a table of nodes, as in `[nodes.ball]`")?.entries();
    if entries.is_empty() {
        return Err(nodes.fault(Fault::NoNode));
    }
    let items: HashMap<&str, &Item<'t>> = entries.iter().map(|(name, item)| (*name, item)).collect();
    let known = || entries.iter().map(|(name, _)| (*name).to_string()).collect::<Vec<_>>();
    let mut made: HashMap<&str, Made> = HashMap::new();
    let mut used: HashSet<&str> = HashSet::new();
    for (name, _) in &entries {
        // A list of its own in place of recursion: chains of nodes may be long.
        let open = |name: &'t str| {
            let mut parts = Vec::new();
            references(items[name], &mut parts);
            Open { name, parts, next: 0 }
        };
        // Of those that are not made, those that wait: found at once, however many they are.
        let mut opened: HashSet<&str> = HashSet::from([*name]);
        let mut waiting = if made.contains_key(name) { vec![] } else { vec![open(name)] };
        while let Some(top) = waiting.last_mut() {
            let Some(part) = top.parts.get(top.next) else {
                let node = make(items[top.name], files, &made)?;
                made.insert(top.name, node);
                waiting.pop();
                continue;
            };
            top.next += 1;
            let part = part.clone();
            let (name, _) = items.get_key_value(part.text()?).ok_or_else(|| part.unknown("node", known()))?;
            used.insert(name);
            if made.contains_key(name) {
                continue;
            }
            if opened.contains(name) {
                let first = waiting.iter().position(|open| open.name == *name).unwrap_or(0);
                let mut nodes: Vec<String> = waiting[first..].iter().map(|open| open.name.into()).collect();
                nodes.push((*name).into());
                return Err(part.fault(Fault::Cycle { nodes }));
            }
            opened.insert(name);
            waiting.push(open(name));
        }
    }
    if let Some(surface) = surface {
        return made.get(surface.text()?).cloned().ok_or_else(|| surface.unknown("node", known()));
    }
    let tops: Vec<&str> = entries.iter().map(|(name, _)| *name).filter(|name| !used.contains(name)).collect();
    match tops[..] {
        [top] => Ok(made[top].clone()),
        _ => Err(source.fault(0, "", Fault::NoSurface { nodes: tops.into_iter().map(Into::into).collect() })),
    }
}
