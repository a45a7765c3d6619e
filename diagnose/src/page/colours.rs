//! Colours of the same things in all pictures.

use report::Colour;

pub const MEASURED: Colour = Colour::GREY;
pub const MODEL: Colour = Colour::VERMILION;
pub const EXTENDED: Colour = Colour::BLUE;
