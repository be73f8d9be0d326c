//! Enums whose variants have names: of faults, states, schemes, as traces and documents call them.

/// An enum with a name for each variant, from one list: a new one cannot be forgotten among all of them, nor without its name.
#[doc(hidden)]
#[macro_export]
macro_rules! named {
    ($(#[$about:meta])* pub enum $name:ident {
        $($(#[$of:meta])* $variant:ident $(= $code:literal)? => $text:literal,)+
    }) => {
        $(#[$about])*
        pub enum $name { $($(#[$of])* $variant $(= $code)?,)+ }

        impl $name {
            /// All of them, in the order of their codes.
            pub const ALL: [Self; [$($text),+].len()] = [$(Self::$variant),+];

            /// The name in traces, in documents and on the command line.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text),+ }
            }
        }
    };
}
