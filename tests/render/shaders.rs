//! Every shader of this folder is valid; checked without a GPU.

use naga::valid::{Capabilities, ValidationFlags, Validator};

#[test]
fn shaders_are_valid() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/shaders/render");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let source = std::fs::read_to_string(&path).unwrap();
        let module = naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|e| panic!("{}: {}", path.display(), e.emit_to_string(&source)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::default());
        validator.validate(&module).unwrap_or_else(|e| panic!("{}: {e:?}", path.display()));
        count += 1;
    }
    assert_eq!(count, 3);
}
