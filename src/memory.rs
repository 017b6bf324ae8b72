//! How much memory may still be had, asked before much of it is taken: an error then, and not the end of the process.

use crate::error::{Error, Result};
use std::cell::Cell;

/// What is left for small things besides the large ones that are asked for.
const RESERVE: u64 = 16 << 20;

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

/// `count` times `value`, for `what`.
///
/// # Errors
/// [`Error::NoMemory`] if there is not enough memory.
pub fn filled<T: Clone>(what: &str, value: T, count: usize) -> Result<Vec<T>> {
    let bytes = (count as u64).saturating_mul(size_of::<T>() as u64);
    // What is small is had, or nothing is; asking costs more.
    if bytes > RESERVE {
        check(what, bytes)?;
    }
    let mut list = Vec::new();
    let before = TRIES.replace(true);
    let taken = list.try_reserve_exact(count);
    TRIES.set(before);
    taken.map_err(|_| lacking(what, bytes, available()))?;
    list.resize(count, value);
    Ok(list)
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
        check("a little", 1 << 10).unwrap();
        if available().is_some() {
            assert!(check("a lot", 1 << 60).unwrap_err().to_string().contains("are left"));
        }
        assert!(!tries());
    }
}
