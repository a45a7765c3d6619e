//! Who may depend on whom.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use crate::workspace::{Crate, Dependency, Kind};

/// Lowest layer first; a crate depends on strictly lower layers only.
const LAYERS: &[&[&str]] = &[
    &[
        "random",
        "wide",
        "toml-input",
        "mat",
        "mdf",
        "targets",
        "templates",
        "report",
    ],
    &["policy", "plant", "measured", "campaign"],
    &["certify"],
    &["import", "interp", "codegen", "drm", "equivalence"],
    &["closed-loop"],
    &[
        "policy-macro",
        "policy-build",
        "train",
        "spice",
        "fmu",
        "diagnose",
        "verify",
        "prove",
    ],
    // above what it calls, below the command that serves its page
    &["studio"],
    &["cli", "example-build-rust", "example-build-c", "example-embedded-hal"],
    &["studio-wasm", "wheel", "tests", "blind", "bench", "xtask", "firmware"],
    // draws its policies as `tests` does
    &["fuzz"],
];

/// No crate of `from` reaches one of `to`, by whatever way.
struct Forbidden {
    from: &'static [&'static str],
    to: &'static [&'static str],
    why: &'static str,
}

const FORBIDDEN: &[Forbidden] = &[
    Forbidden {
        from: &["interp"],
        to: &["codegen", "templates"],
        why: "an oracle that shares the lowering proves nothing",
    },
    Forbidden {
        from: &["equivalence"],
        to: &["codegen", "templates", "interp"],
        why: "a specification that shares the lowering proves nothing, and one that shares the oracle shows no more than it does",
    },
    Forbidden {
        from: &[
            "policy",
            "import",
            "certify",
            "interp",
            "codegen",
            "targets",
            "templates",
            "policy-macro",
            "verify",
            "equivalence",
            "prove",
        ],
        to: &["plant", "drm", "closed-loop", "train", "diagnose"],
        why: "the compile side does not know the model side",
    },
];

pub const MACRO: &str = "policy-macro";
/// Its name in a registry, which cargo calls it by.
const MACRO_PACKAGE: &str = "policyc-macro";

/// Lists what a firmware crate compiles for `include_policy!`, one package a line.
pub const MACRO_TREE: [&str; 11] = [
    "tree",
    "-p",
    MACRO_PACKAGE,
    "-e",
    "no-dev",
    "--target",
    "all",
    "--prefix",
    "none",
    "--format",
    "{p}",
];

// `ndarray` comes with the interpreter, which holds the trainer's golden answers against the network: a controller that
// was misread is worse than the seconds that a first build takes
const NOT_IN_MACRO: &[&str] = &["askama", "clap"];

/// One line per violation.
pub fn check(crates: &[Crate]) -> Vec<String> {
    let mut faults = Vec::new();
    for member in crates {
        faults.extend(order(member));
    }
    for rule in FORBIDDEN {
        for member in crates.iter().filter(|c| rule.from.contains(&&*c.name)) {
            faults.extend(reach(member, crates, rule));
        }
    }
    faults
}

/// Reads the output of [`MACRO_TREE`].
pub fn check_macro_closure(tree: &str) -> Vec<String> {
    let names: BTreeSet<&str> = tree.lines().filter_map(|line| line.split_whitespace().next()).collect();
    if !names.contains(MACRO_PACKAGE) {
        return vec![format!("cargo tree does not list `{MACRO_PACKAGE}` itself")];
    }
    let heavy = names.iter().filter(|name| {
        let is = |heavy: &&str| *name == heavy || name.starts_with(&format!("{heavy}_"));
        NOT_IN_MACRO.iter().any(is)
    });
    heavy
        .map(|name| format!("`{MACRO}` pulls in `{name}`: firmware builds compile it each time; `cargo tree -p {MACRO_PACKAGE} -i {name}` shows the way"))
        .collect()
}

fn layer(name: &str) -> Option<usize> {
    LAYERS.iter().position(|layer| layer.contains(&name))
}

fn order(member: &Crate) -> Vec<String> {
    let name = &member.name;
    let Some(own) = layer(name) else {
        return vec![no_layer(name)];
    };
    let mut faults = Vec::new();
    for Dependency { name: other, kind } in &member.dependencies {
        match layer(other) {
            None => faults.push(no_layer(other)),
            Some(its) if its >= own && *kind != Kind::Dev => faults.push(format!(
                "`{name}` (layer {own}) depends on `{other}` (layer {its}): only lower layers are allowed"
            )),
            Some(_) => {}
        }
    }
    faults
}

fn no_layer(name: &str) -> String {
    format!("crate `{name}` has no layer: give it one in {}", file!())
}

