//! Every package parses, every item is documented, and every class follows the pattern of a device class.

use std::{collections::BTreeSet, path::Path};
use wit_parser::{FunctionKind, Interface, Resolve, SourceMap, TypeDefKind};

fn embedded() -> Resolve {
    let mut resolve = Resolve::default();
    for package in latchwork_wit::PACKAGES {
        let mut map = SourceMap::default();
        for (path, text) in package.files {
            map.push(Path::new(path), *text);
        }
        let group = map.parse().unwrap_or_else(|(map, e)| panic!("{}: {e:?} in {map:?}", package.name));
        let id = resolve.push_group(group).unwrap_or_else(|e| panic!("{}: {e:#}", package.name));
        assert_eq!(resolve.packages[id].name.to_string(), package.name);
    }
    resolve
}

fn classes(resolve: &Resolve) -> impl Iterator<Item = (&str, &Interface)> {
    let device = resolve.packages.iter().find(|(_, p)| p.name.name == "device").expect("the device package").1;
    device.interfaces.iter().map(|(name, id)| (name.as_str(), &resolve.interfaces[*id]))
}

#[test]
fn the_embedded_texts_are_all_files_of_the_folders() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for package in latchwork_wit::PACKAGES {
        let (folder, _) = package.files[0].0.split_once('/').expect("a folder");
        let on_disk: BTreeSet<String> = std::fs::read_dir(root.join(folder))
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .filter(|n| n.ends_with(".wit"))
            .map(|n| format!("{folder}/{n}"))
            .collect();
        let embedded: BTreeSet<String> = package.files.iter().map(|(p, _)| p.to_string()).collect();
        assert_eq!(embedded, on_disk, "list every file of wit/{folder} in wit/src/lib.rs");
    }
}

#[test]
fn the_folders_parse_as_other_languages_tools_read_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for folder in ["block", "device", "journal"] {
        let mut resolve = Resolve::default();
        resolve.push_dir(root.join(folder)).unwrap_or_else(|e| panic!("wit/{folder}: {e:#}"));
    }
}

#[test]
fn every_item_is_documented() {
    let resolve = embedded();
    let mut missing = Vec::new();
    let mut need = |docs: &wit_parser::Docs, what: String| {
        if docs.contents.as_deref().is_none_or(|d| d.trim().is_empty()) {
            missing.push(what);
        }
    };
    for (_, i) in resolve.interfaces.iter() {
        let name = i.name.as_deref().unwrap_or("?");
        need(&i.docs, name.into());
        for f in i.functions.values() {
            // `execute` and its like mean the same in every class; the README of the package explains them.
            need(&f.docs, format!("{name}.{}", f.name));
        }
        for id in i.types.values() {
            let ty = &resolve.types[*id];
            let ty_name = ty.name.as_deref().unwrap_or("?");
            match &ty.kind {
                TypeDefKind::Record(r) => {
                    for f in &r.fields {
                        need(&f.docs, format!("{name}.{ty_name}.{}", f.name));
                    }
                }
                TypeDefKind::Flags(f) => {
                    for f in &f.flags {
                        need(&f.docs, format!("{name}.{ty_name}.{}", f.name));
                    }
                }
                TypeDefKind::Enum(e) => {
                    for c in &e.cases {
                        need(&c.docs, format!("{name}.{ty_name}.{}", c.name));
                    }
                }
                TypeDefKind::Variant(v) => {
                    for c in &v.cases {
                        need(&c.docs, format!("{name}.{ty_name}.{}", c.name));
                    }
                }
                _ => {}
            }
        }
    }
    assert!(missing.is_empty(), "without a doc comment: {missing:#?}");
}

#[test]
fn every_class_follows_the_pattern() {
    let resolve = embedded();
    for (name, class) in classes(&resolve) {
        let has = |ty: &str| class.types.contains_key(ty);
        let params = |f: &str| -> Option<Vec<&str>> {
            let f = class.functions.get(f)?;
            assert_eq!(f.kind, FunctionKind::Freestanding, "{name}");
            Some(f.params.iter().map(|p| p.name.as_str()).collect())
        };
        let mut expected = vec!["scan"];
        expected.extend(["inputs", "commands"].into_iter().filter(|p| has(p)));
        assert_eq!(params("execute"), Some(expected), "{name}");
        assert_eq!(params("configure"), has("settings").then(|| vec!["settings"]), "{name}");
        assert_eq!(params("save"), has("retained").then(Vec::new), "{name}");
        assert_eq!(params("restore"), has("retained").then(|| vec!["state"]), "{name}");
        // `motor` is the contract's own text, which leaves the defaults to the plant file.
        assert_eq!(params("defaults").is_some(), has("settings") && name != "motor", "{name}");
    }
}
