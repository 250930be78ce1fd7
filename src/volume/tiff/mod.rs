//! Stacks of gray TIFF pages, ImageJ's among them.

mod directory;
mod imagej;
mod ome;

use crate::grid::Grid;
use crate::volume::decode::{Coding, Endian, Loss, Scalar, append, grow, read_values};
use crate::volume::error::OpenError;
use crate::volume::planes::{Located, Starts, no_planes};
use crate::volume::source::{Placement, Source, layout};
use crate::volume::{OpenOptions, Opened, Values, opened};
use glam::{DMat3, DVec3};
use imagej::ImageJ;
use ome::Ome;
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
    caught(path, || read_pages(path, options))
}

/// Where the values lie.
pub(super) fn locate(path: &Path, options: &OpenOptions) -> Result<Located, OpenError> {
    caught(path, || locate_pages(path, options))
}

/// The crate multiplies header fields unchecked before it hands anything out (in 0.11.3 the number of strips or tiles), which
/// panics in builds that check overflow.
fn caught<T>(path: &Path, work: impl FnOnce() -> Result<T, OpenError>) -> Result<T, OpenError> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(OpenError::corrupt(path, "its directory of pages makes no sense")))
}

/// What the directories of a file's pages say.
struct Head {
    pages: Pages,
    page: Page,
    stack: Stack,
    /// Whether one directory stands for all pages, which follow each other.
    contiguous: bool,
    grid: Grid,
    /// Of the values as they come from the crate, and as they lie in the file.
    coding: Coding,
    coding_in_file: Coding,
    /// Bytes of the file, and of the values.
    len: u64,
    need: u64,
    notes: Vec<String>,
}

fn read_pages(path: &Path, options: &OpenOptions) -> Result<Opened, OpenError> {
    let mut head = head(path, options)?;
    let (values, loss) =
        if head.contiguous { read_contiguous(path, &mut head)? } else { read_each(path, &mut head)? };
    let Head { grid, coding, mut notes, .. } = head;
    loss.notes(&coding, &mut notes);
    opened(path, grid, values, notes)
}

fn locate_pages(path: &Path, options: &OpenOptions) -> Result<Located, OpenError> {
    let mut head = head(path, options)?;
    let starts = if head.contiguous {
        Starts::Together(start_of_contiguous(path, &mut head)?)
    } else {
        if head.page.compression != CompressionMethod::None {
            return Err(no_planes(path, "compressed"));
        }
        // Read as they lie, without the crate, which turns some of them over.
        head.coding = head.coding_in_file;
        let points = head.page.width * head.page.height;
        let size = points * head.coding.scalar.size() as u64;
        let Stack { first, stride, slices } = head.stack;
        let start = |slice| {
            let number = first + slice * stride;
            head.pages.seek_to_image(number as usize).map_err(|e| failed(path, number, e))?;
            match one_piece(path, &mut head.pages)? {
                Some((start, bytes))
                    if bytes >= size && start.checked_add(size).is_some_and(|end| end <= head.len) =>
                {
                    Ok(start)
                }
                Some(_) => {
                    Err(OpenError::corrupt(path, format!("page {number} (from 0) is not all in the file")))
                }
                None => Err(no_planes(path, "cut into tiles, or into strips that do not follow each other")),
            }
        };
        Starts::Each((0..slices).map(start).collect::<Result<_, _>>()?)
    };
    let Head { grid, coding, notes, .. } = head;
    Ok(Located { path: path.to_owned(), grid, coding, starts, notes })
}

/// The first byte of a page and how many it has, if its strips follow each other.
fn one_piece(path: &Path, pages: &mut Pages) -> Result<Option<(u64, u64)>, OpenError> {
    let strips = find_list(path, pages, Tag::StripOffsets)?;
    let sizes = find_list(path, pages, Tag::StripByteCounts)?;
    let joined =
        strips.iter().zip(strips.iter().skip(1)).zip(&sizes).all(|((a, b), n)| a.checked_add(*n) == Some(*b));
    let bytes = sizes.iter().fold(0_u64, |sum, n| sum.saturating_add(*n));
    Ok(strips.first().filter(|_| joined && strips.len() == sizes.len()).map(|&start| (start, bytes)))
}

