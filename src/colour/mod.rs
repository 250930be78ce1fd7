//! Colours on a mesh, by the values of a second field or volume at its vertices.
//!
//! ```
//! use glam::Vec3;
//! use isoforge::colour::{Colouring, Map, sample, usual_range};
//! use isoforge::{extract::*, field::named::Named, grid::Grid, mesh::write};
//!
//! let (torus, height) = (Named::new("torus")?, Named::new("schwarz_p")?);
//! let grid = Grid::from_bounds([32; 3], Vec3::splat(-1.5), Vec3::splat(1.5))?;
//! let (mesh, _) = extract_on_cpu(&Source::Field(&torus, grid), &Options::new(0.0), &|_| {})?;
//! let samples = sample(&height, None, &mesh)?;
//! let range = usual_range(&samples.values).unwrap_or([0.0, 1.0]);
//! let coloured = Colouring::new(Map::Viridis, range).colour(samples.values);
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("torus.ply");
//! write::write_with(&mesh, &write::Extra { colours: Some(&coloured), ..Default::default() }, &path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod map;
mod sample;

pub use map::{Map, UnknownMap};
pub use sample::{ColourError, Samples, sample};

/// The colour of vertices that have no value (sRGB): grey.
pub const NO_VALUE: [u8; 3] = [128, 128, 128];

/// The parts of the values that the [`usual_range`] leaves out at either end.
const TAIL: f64 = 0.02;

/// A value and a colour for each vertex of a mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Coloured {
    /// In the unit of the source; NaN or infinite where it has none.
    pub values: Vec<f32>,
    /// sRGB.
    pub colours: Vec<[u8; 3]>,
}

/// Which colour stands for which value.
#[derive(Debug, Clone, PartialEq)]
pub struct Colouring {
    range: [f32; 2],
    table: Vec<[u8; 3]>,
}

impl Colouring {
    /// The lowest colour of `map` is for the first value of `range` and what is below, the highest for the second and above.
    /// Where both are equal, that value has the middle colour.
    pub fn new(map: Map, range: [f32; 2]) -> Self {
        Self { range, table: map.table() }
    }

    /// The values with their colours; what is not finite has [`NO_VALUE`].
    pub fn colour(&self, values: Vec<f32>) -> Coloured {
        let [low, high] = self.range.map(f64::from);
        let last = self.table.len() - 1;
        let colour = |value: &f32| {
            let value = f64::from(*value);
            if !value.is_finite() {
                return NO_VALUE;
            }
            // −0 and 0 are one value.
            let part = if low != high {
                (value - low) / (high - low)
            } else if value == low {
                0.5
            } else {
                f64::from(u8::from(value > low))
            };
            self.table[(part.clamp(0.0, 1.0) * last as f64).round() as usize]
        };
        Coloured { colours: values.iter().map(colour).collect(), values }
    }
}

/// From the 2nd to the 98th percentile of the finite values, so that a few far ones do not take all the colours; from the
/// lowest to the highest where these two are the same. `None` without a finite value.
pub fn usual_range(values: &[f32]) -> Option<[f32; 2]> {
    let mut values: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    values.sort_unstable_by(f32::total_cmp);
    let last = values.len().checked_sub(1)?;
    let tail = (last as f64 * TAIL).round() as usize;
    let range = [values[tail], values[last - tail]];
    Some(if range[0] < range[1] { range } else { [values[0], values[last]] })
}

/// An sRGB byte in linear light.
pub(crate) fn linear(byte: u8) -> f32 {
    let c = f64::from(byte) / 255.0;
    let linear = if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    linear as f32
}
