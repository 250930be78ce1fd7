use crate::*;

/// A NIfTI-1 file, written field by field from the standard's table.
#[derive(Clone)]
pub struct Nifti {
    pub scalar: Scalar,
    pub endian: Endian,
    pub dim: Vec<i16>,
    pub pixdim: [f32; 4],
    pub scaling: [f32; 2],
    pub sform: Option<[[f32; 4]; 3]>,
    pub qform: Option<[f32; 6]>,
    pub offset: f32,
    pub extra: Vec<u8>,
    pub data: Vec<u8>,
}

impl Nifti {
    pub fn new(scalar: Scalar, endian: Endian) -> Self {
        Self {
            scalar,
            endian,
            dim: vec![5, 4, 3],
            pixdim: [1.0, 0.5, 2.0, 3.0],
            scaling: [0.0, 0.0],
            sform: None,
            qform: None,
            offset: 352.0,
            extra: vec![0; 4],
            data: encode(&values(scalar), scalar, endian),
        }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut out = vec![0; 348];
        let mut put = |at: usize, bytes: Vec<u8>| {
            let bytes = if self.endian == Endian::Big { bytes.into_iter().rev().collect() } else { bytes };
            out[at..at + bytes.len()].copy_from_slice(&bytes);
        };
        let short = |v: i16| v.to_le_bytes().to_vec();
        let float = |v: f32| v.to_le_bytes().to_vec();
        put(0, 348_i32.to_le_bytes().to_vec());
        put(40, short(self.dim.len() as i16));
        for i in 0..7 {
            put(42 + 2 * i, short(self.dim.get(i).copied().unwrap_or(1)));
        }
        let code = match self.scalar {
            Scalar::U8 => 2,
            Scalar::I16 => 4,
            Scalar::I32 => 8,
            Scalar::F32 => 16,
            Scalar::F64 => 64,
            Scalar::I8 => 256,
            Scalar::U16 => 512,
            Scalar::U32 => 768,
        };
        put(70, short(code));
        put(72, short(8 * self.scalar.size() as i16));
        for (i, v) in self.pixdim.iter().enumerate() {
            put(76 + 4 * i, float(*v));
        }
        put(108, float(self.offset));
        put(112, float(self.scaling[0]));
        put(116, float(self.scaling[1]));
        if let Some(q) = self.qform {
            put(252, short(1));
            for (i, v) in q.iter().enumerate() {
                put(256 + 4 * i, float(*v));
            }
        }
        if let Some(rows) = self.sform {
            put(254, short(2));
            for (i, v) in rows.iter().flatten().enumerate() {
                put(280 + 4 * i, float(*v));
            }
        }
        out[344..348].copy_from_slice(b"n+1\0");
        out.extend(&self.extra);
        out.extend(&self.data);
        out
    }
}

#[test]
fn every_type_in_either_order_plain_and_packed() {
    for scalar in Scalar::ALL {
        for endian in ORDERS {
            let bytes = Nifti::new(scalar, endian).bytes();
            for (name, bytes) in [("a.nii", bytes.clone()), ("a.NII.GZ", gzip(&bytes))] {
                let opened = open_bytes(name, &bytes).unwrap();
                assert_eq!(opened.volume.grid().points().to_array(), [5, 4, 3]);
                assert_values(&opened, &values(scalar));
                assert_eq!(opened.volume.values().scalar(), kept(scalar));
                assert_plain_grid(&opened, [0.0; 3], [0.5, 2.0, 3.0]);
                assert_eq!(opened.notes, [""; 0]);
            }
        }
    }
}

#[test]
fn sform_goes_before_qform_and_may_be_oblique_and_left_handed() {
    let rows = [[-0.8, 0.6, 0.1, -90.0], [0.6, 0.8, 0.0, 126.5], [0.0, 0.25, 2.0, -72.0]];
    for endian in ORDERS {
        let file = Nifti { sform: Some(rows), qform: Some([0.0; 6]), ..Nifti::new(Scalar::I16, endian) };
        let opened = open_bytes("a.nii", &file.bytes()).unwrap();
        assert_grid(&opened, [-90.0, 126.5, -72.0], [[-0.8, 0.6, 0.0], [0.6, 0.8, 0.25], [0.1, 0.0, 2.0]]);
        assert!(opened.volume.grid().is_mirrored());
        assert_eq!(opened.volume.grid().origin(), Vec3::new(-90.0, 126.5, -72.0));
    }
}

