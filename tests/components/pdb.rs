//! PDB molecules.

use std::path::Path;

use isoforge::components::{Loaded, OpenOptions, open};

use crate::folder::{Folder, blob, gzip};

/// A record of the atom `name` (4 columns), alternate location, residue and element.
fn atom(
    record: &str,
    name: &str,
    location: char,
    residue: &str,
    number: u32,
    element: &str,
    x: f32,
) -> String {
    format!(
        "{record:6}    1 {name:4}{location}{residue:3} A{number:4}    {x:8.3}{:8.3}{:8.3}  1.00  0.00          {element:>2}\n",
        2.0, -3.5
    )
}

fn radii(loaded: &Loaded) -> Vec<f32> {
    loaded.components.iter().map(|component| component.radius).collect()
}

#[test]
fn a_real_protein() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/data/1A8O.pdb.gz");
    let loaded = open(&path, &OpenOptions::default()).unwrap();
    assert_eq!(loaded.components.len(), 556);
    assert_eq!(loaded.notes, ["88 atoms of water are not used"]);
    assert_eq!(loaded.components[0], blob(19.594, 32.367, 28.012, 1.55, 1.0));
    let count = |radius: f32| radii(&loaded).iter().filter(|&&found| found == radius).count();
    // Carbon, nitrogen, oxygen, sulphur, selenium.
    assert_eq!([1.7, 1.55, 1.52, 1.8, 1.9].map(count).iter().sum::<usize>(), 556);
    assert_eq!(count(1.9), 4);
}

#[test]
fn elements_from_their_columns_and_from_names() {
    let folder = Folder::new();
    let radius = |name, element| {
        let file = atom("ATOM", name, ' ', "LIG", 1, element, 1.0);
        let loaded = folder.open("pdb", &file).unwrap();
        assert_eq!(loaded.components[0].position, [1.0, 2.0, -3.5]);
        radii(&loaded)[0]
    };
    for (name, element, wanted) in [
        (" CA ", "C", 1.7),
        ("CA  ", "CA", 2.62),
        (" CA ", "", 1.7),
        ("CA  ", "", 2.62),
        ("1HB ", "", 1.2),
        ("HG11", "", 1.2),
        ("HG  ", "", 2.45),
        ("FE  ", " 7", 2.44),
        (" OXT", "", 1.52),
        ("OXT ", "", 1.52),
    ] {
        assert_eq!(radius(name, element), wanted, "{name:?} {element:?}");
    }
    // Before version 3, and by hand, lines end earlier.
    let short = &atom("HETATM", "ZN  ", ' ', " ZN", 1, "", 1.0)[..54];
    assert_eq!(radii(&folder.open("pdb", short).unwrap()), [2.39]);
    assert_eq!(radii(&folder.open("pdb.gz", gzip(short.as_bytes())).unwrap()), [2.39]);
}

#[test]
fn models_waters_and_alternate_locations_are_noted() {
    let folder = Folder::new();
    let model = [
        "MODEL        1\n".to_string(),
        atom("ATOM", " N  ", ' ', "SER", 1, "N", 0.0),
        atom("ATOM", " CA ", 'A', "SER", 1, "C", 1.0),
        atom("ATOM", " CA ", 'B', "SER", 1, "C", 2.0),
        atom("ATOM", " CB ", 'B', "THR", 2, "C", 3.0),
        atom("ATOM", " CB ", 'C', "THR", 2, "C", 4.0),
        atom("ATOM", " CB ", 'B', "SER", 1, "C", 5.0),
        atom("HETATM", " O  ", ' ', "HOH", 3, "O", 6.0),
        atom("HETATM", " O  ", 'A', "WAT", 4, "O", 7.0),
        "ENDMDL\n".to_string(),
    ]
    .concat();
    let loaded = folder.open("pdb", model.repeat(2) + "END\n").unwrap();
    let x: Vec<f32> = loaded.components.iter().map(|component| component.position[0]).collect();
    assert_eq!(x, [0.0, 1.0, 3.0]);
    let skipped = ["2 atoms of water are not used", "3 atoms at alternate locations are not used"];
    assert_eq!(loaded.notes[..2], skipped);
    assert_eq!(loaded.notes[2..], ["further models, from row 12 on, are not used"]);
    assert_eq!(folder.open("pdb", model + "CONECT    1    2\nEND\n").unwrap().notes, skipped);
}

#[test]
fn bad_rows_are_named() {
    let folder = Folder::new();
    let good = atom("ATOM", " CA ", ' ', "GLY", 1, "C", 1.0);
    for (row, fault) in [
        (good.replace(" 2.000", " 2.0x0"), ", row 3, column y (39-46): \"2.0x0\" is not a number"),
        (good.replace("1.000   2", "  nan   2"), ", row 3, column x (31-38): \"nan\" is not a finite"),
        (good[..46].to_string(), ", row 3, column z (47-54): \"\" is not a number"),
        (good.replace(" C\n", "QX\n"), ", row 3: \"QX\" is no element"),
        (good.replace(" C\n", "\n").replace(" CA ", " ?? "), ", row 3: \"??\" is no element"),
        ("ATOM".to_string(), ", row 3, column x (31-38): \"\" is not a number"),
    ] {
        let found = folder.fault("pdb", format!("REMARK\n{good}{row}"));
        assert!(found.starts_with(fault), "{row:?}: {found}");
    }
    assert!(folder.fault("pdb", "").starts_with(": holds no component. Give a file with ATOM"));
    let waters = atom("HETATM", " O  ", ' ', "HOH", 3, "O", 6.0).repeat(3);
    assert!(folder.fault("pdb", waters).starts_with(": holds no component: its 3 atoms are water. "));
}
