//! Sums at the points of a lattice: each component is added to the points that it reaches, in the order of the
//! list. So every point's sum is that of [`super::sum`], bit for bit: what is left out there would add exactly 0.

use super::kernel::{Blobby, InverseSquare, Kernel, Metaball, Profile, SoftObject};
use super::sum::From;
use super::{Blobs, Few, Stored};
use crate::field::LatticeValues;
use crate::graph::field::POINTS_AS_A_BRICK;
use multiversion::multiversion;
use std::cell::RefCell;
use std::ops::Range;

/// Points along x that are done together.
const LANES: usize = 8;

thread_local! {
    static SUMS: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
}

impl LatticeValues for Blobs {
    fn lattice_values(&self, axes: [&[f32]; 3], out: &mut [f32]) -> bool {
        values(self.kernel, self.from(), axes, out)
    }

    fn points_as_a_brick(&self) -> usize {
        POINTS_AS_A_BRICK
    }
}

impl LatticeValues for Few {
    fn lattice_values(&self, axes: [&[f32]; 3], out: &mut [f32]) -> bool {
        values(self.kernel, From::List(&self.components), axes, out)
    }

    fn points_as_a_brick(&self) -> usize {
        POINTS_AS_A_BRICK
    }
}

fn values(kernel: Kernel, from: From<'_>, axes: [&[f32]; 3], out: &mut [f32]) -> bool {
    let [Some(x), Some(y), Some(z)] = axes.map(Axis::new) else { return false };
    SUMS.with_borrow_mut(|sums| sum(kernel, from, &[x, y, z], sums, out));
    true
}

/// Coordinates that grow in equal steps.
struct Axis<'a> {
    at: &'a [f32],
    inverse_step: f32,
    /// Steps by which rounding may put a place off.
    slack: f32,
}

impl<'a> Axis<'a> {
    /// `None` if the steps are not equal: where they are little more than the numbers' last bits.
    fn new(at: &'a [f32]) -> Option<Self> {
        let (&first, &last) = (at.first()?, at.last()?);
        let inverse_step = if at.len() > 1 { (at.len() - 1) as f32 / (last - first) } else { 0.0 };
        let even = (0..at.len()).all(|i| ((at[i] - first) * inverse_step - i as f32).abs() < 1e-3);
        let slack = 4e-3 + 1e-6 * (first.abs() * inverse_step);
        (even && inverse_step >= 0.0 && slack < 0.1).then_some(Self { at, inverse_step, slack })
    }

    /// The points at most `radius` away from `centre`, and perhaps some more.
    #[inline(always)]
    fn near(&self, centre: f32, radius: f32) -> Range<usize> {
        let slack = self.slack + 1e-6 * ((centre.abs() + radius) * self.inverse_step);
        let first = ((centre - radius - self.at[0]) * self.inverse_step - slack).ceil();
        let end = ((centre + radius - self.at[0]) * self.inverse_step + slack).floor() + 1.0;
        // Casts go to the nearest whole number from 0 on.
        first as usize..(end as usize).min(self.at.len())
    }
}

#[multiversion(targets("x86_64+avx2+bmi1+bmi2"))]
fn sum(kernel: Kernel, from: From<'_>, axes: &[Axis<'_>; 3], sums: &mut Vec<f32>, out: &mut [f32]) {
    match kernel {
        Kernel::SoftObject => sum_of(SoftObject, from, axes, sums, out),
        Kernel::Metaball => sum_of(Metaball, from, axes, sums, out),
        Kernel::Blobby { .. } => sum_of(Blobby(kernel.falloff()), from, axes, sums, out),
        Kernel::InverseSquare => sum_of(InverseSquare, from, axes, sums, out),
    }
}

#[inline(always)]
fn sum_of(profile: impl Profile, from: From<'_>, axes: &[Axis<'_>; 3], sums: &mut Vec<f32>, out: &mut [f32]) {
    let [nx, ny, nz] = [axes[0].at.len(), axes[1].at.len(), axes[2].at.len()];
    // Behind each row there is room for lanes that nothing reaches.
    let pitch = nx + LANES;
    sums.clear();
    sums.resize(pitch * ny * nz, 0.0);
    let mut x = vec![f32::INFINITY; pitch];
    x[..nx].copy_from_slice(axes[0].at);
    match from {
        From::List(components) => add_run(profile, components, axes, &x, sums),
        From::Grids(grids, components) => {
            let [low, high] = [
                [axes[0].at[0], axes[1].at[0], axes[2].at[0]],
                [axes[0].at[nx - 1], axes[1].at[ny - 1], axes[2].at[nz - 1]],
            ];
            for grid in grids {
                if let Some(cells) = grid.cells(low, high) {
                    for run in grid.runs(cells) {
                        add_run(profile, &components[run], axes, &x, sums);
                    }
                }
            }
        }
    }
    for (out, sums) in out.chunks_exact_mut(nx).zip(sums.chunks_exact(pitch)) {
        out.copy_from_slice(&sums[..nx]);
    }
}

#[inline(always)]
fn add_run(profile: impl Profile, run: &[Stored], axes: &[Axis<'_>; 3], x: &[f32], sums: &mut [f32]) {
    let (pitch, rows) = (x.len(), axes[1].at.len());
    for &[cx, cy, cz, inverse_square, weight] in run {
        let radius = (1.0 / inverse_square).sqrt();
        let (near_y, near_z) = (axes[1].near(cy, radius), axes[2].near(cz, radius));
        if near_y.is_empty() || near_z.is_empty() {
            continue;
        }
        for start in axes[0].near(cx, radius).step_by(LANES) {
            let mut dx2 = [0.0; LANES];
            for (square, x) in dx2.iter_mut().zip(&x[start..start + LANES]) {
                *square = (x - cx) * (x - cx);
            }
            for z in near_z.clone() {
                let dz = axes[2].at[z] - cz;
                for y in near_y.clone() {
                    let dy = axes[1].at[y] - cy;
                    let first = start + pitch * (y + rows * z);
                    if let Some(sums) = sums.get_mut(first..first + LANES) {
                        for (sum, dx2) in sums.iter_mut().zip(&dx2) {
                            let q = (dx2 + dy * dy + dz * dz) * inverse_square;
                            *sum += weight * profile.value(q);
                        }
                    }
                }
            }
        }
    }
}
