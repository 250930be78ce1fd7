use crate::*;
use flate2::write::ZlibEncoder;

#[derive(Clone, Copy, PartialEq)]
pub enum Packing {
    None,
    Deflate,
    PackBits,
}

/// A classic TIFF file, a directory a page, written entry by entry.
#[derive(Clone)]
pub struct Tiff {
    pub scalar: Scalar,
    pub endian: Endian,
    pub size: [u32; 2],
    pub pages: Vec<Vec<u8>>,
    pub packing: Packing,
    pub strips: u32,
    pub photometric: u16,
    pub description: Option<Vec<u8>>,
    pub resolution: Option<[u32; 2]>,
    pub resolution_unit: u16,
    /// Replaces values of tags: (page, tag, value).
    pub patches: Vec<(usize, u16, u32)>,
}

impl Tiff {
    pub fn new(scalar: Scalar, endian: Endian) -> Self {
        let data = encode(&values(scalar), scalar, endian);
        Self {
            scalar,
            endian,
            size: [5, 4],
            pages: data.chunks(20 * scalar.size()).map(<[u8]>::to_vec).collect(),
            packing: Packing::None,
            strips: 1,
            photometric: 1,
            description: None,
            resolution: None,
            resolution_unit: 1,
            patches: Vec::new(),
        }
    }

    pub fn imagej(description: &str) -> Self {
        let description = Some(format!("ImageJ=1.53t\n{description}\0").into_bytes());
        Self { description, ..Self::new(Scalar::U16, Endian::Big) }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let order = |bytes: &[u8]| -> Vec<u8> {
            if self.endian == Endian::Big { bytes.iter().rev().copied().collect() } else { bytes.to_vec() }
        };
        let short = |v: u16| order(&v.to_le_bytes());
        let long = |v: u32| order(&v.to_le_bytes());
        let mut out = if self.endian == Endian::Big { b"MM".to_vec() } else { b"II".to_vec() };
        out.extend(short(42));
        let mut link = out.len();
        out.extend(long(0));
        let put = |out: &mut Vec<u8>, bytes: &[u8]| {
            let at = out.len() as u32;
            out.extend(bytes);
            at
        };
        for (number, page) in self.pages.iter().enumerate() {
            let rows = self.size[1].div_ceil(self.strips);
            let strip = rows as usize * self.size[0] as usize * self.scalar.size();
            let strips: Vec<Vec<u8>> = page.chunks(strip).map(|s| self.pack(s)).collect();
            let offsets: Vec<u32> = strips.iter().map(|s| put(&mut out, s)).collect();
            let list = |out: &mut Vec<u8>, list: &[u32]| match list {
                [one] => *one,
                _ => put(out, &list.iter().flat_map(|v| long(*v)).collect::<Vec<u8>>()),
            };
            let offset = list(&mut out, &offsets);
            let counts = list(&mut out, &strips.iter().map(|s| s.len() as u32).collect::<Vec<_>>());
            let format = match self.scalar {
                Scalar::U8 | Scalar::U16 | Scalar::U32 => 1,
                Scalar::I8 | Scalar::I16 | Scalar::I32 => 2,
                Scalar::F32 | Scalar::F64 => 3,
            };
            let compression = match self.packing {
                Packing::None => 1,
                Packing::Deflate => 8,
                Packing::PackBits => 32773,
            };
            // Tag, type (2 text, 3 short, 4 long, 5 rational), count, value or place.
            let mut tags: Vec<(u16, u16, u32, u32)> = vec![
                (256, 4, 1, self.size[0]),
                (257, 4, 1, self.size[1]),
                (258, 3, 1, 8 * self.scalar.size() as u32),
                (259, 3, 1, compression),
                (262, 3, 1, u32::from(self.photometric)),
                (273, 4, offsets.len() as u32, offset),
                (277, 3, 1, 1),
                (278, 4, 1, rows),
                (279, 4, offsets.len() as u32, counts),
                (284, 3, 1, 1),
                (339, 3, 1, format),
            ];
            if let Some(description) = self.description.as_ref().filter(|_| number == 0) {
                tags.push((270, 2, description.len() as u32, put(&mut out, description)));
            }
            if let Some([over, under]) = self.resolution {
                let at = put(&mut out, &[long(over), long(under)].concat());
                tags.extend([(282, 5, 1, at), (283, 5, 1, at), (296, 3, 1, u32::from(self.resolution_unit))]);
            }
            tags.sort();
            let here = long(out.len() as u32);
            out[link..link + 4].copy_from_slice(&here);
            out.extend(short(tags.len() as u16));
            for (tag, kind, count, value) in tags {
                let patch = self.patches.iter().find(|p| (p.0, p.1) == (number, tag));
                let value = patch.map_or(value, |p| p.2);
                out.extend([short(tag), short(kind), long(count)].concat());
                // A short stands in the first bytes of its field.
                out.extend(if kind == 3 { [short(value as u16), vec![0; 2]].concat() } else { long(value) });
            }
            link = out.len();
            out.extend(long(0));
        }
        out
    }

