//! A component that was loaded and checked, and a class of it that was compiled.

use crate::compile;
use crate::component_path;
use crate::interface::{self, ClassInterface, Interface};
use crate::plain;
use crate::state::State;
use crate::{Class, Engine, Fault, Instance, Limits, LoadError};
use latchwork_image::nearest;
use sha2::{Digest, Sha256};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// How a block is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallPath {
    /// Through wasmtime's component API; any component.
    Component,
    /// Straight into the one core module that the component consists of.
    Plain,
}

/// A component that was read and checked. Cheap to clone.
#[derive(Clone)]
pub struct Component {
    loaded: Arc<Loaded>,
}

/// What all clones of a component share.
pub(crate) struct Loaded {
    engine: Engine,
    name: String,
    hash: String,
    bytes: Vec<u8>,
    imports: Vec<String>,
    classes: Vec<Arc<ClassInterface>>,
    templates: Mutex<Vec<Template>>,
}

impl Component {
    pub(crate) fn load(engine: &Engine, name: &str, hash: String, bytes: &[u8]) -> Result<Self, LoadError> {
        let Interface { imports, classes } = interface::read(bytes)?;
        let loaded = Loaded {
            engine: engine.clone(),
            name: name.into(),
            hash,
            bytes: bytes.into(),
            imports,
            classes: classes.into_iter().map(Arc::new).collect(),
            templates: Mutex::default(),
        };
        Ok(Self { loaded: Arc::new(loaded) })
    }

    pub(crate) fn from_loaded(loaded: Arc<Loaded>) -> Self {
        Self { loaded }
    }

    pub(crate) fn downgrade(&self) -> Weak<Loaded> {
        Arc::downgrade(&self.loaded)
    }

    /// SHA-256 of the bytes of a component, hex.
    pub fn hash_of(bytes: &[u8]) -> String {
        hex(&Sha256::digest(bytes))
    }

    /// Name it was loaded by.
    pub fn name(&self) -> &str {
        &self.loaded.name
    }

    /// SHA-256 of the bytes, hex.
    pub fn hash(&self) -> &str {
        &self.loaded.hash
    }

    /// The component itself.
    pub fn bytes(&self) -> &[u8] {
        &self.loaded.bytes
    }

    /// Size in bytes.
    pub fn size(&self) -> u64 {
        self.loaded.bytes.len() as u64
    }

    /// What it imports, besides interfaces that hold types only.
    pub fn imports(&self) -> &[String] {
        &self.loaded.imports
    }

    /// The device classes it exports, at least one.
    pub fn classes(&self) -> impl Iterator<Item = &Class> {
        self.loaded.classes.iter().map(|c| &*c.class)
    }

    /// One class by its name, with or without version; `None` means the only one.
    pub fn class(&self, name: Option<&str>) -> Result<Arc<Class>, LoadError> {
        let names = || self.classes().map(|c| c.name.clone()).collect::<Vec<_>>();
        let Some(name) = name else {
            return match &self.loaded.classes[..] {
                [one] => Ok(Arc::clone(&one.class)),
                _ => Err(LoadError::SeveralClasses { classes: names() }),
            };
        };
        let exact = self.loaded.classes.iter().find(|c| c.class.name == name);
        let mut unversioned = self.loaded.classes.iter().filter(|c| without_version(&c.class.name) == name);
        match (exact, unversioned.next(), unversioned.next()) {
            (Some(class), ..) | (None, Some(class), None) => Ok(Arc::clone(&class.class)),
            // The same class in two versions.
            (None, Some(_), Some(_)) => Err(LoadError::SeveralClasses { classes: names() }),
            (None, None, _) => {
                let near = nearest(name, self.classes().map(|c| without_version(&c.name)));
                Err(LoadError::UnknownClass { wanted: name.into(), nearest: near.map(Into::into), classes: names() })
            }
        }
    }

    /// Compiles a class of this component, or takes it from the cache.
    pub fn template(&self, class: &Class) -> Result<Template, LoadError> {
        // Held while compiling: whoever wants the same class waits instead of compiling it, too.
        let mut templates = self.loaded.templates.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = templates.iter().find(|t| t.class().name == class.name) {
            return Ok(known.clone());
        }
        let template = Template::compile(&self.loaded, self.class(Some(&class.name))?)?;
        templates.push(template.clone());
        Ok(template)
    }
}

