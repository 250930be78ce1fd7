//! The fields with a name: norm balls, torus, gyroid. Each is one entry of [`ALL`]: its formula, its
//! parameters, and the expression that both backends evaluate.

use super::{Field, NoForm, Points, Sense, Wgsl, Within};
use crate::graph::interval::Interval;
use crate::graph::{Expr, GraphField, x, y, z};

/// A parameter of a named field.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Its value unless given.
    pub default: f64,
    /// The smallest value it may have.
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
    /// Half the edge of a cube around the origin that shows it.
    pub half_edge: f32,
    /// The field, given its parameters.
    build: fn(&[Expr]) -> Expr,
}

fn distance_square() -> Expr {
    (x().square() + y().square()) + z().square()
}

/// Every named field.
pub static ALL: &[Definition] = &[
    Definition {
        name: "sphere",
        formula: "sqrt(x² + y² + z²); iso is the radius",
        parameters: &[],
        iso: 1.0,
        half_edge: 1.5,
        build: |_| distance_square().sqrt(),
    },
    Definition {
        name: "octahedron",
        formula: "|x| + |y| + |z|; iso is the distance of the corners",
        parameters: &[],
        iso: 1.0,
        half_edge: 1.5,
        build: |_| (x().abs() + y().abs()) + z().abs(),
    },
    Definition {
        name: "cube",
        formula: "max(|x|, |y|, |z|); iso is half the edge",
        parameters: &[],
        iso: 1.0,
        half_edge: 1.5,
        build: |_| x().abs().max(y().abs()).max(z().abs()),
    },
    Definition {
        name: "torus",
        formula: "(x² + y² + z² + R² − r²)² − 4R²(x² + y²), axis z; the surface is at iso 0",
        parameters: &[
            Parameter {
                name: "R",
                meaning: "major radius",
                default: std::f64::consts::FRAC_1_SQRT_2,
                least: 0.0,
            },
            Parameter {
                name: "r",
                meaning: "minor radius",
                default: std::f64::consts::FRAC_1_SQRT_2 / 2.0,
                least: 0.0,
            },
        ],
        iso: 0.0,
        half_edge: 1.5,
        build: |p| {
            // The uniforms R² − r² and 4R² round to exactly 0.375 and 2 for the defaults.
            let flat = x().square() + y().square();
            let k = (&flat + z().square()) + (p[0].square() - p[1].square());
            k.square() - flat * (p[0].square() * 4.0)
        },
    },
    Definition {
        name: "gyroid",
        formula: "sin X cos Y + sin Y cos Z + sin Z cos X, X = 2πx/period",
        parameters: &[Parameter {
            name: "period",
            meaning: "length of one repeat",
            default: 1.0,
            least: 1e-6,
        }],
        iso: 0.0,
        half_edge: 1.0,
        build: |p| {
            let [x, y, z] = [x(), y(), z()].map(|c| c * (1.0 / &p[0]));
            (x.sin_turns() * y.cos_turns() + y.sin_turns() * z.cos_turns()) + z.sin_turns() * x.cos_turns()
        },
    },
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
    #[error("the parameter `{name}` is {value}; it takes a finite number of at least {least}")]
    Value {
        /// The parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// The smallest value it may have.
        least: f64,
    },
}

fn names() -> String {
    ALL.iter().map(|d| d.name).collect::<Vec<_>>().join(", ")
}

/// A named field with its parameters set.
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
        Ok(Self { definition, field: GraphField::new(&(definition.build)(&parameters), Sense::Below) })
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
        if !value.is_finite() || value < least {
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

    fn gradients(&self, points: Points<'_>, delta: f32, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        self.field.gradients(points, delta, out)
    }

    fn within(&self, region: [Interval; 3]) -> Within {
        self.field.within(region)
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        self.field.wgsl()
    }
}
