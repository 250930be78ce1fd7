//! The colour maps, by the `colorgrad` crate.

use colorgrad::{BlendMode, CatmullRomGradient, Color, Gradient, GradientBuilder};
use std::fmt;
use std::str::FromStr;

/// Colours of a table.
const STEPS: usize = 1024;
/// Ends and middle of the map of K. Moreland, *Diverging color maps for scientific visualization*, 2009.
const COOLWARM: [[u8; 3]; 3] = [[59, 76, 192], [221, 221, 221], [180, 4, 38]];

/// A colour map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Map {
    /// Dark violet over green to yellow, evenly bright steps.
    #[default]
    Viridis,
    /// Black over red to pale yellow.
    Magma,
    /// Black over red and orange to pale yellow.
    Inferno,
    /// Blue over red to yellow.
    Plasma,
    /// Blue to yellow, the same for all kinds of colour vision.
    Cividis,
    /// A rainbow without its false edges.
    Turbo,
    /// Blue over light grey to red (Moreland): for values on both sides of a middle.
    Coolwarm,
    /// Red over pale yellow to blue.
    Spectral,
    /// Black to white.
    Grey,
}

/// A name that no map has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no colour map `{name}`; there are {}", Map::ALL.map(|map| map.to_string()).join(", "))]
pub struct UnknownMap {
    /// The name asked for.
    pub name: String,
}

impl Map {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Viridis,
        Self::Magma,
        Self::Inferno,
        Self::Plasma,
        Self::Cividis,
        Self::Turbo,
        Self::Coolwarm,
        Self::Spectral,
        Self::Grey,
    ];

    /// Its sRGB colours, evenly from the lowest value to the highest.
    pub fn table(self) -> Vec<[u8; 3]> {
        use colorgrad::preset;
        match self {
            Self::Viridis => table(&preset::viridis()),
            Self::Magma => table(&preset::magma()),
            Self::Inferno => table(&preset::inferno()),
            Self::Plasma => table(&preset::plasma()),
            Self::Cividis => table(&preset::cividis()),
            Self::Turbo => table(&preset::turbo()),
            Self::Spectral => table(&preset::spectral()),
            Self::Coolwarm => between(&COOLWARM),
            Self::Grey => between(&[[0; 3], [255; 3]]),
        }
    }
}

fn table(gradient: &impl Gradient) -> Vec<[u8; 3]> {
    let colour = |i: usize| {
        let [r, g, b, _] = gradient.at(i as f32 / (STEPS - 1) as f32).to_rgba8();
        [r, g, b]
    };
    (0..STEPS).map(colour).collect()
}

/// A smooth way through some colours.
fn between(colours: &[[u8; 3]]) -> Vec<[u8; 3]> {
    let colours: Vec<Color> = colours.iter().map(|&[r, g, b]| Color::from_rgba8(r, g, b, 255)).collect();
    let gradient =
        GradientBuilder::new().colors(&colours).mode(BlendMode::Oklab).build::<CatmullRomGradient>();
    table(&gradient.expect("colours without positions always make a gradient"))
}

impl fmt::Display for Map {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Viridis => "viridis",
            Self::Magma => "magma",
            Self::Inferno => "inferno",
            Self::Plasma => "plasma",
            Self::Cividis => "cividis",
            Self::Turbo => "turbo",
            Self::Coolwarm => "coolwarm",
            Self::Spectral => "spectral",
            Self::Grey => "grey",
        })
    }
}

impl FromStr for Map {
    type Err = UnknownMap;

    fn from_str(name: &str) -> Result<Self, UnknownMap> {
        let found = Self::ALL.into_iter().find(|map| map.to_string() == name);
        found.ok_or_else(|| UnknownMap { name: name.into() })
    }
}
