//! The library's public interface, as `interface.txt` lists it: what is written `pub` in `src` and everybody can reach, without the
//! bridge to C++. A change of it is seen in the list's difference; `HALITE_WRITE=1 cargo test --test interface` writes the list anew.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use quote::ToTokens;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use syn::{Attribute, Fields, ImplItem, Item, Visibility};

/// Tokens as one line, without documentation and bodies.
fn line(tokens: impl ToTokens) -> String {
    tokens.to_token_stream().to_string()
}

fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

/// Whether an item is there in tests only, or with the bridge.
fn is_conditional(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| a.path().is_ident("cfg"))
}

/// `derive` and `non_exhaustive`, which callers notice.
fn noticed(attributes: &[Attribute]) -> String {
    let named = |a: &&Attribute| a.path().is_ident("derive") || a.path().is_ident("non_exhaustive");
    attributes.iter().filter(named).map(|a| line(a) + " ").collect()
}

fn fields(fields: &Fields, all: bool) -> String {
    let shown = fields.iter().filter(|f| all || is_public(&f.vis));
    let one = |f: &syn::Field| match &f.ident {
        Some(name) => format!("{name} : {}", line(&f.ty)),
        None => line(&f.ty),
    };
    let hidden = if all || fields.iter().all(|f| is_public(&f.vis)) { "" } else { ", .." };
    format!("{{ {}{hidden} }}", shown.map(one).collect::<Vec<_>>().join(", "))
}

/// The lines of one item of a module.
fn list(item: &Item, module: &str, lines: &mut Vec<String>) {
    let mut add = |what: String| lines.push(format!("{module}: {what}"));
    match item {
        Item::Const(i) if is_public(&i.vis) => add(format!("const {} : {}", i.ident, line(&i.ty))),
        Item::Static(i) if is_public(&i.vis) => add(format!("static {} : {}", i.ident, line(&i.ty))),
        Item::Fn(i) if is_public(&i.vis) => add(line(&i.sig)),
        Item::Type(i) if is_public(&i.vis) => add(format!("type {}{} = {}", i.ident, line(&i.generics), line(&i.ty))),
        Item::Use(i) if is_public(&i.vis) => add(format!("use {}", line(&i.tree))),
        Item::Struct(i) if is_public(&i.vis) => {
            let (seen, generics) = (noticed(&i.attrs), line(&i.generics));
            add(format!("{seen}struct {}{generics} {}", i.ident, fields(&i.fields, false)));
        }
        Item::Enum(i) if is_public(&i.vis) => {
            add(format!("{}enum {}{}", noticed(&i.attrs), i.ident, line(&i.generics)));
            for variant in &i.variants {
                add(format!("{} :: {} {}", i.ident, variant.ident, fields(&variant.fields, true)));
            }
        }
        Item::Trait(i) if is_public(&i.vis) => {
            add(format!("trait {}{} : {}", i.ident, line(&i.generics), line(&i.supertraits)));
            for member in &i.items {
                if let syn::TraitItem::Fn(f) = member {
                    add(format!("{} :: {}", i.ident, line(&f.sig)));
                }
            }
        }
        Item::Impl(i) => {
            let of = line(&i.self_ty);
            if let Some((_, of_trait, _)) = &i.trait_ {
                // Which types are public, the list says elsewhere.
                return add(format!("impl {} for {of}", line(of_trait)));
            }
            for member in &i.items {
                match member {
                    ImplItem::Fn(f) if is_public(&f.vis) && !is_conditional(&f.attrs) => {
                        add(format!("{of} :: {}", line(&f.sig)));
                    }
                    ImplItem::Const(c) if is_public(&c.vis) => {
                        add(format!("{of} :: const {} : {}", c.ident, line(&c.ty)));
                    }
                    _ => {}
                }
            }
        }
        _ => {}
    }
}

/// The lines of a module in `file`, and of those within.
fn walk(file: &Path, module: &str, lines: &mut Vec<String>) {
    let text = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let folder = match file.file_stem() {
        Some(stem) if stem != "lib" => file.with_file_name(stem),
        _ => file.with_file_name(""),
    };
    for item in &parsed.items {
        match item {
            Item::Mod(m) if m.content.is_none() && !is_conditional(&m.attrs) => {
                walk(&folder.join(format!("{}.rs", m.ident)), &format!("{module}::{}", m.ident), lines);
            }
            other => list(other, module, lines),
        }
    }
}

/// The list: lines about public types, functions and constants; `impl`s of traits of types that are not public are left out.
fn interface() -> String {
    let mut lines = vec![];
    walk(&PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs"), "halite", &mut lines);
    let types: Vec<String> = lines
        .iter()
        .filter_map(|l| l.split_once(": ")?.1.split("struct ").nth(1).or(l.split("enum ").nth(1)))
        .filter_map(|rest| rest.split([' ', '<']).next().map(str::to_owned))
        .collect();
    let stays = |l: &String| match l.split_once(" for ") {
        Some((before, of)) if before.contains(": impl ") => {
            types.iter().any(|t| of.split([' ', '<', ':']).any(|word| word == t))
        }
        _ => true,
    };
    lines.retain(stays);
    lines.sort();
    lines.dedup();
    lines.iter().fold(String::new(), |mut all, l| {
        let _ = writeln!(all, "{}", l.trim_end());
        all
    })
}

#[test]
fn the_public_interface_is_as_listed() {
    let list = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interface.txt");
    let found = interface();
    if std::env::var_os("HALITE_WRITE").is_some() {
        std::fs::write(&list, &found).unwrap();
    }
    let listed = std::fs::read_to_string(&list).unwrap();
    let missing = |from: &str, of: &str| {
        from.lines().filter(|l| !of.lines().any(|other| other == *l)).map(str::to_owned).collect::<Vec<_>>()
    };
    let (new, gone) = (missing(&found, &listed), missing(&listed, &found));
    assert!(
        new.is_empty() && gone.is_empty(),
        "the public interface changed (HALITE_WRITE=1 writes tests/interface.txt anew).\nNew:\n{}\nGone:\n{}",
        new.join("\n"),
        gone.join("\n")
    );
    // The list is not empty, and has what it must have.
    for line in ["halite: use render :: Renderer", "halite::render: Renderer :: fn render"] {
        assert!(found.contains(line), "{line}");
    }
}
