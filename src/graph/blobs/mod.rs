//! Sums of many components of finite support: blobs, metaballs, soft objects, molecules, fluids.
//!
//! [`Blobs`] is one [`Leaf`] of any number of [`Component`]s, which never become operations: a sum at a
//! point takes only those whose support may reach it (`grid`), so the cost follows the components and the
//! surface. [`skeleton`] has blobs around segments, lines and tori, as expressions.

mod bounds;
mod ellipsoids;
mod grid;
mod kernel;
mod lattice;
pub mod skeleton;
mod sum;

pub use crate::components::Component;
pub use ellipsoids::{Ellipsoid, Ellipsoids};
pub use kernel::{BLOBBY, Kernel};

use super::Expr;
use super::interval::Interval;
use super::leaf::{DualSlices, Leaf, LeafWgsl};
use crate::field::{LatticeValues, Points};
use grid::Grid;
use rayon::prelude::*;
use std::sync::Arc;

/// Position, 1 / radius² and weight.
type Stored = [f32; 5];

/// The most components.
pub const MOST: usize = 1 << 28;
/// The largest position, radius and weight, and 1 over the smallest radius.
const LARGEST: f32 = 1e15;
/// 2⁻⁷⁰: smaller weights are taken for 0, since drivers may take their products for 0.
const LEAST_WEIGHT: f32 = f32::from_bits((127 - 70) << 23);
/// Components of a part that is worth a list of its own: more are found faster by the grids.
const FEW: usize = 16;
const WGSL: &str = include_str!("../../../shaders/graph/blobs.wgsl");
/// Words of data before the grids' own, and of each grid.
const HEADER: usize = 3;
const GRID_HEADER: usize = 10;

/// Why components make no field.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BlobsError {
    /// No component.
    #[error("there is no component: a sum of blobs needs one at least")]
    Empty,
    /// More components than 32-bit numbers can address.
    #[error("there are {count} components, more than {MOST}: leave some out, or make several fields")]
    TooMany {
        /// How many.
        count: usize,
    },
    /// A position that is NaN, infinite or too far away.
    #[error(
        "component {index} (from 0) lies at {position:?}: give finite numbers within ±1e15, or other units"
    )]
    Position {
        /// Which component, from 0.
        index: usize,
        /// Where it lies.
        position: [f32; 3],
    },
    /// A radius that is 0, negative, NaN, infinite, too small or too large.
    #[error("component {index} (from 0) has the radius {radius}: give a number from 1e-15 to 1e15")]
    Radius {
        /// Which component, from 0.
        index: usize,
        /// Its radius.
        radius: f32,
    },
    /// A weight that is NaN, infinite or too large.
    #[error(
        "component {index} (from 0) has the weight {weight} (radius {radius}): give a number within ±1e15; for the \
         inverse square also one within ±1e15 times the radius squared"
    )]
    Weight {
        /// Which component, from 0.
        index: usize,
        /// Its weight.
        weight: f32,
        /// Its radius.
        radius: f32,
    },
    /// Factors that are 0, negative, NaN or infinite.
    #[error("component {index} (from 0) is scaled by {scale:?}: give finite numbers above 0")]
    Scale {
        /// Which component, from 0.
        index: usize,
        /// Its factors.
        scale: [f32; 3],
    },
    /// A quaternion that is NaN, infinite or of no length.
    #[error("component {index} (from 0) is turned by the quaternion {rotation:?}: give one of length 1")]
    Rotation {
        /// Which component, from 0.
        index: usize,
        /// Its quaternion, x, y, z, w.
        rotation: [f32; 4],
    },
    /// A cut-off that leaves nothing, or all.
    #[error(
        "the blobby is to be cut off where it is {least} of its peak: give a number from 1e-30 to below 1"
    )]
    CutOff {
        /// What was asked for.
        least: f32,
    },
}

/// A sum of components. Above iso is inside.
#[derive(Debug)]
pub struct Blobs {
    kernel: Kernel,
    /// In the order of the sums.
    components: Vec<Stored>,
    grids: Vec<Grid>,
    /// What rounding may put a sum of all off by, as a part of the magnitudes.
    slack: f32,
}

/// What is left of [`Blobs`] in a box.
#[derive(Debug)]
struct Few {
    kernel: Kernel,
    components: Vec<Stored>,
}

