//! The place of a word in the image's memory, by the debug information of the ELF file that was flashed.

use anyhow::{Context, Result, bail};
use gimli::{AttributeValue, DebuggingInformationEntry, Dwarf, EndianSlice, LittleEndian, Unit, UnitOffset};
use object::{Object, ObjectSection};
use std::path::Path;

type Bytes<'a> = EndianSlice<'a, LittleEndian>;
type Entry<'u, 'a> = DebuggingInformationEntry<'u, 'u, Bytes<'a>>;

/// The address of a static's field: the static's name, and the fields' names on the way. The error names the file and what is not there.
pub fn place(image: &Path, variable: &str, fields: &[&str]) -> Result<u32> {
    let told = || format!("{}: no debug information of {variable}.{}", image.display(), fields.join("."));
    let bytes = std::fs::read(image).with_context(|| image.display().to_string())?;
    let file = object::File::parse(&*bytes)?;
    let section = |id: gimli::SectionId| -> Result<Bytes> {
        let data = file.section_by_name(id.name()).and_then(|section| section.data().ok());
        Ok(EndianSlice::new(data.unwrap_or_default(), LittleEndian))
    };
    let dwarf = Dwarf::load(section)?;
    let mut units = dwarf.units();
    while let Some(header) = units.next()? {
        let unit = dwarf.unit(header)?;
        if let Some((address, of)) = variable_in(&dwarf, &unit, variable)? {
            return field(&dwarf, &unit, address, of, fields).with_context(told);
        }
    }
    bail!(told())
}

fn is_named(dwarf: &Dwarf<Bytes>, unit: &Unit<Bytes>, entry: &Entry, name: &str) -> Result<bool> {
    let Some(value) = entry.attr_value(gimli::DW_AT_name)? else { return Ok(false) };
    Ok(dwarf.attr_string(unit, value)?.slice() == name.as_bytes())
}

fn type_of(entry: &Entry) -> Result<Option<UnitOffset>> {
    Ok(match entry.attr_value(gimli::DW_AT_type)? {
        Some(AttributeValue::UnitRef(of)) => Some(of),
        _ => None,
    })
}

/// A static that has an address, and its type.
fn variable_in(dwarf: &Dwarf<Bytes>, unit: &Unit<Bytes>, name: &str) -> Result<Option<(u32, UnitOffset)>> {
    let mut entries = unit.entries();
    while let Some((_, entry)) = entries.next_dfs()? {
        if entry.tag() != gimli::DW_TAG_variable || !is_named(dwarf, unit, entry, name)? {
            continue;
        }
        let Some(AttributeValue::Exprloc(place)) = entry.attr_value(gimli::DW_AT_location)? else { continue };
        let Some(of) = type_of(entry)? else { continue };
        if let Some(gimli::Operation::Address { address }) = place.operations(unit.encoding()).next()? {
            return Ok(Some((address as u32, of)));
        }
    }
    Ok(None)
}

/// The address of a field within a field.
fn field(
    dwarf: &Dwarf<Bytes>,
    unit: &Unit<Bytes>,
    address: u32,
    of: UnitOffset,
    fields: &[&str],
) -> Result<u32> {
    let Some((first, rest)) = fields.split_first() else { return Ok(address) };
    let mut tree = unit.entries_tree(Some(of))?;
    let mut members = tree.root()?.children();
    while let Some(member) = members.next()? {
        let entry = member.entry();
        if entry.tag() == gimli::DW_TAG_member && is_named(dwarf, unit, entry, first)? {
            let at = entry.attr(gimli::DW_AT_data_member_location)?.and_then(|at| at.udata_value());
            let (at, of) = at.zip(type_of(entry)?).context("a field without a place")?;
            return field(dwarf, unit, address + at as u32, of, rest);
        }
    }
    bail!("no field {first}")
}
