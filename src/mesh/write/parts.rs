//! A mesh that is written while it is made, and never whole in memory: to PLY or STL.
//!
//! How many vertices there are stands before the first of them, and in STL a triangle holds its corners, which may come later.
//! So vertices and triangles go to two files without a name, and from these to the file asked for: the bytes are those that
//! [`write`](super::write()) makes of the whole mesh.

use super::{Counted, Vertex, WriteError, ending, ply, stl, vertices_le};
use crate::atomic::{self, TargetError};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, Copy, PartialEq)]
enum Format {
    Ply,
    Stl,
}

/// Bytes that are on their way to a file or from one.
const BUFFER: usize = 1 << 20;

/// A window of vertices leaves at most this part of it, those that are done with, in memory.
const LEFT: u64 = 4;

/// The parts of a mesh.
pub(crate) struct Parts {
    path: PathBuf,
    format: Format,
    vertices: Sink,
    triangles: Sink,
    runs: Vec<Run>,
    /// Vertices up to the last that is there or that a triangle names.
    named: u64,
    /// The most vertices that a run's triangles want in memory when the file is written, and the most triangles of a run.
    window: u64,
    run: u64,
}

/// Triangles that were added together.
#[derive(Debug, Clone, Copy)]
struct Run {
    triangles: usize,
    /// No triangle of this run or a later one has a vertex with a lower number.
    first_vertex: u32,
}

/// Turns the normals of vertices that no triangle will add to any more into what they are to be, and adds to the normals of
/// some the others' before.
pub(crate) trait Normals {
    /// Adds to vertices what the triangles' other corners give them.
    fn add(&self, vertices: &mut [Vertex], triangles: &[[u32; 3]]);
    /// Makes normals of the sums.
    fn finish(&self, vertices: &mut [Vertex]);
}

struct Sink {
    out: BufWriter<File>,
    count: u64,
}

impl Sink {
    fn new(path: &Path) -> Result<Self, TargetError> {
        Ok(Self { out: BufWriter::with_capacity(BUFFER, atomic::scratch(path)?), count: 0 })
    }

    fn add(&mut self, bytes: &[u8], count: usize) -> io::Result<()> {
        self.count += count as u64;
        self.out.write_all(bytes)
    }

    fn read(self) -> io::Result<BufReader<File>> {
        let mut file = self.out.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.rewind()?;
        Ok(BufReader::with_capacity(BUFFER, file))
    }
}

impl Parts {
    /// For a file, which is made when the mesh is finished.
    ///
    /// # Errors
    /// [`WriteError::NotInParts`], [`WriteError::Target`].
    pub(crate) fn new(path: &Path) -> Result<Self, WriteError> {
        let format = match ending(path) {
            Some("ply") => Format::Ply,
            Some("stl") => Format::Stl,
            _ => return Err(WriteError::NotInParts { path: path.into() }),
        };
        let (vertices, triangles) = (Sink::new(path)?, Sink::new(path)?);
        Ok(Self {
            path: path.into(),
            format,
            vertices,
            triangles,
            runs: Vec::new(),
            named: 0,
            window: 0,
            run: 0,
        })
    }

    /// Vertices so far.
    pub(crate) fn vertices(&self) -> u64 {
        self.vertices.count
    }

    /// Triangles so far.
    pub(crate) fn triangles(&self) -> u64 {
        self.triangles.count
    }

    /// The most bytes that [`Parts::finish`] holds.
    pub(crate) fn bytes_to_finish(&self, with_normals: bool) -> u64 {
        let window = self.window + self.window / LEFT;
        let held = match (self.format, with_normals) {
            (Format::Ply, false) => 12 * self.run,
            // A run's triangles by numbers in the window, too.
            (Format::Ply, true) => 24 * window + 24 * self.run,
            (Format::Stl, _) => 24 * window + 12 * self.run,
        };
        // Two files are read, one is written.
        held + 3 * BUFFER as u64
    }

    /// Adds the next vertices and triangles. The triangles name vertices by their numbers in the whole mesh: these ones,
    /// and later ones.
    ///
    /// # Errors
    /// [`WriteError::Target`].
    pub(crate) fn add(&mut self, vertices: &[Vertex], triangles: &[[u32; 3]]) -> Result<(), WriteError> {
        let first_vertex = self.vertices.count as u32;
        self.runs.push(Run { triangles: triangles.len(), first_vertex });
        let last = triangles.as_flattened().iter().max().map_or(0, |&v| u64::from(v) + 1);
        self.named = self.named.max(last).max(self.vertices.count + vertices.len() as u64);
        self.window = self.window.max(self.named - self.vertices.count);
        self.run = self.run.max(triangles.len() as u64);
        self.vertices
            .add(bytemuck::cast_slice(vertices), vertices.len())
            .and_then(|()| self.triangles.add(bytemuck::cast_slice(triangles), triangles.len()))
            .map_err(|e| atomic::failed(&self.path, e).into())
    }

