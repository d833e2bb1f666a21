//! The pattern of a device class, checked against one exported interface.

use super::docs::ClassDocs;
use super::signature::scan;
use super::{Shape, types};
use crate::{Class, LoadError};
use latchwork_image::Type;
use std::sync::Arc;
use wasmparser::component_types::{
    ComponentDefinedType, ComponentEntityType, ComponentFuncType, ComponentInstanceTypeId, ComponentItem,
    ComponentValType,
};
use wasmparser::types::TypesRef;

/// What `execute` may look like.
const EXECUTE: &str = "expected func(scan: scan, inputs: inputs, commands: commands) -> tuple<outputs, alarms>, without the \
                       parts that the class does not have";

/// A device class with the shapes that both call paths work by.
#[derive(Debug)]
pub(crate) struct ClassInterface {
    /// The class as others see it.
    pub(crate) class: Arc<Class>,
    /// Record of the inputs.
    pub(crate) inputs: Option<Shape>,
    /// Flags of the commands.
    pub(crate) commands: Option<Shape>,
    /// Record of the outputs.
    pub(crate) outputs: Option<Shape>,
    /// Flags of the alarms.
    pub(crate) alarms: Option<Shape>,
    /// Record of the settings; with it there is `configure`.
    pub(crate) settings: Option<Shape>,
    /// There is `defaults`.
    pub(crate) defaults: bool,
    /// Record of the retained state; with it there are `save` and `restore`.
    pub(crate) retained: Option<Shape>,
}

/// Reads one exported interface that has a function `execute`.
pub(super) fn read(
    types: TypesRef<'_>,
    name: &str,
    id: ComponentInstanceTypeId,
    docs: ClassDocs,
) -> Result<ClassInterface, LoadError> {
    let mut reader = Reader { types, id, problems: Vec::new() };
    let execute = reader.execute();
    let settings = reader.settings();
    let retained = reader.retained();
    let defaults = reader.defaults(settings.as_ref());
    if !reader.problems.is_empty() {
        return Err(LoadError::Class { class: name.into(), problems: reader.problems });
    }
    let Execute { inputs, commands, outputs, alarms } = execute;
    let ports = |shape: &Option<Shape>, group, signals| {
        shape.as_ref().map(|s| s.ports(group, signals, &docs.ports)).unwrap_or_default()
    };
    let class = Class {
        name: name.into(),
        inputs: ports(&inputs, "inputs", true),
        outputs: ports(&outputs, "outputs", true),
        settings: ports(&settings, "settings", false),
        retained: ports(&retained, "retained", false),
        commands: flag_names(&commands),
        alarms: flag_names(&alarms),
        doc: docs.class,
        flag_docs: docs.ports,
    };
    Ok(ClassInterface { class: Arc::new(class), inputs, commands, outputs, alarms, settings, defaults, retained })
}

#[derive(Default)]
struct Execute {
    inputs: Option<Shape>,
    commands: Option<Shape>,
    outputs: Option<Shape>,
    alarms: Option<Shape>,
}

struct Reader<'a> {
    types: TypesRef<'a>,
    id: ComponentInstanceTypeId,
    problems: Vec<String>,
}

impl<'a> Reader<'a> {
    fn export(&self, name: &str) -> Option<ComponentEntityType> {
        self.types.get(self.id)?.exports.get(name).map(|e| e.ty)
    }