impl Loaded {
    /// Compiles a class for the best call path, or for the one that was demanded.
    fn code(&self, class: &ClassInterface) -> Result<Code, LoadError> {
        let forced = self.engine.options().force_path;
        let why = match forced {
            Some(CallPath::Component) => "the component path was demanded".into(),
            _ => match plain::extract(&self.bytes, class) {
                Ok(extract) => return self.plain(class, &extract).map(|c| Code::Plain(Arc::new(c))),
                Err(why) => why,
            },
        };
        if forced == Some(CallPath::Plain) {
            return Err(LoadError::NotPlain { reason: why });
        }
        let code = compile::component(self.engine.wasmtime(), self.engine.cache(), &self.bytes)
            .and_then(|c| component_path::Code::new(&c, class, &self.imports))
            .map_err(refused)?;
        Ok(Code::Component { code: Arc::new(code), why })
    }

    fn plain(&self, class: &ClassInterface, extract: &plain::Extract<'_>) -> Result<plain::Code, LoadError> {
        compile::module(self.engine.wasmtime(), self.engine.cache(), extract.module)
            .and_then(|m| plain::Code::new(&m, extract, class))
            .map_err(refused)
    }
}

/// What the engine does not take.
fn refused(error: wasmtime::Error) -> LoadError {
    LoadError::Compile { reason: format!("{error:#}") }
}

impl std::fmt::Debug for Component {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Component").field("name", &self.name()).field("hash", &self.hash()).finish_non_exhaustive()
    }
}

/// `latchwork:device/ton@0.1.0` → `latchwork:device/ton`
fn without_version(name: &str) -> &str {
    name.split_once('@').map_or(name, |(name, _)| name)
}

pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// A class of a component, compiled. Cheap to clone.
#[derive(Clone)]
pub struct Template {
    compiled: Arc<Compiled>,
}

/// What all clones of a template share.
struct Compiled {
    engine: wasmtime::Engine,
    class: Arc<ClassInterface>,
    logs: bool,
    fuel: usize,
    code: Code,
}

/// Compiled code of one of the call paths.
enum Code {
    Plain(Arc<plain::Code>),
    Component { code: Arc<component_path::Code>, why: String },
}

impl Template {
    fn compile(loaded: &Loaded, class: Arc<Class>) -> Result<Self, LoadError> {
        let interface = loaded.classes.iter().find(|c| c.class.name == class.name);
        let interface = Arc::clone(interface.unwrap_or(&loaded.classes[0]));
        let code = loaded.code(&interface)?;
        let compiled = Compiled {
            engine: loaded.engine.wasmtime().clone(),
            logs: !loaded.imports.is_empty(),
            fuel: interface::fuel(&interface),
            class: interface,
            code,
        };
        Ok(Self { compiled: Arc::new(compiled) })
    }

    /// The call path its instances take.
    pub fn path(&self) -> CallPath {
        match &self.compiled.code {
            Code::Plain(_) => CallPath::Plain,
            Code::Component { .. } => CallPath::Component,
        }
    }

    /// Why they do not take the plain path.
    pub fn why_not_plain(&self) -> Option<&str> {
        match &self.compiled.code {
            Code::Plain(_) => None,
            Code::Component { why, .. } => Some(why),
        }
    }

    /// The class.
    pub fn class(&self) -> &Arc<Class> {
        &self.compiled.class.class
    }

    /// Makes an instance in a store of its own. It is not configured.
    pub fn instantiate(&self, limits: &Limits) -> Result<Instance, Fault> {
        let compiled = &*self.compiled;
        let mut store = State::store(&compiled.engine, limits, compiled.logs, compiled.fuel);
        let bound = match &compiled.code {
            Code::Plain(code) => plain::Bound::new(code, &mut store).map(Into::into),
            Code::Component { code, .. } => component_path::Bound::new(code, &mut store).map(Into::into),
        };
        match bound {
            Ok(bound) => Ok(Instance::new(store, bound, limits, Arc::clone(&compiled.class))),
            Err(error) => Err(Fault::new(None, &self.class().name, &error, store.data())),
        }
    }
}

impl std::fmt::Debug for Template {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Template")
            .field("class", &self.class().name)
            .field("path", &self.path())
            .finish_non_exhaustive()
    }
}
