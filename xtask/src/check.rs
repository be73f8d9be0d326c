//! The contents that no image may hold: double-precision arithmetic in software, and a call path from an interrupt to a panic.
//!
//! The second check uses the names of functions. A panic function that was inlined completely leaves no name, so the check finds what is there and
//! proves only as much as the names tell; the standard library keeps its panic functions out of line.

use crate::elf::{Function, Image};
use crate::graph::CallGraph;

/// All that is wrong with the image, a line each; empty is good.
pub fn findings(image: &Image) -> Vec<String> {
    let mut findings = soft_doubles(image.symbols.iter().map(String::as_str));
    findings.extend(panic_paths(image));
    findings
}

/// The helpers for double-precision arithmetic among the symbols.
pub fn soft_doubles<'a>(symbols: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let helpers = symbols.into_iter().filter(|name| is_soft_double(name));
    helpers.map(|name| format!("double-precision arithmetic in software: {name}")).collect()
}

fn is_soft_double(name: &str) -> bool {
    let name = name.rsplit("::").next().unwrap_or(name);
    let Some(bare) = name.strip_prefix("__") else { return false };
    match bare.strip_prefix("aeabi_") {
        Some(helper) => {
            let to_double = ["f2d", "h2d", "i2d", "ui2d", "l2d", "ul2d"];
            helper.starts_with('d') || helper.starts_with("cd") || to_double.contains(&helper)
        }
        None => bare.contains("df") && bare.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit()),
    }
}

/// The call paths from the vector table's handlers to a panic.
pub fn panic_paths(image: &Image) -> Vec<String> {
    if image.functions.is_empty() {
        return vec!["the image names no functions, so its calls cannot be followed".to_owned()];
    }
    if image.handlers.is_empty() {
        return vec!["the vector table holds no handler, so there is nothing to follow".to_owned()];
    }
    let graph = CallGraph::new(image);
    let mut findings = Vec::new();
    let mut seen = Vec::new();
    for (entry, address) in &image.handlers {
        // Unused entries share the default handler: one look is enough.
        if seen.contains(address) {
            continue;
        }
        seen.push(*address);
        if !image.functions.contains_key(address) {
            findings.push(format!("{entry} leads to {address:#x}, where no function is"));
            continue;
        }
        let came_from = graph.reach(*address);
        let panics = came_from.keys().filter(|function| panic_name(&image.functions[*function]).is_some());
        let shortest = panics.map(|panic| path(&came_from, *panic)).min_by_key(Vec::len);
        findings.extend(shortest.map(|path| format!("{entry}: {}", spelled(image, &path))));
        for (function, target) in graph.astray.iter().filter(|(function, _)| came_from.contains_key(function))
        {
            let name = name_of(&image.functions[function]);
            findings.push(format!("{entry}: {name} branches to {target:#x}, where no function is"));
        }
    }
    findings
}

/// From the handler to the function.
fn path(came_from: &std::collections::BTreeMap<u32, Option<u32>>, to: u32) -> Vec<u32> {
    let callers = std::iter::successors(Some(to), |at| came_from.get(at).copied().flatten());
    let mut path: Vec<_> = callers.collect();
    path.reverse();
    path
}

fn spelled(image: &Image, path: &[u32]) -> String {
    path.iter().map(|function| name_of(&image.functions[function])).collect::<Vec<_>>().join(" -> ")
}

fn name_of(function: &Function) -> &str {
    panic_name(function).or(function.names.first().map(String::as_str)).unwrap_or("?")
}

fn panic_name(function: &Function) -> Option<&str> {
    function.names.iter().map(String::as_str).find(|name| is_panic(name))
}

