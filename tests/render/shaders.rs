//! Every drawing shader is valid; checked without a GPU.

use isoforge::render::shaders;
use naga::valid::{Capabilities, ValidationFlags, Validator};

#[test]
fn shaders_are_valid() {
    for source in [shaders::MESH.to_string(), shaders::wire(), shaders::bounds()] {
        let module =
            naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
        validator.validate(&module).unwrap_or_else(|e| panic!("{e:?}"));
    }
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/render");
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), 3, "a new file belongs in the list above");
}
