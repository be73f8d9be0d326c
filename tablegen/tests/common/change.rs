//! Good texts with something changed.

use proptest::prelude::*;

/// A change of a text: (where, how many bytes go, or with `None` the word that stands there, what comes).
pub type Change = (prop::sample::Index, Option<usize>, Vec<u8>);

/// Any change, most often to what is likely to matter.
pub fn change() -> impl Strategy<Value = Change> {
    let odd = prop::sample::select(vec![
        "nan",
        "inf",
        "-",
        "1e309",
        "0",
        "-0",
        "=",
        ",",
        "\n",
        "\"",
        "[",
        "#",
        "1e-300",
        "\u{feff}",
        "99999999999999999999",
    ]);
    let what =
        prop_oneof![odd.prop_map(|text| text.as_bytes().to_vec()), prop::collection::vec(any::<u8>(), 0..6)];
    (any::<prop::sample::Index>(), prop::option::of(0..12_usize), what)
}

/// Any change, most often to what is likely to matter.
pub fn changed(text: &str, changes: &[Change]) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for (at, gone, what) in changes {
        let at = at.index(bytes.len() + 1);
        let (before, behind) = bytes.split_at(at);
        let is_word = |byte: &&u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
        let (from, to) = match gone {
            Some(gone) => (at, (at + gone).min(bytes.len())),
            None => {
                let back = before.iter().rev().take_while(is_word).count();
                (at - back, at + behind.iter().take_while(is_word).count())
            }
        };
        bytes.splice(from..to, what.iter().copied());
    }
    bytes
}