#[test]
fn qform_turns_scales_and_mirrors() {
    // A quarter turn about z: x goes to y, y goes to -x.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turn = [0.0, 0.0, half, 10.0, 20.0, 30.0];
    let file = Nifti { qform: Some(turn), ..Nifti::new(Scalar::U8, Endian::Little) };
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_grid(&opened, [10.0, 20.0, 30.0], [[0.0, 0.5, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 3.0]]);
    let file = Nifti { pixdim: [-1.0, 0.5, 2.0, 3.0], ..file };
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_grid(&opened, [10.0, 20.0, 30.0], [[0.0, 0.5, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, -3.0]]);
    assert!(opened.volume.grid().is_mirrored());
    // Half a turn about x, a hair too long for a unit quaternion; and qfac 0, which means 1.
    let file =
        Nifti { qform: Some([1.0000001, 0.0, 0.0, 0.0, 0.0, 0.0]), pixdim: [0.0, 0.5, 2.0, 3.0], ..file };
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_grid(&opened, [0.0; 3], [[0.5, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, -3.0]]);
    // An oblique one; the numbers are nibabel 5.4's get_qform().
    let file = Nifti { qform: Some([0.1, -0.2, 0.3, 1.0, 2.0, 3.0]), pixdim: [-1.0, 0.5, 2.0, 3.0], ..file };
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_grid(&opened, [1.0, 2.0, 3.0], OBLIQUE);
}

const OBLIQUE: [[f32; 3]; 3] =
    [[0.37, 0.2582086, 0.2154724], [-1.1928343, 1.6, 0.1309447], [0.9328342, 0.9164171, -2.7]];

#[test]
fn scaling_is_applied_unless_the_slope_says_none() {
    let plain = Nifti::new(Scalar::U8, Endian::Big);
    let read = |scaling| open_bytes("a.nii", &Nifti { scaling, ..plain.clone() }.bytes()).unwrap();
    let scaled: Vec<f64> = values(Scalar::U8).iter().map(|v| v * 0.5 - 1024.0).collect();
    assert_values(&read([0.5, -1024.0]), &scaled);
    assert_eq!(read([0.5, -1024.0]).notes, [""; 0]);
    for none in [[0.0, 9.0], [f32::NAN, f32::NAN], [f32::INFINITY, 0.0], [1.0, 0.0]] {
        assert_values(&read(none), &values(Scalar::U8));
    }
    let odd = read([2.0, f32::NAN]);
    assert_eq!(odd.volume.values().get(0), 0.0);
    assert!(odd.notes[0].contains("scl_inter"), "{:?}", odd.notes);
}

#[test]
fn scaling_is_worked_out_in_double_precision() {
    // In f32 the product would be rounded before the intercept cancels most of it.
    let mut stored = values(Scalar::I32);
    stored[0] = 100_000_001.0;
    let data = encode(&stored, Scalar::I32, Endian::Little);
    let file = Nifti { data, scaling: [1.0, -1.0e8], ..Nifti::new(Scalar::I32, Endian::Little) };
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_eq!(opened.volume.values().get(0), 1.0);
}

#[test]
fn extensions_are_passed_over() {
    let mut file = Nifti::new(Scalar::F32, Endian::Little);
    file.offset = 384.0;
    file.extra = [vec![1, 0, 0, 0], vec![32, 0, 0, 0], vec![77; 28]].concat();
    assert_values(&open_bytes("a.nii.gz", &gzip(&file.bytes())).unwrap(), &values(Scalar::F32));
    file.offset = 0.0;
    file.extra = vec![0; 4];
    assert_values(&open_bytes("a.nii", &file.bytes()).unwrap(), &values(Scalar::F32));
}

#[test]
fn the_first_frame_is_read_and_said() {
    let mut file = Nifti::new(Scalar::I16, Endian::Little);
    file.dim = vec![5, 4, 3, 2, 2];
    file.data = file.data.repeat(4);
    for opened in [open_bytes("a.nii", &file.bytes()), open_bytes("a.nii.gz", &gzip(&file.bytes()))] {
        let opened = opened.unwrap();
        assert_values(&opened, &values(Scalar::I16));
        assert_eq!(opened.notes, ["4 frames in the file; frame 0 is read"]);
    }
}

