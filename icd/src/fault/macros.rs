//! From the entries of the catalogue to types.

/// The enum of the quantities, with names, units and keys.
macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident = $code:literal, $title:literal, $measure:expr, $keys:expr;)+) => {
        /// A number of a fault or of its timing.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Quantity {
            $($(#[$doc])* $name = $code),+
        }

        impl Quantity {
            /// All of them.
            pub const ALL: [Self; [$(Self::$name),+].len()] = [$(Self::$name),+];

            /// Name for people.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => $title),+ }
            }

            /// What it measures.
            #[must_use]
            pub const fn measure(self) -> Measure {
                match self { $(Self::$name => $measure),+ }
            }

            /// Keys in scenario files: of what turns, of an engine.
            #[must_use]
            pub const fn keys(self) -> [&'static str; 2] {
                match self { $(Self::$name => $keys),+ }
            }
        }
    };
}

/// Enums without fields as parts of a kind.
macro_rules! choices {
    ($($name:ident: $($variant:ident),+;)+) => {
        $(impl Part for $name {
            fn put(self, parts: &mut Parts) {
                parts.choice = self as u8;
            }

            fn take(parts: &mut Parts) -> Option<Self> {
                [$(Self::$variant),+].get(usize::from(parts.choice)).copied()
            }
        })+
    };
}

/// The enum of the kinds, the catalogue, and the way between a kind and its code and numbers.
macro_rules! kinds {
    ($(
        $(#[$doc:meta])* $name:ident
        $({ $($(#[$field_doc:meta])* $field:ident: $type:ty),+ $(,)? })?
        => $info:expr;
    )+) => {
        /// How an effector fails. Values are rad, rad/s for those that turn; N, N/s for an engine.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        pub enum FaultKind {
            $($(#[$doc])* $name $({ $($(#[$field_doc])* $field: $type),+ })?),+
        }

        /// Places in the catalogue.
        #[derive(Clone, Copy)]
        enum Place { $($name),+ }

        /// What is known of each kind of fault, in the order of [`FaultKind`].
        pub static CATALOGUE: [KindInfo; [$(Place::$name),+].len()] = [$($info),+];

        impl FaultKind {
            /// Its entry in the catalogue.
            #[must_use]
            pub fn info(&self) -> &'static KindInfo {
                match self { $(Self::$name { .. } => &CATALOGUE[Place::$name as usize]),+ }
            }

            pub(super) fn parts(&self) -> Parts {
                let mut parts = Parts::default();
                match *self {
                    $(Self::$name $({ $($field),+ })? => { $($($field.put(&mut parts);)+)? })+
                }
                parts
            }

            pub(super) fn from_parts(place: usize, mut parts: Parts) -> Option<Self> {
                // Not every kind has parts.
                let _parts = &mut parts;
                $(if place == Place::$name as usize {
                    return Some(Self::$name $({ $($field: Part::take(_parts)?),+ })?);
                })+
                None
            }
        }
    };
}
