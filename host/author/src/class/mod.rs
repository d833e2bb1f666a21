//! A device class as the languages see it: its types in an order in which each stands after those it needs, and its functions.

mod read;

pub(crate) use read::read;

/// The types whose fields are ports, or state.
const PORTS: [&str; 6] = ["settings", "inputs", "commands", "outputs", "alarms", "retained"];

/// A type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ty {
    Bool,
    U8,
    S8,
    U16,
    S16,
    U32,
    S32,
    U64,
    S64,
    F32,
    F64,
    /// Index into [`Class::types`].
    Named(usize),
}

/// A name with its documentation: a flag, a case of an enum.
#[derive(Clone, Debug)]
pub(crate) struct Label {
    pub(crate) name: String,
    pub(crate) doc: String,
}

/// A field of a record.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) ty: Ty,
}

/// What a named type is.
#[derive(Clone, Debug)]
pub(crate) enum Kind {
    Record(Vec<Field>),
    Flags(Vec<Label>),
    Enum(Vec<Label>),
}

/// A named type.
#[derive(Clone, Debug)]
pub(crate) struct TypeDef {
    /// As the class calls it.
    pub(crate) name: String,
    pub(crate) doc: String,
    pub(crate) kind: Kind,
    /// Where it is defined, and as what.
    pub(crate) home: Home,
    /// One of `latchwork:block/types`.
    pub(crate) shared: bool,
}

/// The interface that defines a type: languages whose bindings a tool makes find it there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Home {
    /// `(latchwork, block)`
    pub(crate) package: (String, String),
    /// `types`
    pub(crate) interface: String,
    /// It is the class itself.
    pub(crate) class: bool,
    /// The type's name there.
    pub(crate) name: String,
}

/// A device class.
#[derive(Clone, Debug)]
pub(crate) struct Class {
    /// With version, `latchwork:device/motor@0.1.0`.
    pub(crate) id: String,
    /// `motor`
    pub(crate) name: String,
    /// `(latchwork, device)`
    pub(crate) package: (String, String),
    pub(crate) doc: String,
    pub(crate) types: Vec<TypeDef>,
    pub(crate) scan: usize,
    pub(crate) settings: Option<usize>,
    pub(crate) inputs: Option<usize>,
    pub(crate) commands: Option<usize>,
    pub(crate) outputs: Option<usize>,
    pub(crate) alarms: Option<usize>,
    pub(crate) retained: Option<usize>,
    /// There is a function `defaults`.
    pub(crate) defaults: bool,
}

impl Class {
    /// The fields of a record, none for what is no record.
    pub(crate) fn fields(&self, ty: usize) -> &[Field] {
        match &self.types[ty].kind {
            Kind::Record(fields) => fields,
            _ => &[],
        }
    }

    /// Name and type of each parameter of `execute`.
    pub(crate) fn execute_parameters(&self) -> Vec<(&'static str, usize)> {
        let optional = [("inputs", self.inputs), ("commands", self.commands)];
        let optional = optional.into_iter().filter_map(|(n, t)| t.map(|t| (n, t)));
        std::iter::once(("scan", self.scan)).chain(optional).collect()
    }

    /// Name and type of each part of the result of `execute`.
    pub(crate) fn execute_results(&self) -> Vec<(&'static str, usize)> {
        let parts = [("outputs", self.outputs), ("alarms", self.alarms)];
        parts.into_iter().filter_map(|(n, t)| t.map(|t| (n, t))).collect()
    }
}

/// Ports with their documentation, `inputs.feedback` → text, for the section that `inspect` reads.
pub(crate) fn docs(class: &Class) -> serde_json::Value {
    let groups = [class.settings, class.inputs, class.commands, class.outputs, class.alarms, class.retained];
    let mut ports = serde_json::Map::new();
    for (group, ty) in PORTS.into_iter().zip(groups) {
        if let Some(ty) = ty {
            collect_docs(class, ty, group, &mut ports);
        }
    }
    serde_json::json!({ &class.id: { "class": class.doc, "ports": ports } })
}

fn collect_docs(class: &Class, ty: usize, path: &str, into: &mut serde_json::Map<String, serde_json::Value>) {
    match &class.types[ty].kind {
        Kind::Record(fields) => {
            for field in fields {
                let path = format!("{path}.{}", field.name);
                if let Ty::Named(inner) = field.ty
                    && !class.types[inner].shared
                {
                    collect_docs(class, inner, &path, into);
                }
                into.insert(path, field.doc.clone().into());
            }
        }
        Kind::Flags(flags) if !path.contains('.') => {
            for flag in flags {
                into.insert(format!("{path}.{}", flag.name), flag.doc.clone().into());
            }
        }
        _ => {}
    }
}
