//! A component's index spaces: which function, instance, module and memory each number stands for.
//!
//! The component was validated before, so indices are in range and sections well-formed; what this does not know is
//! still told as a reason, never guessed.

use wasmparser::{
    CanonicalFunction, CanonicalOption, ComponentAlias, ComponentExternalKind, ComponentInstance,
    ComponentOuterAliasKind, ComponentTypeRef, ExternalKind, Instance, Parser, Payload,
};

/// An item of a core instance: which instance, which export.
pub(super) type CoreItem<'a> = (u32, &'a str);

/// A core function.
pub(super) enum CoreFunction<'a> {
    /// Export of a core instance.
    Export(CoreItem<'a>),
    /// `canon lower` of a function.
    Lower(u32, Box<[CanonicalOption]>),
    /// Any other canonical built-in.
    BuiltIn,
}

/// A core instance.
pub(super) enum CoreInstance<'a> {
    /// A module with arguments by name.
    Module(u32, Vec<(&'a str, u32)>),
    /// A bag of items by name, kind and index.
    Bag(Vec<(&'a str, ExternalKind, u32)>),
}

/// A function of the component.
#[derive(Clone)]
pub(super) enum Function<'a> {
    /// Imported by itself.
    Import(&'a str),
    /// Export of an instance.
    Export(u32, &'a str),
    /// `canon lift` of a core function.
    Lift(u32, Box<[CanonicalOption]>),
}

/// An instance of the component.
#[derive(Clone)]
pub(super) enum ComponentInst<'a> {
    /// Imported.
    Import(&'a str),
    /// A nested component with arguments by name.
    Component(u32, Vec<(&'a str, ComponentExternalKind, u32)>),
    /// A bag of items.
    Bag(Vec<(&'a str, ComponentExternalKind, u32)>),
    /// Export of an instance.
    Export,
}

/// All index spaces that matter.
#[derive(Default)]
pub(super) struct Outline<'a> {
    pub(super) modules: Vec<&'a [u8]>,
    pub(super) components: Vec<&'a [u8]>,
    pub(super) core_instances: Vec<CoreInstance<'a>>,
    pub(super) core_functions: Vec<CoreFunction<'a>>,
    pub(super) core_memories: Vec<CoreItem<'a>>,
    pub(super) core_tables: Vec<CoreItem<'a>>,
    pub(super) functions: Vec<Function<'a>>,
    pub(super) instances: Vec<ComponentInst<'a>>,
    pub(super) exports: Vec<(&'a str, ComponentExternalKind, u32)>,
}

/// Reads a component's own level; nested components are kept as bytes.
pub(super) fn read(bytes: &[u8]) -> Result<Outline<'_>, String> {
    let mut outline = Outline::default();
    let mut depth = 0;
    for payload in Parser::new(0).parse_all(bytes) {
        let payload = payload.map_err(unreadable)?;
        match payload {
            Payload::Version { .. } => depth += 1,
            Payload::End(_) => depth -= 1,
            _ if depth != 1 => {}
            payload => outline.add(bytes, payload)?,
        }
    }
    Ok(outline)
}

/// A reason for what cannot happen after validation.
pub(super) fn unreadable(error: wasmparser::BinaryReaderError) -> String {
    format!("its sections cannot be read: {error}")
}

impl<'a> Outline<'a> {
    fn add(&mut self, bytes: &'a [u8], payload: Payload<'a>) -> Result<(), String> {
        let nested = |range| bytes.get::<std::ops::Range<usize>>(range).ok_or("a nested part is cut off");
        match payload {
            Payload::ModuleSection { unchecked_range, .. } => self.modules.push(nested(unchecked_range)?),
            Payload::ComponentSection { unchecked_range, .. } => self.components.push(nested(unchecked_range)?),
            Payload::InstanceSection(section) => {
                for instance in section {
                    self.core_instances.push(match instance.map_err(unreadable)? {
                        Instance::Instantiate { module_index, args } => {
                            CoreInstance::Module(module_index, args.iter().map(|a| (a.name, a.index)).collect())
                        }
                        Instance::FromExports(items) => {
                            CoreInstance::Bag(items.iter().map(|i| (i.name, i.kind, i.index)).collect())
                        }
                    });
                }
            }
            Payload::ComponentInstanceSection(section) => {
                for instance in section {
                    self.instances.push(match instance.map_err(unreadable)? {
                        ComponentInstance::Instantiate { component_index, args } => ComponentInst::Component(
                            component_index,
                            args.iter().map(|a| (a.name, a.kind, a.index)).collect(),
                        ),
                        ComponentInstance::FromExports(items) => {
                            ComponentInst::Bag(items.iter().map(|i| (i.name.name, i.kind, i.index)).collect())
                        }
                    });
                }
            }
            Payload::ComponentAliasSection(section) => {
                for alias in section {
                    self.alias(alias.map_err(unreadable)?)?;
                }
            }
            Payload::ComponentCanonicalSection(section) => {
                for function in section {
                    match function.map_err(unreadable)? {
                        CanonicalFunction::Lift { core_func_index, options, .. } => {
                            self.functions.push(Function::Lift(core_func_index, options));
                        }
                        CanonicalFunction::Lower { func_index, options } => {
                            self.core_functions.push(CoreFunction::Lower(func_index, options));
                        }
                        _ => self.core_functions.push(CoreFunction::BuiltIn),
                    }
                }
            }
            Payload::ComponentImportSection(section) => {
                for import in section {
                    let import = import.map_err(unreadable)?;
                    match import.ty {
                        ComponentTypeRef::Func(_) => self.functions.push(Function::Import(import.name.name)),
                        ComponentTypeRef::Instance(_) => self.instances.push(ComponentInst::Import(import.name.name)),
                        ComponentTypeRef::Type(_) => {}
                        _ => return Err(format!("it imports {}", import.name.name)),
                    }
                }
            }
            Payload::ComponentExportSection(section) => {
                for export in section {
                    let export = export.map_err(unreadable)?;
                    self.export(export.name.name, export.kind, export.index)?;
                }
            }
            Payload::ComponentStartSection { .. } => return Err("it has a start function of its own".into()),
            _ => {}
        }
        Ok(())
    }

    fn alias(&mut self, alias: ComponentAlias<'a>) -> Result<(), String> {
        match alias {
            ComponentAlias::InstanceExport { kind, instance_index, name } => match kind {
                ComponentExternalKind::Func => self.functions.push(Function::Export(instance_index, name)),
                ComponentExternalKind::Instance => self.instances.push(ComponentInst::Export),
                ComponentExternalKind::Type => {}
                _ => return Err(format!("it takes {name} out of an instance")),
            },
            ComponentAlias::CoreInstanceExport { kind, instance_index, name } => match kind {
                ExternalKind::Func => self.core_functions.push(CoreFunction::Export((instance_index, name))),
                ExternalKind::Memory => self.core_memories.push((instance_index, name)),
                ExternalKind::Table => self.core_tables.push((instance_index, name)),
                _ => {}
            },
            ComponentAlias::Outer {
                kind: ComponentOuterAliasKind::Type | ComponentOuterAliasKind::CoreType, ..
            } => {}
            ComponentAlias::Outer { .. } => return Err("it shares modules or components with an outer one".into()),
        }
        Ok(())
    }

    /// An export is also a new entry of its index space.
    fn export(&mut self, name: &'a str, kind: ComponentExternalKind, index: u32) -> Result<(), String> {
        self.exports.push((name, kind, index));
        match kind {
            ComponentExternalKind::Func => self.functions.push(item(&self.functions, index)?.clone()),
            ComponentExternalKind::Instance => self.instances.push(item(&self.instances, index)?.clone()),
            ComponentExternalKind::Type => {}
            _ => return Err(format!("it exports {name}, which is neither function, type nor instance")),
        }
        Ok(())
    }
}

/// An entry of an index space.
pub(super) fn item<T>(space: &[T], index: u32) -> Result<&T, String> {
    space.get(index as usize).ok_or_else(|| format!("index {index} is out of range"))
}
