//! Finds a device class, in the packages of Latchwork or in a folder of the author's, and the files that a project of it needs.

use crate::class::{self, Class};
use crate::error::AuthorError;
use crate::lang::File;
use crate::names::suggestion;
use std::path::{Path, PathBuf};
use wit_parser::{InterfaceId, PackageId, Resolve, SourceMap, WorldId, WorldItem};

/// Where the WIT of a project is, below its folder.
pub(crate) const FOLDER: &str = "wit";

/// A class, and the WIT that a project of it needs.
#[derive(Debug)]
pub(crate) struct Found {
    pub(crate) class: Class,
    pub(crate) files: Vec<File>,
}

/// Names of all shipped classes, as in `latchwork:device/motor`.
pub fn shipped_classes() -> Vec<String> {
    let files = latchwork_wit::DEVICE.files.iter();
    let stem = |path: &str| path.rsplit('/').next().and_then(|f| f.strip_suffix(".wit")).map(str::to_owned);
    files.filter_map(|(path, _)| stem(path)).map(|name| format!("latchwork:device/{name}")).collect()
}

/// A shipped class by its name, with or without package and version.
pub(crate) fn shipped(name: &str, log: bool) -> Result<Found, AuthorError> {
    let known = shipped_classes();
    let bare = name.split('@').next().unwrap_or_default();
    let wanted = if bare.contains('/') { bare.to_owned() } else { format!("latchwork:device/{bare}") };
    let resolve = embedded(latchwork_wit::PACKAGES)?;
    let interface = find(&resolve, &wanted).filter(|_| known.contains(&wanted));
    let version_fits = |id: &String| !name.contains('@') || *id == name || format!("latchwork:device/{name}") == *id;
    let interface = interface.filter(|i| resolve.id_of(*i).is_some_and(|id| version_fits(&id)));
    let interface = interface.ok_or_else(|| AuthorError::UnknownClass {
        found: name.into(),
        suggestion: suggestion(&wanted, known.iter().map(String::as_str)),
        known: known.iter().filter_map(|k| k.strip_prefix("latchwork:device/")).collect::<Vec<_>>().join(", "),
    })?;
    let class = class::read(&resolve, interface)?;
    let source = format!("device/{}.wit", class.name);
    let text = latchwork_wit::DEVICE.files.iter().filter(|(path, _)| *path == source);
    let mut files: Vec<File> =
        text.map(|(path, text)| File::new(format!("{FOLDER}/deps/latchwork-{path}"), *text)).collect();
    files.extend(package_files(&latchwork_wit::BLOCK));
    files.push(world(&class, log));
    Ok(Found { class, files })
}

/// The class of an author's folder: the one named, or the only one.
pub(crate) fn own(folder: &Path, name: Option<&str>, log: bool) -> Result<Found, AuthorError> {
    let folder = std::fs::canonicalize(folder).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => AuthorError::NoWit(folder.to_path_buf()),
        _ => AuthorError::File { path: folder.to_path_buf(), source: e },
    })?;
    let (resolve, package, paths) = own_package(&folder)?;
    let classes: Vec<InterfaceId> = resolve.packages[package]
        .interfaces
        .values()
        .copied()
        .filter(|i| resolve.interfaces[*i].functions.contains_key("execute"))
        .collect();
    let id = |i: &InterfaceId| resolve.id_of(*i).unwrap_or_default();
    let named = |i: &&InterfaceId| {
        let id = id(i);
        name.is_none_or(|n| id == n || id.split('@').next() == Some(n) || id.split(['/', '@']).nth(1) == Some(n))
    };
    let chosen: Vec<&InterfaceId> = classes.iter().filter(named).collect();
    let [interface] = chosen[..] else {
        return Err(AuthorError::WhichClass { folder, found: classes.iter().map(id).collect() });
    };
    let class = class::read(&resolve, *interface)?;
    let mut files = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).map_err(AuthorError::file(&path))?;
        let below = path.strip_prefix(&folder).unwrap_or(&path);
        let to = match below.strip_prefix("deps") {
            Ok(rest) => PathBuf::from(FOLDER).join("deps").join(rest),
            Err(_) => PathBuf::from(FOLDER).join("deps").join(&class.package.1).join(below),
        };
        files.push(File::new(to.display().to_string(), text));
    }

    let needed = needed(&resolve, package);
    for shipped in latchwork_wit::PACKAGES {
        let needed = shipped.name == latchwork_wit::BLOCK.name || needed.iter().any(|n| n == shipped.name);
        if needed && !has_package(&files, shipped.name) {
            files.extend(package_files(shipped));
        }
    }
    files.push(world(&class, log));
    Ok(Found { class, files })
}

