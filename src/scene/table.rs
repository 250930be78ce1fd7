//! A table of a scene file, read key by key: types are checked, and every fault knows its place.

use super::error::{Fault, Place, SceneError};
use crate::excerpt::excerpt;
use crate::field::{Field, Points, Sense};
use crate::graph::formula::Names;
use crate::graph::shapes::Vector;
use crate::graph::{Expr, GraphField, formula};
use std::cell::RefCell;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A scene file's text, and the names that its formulas may use.
pub struct Source<'t> {
    pub path: &'t Path,
    pub text: &'t str,
    /// Before the names of parameters.
    pub prefix: String,
    pub names: Names,
}

impl Source<'_> {
    /// The error for a fault at a byte of the text, in the value of a key.
    pub fn fault(&self, at: usize, key: &str, fault: impl Into<Fault>) -> SceneError {
        let place = excerpt(self.text, at);
        SceneError::At(Box::new(Place {
            file: self.path.into(),
            line: place.line,
            column: place.column,
            key: key.into(),
            fault: fault.into(),
            excerpt: place.text,
        }))
    }

    /// A path in the file, from the file's own folder.
    pub fn relative(&self, path: &str) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(path)
    }
}

/// A table of a scene, and which of its keys were asked for.
pub struct Table<'t> {
    pub source: &'t Source<'t>,
    pub table: &'t DeTable<'t>,
    span: Range<usize>,
    /// Its key, from the top.
    pub key: String,
    asked: RefCell<Vec<&'static str>>,
}

/// A value of a table.
#[derive(Clone)]
pub struct Item<'t> {
    pub source: &'t Source<'t>,
    pub value: &'t DeValue<'t>,
    pub span: Range<usize>,
    /// Its key, from the top.
    pub key: String,
}

type Found<T> = Result<T, SceneError>;

impl<'t> Table<'t> {
    pub fn new(source: &'t Source<'t>, table: &'t DeTable<'t>, span: Range<usize>, key: String) -> Self {
        Self { source, table, span, key, asked: RefCell::default() }
    }

    /// The error for a fault of the table as a whole.
    pub fn fault(&self, fault: impl Into<Fault>) -> SceneError {
        self.source.fault(self.span.start, &self.key, fault)
    }

    fn inner_key(&self, key: &str) -> String {
        // Quoted as in TOML: a point within a name is no step down.
        let is_bare = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        let quoted = key.is_empty() || !key.chars().all(is_bare);
        let key = if quoted { format!("{key:?}") } else { key.into() };
        if self.key.is_empty() { key } else { format!("{}.{key}", self.key) }
    }

    /// The value of a key, if it is there.
    pub fn get(&self, key: &'static str) -> Option<Item<'t>> {
        let mut asked = self.asked.borrow_mut();
        if !asked.contains(&key) {
            asked.push(key);
        }
        self.table.get(key).map(|value| self.item(key, value))
    }

    /// The value of a key that must be there.
    pub fn need(&self, key: &'static str, wanted: &'static str) -> Found<Item<'t>> {
        self.get(key).ok_or_else(|| {
            let written = self.table.iter().map(|(key, _)| &**key.get_ref());
            let closest = formula::closest(key, written.filter(|key| *key != "kind"));
            self.fault(Fault::Missing { key, wanted, closest })
        })
    }

