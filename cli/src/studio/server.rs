//! The server: one thread a connection, one answer a connection.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use toml_input::{Faults, Message};

use super::request::answer;
use super::site::Site;

/// Longest head of a request: several times what browsers send.
const LONGEST: usize = 16 << 10;
/// Connections at a time: a browser opens six.
const MOST: usize = 32;
/// A browser opens connections ahead of need; one that stays silent is closed.
const SILENCE: Duration = Duration::from_secs(5);

/// A page at a port of this machine.
pub struct Server {
    listener: TcpListener,
    port: u16,
}

/// Takes a port; 0 takes one that is free. No other machine reaches it.
///
/// # Errors
/// If it is taken.
pub fn open(port: u16) -> Result<Server, Faults> {
    let told = |error: std::io::Error| {
        let message = Message::new(format!("port {port} of this machine cannot be had")).found(error.to_string());
        Faults::from(message.hint("leave out --port, and a free one is taken"))
    };
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(told)?;
    let port = listener.local_addr().map_err(told)?.port();
    Ok(Server { listener, port })
}

impl Server {
    /// Where it is.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/", self.port)
    }

    /// Answers until the program ends.
    pub fn run(self, site: Site) {
        let site = Arc::new(site);
        let open = Arc::new(AtomicUsize::new(0));
        // a connection that failed before it was taken is its browser's business
        for stream in self.listener.incoming().flatten() {
            if open.fetch_add(1, Ordering::SeqCst) >= MOST {
                open.fetch_sub(1, Ordering::SeqCst);
                continue;
            }
            let (site, open, port) = (Arc::clone(&site), Arc::clone(&open), self.port);
            std::thread::spawn(move || {
                // a browser that has gone needs no answer
                let _ = serve(stream, &site, port);
                open.fetch_sub(1, Ordering::SeqCst);
            });
        }
    }
}

fn serve(mut stream: TcpStream, site: &Site, port: u16) -> std::io::Result<()> {
    stream.set_read_timeout(Some(SILENCE))?;
    stream.set_write_timeout(Some(SILENCE))?;
    let mut head = Vec::new();
    let mut chunk = [0; 2048];
    while !head.windows(4).any(|four| four == b"\r\n\r\n") {
        let count = stream.read(&mut chunk)?;
        head.extend_from_slice(&chunk[..count]);
        if count == 0 || head.len() > LONGEST {
            return Ok(());
        }
    }
    let head = String::from_utf8_lossy(&head);
    let head = head.split("\r\n\r\n").next().unwrap_or_default();
    let found = answer(site, port, head);
    stream.write_all(found.head.as_bytes())?;
    stream.write_all(found.content)
}
