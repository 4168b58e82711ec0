//! Values with their position in the file.

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Formatter;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Range};
use toml::Spanned;

/// A range of bytes of a text: the first byte, and the one after the last.
pub(crate) type Span = (usize, usize);

/// A value with its position in the file.
#[derive(Clone, Debug)]
pub(crate) struct Location<T> {
    value: T,
    span: Span,
}

impl<T> Location<T> {
    /// A value at a range of bytes.
    pub fn new(value: T, span: Span) -> Self {
        Location { value, span }
    }

    /// The position of the value.
    pub fn span(&self) -> Span {
        self.span
    }
}

impl<T> Deref for Location<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Location<T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Location<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let read = Spanned::<T>::deserialize(deserializer)?;
        let Range { start, end } = read.span();
        Ok(Location { value: read.into_inner(), span: (start, end) })
    }
}

impl<T: JsonSchema> JsonSchema for Location<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

/// A table whose keys are chosen by the user, in the order of the file.
#[derive(Clone, Debug)]
pub(crate) struct Named<T>(pub Vec<(Location<String>, Location<T>)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Named(Vec::new())
    }
}

impl<T> Named<T> {
    /// The value of a name.
    pub fn get(&self, name: &str) -> Option<&Location<T>> {
        self.0.iter().find(|(key, _)| **key == name).map(|(_, value)| value)
    }

    /// Sets the value of a name, replacing an existing one.
    pub fn set(&mut self, name: &str, value: Location<T>) {
        match self.0.iter_mut().find(|(key, _)| **key == name) {
            Some((_, old)) => *old = value,
            None => self.0.push((Location::new(name.to_owned(), value.span()), value)),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Table<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Named<T>, A::Error> {
                let mut all = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    all.push(entry);
                }
                // The TOML reader sorts tables by name; this restores the order of the file.
                all.sort_by_key(|(key, _): &(Location<String>, Location<T>)| key.span());
                Ok(Named(all))
            }
        }
        deserializer.deserialize_map(Table(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Named<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("Named{}", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        BTreeMap::<String, T>::json_schema(generator)
    }
}

/// A number, a list of numbers, or a formula in the index of an array.
#[derive(Clone, Debug, JsonSchema)]
#[schemars(untagged, inline)]
pub(crate) enum Numbers {
    /// One number; for an array, the value of all its entries.
    One(f64),
    /// One number for each entry of an array.
    Many(Vec<Location<f64>>),
    /// A formula in the index of an entry.
    Formula(String),
}

impl<'de> Deserialize<'de> for Numbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OneOrMany;
        impl<'de> Visitor<'de> for OneOrMany {
            type Value = Numbers;

            fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
                f.write_str("a number, a list of numbers, or a formula in the index of an array")
            }

            fn visit_f64<E>(self, x: f64) -> Result<Numbers, E> {
                Ok(Numbers::One(x))
            }

            fn visit_i64<E>(self, x: i64) -> Result<Numbers, E> {
                Ok(Numbers::One(x as f64))
            }

            fn visit_str<E>(self, formula: &str) -> Result<Numbers, E> {
                Ok(Numbers::Formula(formula.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Numbers, A::Error> {
                let mut all = Vec::new();
                while let Some(x) = list.next_element()? {
                    all.push(x);
                }
                Ok(Numbers::Many(all))
            }
        }
        deserializer.deserialize_any(OneOrMany)
    }
}
