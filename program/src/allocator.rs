//! Memory that is not there: the program says so and ends with exit code 1, where Rust's own way is to abort.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// The system's allocator, which ends the program where it has no memory and the library does not deal with that.
pub(crate) struct Ending;

/// Says how many bytes there were not, without taking any.
fn end(bytes: usize) -> ! {
    let mut line = [0_u8; 96];
    let mut left = &mut line[..];
    let _ = writeln!(left, "halite: memory ran out: {bytes} bytes more could not be had");
    let unused = left.len();
    let _ = std::io::stderr().write_all(&line[..96 - unused]);
    std::process::exit(1)
}

fn checked(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() && !halite::memory::tries() { end(bytes) } else { pointer }
}

#[allow(unsafe_code, reason = "allocators are unsafe; this one hands every call to the system's")]
// SAFETY: all that is returned is the system allocator's answer to the same arguments.
unsafe impl GlobalAlloc for Ending {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are the same.
        checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are the same.
        checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are the same.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: the caller's promises are the same.
        checked(unsafe { System.realloc(pointer, layout, size) }, size)
    }
}
