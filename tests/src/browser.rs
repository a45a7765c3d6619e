//! A browser without a screen, asked over its debugging pipe: messages in JSON, each ended by a zero byte. A test has no better answer
//! to a browser that does not than to fail, so these functions panic.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Without a screen, for root, and with as little shared memory as a container has.
pub const FLAGS: [&str; 4] = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"];

/// A browser with one page.
#[derive(Debug)]
pub struct Browser {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    last: u64,
    session: Option<String>,
}

impl Browser {
    /// Whether one starts: one that is there may still not, as in a container without what it asks for.
    #[must_use]
    pub fn is_there() -> bool {
        let mut browser = Command::new("timeout");
        browser
            .args(["60", "chromium", "--dump-dom"])
            .args(FLAGS)
            .arg("about:blank");
        browser.output().is_ok_and(|output| output.status.success())
    }

    /// Started with a profile in `folder`.
    ///
    /// # Panics
    /// If it does not start.
    pub fn start(folder: &Path) -> Self {
        // the browser reads at descriptor 3 and writes at 4
        let flags = FLAGS.join(" ");
        let line = format!(
            "exec chromium {flags} --remote-debugging-pipe \"--user-data-dir=$0\" 3<&0 4>&1 0</dev/null 1>/dev/null 2>&1"
        );
        let mut child = Command::new("sh")
            .args(["-c", &line])
            .arg(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (input, output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
        let mut browser = Browser {
            child,
            input,
            output: BufReader::new(output),
            last: 0,
            session: None,
        };
        let target = browser.ask("Target.createTarget", json!({"url": "about:blank"}));
        let attached = json!({"targetId": target["targetId"], "flatten": true});
        let session = browser.ask("Target.attachToTarget", attached);
        browser.session = session["sessionId"].as_str().map(str::to_owned);
        browser
    }

    /// The answer to a command of the debugging protocol.
    ///
    /// # Panics
    /// If the browser has ended or refuses.
    pub fn ask(&mut self, method: &str, parameters: Value) -> Value {
        self.last += 1;
        let mut message = json!({"id": self.last, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.input.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let mut answer = Vec::new();
            let count = self.output.read_until(0, &mut answer).unwrap();
            assert!(count > 0, "chromium has ended");
            let answer: Value =
                serde_json::from_slice(answer.trim_ascii_end().strip_suffix(&[0]).unwrap_or(&answer)).unwrap();
            // the others are events
            if answer["id"] == self.last {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// The value of `expression` as soon as it is one; a promise is waited for.
    ///
    /// # Panics
    /// If there is none within `patience`.
    pub fn value(&mut self, expression: &str, patience: Duration) -> Value {
        let begun = Instant::now();
        while begun.elapsed() < patience {
            let found = self.ask(
                "Runtime.evaluate",
                json!({"expression": expression, "returnByValue": true, "awaitPromise": true}),
            );
            match &found["result"]["value"] {
                Value::Null | Value::Bool(false) => std::thread::sleep(Duration::from_millis(50)),
                value => return value.clone(),
            }
        }
        panic!("no value of {expression} within {patience:?}");
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
