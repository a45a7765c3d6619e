//! What a browser asks, judged before it is answered.
//!
//! A page elsewhere may make a browser ask this machine, and may have its own name lead here (DNS rebinding). So a request must name
//! this server as the host that it means, and what it names is looked up in a table, never on disk.

use super::site::Site;

/// What may be run and loaded: the page's own files and WebAssembly, nothing else. index.html says the same for a server of yours.
pub const POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; style-src 'self'; \
                          connect-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'";

/// An answer: its head, and the content.
#[derive(Debug, PartialEq, Eq)]
pub struct Answer<'s> {
    pub head: String,
    pub content: &'s [u8],
}

/// The answer to the head of a request, for a server at `port`.
pub fn answer<'s>(site: &'s Site, port: u16, head: &str) -> Answer<'s> {
    let mut lines = head.split("\r\n");
    let mut words = lines.next().unwrap_or_default().split(' ');
    let (method, target) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let hosts: Vec<&str> = lines
        .filter_map(|line| line.split_once(':'))
        .filter(|(name, _)| name.eq_ignore_ascii_case("host"))
        .map(|(_, value)| value.trim())
        .collect();
    let own = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    if !matches!(hosts.as_slice(), [only] if own.iter().any(|host| host == only)) {
        return refusal("421 Misdirected Request");
    }
    if !["GET", "HEAD"].contains(&method) {
        return refusal("405 Method Not Allowed\r\nAllow: GET, HEAD");
    }
    let path = target.split(['?', '#']).next().unwrap_or_default();
    let path = match path.strip_prefix('/') {
        Some("") => "index.html",
        Some(path) => path,
        None => return refusal("400 Bad Request"),
    };
    let Some(content) = site.get(path) else {
        return refusal("404 Not Found");
    };
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {}\r\nContent-Length: {}\r\nContent-Security-Policy: {POLICY}; frame-ancestors 'none'\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n",
        media(path),
        content.len()
    );
    let content = if method == "HEAD" { &[] } else { content };
    Answer { head, content }
}

fn refusal(status: &str) -> Answer<'static> {
    Answer {
        head: format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"),
        content: &[],
    }
}

/// Browsers run a module and compile WebAssembly only under these names.
fn media(path: &str) -> &'static str {
    match path.rsplit('.').next().unwrap_or_default() {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "wasm" => "application/wasm",
        "toml" | "csv" | "txt" => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site() -> Site {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("index.html", "page"),
            ("studio.wasm", "code"),
            ("code.wasm", ""),
            ("records.wasm", ""),
            ("simulate.wasm", ""),
            ("examples/a/p.toml", "x = 1"),
        ] {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        }
        Site::from(folder.path()).unwrap()
    }

    fn status(head: &str) -> String {
        let answered = answer(&site(), 80, head).head;
        answered["HTTP/1.1 ".len()..][..3].to_owned()
    }

    #[test]
    fn the_page_and_its_files_are_answered_with_their_types() {
        let site = site();
        for (target, content, media) in [
            ("/", "page", "text/html"),
            ("/?x=1", "page", "text/html"),
            ("/studio.wasm", "code", "application/wasm"),
            ("/examples/a/p.toml", "x = 1", "text/plain"),
        ] {
            let found = answer(
                &site,
                80,
                &format!("GET {target} HTTP/1.1\r\nHost: localhost:80\r\n\r\n"),
            );
            assert_eq!(found.content, content.as_bytes(), "{target}");
            assert!(
                found.head.contains(media) && found.head.contains(&format!("Content-Length: {}", content.len())),
                "{}",
                found.head
            );
        }
        let head = answer(&site, 80, "HEAD / HTTP/1.1\r\nHost: 127.0.0.1:80\r\n\r\n");
        assert!(head.content.is_empty() && head.head.contains("Content-Length: 4"));
    }

    #[test]
    fn another_host_none_or_two_are_refused_whatever_they_ask() {
        for host in [
            "evil.example:80",
            "evil.example",
            "127.0.0.1",
            "127.0.0.1:81",
            "127.0.0.1:80.evil.example",
            "",
        ] {
            assert_eq!(
                status(&format!("GET / HTTP/1.1\r\nHost: {host}\r\n\r\n")),
                "421",
                "{host}"
            );
        }
        assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), "421");
        assert_eq!(
            status("GET / HTTP/1.1\r\nHost: 127.0.0.1:80\r\nHost: evil.example\r\n\r\n"),
            "421"
        );
    }

    #[test]
    fn nothing_but_reading_of_known_files_is_done() {
        let asked = |line: &str| status(&format!("{line}\r\nhost: 127.0.0.1:80\r\n\r\n"));
        assert_eq!(asked("POST / HTTP/1.1"), "405");
        for path in [
            "/../Cargo.toml",
            "//etc/passwd",
            "/%2e%2e/x",
            "/examples",
            "/examples/a/../a/p.toml",
            "/index.html/",
        ] {
            assert_eq!(asked(&format!("GET {path} HTTP/1.1")), "404", "{path}");
        }
        assert_eq!(asked("GET http://127.0.0.1/ HTTP/1.1"), "400");
        assert_eq!(asked(""), "405");
    }
}
