//! ImageJ's description of a stack.

use super::{Pages, Stack, find_list};
use crate::volume::error::OpenError;
use crate::volume::source::Placement;
use glam::{DMat3, DVec3, Vec3};
use std::path::Path;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

/// What ImageJ writes into the description: lines `key=value`, with the scale in pixels a unit in
/// the resolution tags.
pub(super) struct ImageJ {
    lines: Vec<(String, String)>,
    /// Pixels a unit along x and y, where given.
    resolution: [Option<f64>; 2],
    /// Whether the resolution is an inch's because nobody set any.
    inches: bool,
}

impl ImageJ {
    /// `None` where `text`, the description, is another program's.
    pub fn of(path: &Path, text: &str, pages: &mut Pages) -> Result<Option<Self>, OpenError> {
        if !text.starts_with("ImageJ=") {
            return Ok(None);
        }
        let lines = text
            .lines()
            .filter_map(|line| line.split_once('=').map(|(k, v)| (k.trim().to_owned(), v.trim().to_owned())))
            .collect();
        let mut resolution = [None; 2];
        for (resolution, tag) in resolution.iter_mut().zip([Tag::XResolution, Tag::YResolution]) {
            let single = pages.image_ifd().directory().get(tag).is_some_and(|entry| entry.count() == 1);
            if single && let Ok(Some(value)) = pages.find_tag(tag) {
                *resolution = number(&value);
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
    pub fn count(&self, key: &str) -> u64 {
        self.get(key).and_then(|v| v.parse().ok()).filter(|n| *n > 0).unwrap_or(1)
    }

    /// Which pages make the first volume. Pages go through channels fastest, then slices, then
    /// frames.
    pub fn stack(&self, pages: u64, notes: &mut Vec<String>) -> Stack {
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
        let marked = |what| format!("the {pages} pages are marked as {what}; they are read as slices");
        // One slice is no volume: what goes on from page to page is taken for its z.
        if slices == 1 && frames == 1 && channels > 1 {
            notes.push(marked("channels"));
            return all;
        }
        if slices == 1 && channels == 1 && frames > 1 {
            notes.push(marked("frames"));
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

    /// Where samples lie; the spacing is the one `given`, if one is, as the origin is counted in pixels.
    pub fn placement(&self, given: Option<[f32; 3]>, notes: &mut Vec<String>) -> Placement {
        let spacing = given.map_or_else(|| self.spacing(notes), |given| Vec3::from(given).as_dvec3());
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

    fn spacing(&self, notes: &mut Vec<String>) -> DVec3 {
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
        DVec3::from(spacing)
    }

    /// Slope and intercept: ImageJ stores signed 16-bit values as unsigned ones and a straight line.
    pub fn calibration(&self, notes: &mut Vec<String>) -> (f64, f64) {
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

/// A resolution, which the format has as a fraction.
fn number(value: &Value) -> Option<f64> {
    match *value {
        Value::Rational(over, under) => Some(f64::from(over) / f64::from(under)),
        Value::SRational(over, under) => Some(f64::from(over) / f64::from(under)),
        Value::Float(number) => Some(f64::from(number)),
        Value::Double(number) => Some(number),
        _ => None,
    }
}