fn head(path: &Path, options: &OpenOptions) -> Result<Head, OpenError> {
    let mut notes = Vec::new();
    let mut source = Source::open(path)?;
    let len = source.len;
    directory::check(path, &mut source)?;
    let mut limits = Limits::default();
    // No page needs more than what the file can hold, which is checked before it is decoded.
    limits.decoding_buffer_size = usize::try_from(len.saturating_mul(MOST_PACKED)).unwrap_or(usize::MAX);
    limits.intermediate_buffer_size = usize::try_from(len).unwrap_or(usize::MAX);
    let mut pages = Decoder::new(source.reader).map_err(|e| failed(path, 0, e))?.with_limits(limits);

    let first = Page::of(path, 0, &mut pages)?;
    let text = description(path, &mut pages, len)?;
    let imagej = ImageJ::of(path, &text, &mut pages)?;
    let ome = Ome::of(&text, &mut notes);
    if text.starts_with("{\"shape\"") {
        notes.push(
            "tifffile's description of the stack is not read: all pages are taken as slices".to_owned(),
        );
    }
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
        place = imagej.placement(options.spacing, &mut notes);
        (slope, intercept) = imagej.calibration(&mut notes);
    }
    if let Some(ome) = &ome {
        stack = ome.stack(count, &mut notes);
        place = ome.placement(options.spacing, &mut notes);
    }

    let dims = [first.width, first.height, stack.slices];
    let endian = if pages.byte_order() == ByteOrder::BigEndian { Endian::Big } else { Endian::Little };
    let coding_in_file = Coding::scaled(first.scalar, endian, slope, intercept);
    let coding = if contiguous { coding_in_file } else { coding_by_crate(&first, slope, intercept) };
    let (grid, need) = layout(path, dims, &coding, &place, options)?;
    let truncated = |have: u64| OpenError::Truncated {
        file: path.to_owned(),
        need,
        have: format!("there are at most {have}"),
    };
    let most =
        if first.compression == CompressionMethod::None { len } else { len.saturating_mul(MOST_PACKED) };
    if need > most {
        return Err(truncated(most));
    }
    if first.white_is_zero {
        notes.push("the pages are shown inverted (WhiteIsZero); the stored values are kept".to_owned());
    }

    Ok(Head { pages, page: first, stack, contiguous, grid, coding, coding_in_file, len, need, notes })
}

/// The description of the first page, which is empty where there is none. More than 16 MB are of no use here.
fn description(path: &Path, pages: &mut Pages, len: u64) -> Result<String, OpenError> {
    let entry = pages.image_ifd().directory().get(Tag::ImageDescription).map(|entry| entry.count());
    let mut bytes = vec![0; entry.unwrap_or(0).min(len).min(1 << 24) as usize];
    let read = pages.image_ifd().find_tag_bytes(Tag::ImageDescription, &mut bytes, 0);
    let got = read.map_err(|e| failed(path, 0, e))?.unwrap_or(0).min(bytes.len());
    Ok(String::from_utf8_lossy(&bytes[..got]).trim_end_matches('\0').to_owned())
}

/// How the values of pages come from the crate.
fn coding_by_crate(page: &Page, slope: f64, intercept: f64) -> Coding {
    let (scalar, endian) = (page.scalar, Endian::NATIVE);
    if !page.white_is_zero {
        return Coding::scaled(scalar, endian, slope, intercept);
    }
    // The crate turns WhiteIsZero over; this turns it back.
    let most = f64::from(u32::MAX >> (32 - 8 * scalar.size().min(4)));
    Coding::scaled(scalar, endian, -slope, intercept + slope * most)
}

