//! The source of a file with all its mutants in it, each guarded by its number.

use crate::sites::{Bytes, Shape, Site};
use std::ops::Range;

/// A place in the generated source: of which mutant it is, or with `None` of all mutants of a site.
#[derive(Clone, Debug)]
pub struct Written {
    pub bytes: Range<usize>,
    pub numbers: Vec<u32>,
}

/// The source with its mutants, and the place of each.
#[derive(Debug, Default)]
pub struct Schema {
    pub text: String,
    /// The mutants' own bytes, followed by those of whole sites, outer ones first.
    pub written: Vec<Written>,
}

/// A piece of inserted text, of a mutant or of none.
type Piece = (String, Option<u32>);

/// Text put in at a byte, and the byte to go on from.
struct Edit {
    at: usize,
    on: usize,
    /// Ends before middles before beginnings; inner ends first, outer beginnings first.
    order: (u8, isize, isize),
    site: usize,
    pieces: Vec<Piece>,
}

/// Makes it. `numbers` holds those of each site's mutants; 0: left out.
pub fn of(source: &str, sites: &[Site], numbers: &[Vec<u32>]) -> Schema {
    let mut edits = Vec::new();
    for (index, (site, numbers)) in sites.iter().zip(numbers).enumerate() {
        if !site.fixed && numbers.iter().any(|number| *number > 0) {
            edit(source, site, index, numbers, &mut edits);
        }
    }
    edits.sort_by_key(|edit| (edit.at, edit.order));
    let mut schema = Schema::default();
    let mut from = 0;
    let mut places: Vec<Option<Bytes>> = vec![None; sites.len()];
    for edit in edits {
        if edit.at < from {
            continue;
        }
        schema.text += source.get(from..edit.at).unwrap_or_default();
        from = edit.on;
        let begin = schema.text.len();
        for (text, number) in edit.pieces {
            let start = schema.text.len();
            schema.text += &text;
            if let Some(number) = number {
                schema.written.push(Written { bytes: start..schema.text.len(), numbers: vec![number] });
            }
        }
        let end = schema.text.len();
        if let Some(place) = places.get_mut(edit.site) {
            *place = Some(place.as_ref().map_or(begin..end, |place| place.start..end));
        }
    }
    schema.text += source.get(from..).unwrap_or_default();
    for (place, numbers) in places.into_iter().zip(numbers) {
        let numbers = numbers.iter().copied().filter(|number| *number > 0).collect();
        schema.written.extend(place.map(|bytes| Written { bytes, numbers }));
    }
    schema
}

/// The bytes of one mutant of a site, and the text that replaces them, if it is compiled alone.
pub fn alone(source: &str, site: &Site, index: usize) -> Option<(Bytes, String)> {
    let signed = |right: usize, other: &str| (site.left..right, format!(" {other} "));
    Some(match &site.shape {
        Shape::Operator { right, others, .. } | Shape::Assignment { right, others, .. } => {
            signed(*right, others.get(index)?)
        }
        Shape::Lazy { right, and } => signed(*right, if *and { "||" } else { "&&" }),
        Shape::Sign { operand } => (site.bytes.start..*operand, String::new()),
        Shape::Arm => (site.bytes.clone(), " if false".to_owned()),
        Shape::Guard => (site.bytes.clone(), (index == 0).to_string()),
        Shape::Fields { base, fields } => {
            let (name, short, value) = fields.get(index)?;
            let name_of = if *short { format!("{name}: ") } else { String::new() };
            (value.clone(), format!("{name_of}({}).{name}", source.get(base.clone())?))
        }
        Shape::Body(values) => (site.bytes.clone(), format!(" return {};", values.get(index)?)),
    })
}

/// Ways to insert text for one site.
struct Editor<'a> {
    site: usize,
    bytes: Bytes,
    edits: &'a mut Vec<Edit>,
}

