//! Reads a class from WIT, or says why an interface is none.

use super::{Class, Field, Home, Kind, Label, PORTS, Ty, TypeDef};
use crate::error::AuthorError;
use crate::names::{camel, twice};
use std::collections::HashMap;
use wit_parser::{InterfaceId, Resolve, Type, TypeDefKind, TypeId, TypeOwner};

/// The functions of a class.
const FUNCTIONS: [&str; 5] = ["defaults", "configure", "execute", "save", "restore"];

/// Most flags that one word carries.
const MOST_FLAGS: usize = 32;

/// Reads a class, or says why the interface is none.
pub(crate) fn read(resolve: &Resolve, interface: InterfaceId) -> Result<Class, AuthorError> {
    let id = resolve.id_of(interface).unwrap_or_default();
    read_interface(resolve, interface, &id).map_err(|why| AuthorError::NoClass { id, why })
}

fn read_interface(resolve: &Resolve, interface: InterfaceId, id: &str) -> Result<Class, String> {
    let wit = &resolve.interfaces[interface];
    if let Some(name) = wit.functions.keys().find(|n| !FUNCTIONS.contains(&n.as_str())) {
        return Err(format!("it has a function `{name}`; a class has only {}", FUNCTIONS.join(", ")));
    }
    if !wit.functions.contains_key("execute") {
        return Err("it has no function `execute`".into());
    }
    for (ty, function) in [("settings", "configure"), ("retained", "save"), ("retained", "restore")] {
        if wit.types.contains_key(ty) != wit.functions.contains_key(function) {
            return Err(format!("`{ty}` and `{function}` belong together; it has only one of them"));
        }
    }
    if wit.functions.contains_key("defaults") && !wit.types.contains_key("settings") {
        return Err("it has `defaults` without `settings`".into());
    }
    let names = names(resolve, interface);
    let mut reader = Reader { resolve, interface, names, types: Vec::new(), paths: Vec::new(), known: HashMap::new() };
    let mut groups = HashMap::new();
    let Some(scan) = wit.types.get("scan") else {
        return Err("it does not use `scan`; write `use latchwork:block/types@0.1.0.{scan};`".into());
    };
    let Ty::Named(scan) = reader.ty(&Type::Id(*scan), "scan")? else { return Err("`scan` is no record".into()) };
    if !reader.types[scan].shared {
        return Err(
            "`scan` is not that of latchwork:block/types; write `use latchwork:block/types@0.1.0.{scan};`".into()
        );
    }
    for group in PORTS {
        let Some(ty) = wit.types.get(group) else { continue };
        let Ty::Named(index) = reader.ty(&Type::Id(*ty), group)? else {
            return Err(format!("`{group}` is a number; expected a record or flags"));
        };
        let index = reader.called(index, group);
        let flags = matches!(group, "commands" | "alarms");
        if flags != matches!(reader.types[index].kind, Kind::Flags(_)) {
            return Err(format!("`{group}` is not {}", if flags { "flags" } else { "a record" }));
        }
        groups.insert(group, index);
    }
    reader.told_apart()?;
    let group = |name: &str| groups.get(name).copied();
    let package = wit.package.map(|p| &resolve.packages[p].name);
    let class = Class {
        id: id.to_owned(),
        name: wit.name.clone().unwrap_or_default(),
        package: package.map(|p| (p.namespace.clone(), p.name.clone())).unwrap_or_default(),
        doc: text(&wit.docs),
        scan,
        settings: group("settings"),
        inputs: group("inputs"),
        commands: group("commands"),
        outputs: group("outputs"),
        alarms: group("alarms"),
        retained: group("retained"),
        defaults: wit.functions.contains_key("defaults"),
        types: reader.types,
    };
    for name in FUNCTIONS.into_iter().filter(|n| wit.functions.contains_key(*n)) {
        signature(resolve, interface, name, &class)?;
    }
    Ok(class)
}

