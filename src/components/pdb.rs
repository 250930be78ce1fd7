//! PDB: the `ATOM` and `HETATM` records of the first model, by the columns of the format description,
//! version 3.3.

use super::radii;
use super::source::{Growing, Place, Source, text};
use super::{Component, Loaded, OpenError, OpenOptions};
use std::collections::HashMap;
use std::ops::Range;

// Columns are counted from 1 in the format description, and so in messages.
const NAME: Range<usize> = 12..16;
const ALTERNATE: usize = 16;
const RESIDUE_NAME: Range<usize> = 17..20;
/// Chain, number and insertion code.
const RESIDUE: Range<usize> = 21..27;
const POSITION: [(&str, Range<usize>); 3] =
    [("x (31-38)", 30..38), ("y (39-46)", 38..46), ("z (47-54)", 46..54)];
const ELEMENT: Range<usize> = 76..78;

const WATERS: [&[u8]; 3] = [b"HOH", b"WAT", b"DOD"];

#[derive(Default)]
struct Skipped {
    waters: u64,
    alternates: u64,
    /// The row where a further model begins.
    models_from: Option<u64>,
}

pub(super) fn read(source: Source, options: &OpenOptions) -> Result<Loaded, OpenError> {
    let mut growing = Growing::new(source.path, options);
    let mut lines = source.lines(0);
    let mut skipped = Skipped::default();
    // The alternate location that each residue is read at: mixing them would make impossible residues.
    let mut locations: HashMap<[u8; 6], u8> = HashMap::new();
    let (mut seen, mut over) = (false, false);
    while let Some((place, line)) = lines.next()? {
        let record = field(line, 0..6);
        match record {
            b"ENDMDL" | b"END" => over = seen,
            b"ATOM" | b"HETATM" if over => {
                skipped.models_from = Some(place.number);
                break;
            }
            b"ATOM" | b"HETATM" => {
                seen = true;
                if WATERS.contains(&field(line, RESIDUE_NAME)) {
                    skipped.waters += 1;
                } else if is_other_location(line, &mut locations) {
                    skipped.alternates += 1;
                } else {
                    growing.push(atom(place, line)?)?;
                }
            }
            _ => {}
        }
    }
    let why = match skipped.waters {
        0 => String::new(),
        waters => format!(": its {waters} atoms are water"),
    };
    growing.finish(skipped.notes(), &why, "Give a file with ATOM or HETATM records other than water")
}

impl Skipped {
    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if self.waters > 0 {
            notes.push(format!("{} atoms of water are not used", self.waters));
        }
        if self.alternates > 0 {
            notes.push(format!("{} atoms at alternate locations are not used", self.alternates));
        }
        if let Some(row) = self.models_from {
            notes.push(format!("further models, from row {row} on, are not used"));
        }
        notes
    }
}

/// What stands in these columns, without the blanks around it.
fn field(line: &[u8], columns: Range<usize>) -> &[u8] {
    let end = columns.end.min(line.len());
    line.get(columns.start..end).unwrap_or_default().trim_ascii()
}

/// Whether the atom is at another alternate location than its residue's first.
fn is_other_location(line: &[u8], locations: &mut HashMap<[u8; 6], u8>) -> bool {
    let location = line.get(ALTERNATE).copied().unwrap_or(b' ');
    let residue = line.get(RESIDUE).and_then(|residue| residue.try_into().ok());
    match residue {
        Some(residue) if location != b' ' => *locations.entry(residue).or_insert(location) != location,
        _ => false,
    }
}

fn atom(place: Place, line: &[u8]) -> Result<Component, OpenError> {
    let mut element = field(line, ELEMENT);
    let radius = if !element.is_empty() && element.iter().all(u8::is_ascii_alphabetic) {
        radii::of_symbol(&text(element))
    } else {
        // Before version 2.1 these columns held something else.
        element = field(line, NAME);
        radius_by_name(line.get(NAME).unwrap_or_default())
    };
    let columns = POSITION.map(|(name, columns)| (name, text(field(line, columns))));
    place.atom(&text(element), radius, columns)
}

/// The name's first two columns hold the element, to the right. Names of four characters begin with a
/// hydrogen's H already in the first.
fn radius_by_name(name: &[u8]) -> Option<f32> {
    let &[first, second, third, fourth] = name else { return None };
    let one = |byte: u8| radii::of_symbol(&text(&[byte]));
    if !first.is_ascii_alphabetic() {
        return one(second);
    }
    let full = [second, third, fourth].iter().all(|byte| *byte != b' ');
    if full && matches!(first, b'H' | b'D') {
        return one(first);
    }
    radii::of_symbol(&text(&[first, second])).or_else(|| one(first))
}
