//! Finds a device class: in the packages of Latchwork, or in a folder of the author's.

use crate::args::Args;
use crate::names::{nearest, suggestion};
use std::path::{Path, PathBuf};
use syn::Error;
use wit_parser::{InterfaceId, PackageId, Resolve, SourceMap, WorldId};

/// A class and everything it needs.
pub(crate) struct Found {
    pub(crate) resolve: Resolve,
    pub(crate) interface: InterfaceId,
    /// Files that were read, for cargo to watch.
    pub(crate) files: Vec<PathBuf>,
}

/// Parses the packages and looks the class up.
pub(crate) fn find(args: &Args) -> syn::Result<Found> {
    let (resolve, files) = match &args.wit {
        None => (embedded(latchwork_wit::PACKAGES)?, Vec::new()),
        Some(folder) => from_folder(&folder.value()).map_err(|m| Error::new(folder.span(), m))?,
    };
    let interface = look_up(args, &resolve).map_err(|m| Error::new(args.class.span(), m))?;
    Ok(Found { resolve, interface, files })
}

/// The packages that come with the SDK.
pub(crate) fn embedded(packages: &[latchwork_wit::Package]) -> syn::Result<Resolve> {
    let mut resolve = Resolve::default();
    for package in packages {
        let mut map = SourceMap::default();
        for (path, text) in package.files {
            map.push_str(path, *text);
        }
        let broken = |e: String| Error::new(proc_macro2::Span::call_site(), format!("{}: {e}", package.name));
        let group = map.parse().map_err(|(map, e)| broken(e.render(&map)))?;
        resolve.push_group(group).map_err(|e| broken(e.to_string()))?;
    }
    Ok(resolve)
}

/// The author's folder. Packages of Latchwork are supplied unless the folder has its own copy in `deps`.
fn from_folder(folder: &str) -> Result<(Resolve, Vec<PathBuf>), String> {
    let root = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
    let path = root.join(folder);
    if !path.is_dir() {
        return Err(format!(
            "no WIT folder `{folder}` beside Cargo.toml; `wit = …` names the folder that holds the package's .wit files"
        ));
    }
    let shown = |text: String| {
        let text = text.replace(&format!("{}/", root.display()), "");
        text.strip_prefix("failed to parse package: ").map(str::to_owned).unwrap_or(text)
    };
    let mut alone = Resolve::default();
    let first = match alone.push_dir(&path) {
        Ok((_, sources)) => return Ok((alone, sources.paths().map(Path::to_path_buf).collect())),
        Err(e) => alone.render_error(&e),
    };
    let mut supplied = embedded(latchwork_wit::PACKAGES).map_err(|e| e.to_string())?;
    match supplied.push_dir(&path) {
        Ok((_, sources)) => {
            let own = sources.paths().filter(|p| p.is_absolute());
            let files = own.map(Path::to_path_buf).collect();
            Ok((supplied, files))
        }
        // Twice the same package: the folder brings its own, so the first message is the right one.
        Err(e) if format!("{e:?}").contains("DuplicatePackage") => Err(shown(first)),
        Err(e) => Err(shown(supplied.render_error(&e))),
    }
}

fn look_up(args: &Args, resolve: &Resolve) -> Result<InterfaceId, String> {
    let short = |id: PackageId| {
        let name = &resolve.packages[id].name;
        format!("{}:{}", name.namespace, name.name)
    };
    let mut of_name: Vec<PackageId> =
        resolve.packages.iter().map(|(id, _)| id).filter(|id| short(*id) == args.package).collect();
    if of_name.is_empty() {
        let known: Vec<String> = resolve.packages.iter().map(|(id, _)| short(id)).collect();
        let way_out = match (nearest(&args.package, known.iter().map(String::as_str)), &args.wit) {
            (Some(meant), _) => format!("; did you mean `{meant}`?"),
            (None, None) => "; a package of your own needs its folder: #[block(\"…\", wit = \"wit\")]".to_owned(),
            (None, Some(folder)) => {
                format!("; the folder `{}` and Latchwork have {}", folder.value(), known.join(", "))
            }
        };
        return Err(format!("no package `{}`{way_out}", args.package));
    }
    if let Some(version) = &args.version {
        let have: Vec<String> = of_name.iter().map(|id| resolve.packages[*id].name.to_string()).collect();
        of_name.retain(|id| resolve.packages[*id].name.version.as_ref().is_some_and(|v| v.to_string() == *version));
        if of_name.is_empty() {
            return Err(format!("no version {version} of `{}`; found {}", args.package, have.join(", ")));
        }
    }
    let [package] = of_name[..] else {
        let have: Vec<String> = of_name.iter().map(|id| resolve.packages[*id].name.to_string()).collect();
        return Err(format!("several versions of `{}`: {}; add the one you mean", args.package, have.join(", ")));
    };
    let interfaces = &resolve.packages[package].interfaces;
    interfaces.get(&args.interface).copied().ok_or_else(|| {
        let names: Vec<&str> = interfaces.keys().map(String::as_str).collect();
        format!(
            "no device class `{}` in `{}`{} (it has: {})",
            args.interface,
            resolve.packages[package].name,
            suggestion(&args.interface, names.iter().copied()),
            names.join(", ")
        )
    })
}

/// Adds the world that exports the class, and nothing else.
pub(crate) fn export_world(resolve: &mut Resolve, interface: InterfaceId) -> anyhow::Result<WorldId> {
    let id = resolve.id_of(interface).unwrap_or_default();
    let class = resolve.interfaces[interface].name.clone().unwrap_or_default();
    push_world(resolve, &class, &format!("export {id};"))
}

/// Adds a world of the given items to `resolve`.
pub(crate) fn push_world(resolve: &mut Resolve, name: &str, items: &str) -> anyhow::Result<WorldId> {
    // Only a name that no author's package has: the world vanishes when the component is made.
    let text = format!("package latchwork:sdk-{name}; world %{name} {{ {items} }}");
    let package = resolve.push_source("world.wit", &text)?;
    resolve.select_world(&[package], Some(name))
}