/// Compares a function with what a class of these parts has.
fn signature(resolve: &Resolve, interface: InterfaceId, name: &str, class: &Class) -> Result<(), String> {
    let function = &resolve.interfaces[interface].functions[name];
    let names = |list: Vec<(&str, usize)>| list.into_iter().map(|(n, _)| n.to_owned()).collect::<Vec<_>>();
    let (parameters, result) = match name {
        "execute" => {
            let results = names(class.execute_results());
            let result = match &results[..] {
                [] => None,
                [one] => Some(one.clone()),
                both => Some(format!("tuple<{}>", both.join(", "))),
            };
            (names(class.execute_parameters()), result)
        }
        "configure" => (vec!["settings".into()], Some("result<_, string>".into())),
        "defaults" => (Vec::new(), Some("settings".into())),
        "save" => (Vec::new(), Some("retained".into())),
        _ => (vec!["retained".into()], None),
    };
    if function.kind.is_async() {
        return Err(format!("`{name}` is an async func; expected a plain func"));
    }
    let found: Vec<String> = function.params.iter().map(|p| shown(resolve, &p.ty)).collect();
    let found_result = function.result.as_ref().map(|r| shown(resolve, r));
    let write = |parameters: &[String], result: &Option<String>| {
        let arrow = result.as_ref().map_or_else(String::new, |r| format!(" -> {r}"));
        format!("func({}){arrow}", parameters.join(", "))
    };
    if found != parameters || found_result != result {
        return Err(format!("`{name}` is {}; expected {}", write(&found, &found_result), write(&parameters, &result)));
    }
    Ok(())
}

/// A type as WIT writes it.
fn shown(resolve: &Resolve, ty: &Type) -> String {
    let Type::Id(id) = ty else { return format!("{ty:?}").to_lowercase() };
    let def = &resolve.types[*id];
    let shown = |ty: &Option<Type>| ty.as_ref().map_or_else(|| "_".into(), |t| shown(resolve, t));
    match (&def.name, &def.kind) {
        (Some(name), _) => name.clone(),
        (None, TypeDefKind::Result(r)) => format!("result<{}, {}>", shown(&r.ok), shown(&r.err)),
        (None, TypeDefKind::Tuple(t)) => {
            let types: Vec<String> = t.types.iter().map(|t| shown(&Some(*t))).collect();
            format!("tuple<{}>", types.join(", "))
        }
        (None, kind) => kind.as_str().to_owned(),
    }
}

/// What the class calls the types that it defines or uses: groups by their own names, others by the first.
fn names(resolve: &Resolve, interface: InterfaceId) -> HashMap<TypeId, String> {
    let mut names = HashMap::new();
    let (groups, others): (Vec<_>, Vec<_>) =
        resolve.interfaces[interface].types.iter().partition(|(name, _)| PORTS.contains(&name.as_str()));
    for (name, id) in groups.into_iter().chain(others) {
        names.entry(definition(resolve, *id)).or_insert_with(|| name.clone());
    }
    names
}

/// The type behind `use … as …` and `type … = …`.
fn definition(resolve: &Resolve, id: TypeId) -> TypeId {
    match resolve.types[id].kind {
        TypeDefKind::Type(Type::Id(inner)) => definition(resolve, inner),
        _ => id,
    }
}

struct Reader<'a> {
    resolve: &'a Resolve,
    interface: InterfaceId,
    names: HashMap<TypeId, String>,
    types: Vec<TypeDef>,
    /// Where each type was met first.
    paths: Vec<String>,
    known: HashMap<TypeId, usize>,
}