    fn pack(&self, strip: &[u8]) -> Vec<u8> {
        match self.packing {
            Packing::None => strip.to_vec(),
            Packing::Deflate => {
                let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
                encoder.write_all(strip).unwrap();
                encoder.finish().unwrap()
            }
            Packing::PackBits => strip.chunks(128).flat_map(|c| [&[c.len() as u8 - 1], c].concat()).collect(),
        }
    }
}

#[test]
fn every_type_in_either_order_and_packing() {
    for scalar in Scalar::ALL {
        for endian in ORDERS {
            for packing in [Packing::None, Packing::Deflate, Packing::PackBits] {
                for strips in [1, 2, 4] {
                    let file = Tiff { packing, strips, ..Tiff::new(scalar, endian) };
                    let opened = open_bytes("a.TIFF", &file.bytes()).unwrap();
                    assert_eq!(opened.volume.grid().points().to_array(), [5, 4, 3]);
                    assert_values(&opened, &values(scalar));
                    assert_eq!(opened.volume.values().scalar(), kept(scalar));
                    assert_plain_grid(&opened, [0.0; 3], [1.0; 3]);
                    assert_eq!(opened.notes, [""; 0]);
                }
            }
        }
    }
}

#[test]
fn imagej_gives_spacing() {
    let file =
        Tiff { resolution: Some([4, 1]), ..Tiff::imagej("images=3\nslices=3\nunit=\\u00B5m\nspacing=2.5") };
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    assert_plain_grid(&opened, [0.0; 3], [0.25, 0.25, 2.5]);
    assert_values(&opened, &values(Scalar::U16));
    assert_eq!(opened.notes, [""; 0]);
    // Latin-1, as older versions write the micro sign.
    let description = Some(b"ImageJ=1.40\nimages=3\nunit=\xb5m\nspacing=-3.0\nxorigin=2\n\0".to_vec());
    let opened =
        open_bytes("a.tif", &Tiff { description: description.clone(), ..file.clone() }.bytes()).unwrap();
    assert_plain_grid(&opened, [-0.5, 0.0, 0.0], [0.25, 0.25, 3.0]);
    // The user's word in its place; the origin is so many pixels away.
    let bytes = Tiff { description: description.clone(), ..file.clone() }.bytes();
    let opened = open_spaced("a.tif", &bytes, [1.0, 1.0, 2.0]).unwrap();
    assert_plain_grid(&opened, [-2.0, 0.0, 0.0], [1.0, 1.0, 2.0]);
    // The same resolution without the tag: nobody says what its unit is to z.
    let opened = open_bytes("a.tif", &Tiff { description: None, ..file.clone() }.bytes()).unwrap();
    assert_plain_grid(&opened, [0.0; 3], [1.0; 3]);
    // What other programs say of a stack is not understood, which is told.
    for (description, by) in
        [("<?xml?><OME><Image/></OME>", "OME-XML"), ("{\"shape\": [3, 4, 5]}", "tifffile")]
    {
        let file = Tiff { description: Some(description.as_bytes().to_vec()), ..file.clone() };
        let opened = open_bytes("a.tif", &file.bytes()).unwrap();
        assert!(opened.notes.concat().contains(by), "{:?}", opened.notes);
        assert_plain_grid(&opened, [0.0; 3], [1.0; 3]);
    }
    // No spacing along z.
    let file = Tiff { resolution: Some([4, 1]), ..Tiff::imagej("images=3\n") };
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    assert_plain_grid(&opened, [0.0; 3], [0.25, 0.25, 1.0]);
    assert_eq!(opened.notes, ["the ImageJ tag has no spacing along z; 1 is used"]);
    // 72 dots an inch are nobody's choice; 0 and infinity nobody's either.
    let file = Tiff { resolution: Some([72, 1]), resolution_unit: 2, ..file };
    assert_plain_grid(&open_bytes("a.tif", &file.bytes()).unwrap(), [0.0; 3], [1.0; 3]);
    for odd in [[0, 1], [1, 0], [0, 0]] {
        let file = Tiff { resolution: Some(odd), ..file.clone() };
        let opened = open_bytes("a.tif", &file.bytes()).unwrap();
        assert_plain_grid(&opened, [0.0; 3], [1.0; 3]);
        assert!(opened.notes[0].contains("resolution along x"), "{:?}", opened.notes);
    }
}

