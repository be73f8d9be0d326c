//! `cargo xtask image`: the contents of the image.

use crate::board::Board;
use crate::cli::ImageArgs;
use crate::elf::{Image, Sizes};
use crate::setup::Setup;
use crate::{build, check, process};
use anyhow::{Context, Result};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::Path;

/// The command.
pub fn run(args: &ImageArgs) -> Result<u8> {
    let path = build::image(&Setup::default().toolchain()?, build::System::Traction, None)?;
    let sizes = read(&path)?.sizes;
    if args.json {
        println!("{}", as_json(&sizes));
    } else {
        print!("{}", as_table(&sizes));
    }
    Ok(0)
}

/// The image's check as a step of the tests: its findings are printed, `true` is good.
pub fn check(path: &Path) -> Result<bool> {
    let image = read(path)?;
    let is_good = process::is_good(&check::findings(&image));
    if is_good {
        let handlers: BTreeSet<_> = image.vectors().into_values().flatten().map(String::as_str).collect();
        let (functions, handlers) = (image.functions.len(), Vec::from_iter(handlers).join(", "));
        println!("{functions} functions; from {handlers} no panic within reach; no double precision");
    }
    Ok(is_good)
}

/// The least stack that a board's image must leave, in bytes: the deepest that the timing and the twin have seen is half of it.
const LEAST_STACK: u64 = 4_096;

/// The same for a board of real hardware, whose image must also lie in its flash memory and leave room for the stack.
pub fn check_board(path: &Path, board: &Board) -> Result<bool> {
    let (image, wanted) = (read(path)?, board.flashed.flash_origin);
    let (is_there, has_room) = (image.origin == wanted, image.sizes.stack >= LEAST_STACK);
    if !is_there {
        println!("the image begins at {:#x}, the board's flash memory at {wanted:#x}", image.origin);
    }
    if !has_room {
        println!("{} bytes are left for the stack, {LEAST_STACK} at least are needed", image.sizes.stack);
    }
    Ok(check(path)? && is_there && has_room)
}

/// Reads an image.
pub fn read(path: &Path) -> Result<Image> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    Image::parse(&bytes).with_context(|| path.display().to_string())
}

fn rows(sizes: &Sizes) -> [(&'static str, &'static str, u64); 6] {
    [
        ("code_bytes", "code (.text and vectors)", sizes.code),
        ("table_bytes", "the machine's tables, by name", sizes.tables),
        ("rodata_bytes", "read-only data, tables included", sizes.rodata),
        ("ram_bytes", "RAM (.data and .bss)", sizes.ram),
        ("recorder_bytes", "RAM of the flight recorder", sizes.recorder),
        ("stack_bytes", "left for the stack", sizes.stack),
    ]
}

fn as_table(sizes: &Sizes) -> String {
    let lines = rows(sizes).map(|(_, what, bytes)| format!("{what:<32} {bytes:>8} bytes\n"));
    lines.concat()
}

fn as_json(sizes: &Sizes) -> serde_json::Value {
    let image: serde_json::Value =
        rows(sizes).into_iter().map(|(name, _, bytes)| (name.to_owned(), json!(bytes))).collect();
    json!({ "image": image })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: Sizes = Sizes { code: 12_345, tables: 20, rodata: 30, ram: 40, recorder: 45, stack: 50 };

    #[test]
    fn the_same_numbers_in_both_forms() {
        let json = as_json(&SIZES);
        let table = as_table(&SIZES);
        for ((name, what, bytes), line) in rows(&SIZES).into_iter().zip(table.lines()) {
            assert_eq!(json["image"][name], bytes);
            assert!(line.starts_with(what) && line.ends_with(&format!(" {bytes} bytes")), "{line}");
        }
    }

    #[test]
    fn a_missing_image_is_named() {
        let message = format!("{:#}", check(Path::new("no/such.elf")).unwrap_err());
        assert!(message.starts_with("no/such.elf: "), "{message}");
    }
}
