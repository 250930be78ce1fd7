use crate::*;

pub const TYPES: [(Scalar, &[&str]); 8] = [
    (Scalar::U8, &["uchar", "unsigned char", "uint8", "uint8_t"]),
    (Scalar::I8, &["signed char", "int8", "int8_t"]),
    (Scalar::U16, &["ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"]),
    (Scalar::I16, &["short", "short int", "signed short", "signed short int", "int16", "int16_t"]),
    (Scalar::U32, &["uint", "unsigned int", "uint32", "uint32_t"]),
    (Scalar::I32, &["int", "signed int", "int32", "int32_t"]),
    (Scalar::F32, &["float"]),
    (Scalar::F64, &["double"]),
];

pub fn header(type_name: &str, encoding: &str, endian: Endian, more: &str) -> String {
    format!(
        "NRRD0004\n# made by hand\ntype: {type_name}\ndimension: 3\nsizes: 5 4 3\nendian: {endian}\n\
         encoding: {encoding}\n{more}"
    )
}

fn u8_file(more: &str) -> Vec<u8> {
    attach(&header("uchar", "raw", Endian::Little, more), &data())
}

fn data() -> Vec<u8> {
    encode(&values(Scalar::U8), Scalar::U8, Endian::Little)
}

pub fn attach(header: &str, data: &[u8]) -> Vec<u8> {
    [header.as_bytes(), b"\n", data].concat()
}

#[test]
fn every_type_name_order_and_encoding_attached_and_detached() {
    for (scalar, names) in TYPES {
        for name in names {
            for endian in ORDERS {
                let data = encode(&values(scalar), scalar, endian);
                let text: Vec<String> = values(scalar).iter().map(f64::to_string).collect();
                let text = text.chunks(5).map(|row| row.join(" ")).collect::<Vec<_>>().join("\n");
                let encodings: [(&str, Vec<u8>); 5] = [
                    ("raw", data.clone()),
                    ("gzip", gzip(&data)),
                    ("gz", gzip(&data)),
                    ("ascii", text.clone().into_bytes()),
                    ("text", text.into_bytes()),
                ];
                for (encoding, data) in encodings {
                    let dir = TempDir::new().unwrap();
                    let spacings = "spacings: 0.5 2 3\n";
                    let head = header(name, encoding, endian, spacings);
                    let attached = write(&dir, "a.nrrd", &attach(&head, &data));
                    write(&dir, "the data.raw", &data);
                    let head = head + "Data File: the data.raw\n";
                    let detached = write(&dir, "a.NHDR", head.replace('\n', "\r\n").as_bytes());
                    for path in [attached, detached] {
                        let opened = open(&path).unwrap();
                        assert_values(&opened, &values(scalar));
                        // Text may hold any number, whatever the type says.
                        let in_memory = if encoding.ends_with('t') || encoding == "ascii" {
                            Scalar::F32
                        } else {
                            kept(scalar)
                        };
                        assert_eq!(opened.volume.values().scalar(), in_memory);
                        assert_plain_grid(&opened, [0.0; 3], [0.5, 2.0, 3.0]);
                        assert_eq!(opened.notes, [""; 0]);
                    }
                }
            }
        }
    }
}

#[test]
fn space_directions_and_origin_place_the_grid() {
    let more = "space: left-posterior-superior\nspace directions: (-0.8, 0.6, 0) (0.6,0.8,0.25) (0.1,0,2)\n\
                space origin: (-90,126.5,-72)\nkinds: domain domain domain\nkey:=value: with colon\n\
                measurement frame: (1,0,0) (0,1,0) (0,0,1)\nspace units: \"mm\" \"mm\" \"mm\"\ncontent: a: b\n";
    let opened = open_bytes("a.nrrd", &u8_file(more)).unwrap();
    assert_grid(&opened, [-90.0, 126.5, -72.0], [[-0.8, 0.6, 0.0], [0.6, 0.8, 0.25], [0.1, 0.0, 2.0]]);
    assert!(opened.volume.grid().is_mirrored());
    assert_eq!(opened.notes, [""; 0]);
    // The user's spacing goes along the file's axes, from the file's origin.
    let opened = open_spaced("a.nrrd", &u8_file(more), [2.0, 1.0, 3.0]).unwrap();
    let y = Vec3::new(0.6, 0.8, 0.25).normalize().to_array();
    let z = (3.0 * Vec3::new(0.1, 0.0, 2.0).normalize()).to_array();
    assert_grid(&opened, [-90.0, 126.5, -72.0], [[-1.6, 1.2, 0.0], y, z]);
    for bad in [0.0, f32::NAN] {
        let refused = open_spaced("a.nrrd", &u8_file(more), [1.0, bad, 1.0]).map(|o| o.notes).unwrap_err();
        assert!(refused.to_string().contains("the spacing that was given"), "{refused}");
    }
}

