//! XYZ: molecules — a count, a comment, and `Element x y z` lines — and plain `x y z` points.

use super::radii;
use super::source::{Growing, Lines, Place, Source, text};
use super::{Component, Loaded, OpenError, OpenOptions};
use std::borrow::Cow;

pub(super) fn read(source: Source, options: &OpenOptions) -> Result<Loaded, OpenError> {
    let growing = Growing::new(source.path, options);
    let mut lines = source.lines(0);
    let count = lines.next()?.and_then(|(_, line)| text(line).trim().parse::<u64>().ok());
    match count {
        Some(count) => molecule(count, lines, growing),
        None => {
            lines.unread();
            points(lines, growing, options)
        }
    }
}

fn molecule(count: u64, mut lines: Lines, mut growing: Growing) -> Result<Loaded, OpenError> {
    growing.promised(count)?;
    if let Some((place, comment)) = lines.next()? {
        plain_columns(place, &text(comment))?;
    }
    while (growing.len() as u64) < count {
        let Some((place, line)) = lines.next()? else {
            return Err(lines.place().malformed(
                format!("{count} atoms are promised, but the file ends after {}", growing.len()),
                "Correct the count, or copy or export the file again",
            ));
        };
        growing.push(atom(place, &text(line))?)?;
    }
    let mut notes = Vec::new();
    while let Some((place, line)) = lines.next()? {
        let line = text(line);
        if !line.trim().is_empty() {
            notes.push(match line.trim().parse::<u64>() {
                Ok(_) => format!("further frames, from row {} on, are not used", place.number),
                Err(_) => {
                    format!("there are only {count} atoms by row 1: row {} on is not used", place.number)
                }
            });
            break;
        }
    }
    growing.finish(notes, ": the first row promises 0 atoms", "Give a file with atoms")
}

/// The extended format's comment may lay the columns out in another way.
fn plain_columns(place: Place, comment: &str) -> Result<(), OpenError> {
    let Some((_, layout)) = comment.split_once("Properties=") else { return Ok(()) };
    if layout.trim_start_matches('"').to_ascii_lowercase().starts_with("species:s:1:pos:r:3") {
        return Ok(());
    }
    Err(place.malformed(
        "the comment's Properties do not begin with the element and its position",
        "Write the file with Properties=species:S:1:pos:R:3 first",
    ))
}

fn atom(place: Place, line: &str) -> Result<Component, OpenError> {
    let mut words = line.split_whitespace();
    let element = words.next().unwrap_or("");
    let mut column = |name| (name, Cow::Borrowed(words.next().unwrap_or("")));
    let columns = [column("x"), column("y"), column("z")];
    // Some programs number their atoms, C1 C2, and some give the atomic number.
    let symbol = element.trim_end_matches(|c: char| c.is_ascii_digit());
    let radius = match element.parse() {
        Ok(number) => radii::of_number(number),
        Err(_) => radii::of_symbol(symbol),
    };
    place.atom(element, radius, columns)
}

fn points(mut lines: Lines, mut growing: Growing, options: &OpenOptions) -> Result<Loaded, OpenError> {
    let mut notes = Vec::new();
    let mut radius = None;
    while let Some((place, line)) = lines.next()? {
        let line = text(line);
        let line = line.split('#').next().unwrap_or_default();
        let mut words =
            line.split(|c: char| c.is_whitespace() || c == ',' || c == ';').filter(|w| !w.is_empty());
        let Some(first) = words.next() else { continue };
        let radius = match radius {
            Some(radius) => radius,
            None => {
                let given = growing.default_radius(options)?;
                notes.push(format!("plain points, without elements: every component has radius {given}"));
                *radius.insert(given)
            }
        };
        let position = [
            place.number("x", first)?,
            place.number("y", words.next().unwrap_or(""))?,
            place.number("z", words.next().unwrap_or(""))?,
        ];
        if words.next().is_some() && notes.len() == 1 {
            notes.push("columns after x, y, z are not used".to_owned());
        }
        growing.push(Component { position, radius, weight: 1.0 })?;
    }
    growing.finish(notes, "", "Give a count, a comment and lines of Element x y z, or lines of x y z")
}