impl Blobs {
    /// The sum of `components`, each with its own radius (how far it reaches) and weight; negative ones carve.
    /// A component adds exactly 0 from its radius on. Takes time and memory in proportion to the components.
    ///
    /// # Errors
    /// [`BlobsError`] names the first component that cannot be used.
    pub fn new(kernel: Kernel, components: Vec<Component>) -> Result<Arc<Blobs>, BlobsError> {
        check(kernel, components.len())?;
        let stored: Result<Vec<Stored>, BlobsError> = match components
            .par_iter()
            .enumerate()
            .find_map_first(|(index, component)| store(kernel, index, component).err())
        {
            Some(error) => Err(error),
            None => {
                Ok(components.par_iter().filter_map(|component| store(kernel, 0, component).ok()).collect())
            }
        };
        drop(components);
        let (_, components, grids) = grid::arrange(&stored?, kernel.value(0.0));
        let slack = bounds::slack(components.len());
        Ok(Arc::new(Self { kernel, components, grids, slack }))
    }

    /// The sum of points with radii, each of which reaches `support` times its radius ([`Kernel::support_for`]). The
    /// inverse square is weighted so that a lone point has the value `iso` at its radius.
    ///
    /// # Errors
    /// As [`Blobs::new`].
    pub fn of_points(
        kernel: Kernel,
        mut points: Vec<Component>,
        iso: f32,
        support: f32,
    ) -> Result<Arc<Blobs>, BlobsError> {
        for point in &mut points {
            if kernel == Kernel::InverseSquare {
                point.weight *= iso * point.radius * point.radius;
            }
            point.radius *= support;
        }
        Self::new(kernel, points)
    }

    /// As an expression.
    #[must_use]
    pub fn expr(self: &Arc<Self>) -> Expr {
        Expr::leaf(self.clone())
    }

    /// How many components there are.
    pub fn count(&self) -> usize {
        self.components.len()
    }

    /// The lowest and the highest corner of what the components reach.
    pub fn support(&self) -> [[f32; 3]; 2] {
        let none = || [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        let join = |[low, high]: [[f32; 3]; 2], [l, h]: [[f32; 3]; 2]| {
            [[0, 1, 2].map(|k| low[k].min(l[k])), [0, 1, 2].map(|k| high[k].max(h[k]))]
        };
        let one = |&[x, y, z, inverse_square, _]: &Stored| {
            let radius = (1.0 / inverse_square).sqrt();
            [[x - radius, y - radius, z - radius], [x + radius, y + radius, z + radius]]
        };
        self.components.par_iter().map(one).reduce(none, join)
    }
}

fn check(kernel: Kernel, count: usize) -> Result<(), BlobsError> {
    match kernel {
        Kernel::Blobby { least } if !kernel.is_sound() => Err(BlobsError::CutOff { least }),
        _ if count == 0 => Err(BlobsError::Empty),
        _ if count > MOST => Err(BlobsError::TooMany { count }),
        _ => Ok(()),
    }
}

fn store(kernel: Kernel, index: usize, component: &Component) -> Result<Stored, BlobsError> {
    let Component { position, radius, weight } = *component;
    if !position.iter().all(|c| c.abs() <= LARGEST) {
        return Err(BlobsError::Position { index, position });
    }
    if !(1.0 / LARGEST..=LARGEST).contains(&radius) {
        return Err(BlobsError::Radius { index, radius });
    }
    let inverse_square = (1.0 / (f64::from(radius) * f64::from(radius))) as f32;
    let scaled = kernel.scaled_weight(weight, inverse_square);
    if !(weight.abs() <= LARGEST && scaled.abs() <= LARGEST) {
        return Err(BlobsError::Weight { index, weight, radius });
    }
    let [x, y, z] = position;
    Ok([x, y, z, inverse_square, if scaled.abs() < LEAST_WEIGHT { 0.0 } else { scaled }])
}

impl Leaf for Blobs {
    fn values(&self, at: Points<'_>, out: &mut [f32]) {
        self.sum_values(at, out);
    }

    fn lattice(&self) -> Option<&dyn LatticeValues> {
        Some(self)
    }

    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        self.sum_gradients(at, out);
    }

    fn interval(&self, at: [Interval; 3]) -> Interval {
        self.bounds(at)
    }

    /// A list of the components that reach the box, where they are few: many are found faster by the grids.
    fn within(&self, at: [Interval; 3]) -> Option<Arc<dyn Leaf>> {
        let [low, high] = bounds::corners(at)?;
        let mut components = Vec::new();
        for grid in &self.grids {
            let Some(cells) = grid.cells(low, high) else { continue };
            for run in grid.runs(cells) {
                for component in &self.components[run] {
                    if sum::nearest(component, low, high, 1.0) < 1.0 {
                        if components.len() == FEW {
                            return None;
                        }
                        components.push(*component);
                    }
                }
            }
        }
        Few::of(self.kernel, components, self.components.len())
    }

