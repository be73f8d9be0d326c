//! An image as the checks see it: its functions, its code and data bytes, its interrupt handlers, its sizes.

use crate::thumb::{self, Instruction};
use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// A function. Several names may stand at one address.
#[derive(Clone, Debug, Default)]
pub struct Function {
    /// Bytes.
    pub size: u32,
    /// Demangled.
    pub names: Vec<String>,
}

/// Bytes of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sizes {
    /// Instructions and the vector table.
    pub code: u64,
    /// Read-only data that belongs to the machine by its name.
    pub tables: u64,
    /// All read-only data, the tables among it.
    pub rodata: u64,
    /// Initialised and zeroed data, but for the flight recorder.
    pub ram: u64,
    /// The flight recorder's ring.
    pub recorder: u64,
    /// The memory that is left for the stack.
    pub stack: u64,
}

/// The contents of an ELF file.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// By address.
    pub functions: BTreeMap<u32, Function>,
    /// The demangled name of every symbol.
    pub symbols: BTreeSet<String>,
    /// Bytes of the executable sections, by address.
    pub code: BTreeMap<u32, Vec<u8>>,
    /// From this address on: `true` instructions, `false` literals.
    pub mapping: BTreeMap<u32, bool>,
    /// By address.
    pub instructions: BTreeMap<u32, Instruction>,
    /// Name and address of what the vector table leads to, but for the reset.
    pub handlers: Vec<(String, u32)>,
    /// The address of the vector table.
    pub origin: u32,
    /// Every aligned word of the data sections.
    pub data_words: BTreeSet<u32>,
    pub sizes: Sizes,
}

