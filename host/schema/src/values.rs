//! What was read from a file, checked against its section.

use std::collections::BTreeMap;
use std::ops::Range;

/// Bytes of the file a value came from.
pub type Span = Range<usize>;

/// A constant as the file holds it; its meaning depends on the type of the port it goes to.
#[derive(Clone, Debug, PartialEq)]
pub enum Constant {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number with a point or exponent, or `nan`, `inf`.
    Real(f64),
    /// A string.
    Text(String),
}

/// A checked value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Of [`Kind::Text`](crate::Kind::Text), `OneOf` or `Tag`.
    Text(String),
    /// Of `Bool`.
    Bool(bool),
    /// Of `Integer`.
    Integer(i64),
    /// Of `Duration`, ns.
    Duration(u64),
    /// Of `Size`, bytes.
    Size(u64),
    /// Of `Constant`.
    Constant(Constant),
    /// Of `List`.
    List(Vec<(Value, Span)>),
    /// Of `Table`.
    Table(Values),
    /// Of `Map`, in the order of the file.
    Map(Vec<(String, Span, Value, Span)>),
    /// Of `Any`: as it stands, to be checked by whoever owns the section.
    Raw(toml::Value),
}

/// The values of one table by key, with where each stands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// Bytes of the table's header or of the inline table.
    pub span: Span,
    /// Value by key.
    pub entries: BTreeMap<String, (Value, Span)>,
}

impl Values {
    /// True when the file has the key.
    pub fn has(&self, key: &str) -> bool {
        self.entries.contains_key(key)
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&Value> {
        self.entries.get(key).map(|(v, _)| v)
    }

    /// Where the key's value stands; the table itself when the key is absent.
    pub fn span_of(&self, key: &str) -> Span {
        self.entries.get(key).map_or_else(|| self.span.clone(), |(_, s)| s.clone())
    }

    /// A string, word or tag.
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.get(key) {
            Some(Value::Text(t)) => Some(t),
            _ => None,
        }
    }

    /// A boolean.
    pub fn bool(&self, key: &str) -> Option<bool> {
        match self.get(key) {
            Some(Value::Bool(b)) => Some(*b),
            _ => None,
        }
    }

    /// A whole number.
    pub fn integer(&self, key: &str) -> Option<i64> {
        match self.get(key) {
            Some(Value::Integer(i)) => Some(*i),
            _ => None,
        }
    }

    /// A duration in ns.
    pub fn duration(&self, key: &str) -> Option<u64> {
        match self.get(key) {
            Some(Value::Duration(d)) => Some(*d),
            _ => None,
        }
    }

    /// A size in bytes.
    pub fn size(&self, key: &str) -> Option<u64> {
        match self.get(key) {
            Some(Value::Size(s)) => Some(*s),
            _ => None,
        }
    }

    /// A constant.
    pub fn constant(&self, key: &str) -> Option<&Constant> {
        match self.get(key) {
            Some(Value::Constant(c)) => Some(c),
            _ => None,
        }
    }

    /// A table.
    pub fn table(&self, key: &str) -> Option<&Values> {
        match self.get(key) {
            Some(Value::Table(t)) => Some(t),
            _ => None,
        }
    }
}
