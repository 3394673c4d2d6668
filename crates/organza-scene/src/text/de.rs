//! Value tree → raw tables: a serde deserializer whose errors know their place.
//!
//! An error is born without a place inside serde's generated code; the innermost value or key that it passes on its
//! way out gives it one. A table with a key `kind` deserializes as the enum variant of that name.

use super::tree::{Document, Entry, Node, Place, Value};
use crate::{Error, shown};
use serde::de::{self, DeserializeSeed, IntoDeserializer, Unexpected, Visitor};
use std::fmt::{self, Display};

/// Deserializes the whole document.
pub(crate) fn from_document<T: de::DeserializeOwned>(document: &Document<'_>) -> Result<T, Error> {
    from_node(document, &document.root)
}

/// Deserializes a value of the document.
pub(crate) fn from_node<T: de::DeserializeOwned>(document: &Document<'_>, node: &Node) -> Result<T, Error> {
    T::deserialize(node).map_err(|e| document.error(e.place.unwrap_or(node.place), e.message, e.hint))
}

/// A key that was in another table once, or that is looked for there.
struct Moved {
    key: &'static str,
    /// A key of the table where it was.
    beside: &'static str,
    /// Where it is, as a hint.
    hint: &'static str,
}

const MOVED: [Moved; 2] = [
    Moved { key: "shadow", beside: "slice_thickness", hint: "it is `render.shadow` now" },
    // Of `color_by`: users look for colours by a second volume there.
    Moved {
        key: "volume",
        beside: "column",
        hint: "a surface shows another volume by `field`; labels over intensities are two objects, a `mesh` of labels and a `volume`",
    },
];

/// An error and, once known, its place.
#[derive(Debug)]
pub(crate) struct DeError {
    place: Option<Place>,
    message: String,
    hint: String,
}

impl DeError {
    fn new(message: String, hint: String) -> Self {
        Self { place: None, message, hint }
    }

    fn at(mut self, place: Place) -> Self {
        self.place.get_or_insert(place);
        self
    }
}

impl Display for DeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for DeError {}

/// serde's names of types in plain words.
fn in_words(expected: &dyn de::Expected) -> String {
    match expected.to_string().as_str() {
        "f64" | "f32" => "a number".into(),
        "u64" | "usize" | "i64" => "a whole number ≥ 0".into(),
        "u32" => format!("a whole number from 0 to {}", u32::MAX),
        "u8" => "a whole number from 0 to 255".into(),
        "a boolean" => "true or false".into(),
        "a string" => "a text in quotes".into(),
        "a sequence" => "a list".into(),
        "a map" => "a table".into(),
        other => other.replace("an array of length", "a list of length"),
    }
}

fn unexpected_in_words(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Bool(b) => Value::Bool(b).describe(),
        Unexpected::Signed(i) => Value::Int(i).describe(),
        Unexpected::Unsigned(u) => format!("the number {u}"),
        Unexpected::Float(x) => Value::Float(x).describe(),
        Unexpected::Str(s) => format!("the text \"{}\"", shown(s)),
        Unexpected::Unit | Unexpected::Option => "null".into(),
        Unexpected::Seq => "a list".into(),
        Unexpected::Map => "a table".into(),
        other => other.to_string(),
    }
}

/// "did you mean", when some known name is near.
pub(crate) fn suggest(name: &str, known: &[&str]) -> String {
    match nearest_name(name, known) {
        Some(near) => format!("did you mean `{}`?", shown(near)),
        None if known.is_empty() => String::new(),
        None => format!("known here: {}", shown_list(known)),
    }
}

/// The known name that is nearest to another one, where one is near enough to be meant.
pub fn nearest_name<'a>(name: &str, known: &[&'a str]) -> Option<&'a str> {
    // Names cut short or with few letters changed. Long foreign names would cost time and fit nothing.
    let near = |k: &str| (strsim::damerau_levenshtein(name, k), strsim::jaro_winkler(name, k));
    let nearer = |a: &(usize, f64), b: &(usize, f64)| a.0.min(3).cmp(&b.0.min(3)).then(b.1.total_cmp(&a.1));
    let measured = known.iter().take_while(|_| name.len() <= 64).map(|k| (near(k), *k));
    let best = measured.min_by(|(a, _), (b, _)| nearer(a, b));
    best.filter(|((distance, similarity), _)| *distance <= 2 || *similarity > 0.8).map(|(_, known)| known)
}

/// Names with commas between them, as many as a message may hold.
fn shown_list(names: &[&str]) -> String {
    const MOST: usize = 50;
    let mut list = names.iter().take(MOST).map(|name| shown(name)).collect::<Vec<_>>().join(", ");
    if names.len() > MOST {
        list += &format!(" and {} more", names.len() - MOST);
    }
    list
}

impl de::Error for DeError {
    fn custom<T: Display>(message: T) -> Self {
        Self::new(message.to_string(), String::new())
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::new(format!("expected {}, found {}", in_words(expected), unexpected_in_words(found)), String::new())
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn de::Expected) -> Self {
        Self::new(format!("expected {}, found {length}", in_words(expected)), String::new())
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        let list = expected.iter().map(|e| format!("\"{e}\"")).collect::<Vec<_>>().join(", ");
        let message = format!("expected one of {list}, found \"{}\"", shown(variant));
        Self::new(message, suggest(variant, expected))
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        let moved = MOVED.iter().find(|m| m.key == field && expected.contains(&m.beside));
        let hint = moved.map_or_else(|| suggest(field, expected), |m| m.hint.to_owned());
        Self::new(format!("unknown key `{}`", shown(field)), hint)
    }

