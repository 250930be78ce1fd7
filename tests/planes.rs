//! Volumes that are read a part at a time: the files are those of the whole volume, and memory stays within the budget.

mod common;

use common::Random;
use isoforge::extract::{ExtractError, Method, Options, PlanesError, Source, extract_on_cpu, extract_planes};
use isoforge::field::Sense;
use isoforge::mesh::write;
use isoforge::volume::{self, Endian, OpenError, OpenOptions, Planes, RawLayout, Scalar};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Extracts with the least budget that does, and with those that some more layers need; returns the most slabs.
#[track_caller]
fn same_files(path: &Path, options: &OpenOptions, iso: f32, sense: Sense) -> u64 {
    let name = path.display();
    let dir = TempDir::new().unwrap();
    let opened = volume::open(path, options).unwrap();
    let settings = |memory_budget| Options { sense: Some(sense), memory_budget, ..Options::new(iso) };
    let (mesh, whole) =
        extract_on_cpu(&Source::Volume(&opened.volume), &settings(u64::MAX), &|_| {}).unwrap();
    let open = mesh.open_edges_at_border(opened.volume.grid());
    let least = match extract_planes(
        &mut Planes::open(path, options).unwrap(),
        &settings(0),
        &dir.path().join("no.ply"),
        &|_| {},
    ) {
        Err(PlanesError::Extract(ExtractError::Budget { needed, .. })) => needed,
        other => panic!("{name}: {other:?}"),
    };
    let mut most = 0;
    for ending in ["ply", "stl"] {
        let [expected, found] = ["whole", "parts"].map(|name| dir.path().join(name).with_extension(ending));
        write::write(&mesh, &expected).unwrap();
        for budget in [least, least + least / 40, u64::MAX] {
            let mut planes = Planes::open(path, options).unwrap();
            let report = extract_planes(&mut planes, &settings(budget), &found, &|_| {}).unwrap();
            assert!(
                fs::read(&expected).unwrap() == fs::read(&found).unwrap(),
                "{name}, {ending}, {budget} bytes"
            );
            let numbers = |r: &isoforge::extract::Report| {
                [r.vertices, r.triangles, r.bricks, r.active_bricks, r.non_finite]
            };
            assert_eq!(numbers(&report), numbers(&whole), "{name}");
            assert_eq!(report.open_edges, Some(open), "{name}");
            assert!(
                report.peak_bytes <= budget && planes.notes() == opened.notes,
                "{name}: {:?}",
                planes.notes()
            );
            most = most.max(report.slabs);
        }
    }
    assert_eq!(fs::read_dir(&dir).unwrap().count(), 4, "{name}: something is left behind");
    most
}

/// Values with plateaus, whose gradients say nothing, ties, and for floats what is not finite.
fn samples(scalar: Scalar, endian: Endian, count: usize, seed: u64) -> Vec<u8> {
    let mut random = Random(seed);
    let mut bytes = Vec::new();
    for i in 0..count {
        let number = match (scalar, random.next() % 50) {
            (Scalar::F32 | Scalar::F64, 0) => f64::NAN,
            (Scalar::F32 | Scalar::F64, 1) => f64::INFINITY,
            _ if seed.is_multiple_of(2) => (random.next() % 4) as f64,
            _ => (60.0 + 50.0 * (i as f64 * 0.011).sin()).floor() + (random.next() % 3) as f64,
        };
        let start = bytes.len();
        match scalar {
            Scalar::U8 => bytes.push(number as u8),
            Scalar::I8 => bytes.extend((number as i8).to_le_bytes()),
            Scalar::U16 => bytes.extend((number as u16).to_le_bytes()),
            Scalar::I16 => bytes.extend((number as i16).to_le_bytes()),
            Scalar::U32 => bytes.extend((number as u32).to_le_bytes()),
            Scalar::I32 => bytes.extend((number as i32).to_le_bytes()),
            Scalar::F32 => bytes.extend((number as f32).to_le_bytes()),
            Scalar::F64 => bytes.extend(number.to_le_bytes()),
        }
        if endian == Endian::Big {
            bytes[start..].reverse();
        }
    }
    bytes
}

