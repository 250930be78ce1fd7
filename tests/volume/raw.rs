use crate::*;
use isoforge::volume::RawLayout;

fn layout(scalar: Scalar) -> RawLayout {
    RawLayout::new([5, 4, 3], scalar)
}

fn open_raw(bytes: &[u8], raw: RawLayout) -> Result<Opened, OpenError> {
    let dir = TempDir::new().unwrap();
    let options = OpenOptions { raw: Some(raw), ..OpenOptions::default() };
    isoforge::volume::open(&write(&dir, "a.raw", bytes), &options)
}

#[test]
fn every_type_in_either_order() {
    for scalar in Scalar::ALL {
        for endian in ORDERS {
            let expected = values(scalar);
            let mut bytes = vec![9; 13];
            bytes.extend(encode(&expected, scalar, endian));
            let raw = RawLayout {
                endian,
                skip_bytes: 13,
                spacing: [1.0, 2.0, 0.5],
                origin: [-1.0, 0.0, 7.0],
                ..layout(scalar)
            };
            let opened = open_raw(&bytes, raw).unwrap();
            assert_values(&opened, &expected);
            assert_eq!(opened.volume.values().scalar(), kept(scalar));
            assert_plain_grid(&opened, [-1.0, 0.0, 7.0], [1.0, 2.0, 0.5]);
            assert_eq!(opened.notes, [""; 0]);
        }
    }
}

#[test]
fn large_inputs_decode_like_small_ones() {
    // Over the size of a task and of a read buffer, with a remainder in both.
    let dims = [211_u32, 163, 67];
    let count = dims.iter().product::<u32>();
    let expected: Vec<f64> = (0..count).map(|i| f64::from(i) - 1000.0).collect();
    let bytes = encode(&expected, Scalar::F64, Endian::Big);
    let raw = RawLayout { endian: Endian::Big, ..RawLayout::new(dims, Scalar::F64) };
    let opened = open_raw(&bytes, raw).unwrap();
    assert_values(&opened, &expected);
    assert_eq!(opened.volume.finite_range(), Some((-1000.0, (count - 1001) as f32)));
    assert_eq!(opened.notes, [""; 0]);
}

#[test]
fn sizes_must_fit_the_file() {
    let bytes = encode(&values(Scalar::U16), Scalar::U16, Endian::Little);
    assert!(matches!(
        open_raw(&bytes[1..], layout(Scalar::U16)),
        Err(OpenError::Truncated { need: 120, .. })
    ));
    let more = [&bytes[..], &[0; 7]].concat();
    let message = open_raw(&more, layout(Scalar::U16)).unwrap_err().to_string();
    assert!(message.contains("127 follow"), "{message}");
    // A whole number of volumes: several frames.
    let opened = open_raw(&[&bytes[..], &bytes[..]].concat(), layout(Scalar::U16)).unwrap();
    assert_values(&opened, &values(Scalar::U16));
    assert!(opened.notes[0].contains("2 volumes"), "{:?}", opened.notes);
    let far = RawLayout { skip_bytes: u64::MAX, ..layout(Scalar::U16) };
    assert!(matches!(open_raw(&bytes, far), Err(OpenError::Truncated { .. })));
}

#[test]
fn absurd_layouts_are_refused() {
    let bytes = [0; 100];
    let refused = |raw| open_raw(&bytes, raw).unwrap_err();
    assert!(matches!(refused(RawLayout::new([0, 4, 4], Scalar::U8)), OpenError::TooThin { .. }));
    assert!(matches!(refused(RawLayout::new([5, 1, 4], Scalar::U8)), OpenError::TooThin { .. }));
    assert!(matches!(refused(RawLayout::new([u32::MAX; 3], Scalar::F64)), OpenError::TooLarge { .. }));
    assert!(matches!(refused(RawLayout::new([1 << 13; 3], Scalar::F64)), OpenError::Truncated { .. }));
    assert!(matches!(refused(RawLayout::new([1 << 22, 2, 2], Scalar::U8)), OpenError::Grid { .. }));
    let flat = RawLayout { spacing: [1.0, 0.0, 1.0], ..layout(Scalar::U8) };
    assert!(matches!(refused(flat), OpenError::Grid { .. }));
    let odd = RawLayout { origin: [f32::NAN, 0.0, 1.0], ..layout(Scalar::U8) };
    assert!(refused(odd).to_string().contains("origin"));
    let message = refusal("a.bin", &bytes);
    assert!(message.contains("dimensions"), "{message}");
}

#[test]
fn a_limit_on_memory_is_kept() {
    let dir = TempDir::new().unwrap();
    // In bytes of memory, where f64 is kept as f32 and u8 as it is.
    for (scalar, bytes) in [(Scalar::U8, 60), (Scalar::I16, 120), (Scalar::F64, 240)] {
        let path = write(&dir, "a.raw", &vec![0; POINTS * scalar.size()]);
        let options =
            |most| OpenOptions { raw: Some(layout(scalar)), max_bytes: Some(most), ..OpenOptions::default() };
        assert!(isoforge::volume::open(&path, &options(bytes)).is_ok());
        assert!(matches!(isoforge::volume::open(&path, &options(bytes - 1)), Err(OpenError::Budget { .. })));
    }
}

#[test]
fn losses_are_noted() {
    let mut stored = values(Scalar::I32);
    stored[3] = 16_777_217.0;
    let opened = open_raw(&encode(&stored, Scalar::I32, Endian::Little), layout(Scalar::I32)).unwrap();
    assert_eq!(opened.volume.values().get(3), 16_777_216.0);
    assert_eq!(opened.notes, ["i32 values over 2^24 are rounded to f32 (1 of them)"]);

    let mut stored = values(Scalar::F64);
    stored[3] = 1e300;
    stored[4] = f64::NAN;
    stored[5] = f64::INFINITY;
    let opened = open_raw(
        &encode(&stored, Scalar::F64, Endian::Big),
        RawLayout { endian: Endian::Big, ..layout(Scalar::F64) },
    )
    .unwrap();
    assert_eq!(opened.volume.values().get(3), f32::INFINITY);
    assert_eq!(opened.notes, ["1 values are beyond the range of f32 and became infinite"]);
    assert_eq!(opened.volume.non_finite_count(), 3);
    assert_eq!(opened.volume.finite_range(), Some((-1.0e30, 60.0)));

    stored[6] = 0.1;
    let opened = open_raw(&encode(&stored, Scalar::F64, Endian::Little), layout(Scalar::F64)).unwrap();
    assert_eq!(opened.notes[1], "f64 values are rounded to f32");
}

#[test]
fn a_volume_without_finite_values_has_no_range() {
    let stored = vec![f64::NAN; POINTS];
    let opened = open_raw(&encode(&stored, Scalar::F32, Endian::Little), layout(Scalar::F32)).unwrap();
    assert_eq!(opened.volume.finite_range(), None);
    assert_eq!(opened.volume.non_finite_count(), 60);
}