impl Editor<'_> {
    fn put(&mut self, at: usize, on: usize, order: (u8, isize, isize), pieces: Vec<Piece>) {
        self.edits.push(Edit { at, on, order, site: self.site, pieces });
    }

    /// Before `bytes`, going on from `on`.
    fn begin(&mut self, bytes: &Bytes, on: usize, text: &str) {
        let order = (2, -(bytes.len() as isize), self.site as isize);
        self.put(bytes.start, on, order, vec![plain(text)]);
    }

    /// Replaces the text between two operands.
    fn middle(&mut self, at: usize, on: usize, pieces: Vec<Piece>) {
        self.put(at, on, (1, 0, self.site as isize), pieces);
    }

    fn end(&mut self, bytes: &Bytes, pieces: Vec<Piece>) {
        self.put(bytes.end, bytes.end, (0, bytes.len() as isize, -(self.site as isize)), pieces);
    }
}

fn plain(text: &str) -> Piece {
    (text.to_owned(), None)
}

fn is(number: u32) -> String {
    if number == 0 { "false".to_owned() } else { format!("::mutant::is({number})") }
}

/// One branch for each mutant that exists, then the code's own.
fn branches<'a>(numbers: &[u32], texts: impl Iterator<Item = String> + 'a, own: &str) -> Vec<Piece> {
    let there = numbers.iter().zip(texts).filter(|(number, _)| **number > 0);
    let mut pieces: Vec<_> = there
        .map(|(number, text)| (format!("if {} {{ {text} }} else ", is(*number)), Some(*number)))
        .collect();
    pieces.push((format!("{{ {own} }}"), None));
    pieces
}

fn edit(source: &str, site: &Site, index: usize, numbers: &[u32], edits: &mut Vec<Edit>) {
    let bytes = site.bytes.clone();
    let first = numbers.first().copied().unwrap_or(0);
    let text = |bytes: Bytes| source.get(bytes).unwrap_or_default();
    let mut editor = Editor { site: index, bytes: bytes.clone(), edits };
    match &site.shape {
        Shape::Body(values) => {
            let there = numbers.iter().zip(values).filter(|(number, _)| **number > 0);
            let pieces = there
                .map(|(number, value)| (format!(" if {} {{ return {value}; }}", is(*number)), Some(*number)));
            editor.middle(bytes.start, bytes.start, pieces.collect());
        }
        Shape::Operator { right, own, others } => {
            operator(&mut editor, site.left..*right, own, others, numbers)
        }
        Shape::Lazy { right, and } => {
            editor.begin(&bytes, bytes.start, "(match (");
            let chosen = if *and { "!=" } else { "==" };
            let middle = format!(") {{ __a => if __a {chosen} {} {{ ", is(first));
            editor.middle(site.left, *right, vec![(middle, None)]);
            editor.end(&bytes, vec![plain(" } else { __a } })")]);
        }
        Shape::Assignment { right, own, others } => {
            let place = text(bytes.start..site.left);
            let texts = others.iter().map(|other| format!("{place} {other} __b"));
            bound(&mut editor, *right, "__b", branches(numbers, texts, &format!("{place} {own} __b")));
        }
        Shape::Sign { operand } => {
            let sign = text(bytes.start..*operand);
            let deleted = ["__a".to_owned()].into_iter();
            bound(&mut editor, *operand, "__a", branches(numbers, deleted, &format!("{sign} __a")));
        }
        Shape::Arm => {
            editor.middle(bytes.start, bytes.start, vec![(format!(" if !{}", is(first)), Some(first))])
        }
        Shape::Guard => {
            let number = |index: usize| is(numbers.get(index).copied().unwrap_or(0));
            editor.begin(
                &bytes,
                bytes.start,
                &format!("(!{} && ({} || !{} && (", number(2), number(0), number(1)),
            );
            editor.end(&bytes, vec![plain(")))")]);
        }
        Shape::Fields { base, fields } => {
            let path = text(bytes.start..site.left);
            let open = format!("(match ({path} {{ ..{} }}) {{ __s => ", text(base.clone()));
            editor.begin(&bytes, bytes.start, &open);
            structure(&mut editor, base, fields, numbers);
        }
    }
}

/// The operand that begins at `on` is bound to a name, and then one of the branches is taken.
fn bound(editor: &mut Editor, on: usize, name: &str, branches: Vec<Piece>) {
    let bytes = editor.bytes.clone();
    editor.begin(&bytes, on, "(match (");
    let begin = plain(&format!(") {{ {name} => "));
    editor.end(&bytes, [vec![begin], branches, vec![plain(" })")]].concat());
}