impl Image {
    /// Reads a 32-bit ARM ELF file.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let file = object::File::parse(bytes).context("not an ELF file")?;
        if file.architecture() != object::Architecture::Arm || !file.is_little_endian() {
            bail!("not an image for a little-endian ARM: {:?}", file.architecture());
        }
        let mut image = Self::default();
        image.read_sections(&file)?;
        image.read_symbols(&file)?;
        image.read_handlers(&file)?;
        image.read_instructions()?;
        Ok(image)
    }

    /// Decodes the code between literals again.
    pub fn read_instructions(&mut self) -> Result<()> {
        let mut instructions = BTreeMap::new();
        for (&start, bytes) in &self.code {
            let end = start + bytes.len() as u32;
            let changes = self.mapping.range(start + 1..end).map(|(at, _)| *at);
            let bounds: Vec<u32> = [start].into_iter().chain(changes).chain([end]).collect();
            for piece in bounds.windows(2).filter(|piece| self.is_code(piece[0])) {
                let [from, to] = [piece[0], piece[1]].map(|at| (at - start) as usize);
                instructions.extend(thumb::decode(piece[0], &bytes[from..to])?);
            }
        }
        self.instructions = instructions;
        Ok(())
    }

    /// The word among the code at this address.
    pub fn word(&self, address: u32) -> Option<u32> {
        let (start, bytes) = self.code.range(..=address).next_back()?;
        let at = (address - start) as usize;
        Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
    }

    /// `true` if the code at this address consists of instructions, not literals.
    pub fn is_code(&self, address: u32) -> bool {
        self.mapping.range(..=address).next_back().is_none_or(|(_, is_code)| *is_code)
    }

    /// The instructions of the function that starts here.
    pub fn instructions_of(&self, start: u32) -> impl Iterator<Item = (u32, &Instruction)> {
        let size = self.functions.get(&start).map_or(0, |function| function.size);
        self.instructions.range(start..start.saturating_add(size)).map(|(at, instruction)| (*at, instruction))
    }

    /// The names of the handlers by the vector table's entries, as `TIMER0` by `interrupt 8`; none where no function is.
    pub fn vectors(&self) -> BTreeMap<&str, &[String]> {
        let names = |address| self.functions.get(address).map_or(&[][..], |function| &function.names);
        self.handlers.iter().map(|(entry, address)| (entry.as_str(), names(address))).collect()
    }

    /// The function that holds this address.
    pub fn function_at(&self, address: u32) -> Option<u32> {
        let (&start, function) = self.functions.range(..=address).next_back()?;
        (address - start < function.size.max(1)).then_some(start)
    }

    /// The first name of the function that holds this address.
    pub fn name_at(&self, address: u32) -> &str {
        let function = self.function_at(address).and_then(|start| self.functions.get(&start));
        function.and_then(|function| function.names.first()).map_or("?", String::as_str)
    }

    fn read_sections(&mut self, file: &object::File) -> Result<()> {
        for section in file.sections() {
            let name = section.name()?;
            let size = section.size();
            match section.kind() {
                _ if name == ".vector_table" => self.sizes.code += size,
                SectionKind::Text => {
                    self.sizes.code += size;
                    self.code.insert(address(section.address())?, section.data()?.to_vec());
                }
                SectionKind::ReadOnlyData | SectionKind::ReadOnlyString => {
                    self.sizes.rodata += size;
                    self.data_words.extend(words(section.data()?));
                }
                SectionKind::Data => {
                    self.sizes.ram += size;
                    self.data_words.extend(words(section.data()?));
                }
                SectionKind::UninitializedData => self.sizes.ram += size,
                _ => {}
            }
        }
        Ok(())
    }

    fn read_symbols(&mut self, file: &object::File) -> Result<()> {
        let (mut stack_start, mut stack_end) = (None, None);
        for symbol in file.symbols() {
            let raw = symbol.name()?;
            if raw == "$t" || raw.starts_with("$t.") {
                self.mapping.insert(address(symbol.address())?, true);
            } else if raw == "$d" || raw.starts_with("$d.") {
                self.mapping.insert(address(symbol.address())?, false);
            }
            match raw {
                "_stack_start" => stack_start = Some(symbol.address()),
                "_stack_end" => stack_end = Some(symbol.address()),
                _ => {}
            }
            if raw.is_empty()
                || raw.starts_with('$')
                || symbol.kind() == SymbolKind::File
                || symbol.is_undefined()
            {
                continue;
            }
            let name = demangle(raw);
            if symbol.kind() == SymbolKind::Text {
                let function = self.functions.entry(address(symbol.address())? & !1).or_default();
                function.size = function.size.max(address(symbol.size())?);
                function.names.push(name.clone());
            }
            if name.starts_with("tractive")
                && name.contains("::built_in::")
                && is_read_only_data(file, &symbol)
            {
                self.sizes.tables += symbol.size();
            }
            if name.starts_with("tractive") && name.ends_with("RECORDER") {
                self.sizes.recorder += symbol.size();
            }
            self.symbols.insert(name);
        }
        self.sizes.ram = self.sizes.ram.saturating_sub(self.sizes.recorder);
        self.sizes.stack = stack_start.zip(stack_end).map_or(0, |(start, end)| start.saturating_sub(end));
        self.close_gaps();
        Ok(())
    }

    /// Functions written in assembly have no size: they extend to the next one, or to the end of the section.
    fn close_gaps(&mut self) {
        let starts: Vec<u32> = self.functions.keys().copied().collect();
        for (index, start) in starts.iter().enumerate() {
            let section = self.code.range(..=start).next_back();
            let section_end = section.map_or(*start, |(at, bytes)| at + bytes.len() as u32);
            let next = starts.get(index + 1).copied().unwrap_or(section_end).min(section_end);
            if let Some(function) = self.functions.get_mut(start).filter(|function| function.size == 0) {
                function.size = next.saturating_sub(*start);
            }
        }
    }

    fn read_handlers(&mut self, file: &object::File) -> Result<()> {
        let table =
            file.section_by_name(".vector_table").context("the image has no section .vector_table")?;
        self.origin = address(table.address())?;
        // Word 0 is the stack pointer, word 1 the reset; a reserved entry holds 0.
        for (index, word) in words(table.data()?).enumerate().skip(2).filter(|(_, word)| *word != 0) {
            self.handlers.push((handler_name(index), word & !1));
        }
        Ok(())
    }
}

fn handler_name(index: usize) -> String {
    match index {
        2 => "NonMaskableInt".to_owned(),
        3 => "HardFault".to_owned(),
        0..16 => format!("exception {index}"),
        _ => format!("interrupt {}", index - 16),
    }
}

/// Without the hash and the crate's disambiguator.
fn demangle(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name))
}

fn is_read_only_data<'a>(file: &object::File<'a>, symbol: &impl ObjectSymbol<'a>) -> bool {
    let section = symbol.section_index().and_then(|index| file.section_by_index(index).ok());
    section.is_some_and(|section| {
        matches!(section.kind(), SectionKind::ReadOnlyData | SectionKind::ReadOnlyString)
    })
}

fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word))
}

