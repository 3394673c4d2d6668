//! Footprints as they are written: a number for a formula or a table for images, and how objects choose among them.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

/// What is written as a number or as a table.
#[derive(Debug)]
pub(crate) enum NumberOr<T> {
    Number(f64),
    Table(T),
}

/// One footprint, or those of a folder.
pub(crate) type RawFootprint = NumberOr<RawImages>;

/// The footprint of an object.
pub(crate) type RawChoice = NumberOr<RawChosen>;

/// Images that say how much of each place a disc covers.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a number or a table")]
#[schemars(rename = "FootprintImages")]
pub(crate) struct RawImages {
    /// Path of a PNG or OpenEXR image; or `images`.
    pub(crate) image: Option<String>,
    /// Path of a folder whose PNG and OpenEXR images are taken in the order of their names; or `image`.
    pub(crate) images: Option<String>,
    /// Where the Gaussian is cut whose energy they have, in standard deviations, 1 to 8; default 3.
    pub(crate) cutoff: Option<f64>,
}

/// How the footprint of each disc is chosen, and how images lie.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a whole number \u{2265} 0 or a table")]
#[schemars(rename = "FootprintChoice")]
pub(crate) struct RawChosen {
    /// Indices into `footprints`, one of which is chosen for each disc by chance; default those of the file's column `footprint`, else
    /// what the material says.
    pub(crate) of: Option<Vec<u32>>,
    /// Seed of the choice and of turns; default 0.
    pub(crate) seed: Option<u32>,
    /// Greatest angle by which images are turned from upright by chance, degrees, 0 to 180; default 0.
    pub(crate) turn: Option<f64>,
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for NumberOr<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = NumberOr<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a table")
            }

            fn visit_i64<E: Error>(self, v: i64) -> Result<Self::Value, E> {
                Ok(NumberOr::Number(v as f64))
            }

            fn visit_u64<E: Error>(self, v: u64) -> Result<Self::Value, E> {
                Ok(NumberOr::Number(v as f64))
            }

            fn visit_f64<E: Error>(self, v: f64) -> Result<Self::Value, E> {
                Ok(NumberOr::Number(v))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                T::deserialize(MapAccessDeserializer::new(map)).map(NumberOr::Table)
            }
        }

        deserializer.deserialize_any(Either(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for NumberOr<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("NumberOr{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = generator.subschema_for::<T>();
        json_schema!({ "anyOf": [{ "type": "number" }, table] })
    }
}
