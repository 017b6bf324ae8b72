//! How much memory may still be had, asked before much of it is taken: an error then, and not the end of the process. And a hint that
//! some of it will be read soon.

use crate::error::{Error, Result};
use bytemuck::Zeroable;
use std::cell::Cell;
use std::fmt::Display;

/// What is left for small things besides the large ones that are asked for.
const RESERVE: u64 = 16 << 20;

/// Arrays of so many bytes are small.
const ASKED: u64 = 1 << 20;

thread_local! {
    static TRIES: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread takes memory whose lack it deals with itself. For allocators that end a program which has none.
pub fn tries() -> bool {
    TRIES.try_with(Cell::get).unwrap_or(false)
}

/// Refuses to go on if fewer than `bytes` can be had for `what`.
///
/// # Errors
/// [`Error::NoMemory`], where the system says how much there is.
pub fn check(what: &str, bytes: u64) -> Result<()> {
    match available() {
        Some(there) if bytes > there.saturating_sub(RESERVE) => Err(lacking(what, bytes, Some(there))),
        _ => Ok(()),
    }
}

/// As [`check`], for `count` values of type `T`. What is small is not asked for: that costs more than it may save.
///
/// # Errors
/// [`Error::NoMemory`] if they cannot be had.
pub fn check_array<T>(what: impl Display, count: usize) -> Result<()> {
    match bytes::<T>(count) {
        bytes if bytes > ASKED => check(&what.to_string(), bytes),
        _ => Ok(()),
    }
}

/// `count` times `value`, for `what`.
///
/// # Errors
/// [`Error::NoMemory`] if there is not enough memory.
pub fn filled<T: Clone>(what: impl Display, value: T, count: usize) -> Result<Vec<T>> {
    let mut list = Vec::new();
    reserve(what, &mut list, count)?;
    list.resize(count, value);
    Ok(list)
}

/// `count` zeros, for `what`. The system gives each page when it is written, to the thread that writes it.
///
/// # Errors
/// [`Error::NoMemory`] if there is not enough memory.
pub fn zeroed<T: Zeroable>(what: impl Display, count: usize) -> Result<Vec<T>> {
    check_array::<T>(&what, count)?;
    trying(|| bytemuck::try_zeroed_vec(count)).map_err(|()| lacking(&what.to_string(), bytes::<T>(count), available()))
}

/// Makes room for `count` values more at the end of `list`, and for no others.
///
/// # Errors
/// [`Error::NoMemory`] if there is not enough memory.
pub fn reserve<T>(what: impl Display, list: &mut Vec<T>, count: usize) -> Result<()> {
    if count <= list.capacity() - list.len() {
        return Ok(());
    }
    let all = list.len().saturating_add(count);
    check_array::<T>(&what, all)?;
    trying(|| list.try_reserve_exact(count)).map_err(|_| lacking(&what.to_string(), bytes::<T>(all), available()))
}

/// A copy of a slice, for `what`.
///
/// # Errors
/// [`Error::NoMemory`] if there is not enough memory.
pub fn copied<T: Clone>(what: impl Display, from: &[T]) -> Result<Vec<T>> {
    let mut list = Vec::new();
    reserve(what, &mut list, from.len())?;
    list.extend_from_slice(from);
    Ok(list)
}

fn bytes<T>(count: usize) -> u64 {
    (count as u64).saturating_mul(size_of::<T>() as u64)
}

/// Takes memory whose lack is dealt with.
fn trying<T>(take: impl FnOnce() -> T) -> T {
    let before = TRIES.replace(true);
    let taken = take();
    TRIES.set(before);
    taken
}

fn lacking(what: &str, needed: u64, available: Option<u64>) -> Error {
    let there = available.map_or(String::new(), |there| format!(", and {} are left", size(there)));
    Error::NoMemory(format!("there is not enough memory for {what}: {} are needed{there}", size(needed)))
}

/// Bytes in units that people read.
fn size(bytes: u64) -> String {
    match bytes {
        b if b >= 1_000_000_000 => format!("{:.1} GB", b as f64 / 1e9),
        b => format!("{} MB", b.div_ceil(1_000_000)),
    }
}

/// Bytes that this process may still take, as far as the system says: what the limit of its address space, that of its
/// control group, and the machine leave.
pub fn available() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let kilobytes = |text: &str, key: &str| -> Option<u64> {
        let line = text.lines().find_map(|line| line.strip_prefix(key))?;
        line.split_whitespace().next()?.parse::<u64>().ok().map(|kb| kb * 1024)
    };
    let machine = read("/proc/meminfo").and_then(|text| kilobytes(&text, "MemAvailable:"));
    let limit = read("/proc/self/limits").and_then(|text| address_space(&text));
    let taken = read("/proc/self/status").and_then(|text| kilobytes(&text, "VmSize:"));
    let space = limit.zip(taken).map(|(limit, taken)| limit.saturating_sub(taken));
    let number = |path: &str| read(path)?.trim().parse::<u64>().ok();
    let group = |most: &str, used: &str| Some(number(most)?.saturating_sub(number(used)?));
    let groups = [
        group("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        group("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ];
    // What a group uses is partly files that the system would let go of: never below half of what the machine has.
    let groups = groups.into_iter().flatten().map(|left| left.max(machine.map_or(0, |m| (m / 2).min(1 << 30))));
    groups.chain(machine).chain(space).min()
}

/// The soft limit of the address space in the text of `/proc/self/limits`; none if there is none.
fn address_space(limits: &str) -> Option<u64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Has the memory of an item that may come next brought near.
#[inline(always)]
pub(crate) fn prefetch<T>(items: &[T], next: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(item) = items.get(next) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        let first = std::ptr::from_ref(item).cast::<i8>();
        for line in (0..size_of::<T>()).step_by(64) {
            #[allow(unsafe_code, reason = "a hint")]
            // SAFETY: it changes nothing, and the place is the item's.
            unsafe {
                _mm_prefetch::<_MM_HINT_T0>(first.add(line));
            }
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, next);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_read() {
        let text = "Max open files            1024                 4096                 files     \n\
            Max address space         4096000000           unlimited            bytes     \n";
        assert_eq!(address_space(text), Some(4_096_000_000));
        assert_eq!(address_space("Max address space         unlimited            unlimited            bytes"), None);
    }

    #[test]
    fn too_much_is_refused() {
        assert_eq!(filled("a list", 7_u8, 3).unwrap(), [7; 3]);
        let message = filled("a picture", [0.0_f32; 4], 1 << 58).unwrap_err().to_string();
        assert!(message.contains("a picture") && message.contains("GB are needed"), "{message}");
        assert_eq!(zeroed::<u64>("a list", 3).unwrap(), [0; 3]);
        assert_eq!(copied("a list", &[1, 2]).unwrap(), [1, 2]);
        assert!(zeroed::<u64>("points", 1 << 58).unwrap_err().to_string().contains("points"));
        let mut list = vec![1_u8];
        reserve("a list", &mut list, 7).unwrap();
        assert!(list.capacity() >= 8 && reserve("a list", &mut list, 1 << 60).is_err() && list == [1]);
        check("a little", 1 << 10).unwrap();
        if available().is_some() {
            assert!(check("a lot", 1 << 60).unwrap_err().to_string().contains("are left"));
        }
        assert!(!tries());
    }
}