/// Follows normal and build dependencies; dev-dependencies of `start` alone, since cargo does so too.
fn reach(start: &Crate, crates: &[Crate], rule: &Forbidden) -> Vec<String> {
    let by_name: BTreeMap<&str, &Crate> = crates.iter().map(|c| (c.name.as_str(), c)).collect();
    let mut ways = VecDeque::from([vec![start.name.as_str()]]);
    let mut seen = BTreeSet::from([start.name.as_str()]);
    let mut faults = Vec::new();
    while let Some(way) = ways.pop_front() {
        let Some(member) = way.last().and_then(|name| by_name.get(name)) else {
            continue;
        };
        for next in &member.dependencies {
            let counts = next.kind != Kind::Dev || way.len() == 1;
            if !counts || !seen.insert(&next.name) {
                continue;
            }
            let way = [&way[..], &[&next.name]].concat();
            if rule.to.contains(&&*next.name) {
                faults.push(format!("{}: {}", way.join(" -> "), rule.why));
            } else {
                ways.push_back(way);
            }
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(name: &str, dependencies: &[(&str, Kind)]) -> Crate {
        let dependencies = dependencies.iter().map(|(name, kind)| Dependency {
            name: (*name).into(),
            kind: *kind,
        });
        Crate {
            name: name.into(),
            dependencies: dependencies.collect(),
            ..Crate::default()
        }
    }

    fn only_fault(crates: &[Crate]) -> String {
        let faults = check(crates);
        assert_eq!(faults.len(), 1, "{faults:?}");
        faults[0].clone()
    }

    #[test]
    fn the_intended_house_stands() {
        let crates = [
            member("targets", &[]),
            member("templates", &[]),
            member("policy", &[("targets", Kind::Normal)]),
            member("interp", &[("policy", Kind::Normal)]),
            member(
                "codegen",
                &[
                    ("policy", Kind::Normal),
                    ("templates", Kind::Normal),
                    ("interp", Kind::Dev),
                ],
            ),
            member("verify", &[("codegen", Kind::Normal), ("interp", Kind::Normal)]),
            member("train", &[("plant", Kind::Normal)]),
            member("cli", &[("verify", Kind::Normal), ("train", Kind::Normal)]),
        ];
        assert_eq!(check(&crates), [""; 0]);
    }

    #[test]
    fn a_crate_depends_on_no_higher_layer() {
        let fault = only_fault(&[member("policy", &[("codegen", Kind::Normal)])]);
        assert_eq!(
            fault,
            "`policy` (layer 1) depends on `codegen` (layer 3): only lower layers are allowed"
        );
    }

    #[test]
    fn a_crate_depends_on_no_equal_layer_even_to_build() {
        let fault = only_fault(&[member("codegen", &[("interp", Kind::Build)])]);
        assert!(fault.contains("`codegen` (layer 3) depends on `interp` (layer 3)"));
    }

    #[test]
    fn a_crate_without_layer_asks_for_one() {
        let fault = only_fault(&[member("helpers", &[])]);
        assert!(fault.starts_with("crate `helpers` has no layer: give it one in"));
        assert!(fault.ends_with("layers.rs"));
        let fault = only_fault(&[member("cli", &[("helpers", Kind::Normal)])]);
        assert!(fault.starts_with("crate `helpers` has no layer"));
    }

    #[test]
    fn interp_reaches_codegen_not_even_to_test() {
        let fault = only_fault(&[member("interp", &[("codegen", Kind::Dev)])]);
        assert!(fault.starts_with("interp -> codegen: "), "{fault}");
    }

    #[test]
    fn interp_reaches_templates_by_no_detour() {
        let fault = only_fault(&[
            member("templates", &[]),
            member("policy", &[("templates", Kind::Normal)]),
            member("interp", &[("policy", Kind::Normal)]),
        ]);
        assert!(fault.starts_with("interp -> policy -> templates: "), "{fault}");
    }

    #[test]
    fn dev_dependencies_of_others_are_no_way() {
        let crates = [
            member("policy", &[("templates", Kind::Dev)]),
            member("interp", &[("policy", Kind::Normal)]),
        ];
        assert_eq!(check(&crates), [""; 0]);
    }

    #[test]
    fn compile_side_reaches_no_model_crate() {
        let fault = only_fault(&[member("verify", &[("plant", Kind::Normal)])]);
        assert!(fault.starts_with("verify -> plant: "), "{fault}");
        let fault = only_fault(&[member("codegen", &[("train", Kind::Dev)])]);
        assert!(fault.starts_with("codegen -> train: "), "{fault}");
    }

    #[test]
    fn a_cycle_of_dependencies_ends() {
        let crates = [
            member("policy", &[("interp", Kind::Dev)]),
            member("interp", &[("policy", Kind::Normal)]),
        ];
        assert_eq!(check(&crates), [""; 0]);
    }

    #[test]
    fn the_macro_pulls_in_nothing_heavy() {
        let light = "policyc-macro v0.1.0 (proc-macro) (/w/policy-macro)\nsyn v3.0.0\nsyn v3.0.0 (*)";
        assert_eq!(check_macro_closure(light), [""; 0]);
        let faults = check_macro_closure(&format!("{light}\naskama_derive v0.16.0\nclap v4.6.0"));
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(faults[0].starts_with("`policy-macro` pulls in `askama_derive`"));
    }

    #[test]
    fn an_empty_tree_proves_nothing() {
        assert_eq!(check_macro_closure("").len(), 1);
    }
}
