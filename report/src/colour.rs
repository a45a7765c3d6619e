//! Colours that readers with any colour vision tell apart.

use std::fmt;

/// An sRGB colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Colour(pub u8, pub u8, pub u8);

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// Series colours of Okabe and Ito ("Color Universal Design", 2008) without the yellow, which is too faint on white.
impl Colour {
    /// First series.
    pub const BLUE: Self = Self(0x00, 0x72, 0xb2);
    /// Second series.
    pub const VERMILION: Self = Self(0xd5, 0x5e, 0x00);
    /// Third series.
    pub const GREEN: Self = Self(0x00, 0x9e, 0x73);
    /// Fourth series.
    pub const PURPLE: Self = Self(0xcc, 0x79, 0xa7);
    /// Fifth series.
    pub const ORANGE: Self = Self(0xe6, 0x9f, 0x00);
    /// Sixth series.
    pub const SKY: Self = Self(0x56, 0xb4, 0xe9);
    /// For what stays in the background: a reference, the size of an effect.
    pub const GREY: Self = Self(0xa9, 0xae, 0xb6);
    /// Text and frame.
    pub(crate) const INK: Self = Self(0x22, 0x26, 0x2b);
    /// Tick labels.
    pub(crate) const DIM: Self = Self(0x58, 0x5f, 0x69);
    /// Ticks with a label.
    pub(crate) const GRID: Self = Self(0xdf, 0xe2, 0xe6);
    /// Ticks between.
    pub(crate) const FAINT: Self = Self(0xf0, 0xf2, 0xf4);
    /// Background.
    pub(crate) const PAPER: Self = Self(0xff, 0xff, 0xff);

    const SERIES: [Self; 6] = [
        Self::BLUE,
        Self::VERMILION,
        Self::GREEN,
        Self::PURPLE,
        Self::ORANGE,
        Self::SKY,
    ];

    /// Colour of the `index`-th series, and whether the palette has been used up, so that a dash must tell two apart.
    pub(crate) fn series(index: usize) -> (Self, bool) {
        let round = index / Self::SERIES.len();
        // the third round is plain again: more than twelve series are not told apart
        (Self::SERIES[index % Self::SERIES.len()], round % 2 == 1)
    }
}

/// A colour scale for values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ramp {
    /// Dark to bright with even steps of lightness (viridis), for values from low to high.
    #[default]
    Sequential,
    /// Blue over white to red (ColorBrewer RdBu), for differences; its middle is zero.
    Diverging,
}

const VIRIDIS: [Colour; 9] = [
    Colour(0x44, 0x01, 0x54),
    Colour(0x47, 0x2d, 0x7b),
    Colour(0x3b, 0x52, 0x8b),
    Colour(0x2c, 0x72, 0x8e),
    Colour(0x21, 0x91, 0x8c),
    Colour(0x28, 0xae, 0x80),
    Colour(0x5e, 0xc9, 0x62),
    Colour(0xad, 0xdc, 0x30),
    Colour(0xfd, 0xe7, 0x25),
];

const RED_BLUE: [Colour; 7] = [
    Colour(0x21, 0x66, 0xac),
    Colour(0x67, 0xa9, 0xcf),
    Colour(0xd1, 0xe5, 0xf0),
    Colour(0xf7, 0xf7, 0xf7),
    Colour(0xfd, 0xdb, 0xc7),
    Colour(0xef, 0x8a, 0x62),
    Colour(0xb2, 0x18, 0x2b),
];

impl Ramp {
    /// Colour at `part` of the way, 0 to 1.
    pub(crate) fn at(self, part: f64) -> Colour {
        let stops: &[Colour] = match self {
            Self::Sequential => &VIRIDIS,
            Self::Diverging => &RED_BLUE,
        };
        let place = part.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        // at 1 the last pair is taken, not one beyond it
        let below = (place as usize).min(stops.len() - 2);
        let (a, b, t) = (stops[below], stops[below + 1], place - below as f64);
        let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * t).round() as u8;
        Colour(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
    }
}
