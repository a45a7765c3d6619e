//! What is looked up in an ELF file of 32 bits: sizes of sections and symbols.

use object::read::elf::{FileHeader, SectionHeader, Sym};
use object::{Endianness, elf};

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
        let header = elf::FileHeader32::<Endianness>::parse(bytes).ok()?;
        let endian = header.endian().ok()?;
        let table = header.sections(endian, bytes).ok()?;
        let mut sections = Vec::new();
        for section in table
            .iter()
            // debug information and relocations stay in the file
            .filter(|section| section.sh_flags(endian).contains(elf::SHF_ALLOC))
        {
            let name = table.section_name(endian, section).ok()?;
            sections.push(Section {
                name: String::from_utf8_lossy(name).into_owned(),
                size: section.sh_size(endian),
                is_writable: section.sh_flags(endian).contains(elf::SHF_WRITE),
                has_content: section.sh_type(endian) != elf::SHT_NOBITS,
            });
        }
        // on Arm alone the lowest bit of an address is a mark
        let is_arm = header.e_machine(endian) == elf::EM_ARM;
        let table = table.symbols(endian, bytes, elf::SHT_SYMTAB).ok()?;
        let mut symbols = Vec::new();
        for symbol in table.iter() {
            let (name, address) = (symbol.name(endian, table.strings()).ok()?, symbol.st_value(endian));
            if !name.is_empty() {
                symbols.push(Symbol {
                    name: String::from_utf8_lossy(name).into_owned(),
                    address: if is_arm { address & !1 } else { address },
                    is_defined: symbol.st_shndx(endian) != elf::SHN_UNDEF,
                });
            }
        }
        Some(Self { sections, symbols })
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
        total(sections)
    }

    /// Bytes that can be written at run time.
    #[must_use]
    pub fn ram_bytes(&self) -> u32 {
        // `.data` counts here and in flash: its first values are copied at the start
        let sections = self.kept().filter(|section| section.is_writable);
        total(sections)
    }
}

/// Sizes are what the file says: those of a damaged one need not fit into the memory of a target, nor into a word.
fn total<'a>(sections: impl Iterator<Item = &'a Section>) -> u32 {
    sections.fold(0, |sum, section| sum.saturating_add(section.size))
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

    #[test]
    fn sizes_beyond_a_word_are_summed_without_a_panic() {
        let section = Section {
            name: ".text".to_owned(),
            size: u32::MAX,
            is_writable: true,
            has_content: true,
        };
        let elf = Elf {
            sections: vec![section.clone(), section],
            symbols: Vec::new(),
        };
        assert_eq!((elf.flash_bytes(), elf.ram_bytes()), (u32::MAX, u32::MAX));
    }
}
