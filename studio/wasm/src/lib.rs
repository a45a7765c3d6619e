//! The interface to the page. Bytes go in through a buffer that the page fills, and come out as an address and a length.
//!
//! ```text
//! page: at = room(n), n bytes into memory from `at`, then
//!       put(m)    the first m bytes name a file, the rest is its content
//!       forget(m) the file of that name is gone
//!       ask(m)    m bytes of JSON: a request        -> length of the answer, JSON, from answer()
//!       take(m)   the name of a file that was made  -> its length, from answer(); -1: there is none
//! ```

use std::cell::RefCell;

use studio::{Part, Session};

/// What this module answers: a feature of the crate each.
const PARTS: &[Part] = &[
    #[cfg(feature = "first")]
    studio::FIRST,
    #[cfg(feature = "code")]
    studio::CODE,
    #[cfg(feature = "records")]
    studio::RECORDS,
    #[cfg(feature = "simulate")]
    studio::SIMULATE,
];

struct Page {
    session: Session,
    /// What the page wrote.
    room: Vec<u8>,
    answer: Vec<u8>,
}

thread_local! {
    static PAGE: RefCell<Page> = RefCell::new(Page {
        session: Session::new(PARTS),
        room: Vec::new(),
        answer: Vec::new(),
    });
}

#[cfg(target_arch = "wasm32")]
#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// Hears how far a long piece of work is: UTF-8.
    fn progress(at: *const u8, length: usize);
}

fn tell(text: &str) {
    // SAFETY: the page reads `length` bytes from `at` before it returns
    #[cfg(target_arch = "wasm32")]
    unsafe {
        progress(text.as_ptr(), text.len());
    }
    #[cfg(not(target_arch = "wasm32"))]
    let _ = text;
}

/// Address of a buffer of `length` bytes for the page to fill; the one before is gone.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    PAGE.with_borrow_mut(|page| {
        page.room = vec![0; length];
        page.room.as_mut_ptr()
    })
}

/// Takes a file in: `name` bytes of its name, then its content.
#[unsafe(no_mangle)]
pub extern "C" fn put(name: usize) {
    PAGE.with_borrow_mut(|page| {
        let bytes = std::mem::take(&mut page.room);
        let (name, content) = bytes.split_at(name.min(bytes.len()));
        page.session.put(&String::from_utf8_lossy(name), content.to_vec());
    });
}

/// Takes a file away.
#[unsafe(no_mangle)]
pub extern "C" fn forget(name: usize) {
    PAGE.with_borrow_mut(|page| {
        let bytes = std::mem::take(&mut page.room);
        page.session
            .forget(&String::from_utf8_lossy(&bytes[..name.min(bytes.len())]));
    });
}

/// Answers a request; the length of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn ask(length: usize) -> usize {
    PAGE.with_borrow_mut(|page| {
        let bytes = std::mem::take(&mut page.room);
        page.answer = page.session.ask(&bytes[..length.min(bytes.len())], tell).into_bytes();
        page.answer.len()
    })
}

/// A file that the last request made; its length, or -1.
#[unsafe(no_mangle)]
pub extern "C" fn take(length: usize) -> isize {
    PAGE.with_borrow_mut(|page| {
        let bytes = std::mem::take(&mut page.room);
        let name = String::from_utf8_lossy(&bytes[..length.min(bytes.len())]);
        let Some(made) = page.session.made(&name) else {
            return -1;
        };
        page.answer = made.to_vec();
        page.answer.len() as isize
    })
}

/// Address of the last answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    PAGE.with_borrow(|page| page.answer.as_ptr())
}