fn is_panic(name: &str) -> bool {
    const PARTS: &str = "core::panicking panic_fmt panic_bounds_check panic_const unwrap_failed expect_failed \
        rust_begin_unwind begin_panic";
    let is_core_failure = name.contains("core::") && name.contains("_fail");
    let is_slice_failure = name.contains("slice_") && name.contains("_fail");
    is_core_failure || is_slice_failure || PARTS.split(' ').any(|part| name.contains(part))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    /// `true` if all of these names, or none of them, are what is looked for.
    fn all(names: &str, expected: bool, is: fn(&str) -> bool) {
        for name in names.split_whitespace() {
            assert_eq!(is(name), expected, "{name}");
        }
    }

    #[test]
    fn double_helpers_are_found_under_all_their_names() {
        let helpers = "__aeabi_dadd __aeabi_dmul __aeabi_ddiv __aeabi_dcmplt __aeabi_cdcmpeq __aeabi_d2f \
            __aeabi_d2uiz __aeabi_f2d __aeabi_i2d __aeabi_ui2d __aeabi_ul2d __adddf3 __muldf3 __divdf3 __ltdf2 \
            __extendsfdf2 __truncdfsf2 __fixunsdfsi __floatunsidf compiler_builtins::float::mul::__muldf3";
        all(helpers, true, is_soft_double);
        let welcome = "__aeabi_memcpy4 __aeabi_uldivmod __aeabi_f2iz __aeabi_fadd __aeabi_l2f __addsf3 \
            __udivdi3 __INTERRUPTS tractive::control::df __cortex_m_rt_DUALTIMER sdf";
        all(welcome, false, is_soft_double);
    }

    #[test]
    fn panics_are_known_by_their_names() {
        let panics = "core::panicking::panic_bounds_check core::panicking::panic_const::panic_const_div_by_zero \
            core::option::unwrap_failed core::result::unwrap_failed core::option::expect_failed \
            core::slice::index::slice_end_index_len_fail core::slice::copy_from_slice_impl::len_mismatch_fail \
            rust_begin_unwind __rustc::rust_begin_unwind";
        all(panics, true, is_panic);
        let others = "TIMER0 tractive::board::qemu::die tractive::protection::fail_safe HardFault";
        all(others, false, is_panic);
    }

    /// handler: bl step, bx lr; step: b.w the third; the panic besides, called by no function here.
    fn image(third: &str) -> Image {
        let functions: [(&str, u32, &[u16]); 4] = [
            ("handler", 0x100, &[0xF000, 0xF806, 0x4770]),
            ("step", 0x110, &[0xF000, 0xB806]),
            (third, 0x120, &[0x4770]),
            ("core::panicking::panic_fmt", 0x130, &[0xE7FE]),
        ];
        Image::parse(&small_elf(0x100, &functions)).unwrap()
    }

    #[test]
    fn a_panic_behind_an_interrupt_is_told_with_its_path() {
        let found = findings(&image("core::panicking::panic_bounds_check"));
        assert_eq!(found, ["interrupt 0: handler -> step -> core::panicking::panic_bounds_check"]);
    }

    #[test]
    fn a_panic_elsewhere_is_not() {
        assert_eq!(findings(&image("clamp")), Vec::<String>::new());
    }

    #[test]
    fn a_double_in_the_image_is_told() {
        assert_eq!(
            findings(&image("__aeabi_dmul")),
            ["double-precision arithmetic in software: __aeabi_dmul"]
        );
    }

    #[test]
    fn an_image_that_cannot_be_followed_fails() {
        let stripped = Image::parse(&small_elf(0x100, &[])).unwrap();
        assert_eq!(findings(&stripped).len(), 1);
        let astray = Image::parse(&small_elf(0x200, &[("handler", 0x100, &[0x4770])])).unwrap();
        assert_eq!(findings(&astray), ["interrupt 0 leads to 0x200, where no function is"]);
        let mut idle = image("clamp");
        idle.handlers.clear();
        assert_eq!(findings(&idle).len(), 1);
        let lost = Image::parse(&small_elf(0x100, &[("handler", 0x100, &[0xF000, 0xF810])])).unwrap();
        assert_eq!(findings(&lost), ["interrupt 0: handler branches to 0x124, where no function is"]);
    }
}
