//! `policyc studio --out`: the page as files for another server.

use std::collections::BTreeMap;

use tests::tools::listing;

use super::Desk;

/// What a page must have, and a file of an example below it.
const PAGE: [(&str, &str); 6] = [
    ("index.html", "<!DOCTYPE html>"),
    ("studio.wasm", "\0asm first"),
    ("code.wasm", "\0asm code"),
    ("records.wasm", "\0asm records"),
    ("simulate.wasm", "\0asm simulate"),
    ("examples/buck/policy.toml", "name = \"buck\""),
];

fn desk_with_page() -> Desk {
    let desk = Desk::new("minimal");
    for (name, text) in PAGE {
        let path = desk.path("page").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    desk
}

#[test]
fn a_page_is_written_as_files_with_folders_and_again_over_itself() {
    let desk = desk_with_page();
    for _ in 0..2 {
        let said = desk.succeed("studio --from page --out site");
        assert!(said.contains("site/index.html"), "{said}");
        let found: BTreeMap<&str, String> = PAGE
            .iter()
            .map(|(name, _)| (*name, std::fs::read_to_string(desk.path("site").join(name)).unwrap()))
            .collect();
        assert_eq!(
            found,
            PAGE.iter().map(|(name, text)| (*name, (*text).to_owned())).collect()
        );
    }
    // the record by which the command knows its own files again
    assert!(desk.path("site/policyc-files.json").is_file());
}

#[test]
fn a_folder_that_lacks_a_module_is_no_page_and_nothing_is_written() {
    for lacking in [
        "index.html",
        "studio.wasm",
        "code.wasm",
        "records.wasm",
        "simulate.wasm",
    ] {
        let desk = desk_with_page();
        std::fs::remove_file(desk.path("page").join(lacking)).unwrap();
        desk.refuse(
            "studio --from page --out site",
            &["page", &format!("no {lacking}"), "cargo xtask studio"],
        );
        assert!(!desk.path("site").exists(), "{lacking}");
    }
    desk_with_page().refuse("studio --from nowhere --out site", &["nowhere"]);
}

#[test]
fn a_page_of_others_is_kept() {
    let desk = desk_with_page();
    std::fs::create_dir(desk.path("site")).unwrap();
    desk.write("site/index.html", "mine");
    desk.refuse("studio --from page --out site", &["site/index.html", "--force"]);
    assert_eq!(std::fs::read_to_string(desk.path("site/index.html")).unwrap(), "mine");
    assert_eq!(listing(&desk.path("site")), ["index.html"]);
}
