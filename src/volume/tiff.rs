//! Stacks of gray TIFF pages, ImageJ's among them.

use super::decode::{Coding, Endian, Loss, Scalar, decode, grow, read_values};
use super::error::OpenError;
use super::source::{Placement, Source, layout};
use super::{OpenOptions, Opened, opened};
use glam::{DMat3, DVec3};
use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use tiff::decoder::{Decoder, Limits};
use tiff::tags::{ByteOrder, CompressionMethod, Tag};
use tiff::{TiffError, TiffFormatError};

/// More than any of the crate's codecs can shrink data (LZW, the best, reaches 2731).
const MOST_PACKED: u64 = 4096;

type Pages = Decoder<BufReader<File>>;

pub(super) fn read(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    // The crate multiplies header fields unchecked before it hands anything out (in 0.11.3 the
    // number of strips or tiles), which panics in builds that check overflow.
    catch_unwind(AssertUnwindSafe(|| read_pages(path, options)))
        .unwrap_or_else(|_| Err(OpenError::corrupt(path, "its directory of pages makes no sense")))
}

fn read_pages(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    let mut notes = Vec::new();
    let source = Source::open(path)?;
    let len = source.len;
    let mut limits = Limits::default();
    // No page needs more than what the file can hold, which is checked before it is decoded.
    limits.decoding_buffer_size = usize::try_from(len.saturating_mul(MOST_PACKED)).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = usize::try_from(len).unwrap_or(usize::MAX);
    let mut pages = Decoder::new(source.reader).map_err(|e| failed(path, 0, e))?.with_limits(limits);

    let first = Page::of(path, 0, &mut pages)?;
    let imagej = ImageJ::of(path, &mut pages, len)?;
    let mut count = 1_u64;
    while pages.more_images() {
        pages.next_image().map_err(|e| failed(path, count, e))?;
        let page = Page::of(path, count, &mut pages)?;
        if page != first {
            return Err(OpenError::header(
                path,
                format!("page {count} (from 0) is {page}, but page 0 is {first}"),
                "All pages of a stack must have the same size and type: remove or convert the others",
            ));
        }
        count += 1;
    }

    let mut stack = Stack { first: 0, stride: 1, slices: count };
    let mut contiguous = false;
    let mut place = Placement {
        origin: DVec3::ZERO,
        step: DMat3::IDENTITY,
        what: "the spacing".to_owned(),
        remedy: "Correct the resolution tags",
    };
    let (mut slope, mut intercept) = (1.0, 0.0);
    if let Some(imagej) = &imagej {
        let images = imagej.count("images");
        contiguous = count == 1 && images > 1;
        if contiguous {
            count = images;
        } else if images != count {
            notes.push(format!("the ImageJ tag promises {images} images; the file has {count} pages"));
        }
        stack = imagej.stack(count, &mut notes);
        place = imagej.placement(&mut notes);
        (slope, intercept) = imagej.calibration(&mut notes);
    }

    let dims = [first.width, first.height, stack.slices];
    let scalar = first.scalar;
    let (grid, need) = layout(path, dims, scalar.size(), &place, options)?;
    let truncated = |have: u64| OpenError::Truncated {
        file: path.to_owned(),
        need,
        have: format!("there are at most {have}"),
    };
    let plain = first.compression == CompressionMethod::None;
    let most = if plain { len } else { len.saturating_mul(MOST_PACKED) };
    if need > most {
        return Err(truncated(most));
    }
    if first.white_is_zero {
        notes.push("the pages are shown inverted (WhiteIsZero); the stored values are kept".to_owned());
    }

    let (values, loss, coding);
    if contiguous {
        let endian = if pages.byte_order() == ByteOrder::BigEndian { Endian::Big } else { Endian::Little };
        coding = Coding { scalar, endian, slope, intercept };
        (values, loss) = read_contiguous(path, &mut pages, &first, &coding, stack, len, need)?;
    } else {
        // The crate turns WhiteIsZero over; this turns it back.
        if first.white_is_zero {
            intercept += slope * f64::from(u32::MAX >> (32 - 8 * scalar.size().min(4)));
            slope = -slope;
        }
        coding = Coding { scalar, endian: Endian::NATIVE, slope, intercept };
        (values, loss) = read_each(path, &mut pages, &first, &coding, stack, plain)?;
    }
    loss.notes(&coding, &mut notes);
    opened(path, grid, values, notes)
}

/// The pages of one volume: `slices` of them from `first`, each `stride` behind the last.
#[derive(Debug, Clone, Copy)]
struct Stack {
    first: u64,
    stride: u64,
    slices: u64,
}

