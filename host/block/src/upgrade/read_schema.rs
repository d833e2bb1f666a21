//! The ports that a schema names: of a version whose component may be gone.

use crate::Port;
use latchwork_image::Type;
use std::sync::Arc;

/// The ports of a text that [`schema`](super::schema) made, without their documentation; `None` for any other text.
pub fn read_schema(schema: &str) -> Option<Vec<Port>> {
    if schema.is_empty() {
        return Some(Vec::new());
    }
    schema.split(',').map(port).collect()
}

fn port(text: &str) -> Option<Port> {
    let (path, ty) = text.split_once(':')?;
    let (ty, signal) = ty.strip_suffix("+quality").map_or((ty, false), |ty| (ty, true));
    is_name(path, '.').then_some(())?;
    Some(Port { path: path.into(), ty: read_type(ty)?, signal, doc: None })
}

fn read_type(text: &str) -> Option<Type> {
    if let Some(ty) = Type::PLAIN.into_iter().find(|ty| ty.kind() == text) {
        return Some(ty);
    }
    let names = |kind: &str| -> Option<Arc<[String]>> {
        let inner = text.strip_prefix(kind)?.strip_prefix('(')?.strip_suffix(')')?;
        inner.split('|').map(|n| is_name(n, '-').then(|| n.to_owned())).collect()
    };
    let flags = || names("flags").filter(|n| n.len() <= 32).map(Type::Flags);
    names("enum").map(Type::Enum).or_else(flags)
}

/// Letters, digits and hyphens, as WIT has them, and one other sign.
fn is_name(text: &str, also: char) -> bool {
    !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '-' || c == also)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::upgrade::schema;
    use proptest::prelude::*;

    #[test]
    fn other_texts_are_no_schema() {
        let flags = format!("a:flags({})", vec!["x"; 33].join("|"));
        for wrong in ["a", "a:", ":u8", "a:u7", "a:u8,", "a:enum", "a:enum()", "a:enum(x|)", "a b:u8", "a:u8+", &flags]
        {
            assert_eq!(read_schema(wrong), None, "{wrong}");
        }
    }

    fn any_type() -> impl Strategy<Value = Type> {
        let names = || prop::collection::vec("[a-z][a-z0-9]{0,5}(-[a-z]{1,3})?", 1..9).prop_map(Into::into);
        let plain = prop::sample::select(Type::PLAIN.to_vec());
        prop_oneof![plain, names().prop_map(Type::Enum), names().prop_map(Type::Flags)]
    }

    proptest! {
        #[test]
        fn a_schema_names_the_ports_it_was_made_of(
            ports in prop::collection::vec(("[a-z][a-z0-9-]{0,8}(\\.[a-z]{1,4})?", any_type(), any::<bool>()), 0..20),
        ) {
            let port = |(path, ty, signal)| Port { path, ty, signal, doc: None };
            let ports: Vec<_> = ports.into_iter().map(port).collect();
            prop_assert_eq!(read_schema(&schema(&ports)), Some(ports));
        }

        #[test]
        fn no_text_makes_it_panic(text in ".*") {
            let _ = read_schema(&text);
        }
    }
}
