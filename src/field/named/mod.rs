//! The fields with a name: norm balls, quadrics and other classic surfaces. Each is one entry of [`ALL`], a
//! file a family: its formula, its parameters, and the expression that both backends evaluate.

mod algebraic;
mod norms;
mod periodic;
mod quadrics;
mod superquadrics;

use super::{Field, NoForm, Points, Sense, Wgsl, Within};
use crate::graph::interval::Interval;
use crate::graph::{Expr, GraphField};

/// A parameter of a named field.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Its value unless given.
    pub default: f64,
    /// The smallest value it may have; −∞ if it may have any.
    pub least: f64,
}

/// What is known of a field by its name.
pub struct Definition {
    /// The name.
    pub name: &'static str,
    /// One line of formula.
    pub formula: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
    /// An iso value that shows something.
    pub iso: f32,
    /// Which side of iso is inside.
    pub sense: Sense,
    /// Half the edge of a cube around the origin that shows it.
    pub half_edge: f32,
    /// The field, given its parameters.
    build: fn(&[Expr]) -> Expr,
}

impl Definition {
    /// The field as an expression; parameters not among `given` keep their defaults.
    ///
    /// # Errors
    /// [`NameError::NoParameter`]; [`NameError::Value`] for constants out of their range.
    pub fn expr(&self, given: &[(String, Expr)]) -> Result<Expr, NameError> {
        for (name, expr) in given {
            let Some(parameter) = self.parameters.iter().find(|p| p.name == name) else {
                return Err(NameError::NoParameter { field: self.name, name: name.clone() });
            };
            let Parameter { name, least, .. } = *parameter;
            match expr.constant() {
                Some(value) if !value.is_finite() || value < least => {
                    return Err(NameError::Value { name, value, least });
                }
                _ => {}
            }
        }
        let value = |p: &Parameter| {
            let given = given.iter().rev().find(|(name, _)| name == p.name);
            given.map_or(p.default.into(), |(_, expr)| expr.clone())
        };
        Ok((self.build)(&self.parameters.iter().map(value).collect::<Vec<_>>()))
    }

    /// A field without parameters.
    const fn plain(name: &'static str, formula: &'static str, build: fn(&[Expr]) -> Expr) -> Self {
        Self { name, formula, parameters: &[], iso: 0.0, sense: Sense::Below, half_edge: 1.5, build }
    }
}

/// A parameter that may be any number.
const fn any(name: &'static str, meaning: &'static str, default: f64) -> Parameter {
    Parameter { name, meaning, default, least: f64::NEG_INFINITY }
}

/// A parameter above 0.
const fn positive(name: &'static str, meaning: &'static str, default: f64) -> Parameter {
    Parameter { name, meaning, default, least: 1e-6 }
}

/// Every named field.
pub static ALL: &[Definition] = &[
    norms::SPHERE,
    norms::OCTAHEDRON,
    norms::CUBE,
    norms::TORUS,
    periodic::GYROID,
    periodic::SCHWARZ_P,
    periodic::SCHWARZ_D,
    periodic::NEOVIUS,
    quadrics::QUADRIC,
    quadrics::ELLIPSOID,
    quadrics::HYPERBOLOID_ONE_SHEET,
    quadrics::HYPERBOLOID_TWO_SHEETS,
    quadrics::HYPERBOLIC_PARABOLOID,
    quadrics::ELLIPTIC_PARABOLOID,
    quadrics::ELLIPTIC_CONE,
    quadrics::ELLIPTIC_CYLINDER,
    quadrics::PAIR_OF_PLANES,
    superquadrics::SUPERELLIPSOID,
    superquadrics::SUPERHYPERBOLOID,
    superquadrics::SUPERTORUS,
    algebraic::STEINER,
    algebraic::BOY,
    algebraic::REDUCIBLE,
];

/// Why a named field could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NameError {
    /// No such name.
    #[error("there is no field named `{name}`; the named fields are {}", names())]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// No such parameter.
    #[error("the field `{field}` has no parameter `{name}`; `isoforge fields` lists each field's parameters")]
    NoParameter {
        /// The field.
        field: &'static str,
        /// The parameter asked for.
        name: String,
    },
    /// A parameter out of its range.
    #[error("the parameter `{name}` is {value}; it takes a finite number{}", at_least(*.least))]
    Value {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The smallest value it may have.
        least: f64,
    },
}

fn at_least(least: f64) -> String {
    if least.is_finite() { format!(" of at least {least}") } else { String::new() }
}

fn names() -> String {
    ALL.iter().map(|d| d.name).collect::<Vec<_>>().join(", ")
}

/// A named field with its parameters set. Its surface is at [`Definition::iso`] of [`Named::definition`], which is not 0 for all.
#[derive(Debug, Clone)]
pub struct Named {
    definition: &'static Definition,
    field: GraphField,
}

impl std::fmt::Debug for Definition {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Named {
    /// The field of that name, with its default parameters.
    ///
    /// # Errors
    /// [`NameError::Unknown`].
    pub fn new(name: &str) -> Result<Self, NameError> {
        let definition = ALL.iter().find(|d| d.name == name);
        let definition = definition.ok_or_else(|| NameError::Unknown { name: name.into() })?;
        let parameters: Vec<Expr> =
            definition.parameters.iter().map(|p| Expr::parameter(p.name, p.default)).collect();
        Ok(Self { definition, field: GraphField::new(&(definition.build)(&parameters), definition.sense) })
    }

    /// Sets a parameter.
    ///
    /// # Errors
    /// [`NameError::NoParameter`], [`NameError::Value`].
    pub fn with(mut self, name: &str, value: f64) -> Result<Self, NameError> {
        let field = self.definition.name;
        let place = self.definition.parameters.iter().position(|p| p.name == name);
        let place = place.ok_or_else(|| NameError::NoParameter { field, name: name.into() })?;
        let Parameter { name, least, .. } = self.definition.parameters[place];
        if !(value as f32).is_finite() || value < least {
            return Err(NameError::Value { name, value, least });
        }
        // The name is known, and the value finite.
        let _ = self.field.set(name, value);
        Ok(self)
    }

    /// What is known of the field.
    pub fn definition(&self) -> &'static Definition {
        self.definition
    }
}

impl Field for Named {
    fn sense(&self) -> Sense {
        self.field.sense()
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        self.field.values(points, out)
    }

    fn gradients(&self, points: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        self.field.gradients(points, out)
    }

    fn within(&self, region: [Interval; 3]) -> Within {
        self.field.within(region)
    }

    fn as_graph(&self) -> Option<&GraphField> {
        Some(&self.field)
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        self.field.wgsl()
    }
}