fn read_each(
    path: &Path,
    pages: &mut Pages,
    page: &Page,
    coding: &Coding,
    stack: Stack,
    plain: bool,
) -> Result<(Vec<f32>, Loss), OpenError> {
    let dims = [page.width, page.height, stack.slices];
    // Within the file's size, see `need` above.
    let points = (page.width * page.height) as usize;
    let size = points * coding.scalar.size();
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(size).map_err(|_| OpenError::TooLarge {
        file: path.to_owned(),
        dims,
        limit: "there is not enough memory for one page".to_owned(),
    })?;
    bytes.resize(size, 0);
    let mut values = Vec::new();
    if plain {
        grow(path, dims, &mut values, points * stack.slices as usize)?;
    }
    let mut loss = Loss::default();
    for slice in 0..stack.slices {
        let number = stack.first + slice * stack.stride;
        pages.seek_to_image(number as usize).map_err(|e| failed(path, number, e))?;
        let wanted = pages.image_buffer_layout().map_err(|e| failed(path, number, e))?;
        if wanted.len != size {
            let what =
                format!("page {number} decodes to {} bytes, not the {size} of its size and type", wanted.len);
            return Err(OpenError::corrupt(path, what));
        }
        pages.read_image_bytes(&mut bytes).map_err(|e| failed(path, number, e))?;
        let start = values.len();
        grow(path, dims, &mut values, points)?;
        values.resize(start + points, 0.0);
        let part = decode(&bytes, coding, &mut values[start..]);
        loss = loss.plus(part);
    }
    Ok((values, loss))
}

/// ImageJ writes stacks over 4 GiB with one directory: the other pages follow the first.
fn read_contiguous(
    path: &Path,
    pages: &mut Pages,
    page: &Page,
    coding: &Coding,
    stack: Stack,
    len: u64,
    need: u64,
) -> Result<(Vec<f32>, Loss), OpenError> {
    let other = |why: &str| {
        let what = format!("an ImageJ stack with one directory for all its pages and {why}");
        OpenError::unsupported(path, what, "Save the stack with one directory a page")
    };
    if page.compression != CompressionMethod::None {
        return Err(other("compression"));
    }
    if stack.stride != 1 || stack.first != 0 {
        return Err(other("more than one channel"));
    }
    let strips = find_list(path, pages, Tag::StripOffsets)?;
    let sizes = find_list(path, pages, Tag::StripByteCounts)?;
    // The first page must be in one piece for the others to follow it.
    let in_one_piece =
        strips.iter().zip(strips.iter().skip(1)).zip(&sizes).all(|((a, b), n)| a.checked_add(*n) == Some(*b));
    let Some(start) = strips.first().copied().filter(|_| in_one_piece) else {
        return Err(other("a first page in several pieces"));
    };
    let rest = len.saturating_sub(start);
    if rest < need {
        return Err(OpenError::Truncated {
            file: path.to_owned(),
            need,
            have: format!("there are only {rest}"),
        });
    }
    let reader = pages.inner();
    reader.seek(SeekFrom::Start(start)).map_err(|e| OpenError::reading(path, e))?;
    let dims = [page.width, page.height, stack.slices];
    read_values(path, reader, dims, coding, need / coding.scalar.size() as u64)
}

/// What all pages of a stack have in common.
#[derive(Debug, Clone, PartialEq)]
struct Page {
    width: u64,
    height: u64,
    scalar: Scalar,
    white_is_zero: bool,
    compression: CompressionMethod,
}

impl std::fmt::Display for Page {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} x {} of type {}", self.width, self.height, self.scalar)?;
        if self.white_is_zero {
            write!(f, ", WhiteIsZero")?;
        }
        if self.compression != CompressionMethod::None {
            write!(f, ", compression {:?}", self.compression)?;
        }
        Ok(())
    }
}