fn raw(dir: &TempDir, dims: [u32; 3], scalar: Scalar, endian: Endian, seed: u64) -> (PathBuf, OpenOptions) {
    let path = dir.path().join(format!("{scalar}{endian}{seed}.raw"));
    let count = dims.iter().product::<u32>() as usize;
    let mut bytes = vec![7; 11];
    bytes.extend(samples(scalar, endian, count, seed));
    fs::write(&path, bytes).unwrap();
    let layout = RawLayout {
        endian,
        skip_bytes: 11,
        spacing: [0.3, 1.0, 2.7],
        origin: [-3.0, 0.5, 100.0],
        ..RawLayout::new(dims, scalar)
    };
    (path, OpenOptions { raw: Some(layout), ..OpenOptions::default() })
}

/// Goes red when the layer behind a slab is not carried over, when the window begins at the slab's own first plane (slopes
/// there reach below it), and when `Parts::finish` gets no normals.
#[test]
fn every_type_and_order_in_odd_sizes() {
    let dir = TempDir::new().unwrap();
    let sizes = [[9, 7, 50], [20, 17, 33], [2, 41, 24], [33, 12, 10], [17, 9, 2], [8, 8, 9], [25, 16, 26]];
    let mut slabs = 0;
    for (i, scalar) in Scalar::ALL.into_iter().enumerate() {
        for (j, endian) in [Endian::Little, Endian::Big].into_iter().enumerate() {
            let dims = sizes[(i + 3 * j) % sizes.len()];
            for seed in [0, 1] {
                let (path, options) = raw(&dir, dims, scalar, endian, seed);
                let (iso, sense) = if seed == 0 { (1.0, Sense::Below) } else { (60.0, Sense::Above) };
                slabs = slabs.max(same_files(&path, &options, iso, sense));
            }
        }
    }
    assert!(slabs >= 6, "{slabs}");
}

/// Of faces on all six sides, slab by slab, whatever the method makes of them.
#[test]
fn open_edges_are_those_of_the_whole_mesh() {
    let dir = TempDir::new().unwrap();
    for (dims, seed) in [([20, 17, 33], 2), ([9, 2, 50], 3), ([2, 2, 2], 4), ([33, 18, 9], 5)] {
        let (path, options) = raw(&dir, dims, Scalar::U8, Endian::Little, seed);
        let opened = volume::open(&path, &options).unwrap();
        let mut found = Vec::new();
        for method in Method::ALL {
            let iso = if seed % 2 == 0 { 1.5 } else { 60.5 };
            let settings = |memory_budget| Options { memory_budget, method, ..Options::new(iso) };
            let source = Source::Volume(&opened.volume);
            let (mesh, _) = extract_on_cpu(&source, &settings(u64::MAX), &|_| {}).unwrap();
            let mut planes = Planes::open(&path, &options).unwrap();
            let to = dir.path().join("open.ply");
            let least = match extract_planes(&mut planes, &settings(0), &to, &|_| {}) {
                Err(PlanesError::Extract(ExtractError::Budget { needed, .. })) => needed,
                other => panic!("{other:?}"),
            };
            for budget in [least, u64::MAX] {
                let mut planes = Planes::open(&path, &options).unwrap();
                let report = extract_planes(&mut planes, &settings(budget), &to, &|_| {}).unwrap();
                let open = mesh.open_edges_at_border(opened.volume.grid());
                assert_eq!(report.open_edges, Some(open), "{dims:?}, {method:?}, {budget}");
                assert_eq!(open, mesh.check().boundary_edges as u64, "{dims:?}, {method:?}");

                found.push(open);
            }
        }
        assert!(found.iter().all(|&open| open > 0) && found[0] < found[5], "{found:?}");
    }
}

/// More mesh than one batch holds.
#[test]
fn much_mesh() {
    let dir = TempDir::new().unwrap();
    let (path, options) = raw(&dir, [90, 80, 45], Scalar::U8, Endian::Little, 2);
    assert!(same_files(&path, &options, 1.5, Sense::Above) > 3);
}

fn nifti(data: &[u8], dims: [u16; 3], slope: f32) -> Vec<u8> {
    let mut header = vec![0; 352];
    header[..4].copy_from_slice(&348_i32.to_le_bytes());
    for (i, n) in [3, dims[0], dims[1], dims[2], 1, 1, 1, 1].into_iter().enumerate() {
        header[40 + 2 * i..][..2].copy_from_slice(&n.to_le_bytes());
    }
    header[70..72].copy_from_slice(&4_i16.to_le_bytes());
    header[72..74].copy_from_slice(&16_i16.to_le_bytes());
    for (at, number) in [(80, 0.5), (84, 2.0), (88, 3.0), (108, 352.0), (112, slope), (116, 1.5)] {
        header[at..at + 4].copy_from_slice(&f32::to_le_bytes(number));
    }
    header[344..348].copy_from_slice(b"n+1\0");
    header.extend(data);
    header
}