fn address(value: u64) -> Result<u32> {
    u32::try_from(value).with_context(|| format!("{value:#x} is no 32-bit address"))
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use object::build::elf::Builder;
    use object::{Endianness, elf};

    /// A small ELF file: a vector table with one interrupt, functions by (name, address, code), all in one section
    /// at 0x100, and one table in read-only data.
    pub fn small_elf(handler: u32, functions: &[(&str, u32, &[u16])]) -> Vec<u8> {
        let mut builder = Builder::new(Endianness::Little, false);
        builder.header.e_machine = elf::EM_ARM;
        builder.header.e_type = elf::ET_EXEC;
        let mut vectors = [0u32; 17];
        (vectors[0], vectors[1], vectors[16]) = (0x2000_1000, 0x101, handler | 1);
        let vectors = vectors.iter().flat_map(|word| word.to_le_bytes()).collect();
        let end =
            functions.iter().map(|(_, at, code)| *at as usize - 0x100 + code.len() * 2).max().unwrap_or(0);
        let mut text = vec![0; end];
        for (_, at, code) in functions {
            let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
            let at = *at as usize - 0x100;
            text[at..at + bytes.len()].copy_from_slice(&bytes);
        }
        let alloc = u64::from(elf::SHF_ALLOC);
        let code_flags = alloc | u64::from(elf::SHF_EXECINSTR);
        add_section(&mut builder, ".vector_table", 0, alloc, vectors);
        let code = add_section(&mut builder, ".text", 0x100, code_flags, text);
        let data = add_section(&mut builder, ".rodata", 0x8000, alloc, vec![0; 64]);
        let mut add_symbol = |name: &str, kind, section, value: u32, size: u64| {
            let symbol = builder.symbols.add();
            symbol.name = name.to_owned().into_bytes().into();
            symbol.set_st_info(elf::STB_GLOBAL, kind);
            (symbol.section, symbol.st_value, symbol.st_size) = (Some(section), value.into(), size);
        };
        for (name, at, code_words) in functions {
            add_symbol(name, elf::STT_FUNC, code, at | 1, code_words.len() as u64 * 2);
        }
        add_symbol("tractive::built_in::traction::BUILT_IN", elf::STT_OBJECT, data, 0x8000, 48);
        for (name, kind, flags) in [
            (".symtab", elf::SHT_SYMTAB, 0),
            (".strtab", elf::SHT_STRTAB, 0),
            (".shstrtab", elf::SHT_STRTAB, 0),
        ] {
            let section = builder.sections.add();
            section.name = name.into();
            (section.sh_type, section.sh_flags) = (kind, flags);
            section.data = match name {
                ".symtab" => object::build::elf::SectionData::Symbol,
                ".strtab" => object::build::elf::SectionData::String,
                _ => object::build::elf::SectionData::SectionString,
            };
        }
        builder.set_section_sizes();
        let mut bytes = Vec::new();
        builder.write(&mut bytes).unwrap();
        bytes
    }

    fn add_section(
        builder: &mut Builder<'_>,
        name: &'static str,
        address: u64,
        flags: u64,
        data: Vec<u8>,
    ) -> object::build::elf::SectionId {
        let section = builder.sections.add();
        section.name = name.into();
        (section.sh_type, section.sh_flags, section.sh_addr) = (elf::SHT_PROGBITS, flags, address);
        section.sh_addralign = 4;
        section.data = object::build::elf::SectionData::Data(data.into());
        section.id()
    }

    #[test]
    fn functions_handlers_and_sizes_are_read() {
        let bytes = small_elf(0x100, &[("handler", 0x100, &[0x4770, 0xBF00]), ("other", 0x104, &[0x4770])]);
        let image = Image::parse(&bytes).unwrap();
        assert_eq!(image.handlers, [("interrupt 0".to_owned(), 0x100)]);
        assert_eq!(image.functions[&0x100].names, ["handler"]);
        assert_eq!((image.function_at(0x103), image.function_at(0x104)), (Some(0x100), Some(0x104)));
        assert_eq!(image.function_at(0x106), None);
        assert_eq!(image.word(0x100), Some(0xBF00_4770));
        assert_eq!(image.word(0x106), None);
        assert_eq!(image.instructions.keys().copied().collect::<Vec<_>>(), [0x100, 0x102, 0x104]);
        assert_eq!(image.vectors()["interrupt 0"], ["handler"]);
        let sizes = Sizes { code: 68 + 6, tables: 48, rodata: 64, ram: 0, recorder: 0, stack: 0 };
        assert_eq!(image.sizes, sizes);
    }

    #[test]
    fn what_is_no_image_is_refused() {
        assert!(Image::parse(b"not an image").is_err());
        let mut other = small_elf(0x100, &[]);
        other[18] = 62; // x86-64
        assert!(Image::parse(&other).is_err());
    }
}