impl Page {
    fn of(path: &Path, number: u64, pages: &mut Pages) -> Result<Self, OpenError> {
        const REMEDY: &str = "Convert the stack to gray pages of u8, i8, u16, i16, u32, i32, f32 or f64";
        let unsupported =
            |what: String| OpenError::unsupported(path, format!("page {number} (from 0): {what}"), REMEDY);
        let (width, height) = pages.dimensions().map_err(|e| failed(path, number, e))?;
        let mut tag =
            |tag, default: u64| Ok(find_list(path, pages, tag)?.first().copied().unwrap_or(default));
        let photometric = tag(Tag::PhotometricInterpretation, 1)?;
        let white_is_zero = match photometric {
            0 => true,
            1 => false,
            2 => return Err(unsupported("RGB colour".to_owned())),
            3 => return Err(unsupported("a colour palette".to_owned())),
            n => return Err(unsupported(format!("photometric interpretation {n}"))),
        };
        let samples = tag(Tag::SamplesPerPixel, 1)?;
        if samples != 1 {
            return Err(unsupported(format!("{samples} samples a pixel")));
        }
        let bits = tag(Tag::BitsPerSample, 1)?;
        let format = tag(Tag::SampleFormat, 1)?;
        let scalar = match (bits, format) {
            // 4 is "undefined", which readers take for unsigned.
            (8, 1 | 4) => Scalar::U8,
            (16, 1 | 4) => Scalar::U16,
            (32, 1 | 4) => Scalar::U32,
            (8, 2) => Scalar::I8,
            (16, 2) => Scalar::I16,
            (32, 2) => Scalar::I32,
            (32, 3) => Scalar::F32,
            (64, 3) => Scalar::F64,
            (_, 1 | 4) => return Err(unsupported(format!("unsigned values of {bits} bits"))),
            (_, 2) => return Err(unsupported(format!("signed values of {bits} bits"))),
            (_, 3) => return Err(unsupported(format!("floating-point values of {bits} bits"))),
            _ => return Err(unsupported(format!("sample format {format}"))),
        };
        if white_is_zero && format != 1 {
            return Err(unsupported("WhiteIsZero with signed or floating-point values".to_owned()));
        }
        let compression = u16::try_from(tag(Tag::Compression, 1)?).unwrap_or(u16::MAX);
        Ok(Self {
            width: u64::from(width),
            height: u64::from(height),
            scalar,
            white_is_zero,
            compression: CompressionMethod::from_u16_exhaustive(compression),
        })
    }
}

/// A tag's whole numbers; empty without the tag.
fn find_list(path: &Path, pages: &mut Pages, tag: Tag) -> Result<Vec<u64>, OpenError> {
    // The crate allocates what a tag's count asks for; it has already read these once within its
    // limits, the others are single numbers.
    let count = pages.image_ifd().directory().get(tag).map_or(0, |entry| entry.count());
    if count > 1 << 22 {
        return Err(OpenError::corrupt(path, format!("the tag {tag:?} has {count} values")));
    }
    match pages.find_tag_unsigned_vec::<u64>(tag) {
        Ok(list) => Ok(list.unwrap_or_default()),
        Err(e) => Err(OpenError::corrupt(path, format!("the tag {tag:?} does not read ({e})"))),
    }
}

fn failed(path: &Path, page: u64, error: TiffError) -> OpenError {
    match error {
        TiffError::IoError(e) if !matches!(e.kind(), std::io::ErrorKind::UnexpectedEof) => {
            OpenError::reading(path, e)
        }
        TiffError::IoError(_) => OpenError::corrupt(path, format!("it ends inside page {page} (from 0)")),
        TiffError::FormatError(
            TiffFormatError::TiffSignatureNotFound | TiffFormatError::TiffSignatureInvalid,
        ) => OpenError::header(path, "it does not begin like a TIFF file", "Check that the file is TIFF"),
        TiffError::UnsupportedError(e) => OpenError::unsupported(
            path,
            format!("page {page} (from 0): the TIFF reader says \"{e}\", which"),
            "Convert the stack to uncompressed gray pages",
        ),
        TiffError::LimitsExceeded => OpenError::corrupt(
            path,
            format!("page {page} (from 0) asks for more memory than the file can fill"),
        ),
        e => OpenError::corrupt(path, format!("page {page} (from 0) does not decode ({e})")),
    }
}

/// What ImageJ writes into the description: lines `key=value`, with the scale in pixels a unit in
/// the resolution tags.
struct ImageJ {
    lines: Vec<(String, String)>,
    /// Pixels a unit along x and y, where given.
    resolution: [Option<f64>; 2],
    /// Whether the resolution is an inch's because nobody set any.
    inches: bool,
}

