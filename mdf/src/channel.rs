//! CG and CN: what a record holds, and its numbers.

use crate::block::{Block, Blocks};
use crate::conversion::Conversion;
use crate::{Channel, Error, Group};

/// A group of channels and how its records are laid out.
pub struct Layout {
    /// Number that stands before its records.
    pub id: u64,
    /// Records.
    pub rows: u64,
    /// Values of changing length, each with its length in front.
    pub is_variable: bool,
    /// Rows whose time stands in another group (MDF 4.2).
    has_remote_master: bool,
    name: String,
    /// Bytes of values, and of invalidation bits behind them.
    bytes: [usize; 2],
    channels: Vec<Place>,
}

/// A channel before its values are read.
struct Place {
    name: String,
    unit: String,
    role: Role,
    kind: Kind,
    byte: usize,
    bit: u32,
    bits: u32,
    /// Bit behind the values that says whether one is invalid.
    invalid: Option<usize>,
    conversion: Conversion,
}

#[derive(PartialEq, Clone, Copy)]
enum Role {
    Value,
    /// Over which the rows are: time or something else.
    Master {
        is_time: bool,
    },
    /// The same, counted from the number of the row.
    Virtual {
        is_time: bool,
    },
}

/// What stands in a record.
#[derive(PartialEq, Clone, Copy)]
enum Kind {
    Unsigned {
        is_big_endian: bool,
    },
    Signed {
        is_big_endian: bool,
    },
    Float {
        is_big_endian: bool,
    },
    /// Not read, and why.
    Other(&'static str),
}

impl Layout {
    pub fn read(blocks: &Blocks<'_>, group: Block<'_>, channels_left: &mut usize) -> Result<Self, Error> {
        let flags = group.half(16)?;
        let name = match group.link(2) {
            None => String::new(),
            link => blocks.text(link)?,
        };
        let mut channels = Vec::new();
        let mut next = group.link(1);
        while let Some(link) = next {
            *channels_left = channels_left.checked_sub(1).ok_or(Error::Parts)?;
            let block = blocks.at(link, &["CN"])?;
            channels.push(Place::read(blocks, block)?);
            next = block.link(0);
        }
        Ok(Self {
            id: group.long(0)?,
            rows: group.long(8)?,
            is_variable: flags & 1 != 0,
            has_remote_master: flags & 8 != 0,
            name,
            bytes: [group.word(24)? as usize, group.word(28)? as usize],
            channels,
        })
    }

    /// Bytes of one record.
    pub fn record_bytes(&self) -> usize {
        let [values, invalid] = self.bytes;
        values.saturating_add(invalid)
    }

    /// Names of its channels.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.channels.iter().map(|channel| channel.name.as_str())
    }

    /// The numbers of its channels; what is none goes to `left_out`.
    pub fn decode(
        &self,
        blocks: &Blocks<'_>,
        records: &[&[u8]],
        left_out: &mut Vec<String>,
    ) -> Result<Option<Group>, Error> {
        if self.is_variable || records.is_empty() {
            return Ok(None);
        }
        let mut group = Group {
            name: self.name.clone(),
            master: None,
            channels: Vec::new(),
        };
        for place in &self.channels {
            if let Err(why) = place.is_read(self) {
                left_out.push(format!("`{}` ({why})", place.name));
                continue;
            }
            blocks.take_values(records.len())?;
            let values = place.values(records, self.bytes[0]);
            let channel = |is_time| Channel {
                name: place.name.clone(),
                unit: place.unit.clone(),
                is_time,
                values,
            };
            match place.role {
                Role::Value => group.channels.push(channel(false)),
                Role::Master { is_time } | Role::Virtual { is_time } => group.master = Some(channel(is_time)),
            }
        }
        Ok((group.master.is_some() || !group.channels.is_empty()).then_some(group))
    }
}

