//! JSON into the types of a scene. What is wrong is said in the words of scenes, keys, lists and numbers, with its place.

use super::second::OPEN_END;
use serde::de::value::StrDeserializer;
use serde::de::{
    self, DeserializeOwned, DeserializeSeed, Deserializer, Error as _, Expected, IntoDeserializer, MapAccess,
    SeqAccess, Unexpected, Visitor,
};
use serde_json::{Map, Value, error::Category};
use std::fmt::{self, Display, Formatter};

/// Reads a value of a scene, such as its `integral`.
///
/// # Errors
/// What is wrong, and where in the value: `table[1]: a number is meant, and not a text`.
pub fn read<T: DeserializeOwned>(value: &Value) -> Result<T, String> {
    T::deserialize(Reader(value)).map_err(|mistake| mistake.to_string())
}

/// Reads a JSON text, in which no object has a key twice.
///
/// # Errors
/// What is wrong, with its line and column.
pub(super) fn parse(text: &[u8]) -> Result<Value, String> {
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let mut json = serde_json::Deserializer::from_slice(text);
    let value = OnceEach.deserialize(&mut json).map_err(|e| at_place(&e))?;
    json.end().map_err(|e| at_place(&e))?;
    Ok(value)
}

/// A syntax error, with its place.
fn at_place(error: &serde_json::Error) -> String {
    let (line, column) = (error.line(), error.column());
    let told = error.to_string();
    let told = told.rsplit_once(" at line ").map_or(told.as_str(), |(what, _)| what);
    let what = match told {
        "expected value" => "a value is missing",
        "expected `:`" => "there is no \":\" after the key",
        "expected `,` or `}`" => "there is no \",\" or \"}\" after the value",
        "expected `,` or `]`" => "there is no \",\" or \"]\" after the value",
        "expected ident" => {
            "this is no value; one is a text in double quotes, a number, true, false, a list or an object"
        }
        "key must be a string" => "a key is a text in double quotes",
        "trailing comma" => "there is a \",\" with nothing after it",
        "trailing characters" => "there is something after the scene",
        "number out of range" => "this number is too large",
        "invalid number" => "this is no number",
        "recursion limit exceeded" => "there are too many lists and objects in each other",
        "invalid unicode code point" => "this is not UTF-8",
        "invalid escape" => "this is no escape of a character in a text",
        "lone leading surrogate in hex escape" | "unexpected end of hex escape" => {
            "this is half of a character that is escaped in two parts"
        }
        "control character (\\u0000-\\u001F) found while parsing a string" => "a text goes on beyond its line",
        _ if error.classify() == Category::Eof => "the file ends before the scene does",
        other => other,
    };
    format!("line {line}, column {column}: {what}")
}

/// Any JSON value; objects that have a key twice are refused.
struct OnceEach;

impl<'de> DeserializeSeed<'de> for OnceEach {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Value, D::Error> {
        from.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for OnceEach {
    type Value = Value;

    fn expecting(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, v: bool) -> Result<Value, E> {
        Ok(v.into())
    }

    fn visit_i64<E>(self, v: i64) -> Result<Value, E> {
        Ok(v.into())
    }

    fn visit_u64<E>(self, v: u64) -> Result<Value, E> {
        Ok(v.into())
    }

    fn visit_f64<E>(self, v: f64) -> Result<Value, E> {
        Ok(v.into())
    }

    fn visit_str<E>(self, v: &str) -> Result<Value, E> {
        Ok(v.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = list.next_element_seed(OnceEach)? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut object: A) -> Result<Value, A::Error> {
        let mut keys = Map::new();
        while let Some(key) = object.next_key::<String>()? {
            if keys.contains_key(&key) {
                return Err(A::Error::custom(format!("the key \"{key}\" is there twice")));
            }
            let value = object.next_value_seed(OnceEach)?;
            keys.insert(key, value);
        }
        Ok(Value::Object(keys))
    }
}

/// What is wrong with a scene, and where.
#[derive(Debug, Default)]
pub(super) struct Mistake {
    place: String,
    what: String,
}

impl Mistake {
    fn new(what: String) -> Self {
        Mistake { place: String::new(), what }
    }

    fn in_item(mut self, i: usize) -> Self {
        self.place = self.beyond(&format!("[{i}]"));
        self
    }

    fn under(mut self, key: &str) -> Self {
        self.place = self.beyond(key);
        self
    }

    fn beyond(&self, outer: &str) -> String {
        let dot = if self.place.is_empty() || self.place.starts_with('[') { "" } else { "." };
        format!("{outer}{dot}{}", self.place)
    }
}

impl Display for Mistake {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        if self.place.is_empty() { f.write_str(&self.what) } else { write!(f, "{}: {}", self.place, self.what) }
    }
}

impl std::error::Error for Mistake {}

impl de::Error for Mistake {
    fn custom<T: Display>(what: T) -> Self {
        Mistake::new(what.to_string())
    }

    fn invalid_type(found: Unexpected, meant: &dyn Expected) -> Self {
        Mistake::new(format!("{} is meant, and not {}", words(meant), found_words(found)))
    }

    fn invalid_value(found: Unexpected, meant: &dyn Expected) -> Self {
        Self::invalid_type(found, meant)
    }

    fn invalid_length(count: usize, meant: &dyn Expected) -> Self {
        Mistake::new(format!("{} is meant, and not of {count}", words(meant)))
    }

