//! An expression as a [`Field`].

use super::Expr;
use super::eval::{self, Dual, Lanes};
use super::interval::Interval;
use super::lattice::LatticeCode;
use super::lower::Program;
use super::ops::Binary;
use super::same::is_same;
use super::tape::{Code, Op, Tape};
use super::wgsl;
use crate::field::{Field, LatticeValues, NoForm, Planes, Points, Sense, Wgsl, Within};
use std::cell::RefCell;
use std::sync::{Arc, OnceLock};

/// An expression, flattened, with values for its parameters.
#[derive(Debug, Clone)]
pub struct GraphField {
    program: Arc<Program>,
    /// The program's tape, or what is left of it in a box.
    tape: Arc<Tape>,
    /// The tape with registers, once points are asked for: of most boxes only bounds are.
    code: Arc<OnceLock<Code>>,
    /// The tape for lattices of points, if it is faster so.
    lattice: Arc<OnceLock<Option<LatticeCode>>>,
    wgsl: Arc<OnceLock<Written>>,
    parameters: Vec<f64>,
    uniforms: Arc<[f32]>,
    sense: Sense,
}

/// The program's WGSL (values, gradient, intervals; values by planes) and the data that it reads, once asked for.
type Written = ([Arc<str>; 3], Option<Planes>, Arc<[u32]>);

/// Why a parameter could not be set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// No such parameter.
    #[error("there is no parameter `{name}`; {}", list(.known))]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// NaN or infinite.
    #[error("the parameter `{name}` is {value}: give a finite 32-bit number")]
    NotFinite {
        /// The parameter.
        name: String,
        /// What was given.
        value: f64,
    },
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "the field has none".into() } else { format!("there are {}", names.join(", ")) }
}

// Taken out while they are in use: a leaf may evaluate another field within.
thread_local! {
    static LANES: RefCell<Vec<Lanes>> = const { RefCell::new(Vec::new()) };
    static DUALS: RefCell<Vec<Dual>> = const { RefCell::new(Vec::new()) };
}

impl GraphField {
    /// Flattens `expr`; `sense` says which side of iso is inside.
    pub fn new(expr: &Expr, sense: Sense) -> Self {
        let program = Program::new(expr);
        let tape = Arc::new(program.tape.clone());
        let parameters: Vec<f64> = program.parameters.iter().map(|p| p.default).collect();
        Self {
            code: Arc::default(),
            lattice: Arc::default(),
            uniforms: program.uniforms(&parameters).into(),
            wgsl: Arc::default(),
            program: Arc::new(program),
            tape,
            parameters,
            sense,
        }
    }

    /// Sets a parameter. Compiles nothing, on CPU and GPU.
    ///
    /// # Errors
    /// [`ParameterError`].
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), ParameterError> {
        if !(value as f32).is_finite() {
            return Err(ParameterError::NotFinite { name: name.into(), value });
        }
        let parameters = &self.program.parameters;
        let place = parameters.iter().position(|p| &*p.name == name).ok_or_else(|| {
            let known = parameters.iter().map(|p| p.name.to_string()).collect();
            ParameterError::Unknown { name: name.into(), known }
        })?;
        self.parameters[place] = value;
        self.uniforms = self.program.uniforms(&self.parameters).into();
        Ok(())
    }

    /// Names and values of the parameters.
    pub fn parameters(&self) -> impl Iterator<Item = (&str, f64)> {
        self.program.parameters.iter().map(|p| &*p.name).zip(self.parameters.iter().copied())
    }

    /// How many operations each point takes.
    pub fn operations(&self) -> usize {
        self.tape.instructions.len()
    }

    /// Whether any operation may be left out of the field in a box where it is decided.
    pub(crate) fn has_choices(&self) -> bool {
        let is_choice = |op| matches!(op, Op::Select | Op::Binary(Binary::Min | Binary::Max));
        self.tape.instructions.iter().any(|instruction| is_choice(instruction.op))
    }

    fn code(&self) -> &Code {
        self.code.get_or_init(|| Code::new(&self.tape))
    }

    fn lattice_code(&self) -> Option<&LatticeCode> {
        self.lattice.get_or_init(|| LatticeCode::new(&self.tape, self.uniforms.len())).as_ref()
    }

    /// Whether `other` gives the same values and gradients at all points of a box, bit for bit; `false` where that is not
    /// known.
    pub fn is_same(&self, other: &Self, region: [Interval; 3]) -> bool {
        is_same((&self.tape, &self.uniforms), (&other.tape, &other.uniforms), region)
    }
}