    fn item(&self, key: &str, value: &'t Spanned<DeValue<'t>>) -> Item<'t> {
        Item { source: self.source, value: value.get_ref(), span: value.span(), key: self.inner_key(key) }
    }

    /// All keys and values in the order of the file.
    pub fn entries(&self) -> Vec<(&'t str, Item<'t>)> {
        let mut entries: Vec<_> = self.table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries.into_iter().map(|(key, value)| (&**key.get_ref(), self.item(key.get_ref(), value))).collect()
    }

    /// Marks keys that another part of the program reads.
    pub fn allow(&self, keys: &[&'static str]) {
        self.asked.borrow_mut().extend(keys);
    }

    /// Refuses keys that nobody asked for.
    pub fn finish(&self) -> Found<()> {
        let asked = self.asked.borrow();
        let unknown = self.table.iter().filter(|(key, _)| !asked.contains(&&**key.get_ref()));
        let Some((key, _)) = unknown.min_by_key(|(key, _)| key.span().start) else { return Ok(()) };
        let (at, key) = (key.span().start, key.get_ref().to_string());
        let closest = formula::closest(&key, asked.iter().copied());
        let known = asked.iter().map(|key| (*key).to_string()).collect();
        Err(self.source.fault(at, &self.key, Fault::UnknownKey { key, closest, known }))
    }

    pub fn number(&self, key: &'static str) -> Found<Expr> {
        self.need(key, NUMBER)?.number()
    }

    pub fn number_or(&self, key: &'static str, default: f64) -> Found<Expr> {
        self.get(key).map_or(Ok(default.into()), |item| item.number())
    }

    /// A size, which may vanish.
    pub fn size(&self, key: &'static str) -> Found<Expr> {
        self.need(key, NUMBER)?.size()
    }

    pub fn vector(&self, key: &'static str) -> Found<Vector> {
        self.need(key, VECTOR)?.vector()
    }

    pub fn vector_or(&self, key: &'static str, default: [f64; 3]) -> Found<Vector> {
        self.get(key).map_or(Ok(default.into()), |item| item.vector())
    }

    /// The value of a key that names a file, and the file's path.
    pub fn file(&self, key: &'static str, wanted: &'static str) -> Found<(Item<'t>, PathBuf)> {
        let item = self.need(key, wanted)?;
        let path = self.source.relative(item.text()?);
        Ok((item, path))
    }

    /// A whole number from `least` to `most`.
    pub fn whole(&self, key: &'static str, default: u32, range: Range<u32>) -> Found<u32> {
        self.get(key).map_or(Ok(default), |item| item.whole(range))
    }

    /// A number that is known when the file is read.
    pub fn setting_or(&self, key: &'static str, default: f64) -> Found<f64> {
        self.get(key).map_or(Ok(default), |item| item.setting())
    }
}

const NUMBER: &str = "a number or a formula like \"2*r\"";
const VECTOR: &str = "three numbers or formulas like [0, 1.5, \"h/2\"]";
const TEXT: &str = "a text in quotes";

impl<'t> Item<'t> {
    pub fn fault(&self, fault: impl Into<Fault>) -> SceneError {
        self.source.fault(self.span.start, &self.key, fault)
    }

    pub fn type_fault(&self, wanted: &'static str) -> SceneError {
        let found = match self.value {
            DeValue::String(_) => "a text",
            DeValue::Integer(_) | DeValue::Float(_) => "a number",
            DeValue::Boolean(_) => "true or false",
            DeValue::Datetime(_) => "a date",
            DeValue::Array(_) => "a list",
            DeValue::Table(_) => "a table",
        };
        self.fault(Fault::Type { wanted, found })
    }