impl ImageJ {
    fn of(path: &Path, pages: &mut Pages, len: u64) -> Result<Option<Self>, OpenError> {
        let entry = pages.image_ifd().directory().get(Tag::ImageDescription).map(|entry| entry.count());
        let Some(count) = entry else { return Ok(None) };
        // A description is text of a few lines; the rest of a longer one is of no use here.
        let mut bytes = vec![0; count.min(len).min(1 << 16) as usize];
        let read = pages.image_ifd().find_tag_bytes(Tag::ImageDescription, &mut bytes, 0);
        let got = read.map_err(|e| failed(path, 0, e))?.unwrap_or(0).min(bytes.len());
        let text = String::from_utf8_lossy(&bytes[..got]);
        if !text.starts_with("ImageJ=") {
            return Ok(None);
        }
        let lines = text
            .trim_end_matches('\0')
            .lines()
            .filter_map(|line| line.split_once('=').map(|(k, v)| (k.trim().to_owned(), v.trim().to_owned())))
            .collect();
        let mut resolution = [None; 2];
        for (resolution, tag) in resolution.iter_mut().zip([Tag::XResolution, Tag::YResolution]) {
            let single = pages.image_ifd().directory().get(tag).is_some_and(|entry| entry.count() == 1);
            if single && let Ok(Some(value)) = pages.find_tag(tag) {
                *resolution = value.into_f64().ok();
            }
        }
        let inches = find_list(path, pages, Tag::ResolutionUnit)?.first() == Some(&2);
        Ok(Some(Self { lines, resolution, inches }))
    }

    fn get(&self, key: &str) -> Option<&str> {
        self.lines.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.get(key).and_then(|v| v.parse().ok())
    }

    /// A count, 1 where the tag has none.
    fn count(&self, key: &str) -> u64 {
        self.get(key).and_then(|v| v.parse().ok()).filter(|n| *n > 0).unwrap_or(1)
    }

    /// Which pages make the first volume. Pages go through channels fastest, then slices, then
    /// frames.
    fn stack(&self, pages: u64, notes: &mut Vec<String>) -> Stack {
        let [channels, slices, frames] = ["channels", "slices", "frames"].map(|key| self.count(key));
        let all = Stack { first: 0, stride: 1, slices: pages };
        if channels.checked_mul(slices).and_then(|n| n.checked_mul(frames)) != Some(pages) {
            if channels > 1 || frames > 1 {
                notes.push(format!(
                    "the ImageJ tag's {channels} channels, {slices} slices and {frames} frames are not the \
                     {pages} pages; all pages are read as slices"
                ));
            }
            return all;
        }
        if slices == 1 && channels == 1 && frames > 1 {
            notes.push(format!("the {frames} pages are marked as frames; they are read as slices"));
            return all;
        }
        if channels > 1 {
            notes.push(format!("{channels} channels in the file; channel 0 is read"));
        }
        if frames > 1 {
            notes.push(format!("{frames} frames in the file; frame 0 is read"));
        }
        Stack { first: 0, stride: channels, slices }
    }

    fn placement(&self, notes: &mut Vec<String>) -> Placement {
        let mut spacing = [1.0; 3];
        for axis in 0..2 {
            let name = ["x", "y"][axis];
            match self.resolution[axis] {
                None => {}
                // ImageJ's own reading of the value that other writers put in by default.
                Some(72.0) if self.inches && self.get("unit").is_none() => {}
                Some(per_unit) if per_unit.is_finite() && per_unit > 0.0 => spacing[axis] = per_unit.recip(),
                Some(per_unit) => {
                    notes.push(format!("the resolution along {name} is {per_unit}; spacing 1 is used"))
                }
            }
        }
        match self.number("spacing") {
            Some(z) if z.is_finite() && z != 0.0 => spacing[2] = z.abs(),
            Some(z) => notes.push(format!("the ImageJ tag's spacing is {z}; 1 is used along z")),
            // ImageJ leaves the line out where the spacing is 1.
            None if spacing[0] != 1.0 => {
                notes.push("the ImageJ tag has no spacing along z; 1 is used".to_owned())
            }
            None => {}
        }
        let spacing = DVec3::from(spacing);
        // In pixels from the first one's centre.
        let zero = ["xorigin", "yorigin", "zorigin"]
            .map(|key| self.number(key).filter(|n| n.is_finite()).unwrap_or(0.0));
        Placement {
            origin: -DVec3::from(zero) * spacing,
            step: DMat3::from_diagonal(spacing),
            what: "the spacing in the ImageJ tag and the resolution tags".to_owned(),
            remedy: "Set the voxel size in ImageJ (Image > Properties) and save again",
        }
    }

    /// Slope and intercept: ImageJ stores signed 16-bit values as unsigned ones and a straight line.
    fn calibration(&self, notes: &mut Vec<String>) -> (f64, f64) {
        let Some(function) = self.get("cf") else { return (1.0, 0.0) };
        match (function, self.number("c0"), self.number("c1")) {
            ("0", Some(c0), Some(c1)) if c0.is_finite() && c1.is_finite() && c1 != 0.0 => {
                notes.push(format!("ImageJ's calibration is applied: {c0} + {c1} * stored value"));
                (c1, c0)
            }
            _ => {
                notes.push(format!("ImageJ's calibration function {function} is not applied"));
                (1.0, 0.0)
            }
        }
    }
}
