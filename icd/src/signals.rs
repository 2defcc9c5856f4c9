//! Lists from which types follow: signals with the names of their columns, choices with their names in files.

/// A struct of `f64` signals. The name of a field is that of its column in logs and tables, and its last word is the unit.
#[macro_export]
macro_rules! signals {
    ($(#[$meta:meta])* $type:ident { $($(#[$doc:meta])* $name:ident,)+ }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Default)]
        pub struct $type {
            $($(#[$doc])* pub $name: f64,)+
        }

        impl $type {
            /// Names of the columns.
            pub const NAMES: [&'static str; [$(stringify!($name)),+].len()] = [$(stringify!($name)),+];

            /// The values in the order of the names.
            pub const fn values(&self) -> [f64; Self::NAMES.len()] {
                [$(self.$name),+]
            }

            /// From values in the order of the names.
            pub const fn from_values(values: &[f64; Self::NAMES.len()]) -> Self {
                let [$($name),+] = *values;
                Self { $($name),+ }
            }
        }
    };
}

/// An enum whose variants have names in files and options: the list of all, and the name of each.
#[macro_export]
macro_rules! named {
    ($(#[$meta:meta])* $type:ident { $($(#[$doc:meta])* $variant:ident = $key:literal,)+ }) => {
        $(#[$meta])*
        pub enum $type {
            $($(#[$doc])* #[serde(rename = $key)] $variant,)+
        }

        impl $type {
            /// All of them, in order.
            pub const ALL: [Self; [$($key),+].len()] = [$(Self::$variant),+];

            /// Name in files and options.
            pub const fn key(self) -> &'static str {
                match self { $(Self::$variant => $key),+ }
            }
        }
    };
}
