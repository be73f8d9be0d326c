//! The rooms of every crate, its modules right below the root: none imports one that imports it, and in the rig no module of any
//! depth does. Control and modulation know neither each other nor the nine-switch.
//!
//! Every path of every file is read: `use` trees with their braces, and paths in the code and in macros, from `crate`, `super`, `self`
//! or a child. A name that a module only hands on (`pub use`) counts as an import of where it is defined.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A module, by its path from the crate on.
type Module = Vec<String>;
/// The imports of each module.
type Imports = BTreeMap<Module, BTreeSet<Module>>;

/// A module's paths, and what it hands on by name.
#[derive(Default)]
struct Source {
    paths: Vec<Vec<String>>,
    handed_on: BTreeMap<String, Vec<String>>,
    /// Modules from which everything that they hand on is taken.
    globs: Vec<Vec<String>>,
}

/// Reads the files of a folder; `main.rs` is another crate.
fn read(folder: &Path, module: &[String], sources: &mut BTreeMap<Module, Source>) {
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, mut own) = (entry.path(), module.to_vec());
        let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            own.push(stem);
            read(&path, &own, sources);
            continue;
        }
        if stem == "main" || path.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        if stem != "mod" && stem != "lib" {
            own.push(stem);
        }
        let text: TokenStream = std::fs::read_to_string(&path).unwrap().parse().unwrap();
        let mut source = Source::default();
        source.read(&text.into_iter().collect::<Vec<_>>());
        sources.insert(own, source);
    }
}

fn is(token: Option<&TokenTree>, what: &str) -> bool {
    token.is_some_and(|token| token.to_string() == what)
}

impl Source {
    fn read(&mut self, tokens: &[TokenTree]) {
        let mut at = 0;
        while at < tokens.len() {
            match &tokens[at] {
                // Code that is only compiled for tests may look wherever it likes.
                TokenTree::Group(group) if group.to_string().replace(' ', "") == "[cfg(test)]" => {
                    let is_block = |token: &TokenTree| matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Brace);
                    at += tokens[at..].iter().position(is_block).unwrap_or(0);
                }
                TokenTree::Group(group) => self.read(&group.stream().into_iter().collect::<Vec<_>>()),
                TokenTree::Ident(word) if *word == "use" => {
                    // Inside a type or a macro's pattern it may mean something else.
                    let Some(length) = tokens[at..].iter().position(|token| is(Some(token), ";")) else {
                        at += 1;
                        continue;
                    };
                    let end = at + length;
                    let hands_on = (at > 0 && is(tokens.get(at - 1), "pub"))
                        || (at > 1 && is(tokens.get(at - 2), "pub"));
                    self.tree(&[], &tokens[at + 1..end], hands_on);
                    at = end;
                }
                TokenTree::Ident(word) if is(tokens.get(at + 1), ":") && is(tokens.get(at + 2), ":") => {
                    let mut path = vec![word.to_string()];
                    while is(tokens.get(at + 1), ":") && is(tokens.get(at + 2), ":") {
                        let Some(TokenTree::Ident(word)) = tokens.get(at + 3) else { break };
                        path.push(word.to_string());
                        at += 3;
                    }
                    self.paths.push(path);
                }
                _ => {}
            }
            at += 1;
        }
    }

    /// A `use` tree behind a prefix.
    fn tree(&mut self, prefix: &[String], tokens: &[TokenTree], hands_on: bool) {
        let (mut path, mut name) = (prefix.to_vec(), None);
        let mut tokens = tokens.iter();
        while let Some(token) = tokens.next() {
            match token {
                TokenTree::Ident(word) if *word == "as" => name = tokens.next().map(TokenTree::to_string),
                TokenTree::Ident(word) if *word == "self" && !path.is_empty() => {}
                TokenTree::Ident(word) => path.push(word.to_string()),
                TokenTree::Group(group) => {
                    let inner: Vec<_> = group.stream().into_iter().collect();
                    for part in inner.split(|token| is(Some(token), ",")).filter(|part| !part.is_empty()) {
                        self.tree(&path, part, hands_on);
                    }
                    return;
                }
                TokenTree::Punct(punct) if punct.as_char() == '*' => self.globs.push(path.clone()),
                _ => {}
            }
        }
        match name.or(path.last().cloned()) {
            Some(name) if hands_on => drop(self.handed_on.insert(name, path)),
            _ => self.paths.push(path),
        }
    }
}

/// A path as seen from the crate; `None` for what is of another crate.
fn absolute(module: &[String], path: &[String], sources: &BTreeMap<Module, Source>) -> Option<Vec<String>> {
    let supers = path.iter().take_while(|word| *word == "super").count();
    let child = [module, &path[..1]].concat();
    Some(match path[0].as_str() {
        "crate" => path[1..].to_vec(),
        "super" => [&module[..module.len().checked_sub(supers)?], &path[supers..]].concat(),
        "self" => [module, &path[1..]].concat(),
        _ if sources.contains_key(&child) => [module, path].concat(),
        _ => return None,
    })
}