    fn missing_field(field: &'static str) -> Self {
        Self::new(format!("expected a key `{field}` here, found none"), String::new())
    }
}

impl<'de> de::Deserializer<'de> for &'de Node {
    type Error = DeError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        let out = match &self.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(b) => visitor.visit_bool(*b),
            Value::Int(i) => visitor.visit_i64(*i),
            Value::Float(x) => visitor.visit_f64(*x),
            Value::Text(text) => visitor.visit_borrowed_str(text),
            Value::List(items) => visit_list(items, visitor),
            Value::Table(entries) => visitor.visit_map(TableAccess { entries: entries.iter(), skip: "", value: None }),
        };
        out.map_err(|e| e.at(self.place))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, DeError> {
        match self.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        let list = || variants.iter().map(|v| format!("\"{v}\"")).collect::<Vec<_>>().join(", ");
        let wrong = |value: &Value, what: &str| {
            let message = format!("expected {what}one of {}, found {}", list(), value.describe());
            Err(DeError::new(message, String::new()))
        };
        let out = match &self.value {
            Value::Text(name) => visitor.visit_enum(EnumAccess { tag: self, name, body: None }),
            Value::Table(entries) => match entries.iter().find(|e| e.key == "kind").map(|e| &e.node) {
                Some(tag @ Node { value: Value::Text(name), .. }) => {
                    visitor.visit_enum(EnumAccess { tag, name, body: Some(entries) })
                }
                Some(tag) => wrong(&tag.value, "").map_err(|e| e.at(tag.place)),
                None => wrong(&self.value, "a key `kind`, "),
            },
            other => wrong(other, ""),
        };
        out.map_err(|e| e.at(self.place))
    }

    /// Generated code takes a list for a table too, by the order of fields; a scene does not.
    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        match &self.value {
            Value::Table(_) => self.deserialize_any(visitor),
            other => {
                let message = format!("expected a table, found {}", other.describe());
                Err(DeError::new(message, String::new()).at(self.place))
            }
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct
        newtype_struct seq tuple tuple_struct map identifier ignored_any
    }
}

/// Visits a list and refuses what the visitor did not take, such as the fourth number of a position.
fn visit_list<'de, V: Visitor<'de>>(items: &'de [Node], visitor: V) -> Result<V::Value, DeError> {
    let expected = in_words(&visitor);
    let mut access = ListAccess { items: items.iter() };
    let out = visitor.visit_seq(&mut access)?;
    match access.items.next() {
        Some(extra) => {
            let message = format!("expected {expected}, found {} values", items.len());
            Err(DeError::new(message, String::new()).at(extra.place))
        }
        None => Ok(out),
    }
}

struct ListAccess<'de> {
    items: std::slice::Iter<'de, Node>,
}

impl<'de> de::SeqAccess<'de> for &mut ListAccess<'de> {
    type Error = DeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, DeError> {
        self.items.next().map(|item| seed.deserialize(item).map_err(|e| e.at(item.place))).transpose()
    }
}

struct TableAccess<'de> {
    entries: std::slice::Iter<'de, Entry>,
    /// A key that was read already.
    skip: &'static str,
    value: Option<&'de Node>,
}

impl<'de> de::MapAccess<'de> for TableAccess<'de> {
    type Error = DeError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, DeError> {
        let Some(entry) = self.entries.by_ref().find(|e| e.key != self.skip) else { return Ok(None) };
        self.value = Some(&entry.node);
        let key: de::value::StrDeserializer<'_, DeError> = entry.key.as_str().into_deserializer();
        seed.deserialize(key).map(Some).map_err(|e| e.at(entry.place))
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, DeError> {
        let node = self.value.take().expect("invariant: serde asks for a key first");
        seed.deserialize(node).map_err(|e| e.at(node.place))
    }
}

struct EnumAccess<'de> {
    tag: &'de Node,
    name: &'de str,
    body: Option<&'de [Entry]>,
}

impl<'de> de::EnumAccess<'de> for EnumAccess<'de> {
    type Error = DeError;
    type Variant = Self;

    fn variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<(T::Value, Self), DeError> {
        let name: de::value::StrDeserializer<'_, DeError> = self.name.into_deserializer();
        let variant = seed.deserialize(name).map_err(|e| e.at(self.tag.place))?;
        Ok((variant, self))
    }
}

impl<'de> de::VariantAccess<'de> for EnumAccess<'de> {
    type Error = DeError;

    fn unit_variant(self) -> Result<(), DeError> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, DeError> {
        seed.deserialize(self.tag)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, DeError> {
        de::Deserializer::deserialize_any(self.tag, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, DeError> {
        match self.body {
            Some(entries) => visitor.visit_map(TableAccess { entries: entries.iter(), skip: "kind", value: None }),
            None => Err(DeError::new(format!("expected a table, found the text \"{}\"", self.name), String::new())),
        }
    }
}