#[test]
fn imagej_stacks_with_one_directory_are_read_on() {
    for endian in ORDERS {
        let mut file = Tiff { endian, ..Tiff::imagej("images=3\nslices=3\n") };
        let data = encode(&values(Scalar::U16), Scalar::U16, endian);
        file.pages.truncate(1);
        file.pages[0] = data.clone();
        // The strip holds all three pages; rows and sizes tell of one.
        file.size[1] = 12;
        file.patches = vec![(0, 257, 4), (0, 278, 4), (0, 279, 40)];
        let opened = open_bytes("a.tif", &file.bytes()).unwrap();
        assert_eq!(opened.volume.grid().points().to_array(), [5, 4, 3]);
        assert_values(&opened, &values(Scalar::U16));
        file.description = Some(b"ImageJ=1.53t\nimages=300000\n\0".to_vec());
        assert!(refusal("a.tif", &file.bytes()).contains("the values need"));
        file.description = Some(b"ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\n\0".to_vec());
        assert!(refusal("a.tif", &file.bytes()).contains("more than one channel"));
        file.description = Some(b"ImageJ=1.53t\nimages=3\n\0".to_vec());
        file.patches.push((0, 259, 8));
        assert!(refusal("a.tif", &file.bytes()).contains("compression"));
    }
}

#[test]
fn imagej_hyperstacks_give_their_first_channel_and_frame() {
    let mut file = Tiff::imagej("images=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\n");
    let page = |n: u16| vec![[n.to_be_bytes(); 20].concat()];
    file.pages = (0..12).flat_map(page).collect();
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    let expected: Vec<f64> = [0.0, 2.0, 4.0].iter().flat_map(|v| [*v; 20]).collect();
    assert_values(&opened, &expected);
    let said = ["2 channels in the file; channel 0 is read", "2 frames in the file; frame 0 is read"];
    assert_eq!(opened.notes, said);

    let mut file = Tiff::imagej("images=3\nframes=3\n");
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    assert_values(&opened, &values(Scalar::U16));
    assert_eq!(opened.notes, ["the 3 pages are marked as frames; they are read as slices"]);
    file.description = Some(b"ImageJ=1.53t\nimages=3\nchannels=3\n".to_vec());
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    assert_values(&opened, &values(Scalar::U16));
    assert_eq!(opened.notes, ["the 3 pages are marked as channels; they are read as slices"]);
    file.description = Some(b"ImageJ=1.53t\nimages=8\nchannels=4\nslices=2\n".to_vec());
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    assert_values(&opened, &values(Scalar::U16));
    assert_eq!(opened.notes.len(), 2);
}

#[test]
fn imagej_calibration_is_applied() {
    // How ImageJ stores signed 16-bit values.
    let file = Tiff::imagej("images=3\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=Gray Value\n");
    let opened = open_bytes("a.tif", &file.bytes()).unwrap();
    let expected: Vec<f64> = values(Scalar::U16).iter().map(|v| v - 32768.0).collect();
    assert_values(&opened, &expected);
    assert_eq!(opened.notes.len(), 1);
    let opened = open_bytes("a.tif", &Tiff::imagej("images=3\ncf=20\nc0=1\nc1=2\n").bytes()).unwrap();
    assert_values(&opened, &values(Scalar::U16));
    assert_eq!(opened.notes, ["ImageJ's calibration function 20 is not applied"]);
}

