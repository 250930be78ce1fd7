//! Where files go, and that nothing else is left behind.

use std::fs;
use std::path::Path;

use isoforge::TargetError;
use isoforge::mesh::write::{ENDINGS, WriteError, check_target, write};

use crate::shapes::{cube, mesh, tetrahedron};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_replaces_another_whole() {
    let folder = tempfile::tempdir().unwrap();
    for ending in ENDINGS {
        let path = folder.path().join(format!("m.{ending}"));
        write(&tetrahedron(), &path).unwrap();
        let small = fs::metadata(&path).unwrap().len();
        write(&cube(), &path).unwrap();
        assert!(fs::metadata(&path).unwrap().len() > small);
    }
    assert_eq!(names(folder.path()), ["m.glb", "m.obj", "m.off", "m.ply", "m.rib", "m.stl"]);
}

#[test]
fn refusals_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "old").unwrap();
    fs::create_dir(folder.path().join("sub.ply")).unwrap();
    let both = |name: &str| {
        let path = folder.path().join(name);
        let error = write(&cube(), &path).unwrap_err();
        assert_eq!(check_target(&path).unwrap_err().to_string(), error.to_string());
        assert!(error.to_string().contains(path.to_str().unwrap()), "{error}");
        error
    };
    assert!(matches!(both("a.xyz"), WriteError::UnknownEnding { .. }));
    assert!(both("a").to_string().contains(".off, .obj, .ply, .stl, .glb or .rib"));
    assert!(matches!(both("none/a.ply"), WriteError::Target(TargetError::FolderMissing { .. })));
    assert!(matches!(both("file/a.ply"), WriteError::Target(TargetError::InTheWay { .. })));
    assert!(matches!(both("sub.ply"), WriteError::Target(TargetError::InTheWay { .. })));
    assert_eq!(names(folder.path()), ["file", "sub.ply"]);

    // What only the mesh decides: an older file stays.
    let path = folder.path().join("a.stl");
    fs::write(&path, "old").unwrap();
    let broken = mesh(&[[0.0; 3]], &[[0, 0, 0], [0, 3, 0]]);
    let error = write(&broken, &path).unwrap_err();
    assert!(matches!(error, WriteError::BadIndex { triangle: 1, vertex: 3, vertices: 1, .. }));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    check_target(&path).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["a.stl", "file", "sub.ply"]);
}

#[test]
fn a_bare_name_means_the_current_folder() {
    check_target(Path::new("bare.ply")).unwrap();
    assert!(!Path::new("bare.ply").exists());
}

#[cfg(unix)]
#[test]
fn permissions_and_links_are_those_of_ordinary_files() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().permissions().mode() & 0o777;
    fs::write(folder.path().join("ordinary"), "").unwrap();
    let path = folder.path().join("a.off");
    write(&cube(), &path).unwrap();
    assert_eq!(mode("a.off"), mode("ordinary"));

    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    write(&cube(), &path).unwrap();
    assert_eq!(mode("a.off"), 0o640);

    symlink("a.off", folder.path().join("link.off")).unwrap();
    write(&tetrahedron(), &folder.path().join("link.off")).unwrap();
    assert!(folder.path().join("link.off").is_symlink());
    assert_eq!(isoforge::mesh::read::read(&path).unwrap().mesh.triangles.len(), 4);

    // A link to what does not exist yet makes it; one to itself leads nowhere.
    fs::create_dir(folder.path().join("sub")).unwrap();
    symlink("sub/new.off", folder.path().join("dangling.off")).unwrap();
    write(&cube(), &folder.path().join("dangling.off")).unwrap();
    assert!(folder.path().join("dangling.off").is_symlink());
    assert!(folder.path().join("sub/new.off").is_file());
    symlink("self.off", folder.path().join("self.off")).unwrap();
    for error in [check_target(&folder.path().join("self.off")).unwrap_err(), {
        write(&cube(), &folder.path().join("self.off")).unwrap_err()
    }] {
        assert!(matches!(error, WriteError::Target(TargetError::InTheWay { .. })), "{error}");
    }
}

/// A folder that takes no files is not a missing one, and no message names the temporary file.
#[cfg(target_os = "linux")]
#[test]
fn folders_that_take_no_files() {
    let error = check_target(Path::new("/proc/x.ply")).unwrap_err();
    assert!(matches!(&error, WriteError::Target(TargetError::NotWritable { .. })), "{error}");
    assert!(!error.to_string().contains(".isoforge-"), "{error}");
}
