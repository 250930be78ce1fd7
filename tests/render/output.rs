//! PNG files.

use image::{Rgba, RgbaImage};
use isoforge::render::{check_target, save_png};

#[test]
fn a_saved_picture_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    for alpha in [255, 40] {
        let image = RgbaImage::from_fn(7, 5, |x, y| Rgba([x as u8 * 30, y as u8 * 40, 9, alpha]));
        let path = folder.path().join("picture.PNG");
        save_png(image.clone(), &path).unwrap();
        let read = image::load_from_memory(&std::fs::read(&path).unwrap()).unwrap();
        assert_eq!(read.color().has_alpha(), alpha != 255);
        assert_eq!(read.into_rgba8(), image);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1, "something was left behind");
    }
}

#[cfg(unix)]
#[test]
fn a_saved_picture_has_ordinary_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let (path, plain) = (folder.path().join("a.png"), folder.path().join("plain"));
    save_png(RgbaImage::new(2, 2), &path).unwrap();
    std::fs::write(&plain, "").unwrap();
    let mode = |p| std::fs::metadata(p).unwrap().permissions().mode();
    assert_eq!(mode(path), mode(plain));
}

#[test]
fn bad_targets_are_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let directory = folder.path().join("folder.png");
    std::fs::create_dir(&directory).unwrap();
    let cases = [
        (folder.path().join("a.jpg"), ".png"),
        (folder.path().join("png"), ".png"),
        (folder.path().join("missing").join("a.png"), "create it"),
        (directory, "folder"),
    ];
    for (path, remedy) in cases {
        for error in [check_target(&path).unwrap_err(), save_png(RgbaImage::new(1, 1), &path).unwrap_err()] {
            let text = error.to_string();
            assert!(text.contains(remedy) && text.contains(&path.display().to_string()), "{text}");
        }
    }
    let good = folder.path().join("good.png");
    check_target(&good).unwrap();
    assert!(!good.exists());
}
