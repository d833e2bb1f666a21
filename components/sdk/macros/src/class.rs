//! A device class as the macro sees it: which functions an author writes, with which parameters, and which types are
//! in scope.

use heck::ToUpperCamelCase;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use wit_parser::{Interface, InterfaceId, Resolve, Type, TypeDefKind, TypeId, TypeOwner};

/// The functions of a class, in the order an author writes them.
const FUNCTIONS: [&str; 5] = ["defaults", "configure", "execute", "save", "restore"];

/// The types whose fields are ports, or state.
const PORTS: [&str; 6] = ["settings", "inputs", "commands", "outputs", "alarms", "retained"];

/// One function an author writes.
#[derive(Debug)]
pub(crate) struct Function {
    pub(crate) name: &'static str,
    /// `&mut self`, `&self` or nothing.
    pub(crate) receiver: Option<&'static str>,
    /// Name and type of each parameter after the receiver.
    pub(crate) parameters: Vec<(String, String)>,
    /// The result as the author writes it, without the arrow.
    pub(crate) result: Option<String>,
}

impl Function {
    /// The signature as it is to be written.
    pub(crate) fn signature(&self) -> String {
        let result = self.result.as_ref().map_or_else(String::new, |r| format!(" -> {r}"));
        format!("fn {}({}){result}", self.name, self.parameter_list())
    }

    /// What stands between the parentheses.
    pub(crate) fn parameter_list(&self) -> String {
        let receiver = self.receiver.map(str::to_owned);
        let rest = self.parameters.iter().map(|(n, t)| format!("{n}: {t}"));
        receiver.into_iter().chain(rest).collect::<Vec<_>>().join(", ")
    }
}

/// A type of the class and where it comes from.
pub(crate) struct Named {
    /// Its name in Rust.
    pub(crate) rust: String,
    pub(crate) id: TypeId,
    /// Defined by the class itself, so its `Default` is ours to write.
    pub(crate) own: bool,
}

/// A device class.
pub(crate) struct Class {
    /// With version, `latchwork:device/ton@0.1.0`.
    pub(crate) id: String,
    /// Rust path of the generated module below `exports`.
    pub(crate) module: Vec<String>,
    pub(crate) functions: Vec<Function>,
    pub(crate) types: Vec<Named>,
}

/// Reads a class, or says why the interface is none.
pub(crate) fn read(resolve: &Resolve, interface: InterfaceId) -> Result<Class, String> {
    let class = &resolve.interfaces[interface];
    let id = resolve.id_of(interface).unwrap_or_default();
    let refuse = |why: String| format!("`{id}` is no device class: {why}");
    for name in class.functions.keys() {
        if !FUNCTIONS.contains(&name.as_str()) {
            return Err(refuse(format!("it has a function `{name}`; a class has only {}", FUNCTIONS.join(", "))));
        }
    }
    if !class.functions.contains_key("execute") {
        return Err(refuse("it has no function `execute`".into()));
    }
    for (ty, needs) in
        [("settings", &["configure"][..]), ("retained", &["save", "restore"]), ("inputs", &[]), ("outputs", &[])]
    {
        for function in needs {
            if class.types.contains_key(ty) != class.functions.contains_key(*function) {
                return Err(refuse(format!("`{ty}` and `{function}` belong together")));
            }
        }
    }
    for group in PORTS {
        if let Some(ty) = class.types.get(group) {
            check_port(resolve, &Type::Id(*ty), group).map_err(refuse)?;
        }
    }
    let functions = FUNCTIONS.into_iter().filter(|n| class.functions.contains_key(*n));
    let functions = functions.map(|name| function(resolve, class, name)).collect::<Result<_, _>>().map_err(refuse)?;
    let package = class.package.map(|p| &resolve.packages[p].name);
    let module = package.into_iter().flat_map(|p| [p.namespace.clone(), module_of_package(resolve, p)]);
    let module = module.chain(class.name.clone()).map(|n| rust_module(&n)).collect();
    let types = class.types.iter().map(|(name, id)| Named {
        rust: name.to_upper_camel_case(),
        id: *id,
        own: !matches!(resolve.types[*id].kind, TypeDefKind::Type(_)),
    });
    Ok(Class { id, module, functions, types: types.collect() })
}

/// As wit-bindgen: the version becomes part of the module only when two versions are around.
fn module_of_package(resolve: &Resolve, name: &wit_parser::PackageName) -> String {
    let same = resolve.packages.iter().filter(|(_, p)| p.name.namespace == name.namespace && p.name.name == name.name);
    match (&name.version, same.count()) {
        (Some(version), 2..) => format!("{}{version}", name.name).replace(['.', '-', '+'], "_"),
        _ => name.name.clone(),
    }
}

fn rust_module(name: &str) -> String {
    let name = heck::AsSnakeCase(name).to_string();
    if syn::parse_str::<syn::Ident>(&name).is_ok() { name } else { format!("{name}_") }
}