#[test]
fn white_is_zero_keeps_the_stored_values() {
    for scalar in [Scalar::U8, Scalar::U16, Scalar::U32] {
        for packing in [Packing::None, Packing::Deflate] {
            let file = Tiff { photometric: 0, packing, ..Tiff::new(scalar, Endian::Big) };
            let opened = open_bytes("a.tif", &file.bytes()).unwrap();
            assert_values(&opened, &values(scalar));
            assert_eq!(opened.notes.len(), 1);
        }
    }
    let file = Tiff { photometric: 0, ..Tiff::new(Scalar::F32, Endian::Big) };
    assert!(refusal("a.tif", &file.bytes()).contains("WhiteIsZero"));
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let good = Tiff::new(Scalar::U16, Endian::Little);
    let patched = |page, tag, value| {
        refusal("a.tif", &Tiff { patches: vec![(page, tag, value)], ..good.clone() }.bytes())
    };
    assert!(patched(1, 256, 4).contains("page 1 (from 0) is 4 x 4 of type u16, but page 0 is 5 x 4"));
    assert!(patched(2, 339, 2).contains("page 2 (from 0) is 5 x 4 of type i16"));
    assert!(patched(0, 262, 2).contains("RGB"));
    assert!(patched(0, 262, 3).contains("palette"));
    assert!(patched(0, 339, 3).contains("floating-point values of 16 bits"));
    assert!(patched(0, 258, 4).contains("unsigned values of 4 bits"));
    assert!(patched(0, 259, 4).contains("page 1"));
    assert!(patched(0, 259, 50000).contains("page 1"));
    let all = |tag, value| {
        let patches = (0..3).map(|page| (page, tag, value)).collect();
        refusal("a.tif", &Tiff { patches, ..good.clone() }.bytes())
    };
    assert!(all(259, 5).contains("damaged"));
    assert!(all(259, 50000).contains("not supported"));
    assert!(all(256, 1 << 30).contains("the number of samples"));
    assert!(all(256, 1 << 18).contains("the values need"));
    assert!(all(256, 1).contains("at least 2 along each axis"));
    let wide = Tiff {
        packing: Packing::Deflate,
        patches: (0..3).map(|page| (page, 256, 10_000)).collect(),
        ..good.clone()
    };
    assert!(refusal("a.tif", &wide.bytes()).contains("can't hold the 80000"));
    let one = Tiff { pages: good.pages[..1].to_vec(), ..good.clone() };
    assert!(refusal("a.tif", &one.bytes()).contains("5 x 4 x 1"));
    assert!(refusal("a.tif", b"GIF89a............").contains("TIFF"));
    let bytes = good.bytes();
    assert!(refusal("a.tif", &bytes[..bytes.len() - 30]).contains("page 2"));
}

#[test]
fn sizes_that_overflow_are_refused() {
    // Strips times planes go over 32 bits, which the crate multiplies unchecked.
    let patches = vec![(0, 257, u32::MAX), (0, 278, 1), (0, 277, 65535), (0, 284, 2)];
    let file = Tiff { patches, ..Tiff::new(Scalar::U8, Endian::Little) };
    assert!(refusal("a.tif", &file.bytes()).contains("damaged"));
}

/// A directory of 786 KB that follows itself was read 131,000 times.
#[test]
fn directories_that_lead_back_are_refused() {
    let good = Tiff::new(Scalar::U8, Endian::Little).bytes();
    let first = good[4..8].to_vec();
    let mut bytes = good.clone();
    let end = bytes.len() - 4;
    bytes[end..].copy_from_slice(&first);
    assert!(refusal("a.tif", &bytes).contains("lead back"));
    // In a large file the sum of what is read would take long to be too much.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tif");
    std::fs::write(&path, &bytes).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(1 << 30).unwrap();
    let since = std::time::Instant::now();
    assert!(open(&path).unwrap_err().to_string().contains("lead back"));
    assert!(since.elapsed().as_secs() < 10, "{:?}", since.elapsed());

    let mut bytes = b"II*\0\x08\0\0\0\xff\xff".to_vec();
    bytes.resize(bytes.len() + 12 * 65535, 0);
    bytes.extend(8u32.to_le_bytes());
    assert!(refusal("a.tif", &bytes).contains("lead back"));
}

/// Files of other programs, for what the writer above does not do.
#[test]
fn tiles_big_offsets_and_lzw() {
    let values = |value: fn(f64, f64, f64) -> f64| -> Vec<f64> {
        let point = |i: u32| (f64::from(i % 37), f64::from(i / 37 % 20), f64::from(i / 740));
        (0..37 * 20 * 3).map(point).map(|(x, y, z)| value(x, y, z)).collect()
    };
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let opened = open(&data.join("big_tiled.tif")).unwrap();
    assert_eq!(opened.volume.grid().points().to_array(), [37, 20, 3]);
    assert_values(&opened, &values(|x, y, z| x * y - 50.0 * z));
    let opened = open(&data.join("lzw.tif")).unwrap();
    assert_eq!(opened.volume.grid().points().to_array(), [37, 20, 3]);
    assert_values(&opened, &values(|x, y, z| 0.5 * x + y - 0.25 * z));
}

/// Pages of a file with such a description, 4 × 5 samples each; those of page i are i.
fn ome(pages: u16, attributes: &str, inner: &str, more: &str) -> Opened {
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\">\
         <Image ID=\"Image:0\"><Pixels SizeX=\"5\" SizeY=\"4\" Type=\"uint16\" {attributes}>{inner}</Pixels></Image>{more}</OME>"
    );
    let mut file = Tiff::imagej("");
    file.description = Some(text.into_bytes());
    file.pages = (0..pages).map(|i| i.to_be_bytes().repeat(20)).collect();
    open_bytes("a.ome.tif", &file.bytes()).unwrap()
}

