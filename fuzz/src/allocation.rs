//! An allocator that counts, so that memory without bound is a finding and not the end of the machine.
#![allow(
    unsafe_code,
    reason = "`GlobalAlloc` is unsafe to implement; every call goes on to the system's own"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bytes beyond which nothing is given: the process ends, and its journal holds the input.
// eight times what any target may take, and a quarter of a small machine
const CEILING: usize = 2 << 30;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator with a count.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn taken(size: usize) {
    let live = LIVE.fetch_add(size, Relaxed) + size;
    // a load first: most requests are below the peak, and `fetch_max` would write each time
    if live > PEAK.load(Relaxed) {
        PEAK.fetch_max(live, Relaxed);
    }
}

fn is_refused(size: usize) -> bool {
    LIVE.load(Relaxed).saturating_add(size) > CEILING
}

// SAFETY: every block comes from `System` and goes back to it with the layout it was given with
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if is_refused(layout.size()) {
            return std::ptr::null_mut();
        }
        let block = unsafe { System.alloc(layout) };
        if !block.is_null() {
            taken(layout.size());
        }
        block
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if is_refused(layout.size()) {
            return std::ptr::null_mut();
        }
        let block = unsafe { System.alloc_zeroed(layout) };
        if !block.is_null() {
            taken(layout.size());
        }
        block
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if is_refused(size) {
            return std::ptr::null_mut();
        }
        let new = unsafe { System.realloc(block, layout, size) };
        if !new.is_null() {
            taken(size);
            LIVE.fetch_sub(layout.size(), Relaxed);
        }
        new
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        unsafe { System.dealloc(block, layout) };
        LIVE.fetch_sub(layout.size(), Relaxed);
    }
}

/// Begins a count; returns the bytes that are in use now.
#[must_use]
pub fn begin() -> usize {
    let live = LIVE.load(Relaxed);
    PEAK.store(live, Relaxed);
    live
}

/// Most bytes that were in use at one time since [`begin`], beyond those that it returned. Counts all threads.
#[must_use]
pub fn peak_since(begin: usize) -> usize {
    PEAK.load(Relaxed).saturating_sub(begin)
}