/// Measured on scenes with blobs: at some 90 points of a brick emit takes half to two thirds of the time.
pub(super) const POINTS_AS_A_BRICK: usize = 256;

impl LatticeValues for GraphField {
    fn lattice_values(&self, axes: [&[f32]; 3], out: &mut [f32]) -> bool {
        self.lattice_code().is_some_and(|code| code.values(&self.uniforms, axes, out))
    }

    fn points_as_a_brick(&self) -> usize {
        // Of operations alone the lattice takes so few at each point that few points are no less.
        if self.lattice_code().is_some_and(|code| code.has_leaves) { POINTS_AS_A_BRICK } else { 0 }
    }
}

impl Field for GraphField {
    fn sense(&self) -> Sense {
        self.sense
    }

    fn values(&self, points: Points<'_>, out: &mut [f32]) -> Result<(), NoForm> {
        let mut registers = LANES.take();
        eval::values(self.code(), &self.uniforms, points, &mut registers, out);
        LANES.set(registers);
        Ok(())
    }

    fn lattice(&self) -> Option<&dyn LatticeValues> {
        match self.tape.only_leaf() {
            Some(leaf) => leaf.lattice(),
            None => self.lattice_code().map(|_| self as &dyn LatticeValues),
        }
    }

    fn gradients(&self, points: Points<'_>, out: &mut [[f32; 3]]) -> Result<(), NoForm> {
        let mut registers = DUALS.take();
        eval::gradients(self.code(), &self.uniforms, points, &mut registers, out);
        DUALS.set(registers);
        Ok(())
    }

    fn as_graph(&self) -> Option<&GraphField> {
        Some(self)
    }

    fn within(&self, region: [Interval; 3]) -> Within {
        let mut all = Vec::with_capacity(self.tape.instructions.len());
        let range = self.tape.interval(&self.uniforms, region, &mut all);
        let pruned = self.tape.pruned(&self.uniforms, region, &all);
        // What is computed of values that do not matter may be over all numbers.
        let is_finite = |tape: &Tape, all: &mut Vec<Interval>| {
            !range.is_bounded() || tape.interval(&self.uniforms, region, all).is_bounded()
        };
        let field = pruned.filter(|tape| is_finite(tape, &mut all)).map(|tape| {
            let (code, lattice) = (Arc::default(), Arc::default());
            Arc::new(Self { code, lattice, tape: Arc::new(tape), ..self.clone() }) as Arc<dyn Field>
        });
        Within { range, field }
    }

    fn range(&self, region: [Interval; 3]) -> Interval {
        self.tape.interval(&self.uniforms, region, &mut Vec::with_capacity(self.tape.instructions.len()))
    }

    fn wgsl(&self) -> Result<Wgsl, NoForm> {
        let ([value, gradient, interval], planes, data) = self.wgsl.get_or_init(|| {
            let texts = wgsl::write(&self.program);
            let leaves = self.program.tape.leaves.iter().flat_map(|leaf| leaf.data());
            let data: Vec<u32> = leaves.chain(texts.code).collect();
            let required = [texts.value, texts.gradient, texts.interval].map(Arc::from);
            (required, texts.planes, data.into())
        });
        let places = wgsl::buffer_places(&self.program);
        Ok(Wgsl {
            value: value.clone(),
            gradient: Some(gradient.clone()),
            interval: Some(interval.clone()),
            planes: planes.clone(),
            data: data.clone(),
            parameters: places.iter().map(|&i| self.uniforms[i as usize]).collect(),
            counts_loops: false,
        })
    }
}
