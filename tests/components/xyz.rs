//! XYZ molecules and points.

use isoforge::components::OpenOptions;

use crate::folder::{Folder, RADIUS, blob, gzip};

const WATER: &str = "3\nwater\nO 0.0 0.0 0.1173\nH 0.0 0.7572 -0.4692\nH 0.0 -0.7572 -0.4692\n";

#[test]
fn a_molecule() {
    let folder = Folder::new();
    let loaded = folder.open("xyz", WATER).unwrap();
    let wanted = [
        blob(0.0, 0.0, 0.1173, 1.52, 1.0),
        blob(0.0, 0.7572, -0.4692, 1.2, 1.0),
        blob(0.0, -0.7572, -0.4692, 1.2, 1.0),
    ];
    assert_eq!((loaded.components.as_slice(), loaded.notes.len()), (wanted.as_slice(), 0));
    assert_eq!(folder.open("xyz.gz", gzip(WATER.as_bytes())).unwrap(), loaded);
    let extended =
        WATER.replace("water", "Lattice=\"9 0 0 0 9 0 0 0 9\" Properties=species:S:1:pos:R:3:q:R:1");
    assert_eq!(folder.open("xyz", extended).unwrap(), loaded);
    let radius =
        |element: &str| folder.open("xyz", format!("1\n\n{element} 0 0 0")).unwrap().components[0].radius;
    assert_eq!([radius("cl"), radius("CL12"), radius("17")], [1.75; 3]);
    assert_eq!([radius("Fe"), radius("U"), radius("D")], [2.44, 2.71, 1.2]);
}

#[test]
fn further_frames_are_noted() {
    let folder = Folder::new();
    let loaded = folder.open("xyz", WATER.repeat(2)).unwrap();
    assert_eq!(loaded.components.len(), 3);
    assert_eq!(loaded.notes, ["further frames, from row 6 on, are not used"]);
    let loaded = folder.open("xyz", format!("{WATER}\nHe 1 1 1\n")).unwrap();
    assert_eq!(loaded.notes, ["there are only 3 atoms by row 1: row 7 on is not used"]);
}

#[test]
fn points() {
    let folder = Folder::new();
    let loaded = folder.open("xyz", "# scan\n1 2 3 255 0 0\n\n 4\t5  6 0 0 0\n7,8,9\n").unwrap();
    let wanted = [
        blob(1.0, 2.0, 3.0, RADIUS, 1.0),
        blob(4.0, 5.0, 6.0, RADIUS, 1.0),
        blob(7.0, 8.0, 9.0, RADIUS, 1.0),
    ];
    assert_eq!(loaded.components, wanted);
    let notes = [
        "plain points, without elements: every component has radius 0.25",
        "columns after x, y, z are not used",
    ];
    assert_eq!(loaded.notes, notes);
}

#[test]
fn bad_rows_are_named() {
    let folder = Folder::new();
    for (file, fault) in [
        ("2\n\nH 0 0 0\nQq 1 1 1\n", ", row 4: \"Qq\" is no element"),
        ("1\n\n119 0 0 0\n", ", row 3: \"119\" is no element"),
        ("1\n\nPm 0 0 0\n", ", row 3: \"Pm\" is no element"),
        ("1\n\nH 0 zero 0\n", ", row 3, column y: \"zero\" is not a number"),
        ("1\n\nH 0 0\n", ", row 3, column z: \"\" is not a number"),
        ("1\n\nH NaN 0 0\n", ", row 3, column x: \"NaN\" is not a finite"),
        ("3\n\nH 0 0 0\nH 0 0 0\n", ", row 4: 3 atoms are promised, but the file ends after 2"),
        ("99999999999999999\n\nH 0 0 0\n", ", row 3: 99999999999999999 atoms are promised"),
        ("3", ", row 1: 3 atoms are promised, but the file ends after 0"),
        ("1\nProperties=id:I:1:species:S:1:pos:R:3\n1 H 0 0 0\n", ", row 2: the comment's Properties"),
        ("0\n\n", ": holds no component: the first row promises 0 atoms"),
        ("", ": holds no component. Give a count"),
        ("\n\n# 1 2 3\n", ": holds no component. Give a count"),
        ("-1\n\nH 0 0 0", ", row 1, column y: \"\" is not a number"),
        ("1 2 3\n4 5 inf\n", ", row 2, column z: \"inf\" is not a finite"),
        ("H 0 0 0\n", ", row 1, column x: \"H\" is not a number"),
    ] {
        let found = folder.fault("xyz", file);
        assert!(found.starts_with(fault), "{file:?}: {found}");
    }
}

#[test]
fn a_promise_over_the_limit_is_refused_at_once() {
    let options = OpenOptions { max_bytes: Some(59), ..OpenOptions::default() };
    let error = Folder::new().open_with("xyz", WATER, &options).unwrap_err().to_string();
    assert!(error.contains("take 60 bytes or more, and 59 are allowed"), "{error}");
}
