//! Values of flags, from text.

use crate::grid::MAX_CELLS;
use crate::mesh::Least;
use crate::scene;
use glam::Vec3;
use std::str::FromStr;

/// What `--refine` says.
#[derive(Debug, Clone, Copy, Default)]
pub struct RefineArg(pub scene::Refine);

/// Three numbers.
#[derive(Debug, Clone, Copy)]
pub struct Triple(pub [f32; 3]);

/// Width and height.
#[derive(Debug, Clone, Copy)]
pub struct Size(pub [u32; 2]);

fn list<T: FromStr, const N: usize>(text: &str, separator: char) -> Option<[T; N]> {
    let parts: Vec<T> = text.split(separator).map(|p| p.trim().parse().ok()).collect::<Option<_>>()?;
    parts.try_into().ok()
}

pub fn cells(text: &str) -> Result<[u32; 3], String> {
    let one: Option<[u32; 1]> = list(text, ',');
    let cells = one.map(|[n]| [n; 3]).or_else(|| list(text, ','));
    cells.ok_or_else(|| format!("give one whole number from 1 to {MAX_CELLS}, or three with commas"))
}

pub fn dims(text: &str) -> Result<[u32; 3], String> {
    list(text, ',').ok_or_else(|| "give three whole numbers with commas".into())
}

pub fn triple(text: &str) -> Result<Triple, String> {
    list(text, ',').map(Triple).ok_or_else(|| "give three numbers with commas".into())
}

pub fn bounds(text: &str) -> Result<[Vec3; 2], String> {
    let [a, b, c, d, e, f] =
        list(text, ',').ok_or("give six numbers with commas: low corner, high corner")?;
    Ok([Vec3::new(a, b, c), Vec3::new(d, e, f)])
}

pub fn size(text: &str) -> Result<Size, String> {
    list(text, 'x').map(Size).ok_or_else(|| "give two whole numbers, as in 1024x768".into())
}

pub fn parameter(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("give NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("`{value}` is not a number"))?;
    Ok((name.trim().into(), value))
}

pub fn refine(text: &str) -> Result<RefineArg, String> {
    let mut refine = scene::Refine::default();
    for part in text.split(',').filter(|part| !part.trim().is_empty()) {
        let (name, value) = parameter(part)?;
        let number = Some(value as f32);
        match &*name {
            "flatness" => refine.flatness = number,
            "epsilon" => refine.epsilon = number,
            "step" => refine.step = number,
            "depth" if value >= 0.0 && value.fract() == 0.0 => refine.depth = Some(value as u32),
            "depth" => return Err(format!("the depth is {value}: give a whole number")),
            _ => return Err(format!("there is no `{name}`; there are flatness, epsilon, depth, step")),
        }
    }
    Ok(RefineArg(refine))
}

pub fn range(text: &str) -> Result<[f32; 2], String> {
    let range: Option<[f32; 2]> = list(text, ',');
    let good = range.filter(|[low, high]| low.is_finite() && high.is_finite() && low <= high);
    good.ok_or_else(|| "give two finite numbers with a comma, the lower one first".into())
}

pub fn least(text: &str) -> Result<Least, String> {
    let part = |value: &str| value.parse().ok().filter(|part| (0.0..=1.0).contains(part));
    let least = match text.split_once('=') {
        Some(("area", value)) => part(value).map(Least::Area),
        Some(("volume", value)) => part(value).map(Least::Volume),
        Some(_) => None,
        None => text.parse().ok().map(Least::Triangles),
    };
    least.ok_or_else(|| {
        "give a number of triangles, or area=PART or volume=PART with a part of the largest from 0 to 1"
            .into()
    })
}

/// A length in world units.
pub fn length(text: &str) -> Result<f32, String> {
    let length = text.trim().parse().ok().filter(|length: &f32| length.is_finite() && *length >= 0.0);
    length.ok_or_else(|| "give a finite length of zero or more, in world units".into())
}

/// A whole number.
pub fn count<T: FromStr>(text: &str) -> Result<T, String> {
    text.trim().parse().map_err(|_| "give a whole number of 0 or more".into())
}

pub fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.trim().parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds >= 0.0);
    seconds.ok_or_else(|| "give a finite number of seconds, 0 or more".into())
}

/// Whole seconds.
pub fn time_limit(text: &str) -> Result<u64, String> {
    let seconds = text.trim().parse().ok().filter(|seconds| *seconds >= 1);
    seconds.ok_or_else(|| "give a whole number of seconds, at least 1".into())
}

pub fn degrees(text: &str) -> Result<f32, String> {
    let angle = text.trim().parse().ok().filter(|angle| (0.0..=180.0).contains(angle));
    angle.ok_or_else(|| "give an angle from 0 to 180".into())
}

pub fn byte_count(text: &str) -> Result<u64, String> {
    let lower = text.trim().to_ascii_lowercase();
    let digits = lower.find(|c: char| !c.is_ascii_digit()).unwrap_or(lower.len());
    let shift = match lower[digits..].trim() {
        "" | "b" => 0,
        "k" | "kb" | "kib" => 10,
        "m" | "mb" | "mib" => 20,
        "g" | "gb" | "gib" => 30,
        "t" | "tb" | "tib" => 40,
        _ => return Err("give a whole number of bytes, or one with K, M, G or T (powers of 1024)".into()),
    };
    let number: u64 =
        lower[..digits].parse().map_err(|_| "give a whole number of bytes, or one with K, M, G, T")?;
    number.checked_shl(shift).filter(|n| n >> shift == number).ok_or_else(|| "that is too large".into())
}