    fn is_same(&self, other: &dyn Leaf, at: [Interval; 3]) -> bool {
        sum::is_same((self.kernel, self.from()), other, at)
    }

    fn wgsl(&self, name: &str, first: usize) -> LeafWgsl {
        wgsl(self.kernel, false, name, first)
    }

    fn data(&self) -> Vec<u32> {
        Data::of(&self.grids, self.slack, &self.components).words()
    }

    fn data_bytes(&self) -> u64 {
        Data::of(&self.grids, self.slack, &self.components).bytes()
    }
}

/// The shader of balls, or of turned ellipsoids.
fn wgsl(kernel: Kernel, turned: bool, name: &str, first: usize) -> LeafWgsl {
    let head = format!(
        "const LEAF_FIRST = {first}u;\nconst LEAF_KERNEL = {}u;\nconst LEAF_FALLOFF = {:?}f;\n\
         const LEAF_TURNED = {turned};\nconst LEAF_WORDS = {}u;\n",
        kernel.number(),
        kernel.falloff(),
        if turned { 13 } else { 5 }
    );
    LeafWgsl::from_template(&(head + WGSL), name)
}

/// What the shader reads.
struct Data<'a> {
    grids: &'a [Grid],
    slack: f32,
    components: &'a [u32],
}

impl<'a> Data<'a> {
    fn of<C: bytemuck::Pod>(grids: &'a [Grid], slack: f32, components: &'a [C]) -> Self {
        Self { grids, slack, components: bytemuck::cast_slice(components) }
    }

    fn words(&self) -> Vec<u32> {
        let mut data = Vec::with_capacity(self.bytes() as usize / 4);
        let mut place = HEADER + GRID_HEADER * self.grids.len();
        data.extend([self.grids.len() as u32, self.components_at() as u32, self.slack.to_bits()]);
        for grid in self.grids {
            data.extend(grid.origin.map(f32::to_bits));
            data.push(grid.inverse.to_bits());
            data.extend(grid.dims);
            data.extend([grid.reach.to_bits(), place as u32, (place + grid.starts.len()) as u32]);
            place += grid.starts.len() + 2 * grid.peaks.len();
        }
        for grid in self.grids {
            data.extend_from_slice(&grid.starts);
            data.extend_from_slice(bytemuck::cast_slice(&grid.peaks));
        }
        data.extend_from_slice(self.components);
        data
    }

    fn bytes(&self) -> u64 {
        4 * (self.components_at() + self.components.len()) as u64
    }

    /// The word at which the components begin.
    fn components_at(&self) -> usize {
        let own = |grid: &Grid| GRID_HEADER + grid.starts.len() + 2 * grid.peaks.len();
        HEADER + self.grids.iter().map(own).sum::<usize>()
    }
}

impl Few {
    fn of(kernel: Kernel, components: Vec<Stored>, all: usize) -> Option<Arc<dyn Leaf>> {
        (components.len() < all).then(|| Arc::new(Self { kernel, components }) as Arc<dyn Leaf>)
    }
}

impl Leaf for Few {
    fn values(&self, at: Points<'_>, out: &mut [f32]) {
        self.sum_values(at, out);
    }

    fn lattice(&self) -> Option<&dyn LatticeValues> {
        Some(self)
    }

    fn gradients(&self, at: Points<'_>, out: DualSlices<'_>) {
        self.sum_gradients(at, out);
    }

    fn interval(&self, at: [Interval; 3]) -> Interval {
        self.bounds(at)
    }

    fn within(&self, at: [Interval; 3]) -> Option<Arc<dyn Leaf>> {
        let [low, high] = bounds::corners(at)?;
        let near = self.components.iter().filter(|component| sum::nearest(component, low, high, 1.0) < 1.0);
        Few::of(self.kernel, near.copied().collect(), self.components.len())
    }

    fn is_same(&self, other: &dyn Leaf, at: [Interval; 3]) -> bool {
        sum::is_same((self.kernel, self.from()), other, at)
    }

    /// Only whole fields are sent to the GPU.
    fn wgsl(&self, name: &str, _first: usize) -> LeafWgsl {
        let none = |head: String, zero: &str| format!("fn {head} {{\n    return {zero};\n}}\n");
        LeafWgsl {
            value: none(format!("{name}(p: vec3<f32>) -> f32"), "0.0"),
            gradient: none(format!("{name}_gradient(p: vec3<f32>) -> vec4<f32>"), "vec4<f32>(0.0)"),
            interval: none(
                format!("{name}_interval(x: vec2<f32>, y: vec2<f32>, z: vec2<f32>) -> vec2<f32>"),
                "ALL",
            ),
        }
    }
}