    /// Writes the file; returns its size in bytes. With `normals` they are completed on the way, which STL has no use for.
    ///
    /// # Errors
    /// [`WriteError::Target`], [`WriteError::TooLarge`].
    pub(crate) fn finish(
        self,
        normals: Option<&dyn Normals>,
        progress: &dyn Fn(f64),
    ) -> Result<u64, WriteError> {
        let Self { path, format, vertices, triangles, runs, window, .. } = self;
        let counts = [vertices.count, triangles.count];
        if format == Format::Stl {
            stl::fits(counts[1]).map_err(|what| WriteError::TooLarge { path: path.clone(), what })?;
        }
        let failed = |e| atomic::failed(&path, e);
        let mut source = Reading {
            vertices: vertices.read().map_err(failed)?,
            triangles: triangles.read().map_err(failed)?,
            runs,
            most: usize::try_from(window + window / LEFT).unwrap_or(usize::MAX),
            left: counts[0],
            progress,
        };
        let bytes = atomic::write(&path, |file| {
            let mut out = Counted { inner: file, bytes: 0 };
            match format {
                Format::Ply => source.ply(counts, normals, &mut out)?,
                Format::Stl => source.stl(counts, &mut out)?,
            }
            Ok(out.bytes)
        })?;
        Ok(bytes)
    }
}

/// What was gathered, read again.
struct Reading<'a> {
    vertices: BufReader<File>,
    triangles: BufReader<File>,
    runs: Vec<Run>,
    /// Vertices that the window has room for.
    most: usize,
    /// Vertices not yet read.
    left: u64,
    progress: &'a dyn Fn(f64),
}

impl Reading<'_> {
    fn ply(
        &mut self,
        [vertices, triangles]: [u64; 2],
        normals: Option<&dyn Normals>,
        out: &mut impl Write,
    ) -> io::Result<()> {
        ply::header(out, [vertices, triangles], "")?;
        match normals {
            None => {
                let mut piece = Vec::new();
                while self.left > 0 {
                    piece.clear();
                    self.next_vertices(&mut piece, BUFFER / size_of::<Vertex>())?;
                    vertices_le(out, &piece)?;
                }
            }
            Some(normals) => {
                self.each_run(|first, window, triangles, done| {
                    let local: Vec<_> = triangles.iter().map(|corners| corners.map(|v| v - first)).collect();
                    normals.add(window, &local);
                    normals.finish(&mut window[..done]);
                    vertices_le(out, &window[..done])
                })?;
                self.triangles.rewind()?;
            }
        }
        let runs = std::mem::take(&mut self.runs);
        for (i, run) in runs.iter().enumerate() {
            ply::faces(out, &self.next_triangles(run.triangles)?)?;
            self.tell(0.5 + 0.5 * (i as f64 / runs.len() as f64));
        }
        Ok(())
    }

    fn stl(&mut self, [_, triangles]: [u64; 2], out: &mut impl Write) -> io::Result<()> {
        stl::header(out, triangles as u32)?;
        self.each_run(|first, window, triangles, _| stl::facets(out, triangles, first, window))
    }

    /// Hands out the triangles of each run, with a window of vertices that holds theirs: the first vertex' number, the
    /// vertices, the triangles, and how many of the vertices no later run has.
    fn each_run(
        &mut self,
        mut work: impl FnMut(u32, &mut [Vertex], &[[u32; 3]], usize) -> io::Result<()>,
    ) -> io::Result<()> {
        // Those before `start` are done. They stay until they are a part of the rest, so that this is not moved at every run.
        let (mut window, mut start, mut first) = (Vec::with_capacity(self.most), 0, 0u32);
        for i in 0..self.runs.len() {
            let triangles = self.next_triangles(self.runs[i].triangles)?;
            let end_of_run = self.runs.get(i + 1).map(|next| next.first_vertex);
            // Vertices that no triangle has are handed out, too.
            let last = triangles.as_flattened().iter().max().map_or(0, |&v| u64::from(v) + 1);
            let last = last.max(end_of_run.map_or(u64::MAX, u64::from));
            let wanted = last.saturating_sub(u64::from(first) + (window.len() - start) as u64).min(self.left);
            self.next_vertices(&mut window, wanted as usize)?;
            let done = end_of_run.map_or(window.len() - start, |end| (end - first) as usize);
            work(first, &mut window[start..], &triangles, done)?;
            start += done;
            if start > (window.len() - start) / LEFT as usize {
                window.drain(..start);
                start = 0;
            }
            first += done as u32;
            self.tell(0.5 * (i as f64 / self.runs.len() as f64));
        }
        Ok(())
    }

    /// Reads so many vertices, or all that are left, behind those in `to`.
    fn next_vertices(&mut self, to: &mut Vec<Vertex>, count: usize) -> io::Result<()> {
        let (start, count) = (to.len(), count.min(usize::try_from(self.left).unwrap_or(usize::MAX)));
        to.resize(start + count, Vertex::default());
        self.vertices.read_exact(bytemuck::cast_slice_mut(&mut to[start..]))?;
        self.left -= count as u64;
        Ok(())
    }

    fn next_triangles(&mut self, count: usize) -> io::Result<Vec<[u32; 3]>> {
        let mut triangles = vec![[0; 3]; count];
        self.triangles.read_exact(bytemuck::cast_slice_mut(&mut triangles))?;
        Ok(triangles)
    }

    fn tell(&self, part: f64) {
        (self.progress)(part);
    }
}
