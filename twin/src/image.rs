//! The image: the ELF file that is flashed, as bytes in the flash memory and as names.

use anyhow::{Context, Result, ensure};
use object::read::elf::ProgramHeader as _;
use object::{Object, ObjectSymbol, SymbolKind};
use sha2::{Digest, Sha256};
use std::path::Path;

/// The flash memory's first address, and its length.
pub const FLASH: (u32, u32) = (0x0800_0000, 512 * 1024);

/// The image.
pub struct Image {
    /// The flash memory's contents; erased where the image says nothing.
    pub flash: Vec<u8>,
    /// The file's SHA-256, in hexadecimal.
    pub sha256: String,
    /// Functions: address and name, by address.
    functions: Vec<(u32, String)>,
    /// Variables, likewise.
    variables: Vec<(u32, String)>,
    /// The end of the static data in RAM: the stack may not come down to it.
    pub statics_end: u32,
    /// The bytes of the flash memory that it fills.
    pub flash_bytes: u32,
}

impl Image {
    /// Reads the file. The error names it.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
        Self::parse(&bytes).with_context(|| path.display().to_string())
    }

    fn parse(bytes: &[u8]) -> Result<Self> {
        let file = object::read::elf::ElfFile32::<object::Endianness>::parse(bytes)?;
        let mut flash_bytes = 0;
        let mut flash = vec![0xFF; FLASH.1 as usize];
        for header in file.elf_program_headers() {
            let endian = object::Endianness::Little;
            let data = header.data(endian, bytes).map_err(|()| anyhow::anyhow!("a segment is cut off"))?;
            let (at, length) = (header.p_paddr.get(endian), data.len());
            if header.p_type.get(endian) != object::elf::PT_LOAD || length == 0 {
                continue;
            }
            let from = at.wrapping_sub(FLASH.0) as usize;
            flash_bytes += length as u32;
            let room = flash.get_mut(from..from + length);
            room.with_context(|| format!("a segment at {at:#010x} lies outside the flash memory"))?
                .copy_from_slice(data);
        }
        ensure!(flash[..4] != [0xFF; 4], "no vector table at {:#010x}", FLASH.0);
        let text = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text);
        let mut functions: Vec<_> = text
            .map(|symbol| (symbol.address() as u32 & !1, symbol.name().unwrap_or_default().to_owned()))
            .collect();
        functions.sort();
        let data = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Data);
        let mut variables: Vec<_> = data
            .map(|symbol| (symbol.address() as u32, symbol.name().unwrap_or_default().to_owned()))
            .collect();
        variables.sort();
        let statics_end = file.symbols().find(|symbol| symbol.name() == Ok("__sheap"));
        let statics_end = statics_end.context("no symbol __sheap")?.address() as u32;
        let digest = Sha256::digest(bytes);
        let sha256 = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { flash, sha256, functions, variables, statics_end, flash_bytes })
    }

    /// An image of these words, the vector table first, without names.
    #[cfg(test)]
    pub fn of(words: &[u32]) -> Self {
        let mut flash: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        flash.resize(FLASH.1 as usize, 0xFF);
        let flash_bytes = 4 * words.len() as u32;
        let (functions, variables) = (Vec::new(), Vec::new());
        Self { flash, sha256: String::new(), functions, variables, statics_end: 0x2000_0000, flash_bytes }
    }

    /// The first address of a variable, by a part of its name.
    pub fn variable(&self, name: &str) -> Option<u32> {
        self.variables.iter().find(|(_, known)| known.contains(name)).map(|(address, _)| *address)
    }

    /// The function at an address.
    pub fn function(&self, address: u32) -> &str {
        let after = self.functions.partition_point(|(from, _)| *from <= address);
        after.checked_sub(1).map_or("?", |index| &self.functions[index].1)
    }
}