    /// A function of the interface; an asynchronous one is a problem.
    fn function(&mut self, name: &str) -> Option<&'a ComponentFuncType> {
        let Some(ComponentEntityType::Func(id)) = self.export(name) else { return None };
        let function = self.types.get(id)?;
        if function.async_ {
            self.problems.push(format!("{name} is an async func; expected a plain func"));
        }
        Some(function)
    }

    fn has_type(&self, name: &str) -> bool {
        matches!(self.export(name), Some(ComponentEntityType::Type { .. }))
    }

    fn problem(&mut self, text: String) {
        self.problems.push(text);
    }

    /// A record of ports.
    fn record(&mut self, ty: ComponentValType, group: &str) -> Option<Shape> {
        if !is_record(self.types, ty) {
            let found = types::name(self.types, ty);
            self.problem(format!("{group} has the type {found}; expected a record whose fields are the ports"));
            return None;
        }
        types::shape(self.types, ty, group, &mut self.problems)
    }

    fn flags(&mut self, ty: ComponentValType, group: &str) -> Option<Shape> {
        if !is_flags(self.types, ty) {
            let found = types::name(self.types, ty);
            self.problem(format!("{group} has the type {found}; expected flags"));
            return None;
        }
        types::shape(self.types, ty, group, &mut self.problems)
    }

    fn execute(&mut self) -> Execute {
        let mut result = Execute::default();
        let Some(function) = self.function("execute") else { return result };
        let mut params = function.params.iter().peekable();
        match params.next_if(|(name, _)| name.as_str() == "scan") {
            Some((_, ty)) => {
                if !is_scan(self.types, *ty) {
                    self.problem(
                        "the parameter scan of execute is not latchwork:block/types.scan; expected record { now: u64, elapsed: \
                         u64, first: bool }"
                            .into(),
                    );
                }
            }
            None => self.problem(format!(
                "execute has the signature {}, which does not begin with scan; {EXECUTE}",
                self.signature(function)
            )),
        }
        if let Some((_, ty)) = params.next_if(|(name, _)| name.as_str() == "inputs") {
            result.inputs = self.record(*ty, "inputs");
        }
        if let Some((_, ty)) = params.next_if(|(name, _)| name.as_str() == "commands") {
            result.commands = self.flags(*ty, "commands");
        }
        // Without scan the next parameter has been complained about already.
        if params.peek().is_some() && self.problems.is_empty() {
            self.problem(format!("execute has the signature {}; {EXECUTE}", self.signature(function)));
        }
        if let Some(ty) = function.result {
            match self.defined(ty) {
                Some(ComponentDefinedType::Tuple(tuple)) if tuple.types.len() == 2 => {
                    result.outputs = self.record(tuple.types[0], "outputs");
                    result.alarms = self.flags(tuple.types[1], "alarms");
                }
                Some(ComponentDefinedType::Flags(_)) => result.alarms = self.flags(ty, "alarms"),
                Some(ComponentDefinedType::Record(_)) => result.outputs = self.record(ty, "outputs"),
                _ => {
                    let found = types::name(self.types, ty);
                    self.problem(format!(
                        "execute returns {found}; expected tuple<outputs, alarms>, outputs or alarms"
                    ));
                }
            }
        }
        for (group, taken) in [
            ("inputs", result.inputs.is_some()),
            ("commands", result.commands.is_some()),
            ("outputs", result.outputs.is_some()),
            ("alarms", result.alarms.is_some()),
        ] {
            if self.has_type(group) && !taken && self.problems.is_empty() {
                self.problem(format!(
                    "there is a type {group}, but execute has the signature {}; {EXECUTE}",
                    self.signature(function)
                ));
            }
        }
        result
    }

    fn settings(&mut self) -> Option<Shape> {
        const EXPECTED: &str = "expected configure: func(settings: settings) -> result<_, string>";
        let Some(function) = self.function("configure") else {
            if self.has_type("settings") {
                self.problem(format!("there is a type settings but no function configure; {EXPECTED}"));
            }
            return None;
        };
        let [(name, ty)] = &*function.params else {
            self.problem(format!("configure has the signature {}; {EXPECTED}", self.signature(function)));
            return None;
        };
        if name.as_str() != "settings" || !function.result.is_some_and(|r| self.is_refusal(r)) {
            self.problem(format!("configure has the signature {}; {EXPECTED}", self.signature(function)));
            return None;
        }
        self.record(*ty, "settings")
    }

    fn retained(&mut self) -> Option<Shape> {
        const EXPECTED: &str = "expected save: func() -> retained and restore: func(state: retained)";
        let (save, restore) = (self.function("save"), self.function("restore"));
        let (save, restore) = match (save, restore) {
            (None, None) => {
                if self.has_type("retained") {
                    self.problem(format!("there is a type retained but neither save nor restore; {EXPECTED}"));
                }
                return None;
            }
            (Some(_), None) => {
                self.problem(format!("there is save but no restore; {EXPECTED}"));
                return None;
            }
            (None, Some(_)) => {
                self.problem(format!("there is restore but no save; {EXPECTED}"));
                return None;
            }
            (Some(s), Some(r)) => (s, r),
        };
        let (Some(state), [], None, [(_, param)]) = (save.result, &*save.params, restore.result, &*restore.params)
        else {
            let (s, r) = (self.signature(save), self.signature(restore));
            self.problem(format!("save has the signature {s}, restore {r}; {EXPECTED}"));
            return None;
        };
        let before = self.problems.len();
        let saved = self.record(state, "retained");
        if self.problems.len() > before {
            return None;
        }
        let restored = self.record(*param, "retained");
        if saved != restored && self.problems.len() == before {
            self.problem(format!("save and restore have different types; {EXPECTED}"));
        }
        saved
    }

    fn defaults(&mut self, settings: Option<&Shape>) -> bool {
        let Some(function) = self.function("defaults") else { return false };
        let shape = match (&*function.params, function.result) {
            ([], Some(ty)) if is_record(self.types, ty) => types::shape(self.types, ty, "settings", &mut Vec::new()),
            _ => None,
        };
        if settings.is_some() && shape.as_ref() == settings {
            return true;
        }
        if self.problems.is_empty() {
            self.problem(format!(
                "defaults has the signature {}; expected func() -> settings, with the type that configure takes",
                self.signature(function)
            ));
        }
        false
    }

    fn defined(&self, ty: ComponentValType) -> Option<&'a ComponentDefinedType> {
        match ty {
            ComponentValType::Type(id) => self.types.get(id),
            ComponentValType::Primitive(_) => None,
        }
    }

    /// `result<_, string>`
    fn is_refusal(&self, ty: ComponentValType) -> bool {
        match self.defined(ty) {
            Some(ComponentDefinedType::Result { ok: None, err: Some(err), .. }) => {
                types::name(self.types, *err) == "string"
            }
            _ => false,
        }
    }

    fn signature(&self, f: &ComponentFuncType) -> String {
        let params: Vec<_> = f.params.iter().map(|(n, ty)| format!("{n}: {}", types::name(self.types, *ty))).collect();
        let result = f.result.map(|r| format!(" -> {}", types::name(self.types, r))).unwrap_or_default();
        format!("func({}){result}", params.join(", "))
    }
}