impl Reader<'_> {
    /// A type of a port; `path` is for the refusal.
    fn ty(&mut self, ty: &Type, path: &str) -> Result<Ty, String> {
        let kind = match ty {
            Type::Bool => return Ok(Ty::Bool),
            Type::U8 => return Ok(Ty::U8),
            Type::S8 => return Ok(Ty::S8),
            Type::U16 => return Ok(Ty::U16),
            Type::S16 => return Ok(Ty::S16),
            Type::U32 => return Ok(Ty::U32),
            Type::S32 => return Ok(Ty::S32),
            Type::U64 => return Ok(Ty::U64),
            Type::S64 => return Ok(Ty::S64),
            Type::F32 => return Ok(Ty::F32),
            Type::F64 => return Ok(Ty::F64),
            Type::Id(id) => return self.named(*id, path),
            Type::Char => "char",
            Type::String => "string",
            Type::ErrorContext => "error-context",
        };
        Err(refused(path, kind))
    }

    fn named(&mut self, id: TypeId, path: &str) -> Result<Ty, String> {
        if let Some(known) = self.known.get(&id) {
            return Ok(Ty::Named(*known));
        }
        let def = &self.resolve.types[id];
        let label = |name: &String, docs: &wit_parser::Docs| Label { name: name.clone(), doc: text(docs) };
        let kind = match &def.kind {
            TypeDefKind::Type(inner) => return self.ty(inner, path),
            TypeDefKind::Record(record) if record.fields.is_empty() => {
                return Err(empty(path, "record without fields"));
            }
            TypeDefKind::Flags(flags) if flags.flags.is_empty() => return Err(empty(path, "flags without a flag")),
            TypeDefKind::Enum(cases) if cases.cases.is_empty() => return Err(empty(path, "enum without a case")),
            TypeDefKind::Record(record) => {
                let mut fields = Vec::new();
                for field in &record.fields {
                    let ty = self.ty(&field.ty, &format!("{path}.{}", field.name))?;
                    fields.push(Field { name: field.name.clone(), doc: text(&field.docs), ty });
                }
                Kind::Record(fields)
            }
            TypeDefKind::Flags(flags) if flags.flags.len() > MOST_FLAGS => {
                return Err(format!("`{path}` has {} flags; expected at most {MOST_FLAGS}", flags.flags.len()));
            }
            TypeDefKind::Flags(flags) => Kind::Flags(flags.flags.iter().map(|f| label(&f.name, &f.docs)).collect()),
            TypeDefKind::Enum(cases) => Kind::Enum(cases.cases.iter().map(|c| label(&c.name, &c.docs)).collect()),
            other => return Err(refused(path, other.as_str())),
        };
        let index = self.types.len();
        let home = self.home(id);
        let name = self.names.get(&id).unwrap_or(&home.name).clone();
        let shared = home.package.0 == "latchwork" && home.package.1 == "block";
        self.types.push(TypeDef { name, doc: text(&def.docs), kind, home, shared });
        self.paths.push(path.to_owned());
        self.known.insert(id, index);
        Ok(Ty::Named(index))
    }

    fn home(&self, id: TypeId) -> Home {
        let def = &self.resolve.types[id];
        let name = def.name.clone().unwrap_or_default();
        let TypeOwner::Interface(owner) = def.owner else {
            return Home { package: Default::default(), interface: String::new(), class: false, name };
        };
        let interface = &self.resolve.interfaces[owner];
        let package = interface.package.map(|p| &self.resolve.packages[p].name);
        Home {
            package: package.map(|p| (p.namespace.clone(), p.name.clone())).unwrap_or_default(),
            interface: interface.name.clone().unwrap_or_default(),
            class: owner == self.interface,
            name,
        }
    }

    /// The type under the name of a group: two groups may be one type to WIT.
    fn called(&mut self, index: usize, group: &str) -> usize {
        if self.types[index].name == group {
            return index;
        }
        self.types.push(TypeDef { name: group.to_owned(), ..self.types[index].clone() });
        self.paths.push(group.to_owned());
        self.types.len() - 1
    }

    /// No two types have one name; in most languages `a-1` and `a1` are one.
    fn told_apart(&self) -> Result<(), String> {
        for (i, ty) in self.types.iter().enumerate() {
            if let Some(first) = self.types[..i].iter().position(|t| camel(&t.name) == camel(&ty.name)) {
                let (a, b, name) = (&self.paths[first], &self.paths[i], &ty.name);
                let from = &ty.home.interface;
                return Err(format!(
                    "`{a}` and `{b}` have two types of the name `{name}`; give one of them another in the class, as in `use {from}.{{{name} as other-{name}}};`"
                ));
            }
            let names: Vec<(String, String)> = match &ty.kind {
                Kind::Record(fields) => fields.iter().map(|f| (f.name.clone(), camel(&f.name))).collect(),
                Kind::Flags(labels) | Kind::Enum(labels) => {
                    labels.iter().map(|l| (l.name.clone(), camel(&l.name))).collect()
                }
            };
            if let Some((a, b)) = twice(&names) {
                return Err(format!(
                    "`{a}` and `{b}` of `{}` are one name in most languages; give one of them another",
                    self.paths[i]
                ));
            }
        }
        Ok(())
    }
}

fn empty(path: &str, what: &str) -> String {
    let article = if what.starts_with('e') {
        "an "
    } else if what.starts_with('r') {
        "a "
    } else {
        ""
    };
    format!("`{path}` is {article}{what}, which no component can have; leave it out")
}

fn refused(path: &str, kind: &str) -> String {
    let article = if kind.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!(
        "`{path}` is {article} {kind}; a port is a bool, a number, an enum, flags, a duration, a signal or a record of these"
    )
}

fn text(docs: &wit_parser::Docs) -> String {
    docs.contents.as_deref().unwrap_or_default().trim().to_owned()
}
