//! Labels of a volume, as they are written: in a scene, and in a file of their own.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// A value of a scene file that may be a text instead.
#[derive(Debug)]
pub(crate) enum TextOr<T> {
    Text(String),
    Other(T),
}

/// The labels of an object: the path of a table, or a table.
pub(crate) type RawLabels = TextOr<RawLabelTable>;

/// A label: its name, or a table.
pub(crate) type RawLabel = TextOr<RawLabelLook>;

/// Labels by their numbers.
#[derive(Debug, Default, JsonSchema)]
#[schemars(rename = "LabelTable")]
pub(crate) struct RawLabelTable {
    /// Path of a table of labels (.ctbl, .lut, .txt or .toml), before the labels beside it, which take the place of its own.
    pub(crate) table: Option<String>,
    /// By their numbers, each a name or a table.
    #[schemars(flatten)]
    pub(crate) labels: BTreeMap<String, RawLabel>,
}

/// How a label looks.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    default,
    expecting = "a name or a table behind the number of a label, such as 12 = \"liver\""
)]
#[schemars(rename = "Label")]
pub(crate) struct RawLabelLook {
    /// Its name in the legend; default none.
    pub(crate) name: Option<String>,
    /// Its colour: three numbers, linear Rec.709, or "#rrggbb"; default the colour of its number in the map `distinct`.
    pub(crate) color: Option<TextOr<[f64; 3]>>,
    /// Opacity of one crossing of its surface, from 0, which hides it, to 1, the default.
    pub(crate) opacity: Option<f64>,
    /// Whether it is drawn; default true.
    pub(crate) visible: Option<bool>,
}

/// The key of [`RawLabelTable`] that is no number.
const TABLE: &str = "table";

impl<'de> Deserialize<'de> for RawLabelTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Rows;

        impl<'de> Visitor<'de> for Rows {
            type Value = RawLabelTable;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of labels")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut found = RawLabelTable::default();
                while let Some(key) = map.next_key::<String>()? {
                    if key == TABLE {
                        found.table = Some(map.next_value()?);
                    } else {
                        found.labels.insert(key, map.next_value()?);
                    }
                }
                Ok(found)
            }
        }

        deserializer.deserialize_map(Rows)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for TextOr<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = TextOr<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a text, a table or a list")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                Ok(TextOr::Text(text.to_owned()))
            }

            // The other type refuses numbers in its own words: of a label the name stands where its number should.
            fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
                T::deserialize(number.into_deserializer()).map(TextOr::Other)
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
                T::deserialize(number.into_deserializer()).map(TextOr::Other)
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
                T::deserialize(number.into_deserializer()).map(TextOr::Other)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(TextOr::Other)
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Self::Value, A::Error> {
                T::deserialize(SeqAccessDeserializer::new(seq)).map(TextOr::Other)
            }
        }

        deserializer.deserialize_any(Either(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for TextOr<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("TextOr{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let other = generator.subschema_for::<T>();
        json_schema!({ "anyOf": [{ "type": "string" }, other] })
    }
}
