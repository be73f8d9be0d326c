//! The values in place of what a function returns, by its type: those of cargo-mutants.

use quote::ToTokens;
use syn::{GenericArgument, PathArguments, PathSegment, ReturnType, Type};

/// The values, as source text; none where no value can stand.
pub fn of(output: &ReturnType) -> Vec<String> {
    match output {
        ReturnType::Default => vec!["()".to_owned()],
        ReturnType::Type(_, ty) => of_type(ty),
    }
}

fn of_type(ty: &Type) -> Vec<String> {
    match ty {
        Type::Never(_) => Vec::new(),
        Type::Paren(inner) => of_type(&inner.elem),
        Type::Group(inner) => of_type(&inner.elem),
        Type::Array(array) => {
            let length = array.len.to_token_stream();
            of_type(&array.elem).iter().map(|value| format!("[{value}; {length}]")).collect()
        }
        Type::Tuple(tuple) => tuple
            .elems
            .iter()
            .map(of_type)
            .fold(vec![Vec::new()], product)
            .iter()
            .map(|values| tupled(values))
            .collect(),
        Type::Reference(reference) => match (&*reference.elem, reference.mutability) {
            (Type::Slice(slice), mutability) => {
                let none = if mutability.is_some() { "&mut []" } else { "&[]" };
                let some = of_type(&slice.elem).into_iter().map(|value| format!("::mutant::leak([{value}])"));
                strings([none]).into_iter().chain(some).collect()
            }
            (Type::Path(path), None) if path.path.is_ident("str") => strings(["\"\"", "\"xyzzy\""]),
            (inner, _) => leaked(&of_type(inner)),
        },
        Type::Path(path) => path.path.segments.last().map_or_else(default, of_segment),
        _ => default(),
    }
}

fn of_segment(segment: &PathSegment) -> Vec<String> {
    let inner = || match &segment.arguments {
        PathArguments::AngleBracketed(arguments) => {
            arguments.args.iter().find_map(|argument| match argument {
                GenericArgument::Type(ty) => Some(of_type(ty)),
                _ => None,
            })
        }
        _ => None,
    };
    let wrapped = |wrapper: &str| {
        inner().unwrap_or_else(default).iter().map(|value| format!("{wrapper}({value})")).collect::<Vec<_>>()
    };
    match segment.ident.to_string().as_str() {
        "bool" => strings(["true", "false"]),
        "u8" | "u16" | "u32" | "u64" | "u128" | "usize" => strings(["0", "1"]),
        "i8" | "i16" | "i32" | "i64" | "i128" | "isize" => strings(["0", "1", "-1"]),
        "f32" | "f64" => strings(["0.0", "1.0", "-1.0"]),
        "String" => strings(["String::new()", "\"xyzzy\".into()"]),
        "Option" => strings(["None"]).into_iter().chain(wrapped("Some")).collect(),
        "Result" => wrapped("Ok"),
        "Box" => wrapped("Box::new"),
        "Vec" => {
            let some = inner().unwrap_or_else(default).into_iter().map(|value| format!("vec![{value}]"));
            strings(["vec![]"]).into_iter().chain(some).collect()
        }
        _ => default(),
    }
}

fn leaked(values: &[String]) -> Vec<String> {
    values.iter().map(|value| format!("::mutant::leak({value})")).collect()
}

fn product(done: Vec<Vec<String>>, next: Vec<String>) -> Vec<Vec<String>> {
    let with = |one: &Vec<String>, value: &String| one.iter().chain([value]).cloned().collect();
    done.iter().flat_map(|one| next.iter().map(move |value| with(one, value))).collect()
}

fn tupled(values: &[String]) -> String {
    format!("({}{})", values.join(", "), if values.len() == 1 { "," } else { "" })
}

fn strings<const N: usize>(of: [&str; N]) -> Vec<String> {
    of.map(str::to_owned).into()
}

fn default() -> Vec<String> {
    strings(["Default::default()"])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_has_its_values() {
        let values = |text: &str| of(&syn::parse_str(text).unwrap()).join(" | ");
        assert_eq!(values(""), "()");
        assert_eq!(values("-> bool"), "true | false");
        assert_eq!(values("-> Option<f32>"), "None | Some(0.0) | Some(1.0) | Some(-1.0)");
        assert_eq!(values("-> Result<(), Fault>"), "Ok(())");
        assert_eq!(values("-> [u8; 8]"), "[0; 8] | [1; 8]");
        assert_eq!(values("-> (bool, Angle)"), "(true, Default::default()) | (false, Default::default())");
        assert_eq!(values("-> &Angle"), "::mutant::leak(Default::default())");
        assert_eq!(values("-> !"), "");
    }
}
