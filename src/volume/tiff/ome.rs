//! What OME-TIFF files say of a stack in their description.
//! (Goldberg et al., *The Open Microscopy Environment (OME) data model and XML file*, Genome Biology 2005; schema 2016-06.)

use super::Stack;
use crate::volume::source::Placement;
use glam::{DMat3, DVec3};
use roxmltree::{Document, Node};

/// Attributes of an element, of which OME-XML has a few dozen.
const MOST_ATTRIBUTES: usize = 1000;

/// The unit where none is named.
const MICROMETRE: &str = "\u{b5}m";

/// The first image of the file.
pub(super) struct Ome {
    /// Which of z, channel and time goes on fastest from page to page: their letters, and how many there are.
    order: [(char, u64); 3],
    /// Whether pages lie elsewhere than the order says.
    shuffled: bool,
    /// Sizes of a voxel, with their units.
    sizes: [Option<(f64, String)>; 3],
    images: usize,
}

impl Ome {
    /// `None` where the text is no OME-XML, or is damaged, which a note tells.
    pub fn of(text: &str, notes: &mut Vec<String>) -> Option<Self> {
        if !text.contains("<OME") {
            return None;
        }
        // The parser compares the attributes of an element with each other.
        let is_sane = text.split('<').all(|element| element.matches('=').count() <= MOST_ATTRIBUTES);
        let document = is_sane.then(|| Document::parse(text).ok()).flatten();
        let found = document.and_then(|document| Self::of_document(&document));
        if found.is_none() {
            notes.push("the file's OME-XML is damaged: all pages are taken as slices".to_owned());
        }
        found
    }

    fn of_document(document: &Document<'_>) -> Option<Self> {
        let all = |name: &'static str| document.descendants().filter(move |node| node.has_tag_name(name));
        let pixels = all("Pixels").next()?;
        let number = |node: Node<'_, '_>, name: &str| node.attribute(name)?.parse::<u64>().ok();
        // As "XYZCT": the pages' letters are the last three.
        let letters = pixels.attribute("DimensionOrder")?.strip_prefix("XY")?;
        let mut order = [(' ', 1); 3];
        for (place, letter) in order.iter_mut().zip(letters.chars()) {
            *place = (letter, number(pixels, &format!("Size{letter}")).filter(|n| *n > 0)?);
        }
        let at = |letter| order.iter().position(|(other, _)| *other == letter);
        let ([Some(_), Some(_), Some(_)], 3) = (['Z', 'C', 'T'].map(at), letters.len()) else { return None };
        let page = |data: Node<'_, '_>| {
            let mut before = 1;
            order.iter().try_fold(0u64, |page, (letter, count)| {
                let first = number(data, &format!("First{letter}")).unwrap_or(0).checked_mul(before)?;
                before = before.checked_mul(*count)?;
                page.checked_add(first)
            })
        };
        let pages = pixels.children().filter(|node| node.has_tag_name("TiffData"));
        let shuffled =
            pages.into_iter().any(|data| number(data, "IFD").is_some_and(|ifd| page(data) != Some(ifd)));
        let sizes = ["X", "Y", "Z"].map(|axis| {
            let size = pixels.attribute(format!("PhysicalSize{axis}").as_str())?.parse::<f64>().ok()?;
            let unit = pixels.attribute(format!("PhysicalSize{axis}Unit").as_str()).unwrap_or(MICROMETRE);
            (size.is_finite() && size > 0.0).then(|| (size, unit.to_owned()))
        });
        Some(Self { order, shuffled, sizes, images: all("Image").count() })
    }

    /// Which pages make the first volume.
    pub fn stack(&self, pages: u64, notes: &mut Vec<String>) -> Stack {
        let all = Stack { first: 0, stride: 1, slices: pages };
        let [one, two, three] = self.order.map(|(_, count)| count);
        let planes = one.checked_mul(two).and_then(|n| n.checked_mul(three));
        let is_there =
            planes == Some(pages) || self.images > 1 && planes.is_some_and(|planes| planes < pages);
        if !is_there || self.shuffled {
            let sizes = self.order.map(|(letter, count)| format!("{letter} {count}")).join(", ");
            let why = if is_there { "in another order" } else { "not those" };
            notes.push(format!(
                "the OME-XML tells of planes along {sizes}; the file's {pages} pages are {why}: all are read as slices"
            ));
            return all;
        }
        let place = self.order.iter().position(|(letter, _)| *letter == 'Z').unwrap_or(0);
        let slices = self.order[place].1;
        if slices == 1 && pages > 1 {
            notes.push(format!("the {pages} pages have one z; they are read as slices"));
            return all;
        }
        for (letter, count) in self.order.iter().filter(|(letter, count)| *letter != 'Z' && *count > 1) {
            let what = if *letter == 'C' { "channel" } else { "frame" };
            notes.push(format!("{count} {what}s in the file; {what} 0 is read"));
        }
        if self.images > 1 {
            notes.push(format!("{} images in the file; image 0 is read", self.images));
        }
        Stack { first: 0, stride: self.order[..place].iter().map(|(_, count)| count).product(), slices }
    }

    /// Where samples lie, in the unit along x; nothing is to be told of the spacing where another is `given`.
    pub fn placement(&self, given: Option<[f32; 3]>, notes: &mut Vec<String>) -> Placement {
        let mut own_notes = Vec::new();
        let step = DMat3::from_diagonal(self.spacing(&mut own_notes));
        if given.is_none() {
            notes.append(&mut own_notes);
        }
        Placement {
            origin: DVec3::ZERO,
            step,
            what: "the sizes in the OME-XML".to_owned(),
            remedy: "Correct PhysicalSizeX, Y and Z",
        }
    }

    fn spacing(&self, notes: &mut Vec<String>) -> DVec3 {
        let mut spacing = [1.0; 3];
        let unit = self.sizes.iter().flatten().next().map_or(MICROMETRE, |(_, unit)| unit.as_str());
        for ((spacing, size), axis) in spacing.iter_mut().zip(&self.sizes).zip(["x", "y", "z"]) {
            match size {
                Some((size, own)) if own == unit => *spacing = *size,
                Some((size, own)) => match (metres(own), metres(unit)) {
                    (Some(own), Some(unit)) => *spacing = size * (own / unit),
                    _ => notes.push(format!(
                        "the OME-XML's sizes are in {unit} and along {axis} in {own}; spacing 1 is used along {axis}"
                    )),
                },
                None => notes.push(format!("the OME-XML has no size along {axis}; spacing 1 is used")),
            }
        }
        DVec3::from(spacing)
    }
}

/// A unit of length.
fn metres(unit: &str) -> Option<f64> {
    Some(match unit {
        "m" => 1.0,
        "cm" => 1e-2,
        "mm" => 1e-3,
        // The micro sign, and the Greek letter.
        "\u{b5}m" | "\u{3bc}m" => 1e-6,
        "nm" => 1e-9,
        // The letter, and the sign for it.
        "\u{c5}" | "\u{212b}" => 1e-10,
        "pm" => 1e-12,
        _ => return None,
    })
}