#[test]
fn axis_borders_place_the_grid() {
    let opened = open_bytes("a.nrrd", &u8_file("spacings: 1 2 3\naxis mins: 10 20 30\n")).unwrap();
    assert_plain_grid(&opened, [10.0, 20.0, 30.0], [1.0, 2.0, 3.0]);
    // From border to border for cells, from sample to sample for nodes.
    let more = "axismins: 0 0 0\naxis maxs: 10 12 2\ncenterings: cell node ???\n";
    let opened = open_bytes("a.nrrd", &u8_file(more)).unwrap();
    assert_plain_grid(&opened, [1.0, 0.0, 0.0], [2.0, 4.0, 1.0]);
    let opened = open_bytes("a.nrrd", &u8_file("spacings: 1 nan 3\n")).unwrap();
    assert_plain_grid(&opened, [0.0; 3], [1.0, 1.0, 3.0]);
    assert_eq!(opened.notes, ["the spacing along y is unknown (nan); 1 is used"]);
    let opened = open_bytes("a.nrrd", &u8_file("")).unwrap();
    assert!(opened.notes[0].contains("no spacing"), "{:?}", opened.notes);
}

#[test]
fn a_fourth_axis_of_one_sample_is_dropped() {
    let four = |sizes: &str, more: &str| {
        let head = header("uchar", "raw", Endian::Little, more);
        attach(&head.replace("dimension: 3", "dimension: 4").replace("5 4 3", sizes), &data())
    };
    let directions = "space directions: none (1,0,0) (0,2,0) (0,0,3)\n";
    for (sizes, more) in [
        ("1 5 4 3", directions),
        ("1 5 4 3", "spacings: nan 1 2 3\n"),
        ("5 4 3 1", "spacings: 1 2 3 nan\n"),
        ("5 1 4 3", "spacings: 1 nan 2 3\nkinds: domain vector domain domain\n"),
    ] {
        let opened = open_bytes("a.nrrd", &four(sizes, more)).unwrap();
        assert_eq!(opened.volume.grid().points().to_array(), [5, 4, 3]);
        assert_plain_grid(&opened, [0.0; 3], [1.0, 2.0, 3.0]);
        assert_values(&opened, &values(Scalar::U8));
    }
    assert!(refusal("a.nrrd", &four("2 5 3 2", directions)).contains("fourth axis"));
    assert!(refusal("a.nrrd", &four("5 3 2 2", "spacings: 1 1 1 1\n")).contains("fourth axis"));
    assert!(refusal("a.nrrd", &u8_file("kinds: 3-color domain domain\n")).contains("axis 0"));
}

#[test]
fn lines_and_bytes_are_skipped() {
    let dir = TempDir::new().unwrap();
    let detached = |name: &str, more: &str, data: &[u8]| {
        write(&dir, "values", data);
        let head = header("uchar", name, Endian::Little, "spacings: 1 1 1\ndatafile: values\n") + more;
        open(&write(&dir, "a.nhdr", head.as_bytes()))
    };
    let raw = [b"one\ntwo\nabc", &data()[..]].concat();
    let read = detached("raw", "line skip: 2\nbyte skip: 3\n", &raw).unwrap();
    assert_values(&read, &values(Scalar::U8));
    let read = detached("raw", "byteskip: -1\n", &raw).unwrap();
    assert_values(&read, &values(Scalar::U8));
    // Lines are those of the compressed file, bytes those of its contents.
    let packed = [b"one\n".to_vec(), gzip(&[b"abc", &data()[..]].concat())].concat();
    let read = detached("gzip", "lineskip: 1\nbyte skip: 3\n", &packed).unwrap();
    assert_values(&read, &values(Scalar::U8));

    let message = detached("gzip", "byte skip: -1\n", &packed).unwrap_err().to_string();
    assert!(message.contains("line 10") && message.contains("-1"), "{message}");
    assert!(detached("raw", "line skip: 99\n", &raw).unwrap_err().to_string().contains("lines to skip"));
    assert!(detached("raw", "byte skip: 12\n", &raw).unwrap_err().to_string().contains("the values need"));
    assert!(detached("raw", "byte skip: -2\n", &raw).unwrap_err().to_string().contains("-1 or more"));
    let message = detached("raw", "byte skip: 10\n", &raw).unwrap().notes.concat();
    assert_eq!(message, "1 bytes after the values are ignored");
    let message = detached("raw", "", &raw[..50]).unwrap_err().to_string();
    assert!(message.contains("values: the values need 60 bytes"), "the data file is named: {message}");
}

