//! What stands behind a key: values with their place in the file, whose types say unit and bounds.
//!
//! The doc comments of the fields that have these types are the text of `docs/scene.md` and of the
//! JSON Schema. Defaults there are in SI whatever the file's units.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, IntoDeserializer, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::units::{Quantity, TABLE};

/// A value and where it stands.
#[derive(Clone, Copy, Debug)]
pub(super) struct At<T> {
    pub(super) value: T,
    /// Byte offset in the file.
    pub(super) offset: usize,
}

/// A number in the file's unit of a quantity, `Q` of [`Quantity`].
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct In<const Q: usize>(pub(super) f64);

pub(super) type Length = At<In<{ Quantity::Length as usize }>>;
pub(super) type Time = At<In<{ Quantity::Time as usize }>>;
pub(super) type Speed = At<In<{ Quantity::Speed as usize }>>;
pub(super) type Mass = At<In<{ Quantity::Mass as usize }>>;
pub(super) type Density = At<In<{ Quantity::Density as usize }>>;
pub(super) type Pressure = At<In<{ Quantity::Pressure as usize }>>;
pub(super) type Force = At<In<{ Quantity::Force as usize }>>;
pub(super) type Stiffness = At<In<{ Quantity::Stiffness as usize }>>;
pub(super) type Damping = At<In<{ Quantity::Damping as usize }>>;
pub(super) type RotationalInertia = At<In<{ Quantity::RotationalInertia as usize }>>;
pub(super) type RotationalStiffness = At<In<{ Quantity::RotationalStiffness as usize }>>;
pub(super) type RotationalDamping = At<In<{ Quantity::RotationalDamping as usize }>>;
pub(super) type Angle = At<In<{ Quantity::Angle as usize }>>;
pub(super) type Plain = At<In<{ Quantity::Number as usize }>>;

/// So many numbers of one quantity and no more: serde's own arrays drop what is too much.
#[derive(Clone, Copy, Debug)]
pub(super) struct Vector<const N: usize, const Q: usize>(pub(super) [f64; N]);

pub(super) type Point = At<Vector<3, { Quantity::Length as usize }>>;
pub(super) type Direction = At<Vector<3, { Quantity::Number as usize }>>;
pub(super) type Quaternion = At<Vector<4, { Quantity::Number as usize }>>;

/// A whole number from `LEAST` to `MOST`, which is not checked yet.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(transparent)]
pub(super) struct Bounded<const LEAST: u32, const MOST: u32>(pub(super) i64);

pub(super) type Whole<const LEAST: u32, const MOST: u32> = At<Bounded<LEAST, MOST>>;

/// One value, which must be written as a word, or a list of them.
#[derive(Debug)]
pub(super) struct OneOrMore<T>(Vec<At<T>>);

/// What can be listed.
pub(super) trait Listed {
    /// What the key takes, for the message about anything else.
    const EXPECTED: &str;
}

/// Where a key stands, if it is written.
pub(super) fn place<T>(key: &Option<At<T>>) -> Option<usize> {
    key.as_ref().map(|at| at.offset)
}

impl<T> At<OneOrMore<T>> {
    pub(super) fn is_empty(&self) -> bool {
        self.value.0.is_empty()
    }

    /// The values; one that stands alone has the place of the whole.
    pub(super) fn into_values(self) -> impl Iterator<Item = At<T>> {
        self.value.0.into_iter().map(move |at| At {
            offset: at.offset.max(self.offset),
            ..at
        })
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for At<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = toml::Spanned::<T>::deserialize(deserializer)?;
        Ok(Self {
            offset: spanned.span().start,
            value: spanned.into_inner(),
        })
    }
}

impl<'de, const N: usize, const Q: usize> Deserialize<'de> for Vector<N, Q> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::deserialize(deserializer)?;
        let wrong = |numbers: Vec<f64>| {
            let expected = format!("{N} numbers");
            de::Error::invalid_length(numbers.len(), &&*expected)
        };
        numbers.try_into().map(Self).map_err(wrong)
    }
}

impl<'de, T: Deserialize<'de> + Listed> Deserialize<'de> for OneOrMore<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Values<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de> + Listed> Visitor<'de> for Values<T> {
            type Value = Vec<At<T>>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(T::EXPECTED)
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<Vec<At<T>>, E> {
                let value = T::deserialize(word.into_deserializer())?;
                // Only the key knows its place; see `into_values`.
                Ok(vec![At { value, offset: 0 }])
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<At<T>>, A::Error> {
                let mut values = Vec::new();
                while let Some(value) = seq.next_element()? {
                    values.push(value);
                }
                Ok(values)
            }
        }
        let values = deserializer.deserialize_any(Values(PhantomData))?;
        Ok(Self(values))
    }
}

impl<T: JsonSchema> JsonSchema for At<T> {
    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}

impl<const Q: usize> JsonSchema for In<Q> {
    fn schema_name() -> Cow<'static, str> {
        TABLE[Q].1.into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        of_quantity(f64::json_schema(generator), Q)
    }
}

impl<const N: usize, const Q: usize> JsonSchema for Vector<N, Q>
where
    [f64; N]: JsonSchema,
{
    fn schema_name() -> Cow<'static, str> {
        <[f64; N]>::schema_name()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        of_quantity(<[f64; N]>::json_schema(generator), Q)
    }
}

impl<const LEAST: u32, const MOST: u32> JsonSchema for Bounded<LEAST, MOST> {
    fn schema_name() -> Cow<'static, str> {
        format!("{LEAST} to {MOST}").into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = i64::json_schema(generator);
        schema.insert("minimum".to_owned(), LEAST.into());
        schema.insert("maximum".to_owned(), MOST.into());
        schema
    }
}

impl<T: JsonSchema> JsonSchema for OneOrMore<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("List of {}", T::schema_name()).into()
    }
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "x-type": "name or list",
            "anyOf": [
                { "type": "string" },
                { "type": "array", "minItems": 1, "items": T::json_schema(generator) }
            ]
        })
    }
}

/// The document has the unit from this name.
fn of_quantity(mut schema: Schema, quantity: usize) -> Schema {
    schema.insert("x-quantity".to_owned(), TABLE[quantity].1.into());
    schema
}
