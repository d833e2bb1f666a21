//! Finds the one core module a component consists of, and which of its exports are the functions of a class.
//!
//! The way is that of the component's own indices — export → lift → core function → core instance → module — never that of
//! names. Whatever is not understood completely is a reason to take the component path.

use super::adapters::{Helper, helper, shim};
use super::outline::{self, ComponentInst, CoreFunction, CoreInstance, Function, Outline, item};
use crate::interface::{ClassInterface, Function as ClassFunction, Signature, is_log};
use wasmparser::{CanonicalOption, ComponentExternalKind, ExternalKind, Parser, Payload, TypeRef};

/// A function of the class as an export of the core module.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lifted {
    /// The function's export.
    pub(super) export: String,
    /// Memory its values stand in.
    pub(super) memory: Option<String>,
    /// What gives room for arguments that stand in memory.
    pub(super) realloc: Option<String>,
    /// What is called when the host has read the result.
    pub(super) post_return: Option<String>,
}

/// The core module and how to use it.
pub(crate) struct Extract<'a> {
    /// The module.
    pub(crate) module: &'a [u8],
    /// Function to be called once after instantiation.
    pub(super) initialize: Option<String>,
    /// The module's imports, all of them the log.
    pub(super) logs: Vec<(String, String)>,
    /// Memory that the log's messages stand in.
    pub(super) log_memory: Option<String>,
    /// Functions of the class.
    pub(super) functions: [Option<Lifted>; 5],
}

/// Takes a validated component apart; `Err` says why it cannot be done.
pub(crate) fn extract<'a>(bytes: &'a [u8], class: &ClassInterface) -> Result<Extract<'a>, String> {
    let outline = outline::read(bytes)?;
    for nested in &outline.components {
        check_nested(nested)?;
    }
    let mut finder = Finder { outline: &outline, main: None };
    let mut functions = [const { None }; 5];
    for function in ClassFunction::ALL {
        if Signature::of(class, function).is_some() {
            let index = finder.exported(&class.class.name, function.name())?;
            functions[function as usize] = Some(finder.lifted(index)?);
        }
    }
    let main = finder.main.ok_or("it has no core module")?;
    let main = Main::new(&outline, main)?;
    let (logs, log_memory, wired) = main.imports()?;
    let initialize = main.others(&wired)?;
    Ok(Extract { module: main.module, initialize, logs, log_memory, functions })
}

/// The tools wrap every exported interface in a component that only renames its parts. One with code is a composition.
fn check_nested(bytes: &[u8]) -> Result<(), String> {
    let nested = outline::read(bytes)?;
    let code = !nested.modules.is_empty()
        || !nested.components.is_empty()
        || !nested.core_instances.is_empty()
        || !nested.core_functions.is_empty()
        || nested.functions.iter().any(|f| matches!(f, Function::Lift(..)));
    if code { Err("it is composed of several components".into()) } else { Ok(()) }
}

struct Finder<'a, 'o> {
    outline: &'o Outline<'a>,
    main: Option<u32>,
}

