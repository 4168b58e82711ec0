//! Tables of parameters and values of the initial state.

use super::location::{Location, Named};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::borrow::Cow;
use std::fmt::Formatter;
use std::marker::PhantomData;

/// A table of parameters, and of values of the initial state such as `start.x`, in the order of the file.
#[derive(Clone, Debug)]
pub(crate) struct Quantities<T>(pub Vec<(Location<String>, Location<T>)>);

impl<T> Default for Quantities<T> {
    fn default() -> Self {
        Quantities(Vec::new())
    }
}

/// The key of the nested table with values of the initial state.
const START: &str = "start";

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Quantities<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Table<T> {
            type Value = Quantities<T>;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Quantities<T>, A::Error> {
                let mut all = Vec::new();
                while let Some(key) = map.next_key::<Location<String>>()? {
                    if *key == START {
                        let of_start: Named<T> = map.next_value()?;
                        let named = |(key, values): (Location<String>, _)| {
                            (Location::new(format!("{START}.{}", *key), key.span()), values)
                        };
                        all.extend(of_start.0.into_iter().map(named));
                    } else {
                        all.push((key, map.next_value()?));
                    }
                }
                // The TOML reader sorts tables by name; this restores the order of the file.
                all.sort_by_key(|(key, _)| key.span());
                Ok(Quantities(all))
            }
        }
        deserializer.deserialize_map(Table(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Quantities<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Quantities{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let values = generator.subschema_for::<T>();
        json_schema!({
            "type": "object",
            "properties": { START: { "type": "object", "additionalProperties": values.clone() } },
            "additionalProperties": values,
        })
    }
}