/// The world and the class of a project: the one that the world exports, or the one named where it exports several.
pub(crate) fn of_project(folder: &Path, class: Option<&str>) -> Result<(Resolve, WorldId, Class), AuthorError> {
    let wit = folder.join(FOLDER);
    let broken = |why: String| AuthorError::Wit { folder: wit.clone(), why: tidy(&why, &wit) };
    if !wit.is_dir() {
        return Err(broken("there is no such folder".into()));
    }
    let mut resolve = Resolve::default();
    let package = match resolve.push_dir(&wit) {
        Ok((package, _)) => package,
        Err(e) => return Err(broken(resolve.render_error(&e))),
    };
    let world = resolve.select_world(&[package], None).map_err(|e| broken(format!("{e:#}")))?;
    let exported = resolve.worlds[world].exports.values().filter_map(|item| match item {
        WorldItem::Interface { id, .. } => Some(*id),
        _ => None,
    });
    let classes: Vec<InterfaceId> =
        exported.filter(|i| resolve.interfaces[*i].functions.contains_key("execute")).collect();
    let id = |i: &InterfaceId| resolve.id_of(*i).unwrap_or_default();
    let all = || classes.iter().map(id).collect::<Vec<_>>().join(", ");
    let interface = match (class, &classes[..]) {
        (None, [one]) => *one,
        (None, []) => {
            return Err(broken("world.wit exports no device class; expected `export PACKAGE/CLASS@VERSION;`".into()));
        }
        (None, _) => {
            return Err(broken(format!(
                "world.wit exports several device classes: {}; name one as `class` in block.toml",
                all()
            )));
        }
        (Some(name), _) => find(&resolve, name).filter(|i| classes.contains(i)).ok_or_else(|| {
            broken(format!("world.wit exports no `{name}`, which block.toml names (it exports {})", all()))
        })?,
    };
    let class = class::read(&resolve, interface)?;
    Ok((resolve, world, class))
}

/// An interface by its id, with or without version.
fn find(resolve: &Resolve, id: &str) -> Option<InterfaceId> {
    let fits = |full: &str| full == id || (!id.contains('@') && full.split('@').next() == Some(id));
    resolve.interfaces.iter().map(|(i, _)| i).find(|i| resolve.id_of(*i).is_some_and(|full| fits(&full)))
}

/// The world. An interpreter imports whatever it could call; elsewhere only what is called is imported.
fn world(class: &Class, log: bool) -> File {
    let import = "import latchwork:block/log@0.1.0;";
    let import = if log { import.to_owned() } else { format!("// For messages: {import}") };
    let text = format!(
        "// What this block is to a plant.\npackage local:block;\n\nworld block {{\n    {import}\n    export {};\n}}\n",
        class.id
    );
    File::new(format!("{FOLDER}/world.wit"), text)
}

fn package_files(package: &latchwork_wit::Package) -> impl Iterator<Item = File> {
    package.files.iter().map(|(path, text)| File::new(format!("{FOLDER}/deps/latchwork-{path}"), *text))
}

fn embedded(packages: &[latchwork_wit::Package]) -> Result<Resolve, AuthorError> {
    let mut resolve = Resolve::default();
    for package in packages {
        let mut map = SourceMap::default();
        for (path, text) in package.files {
            map.push_str(path, *text);
        }
        let broken = |why: String| AuthorError::Wit { folder: package.name.into(), why };
        let group = map.parse().map_err(|(map, e)| broken(e.render(&map)))?;
        resolve.push_group(group).map_err(|e| broken(e.to_string()))?;
    }
    Ok(resolve)
}

/// The author's package; those of Latchwork are supplied unless the folder has its own copy in `deps`.
fn own_package(folder: &Path) -> Result<(Resolve, PackageId, Vec<PathBuf>), AuthorError> {
    let broken = |why: String| AuthorError::Wit { folder: folder.to_path_buf(), why: tidy(&why, folder) };
    if !folder.is_dir() {
        return Err(broken("it is no folder; expected one with the package's .wit files".into()));
    }
    let sources =
        |s: wit_parser::PackageSourceMap| s.paths().filter(|p| p.is_absolute()).map(Path::to_path_buf).collect();
    let mut alone = Resolve::default();
    let first = match alone.push_dir(folder) {
        Ok((package, found)) => return Ok((alone, package, sources(found))),
        Err(e) => alone.render_error(&e),
    };
    let mut supplied = embedded(latchwork_wit::PACKAGES)?;
    match supplied.push_dir(folder) {
        Ok((package, found)) => Ok((supplied, package, sources(found))),
        // Twice the same package: the folder brings its own, so the first message is the right one.
        Err(e) if format!("{e:?}").contains("DuplicatePackage") => Err(broken(first)),
        Err(e) => Err(broken(supplied.render_error(&e))),
    }
}

/// Full names of the packages that one uses, and those that they use.
fn needed(resolve: &Resolve, package: PackageId) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let mut open = vec![package];
    while let Some(package) = open.pop() {
        for used in resolve.package_direct_deps(package) {
            let name = resolve.packages[used].name.to_string();
            if !names.contains(&name) {
                names.push(name);
                open.push(used);
            }
        }
    }
    names
}

fn has_package(files: &[File], name: &str) -> bool {
    let wanted = format!("package {name};");
    files.iter().any(|f| f.text.lines().any(|l| l.trim() == wanted))
}

/// A parser's message without what the error says anyway, and without the folder's own path.
fn tidy(why: &str, folder: &Path) -> String {
    let folder = folder.display().to_string();
    let why = why.replace(&format!("{folder}/"), "");
    let why = why.strip_prefix("failed to parse package: ").unwrap_or(&why);
    why.strip_prefix(&format!("{folder}: ")).unwrap_or(why).to_owned()
}