#[test]
fn leftovers_are_said() {
    let mut file = Nifti::new(Scalar::I16, Endian::Little);
    file.data.extend([0; 5]);
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_eq!(opened.notes, ["5 bytes after the values are ignored"]);
    let packed =
        [gzip(&Nifti::new(Scalar::I16, Endian::Little).bytes()), b"tail of something".to_vec()].concat();
    let opened = open_bytes("a.nii.gz", &packed).unwrap();
    assert_eq!(opened.notes, ["bytes after the compressed data are ignored"]);
}

#[test]
fn gzip_in_several_members_is_one_file() {
    let bytes = Nifti::new(Scalar::F64, Endian::Big).bytes();
    let packed = [gzip(&bytes[..400]), gzip(&bytes[400..])].concat();
    assert_values(&open_bytes("a.nii.gz", &packed).unwrap(), &values(Scalar::F64));
}

#[test]
fn what_is_not_read_is_refused_by_name() {
    let good = Nifti::new(Scalar::U8, Endian::Little);
    let dim = |dim: &[i16]| refusal("a.nii", &Nifti { dim: dim.to_vec(), ..good.clone() }.bytes());
    assert!(dim(&[5, 12]).contains("at least 2 along each axis"));
    assert!(dim(&[5, 12, 1]).contains("at least 2 along each axis"));
    assert!(dim(&[5, 0, 3]).contains("dim[2] is 0"));
    assert!(dim(&[5, -4, 3]).contains("dim[2] is -4"));
    assert!(dim(&[5, 4, 4]).contains("only 60"));
    assert!(dim(&[32767, 32767, 32767]).contains("only 60"));

    let patch = |at: usize, bytes: &[u8]| {
        let mut file = good.bytes();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        refusal("a.nii", &file)
    };
    assert!(patch(70, &[128, 0]).contains("RGB"));
    assert!(patch(70, &[0, 4]).contains("int64"));
    assert!(patch(70, &[32, 0]).contains("complex64"));
    assert!(patch(70, &[3, 0]).contains("datatype 3"));
    assert!(patch(40, &[8, 0]).contains("dim[0]"));
    assert!(patch(0, &[0; 4]).contains("sizeof_hdr"));
    assert!(patch(0, &540_i32.to_le_bytes()).contains("NIfTI-2"));
    assert!(patch(344, b"ni1\0").contains(".hdr and .img"));
    assert!(patch(344, b"what").contains("magic"));
    assert!(patch(108, &f32::NAN.to_le_bytes()).contains("vox_offset"));
    assert!(patch(108, &1e12_f32.to_le_bytes()).contains("only 0"));

    let flat = [[1.0, 0.0, 2.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]];
    let message = refusal("a.nii", &Nifti { sform: Some(flat), ..good.clone() }.bytes());
    assert!(message.contains("sform") && message.contains("no volume"), "{message}");
    // Spacing gives no direction to an axis that has none.
    let none = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]];
    let bytes = Nifti { sform: Some(none), ..good.clone() }.bytes();
    let message = open_spaced("a.nii", &bytes, [1.0, 2.0, 1.0]).unwrap_err().to_string();
    assert!(message.contains("sform"), "{message}");
    let message = refusal("a.nii", &Nifti { qform: Some([f32::NAN; 6]), ..good.clone() }.bytes());
    assert!(message.contains("qform"), "{message}");
}

#[test]
fn odd_voxel_sizes_are_said() {
    let file = Nifti { pixdim: [1.0, 0.0, -2.0, 3.0], ..Nifti::new(Scalar::U8, Endian::Little) };
    let opened = open_bytes("a.nii", &file.bytes()).unwrap();
    assert_plain_grid(&opened, [0.0; 3], [1.0, 2.0, 3.0]);
    assert_eq!(opened.notes.len(), 2);
}

#[test]
fn a_gzip_bomb_is_refused_before_it_grows() {
    // 32767^3 doubles promised by 20 KB.
    let file =
        Nifti { dim: vec![32767; 3], data: vec![0; 1 << 20], ..Nifti::new(Scalar::F64, Endian::Little) };
    let message = refusal("a.nii.gz", &gzip(&file.bytes()));
    assert!(message.contains("unpack to at most"), "{message}");
    // A promise within deflate's reach, not kept.
    let noise = (0..1_u32 << 20).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let file = Nifti { dim: vec![64; 3], data: noise, ..file };
    let message = refusal("a.nii.gz", &gzip(&file.bytes()));
    assert!(message.contains("only 1048576"), "{message}");
}