#[test]
fn many_data_files_are_refused() {
    for list in ["LIST\na.raw\nb.raw", "LIST 2\na.raw", "slice%03d.raw 1 3 1"] {
        let message = refusal(
            "a.nhdr",
            header("uchar", "raw", Endian::Little, &format!("data file: {list}\n")).as_bytes(),
        );
        assert!(message.contains("of data files"), "{message}");
    }
    let message =
        open_bytes("a.nhdr", header("uchar", "raw", Endian::Little, "data file: gone.raw\n").as_bytes());
    assert!(message.unwrap_err().to_string().contains("gone.raw: cannot be read"));
    let message = refusal("a.nhdr", header("uchar", "raw", Endian::Little, "").as_bytes());
    assert!(message.contains("data file"), "{message}");
}

/// A name that begins as the list's word does: what follows it in the header is read.
#[test]
fn a_file_may_be_called_list_of_something() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("LISTEN.raw"), [7; 60]).unwrap();
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 5 4 3\nencoding: raw\ndata file: LISTEN.raw\nspacings: 1 1 5\n";
    std::fs::write(folder.path().join("a.nhdr"), text).unwrap();
    let opened = open(&folder.path().join("a.nhdr")).unwrap();
    assert_plain_grid(&opened, [0.0; 3], [1.0, 1.0, 5.0]);
}

#[test]
fn wrong_fields_are_named_with_their_line() {
    let good = header("short", "raw", Endian::Little, "spacings: 1 1 1\n");
    let swap = |from: &str, to: &str| refusal("a.nrrd", &attach(&good.replace(from, to), &[0; 120]));
    assert!(swap("NRRD0004", "NRRD0009").contains("line 1"));
    assert!(swap("type: short", "type: block").contains("line 3: the type \"block\""));
    assert!(swap("type: short", "type: long long").contains("long long"));
    assert!(swap("type: short\n", "").contains("no field \"type\""));
    assert!(swap("sizes: 5 4 3\n", "").contains("no field \"sizes\""));
    assert!(swap("encoding: raw\n", "").contains("no field \"encoding\""));
    assert!(swap("endian: little\n", "").contains("no field \"endian\""));
    assert!(swap("endian: little", "endian: odd").contains("line 6: the field \"endian\" is \"odd\""));
    assert!(swap("encoding: raw", "encoding: bzip2").contains("line 7: the encoding \"bzip2\""));
    assert!(swap("dimension: 3", "dimension: 2").contains("line 4"));
    assert!(swap("dimension: 3", "dimension: three").contains("line 4"));
    assert!(swap("sizes: 5 4 3", "sizes: 5 4").contains("line 5"));
    assert!(swap("sizes: 5 4 3", "sizes: 5 -4 3").contains("line 5"));
    assert!(swap("sizes: 5 4 3", "sizes: 5 0 3").contains("line 5"));
    assert!(swap("sizes: 5 4 3", "sizes: 5 4 1").contains("at least 2"));
    assert!(swap("sizes: 5 4 3", "sizes: 99999999999999 99999999999999 2").contains("do not fit"));
    assert!(swap("sizes: 5 4 3", "sizes: 5 4 4").contains("only 120"));
    assert!(swap("spacings: 1 1 1", "spacings: 1 1").contains("line 8"));
    assert!(swap("spacings: 1 1 1", "spacings: 1 1 one").contains("line 8"));
    assert!(swap("spacings: 1 1 1", "spacings: 1 1 0").contains("spacings"));
    assert!(swap("spacings: 1 1 1", "sizes: 5 4 3").contains("lines 5 and 8"));
    assert!(swap("spacings: 1 1 1", "what is this").contains("line 8"));
    assert!(swap("spacings: 1 1 1", "space directions: (1,0) (0,1) (0,0)").contains("line 8"));
    assert!(swap("spacings: 1 1 1", "space directions: (1,0,0) (0,1,0)").contains("line 8"));
    assert!(swap("spacings: 1 1 1", "space directions: (1,0,0) (0,1,0) (1,1,0)").contains("line 8"));
    assert!(swap("spacings: 1 1 1", "space directions: none (0,1,0) (1,1,0)").contains("line 8"));
    let notes = open_bytes("a.nrrd", &attach(&good.replace("spacings", "wat: 7\nspacings"), &[0; 120]))
        .unwrap()
        .notes;
    assert_eq!(notes, ["line 8: the unknown field \"wat\" is ignored"]);
}

#[test]
fn wrong_text_is_refused() {
    let text = |text: &str| {
        refusal("a.nrrd", &attach(&header("float", "ascii", Endian::Little, ""), text.as_bytes()))
    };
    assert!(text(&"1 ".repeat(59)).contains("only 59 numbers"));
    assert!(text("1 2").contains("only 2 numbers"));
    assert!(text(&"1 ".repeat(61)).contains("more numbers than the 60"));
    assert!(text(&"1 x ".repeat(30)).contains("value 1 is \"x\""));
}

#[test]
fn a_header_without_end_is_refused() {
    let endless = header("uchar", "raw", Endian::Little, &"# more\n".repeat(200_000));
    assert!(refusal("a.nrrd", endless.as_bytes()).contains("does not end"));
}
