//! A value as it stands, for whoever owns the section.

use crate::words::integer;
use toml::Value;
use toml::de::DeValue;

/// The value without its places in the file; `None` when a number in it does not fit into 64 bits.
pub(crate) fn raw(value: &DeValue<'_>) -> Option<Value> {
    Some(match value {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(_) => Value::Integer(integer(value)?),
        DeValue::Float(real) => Value::Float(real.as_str().replace('_', "").parse().ok()?),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Datetime(time) => Value::Datetime(*time),
        DeValue::Array(list) => Value::Array(list.iter().map(|v| raw(v.get_ref())).collect::<Option<_>>()?),
        DeValue::Table(table) => {
            let entries = table.iter().map(|(key, v)| Some((key.get_ref().to_string(), raw(v.get_ref())?)));
            Value::Table(entries.collect::<Option<_>>()?)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_the_same_without_its_places() {
        let text =
            "v = { a = [1, 0x10, 2.5e3, 1_000.5, inf], b = 'x', c = true, d.e = 2026-11-27, f = 1979-05-27T07:32:00Z }";
        let table = toml::de::DeTable::parse(text).expect("TOML");
        let expected: toml::Table = toml::from_str(text).expect("TOML");
        assert_eq!(raw(table.get_ref().values().next().expect("a value").get_ref()), Some(expected["v"].clone()));
    }
}
