//! Every guest, called many times with any values of its types, keeps to what is promised: no trap, no import but the
//! log, no more than two pages of memory however long it runs. Needs `cargo xtask guests`.

use std::path::{Path, PathBuf};
use wasmtime::component::{Component, Func, Instance, Linker, Type, Val};
use wasmtime::{Config, Engine, ResourceLimiter, Store, bail};

/// The promise: two pages of 64 KiB.
const MEMORY: usize = 128 * 1024;
const CALLS: u32 = 3_000;

/// Counts what the guest asks for.
#[derive(Default)]
struct Host {
    memory: usize,
    lines: usize,
}

impl ResourceLimiter for Host {
    fn memory_growing(&mut self, _: usize, desired: usize, _: Option<usize>) -> wasmtime::Result<bool> {
        self.memory = self.memory.max(desired);
        Ok(desired <= MEMORY)
    }

    fn table_growing(&mut self, _: usize, _: usize, _: Option<usize>) -> wasmtime::Result<bool> {
        Ok(true)
    }
}

/// Values without end, the same in each run (SplitMix64), with the awkward ones among them.
struct Values(u64);

impl Values {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Small, extreme or anything.
    fn integer(&mut self) -> u64 {
        let bits = self.bits();
        match bits % 4 {
            0 => 0,
            1 => u64::MAX,
            2 => (bits >> 8) % 1000,
            _ => self.bits(),
        }
    }

    fn real(&mut self) -> f64 {
        let bits = self.bits();
        match bits % 6 {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => f64::NEG_INFINITY,
            3 => (bits >> 40) as f64 / 100.0 - 50.0,
            4 => -0.0,
            _ => f64::from_bits(self.bits()),
        }
    }

    fn of(&mut self, ty: &Type) -> Val {
        match ty {
            Type::Bool => Val::Bool(self.bits() & 1 == 1),
            Type::S8 => Val::S8(self.integer() as i8),
            Type::U8 => Val::U8(self.integer() as u8),
            Type::S16 => Val::S16(self.integer() as i16),
            Type::U16 => Val::U16(self.integer() as u16),
            Type::S32 => Val::S32(self.integer() as i32),
            Type::U32 => Val::U32(self.integer() as u32),
            Type::S64 => Val::S64(self.integer() as i64),
            Type::U64 => Val::U64(self.integer()),
            Type::Float32 => Val::Float32(self.real() as f32),
            Type::Float64 => Val::Float64(self.real()),
            Type::Record(r) => Val::Record(r.fields().map(|f| (f.name.to_owned(), self.of(&f.ty))).collect()),
            Type::Enum(e) => {
                let names: Vec<&str> = e.names().collect();
                Val::Enum(names[self.bits() as usize % names.len()].to_owned())
            }
            Type::Flags(f) => Val::Flags(f.names().filter(|_| self.bits() & 3 == 0).map(str::to_owned).collect()),
            other => panic!("a guest with a port of type {other:?}"),
        }
    }
}

fn guests(folder: &str) -> Vec<PathBuf> {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder");
    let folder = target.join(folder);
    let entries = std::fs::read_dir(&folder);
    let entries = entries.unwrap_or_else(|e| panic!("{}: {e}; run `cargo xtask guests` first", folder.display()));
    let mut guests: Vec<PathBuf> = entries.map(|e| e.expect("a readable folder").path()).collect();
    guests.retain(|p| p.extension().is_some_and(|e| e == "wasm"));
    // Loggers want files and have tests of their own.
    let sink = b"latchwork:journal/sink@";
    guests.retain(|p| !std::fs::read(p).expect("a component").windows(sink.len()).any(|bytes| bytes == sink));
    guests.sort();
    assert!(!guests.is_empty(), "no guests in {}; run `cargo xtask guests` first", folder.display());
    guests
}

fn name(path: &Path) -> &str {
    path.file_stem().and_then(|n| n.to_str()).expect("a name")
}

fn start(engine: &Engine, path: &Path) -> wasmtime::Result<(Store<Host>, Component, Instance)> {
    let component = Component::from_file(engine, path)?;
    let mut store = Store::new(engine, Host::default());
    store.limiter(|host| host);
    let mut linker = Linker::<Host>::new(engine);
    linker.instance("latchwork:block/log@0.1.0")?.func_new("write", |mut store, _, parameters, _| {
        let [Val::Enum(_), Val::String(text)] = parameters else { bail!("the log is called with {parameters:?}") };
        assert!(!text.is_empty());
        store.data_mut().lines += 1;
        Ok(())
    })?;
    let instance = linker.instantiate(&mut store, &component)?;
    Ok((store, component, instance))
}

