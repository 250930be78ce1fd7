//! The structs that Rust and WGSL share have the same layout in both.

use super::shade::Frame;
use super::shaders;
use super::wire::{ARGUMENTS, DRAW, Window};
use crate::gpu::MeshHeader;
use naga::TypeInner;
use std::mem::offset_of;

/// Size of the struct `name`, and its members' names and offsets.
fn layout(source: &str, name: &str) -> (u32, Vec<(String, usize)>) {
    let module = naga::front::wgsl::parse_str(source).unwrap();
    let (_, found) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).unwrap();
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{name} is no struct") };
    let member = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
    (*span, members.iter().map(member).collect())
}

macro_rules! offsets {
    ($of:ty: $($field:ident),*) => { vec![$((stringify!($field).to_string(), offset_of!($of, $field))),*] };
}

#[test]
fn frame() {
    let (size, members) = layout(shaders::MESH, "Frame");
    assert_eq!(size as usize, size_of::<Frame>());
    assert_eq!(members, offsets!(Frame: clip, eye, scale, key, shade, fill, line_bias));
}

#[test]
fn mesh_header() {
    let rust = offsets!(MeshHeader: index_count, instance_count, first_index, base_vertex, first_instance,
        vertices, triangles, active_bricks, overflow, non_finite, runaway, reserved);
    for source in [shaders::wire(), shaders::bounds()] {
        let (size, members) = layout(&source, "MeshHeader");
        assert_eq!(size as usize, size_of::<MeshHeader>());
        assert_eq!(members, rust);
    }
}

#[test]
fn windows() {
    for (source, last) in [(shaders::wire(), "windows"), (shaders::bounds(), "stride")] {
        let (size, members) = layout(&source, "Window");
        assert_eq!(size as usize, size_of::<Window>());
        let mut rust = offsets!(Window: first, count, capacity, extra);
        rust[3].0 = last.into();
        assert_eq!(members, rust);
    }
    let (size, members) = layout(&shaders::wire(), "Arguments");
    assert_eq!(u64::from(size), ARGUMENTS);
    assert_eq!(members[3], ("index_count".to_string(), DRAW as usize));
}