fn is_record(types: TypesRef<'_>, ty: ComponentValType) -> bool {
    matches!(ty, ComponentValType::Type(id) if matches!(types[id], ComponentDefinedType::Record(_)))
}

fn is_flags(types: TypesRef<'_>, ty: ComponentValType) -> bool {
    matches!(ty, ComponentValType::Type(id) if matches!(types[id], ComponentDefinedType::Flags(_)))
}

fn is_scan(types: TypesRef<'_>, ty: ComponentValType) -> bool {
    types::shape(types, ty, "scan", &mut Vec::new()) == Some(scan())
}

fn flag_names(flags: &Option<Shape>) -> Vec<String> {
    match flags {
        Some(Shape::Leaf(Type::Flags(names))) => names.to_vec(),
        _ => Vec::new(),
    }
}

/// Checks that an imported log is the one this runtime offers.
pub(super) fn check_log(types: TypesRef<'_>, name: &str, item: &ComponentItem) -> Result<(), LoadError> {
    let wrong = || {
        LoadError::Import {
        imports: vec![name.into()],
        way_out: "It is imported with another signature than write: func(level: level, message: string) and the levels debug, \
                  info, warning, error: build the block against the shipped wit/block"
            .into(),
    }
    };
    let ComponentEntityType::Instance(id) = item.ty else { return Err(wrong()) };
    let functions = types[id].exports.iter().filter_map(|(n, e)| match e.ty {
        ComponentEntityType::Func(f) => Some((n.as_str(), &types[f])),
        _ => None,
    });
    for (name, f) in functions {
        let [(_, level), (_, message)] = &*f.params else { return Err(wrong()) };
        let level = types::shape(types, *level, "level", &mut Vec::new());
        let levels = matches!(&level, Some(Shape::Leaf(Type::Enum(cases)))
            if cases.iter().eq(["debug", "info", "warning", "error"].iter()));
        let message = types::name(types, *message) == "string";
        if name != "write" || f.async_ || f.result.is_some() || !levels || !message {
            return Err(wrong());
        }
    }
    Ok(())
}
