//! The input that is being read, in a file: what is left when the process dies over it.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Written before each input. A write into the page cache costs about a microsecond and survives the process.
#[derive(Debug)]
pub struct Journal {
    file: Mutex<(File, Vec<u8>)>,
    beat: AtomicU64,
}

impl Journal {
    /// A new journal at `path`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn create(path: &Path) -> std::io::Result<Self> {
        Ok(Journal {
            file: Mutex::new((File::create(path)?, Vec::new())),
            beat: AtomicU64::new(0),
        })
    }

    /// `input` is about to be read.
    pub fn note(&self, execution: u64, input: &[u8]) {
        if let Ok(mut locked) = self.file.lock() {
            let (file, buffer) = &mut *locked;
            buffer.clear();
            buffer.extend_from_slice(&execution.to_le_bytes());
            buffer.extend_from_slice(&(input.len() as u64).to_le_bytes());
            buffer.extend_from_slice(input);
            // without a journal a death has no input, which its finding then says
            let _ = file.seek(SeekFrom::Start(0)).and_then(|_| file.write_all(buffer));
        }
        self.beat.fetch_add(1, Ordering::Release);
    }

    /// How often something was noted: a reader that hangs leaves it as it is.
    #[must_use]
    pub fn beat(&self) -> u64 {
        self.beat.load(Ordering::Acquire)
    }

    /// The input that was noted last in the journal at `path`, and its execution.
    #[must_use]
    pub fn last(path: &Path) -> Option<(u64, Vec<u8>)> {
        let mut bytes = Vec::new();
        File::open(path).ok()?.read_to_end(&mut bytes).ok()?;
        let (execution, rest) = bytes.split_first_chunk::<8>()?;
        let (length, rest) = rest.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        // behind it may be the end of a longer one
        Some((u64::from_le_bytes(*execution), rest.get(..length)?.to_vec()))
    }
}
