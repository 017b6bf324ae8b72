//! Memory for the texels of large tables.

use std::ops::{Deref, DerefMut};

type Texel = [f32; 4];

/// Texels, zero at first. To get memory in pages of 4 KiB takes nearly as long as to fill it, so that of many comes in
/// large pages where the system has them.
pub struct Storage(Memory);

enum Memory {
    Heap(Vec<Texel>),
    #[cfg(target_os = "linux")]
    Mapped(memmap2::MmapMut),
}

/// Bytes from which on memory is mapped: several large pages.
#[cfg(target_os = "linux")]
const LARGE: usize = 16 << 20;

impl Storage {
    /// `count` texels.
    pub fn zeroed(count: usize) -> Self {
        #[cfg(target_os = "linux")]
        if let Some(mapped) = mapped(count) {
            return Storage(Memory::Mapped(mapped));
        }
        vec![[0.0; 4]; count].into()
    }
}

#[cfg(target_os = "linux")]
fn mapped(count: usize) -> Option<memmap2::MmapMut> {
    let bytes = count.checked_mul(size_of::<Texel>()).filter(|&b| b >= LARGE)?;
    let mapped = memmap2::MmapMut::map_anon(bytes).ok()?;
    // Where the system has none, small pages do.
    let _ = mapped.advise(memmap2::Advice::HugePage);
    Some(mapped)
}

impl From<Vec<Texel>> for Storage {
    fn from(texels: Vec<Texel>) -> Self {
        Storage(Memory::Heap(texels))
    }
}

impl Deref for Storage {
    type Target = [Texel];

    fn deref(&self) -> &[Texel] {
        match &self.0 {
            Memory::Heap(texels) => texels,
            #[cfg(target_os = "linux")]
            Memory::Mapped(bytes) => bytemuck::cast_slice(bytes),
        }
    }
}

impl DerefMut for Storage {
    fn deref_mut(&mut self) -> &mut [Texel] {
        match &mut self.0 {
            Memory::Heap(texels) => texels,
            #[cfg(target_os = "linux")]
            Memory::Mapped(bytes) => bytemuck::cast_slice_mut(bytes),
        }
    }
}

impl Clone for Storage {
    fn clone(&self) -> Self {
        let mut copy = Self::zeroed(self.len());
        copy.copy_from_slice(self);
        copy
    }
}

impl PartialEq for Storage {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl std::fmt::Debug for Storage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Storage({} texels)", self.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn much_memory_is_as_little_is() {
        for count in [0, 5, (20 << 20) / 16] {
            let mut texels = Storage::zeroed(count);
            assert!(texels.len() == count && texels.iter().all(|t| *t == [0.0; 4]), "{count}");
            texels.iter_mut().enumerate().for_each(|(i, t)| *t = [1.0 + i as f32; 4]);
            let copy = texels.clone();
            assert!(copy == texels && copy == Storage::from(copy.to_vec()), "{count}");
            texels.fill([0.0; 4]);
            assert_eq!(copy == texels, count == 0);
        }
    }
}