    fn unknown_variant(name: &str, known: &'static [&'static str]) -> Self {
        Mistake::new(format!("\"{name}\" is not known here; there is {}", known.join(", ")))
    }

    fn unknown_field(key: &str, known: &'static [&'static str]) -> Self {
        Mistake::new(format!("there is no key \"{key}\"; the keys are {}", known.join(", ")))
    }

    fn missing_field(key: &'static str) -> Self {
        Mistake::new(format!("the key \"{key}\" is missing"))
    }

    fn duplicate_field(key: &'static str) -> Self {
        Mistake::new(format!("the key \"{key}\" is there twice"))
    }
}

/// What serde expects, in the words of scenes.
fn words(meant: &dyn Expected) -> String {
    let text = meant.to_string();
    match text.as_str() {
        "f32" | "f64" => "a number".into(),
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number from 0".into(),
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number".into(),
        "a string" | "a borrowed string" | "path string" | "string" => "a text".into(),
        "a boolean" => "true or false".into(),
        "a sequence" => "a list".into(),
        "an empty array" => "a list of 0".into(),
        "a map" => "an object".into(),
        _ if text.starts_with("struct ") => "an object".into(),
        _ => text.strip_prefix("an array of length ").map_or(text.clone(), |n| format!("a list of {n}")),
    }
}

/// What there is instead.
fn found_words(found: Unexpected) -> String {
    match found {
        Unexpected::Bool(b) => b.to_string(),
        Unexpected::Unsigned(n) => n.to_string(),
        Unexpected::Signed(n) => n.to_string(),
        Unexpected::Float(x) => x.to_string(),
        Unexpected::Str(s) => format!("\"{s}\""),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "an object".into(),
        Unexpected::Unit => "null".into(),
        other => other.to_string(),
    }
}

/// What a value is, in the words of scenes.
pub(super) fn kind(value: &Value) -> String {
    match value {
        Value::Null => "null".into(),
        Value::Array(_) => "a list".into(),
        Value::Object(_) => "an object".into(),
        Value::String(s) => format!("\"{s}\""),
        other => other.to_string(),
    }
}

/// A value that is read.
struct Reader<'a>(&'a Value);

impl<'a> Reader<'a> {
    fn not(&self, meant: &str) -> Mistake {
        match self.0 {
            Value::Null => Mistake::new("null says nothing; leave the key out".into()),
            other => Mistake::new(format!("{meant} is meant, and not {}", kind(other))),
        }
    }

    fn keys<V: Visitor<'a>>(keys: &'a Map<String, Value>, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_map(Keys { left: keys.iter(), value: None })
    }
}

impl<'de> Deserializer<'de> for Reader<'de> {
    type Error = Mistake;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mistake> {
        match self.0 {
            Value::Null => Err(self.not("")),
            Value::Bool(b) => visitor.visit_bool(*b),
            Value::Number(n) => match (n.as_u64(), n.as_i64(), n.as_f64()) {
                (Some(n), _, _) => visitor.visit_u64(n),
                (None, Some(n), _) => visitor.visit_i64(n),
                (None, None, x) => visitor.visit_f64(x.unwrap_or(f64::NAN)),
            },
            Value::String(s) => visitor.visit_borrowed_str(s),
            Value::Array(items) => {
                let mut list = Items { left: items.iter(), read: 0 };
                let read = visitor.visit_seq(&mut list)?;
                if list.left.len() > 0 {
                    return Err(Mistake::new(format!("a list of {} is meant, and not of {}", list.read, items.len())));
                }
                Ok(read)
            }
            Value::Object(keys) => Self::keys(keys, visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, Mistake> {
        if name == OPEN_END && self.0.is_null() {
            return visitor.visit_none();
        }
        visitor.visit_newtype_struct(self)
    }

    /// Never a list, of which serde would take the items for the keys in sequence.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        match self.0 {
            Value::Object(keys) => Self::keys(keys, visitor),
            _ => Err(self.not("an object")),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mistake> {
        match self.0 {
            Value::String(name) => {
                let name: StrDeserializer<'_, Mistake> = name.as_str().into_deserializer();
                visitor.visit_enum(name)
            }
            _ => Err(self.not(&format!("one of {}", known.join(", ")))),
        }
    }

    /// What is for others may be anything.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mistake> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier
    }
}

struct Items<'a> {
    left: std::slice::Iter<'a, Value>,
    read: usize,
}

impl<'de> SeqAccess<'de> for &mut Items<'de> {
    type Error = Mistake;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Mistake> {
        let Some(value) = self.left.next() else { return Ok(None) };
        self.read += 1;
        seed.deserialize(Reader(value)).map(Some).map_err(|e| e.in_item(self.read - 1))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.left.len())
    }
}

struct Keys<'a> {
    left: serde_json::map::Iter<'a>,
    value: Option<(&'a str, &'a Value)>,
}

impl<'de> MapAccess<'de> for Keys<'de> {
    type Error = Mistake;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Mistake> {
        let Some((key, value)) = self.left.next() else { return Ok(None) };
        self.value = Some((key, value));
        let key: StrDeserializer<'_, Mistake> = key.as_str().into_deserializer();
        seed.deserialize(key).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Mistake> {
        let Some((key, value)) = self.value.take() else {
            return Err(Mistake::custom("a value was asked for before its key"));
        };
        seed.deserialize(Reader(value)).map_err(|e| e.under(key))
    }
}