impl<'a> Finder<'a, '_> {
    /// Index of a function of an exported interface.
    fn exported(&self, interface: &str, name: &str) -> Result<u32, String> {
        let o = self.outline;
        let export = o.exports.iter().find(|(n, k, _)| *n == interface && *k == ComponentExternalKind::Instance);
        let (.., instance) = export.ok_or("the interface is not exported")?;
        let pick = |items: &[(&str, ComponentExternalKind, u32)]| {
            let found = items.iter().find(|(n, k, _)| *n == name && *k == ComponentExternalKind::Func);
            found.map(|(.., index)| *index).ok_or_else(|| format!("{name} is not where it is expected"))
        };
        match item(&o.instances, *instance)? {
            ComponentInst::Bag(items) => pick(items),
            ComponentInst::Component(component, args) => {
                let nested = outline::read(item(&o.components, *component)?)?;
                let index = pick(&nested.exports)?;
                let Function::Import(import) = item(&nested.functions, index)? else {
                    return Err(format!("{name} is made by a nested component"));
                };
                let arg = args.iter().find(|(n, k, _)| n == import && *k == ComponentExternalKind::Func);
                arg.map(|(.., index)| *index).ok_or_else(|| format!("{name} is not where it is expected"))
            }
            ComponentInst::Import(_) | ComponentInst::Export => {
                Err("the interface comes from another component".into())
            }
        }
    }

    fn lifted(&mut self, function: u32) -> Result<Lifted, String> {
        let o = self.outline;
        let Function::Lift(core, options) = item(&o.functions, function)? else {
            return Err("a function comes from another component".into());
        };
        let CoreFunction::Export((main, export)) = item(&o.core_functions, *core)? else {
            return Err("a function is none of a core module".into());
        };
        if *self.main.get_or_insert(*main) != *main {
            return Err("its functions come from several core modules".into());
        }
        let mut lifted = Lifted { export: (*export).into(), memory: None, realloc: None, post_return: None };
        let of_main = |index: u32| match item(&o.core_functions, index)? {
            CoreFunction::Export((instance, name)) if instance == main => Ok(Some((*name).to_string())),
            _ => Err("it allocates or cleans up by another core module".to_string()),
        };
        for option in options {
            match option {
                CanonicalOption::UTF8 => {}
                CanonicalOption::Memory(memory) => lifted.memory = Some(main_memory(o, *memory, *main)?),
                CanonicalOption::Realloc(index) => lifted.realloc = of_main(*index)?,
                CanonicalOption::PostReturn(index) => lifted.post_return = of_main(*index)?,
                other => return Err(format!("it uses the canonical option {other:?}")),
            }
        }
        Ok(lifted)
    }
}

fn main_memory(outline: &Outline<'_>, memory: u32, main: u32) -> Result<String, String> {
    match item(&outline.core_memories, memory)? {
        (instance, name) if *instance == main => Ok((*name).to_string()),
        _ => Err("its values stand in the memory of another core module".into()),
    }
}

/// The main module's instance.
struct Main<'a, 'o> {
    outline: &'o Outline<'a>,
    index: u32,
    module: &'a [u8],
    args: &'o [(&'a str, u32)],
}

/// Imports of the main module that are the log, the memory of the log, the core instances that wire them.
type Imports = (Vec<(String, String)>, Option<String>, Vec<u32>);

impl<'a, 'o> Main<'a, 'o> {
    fn new(outline: &'o Outline<'a>, index: u32) -> Result<Self, String> {
        let CoreInstance::Module(module, args) = item(&outline.core_instances, index)? else {
            return Err("its functions are taken from several core modules".into());
        };
        Ok(Self { outline, index, module: item(&outline.modules, *module)?, args })
    }

    /// Follows every import of the main module to the log.
    fn imports(&self) -> Result<Imports, String> {
        let (mut logs, mut memory, mut used, mut start) = (Vec::new(), None, Vec::new(), false);
        for payload in Parser::new(0).parse_all(self.module) {
            match payload.map_err(outline::unreadable)? {
                Payload::StartSection { .. } => start = true,
                Payload::ImportSection(section) => {
                    for import in section.into_imports() {
                        let import = import.map_err(outline::unreadable)?;
                        if !matches!(import.ty, TypeRef::Func(_)) {
                            return Err(format!(
                                "its core module imports {} {}, which is no function",
                                import.module, import.name
                            ));
                        }
                        memory = Some(self.follow(import.module, import.name, &mut used)?);
                        logs.push((import.module.to_string(), import.name.to_string()));
                    }
                }
                _ => {}
            }
        }
        if start && !logs.is_empty() {
            return Err(
                "its core module has imports and a start function, which would run before they are there".into()
            );
        }
        Ok((logs, memory, used))
    }

