//! What an FMU says while it runs.

use std::sync::Mutex;

use crate::instance::Status;

/// Where the words of FMUs go.
pub type Tell = fn(&str);

/// Longest message that is kept, bytes.
const LONGEST: usize = 2000;

/// The words of one instance.
#[derive(Debug)]
pub(crate) struct Log {
    /// Name of the FMU.
    of: String,
    /// Nothing: only complaints are kept.
    tell: Option<Tell>,
    /// The last complaint, for the fault that follows it.
    complaint: Mutex<Option<String>>,
}

impl Log {
    pub fn new(of: &str, tell: Option<Tell>) -> Self {
        Self {
            of: of.to_owned(),
            tell,
            complaint: Mutex::new(None),
        }
    }

    pub fn is_wanted(&self) -> bool {
        self.tell.is_some()
    }

    pub fn say(&self, status: Status, text: &str) {
        let text: String = text
            .trim()
            .chars()
            .take(LONGEST)
            .map(|c| if c.is_control() { ' ' } else { c })
            .collect();
        if let Some(tell) = self.tell {
            tell(&format!("{}: {}: {text}", self.of, status.word()));
        }
        if let (true, Ok(mut complaint)) = (status.is_failure(), self.complaint.lock()) {
            *complaint = Some(text);
        }
    }

    /// The last complaint, once.
    pub fn complaint(&self) -> Option<String> {
        self.complaint.lock().ok().and_then(|mut complaint| complaint.take())
    }
}