impl Place {
    fn read(blocks: &Blocks<'_>, block: Block<'_>) -> Result<Self, Error> {
        let (kind, sync, stored) = (block.byte(0)?, block.byte(1)?, block.byte(2)?);
        let is_time = sync == 1;
        let role = match kind {
            2 => Role::Master { is_time },
            3 => Role::Virtual { is_time },
            _ => Role::Value,
        };
        let is_big_endian = stored % 2 == 1;
        let flags = block.word(12)?;
        let content = match (kind, stored) {
            // the structure's own bytes; its members follow as channels of their own in the files that were seen
            _ if block.link(1).is_some() => Kind::Other("an array or a structure"),
            (_, 6..=9) => Kind::Other("text"),
            (1 | 5, _) => Kind::Other("of changing length"),
            (4, _) => Kind::Other("another stream"),
            (6, _) => Kind::Other("the number of the row"),
            _ if flags & 1 != 0 => Kind::Other("all of it is marked as invalid"),
            (_, 0 | 1) => Kind::Unsigned { is_big_endian },
            (_, 2 | 3) => Kind::Signed { is_big_endian },
            (_, 4 | 5) => Kind::Float { is_big_endian },
            (_, 13 | 14) => Kind::Other("a date"),
            (_, 15 | 16) => Kind::Other("complex numbers"),
            _ => Kind::Other("bytes"),
        };
        let is_float = matches!(content, Kind::Float { .. });
        let (conversion, unit) = Conversion::read(blocks, block.link(4), is_float)?;
        let unit = blocks.text(block.link(6).or(unit))?;
        Ok(Self {
            name: blocks.text(block.link(2))?,
            unit,
            role,
            kind: content,
            bit: u32::from(block.byte(3)?),
            byte: block.word(4)? as usize,
            bits: block.word(8)?,
            invalid: (flags & 2 != 0).then_some(block.word(16)? as usize),
            conversion,
        })
    }

    fn is_read(&self, layout: &Layout) -> Result<(), &'static str> {
        let fits = || {
            let end = self.byte.checked_add(self.bytes());
            end.is_some_and(|end| end <= layout.bytes[0])
        };
        match self.kind {
            _ if layout.has_remote_master => Err("its time stands in another group"),
            Kind::Other(why) => Err(why),
            _ if self.conversion == Conversion::Words => Err("words or a formula"),
            _ if matches!(self.role, Role::Virtual { .. }) => Ok(()),
            Kind::Float { .. } if !matches!(self.bits, 32 | 64) || self.bit != 0 => Err("a float of another size"),
            _ if self.bits == 0 || self.bits > 64 || self.bit > 7 => Err("an integer of another size"),
            _ if !fits() => Err("outside of its record"),
            _ => Ok(()),
        }
    }

    /// Bytes that its bits lie in.
    fn bytes(&self) -> usize {
        self.bit.saturating_add(self.bits).div_ceil(8) as usize
    }

    /// The physical values; `behind` is where invalidation bits begin.
    fn values(&self, records: &[&[u8]], behind: usize) -> Vec<f64> {
        let is_virtual = matches!(self.role, Role::Virtual { .. });
        let value = |(row, record): (usize, &&[u8])| {
            let is_invalid = self.invalid.is_some_and(|bit| {
                let byte = record.get(behind..).and_then(|bits| bits.get(bit / 8));
                byte.is_none_or(|byte| byte >> (bit % 8) & 1 == 1)
            });
            let raw = match (is_invalid, is_virtual) {
                (true, _) => None,
                (false, true) => Some(row as f64),
                (false, false) => self.raw(record),
            };
            raw.map_or(f64::NAN, |raw| self.conversion.of(raw))
        };
        records.iter().enumerate().map(value).collect()
    }

    /// What stands in a record.
    fn raw(&self, record: &[u8]) -> Option<f64> {
        let bytes = record.get(self.byte..)?.get(..self.bytes())?;
        let whole = |is_big_endian: bool| {
            let add = |sum: u128, byte: &u8| sum << 8 | u128::from(*byte);
            match is_big_endian {
                true => bytes.iter().fold(0, add),
                false => bytes.iter().rev().fold(0, add),
            }
        };
        let bits = |is_big_endian| {
            // at most 64 bits, so the mask leaves an u64
            (whole(is_big_endian) >> self.bit & ((1_u128 << self.bits) - 1)) as u64
        };
        Some(match self.kind {
            Kind::Unsigned { is_big_endian } => bits(is_big_endian) as f64,
            Kind::Signed { is_big_endian } => {
                let empty = 64 - self.bits;
                ((bits(is_big_endian) << empty) as i64 >> empty) as f64
            }
            Kind::Float { is_big_endian } => {
                let bits = bits(is_big_endian);
                match self.bits {
                    32 => f64::from(f32::from_bits(bits as u32)),
                    _ => f64::from_bits(bits),
                }
            }
            Kind::Other(_) => return None,
        })
    }
}
