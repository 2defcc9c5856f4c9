//! Lists of signals: a struct with a field a signal, the names of the columns and the order of the values, from one list.

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
