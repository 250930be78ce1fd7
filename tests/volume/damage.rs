//! Damaged files: no panic and no memory beyond what a file of that size can hold.

use crate::nifti::Nifti;
use crate::tiff::{Packing, Tiff};
use crate::*;
use rayon::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// The largest single allocation of this process.
static LARGEST: AtomicUsize = AtomicUsize::new(0);

struct Watch;

// SAFETY: every call goes to the system's allocator unchanged.
unsafe impl GlobalAlloc for Watch {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LARGEST.fetch_max(size, Ordering::Relaxed);
        unsafe { System.realloc(at, layout, size) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc_zeroed(layout) }
    }
}

#[global_allocator]
static WATCH: Watch = Watch;

fn files() -> Vec<(&'static str, Vec<u8>)> {
    let order = Endian::Little;
    let nifti = Nifti {
        sform: Some([[1.0, 0.0, 0.0, 4.0], [0.0, 1.0, 0.0, 5.0], [0.0, 0.0, 1.0, 6.0]]),
        ..Nifti::new(Scalar::I16, order)
    };
    let packed = |packing, endian| Tiff { packing, strips: 2, ..Tiff::new(Scalar::U16, endian) }.bytes();
    let imagej = Tiff { resolution: Some([4, 1]), ..Tiff::imagej("images=3\nslices=3\nspacing=2.5\n") };
    let data = encode(&values(Scalar::I16), Scalar::I16, order);
    let directions = "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (1,2,3)\nbyte skip: 0\n";
    let head = |encoding| nrrd::header("short", encoding, order, directions);
    vec![
        ("a.nii", nifti.bytes()),
        ("a.nii", Nifti { qform: Some([0.1; 6]), ..Nifti::new(Scalar::F64, Endian::Big) }.bytes()),
        ("a.nii.gz", gzip(&nifti.bytes())),
        ("a.tif", packed(Packing::None, Endian::Little)),
        ("a.tif", packed(Packing::Deflate, Endian::Big)),
        ("a.tif", packed(Packing::PackBits, Endian::Little)),
        ("a.tif", imagej.bytes()),
        ("a.nrrd", nrrd::attach(&head("raw"), &data)),
        ("a.nrrd", nrrd::attach(&head("gzip"), &gzip(&data))),
        ("a.nrrd", nrrd::attach(&head("ascii"), "7 ".repeat(60).as_bytes())),
    ]
}

/// Opens every damaged form of a file; how many were refused and how many read.
fn damage(name: &str, bytes: &[u8]) -> [u32; 2] {
    let dir = TempDir::new().unwrap();
    let mut outcomes = [0; 2];
    let mut try_one = |bytes: &[u8], what: &dyn Fn() -> String| {
        let path = write(&dir, name, bytes);
        let read = std::panic::catch_unwind(|| open(&path));
        let Ok(read) = read else { panic!("{name}, {}: panicked", what()) };
        outcomes[usize::from(read.is_ok())] += 1;
    };
    for len in 0..bytes.len() {
        try_one(&bytes[..len], &|| format!("cut to {len}"));
    }
    let mut damaged = bytes.to_vec();
    for at in 0..bytes.len().min(600) {
        let old = bytes[at];
        for new in [0x00, 0x7f, 0xff, old ^ 0x80, old ^ 0x01] {
            damaged[at] = new;
            try_one(&damaged, &|| format!("byte {at} set to {new}"));
        }
        damaged[at] = old;
        // Four at once, for fields that only hurt as a whole.
        let end = (at + 4).min(bytes.len());
        for new in [0x00, 0x7f, 0xff] {
            damaged[at..end].fill(new);
            try_one(&damaged, &|| format!("bytes {at}..{end} set to {new}"));
        }
        damaged[at..end].copy_from_slice(&bytes[at..end]);
    }
    outcomes
}

#[test]
fn damaged_files_are_refused_or_read_but_never_panic() {
    let outcomes = files()
        .par_iter()
        .map(|(name, bytes)| damage(name, bytes))
        .reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
    assert!(outcomes[0] > 1000 && outcomes[1] > 1000, "{outcomes:?}");
    let largest = LARGEST.load(Ordering::Relaxed);
    assert!(largest < 64 << 20, "an allocation of {largest} bytes");
}