/// Which page each slice is.
fn slices(opened: &Opened) -> Vec<f32> {
    let points = opened.volume.grid().points();
    (0..points.z).map(|z| opened.volume.values().get((20 * z) as usize)).collect()
}

#[test]
fn ome_xml_says_which_pages_are_slices_and_how_large_voxels_are() {
    let sizes = "SizeZ='3' SizeC='2' SizeT='2' PhysicalSizeX='0.5' PhysicalSizeY='0.25' PhysicalSizeZ='3'";
    for (order, pages) in [
        ("XYZCT", [0.0, 1.0, 2.0]),
        ("XYZTC", [0.0, 1.0, 2.0]),
        ("XYCZT", [0.0, 2.0, 4.0]),
        ("XYTZC", [0.0, 2.0, 4.0]),
        ("XYCTZ", [0.0, 4.0, 8.0]),
        ("XYTCZ", [0.0, 4.0, 8.0]),
    ] {
        let opened = ome(12, &format!("DimensionOrder='{order}' {sizes}"), "<TiffData/>", "");
        assert_eq!(slices(&opened), pages, "{order}");
        assert_plain_grid(&opened, [0.0; 3], [0.5, 0.25, 3.0]);
        let notes = opened.notes.concat();
        assert!(
            notes.contains("2 channels") && notes.contains("2 frames") && opened.notes.len() == 2,
            "{notes}"
        );
    }
    // One channel and frame, and other units; each page is named.
    let sizes = "SizeZ='3' SizeC='1' SizeT='1' PhysicalSizeX='500' PhysicalSizeXUnit='nm' PhysicalSizeY='0.5' \
                 PhysicalSizeZ='2e-6' PhysicalSizeZUnit='m'";
    let named: String =
        (0..3).map(|z| format!("<TiffData IFD='{z}' FirstZ='{z}' PlaneCount='1'/>")).collect();
    let opened = ome(3, &format!("DimensionOrder='XYCZT' {sizes}"), &named, "");
    assert_plain_grid(&opened, [0.0; 3], [500.0, 500.0, 2000.0]);
    assert_eq!((slices(&opened), opened.notes.len()), (vec![0.0, 1.0, 2.0], 0));
    // A second image behind the first.
    let opened = ome(5, &format!("DimensionOrder='XYZCT' {sizes}"), "", "<Image ID='Image:1'/>");
    assert_eq!(slices(&opened), [0.0, 1.0, 2.0]);
    assert!(opened.notes.concat().contains("2 images"), "{:?}", opened.notes);
}

/// What does not fit its pages is told, and all pages are slices.
#[test]
fn ome_xml_that_does_not_fit() {
    let plain = "DimensionOrder='XYZCT' SizeC='1' SizeT='1'";
    for (attributes, inner, words) in [
        (format!("{plain} SizeZ='4'"), "", "not those"),
        (format!("{plain} SizeZ='3'"), "<TiffData IFD='0' FirstZ='1'/>", "in another order"),
        (format!("{plain} SizeZ='18446744073709551615'"), "", "not those"),
        (format!("{plain} SizeZ='0'"), "", "damaged"),
        ("DimensionOrder='XYZZT' SizeZ='1' SizeC='1' SizeT='3'".to_owned(), "", "damaged"),
        ("DimensionOrder='XYZCT' SizeZ='1' SizeC='3' SizeT='1'".to_owned(), "", "one z"),
        (format!("{plain} SizeZ='3' x"), "", "damaged"),
        // A parser that compares all with all would take an hour.
        (
            format!("{plain} SizeZ='3'{}", (0..600_000).map(|i| format!(" a{i}=''")).collect::<String>()),
            "",
            "damaged",
        ),
        (format!("{plain} SizeZ='3' PhysicalSizeX='-1'"), "", "no size along x"),
        (
            format!("{plain} SizeZ='3' PhysicalSizeX='2' PhysicalSizeY='2' PhysicalSizeYUnit='pixel'"),
            "",
            "along y in pixel",
        ),
    ] {
        let opened = ome(3, &attributes, inner, "");
        assert_eq!(slices(&opened), [0.0, 1.0, 2.0], "{words}");
        assert!(opened.notes.concat().contains(words), "{words}: {:?}", opened.notes);
        assert_eq!(opened.volume.grid().step().col(1).y, 1.0);
    }
}