    pub fn text(&self) -> Found<&'t str> {
        self.value.as_str().ok_or_else(|| self.type_fault(TEXT))
    }

    /// A number as it stands, finite also as `f32`, which is what fields are computed in.
    pub fn plain(&self) -> Found<f64> {
        let number = match self.value {
            DeValue::Integer(n) => i128::from_str_radix(n.as_str(), n.radix()).ok().map(|n| n as f64),
            DeValue::Float(n) => n.as_str().parse().ok(),
            _ => return Err(self.type_fault("a number")),
        };
        number.filter(|n: &f64| (*n as f32).is_finite()).ok_or_else(|| {
            let wanted = "a finite number within ±3.4e38".into();
            self.fault(Fault::Range { wanted, found: self.written().into() })
        })
    }

    /// The value as it stands in the file.
    fn written(&self) -> &'t str {
        self.source.text.get(self.span.clone()).unwrap_or("")
    }

    pub fn whole(&self, range: Range<u32>) -> Found<u32> {
        let DeValue::Integer(n) = self.value else { return Err(self.type_fault("a whole number")) };
        let number = u32::from_str_radix(n.as_str(), n.radix()).ok().filter(|n| range.contains(n));
        number.ok_or_else(|| {
            let wanted = format!("a whole number from {} to {}", range.start, range.end - 1);
            self.fault(Fault::Range { wanted, found: self.written().into() })
        })
    }

    pub fn choice<T: Copy>(&self, what: &'static str, words: &[(&str, T)]) -> Found<T> {
        let found = self.text()?;
        words.iter().find(|(word, _)| *word == found).map(|(_, value)| *value).ok_or_else(|| {
            let known: Vec<String> = words.iter().map(|(word, _)| (*word).to_string()).collect();
            self.unknown(what, known)
        })
    }

    /// The error for a text that is none of `known`.
    pub fn unknown(&self, what: &'static str, known: Vec<String>) -> SceneError {
        let found = self.value.as_str().unwrap_or("");
        let closest = formula::closest(found, known.iter().map(String::as_str));
        self.fault(Fault::UnknownWord { what, found: formula::short(found), closest, known })
    }

    /// A number, or a formula of the scene's parameters (and of the point).
    pub fn number(&self) -> Found<Expr> {
        match self.value {
            DeValue::String(text) => self.formula(text, &Names::default()),
            DeValue::Integer(_) | DeValue::Float(_) => Ok(self.plain()?.into()),
            _ => Err(self.type_fault(NUMBER)),
        }
    }

    /// A number that is no constant below 0. What parameters make of one is known when the field is evaluated; then such a
    /// solid is empty.
    pub fn size(&self) -> Found<Expr> {
        let size = self.number()?;
        match size.constant() {
            Some(value) if value < 0.0 => {
                let found = match self.value {
                    DeValue::String(_) => format!("{} = {value}", self.written()),
                    _ => self.written().into(),
                };
                Err(self.fault(Fault::Range { wanted: "a number of 0 or more".into(), found }))
            }
            _ => Ok(size),
        }
    }

    /// A number that is known when the file is read: one number, or a formula of parameters at the values that they have.
    pub fn setting(&self) -> Found<f64> {
        let DeValue::String(text) = self.value else { return self.plain() };
        let expr = self.formula(text, &Names::default())?;
        let field = GraphField::new(&expr, Sense::Below);
        // One number wherever it is asked for, or it is none.
        let mut values = [0.0; 2];
        let points = Points { x: &[0.3, -1.7], y: &[-0.6, 2.9], z: &[0.8, -4.1] };
        let known = field.values(points, &mut values).is_ok();
        if known && values[0] == values[1] && values[0].is_finite() {
            return Ok(f64::from(values[0]));
        }
        let wanted = "a formula of parameters alone, with a finite value".into();
        Err(self.fault(Fault::Range { wanted, found: self.written().into() }))
    }

    /// A whole number that is known when the file is read, formulas rounded.
    pub fn whole_setting(&self, range: Range<u32>) -> Found<u32> {
        if !matches!(self.value, DeValue::String(_)) {
            return self.whole(range);
        }
        let number = self.setting()?.round();
        if (f64::from(range.start)..f64::from(range.end)).contains(&number) {
            return Ok(number as u32);
        }
        let wanted = format!("a whole number from {} to {}", range.start, range.end - 1);
        Err(self.fault(Fault::Range { wanted, found: format!("{} = {number}", self.written()) }))
    }

    /// Refuses a name for this value that formulas cannot say, or mean something else by.
    pub fn check_name(&self, name: &str) -> Found<()> {
        if formula::is_reserved(name) {
            Err(self.fault(Fault::Reserved { name: name.into() }))
        } else if formula::is_name(name) {
            Ok(())
        } else {
            Err(self.fault(Fault::Unsayable { name: formula::short(name) }))
        }
    }

    /// `text`, which is this value, as a formula; `more` are names beside the scene's parameters.
    pub fn formula(&self, text: &str, more: &Names) -> Found<Expr> {
        formula::parse_with(text, &[&self.source.names, more]).map_err(|(fault, at)| {
            // Where the text stands in the file as it is, the caret can stand in it.
            let written = self.written();
            let quotes = written.find(text).unwrap_or(0);
            let at = if written[quotes..].starts_with(text) { quotes + at } else { 0 };
            self.source.fault(self.span.start + at, &self.key, Fault::Formula(fault))
        })
    }

    pub fn vector(&self) -> Found<Vector> {
        Ok(Vector(
            self.triple(VECTOR)?
                .map(|item| item.number())
                .into_iter()
                .collect::<Found<Vec<_>>>()
                .and_then(|numbers| numbers.try_into().map_err(|_| self.type_fault(VECTOR)))?,
        ))
    }

    fn triple(&self, wanted: &'static str) -> Found<[Item<'t>; 3]> {
        self.list(wanted)?
            .try_into()
            .map_err(|_| self.fault(Fault::Type { wanted, found: "a list of another length" }))
    }

    pub fn plain_triple(&self) -> Found<[f64; 3]> {
        let [x, y, z] = self.triple("three numbers like [0, 1.5, 2]")?;
        Ok([x.setting()?, y.setting()?, z.setting()?])
    }

    pub fn list(&self, wanted: &'static str) -> Found<Vec<Item<'t>>> {
        let list = self.value.as_array().ok_or_else(|| self.type_fault(wanted))?;
        let item = |(i, value): (usize, &'t Spanned<DeValue<'t>>)| Item {
            source: self.source,
            value: value.get_ref(),
            span: value.span(),
            key: format!("{}[{i}]", self.key),
        };
        Ok(list.iter().enumerate().map(item).collect())
    }

    pub fn table(&self, wanted: &'static str) -> Found<Table<'t>> {
        let table = self.value.as_table().ok_or_else(|| self.type_fault(wanted))?;
        Ok(Table::new(self.source, table, self.span.clone(), self.key.clone()))
    }
}