fn function(resolve: &Resolve, class: &Interface, name: &'static str) -> Result<Function, String> {
    let wit = &class.functions[name];
    let mut parameters = Vec::new();
    for p in &wit.params {
        let ty =
            type_name(resolve, &p.ty).ok_or_else(|| format!("parameter `{}` of `{name}` has no type name", p.name))?;
        parameters.push((p.name.replace('-', "_"), ty));
    }
    let expected: Vec<String> = match name {
        "execute" => {
            let optional = ["inputs", "commands"].into_iter().filter(|t| class.types.contains_key(*t));
            std::iter::once("scan").chain(optional).map(ToUpperCamelCase::to_upper_camel_case).collect()
        }
        "configure" => vec!["Settings".into()],
        "restore" => vec!["Retained".into()],
        _ => Vec::new(),
    };
    let found: Vec<&String> = parameters.iter().map(|(_, t)| t).collect();
    if !found.iter().copied().eq(&expected) {
        let wit = |t: &[String]| t.join(", ").to_lowercase();
        let found: Vec<String> = found.into_iter().cloned().collect();
        return Err(format!("`{name}` takes ({}), expected ({})", wit(&found), wit(&expected)));
    }
    let receiver = match name {
        "defaults" => None,
        "save" => Some("&self"),
        _ => Some("&mut self"),
    };
    let result = match name {
        "configure" => Some("Result<(), String>".into()),
        "defaults" => Some("Settings".into()),
        "save" => Some("Retained".into()),
        "restore" => None,
        _ => match (class.types.contains_key("outputs"), class.types.contains_key("alarms")) {
            (true, true) => Some("(Outputs, Alarms)".into()),
            (true, false) => Some("Outputs".into()),
            (false, true) => Some("Alarms".into()),
            (false, false) => None,
        },
    };
    Ok(Function { name, receiver, parameters, result })
}

/// Says which port has a type that no host wires; hosts refuse the same at load.
fn check_port(resolve: &Resolve, ty: &Type, path: &str) -> Result<(), String> {
    let kind = match ty {
        Type::Char => "char",
        Type::String => "string",
        Type::ErrorContext => "error-context",
        Type::Id(id) => match &resolve.types[*id].kind {
            TypeDefKind::Type(inner) => return check_port(resolve, inner, path),
            TypeDefKind::Record(record) => {
                return record
                    .fields
                    .iter()
                    .try_for_each(|f| check_port(resolve, &f.ty, &format!("{path}.{}", f.name)));
            }
            TypeDefKind::Flags(_) | TypeDefKind::Enum(_) => return Ok(()),
            other => other.as_str(),
        },
        _ => return Ok(()),
    };
    Err(format!(
        "`{path}` is a {kind}; a port is a bool, a number, an enum, flags, a duration, a signal or a record of these"
    ))
}

fn type_name(resolve: &Resolve, ty: &Type) -> Option<String> {
    match ty {
        Type::Id(id) => resolve.types[*id].name.as_ref().map(|n| n.to_upper_camel_case()),
        _ => None,
    }
}

/// The documentation of a class for `latchwork inspect`: the class's text and one text per port.
pub(crate) fn docs(resolve: &Resolve, interface: InterfaceId) -> Value {
    let class = &resolve.interfaces[interface];
    let mut ports = BTreeMap::new();
    for (name, id) in &class.types {
        if PORTS.contains(&name.as_str()) {
            collect_docs(resolve, *id, name, &mut ports);
        }
    }
    let ports: Map<String, Value> = ports.into_iter().map(|(k, v)| (k, Value::String(v))).collect();
    json!({ "class": text(&class.docs), "ports": ports })
}

fn text(docs: &wit_parser::Docs) -> &str {
    docs.contents.as_deref().unwrap_or_default().trim()
}

fn collect_docs(resolve: &Resolve, id: TypeId, path: &str, into: &mut BTreeMap<String, String>) {
    match &resolve.types[id].kind {
        TypeDefKind::Record(record) => {
            for field in &record.fields {
                let path = format!("{path}.{}", field.name);
                if let Type::Id(id) = field.ty {
                    let shared = matches!(shared_type(resolve, id), Some("duration" | "real-signal" | "bool-signal"));
                    if !shared {
                        collect_docs(resolve, id, &path, into);
                    }
                }
                into.insert(path, text(&field.docs).into());
            }
        }
        TypeDefKind::Flags(flags) if !path.contains('.') => {
            for flag in &flags.flags {
                into.insert(format!("{path}.{}", flag.name), text(&flag.docs).into());
            }
        }
        TypeDefKind::Type(Type::Id(id)) => collect_docs(resolve, *id, path, into),
        _ => {}
    }
}

/// The name of a type of `latchwork:block/types`, seen through `use`.
pub(crate) fn shared_type(resolve: &Resolve, id: TypeId) -> Option<&str> {
    let ty = &resolve.types[id];
    if let TypeDefKind::Type(Type::Id(inner)) = ty.kind {
        return shared_type(resolve, inner);
    }
    let TypeOwner::Interface(owner) = ty.owner else { return None };
    let interface = &resolve.interfaces[owner];
    let package = &resolve.packages[interface.package?].name;
    (package.namespace == "latchwork" && package.name == "block").then_some(ty.name.as_deref()?)
}
