//! The fields with a name: norm balls, torus, gyroid. Each is one entry of [`ALL`]: its formula, its
//! parameters, its WGSL and the same arithmetic in Rust, side by side and in the same order, so that
//! both give the same bits where the GPU does not contract.

use super::functions::{cos_turns, sin_turns};
use super::{Field, NoForm, Points, Sense, Wgsl};
use multiversion::multiversion;

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

type Value = fn(&[f32; 4], Points<'_>, &mut [f32]);
type Gradient = fn(&[f32; 4], Points<'_>, &mut [[f32; 3]]);

/// An evaluator over slices of points, compiled for several instruction sets and chosen at run time.
/// None of them fuses a product and a sum: all give the same bits.
macro_rules! over_points {
    ($out:ty, |$c:ident, $points:ident, $slice:ident| $body:expr) => {{
        #[multiversion(targets("x86_64+avx2"))]
        fn evaluate($c: &[f32; 4], $points: Points<'_>, $slice: &mut [$out]) {
            $body;
        }
        evaluate
    }};
}

/// What is known of a field by its name.
pub struct Definition {
    /// The name.
    pub name: &'static str,
    /// One line of formula.
    pub formula: &'static str,
    /// Its parameters, at most four.
    pub parameters: &'static [Parameter],
    /// An iso value that shows something.
    pub iso: f32,
    /// Half the edge of a cube around the origin that shows it.
    pub half_edge: f32,
    /// From the parameters to the constants that both evaluators read.
    constants: fn(&[f64]) -> [f32; 4],
    value: Value,
    gradient: Gradient,
    wgsl: &'static str,
}

#[inline(always)]
fn norm(x: f32, y: f32, z: f32) -> f32 {
    ((x * x + y * y) + z * z).sqrt()
}

#[inline(always)]
fn sign(v: f32) -> f32 {
    if v > 0.0 {
        1.0
    } else if v < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Every named field.
pub static ALL: &[Definition] = &[
    Definition {
        name: "sphere",
        formula: "sqrt(x² + y² + z²); iso is the radius",
        parameters: &[],
        iso: 1.0,
        half_edge: 1.5,
        constants: |_| [0.0; 4],
        value: over_points!(f32, |_c, points, out| points.map(out, norm)),
        gradient: over_points!([f32; 3], |_c, points, out| points.map(out, |x, y, z| [x, y, z])),
        wgsl: "
            fn density(p: vec3<f32>) -> f32 { return sqrt((p.x * p.x + p.y * p.y) + p.z * p.z); }
            fn density_gradient(p: vec3<f32>) -> vec3<f32> { return p; }",
    },
    Definition {
        name: "octahedron",
        formula: "|x| + |y| + |z|; iso is the distance of the corners",
        parameters: &[],
        iso: 1.0,
        half_edge: 1.5,
        constants: |_| [0.0; 4],
        value: over_points!(f32, |_c, points, out| points.map(out, |x, y, z| (x.abs() + y.abs()) + z.abs())),
        gradient: over_points!([f32; 3], |_c, points, out| points.map(out, |x, y, z| [
            sign(x),
            sign(y),
            sign(z)
        ])),
        wgsl: "
            fn density(p: vec3<f32>) -> f32 { return (abs(p.x) + abs(p.y)) + abs(p.z); }
            fn density_gradient(p: vec3<f32>) -> vec3<f32> { return sign(p); }",
    },
    Definition {
        name: "cube",
        formula: "max(|x|, |y|, |z|); iso is half the edge",
        parameters: &[],
        iso: 1.0,
        half_edge: 1.5,
        constants: |_| [0.0; 4],
        value: over_points!(f32, |_c, points, out| points
            .map(out, |x, y, z| x.abs().max(y.abs()).max(z.abs()))),
        gradient: over_points!([f32; 3], |_c, points, out| {
            points.map(out, |x, y, z| {
                let (a, b, c) = (x.abs(), y.abs(), z.abs());
                if a >= b && a >= c {
                    [sign(x), 0.0, 0.0]
                } else if b >= c {
                    [0.0, sign(y), 0.0]
                } else {
                    [0.0, 0.0, sign(z)]
                }
            });
        }),
        wgsl: "
            fn density(p: vec3<f32>) -> f32 { return max(max(abs(p.x), abs(p.y)), abs(p.z)); }
            fn density_gradient(p: vec3<f32>) -> vec3<f32> {
                let a = abs(p);
                if a.x >= a.y && a.x >= a.z { return vec3<f32>(sign(p.x), 0.0, 0.0); }
                if a.y >= a.z { return vec3<f32>(0.0, sign(p.y), 0.0); }
                return vec3<f32>(0.0, 0.0, sign(p.z));
            }",
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
        // R² − r² and 4R²; the defaults round to exactly 0.375 and 2.
        constants: |p| [(p[0] * p[0] - p[1] * p[1]) as f32, (4.0 * p[0] * p[0]) as f32, 0.0, 0.0],
        value: over_points!(f32, |c, points, out| {
            points.map(out, |x, y, z| {
                let flat = x * x + y * y;
                let k = (flat + z * z) + c[0];
                k * k - c[1] * flat
            });
        }),
        gradient: over_points!([f32; 3], |c, points, out| {
            points.map(out, |x, y, z| {
                let k = 4.0 * (((x * x + y * y) + z * z) + c[0]);
                let in_plane = k - 2.0 * c[1];
                [in_plane * x, in_plane * y, k * z]
            });
        }),
        wgsl: "
            fn density(p: vec3<f32>) -> f32 {
                let c = field_parameters[0];
                let flat_square = p.x * p.x + p.y * p.y;
                let k = (flat_square + p.z * p.z) + c.x;
                return k * k - c.y * flat_square;
            }
            fn density_gradient(p: vec3<f32>) -> vec3<f32> {
                let c = field_parameters[0];
                let k = 4.0 * (((p.x * p.x + p.y * p.y) + p.z * p.z) + c.x);
                let in_plane = k - 2.0 * c.y;
                return vec3<f32>(in_plane * p.x, in_plane * p.y, k * p.z);
            }",
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
        constants: |p| [(1.0 / p[0]) as f32, 0.0, 0.0, 0.0],
        value: over_points!(f32, |c, points, out| {
            points.map(out, |x, y, z| {
                let (x, y, z) = (x * c[0], y * c[0], z * c[0]);
                (sin_turns(x) * cos_turns(y) + sin_turns(y) * cos_turns(z)) + sin_turns(z) * cos_turns(x)
            });
        }),
        gradient: over_points!([f32; 3], |c, points, out| {
            points.map(out, |x, y, z| {
                let (x, y, z) = (x * c[0], y * c[0], z * c[0]);
                let (sx, sy, sz) = (sin_turns(x), sin_turns(y), sin_turns(z));
                let (cx, cy, cz) = (cos_turns(x), cos_turns(y), cos_turns(z));
                [cx * cy - sz * sx, cy * cz - sx * sy, cz * cx - sy * sz]
            });
        }),
        wgsl: "
            fn density(p: vec3<f32>) -> f32 {
                let u = p * field_parameters[0].x;
                return (sin_turns(u.x) * cos_turns(u.y) + sin_turns(u.y) * cos_turns(u.z))
                    + sin_turns(u.z) * cos_turns(u.x);
            }
            fn density_gradient(p: vec3<f32>) -> vec3<f32> {
                let u = p * field_parameters[0].x;
                let s = vec3<f32>(sin_turns(u.x), sin_turns(u.y), sin_turns(u.z));
                let c = vec3<f32>(cos_turns(u.x), cos_turns(u.y), cos_turns(u.z));
                return vec3<f32>(c.x * c.y - s.z * s.x, c.y * c.z - s.x * s.y, c.z * c.x - s.y * s.z);
            }",
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
#[derive(Clone)]
pub struct Named {
    definition: &'static Definition,
    constants: [f32; 4],
    values: Vec<f64>,
}

impl std::fmt::Debug for Named {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", self.definition.name, self.values)
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
        let values: Vec<f64> = definition.parameters.iter().map(|p| p.default).collect();
        Ok(Self { definition, constants: (definition.constants)(&values), values })
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
        self.values[place] = value;
        self.constants = (self.definition.constants)(&self.values);
        Ok(self)
    }

    /// What is known of the field.
    pub fn definition(&self) -> &'static Definition {
        self.definition
    }
}

impl Field for Named {
    fn sense(&self) -> Sense {
        Sense::Below
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        (self.definition.value)(&self.constants, points, out);
        Ok(())
    }

    fn gradients(&self, points: Points<'_>, _delta: f32, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        (self.definition.gradient)(&self.constants, points, out);
        Ok(())
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        Ok(Wgsl {
            source: self.definition.wgsl.into(),
            has_gradient: true,
            parameters: self.constants.to_vec(),
            counts_loops: false,
        })
    }
}