/// The device classes of a component: exported instances with an `execute`.
fn classes(store: &mut Store<Host>, component: &Component, instance: &Instance) -> Vec<String> {
    let engine = component.engine();
    let names: Vec<String> = component.component_type().exports(engine).map(|(n, _)| n.to_owned()).collect();
    names.into_iter().filter(|n| function(store, instance, n, "execute").is_some()).collect()
}

fn function(store: &mut Store<Host>, instance: &Instance, class: &str, name: &str) -> Option<Func> {
    let class = instance.get_export_index(&mut *store, None, class)?;
    let function = instance.get_export_index(&mut *store, Some(&class), name)?;
    instance.get_func(&mut *store, function)
}

fn call(store: &mut Store<Host>, function: &Func, parameters: &[Val]) -> wasmtime::Result<Option<Val>> {
    let mut results = vec![Val::Bool(false); function.ty(&*store).results().len()];
    function.call(&mut *store, parameters, &mut results)?;
    Ok(results.pop())
}

fn run(engine: &Engine, path: &Path) -> wasmtime::Result<Host> {
    let (mut store, component, instance) = start(engine, path)?;
    let classes = classes(&mut store, &component, &instance);
    assert!(!classes.is_empty(), "{} exports no class", path.display());
    for class in classes {
        let mut get = |name| function(&mut store, &instance, &class, name);
        let execute = get("execute").expect("just found");
        let (defaults, configure, save, restore) = (get("defaults"), get("configure"), get("save"), get("restore"));
        let settings = match &defaults {
            Some(f) => call(&mut store, f, &[])?,
            None => None,
        };
        let mut values = Values(7);
        for n in 0..CALLS {
            if let Some(configure) = &configure {
                // The defaults, then anything: what is refused must leave the block as it was.
                let ty = configure.ty(&store).params().next().expect("settings").1;
                let settings = settings.clone().filter(|_| n % 64 == 0).unwrap_or_else(|| values.of(&ty));
                match call(&mut store, configure, &[settings])? {
                    Some(Val::Result(Err(Some(text)))) => assert!(matches!(*text, Val::String(t) if !t.is_empty())),
                    Some(Val::Result(_)) => {}
                    other => panic!("{class}: configure returned {other:?}"),
                }
            }
            let parameters: Vec<Val> = execute.ty(&store).params().map(|(_, ty)| values.of(&ty)).collect();
            call(&mut store, &execute, &parameters)?;
            if let (Some(save), Some(restore)) = (&save, &restore) {
                let saved = call(&mut store, save, &[])?.expect("a state");
                // Its own state, and anything of the type: a state may come from another version.
                let ty = restore.ty(&store).params().next().expect("a state").1;
                let state = if n % 8 == 0 { values.of(&ty) } else { saved };
                call(&mut store, restore, &[state])?;
            }
        }
    }
    Ok(std::mem::take(store.data_mut()))
}

fn every_guest(folder: &str) {
    let engine = Engine::new(&Config::new()).expect("an engine");
    // `stress` and `defects` are made to break these promises, `interlock-probe` and `keeper-probe` to trap when told to.
    let meant = ["stress", "defects", "interlock-probe", "keeper-probe"];
    for guest in guests(folder).iter().filter(|g| !meant.contains(&name(g))) {
        let host = run(&engine, guest).unwrap_or_else(|e| panic!("{}: {e:#}", guest.display()));
        assert!(host.memory <= MEMORY, "{} asks for {} bytes", guest.display(), host.memory);
        assert_eq!(host.lines > 0, name(guest) == "chatty", "{} wrote {} lines", guest.display(), host.lines);
    }
}

#[test]
fn shipped_blocks_never_trap_and_never_take_more_than_two_pages() {
    every_guest("components");
}

#[test]
fn guests_of_tests_never_trap_and_never_take_more_than_two_pages() {
    every_guest("test-components");
}

#[test]
fn every_block_of_the_sdk_carries_the_documentation_of_its_ports() {
    let guests = [guests("components"), guests("test-components")].concat();
    // `stress` writes its exports by hand, without #[block].
    for guest in guests.iter().filter(|g| name(g) != "stress") {
        let bytes = std::fs::read(guest).expect("a file");
        // The section is the last: its JSON ends the file.
        let start = bytes.windows(14).rposition(|w| w == b"latchwork-docs").expect("the section") + 14;
        let docs: serde_json::Value = serde_json::from_slice(&bytes[start..]).expect("JSON");
        for (class, docs) in docs.as_object().expect("an object by class") {
            assert!(docs["class"].as_str().is_some_and(|d| !d.is_empty()), "{class}");
            let ports = docs["ports"].as_object().expect("ports");
            assert!(ports.keys().any(|k| k.starts_with("inputs.") || k.starts_with("outputs.")), "{class}");
            for (port, text) in ports {
                assert!(text.as_str().is_some_and(|t| !t.is_empty()), "{class}: {port} is not documented");
            }
        }
    }
}