/// The module in which what a path names is defined.
fn defined(path: &[String], sources: &BTreeMap<Module, Source>) -> Option<Module> {
    let length = (0..=path.len()).rev().find(|length| sources.contains_key(&path[..*length]))?;
    let (module, rest) = path.split_at(length);
    let handed = rest.first().and_then(|name| sources[module].handed_on.get(name));
    match handed {
        Some(from) => defined(&[absolute(module, from, sources)?, rest[1..].to_vec()].concat(), sources),
        None => Some(module.to_vec()),
    }
}

fn imports(sources: &BTreeMap<Module, Source>) -> Imports {
    let of = |module: &Module, source: &Source| {
        let paths = source.paths.iter().filter_map(|path| absolute(module, path, sources));
        let globs = source.globs.iter().filter_map(|path| absolute(module, path, sources));
        let handed = globs.flat_map(|path| {
            let names = sources.get(&path).into_iter().flat_map(|source| source.handed_on.keys());
            names.map(|name| [&path[..], std::slice::from_ref(name)].concat()).collect::<Vec<_>>()
        });
        let targets = paths.chain(handed).filter_map(|path| defined(&path, sources));
        targets.filter(|target| target != module).collect()
    };
    sources.iter().map(|(module, source)| (module.clone(), of(module, source))).collect()
}

/// The same between the rooms right below the crate.
fn of_rooms(imports: &Imports) -> Imports {
    let room = |module: &Module| module[..module.len().min(1)].to_vec();
    let mut rooms = Imports::new();
    for (module, targets) in imports.iter().filter(|(module, _)| !module.is_empty()) {
        let other = targets.iter().map(room).filter(|target| *target != room(module));
        rooms.entry(room(module)).or_default().extend(other);
    }
    rooms
}

/// The modules left after those that import nothing of the rest are taken away again and again: the cycles, and their importers.
fn cyclic(mut imports: Imports) -> Imports {
    loop {
        let left: BTreeSet<_> = imports.keys().cloned().collect();
        let before = imports.len();
        imports.retain(|_, targets| {
            targets.retain(|target| left.contains(target));
            !targets.is_empty()
        });
        if imports.len() == before {
            return imports;
        }
    }
}

/// The crates' sources, beside the boards'.
const CRATES: [&str; 7] =
    ["src", "control/src", "tablegen/src", "rig/src", "xtask/src", "bench/src", "fault-injector/src"];

/// The sources of the packages in `boards/`.
fn boards() -> Vec<String> {
    let folders = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("boards")).unwrap();
    let names = folders.map(|folder| folder.unwrap().file_name().to_string_lossy().into_owned());
    names.map(|name| format!("boards/{name}/src")).collect()
}

fn of_crate(name: &str) -> Imports {
    let mut sources = BTreeMap::new();
    read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(name), &[], &mut sources);
    assert!(sources.len() > 3, "{name}: {} files", sources.len());
    imports(&sources)
}

fn assert_no_cycle(what: &str, imports: Imports) {
    let count: usize = imports.values().map(BTreeSet::len).sum();
    let cycles = cyclic(imports);
    let list = cycles.iter().map(|(module, targets)| {
        let targets: Vec<_> = targets.iter().map(|target| target.join("::")).collect();
        format!("{} -> {}", module.join("::"), targets.join(", "))
    });
    assert!(cycles.is_empty(), "cycles between {what}:\n{}", list.collect::<Vec<_>>().join("\n"));
    println!("{what}: {count} imports, no cycle");
}

#[test]
fn no_room_imports_what_imports_it() {
    let boards = boards();
    assert!(!boards.is_empty());
    for name in CRATES.into_iter().chain(boards.iter().map(String::as_str)) {
        assert_no_cycle(&format!("the rooms of {name}"), of_rooms(&of_crate(name)));
    }
    assert_no_cycle("the modules of the rig", of_crate("rig/src"));
}

#[test]
fn control_and_modulation_know_neither_each_other_nor_the_nine_switch() {
    const APART: [(&str, &[&str]); 8] = [
        ("named", &[]),
        ("frames", &[]),
        ("time", &["frames"]),
        ("machine", &[]),
        ("control", &["frames", "named", "time", "machine"]),
        ("identification", &["control", "frames", "named", "time", "machine"]),
        ("modulation", &["frames", "time"]),
        ("nine_switch", &["frames", "named"]),
    ];
    let rooms = of_rooms(&of_crate("control/src"));
    for (room, allowed) in APART {
        let known = &rooms[&vec![room.to_owned()]];
        let known: Vec<_> = known.iter().filter_map(|module| module.first()).collect();
        assert!(known.iter().all(|other| allowed.contains(&other.as_str())), "{room} knows {known:?}");
    }
}
