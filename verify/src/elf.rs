//! What is looked up in an ELF file of 32 bits: sizes of sections and symbols.

/// Sections and symbols of an object file or an image.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Elf {
    /// Sections that take memory on the target.
    pub sections: Vec<Section>,
    /// Named symbols.
    pub symbols: Vec<Symbol>,
}

/// A section that takes memory on the target.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// Name.
    pub name: String,
    /// Bytes.
    pub size: u32,
    /// Can be written at run time.
    pub is_writable: bool,
    /// Has content in the file; `.bss` has none.
    pub has_content: bool,
}

/// A named symbol.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Symbol {
    /// Name.
    pub name: String,
    /// Address, without the bit that marks Thumb code.
    pub address: u32,
    /// Defined in this file.
    pub is_defined: bool,
}

impl Elf {
    /// Reads an ELF file of 32 bits in either byte order; `None` if it is something else or cut short.
    #[must_use]
    pub fn read(bytes: &[u8]) -> Option<Self> {
        let file = File::new(bytes)?;
        let headers = file.section_headers()?;
        let names = headers.get(usize::from(file.half(50)?))?;
        let mut elf = Self::default();
        for header in &headers {
            if header.flags & SHF_ALLOC != 0 {
                elf.sections.push(Section {
                    name: file.text(names.offset, header.name)?,
                    size: header.size,
                    is_writable: header.flags & SHF_WRITE != 0,
                    has_content: header.kind != SHT_NOBITS,
                });
            }
            if header.kind == SHT_SYMTAB {
                let strings = headers.get(usize::try_from(header.link).ok()?)?;
                elf.symbols.extend(file.symbols(header, strings)?);
            }
        }
        Some(elf)
    }

    /// Address of a symbol.
    #[must_use]
    pub fn address(&self, name: &str) -> Option<u32> {
        let symbol = self
            .symbols
            .iter()
            .find(|symbol| symbol.is_defined && symbol.name == name);
        symbol.map(|symbol| symbol.address)
    }

    /// Sections without those of unwinding, which firmware does not link.
    fn kept(&self) -> impl Iterator<Item = &Section> {
        let unwinding = [".eh_frame", ".ARM.ex"];
        self.sections
            .iter()
            .filter(move |section| !unwinding.iter().any(|start| section.name.starts_with(start)))
    }

    /// Bytes of code and constants.
    #[must_use]
    pub fn flash_bytes(&self) -> u32 {
        let sections = self.kept().filter(|section| section.has_content);
        sections.map(|section| section.size).sum()
    }

    /// Bytes that can be written at run time.
    #[must_use]
    pub fn ram_bytes(&self) -> u32 {
        let sections = self.kept().filter(|section| section.is_writable);
        sections.map(|section| section.size).sum()
    }
}

const SHF_WRITE: u32 = 1;
const SHF_ALLOC: u32 = 2;
const SHT_SYMTAB: u32 = 2;
const SHT_NOBITS: u32 = 8;
const EM_ARM: u16 = 40;

struct File<'a> {
    bytes: &'a [u8],
    is_big: bool,
}

struct Header {
    name: u32,
    kind: u32,
    flags: u32,
    offset: u32,
    size: u32,
    link: u32,
}

impl<'a> File<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        let is_32_bit = bytes.starts_with(b"\x7fELF") && bytes.get(4) == Some(&1);
        is_32_bit.then_some(())?;
        Some(Self {
            bytes,
            is_big: *bytes.get(5)? == 2,
        })
    }

    fn half(&self, at: usize) -> Option<u16> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.is_big {
            u16::from_be_bytes(bytes)
        } else {
            u16::from_le_bytes(bytes)
        })
    }

    fn word(&self, at: usize) -> Option<u32> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.is_big {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        })
    }

    fn section_headers(&self) -> Option<Vec<Header>> {
        let start = usize::try_from(self.word(32)?).ok()?;
        let (size, count) = (usize::from(self.half(46)?), usize::from(self.half(48)?));
        let header = |index: usize| {
            let at = start.checked_add(index * size)?;
            Some(Header {
                name: self.word(at)?,
                kind: self.word(at + 4)?,
                flags: self.word(at + 8)?,
                offset: self.word(at + 16)?,
                size: self.word(at + 20)?,
                link: self.word(at + 24)?,
            })
        };
        (0..count).map(header).collect()
    }

    fn symbols(&self, table: &Header, strings: &Header) -> Option<Vec<Symbol>> {
        let is_arm = self.half(18)? == EM_ARM;
        let start = usize::try_from(table.offset).ok()?;
        let mut symbols = Vec::new();
        for index in 0..usize::try_from(table.size).ok()? / 16 {
            let at = start.checked_add(index * 16)?;
            let name = self.text(strings.offset, self.word(at)?)?;
            let address = self.word(at + 4)?;
            if !name.is_empty() {
                symbols.push(Symbol {
                    name,
                    address: if is_arm { address & !1 } else { address },
                    is_defined: self.half(at + 14)? != 0,
                });
            }
        }
        Some(symbols)
    }

    fn text(&self, table: u32, offset: u32) -> Option<String> {
        let start = usize::try_from(table.checked_add(offset)?).ok()?;
        let rest = self.bytes.get(start..)?;
        let end = rest.iter().position(|byte| *byte == 0)?;
        Some(String::from_utf8_lossy(&rest[..end]).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_elf_file_of_32_bits_or_is_cut_short_is_refused() {
        assert_eq!(Elf::read(b""), None);
        assert_eq!(Elf::read(b"\x7fELF\x01\x01"), None);
        let mut header = vec![0; 64];
        header[..6].copy_from_slice(b"\x7fELF\x01\x01");
        // section headers far behind the end
        header[32..36].copy_from_slice(&u32::MAX.to_le_bytes());
        header[46] = 40;
        header[48] = 3;
        assert_eq!(Elf::read(&header), None);
        header[4] = 2;
        assert_eq!(Elf::read(&header), None);
    }
}