#[test]
fn every_format() {
    let dir = TempDir::new().unwrap();
    let dims = [20, 17, 33];
    let count = 20 * 17 * 33;
    let [little, big] = [Endian::Little, Endian::Big].map(|endian| samples(Scalar::I16, endian, count, 1));
    let write = |name: &str, bytes: &[u8]| {
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let options = OpenOptions::default();
    for (name, slope, iso) in [("plain.nii", 0.0, 60.0), ("scaled.nii", 0.25, 16.5)] {
        let path = write(name, &nifti(&little, dims, slope));
        assert!(same_files(&path, &options, iso, Sense::Above) > 3);
    }
    let head = "NRRD0004\ntype: short\ndimension: 3\nsizes: 20 17 33\nspacings: 1 2 3\nencoding: raw\n";
    let attached = [format!("{head}endian: big\n\n").as_bytes(), &big].concat();
    write("values.dat", &[b"line\nxx".as_slice(), &little].concat());
    let skips = "endian: little\nline skip: 1\nbyte skip: 2\ndata file: values.dat\n";
    for path in [write("a.nrrd", &attached), write("b.nhdr", format!("{head}{skips}").as_bytes())] {
        assert!(same_files(&path, &options, 60.0, Sense::Above) > 3);
    }
    let path = dir.path().join("stack.tif");
    let mut encoder = tiff::encoder::TiffEncoder::new(fs::File::create(&path).unwrap()).unwrap();
    let values: Vec<u16> = little.as_chunks().0.iter().map(|b| u16::from_le_bytes(*b)).collect();
    for page in values.chunks(20 * 17) {
        encoder.write_image::<tiff::encoder::colortype::Gray16>(20, 17, page).unwrap();
    }
    drop(encoder);
    assert!(same_files(&path, &options, 60.0, Sense::Above) > 3);

    let refused = |path: &Path| Planes::open(path, &options).unwrap_err().to_string();
    assert!(
        refused(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/brain_24.nii.gz"))
            .contains("compressed")
    );
    assert!(
        refused(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/lzw.tif")).contains("compressed")
    );
    assert!(
        refused(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/big_tiled.tif")).contains("in parts")
    );
    let text = head.replace("raw", "text") + "\n1 2 3\n";
    assert!(refused(&write("text.nrrd", text.as_bytes())).contains("text"));
}

/// The real volumes, which lie beside the repository where somebody has put them there.
#[test]
fn the_real_ones() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/volumes");
    for (name, iso) in [("shell_225x128x128.tif", 60.0), ("bone_128x128x128.tif", 128.0)] {
        let path = folder.join(name);
        if path.exists() {
            assert!(same_files(&path, &OpenOptions::default(), iso, Sense::Above) > 9);
        }
    }
    for (name, brain, iso) in
        common::large_volumes().into_iter().take(1).chain([("small", common::small_brain(), 30.0)])
    {
        // Unpacked.
        let dir = TempDir::new().unwrap();
        let path = dir.path().join("brain.raw");
        fs::write(&path, brain.values().bytes()).unwrap();
        let layout = RawLayout::new(brain.grid().points().to_array(), brain.values().scalar());
        let options = OpenOptions { raw: Some(layout), ..OpenOptions::default() };
        assert!(same_files(&path, &options, iso, Sense::Above) >= 3, "{name}");
    }
}

/// What a layer's triangles name of the next is counted, too. Goes red when the window is not.
#[test]
fn the_window_of_vertices_keeps_to_the_budget() {
    let dir = TempDir::new().unwrap();
    let out = TempDir::new().unwrap();
    let (path, options) = raw(&dir, [257, 257, 18], Scalar::U8, Endian::Little, 2);
    for ending in ["ply", "stl"] {
        let to = out.path().join("a").with_extension(ending);
        let extract = |memory_budget| {
            let settings = Options { memory_budget, ..Options::new(1.5) };
            extract_planes(&mut Planes::open(&path, &options).unwrap(), &settings, &to, &|_| {})
        };
        let over = |result| match result {
            Err(PlanesError::Extract(ExtractError::Budget { what, needed, .. })) => (what, needed),
            other => panic!("{other:?}"),
        };
        let (slab, least) = over(extract(0));
        let (vertices, needed) = over(extract(least));
        assert!(slab.contains("slab") && vertices.contains("vertices"), "{slab} {vertices}");
        assert_eq!(fs::read_dir(&out).unwrap().count(), 0, "something is left behind");
        let report = extract(needed).unwrap();
        assert!(least < report.peak_bytes && report.peak_bytes <= needed, "{report:?}, {needed}");
        fs::remove_file(&to).unwrap();
    }
}

#[test]
fn what_goes_wrong_leaves_nothing() {
    let dir = TempDir::new().unwrap();
    let (path, options) = raw(&dir, [20, 17, 64], Scalar::U16, Endian::Little, 1);
    let full = fs::metadata(&path).unwrap().len();
    let target = dir.path().join("made.ply");
    let settings = Options::new(60.0);
    let file = fs::File::options().write(true).open(&path).unwrap();

    // Cut short after it was opened.
    let mut planes = Planes::open(&path, &options).unwrap();
    file.set_len(full / 2).unwrap();
    let error = extract_planes(&mut planes, &settings, &target, &|_| {}).unwrap_err();
    assert!(matches!(error, PlanesError::Read(OpenError::Truncated { .. })), "{error}");
    // Before it was opened.
    assert!(matches!(Planes::open(&path, &options), Err(OpenError::Truncated { .. })));
    file.set_len(full).unwrap();

    let mut planes = Planes::open(&path, &options).unwrap();
    let wrong = |path: &Path, settings: &Options| {
        let mut planes = Planes::open(&path.with_file_name("u16little1.raw"), &options).unwrap();
        extract_planes(&mut planes, settings, path, &|_| {}).unwrap_err().to_string()
    };
    assert!(wrong(&dir.path().join("a.obj"), &settings).contains("only .ply and .stl"));
    assert!(wrong(&target, &Options::new(f32::NAN)).contains("finite"));
    fs::write(&target, "older").unwrap();
    #[cfg(unix)]
    {
        let link = dir.path().join("full.ply");
        std::os::unix::fs::symlink("/dev/full", &link).unwrap();
        assert!(wrong(&link, &settings).contains("no room"));
        fs::remove_file(&link).unwrap();
    }
    assert_eq!(fs::read(&target).unwrap(), b"older");
    assert_eq!(fs::read_dir(&dir).unwrap().count(), 2, "something is left behind");
    extract_planes(&mut planes, &settings, &target, &|_| {}).unwrap();
    assert!(fs::metadata(&target).unwrap().len() > 1000);
}

/// A raw volume of zeros, which take no room on the disk, with a ball of ones: 200 MB.
fn ball(path: &Path) -> [u32; 3] {
    use std::io::{Seek, SeekFrom};
    let dims = [512, 512, 800];
    let mut file = fs::File::create(path).unwrap();
    file.set_len(512 * 512 * 800).unwrap();
    for z in 300..500_i32 {
        for y in 156..356_i32 {
            let square = 100 * 100 - (z - 400).pow(2) - (y - 256).pow(2);
            if square > 0 {
                let half = f64::from(square).sqrt() as u64;
                let at = (z as u64 * 512 + y as u64) * 512 + 256 - half;
                file.seek(SeekFrom::Start(at)).unwrap();
                file.write_all(&vec![1; 2 * half as usize]).unwrap();
            }
        }
    }
    dims
}

/// What the program itself takes: code, stacks, the allocator's rest.
const PROGRAM_BYTES: u64 = 40 << 20;

/// Goes red when a window is as large as the volume.
#[test]
#[cfg(target_os = "linux")]
fn the_program_keeps_its_budget() {
    let dir = TempDir::new().unwrap();
    let (path, budget) = (dir.path().join("ball.raw"), 48_u64 << 20);
    let dims = ball(&path).map(|n| n.to_string()).join(",");
    let arguments = |out: &str, budget: u64| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isoforge"));
        command.args(["extract", "ball.raw", "--dims", &dims, "--type", "u8", "-I", "0.5", "-o", out]);
        command.args(["--memory-budget", &budget.to_string(), "--stats", "stats.json", "--backend", "cpu"]);
        command.current_dir(dir.path()).stderr(std::process::Stdio::piped());
        command
    };
    let mut child = arguments("parts.ply", budget).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().unwrap().is_none() {
        let text = fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let bytes =
            line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok()).unwrap_or(0) << 10;
        peak = peak.max(bytes);
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("a part at a time"), "{said}");
    assert!(peak > 1 << 20 && peak <= budget + PROGRAM_BYTES, "{peak} bytes");
    let stats: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(dir.path().join("stats.json")).unwrap()).unwrap();
    assert!(
        stats["peak_bytes"].as_u64().unwrap() <= budget && stats["slabs"].as_u64().unwrap() > 10,
        "{stats}"
    );
    assert!(arguments("whole.ply", 4 << 30).status().unwrap().success());
    assert!(
        fs::read(dir.path().join("parts.ply")).unwrap() == fs::read(dir.path().join("whole.ply")).unwrap()
    );

    // What needs more of it than a part is refused, with what would do.
    for (more, why) in [
        (&["--png", "a.png"][..], "--png needs the whole mesh"),
        (&["--sharp"], "--sharp needs"),
        (&["--backend", "gpu"], "--backend gpu needs"),
        (&["-o", "a.obj"], "only .ply and .stl"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isoforge"));
        command.args(["extract", "ball.raw", "--dims", &dims, "--type", "u8", "-I", "0.5"]);
        if more[0] != "-o" {
            command.args(["-o", "a.ply"]);
        }
        command.args(["--memory-budget", "48M"]).args(more).current_dir(dir.path());
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            output.status.code() == Some(1) && said.contains(why) && said.contains("--memory-budget"),
            "{said}"
        );
    }
    let output = arguments("a.ply", 1 << 20).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("smallest slab"), "{said}");
    // The figure told suffices.
    let needed = said.split("needs ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a figure");
    let output = arguments("a.ply", needed.parse().expect("a number")).output().unwrap();
    assert!(output.status.success(), "{needed}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A volume that fits the budget, with a mesh that does not, is read in parts, too.
#[test]
fn a_mesh_over_the_budget_goes_out_in_parts() {
    let dir = TempDir::new().unwrap();
    let mut random = Random(5);
    let noise: Vec<u8> = (0..100_u32.pow(3)).map(|_| random.next() as u8).collect();
    fs::write(dir.path().join("noise.raw"), &noise).unwrap();
    let mut packed = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 100 100 100\nencoding: gzip\n\n".to_vec();
    let mut encoder = flate2::write::GzEncoder::new(&mut packed, flate2::Compression::fast());
    encoder.write_all(&noise).unwrap();
    encoder.finish().unwrap();
    fs::write(dir.path().join("noise.nrrd"), packed).unwrap();

    let run = |file: &str, budget: &str, more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_isoforge"));
        command.args(["extract", file, "-I", "128", "--memory-budget", budget]).args(more);
        if file.ends_with(".raw") {
            command.args(["--dims", "100,100,100", "--type", "u8"]);
        }
        let output = command.current_dir(dir.path()).output().unwrap();
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    for ending in ["ply", "stl"] {
        let [whole, parts] = ["whole", "parts"].map(|name| format!("{name}.{ending}"));
        let (code, said) = run("noise.raw", "1G", &["-o", &whole, "--backend", "cpu"]);
        assert!(code == Some(0) && !said.contains("a part at a time"), "{said}");
        let (code, said) = run("noise.raw", "16M", &["-o", &parts]);
        assert!(code == Some(0) && said.contains("the mesh") && said.contains("a part at a time"), "{said}");
        assert!(fs::read(dir.path().join(whole)).unwrap() == fs::read(dir.path().join(parts)).unwrap());
    }
    for (file, more, why) in [
        ("noise.raw", &["-o", "a.obj"][..], "only .ply and .stl"),
        ("noise.raw", &["-o", "a.ply", "--no-degenerate"], "--no-degenerate needs the whole mesh"),
        ("noise.raw", &["-o", "a.ply", "--track"], "--track needs the whole volume"),
        ("noise.nrrd", &["-o", "a.ply"], "uncompressed"),
    ] {
        let (code, said) = run(file, "16M", more);
        assert!(code == Some(1) && said.contains(why) && said.contains("raise"), "{said}");
        assert!(!said.contains("coarsen") && !dir.path().join(more[1]).exists(), "{said}");
    }
}
