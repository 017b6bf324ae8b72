//! Faces of the same points, found by a hash.

use super::HalfFace;

/// A face, and on which side of it its tetrahedron lies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SidedFace {
    /// Ascending.
    pub(super) points: [u32; 3],
    pub(super) half: HalfFace,
    /// As of [`HalfFace::side`].
    pub(super) side: i8,
}

/// Faces that are grouped by their points.
#[derive(Debug, Default)]
pub(super) struct Groups {
    faces: Vec<SidedFace>,
    /// The same by bins of a hash of their points; each begins where the last ends.
    binned: Vec<SidedFace>,
    ends: Vec<u32>,
}

impl Groups {
    pub(super) fn clear(&mut self) {
        self.faces.clear();
    }

    pub(super) fn push(&mut self, face: SidedFace) {
        self.faces.push(face);
    }

    /// Calls `found` with the faces of the same points, of any points, as they were pushed.
    pub(super) fn for_each(&mut self, mut found: impl FnMut(&[SidedFace])) {
        let bits = self.faces.len().max(2).ilog2();
        let bin = |face: &SidedFace| {
            let [x, y, z] = face.points.map(u64::from);
            ((x ^ y.rotate_left(21) ^ z.rotate_left(42)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - bits)) as usize
        };
        self.ends.clear();
        self.ends.resize(1 << bits, 0);
        self.faces.iter().for_each(|f| self.ends[bin(f)] += 1);
        let mut start = 0;
        for end in &mut self.ends {
            start += std::mem::replace(end, start);
        }
        self.binned.clear();
        self.binned.resize(self.faces.len(), SidedFace::default());
        for face in &self.faces {
            let end = &mut self.ends[bin(face)];
            self.binned[*end as usize] = *face;
            *end += 1;
        }
        let mut start = 0;
        for &end in &self.ends {
            let of_bin = &mut self.binned[start..end as usize];
            start = end as usize;
            match of_bin {
                [] => {}
                [a, b] if a.points == b.points => found(of_bin),
                [_] => found(of_bin),
                _ => {
                    of_bin.sort_by_key(|f| f.points);
                    of_bin.chunk_by(|a, b| a.points == b.points).for_each(&mut found);
                }
            }
        }
    }
}
