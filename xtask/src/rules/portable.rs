//! Tracked files name no path of one machine and no registry host.

use std::path::Path;

/// Folders that exist on one machine only; split, so that this file does not break its own rule.
const FOLDERS: &[&str] = &[concat!("/wo", "rk/"), concat!("/ro", "ot/")];
const HOSTS: &[&str] = &[concat!("index.", "crates.io"), concat!("static.", "crates.io")];

/// One line per place; also looks into binary files.
pub fn check(path: &Path, bytes: &[u8]) -> Vec<String> {
    let mut faults = Vec::new();
    for (index, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        let folder = |word: &&&str| find(line, word).any(|at| !continues_a_path(&line[..at]));
        let host = |word: &&&str| find(line, word).next().is_some();
        let found = FOLDERS.iter().filter(folder);
        for word in found.chain(HOSTS.iter().filter(host)) {
            faults.push(format!("{}:{}: `{word}`", path.display(), index + 1));
        }
    }
    faults
}

fn find<'a>(line: &'a [u8], word: &'a str) -> impl Iterator<Item = usize> + 'a {
    let word = word.as_bytes();
    let windows = line.windows(word.len()).enumerate();
    windows.filter_map(move |(at, window)| (window == word).then_some(at))
}

/// `tests/x/`, `../x/`, `$DIR/x/` and `https://host/x/` are no absolute paths.
fn continues_a_path(before: &[u8]) -> bool {
    before
        .last()
        .is_some_and(|b| b.is_ascii_alphanumeric() || b"._-*}".contains(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn faults(text: &str) -> Vec<String> {
        check(Path::new("a.toml"), text.as_bytes())
    }

    #[test]
    fn machine_paths_are_found_with_their_line() {
        let folder = FOLDERS[0];
        let text = format!("a = 1\nb = \"{folder}main\"\nfile://{folder}main");
        assert_eq!(
            faults(&text),
            [format!("a.toml:2: `{folder}`"), format!("a.toml:3: `{folder}`")]
        );
    }

    #[test]
    fn registry_hosts_are_found() {
        for host in HOSTS {
            assert_eq!(faults(&format!("https://{host}/config.json")).len(), 1);
        }
    }

    #[test]
    fn relative_paths_and_addresses_are_left_alone() {
        let folder = FOLDERS[0];
        for text in ["tests", "..", "$DIR", "${DIR}", "https://example.org"] {
            assert_eq!(faults(&format!("{text}{folder}main")), [""; 0]);
        }
    }

    #[test]
    fn the_lock_file_may_name_its_registry() {
        let source = "registry+https://github.com/rust-lang/crates.io-index";
        assert_eq!(faults(source), [""; 0]);
    }
}
