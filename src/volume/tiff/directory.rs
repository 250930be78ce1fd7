//! A walk along the directories of a TIFF file before the crate gets it.
//!
//! The crate takes memory for as many values as an entry announces (up to 256 MiB) before it looks
//! whether the file has them. This walk refuses entries that are larger than the file.

use crate::volume::decode::{Endian, fill};
use crate::volume::error::OpenError;
use crate::volume::source::Source;
use std::collections::HashSet;
use std::io::{Seek, SeekFrom};
use std::path::Path;

/// The fields' sizes in classic and in big TIFF.
struct Words {
    endian: Endian,
    big: bool,
}

impl Words {
    /// A whole number of as many bytes as `bytes` has.
    fn number(&self, bytes: &[u8]) -> u64 {
        let place = |n: u64, b: &u8| n << 8 | u64::from(*b);
        match self.endian {
            Endian::Big => bytes.iter().fold(0, place),
            Endian::Little => bytes.iter().rev().fold(0, place),
        }
    }
}

/// Checks every directory's entries against the file's size, and leaves the file at its start.
///
/// A file that is no TIFF, or ends inside a directory, passes: the crate says it better.
pub(super) fn check(path: &Path, source: &mut Source) -> Result<(), OpenError> {
    let walked = walk(path, source);
    source.reader.seek(SeekFrom::Start(0)).map_err(|e| OpenError::reading(path, e))?;
    walked
}

fn walk(path: &Path, source: &mut Source) -> Result<(), OpenError> {
    let len = source.len;
    let mut read = |at: u64, buffer: &mut [u8]| -> Result<bool, OpenError> {
        let moved = source.reader.seek(SeekFrom::Start(at)).and_then(|_| fill(&mut source.reader, buffer));
        Ok(moved.map_err(|e| OpenError::reading(path, e))? == buffer.len())
    };
    let mut head = [0; 16];
    if !read(0, &mut head[..8])? {
        return Ok(());
    }
    let endian = if head[0] == b'M' { Endian::Big } else { Endian::Little };
    let mut words = Words { endian, big: false };
    words.big = words.number(&head[2..4]) == 43;
    if words.big && !read(0, &mut head)? {
        return Ok(());
    }
    let mut next = if words.big { words.number(&head[8..16]) } else { words.number(&head[4..8]) };
    // Bytes of a directory's number of entries, of an entry, and of its count and place.
    let (count_size, entry_size, word) = if words.big { (8, 20, 8) } else { (2, 12, 4) };
    // Bytes of the directories so far.
    let (mut seen, mut sum) = (HashSet::new(), 0);
    for page in 0.. {
        if next == 0 || next >= len {
            break;
        }
        let again = OpenError::corrupt(path, "its directories of pages overlap, or lead back to one");
        if !seen.insert(next) {
            return Err(again);
        }
        let mut bytes = [0; 8];
        if !read(next, &mut bytes[..count_size])? {
            return Ok(());
        }
        let count = words.number(&bytes[..count_size]);
        let start = next + count_size as u64;
        // Most directories have a dozen entries; one that the file can't hold is cut off here.
        if count > (len - next) / entry_size {
            let problem = format!(
                "the directory of page {page} (from 0) has {count} entries, more than the file holds"
            );
            return Err(OpenError::corrupt(path, problem));
        }
        // Directories that share bytes would be read many times over.
        sum += count_size as u64 + count * entry_size + word as u64;
        if sum > len {
            return Err(again);
        }
        let mut entries = vec![0; (count * entry_size) as usize + word];
        if !read(start, &mut entries)? {
            return Ok(());
        }
        let (entries, link) = entries.split_at((count * entry_size) as usize);
        for entry in entries.chunks_exact(entry_size as usize) {
            let size = match words.number(&entry[2..4]) {
                1 | 2 | 6 | 7 => 1,
                3 | 8 => 2,
                4 | 9 | 11 | 13 => 4,
                5 | 10 | 12 | 16 | 17 | 18 => 8,
                // The crate passes over types that it does not know.
                _ => continue,
            };
            let values = words.number(&entry[4..4 + word]);
            if values.saturating_mul(size) > len {
                let tag = words.number(&entry[..2]);
                let problem = format!(
                    "tag {tag} of page {page} (from 0) has {values} values, more than the file holds"
                );
                return Err(OpenError::corrupt(path, problem));
            }
        }
        next = words.number(link);
    }
    Ok(())
}
