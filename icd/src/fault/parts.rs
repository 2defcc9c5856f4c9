//! Macros that generate types from the entries of the catalogue, and kinds in parts.

/// Most numbers that a kind can have.
pub const NUMBERS_MAX: usize = 2;

/// A kind taken apart.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts {
    pub choice: u8,
    pub values: [f64; NUMBERS_MAX],
    pub next: usize,
}

/// A field of a kind.
pub(super) trait Part: Sized {
    fn put(self, parts: &mut Parts);
    fn take(parts: &mut Parts) -> Option<Self>;
}

impl Part for f64 {
    fn put(self, parts: &mut Parts) {
        if let Some(value) = parts.values.get_mut(parts.next) {
            *value = self;
            parts.next += 1;
        }
    }

    fn take(parts: &mut Parts) -> Option<Self> {
        let value = parts.values.get(parts.next).copied();
        parts.next += 1;
        value
    }
}

/// Enums without fields as fields of a kind.
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

/// The enum of the kinds, the catalogue, and the conversion between a kind and its code and numbers.
macro_rules! kinds {
    ($(
        $(#[$doc:meta])* $name:ident
        $({ $($(#[$field_doc:meta])* $field:ident: $type:ty),+ $(,)? })?
        => $info:expr;
    )+) => {
        /// How an effector or a sensor fails. Values are rad, rad/s for effectors that turn; N, N/s for an engine; the SI unit of
        /// its output, and that per second, for a sensor.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        pub enum FaultKind {
            $($(#[$doc])* $name $({ $($(#[$field_doc])* $field: $type),+ })?),+
        }

        /// Index in the catalogue.
        #[derive(Clone, Copy)]
        enum Place { $($name),+ }

        /// The entry of each kind of fault, in the order of [`FaultKind`].
        pub static CATALOGUE: [KindInfo; [$(Place::$name),+].len()] = [$($info),+];

        impl FaultKind {
            /// Its entry in the catalogue.
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

pub(super) use {choices, kinds};
