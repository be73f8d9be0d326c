//! Enums with named variants: the names of faults, states and schemes as they appear in traces and documents.

/// An enum and the names of its variants, from one list: a new variant can neither be left out of the list of all nor lack a name.
#[doc(hidden)]
#[macro_export]
macro_rules! named {
    ($(#[$about:meta])* pub enum $name:ident {
        $($(#[$of:meta])* $variant:ident $(= $code:literal)? => $text:literal,)+
    }) => {
        $(#[$about])*
        pub enum $name { $($(#[$of])* $variant $(= $code)?,)+ }

        impl $name {
            /// All variants, in the order of their codes.
            pub const ALL: [Self; [$($text),+].len()] = [$(Self::$variant),+];

            /// The name in traces, in documents and on the command line.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text),+ }
            }
        }
    };
}
