//! The shape of the tree: modules take from siblings and from other trees, never from those that hold them, and files stay
//! short.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The crates' sources.
const TREES: [&str; 2] = ["src", "api/src"];

/// Files that still take items of the modules that hold them. Names may be taken off this list, never put on it.
const NOT_YET: [&str; 0] = [];

/// Most lines of a file.
const MOST_LINES: usize = 450;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every file below a folder with one of the extensions, as a path from the root.
fn files(folder: &str, extensions: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(root().join(folder)).unwrap() {
        let entry = entry.unwrap();
        let path = format!("{folder}/{}", entry.file_name().into_string().unwrap());
        if entry.file_type().unwrap().is_dir() {
            found.extend(files(&path, extensions));
        } else if extensions.iter().any(|wanted| Path::new(&path).extension().is_some_and(|found| found == *wanted)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap()
}

/// A module by the names that lead to it from the crate's root.
type Module = Vec<String>;

/// The modules of a library with their files; the root's path is empty.
fn modules(tree: &str) -> BTreeMap<Module, String> {
    let module = |path: String| {
        let inside = path[tree.len() + 1..].trim_end_matches(".rs");
        // A program of one file is a crate of its own, which nothing holds.
        (inside != "main").then(|| (if inside == "lib" { Module::new() } else { names(inside, "/") }, path.clone()))
    };
    files(tree, &["rs"]).into_iter().filter_map(module).collect()
}

fn names(path: &str, between: &str) -> Vec<String> {
    path.split(between).map(|name| name.trim().to_owned()).filter(|name| !name.is_empty()).collect()
}

/// A source without comments and without what is compiled for tests alone, and the modules in files that are.
fn without_tests(source: &str) -> (String, Vec<String>) {
    let lines: Vec<&str> = source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let (mut kept, mut tests) = (String::new(), Vec::new());
    let mut lines = lines.into_iter();
    while let Some(line) = lines.next() {
        if line != "#[cfg(test)]" {
            kept.push_str(line);
            kept.push('\n');
            continue;
        }
        let Some(item) = lines.by_ref().find(|line| !line.starts_with("#[")) else { break };
        if let Some(name) = item.strip_prefix("mod ").and_then(|rest| rest.strip_suffix(';')) {
            tests.push(name.to_owned());
        } else if !item.ends_with([';', '}']) {
            // Formatted sources close an item of the file in the first column.
            lines.by_ref().find(|line| line.starts_with('}'));
        }
    }
    (kept, tests)
}

/// The end of a name.
fn ends(character: char) -> bool {
    !character.is_alphanumeric() && character != '_'
}

/// All paths that `text` begins with: one, or those of a use in braces.
fn paths(text: &str, before: &str) -> Vec<String> {
    let text = text.trim_start();
    if let Some(inside) = text.strip_prefix('{') {
        let (mut depth, mut from, mut found) = (0_i32, 0, Vec::new());
        for (at, character) in inside.char_indices() {
            match character {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    if !inside[from..at].trim().is_empty() {
                        found.extend(paths(&inside[from..at], before));
                    }
                    from = at + 1;
                    if character == '}' {
                        break;
                    }
                }
                _ => {}
            }
        }
        return found;
    }
    if text.starts_with('*') {
        return vec![format!("{before}*")];
    }
    let (name, rest) = text.split_at(text.find(ends).unwrap_or(text.len()));
    let path = format!("{before}{name}");
    match rest.strip_prefix("::") {
        Some(rest) if !rest.starts_with('<') => paths(rest, &format!("{path}::")),
        _ => vec![path],
    }
}

/// Every path in a source that starts with `super` or `crate`, wherever it stands. Macros' own `$crate` is none of them: it
/// is read where the macro is used. Nor is the reach of a `pub(in ...)`.
fn climbing_paths(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    for start in ["super::", "crate::"] {
        for (at, _) in source.match_indices(start) {
            let before = &source[..at];
            let begins = before.chars().next_back().is_none_or(|last| ends(last) && last != ':' && last != '$');
            if begins && !before.ends_with("pub(in ") {
                found.extend(paths(&source[at..], ""));
            }
        }
    }
    found
}

/// What a path takes of a module that holds the one it stands in, or that module as a whole; `None` for all other paths.
fn taken_from_above(path: &str, module: &Module, modules: &BTreeMap<Module, String>) -> Option<String> {
    let mut names = names(path, "::").into_iter().peekable();
    let mut place = module.clone();
    while let Some(name) = names.next_if(|name| name == "super" || name == "crate") {
        if name == "crate" {
            place.clear();
        } else {
            place.pop();
        }
    }
    while let Some(name) =
        names.next_if(|name| modules.contains_key(&[&place[..], std::slice::from_ref(name)].concat()))
    {
        place.push(name);
    }
    let above = place.len() < module.len() && module.starts_with(&place);
    above.then(|| names.next().unwrap_or_else(|| "self".to_owned()))
}

/// What every file of the trees takes of the modules that hold it.
fn climbers() -> BTreeMap<String, BTreeSet<String>> {
    let mut climbers = BTreeMap::<String, BTreeSet<String>>::new();
    for tree in TREES {
        let modules = modules(tree);
        let sources: BTreeMap<&Module, _> =
            modules.iter().map(|(module, path)| (module, without_tests(&read(path)))).collect();
        for (module, path) in &modules {
            let Some((name, parent)) = module.split_last() else { continue };
            if sources.get(&parent.to_vec()).is_some_and(|(_, tests)| tests.contains(name)) {
                continue;
            }
            let paths = climbing_paths(&sources[module].0);
            let taken: BTreeSet<_> = paths.iter().filter_map(|path| taken_from_above(path, module, &modules)).collect();
            if !taken.is_empty() {
                climbers.insert(path.clone(), taken);
            }
        }
    }
    climbers
}

#[test]
fn no_module_takes_an_item_of_a_module_that_holds_it() {
    let climbers = climbers();
    let new: Vec<_> = climbers
        .iter()
        .filter(|(path, _)| !NOT_YET.contains(&path.as_str()))
        .flat_map(|(path, taken)| taken.iter().map(move |item| format!("{path}: {item}")))
        .collect();
    assert!(new.is_empty(), "move these into files beside the ones that take them:\n{}", new.join("\n"));
    let clean: Vec<_> = NOT_YET.into_iter().filter(|path| !climbers.contains_key(*path)).collect();
    assert!(clean.is_empty(), "take these off the list NOT_YET:\n{}", clean.join("\n"));
}

#[test]
fn files_are_short() {
    let sources = TREES.iter().flat_map(|tree| files(tree, &["rs"])).chain(files("shaders", &["wgsl"]));
    let long: Vec<_> = sources
        .map(|path| (read(&path).lines().count(), path))
        .filter(|(lines, _)| *lines > MOST_LINES)
        .map(|(lines, path)| format!("{path}: {lines} lines"))
        .collect();
    assert!(long.is_empty(), "above {MOST_LINES} lines:\n{}", long.join("\n"));
}

#[test]
fn the_search_finds_what_climbs_and_nothing_else() {
    let modules: BTreeMap<Module, String> =
        ["a", "a/b", "a/c", "a/b/d", "e"].iter().map(|path| (names(path, "/"), String::new())).collect();
    let found = |source: &str| -> Vec<String> {
        let (source, _) = without_tests(source);
        let module = names("a/b", "/");
        climbing_paths(&source).iter().filter_map(|path| taken_from_above(path, &module, &modules)).collect()
    };
    for clean in [
        "use super::c::X;",
        "use super::c;",
        "use super::{c::{X, Y}, c as other};",
        "use crate::a::c::X;\nuse crate::e::{Y, Z};",
        "use crate::a::b::d::X;",
        "pub(in crate::a) struct X;",
        "pub(super) struct X;",
        "// use super::X;",
        "    /// See [`super::X`].",
        "macro_rules! m { () => { $crate::a::X }; }",
        "fn f() { super::c::g::<u8>() }",
        "#[cfg(test)]\nmod tests {\n    use super::*;\n}\n",
        "#[cfg(test)]\n#[allow(clippy::panic)]\nmod tests;\nuse super::c::X;",
    ] {
        assert_eq!(found(clean), Vec::<String>::new(), "{clean}");
    }
    for (source, taken) in [
        ("use super::X;", vec!["X"]),
        ("pub use super::{c, X as Y};", vec!["X"]),
        ("use super::{\n    X,\n    c::{Y, Z},\n    d,\n};", vec!["X", "d"]),
        ("use super::*;", vec!["*"]),
        ("use crate::a::{X, b::d::Y};", vec!["X"]),
        ("use crate::a;", vec!["self"]),
        ("use crate::X;", vec!["X"]),
        ("fn f() -> f64 { 2.0 * super::X }", vec!["X"]),
        ("fn f() { super::g::<u8>() }", vec!["g"]),
        ("#[cfg(test)]\nmod tests;\nuse super::X;", vec!["X"]),
        ("#[cfg(test)]\nmod tests {\n    use super::*;\n}\nuse super::X;", vec!["X"]),
    ] {
        assert_eq!(found(source), taken, "{source}");
    }
}