/// Takes each mutated field from the base, which is `__s`.
fn structure(editor: &mut Editor, base: &Bytes, fields: &[(String, bool, Bytes)], numbers: &[u32]) {
    for ((name, short, value), number) in fields.iter().zip(numbers).filter(|(_, number)| **number > 0) {
        let name_of = if *short { format!("{name}: ") } else { String::new() };
        let open = format!("{name_of}if {} {{ __s.{name} }} else {{ ", is(*number));
        editor.begin(value, value.start, &open);
        editor.end(value, vec![(" }".to_owned(), Some(*number))]);
    }
    editor.middle(base.start, base.end, vec![plain("__s")]);
    let bytes = editor.bytes.clone();
    editor.end(&bytes, vec![plain(" })")]);
}

fn operator(editor: &mut Editor, sign: Bytes, own: &str, others: &[&str], numbers: &[u32]) {
    let bytes = editor.bytes.clone();
    let compares = matches!(own, "==" | "!=" | "<" | ">" | "<=" | ">=");
    let (by, a, b) = if compares { ("&", "*__a", "*__b") } else { ("", "__a", "__b") };
    editor.begin(&bytes, bytes.start, &format!("(match ({by}("));
    editor.middle(sign.start, sign.end, vec![(format!("), {by}("), None)]);
    let mut pieces = vec![plain(")) { (__a, __b) => ")];
    pieces.extend(branches(
        numbers,
        others.iter().map(|other| format!("{a} {other} {b}")),
        &format!("{a} {own} {b}"),
    ));
    pieces.push(plain(" })"));
    editor.end(&bytes, pieces);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sites;

    fn schema(source: &str) -> String {
        let sites = sites::of(source).unwrap();
        let mut count = 0;
        let numbers: Vec<Vec<u32>> = sites
            .iter()
            .map(|site| {
                let numbers = site.mutants.iter().map(|_| {
                    count += 1;
                    count
                });
                numbers.collect()
            })
            .collect();
        let schema = of(source, &sites, &numbers);
        syn::parse_file(&schema.text).unwrap_or_else(|error| panic!("{error}: {}", schema.text));
        schema.text
    }

    #[test]
    fn an_operator_chooses_among_its_mutants() {
        assert_eq!(
            schema("fn f(x: T) -> T { x /* by */ * 2 }"),
            "fn f(x: T) -> T { if ::mutant::is(1) { return Default::default(); } (match ((x), (2)) { (__a, __b) => \
             if ::mutant::is(2) { __a + __b } else if ::mutant::is(3) { __a / __b } else { __a * __b } }) }"
        );
    }

    /// A place or a base that is written twice has no mutants in it.
    #[test]
    fn every_mutant_that_can_be_chosen_is_written() {
        let source = "fn f(x: &mut [T], n: N) -> S { x[n - 1] /= x[n + 1]; S { a: n * 2, ..g(n % 3) } }";
        let text = schema(source);
        let mut number = 0;
        for site in sites::of(source).unwrap() {
            for found in &site.mutants {
                number += 1;
                let is_written = text.contains(&format!("is({number})"));
                assert_eq!(is_written, !site.fixed, "{}: {text}", found.what);
            }
        }
        assert!(number > 10);
    }

    #[test]
    fn every_shape_stays_a_program() {
        let text = schema(
            "fn f(mut x: f32, y: &[u8]) { x += -1.0 * x; if x < 3.0 && !y.is_empty() || x == 0.0 { g() }
             match x { 1.0 if y[0] > 1 => 1, 2.0 | 3.0 => 2, _ => S { a: 1 + 2, b, ..S::new() }.a }; let _ = [0; 2 + 3]; }
             const N: usize = 3 * 4;",
        );
        for part in [
            "x += __b",
            "x -= __b",
            "S { ..S::new() }",
            "b: if",
            "..__s",
            "2.0 | 3.0 if !",
            "[0; 2 + 3]",
            "= 3 * 4;",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