    /// Follows one import: main → shim → fixup → lowered log. Returns the name of the memory of main it works on.
    fn follow(&self, module: &str, name: &str, used: &mut Vec<u32>) -> Result<String, String> {
        let o = self.outline;
        let elsewhere = || format!("its core module imports {module} {name} from something else than the log");
        let bag = |args: &[(&str, u32)], arg: &str| -> Result<&Vec<(&'a str, ExternalKind, u32)>, String> {
            let (_, index) = args.iter().find(|(n, _)| *n == arg).ok_or_else(elsewhere)?;
            match item(&o.core_instances, *index)? {
                CoreInstance::Bag(items) => Ok(items),
                CoreInstance::Module(..) => Err(elsewhere()),
            }
        };
        let in_bag = |items: &[(&str, ExternalKind, u32)], kind, name: &str| {
            items.iter().find(|(n, k, _)| *n == name && *k == kind).map(|(.., index)| *index).ok_or_else(elsewhere)
        };
        let function = in_bag(bag(self.args, module)?, ExternalKind::Func, name)?;
        let CoreFunction::Export((shim_instance, shim_export)) = item(&o.core_functions, function)? else {
            return Err(elsewhere());
        };
        let CoreInstance::Module(shim_module, shim_args) = item(&o.core_instances, *shim_instance)? else {
            return Err(elsewhere());
        };
        let shim = shim(item(&o.modules, *shim_module)?)?.filter(|_| shim_args.is_empty()).ok_or_else(elsewhere)?;
        let slot = *shim.slots.get(shim_export).ok_or_else(elsewhere)?;
        // The fixup of this shim: the one helper that fills its table, after main was made.
        let mut target = None;
        for (index, instance) in o.core_instances.iter().enumerate() {
            let CoreInstance::Module(module, args) = instance else { continue };
            let Some(Helper::Fixup { table, functions }) = helper(item(&o.modules, *module)?)? else { continue };
            let table = in_bag(bag(args, table.0)?, ExternalKind::Table, table.1)?;
            if *item(&o.core_tables, table)? != (*shim_instance, shim.table) {
                continue;
            }
            if target.is_some() || index < self.index as usize {
                return Err(elsewhere());
            }
            let (module, name) = functions.get(slot as usize).ok_or_else(elsewhere)?;
            target = Some((index as u32, in_bag(bag(args, module)?, ExternalKind::Func, name)?));
        }
        let (fixup, lowered) = target.ok_or_else(elsewhere)?;
        used.extend([*shim_instance, fixup]);
        self.log(lowered)?.ok_or_else(elsewhere)
    }

    /// The memory that a lowered log works on; `None` if the function is not the log.
    fn log(&self, lowered: u32) -> Result<Option<String>, String> {
        let o = self.outline;
        let CoreFunction::Lower(function, options) = item(&o.core_functions, lowered)? else { return Ok(None) };
        let Function::Export(instance, "write") = item(&o.functions, *function)? else { return Ok(None) };
        if !matches!(item(&o.instances, *instance)?, ComponentInst::Import(name) if is_log(name)) {
            return Ok(None);
        }
        let mut memory = None;
        for option in options {
            match option {
                // The log hands nothing back that would need room.
                CanonicalOption::UTF8 | CanonicalOption::Realloc(_) => {}
                CanonicalOption::Memory(index) => memory = Some(main_memory(o, *index, self.index)?),
                other => return Err(format!("it uses the canonical option {other:?}")),
            }
        }
        Ok(memory)
    }

    /// Checks every other core instance; returns the function of main that a starter calls.
    fn others(&self, wired: &[u32]) -> Result<Option<String>, String> {
        let o = self.outline;
        let mut initialize = None;
        for (index, instance) in o.core_instances.iter().enumerate() {
            let index = index as u32;
            let CoreInstance::Module(module, args) = instance else { continue };
            if index == self.index || wired.contains(&index) {
                continue;
            }
            let several = || "it consists of several core modules".to_string();
            let Some(Helper::Starter((module, name))) = helper(item(&o.modules, *module)?)? else {
                return Err(several());
            };
            // It must run last: after main and after its imports are wired.
            let late = index > self.index && wired.iter().all(|w| *w < index);
            let (_, bag) = args.iter().find(|(n, _)| *n == module).ok_or_else(several)?;
            let CoreInstance::Bag(items) = item(&o.core_instances, *bag)? else { return Err(several()) };
            let found = items.iter().find(|(n, k, _)| *n == name && *k == ExternalKind::Func).ok_or_else(several)?;
            match item(&o.core_functions, found.2)? {
                CoreFunction::Export((main, export)) if *main == self.index && late && initialize.is_none() => {
                    initialize = Some((*export).to_string());
                }
                _ => return Err(several()),
            }
        }
        Ok(initialize)
    }
}

#[cfg(test)]
#[path = "extract_tests.rs"]
mod tests;
