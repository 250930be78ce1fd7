//! PLY points.

use isoforge::components::OpenOptions;

use crate::folder::{Folder, RADIUS, blob};

fn header(encoding: &str, count: u64, properties: &str) -> String {
    let properties: String = properties.lines().map(|property| format!("property {property}\n")).collect();
    format!("ply\nformat {encoding} 1.0\ncomment made here\nelement vertex {count}\n{properties}")
}

const ALL: &str = "float x\nuchar red\ndouble y\nshort z\nfloat radius\nfloat weight";

#[test]
fn text_and_both_binary_orders() {
    let folder = Folder::new();
    let wanted = [blob(1.5, -2.25, 3.0, 0.5, -1.0), blob(4.0, 5.0, -6.0, 2.0, 1.0)];
    let rows = "1.5 255 -2.25 3 .5 -1\n4 0 5 -6 2. 1\n";
    let text = header("ascii", 2, ALL) + "end_header\n" + rows;
    let loaded = folder.open("ply", &text).unwrap();
    assert_eq!((loaded.components.as_slice(), loaded.notes.len()), (wanted.as_slice(), 0));
    assert_eq!(folder.open("ply", text.replace('\n', "\r\n")).unwrap(), loaded);
    for big in [false, true] {
        let encoding = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut file = (header(encoding, 2, ALL) + "end_header\n").into_bytes();
        for blob in &wanted {
            let [x, y, z] = blob.position;
            macro_rules! put {
                ($value:expr) => {
                    file.extend(if big { $value.to_be_bytes() } else { $value.to_le_bytes() })
                };
            }
            put!(x);
            put!(9_u8);
            put!(f64::from(y));
            put!((z as i16));
            put!(blob.radius);
            put!(blob.weight);
        }
        assert_eq!(folder.open("ply", &file).unwrap(), loaded);
        let found = folder.fault("ply", &file[..file.len() - 1]);
        assert!(found.starts_with(": 2 elements vertex are promised, but the file ends after 1."), "{found}");
        let radius = file.len() - 8;
        file[radius..radius + 4].copy_from_slice(&if big {
            f32::NAN.to_be_bytes()
        } else {
            f32::NAN.to_le_bytes()
        });
        let found = folder.fault("ply", &file);
        assert!(found.starts_with(", vertex 2, column radius: \"NaN\" is not a finite"), "{found}");
    }
}

#[test]
fn other_elements_are_passed_over() {
    let folder = Folder::new();
    let file = "ply\nformat ascii 1.0\nelement camera 2\nproperty int id\nelement vertex 1\nproperty float z\n\
                property float y\nproperty float x\nproperty float scale\nelement face 1\n\
                property list uchar int vertex_indices\nend_header\n7\n8\n3 2 1 .5\n3 0 0 0\n";
    let loaded = folder.open("ply", file).unwrap();
    assert_eq!(loaded.components, [blob(1.0, 2.0, 3.0, 0.5, 1.0)]);
    assert_eq!(loaded.notes, ["2 elements camera are not used", "1 elements face are not used"]);
    let loaded = folder.open("ply", file.replace("scale", "s")).unwrap();
    assert_eq!(loaded.components, [blob(1.0, 2.0, 3.0, RADIUS, 1.0)]);
    assert_eq!(loaded.notes[0], "the vertices have no radius: every component has radius 0.25");
}

#[test]
fn bad_files_are_named() {
    let folder = Folder::new();
    let xyz = "float x\nfloat y\nfloat z\nfloat radius";
    let start = header("ascii", 2, xyz) + "end_header\n0 0 0 1\n";
    let binary = header("binary_little_endian", 1 << 60, "float x\nfloat y\nfloat z") + "end_header\n0123";
    for (file, fault) in [
        (start.clone() + "0 a 0 1\n", ", row 11, column y: \"a\" is not a number"),
        (start.clone() + "0 0 0\n", ", row 11, column radius: \"\" is not a number"),
        (start.clone() + "0 0 0 0\n", ", row 11, column radius: \"0\" is not above 0"),
        (start.clone() + "0 0 nan 1\n", ", row 11, column z: \"nan\" is not a finite"),
        (start.clone(), ": 2 elements vertex are promised, but the file ends after 1"),
        (binary, ": 1152921504606846976 elements vertex are promised, but the file ends after 0"),
        (start.replace("float y", "float why"), ": the vertices have no coordinate y"),
        (start.replace("vertex", "point"), ": no element is named vertex"),
        (start.replace("float y", "list uchar float y"), ": the element vertex has lists"),
        (start.replace("vertex 2", "vertex 0"), ": holds no component: the header promises 0"),
        (start.replace("float radius", "flat radius"), ", row 8: Couldn't parse line"),
        ("ply\n".to_string(), ", row 2: Unexpected end of file while reading header"),
        (String::new(), ": Unexpected end of file while reading magic number. "),
    ] {
        let found = folder.fault("ply", &file);
        assert!(found.starts_with(fault), "{file:?}: {found}");
    }
    let options = OpenOptions { max_bytes: Some(39), ..OpenOptions::default() };
    let error = folder.open_with("ply", start + "0 0 0 1\n", &options).unwrap_err().to_string();
    assert!(error.contains("take 40 bytes or more, and 39 are allowed"), "{error}");
}
