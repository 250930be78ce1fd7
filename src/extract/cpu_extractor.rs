//! The CPU path: the twins of every stage, end to end.

use super::cpu::{BRICKS, Clock, Job};
use super::kept::Kept;
use super::{ExtractError, Options, Report, Source, stage_index as at};
use crate::mesh::Mesh;
use crate::stage::cull::bounds::{Culled, cull_field};
use crate::stage::cull::cpu::straddles;

/// Extracts the mesh by the CPU twins. `progress` hears how much of the work is done, from 0 to 1.
///
/// The mesh is the GPU's: same vertices in the same order, positions and normals equal where the GPU
/// rounds as IEEE 754 says.
///
/// # Errors
/// [`ExtractError::Iso`], [`ExtractError::Epsilon`], [`ExtractError::Delta`], [`ExtractError::Budget`], [`ExtractError::TooLarge`],
/// [`ExtractError::TooManyBricks`], [`ExtractError::NoForm`].
pub fn extract_on_cpu(
    source: &Source<'_>,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(Mesh, Report), ExtractError> {
    let mut extractor = CpuExtractor::default();
    let report = extractor.extract(source, options, progress)?;
    Ok((extractor.mesh, report))
}

/// The CPU path with its memory kept from call to call: what an iso value that moves, or a field that changes, is
/// extracted with. From the second call on next to nothing is allocated where the mesh is not larger than before.
///
/// ```
/// use isoforge::{extract::*, field::named::Named, grid::Grid};
/// use glam::Vec3;
/// let (sphere, grid) = (Named::new("sphere")?, Grid::from_bounds([32; 3], Vec3::splat(-1.5), Vec3::splat(1.5))?);
/// let mut extractor = CpuExtractor::default();
/// for iso in [0.8, 0.9, 1.0] {
///     extractor.extract(&Source::Field(&sphere, grid), &Options::new(iso), &|_| {})?;
///     println!("{} triangles", extractor.mesh().triangles.len());
///     assert!(!extractor.mesh().triangles.is_empty());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Default)]
pub struct CpuExtractor {
    kept: Kept,
    mesh: Mesh,
}

impl CpuExtractor {
    /// Extracts as [`extract_on_cpu`] does, in place of the mesh before.
    ///
    /// # Errors
    /// As those of [`extract_on_cpu`]. The mesh is empty then.
    pub fn extract(
        &mut self,
        source: &Source<'_>,
        options: &Options,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Report, ExtractError> {
        let made = self.make(source, options, progress);
        if made.is_err() {
            self.mesh.vertices.clear();
            self.mesh.triangles.clear();
        }
        made
    }

    /// The mesh of the last call.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The mesh of the last call, to keep.
    pub fn into_mesh(self) -> Mesh {
        self.mesh
    }

    fn make(
        &mut self,
        source: &Source<'_>,
        options: &Options,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Report, ExtractError> {
        let mut job = Job::new(source, options)?;
        let mut clock = Clock::start();
        let bricks = u64::from(job.params.slab_bricks);
        // A volume has a table of ranges. The list of active bricks may have all; of a culled field it follows the surface.
        const LISTED: u64 = size_of::<u32>() as u64;
        job.held_bytes = match source {
            Source::Volume(volume) => volume.bytes() + bricks * (8 + LISTED),
            Source::Field(..) if options.cull => 0,
            Source::Field(..) => bricks * LISTED,
        };
        job.budget(BRICKS, 0)?;

        let kept = &mut self.kept;
        kept.clear();
        let (active_bricks, non_finite) = match source {
            Source::Volume(volume) => {
                let mut classified = None;
                let (ranges, odd) = volume.ranges(|values| {
                    let (ranges, active) = job.classify_fresh(values, kept, progress);
                    classified = active;
                    ranges
                });
                let active = if let Some(active) = classified {
                    active
                } else {
                    let straddling = (0..).zip(ranges).filter(|(_, range)| straddles(&job.params, **range));
                    kept.bricks.extend(straddling.map(|(brick, _)| brick));
                    clock.lap(at::CULL);
                    let active = kept.bricks.len();
                    job.classify_in_place(kept, progress)?;
                    active
                };
                (active, *odd)
            }
            Source::Field(field, _) => {
                let culled = match options.cull {
                    true => cull_field(&job.params, *field),
                    false => Culled { active: (0..bricks as u32).collect(), ..Culled::default() },
                };
                job.fields = culled.fields;
                job.held_bytes = culled.active.len() as u64 * LISTED;
                job.budget(BRICKS, 0)?;
                clock.lap(at::CULL);
                job.classify_all(&culled.active, kept, progress)?;
                (culled.active.len(), kept.non_finite)
            }
        };
        clock.lap(at::CLASSIFY);

        let peak_bytes = job.emit_into(kept, &mut self.mesh, &mut clock)?;
        Ok(Report {
            vertices: self.mesh.vertices.len() as u64,
            triangles: self.mesh.triangles.len() as u64,
            bricks,
            active_bricks: active_bricks as u64,
            non_finite,
            open_edges: None,
            slabs: 1,
            peak_bytes,
            scratch_bytes: kept.bytes(),
            seconds: clock.seconds,
        })
    }
}
