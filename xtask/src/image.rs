//! What the image is made of, and what must not be in it.

use crate::build;
use crate::calls::{self, Function};
use anyhow::{Context, Result, bail};
use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};
use std::path::Path;

/// Sizes, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Sizes {
    code: u64,
    tables: u64,
    constants: u64,
    ram: u64,
    stack: u64,
}

/// Builds the image and prints its table.
pub fn show(json: bool) -> Result<u8> {
    let path = build::image(None)?;
    let data = read(&path)?;
    let sizes = sizes(&parse(&data)?)?;
    if json {
        let value = serde_json::json!({ "image": {
            "code_bytes": sizes.code, "table_bytes": sizes.tables, "constant_bytes": sizes.constants,
            "ram_bytes": sizes.ram, "stack_bytes": sizes.stack,
        }});
        println!("{value}");
    } else {
        print(&sizes);
    }
    Ok(0)
}

fn print(sizes: &Sizes) {
    println!("code                {:7} bytes", sizes.code);
    println!("machine tables      {:7} bytes", sizes.tables);
    println!("other constants     {:7} bytes", sizes.constants);
    println!("RAM, static         {:7} bytes", sizes.ram);
    println!("RAM, left for stack {:7} bytes", sizes.stack);
}

/// No double precision, no panic that an interrupt can reach.
pub fn check(path: &Path) -> Result<()> {
    let data = read(path)?;
    let elf = parse(&data)?;
    print(&sizes(&elf)?);
    let functions = functions(&elf)?;
    if let Some(function) = functions.iter().find(|function| is_double_precision(&function.name)) {
        bail!("{}: double-precision routine in the image", function.name);
    }
    let handlers = handlers(&elf)?;
    if let Some(way) = calls::path_to(&functions, &handlers, is_panic) {
        bail!("an interrupt can panic: {}", way.join(" -> "));
    }
    let interrupts = handlers.len();
    println!(
        "no double-precision routine; no panic from {interrupts} handlers ({} functions)",
        functions.len()
    );
    Ok(())
}

/// Soft-float helpers of the run-time ABI and of compiler-rt that work in double precision.
fn is_double_precision(name: &str) -> bool {
    let aeabi = name.strip_prefix("__aeabi_").is_some_and(|rest| {
        (rest.starts_with('d') && !rest.starts_with("div")) || rest.ends_with("2d") || rest.starts_with("cd")
    });
    let compiler_rt = name.starts_with("__") && name.contains("df") && !name.contains("aeabi");
    aeabi || compiler_rt
}

fn is_panic(name: &str) -> bool {
    ["core::panicking", "rust_begin_unwind", "panic_fmt", "unwrap_failed", "expect_failed", "slice_index"]
        .iter()
        .any(|part| name.contains(part))
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("{}", path.display()))
}

type Elf<'a> = ElfFile32<'a>;

fn parse(data: &[u8]) -> Result<Elf<'_>> {
    ElfFile32::parse(data).context("not an ELF file of a 32-bit machine")
}

fn sizes(elf: &Elf) -> Result<Sizes> {
    let section = |name: &str| elf.section_by_name(name).map_or(0, |section| section.size());
    let tables = elf
        .symbols()
        .filter(|symbol| symbol.name().is_ok_and(|name| demangled(name).starts_with("tractive::machine::")))
        .filter(|symbol| symbol.kind() == SymbolKind::Data)
        .map(|symbol| symbol.size())
        .sum();
    let address = |name: &str| {
        let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name));
        symbol.map(|symbol| symbol.address()).with_context(|| format!("the image has no symbol {name}"))
    };
    Ok(Sizes {
        code: section(".vector_table") + section(".text"),
        tables,
        constants: section(".rodata").saturating_sub(tables),
        ram: section(".data") + section(".bss"),
        stack: address("_stack_start")?.saturating_sub(address("__sheap")?),
    })
}

fn demangled(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name))
}

fn functions(elf: &Elf) -> Result<Vec<Function>> {
    let text = elf.section_by_name(".text").context("the image has no .text")?;
    let (base, bytes) = (text.address(), text.data().context("no .text")?);
    let mut functions: Vec<_> = elf
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0)
        .filter_map(|symbol| {
            let address = symbol.address() & !1;
            let begin = usize::try_from(address.checked_sub(base)?).ok()?;
            let code = bytes.get(begin..begin + usize::try_from(symbol.size()).ok()?)?;
            Some(Function {
                name: demangled(symbol.name().ok()?),
                address: address as u32,
                bytes: code.to_vec(),
            })
        })
        .collect();
    functions.sort_by_key(|function| function.address);
    functions.dedup_by_key(|function| function.address);
    if functions.is_empty() {
        bail!("the image has no function symbols");
    }
    Ok(functions)
}

/// Addresses in the vector table from the first device interrupt on.
fn handlers(elf: &Elf) -> Result<Vec<u32>> {
    const SYSTEM_ENTRIES: usize = 16;
    let table = elf.section_by_name(".vector_table").context("the image has no vector table")?;
    let words =
        table.data()?.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
    let handlers: Vec<_> = words.skip(SYSTEM_ENTRIES).filter(|word| *word != 0).collect();
    if handlers.is_empty() {
        bail!("the vector table holds no interrupt");
    }
    Ok(handlers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_precision_is_recognised() {
        for name in
            ["__aeabi_dadd", "__aeabi_f2d", "__aeabi_dcmplt", "__aeabi_cdcmpeq", "__muldf3", "__floatsidf"]
        {
            assert!(is_double_precision(name), "{name}");
        }
        for name in
            ["__aeabi_uldivmod", "__aeabi_memcpy", "__aeabi_idiv", "__aeabi_fadd", "sqrtf", "DUALTIMER"]
        {
            assert!(!is_double_precision(name), "{name}");
        }
    }

    #[test]
    fn panics_are_recognised() {
        assert!(is_panic("core::panicking::panic_bounds_check"));
        assert!(is_panic("core::option::unwrap_failed"));
        assert!(!is_panic("tractive::drive::traction::ControlTask::run"));
    }
}
