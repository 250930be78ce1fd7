//! Real volumes. The facts were printed by nibabel 5.4.2 and tifffile 2026.3.3.

use crate::*;

fn sum(opened: &Opened) -> f64 {
    opened.volume.values().iter().map(f64::from).sum()
}

fn at(opened: &Opened, x: u32, y: u32, z: u32) -> f32 {
    let n = opened.volume.grid().points();
    opened.volume.values().get((x + n.x * (y + n.y * z)) as usize)
}

#[test]
fn a_crop_of_a_brain() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/brain_24.nii.gz");
    let opened = open(&path).unwrap();
    assert_eq!(opened.volume.grid().points().to_array(), [24; 3]);
    assert_eq!(opened.volume.finite_range(), Some((-28.0, 153.0)));
    assert_eq!(sum(&opened), 503_649.0);
    assert_eq!([at(&opened, 0, 0, 0), at(&opened, 23, 0, 0), at(&opened, 5, 11, 17)], [57.0, 14.0, 32.0]);
    assert_plain_grid(&opened, [-40.802734, 171.69727, 1186.8], [1.0; 3]);
    assert_eq!(opened.notes, [""; 0]);
}

/// The larger volumes lie beside the repository where somebody has put them there.
fn shared(name: &str) -> Option<Opened> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/volumes").join(name);
    path.exists().then(|| open(&path).unwrap())
}

#[test]
fn brain() {
    let Some(opened) = shared("ct_brain_atlas_1mm.nii.gz") else { return };
    assert_eq!(opened.volume.grid().points().to_array(), [202, 202, 179]);
    assert_eq!(opened.volume.finite_range(), Some((-30.0, 385.0)));
    assert_eq!(opened.volume.non_finite_count(), 0);
    assert_eq!(sum(&opened), 50_127_759.0);
    assert_eq!(
        [at(&opened, 100, 100, 90), at(&opened, 60, 110, 80), at(&opened, 101, 70, 33)],
        [38.0, 36.0, 16.0]
    );
    assert_plain_grid(&opened, [-100.802734, 81.697266, 1126.8], [1.0; 3]);
    assert_eq!(opened.notes, [""; 0]);
}

#[test]
fn bone() {
    let Some(opened) = shared("bone_128x128x128.tif") else { return };
    assert_eq!(opened.volume.grid().points().to_array(), [128; 3]);
    assert_eq!(opened.volume.finite_range(), Some((0.0, 255.0)));
    assert_eq!(sum(&opened), 243_509_780.0);
    assert_eq!(
        [at(&opened, 30, 20, 10), at(&opened, 64, 64, 64), at(&opened, 77, 5, 100)],
        [8.0, 170.0, 236.0]
    );
    // XResolution is 512000/1000000 pixels a unit; spacing=1.953125 stands in the ImageJ tag.
    assert_plain_grid(&opened, [0.0; 3], [1.953125; 3]);
    assert_eq!(opened.notes, [""; 0]);
}

#[test]
fn shell() {
    let Some(opened) = shared("shell_225x128x128.tif") else { return };
    assert_eq!(opened.volume.grid().points().to_array(), [128, 128, 225]);
    assert_eq!(opened.volume.finite_range(), Some((0.0, 255.0)));
    assert_eq!(sum(&opened), 54_577_895.0);
    assert_eq!(
        [at(&opened, 30, 20, 10), at(&opened, 64, 64, 64), at(&opened, 77, 5, 100)],
        [0.0, 167.0, 0.0]
    );
    assert_plain_grid(&opened, [0.0; 3], [1.0; 3]);
    assert_eq!(opened.notes, [""; 0]);
}
