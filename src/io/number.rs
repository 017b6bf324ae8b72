//! The number types of a file: parsing, byte order, and what an index or a float made of one is.

use crate::mesh::Values;
use std::fmt::Display;

/// Runs `$body` with the type `$T` being the one that a [`Kind`] stands for.
macro_rules! with_kind {
    ($kind:expr, $T:ident => $body:expr) => {
        with_kind!($kind, $T => $body; I8 i8, U8 u8, I16 i16, U16 u16, I32 i32, U32 u32, I64 i64, U64 u64, F32 f32, F64 f64)
    };
    ($kind:expr, $T:ident => $body:expr; $($variant:ident $type:ty),*) => {
        match $kind {
            $($crate::io::number::Kind::$variant => {
                type $T = $type;
                $body
            })*
        }
    };
}
pub(super) use with_kind;

/// A number type that a data array may be made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "each variant is named after its type")]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// VTK's name of the type in an XML file.
    pub(super) fn from_name(name: &str) -> Option<Kind> {
        Some(match name {
            "Int8" => Kind::I8,
            "UInt8" => Kind::U8,
            "Int16" => Kind::I16,
            "UInt16" => Kind::U16,
            "Int32" => Kind::I32,
            "UInt32" => Kind::U32,
            "Int64" => Kind::I64,
            "UInt64" => Kind::U64,
            "Float32" => Kind::F32,
            "Float64" => Kind::F64,
            _ => return None,
        })
    }

    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        with_kind!(self, T => size_of::<T>())
    }
}

/// One of the ten number types.
pub(super) trait Number: bytemuck::Pod + Send + Sync + Display {
    /// A token of an ascii array. Whole numbers may be written as floats.
    fn parse(token: &str) -> Option<Self>;
    /// The number as an index: none if it is negative or not whole.
    fn index(self) -> Option<u64>;
    /// The nearest f64.
    fn float(self) -> f64;
    /// An array of them.
    fn values(numbers: Vec<Self>) -> Values;
}

macro_rules! whole {
    ($($T:ident $variant:ident),*) => {$(
        impl Number for $T {
            fn parse(token: &str) -> Option<Self> {
                token.parse().ok().or_else(|| {
                    let float: f64 = token.parse().ok()?;
                    (float as $T as f64 == float).then_some(float as $T)
                })
            }
            fn index(self) -> Option<u64> {
                u64::try_from(self).ok()
            }
            fn float(self) -> f64 {
                self as f64
            }
            fn values(numbers: Vec<Self>) -> Values {
                Values::$variant(numbers)
            }
        }
    )*};
}
whole!(i8 I8, u8 U8, i16 I16, u16 U16, i32 I32, u32 U32, i64 I64, u64 U64);

macro_rules! float {
    ($($T:ident $variant:ident),*) => {$(
        impl Number for $T {
            fn parse(token: &str) -> Option<Self> {
                token.parse().ok().or_else(|| special(token).map(|f| f as $T))
            }
            fn index(self) -> Option<u64> {
                let index = self as u64;
                (index as $T == self).then_some(index)
            }
            fn float(self) -> f64 {
                self.into()
            }
            fn values(numbers: Vec<Self>) -> Values {
                Values::$variant(numbers)
            }
        }
    )*};
}
float!(f32 F32, f64 F64);

/// The spellings of NaN and infinity that C libraries print and Rust does not parse: `nan(0x8)`, `-nan(ind)`,
/// `1.#QNAN`, `-1.#INF`.
fn special(token: &str) -> Option<f64> {
    let lower = token.to_ascii_lowercase();
    let (sign, rest) = match lower.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, lower.as_str()),
    };
    if rest.starts_with("nan(")
        || rest.starts_with("1.#qnan")
        || rest.starts_with("1.#snan")
        || rest.starts_with("1.#ind")
    {
        Some(f64::NAN)
    } else {
        rest.starts_with("1.#inf").then_some(sign * f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tokens_of_other_languages() {
        assert_eq!(i32::parse("-3.0"), Some(-3));
        assert_eq!(i64::parse("9007199254740993"), Some(9_007_199_254_740_993));
        assert_eq!(u8::parse("2.56e2"), None);
        assert_eq!(i32::parse("nan"), None);
        assert_eq!(i32::parse("1.5"), None);
        assert!(f32::parse("-nan").is_some_and(f32::is_nan));
        assert!(f64::parse("-nan(ind)").is_some_and(f64::is_nan));
        assert!(f64::parse("1.#QNAN0").is_some_and(f64::is_nan));
        assert_eq!(f64::parse("-1.#INF"), Some(f64::NEG_INFINITY));
        assert_eq!(f32::parse("Inf"), Some(f32::INFINITY));
        assert_eq!(f64::parse("1,5"), None);
    }

    #[test]
    fn indices() {
        assert_eq!((-1i8).index(), None);
        assert_eq!(u64::MAX.index(), Some(u64::MAX));
        assert_eq!(3.0f32.index(), Some(3));
        assert_eq!(f64::NAN.index(), None);
        assert_eq!(0.5f64.index(), None);
    }
}