/// The pages of one volume: `slices` of them from `first`, each `stride` behind the last.
#[derive(Debug, Clone, Copy)]
struct Stack {
    first: u64,
    stride: u64,
    slices: u64,
}

fn read_each(path: &Path, head: &mut Head) -> Result<(Values, Loss), OpenError> {
    let Head { pages, page, coding, stack, .. } = head;
    let dims = [page.width, page.height, stack.slices];
    // Within the file's size, see `need` above.
    let points = (page.width * page.height) as usize;
    let size = points * coding.scalar.size();
    let mut bytes = Vec::new();
    let mut values = coding.none();
    if page.compression == CompressionMethod::None {
        grow(path, dims, &mut values, points * stack.slices as usize)?;
    }
    let mut loss = Loss::default();
    for slice in 0..stack.slices {
        let number = stack.first + slice * stack.stride;
        pages.seek_to_image(number as usize).map_err(|e| failed(path, number, e))?;
        holds(path, pages, page, number, size as u64)?;
        let wanted = pages.image_buffer_layout().map_err(|e| failed(path, number, e))?;
        if wanted.len != size {
            let what =
                format!("page {number} decodes to {} bytes, not the {size} of its size and type", wanted.len);
            return Err(OpenError::corrupt(path, what));
        }
        if bytes.is_empty() {
            bytes.try_reserve_exact(size).map_err(|_| OpenError::TooLarge {
                file: path.to_owned(),
                dims,
                limit: "there is not enough memory for one page".to_owned(),
            })?;
            bytes.resize(size, 0);
        }
        pages.read_image_bytes(&mut bytes).map_err(|e| failed(path, number, e))?;
        grow(path, dims, &mut values, points)?;
        loss = loss.plus(append(&bytes, coding, &mut values, points));
    }
    Ok((values, loss))
}

/// Refuses a page whose strips or tiles can't unpack to its size, before memory is taken for it.
fn holds(path: &Path, pages: &mut Pages, page: &Page, number: u64, size: u64) -> Result<(), OpenError> {
    // Bytes that one byte can stand for at most.
    let ratio = match page.compression {
        CompressionMethod::None => 1,
        CompressionMethod::PackBits => 64,
        CompressionMethod::Deflate | CompressionMethod::OldDeflate => 1032,
        _ => MOST_PACKED,
    };
    let mut packed = 0_u64;
    for tag in [Tag::StripByteCounts, Tag::TileByteCounts] {
        packed = find_list(path, pages, tag)?.iter().fold(packed, |sum, n| sum.saturating_add(*n));
    }
    if packed.saturating_mul(ratio) < size {
        let what = format!(
            "the {packed} bytes of page {number} (from 0) can't hold the {size} of its size and type"
        );
        return Err(OpenError::corrupt(path, what));
    }
    Ok(())
}

/// ImageJ writes stacks over 4 GiB with one directory: the other pages follow the first.
fn read_contiguous(path: &Path, head: &mut Head) -> Result<(Values, Loss), OpenError> {
    let start = start_of_contiguous(path, head)?;
    let Head { pages, page, coding, stack, need, .. } = head;
    let reader = pages.inner();
    reader.seek(SeekFrom::Start(start)).map_err(|e| OpenError::reading(path, e))?;
    let dims = [page.width, page.height, stack.slices];
    read_values(path, reader, dims, coding, *need / coding.scalar.size() as u64)
}

/// The first byte of pages that follow each other.
fn start_of_contiguous(path: &Path, head: &mut Head) -> Result<u64, OpenError> {
    let Head { pages, page, stack, len, need, .. } = head;
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
    // The first page must be in one piece for the others to follow it.
    let Some((start, _)) = one_piece(path, pages)? else {
        return Err(other("a first page in several pieces"));
    };
    let rest = len.saturating_sub(start);
    if rest < *need {
        return Err(OpenError::Truncated {
            file: path.to_owned(),
            need: *need,
            have: format!("there are only {rest}"),
        });
    }
    Ok(start)
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
